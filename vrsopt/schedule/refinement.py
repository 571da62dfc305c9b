"""The whole-mission problem solved on a mesh that is split until the flight keeps the limits between its nodes too, and
its quadrature is good enough."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from vrsopt.schedule.additions import Additions
from vrsopt.schedule.bounds import Corridor, LimitBounds
from vrsopt.schedule.carry_over import carried_over
from vrsopt.schedule.crossings import Crossings
from vrsopt.schedule.mesh import Mesh, MeshOptions
from vrsopt.schedule.path_model import PathModelFactory
from vrsopt.schedule.refly import Flight, FlightGrid
from vrsopt.schedule.resolution import resolution_loss
from vrsopt.schedule.schedule import ON_LIMIT, Schedule, ScheduleSettings
from vrsopt.schedule.speed_plan import speed_plan
from vrsopt.schedule.trajectory import Trajectory, TrajectoryProblem
from vrsopt.schedule.transcription import Transcription

logger = logging.getLogger(__name__)

MAX_ROUNDS = 5
CHANGE = 5e-5  # of the fuel of the flight from one mesh to the next: less is not worth another one
QUADRATURE = 1e-5  # of the fuel: a smaller sum of the mesh errors splits nothing
RESOLUTION = 1e-5  # of the fuel: a smaller sum of what straight pieces cost splits nothing
CHECKED_LIMIT = 0.9 * ON_LIMIT
SHORTEST = 0.2  # of an interval: no part of it is shorter


def refined_trajectory(
    grid: FlightGrid,
    make_path_model: PathModelFactory,
    *,
    takeoff_mass: float,
    settings: ScheduleSettings | None = None,
    mesh: MeshOptions | Mesh | None = None,
    initial: Schedule | Trajectory | None = None,
    transcription: Transcription = "hermite_simpson",
    additions: Additions | None = None,
    ipopt: Mapping[str, Any] | None = None,
) -> Trajectory:
    """Schedule of least fuel, or cost, on the mission of ``grid`` from ``takeoff_mass`` [kg]; see :func:`refined`."""
    problem = TrajectoryProblem(
        grid.profile,
        make_path_model,
        settings=settings,
        mesh=mesh,
        transcription=transcription,
        additions=additions,
        ipopt=ipopt,
    )
    return refined(problem, grid, takeoff_mass=takeoff_mass, initial=initial)[0]


def refined(
    problem: TrajectoryProblem,
    grid: FlightGrid,
    *,
    takeoff_mass: float,
    initial: Schedule | Trajectory | None = None,
    settings: ScheduleSettings | None = None,
    limits: LimitBounds | None = None,
) -> tuple[Trajectory, TrajectoryProblem]:
    """The solution of ``problem`` from ``takeoff_mass`` [kg], and the problem on the mesh that this has come to.

    Two things split intervals, and have the problem solved again from its solution, at most MAX_ROUNDS times. The
    problem knows the limits at the stages of its intervals only: where a flight of its solution breaks one in between,
    by more than may pass for active, the interval is split. So are those that are too coarse for the quadrature or
    for a schedule that bends, unless the fuel of the flight has changed by less than CHANGE since the last mesh. Which
    side of forbidden bands the rotor is on, and when it crosses them, is planned first, for least fuel within the
    limits of the aircraft (:mod:`vrsopt.schedule.speed_plan`); if that fails for constraints of one's own, it does not
    cross them. Other arguments as of :meth:`TrajectoryProblem.solve`.
    """
    settings, limits = settings or problem.settings, limits or {}
    problem.bounds(takeoff_mass, settings=settings, limits=limits)  # complains of what can not be
    if not settings.forbidden_bands:
        return _split_as_needed(problem, grid, None, takeoff_mass, initial, settings, limits)
    staying = replace(
        settings, forbidden_bands=tuple(replace(band, crossing_time=0.0) for band in settings.forbidden_bands)
    )
    usages = {name: float(value) for name, value in limits.items() if not isinstance(value, tuple)}
    tried = []
    for one in (settings, staying):
        plan = speed_plan(grid, problem.make_path_model, takeoff_mass=takeoff_mass, settings=one, usages=usages)
        start = initial if initial is not None and one is settings else plan.schedule
        on_it = problem.on(plan.crossings.split(problem.mesh))
        tried.append(_split_as_needed(on_it, grid, plan.crossings, takeoff_mass, start, settings, limits))
        if tried[-1][0].success:
            return tried[-1]
    trajectory, last = tried[0]
    message = f"with the forbidden bands crossed as least fuel would have it, or not at all: {trajectory.message}"
    return replace(trajectory, message=message, schedule=replace(trajectory.schedule, message=message)), last


def _split_as_needed(
    problem: TrajectoryProblem,
    grid: FlightGrid,
    crossings: Crossings | None,
    takeoff_mass: float,
    initial: Schedule | Trajectory | None,
    settings: ScheduleSettings,
    limits: LimitBounds,
) -> tuple[Trajectory, TrajectoryProblem]:
    """See :func:`refined`; the rotor keeps to the bounds of ``crossings``."""
    largest = [limits.get(name, 1.0) for name in grid.model.limit_names]
    allowed = np.array([[float(usage) - 1.0] for usage in largest if not isinstance(usage, tuple)])
    rounds: list[Trajectory] = []
    fuel: list[float] = []
    build_s = problem.build_s
    while True:
        corridor = None if crossings is None else Corridor(rotor_speed=crossings.bounds(problem.nodes.time))
        last = problem.solve(takeoff_mass, initial, settings=settings, limits=limits, corridor=corridor)
        rounds.append(last)
        if not last.success or len(rounds) == MAX_ROUNDS:
            break
        flight = grid.fly(last.schedule, takeoff_mass=takeoff_mass)
        flight = replace(flight, limits=flight.limits - allowed)  # as what counts as broken here
        fuel.append(flight.fuel)
        split = dict(zip(*broken_intervals(problem.mesh, flight), strict=True))
        if len(fuel) == 1 or abs(fuel[-1] - fuel[-2]) > CHANGE * fuel[-1]:
            middle = problem.mesh.start + 0.5 * problem.mesh.step
            split = {interval: middle[interval] for interval in coarse_intervals(problem, last)} | split
        if not split:
            break
        logger.debug("trajectory: round %d, %d of %d intervals split", len(rounds), len(split), len(problem.mesh))
        finer = problem.on(problem.mesh.split(np.array(list(split)), np.array(list(split.values()))))
        problem, initial = finer, carried_over(last, problem, finer)
        build_s += problem.build_s
    total = replace(
        last,
        iterations=sum(one.iterations for one in rounds),
        build_s=build_s,
        solve_s=sum(one.solve_s for one in rounds),
        rounds=len(rounds),
    )
    return total, problem


def coarse_intervals(problem: TrajectoryProblem, trajectory: Trajectory) -> list[int]:
    """Intervals in which the mesh is too coarse for the quadrature, or for the schedule to bend as it would."""
    quadrature = _largest(np.abs(trajectory.mesh_error), QUADRATURE * trajectory.fuel)
    return sorted({*quadrature, *_largest(resolution_loss(problem, trajectory), RESOLUTION * trajectory.fuel)})


def _largest(loss: np.ndarray, allowed: float) -> list[int]:
    """Indices of the largest losses, so many that the others add up to a tenth of what is ``allowed``; none if the sum
    of all is allowed."""
    order = np.argsort(-loss)
    rest = loss.sum() - np.cumsum(loss[order])
    enough = int(np.sum(rest > 0.1 * allowed)) + 1
    return order[:enough].tolist() if loss.sum() > allowed else []


def broken_intervals(mesh: Mesh, flight: Flight) -> tuple[np.ndarray, np.ndarray]:
    """Intervals (n,) inside which ``flight`` breaks a limit, and the times (n,) [s] to split them at."""
    excess = np.max(flight.limits, axis=0)
    found: dict[int, int] = {}  # the worst node inside each interval
    for node in np.flatnonzero(excess > CHECKED_LIMIT).tolist():
        inside = (mesh.segment == flight.segment[node]) & (mesh.start < flight.time[node])
        inside &= flight.time[node] < mesh.end
        for interval in np.flatnonzero(inside).tolist():
            if interval not in found or excess[node] > excess[found[interval]]:
                found[interval] = node
    intervals = np.array(sorted(found), dtype=int)
    start, step = mesh.start[intervals], mesh.step[intervals]
    share = (flight.time[[found[k] for k in intervals]] - start) / step
    return intervals, start + np.clip(share, SHORTEST, 1.0 - SHORTEST) * step
