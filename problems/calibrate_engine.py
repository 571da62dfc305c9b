"""Calibrate the engine's part-power curve on the flight manual's fuel flow, and judge the result.

Two points may be used: the design point (313 kW), which sizes the gas path and solves the power turbine's efficiency,
and one fuel flow at 257 kW. One number is solved on the latter. Which one: at a given design point the consumption at
82 % power changes by less than 0.4 % across the range of any component efficiency, loss or map exponent, but by 1.6 %
across that of the slope of the compressor's efficiency with speed (by 1.5 % across that of the power turbine's best
velocity ratio, of which the velocity triangles know). So the slope is the candidate; it is accepted only inside the
range that the data file states for it.

The same fuel flow solved through the level of consumption shows what a physical explanation would need.

Run: python problems/calibrate_engine.py
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq, least_squares

from vrsopt import foca
from vrsopt.atmosphere import standard_air
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.cycle import sized
from vrsopt.turboshaft.data import EngineData, load_engine
from vrsopt.turboshaft.performance import engine

CO_HEAT, FUEL_HEAT = 10.1e6, 43.1e6  # J/kg, of burning CO and fuel
VARIANTS = ("flight_manual_slope", "flight_manual_level")  # each holds one number solved here
B17F_POWER, B17F_RATIO = 0.698, 1.098  # sister engine 250-B17F: consumption at 69.8 % power over that at take-off


@dataclass(frozen=True)
class Calibrated:
    """One number solved on the fuel flow: where it is, its shipped and solved values, its range."""

    component: str
    parameter: str
    shipped: float
    solved: float
    range: tuple[float, float]

    @property
    def accepted(self) -> bool:
        return self.range[0] <= self.solved <= self.range[1]


def fuel_flow_error(data: EngineData) -> float:
    """Fuel flow [kg/h] of one engine at the calibration point minus the flight manual's."""
    point = data.calibration
    assert point is not None
    mach = point.true_airspeed / standard_air(0.0).speed_of_sound
    return engine(point.power, mach=mach, engine_data=data).fuel_flow_kg_s * 3600.0 - point.fuel_flow


def calibrate(data: EngineData, component: str, parameter: str, *, between: tuple[float, float]) -> Calibrated:
    """Solve one number of ``data`` so that the model's fuel flow is the flight manual's."""
    origin = getattr(data, component).provenance[parameter]
    assert origin.range is not None
    solved = brentq(lambda value: fuel_flow_error(data.changed(component, **{parameter: value})), *between, xtol=1e-9)
    return Calibrated(component, parameter, getattr(getattr(data, component), parameter), float(solved), origin.range)


def calibrate_all(data: EngineData) -> tuple[Calibrated, Calibrated]:
    """The slope (the calibration) and the level (the physical alternative)."""
    return (
        calibrate(data, "compressor", "efficiency_slope", between=(0.0, 3.0)),
        calibrate(data, "design_point", "sfc", between=(0.36, 0.41)),
    )


def fleet_loss(power: Any) -> Any:
    """Heat not released, as CO and unburnt fuel, over the heating value, at shaft power [W]: FOCA's fleet average."""
    return (CO_HEAT * foca.co_index(power) + FUEL_HEAT * foca.hc_index(power)) / FUEL_HEAT


def fit_combustion_loss(data: EngineData) -> tuple[float, float]:
    """Slope and curvature of the combustion loss over loading for the least squares of ln(loss/fleet's loss), from
    6.4 % of the take-off rating to all of it at sea level. The cycle takes part: loading depends on the loss."""
    power = np.geomspace(0.064, 1.0, 40) * data.ratings.take_off_power
    points = np.zeros((40, 8))
    points[:, 0], points[:, 1] = power, 1.0
    known = np.log(fleet_loss(power))

    def misfit(shape: np.ndarray) -> np.ndarray:
        engine_data = data.changed("combustor", loss_slope=float(shape[0]), loss_curvature=float(shape[1]))
        return np.log(1.0 - solve_many(points, engine_data=engine_data).outputs["combustion_efficiency"]) - known

    # a step well above what the solver leaves open, for derivatives by differences
    slope, curvature = least_squares(misfit, [0.0, 1.0], diff_step=1e-3, xtol=1e-6).x
    return float(slope), float(curvature)


def sister_engine_ratio(data: EngineData) -> float:
    """Specific consumption at 69.8 % power over that at take-off power."""
    full = data.ratings.take_off_power
    part, whole = (engine(power, engine_data=data).fuel_flow_kg_s / power for power in (B17F_POWER * full, full))
    return part / whole


def report(data: EngineData) -> list[str]:
    """What the calibration gives, as lines of text."""
    lines = ["number                       shipped    solved   range            verdict"]
    for item in calibrate_all(data):
        verdict = "accepted" if item.accepted else "outside: variant only"
        name = f"{item.component}.{item.parameter}"
        lines.append(f"{name:<28} {item.shipped:7.4f} {item.solved:9.5f}   {item.range!s:<15}  {verdict}")
    lines += [
        "",
        "engine                 kg/h at   SFC 257 kW  SFC 257 kW  B17F ratio  T45 at take-off  FOCA at 313/257/200 kW",
    ]
    lines += ["                       257 kW    131.5 kt    static      (1.098)     K                %"]
    engines = {"shipped": data} | {name: data.variant(name) for name in VARIANTS}
    for name, variant in engines.items():
        point = variant.calibration
        assert point is not None
        flow = point.fuel_flow + fuel_flow_error(variant)
        static = engine(point.power, engine_data=variant).sfc_kg_kwh
        fleet = [
            100 * (engine(p, engine_data=variant).fuel_flow_kg_s / foca.fuel_flow(p) - 1) for p in (313e3, 257e3, 200e3)
        ]
        lines.append(
            f"{name:<22} {flow:7.2f}   {flow / point.power * 1e3:8.4f}    {static:8.4f}    "
            f"{sister_engine_ratio(variant):7.4f}     {sized(variant).t45:7.1f}          "
            + " ".join(f"{value:+5.1f}" for value in fleet)
        )
    return lines


if __name__ == "__main__":
    print("\n".join(report(load_engine())))
