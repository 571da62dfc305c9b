"""Where a track stands still: on the ground, or in the hover.

A receiver's noise hides the two metres between standing and a low hover, and there is no map of the ground. What the
file says of it (a column ``on_ground``) or a clean step in altitude decides; else the rules below, which are said.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vrsopt.mission.track_clean import Fixes
from vrsopt.mission.track_motion import SmoothTrack

Array = NDArray[Any]
MEAN_OVER = 20.0  # s, over which a speed that counts is averaged: the noise of positions makes none
SLOW, SLOW_NOW = 1.0, 3.0  # m/s: mean ground speed of a stop, and its ground speed at any moment
EDGE_SPEED = 1.5  # m/s, a stop reaches as far as this
SHORTEST_STOP = 10.0  # s
SAME_PLACE = 15.0  # m
LEVEL = 1.0  # m/s, mean climb rate; faster is a vertical climb or descent, if it leads to
SAME_LEVEL = 40.0  # m, another level
SHORTEST_GROUND, SHORTEST_LANDING = 20.0, 45.0  # s: at an end of the track, and between
AROUND = 2000.0  # m, where a lower altitude shows that a stop is no landing
# m, by which a stop may be above the lowest altitude around it and still be on the ground: three times the scatter
# within these limits, and more at an end of the track, where standing is usual
GROUND_NOISE, GROUND_NOISE_AT_END = (15.0, 30.0), 50.0
BESIDE, RISE = 300.0, 60.0  # s and m: the flight before and after a landing gets that much higher in that time
LOW_HOVER = 2.0  # m, height of the skids in a hover that is assumed
CLEAN = 0.2  # m: scatter below which altitudes show a lift-off
FINEST = 0.5  # m: resolution, the same


@dataclass(frozen=True)
class Rest:
    """A time at rest: idle on the ground or hovering, at an altitude [m]."""

    kind: str
    start: float  # s
    end: float  # s
    altitude: float


@dataclass(frozen=True)
class Stop:
    """A time over one place, ``place`` (2,) in the plane [m]: what was done there, without gaps.

    ``ground`` is the altitude of the ground [m] where it is known, ``how`` why, in words.
    """

    start: float
    end: float
    place: Array
    rests: tuple[Rest, ...]
    ground: float | None = None
    how: str = ""

    @property
    def length(self) -> float:
        """Time of it [s]."""
        return self.end - self.start


def still(curve: SmoothTrack) -> list[tuple[float, float]]:
    """Times [s] from and to which the track stays over a place."""
    time = _seconds(curve)
    mean = np.linalg.norm(_change(curve.place, time, curve.duration), axis=1)
    speed = np.linalg.norm(curve.velocity(time), axis=1)
    slow = (mean < SLOW) & (speed < SLOW_NOW)
    reach = int(0.5 * MEAN_OVER)
    for _ in range(reach):  # the mean speed sees the flight beside the stop too early
        beside = np.append(False, slow[:-1]) | np.append(slow[1:], False)
        slow = slow | (beside & (speed < EDGE_SPEED))
    found: list[tuple[float, float]] = []
    for a, b in runs(slow):
        start, end = float(time[a]), float(time[b])
        if found and start - found[-1][1] < MEAN_OVER:  # noise between two parts of one stop
            middles = curve.place(np.array([0.5 * sum(found[-1]), 0.5 * (start + end)]))
            if np.linalg.norm(middles[1] - middles[0]) < SAME_PLACE:
                start = found.pop()[0]
        found.append((start, end))
    # the curve is least certain at its ends
    return [
        (start if start > SHORTEST_STOP else 0.0, end if end < curve.duration - SHORTEST_STOP else curve.duration)
        for start, end in found
        if end - start >= SHORTEST_STOP
    ]


def stops(curve: SmoothTrack, fixes: Fixes, *, assumed_hover: float) -> list[Stop]:
    """The stops of a track in order; ``assumed_hover`` [s] beside a flight where the track can not tell."""
    found = []
    for start, end in still(curve):
        within = (fixes.time >= start) & (fixes.time <= end)
        if not within.any():
            continue
        place = np.mean(curve.place(fixes.time[within]), axis=0)
        for a, b in _levels(curve, start, end):
            here = (fixes.time >= a) & (fixes.time <= b) & np.isfinite(fixes.altitude)
            if here.any():
                found.append(_stop(curve, fixes, a, b, place, here, assumed_hover))
    return [_over_known_ground(stop, found) for stop in found]


def _levels(curve: SmoothTrack, start: float, end: float) -> list[tuple[float, float]]:
    """The parts of a stop without a vertical climb or descent to another level."""
    time = _seconds(curve)
    time = time[(time >= start) & (time <= end)]
    height = curve.heights(time)
    steady = np.abs(_change(curve.altitude, time, curve.duration)[:, 0]) < LEVEL
    parts = [[a, b] for a, b in runs(steady) if time[b] - time[a] >= SHORTEST_STOP] or [[0, len(time) - 1]]
    merged = parts[:1]
    for a, b in parts[1:]:
        before = np.median(height[merged[-1][0] : merged[-1][1] + 1])
        if abs(before - np.median(height[a : b + 1])) < SAME_LEVEL:
            merged[-1][1] = b  # up and down between was noise
        else:
            merged.append([a, b])
    for part, side, whole in ((merged[0], 0, 0), (merged[-1], 1, len(time) - 1)):
        if abs(height[whole] - np.median(height[part[0] : part[1] + 1])) < SAME_LEVEL:
            part[side] = whole
    return [(float(time[a]), float(time[b])) for a, b in merged]


def _stop(
    curve: SmoothTrack, fixes: Fixes, start: float, end: float, place: Array, here: Array, assumed_hover: float
) -> Stop:
    level = float(np.median(fixes.altitude[here]))
    hover = Stop(start, end, place, (Rest("hover", start, end, level),))
    joins = (start > 0.0, end < curve.duration)  # flight before it, and after it
    said = fixes.on_ground is not None
    if said:
        assert fixes.on_ground is not None
        down = fixes.time[here & (fixes.on_ground > 0.5)]
        if len(down) < 2 or down[-1] - down[0] < SHORTEST_STOP:
            return hover
        ground = float(np.median(fixes.altitude[here & (fixes.on_ground > 0.5)]))
        edges, how = (down[0] if joins[0] else start, down[-1] if joins[1] else end), "the file says so"
        heights = (LOW_HOVER, LOW_HOVER)
    elif not _low(curve, start, end, fixes.altitude[here]):
        return hover
    elif step := _lift_off(fixes, start, end, here):
        ground, edges, heights = step
        steps = edges != (start, end)
        how = "its altitude steps at lift-off or touch-down" if steps else "its altitude shows no hover"
    else:
        ground, heights = level, (LOW_HOVER, LOW_HOVER)
        share = min(assumed_hover, 0.5 * (end - start) / max(1, sum(joins)))
        edges = (start + share * joins[0], end - share * joins[1])
        how = f"{share:.0f} s of hover assumed beside the flight" if share and any(joins) else "no hover assumed"
    rests = (
        Rest("hover", start, edges[0], ground + heights[0]),
        Rest("idle", *edges, ground),
        Rest("hover", edges[1], end, ground + heights[1]),
    )
    return Stop(start, end, place, tuple(_of_some_length(rests, start, end)), ground, how)


def _of_some_length(rests: tuple[Rest, ...], start: float, end: float) -> Iterator[Rest]:
    """Without hovers of less than two seconds, whose time goes to the idle."""
    before, idle, after = rests
    kept_before, kept_after = before.end - before.start >= 2.0, after.end - after.start >= 2.0
    if kept_before:
        yield before
    yield replace(idle, start=idle.start if kept_before else start, end=idle.end if kept_after else end)
    if kept_after:
        yield after


def _low(curve: SmoothTrack, start: float, end: float, altitude: Array) -> bool:
    """Is a stop without a word about the ground taken as a landing?"""
    time, level = _seconds(curve), float(np.median(altitude))
    height = np.convolve(np.pad(curve.heights(time), 15, mode="edge"), np.full(31, 1.0 / 31.0), mode="valid")
    before = height[(time < start) & (time > start - BESIDE)]
    after = height[(time > end) & (time < end + BESIDE)]
    if not len(before) and not len(after):
        return True
    at_end = not len(before) or not len(after)
    away = np.linalg.norm(curve.place(time) - curve.place(0.5 * (start + end)), axis=1)
    around = height[((time < start) | (time > end)) & (away < AROUND)]
    noise = GROUND_NOISE_AT_END if at_end else float(np.clip(3.0 * np.std(altitude), *GROUND_NOISE))
    if level > np.min(around, initial=np.inf) + noise:
        return False
    if end - start < (SHORTEST_GROUND if at_end else SHORTEST_LANDING):
        return False
    return all(side.max() > level + RISE for side in (before, after) if len(side))


def _lift_off(
    fixes: Fixes, start: float, end: float, here: Array
) -> tuple[float, tuple[float, float], tuple[float, float]] | None:
    """Ground altitude, times on the ground and heights of the hovers before and after, if the altitudes show them."""
    known = np.unique(fixes.altitude[np.isfinite(fixes.altitude)])
    if len(known) < 2 or np.min(np.diff(known)) > FINEST:
        return None
    time, altitude = fixes.time[here], fixes.altitude[here]
    ground = float(np.median(np.sort(altitude)[: max(3, len(altitude) // 3)]))
    down = np.flatnonzero(np.abs(altitude - ground) < 2.0 * CLEAN)
    if not len(down):
        return None
    first, last = int(down[0]), int(down[-1])
    if len(down) < 0.95 * (last - first + 1) or time[last] - time[first] < SHORTEST_STOP:
        return None
    if np.std(altitude[down]) > CLEAN:
        return None
    sides = [(time < time[first], first == 0), (time > time[last], last == len(time) - 1)]
    heights = []
    for side, none in sides:
        height = LOW_HOVER if none else float(np.median(altitude[side]) - ground)
        if not none and (height < 1.0 or np.std(altitude[side] - ground) > 0.5 * height):
            return None
        heights.append(height)
    edges = (start if first == 0 else float(time[first]), end if last == len(time) - 1 else float(time[last]))
    return ground, edges, (heights[0], heights[1])


def _over_known_ground(stop: Stop, others: list[Stop]) -> Stop:
    """A hover low above a place where the aircraft stood knows its ground."""
    if stop.ground is not None:
        return stop
    for other in others:
        if other.ground is None or np.linalg.norm(other.place - stop.place) > 300.0:
            continue
        hover = stop.rests[0]
        if hover.altitude - other.ground < 20.0:
            at = max(hover.altitude, other.ground + 1.0)
            return replace(stop, ground=other.ground, rests=(replace(hover, altitude=at),), how="it stood near there")
    return stop


def runs(flags: Array) -> Iterator[tuple[int, int]]:
    """First and last index of each run of true values.

    ``flags`` (N,).
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    for first, after in edges.reshape(-1, 2):
        yield int(first), int(after) - 1


def _seconds(curve: SmoothTrack) -> Array:
    """Whole seconds, and the end."""
    return np.append(np.arange(0.0, curve.duration), curve.duration)


def _change(series: Any, time: Array, duration: float) -> Array:
    """Mean rate of change (N, k) over MEAN_OVER about each time."""
    before = np.clip(time - 0.5 * MEAN_OVER, 0.0, duration)
    after = np.clip(time + 0.5 * MEAN_OVER, 0.0, duration)
    return np.asarray((series(after) - series(before)) / (after - before)[:, None])
