"""Component maps: smooth analytic shapes that extrapolate safely, scaled through the design point.

All functions take floats or CasADi expressions. Tables are avoided on purpose: their kinks cost Newton steps, and their
edges cost convergence. Who wants a table nevertheless passes other functions in a :class:`ComponentMaps`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from vrsopt.turboshaft.data import CombustorData, CompressorData, GasGeneratorTurbineData, PowerTurbineData

TurbineData = GasGeneratorTurbineData | PowerTurbineData

# Exponents of the combustor loading W / (P^1.8 exp(T/300 K) V): Walsh & Fletcher, Gas Turbine Performance (2004), 5.10
LOADING_PRESSURE = 1.8
LOADING_TEMPERATURE = 300.0  # K


@dataclass(frozen=True)
class TurbineState:
    """Where a turbine works; all but the two expansion ratios are over their values at the design point."""

    speed: Any  # of the shaft
    corrected_speed: Any  # speed / sqrt(R T) at the inlet
    spouting: Any  # root of the isentropic enthalpy drop: the spouting velocity
    expansion_ratio: Any  # inlet over exit pressure
    design_expansion_ratio: float


@dataclass(frozen=True)
class ComponentMaps:
    """The maps of a gas path as functions; the default are the analytic shapes of this module.

    ``compressor(data, speed, beta, pressure_ratio=)``: see :func:`compressor_map`. ``gas_generator_turbine`` and
    ``power_turbine(data, state)``: see :func:`turbine_map`. Each must return its design values at the design point
    (speeds 1, beta 0). ``symbols``: ``ca.MX`` where a function holds tables (interpolants), which SX can not.
    """

    compressor: Callable[..., tuple[Any, Any, Any]]
    gas_generator_turbine: Callable[[Any, TurbineState], tuple[Any, Any]]
    power_turbine: Callable[[Any, TurbineState], tuple[Any, Any]]
    symbols: Any = ca.SX


def compressor_map(data: CompressorData, speed: Any, beta: Any, *, pressure_ratio: float) -> tuple[Any, Any, Any]:
    """Corrected flow relative to the design point, pressure ratio and efficiency of the compressor.

    ``speed`` is the corrected speed, 1 at the design point; ``beta`` the map coordinate along a speed line: 0 the line
    of the design point, negative towards surge, positive towards choke, where speed lines turn vertical.
    ``pressure_ratio`` is the design point's.
    """
    spread = data.flow_spread * speed ** (-data.flow_spread_exponent)
    sharpness = data.choke_sharpness
    flow = speed**data.flow_speed_exponent * (1.0 + spread * (1.0 - ca.exp(-sharpness * beta)) / sharpness)
    rise = speed**data.pressure_speed_exponent * ca.exp(-data.pressure_spread * beta)
    off = speed - 1.0
    shape = 1.0 - data.efficiency_curvature * off**2 - data.efficiency_slope * off
    efficiency = data.efficiency * shape * ca.exp(-data.efficiency_beta_curvature * beta**2)
    return flow, 1.0 + (pressure_ratio - 1.0) * rise, efficiency


def turbine_map(data: TurbineData, state: TurbineState) -> tuple[Any, Any]:
    """Square of the flow function W sqrt(R T)/P, and work per kg (efficiency times isentropic drop), of a turbine, both
    over their values at the design point. Squared, because the root is singular at an expansion ratio of one."""
    flow = swallowing(state.expansion_ratio, data.flow_exponent) / swallowing(
        state.design_expansion_ratio, data.flow_exponent
    )
    return flow, turbine_work(data.speed_curvature, state.speed, state.spouting)


def power_turbine_map(data: PowerTurbineData, state: TurbineState) -> tuple[Any, Any]:
    """:func:`turbine_map` of a turbine whose best velocity ratio need not be the design point's."""
    flow, _ = turbine_map(data, state)
    return flow, turbine_work(data.speed_curvature, state.speed, state.spouting, best=data.best_velocity_ratio)


ANALYTIC = ComponentMaps(compressor_map, turbine_map, power_turbine_map)


def surge_margin(
    maps: ComponentMaps, data: CompressorData, speed: Any, *, at: tuple[Any, Any], pressure_ratio: float
) -> Any:
    """How far the point ``at`` (flow relative to the design point, pressure ratio) is from surge at its corrected
    speed: pressure ratio over flow on the surge line over that at the point, less one.

    This is the margin at constant speed, pyCycle's ``SMN``; the one at constant flow is another number, 25 instead of
    20 % at the shipped engine's design point, with the same sign. The surge line is where the map coordinate is
    ``data.surge_coordinate``; at or beyond it the margin is not positive.
    """
    flow, ratio, _ = maps.compressor(data, speed, data.surge_coordinate, pressure_ratio=pressure_ratio)
    return ratio / flow * at[0] / at[1] - 1.0


def combustion_efficiency(data: CombustorData, loading: Any) -> Any:
    """Combustion efficiency over the combustor loading relative to the design point's (:func:`combustor_loading`).

    The loss grows as exp(slope L + curvature L^2), L = ln(loading), and saturates at ``loss_ceiling``. With slope and
    curvature zero the efficiency is constant.
    """
    design_loss, ceiling = 1.0 - data.efficiency, data.loss_ceiling
    log_loading = ca.log(loading)
    growth = ca.exp(data.loss_slope * log_loading + data.loss_curvature * log_loading**2)
    return 1.0 - design_loss * growth * (1.0 + design_loss / ceiling) / (1.0 + design_loss * growth / ceiling)


def combustor_loading(air_flow: Any, pressure: Any, temperature: Any) -> Any:
    """Loading of a combustor of unit volume: air flow over what its reactions could take, both growing with pressure
    and inlet temperature. Lean-light altitude and hot days act through it; SI units, to be used as a ratio."""
    return air_flow / (pressure**LOADING_PRESSURE * ca.exp(temperature / LOADING_TEMPERATURE))


def turbine_work(curvature: float, speed: Any, spouting_velocity: Any, *, best: float = 1.0) -> Any:
    """Turbine work over the design point's: efficiency times isentropic drop, regular down to no drop at all.

    ``spouting_velocity`` c = sqrt(isentropic drop/its design value). w = c^2 - a [(n - b c)^2 - (1 - b)^2 c^2]:
    efficiency is a parabola of the velocity ratio n/c, highest at b = ``best``; with b = 1, c^2 [1 - a (n/c - 1)^2].
    ``speed`` n over that of the design point; ``curvature``: a.
    """
    c = spouting_velocity
    return c**2 - curvature * ((speed - best * c) ** 2 - (1.0 - best) ** 2 * c**2)


def swallowing(expansion_ratio: Any, exponent: float) -> Any:
    """Square of the flow function of a turbine up to a constant: 1 - ratio^-exponent (an ellipse that chokes).

    ``expansion_ratio``: inlet over exit pressure.
    """
    return 1.0 - expansion_ratio ** (-exponent)
