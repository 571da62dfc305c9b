"""The hovering rotor against vortices: a lattice on a rigid helix, of which the inflow of a disc knows only a part.

One row of horseshoe vortices on the quarter chord, the flow tangent at three quarters, as on a wing (J. Weissinger,
NACA TM 1120, 1947). The wake is a helix without contraction that descends with the momentum value of the induced
velocity: nothing in it is fitted to a rotor. Imported by validation_isolated.py and by tests/analytic.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from scipy.optimize import brentq

from vrsopt.rotor.airfoil import load_section

CHORD, ROOT, BLADES = 0.191 / 1.143, 0.167, 2  # Caradonna and Tung, over the radius
TIP_MACH, SPEED_OF_SOUND = 0.439, 340.294
# F. X. Caradonna, C. Tung, NASA TM-81232: collective [deg] and thrust coefficient
MEASURED = {5.0: 0.00213, 8.0: 0.00459, 12.0: 0.00796}


def upwash(point: np.ndarray, start: np.ndarray, end: np.ndarray, core: float = 1e-6) -> np.ndarray:
    """Velocity along z at points (P, 3) by each of the straight vortices of strength one (S, 3), (P, S)."""
    a, b = point[:, None] - start, point[:, None] - end
    size_a, size_b = np.linalg.norm(a, axis=-1), np.linalg.norm(b, axis=-1)
    both = size_a * size_b
    smooth = core**2 * np.sum((end - start) ** 2, axis=-1)
    turn = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return turn * (size_a + size_b) / (both * (both + np.sum(a * b, axis=-1)) + smooth) / (4 * pi)


def turned(point: np.ndarray, angle: np.ndarray | float) -> np.ndarray:
    """Points (..., 3) turned about z."""
    (x, y, z), c, s = np.moveaxis(point, -1, 0), np.cos(angle), np.sin(angle)
    return np.stack([c * x - s * y, s * x + c * y, z], axis=-1)


def points(x: np.ndarray, y: float, z: float) -> np.ndarray:
    return np.stack([x, np.full_like(x, y), np.full_like(x, z)], axis=-1)


@dataclass(frozen=True)
class Lattice:
    """Untwisted blades; lengths over the radius, velocities over the tip speed."""

    pitch: float  # rad
    chord: float
    panels: int = 20
    turns: int = 15

    def influence(self, inflow: float) -> np.ndarray:
        """Upwash at three quarters of the chord by the horseshoes, without the part of a section's own vortex."""
        edge, middle = self.stations()
        c, s = self.chord * np.cos(self.pitch), self.chord * np.sin(self.pitch)
        control, quarter, back = points(middle, -c / 2, -s / 2), points(edge, 0, 0), points(edge, -0.75 * c, -0.75 * s)
        age = np.radians(np.r_[0:360:5, 360 : 360 * self.turns + 1 : 10])
        trail = np.zeros((self.panels, self.panels + 1))
        bound = np.zeros((self.panels, self.panels))
        for blade in range(BLADES):
            angle = 2 * pi * blade / BLADES
            q, t = turned(quarter, angle), turned(back, angle)
            trail += upwash(control, q, t)
            bound += upwash(control, q[:-1], q[1:])
            for j in range(self.panels + 1):
                wake = turned(back[j] - np.outer(inflow * age, [0, 0, 1]), angle - age)
                trail[:, j] += upwash(control, wake[:-1], wake[1:], core=0.003).sum(axis=1)
        return trail[:, 1:] - trail[:, :-1] + bound + np.eye(self.panels) / (pi * self.chord)

    def stations(self) -> tuple[np.ndarray, np.ndarray]:
        edge = ROOT + (1 - ROOT) * np.sin(np.linspace(0, pi / 2, self.panels + 1))
        return edge, (edge[1:] + edge[:-1]) / 2

    def thrust(self) -> float:
        """C_T; the sections have the lift slope of the shipped section."""
        edge, r = self.stations()
        section = load_section("naca_0012")
        half = self.chord / 2 * np.array([float(section.attached_lift(max(m, 0.2))[0]) for m in TIP_MACH * r])

        def lifted(inflow: float) -> float:
            strength = np.linalg.solve(
                np.eye(self.panels) - half[:, None] * self.influence(inflow), half * r * self.pitch
            )
            return float(BLADES / pi * strength @ (r * np.diff(edge)))

        inflow = brentq(lambda v: lifted(v) / (2 * v) - v, 0.01, 0.12, xtol=1e-4)
        return lifted(inflow)
