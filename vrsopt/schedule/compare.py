"""The main job: one mission, several schedules, all flown on one fine grid and on the physics from the same state."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path

from threadpoolctl import threadpool_limits

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.helicopter import MODEL_VERSION
from vrsopt.mission.file import Mission
from vrsopt.mission.track import FlownMission
from vrsopt.progress import telling
from vrsopt.schedule.additions import Additions
from vrsopt.schedule.batched import batched_minimum, rotor_speed_band
from vrsopt.schedule.common_flights import DECISION_STEP, fly_all
from vrsopt.schedule.comparison import Band, Comparison
from vrsopt.schedule.consistent import Consistent, consistent_trajectory
from vrsopt.schedule.constant import best_constant_schedule
from vrsopt.schedule.decision import GROUND, decision_nodes
from vrsopt.schedule.free_flight import free_flight
from vrsopt.schedule.genetic import GeneticOptions
from vrsopt.schedule.limiter import rate_limited_schedule
from vrsopt.schedule.mission_setup import MissionSetup
from vrsopt.schedule.physics_path import PhysicsTruth
from vrsopt.schedule.pointwise import METHODS, pointwise_schedule
from vrsopt.schedule.prescribed import prescribed_schedule
from vrsopt.schedule.refinement import refined_trajectory
from vrsopt.schedule.schedule import Schedule, ScheduleSettings, Variables
from vrsopt.schedule.step_times import StepTimes
from vrsopt.schedule.study_input import DEFAULT, checked_schedules, read
from vrsopt.schedule.trajectory import Trajectory
from vrsopt.solvers.status import Status
from vrsopt.surrogate.store import Surrogate

ORDER = (
    "nominal",
    "constant",
    "pointwise",
    "pointwise_rate_limited",
    "prescribed",
    "prescribed_rate_limited",
    "trajectory",
    "consistent",
    "nominal_variable_transmission",
    "trajectory_variable_transmission",
)
VARIABLE = "variable_transmission"


def solve(
    mission: Mission | FlownMission | Path | str,
    surrogate: Surrogate | Path | str | None = None,
    *,
    mass: float | None = None,
    schedules: Sequence[str] = DEFAULT,
    variables: str = "both",
    objective: Mapping[str, float] | None = None,
    search: str = "batched",
    seed: int = 1,
    workers: int = 2,
    progress: bool = False,
) -> Comparison:
    """Schedule rotor speed and blade twist over ``mission`` and compare the schedules.

    ``mission``: a mission file (TOML) or a :class:`Mission`; a flown track (CSV, GPX), with the take-off ``mass`` [kg],
    or a :class:`FlownMission`. ``surrogate``: fitted by :func:`vrsopt.fit`; default the shipped one. ``schedules``:
    some of

    - nominal;
    - constant: the best rotor speed and twist that are set once for the mission;
    - pointwise: least fuel at every time by itself, raw and rate limited;
    - prescribed: the same with the study's table in climb and descent, raw and rate limited;
    - trajectory: the optimum of the mission as a whole;
    - consistent: the trajectory, corrected until it is optimal to the physics;
    - variable_transmission: nominal and trajectory with the engines at their own best speed, whatever the rotor's.

    ``variables``: "both", "speed", "twist", or "all" three of them. ``objective``: of the trajectories, weights of
    fuel, nox, co and co2 [kg]; default the fuel. ``search``: of pointwise, "batched" (projected Newton at all
    times at once) or "nsga2", the study's genetic search with its ``seed``: the same optimum to 0.01 %, a thousand
    times slower. The result does not depend on ``workers``; ``progress`` shows the current step on standard error.

    Raises :class:`InputError` for unusable input and :class:`NoSolutionError` where the mission can not be flown.
    """
    task = read(mission, mass=mass) if isinstance(mission, Path | str) else mission
    names = checked_schedules(schedules)
    if variables not in ("both", "speed", "twist", "all"):
        raise InputError(f"solve: variables = {variables!r}: one of both, speed, twist, all")
    if search not in METHODS:
        raise InputError(f"solve: search = {search!r}: one of {', '.join(METHODS)}")
    if objective is not None:
        Additions(cost=objective).cost_expression()  # complains of weights that it does not know
        if "consistent" in names:
            raise InputError("solve: objective: not with the schedule consistent, which is one of least fuel")
    # one thread as in the worker processes: sums round alike
    with telling(task.name, wanted=progress) as say, threadpool_limits(limits=1):
        try:
            study = _Study(task, surrogate, objective=objective, search=search, seed=seed, workers=workers, say=say)
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
        objective: Mapping[str, float] | None,
        search: str,
        seed: int,
        workers: int,
        say: Callable[[str], None],
    ) -> None:
        self.objective, self.search, self.seed, self.workers, self.say = objective, search, seed, workers, say
        self.prepared = StepTimes(say)
        with self.prepared("surrogate along the mission"):
            setup = MissionSetup(mission, surrogate)
        with self.prepared("free speeds and altitudes"):
            self.free = free_flight(setup)
        if self.free is None:
            del self.prepared.known["free speeds and altitudes"]
        else:
            mission = self.free.mission
            setup = MissionSetup(mission, setup.surrogate)
        self.mission, self.setup = mission, setup
        self.profile, self.limits, self.loading = setup.profile, setup.limits, setup.loading
        with self.prepared("table of emissions"):
            _ = setup.make.plant.emission_table  # before the searches: what fails should fail at once

    @cached_property
    def variable(self) -> MissionSetup:
        """The same mission with the engines at their own best speed; it takes off with the same mass."""
        return MissionSetup(self.mission, self.setup.surrogate, transmission="variable")

    def compare(self, names: Sequence[str], variables: Variables) -> Comparison:
        """Schedules of ``names`` with the given variables free, flown and compared."""
        settings = self.setup.settings.restricted(variables)
        timed = StepTimes(self.say)
        timed.known |= {name: replace(step) for name, step in self.prepared.known.items()}
        found: dict[str, Schedule] = {"nominal": self.setup.nominal}
        if "constant" in names:
            with timed("best constant rotor speed and twist"):
                found["constant"] = best_constant_schedule(
                    self.setup.grid, takeoff_mass=self.loading.takeoff_mass, settings=settings
                )
        if "pointwise" in names or "prescribed" in names:
            found |= self._pointwise(settings, timed, prescribed="prescribed" in names)
        trajectory = consistent = None
        if "trajectory" in names or "consistent" in names:
            with timed("trajectory"):
                trajectory = self._trajectory(self.setup, settings)
            found["trajectory"] = replace(trajectory.schedule, name="trajectory")
        if "consistent" in names and trajectory is not None:
            with timed("trajectory on the physics"):
                found["consistent"], consistent = self._consistent(trajectory, settings)
        if "variable_transmission" in names:
            with timed("variable transmission"):
                found["nominal_variable_transmission"] = self.variable.nominal
                other = self._trajectory(self.variable, settings)
            found["trajectory_variable_transmission"] = other.schedule
        found = {name: replace(found[name], name=name) for name in ORDER if name in found}
        setups = {name: self.variable if name.endswith(VARIABLE) else self.setup for name in found}
        return Comparison(
            mission=self.mission,
            profile=self.profile,
            settings=settings,
            limits=self.limits,
            loading=self.loading,
            results=fly_all(found, setups, settings=settings, timed=timed, workers=self.workers),
            band=self._band(settings),
            trajectory=trajectory,
            consistent=consistent,
            free=self.free,
            steps=timed.as_dict(),
            provenance={
                "model_version": MODEL_VERSION,
                "data_hash": self.setup.surrogate.data_hash,
                "design_seed": self.setup.surrogate.seed,
                "search": self.search,
                "search_seed": self.seed,
                "variables": variables,
                "objective": "fuel" if self.objective is None else json.dumps(dict(self.objective)),
            },
        )

    def _pointwise(self, settings: ScheduleSettings, timed: StepTimes, *, prescribed: bool) -> dict[str, Schedule]:
        """The pointwise schedule and, if asked for, the prescribed one, each raw and rate limited."""
        grid, mass = self.setup.grid, self.loading.takeoff_mass
        with timed("pointwise search"):
            raw = pointwise_schedule(
                self.profile,
                self.setup.make,
                takeoff_mass=mass,
                settings=settings,
                method=self.search,  # type: ignore[arg-type]
                genetic=GeneticOptions(seed=self.seed),
                workers=self.workers,
                grid=grid,
            )
        found = {"pointwise": raw}
        with timed("rate limiter"):
            if prescribed:
                found["prescribed"] = prescribed_schedule(raw, grid, takeoff_mass=mass, settings=settings)
            limited = {
                f"{name}_rate_limited": rate_limited_schedule(schedule, grid, takeoff_mass=mass, settings=settings)
                for name, schedule in found.items()
            }
        return found | limited

    def _trajectory(self, setup: MissionSetup, settings: ScheduleSettings) -> Trajectory:
        additions = None if self.objective is None else Additions(cost=self.objective)
        mass = self.loading.takeoff_mass
        return refined_trajectory(setup.grid, setup.make, takeoff_mass=mass, settings=settings, additions=additions)

    def _consistent(self, trajectory: Trajectory, settings: ScheduleSettings) -> tuple[Schedule, Consistent | None]:
        """The trajectory on the physics; where that can not be solved, the surrogate's without success."""
        try:
            found = consistent_trajectory(
                self.profile,
                self.setup.make,
                PhysicsTruth(self.profile, self.limits, workers=self.workers),
                takeoff_mass=self.loading.takeoff_mass,
                trajectory=trajectory,
                settings=settings,
            )
        except NoSolutionError as error:
            return replace(trajectory.schedule, success=False, status=Status.INFEASIBLE, message=str(error)), None
        return found.trajectory.schedule, found

    def _band(self, settings: ScheduleSettings) -> Band:
        """Rotor speeds within 0.5 % of least fuel at the decision nodes in flight, at the nominal schedule's mass."""
        nodes = decision_nodes(self.profile, DECISION_STEP)
        model = self.setup.make(nodes.conditions())
        mass = self.setup.grid.burned(self.setup.nominal, takeoff_mass=self.loading.takeoff_mass)[0]
        mass = nodes.interpolated(self.setup.grid, mass)
        box = settings.box(model.bounds)
        optima = batched_minimum(model, mass, box=box, bands=settings.forbidden_bands)
        lower, upper = rotor_speed_band(model, mass, optima=optima, box=box)
        flying = nodes.search != GROUND
        return Band(
            nodes.segment[flying],
            nodes.time[flying],
            nodes.spread(lower, math.nan)[flying],
            nodes.spread(upper, math.nan)[flying],
        )
