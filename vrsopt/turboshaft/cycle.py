"""Off-design gas path of a turboshaft: nine unknowns, nine smooth residuals, three ways to say what is demanded.

Modes: ``power`` (demand is shaft power in W), ``gas_generator_speed`` (demand is the speed ratio) and ``temperature``
(demand is the inter-turbine temperature in K). Everything is scaled through the design point, so the residual there is
zero by construction and one start, the design point, serves the whole operating range.

Method: component matching with maps scaled through the design point (Walsh & Fletcher, Gas Turbine Performance, 2004).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Literal

import casadi as ca

from vrsopt.atmosphere import SEA_LEVEL_PRESSURE, SEA_LEVEL_TEMPERATURE, standard_air
from vrsopt.errors import InputError
from vrsopt.residual import Named, ResidualSystem, Unknown
from vrsopt.turboshaft.data import EngineData
from vrsopt.turboshaft.design_point import DesignPoint, design_point
from vrsopt.turboshaft.gas import (
    enthalpy,
    entropy_function,
    fuel_enthalpy,
    gas_constant,
    heat_capacity,
    heat_capacity_ratio,
)
from vrsopt.turboshaft.maps import combustion_efficiency, compressor_map, swallowing, turbine_efficiency, turbine_work

Mode = Literal["power", "gas_generator_speed", "temperature"]
DEMAND_UNITS: dict[str, str] = {"power": "W", "gas_generator_speed": "-", "temperature": "K"}

# Temperatures enter as T = T_design exp(u - 1): positive for any u. The wide bounds keep IPOPT off mirror roots.
_TEMPERATURE = {"unit": "-", "lower": 0.3, "upper": 1.5, "start": 1.0}
UNKNOWNS = (
    Unknown("gas_generator_speed", "-", lower=0.3, upper=1.3, start=1.0),
    Unknown("map_coordinate", "-", lower=-1.5, upper=1.5, start=0.0),
    Unknown("log_compressor_exit_temperature_ideal", **_TEMPERATURE),  # type: ignore[arg-type]
    Unknown("log_compressor_exit_temperature", **_TEMPERATURE),  # type: ignore[arg-type]
    Unknown("log_turbine_inlet_temperature", **_TEMPERATURE),  # type: ignore[arg-type]
    Unknown("log_inter_turbine_temperature_ideal", **_TEMPERATURE),  # type: ignore[arg-type]
    Unknown("log_inter_turbine_temperature_uncooled", **_TEMPERATURE),  # type: ignore[arg-type]
    Unknown("power_turbine_expansion", "-", lower=0.05, upper=2.0, start=1.0),
    Unknown("log_exhaust_temperature", **_TEMPERATURE),  # type: ignore[arg-type]
)
OUTPUTS = (
    Named("power", "W"),
    Named("fuel_flow", "kg/s"),
    Named("co2_flow", "kg/s"),
    Named("gas_generator_speed", "-"),
    Named("turbine_inlet_temperature", "K"),
    Named("power_turbine_inlet_temperature", "K"),
    Named("exhaust_temperature", "K"),
    Named("compressor_exit_temperature", "K"),
    Named("compressor_exit_pressure", "Pa"),
    Named("pressure_ratio", "-"),
    Named("air_flow", "kg/s"),
    Named("combustor_air_flow", "kg/s"),
    Named("fuel_air_ratio", "-"),
    Named("combustion_efficiency", "-"),
    Named("compressor_efficiency", "-"),
    Named("map_coordinate", "-"),
    Named("best_power_turbine_speed", "-"),
)


def gas_path(engine: EngineData, mode: Mode = "power") -> ResidualSystem:
    """The gas path of ``engine`` as a residual system (SX, 9 unknowns), for one engine.

    Parameters: ``demand`` (W, ratio or K by ``mode``), ``power_turbine_speed`` (ratio), ``altitude`` (m, pressure
    altitude), ``isa_offset`` (K), ``mach``, ``bleed_fraction`` (of the compressor's air), ``power_offtake`` (W, from
    the gas generator), ``humidity`` (kg of water vapour per kg of dry air). Combustion efficiency falls with combustor pressure, as the data file says. Built once per
    engine and mode. Raises :class:`InputError` for an unknown mode.
    """
    if mode not in DEMAND_UNITS:
        raise InputError(f"{engine.name}: mode = {mode!r}: expected one of: {', '.join(DEMAND_UNITS)}")
    return _built(engine.model_dump_json(), mode)


def sized(engine: EngineData) -> DesignPoint:
    """The design point of ``engine``, computed once."""
    return _sized(engine.model_dump_json())


@lru_cache(maxsize=16)
def _sized(engine: str) -> DesignPoint:
    return design_point(EngineData.model_validate_json(engine))


@lru_cache(maxsize=16)
def _built(text: str, mode: Mode) -> ResidualSystem:
    engine, design = EngineData.model_validate_json(text), _sized(text)
    x, p = ca.SX.sym("x", len(UNKNOWNS)), ca.SX.sym("p", 8)
    residuals, outputs = _equations(engine, design, x, p)
    reached = {
        "power": outputs["power"] / design.power,
        "gas_generator_speed": outputs["gas_generator_speed"],
        "temperature": outputs["power_turbine_inlet_temperature"] / design.t45,
    }[mode]
    size = {"power": design.power, "gas_generator_speed": 1.0, "temperature": design.t45}[mode]
    residuals["demand"] = reached - p[0] / size
    return ResidualSystem(
        name=f"{engine.name} gas path",
        unknowns=UNKNOWNS,
        parameters=(
            Named("demand", DEMAND_UNITS[mode]),
            Named("power_turbine_speed", "-"),
            Named("altitude", "m"),
            Named("isa_offset", "K"),
            Named("mach", "-"),
            Named("bleed_fraction", "-"),
            Named("power_offtake", "W"),
            Named("humidity", "-"),
        ),
        residuals=tuple(Named(name) for name in residuals),
        outputs=OUTPUTS,
        x=x,
        p=p,
        r=ca.vertcat(*residuals.values()),
        y=ca.vertcat(*(outputs[output.name] for output in OUTPUTS)),
    )


def _equations(engine: EngineData, design: DesignPoint, x: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Scaled residuals (all but the demand) and outputs by name, station by station along the gas path."""
    ggt, pt, burner = engine.gas_generator_turbine, engine.power_turbine, engine.combustor
    speed, beta = x[0], x[1]
    t3s, t3, t4, t45s, t45u, t5 = (
        value * ca.exp(x[i] - 1.0)
        for value, i in (
            (design.t3_ideal, 2),
            (design.t3, 3),
            (design.t4, 4),
            (design.t45_ideal, 5),
            (design.t45_uncooled, 6),
            (design.t5, 8),
        )
    )
    expansion = design.expansion * x[7]
    _, n2, altitude, isa_offset, mach, bleed, offtake, humidity = ca.vertsplit(p)

    ambient = standard_air(altitude, isa_offset)
    t2, stagnation_ratio = stagnation(ambient.temperature, mach, humidity)
    p2 = ambient.pressure * stagnation_ratio * (1.0 - engine.intake.pressure_loss)
    sound, flow_unit = similarity(t2, p2, humidity)

    relative_flow, pressure_ratio, eta_c = compressor_map(
        engine.compressor, speed / sound, beta, pressure_ratio=design.pressure_ratio
    )
    air = design.corrected_air_flow * relative_flow * flow_unit
    h2, h3 = enthalpy(t2, 0.0, humidity), enthalpy(t3, 0.0, humidity)
    p3 = p2 * pressure_ratio

    burnt = air * (1.0 - bleed - ggt.cooling_fraction)
    dry = burnt / (1.0 + humidity)
    eta_b = combustion_efficiency(burner, p3 / design.compressor_exit_pressure)
    # energy per kg of dry air: air and vapour are heated, the fuel adds its heat and the heat of its products
    f4 = (1.0 + humidity) * (enthalpy(t4, 0.0, humidity) - h3) / (eta_b * burner.heating_value - fuel_enthalpy(t4))
    fuel = f4 * dry
    gas3, gas4 = gas_constant(0.0, humidity), gas_constant(f4, humidity)
    loss = burner.pressure_loss * (burnt / p3) ** 2 * gas3 * t3 / design.combustor_parameter
    p4, w4, h4 = p3 * (1.0 - loss), burnt + fuel, enthalpy(t4, f4, humidity)

    ratio_gg = ca.exp((entropy_function(t4, f4, humidity) - entropy_function(t45s, f4, humidity)) / gas4)
    drop_gg, h45u = h4 - enthalpy(t45s, f4, humidity), enthalpy(t45u, f4, humidity)
    eta_gg = turbine_efficiency(ggt.efficiency, ggt.speed_curvature, speed, drop_gg / design.gas_generator_drop)

    cooling = air * ggt.cooling_fraction
    w45, f45 = w4 + cooling, fuel * (1.0 + humidity) / (burnt + cooling)
    h45 = (w4 * h45u + cooling * h3) / w45
    t45 = t45u  # mixing changes it by some 10 K: two Newton steps are exact to 1e-8 K
    for _ in range(2):
        t45 = t45 - (enthalpy(t45, f45, humidity) - h45) / heat_capacity(t45, f45, humidity)
    p45u, gas45 = p4 / ratio_gg, gas_constant(f45, humidity)
    p45 = p45u * (1.0 - pt.duct_pressure_loss * (w45 / p45u) ** 2 * gas45 * t45 / design.duct_parameter)

    t5s = t45 * ca.exp(-(expansion**2))
    ratio_pt = ca.exp((entropy_function(t45, f45, humidity) - entropy_function(t5s, f45, humidity)) / gas45)
    spouting = ca.sqrt((h45 - enthalpy(t5s, f45, humidity)) / design.power_turbine_drop)
    work_pt = (
        design.power_turbine_efficiency * design.power_turbine_drop * turbine_work(pt.speed_curvature, n2, spouting)
    )
    h5, p5 = enthalpy(t5, f45, humidity), p45 / ratio_pt
    power = pt.mechanical_efficiency * w45 * (h45 - h5)

    shaft = air * (h3 - h2) / ggt.mechanical_efficiency + ggt.accessory_power * speed + offtake
    residuals = {
        "compression": (entropy_function(t3s, 0.0, humidity) - entropy_function(t2, 0.0, humidity)) / gas3
        - ca.log(pressure_ratio),
        "compressor work": (eta_c * (h3 - h2) - (enthalpy(t3s, 0.0, humidity) - h2))
        / (design.compressor_work * engine.compressor.efficiency),
        "gas-generator turbine flow": (w4 / p4 / design.gas_generator_constant) ** 2 * gas4 * t4
        - swallowing(ratio_gg, ggt.flow_exponent),
        "gas-generator turbine work": (h4 - h45u - eta_gg * drop_gg) / (ggt.efficiency * design.gas_generator_drop),
        "gas-generator shaft": (w4 * (h4 - h45u) - shaft) / (design.air_flow * design.compressor_work),
        "power turbine flow": (w45 / p45 / design.power_turbine_constant) ** 2 * gas45 * t45
        - swallowing(ratio_pt, pt.flow_exponent),
        "power turbine work": (h45 - h5 - work_pt) / (design.power_turbine_efficiency * design.power_turbine_drop),
        "exhaust": p5 / ambient.pressure - 1.0 - design.exhaust_constant * (w45 / p5) ** 2 * gas45 * t5,
    }
    outputs = {
        "power": power,
        "fuel_flow": fuel,
        "co2_flow": burner.co2_per_fuel * fuel,
        "gas_generator_speed": speed,
        "turbine_inlet_temperature": t4,
        "power_turbine_inlet_temperature": t45,
        "exhaust_temperature": t5,
        "compressor_exit_temperature": t3,
        "compressor_exit_pressure": p3,
        "pressure_ratio": pressure_ratio,
        "air_flow": air,
        "combustor_air_flow": burnt,
        "fuel_air_ratio": f4,
        "combustion_efficiency": eta_b,
        "compressor_efficiency": eta_c,
        "map_coordinate": beta,
        "best_power_turbine_speed": spouting,
    }
    return residuals, outputs


