"""The whole-mission problem solved on a mesh that is split until the flight keeps the limits between its nodes too, and
its quadrature is good enough."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from vrsopt.schedule.additions import Additions
from vrsopt.schedule.bounds import Bounds, Corridor, LimitBounds
from vrsopt.schedule.carry_over import carried_over
from vrsopt.schedule.crossings import Crossings
from vrsopt.schedule.layout import FUEL_SCALE
from vrsopt.schedule.mesh import Mesh, MeshOptions
from vrsopt.schedule.own_rows import OwnRows, PlannedModel, asked_usages, flown_excess
from vrsopt.schedule.path_model import PathModelFactory
from vrsopt.schedule.refly import Flight, FlightGrid
from vrsopt.schedule.resolution import resolution_loss
from vrsopt.schedule.schedule import ON_LIMIT, Schedule, ScheduleSettings
from vrsopt.schedule.speed_plan import speed_plan
from vrsopt.schedule.trajectory import Trajectory, TrajectoryProblem
from vrsopt.schedule.transcription import Transcription
from vrsopt.schedule.violation import Violation
from vrsopt.solvers.status import Status

if TYPE_CHECKING:
    from vrsopt.mission.profile import Conditions

logger = logging.getLogger(__name__)

MAX_ROUNDS = 5
CHANGE = 5e-5  # of the fuel of the flight from one mesh to the next: less is not worth another one
QUADRATURE = 1e-5  # of the fuel: a smaller sum of the mesh errors splits nothing
RESOLUTION = 2e-5  # of the fuel: a smaller sum of what straight pieces cost splits nothing
LEFT = 0.25  # of what is allowed: intervals that are not split lose no more together
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
    """Schedule of least fuel, or cost, on the mission of ``grid`` from ``takeoff_mass`` [kg]; see :func:`refined`.

    ``transcription``, ``mesh`` and ``ipopt``, options by IPOPT's own names, as of :class:`vrsopt.MissionProblem`.
    """
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
    or a constraint of one's own, by more than may pass for active, the interval is split. So are those that are too
    coarse for the quadrature or for a schedule that bends, unless the fuel of the flight has changed by less than
    CHANGE since the last mesh. Which side of forbidden bands the rotor is on, and when it crosses them, is planned
    first (:mod:`vrsopt.schedule.speed_plan`). The plan knows nothing of integrals, accelerations and the rate of the
    twist; if that fails for them, the rotor stays on one side. Other arguments as of :meth:`TrajectoryProblem.solve`.
    """
    settings, limits = settings or problem.settings, limits or {}
    problem.bounds(takeoff_mass, settings=settings, limits=limits)  # complains of what can not be
    if not settings.forbidden_bands:
        return _split_as_needed(problem, grid, None, takeoff_mass, initial, settings, limits)
    plan = speed_plan(
        grid,
        _planned_models(problem, takeoff_mass, limits),
        takeoff_mass=takeoff_mass,
        settings=settings,
        usages=asked_usages(grid.model, limits),
    )
    tried = []
    for crossings in dict.fromkeys((plan.crossings, *_one_side(plan.crossings, settings, grid))):
        start = initial or plan.schedule if crossings is plan.crossings else initial
        on_it = problem.on(crossings.split(problem.mesh))
        tried.append(_split_as_needed(on_it, grid, crossings, takeoff_mass, start, settings, limits))
        if tried[-1][0].success:
            return tried[-1]
    planned, last = tried[0]
    return planned if len(plan.crossings.regions) == 1 else _only_tried(planned), last


def _one_side(planned: Crossings, settings: ScheduleSettings, grid: FlightGrid) -> list[Crossings]:
    """Courses that stay in one region throughout: the one about the nominal rotor speed where the rotor is held at it,
    and can not jump."""
    nominal, held = settings.nominal_rotor_speed, settings.ends == "pinned" or bool(np.any(grid.conditions.idle))
    bound = held and settings.rotor_speed_rate is not None
    regions = [k for k, (low, high) in enumerate(planned.regions) if not bound or low <= nominal <= high]
    return [Crossings(planned.regions, k, ()) for k in regions]


