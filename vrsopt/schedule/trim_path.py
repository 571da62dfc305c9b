"""Trims along a flight, each from its neighbours: what makes a re-flight on the physics cheap.

A start is interpolated in the flight parameters between the nearest trims solved so far, straight or turning, climbing
or not. From there Broyden's method with the inverse Jacobian of the trim before needs a few residuals. A trim found so
is checked as any other; where it is not found, or lies near a fold, the cascade of :mod:`vrsopt.trimming` has its say.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.linalg import lu_solve

from vrsopt.equilibrium import trim_system
from vrsopt.flight import trim_parameters
from vrsopt.helicopter import Helicopter
from vrsopt.residual import TOLERANCE
from vrsopt.solvers.broyden import broyden
from vrsopt.trimming import ROUGH, SUSPICIOUS, Trim

NEIGHBOURS = 20
REMEMBERED = 400  # trims
REACH = 0.5  # of a scaled unknown: a start further away than that may lead to another trim than the one of least power
NUGGET = 1e-10  # of the interpolation, for trims that are as exact as their residual
# Lengths of the interpolation: changes of the parameters that change a trim about as much
SPREAD = {
    "mass": 500.0,
    "altitude": 1000.0,
    "isa_offset": 10.0,
    "speed": 20.0,
    "climb_angle": 0.1,
    "vertical_speed": 5.0,
    "turn_rate": 0.1,
    "rotor_speed": 5.0,
    "twist": 0.05,
    "ground_proximity": 0.3,
}


class TrimPath:
    """Trims of one aircraft, one after the other; ``evaluations`` counts residuals, ``cascades`` the slow way.

    The slow way starts afresh: of a far neighbour Newton's method may find another trim, of more power.
    """

    def __init__(self, machine: Helicopter) -> None:
        self.machine = machine
        self.system = trim_system(machine.aircraft)
        self._spread = np.array([SPREAD.get(parameter.name, 1.0) for parameter in self.system.parameters])
        self._places = np.empty((0, len(self._spread)))
        self._roots = np.empty((0, len(self.system.unknowns)))
        self._inverse: np.ndarray | None = None
        self.evaluations = self.cascades = 0

    def trim(self, flight: Mapping[str, float]) -> Trim:
        """Trim at ``flight`` (see :func:`vrsopt.flight.trim_parameters`, which may raise :class:`InputError`)."""
        parameters = trim_parameters(self.machine.aircraft, flight)
        place = self.system.vector(parameters)
        trim = self._followed(place) or self._cascade(flight)
        if trim.success:
            self._places = np.vstack([self._places[-REMEMBERED + 1 :], place / self._spread])
            self._roots = np.vstack([self._roots[-REMEMBERED + 1 :], trim.solution.scaled])
        return trim

    def _followed(self, place: np.ndarray) -> Trim | None:
        """The trim found from its neighbours, None where there is none or it is not beyond doubt."""
        if self._inverse is None:
            return None
        values: list[tuple[np.ndarray, np.ndarray]] = []  # residual and outputs

        def residual(z: np.ndarray) -> np.ndarray:
            values.append(self.system.values(z, place))
            return values[-1][0]

        start = self._start(place / self._spread)
        found = broyden(residual, start=start, inverse=self._inverse, tolerance=TOLERANCE, reach=REACH)
        self.evaluations += found.evaluations
        if not found.success:
            return None
        solution = self.system.accepted(place, found.root, values=values[-1], iterations=found.evaluations)
        singular = 1.0 / float(np.linalg.norm(found.inverse, 2))
        if not solution.success or singular < ROUGH * SUSPICIOUS:
            return None
        self._inverse = found.inverse
        return Trim(solution, "guess", smallest_singular_value=singular)

    def _cascade(self, flight: Mapping[str, float]) -> Trim:
        trim = self.machine.trim(flight)
        self.cascades += 1
        known = trim.solution.factorisation
        if trim.success and known is not None:
            self._inverse = lu_solve(known, np.eye(len(trim.solution.scaled)))
        return trim

    def _start(self, place: np.ndarray) -> np.ndarray:
        """Kriging of the nearest trims (constant trend, Gaussian correlation over SPREAD) at ``place``, in units of
        SPREAD."""
        away = self._places - place
        distance = np.sum(away**2, axis=1)
        near = np.argsort(distance, kind="stable")[:NEIGHBOURS]
        if distance[near[0]] == 0.0:
            return self._roots[near[0]]
        count = len(near)
        between = np.sum((away[near, None] - away[None, near]) ** 2, axis=2)
        matrix = np.ones((count + 1, count + 1))
        matrix[:count, :count] = np.exp(-0.5 * between) + NUGGET * np.eye(count)
        matrix[count, count] = 0.0
        weights = np.linalg.solve(matrix, np.append(np.exp(-0.5 * distance[near]), 1.0))
        return weights[:count] @ self._roots[near]
