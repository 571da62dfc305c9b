"""Natural frequencies of the pitched, twisted blade in vacuum, and where they meet multiples of the rotor speed."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eig
from scipy.optimize import linear_sum_assignment

from vrsopt.aircraft import MainRotor
from vrsopt.rotor.blade_equations import BladeEquations, Frame, RootPitch
from vrsopt.rotor.fidelity import Fidelity


@dataclass(frozen=True)
class Crossing:
    """A mode's frequency equals ``order`` times the rotor speed [rad/s]."""

    mode: str
    order: int
    rotor_speed: float


def coupled_frequencies(
    rotor: MainRotor, fidelity: Fidelity, rotor_speed: ArrayLike, collective: float, twist: float | None = None
) -> np.ndarray:
    """Frequencies (..., n) in rad/s of small motions about the blade straight along its precone, without aerodynamics.

    rotor_speed: (...) rad/s; collective: pitch at 3/4 radius [rad]; twist: washout [rad], as built where None. In the
    order of ``BladeEquations.names``: every coupled mode is given the uncoupled one that carries most of its kinetic
    energy, none twice. The third flap mode needs more modes than the trim does (6 flap and 5 lag for 0.2 %): pitch
    couples it with lagwise bending that two lag modes can not follow.
    """
    equations = BladeEquations(rotor, fidelity)
    speed = ca.SX.sym("speed")
    arguments = [ca.SX.sym(name, equations.size) for name in ("q", "rate", "acceleration")]
    imbalance = equations.imbalance(
        *arguments,
        pitch=RootPitch(collective, 0.0, 0.0),
        twist=rotor.twist if twist is None else twist,
        frame=Frame(speed),
    )
    matrices = ca.Function("matrices", [*arguments, speed], [ca.jacobian(imbalance, x) for x in arguments])
    speeds = np.asarray(rotor_speed, dtype=float)
    found = [_frequencies(*(np.array(m) for m in matrices(0, 0, 0, value))) for value in speeds.ravel()]
    return np.array(found).reshape(*speeds.shape, equations.size)


def _frequencies(stiffness: np.ndarray, damping: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Frequencies of M q'' + C q' + K q = 0, each in the place of the coordinate that it mostly moves."""
    size = len(mass)
    system = np.block(
        [[np.zeros((size, size)), np.eye(size)], [-np.linalg.solve(mass, np.hstack([stiffness, damping]))]]
    )
    values, vectors = eig(system)
    upper = np.argsort(values.imag)[size:]  # of each conjugate pair the one that turns forwards
    energy = np.diag(mass)[:, None] * np.abs(vectors[:size, upper]) ** 2
    coordinate, found = linear_sum_assignment(energy / energy.sum(axis=0), maximize=True)
    frequencies = np.empty(size)
    frequencies[coordinate] = values[upper].imag[found]
    return frequencies


def crossings(names: tuple[str, ...], rotor_speed: np.ndarray, frequencies: np.ndarray) -> list[Crossing]:
    """Where the modes ``names``, frequencies (n_speeds, n_modes), cross whole multiples of the rotor speed (n_speeds,).

    Linear between the given speeds, which must increase; both in rad/s. Sorted by rotor speed.
    """
    found = []
    for name, ratio in zip(names, (frequencies / rotor_speed[:, None]).T, strict=True):
        for order in range(int(np.ceil(ratio.min())), int(np.floor(ratio.max())) + 1):
            excess = ratio - order
            for k in np.flatnonzero((excess[:-1] < 0) != (excess[1:] < 0)):
                part = excess[k] / (excess[k] - excess[k + 1])
                found.append(
                    Crossing(name, order, float(rotor_speed[k] + part * (rotor_speed[k + 1] - rotor_speed[k])))
                )
    return sorted(found, key=lambda crossing: crossing.rotor_speed)
