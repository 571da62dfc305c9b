"""The optimum of the physics at one point: least fuel over rotor speed and twist, with no surrogate.

The problem that is solved is that of :mod:`vrsopt.point_problem`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from math import radians
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from vrsopt.aircraft import Aircraft
from vrsopt.errors import InputError
from vrsopt.helicopter import allowed_ranges, helicopter
from vrsopt.limits import MARGINS, Limits, Setting
from vrsopt.point_problem import PointOptimum, PointProblem
from vrsopt.quantity import is_number

NOMINAL_BOUNDS = ((0.75, 1.15), (radians(6.0), radians(16.0)))  # of nominal rotor speed; rad

__all__ = ["PointOptimum", "physics_optimum"]


def physics_optimum(
    mass: float,
    speed: float,
    *,
    altitude: float = 0.0,
    climb_angle: float = 0.0,
    load_factor: float = 1.0,
    isa_offset: float = 0.0,
    variables: Literal["both", "speed", "twist"] = "both",
    rotor_speed_bounds: tuple[float, float] | None = None,
    twist_bounds: tuple[float, float] = NOMINAL_BOUNDS[1],
    setting: Setting = "manual",
    manoeuvre_margin: float | None = None,
    aircraft: Aircraft | str | Path = "bo105",
) -> PointOptimum:
    """Rotor speed and twist of least fuel at gross mass [kg], true airspeed [m/s] and pressure altitude [m].

    In steady flight at ``climb_angle`` [rad] with ``load_factor`` of a coordinated turn, on a day ``isa_offset`` [K]
    off standard. ``variables``: which of the two are free, the other is nominal; ``rotor_speed_bounds`` [rad/s] (75 to
    115 % of nominal by default), ``twist_bounds`` [rad]; ``setting`` and ``manoeuvre_margin`` [-] (the aircraft's by
    default) of the limits, see :class:`vrsopt.limits.Limits`; ``aircraft``: shipped, a TOML file, or loaded.

    No surrogate is involved: trim, engine and limits are solved as they are. Raises :class:`InputError` for what is not
    one of these or out of range and :class:`NoSolutionError` where the nominal rotor has no trim or no engine state.
    """
    machine = helicopter(aircraft)
    rotor = machine.aircraft.main_rotor
    nominal = rotor.nominal_rotor_speed
    _check_choice("variables", variables, ("both", "speed", "twist"))
    _check_choice("setting", setting, get_args(Setting))
    ranges = {**allowed_ranges(machine.aircraft), "manoeuvre_margin": MARGINS}
    usual = (NOMINAL_BOUNDS[0][0] * nominal, NOMINAL_BOUNDS[0][1] * nominal)
    speeds = _pair("rotor_speed", usual if rotor_speed_bounds is None else rotor_speed_bounds, ranges)
    twist_bounds = _pair("twist", twist_bounds, ranges)
    if variables == "speed":
        twist_bounds = (rotor.twist, rotor.twist)
    if variables == "twist":
        speeds = (nominal, nominal)
    flight = {
        "mass": mass,
        "altitude": altitude,
        "isa_offset": isa_offset,
        "speed": speed,
        "climb_angle": climb_angle,
        "load_factor": load_factor,
        "rotor_speed": nominal,
        "twist": rotor.twist,
    }
    margin = machine.aircraft.blade_loading_limit.manoeuvre_margin if manoeuvre_margin is None else manoeuvre_margin
    for name, value in (*flight.items(), ("manoeuvre_margin", margin)):
        low, high = ranges[name]
        if not is_number(value) or not low <= value <= high:
            raise InputError(f"optimum of the physics: {name} = {value!r}: a number from {low:g} to {high:g}")
    return _problem(machine.aircraft, setting, margin).solve(flight, bounds=np.array([speeds, twist_bounds]).T)


def _check_choice(name: str, value: Any, allowed: tuple[str, ...]) -> None:
    if not isinstance(value, str) or value not in allowed:
        raise InputError(f"optimum of the physics: {name} = {value!r}: one of {', '.join(allowed)}")


def _pair(name: str, value: Any, ranges: Mapping[str, tuple[float, float]]) -> tuple[float, float]:
    """The bounds of a variable; raises :class:`InputError` unless they are two numbers in order, within its range."""
    low, high = ranges[name]
    known = isinstance(value, Sequence) and len(value) == 2 and all(map(is_number, value))
    if not known or not low <= value[0] <= value[1] <= high:
        allowed = f"lower, upper, numbers in order from {low:g} to {high:g}"
        raise InputError(f"optimum of the physics: {name}_bounds = {value!r}: {allowed}")
    return float(value[0]), float(value[1])


@lru_cache(maxsize=4)
def _problem(aircraft: Aircraft, setting: Setting, margin: float) -> PointProblem:
    machine = helicopter(aircraft)
    return PointProblem(machine, Limits(machine.aircraft, machine.engine, setting, margin))
