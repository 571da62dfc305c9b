"""The main job: one mission, several schedules, all flown on one fine grid and on the physics from the same state."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import joblib
from rich.console import Console
from rich.progress import Progress
from threadpoolctl import threadpool_limits

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.helicopter import MODEL_VERSION
from vrsopt.mission.file import Mission
from vrsopt.mission.track import FlownMission
from vrsopt.schedule.batched import batched_minimum, rotor_speed_band
from vrsopt.schedule.comparison import Band, Comparison, ScheduleResult
from vrsopt.schedule.decision import GROUND, decision_nodes
from vrsopt.schedule.emissions import changes
from vrsopt.schedule.flight_nodes import flight_nodes
from vrsopt.schedule.genetic import GeneticOptions
from vrsopt.schedule.limiter import rate_limited_schedule
from vrsopt.schedule.mission_setup import MissionSetup
from vrsopt.schedule.pointwise import pointwise_schedule
from vrsopt.schedule.prescribed import prescribed_schedule
from vrsopt.schedule.refinement import refined_trajectory
from vrsopt.schedule.reliance import reliance
from vrsopt.schedule.schedule import Schedule, ScheduleSettings, Variables
from vrsopt.schedule.study_input import DEFAULT, checked_schedules, read
from vrsopt.schedule.verify import fly_physics
from vrsopt.surrogate.store import Surrogate

ORDER = (
    "nominal",
    "pointwise",
    "pointwise_rate_limited",
    "prescribed",
    "prescribed_rate_limited",
    "trajectory",
)
DECISION_STEP = 60.0  # s


def solve(
    mission: Mission | FlownMission | Path | str,
    surrogate: Surrogate | Path | str | None = None,
    *,
    mass: float | None = None,
    schedules: Sequence[str] = DEFAULT,
    variables: str = "both",
    seed: int = 1,
    workers: int = 2,
    progress: bool = False,
) -> Comparison:
    """Schedule rotor speed and blade twist over ``mission`` and compare the schedules.

    ``mission``: a mission file (TOML) or a :class:`Mission`; a flown track (CSV, GPX), with the take-off ``mass`` [kg],
    or a :class:`FlownMission`. ``surrogate``: fitted by :func:`vrsopt.fit`; default the shipped one. ``schedules``:
    some of nominal, pointwise, prescribed (pointwise with the study's table in climb and descent), trajectory;
    pointwise and prescribed are flown raw and rate limited.
    ``variables``: "both", "speed", "twist", or "all" three of them. ``seed`` is that of the genetic search. The result
    does not depend on ``workers``; ``progress`` shows the current step on standard error.

    Raises :class:`InputError` for unusable input and :class:`NoSolutionError` where the mission can not be flown.
    """
    task = read(mission, mass=mass) if isinstance(mission, Path | str) else mission
    names = checked_schedules(schedules)
    if variables not in ("both", "speed", "twist", "all"):
        raise InputError(f"solve: variables = {variables!r}: one of both, speed, twist, all")
    bar = Progress(console=Console(stderr=True)) if progress else None
    with bar or nullcontext(), threadpool_limits(limits=1):  # as in the worker processes: sums round alike
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
        mission: Mission | FlownMission,
        surrogate: Surrogate | Path | str | None,
        *,
        seed: int,
        workers: int,
        say: Callable[[str], None],
    ) -> None:
        self.setup = setup = MissionSetup(mission, surrogate, say=say)
        self.mission, self.seed, self.workers, self.say = mission, seed, workers, say
        self.profile, self.limits, self.surrogate, self.settings = (
            setup.profile,
            setup.limits,
            setup.surrogate,
            setup.settings,
        )
        self.make, self.grid, self.nominal, self.loading = setup.make, setup.grid, setup.nominal, setup.loading
        _ = self.make.plant.emission_table  # before the searches: what fails should fail at once

    def compare(self, names: Sequence[str], variables: Variables) -> Comparison:
        """Schedules of ``names`` with the given variables free, flown and compared."""
        settings = self.settings.restricted(variables)
        mass = self.loading.takeoff_mass
        found: dict[str, Schedule] = {"nominal": self.nominal}
        if "pointwise" in names or "prescribed" in names:
            self.say("pointwise search")
            found["pointwise"] = pointwise_schedule(
                self.profile,
                self.make,
                takeoff_mass=mass,
                settings=settings,
                genetic=GeneticOptions(seed=self.seed),
                workers=self.workers,
                grid=self.grid,
            )
            if "prescribed" in names:
                found["prescribed"] = prescribed_schedule(
                    found["pointwise"], self.grid, takeoff_mass=mass, settings=settings
                )
            limited = {
                name: rate_limited_schedule(found[name], self.grid, takeoff_mass=mass, settings=settings)
                for name in ("pointwise", "prescribed")
                if name in found
            }
            found |= {f"{name}_rate_limited": schedule for name, schedule in limited.items()}
            found = {name: found[name] for name in ORDER if name in found}
        trajectory = None
        if "trajectory" in names:
            self.say("trajectory")
            trajectory = refined_trajectory(self.grid, self.make, takeoff_mass=mass, settings=settings)
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
        mass, nodes = self.loading.takeoff_mass, flight_nodes(self.profile, schedules.values())
        with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
            physics = joblib.Parallel(n_jobs=min(self.workers, len(schedules)))(
                joblib.delayed(fly_physics)(self.profile, schedule, limits=self.limits, takeoff_mass=mass, nodes=nodes)
                for schedule in schedules.values()
            )
        flights = {name: self.grid.fly(schedule, takeoff_mass=mass) for name, schedule in schedules.items()}
        emissions = {name: self.grid.emissions(flight) for name, flight in flights.items()}
        decisions = decision_nodes(self.profile, DECISION_STEP)
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
                reliance=reliance(self.make, decisions, self.grid, flights[name]),
            )
            for (name, schedule), flown in zip(schedules.items(), physics, strict=True)
        }

    def _closed_fuel(self, name: str, schedule: Schedule) -> float:
        """Fuel [kg] burned when the take-off mass is closed for ``schedule``; nan if that leaves the sampled box."""
        if name == "nominal":
            return self.loading.fuel_burned
        try:
            return self.setup.close(schedule).fuel_burned
        except (InputError, NoSolutionError):
            return math.nan

    def _band(self, settings: ScheduleSettings) -> Band:
        """Rotor speeds within 0.5 % of least fuel at the decision nodes in flight, at the nominal schedule's mass."""
        nodes = decision_nodes(self.profile, DECISION_STEP)
        model = self.make(nodes.conditions())
        mass = self.grid.burned(self.nominal, takeoff_mass=self.loading.takeoff_mass)[0]
        mass = nodes.interpolated(self.grid, mass)
        box = settings.box(model.bounds)
        optima = batched_minimum(model, mass, box=box)
        lower, upper = rotor_speed_band(model, mass, optima=optima, box=box)
        flying = nodes.search != GROUND
        return Band(
            nodes.segment[flying],
            nodes.time[flying],
            nodes.spread(lower, math.nan)[flying],
            nodes.spread(upper, math.nan)[flying],
        )
