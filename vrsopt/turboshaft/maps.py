"""Component maps: smooth analytic shapes that extrapolate safely, scaled through the design point.

All functions take floats or CasADi expressions. Tables are avoided on purpose: their kinks cost Newton steps, and their
edges cost convergence.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from vrsopt.turboshaft.data import CombustorData, CompressorData


def compressor_map(data: CompressorData, speed: Any, beta: Any, *, pressure_ratio: float) -> tuple[Any, Any, Any]:
    """Corrected flow relative to the design point, pressure ratio and efficiency of the compressor.

    ``speed`` is the corrected speed, 1 at the design point; ``beta`` the map coordinate along a speed line: -1 about
    surge, 0 the line of the design point, positive towards choke, where speed lines turn vertical.
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


def combustion_efficiency(data: CombustorData, pressure_ratio_to_design: Any) -> Any:
    """Combustion efficiency over P3/P3 of the design point, after the CO and HC that FOCA gives at part power.

    The loss grows as exp(-slope L + curvature L^2), L = ln(P3/P3d), and saturates at ``loss_ceiling``. With slope and
    curvature zero the efficiency is constant.
    """
    design_loss, ceiling = 1.0 - data.efficiency, data.loss_ceiling
    log_ratio = ca.log(pressure_ratio_to_design)
    growth = ca.exp(-data.loss_slope * log_ratio + data.loss_curvature * log_ratio**2)
    return 1.0 - design_loss * growth * (1.0 + design_loss / ceiling) / (1.0 + design_loss * growth / ceiling)


def turbine_efficiency(design_efficiency: Any, curvature: float, speed: Any, isentropic_work_ratio: Any) -> Any:
    """Turbine efficiency over the velocity ratio U/C0: highest at the design point's.

    ``isentropic_work_ratio`` is the isentropic enthalpy drop over the design point's.
    """
    velocity_ratio = speed / ca.sqrt(isentropic_work_ratio)
    return design_efficiency * (1.0 - curvature * (velocity_ratio - 1.0) ** 2)


def turbine_work(curvature: float, speed: Any, spouting_velocity: Any) -> Any:
    """Turbine work over the design point's: efficiency times isentropic drop, regular down to no drop at all.

    ``spouting_velocity`` c = sqrt(isentropic drop/its design value). Equals c^2 [1 - a (n/c - 1)^2].
    """
    return spouting_velocity**2 - curvature * (speed - spouting_velocity) ** 2


def swallowing(expansion_ratio: Any, exponent: float) -> Any:
    """Square of the flow function of a turbine up to a constant: 1 - ratio^-exponent (an ellipse that chokes).

    Squared, because the root is singular at an expansion ratio of one.
    """
    return 1.0 - expansion_ratio ** (-exponent)
