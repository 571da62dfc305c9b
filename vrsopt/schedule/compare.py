"""The main job: one mission, several schedules, all flown on one fine grid and on the physics from the same state."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import cached_property, lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

import joblib
import numpy as np
from rich.console import Console
from rich.progress import Progress

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.helicopter import MODEL_VERSION, Helicopter, helicopter
from vrsopt.limits import Limits
from vrsopt.mission.file import Mission, read_mission
from vrsopt.mission.loading import TakeoffLoading, close_takeoff_mass
from vrsopt.mission.profile import Conditions, Profile
from vrsopt.schedule.batched import batched_minimum, rotor_speed_band
from vrsopt.schedule.comparison import Band, Comparison, ScheduleResult
from vrsopt.schedule.emissions import changes
from vrsopt.schedule.genetic import GeneticOptions
from vrsopt.schedule.limiter import rate_limited_schedule
from vrsopt.schedule.nominal import nominal_schedule
from vrsopt.schedule.pointwise import pointwise_schedule
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import Schedule, ScheduleSettings, Variables
from vrsopt.schedule.surrogate_path import SurrogateAircraft
from vrsopt.schedule.trajectory import TrajectoryProblem
from vrsopt.schedule.verify import fly_physics
from vrsopt.surrogate.kriging import KrigingState
from vrsopt.surrogate.store import Surrogate, load

HEAVY_ENOUGH = 1.3  # times the lightest mass of the surrogate: what no mission burns off
SCHEDULES = ("nominal", "pointwise", "trajectory")
RESERVE_SPEEDS = np.arange(15.0, 46.0)  # m/s, among which the best-endurance speed is found


def solve(
    mission: Mission | Path | str,
    surrogate: Surrogate | Path | str | None = None,
    *,
    schedules: Sequence[str] = SCHEDULES,
    variables: str = "both",
    seed: int = 1,
    workers: int = 2,
    progress: bool = False,
) -> Comparison:
    """Schedule rotor speed and blade twist over ``mission`` and compare the schedules.

    ``mission``: a mission file (TOML) or a :class:`Mission`. ``surrogate``: fitted by :func:`vrsopt.fit`; default the
    shipped one. ``schedules``: some of nominal, pointwise, trajectory (pointwise is flown raw and rate limited).
    ``variables``: "both", "speed", "twist", or "all" three of them. ``seed`` is that of the genetic search. The result
    does not depend on ``workers``; ``progress`` shows the current step on standard error.

    Raises :class:`InputError` for unusable input and :class:`NoSolutionError` where the mission can not be flown.
    """
    task = mission if isinstance(mission, Mission) else read_mission(mission)
    names = _checked_schedules(schedules)
    if variables not in ("both", "speed", "twist", "all"):
        raise InputError(f"solve: variables = {variables!r}: one of both, speed, twist, all")
    bar = Progress(console=Console(stderr=True)) if progress else None
    with bar or nullcontext():
        row = bar.add_task(task.name, total=None) if bar else None

        def say(text: str) -> None:
            if bar is not None and row is not None:
                bar.update(row, description=f"{task.name}: {text}")

        try:
            study = _Study(task, surrogate, seed=seed, workers=workers, say=say)
        except (InputError, NoSolutionError) as error:
            raise type(error)(f"{task.name}: {str(error).removeprefix(f'{task.name}: ')}") from None
        if variables != "all":
            return study.compare(names, variables)  # type: ignore[arg-type]
        alone: tuple[Variables, ...] = ("speed", "twist")
        others = {f"{name}_only": study.compare(names, name) for name in alone}
        return replace(study.compare(names, "both"), variants=others)


class _Study:
    """One mission ready to be scheduled: aircraft, surrogate on the fine grid, take-off mass."""

    def __init__(
        self,
        mission: Mission,
        surrogate: Surrogate | Path | str | None,
        *,
        seed: int,
        workers: int,
        say: Callable[[str], None],
    ) -> None:
        self.mission, self.seed, self.workers, self.say = mission, seed, workers, say
        self.machine: Helicopter = helicopter(mission.aircraft)
        self.profile = Profile.of(mission)
        margin = mission.limits.manoeuvre_margin or self.machine.aircraft.blade_loading_limit.manoeuvre_margin
        self.limits = Limits(self.machine.aircraft, self.machine.engine, mission.limits.limits, margin)
        self.surrogate = _loaded(surrogate, self.machine.data_hash)
        self.settings = schedule_settings(mission, self.machine)
        self.make = SurrogateAircraft(self.surrogate, self.limits, isa_offset=mission.isa_offset_k)
        say("surrogate along the mission")
        self.grid = FlightGrid(self.profile, self.make)
        self.nominal = nominal_schedule(self.profile, self.settings)
        self.loading = self._close(self.nominal)
        self._check_mass()
        _ = self.make.plant.emission_table  # before the searches: what fails should fail at once

    def compare(self, names: Sequence[str], variables: Variables) -> Comparison:
        """Schedules of ``names`` with the given variables free, flown and compared."""
        settings = self.settings.restricted(variables)
        mass = self.loading.takeoff_mass
        found: dict[str, Schedule] = {"nominal": self.nominal}
        if "pointwise" in names:
            self.say("pointwise search")
            found["pointwise"] = pointwise_schedule(
                self.profile,
                self.make,
                takeoff_mass=mass,
                settings=settings,
                genetic=GeneticOptions(seed=self.seed),
                workers=self.workers,
            )
            found["pointwise_rate_limited"] = rate_limited_schedule(
                found["pointwise"], self.grid, takeoff_mass=mass, settings=settings
            )
        trajectory = None
        if "trajectory" in names:
            self.say("trajectory")
            trajectory = TrajectoryProblem(self.profile, self.make, settings=settings).solve(mass)
            found["trajectory"] = replace(trajectory.schedule, name="trajectory")
        self.say("re-flight on the physics")
        return Comparison(
            mission=self.mission,
            profile=self.profile,
            settings=settings,
            limits=self.limits,
            loading=self.loading,
            results=self._flown(found),
            band=self._band(settings),
            trajectory=trajectory,
            provenance={
                "model_version": MODEL_VERSION,
                "data_hash": self.surrogate.data_hash,
                "design_seed": self.surrogate.seed,
                "search_seed": self.seed,
                "variables": variables,
            },
        )

    def _flown(self, schedules: Mapping[str, Schedule]) -> dict[str, ScheduleResult]:
        mass = self.loading.takeoff_mass
        with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
            physics = joblib.Parallel(n_jobs=min(self.workers, len(schedules)))(
                joblib.delayed(fly_physics)(self.profile, schedule, limits=self.limits, takeoff_mass=mass)
                for schedule in schedules.values()
            )
        flights = {name: self.grid.fly(schedule, takeoff_mass=mass) for name, schedule in schedules.items()}
        emissions = {name: self.grid.emissions(flight) for name, flight in flights.items()}
        base, base_physics = flights["nominal"].fuel, physics[0].fuel
        return {
            name: ScheduleResult(
                schedule=schedule,
                flight=flights[name],
                physics=flown,
                emissions=emissions[name],
                fuel_delta_percent=100 * (flights[name].fuel / base - 1),
                fuel_delta_closed_percent=100 * (self._closed_fuel(name, schedule) / self.loading.fuel_burned - 1),
                fuel_physics_delta_percent=100 * (flown.fuel / base_physics - 1),
                changes=changes(emissions[name], emissions["nominal"]),
                physics_changes=changes(flown.emissions, physics[0].emissions),
            )
            for (name, schedule), flown in zip(schedules.items(), physics, strict=True)
        }

    def _closed_fuel(self, name: str, schedule: Schedule) -> float:
        """Fuel [kg] burned when the take-off mass is closed for ``schedule``; nan if that leaves the sampled box."""
        if name == "nominal":
            return self.loading.fuel_burned
        try:
            return self._close(schedule).fuel_burned
        except (InputError, NoSolutionError):
            return math.nan

    def _close(self, schedule: Schedule) -> TakeoffLoading:
        """Take-off mass with which ``schedule`` lands with the reserve."""
        loading = self.machine.aircraft.loading
        state: KrigingState = self.surrogate.models["main_rotor_power"].state_
        lightest = float(state.lower[state.names.index("mass")])

        def burn(mass: float) -> float:
            try:
                return self.grid.fly(schedule, takeoff_mass=mass).fuel
            except InputError:
                if mass > HEAVY_ENOUGH * lightest:
                    raise
                # The first iterates carry no fuel and may lie below the sampled box: a heavier aircraft stands in,
                # as the lightest one does for the reserve.
                return self.grid.fly(schedule, takeoff_mass=HEAVY_ENOUGH * lightest).fuel

        closed = close_takeoff_mass(
            burn,
            lambda landing_mass: self._reserve(max(landing_mass, lightest)),
            zero_fuel_mass=self.mission.loading.zero_fuel_mass,
            payload_change=float(np.sum(self.profile.mass_changes)),
            max_takeoff_mass=loading.largest_mass,
            tank_capacity=loading.fuel_capacity,
        )
        self.grid.fly(schedule, takeoff_mass=closed.takeoff_mass)  # raises if the solution itself is below the box
        return closed

    def _reserve(self, landing_mass: float) -> float:
        """Fuel [kg] for the reserve time at the speed of best endurance, nominal rotor, where the mission ends."""
        values = self._reserve_model.evaluate(
            np.full(len(RESERVE_SPEEDS), landing_mass), self.settings.nominal_rotor_speed, self.settings.nominal_twist
        )
        return 60 * self.mission.loading.reserve_minutes * float(np.min(values.fuel_flow))

    @cached_property
    def _reserve_model(self) -> Any:
        count = len(RESERVE_SPEEDS)
        altitude = np.full(count, self.profile.segments[-1].altitude_end)
        zero = np.zeros(count)
        level = Conditions(
            segment=zero.astype(int),
            time=zero,
            speed=RESERVE_SPEEDS,
            altitude=altitude,
            climb_angle=zero,
            load_factor=np.ones(count),
            idle=np.zeros(count, dtype=bool),
        )
        return self.make(level)

    def _check_mass(self) -> None:
        """The aircraft may be heaviest after a pick-up; raises :class:`NoSolutionError` above its largest mass."""
        flight = self.grid.fly(self.nominal, takeoff_mass=self.loading.takeoff_mass)
        node = int(np.argmax(flight.mass))
        largest = self.machine.aircraft.loading.largest_mass
        if flight.mass[node] > largest:
            task = self.profile.segments[flight.segment[node]].task
            raise NoSolutionError(
                f"{self.mission.name}: gross mass {flight.mass[node]:.0f} kg at {flight.time[node]:.0f} s ({task}), "
                f"{flight.mass[node] - largest:.0f} kg over the largest mass {largest:g} kg"
            )

    def _band(self, settings: ScheduleSettings) -> Band:
        """Rotor speeds within 0.5 % of least fuel at the decision nodes in flight, at the nominal schedule's mass."""
        grid = FlightGrid(self.profile, self.make, step=60.0)
        flying = np.flatnonzero(~np.asarray(grid.conditions.idle))
        mass = grid.fly(self.nominal, takeoff_mass=self.loading.takeoff_mass).mass[flying]
        model = grid.model.nodes(flying)
        box = settings.box(model.bounds)
        optima = batched_minimum(model, mass, box=box)
        lower, upper = rotor_speed_band(model, mass, optima=optima, box=box)
        return Band(grid.segment[flying], grid.time[flying], lower, upper)


