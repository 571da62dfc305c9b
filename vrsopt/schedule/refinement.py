"""The whole-mission problem solved on a mesh that is split until the flight keeps the limits between its nodes too."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np

from vrsopt.schedule.mesh import Mesh, MeshOptions, make_mesh
from vrsopt.schedule.path_model import PathModelFactory
from vrsopt.schedule.refly import Flight, FlightGrid
from vrsopt.schedule.schedule import ON_LIMIT, Schedule, ScheduleSettings
from vrsopt.schedule.trajectory import Trajectory, TrajectoryProblem

logger = logging.getLogger(__name__)

MAX_ROUNDS = 5
CHECKED_LIMIT = 0.9 * ON_LIMIT
SHORTEST = 0.2  # of an interval: no part of it is shorter


def refined_trajectory(
    grid: FlightGrid,
    make_path_model: PathModelFactory,
    *,
    takeoff_mass: float,
    settings: ScheduleSettings | None = None,
    mesh: MeshOptions | Mesh | None = None,
    initial: Schedule | None = None,
) -> Trajectory:
    """Schedule of least fuel on the mission of ``grid`` from ``takeoff_mass`` [kg].

    The problem knows the limits at start, middle and end of its intervals. Where a flight of its solution breaks one in
    between, by more than may pass for active, the interval is split and the problem solved again from its solution, at
    most MAX_ROUNDS times. Raises InputError for a take-off mass outside the bounds of the aircraft's model.
    """
    profile, settings = grid.profile, settings or ScheduleSettings()
    intervals = mesh if isinstance(mesh, Mesh) else make_mesh(profile, mesh, settings=settings)
    rounds: list[Trajectory] = []
    while True:
        problem = TrajectoryProblem(profile, make_path_model, settings=settings, mesh=intervals)
        rounds.append(problem.solve(takeoff_mass, rounds[-1].schedule if rounds else initial))
        last = rounds[-1]
        if not last.success or len(rounds) == MAX_ROUNDS:
            break
        split = broken_intervals(intervals, grid.fly(last.schedule, takeoff_mass=takeoff_mass))
        if not len(split[0]):
            break
        logger.debug("trajectory: round %d, %d of %d intervals split", len(rounds), len(split[0]), len(intervals))
        intervals = intervals.split(*split)
    return replace(
        last,
        iterations=sum(one.iterations for one in rounds),
        build_s=sum(one.build_s for one in rounds),
        solve_s=sum(one.solve_s for one in rounds),
        rounds=len(rounds),
    )


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
