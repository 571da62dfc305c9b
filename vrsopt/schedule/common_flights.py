"""All schedules of a comparison flown from the same state on the same grids: on the surrogate and on the physics."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Mapping
from typing import Any

import joblib

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.mission.profile import Profile
from vrsopt.schedule.activity import active_limits
from vrsopt.schedule.comparison import ScheduleResult
from vrsopt.schedule.decision import decision_nodes
from vrsopt.schedule.emissions import changes
from vrsopt.schedule.flight_nodes import flight_nodes
from vrsopt.schedule.mission_setup import MissionSetup
from vrsopt.schedule.reliance import reliance
from vrsopt.schedule.rotor_energy import rotor_energy
from vrsopt.schedule.schedule import Schedule, ScheduleSettings
from vrsopt.schedule.step_times import StepTimes
from vrsopt.schedule.verify import PhysicsFlight, fly_physics

BASE = "nominal"  # with which every schedule is compared
DECISION_STEP = 60.0  # s


def fly_all(
    schedules: Mapping[str, Schedule],
    setups: Mapping[str, MissionSetup],
    *,
    settings: ScheduleSettings,
    timed: StepTimes,
    workers: int,
) -> dict[str, ScheduleResult]:
    """Fly ``schedules``, the nominal one among them, each with its aircraft, that of ``setups``.

    All take off with the mass of the nominal schedule of its aircraft.
    """
    setup = setups[BASE]
    mass, profile, loading = setup.loading.takeoff_mass, setup.profile, setup.loading
    with timed("re-flight on the surrogate"):
        flights = {name: setups[name].grid.fly(one, takeoff_mass=mass) for name, one in schedules.items()}
        emissions = {name: setups[name].grid.emissions(flight) for name, flight in flights.items()}
    physics = _on_physics(schedules, setups, timed, workers)
    with timed("accounts"):
        decisions = decision_nodes(profile, DECISION_STEP)
        return {
            name: ScheduleResult(
                schedule=schedule,
                flight=flights[name],
                physics=physics[name],
                emissions=emissions[name],
                fuel_delta_percent=100 * (flights[name].fuel / flights[BASE].fuel - 1),
                fuel_delta_closed_percent=100 * (_closed_fuel(name, setups[name], schedule) / loading.fuel_burned - 1),
                fuel_physics_delta_percent=100 * (physics[name].fuel / physics[BASE].fuel - 1),
                changes=changes(emissions[name], emissions[BASE]),
                physics_changes=changes(physics[name].emissions, physics[BASE].emissions),
                energy=rotor_energy(setups[name].grid, flights[name]),
                active=active_limits(setups[name].grid, flights[name], settings),
                reliance=reliance(setups[name].make, decisions, setups[name].grid, flights[name]),
                corrected=name == "consistent",
            )
            for name, schedule in schedules.items()
        }


def _on_physics(
    schedules: Mapping[str, Schedule], setups: Mapping[str, MissionSetup], timed: StepTimes, workers: int
) -> dict[str, PhysicsFlight]:
    setup, jobs = setups[BASE], min(workers, len(schedules))
    options: dict[str, Any] = {
        "limits": setup.limits,
        "takeoff_mass": setup.loading.takeoff_mass,
        "nodes": flight_nodes(setup.profile, schedules.values()),  # the same for all
        "spin_down_credit": setup.settings.spin_down_credit,
    }
    with timed("re-flight on the physics") as step, joblib.parallel_config(backend="loky", inner_max_num_threads=1):
        flights = joblib.Parallel(n_jobs=jobs, return_as="generator")(
            joblib.delayed(_fly)(setup.profile, schedule, transmission=setups[name].transmission, **options)
            for name, schedule in schedules.items()
        )
        flown = []
        for flight in flights:
            flown.append(flight)
            timed.say(f"re-flight on the physics, {len(flown)} of {len(schedules)} schedules flown")
        if jobs > 1:
            step.cpu_s += sum(cpu for _, cpu in flown)
    return {name: flight for name, (flight, _) in zip(schedules, flown, strict=True)}


def _fly(profile: Profile, schedule: Schedule, **options: Any) -> tuple[PhysicsFlight, float]:
    """The flight, and how long it took the processor [s]."""
    begun = clock.process_time()
    return fly_physics(profile, schedule, **options), clock.process_time() - begun


def _closed_fuel(name: str, setup: MissionSetup, schedule: Schedule) -> float:
    """Fuel [kg] burned when the take-off mass is closed for ``schedule``; nan if that leaves the sampled box."""
    try:
        return (setup.loading if name == BASE else setup.close(schedule)).fuel_burned
    except (InputError, NoSolutionError):
        return math.nan
