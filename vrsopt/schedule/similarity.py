"""A flight on any day as a flight on the standard day, by the similarity of compressible flow.

Forces scale with density times the speed of sound squared, that is with the pressure, if all velocities scale with the
speed of sound: advance ratio, Mach numbers and thrust coefficient are then the same. At one pressure altitude a flight
on a hot day is so the flight of the same aircraft on the standard day with V and Omega R times a'/a, and its power is
that of the standard day times a/a'. What differs is the weight of the blades against that of the air (their Lock
number, by 10 % at 30 K) and their stiffness against their centrifugal force, which do to the power about 0.1 %. A
density altitude, at the same speeds, would have another tip Mach number: 1 to 6 % of the power at 20 K.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vrsopt.atmosphere import standard_air


@dataclass(frozen=True)
class StandardDay:
    """The standard day on which the flights (n,) of another day are flown.

    ``altitude`` [m] and ``density`` [kg/m3] of that day. Speeds and masses there are ``speed`` and ``mass`` times those
    of the flight, the power of the flight is ``power`` times that of the standard day.
    """

    altitude: np.ndarray
    density: np.ndarray
    speed: np.ndarray
    mass: np.ndarray
    power: np.ndarray


def standard_day(altitude: np.ndarray, isa_offset: float, highest: float) -> StandardDay:
    """The standard day for pressure altitudes (n,) [m].

    Below sea level or above ``highest`` [m] it is the end of that range, and the weight scales with the pressure. At
    ISA offset 0 in the range it is the flight itself, exactly.
    """
    chosen = np.clip(altitude, 0.0, highest)
    here, there = standard_air(altitude, isa_offset), standard_air(chosen)
    speed = there.speed_of_sound / here.speed_of_sound
    mass = there.pressure / here.pressure
    return StandardDay(chosen, there.density, speed, mass, 1.0 / (mass * speed))
