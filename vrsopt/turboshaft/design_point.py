"""Sizing: the constants of the gas path from the engine's design point, as a residual system of its own.

Power, consumption, air flow and pressure ratio are given; the heat balance then fixes every temperature, the
gas-generator's shaft balance its turbine's expansion, and what is left of the pressure the power turbine's efficiency.
The parameters of the system are the numbers of the data file, so that every sized constant has exact derivatives with
respect to each of them: :func:`design_sensitivities`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import casadi as ca

from vrsopt.atmosphere import SEA_LEVEL_PRESSURE, SEA_LEVEL_TEMPERATURE
from vrsopt.errors import InputError
from vrsopt.quantity import Record
from vrsopt.residual import Named, ResidualSystem, Solution, Unknown
from vrsopt.turboshaft.data import EngineData
from vrsopt.turboshaft.gas import enthalpy, entropy_function, fuel_enthalpy, gas_constant
from vrsopt.turboshaft.maps import combustor_loading

COLDEST, HOTTEST = 150.0, 2200.0  # K, where temperatures are looked for
KILOWATT_HOUR = 3.6e6  # J
LEAST_EXPANSION = 1.05  # of the power turbine
TURBINE_EFFICIENCIES = (0.5, 0.95)  # of the power turbine
# The residual of the gas path at the design point is that of the sizing: a thousand times smaller than elsewhere.
STRICT = 1e-3

# Numbers of the data file that the sizing depends on, component by component.
SIZED_BY = {
    "design_point": ("power", "sfc", "air_flow", "pressure_ratio"),
    "intake": ("pressure_loss",),
    "compressor": ("efficiency",),
    "combustor": ("heating_value", "efficiency", "pressure_loss"),
    "gas_generator_turbine": ("efficiency", "cooling_fraction", "mechanical_efficiency", "accessory_power"),
    "power_turbine": ("mechanical_efficiency", "duct_pressure_loss"),
    "exhaust": ("pressure_loss",),
}
# In the order in which each follows from those before it.
TEMPERATURES = ("t3_ideal", "t3", "t4", "t45_uncooled", "t45_ideal", "t45", "t5_ideal", "t5")
UNITS = {
    **dict.fromkeys(("power", "accessory_power"), "W"),
    **dict.fromkeys(("air_flow", "corrected_air_flow", "fuel_flow"), "kg/s"),
    **dict.fromkeys(("heating_value", "compressor_work", "gas_generator_drop", "power_turbine_drop"), "J/kg"),
    **dict.fromkeys(TEMPERATURES, "K"),
    **dict.fromkeys(
        ("combustor_parameter", "gas_generator_constant", "power_turbine_constant", "duct_parameter"), "m4"
    ),
    "sfc": "kg/kWh",
    "compressor_exit_pressure": "Pa",
    "exhaust_constant": "1/m4",
    "combustor_loading": "kg/(s Pa^1.8)",
}


@dataclass(frozen=True)
class DesignPoint:
    """Design point and the constants of the flow functions. Temperatures K, works J/kg, flows kg/s, pressures Pa.

    Stations: 2 compressor inlet, 3 its exit, 4 combustor exit, 45 between the turbines, 5 power-turbine exit; ``ideal``
    is isentropic, ``uncooled`` before the cooling air is mixed in.
    """

    power: float
    air_flow: float
    corrected_air_flow: float
    fuel_flow: float
    pressure_ratio: float
    compressor_exit_pressure: float
    compressor_work: float
    t3_ideal: float
    t3: float
    t4: float
    t45_ideal: float
    t45_uncooled: float
    t45: float
    t5: float
    gas_generator_drop: float  # isentropic enthalpy drop of the gas-generator turbine
    gas_generator_expansion: float  # its pressure ratio
    power_turbine_drop: float  # isentropic enthalpy drop of the power turbine
    power_turbine_expansion: float  # its pressure ratio
    power_turbine_efficiency: float
    expansion: float  # y0: T5 ideal = T45 exp(-y0^2)
    combustor_loading: float  # see :func:`vrsopt.turboshaft.maps.combustor_loading`
    combustor_parameter: float  # W^2 R T/P^2 at the combustor inlet
    gas_generator_constant: float  # W^2 R T/P^2 at the inlet of the gas-generator turbine
    duct_parameter: float  # W^2 R T/P^2 of the duct between the turbines
    power_turbine_constant: float  # W^2 R T/P^2 at the inlet of the power turbine
    exhaust_constant: float  # exhaust loss over W^2 R T/P^2


def design_point(engine: EngineData) -> DesignPoint:
    """Size the gas path of ``engine``; raises :class:`InputError` when its design point can not be closed."""
    found = _solved(engine).outputs
    return DesignPoint(**{field.name: found[field.name] for field in fields(DesignPoint)})


def design_sensitivities(engine: EngineData) -> dict[str, dict[str, float]]:
    """Exact d(sized constant)/d(number of the data file): ``result["t45"]["design_point.sfc"]`` in K per (kg/kWh).

    The numbers that size the gas path (:data:`SIZED_BY`); the others have no part in it. Raises as
    :func:`design_point`.
    """
    return sizing().sensitivities(_solved(engine))


@lru_cache(maxsize=1)
def sizing() -> ResidualSystem:
    """The sizing of any engine: 8 temperatures along the gas path, parameters "component.number" of the data file."""
    names = [f"{component}.{number}" for component, numbers in SIZED_BY.items() for number in numbers]
    x, p = ca.SX.sym("x", len(TEMPERATURES)), ca.SX.sym("p", len(names))
    values = dict(zip(names, ca.vertsplit(p), strict=True))
    given = SimpleNamespace(
        **{part: SimpleNamespace(**{n: values[f"{part}.{n}"] for n in numbers}) for part, numbers in SIZED_BY.items()}
    )
    residuals, outputs = _balances(given, SimpleNamespace(**dict(zip(TEMPERATURES, ca.vertsplit(x), strict=True))))
    return ResidualSystem(
        name="design point",
        unknowns=tuple(Unknown(name, "K", scale=1000.0, lower=COLDEST, upper=HOTTEST) for name in TEMPERATURES),
        parameters=tuple(Named(name, UNITS.get(name.split(".")[1], "-")) for name in names),
        residuals=tuple(Named(name, scale=STRICT) for name in residuals),
        outputs=tuple(Named(name, UNITS.get(name, "-")) for name in outputs),
        x=x,
        p=p,
        r=ca.vertcat(*residuals.values()),
        y=ca.vertcat(*outputs.values()),
        guess=_constant_heat_capacities,
    )


def _balances(given: Any, t: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Scaled residuals in the order of TEMPERATURES and outputs by name."""
    ggt, pt, point = given.gas_generator_turbine, given.power_turbine, given.design_point
    air, fuel = point.air_flow, point.sfc * point.power / KILOWATT_HOUR
    t2, p2 = SEA_LEVEL_TEMPERATURE, SEA_LEVEL_PRESSURE * (1.0 - given.intake.pressure_loss)
    p3 = p2 * point.pressure_ratio
    work = (enthalpy(t.t3_ideal) - enthalpy(t2)) / given.compressor.efficiency
    h3 = enthalpy(t2) + work

    burnt = air * (1.0 - ggt.cooling_fraction)
    f4, f45 = fuel / burnt, fuel / air
    heat = f4 * given.combustor.efficiency * given.combustor.heating_value
    p4, w4, w45 = p3 * (1.0 - given.combustor.pressure_loss), burnt + fuel, air + fuel
    work_gg = (air * work / ggt.mechanical_efficiency + ggt.accessory_power) / w4
    drop_gg, h4 = work_gg / ggt.efficiency, enthalpy(t.t4, f4)
    ratio_gg = ca.exp((entropy_function(t.t4, f4) - entropy_function(t.t45_ideal, f4)) / gas_constant(f4))

    p45_uncooled = p4 / ratio_gg
    h45 = (w4 * enthalpy(t.t45_uncooled, f4) + (air - burnt) * h3) / w45
    p45, p5 = p45_uncooled * (1.0 - pt.duct_pressure_loss), SEA_LEVEL_PRESSURE * (1.0 + given.exhaust.pressure_loss)
    drop_pt, work_pt = h45 - enthalpy(t.t5_ideal, f45), point.power / pt.mechanical_efficiency / w45
    rise = entropy_function(t.t3_ideal) - entropy_function(t2)
    fall = entropy_function(t.t45, f45) - entropy_function(t.t5_ideal, f45)
    size = enthalpy(1000.0)
    residuals = {
        "t3_ideal": rise / gas_constant() - ca.log(point.pressure_ratio),
        "t3": (enthalpy(t.t3) - h3) / size,
        "t4": (enthalpy(t.t4) + f4 * fuel_enthalpy(t.t4) - h3 - heat) / size,
        "t45_uncooled": (h4 - enthalpy(t.t45_uncooled, f4) - work_gg) / size,
        "t45_ideal": (h4 - enthalpy(t.t45_ideal, f4) - drop_gg) / size,
        "t45": (enthalpy(t.t45, f45) - h45) / size,
        "t5_ideal": fall / gas_constant(f45) - ca.log(p45 / p5),
        "t5": (h45 - enthalpy(t.t5, f45) - work_pt) / size,
    }
    gas3, gas4, gas45 = gas_constant(), gas_constant(f4), gas_constant(f45)
    outputs = {
        "power": point.power,
        "air_flow": air,
        "corrected_air_flow": air * SEA_LEVEL_PRESSURE / p2,
        "fuel_flow": fuel,
        "pressure_ratio": point.pressure_ratio,
        "compressor_exit_pressure": p3,
        "compressor_work": work,
        **vars(t),
        "gas_generator_drop": drop_gg,
        "gas_generator_expansion": ratio_gg,
        "power_turbine_drop": drop_pt,
        "power_turbine_expansion": p45 / p5,
        "power_turbine_efficiency": work_pt / drop_pt,
        "expansion": ca.sqrt(ca.log(t.t45 / t.t5_ideal)),
        "combustor_loading": combustor_loading(burnt, p3, t.t3),
        "combustor_parameter": (burnt / p3) ** 2 * gas3 * t.t3,
        "gas_generator_constant": (w4 / p4) ** 2 * gas4 * t.t4,
        "duct_parameter": (w45 / p45_uncooled) ** 2 * gas45 * t.t45,
        "power_turbine_constant": (w45 / p45) ** 2 * gas45 * t.t45,
        "exhaust_constant": given.exhaust.pressure_loss / ((w45 / p5) ** 2 * gas45 * t.t5),
    }
    return residuals, outputs


