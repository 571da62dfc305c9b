"""The most and the least power of an engine, and the limits that set them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from vrsopt.errors import InputError
from vrsopt.residual import Solution
from vrsopt.solvers.status import Status
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.cycle import PARAMETERS, Mode, gas_path, sized
from vrsopt.turboshaft.data import TAKE_OFF, EngineData, load_engine

# Where the model is known to solve and its maps still mean something.
ALLOWED = {
    "power": (0.0, math.inf),
    "gas_generator_speed": (0.3, 1.3),
    "inter_turbine_temperature": (500.0, 1600.0),
    "power_turbine_speed": (0.4, 1.4),
    "altitude": (-500.0, 6000.0),
    "isa_offset": (-50.0, 50.0),
    "mach": (0.0, 0.4),
    "humidity": (0.0, 0.05),
    "bleed_fraction": (0.0, 0.15),
    "power_offtake": (0.0, math.inf),
}
LIMITS = {
    "temperature": "turbine temperature limit",
    "gas_generator_speed": "gas-generator speed limit",
    "power": "take-off rating",
    "surge": "surge line of the compressor (a placeholder)",
    "no power": "power turbine, which gives no power below",
    "self-sustaining": "gas generator, which below does not sustain itself at its turbine temperature limit",
    "slowest": "slowest gas generator of the model",
}
RATED = {"temperature": "turbine temperature", "gas_generator_speed": "gas-generator speed", "power": "power"}
SLOWEST = 0.31  # gas-generator speed down to which the least power is looked for
STEPS = 80  # of gas-generator speed, of that search
EXACT = 1e-7  # by which a limit may be exceeded: it may be met


@dataclass(frozen=True)
class Extreme:
    """The ``end`` ("maximum" or "minimum") of what one engine can do: shaft power [W], gas-generator speed (ratio),
    inter-turbine temperature [K], and the limit that sets it. Numbers are nan without ``success``."""

    success: bool
    status: Status
    message: str
    end: str
    limit: str
    power: float
    gas_generator_speed: float
    inter_turbine_temperature: float
    solution: Solution = field(repr=False, compare=False)

    def __str__(self) -> str:
        return self.of("power")

    def of(self, quantity: str) -> str:
        """The extreme of "power", "gas_generator_speed" or "inter_turbine_temperature" in words."""
        if not self.success:
            return self.message
        return f"{self.end} {in_words(quantity, getattr(self, quantity))}, limited by the {self.limit}"


def in_words(quantity: str, value: float) -> str:
    """A demand with its unit.

    ``quantity``: its name; ``value`` in the unit of the library.
    """
    return {
        "power": f"power {round(value / 1e3, 1) + 0.0:.1f} kW",
        "gas_generator_speed": f"gas-generator speed {100 * value:.2f} %",
        "inter_turbine_temperature": f"inter-turbine temperature {value:.1f} K",
    }[quantity]


def temperature_limit(data: EngineData, rating: str = TAKE_OFF) -> float:
    """Limit of the inter-turbine temperature [K]: a ratio to that of the model's own design point.

    ``rating``: its name.
    """
    return rating_limits(data, rating)["temperature"]


def rating_limits(data: EngineData, rating: str = TAKE_OFF) -> dict[Mode, float]:
    """Largest inter-turbine temperature [K], gas-generator speed (ratio) and power [W] of a rating.

    Raises :class:`InputError` for a rating that the data file does not have.
    """
    own = data.ratings
    ratio, speed, power = own.inter_turbine_temperature_ratio, own.gas_generator_speed, own.take_off_power
    if rating != TAKE_OFF:
        if rating not in own.named:
            raise InputError(f"engine: rating = {rating!r}: expected one of: {', '.join(own.names)}")
        named = own.named[rating]
        ratio = min(ratio, named.inter_turbine_temperature_ratio or ratio)
        speed = min(speed, named.gas_generator_speed or speed)
        power = min(power, named.power or power)
    return {"temperature": ratio * sized(data).t45, "gas_generator_speed": speed, "power": power}


def rated_speed(data: EngineData, rating: str = TAKE_OFF) -> float:
    """Power-turbine speed (ratio) where a rating is used: its own, or 1."""
    named = data.ratings.named.get(rating)
    return 1.0 if named is None or named.power_turbine_speed is None else named.power_turbine_speed


def maximum_power(*, rating: str = TAKE_OFF, engine_data: EngineData | None = None, **place: float) -> Extreme:
    """The most power of one engine at a rating: at its limit of temperature, gas-generator speed or power.

    ``place``: ``power_turbine_speed``, ``altitude``, ``isa_offset``, ``mach``, ``humidity``, ``bleed_fraction``,
    ``power_offtake`` as for :func:`vrsopt.turboshaft.performance.engine`, 0 unless given, the speed that of the rating
    or 1. Without success where the engine runs nowhere inside its limits. Raises :class:`InputError` for a value
    outside ``ALLOWED`` or an unknown rating.
    """
    data = _data(engine_data)
    return highest(data, checked_place(**{"power_turbine_speed": rated_speed(data, rating), **place}), rating)


def highest(data: EngineData, place: dict[str, float], rating: str = TAKE_OFF) -> Extreme:
    """:func:`maximum_power` at a place as :func:`checked_place` returns it.

    ``rating``: its name.
    """
    limits = rating_limits(data, rating)
    words = LIMITS | {
        mode: f"{RATED[mode]} of the rating" for mode, own in rating_limits(data).items() if limits[mode] < own
    }
    if rating != TAKE_OFF:
        words["power"] = "power of the rating"
    outputs: dict[Mode, str] = {"gas_generator_speed": "gas_generator_speed", "power": "power"}
    # from the limit that is met first in heat: each further one is looked at only where it is exceeded
    limit: str = "temperature"
    solution = solve(data, "temperature", limits["temperature"], place)
    for mode, output in outputs.items():
        if not solution.success or solution.outputs[output] > limits[mode] * (1.0 + EXACT):
            limit, solution = mode, solve(data, mode, limits[mode], place)
    most = _extreme("maximum", words[limit], solution)
    reason = _nowhere(data, most, limits["temperature"])
    return replace(most, success=False, status=Status.INFEASIBLE, message=f"{data.name}: {reason}") if reason else most


def _nowhere(data: EngineData, most: Extreme, temperature: float) -> str:
    """Why the engine runs nowhere inside its limits, in words; empty where it does.

    With too much taken from the gas generator no speed keeps the turbines at or below ``temperature`` [K]: then
    ``most``, found without that limit, is hotter, or there is no such state at all.
    """
    if not most.success:
        return f"no power inside the limits ({most.message})"
    if most.inter_turbine_temperature > temperature * (1.0 + EXACT):
        hot = in_words("inter_turbine_temperature", most.inter_turbine_temperature)
        return f"no power inside the limits: {hot}, {temperature:.1f} K allowed, at {most}"
    margin = most.solution.outputs["surge_margin"]  # less power only brings surge nearer
    return "" if margin >= 0.0 else f"no power without surge: margin {100 * margin:.1f} % at {most}"


def minimum_power(*, engine_data: EngineData | None = None, **place: float) -> Extreme:
    """The least power of one engine that runs by itself: where its shaft gives none, at surge, or where the gas
    generator gets as hot as its limit because it turns too slowly to sustain itself. Arguments as
    :func:`maximum_power`.

    ``place``: those of the day and of the flight.
    """
    return lowest(_data(engine_data), checked_place(**place))


def lowest(data: EngineData, place: dict[str, float]) -> Extreme:
    """:func:`minimum_power` at a place as :func:`checked_place` returns it."""
    most = highest(data, place)
    if not most.success:
        return replace(most, end="minimum")
    speeds, outputs = _sweep(data, place, most.gas_generator_speed)
    margins = _margins(data, outputs)
    bad = np.flatnonzero(~(np.min(np.stack(list(margins.values())), axis=0) >= 0.0))
    if not bad.size:
        return _extreme("minimum", LIMITS["slowest"], solve(data, "gas_generator_speed", float(speeds[-1]), place))
    first = max(int(bad[0]), 1)
    limit = min(margins, key=lambda name: margins[name][first])
    if not math.isfinite(margins[limit][first]):  # no solution at all
        limit = "self-sustaining"

    def margin(speed: float) -> float:
        solution = solve(data, "gas_generator_speed", speed, place)
        return float(_margins(data, solution.outputs)[limit]) if solution.success else -1.0

    # a margin that is there at one speed and gone at the next: a little on the good side of where it goes
    edge = brentq(margin, speeds[first], speeds[first - 1], xtol=1e-9) if margin(speeds[first - 1]) > 0 else speeds[0]
    return _extreme("minimum", LIMITS[limit], solve(data, "gas_generator_speed", float(edge), place))


def coolest(data: EngineData, place: dict[str, float], fastest: float) -> float:
    """Least inter-turbine temperature [K] below the gas-generator speed ``fastest``: it rises again towards idle.

    ``place``: as :func:`checked_place` returns it.
    """
    return float(np.nanmin(_sweep(data, place, fastest)[1]["power_turbine_inlet_temperature"]))


def solve(data: EngineData, mode: Mode, demand: float, place: dict[str, float]) -> Solution:
    """The gas path at a demand, from the design point; ``place`` as :func:`checked_place` returns it."""
    return gas_path(data, mode).solve({"demand": demand, **place})


def checked(**values: float) -> dict[str, float]:
    """The values; raises :class:`InputError` for one outside ``ALLOWED``."""
    for name, value in values.items():
        if name not in ALLOWED:
            raise InputError(f"engine: unknown argument {name!r}: expected {', '.join(ALLOWED)}")
        low, high = ALLOWED[name]
        if not (math.isfinite(value) and low <= value <= high):
            span = f"from {low:g} to {high:g}" if math.isfinite(high) else f"of at least {low:g}"
            raise InputError(f"engine: {name} = {value}: a number {span}")
    return values


def checked_place(**place: float) -> dict[str, float]:
    """All parameters of the gas path after the demand, in its order; raises as :func:`checked`.

    ``place``: parameters by name, SI units; the others are 0, and the power turbine at its nominal speed.
    """
    values = dict.fromkeys((parameter.name for parameter in PARAMETERS), 0.0) | {"power_turbine_speed": 1.0}
    return values | checked(**place)


def _sweep(data: EngineData, place: dict[str, float], fastest: float) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Gas-generator speeds (n,) falling from ``fastest``, and the outputs there (nan where there is no solution)."""
    speeds = np.linspace(fastest, min(SLOWEST, fastest), STEPS)
    rows = np.column_stack([speeds, np.tile(list(place.values()), (STEPS, 1))])
    return speeds, solve_many(rows, mode="gas_generator_speed", engine_data=data).outputs


def _margins(data: EngineData, outputs: dict[str, Any]) -> dict[str, Any]:
    """What is left of each limit of the low end, scaled; not negative is allowed."""
    temperature = outputs["power_turbine_inlet_temperature"] / temperature_limit(data)
    return {
        "no power": outputs["power"] / data.ratings.take_off_power,
        "surge": outputs["surge_margin"],
        "self-sustaining": 1.0 + EXACT - temperature,
    }


def _extreme(end: str, limit: str, solution: Solution) -> Extreme:
    reached = solution.outputs if solution.success else dict.fromkeys(solution.outputs, math.nan)
    return Extreme(
        success=solution.success,
        status=solution.status,
        message=solution.message,
        end=end,
        limit=limit,
        power=reached["power"],
        gas_generator_speed=reached["gas_generator_speed"],
        inter_turbine_temperature=reached["power_turbine_inlet_temperature"],
        solution=solution,
    )


def _data(engine_data: EngineData | None) -> EngineData:
    return engine_data if engine_data is not None else load_engine()
