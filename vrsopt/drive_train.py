"""Power of the engines from the power of the rotors: gearboxes, accessories, and the engines' idle as the least.

Below idle nothing is saved: a steep descent, or a rotor that spins down, is credited down to idle power and no further.
"""

from __future__ import annotations

from typing import Any

from vrsopt.aircraft import Aircraft
from vrsopt.turboshaft.data import EngineData

ROUNDING = 200.0  # W, over which the change to idle power is rounded


def idle_power(engine: EngineData) -> float:
    """Idle power of one engine [W]."""
    return engine.ratings.idle_power_ratio * engine.ratings.take_off_power


def engine_power(aircraft: Aircraft, engine: EngineData, rotor_power: Any) -> Any:
    """Shaft power of one engine [W] for the power at the main-rotor shaft [W], tail rotor included.

    Numbers, arrays and CasADi expressions.
    """
    return smooth_max(aircraft.transmission.power_per_engine(rotor_power), idle_power(engine), ROUNDING)


def smooth_max(a: Any, b: Any, width: float) -> Any:
    """The larger of two, rounded over about ``width``; at most width / 2 above it."""
    return 0.5 * (a + b + ((a - b) ** 2 + width**2) ** 0.5)
