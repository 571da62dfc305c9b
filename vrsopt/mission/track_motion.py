"""The motion of a smoothed track: positions in a plane, speeds and accelerations as their derivatives."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from vrsopt.mission.conditions import Kinematics
from vrsopt.mission.route import WGS84, Point

Array = NDArray[Any]
STANDING = 1.0  # m/s, a slower motion has no course of its own


@dataclass(frozen=True)
class Plane:
    """Plane coordinates east and north [m]: the azimuthal equidistant projection about ``centre``.

    Lengths across the direction to the centre are too long by (d / R)^2 / 6 at the distance d: 4 parts in 100 000 at
    100 km.
    """

    centre: Point

    def project(self, latitude_deg: Array, longitude_deg: Array) -> Array:
        """East and north (N, 2) [m]."""
        mask = WGS84.DISTANCE | WGS84.AZIMUTH
        lines = [
            WGS84.Inverse(*self.centre, lat, lon, mask) for lat, lon in zip(latitude_deg, longitude_deg, strict=True)
        ]
        distance, bearing = np.array([(line["s12"], np.radians(line["azi1"])) for line in lines]).reshape(-1, 2).T
        return np.stack([distance * np.sin(bearing), distance * np.cos(bearing)], axis=1)

    def unproject(self, place: Array) -> tuple[Array, Array, Array]:
        """Latitude and longitude [deg], and the true direction of what points north in the plane [deg], each (N,)."""
        rows = []
        for east, north in place:
            end = WGS84.Direct(*self.centre, np.degrees(np.arctan2(east, north)), np.hypot(east, north))
            rows.append((end["lat2"], end["lon2"], end["azi2"] - end["azi1"]))
        latitude, longitude, turn = np.array(rows).reshape(-1, 3).T
        return latitude, longitude, turn


@dataclass(frozen=True)
class SmoothTrack:
    """A whole track as curves in time [s]: east and north [m] in the plane, altitude [m], not below ``floor``."""

    plane: Plane
    place: BSpline = field(repr=False)
    altitude: BSpline = field(repr=False)
    duration: float
    floor: float = -np.inf

    def velocity(self, time: Array) -> Array:
        """East and north (N, 2) [m/s]."""
        return np.asarray(self._velocity(time))

    def heights(self, time: Array) -> Array:
        """Altitude (N,) [m]."""
        return np.maximum(self.altitude(time)[:, 0], self.floor)

    def climb_rate(self, time: Array) -> Array:
        """(N,) [m/s]."""
        return np.asarray(self._climb_rate(time)[:, 0])

    def direction(self, time: Array) -> Array:
        """Unit vector (N, 2) along the track; where it stands, the one it last had, or will first have."""
        velocity = self.velocity(time)
        speed = np.linalg.norm(velocity, axis=1)
        seconds, kept = self._directions
        held = kept[np.clip(np.searchsorted(seconds, time, side="right") - 1, 0, None)]
        moving = (speed > STANDING)[:, None]
        return np.where(moving, velocity / np.where(moving, speed[:, None], 1.0), held)

    def kinematics(self, time: Array) -> Kinematics:
        """See :class:`vrsopt.mission.motion.Motion`, at times of the whole track."""
        acceleration = np.asarray(self._acceleration(time))
        east, north = self.direction(time).T
        return Kinematics(
            ground_speed=np.linalg.norm(self.velocity(time), axis=1),
            acceleration=acceleration[:, 0] * east + acceleration[:, 1] * north,
            lateral_acceleration=acceleration[:, 0] * north - acceleration[:, 1] * east,
            altitude=self.heights(time),
            climb_rate=self.climb_rate(time),
            vertical_acceleration=self._lift(time)[:, 0],
        )

    def track(self, time: Array) -> tuple[Array, Array, Array]:
        """See :class:`vrsopt.mission.motion.Motion`, at times of the whole track."""
        latitude, longitude, turn = self.plane.unproject(self.place(time))
        east, north = self.direction(time).T
        return latitude, longitude, np.degrees(np.arctan2(east, north)) + turn

    @cached_property
    def _velocity(self) -> BSpline:
        return self.place.derivative()

    @cached_property
    def _acceleration(self) -> BSpline:
        return self.place.derivative(2)

    @cached_property
    def _climb_rate(self) -> BSpline:
        return self.altitude.derivative()

    @cached_property
    def _lift(self) -> BSpline:
        return self.altitude.derivative(2)

    @cached_property
    def _directions(self) -> tuple[Array, Array]:
        """Times [s] and directions where it moves; north if it never does."""
        seconds = np.linspace(0.0, self.duration, int(self.duration) + 2)
        velocity = self.velocity(seconds)
        speed = np.linalg.norm(velocity, axis=1)
        moving = speed > STANDING
        if not moving.any():
            return np.zeros(1), np.array([[0.0, 1.0]])
        return seconds[moving], velocity[moving] / speed[moving, None]


@dataclass(frozen=True)
class TrackMotion:
    """The part of a track that begins at ``start`` [s]: :class:`vrsopt.mission.motion.Motion` of a segment."""

    curve: SmoothTrack
    start: float

    def kinematics(self, time: Array) -> Kinematics:
        """See :class:`vrsopt.mission.motion.Motion`."""
        return self.curve.kinematics(np.asarray(time, dtype=float) + self.start)

    def track(self, time: Array) -> tuple[Array, Array, Array]:
        """See :class:`vrsopt.mission.motion.Motion`."""
        return self.curve.track(np.asarray(time, dtype=float) + self.start)


@dataclass(frozen=True)
class StandingMotion:
    """Standing over a point at an altitude [m], facing a course [deg]."""

    point: Point
    altitude: float
    course_deg: float

    def kinematics(self, time: Array) -> Kinematics:
        """See :class:`vrsopt.mission.motion.Motion`."""
        none = np.zeros(np.shape(time))
        return Kinematics(none, none, none, none + self.altitude, none, none)

    def track(self, time: Array) -> tuple[Array, Array, Array]:
        """See :class:`vrsopt.mission.motion.Motion`."""
        none = np.zeros(np.shape(time))
        return none + self.point.latitude_deg, none + self.point.longitude_deg, none + self.course_deg