def _planned_models(problem: TrajectoryProblem, takeoff_mass: float, limits: LimitBounds) -> PathModelFactory:
    """What a plan of the rotor speed goes by: the aircraft, with the constraints and the cost of one's own."""
    additions = problem.additions
    if not additions.constraints and additions.cost is None:
        return problem.make_path_model
    factor = float(problem.start(None, takeoff_mass)[1][1])

    def make(conditions: Conditions) -> Any:
        model = problem.make_path_model(conditions)
        own = OwnRows(problem.profile, model, conditions, additions, limits)
        return PlannedModel(model, own, FUEL_SCALE * factor)

    return make


def _only_tried(trajectory: Trajectory) -> Trajectory:
    """Without a solution where the rotor crosses forbidden bands as planned: that there is none is not shown."""
    verdict: dict[str, Any] = {
        "status": Status.NO_PROGRESS if trajectory.status is Status.INFEASIBLE else trajectory.status,
        "message": "nothing found where the forbidden bands are crossed as planned, nor on one side of them; other "
        f"crossings were not tried; as planned: {trajectory.message.removeprefix('infeasible; ')}",
    }
    return replace(trajectory, schedule=replace(trajectory.schedule, **verdict), **verdict)


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
    rounds: list[Trajectory] = []
    fuel: list[float] = []
    build_s = problem.build_s
    while True:
        corridor = None if crossings is None else Corridor(rotor_speed=crossings.bounds(problem.nodes.time))
        last = problem.solve(takeoff_mass, initial, settings=settings, limits=limits, corridor=corridor)
        rounds.append(last)
        if not last.success:
            break
        flight = grid.fly(last.schedule, takeoff_mass=takeoff_mass)
        fuel.append(flight.fuel)
        names, excess = flown_excess(grid, flight, problem.additions, limits)
        if len(rounds) == MAX_ROUNDS:
            last = _unless_broken(last, grid.worst(excess, names=names))
            break
        split = dict(zip(*broken_intervals(problem.mesh, flight, excess), strict=True))
        if len(fuel) == 1 or abs(fuel[-1] - fuel[-2]) > CHANGE * fuel[-1]:
            middle = problem.mesh.start + 0.5 * problem.mesh.step
            bounds = problem.bounds(takeoff_mass, settings=settings, limits=limits, corridor=corridor)
            split = {interval: middle[interval] for interval in coarse_intervals(problem, last, bounds)} | split
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


def _unless_broken(trajectory: Trajectory, broken: tuple[Violation, ...]) -> Trajectory:
    """The trajectory on the last mesh, without success where its flight breaks limits in between."""
    if not broken:
        return trajectory
    message = f"between its nodes, on the last of {MAX_ROUNDS} meshes: {'; '.join(map(str, broken))}"
    verdict: dict[str, Any] = {"success": False, "status": Status.ITERATION_LIMIT, "message": message}
    return replace(trajectory, schedule=replace(trajectory.schedule, **verdict), **verdict)


def coarse_intervals(problem: TrajectoryProblem, trajectory: Trajectory, bounds: Bounds) -> list[int]:
    """Intervals in which the mesh is too coarse for the quadrature, or for the schedule to bend as it would."""
    quadrature = _largest(np.abs(trajectory.mesh_error), QUADRATURE * trajectory.fuel)
    return sorted({*quadrature, *_largest(resolution_loss(problem, trajectory, bounds), RESOLUTION * trajectory.fuel)})


def _largest(loss: np.ndarray, allowed: float) -> list[int]:
    """Indices of the largest losses, so many that the others add up to LEFT of what is ``allowed``; none if the sum of
    all is allowed."""
    order = np.argsort(-loss)
    rest = loss.sum() - np.cumsum(loss[order])
    enough = int(np.sum(rest > LEFT * allowed)) + 1
    return order[:enough].tolist() if loss.sum() > allowed else []


def broken_intervals(mesh: Mesh, flight: Flight, limits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Intervals (n,) inside which ``flight`` breaks one of ``limits`` (m, N), and the times (n,) [s] to split them
    at."""
    excess = np.max(limits, axis=0)
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
