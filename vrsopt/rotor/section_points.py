"""What a deck shows by itself: the points that a fit sees, and where its search begins."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import polynomial as npoly

from vrsopt.errors import InputError
from vrsopt.rotor.airfoil import LOWEST_MACH
from vrsopt.rotor.c81 import QUANTITIES, Deck, Table

CENTRE, WIDTH = 0.5, 0.3  # polynomials are fitted in (Mach - CENTRE) / WIDTH, which conditions the problem
HIGHEST_MACH = 0.8  # of lift and moment, which have no simple form beyond
HIGHEST_DRAG_MACH = 0.9
FEWEST_ANGLES = 8  # between -10 and 15 deg
ATTACHED = {"lift": (-2.0, 4.0), "drag": (-3.0, 3.0), "moment": (-4.0, 10.0)}  # deg, where a table shows its level
FEWEST_ATTACHED = 3
SMALLEST_SLOPE = 0.1  # of the attached lift, per rad


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


def check(deck: Deck) -> None:
    """Raises :class:`InputError`, one line with deck, table and Mach number, where the tables can not carry a fit."""
    for quantity, table in zip(QUANTITIES, (deck.lift, deck.drag, deck.moment), strict=True):
        where = f"{deck.name or 'deck'}: {quantity}"
        if not (table.mach <= HIGHEST_MACH).any():
            raise InputError(f"{where}: Mach numbers = {table.mach.tolist()}: at least one up to {HIGHEST_MACH}")
        if not np.isfinite(table.value).all():
            raise InputError(f"{where}: a value is not finite: all must be numbers")
        for (low, high), fewest in (((-10, 15), FEWEST_ANGLES), (ATTACHED[quantity], FEWEST_ATTACHED)):
            count = np.count_nonzero(_between(table, low, high))
            if count < fewest:
                raise InputError(
                    f"{where}: {count} angles between {low:g} and {high:g} deg: at least {fewest} for a fit"
                )
    name = deck.name or "deck"
    known, values = columns(deck.lift)
    for mach, lift in zip(known, values.T, strict=True):
        slope = _attached_line(deck.lift, lift)[0]
        if slope < SMALLEST_SLOPE:
            raise InputError(f"{name}: lift: Mach {mach:g}: slope = {slope:.3g} per rad: at least {SMALLEST_SLOPE:g}")
    known, values = columns(deck.drag, HIGHEST_DRAG_MACH)
    for mach, drag in zip(known, values.T, strict=True):
        if drag.min() <= 0:
            raise InputError(f"{name}: drag: Mach {mach:g}: value = {drag.min():g}: must be positive")


def _between(table: Table, low: float, high: float) -> np.ndarray:
    return (table.angle_deg >= low) & (table.angle_deg <= high)


def _attached_line(table: Table, lift: np.ndarray) -> tuple[float, float]:
    """Slope by the sine of the angle, and level, of a column of the table where attached."""
    near = _between(table, *ATTACHED["lift"])
    slope, level = np.polyfit(np.sin(np.radians(table.angle_deg[near])), lift[near], 1)
    return float(slope), float(level)


def columns(table: Table, highest_mach: float = HIGHEST_MACH) -> tuple[np.ndarray, np.ndarray]:
    """Mach numbers (m,) between the ends of the fit and their columns (n, m); the last one below where none is.

    The deck has passed :func:`check`. ``highest_mach``: end of the fit.
    """
    inside = (table.mach >= LOWEST_MACH) & (table.mach <= highest_mach)
    if not inside.any():
        inside = np.arange(len(table.mach)) == np.flatnonzero(table.mach < LOWEST_MACH)[-1]
    return table.mach[inside], table.value[:, inside]


def points_of(table: Table, angles: tuple[float, float], highest_mach: float, *, between: bool = False) -> Points:
    """``between``: also halfway between the Mach numbers, where a deck is read linearly: drag rises steeply there.

    Points of ``table`` at ``angles`` (lowest, highest) [deg] and up to ``highest_mach``.
    """
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
        slope, level = _attached_line(table, lift)
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
        level = drag[_between(table, *ATTACHED["drag"])].min()
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
