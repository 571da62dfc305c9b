"""Search patterns, as chains of legs and turns that begin where the one before ended."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator
from itertools import product
from math import ceil, pi
from typing import NamedTuple

from vrsopt.mission.route import SHORTEST, Arc, Leg, Point, Pose, offset
from vrsopt.mission.tasks import Search


def creeping_line(position: Point, centre: Point, task: Search) -> list[Leg | Arc]:
    """The parallel-track search flown from ``position``: ``speed x duration`` long, its last piece cut.

    The first piece goes to the nearest corner of the pattern; it has zero length if the aircraft is there, and is alone
    and whole if it takes all of the time or more. The pattern has as many tracks as there is time for and is centred on
    ``centre`` (the last track counted at its full length).
    """
    entry, tracks = _nearest_entry(position, centre, task)
    pieces: list[Leg | Arc] = [entry.leg]
    remaining = task.speed_m_s * task.duration_s - entry.leg.length
    for piece in _chain(entry, tracks, task):
        if remaining < SHORTEST:
            break
        pieces.append(piece if piece.length <= remaining else piece.cut(remaining))
        remaining -= piece.length
    return pieces


class _Entry(NamedTuple):
    leg: Leg  # to the corner
    heading_deg: float  # of the first track
    side: float  # of the first turn, +1 right, -1 left


def _nearest_entry(position: Point, centre: Point, task: Search) -> tuple[_Entry, int]:
    """The entry at the nearest corner, and the number of tracks there is time for.

    The two depend on each other: each track moves the corners by half a spacing. That is less than a track with its
    turn adds, so the distance flown grows with the number of tracks and bisection finds it.
    """
    distance = task.speed_m_s * task.duration_s
    between_tracks = task.spacing_m + (pi - 2.0) * task.turn_radius_m

    def entry(tracks: int) -> _Entry:
        return min(_entries(position, centre, task, tracks), key=lambda way: way.leg.length)

    def flown(tracks: int) -> float:
        return entry(tracks).leg.length + tracks * task.leg_m + (tracks - 1) * between_tracks

    tracks = 1 + bisect_left(range(1, ceil(distance / task.leg_m)), distance, key=flown)
    return entry(tracks), tracks


def _entries(position: Point, centre: Point, task: Search, tracks: int) -> Iterator[_Entry]:
    """The ways to begin: from each corner the first track runs away from it and the pattern creeps away from it."""
    half_width = 0.5 * (tracks - 1) * task.spacing_m
    for forward, right in product((1.0, -1.0), (1.0, -1.0)):
        corner = offset(centre, task.leg_bearing_deg, along=-0.5 * forward * task.leg_m, across=-right * half_width)
        heading = task.leg_bearing_deg + (0.0 if forward > 0.0 else 180.0)
        yield _Entry(Leg.between(position, corner), heading, forward * right)


def _chain(entry: _Entry, tracks: int, task: Search) -> Iterator[Leg | Arc]:
    """The whole pattern after the entry, uncut."""
    pose, side = Pose(entry.leg.position(entry.leg.length), entry.heading_deg), entry.side
    for track in range(tracks):
        yield (leg := Leg(*pose, task.leg_m))
        pose = leg.pose(leg.length)
        if track < tracks - 1:
            for piece in _turn(pose, side, task):
                yield piece
                pose = piece.pose(piece.length)
            side = -side


def _turn(pose: Pose, side: float, task: Search) -> Iterator[Leg | Arc]:
    """From the end of a track to the start of the next: a half circle, or two quarters with a straight between."""
    straight = task.spacing_m - 2.0 * task.turn_radius_m
    if straight < SHORTEST:
        yield Arc.from_pose(pose, task.turn_radius_m, sweep_deg=180.0 * side)
        return
    quarter = 90.0 * side
    first = Arc.from_pose(pose, task.turn_radius_m, sweep_deg=quarter)
    yield first
    cross = Leg(*first.pose(first.length), straight)
    yield cross
    yield Arc.from_pose(cross.pose(straight), task.turn_radius_m, sweep_deg=quarter)
