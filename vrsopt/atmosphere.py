"""International standard atmosphere (ICAO Doc 7488), troposphere, with a temperature offset.

Altitude is pressure altitude: the offset changes temperature and density, not pressure.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

GRAVITY = 9.80665  # m/s2, standard
GAS_CONSTANT = 287.05287  # J/(kg K), dry air, ICAO
SEA_LEVEL_TEMPERATURE = 288.15  # K
SEA_LEVEL_PRESSURE = 101325.0  # Pa
LAPSE_RATE = 0.0065  # K/m
HEAT_CAPACITY_RATIO = 1.4


@dataclass(frozen=True)
class Air:
    """State of still air; floats, arrays or CasADi expressions."""

    temperature: Any  # K
    pressure: Any  # Pa
    density: Any  # kg/m3
    speed_of_sound: Any  # m/s


def standard_air(altitude: Any, isa_offset: Any = 0.0) -> Air:
    """Air at a pressure altitude [m] below 11 km, on a day ``isa_offset`` [K] warmer than standard.

    Works on floats, arrays and CasADi expressions alike.
    """
    standard_temperature = SEA_LEVEL_TEMPERATURE - LAPSE_RATE * altitude
    exponent = GRAVITY / (GAS_CONSTANT * LAPSE_RATE)
    pressure = SEA_LEVEL_PRESSURE * (standard_temperature / SEA_LEVEL_TEMPERATURE) ** exponent
    temperature = standard_temperature + isa_offset
    density = pressure / (GAS_CONSTANT * temperature)
    speed_of_sound = (HEAT_CAPACITY_RATIO * GAS_CONSTANT * temperature) ** 0.5
    return Air(temperature, pressure, density, speed_of_sound)


def density_altitude(altitude: Any, isa_offset: Any) -> Any:
    """Altitude [m] of the standard day with the density found at a pressure altitude on a day with that ISA offset."""
    ratio = standard_air(altitude, isa_offset).density / standard_air(0.0).density
    exponent = GRAVITY / (GAS_CONSTANT * LAPSE_RATE) - 1
    return SEA_LEVEL_TEMPERATURE / LAPSE_RATE * (1 - ratio ** (1 / exponent))
