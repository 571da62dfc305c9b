"""Search and loiter patterns, as endless chains of legs and turns that begin in a pose of their own.

Lengths are in metres; ``radius`` and ``roll_length`` of the turns as in :mod:`vrsopt.mission.turns`. The search
patterns are those of the IAMSAR Manual, volume II: creeping line (parallel tracks), expanding square, sector.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain, count, cycle, repeat
from math import atan2, ceil, cos, degrees, hypot, pi, radians, remainder, sin
from typing import NamedTuple

from scipy.optimize import brentq

from vrsopt.errors import InputError
from vrsopt.mission.route import Arc, Leg, Point, Pose, Spiral, Way, offset, plane_pose, plane_shape, spiral_shape
from vrsopt.mission.turns import end_of, half_circle_radius, lead, turn, turn_shape

_STRAIGHT = 0.05  # of a sector's reach, flown straight over the datum before the turn into the next circuit


class Pattern(NamedTuple):
    """An endless chain of pieces, each of which begins where the one before ended."""

    entry: Pose  # where the first piece begins, and on which course
    pieces: Iterator[Leg | Arc | Spiral]  # to be used once


class Corner(NamedTuple):
    """Where a creeping line begins, as seen from its centre along its bearing: signs, +1 or -1."""

    along: int  # +1 ahead, the first leg is flown back; -1 behind
    across: int  # +1 to the right, it creeps to the left; -1 to the left


CORNERS = (Corner(-1, -1), Corner(-1, 1), Corner(1, -1), Corner(1, 1))


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
    """A creeping line: ``tracks`` legs of ``leg`` along ``bearing_deg``, ``spacing`` apart, around ``centre``.

    The pattern goes on after ``tracks`` legs; their number only says where its middle is. From one leg to the next
    it turns by a half circle that ends exactly ``spacing`` to the side (of whatever radius that takes), or, where
    there is room, by two quarter turns of ``radius`` with a straight between.
    Raises :class:`InputError` if ``spacing`` is below twice ``radius``.
    """
    if spacing < 2.0 * radius:
        raise InputError(f"spacing_m = {spacing:g}: allowed: at least {2.0 * radius:g}, twice the radius of the turns")
    middle = Pose(centre, bearing_deg)
    beside = 0.5 * (tracks - 1) * spacing * corner.across
    turned = 90.0 * (corner.along + 1)
    entry = plane_pose(middle, 0.5 * leg * corner.along, across=beside, turned_deg=turned)

    def pieces() -> Iterator[Leg | Arc | Spiral]:
        pose, cross = entry, _Cross.of(spacing, radius=radius, roll_length=roll_length)
        for number in count():
            way: Way = [Leg(*pose, leg)]
            way += cross.way(end_of(way, pose), side=corner.along * corner.across * (-1) ** number)
            yield from way
            pose = end_of(way, pose)

    return Pattern(entry, pieces())


def track_pitch(leg: float, spacing: float, *, radius: float, roll_length: float) -> float:
    """Distance flown over one leg of :func:`parallel_tracks` and the turn to the next.

    ``leg`` and ``spacing`` [m] as there.
    """
    cross = _Cross.of(spacing, radius=radius, roll_length=roll_length)
    shape = turn_shape(cross.angle_deg, radius=cross.radius, roll_length=roll_length)
    return leg + cross.straight + float(shape.length) * (180.0 / cross.angle_deg)


class _Cross(NamedTuple):
    """From one track to the next: a half circle, or two quarters with a straight between."""

    angle_deg: float  # of each turn
    radius: float
    roll_length: float
    straight: float  # between the two turns

    @classmethod
    def of(cls, spacing: float, *, radius: float, roll_length: float) -> _Cross:
        straight = spacing - 2.0 * lead(90.0, radius=radius, roll_length=roll_length)
        if straight > 0.0:
            return cls(90.0, radius, roll_length, straight)
        return cls(180.0, half_circle_radius(spacing, roll_length=roll_length), roll_length, 0.0)

    def way(self, pose: Pose, *, side: int) -> Way:
        angle = side * self.angle_deg
        way = turn(pose, angle, radius=self.radius, roll_length=self.roll_length)
        if self.straight:
            way.append(Leg(*end_of(way, pose), self.straight))
            way += turn(end_of(way, pose), angle, radius=self.radius, roll_length=self.roll_length)
        return way


def expanding_square(
    datum: Point, bearing_deg: float, *, spacing: float, radius: float, roll_length: float, right: bool = True
) -> Pattern:
    """Legs of 1, 1, 2, 2, 3, 3 ... ``spacing``, the first from ``datum`` on ``bearing_deg``, at right angles.

    The turns are flown inside the corners. Raises :class:`InputError` if ``spacing`` is too small for them.
    """
    least = 2.0 * lead(90.0, radius=radius, roll_length=roll_length)
    if spacing < least:
        raise InputError(f"spacing_m = {spacing:g}: allowed: {_at_least(least)}, for two turns of radius {radius:g}")

    def corners() -> Iterator[Point]:
        x = y = 0.0
        for number in count():
            length, angle = spacing * (number // 2 + 1), number * (90.0 if right else -90.0)
            x, y = x + length * cos(radians(angle)), y + length * sin(radians(angle))
            yield offset(datum, bearing_deg, along=x, across=y)

    return Pattern(Pose(datum, bearing_deg), _fly_by(datum, corners(), radius=radius, roll_length=roll_length))


def sector_search(datum: Point, bearing_deg: float, *, reach: float, radius: float, roll_length: float) -> Pattern:
    """Sectors of ``reach`` around ``datum``: three legs through it per circuit, turns by 120 degrees to the right.

    Begins at ``datum`` on ``bearing_deg``. The turns are flown inside the outer corners. Each circuit is turned by 30
    degrees from the one before; the turn into it is flown after ``datum``, so that every leg leads straight over it.
    Raises :class:`InputError` if ``reach`` is too small for the turns.
    """
    least = 2.0 * lead(120.0, radius=radius, roll_length=roll_length)
    if reach < least:
        raise InputError(f"sector_m = {reach:g}: allowed: {_at_least(least)}, for two turns of radius {radius:g}")

    def angle_beyond(distance: float) -> float:
        """Of the turn ``distance`` after the datum towards the first corner of the next circuit [deg]."""
        return degrees(atan2(reach * sin(pi / 6.0), reach * cos(pi / 6.0) - distance))

    def late(distance: float) -> float:
        return distance - _STRAIGHT * reach - lead(angle_beyond(distance), radius=radius, roll_length=roll_length)

    beyond = float(brentq(late, 0.0, reach * cos(pi / 6.0), xtol=1e-9))

    def corners() -> Iterator[Point]:
        for first in count(bearing_deg, 30.0):
            for bearing in (0.0, 60.0, 240.0, 300.0, 120.0, 180.0):
                yield offset(datum, first + bearing, along=reach, across=0.0)
            yield offset(datum, first, along=beyond, across=0.0)

    return Pattern(Pose(datum, bearing_deg), _fly_by(datum, corners(), radius=radius, roll_length=roll_length))


def race_track(
    centre: Point, bearing_deg: float, *, leg: float, radius: float, roll_length: float, right: bool = True
) -> Pattern:
    """Two legs of ``leg``, 2 ``radius`` apart, joined by half circles, the first along ``bearing_deg``.

    Begins with that leg; ``centre`` lies amid the two. Every circuit lies exactly on the one before: on the ellipsoid
    two half circles lead back only almost, and the second leg and turn are made to fit. ``right``: turns to the right,
    else to the left.
    """
    side = 1.0 if right else -1.0
    entry = plane_pose(Pose(centre, bearing_deg), -0.5 * leg, across=-side * radius)
    across, back, angle = 2.0 * radius, leg, 180.0
    there: Way = [Leg(*entry, leg)]
    there += _half_circle(end_of(there, entry), side * angle, across=across, roll_length=roll_length)
    for _ in range(4):
        circuit: Way = [*there, Leg(*end_of(there, entry), back)]
        circuit += _half_circle(end_of(circuit, entry), side * angle, across=across, roll_length=roll_length)
        ahead, aside, turned_deg = plane_shape(entry, end_of(circuit, entry))
        back, across, angle = back + ahead, across + side * aside, angle - side * turned_deg
    return Pattern(entry, cycle(circuit))


def circle(centre: Point, bearing_deg: float, *, radius: float, roll_length: float, right: bool = True) -> Pattern:
    """The orbit of ``radius`` about ``centre``; its entry lies on ``bearing_deg`` from there.

    Begins with the spiral that leads from straight flight into the orbit, and goes on circle by circle. ``right``:
    turned to the right, else to the left.
    """
    side = 1.0 if right else -1.0
    curvatures = (0.0, 1.0 / radius)
    along, across = spiral_shape(roll_length, whole=roll_length, curvatures=curvatures)
    turned = 0.5 * roll_length / radius
    ahead, aside = along - radius * sin(turned), across + radius * cos(turned)  # the centre, as seen from the entry
    outward = Leg(centre, bearing_deg, hypot(ahead, aside)).pose(hypot(ahead, aside))
    course = outward.heading_deg + 180.0 - side * degrees(atan2(aside, ahead))
    entry = Pose(outward.point, remainder(course, 360.0))
    spiral = Spiral.from_pose(entry, roll_length, curvatures=(0.0, side / radius))
    orbit = Arc(centre, radius, Leg.between(centre, spiral.position(roll_length)).heading_deg, side * 360.0)
    return Pattern(entry, chain([spiral], repeat(orbit)))


def _half_circle(pose: Pose, angle_deg: float, *, across: float, roll_length: float) -> Way:
    return turn(pose, angle_deg, radius=half_circle_radius(across, roll_length=roll_length), roll_length=roll_length)


def _fly_by(
    start: Point, corners: Iterable[Point], *, radius: float, roll_length: float
) -> Iterator[Leg | Arc | Spiral]:
    """Legs from corner to corner, with the turns inside them; each leg is aimed anew, so that errors do not add up."""
    corners = iter(corners)
    corner = next(corners)
    for beyond in corners:
        leg = Leg.between(start, corner)
        arrival = leg.pose(leg.length)
        angle = remainder(Leg.between(corner, beyond).heading_deg - arrival.heading_deg, 360.0)
        leg = leg.section(0.0, leg.length - lead(angle, radius=radius, roll_length=roll_length))
        way: Way = [leg, *turn(leg.pose(leg.length), angle, radius=radius, roll_length=roll_length)]
        yield from way
        start, corner = way[-1].position(way[-1].length), beyond


def _at_least(least: float) -> str:
    return f"at least {ceil(10.0 * least) / 10.0:g}"
