"""What one engine does at a demanded power, and the most power it can give."""

from __future__ import annotations

import math
from dataclasses import dataclass

from vrsopt.errors import InputError
from vrsopt.residual import Solution
from vrsopt.solvers.status import Status
from vrsopt.turboshaft.cycle import Mode, gas_path, sized
from vrsopt.turboshaft.data import EngineData, load_engine
from vrsopt.turboshaft.design_point import SPEED_UNIT

# Where the model is known to solve and its maps still mean something.
ALLOWED = {
    "power": (0.0, math.inf),
    "power_turbine_speed": (0.4, 1.4),
    "altitude": (-500.0, 6000.0),
    "isa_offset": (-50.0, 50.0),
    "mach": (0.0, 0.4),
}
LARGEST_DEMAND = 3.0  # times the take-off rating: the most power that is put to the solver


@dataclass(frozen=True)
class EngineResult:
    """One engine at one operating point, in the units of the names; prints as a short table.

    ``success`` is False when the power can not be had (``message`` says which limit and what the maximum is; the
    numbers are then those of the engine driven beyond its limit) or when the cycle was not solved (numbers are nan).
    ``sfc_kg_kwh`` is None at zero power.
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
    pressure_ratio: float
    air_flow_kg_s: float
    co2_kg_s: float
    residual_norm: float

    def __str__(self) -> str:
        sfc = "-" if self.sfc_kg_kwh is None else f"{self.sfc_kg_kwh:.3f} kg/kWh"
        rows = (
            ("power", f"{self.power_w / 1e3:.1f} kW at {self.power_turbine_speed_percent:.1f} % power-turbine speed"),
            ("fuel flow", f"{self.fuel_flow_kg_s * 3600:.1f} kg/h ({sfc})"),
            ("CO2", f"{self.co2_kg_s * 3600:.1f} kg/h"),
            ("gas generator", f"{self.gas_generator_speed_percent:.1f} %, pressure ratio {self.pressure_ratio:.2f}"),
            ("air flow", f"{self.air_flow_kg_s:.3f} kg/s"),
            ("turbine inlet", f"{self.turbine_inlet_temperature_k:.0f} K"),
            ("between turbines", f"{self.power_turbine_inlet_temperature_k:.0f} K"),
            ("result", self.message),
        )
        return "\n".join(f"{label:<17}{text}" for label, text in rows)


@dataclass(frozen=True)
class MaximumPower:
    """The most shaft power [W] of one engine, the limit that sets it, and the gas-generator speed ratio there."""

    success: bool
    status: Status
    message: str
    power: float
    limit: str
    gas_generator_speed: float

    def __str__(self) -> str:
        return f"maximum power {self.power / 1e3:.1f} kW, limited by the {self.limit}" if self.success else self.message


def engine(
    power: float,
    *,
    power_turbine_speed: float = 1.0,
    altitude: float = 0.0,
    isa_offset: float = 0.0,
    mach: float = 0.0,
    engine_data: EngineData | None = None,
) -> EngineResult:
    """One engine at shaft power [W], power-turbine speed (ratio), pressure altitude [m], ISA offset [K], Mach number.

    ``engine_data`` defaults to the Allison 250-C20B. Solves the gas path (:func:`vrsopt.turboshaft.cycle.gas_path`) by
    IPOPT and tests the engine's own limits: take-off rating, inter-turbine temperature, gas-generator speed. Raises
    :class:`InputError` for a value outside ``ALLOWED``.
    """
    data = engine_data if engine_data is not None else load_engine()
    place = _checked(power_turbine_speed=power_turbine_speed, altitude=altitude, isa_offset=isa_offset, mach=mach)
    _checked(power=power)
    hopeless = LARGEST_DEMAND * data.ratings.take_off_power  # the solver need not end beyond it
    solution = _solve(data, "power", min(power, hopeless), place)
    solved = solution.success and power <= hopeless
    success, status, message = solution.success, solution.status, solution.message
    if not solved or _beyond_limits(data, solution):
        best = maximum_power(**place, engine_data=data)
        if best.success and power > best.power:
            success, status = False, Status.INFEASIBLE
            message = f"power {power / 1e3:.1f} kW can not be had: {best}, at {_where(place)}"
    out = solution.outputs if solved else dict.fromkeys(solution.outputs, math.nan)
    return EngineResult(
        success=success,
        status=status,
        message=message,
        power_w=float(power),
        fuel_flow_kg_s=out["fuel_flow"],
        sfc_kg_kwh=out["fuel_flow"] * SPEED_UNIT / power if power > 0 else None,
        gas_generator_speed_percent=100.0 * out["gas_generator_speed"],
        power_turbine_speed_percent=100.0 * power_turbine_speed,
        turbine_inlet_temperature_k=out["turbine_inlet_temperature"],
        power_turbine_inlet_temperature_k=out["power_turbine_inlet_temperature"],
        pressure_ratio=out["pressure_ratio"],
        air_flow_kg_s=out["air_flow"],
        co2_kg_s=out["co2_flow"],
        residual_norm=solution.residual_norm,
    )


def maximum_power(
    *,
    power_turbine_speed: float = 1.0,
    altitude: float = 0.0,
    isa_offset: float = 0.0,
    mach: float = 0.0,
    engine_data: EngineData | None = None,
) -> MaximumPower:
    """The most power of one engine: at its temperature limit, its gas-generator speed limit, or its take-off rating.

    Arguments as :func:`engine`. Raises :class:`InputError` for a value outside ``ALLOWED``.
    """
    data = engine_data if engine_data is not None else load_engine()
    place = _checked(power_turbine_speed=power_turbine_speed, altitude=altitude, isa_offset=isa_offset, mach=mach)
    limit, solution = "turbine temperature limit", _solve(data, "temperature", temperature_limit(data), place)
    if solution.success and solution.outputs["gas_generator_speed"] > data.ratings.gas_generator_speed:
        limit = "gas-generator speed limit"
        solution = _solve(data, "gas_generator_speed", data.ratings.gas_generator_speed, place)
    if solution.success and solution.outputs["power"] > data.ratings.take_off_power:
        limit, solution = "take-off rating", _solve(data, "power", data.ratings.take_off_power, place)
    reached = solution.outputs if solution.success else dict.fromkeys(solution.outputs, math.nan)
    return MaximumPower(
        success=solution.success,
        status=solution.status,
        message=solution.message,
        power=reached["power"],
        limit=limit,
        gas_generator_speed=reached["gas_generator_speed"],
    )


def temperature_limit(data: EngineData) -> float:
    """Limit of the inter-turbine temperature [K]: a ratio to that of the model's own design point."""
    return data.ratings.inter_turbine_temperature_ratio * sized(data).t45


