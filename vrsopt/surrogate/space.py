"""The spaces of the designs of experiments: which inputs, in which box."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

NOMINAL_ROTOR_SPEED = 44.4  # rad/s


@dataclass(frozen=True)
class Space:
    """A box of named inputs, SI units."""

    name: str
    names: tuple[str, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]


# The box of the study, its rotor speed from 70 instead of 75 %: a hot day is flown as the standard day of the same tip
# Mach number, on which 75 % are some 72 %.
LEVEL = Space(
    "level",
    ("mass", "altitude", "speed", "rotor_speed", "twist"),
    (1400.0, 0.0, 0.0, 0.70 * NOMINAL_ROTOR_SPEED, radians(6.0)),
    (2500.0, 2000.0, 70.0, 1.15 * NOMINAL_ROTOR_SPEED, radians(16.0)),
)  # kg, m, m/s, rad/s, rad: level, straight flight
FLIGHT = Space(
    "flight",
    (*LEVEL.names, "climb_angle", "load_factor"),
    (*LEVEL.lower, radians(-8.0), 1.0),
    (*LEVEL.upper, radians(8.0), 1.3),
)  # rad; the load factor is that of a steady, coordinated turn
SPACES = {space.name: space for space in (LEVEL, FLIGHT)}
