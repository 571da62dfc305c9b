"""Fuel against NOx of a whole mission: the schedules for which one can not have less of both.

Two ways to the front. *Step by step*: NSGA-II with two objectives (K. Deb et al., 2002) finds the front of every
decision step by itself; a mission's front takes from all of them the point of the same price of NOx, in kg of fuel per
kg of NOx: at equal marginal rates no exchange between two steps saves either. *Trajectory*: the whole-mission problem
with NOx bounded (the epsilon-constraint method), whose multiplier is that price.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from joblib import Parallel, delayed
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from vrsopt.errors import NoSolutionError
from vrsopt.schedule.additions import Additions, Constraint, quantities
from vrsopt.schedule.batched import batched_minimum
from vrsopt.schedule.decision import DecisionNodes, decision_nodes
from vrsopt.schedule.path_model import PathModel, PathModelFactory, PathValues
from vrsopt.schedule.pointwise import pointwise_schedule
from vrsopt.schedule.refinement import refined_trajectory
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import Schedule, ScheduleSettings
from vrsopt.schedule.trajectory import Trajectory, TrajectoryProblem

PRICES = (0.0, 10.0, 30.0, 100.0, 200.0, 400.0, 1000.0, np.inf)  # kg/kg; the last is that of least NOx
POPULATION = 50
BOUND = "NOx of the mission"


@dataclass(frozen=True)
class FrontPoint:
    """A schedule of the front, flown: ``price`` of NOx [kg fuel per kg], ``fuel`` and ``nox`` [kg] of the mission."""

    price: float
    fuel: float
    nox: float
    schedule: Schedule
    success: bool
    message: str


@dataclass(frozen=True)
class StepFronts:
    """Fronts of the decision steps ``nodes`` by themselves: for each of its m searches (k, 4) rotor speed [rad/s],
    twist [rad], fuel flow and NOx [kg/s] of the points found."""

    nodes: DecisionNodes
    points: tuple[np.ndarray, ...]

    def at(self, price: float) -> np.ndarray:
        """The point (m, 4) of each step for which fuel flow and NOx at ``price`` [kg/kg] together cost least."""
        return np.array([front[np.argmin(_cost(front, price))] for front in self.points])


def _cost(front: np.ndarray, price: float) -> np.ndarray:
    return front[:, 3] if np.isinf(price) else front[:, 2] + price * front[:, 3]


class _Emitter:
    """A path model whose NOx [kg/s] takes the place of its fuel flow."""

    def __init__(self, model: PathModel) -> None:
        self.model, self.limit_names, self.bounds = model, model.limit_names, model.bounds

    def evaluate(self, mass: Any, rotor_speed: Any, twist: Any, rotor_speed_rate: Any = 0.0) -> PathValues:
        values = self.model.evaluate(mass, rotor_speed, twist, rotor_speed_rate)
        fuel, power = (np.atleast_2d(value.T).T for value in (values.fuel_flow, values.power_per_engine))
        speed = np.broadcast_to(rotor_speed, values.fuel_flow.shape).reshape(fuel.shape)
        nox = self.model.emissions(fuel, power, speed)["nox"]
        return replace(values, fuel_flow=nox.reshape(values.fuel_flow.shape))

    def nodes(self, index: np.ndarray) -> _Emitter:
        return _Emitter(self.model.nodes(index))


class _Step(Problem):
    """Fuel flow and NOx at one node."""

    def __init__(self, model: PathModel, mass: float, box: np.ndarray) -> None:
        self.model, self.mass = model, mass
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=len(model.limit_names), xl=box[0], xu=box[1])

    def _evaluate(self, x: np.ndarray, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        values = self.model.evaluate(np.array([[self.mass]]), x[None, :, 0], x[None, :, 1])
        flows = self.model.emissions(values.fuel_flow, values.power_per_engine, x[None, :, 0])
        out["F"] = np.stack([values.fuel_flow[0], flows["nox"][0]], axis=1)
        out["G"] = values.limits[:, 0, :].T


def step_fronts(
    grid: FlightGrid,
    make_path_model: PathModelFactory,
    *,
    takeoff_mass: float,
    settings: ScheduleSettings | None = None,
    decision_step: float = 60.0,
    generations: int = 20,
    seed: int = 1,
    workers: int = 1,
) -> StepFronts:
    """The front of every decision step, at the masses of the pointwise schedule of least fuel.

    The search starts with both ends, the points of least fuel flow and of least NOx by :func:`batched_minimum`. Each
    step has its own seed: the result does not depend on ``workers``. ``generations``: of the search. Raises
    :class:`NoSolutionError` where no rotor speed and twist keep the limits.
    """
    settings = settings or ScheduleSettings()
    own: dict[str, Any] = {"takeoff_mass": takeoff_mass, "settings": settings, "decision_step": decision_step}
    least = pointwise_schedule(grid.profile, make_path_model, method="batched", grid=grid, **own)
    nodes = replace(decision_nodes(grid.profile, decision_step), segment=least.segment, time=least.time)
    mass = nodes.interpolated(grid, grid.burned(least, takeoff_mass=takeoff_mass)[0])
    model = make_path_model(nodes.conditions())
    box = settings.box(model.bounds)
    chunks = np.array_split(np.arange(len(mass)), max(1, min(8 * workers, len(mass))))
    ends = [batched_minimum(one, mass, box=box) for one in (model, cast(PathModel, _Emitter(model)))]
    start = np.stack([np.column_stack([end.rotor_speed, end.twist]) for end in ends], axis=1)
    jobs = (
        delayed(_search)(model.nodes(part), mass[part], box, start[part], generations, seed + part) for part in chunks
    )
    found = [front for fronts in Parallel(n_jobs=workers)(jobs) for front in fronts]
    for k, front in enumerate(found):
        if not len(front):
            node = nodes.first[k]
            task = grid.profile.segments[nodes.segment[node]].task
            raise NoSolutionError(
                f"front: no rotor speed and twist keep the limits at {nodes.time[node]:.0f} s ({task})"
            )
    return StepFronts(nodes, tuple(found))


def _search(
    model: PathModel, mass: np.ndarray, box: np.ndarray, start: np.ndarray, generations: int, seeds: np.ndarray
) -> list[np.ndarray]:
    """Fronts (k, 4) of the nodes of a chunk, from populations all over the box and ``start`` (n, 2, 2)."""
    fronts = []
    for k, seed in enumerate(seeds.tolist()):
        step = _Step(model.nodes(np.array([k])), float(mass[k]), box)
        population = np.random.default_rng(seed).uniform(box[0], box[1], (POPULATION, 2))
        population[:2] = start[k]
        algorithm = NSGA2(pop_size=POPULATION, sampling=population)
        found = minimize(step, algorithm, ("n_gen", generations), seed=seed)
        points = np.empty((0, 4)) if found.X is None else np.column_stack([found.X, found.F])
        fronts.append(points)
    return fronts


def step_front(
    fronts: StepFronts,
    grid: FlightGrid,
    *,
    takeoff_mass: float,
    settings: ScheduleSettings | None = None,
    prices: Sequence[float] = PRICES,
) -> list[FrontPoint]:
    """The mission's front made of those of its steps, a point for each of ``prices``, flown without regard to rates."""
    settings, nodes, found = settings or ScheduleSettings(), fronts.nodes, []
    for price in prices:
        chosen = fronts.at(price)
        schedule = Schedule(
            name=f"{price:g} kg/kg",
            segment=nodes.segment,
            time=nodes.time,
            rotor_speed=nodes.spread(chosen[:, 0], settings.nominal_rotor_speed),
            twist=nodes.spread(chosen[:, 1], settings.nominal_twist),
        )
        found.append(_flown(grid, schedule, takeoff_mass, price))
    return found


