"""Ways over the ground on the WGS-84 ellipsoid: standing still, geodesic legs, arcs of constant radius, spirals.

A way is a chain of pieces, each a curve in terms of the distance d [m] from its start: where it is and on which course
(``pose``), and how it bends (``curvature`` [1/m], positive to the right). How fast it is flown is not said here.

Distances are taken on the ellipsoid, not at flight altitude: at 300 m the difference is 5 parts in 100 000. Geodesics
are those of Karney (2013), "Algorithms for geodesics", by geographiclib.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import atan2, copysign, cos, degrees, hypot, radians, remainder, sin
from typing import NamedTuple

import numpy as np
from geographiclib.geodesic import Geodesic
from geographiclib.geodesicline import GeodesicLine
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

WGS84 = Geodesic.WGS84
SHORTEST = 1e-6  # m, a shorter piece of a way is left out
_POSE = Geodesic.LATITUDE | Geodesic.LONGITUDE | Geodesic.AZIMUTH
# Gauss-Legendre on [0, 1]: 16 nodes integrate a spiral that turns by 3 rad to 1e-13 of its length
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
GAUSS = tuple((0.5 * float(node) + 0.5, 0.5 * float(weight)) for node, weight in zip(_NODES, _WEIGHTS, strict=True))


class Point(NamedTuple):
    """A position on the ellipsoid [deg]."""

    latitude_deg: float
    longitude_deg: float


class Pose(NamedTuple):
    """A position and the direction of travel there, clockwise from true north [deg]."""

    point: Point
    heading_deg: float

    @property
    def reversed(self) -> Pose:
        """The same position, travelled the other way."""
        return Pose(self.point, remainder(self.heading_deg + 180.0, 360.0))


@dataclass(frozen=True)
class Stay:
    """Standing over a point, the nose on ``heading_deg``."""

    point: Point
    length: float = 0.0
    heading_deg: float = 0.0

    def pose(self, distance: float) -> Pose:
        """The point and the heading, whatever the distance."""
        return Pose(self.point, self.heading_deg)

    def position(self, distance: float) -> Point:
        """The point, whatever the distance."""
        return self.point

    def curvature(self, distance: ArrayLike) -> Array:
        """Zero, in the shape of ``distance``."""
        return np.zeros(np.shape(distance))

    def section(self, begin: float, end: float) -> Stay:
        """The same."""
        return self


@dataclass(frozen=True)
class Leg:
    """A geodesic of ``length`` [m] from ``start``, which it leaves on ``heading_deg``."""

    start: Point
    heading_deg: float
    length: float

    @classmethod
    def between(cls, start: Point, end: Point) -> Leg:
        """The shortest leg from ``start`` to ``end``."""
        line = WGS84.Inverse(*start, *end)
        return cls(start, line["azi1"], line["s12"])

    @cached_property
    def _line(self) -> GeodesicLine:
        return WGS84.Line(*self.start, self.heading_deg, Geodesic.DISTANCE_IN | _POSE)

    def pose(self, distance: float) -> Pose:
        """Position and heading ``distance`` [m] from the start."""
        end = self._line.Position(distance, _POSE)
        return Pose(Point(end["lat2"], end["lon2"]), end["azi2"])

    def position(self, distance: float) -> Point:
        """Position ``distance`` [m] from the start."""
        return self.pose(distance).point

    def curvature(self, distance: ArrayLike) -> Array:
        """Zero, in the shape of ``distance``."""
        return np.zeros(np.shape(distance))

    def section(self, begin: float, end: float) -> Leg:
        """The part of the leg between two distances [m] from its start."""
        return Leg(*self.pose(begin), end - begin)


@dataclass(frozen=True)
class Arc:
    """A turn about ``centre``; ``bearing_deg`` points from there to its start, ``sweep_deg`` > 0 turns right."""

    centre: Point
    radius: float  # m
    bearing_deg: float
    sweep_deg: float

    @classmethod
    def from_pose(cls, pose: Pose, radius: float, *, sweep_deg: float) -> Arc:
        """The turn that begins at ``pose``, tangent to it."""
        to_centre = WGS84.Direct(*pose.point, pose.heading_deg + copysign(90.0, sweep_deg), radius, _POSE)
        return cls(Point(to_centre["lat2"], to_centre["lon2"]), radius, to_centre["azi2"] + 180.0, sweep_deg)

    @property
    def length(self) -> float:
        """Distance flown [m]."""
        return self.radius * radians(abs(self.sweep_deg))

    def pose(self, distance: float) -> Pose:
        """Position and heading ``distance`` [m] along the turn."""
        end = WGS84.Direct(*self.centre, self._bearing(distance), self.radius, _POSE)
        heading = remainder(end["azi2"] + copysign(90.0, self.sweep_deg), 360.0)
        return Pose(Point(end["lat2"], end["lon2"]), heading)

    def position(self, distance: float) -> Point:
        """Position ``distance`` [m] along the turn."""
        return self.pose(distance).point

    def curvature(self, distance: ArrayLike) -> Array:
        """That of the circle [1/m], + to the right, in the shape of ``distance``."""
        return np.full(np.shape(distance), copysign(1.0 / self.radius, self.sweep_deg))

    def section(self, begin: float, end: float) -> Arc:
        """The part of the turn between two distances [m] from its start."""
        sweep = copysign(degrees((end - begin) / self.radius), self.sweep_deg)
        return replace(self, bearing_deg=self._bearing(begin), sweep_deg=sweep)

    def _bearing(self, distance: float) -> float:
        return self.bearing_deg + copysign(degrees(distance / self.radius), self.sweep_deg)


@dataclass(frozen=True)
class Spiral:
    """The roll into a turn or out of it: a curvature that goes smoothly from one value to another.

    With s the part of the ``whole`` length that is flown, the curvature is that at the start plus 3 s^2 - 2 s^3 of its
    change: the roll begins and ends gently. The piece is the part of the spiral that begins ``begin`` [m] after
    ``start`` and is ``length`` [m] long. Positions are those of a plane curve, by quadrature of its direction, in the
    azimuthal equidistant projection about ``start``; the error is the cube of the length over 6 squares of the Earth's
    radius, 4 micrometres for 1 km.
    """

    start: Point  # of the whole spiral, as its heading
    heading_deg: float
    whole: float  # m
    curvatures: tuple[float, float]  # 1/m, at the start and at the end of the whole spiral, + to the right
    begin: float  # m
    length: float  # m

    @classmethod
    def from_pose(cls, pose: Pose, length: float, *, curvatures: tuple[float, float]) -> Spiral:
        """The whole spiral that begins at ``pose``."""
        return cls(*pose, length, curvatures, 0.0, length)

    def pose(self, distance: float) -> Pose:
        """Position and heading ``distance`` [m] along the piece."""
        flown = self.begin + distance
        along, across = spiral_shape(flown, whole=self.whole, curvatures=self.curvatures)
        turned = degrees(turned_by(flown, whole=self.whole, curvatures=self.curvatures))
        return plane_pose(Pose(self.start, self.heading_deg), along, across=across, turned_deg=turned)

    def position(self, distance: float) -> Point:
        """Position ``distance`` [m] along the piece."""
        return self.pose(distance).point

    def curvature(self, distance: ArrayLike) -> Array:
        """Curvature [1/m], + to the right, in the shape of ``distance``."""
        part = (self.begin + np.asarray(distance, dtype=float)) / self.whole
        before, after = self.curvatures
        return before + (after - before) * part * part * (3.0 - 2.0 * part)

    def section(self, begin: float, end: float) -> Spiral:
        """The part of the piece between two distances [m] from its start."""
        return replace(self, begin=self.begin + begin, length=end - begin)


Path = Stay | Leg | Arc | Spiral
Way = list[Leg | Arc | Spiral]


def turned_by(distance: float, *, whole: float, curvatures: tuple[float, float]) -> float:
    """Change of direction [rad], + to the right, ``distance`` after the start of a spiral: the curvature's integral.

    ``whole``: its length [m]; ``curvatures`` [1/m] at its start and its end.
    """
    before, after = curvatures
    part = distance / whole
    return distance * (before + (after - before) * part * part * (1.0 - 0.5 * part))


def spiral_shape(distance: float, *, whole: float, curvatures: tuple[float, float]) -> tuple[float, float]:
    """Displacement (along, across) [m] in the plane ``distance`` [m] after the start of a spiral, + to the right.

    ``whole``: its length [m]; ``curvatures`` [1/m] at its start and its end.
    """
    along = across = 0.0
    for node, weight in GAUSS:
        direction = turned_by(distance * node, whole=whole, curvatures=curvatures)
        along += weight * cos(direction)
        across += weight * sin(direction)
    return distance * along, distance * across


def plane_pose(origin: Pose, along: float, *, across: float, turned_deg: float = 0.0) -> Pose:
    """The pose ``along`` [m] ahead of ``origin`` and ``across`` [m] to its right, ``turned_deg`` from its direction.

    Plane coordinates of the azimuthal equidistant projection about ``origin``. Directions are carried from there along
    the geodesic.
    """
    bearing = origin.heading_deg + degrees(atan2(across, along))
    end = WGS84.Direct(*origin.point, bearing, hypot(along, across), _POSE)
    heading = origin.heading_deg + turned_deg + end["azi2"] - bearing
    return Pose(Point(end["lat2"], end["lon2"]), remainder(heading, 360.0))


def plane_shape(origin: Pose, pose: Pose) -> tuple[float, float, float]:
    """``along``, ``across`` [m] and ``turned_deg`` (-180 to 180) of a pose: the inverse of :func:`plane_pose`."""
    line = WGS84.Inverse(*origin.point, *pose.point)
    bearing = radians(line["azi1"] - origin.heading_deg)
    turned = pose.heading_deg - line["azi2"] + line["azi1"] - origin.heading_deg
    return line["s12"] * cos(bearing), line["s12"] * sin(bearing), remainder(turned, 360.0)


def offset(origin: Point, bearing_deg: float, *, along: float, across: float) -> Point:
    """The point ``along`` [m] on ``bearing_deg`` and ``across`` [m] to its right, as seen from ``origin``."""
    return plane_pose(Pose(origin, bearing_deg), along, across=across).point


def length_of(way: Sequence[Path]) -> float:
    """Distance flown [m] over all the pieces of a way."""
    return sum(piece.length for piece in way)
