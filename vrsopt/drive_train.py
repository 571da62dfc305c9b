"""Power of the engines from the power of the rotors: gearboxes, accessories, and the engines' idle as the least.

Below idle nothing is saved: a steep descent, or a rotor that spins down, is credited down to idle power and no further.
Engines that operate share the power equally; one that does not burns nothing and drives nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vrsopt.aircraft import Aircraft
from vrsopt.atmosphere import standard_air
from vrsopt.errors import InputError
from vrsopt.turboshaft.data import EngineData

ROUNDING = 200.0  # W, over which the change to idle power is rounded


def idle_power(engine: EngineData) -> float:
    """Idle power of one engine [W]."""
    return engine.ratings.idle_power_ratio * engine.ratings.take_off_power


def operating_engines(aircraft: Aircraft, wanted: int | None) -> int:
    """Number of engines that operate: ``wanted``, or all of the aircraft's.

    Raises :class:`InputError` for a number that the aircraft can not fly with.
    """
    engines = aircraft.transmission.engines
    if wanted is None:
        return engines
    if isinstance(wanted, bool) or wanted not in range(1, engines + 1):
        allowed = "1, the only one" if engines == 1 else f"a whole number from 1 to {engines}"
        raise InputError(f"trim: engines_operating = {wanted}: {allowed}")
    return int(wanted)


def engine_power(
    aircraft: Aircraft, engine: EngineData, rotor_power: Any, *, engines_operating: int | None = None
) -> Any:
    """Shaft power of one operating engine [W] for the power at the main-rotor shaft [W], tail rotor included.

    ``engines_operating`` defaults to all. Numbers, arrays and CasADi expressions. ``rotor_power`` [W] is the latter.
    """
    share = aircraft.transmission.engines / operating_engines(aircraft, engines_operating)
    return smooth_max(share * aircraft.transmission.power_per_engine(rotor_power), idle_power(engine), ROUNDING)


def engine_parameters(aircraft: Aircraft, power: Any, flight: Mapping[str, Any]) -> dict[str, Any]:
    """Parameters of the gas path of one engine at shaft power [W] in ``flight`` (altitude, isa_offset, speed,
    rotor_speed): dry air, no bleed, nothing taken from the gas generator. Numbers and CasADi expressions."""
    air = standard_air(flight["altitude"], flight["isa_offset"])
    return {
        "demand": power,
        "power_turbine_speed": flight["rotor_speed"] / aircraft.main_rotor.nominal_rotor_speed,
        "altitude": flight["altitude"],
        "isa_offset": flight["isa_offset"],
        "mach": flight["speed"] / air.speed_of_sound,
        "bleed_fraction": 0.0,
        "power_offtake": 0.0,
        "humidity": 0.0,
    }


def smooth_max(a: Any, b: Any, width: float) -> Any:
    """The larger of two, rounded over about ``width``; at most width / 2 above it.

    ``a`` and ``b`` in the unit of ``width``.
    """
    return 0.5 * (a + b + ((a - b) ** 2 + width**2) ** 0.5)
