"""Search patterns, as chains of legs and turns that begin where the one before ended."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator
from itertools import product
from math import ceil, pi
from typing import TYPE_CHECKING, NamedTuple

from vrsopt.mission.route import SHORTEST, Arc, Leg, Point, Pose, Spiral, Way, offset

if TYPE_CHECKING:
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


class Pattern(NamedTuple):
    """An endless chain of pieces, each of which begins where the one before ended."""

    entry: Pose  # where the first piece begins, and on which course
    pieces: Iterator[Leg | Arc | Spiral]  # to be used once


class Corner(NamedTuple):
    """Where a creeping line begins, as seen from its centre along its bearing: signs, +1 or -1."""

    along: int  # +1 ahead, the first leg is flown back; -1 behind
    across: int  # +1 to the right, it creeps to the left; -1 to the left


CORNERS = (Corner(-1, -1), Corner(-1, 1), Corner(1, -1), Corner(1, 1))


def best_entry(pose: Pose, patterns: Iterable[Pattern], *, radius: float, roll_length: float) -> tuple[Way, Pattern]:
    """The pattern with the shortest way from ``pose`` to its entry, and that way."""
    raise NotImplementedError


def parallel_tracks(
    centre: Point,
    bearing_deg: float,
    *,
    leg: float,
    spacing: float,
    tracks: int,
    radius: float,
    roll_length: float,
    corner: Corner,
) -> Pattern:
    """A creeping line: ``tracks`` legs of ``leg`` [m] along ``bearing_deg``, ``spacing`` [m] apart, around ``centre``.

    The pattern goes on after ``tracks`` legs; their number only says where its middle is. From one leg to the next
    it turns by a half circle that ends exactly ``spacing`` to the side (of whatever radius that takes), or, where
    there is room, by two quarter turns of ``radius`` with a straight between.
    Raises :class:`InputError` if ``spacing`` is below twice ``radius``.
    """
    raise NotImplementedError


def track_pitch(leg: float, spacing: float, *, radius: float, roll_length: float) -> float:
    """Distance flown [m] over one leg of :func:`parallel_tracks` and the turn to the next."""
    raise NotImplementedError


def expanding_square(
    datum: Point, bearing_deg: float, *, spacing: float, radius: float, roll_length: float, right: bool = True
) -> Pattern:
    """Legs of 1, 1, 2, 2, 3, 3 ... ``spacing`` [m], the first from ``datum`` on ``bearing_deg``, at right angles.

    The turns are flown inside the corners. Raises :class:`InputError` if ``spacing`` is too small for them.
    """
    raise NotImplementedError


def sector_search(datum: Point, bearing_deg: float, *, reach: float, radius: float, roll_length: float) -> Pattern:
    """Sectors of ``reach`` [m] around ``datum``: three legs through it per circuit, turns by 120 degrees to the right.

    The turns are flown inside the outer corners; each circuit is turned by 30 degrees from the one before. Raises
    :class:`InputError` if ``reach`` is too small for the turns.
    """
    raise NotImplementedError


def race_track(
    centre: Point, bearing_deg: float, *, leg: float, radius: float, roll_length: float, right: bool = True
) -> Pattern:
    """Two legs of ``leg`` [m], 2 ``radius`` [m] apart, joined by half circles, the first along ``bearing_deg``.

    Begins with that leg; ``centre`` lies amid the two. Every circuit lies exactly on the one before.
    """
    raise NotImplementedError


def circle(centre: Point, bearing_deg: float, *, radius: float, roll_length: float, right: bool = True) -> Pattern:
    """The orbit of ``radius`` [m] about ``centre``; its entry lies on ``bearing_deg`` from there.

    Begins with the spiral that leads from straight flight into the orbit, and goes on circle by circle.
    """
    raise NotImplementedError
