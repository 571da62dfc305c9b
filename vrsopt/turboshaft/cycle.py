"""Off-design gas path of a turboshaft: nine unknowns, nine smooth residuals, three ways to say what is demanded.

Modes: ``power`` (demand is shaft power in W), ``gas_generator_speed`` (demand is the speed ratio) and ``temperature``
(demand is the inter-turbine temperature in K). Everything is scaled through the design point, so the residual there is
zero by construction and one start, the design point, serves the whole operating range.

Method: component matching with maps scaled through the design point (Walsh & Fletcher, Gas Turbine Performance, 2004).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import casadi as ca

from vrsopt.errors import InputError
from vrsopt.residual import Named, ResidualSystem, Unknown
from vrsopt.turboshaft.data import EngineData
from vrsopt.turboshaft.design_point import DesignPoint, design_point
from vrsopt.turboshaft.maps import ANALYTIC, ComponentMaps
from vrsopt.turboshaft.stations import Path, State

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
PARAMETERS = (
    Named("power_turbine_speed", "-"),
    Named("altitude", "m"),
    Named("isa_offset", "K"),
    Named("mach", "-"),
    Named("bleed_fraction", "-"),
    Named("power_offtake", "W"),
    Named("humidity", "-"),
)  # after the demand
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
    Named("burnt_fuel_flow", "kg/s"),
    Named("hydrocarbon_index", "kg/kg"),
    Named("compressor_efficiency", "-"),
    Named("compressor_speed", "-"),
    Named("map_coordinate", "-"),
    Named("surge_margin", "-"),
    Named("inlet_temperature", "K"),
    Named("best_power_turbine_speed", "-"),
)


def gas_path(engine: EngineData, mode: Mode = "power", *, maps: ComponentMaps = ANALYTIC) -> ResidualSystem:
    """The gas path of ``engine`` as a residual system (SX, 9 unknowns), for one engine.

    Parameters: ``demand`` (W, ratio or K by ``mode``), ``power_turbine_speed`` (ratio), ``altitude`` (m, pressure
    altitude), ``isa_offset`` (K), ``mach``, ``bleed_fraction`` (of the compressor's air), ``power_offtake`` (W, from
    the gas generator), ``humidity`` (kg of water vapour per kg of dry air). Air flows are of moist air,
    ``fuel_air_ratio`` is that of the combustor, per dry air; for ``surge_margin`` see
    :func:`vrsopt.turboshaft.maps.surge_margin`. ``maps`` replaces the component maps (a record with tables makes an MX
    system). Built once per engine, mode and maps. Raises :class:`InputError` for an unknown mode.
    """
    if mode not in DEMAND_UNITS:
        raise InputError(f"{engine.name}: mode = {mode!r}: expected one of: {', '.join(DEMAND_UNITS)}")
    return _built(engine.model_dump_json(), mode, maps)


def sized(engine: EngineData) -> DesignPoint:
    """The design point of ``engine``, computed once."""
    return _sized(engine.model_dump_json())


@lru_cache(maxsize=16)
def _sized(engine: str) -> DesignPoint:
    return design_point(EngineData.model_validate_json(engine))


@lru_cache(maxsize=16)
def _built(text: str, mode: Mode, maps: ComponentMaps) -> ResidualSystem:
    engine, design = EngineData.model_validate_json(text), _sized(text)
    x, p = maps.symbols.sym("x", len(UNKNOWNS)), maps.symbols.sym("p", 1 + len(PARAMETERS))
    demand, *places = ca.vertsplit(p)
    place = dict(zip((parameter.name for parameter in PARAMETERS), places, strict=True))
    path = Path(engine, design, maps, State(*ca.vertsplit(x)), **place)
    reached, size = {
        "power": (path.outputs["power"], design.power),
        "gas_generator_speed": (path.outputs["gas_generator_speed"], 1.0),
        "temperature": (path.outputs["power_turbine_inlet_temperature"], design.t45),
    }[mode]
    residuals = {**path.residuals, "demand": (reached - demand) / size}
    return ResidualSystem(
        name=f"{engine.name} gas path",
        unknowns=UNKNOWNS,
        parameters=(Named("demand", DEMAND_UNITS[mode]), *PARAMETERS),
        residuals=tuple(Named(name) for name in residuals),
        outputs=OUTPUTS,
        x=x,
        p=p,
        r=ca.vertcat(*residuals.values()),
        y=ca.vertcat(*(path.outputs[output.name] for output in OUTPUTS)),
    )