def _constant_heat_capacities(given: Mapping[str, float]) -> dict[str, float]:
    """The same balances with constant heat capacities: a start for any engine, kept inside the bounds."""
    cold, hot, exponent = 1010.0, 1170.0, 0.245  # J/(kg K) of air and gas, R/cp of gas
    air, fuel = given["design_point.air_flow"], given["design_point.sfc"] * given["design_point.power"] / KILOWATT_HOUR
    ratio, t2 = given["design_point.pressure_ratio"], SEA_LEVEL_TEMPERATURE
    t = {"t3_ideal": t2 * ratio**0.284}
    t["t3"] = t2 + (t["t3_ideal"] - t2) / given["compressor.efficiency"]
    t["t4"] = t["t3"] + fuel / air * given["combustor.heating_value"] / hot
    fall = (t["t3"] - t2) * cold / hot
    t["t45_uncooled"] = t["t45"] = t["t4"] - fall
    t["t45_ideal"] = t["t4"] - fall / given["gas_generator_turbine.efficiency"]
    t = {name: min(max(value, COLDEST), HOTTEST) for name, value in t.items()}
    left = 0.9 * ratio * (t["t45_ideal"] / t["t4"]) ** (1.0 / exponent)
    t["t5_ideal"] = t["t45"] * left**-exponent
    t["t5"] = t["t45"] - given["design_point.power"] / air / hot
    return {name: min(max(value, COLDEST), HOTTEST) for name, value in t.items()}


