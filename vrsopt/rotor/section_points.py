"""What a deck shows by itself: the points that a fit sees, and where its search begins."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import polynomial as npoly

from vrsopt.errors import InputError
from vrsopt.rotor.airfoil import LOWEST_MACH
from vrsopt.rotor.c81 import Table

CENTRE, WIDTH = 0.5, 0.3  # polynomials are fitted in (Mach - CENTRE) / WIDTH, which conditions the problem
HIGHEST_MACH = 0.8  # of lift and moment, which have no simple form beyond
FEWEST_ANGLES = 8  # between -10 and 15 deg


@dataclass(frozen=True)
class Points:
    """Points of a table inside the range that is fitted: alpha [rad], Mach number, value, each (N,)."""

    alpha: np.ndarray
    mach: np.ndarray
    value: np.ndarray

    @property
    def state(self) -> np.ndarray:
        """Sine and cosine of the angle of attack and Mach number (3, N)."""
        return np.vstack([np.sin(self.alpha), np.cos(self.alpha), self.mach])


def columns(table: Table, highest_mach: float = HIGHEST_MACH) -> tuple[np.ndarray, np.ndarray]:
    """Mach numbers (m,) between the ends of the fit and their columns (n, m); the last one below where none is."""
    inside = (table.mach >= LOWEST_MACH) & (table.mach <= highest_mach)
    if not inside.any():
        below = np.flatnonzero(table.mach < LOWEST_MACH)
        if not len(below):
            raise InputError(f"deck: Mach numbers = {table.mach.tolist()}: at least one up to {highest_mach}")
        inside = np.arange(len(table.mach)) == below[-1]
    near = np.count_nonzero((table.angle_deg >= -10) & (table.angle_deg <= 15))
    if near < FEWEST_ANGLES:
        raise InputError(f"deck: {near} angles between -10 and 15 deg: at least {FEWEST_ANGLES} for a fit")
    return table.mach[inside], table.value[:, inside]


def points_of(table: Table, angles: tuple[float, float], highest_mach: float, *, between: bool = False) -> Points:
    """``between``: also halfway between the Mach numbers, where a deck is read linearly: drag rises steeply there."""
    grid, values = columns(table, highest_mach)
    if between and len(grid) > 1:
        known, grid = grid, np.union1d(grid, 0.5 * (grid[:-1] + grid[1:]))
        values = np.array([np.interp(grid, known, row) for row in values])
    alpha, mach = np.meshgrid(table.angle_deg, grid, indexing="ij")
    inside = (alpha >= angles[0]) & (alpha <= angles[1])
    return Points(np.radians(alpha[inside]), mach[inside], values[inside])


def lift_start(table: Table) -> dict[str, tuple[float, ...]]:
    """Constants, or lines in the scaled Mach number, that lie near the deck."""
    mach, slopes, zeros, breaks, negative = [], [], [], [], []
    s = np.sin(np.radians(table.angle_deg))
    known, values = columns(table)
    for m, lift in zip(known, values.T, strict=True):
        attached = (table.angle_deg >= -2) & (table.angle_deg <= 4)
        slope, level = np.polyfit(s[attached], lift[attached], 1)
        lost = np.abs(slope * s + level - lift) > 0.25
        mach.append(m)
        slopes.append(slope)
        zeros.append(-level / slope)
        breaks.append(_first(s, lost & (s > 0) & (table.angle_deg <= 25), 0.35))
        negative.append(-_first(-s, lost & (s < 0) & (table.angle_deg >= -25), 0.35))
    return {
        "lift_slope": (float(np.median(slopes)),),
        "zero_lift_sine": (float(np.median(zeros)),),
        "break_sine": _line(mach, breaks),
        "log_break_width": (-3.9,),
        "negative_break_sine": _line(mach, negative),
        "log_negative_break_width": (-3.5,),
        "separated_lift": (1.1,),
        "separated_width": (0.15,),
    }


def drag_start(table: Table) -> dict[str, tuple[float, ...]]:
    """As for the lift; the drag rise is where it has gained 0.02."""
    mach, levels, ramps, negative = [], [], [], []
    s = np.sin(np.radians(table.angle_deg))
    known, values = columns(table)
    for m, drag in zip(known, values.T, strict=True):
        level = drag[np.abs(table.angle_deg) <= 3].min()
        mach.append(m)
        levels.append(level)
        ramps.append(_first(s, (drag > level + 0.02) & (s > -0.02), 0.3))
        negative.append(-_first(-s, (drag > level + 0.02) & (s < 0.02), 0.3))
    return {
        "drag_level": (float(np.median(levels)),),
        "drag_parabola": (0.05,),
        "drag_bucket_sine": (0.5 * (float(np.median(ramps)) + float(np.median(negative))) * 0.1,),
        "ramp_sine": _line(mach, ramps),
        "ramp_slope": (2.0,),
        "log_ramp_width": (-4.2,),
        "negative_ramp_sine": _line(mach, negative),
        "negative_ramp_slope": (1.5,),
        "log_negative_ramp_width": (-4.3,),
    }


def _first(sine: np.ndarray, where: np.ndarray, otherwise: float) -> float:
    return float(sine[where].min()) if where.any() else otherwise


def _line(mach: list[float], values: list[float]) -> tuple[float, ...]:
    if len(mach) < 2:
        return (float(np.mean(values)),)
    return tuple(npoly.polyfit((np.array(mach) - CENTRE) / WIDTH, values, 1))
