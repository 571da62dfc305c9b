"""Many states of a combustor at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from vrsopt.bulk import BulkSolver, ManySolutions, Start
from vrsopt.combustor.data import ReactorData
from vrsopt.combustor.network import combustor
from vrsopt.combustor.start import network_start
from vrsopt.combustor.zones import fuel_stream

CHUNK = 20  # points per compiled call: a network is large
ANCHORS = 60  # points that are solved first, from a start reactor by reactor; the others start from a fit of these


def solve_combustor_many(
    parameters: np.ndarray, reactors: ReactorData, hydrogen_to_carbon: float, heating_value: float
) -> ManySolutions:
    """Solve the combustor at every row of ``parameters`` (N, 5), some milliseconds each.

    Columns in the order of :func:`vrsopt.combustor.network.combustor`, SI units. ``reactors``: data of the network;
    ``hydrogen_to_carbon`` [-] and ``heating_value`` [J/kg] of the fuel. Raises :class:`InputError` for a wrong shape or
    a value that is not finite.
    """
    solver, reactor_by_reactor = _solver(reactors.model_dump_json(), hydrogen_to_carbon, heating_value)
    points = solver.checked(parameters)
    if len(points) < 2 * ANCHORS:
        return solver.solve(points, (reactor_by_reactor,))
    anchors = np.random.default_rng(0).permutation(len(points))[:ANCHORS]
    known = solver.solve(points[anchors], (reactor_by_reactor,))
    if not known.success.any():
        return solver.solve(points, (reactor_by_reactor,))
    near = _Quadratic.through(points[anchors][known.success], known.scaled[known.success])
    return solver.solve(points, (near, reactor_by_reactor))


@lru_cache(maxsize=8)
def _solver(text: str, hydrogen_to_carbon: float, heating_value: float) -> tuple[BulkSolver, Start]:
    reactors = ReactorData.model_validate_json(text)
    system = combustor(reactors, hydrogen_to_carbon, heating_value)
    fuel = fuel_stream(hydrogen_to_carbon, heating_value)
    scale = np.array([unknown.scale for unknown in system.unknowns])
    return BulkSolver(system, chunk=CHUNK), lambda points: network_start(reactors, fuel, points) / scale


@dataclass(frozen=True)
class _Quadratic:
    """Unknowns as quadratic polynomials of the state of the combustor, by least squares through solved points."""

    centre: np.ndarray
    size: np.ndarray
    coefficients: np.ndarray

    @staticmethod
    def through(points: np.ndarray, unknowns: np.ndarray) -> _Quadratic:
        """Polynomials through ``unknowns`` (N, n) at ``points`` (N, 5)."""
        features = _features(points)
        centre, size = features.mean(axis=0), features.std(axis=0) + 1e-9
        matrix = _monomials((features - centre) / size)
        return _Quadratic(centre, size, np.linalg.lstsq(matrix, unknowns, rcond=1e-10)[0])

    def __call__(self, points: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):  # not finite where nothing can burn: the solver finds that out
            return _monomials((_features(points) - self.centre) / self.size) @ self.coefficients


def _features(points: np.ndarray) -> np.ndarray:
    """What the gas in the reactors depends on most smoothly: logarithms, and the fuel-air ratio for the fuel."""
    pressure, temperature, air_flow, fuel_flow, humidity = points.T
    return np.column_stack([np.log(pressure), temperature, np.log(air_flow), np.log(fuel_flow / air_flow), humidity])


def _monomials(x: np.ndarray) -> np.ndarray:
    first, second = np.triu_indices(x.shape[1])
    return np.column_stack([np.ones(len(x)), x, x[:, first] * x[:, second]])
