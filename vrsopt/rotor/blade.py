"""Rotating blade: flap modes from a beam finite-element model, with the rotor speed left symbolic.

Cubic Hermite beam elements give mass, bending and centrifugal stiffness matrices once. The modes at the nominal rotor
speed are kept as a fixed Ritz basis, so that at any speed the modal stiffness is K = K_bending + Omega^2 K_centrifugal:
a polynomial in Omega, with exact derivatives and no eigenproblem inside the trim.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from vrsopt.aircraft import Blade

ELEMENTS = 40
GAUSS_POINTS = 5


@dataclass(frozen=True)
class FlapModes:
    """Flap Ritz basis of a blade, normalised to one metre at the tip; n modes.

    mass, bending, centrifugal: modal matrices (n, n), kg, N/m and kg (times Omega^2 gives N/m).
    precone: integral of m r phi (n,), kg m. weight: integral of m phi (n,), kg.
    """

    nodes: np.ndarray  # (n_nodes,) radius, m
    shapes: np.ndarray  # (2 n_nodes, n): deflection and slope at the nodes
    mass: np.ndarray
    bending: np.ndarray
    centrifugal: np.ndarray
    precone: np.ndarray
    weight: np.ndarray

    def at(self, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Deflection (E, n) and slope [1/m] (E, n) of the modes at radii (E,); zero inboard of the root."""
        n_modes = self.shapes.shape[1]
        deflection, slope = np.zeros((len(radius), n_modes)), np.zeros((len(radius), n_modes))
        for i, r in enumerate(radius):
            if r <= self.nodes[0]:
                continue
            element = min(int(np.searchsorted(self.nodes, r, side="right")) - 1, len(self.nodes) - 2)
            length = self.nodes[element + 1] - self.nodes[element]
            xi = (r - self.nodes[element]) / length
            dofs = self.shapes[2 * element : 2 * element + 4]
            deflection[i] = _hermite(xi, length, order=0) @ dofs
            slope[i] = _hermite(xi, length, order=1) @ dofs
        return deflection, slope

    def frequencies(self, rotor_speed: float) -> np.ndarray:
        """Natural frequencies (n,) of the Ritz system in vacuum at a rotor speed, both in rad/s."""
        stiffness = self.bending + rotor_speed**2 * self.centrifugal
        return np.sqrt(eigh(stiffness, self.mass, eigvals_only=True))


def flap_modes(blade: Blade, *, rotor_speed: float, count: int = 3) -> FlapModes:
    """The ``count`` lowest flap modes at ``rotor_speed`` [rad/s] as Ritz basis. Root clamped at the first station."""
    nodes, mass, bending, centrifugal = finite_elements(blade, blade.bending_stiffness_flap)
    free = slice(2, None)  # deflection and slope at the root are zero
    stiffness = bending + rotor_speed**2 * centrifugal
    vectors = eigh(stiffness[free, free], mass[free, free], subset_by_index=(0, count - 1))[1]
    shapes = np.vstack([np.zeros((2, count)), vectors / vectors[-2]])
    first_moment, zeroth_moment = _moments(blade, nodes)
    return FlapModes(
        nodes=nodes,
        shapes=shapes,
        mass=shapes.T @ mass @ shapes,
        bending=shapes.T @ bending @ shapes,
        centrifugal=shapes.T @ centrifugal @ shapes,
        precone=shapes.T @ first_moment,
        weight=shapes.T @ zeroth_moment,
    )


def finite_elements(
    blade: Blade, bending_stiffness: tuple[float, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Node radii and the mass, bending and centrifugal matrices of a beam bending out of the plane of rotation.

    ``bending_stiffness`` [N m2] is given at the blade's stations, linear between them. For bending in the plane of
    rotation the centrifugal matrix is this one minus the mass matrix.
    """
    nodes = np.linspace(blade.station[0], blade.station[-1], ELEMENTS + 1)
    size = 2 * len(nodes)
    mass, bending, centrifugal = (np.zeros((size, size)) for _ in range(3))
    for element in range(ELEMENTS):
        length = nodes[element + 1] - nodes[element]
        dofs = slice(2 * element, 2 * element + 4)
        for xi, weight in _gauss():
            r = nodes[element] + xi * length
            n0, n1, n2 = (_hermite(xi, length, order=order) for order in range(3))
            dr = weight * length
            mass[dofs, dofs] += np.interp(r, blade.station, blade.mass_per_length) * np.outer(n0, n0) * dr
            bending[dofs, dofs] += np.interp(r, blade.station, bending_stiffness) * np.outer(n2, n2) * dr
            centrifugal[dofs, dofs] += _tension(blade, r) * np.outer(n1, n1) * dr
    return nodes, mass, bending, centrifugal


def _tension(blade: Blade, radius: float) -> float:
    """Centrifugal tension over Omega^2: the integral of m r from ``radius`` to the tip, kg m."""
    breaks = np.unique([radius, *[s for s in blade.station if s > radius]])
    total = 0.0
    for a, b in zip(breaks[:-1], breaks[1:], strict=True):
        for xi, weight in _gauss():
            r = a + xi * (b - a)
            total += weight * (b - a) * r * np.interp(r, blade.station, blade.mass_per_length)
    return total


def _moments(blade: Blade, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Load vectors of the distributed loads m r and m on the element degrees of freedom."""
    first, zeroth = np.zeros(2 * len(nodes)), np.zeros(2 * len(nodes))
    for element in range(ELEMENTS):
        length = nodes[element + 1] - nodes[element]
        dofs = slice(2 * element, 2 * element + 4)
        for xi, weight in _gauss():
            r = nodes[element] + xi * length
            load = np.interp(r, blade.station, blade.mass_per_length) * weight * length
            first[dofs] += load * r * _hermite(xi, length, order=0)
            zeroth[dofs] += load * _hermite(xi, length, order=0)
    return first, zeroth


def _gauss() -> list[tuple[float, float]]:
    points, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    return [((1 + p) / 2, w / 2) for p, w in zip(points.tolist(), weights.tolist(), strict=True)]


def _hermite(xi: float, length: float, *, order: int) -> np.ndarray:
    """Hermite shape functions (4,) of deflection and slope at both ends, or their derivatives by the radius."""
    if order == 0:
        return np.array(
            [
                1 - 3 * xi**2 + 2 * xi**3,
                length * (xi - 2 * xi**2 + xi**3),
                3 * xi**2 - 2 * xi**3,
                length * (xi**3 - xi**2),
            ]
        )
    if order == 1:
        return np.array(
            [
                (6 * xi**2 - 6 * xi) / length,
                1 - 4 * xi + 3 * xi**2,
                (6 * xi - 6 * xi**2) / length,
                3 * xi**2 - 2 * xi,
            ]
        )
    return np.array(
        [(12 * xi - 6) / length**2, (6 * xi - 4) / length, (6 - 12 * xi) / length**2, (6 * xi - 2) / length]
    )
