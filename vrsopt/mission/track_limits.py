"""Where a flown profile leaves what the model of the aircraft covers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vrsopt.atmosphere import standard_air
from vrsopt.mission.conditions import FASTEST_SINKING
from vrsopt.mission.profile import Profile

Array = NDArray[Any]
STEP = 1.0  # s
TOLERANCE = 1e-6  # of the width of a range
SINKING = "descent rate at little airspeed (or as hard a slowing down)"
LISTED = 3  # stretches in a message


@dataclass(frozen=True)
class FlightBox:
    """What the model covers. A climb is too steep where it is steeper than both the angle and the climb rate."""

    speed: tuple[float, float] = (0.0, 70.0)  # m/s, through the air
    altitude: tuple[float, float] = (0.0, 2000.0)  # m, pressure altitude
    equivalent_climb_angle: tuple[float, float] = (-np.radians(20.0), np.radians(20.0))  # rad
    equivalent_climb_rate: tuple[float, float] = (-5.0, 5.0)  # m/s, of the same steady climb
    mass: tuple[float, float] = (1400.0, 2500.0)  # kg, times the load factor
    # m/s over the velocity induced in the hover: sinking faster, at less airspeed than that, nears the vortex ring
    sinking: float = FASTEST_SINKING
    disc_loading: float = 252.5  # N/m2, with which that velocity is found


BOX = FlightBox()


@dataclass(frozen=True)
class Stretch:
    """A time [s] over which one quantity is out of its range; values in the units of the message."""

    quantity: str
    start: float
    end: float
    worst: float
    low: float
    high: float
    unit: str

    def __str__(self) -> str:
        return (
            f"{self.start:.0f} to {self.end:.0f} s: {self.quantity} up to {self.worst:.4g} {self.unit}, "
            f"allowed {self.low:.4g} to {self.high:.4g}"
        )


def unflyable(profile: Profile, *, mass: ArrayLike | None = None, box: FlightBox = BOX) -> list[Stretch]:
    """The stretches of a profile that leave the box, in the order of time.

    ``mass`` [kg]: a number, or one for each node of ``profile.grid(1.0)``; without it the load is not looked at.
    """
    grid = profile.grid(STEP)
    flying = ~np.asarray(grid.idle)
    angle = np.where(flying, grid.equivalent_climb_angle, 0.0)
    rate = grid.speed * np.sin(angle)
    gentle = (rate >= box.equivalent_climb_rate[0]) & (rate <= box.equivalent_climb_rate[1])
    degrees = tuple(float(np.degrees(edge)) for edge in box.equivalent_climb_angle)
    checks: list[tuple[str, Array, tuple[float, ...], str]] = [
        ("airspeed", grid.speed, box.speed, "m/s"),
        ("altitude", grid.altitude, box.altitude, "m"),
        ("equivalent climb angle", np.where(gentle, 0.0, np.degrees(angle)), degrees, "deg"),
    ]
    induced = np.sqrt(box.disc_loading / (2.0 * standard_air(grid.altitude, profile.isa_offset).density))
    fastest = box.sinking * float(np.min(induced))
    usage = -rate / (box.sinking * induced)
    slow = grid.speed * np.cos(angle) < induced
    checks.append((SINKING, np.where(flying & slow, np.maximum(usage, 0.0) * fastest, 0.0), (0.0, fastest), "m/s"))
    if mass is not None:
        carried = np.where(flying, np.asarray(mass) * grid.load_factor, box.mass[0])
        checks.append(("mass times load factor", carried, box.mass, "kg"))
    found = [stretch for check in checks for stretch in _outside(grid.time, *check)]
    return sorted(found, key=lambda stretch: stretch.start)


def _outside(time: Array, quantity: str, value: Array, allowed: tuple[float, ...], unit: str) -> list[Stretch]:
    low, high = allowed
    margin = TOLERANCE * (high - low)
    excess = np.maximum(low - value, value - high)
    wrong = ~(excess <= margin)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], wrong, [False]]).astype(int))).reshape(-1, 2)
    stretches = []
    for first, after in edges:
        worst = value[first + int(np.argmax(excess[first:after]))]
        stretches.append(Stretch(quantity, float(time[first]), float(time[after - 1]), float(worst), low, high, unit))
    return stretches


def listed(stretches: Sequence[Stretch]) -> str:
    """The first stretches in one line, and how many there are."""
    more = f"; {len(stretches) - LISTED} more" if len(stretches) > LISTED else ""
    return "; ".join(str(stretch) for stretch in stretches[:LISTED]) + more