def stagnation(temperature: Any, mach: Any, humidity: Any) -> tuple[Any, Any]:
    """Stagnation temperature [K] and stagnation over static pressure of humid air at static ``temperature`` [K]."""
    gas = gas_constant(0.0, humidity)
    kinetic = 0.5 * mach**2 * heat_capacity_ratio(temperature, 0.0, humidity) * gas * temperature
    still, total = enthalpy(temperature, 0.0, humidity), temperature * (1.0 + 0.2 * mach**2)
    for _ in range(2):  # exact to 1e-9 K below Mach 0.5
        total = total - (enthalpy(total, 0.0, humidity) - still - kinetic) / heat_capacity(total, 0.0, humidity)
    rise = entropy_function(total, 0.0, humidity) - entropy_function(temperature, 0.0, humidity)
    return total, ca.exp(rise / gas)


def similarity(temperature: Any, pressure: Any, humidity: Any) -> tuple[Any, Any]:
    """Units of speed, sqrt(gamma R T), and of flow, P sqrt(gamma / (R T)), at a compressor's inlet over their values in
    dry air at 288.15 K and 101325 Pa: equal Mach numbers at equal speed and flow over these units."""
    gas = gas_constant(0.0, humidity) / gas_constant()
    gamma = heat_capacity_ratio(temperature, 0.0, humidity) / heat_capacity_ratio(SEA_LEVEL_TEMPERATURE)
    theta = gas * temperature / SEA_LEVEL_TEMPERATURE
    return ca.sqrt(gamma * theta), pressure / SEA_LEVEL_PRESSURE * ca.sqrt(gamma / theta)