def _beyond_limits(data: EngineData, solution: Solution) -> bool:
    """Whether the solution is beyond a limit of the engine; a limit may be met exactly."""
    ratios = (
        solution.outputs["power"] / data.ratings.take_off_power,
        solution.outputs["power_turbine_inlet_temperature"] / temperature_limit(data),
        solution.outputs["gas_generator_speed"] / data.ratings.gas_generator_speed,
    )
    return max(ratios) > 1.0 + 1e-7


def _solve(data: EngineData, mode: Mode, demand: float, place: dict[str, float]) -> Solution:
    return gas_path(data, mode).solve(
        {"demand": demand, **place, "bleed_fraction": 0.0, "power_offtake": 0.0, "humidity": 0.0}
    )


def _checked(**values: float) -> dict[str, float]:
    for name, value in values.items():
        low, high = ALLOWED[name]
        if not (math.isfinite(value) and low <= value <= high):
            raise InputError(f"engine: {name} = {value}: a number from {low:g} to {high:g}")
    return values


def _where(place: dict[str, float]) -> str:
    return (
        f"{place['altitude']:.0f} m, ISA{place['isa_offset']:+.0f} K, Mach {place['mach']:.2f}, "
        f"power-turbine speed {100 * place['power_turbine_speed']:.0f} %"
    )