def _solved(engine: EngineData) -> Solution:
    """The solved sizing; raises :class:`InputError` in the words of the data file."""
    system = sizing()
    given: dict[str, float] = {}
    for component, numbers in SIZED_BY.items():
        part: Record = getattr(engine, component)
        given |= {f"{component}.{number}": getattr(part, number) for number in numbers}
    solution = system.solve(given, method="newton")
    where = f"{engine.name}: design_point"
    open_at = None if solution.success else _first_open(system, given)
    ratio, efficiency = (solution.outputs[f"power_turbine_{name}"] for name in ("expansion", "efficiency"))
    if open_at in (None, "t5_ideal", "t5") and not ratio > LEAST_EXPANSION:
        raise InputError(f"{where}: power-turbine expansion {ratio:.3f}: more than {LEAST_EXPANSION} needed")
    if open_at is not None:
        station = open_at.split("_")[0].upper()
        raise InputError(f"{where}: no {station} between {COLDEST:.0f} and {HOTTEST:.0f} K closes the balance")
    low, high = TURBINE_EFFICIENCIES
    if not low < efficiency < high:
        raise InputError(f"{where}: needs a power-turbine efficiency of {efficiency:.3f}: {low} to {high} allowed")
    return solution


def _first_open(system: ResidualSystem, given: Mapping[str, float]) -> str:
    """The first temperature along the gas path without a solution: none depends on those after it."""
    for count in range(1, len(TEMPERATURES)):
        part = replace(
            system,
            unknowns=system.unknowns[:count],
            residuals=system.residuals[:count],
            outputs=(),
            x=system.x[:count],
            r=system.r[:count],
            y=ca.SX(0, 1),
        )
        if not part.solve(given, method="newton").success:
            return TEMPERATURES[count - 1]
    return TEMPERATURES[-1]
