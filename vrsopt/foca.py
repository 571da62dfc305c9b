"""Emissions of turboshaft helicopters by the guidance of the Swiss Federal Office of Civil Aviation.

Rindlisbacher & Chabbey, Guidance on the Determination of Helicopter Emissions, FOCA, edition 2 (2015), sections 2.4 and
3.2, tables 2 to 4: correlations over shaft horsepower, and times and powers of a landing and take-off cycle. They are
averages over a fleet of engines and know nothing of a particular one: FOCA itself states that an individual engine may
differ by a factor of 2 or more, and that the method is not fit to compare helicopters of similar size. They are
therefore an independent estimate beside the model of this package, not a measurement of the engine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from vrsopt.errors import InputError

HORSEPOWER = 745.7  # W
CO2_INDEX = 3.16  # kg per kg of Jet A
NOTE = "fleet average of FOCA (2015): an individual engine may differ by a factor of 2"
HEAVIEST_LIGHT_TWIN = 3400.0  # kg, take-off mass

# Up to which rating [shp], and the coefficients of the fuel flow [kg/s] over shaft horsepower, constant first.
FUEL_CLASSES = (
    (600.0, (0.004583, 2.414e-4, -1.2138e-6, 3.4208e-9, -4.4441e-12, 2.197e-15)),
    (1000.0, (0.0062945, 1.8168e-4, -5.9528e-7, 1.1627e-9, -1.0175e-12, 3.3158e-16)),
    (float("inf"), (0.01256, 1.1476e-4, -1.2156e-7, 9.2087e-11, -3.16298e-14, 4.0539e-18)),
)
MINUTES = {"ground idle": 5.0, "take-off": 3.0, "approach": 5.5}  # in one landing and take-off cycle
# Power in these modes and the mean of operation, over the rating.
POWERS = {
    "single": (0.13, 0.87, 0.46, 0.80),
    "light twin": (0.07, 0.78, 0.38, 0.65),
    "heavy twin": (0.06, 0.66, 0.32, 0.62),
}


def fuel_flow(power: Any, *, rating: float = 0.0) -> Any:
    """Fuel flow of one engine [kg/s] at shaft power [W]; numbers, arrays and CasADi expressions, as all functions here.

    ``rating``: the engine's largest power [W], which chooses the class; default the smallest, up to 600 shp.
    """
    S = power / HORSEPOWER
    coefficients = next(row for limit, row in FUEL_CLASSES if rating / HORSEPOWER <= limit)
    result = 0.0 * S
    for coefficient in reversed(coefficients):
        result = result * S + coefficient
    return result


def nox_index(power: Any) -> Any:
    """NOx as NO2 [kg per kg of fuel] at shaft power of one engine [W] > 0."""
    return 1e-3 * 0.2113 * (power / HORSEPOWER) ** 0.5677


def co_index(power: Any) -> Any:
    """CO [kg per kg of fuel] at shaft power of one engine [W] > 0; grows without limit towards no power."""
    return 1e-3 * 5660.0 * (power / HORSEPOWER) ** -1.11


def hc_index(power: Any) -> Any:
    """Unburnt hydrocarbons [kg per kg of fuel] at shaft power of one engine [W] > 0."""
    return 1e-3 * 3819.0 * (power / HORSEPOWER) ** -1.0801


def soot_index(power: Any) -> Any:
    """Non-volatile particulate matter [kg per kg of fuel] at shaft power of one engine [W]."""
    S = power / HORSEPOWER
    return 1e-3 * (-4.8e-8 * S**2 + 2.3664e-4 * S + 0.1056)


@dataclass(frozen=True)
class Mode:
    """Time in one mode [s], power of one engine in it [W], and what all engines burn and emit meanwhile [kg]."""

    name: str
    duration: float
    power: float
    fuel: float
    nox: float
    hc: float
    co: float
    soot: float
    co2: float


@dataclass(frozen=True)
class Estimate:
    """Fuel and emissions mode by mode, and together as :attr:`total`; prints as a table."""

    modes: tuple[Mode, ...]

    @property
    def total(self) -> Mode:
        """Sums over the modes; the power is the mean over the time [W]."""
        duration = sum(mode.duration for mode in self.modes)
        power = sum(mode.power * mode.duration for mode in self.modes) / duration
        sums = {name: sum(getattr(mode, name) for mode in self.modes) for name in MASSES}
        return Mode("total", duration, power, **sums)

    def __str__(self) -> str:
        head = f"{'mode':<12}{'min':>7}{'kW each':>9}" + "".join(f"{name + ' kg':>10}" for name in MASSES)
        rows = (
            f"{mode.name:<12}{mode.duration / 60:7.1f}{mode.power / 1e3:9.1f}"
            + "".join(f"{getattr(mode, name):10.4f}" for name in MASSES)
            for mode in (*self.modes, self.total)
        )
        return "\n".join((head, *rows, f"({NOTE})"))


MASSES = ("fuel", "nox", "hc", "co", "soot", "co2")


def landing_take_off(rating: float, engines: int = 2, *, takeoff_mass: float = 0.0) -> Estimate:
    """One landing and take-off cycle: idle on the ground, take-off and climb, approach.

    ``rating``: take-off power of one engine [W]; ``takeoff_mass``: the largest [kg], which tells a heavy twin (above
    3400 kg) from a light one. Tables of particular engines that follow the first edition split the idle of a light twin
    into 4 min at 7 % before and 1 min at 5 % after the flight; edition 2 has 7 % for both. Raises :class:`InputError`
    for a rating that is not a positive number or no engine.
    """
    if not 0.0 < rating < math.inf or engines < 1:
        raise InputError(f"foca: rating = {rating:g} W, engines = {engines}: a positive rating, at least one engine")
    powers = POWERS[_category(engines, takeoff_mass)]
    return Estimate(
        tuple(
            _mode(name, 60.0 * minutes, ratio * rating, rating, engines)
            for (name, minutes), ratio in zip(MINUTES.items(), powers[:3], strict=True)
        )
    )


def mission(
    duration: float, rating: float, engines: int = 2, *, takeoff_mass: float = 0.0, landings: int = 1
) -> Estimate:
    """A mission of ``duration`` [s]: a cycle for each landing, and the mean power for the time that is left.

    Other arguments as :func:`landing_take_off`. A mission shorter than its cycles has no time at mean power: it is then
    the cycles alone. ``rating``: take-off power of one engine [W]; ``engines``: how many. Raises :class:`InputError` as
    :func:`landing_take_off`, and for a negative duration or number of landings.
    """
    if not (math.isfinite(duration) and duration >= 0.0 and landings >= 0):
        raise InputError(f"foca: duration = {duration:g} s, landings = {landings}: both zero or more")
    cycle = landing_take_off(rating, engines, takeoff_mass=takeoff_mass)
    mean = POWERS[_category(engines, takeoff_mass)][3] * rating
    modes = [_mode(mode.name, landings * mode.duration, mode.power, rating, engines) for mode in cycle.modes]
    left = max(0.0, duration - landings * cycle.total.duration)
    return Estimate((*modes, _mode("mean power", left, mean, rating, engines)))


def _category(engines: int, takeoff_mass: float) -> str:
    if engines == 1:
        return "single"
    return "light twin" if takeoff_mass <= HEAVIEST_LIGHT_TWIN else "heavy twin"


def _mode(name: str, duration: float, power: float, rating: float, engines: int) -> Mode:
    fuel = engines * duration * fuel_flow(power, rating=rating)
    indices = (nox_index(power), hc_index(power), co_index(power), soot_index(power), CO2_INDEX)
    return Mode(name, duration, power, fuel, *(fuel * index for index in indices))
