"""What one engine does at a demand or a rating: fuel, temperatures, emissions, margins, and what it can not do."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vrsopt.errors import InputError
from vrsopt.residual import Solution
from vrsopt.solvers.status import Status
from vrsopt.turboshaft.cycle import Mode
from vrsopt.turboshaft.data import TAKE_OFF, EngineData, load_engine
from vrsopt.turboshaft.design_point import KILOWATT_HOUR
from vrsopt.turboshaft.map_range import outside_map
from vrsopt.turboshaft.operating_range import (
    ALLOWED,
    EXACT,
    checked,
    checked_place,
    coolest,
    highest,
    in_words,
    lowest,
    maximum_power,
    minimum_power,
    rated_speed,
    rating_limits,
    solve,
    temperature_limit,
)

if TYPE_CHECKING:
    from vrsopt.combustor.emissions import Emissions

__all__ = ["ALLOWED", "EngineResult", "engine", "maximum_power", "minimum_power", "temperature_limit"]

MODES: dict[str, Mode] = {
    "power": "power",
    "gas_generator_speed": "gas_generator_speed",
    "inter_turbine_temperature": "temperature",
}
OUTPUTS = {
    "power": "power",
    "gas_generator_speed": "gas_generator_speed",
    "inter_turbine_temperature": "power_turbine_inlet_temperature",
}
LARGEST_DEMAND = 3.0  # times the take-off rating: the most power that is put to the solver


@dataclass(frozen=True)
class EngineResult:
    """One engine at one operating point, in the units of the names; prints as a short table.

    ``power_w`` at the shaft; ``fuel_flow_kg_s`` and ``sfc_kg_kwh`` per power; ``gas_generator_speed_percent`` of
    design, ``power_turbine_speed_percent`` of nominal; ``turbine_inlet_temperature_k`` before both turbines,
    ``power_turbine_inlet_temperature_k`` between them, ``exhaust_temperature_k`` behind them; ``pressure_ratio`` of the
    compressor and its ``air_flow_kg_s``; ``combustion_efficiency`` [-]; ``surge_margin_percent``; emissions
    ``nox_kg_s`` (as NO2), ``co_kg_s``, ``co2_kg_s`` and per fuel ``nox_index_g_kg``, ``co_index_g_kg``,
    ``hc_index_g_kg``; ``residual_norm``, the largest scaled residual [-].

    ``success`` is False when the demand can not be met (``message`` says which limit and what the maximum or minimum
    is; the numbers are then those of the engine driven beyond its limit) or when the cycle was not solved (numbers are
    nan). It does not depend on the emissions: where the combustor could not be solved, NOx and CO are nan, CO2 is that
    of complete combustion, and ``message`` says so. ``sfc_kg_kwh`` is None at zero power. ``nox_range_kg_s`` is the
    least and largest over the combustor fits of the data file. ``inside_map`` is False, and ``map_note`` says why,
    where the compressor map or the gas properties are used outside the range they are meant for.
    """

    success: bool
    status: Status
    message: str
    power_w: float
    fuel_flow_kg_s: float
    sfc_kg_kwh: float | None
    gas_generator_speed_percent: float
    power_turbine_speed_percent: float
    turbine_inlet_temperature_k: float
    power_turbine_inlet_temperature_k: float
    exhaust_temperature_k: float
    pressure_ratio: float
    air_flow_kg_s: float
    combustion_efficiency: float
    surge_margin_percent: float
    inside_map: bool
    map_note: str
    nox_kg_s: float
    co_kg_s: float
    co2_kg_s: float
    nox_index_g_kg: float
    co_index_g_kg: float
    hc_index_g_kg: float
    nox_range_kg_s: tuple[float, float]
    residual_norm: float

    def __str__(self) -> str:
        sfc = "-" if self.sfc_kg_kwh is None else f"{self.sfc_kg_kwh:.3f} kg/kWh"
        low, high = (3.6e6 * value for value in self.nox_range_kg_s)
        fits = f", {low:.0f} to {high:.0f} g/h over the combustor's fits" if high > low else ""
        rows = [
            ("power", f"{self.power_w / 1e3:.1f} kW at {self.power_turbine_speed_percent:.1f} % power-turbine speed"),
            ("fuel flow", f"{self.fuel_flow_kg_s * 3600:.1f} kg/h ({sfc})"),
            ("CO2", f"{self.co2_kg_s * 3600:.1f} kg/h"),
            ("NOx", f"{self.nox_kg_s * 3.6e6:.0f} g/h ({self.nox_index_g_kg:.2f} g/kg){fits}"),
            ("CO", f"{self.co_kg_s * 3.6e6:.0f} g/h ({self.co_index_g_kg:.1f} g/kg)"),
            (
                "hydrocarbons",
                f"{self.hc_index_g_kg:.1f} g/kg by FOCA's correlation; at idle NOx and CO are indicative only",
            ),
            ("gas generator", f"{self.gas_generator_speed_percent:.1f} %, pressure ratio {self.pressure_ratio:.2f}"),
            (
                "air flow",
                f"{self.air_flow_kg_s:.3f} kg/s, surge margin {self.surge_margin_percent:.0f} % (placeholder)",
            ),
            ("turbine inlet", f"{self.turbine_inlet_temperature_k:.0f} K"),
            ("between turbines", f"{self.power_turbine_inlet_temperature_k:.0f} K"),
            ("combustion", f"efficiency {self.combustion_efficiency:.4f}"),
            ("result", self.message),
        ]
        rows += [] if self.inside_map else [("map", self.map_note)]
        return "\n".join(f"{label:<17}{text}" for label, text in rows)


def engine(
    power: float | None = None,
    *,
    gas_generator_speed: float | None = None,
    inter_turbine_temperature: float | None = None,
    rating: str | None = None,
    power_turbine_speed: float | None = None,
    altitude: float = 0.0,
    isa_offset: float = 0.0,
    mach: float = 0.0,
    humidity: float = 0.0,
    bleed_fraction: float = 0.0,
    power_offtake: float = 0.0,
    engine_data: EngineData | None = None,
) -> EngineResult:
    """One engine at a demand, exactly one of four: shaft ``power`` [W], ``gas_generator_speed`` [ratio to design],
    ``inter_turbine_temperature`` [K], or ``rating``, a name of the data file ("take_off", "maximum_continuous",
    "ground_idle").

    ``power_turbine_speed`` [ratio to nominal] (1, or the rating's own), pressure ``altitude`` [m], ``isa_offset`` [K],
    ``mach``, ``humidity`` (kg of water vapour per kg of dry air), ``bleed_fraction`` (of the compressor's air),
    ``power_offtake`` (taken from the gas generator) [W]. ``engine_data`` defaults to the Allison 250-C20B. Solves the
    gas path (:func:`vrsopt.turboshaft.cycle.gas_path`) and the combustor (:func:`vrsopt.combustor.emissions.emissions`)
    and tests the engine's limits. Raises :class:`InputError` for a value outside ``ALLOWED``, an unknown rating, or
    another number of demands than one.
    """
    data = engine_data if engine_data is not None else load_engine()
    demands = {
        "power": power,
        "gas_generator_speed": gas_generator_speed,
        "inter_turbine_temperature": inter_turbine_temperature,
        "rating": rating,
    }
    given = [name for name, value in demands.items() if value is not None]
    if len(given) != 1:
        raise InputError(f"engine: {' and '.join(given) or 'no demand'} given: exactly one of {', '.join(demands)}")
    rated = rated_speed(data, rating or TAKE_OFF)
    place = checked_place(
        power_turbine_speed=rated if power_turbine_speed is None else power_turbine_speed,
        altitude=altitude,
        isa_offset=isa_offset,
        mach=mach,
        bleed_fraction=bleed_fraction,
        power_offtake=power_offtake,
        humidity=humidity,
    )
    if rating is not None:
        return _at_rating(data, rating, place)
    quantity = given[0]
    return _at_demand(data, quantity, checked(**{quantity: demands[quantity]})[quantity], place)  # type: ignore[arg-type]


def _at_rating(data: EngineData, rating: str, place: dict[str, float]) -> EngineResult:
    best = highest(data, place, rating)
    status, message = best.status, best.message
    if best.success:
        message = f"{rating.replace('_', ' ')}: {best}"
        short = _shortfall(data, best.solution, "gas_generator_speed", best.gas_generator_speed, place)
        if short:
            status, message = Status.INFEASIBLE, f"rating {rating.replace('_', ' ')}: {short}"
    return _result(data, best.solution, best.success, status, message, place)


def _at_demand(data: EngineData, quantity: str, demand: float, place: dict[str, float]) -> EngineResult:
    hopeless = LARGEST_DEMAND * data.ratings.take_off_power if quantity == "power" else math.inf
    solution = solve(data, MODES[quantity], min(demand, hopeless), place)  # the solver need not end beyond it
    solved = solution.success and demand <= hopeless
    short = _shortfall(data, solution if solved else None, quantity, demand, place)
    status = Status.INFEASIBLE if short else solution.status
    return _result(data, solution, solved, status, short or solution.message, place)


def _shortfall(
    data: EngineData, solution: Solution | None, quantity: str, demand: float, place: dict[str, float]
) -> str:
    """Why a demand can not be met, in words; empty where it can (or where the solver failed for no known reason)."""
    beyond, below = solution is None, solution is None
    if solution is not None:
        limits = rating_limits(data, TAKE_OFF)
        used = (solution.outputs[OUTPUTS[name]] / limits[mode] for name, mode in MODES.items())
        beyond = max(used) > 1.0 + EXACT or solution.outputs["surge_margin"] < 0.0
        below = solution.outputs["power"] < 0.0 or beyond
    if not (beyond or below):
        return ""
    refused = f"{in_words(quantity, demand)} can not be had:"
    most = highest(data, place)
    if not most.success and most.status is Status.INFEASIBLE:
        return f"{refused} {most.message}, at {_where(place)}"
    if most.success and demand > getattr(most, quantity) * (1.0 + EXACT):
        return f"{refused} {most.of(quantity)}, at {_where(place)}"
    least = lowest(data, place)
    if least.success and demand < getattr(least, quantity) and quantity != "inter_turbine_temperature":
        return f"{refused} {least.of(quantity)}, at {_where(place)}"
    if most.success and quantity == "inter_turbine_temperature":
        cold = coolest(data, place, most.gas_generator_speed)
        if demand < cold:
            return f"{refused} it does not fall below {cold:.1f} K, at {_where(place)}"
    if most.success and beyond and solution is not None:
        return f"{refused} {most}, at {_where(place)}"
    if least.success and solution is not None and solution.outputs["power"] < -EXACT * data.ratings.take_off_power:
        return f"{refused} {least}, at {_where(place)}"
    return ""


def _result(
    data: EngineData, solution: Solution, solved: bool, status: Status, message: str, place: dict[str, float]
) -> EngineResult:
    out = solution.outputs if solved else dict.fromkeys(solution.outputs, math.nan)
    fuel, power = out["fuel_flow"], out["power"]
    note = outside_map(data, out) if solved else "not solved"
    emitted = _emissions(data, solution) if solved else None
    if emitted is not None and not emitted.success:
        message = f"{message}; emissions: {emitted.message}"
    known = emitted is not None and emitted.success
    nox, co, nox_index, co_index, low, high = (
        (emitted.nox, emitted.co, emitted.nox_index, emitted.co_index, *emitted.nox_range)
        if emitted is not None and known
        else (math.nan,) * 6
    )
    return EngineResult(
        success=status is Status.CONVERGED and solved,
        status=status,
        message=message,
        power_w=power,
        fuel_flow_kg_s=fuel,
        sfc_kg_kwh=fuel * KILOWATT_HOUR / power if power > 1e-6 * data.ratings.take_off_power else None,
        gas_generator_speed_percent=100.0 * out["gas_generator_speed"],
        power_turbine_speed_percent=100.0 * place["power_turbine_speed"],
        turbine_inlet_temperature_k=out["turbine_inlet_temperature"],
        power_turbine_inlet_temperature_k=out["power_turbine_inlet_temperature"],
        exhaust_temperature_k=out["exhaust_temperature"],
        pressure_ratio=out["pressure_ratio"],
        air_flow_kg_s=out["air_flow"],
        combustion_efficiency=out["combustion_efficiency"],
        surge_margin_percent=100.0 * out["surge_margin"],
        inside_map=not note,
        map_note=note,
        nox_kg_s=nox,
        co_kg_s=co,
        co2_kg_s=emitted.co2 if emitted is not None and known else out["co2_flow"],
        nox_index_g_kg=1e3 * nox_index,
        co_index_g_kg=1e3 * co_index,
        hc_index_g_kg=1e3 * out["hydrocarbon_index"],
        nox_range_kg_s=(low, high),
        residual_norm=solution.residual_norm,
    )


def _emissions(data: EngineData, solution: Solution) -> Emissions:
    from vrsopt.combustor.emissions import emissions  # builds its equations on first use: only for who asks

    return emissions(data, solution)


def _where(place: dict[str, float]) -> str:
    words = [
        f"{place['altitude']:.0f} m",
        f"ISA{place['isa_offset']:+.0f} K",
        f"Mach {place['mach']:.2f}",
        f"power-turbine speed {100 * place['power_turbine_speed']:.0f} %",
    ]
    further = {
        "humidity": f"humidity {place['humidity']:.3f}",
        "bleed_fraction": f"bleed {100 * place['bleed_fraction']:.1f} %",
        "power_offtake": f"offtake {place['power_offtake'] / 1e3:.1f} kW",
    }
    return ", ".join(words + [text for name, text in further.items() if place[name] > 0.0])
