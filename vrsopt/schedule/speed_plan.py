"""Rotor speed over a mission by dynamic programming: the best of all courses on a grid, across forbidden bands too.

Layers are times, states rotor speeds outside the bands, twist is at its best. From layer to layer the rotor changes
speed within its rate; across a band it goes from edge to edge at the largest rate, over as many layers as that takes.
Nothing needs to be convex: which side of a band is best at which time is found, not assumed.
Method: R. Bellman, Dynamic programming (1957).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from vrsopt.errors import NoSolutionError
from vrsopt.mission.segment import ON_THE_GROUND
from vrsopt.schedule.bands import allowed_regions, check_bands
from vrsopt.schedule.bellman import Course, Jump, Layers, cheapest
from vrsopt.schedule.crossings import Crossings, windows_around
from vrsopt.schedule.nominal import nominal_schedule
from vrsopt.schedule.path_model import PathModelFactory
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import Schedule, ScheduleSettings
from vrsopt.schedule.speed_maps import SpeedMaps, speed_maps

SPACING = 0.005  # of the nominal rotor speed, between two states at most
STEP, MOST_STEPS = 2.0, 4000  # s between layers, more where that would be too many of them
PASSES = 2  # over the mass history


@dataclass(frozen=True)
class SpeedPlan:
    """The course of least fuel, and when it crosses the bands."""

    schedule: Schedule
    crossings: Crossings


def speed_plan(
    grid: FlightGrid,
    make_path_model: PathModelFactory,
    *,
    takeoff_mass: float,
    settings: ScheduleSettings,
    usages: Mapping[str, float] | None = None,
) -> SpeedPlan:
    """Plan of the mission of ``grid`` from ``takeoff_mass`` [kg], within ``usages`` of limits that need not be 1.

    What is over a limit is avoided where it can be, no more; the rate of the twist and bounds of accelerations are left
    to who polishes the plan. Raises :class:`InputError` for bands that contradict each other or the other settings, and
    :class:`NoSolutionError` where no course leads to the end of the mission.
    """
    low, high = settings.box(grid.model.bounds)[:, 0].tolist()
    regions = allowed_regions(settings.forbidden_bands, low, high)
    layers = _layers(grid, settings, regions)
    jumps = _jumps(layers.speed, settings)
    schedule = nominal_schedule(grid.profile, settings)
    for _ in range(PASSES):
        maps = speed_maps(
            grid,
            make_path_model,
            segment=layers.segment,
            times=np.stack([layers.time[:-1], layers.time[1:]]),
            mass=grid.burned(schedule, takeoff_mass=takeoff_mass)[0],
            rotor_speed=layers.speed,
            settings=settings,
            usages=usages or {},
        )
        course = best_course(layers, maps, jumps, periodic=settings.ends == "periodic")
        times, speeds = _corners(layers, course, settings)
        schedule = _schedule(layers, maps, times, speeds)
    return SpeedPlan(schedule, _crossings(layers, course, settings, regions))


def _layers(grid: FlightGrid, settings: ScheduleSettings, regions: tuple[tuple[float, float], ...]) -> Layers:
    """Layers on all edges of segments. Raises :class:`InputError` as :func:`speed_plan`."""
    nominal, rate = settings.nominal_rotor_speed, settings.rotor_speed_rate
    edges = np.asarray(grid.profile.edges, dtype=float)
    counts = np.ceil(np.diff(edges) / max(STEP, edges[-1] / MOST_STEPS) - 1e-9).astype(int)
    pieces = [np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(edges, edges[1:], counts, strict=False)]
    time, segment = np.append(np.concatenate(pieces), edges[-1]), np.repeat(np.arange(len(counts)), counts)
    idle = np.array([item.kind in ON_THE_GROUND for item in grid.profile.segments])[segment]
    held = np.append(idle, False) | np.append(False, idle)
    if settings.ends == "pinned":
        held[[0, -1]] = True
    bounds = regions[0][0], regions[-1][1]
    check_bands(settings.forbidden_bands, bounds=bounds, rate=rate, held=nominal if held.any() else None)
    states = [np.linspace(a, b, int(np.ceil((b - a) / (SPACING * nominal))) + 1) for a, b in regions]
    states = [np.union1d(part, nominal) if part[0] <= nominal <= part[-1] else part for part in states]
    region = np.repeat(np.arange(len(regions)), [len(part) for part in states])
    speed = np.concatenate(states)
    # in whole spacings that time has brought so far, so that short steps are worth something as well
    spacing = SPACING * nominal
    reach = np.full(len(segment), np.inf) if rate is None else np.diff(np.floor(rate * time / spacing + 1e-9)) * spacing
    return Layers(time, segment, idle, speed, region, ~held[:, None] | (speed == nominal), reach)


def _jumps(speed: np.ndarray, settings: ScheduleSettings) -> list[Jump]:
    rate, jumps = settings.rotor_speed_rate, []
    for band in settings.forbidden_bands:
        lower, upper = (np.flatnonzero(speed == edge).tolist() for edge in (band.lower, band.upper))
        if lower and upper and band.crossing_time > 0.0:
            duration = 0.0 if rate is None else (band.upper - band.lower) / rate
            jumps += [Jump(lower[0], upper[0], duration), Jump(upper[0], lower[0], duration)]
    return jumps


def best_course(layers: Layers, maps: SpeedMaps, jumps: list[Jump], *, periodic: bool) -> Course:
    """The cheapest course; one that is to end as it began is the best of those that begin where the free one begins,
    ends, or half-way. Raises :class:`NoSolutionError`.

    ``periodic``: it is to end as it began.
    """
    course = cheapest(layers, maps, jumps)
    if periodic and course.state[0] != course.state[-1]:
        first, last = course.state[[0, -1]].tolist()
        states, courses = np.arange(len(layers.speed)), []
        for state in {first, last, (first + last) // 2}:
            allowed = layers.allowed.copy()
            allowed[[0, -1]] &= states == state
            courses.append(cheapest(replace(layers, allowed=allowed), maps, jumps))
        course = min(courses, key=lambda found: found.fuel)
    if not np.isfinite(course.fuel):
        raise NoSolutionError(
            "rotor speed: no course within its rate and outside its forbidden bands leads to the end of the mission"
        )
    return course


def _ramps(layers: Layers, course: Course, settings: ScheduleSettings) -> list[tuple[int, float, float]]:
    """Stop (of a course) after which it jumps, and the times [s] at which the jump begins and ends."""
    rate = settings.rotor_speed_rate
    time, speed, region = layers.time[course.layer], layers.speed[course.state], layers.region[course.state]
    stops = np.flatnonzero(np.diff(region)).tolist()
    durations = [0.0 if rate is None else abs(float(speed[i + 1] - speed[i])) / rate for i in stops]
    return [(i, float(time[i]), float(time[i]) + duration) for i, duration in zip(stops, durations, strict=True)]


def _corners(layers: Layers, course: Course, settings: ScheduleSettings) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and rotor speeds [rad/s] between which a course is linear."""
    ramps = [ramp for ramp in _ramps(layers, course, settings) if ramp[2] > ramp[1]]
    after = [ramp[0] + 1 for ramp in ramps]
    speed = layers.speed[course.state]
    times = np.insert(layers.time[course.layer], after, [ramp[2] for ramp in ramps])
    return times, np.insert(speed, after, speed[after])