def schedule_settings(mission: Mission, machine: Helicopter) -> ScheduleSettings:
    """The mission's limits on schedules in SI units, around the aircraft's nominal rotor speed and twist."""
    limits, rotor = mission.limits, machine.aircraft.main_rotor
    low, high = (percent / 100 * rotor.nominal_rotor_speed for percent in limits.rotor_speed_percent)
    return ScheduleSettings(
        nominal_rotor_speed=rotor.nominal_rotor_speed,
        nominal_twist=rotor.twist,
        rotor_speed_bounds=(low, high),
        twist_bounds=(math.radians(limits.twist_deg[0]), math.radians(limits.twist_deg[1])),
        rotor_speed_rate=limits.rotor_speed_rate_percent_s / 100 * rotor.nominal_rotor_speed,
        twist_rate=math.radians(limits.twist_rate_deg_s),
    )


def _checked_schedules(schedules: Sequence[str]) -> Sequence[str]:
    for name in schedules:
        if name not in SCHEDULES:
            raise InputError(f"solve: schedules: {name!r}: some of {', '.join(SCHEDULES)}")
    return schedules


def _loaded(surrogate: Surrogate | Path | str | None, hashed: str) -> Surrogate:
    """The surrogate of a file, or the shipped one; it must be of this model and this aircraft."""
    if isinstance(surrogate, Surrogate):
        return surrogate
    if surrogate is not None:
        return load(surrogate, model_version=MODEL_VERSION, data_hash=hashed)
    return _shipped(hashed)


@lru_cache(maxsize=1)
def _shipped(hashed: str) -> Surrogate:
    with resources.as_file(resources.files("vrsopt") / "data" / "surrogate.nc") as path:
        return load(path, model_version=MODEL_VERSION, data_hash=hashed)
