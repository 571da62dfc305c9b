"""Speed laws: distance over the ground and altitude over time, of flight at constant airspeed and of its changes.

Airspeed is held, ground speed follows from the triangle of velocities; a change leads from one pair of horizontal and
vertical speed to another as the smoothstep 3 s^2 - 2 s^3 of time, whose largest slope is 1.5 times its mean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from vrsopt.errors import InputError
from vrsopt.mission.route import Path
from vrsopt.mission.wind import Array, Wind

PEAK = 1.5  # largest slope of the smoothstep over its mean
SMOOTHSTEP = Polynomial([0.0, 0.0, 3.0, -2.0])
WIND_DEGREES = (12, 24, 48, 96, 192)  # of the speed over time in wind, as far as it takes
RESOLVED = 1e-12  # relative, last coefficients of a speed that is written out fully
COURSE_DEGREE = 24  # a whole circle to 1e-13 degrees
WIND_SWEEPS = 60
CLOSED = 1e-13  # relative, where a fixed point of the speed is taken as found
SLOWEST = 1.0  # m/s over the ground, below it a track cannot be held against the wind


@dataclass(frozen=True)
class SpeedLaw:
    """Distance along the way and altitude [m] as series in time from 0 to ``duration`` [s]."""

    duration: float
    distance: Chebyshev
    altitude: Chebyshev

    def part(self, begin: float, end: float) -> SpeedLaw:
        """The law between two times [s], its own time counted from ``begin``."""
        return SpeedLaw(end - begin, *(_part(series, begin, end) for series in (self.distance, self.altitude)))

    def time_at(self, distance: float) -> float:
        """The time [s] at which ``distance`` [m] along the way is reached."""
        low, high = float(self.distance(0.0)), float(self.distance(self.duration))
        if distance <= low:
            return 0.0
        if distance >= high:
            return self.duration
        return float(brentq(lambda t: self.distance(t) - distance, 0.0, self.duration, xtol=1e-12, rtol=1e-15))


def change(
    begin: tuple[float, float], rates: tuple[tuple[float, float], tuple[float, float]], duration: float
) -> SpeedLaw:
    """A smooth change in ``duration`` [s] that begins at a distance and an altitude [m].

    ``rates``: ground speed at its start and end, climb rate at its start and end [m/s].
    """
    series = []
    for start, (first, last) in zip(begin, rates, strict=True):
        series.append(_travelled(first + (last - first) * SMOOTHSTEP, duration, start))
    return SpeedLaw(duration, *series)


def change_duration(differences: tuple[float, float], largest: tuple[float, float]) -> float:
    """Time [s] in which horizontal and vertical speed change by ``differences`` [m/s] within ``largest`` [m/s2]."""
    return PEAK * max(abs(difference) / most for difference, most in zip(differences, largest, strict=True))


def ground_speed(airspeed: float, course_deg: ArrayLike, altitude: ArrayLike, wind: Wind) -> Array:
    """Speeds over the ground [m/s] on courses [deg] at horizontal airspeed [m/s]: the triangle of velocities.

    ``course_deg``: true; ``altitude`` [m], at which ``wind`` is taken. Raises :class:`InputError` if the wind is too
    strong to hold a course.
    """
    along, across = wind.along_and_across(course_deg, altitude)
    square = airspeed**2 - across**2
    speed = np.where(square > 0.0, along + np.sqrt(np.maximum(square, 0.0)), 0.0)
    if np.any(speed < SLOWEST):
        worst = np.argmin(speed)
        head, side = (round(float(part.flat[worst]), 1) + 0.0 for part in (-along, np.abs(across)))
        course, height = (np.broadcast_to(part, speed.shape).flat[worst] for part in (course_deg, altitude))
        raise InputError(
            f"wind = {head} m/s against and {side} m/s across a course of {course % 360:.0f} deg "
            f"at {height:.0f} m: allowed at {airspeed:g} m/s: what leaves at least {SLOWEST:g} m/s over the ground"
        )
    return speed


def course_along(piece: Path, start: float, begin: float, end: float) -> Chebyshev:
    """Course [deg] on a piece of a way as a series in the distance [m] along the way; it does not jump at north.

    The piece starts at ``start``, the series goes from ``begin`` to ``end``. Courses are next to linear in distance, on
    spirals of fourth degree.
    """

    def course(distance: Array) -> Array:
        return np.unwrap([piece.pose(d - start).heading_deg for d in distance], period=360.0)

    return Chebyshev.interpolate(course, COURSE_DEGREE, domain=[begin, end])


def hold(
    course: Chebyshev | None, begin: tuple[float, float], speeds: tuple[float, float], duration: float, wind: Wind
) -> SpeedLaw:
    """Constant horizontal airspeed and climb rate ``speeds`` [m/s] for ``duration`` [s] from distance and altitude.

    In wind it is found by fixed-point sweeps over a Chebyshev series. ``course`` is that of :func:`course_along`, taken
    as constant beyond its ends; None in still air, where it does not matter. ``begin``: distance and altitude [m].
    """
    distance, altitude = begin
    airspeed, climb_rate = speeds
    rise = _travelled(Polynomial([climb_rate]), duration, altitude)
    speed = Chebyshev([airspeed], domain=[0.0, duration])
    track = speed.integ(lbnd=0.0, k=distance)
    if course is None:
        return SpeedLaw(duration, track, rise)

    def speed_at(time: Array) -> Array:
        return ground_speed(airspeed, course(np.clip(track(time), *course.domain)), rise(time), wind)

    for degree in WIND_DEGREES:
        for _ in range(WIND_SWEEPS):
            before, speed = speed, Chebyshev.interpolate(speed_at, degree, domain=[0.0, duration])
            track = speed.integ(lbnd=0.0, k=distance)
            if np.max(np.abs((speed - before).coef)) <= CLOSED * airspeed:
                break
        if np.max(np.abs(speed.coef[-3:])) <= RESOLVED * airspeed:
            break
    return SpeedLaw(duration, track, rise)


def _travelled(speed: Polynomial, duration: float, start: float) -> Chebyshev:
    """What a speed, a polynomial in the part of ``duration`` [s] that is over, adds to ``start``: a series in time.

    Speeds are what is written as series, and then integrated: of a short piece far along the way the differences of
    distances would lose them in rounding.
    """
    rate = Chebyshev.interpolate(lambda t: speed(t / duration), speed.degree(), domain=[0.0, duration])
    return rate.integ(lbnd=0.0, k=start)


def _part(series: Chebyshev, begin: float, end: float) -> Chebyshev:
    """The series from ``begin`` to ``end`` [s]."""
    speed, degree = series.deriv(), max(0, series.degree() - 1)
    rate = Chebyshev.interpolate(lambda t: speed(t + begin), degree, domain=[0.0, end - begin])
    return rate.integ(lbnd=0.0, k=float(series(begin)))
