"""Rotating blade: uncoupled flap, lag and torsion modes from finite elements, with the rotor speed left symbolic.

Cubic Hermite elements give mass, elastic and centrifugal stiffness matrices once. The modes at the nominal rotor speed
are kept as a fixed Ritz basis, so that at any speed the modal stiffness is K = K_elastic + Omega^2 K_centrifugal: a
polynomial in Omega, with exact derivatives and no eigenproblem inside the trim.

Energies per length, ' = d/dr, T the integral of m r from r to the tip (W. Johnson, Rotorcraft Aeromechanics, 2013):

    flap     kinetic m w_t^2 / 2,  elastic EI_flap w''^2 / 2,  centrifugal Omega^2 T w'^2 / 2
    lag      kinetic m v_t^2 / 2,  elastic EI_lag v''^2 / 2,   centrifugal Omega^2 (T v'^2 - m v^2) / 2
    torsion  kinetic I p_t^2 / 2,  elastic GJ p'^2 / 2,        centrifugal Omega^2 I p^2 / 2 (propeller moment)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.linalg import block_diag, eigh

from vrsopt.aircraft import Blade

Family = Literal["flap", "lag", "torsion"]
ELEMENTS, ROOT_ELEMENTS = 50, 120  # per blade length; curvature falls off steeply from the root
GAUSS_POINTS = 5


@dataclass(frozen=True)
class Modes:
    """Ritz basis of one family of motions, normalised to one (metre or radian) at the tip; n modes.

    mass, elastic, centrifugal: modal matrices (n, n); flap and lag: kg, N/m and kg; torsion: kg m2, N m and kg m2
    (times Omega^2 gives a stiffness).
    """

    nodes: np.ndarray  # (n_nodes,) radius, m
    shapes: np.ndarray  # (2 n_nodes, n): value and slope at the nodes
    mass: np.ndarray
    elastic: np.ndarray
    centrifugal: np.ndarray

    @property
    def count(self) -> int:
        """Number of modes n."""
        return self.shapes.shape[1]

    def at(self, radius: np.ndarray, order: int = 0) -> np.ndarray:
        """Derivative of that order of the modes at radii (E,): (E, n), 1/m^order; zero inboard of the root."""
        return hermite(self.nodes, radius, order) @ self.shapes

    def frequencies(self, rotor_speed: float) -> np.ndarray:
        """Natural frequencies (n,) of the Ritz system in vacuum at a rotor speed, both in rad/s."""
        stiffness = self.elastic + rotor_speed**2 * self.centrifugal
        return np.sqrt(eigh(stiffness, self.mass, eigvals_only=True))


class Beam:
    """Finite elements of a blade: the matrices of each family and integrals along the radius."""

    def __init__(self, blade: Blade) -> None:
        self.blade = blade
        self.nodes = _nodes(np.array(blade.station))
        points, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
        length = np.diff(self.nodes)
        self.radius = (self.nodes[:-1, None] + length[:, None] * (1 + points) / 2).ravel()  # (n_p,) of quadrature
        self.weight = (length[:, None] * weights / 2).ravel()  # (n_p,), m
        self.mass_per_length = np.interp(self.radius, blade.station, blade.mass_per_length)

    @cached_property
    def outboard(self) -> np.ndarray:
        """Matrix (n_p, n_p): values at the points to their integrals from each point to the tip.

        Exact for what is a polynomial of the fourth degree in each element.
        """
        points = (1 + np.polynomial.legendre.leggauss(GAUSS_POINTS)[0]) / 2
        power = np.arange(GAUSS_POINTS)
        integrals = (1 - points[:, None] ** (power + 1)) / (power + 1)
        inside = integrals @ np.linalg.inv(points[:, None] ** power)
        element = np.repeat(np.arange(len(self.nodes) - 1), GAUSS_POINTS)
        beyond = (element[None, :] > element[:, None]) * self.weight
        return np.asarray(block_diag(*[inside * length for length in np.diff(self.nodes)]) + beyond)

    @cached_property
    def tension(self) -> np.ndarray:
        """Centrifugal tension over Omega^2 at the points (n_p,), kg m."""
        return np.asarray(self.outboard @ (self.mass_per_length * self.radius))

    def matrices(self, family: Family) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Mass, elastic and centrifugal matrices on the value and slope at each node, ends free."""
        blade = self.blade
        if family == "torsion":
            mass = self._integral(0, np.interp(self.radius, blade.station, blade.polar_inertia))
            return mass, self._integral(1, np.interp(self.radius, blade.station, blade.torsional_stiffness)), mass
        mass, tension = self._integral(0, self.mass_per_length), self._integral(1, self.tension)
        if family == "flap":
            return mass, self._integral(2, np.interp(self.radius, blade.station, blade.bending_stiffness_flap)), tension
        elastic = self._integral(2, np.interp(self.radius, blade.station, blade.bending_stiffness_lag))
        return mass, elastic, tension - mass

    def modes(self, family: Family, *, rotor_speed: float, count: int) -> Modes:
        """The ``count`` lowest modes at ``rotor_speed`` [rad/s] as Ritz basis; the root is clamped."""
        matrices = self.matrices(family)
        root = 1 if family == "torsion" else 2  # fixed there: the angle; the deflection and its slope
        mass, elastic, centrifugal = (matrix[root:, root:] for matrix in matrices)
        shapes = np.zeros((len(self.nodes) * 2, count))
        if count:
            stiffness = elastic + rotor_speed**2 * centrifugal
            vectors = eigh(stiffness, mass, subset_by_index=(0, count - 1))[1]
            shapes[root:] = vectors / vectors[-2]
        return Modes(self.nodes, shapes, *(shapes.T @ matrix @ shapes for matrix in matrices))

    def _integral(self, order: int, density: np.ndarray) -> np.ndarray:
        basis = hermite(self.nodes, self.radius, order)
        return np.asarray(basis.T @ ((density * self.weight)[:, None] * basis))


