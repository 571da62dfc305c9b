"""The cycle of a turboshaft as a closed formula, to share out a change of consumption among its steps."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from scipy.optimize import brentq

from vrsopt.atmosphere import SEA_LEVEL_PRESSURE
from vrsopt.residual import Solution
from vrsopt.turboshaft.cycle import sized
from vrsopt.turboshaft.data import EngineData
from vrsopt.turboshaft.design_point import KILOWATT_HOUR
from vrsopt.turboshaft.gas import enthalpy, entropy_function, fuel_enthalpy, gas_constant, heat_capacity
from vrsopt.turboshaft.maps import turbine_work

# What the consumption depends on, by group; pressures are ratios across the part, temperatures K, works J/kg of air.
GROUPS: dict[str, tuple[str, ...]] = {
    "turbine inlet temperature": ("turbine_inlet_temperature",),
    "pressure ratio": ("pressure_ratio",),
    "compressor efficiency": ("compressor_efficiency",),
    "gas-generator turbine efficiency": ("gas_generator_turbine_efficiency",),
    "power turbine efficiency": ("power_turbine_efficiency",),
    "combustion efficiency": ("combustion_efficiency",),
    "pressure losses": ("combustor_pressure", "duct_pressure", "exhaust_pressure"),
    "accessories of the gas generator": ("accessory_work",),
    "air at the inlet (ram)": ("inlet_temperature", "inlet_pressure"),
}
STEPS = tuple(name for names in GROUPS.values() for name in names)
Steps = dict[str, float]
NEWTON_STEPS = 8  # from 700 K they leave an error below 1e-10 K


def _temperature(function: Callable[[Any], Any], slope: Callable[[Any], Any], value: Any) -> Any:
    """Temperature [K] at which a property has a value: Newton steps, so that CasADi sees through them."""
    t: Any = 700.0
    for _ in range(NEWTON_STEPS):
        t = t - (function(t) - value) / slope(t)
    return t


def _at_enthalpy(value: Any, fuel_air_ratio: Any = 0.0) -> Any:
    return _temperature(lambda t: enthalpy(t, fuel_air_ratio), lambda t: heat_capacity(t, fuel_air_ratio), value)


def _expanded(temperature: Any, pressure_ratio: Any, fuel_air_ratio: Any = 0.0) -> Any:
    """Temperature [K] after an isentropic expansion (or, below one, compression)."""
    entropy = entropy_function(temperature, fuel_air_ratio) - gas_constant(fuel_air_ratio) * ca.log(pressure_ratio)
    return _temperature(
        lambda t: entropy_function(t, fuel_air_ratio), lambda t: heat_capacity(t, fuel_air_ratio) / t, entropy
    )


def _consumption(engine: EngineData, x: dict[str, Any]) -> dict[str, Any]:
    """Specific consumption [kg/kWh] of a cycle and what is met on the way, per kg of air, dry."""
    ggt, pt = engine.gas_generator_turbine, engine.power_turbine
    cold = enthalpy(x["inlet_temperature"])
    ideal = _expanded(x["inlet_temperature"], 1.0 / x["pressure_ratio"])
    work = (enthalpy(ideal) - cold) / x["compressor_efficiency"]
    t4, burnt = x["turbine_inlet_temperature"], 1.0 - ggt.cooling_fraction
    released = x["combustion_efficiency"] * engine.combustor.heating_value
    f4 = (enthalpy(t4) - cold - work) / (released - fuel_enthalpy(t4))
    fuel, w4 = f4 * burnt, (1.0 + f4) * burnt

    taken = (work / ggt.mechanical_efficiency + x["accessory_work"]) / w4
    drop = taken / x["gas_generator_turbine_efficiency"]
    behind = _at_enthalpy(enthalpy(t4, f4) - drop, f4)
    ratio = ca.exp((entropy_function(t4, f4) - entropy_function(behind, f4)) / gas_constant(f4))
    p4 = x["inlet_pressure"] * x["pressure_ratio"] * x["combustor_pressure"]

    w45 = 1.0 + fuel
    h45 = (w4 * (enthalpy(t4, f4) - taken) + ggt.cooling_fraction * (cold + work)) / w45
    t45 = _at_enthalpy(h45, fuel)
    expansion = p4 / ratio * x["duct_pressure"] / x["exhaust_pressure"]
    left = h45 - enthalpy(_expanded(t45, expansion, fuel), fuel)
    power = pt.mechanical_efficiency * w45 * x["power_turbine_efficiency"] * left
    return {
        "consumption": fuel / power * KILOWATT_HOUR,
        "t45": t45,
        "p45_uncooled": p4 / ratio,
        "w45": w45,
        "gas45": gas_constant(fuel),
    }


@lru_cache(maxsize=4)
def _functions(text: str) -> tuple[ca.Function, ca.Function, list[str]]:
    """Consumption and company, and d ln(consumption)/d ln(steps), as functions of ln(steps)."""
    logs = ca.SX.sym("x", len(STEPS))
    values = dict(zip(STEPS, ca.vertsplit(ca.exp(logs)), strict=True))
    found = _consumption(EngineData.model_validate_json(text), values)
    value = ca.Function("cycle", [logs], [ca.vertcat(*found.values())])
    slope = ca.Function("slope", [logs], [ca.jacobian(ca.log(found["consumption"]), logs)])
    return value, slope, list(found)


def cycle(engine: EngineData, steps: Steps) -> dict[str, float]:
    """Specific consumption [kg/kWh] and temperatures of the cycle with these steps."""
    value, _, names = _functions(engine.model_dump_json())
    return dict(zip(names, value(np.log(_vector(steps))).full().ravel().tolist(), strict=True))


def slopes(engine: EngineData, steps: Steps) -> dict[str, float]:
    """Exact d ln(consumption)/d ln(step)."""
    _, slope, _ = _functions(engine.model_dump_json())
    return dict(zip(STEPS, slope(np.log(_vector(steps))).full().ravel().tolist(), strict=True))


def shares(engine: EngineData, first: Steps, second: Steps) -> dict[str, float]:
    """What each group contributes to ln(consumption) from the first state to the second; they add up to the whole."""
    _, slope, _ = _functions(engine.model_dump_json())
    start, way = np.log(_vector(first)), np.log(_vector(second)) - np.log(_vector(first))
    nodes, weights = np.polynomial.legendre.leggauss(10)
    mean = sum(
        w * slope(start + 0.5 * (1.0 + t) * way).full().ravel() for t, w in zip(nodes, 0.5 * weights, strict=True)
    )
    parts = dict(zip(STEPS, mean * way, strict=True))
    return {group: float(sum(parts[name] for name in names)) for group, names in GROUPS.items()}


def _vector(steps: Steps) -> np.ndarray:
    return np.array([steps[name] for name in STEPS])


def steps_of(engine: EngineData, solution: Solution, design: Solution) -> Steps:
    """The steps of a solved gas path at sea level, dry; ``design`` is its solution at the design point.

    The gas path does not tell all of them. Losses of pressure grow with the square of the local flow function from
    their design values. The power turbine's efficiency is its map's; the gas-generator turbine's is what closes the
    consumption.
    """
    out, place = solution.outputs, solution.parameters
    turbine = engine.power_turbine
    spouting = out["best_power_turbine_speed"] / turbine.best_velocity_ratio
    work = turbine_work(
        turbine.speed_curvature, place["power_turbine_speed"], spouting, best=turbine.best_velocity_ratio
    )
    steps = {
        "inlet_temperature": out["inlet_temperature"],
        "inlet_pressure": out["compressor_exit_pressure"] / out["pressure_ratio"] / SEA_LEVEL_PRESSURE,
        "pressure_ratio": out["pressure_ratio"],
        "turbine_inlet_temperature": out["turbine_inlet_temperature"],
        "compressor_efficiency": out["compressor_efficiency"],
        "combustion_efficiency": out["combustion_efficiency"],
        "power_turbine_efficiency": sized(engine).power_turbine_efficiency * work / spouting**2,
        "accessory_work": engine.gas_generator_turbine.accessory_power * out["gas_generator_speed"] / out["air_flow"],
        "combustor_pressure": 1.0
        - engine.combustor.pressure_loss * _flow(out, "compressor") / _flow(design.outputs, "compressor"),
    }
    exhaust = 1.0
    for _ in range(20):
        grown = _flow(out, "exhaust", exhaust) / _flow(design.outputs, "exhaust", 1.0 + engine.exhaust.pressure_loss)
        exhaust = 1.0 + engine.exhaust.pressure_loss * grown
    steps["exhaust_pressure"] = exhaust
    return _closed(engine, steps, solution)


def _flow(out: dict[str, float], where: str, pressure: float = 1.0) -> float:
    """(W/P)^2 T up to a constant, at the compressor's exit or at an exhaust pressure over ambient."""
    if where == "compressor":
        return (out["air_flow"] / out["compressor_exit_pressure"]) ** 2 * out["compressor_exit_temperature"]
    return ((out["air_flow"] + out["fuel_flow"]) / pressure) ** 2 * out["exhaust_temperature"]


def _closed(engine: EngineData, steps: Steps, solution: Solution) -> Steps:
    """``steps`` with the gas-generator turbine's efficiency that closes the consumption, and the loss of the duct."""
    target = solution.outputs["fuel_flow"] / solution.outputs["power"] * KILOWATT_HOUR
    lost = engine.power_turbine.duct_pressure_loss
    at_design = sized(engine).duct_parameter

    def complete(efficiency: float) -> Steps:
        whole = steps | {"gas_generator_turbine_efficiency": efficiency, "duct_pressure": 1.0 - lost}
        found = cycle(engine, whole)
        flow = solution.outputs["air_flow"] * found["w45"] / (found["p45_uncooled"] * SEA_LEVEL_PRESSURE)
        return whole | {"duct_pressure": 1.0 - lost * flow**2 * found["gas45"] * found["t45"] / at_design}

    def error(efficiency: float) -> float:
        return cycle(engine, complete(efficiency))["consumption"] - target

    return complete(float(brentq(error, 0.6, 0.95, xtol=1e-13)))
