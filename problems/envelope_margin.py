"""What the missions save at different manoeuvre margins, on the surrogate: the batched pointwise schedule and the
trajectory, flown on the fine grid from one take-off mass."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from vrsopt.mission.file import read_mission
from vrsopt.schedule.mission_setup import MissionSetup
from vrsopt.schedule.pointwise import pointwise_schedule
from vrsopt.schedule.refinement import refined_trajectory

MARGINS = (1.0, 1.15, 1.3, 1.5)
MISSIONS = ("patm", "lem", "sarm")
SCHEDULES = ("pointwise", "trajectory")
FOLDER = Path(__file__).parent


def mission_savings() -> Mapping[str, Mapping[float, Mapping[str, float]]]:
    """Change of fuel [%] against nominal by mission, margin and schedule; and the share of time [%] that the trajectory
    is on the blade loading, "on_margin_percent"."""
    return {name.upper(): {margin: _savings(name, margin) for margin in MARGINS} for name in MISSIONS}


def _savings(name: str, margin: float) -> Mapping[str, float]:
    mission = read_mission(FOLDER / f"{name}.toml")
    limits = mission.limits.model_copy(update={"manoeuvre_margin": margin})
    setup = MissionSetup(mission.model_copy(update={"limits": limits}))
    mass, settings, grid = setup.loading.takeoff_mass, setup.settings, setup.grid
    schedules = {
        "pointwise": pointwise_schedule(
            setup.profile, setup.make, takeoff_mass=mass, settings=settings, method="batched", grid=grid
        ),
        "trajectory": refined_trajectory(grid, setup.make, takeoff_mass=mass, settings=settings).schedule,
    }
    nominal = grid.fly(setup.nominal, takeoff_mass=mass).fuel
    flights = {key: grid.fly(schedule, takeoff_mass=mass) for key, schedule in schedules.items()}
    for key, flight in flights.items():
        if not flight.success:
            raise SystemExit(f"{name}: {key} at margin {margin:g}: {flight.message}")
    changes = {key: 100.0 * (flight.fuel / nominal - 1.0) for key, flight in flights.items()}
    return changes | {"on_margin_percent": 100.0 * flights["trajectory"].time_on_limits["blade loading"]}