def _nodes(station: np.ndarray) -> np.ndarray:
    """Radii of elements equal in each segment, finer near the root, with a node at every station: none spans a kink."""
    span = station[-1] - station[0]
    density = np.where(station[:-1] < station[0] + 0.2 * span, ROOT_ELEMENTS, ELEMENTS)
    counts = np.maximum(2, np.round(density * np.diff(station) / span)).astype(int)
    pieces = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(station[:-1], station[1:], counts, strict=True)]
    return np.concatenate([*pieces, station[-1:]])


def hermite(nodes: np.ndarray, radius: np.ndarray, order: int) -> np.ndarray:
    """Cubic Hermite basis, or its derivative of that order, at radii (E,): (E, 2 n_nodes); zero inboard of the root.

    ``radius`` (E,) and ``nodes`` [m].
    """
    element = np.clip(np.searchsorted(nodes, radius, side="right") - 1, 0, len(nodes) - 2)
    length = np.diff(nodes)[element]
    x = (radius - nodes[element]) / length
    values = {
        0: (1 - 3 * x**2 + 2 * x**3, x - 2 * x**2 + x**3, 3 * x**2 - 2 * x**3, x**3 - x**2),
        1: (6 * x**2 - 6 * x, 1 - 4 * x + 3 * x**2, 6 * x - 6 * x**2, 3 * x**2 - 2 * x),
        2: (12 * x - 6, 6 * x - 4, 6 - 12 * x, 6 * x - 2),
    }[order]
    basis = np.zeros((len(radius), 2 * len(nodes)))
    rows = np.arange(len(radius))
    for k, value in enumerate(values):
        slope = k % 2
        basis[rows, 2 * element + k] = np.where(radius >= nodes[0], value * length ** (slope - order), 0.0)
    return basis