def _schedule(layers: Layers, maps: SpeedMaps, times: np.ndarray, speeds: np.ndarray) -> Schedule:
    """The course with its twist, at both ends of every step."""
    ends = np.column_stack([layers.time[:-1], layers.time[1:]])
    speed = np.interp(ends, times, speeds)
    twist = [[np.interp(speed[k, e], layers.speed, maps.twist[e, k]) for e in (0, 1)] for k in range(len(speed))]
    kept = np.ones_like(ends, dtype=bool)
    kept[:-1, 1] = np.diff(layers.segment) != 0  # inside a segment the end of a step is the start of the next one
    segment = np.column_stack([layers.segment, layers.segment])
    return Schedule("planned", segment[kept], ends[kept], speed[kept], np.array(twist)[kept])


def _crossings(
    layers: Layers, course: Course, settings: ScheduleSettings, regions: tuple[tuple[float, float], ...]
) -> Crossings:
    region = layers.region[course.state].tolist()
    ramps = _ramps(layers, course, settings)
    bands = {band.lower: band for band in settings.forbidden_bands}
    moves = [(start, end, region[i], region[i + 1]) for i, start, end in ramps]
    lengths = [bands[regions[min(move[2:])][1]].crossing_time for move in moves]
    return Crossings(regions, region[0], windows_around(moves, lengths, float(layers.time[-1])))
