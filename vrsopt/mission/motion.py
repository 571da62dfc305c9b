"""How the aircraft moves over the ground within a segment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.typing import NDArray

from vrsopt.mission.conditions import Kinematics
from vrsopt.mission.route import Path

Array = NDArray[Any]


class Motion(Protocol):
    """Motion over the time of a segment, from 0 to its duration [s]."""

    def kinematics(self, time: Array) -> Kinematics:
        """Speeds and accelerations over the ground, and the altitude, at times (N,)."""
        ...

    def track(self, time: Array) -> tuple[Array, Array, Array]:
        """Latitude, longitude and course over the ground, clockwise from true north [deg], at times (N,)."""
        ...


@dataclass(frozen=True)
class PathMotion:
    """Flight along a piece of the route: distance from the piece's start [m] and altitude [m] as series in time [s]."""

    path: Path
    distance: Chebyshev
    altitude: Chebyshev

    def kinematics(self, time: Array) -> Kinematics:
        """See :class:`Motion`."""
        ground_speed, climb_rate = self.distance.deriv(), self.altitude.deriv()
        speed = ground_speed(time)
        return Kinematics(
            ground_speed=speed,
            acceleration=ground_speed.deriv()(time),
            lateral_acceleration=speed**2 * self.path.curvature(self.distance(time)),
            altitude=self.altitude(time),
            climb_rate=climb_rate(time),
            vertical_acceleration=climb_rate.deriv()(time),
        )

    def track(self, time: Array) -> tuple[Array, Array, Array]:
        """See :class:`Motion`."""
        poses = [self.path.pose(distance) for distance in self.distance(time)]
        latitude, longitude, course = np.array([(*pose.point, pose.heading_deg) for pose in poses]).reshape(-1, 3).T
        return latitude, longitude, course
