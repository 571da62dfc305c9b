"""What a track does between its stops: climb, cruise, descent, loiter; as segments of a mission.

Segments begin and end where the kind of flight changes and where turns begin and end, so that a time step between them
sees a straight or a turn, not a mixture. Thresholds differ between entering and leaving a state, and short pieces join
their neighbours.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from vrsopt.mission.motion import Motion
from vrsopt.mission.route import Point
from vrsopt.mission.segment import Kind, Segment
from vrsopt.mission.track_motion import SmoothTrack, StandingMotion, TrackMotion
from vrsopt.mission.track_stops import MEAN_OVER, Stop, runs

Array = NDArray[Any]
CLIMB, CLIMB_ENDS = 1.0, 0.5  # m/s, mean climb rate
SHORTEST_PHASE = 20.0  # s
# s, rad: who turns a full circle in five minutes loiters, for as long as it is three quarters
TURNED_WITHIN, TURNED, TURNED_ENDS = 300.0, 2.0 * np.pi, 1.5 * np.pi
TURNING = 0.02  # rad/s, and
TURNING_SPEED = 5.0  # m/s, from which on a turn counts
SHORTEST_LOITER = 120.0  # s
TURN, TURN_ENDS = 1.5, 0.8  # m/s2, lateral acceleration
SHORTEST_TURN = 6.0  # s
STANDING_STILL = 0.01  # m/s
GROUND_MATTERS = 20.0  # m, height up to which the ground is felt
GROUND_KNOWN = 500.0  # m, distance from a stop over which its ground counts


@dataclass(frozen=True)
class _Piece:
    """A time of one kind of flight."""

    kind: str
    start: float
    end: float
    task: int = 0  # number of the task, counted over the whole track
    ground: float | None = None


def segments_of_track(curve: SmoothTrack, stops: Sequence[Stop]) -> tuple[Segment, ...]:
    """The whole track as segments; at the stops it stands, between them it follows the curve."""
    ends = [0.0, *(edge for stop in stops for edge in (stop.start, stop.end)), curve.duration]
    pieces: list[_Piece] = []
    number = 0
    for index in range(len(stops) + 1):
        start, end = ends[2 * index], ends[2 * index + 1]
        if end > start:
            for piece in _flight(curve, start, end, number):
                pieces += _near_ground(curve, piece, stops[max(0, index - 1) : index + 1])
            number = pieces[-1].task + 1
        if index < len(stops):
            for rest in stops[index].rests:
                pieces.append(_Piece(rest.kind, rest.start, rest.end, number, stops[index].ground))
                number += 1
    names = _names(pieces)
    standing = {rest.start: (stop, rest) for stop in stops for rest in stop.rests}
    segments = []
    for piece in pieces:
        motion: Motion = TrackMotion(curve, piece.start)
        if piece.kind in ("idle", "hover"):
            stop, rest = standing[piece.start]
            latitude, longitude, turn = curve.plane.unproject(stop.place[None, :])
            east, north = curve.direction(np.array([piece.start]))[0]
            course = float(np.degrees(np.arctan2(east, north)) + turn[0])
            motion = StandingMotion(Point(float(latitude[0]), float(longitude[0])), rest.altitude, course)
        kind = cast(Kind, piece.kind)
        ground = None if piece.kind == "idle" else piece.ground
        segments.append(Segment(names[piece.task], kind, piece.start, piece.end - piece.start, 0.0, motion, ground))
    return tuple(segments)


def _names(pieces: Sequence[_Piece]) -> dict[int, str]:
    """Label of each task: its kind, numbered where there are several."""
    kinds = {piece.task: piece.kind for piece in pieces}
    total, seen = Counter(kinds.values()), Counter[str]()
    names = {}
    for task, kind in sorted(kinds.items()):
        seen[kind] += 1
        names[task] = f"{kind.replace('_', ' ')} {seen[kind]}" if total[kind] > 1 else kind.replace("_", " ")
    return names


def _flight(curve: SmoothTrack, start: float, end: float, number: int) -> list[_Piece]:
    """The pieces of a flight between two stops; those of one task share its number."""
    time = np.unique(np.concatenate([[start], np.arange(np.ceil(start), end), [end]]))
    kinds = _kinds(curve, time)
    turning = _turning(curve, time)
    pieces, last = [], ""
    for first, after in pairwise(
        [0, *(1 + np.flatnonzero((kinds[1:] != kinds[:-1]) | (turning[1:] != turning[:-1]))), len(time)]
    ):
        kind = str(kinds[first])
        number += bool(last) and kind != last
        last = kind
        pieces.append(_Piece(kind, float(time[first]), float(time[min(after, len(time) - 1)]), number))
    return [piece for piece in pieces if piece.end > piece.start]


def _kinds(curve: SmoothTrack, time: Array) -> Array:
    """Kind of flight at each time; short ones have joined their neighbours."""
    half = 0.5 * MEAN_OVER
    before, after = np.clip(time - half, time[0], time[-1]), np.clip(time + half, time[0], time[-1])
    rate = (curve.heights(after) - curve.heights(before)) / np.maximum(after - before, 1e-9)
    kinds = np.full(len(time), "cruise", dtype="<U14")
    kinds[_loitering(curve, time)] = "loiter"
    kinds[_hysteresis(rate, CLIMB, CLIMB_ENDS)] = "climb"
    kinds[_hysteresis(-rate, CLIMB, CLIMB_ENDS)] = "descent"
    kinds = _joined(kinds, time, {"loiter": SHORTEST_LOITER}, SHORTEST_PHASE)
    speed = np.linalg.norm(curve.velocity(time), axis=1)
    over = (kinds == "climb") & (speed < STANDING_STILL)
    for first, last in runs(over):
        if time[last] - time[first] >= SHORTEST_TURN:
            kinds[first : last + 1] = "vertical_climb"
    return kinds


def _loitering(curve: SmoothTrack, time: Array) -> Array:
    """Where more than a full circle is turned, to either side, within the five minutes around."""
    motion = curve.kinematics(time)
    fast = motion.ground_speed > TURNING_SPEED
    rate = np.where(fast, np.abs(motion.lateral_acceleration) / np.where(fast, motion.ground_speed, 1.0), 0.0)
    rate = np.where(rate > TURNING, rate, 0.0)
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))])
    window = 0.5 * TURNED_WITHIN
    around = np.interp(time + window, time, turned) - np.interp(time - window, time, turned)
    return _hysteresis(around, TURNED, TURNED_ENDS)


def _turning(curve: SmoothTrack, time: Array) -> Array:
    """In a turn: +1 to the right, -1 to the left, else 0."""
    lateral = curve.kinematics(time).lateral_acceleration
    right, left = (_hysteresis(side * lateral, TURN, TURN_ENDS) for side in (1.0, -1.0))
    turning = right.astype(int) - left.astype(int)
    return _joined(turning, time, {}, SHORTEST_TURN)


def _hysteresis(value: Array, enter: float, leave: float) -> Array:
    """True from where the value passes ``enter`` until, to both sides, it falls below ``leave``."""
    found = np.zeros(len(value), dtype=bool)
    for first, last in runs(value > leave):
        found[first : last + 1] = (value[first : last + 1] > enter).any()
    return found


def _joined(states: Array, time: Array, shortest: dict[Any, float], otherwise: float) -> Array:
    """States whose runs are long enough: the shortest run joins its longer neighbour until none is too short."""
    states = states.copy()
    while True:
        edges = [0, *(1 + np.flatnonzero(states[1:] != states[:-1])), len(states)]
        if len(edges) < 3:
            return states
        length = np.array([time[min(b, len(time) - 1)] - time[a] for a, b in pairwise(edges)])
        wanted = np.array([shortest.get(states[a], otherwise) for a in edges[:-1]])
        missing = np.where(length < wanted, length / wanted, np.inf)
        run = int(np.argmin(missing))
        if np.isinf(missing[run]):
            return states
        sides = [side for side in (run - 1, run + 1) if 0 <= side < len(length)]
        into = max(sides, key=lambda side: length[side])
        states[edges[run] : edges[run + 1]] = states[edges[into]]


def _near_ground(curve: SmoothTrack, piece: _Piece, stops: Sequence[Stop]) -> list[_Piece]:
    """The piece, cut where it leaves or reaches the height at which the ground of a stop beside it is felt."""
    time = np.unique(np.concatenate([[piece.start], np.arange(np.ceil(piece.start), piece.end), [piece.end]]))
    height = curve.heights(time)
    for stop in stops:
        if stop.ground is None or not (stop.end == piece.start or stop.start == piece.end):
            continue
        away = np.linalg.norm(curve.place(time) - stop.place, axis=1)
        near = (height < stop.ground + GROUND_MATTERS) & (away < GROUND_KNOWN)
        if stop.end == piece.start:
            count = int(np.argmin(near)) if not near.all() else len(near)
            low, cut = slice(0, count + 1), time[min(count, len(time) - 1)]
        else:
            count = int(np.argmin(near[::-1])) if not near.all() else len(near)
            low, cut = slice(max(0, len(time) - count - 1), None), time[max(0, len(time) - count - 1)]
        if count < 2:
            continue
        # the smoothed altitude may dip below the ground it is about to leave
        ground = min(stop.ground, float(height[low].min()) - 1.0)
        close = replace(piece, ground=ground)
        if not piece.start < cut < piece.end:
            return [close]
        parts = [replace(piece, end=float(cut)), replace(piece, start=float(cut))]
        parts[0 if stop.end == piece.start else 1] = replace(parts[0 if stop.end == piece.start else 1], ground=ground)
        return parts
    return [piece]
