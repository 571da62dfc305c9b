"""Ways between poses: turns and a straight, fitted together in the plane and then exactly on the ellipsoid.

The straight has to begin on the course on which the first turn ends, which is one equation for the angle of that turn
(the angle of the last follows from the courses). In the plane, with its origin at the start, all of its solutions are
found by a scan; the best is then made exact by Newton's method with the derivatives of the plane, whose error is the
square of the distance over 6 squares of the Earth's radius.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product
from math import cos, degrees, hypot, pi, radians, sin
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from vrsopt.errors import NoSolutionError
from vrsopt.mission.route import SHORTEST, Array, Leg, Point, Pose, Way, plane_shape
from vrsopt.mission.turns import end_of, turn, turn_shape

CLOSE = 1e-4  # m, ways end this close to where they are meant to
CLOSE_DEG = 1e-7
_EXACT = 1e-8  # m
_NEAR = 1e-6  # m, what the last small turn may leave; aiming a short leg anew would put a corner at its start
_EXACT_DEG = 1e-10
_SCAN = 181  # angles, one every 2 degrees of a full circle
_STEPS = 16  # lengths flown ahead, a quarter of radius and roll length apart


def direct_to(pose: Pose, target: Point, *, radius: float, roll_length: float) -> Way:
    """From ``pose``, turn towards ``target`` and fly straight there: the shorter of right and left.

    Ends at ``target``, less than 1e-4 m off; empty if already there. No turn if already on course. A target too close
    to be turned to is first flown away from, straight ahead, by steps of a quarter of radius and roll length.
    ``radius`` and ``roll_length`` [m] of the turn as in :mod:`vrsopt.mission.turns`.
    """
    turns = _Turns(radius, roll_length)
    x, y, _ = plane_shape(pose, Pose(target, 0.0))
    if hypot(x, y) < CLOSE:
        return []
    fits = _fits_ahead(lambda ahead: _direct_fits(x - ahead, y, turns), 0.25 * (radius + roll_length))
    return _made_exact(pose, fits, lambda start, fit: _exactly_to(start, target, fit, turns))


def join(pose: Pose, goal: Pose, *, radius: float, roll_length: float) -> Way:
    """From ``pose``, a turn, a straight and a turn that end in ``goal``: the shortest of the four choices of sides.

    Ends less than 1e-4 m and 1e-7 degrees off ``goal``; empty if already there. Pieces that are not needed are left
    out. Where no choice exists, or the shortest turns by more than a full circle (``goal`` is close by), so many steps
    are flown straight ahead first as make the way the shortest; each is a quarter of radius and roll length.
    """
    turns = _Turns(radius, roll_length)
    x, y, turned_deg = plane_shape(pose, goal)
    if hypot(x, y) < CLOSE and abs(turned_deg) < CLOSE_DEG:
        return []
    fits = _fits_ahead(lambda ahead: _fits(x - ahead, y, radians(turned_deg), turns), 0.25 * (radius + roll_length))
    return _made_exact(pose, fits, lambda start, fit: _exactly_in(start, goal, fit, turns))


class _Turns(NamedTuple):
    radius: float  # m
    roll_length: float  # m

    def from_pose(self, pose: Pose, angle: float) -> Way:
        """The turn by ``angle`` [rad]."""
        return turn(pose, degrees(angle), radius=self.radius, roll_length=self.roll_length)

    def shape(self, angle: Array | float) -> tuple[Array, Array]:
        """Its displacement in the plane: along and across."""
        shape = turn_shape(np.degrees(angle), radius=self.radius, roll_length=self.roll_length)
        return shape.along, shape.across

    def length(self, angle: float) -> float:
        """Distance flown [m] in it."""
        return float(turn_shape(degrees(angle), radius=self.radius, roll_length=self.roll_length).length)

    def slope(self, angle: float) -> tuple[float, float]:
        """Derivatives of its displacement [m/rad]."""
        (back, left), (ahead, right) = self.shape(angle - 1e-4), self.shape(angle + 1e-4)
        return float(ahead - back) / 2e-4, float(right - left) / 2e-4


class _Fit(NamedTuple):
    length: float  # m, of the whole way
    first: float  # rad, turns
    straight: float  # m
    last: float = 0.0  # rad
    ahead: float = 0.0  # m, flown straight before the first turn


def _fits_ahead(fits_after: Callable[[float], Iterator[_Fit]], step: float) -> Iterator[_Fit]:
    """The fits to be tried: the shortest with nothing flown ahead; from the first that takes a full circle on, all."""
    fits = sorted(fits_after(0.0))
    while fits and abs(fits[0].first) + abs(fits[0].last) <= 2.0 * pi:
        yield fits.pop(0)
    for ahead in (step * number for number in range(1, _STEPS)):
        fits += (fit._replace(length=fit.length + ahead, ahead=ahead) for fit in fits_after(ahead))
    yield from sorted(fits)


def _made_exact(pose: Pose, fits: Iterator[_Fit], exact: Callable[[Pose, _Fit], Way | None]) -> Way:
    """The way of the first fit that can be made exact."""
    for fit in fits:
        before: Way = [Leg(*pose, fit.ahead)] if fit.ahead else []
        way = exact(end_of(before, pose), fit)
        if way is not None:
            return before + way
    raise NoSolutionError(f"way from {pose.point} on {pose.heading_deg:.1f} degrees: no turns lead to its goal")


def _direct_fits(x: float, y: float, turns: _Turns) -> Iterator[_Fit]:
    """The turns to the right and left that end on course to a point of the plane."""
    for side in (1.0, -1.0):

        def miss(size: Array | float, side: float = side) -> Array:
            return _seen(x, y, side * size, turns)[1]

        for size in _roots(miss, 0.0, 2.0 * pi):
            straight = float(_seen(x, y, side * size, turns)[0])
            if straight > -SHORTEST:
                yield _Fit(turns.length(size) + straight, side * size, straight)


def _exactly_to(pose: Pose, target: Point, fit: _Fit, turns: _Turns) -> Way | None:
    """The way of a fit, its turn corrected until it ends on course to the target."""
    angle = fit.first
    for _ in range(20):
        way = turns.from_pose(pose, angle)
        end = end_of(way, pose)
        straight, miss, _ = plane_shape(end, Pose(target, 0.0))
        if abs(miss) < _EXACT:
            break
        along, across = turns.slope(angle)
        angle += miss / (straight + across * cos(angle) - along * sin(angle))
    if abs(miss) > CLOSE or straight < -CLOSE:
        return None
    if straight >= SHORTEST:  # aimed anew only where the turn that is missing is too small to be flown
        way.append(Leg(*end, straight) if abs(miss) < _NEAR else Leg.between(end.point, target))
    return way


def _fits(x: float, y: float, turned: float, turns: _Turns) -> Iterator[_Fit]:
    """All turns that, with a straight between, lead in the plane from the origin to a pose there."""
    for first, last in product((1.0, -1.0), (1.0, -1.0)):
        # The size of the last turn falls from a full circle to nothing, or rises, as that of the first grows; it
        # starts anew where the first turn alone leads to the right course.
        alone = (first * turned) % (2.0 * pi)
        for low, high in ((0.0, alone), (alone, 2.0 * pi)):
            middle = 0.5 * (low + high)
            both = last * ((last * (turned - first * middle)) % (2.0 * pi)) + first * middle

            def miss(size: Array | float, first: float = first, both: float = both) -> Array:
                return _between(x, y, first * size, both - first * size, turns)[1]

            for size in _roots(miss, low, high):
                one, other = first * size, both - first * size
                straight = float(_between(x, y, one, other, turns)[0])
                if straight > -SHORTEST:
                    yield _Fit(turns.length(one) + straight + turns.length(other), one, straight, other)


def _exactly_in(pose: Pose, goal: Pose, fit: _Fit, turns: _Turns) -> Way | None:
    """The way of a fit, its angles and its straight corrected until it ends in the goal."""
    _, first, straight, last, _ = fit
    for _ in range(20):
        way = turns.from_pose(pose, first)
        if abs(straight) >= SHORTEST:
            way.append(Leg(*end_of(way, pose), straight))
        way += turns.from_pose(end_of(way, pose), last)
        along, across, turned_deg = plane_shape(goal, end_of(way, pose))
        if hypot(along, across) < _EXACT and abs(turned_deg) < _EXACT_DEG:
            break
        ahead, aside = _turned(along, across, last)  # as seen on the straight
        if abs(aside) < _EXACT and abs(turned_deg) < _EXACT_DEG:
            # The length of a tiny turn goes with the root of its angle: with the angles right, the straight makes up
            if max(abs(straight), abs(float(ahead))) < SHORTEST:  # a straight is left out that is next to nothing
                break
            straight -= float(ahead)
            continue
        change = np.linalg.solve(_sensitivity(first, straight, last, turns), [along, across, radians(turned_deg)])
        first, straight, last = (np.array([first, straight, last]) - change).tolist()
    if hypot(along, across) > CLOSE or abs(turned_deg) > CLOSE_DEG or straight < -SHORTEST:
        return None
    return [piece for piece in way if piece.length > 0.0]


def _sensitivity(first: float, straight: float, last: float, turns: _Turns) -> Array:
    """Derivatives of the end of a way (along, across, direction; as seen there) by turn, straight and turn."""
    ahead, aside = turns.shape(last)
    along, across = turns.slope(first)
    first_ends = _turned(along, across, -first)
    by_first = _turned(first_ends[0] - aside, first_ends[1] + straight + ahead, -last)
    by_last = _turned(*turns.slope(last), -last)
    return np.array([[by_first[0], cos(last), by_last[0]], [by_first[1], -sin(last), by_last[1]], [1.0, 0.0, 1.0]])


def _seen(x: float, y: float, angle: Array | float, turns: _Turns) -> tuple[Array, Array]:
    """A point of the plane as seen from the end of a turn: along its course and across."""
    along, across = turns.shape(angle)
    return _turned(x - along, y - across, -angle)


def _between(x: float, y: float, first: Array | float, last: Array | float, turns: _Turns) -> tuple[Array, Array]:
    """From the end of one turn to the start of another that ends at a point of the plane: along the course, across."""
    along, across = _seen(x, y, first, turns)
    ahead, aside = turns.shape(last)
    return along - ahead, across - aside


def _turned(along: Array | float, across: Array | float, angle: Array | float) -> tuple[Array, Array]:
    """A vector turned to the right."""
    c, s = np.cos(angle), np.sin(angle)
    return along * c - across * s, along * s + across * c


def _roots(function: Callable[[Array | float], Array], low: float, high: float) -> Iterator[float]:
    """The zeros of a function [m] that a scan from ``low`` to ``high`` finds, both included, to 1e-6 m."""
    grid = np.linspace(low, high, _SCAN)
    values = function(grid)
    zero = np.abs(values) < SHORTEST
    yield from grid[zero].tolist()
    for index in np.flatnonzero((values[:-1] * values[1:] < 0.0) & ~zero[:-1] & ~zero[1:]):
        yield float(brentq(function, grid[index], grid[index + 1], xtol=1e-13, rtol=1e-14))
