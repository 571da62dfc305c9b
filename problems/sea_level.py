"""The gas path of an engine at sea level on a standard dry day, as the studies of the engine look at it."""

from __future__ import annotations

from vrsopt.solution import Solution
from vrsopt.turboshaft.cycle import Mode, gas_path
from vrsopt.turboshaft.data import EngineData
from vrsopt.turboshaft.maps import ANALYTIC, ComponentMaps


def at_sea_level(
    engine: EngineData,
    demand: float,
    *,
    mode: Mode = "power",
    speed: float = 1.0,
    mach: float = 0.0,
    maps: ComponentMaps = ANALYTIC,
) -> Solution:
    """Gas path at ``demand`` [W, or that of the mode], power-turbine speed (ratio) and Mach number."""
    system = gas_path(engine, mode, maps=maps)
    place = dict.fromkeys((parameter.name for parameter in system.parameters), 0.0)
    return system.solve(place | {"demand": demand, "power_turbine_speed": speed, "mach": mach}, method="newton")
