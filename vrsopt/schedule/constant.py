"""The best a rotor can do that is set once for a mission: one rotor speed and one twist for all of the flight.

What a variable rotor saves beyond this schedule it saves by changing in flight; the rest, by being set for the mission.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from vrsopt.schedule.limiter import CHECKED_LIMIT, followed
from vrsopt.schedule.quadrature import per_segment, thinned
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import Schedule, ScheduleSettings
from vrsopt.solvers.status import Status

TRIED = (25, 11)  # rotor speeds and twists of the first search
FEW_NODES = 400  # of the first search
FINEST = 2e-4  # of the range of each variable: where the search ends
DIRECTIONS = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)], dtype=float)
PASSES = 2  # over the mass history

Point = np.ndarray  # rotor speed [rad/s] and twist [rad]
Judged = tuple[float, float]  # by how much limits are broken, fuel [kg]: compared in this order


def best_constant_schedule(
    grid: FlightGrid, *, takeoff_mass: float, settings: ScheduleSettings | None = None
) -> Schedule:
    """The constant rotor speed and twist of least mission fuel from ``takeoff_mass`` [kg] that keep all limits.

    Nominal in idle and, unless these are free, at both ends of the mission, and on the way from and to there as the
    rates of ``settings`` allow. A search over the whole box, then a pattern search (R. Hooke and T. A. Jeeves, 1961) on
    the flight grid: neither derivatives nor convexity are needed. ``details`` has both values. If no point keeps the
    limits the one that breaks them least is returned, with ``success`` false.
    """
    settings = settings or ScheduleSettings()
    box = settings.box(grid.model.bounds)
    nominal = np.array([settings.nominal_rotor_speed, settings.nominal_twist])
    flown = followed(grid, settings, *(np.full(len(grid.time), value) for value in nominal))
    mass = _mass(grid, flown, takeoff_mass)
    usage = float(np.max(grid.flyable_limits(grid.evaluate(np.clip(mass, *grid.mass_bounds), *flown))))
    allowed = min(max(usage, 0.0), CHECKED_LIMIT)  # what the nominal rotor may, this one may too
    tried = _tried(box)
    point = tried[int(np.lexsort(_first_look(grid, settings, mass, tried, allowed).T)[0])]
    steps = (box[1] - box[0]) / (np.array(TRIED) - 1.0)
    for _ in range(PASSES):
        point, judged = _pattern_search(_judge(grid, settings, mass, allowed), point, box, steps)
        flown = followed(grid, settings, *(np.full(len(grid.time), value) for value in point))
        mass, steps = _mass(grid, flown, takeoff_mass), steps / 16.0
    schedule = Schedule("constant", grid.segment, grid.time, *flown)
    details = {"rotor_speed": float(point[0]), "twist": float(point[1])}
    if judged[0] > 0.0:
        message = "no constant rotor speed and twist keep all limits: these break them least"
        return replace(schedule, details=details, success=False, status=Status.INFEASIBLE, message=message)
    return replace(schedule, details=details)


def _mass(grid: FlightGrid, flown: tuple[np.ndarray, np.ndarray], takeoff_mass: float) -> np.ndarray:
    """Mass (N,) [kg] along the mission with this rotor speed and twist (N,)."""
    return grid.burned(Schedule("constant", grid.segment, grid.time, *flown), takeoff_mass=takeoff_mass)[0]


def _tried(box: np.ndarray) -> np.ndarray:
    """Points (k, 2) all over the box; a variable that is held has one value."""
    axes = [np.unique(np.linspace(low, high, count)) for (low, high), count in zip(box.T, TRIED, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)


def _first_look(
    grid: FlightGrid, settings: ScheduleSettings, mass: np.ndarray, points: np.ndarray, allowed: float
) -> np.ndarray:
    """Fuel [kg] and excess over the limits (k, 2), last the more important, on few nodes and without the way there."""
    stride = max(2, len(grid.time) // FEW_NODES)
    nodes = thinned(grid.segment, stride)
    speed, twist = points.T[:, None, :]
    mass = np.clip(mass, *grid.mass_bounds)[nodes, None]
    values = grid.model.nodes(nodes).evaluate(mass, speed, twist)
    step = np.where(np.diff(grid.segment[nodes]) == 0, np.diff(grid.time[nodes]), 0.0)
    weight = 0.5 * (np.append(step, 0.0) + np.append(0.0, step))
    flying = ~np.asarray(grid.conditions.idle)[nodes]
    worst = np.max(values.limits[:, flying], axis=(0, 1), initial=-np.inf)
    return np.column_stack([weight @ values.fuel_flow, np.maximum(worst - allowed, _in_band(settings, points))])


def _in_band(settings: ScheduleSettings, points: np.ndarray) -> np.ndarray:
    """How far (k,) the rotor speeds of ``points`` (k, 2) are inside a forbidden band, over nominal; at least zero."""
    depth = np.zeros(len(points))
    for band in settings.forbidden_bands:
        inside = np.minimum(points[:, 0] - band.lower, band.upper - points[:, 0])
        depth = np.maximum(depth, inside / settings.nominal_rotor_speed)
    return depth


def _judge(grid: FlightGrid, settings: ScheduleSettings, mass: np.ndarray, allowed: float) -> Callable[[Point], Judged]:
    """How good a point is on the flight grid, at this mass history (N,) [kg], if limits may be ``allowed`` over."""
    every, count = np.arange(len(grid.time)), len(grid.profile.segments)

    def judge(point: Point) -> Judged:
        flown = followed(grid, settings, *(np.full(len(grid.time), value) for value in point))
        values = grid.evaluate(np.clip(mass, *grid.mass_bounds), *flown)
        worst = float(np.max(grid.flyable_limits(values)))
        excess = max(worst - allowed, float(_in_band(settings, point[None])[0]))  # at least 0
        return excess, float(np.sum(per_segment(grid.segment, grid.time, values.fuel_flow, every, count)))

    return judge


def _pattern_search(
    judge: Callable[[Point], Judged], point: Point, box: np.ndarray, steps: np.ndarray
) -> tuple[Point, Judged]:
    """The best point of the box near ``point``: steps in all eight directions, halved where none is better."""
    best, known = judge(point), {tuple(point)}
    while np.any(steps > FINEST * (box[1] - box[0])):
        for candidate in _around(point, box, steps):
            if tuple(candidate) not in known:
                known.add(tuple(candidate))
                found = judge(candidate)
                if found < best:
                    point, best = candidate, found
                    break
        else:
            steps = 0.5 * steps
    return point, best


def _around(point: Point, box: np.ndarray, steps: np.ndarray) -> Iterator[Point]:
    for direction in DIRECTIONS:
        yield np.clip(point + direction * steps, *box)
