"""Natural frequencies of the pitched, twisted blade in vacuum, and where they meet multiples of the rotor speed."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
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
    rotor: MainRotor, fidelity: Fidelity, rotor_speed: float, collective: float, twist: float | None = None
) -> np.ndarray:
    """Frequencies (n,) in rad/s of small motions of the blade straight along its precone, without aerodynamics.

    collective: pitch at 3/4 radius [rad]; twist: washout [rad], as built where None. In the order of
    ``BladeEquations.names``: every coupled mode is given the uncoupled one that carries most of its kinetic energy,
    no one twice.
    """
    equations = BladeEquations(rotor, fidelity)
    q, rate, acceleration = (ca.SX.sym(name, equations.size) for name in ("q", "rate", "acceleration"))
    imbalance = equations.imbalance(
        q,
        rate,
        acceleration,
        pitch=RootPitch(collective, 0.0, 0.0),
        twist=rotor.twist if twist is None else twist,
        frame=Frame(rotor_speed),
    )
    arguments = (q, rate, acceleration)
    matrices = ca.Function("matrices", [*arguments], [ca.jacobian(imbalance, x) for x in arguments])
    stiffness, damping, mass = (np.array(m) for m in matrices(0, 0, 0))
    size = equations.size
    system = np.block(
        [[np.zeros((size, size)), np.eye(size)], [-np.linalg.solve(mass, np.hstack([stiffness, damping]))]]
    )
    values, vectors = eig(system)
    upper = np.argsort(values.imag)[size:]  # of each conjugate pair the one that turns forwards
    energy = np.diag(mass)[:, None] * np.abs(vectors[:size, upper]) ** 2
    mode, found = linear_sum_assignment(energy / energy.sum(axis=0), maximize=True)
    frequencies = np.empty(size)
    frequencies[mode] = values[upper].imag[found]
    return frequencies


def crossings(names: tuple[str, ...], rotor_speed: np.ndarray, frequencies: np.ndarray) -> list[Crossing]:
    """Where frequencies (n_speeds, n_modes) of the modes ``names`` cross whole multiples of the rotor speed (n_speeds,).

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