def trajectory_front(
    grid: FlightGrid,
    make_path_model: PathModelFactory,
    *,
    takeoff_mass: float,
    settings: ScheduleSettings | None = None,
    points: int = 7,
) -> list[FrontPoint]:
    """The mission's front by trajectories: least fuel, least NOx, and between them least fuel with NOx bounded.

    ``points`` in all, evenly spaced in NOx, on the mesh on which that of least fuel keeps the limits between the nodes.
    Built once, each solved from the one before.
    """
    settings = settings or ScheduleSettings()
    fuel = refined_trajectory(grid, make_path_model, takeoff_mass=takeoff_mass, settings=settings)

    def problem_with(additions: Additions) -> TrajectoryProblem:
        own: dict[str, Any] = {"settings": settings, "mesh": fuel.mesh}
        return TrajectoryProblem(grid.profile, make_path_model, additions=additions, **own)

    nox = Constraint(BOUND, quantities()["nox"], upper=1.0, unit="kg")  # each solve has a bound of its own
    problem, cleanest = problem_with(Additions(integrals=(nox,))), problem_with(Additions(cost={"nox": 1.0}))
    last = problem.solve(takeoff_mass, fuel.schedule, limits={BOUND: (None, None)})
    clean = cleanest.solve(takeoff_mass, last.schedule)
    most, least = last.integrals[BOUND], clean.objective
    found = [_flown_trajectory(grid, last, takeoff_mass, 0.0)]
    for allowed in np.linspace(most, least, points)[1:-1].tolist():
        last = problem.solve(takeoff_mass, last, limits={BOUND: (None, allowed)})
        found.append(_flown_trajectory(grid, last, takeoff_mass, max(0.0, last.integral_multipliers[BOUND])))
    return [*found, _flown_trajectory(grid, clean, takeoff_mass, np.inf)]


def _flown_trajectory(grid: FlightGrid, trajectory: Trajectory, takeoff_mass: float, price: float) -> FrontPoint:
    return _flown(grid, replace(trajectory.schedule, name=f"{price:g} kg/kg"), takeoff_mass, price)


def _flown(grid: FlightGrid, schedule: Schedule, takeoff_mass: float, price: float) -> FrontPoint:
    flight = grid.fly(schedule, takeoff_mass=takeoff_mass)
    nox = grid.emissions(flight).total("nox")
    return FrontPoint(price, flight.fuel, nox, schedule, flight.success, flight.message)
