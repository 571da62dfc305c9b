"""Speed laws: distance over the ground and altitude over time, of flight at constant airspeed and of its changes.

Airspeed is held, ground speed follows from the triangle of velocities; a change leads from one pair of horizontal and
vertical speed to another as the smoothstep 3 s^2 - 2 s^3 of time, whose largest slope is 1.5 times its mean.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial
from scipy.optimize import brentq

from vrsopt.errors import InputError
from vrsopt.mission.chain import Chain
from vrsopt.mission.wind import Wind

PEAK = 1.5  # largest slope of the smoothstep over its mean
SMOOTHSTEP_INTEGRAL = Polynomial([0.0, 0.0, 0.0, 1.0, -0.5])  # of 3 s^2 - 2 s^3 from 0
WIND_DEGREE = 12  # of the distance over time in wind
WIND_SWEEPS = 60
CLOSED = 1e-11  # relative, where a fixed point of the distance is taken as found
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
        polynomial = Polynomial([start, first * duration]) + (last - first) * duration * SMOOTHSTEP_INTEGRAL
        series.append(_chebyshev(polynomial, duration))
    return SpeedLaw(duration, *series)


def change_duration(differences: tuple[float, float], largest: tuple[float, float]) -> float:
    """Time [s] in which horizontal and vertical speed change by ``differences`` [m/s] within ``largest`` [m/s2]."""
    return PEAK * max(abs(difference) / most for difference, most in zip(differences, largest, strict=True))


def ground_speed(airspeed: float, course_deg: float, altitude: float, wind: Wind) -> float:
    """Speed over the ground [m/s] on a course [deg] at horizontal airspeed [m/s]: the triangle of velocities.

    Raises :class:`InputError` if the wind is too strong to hold the course.
    """
    along, across = (float(part) for part in wind.along_and_across(course_deg, altitude))
    square = airspeed**2 - across**2
    speed = along + sqrt(square) if square > 0.0 else 0.0
    if speed < SLOWEST:
        raise InputError(
            f"wind = {-along:.1f} m/s against and {abs(across):.1f} m/s across a course of {course_deg % 360:.0f} deg "
            f"at {altitude:.0f} m: allowed at {airspeed:g} m/s: what leaves at least {SLOWEST:g} m/s over the ground"
        )
    return speed


def hold(way: Chain, begin: tuple[float, float], speeds: tuple[float, float], duration: float, wind: Wind) -> SpeedLaw:
    """Constant horizontal airspeed and climb rate ``speeds`` [m/s] for ``duration`` [s] from distance and altitude.

    In wind the distance is found by fixed-point sweeps over a Chebyshev series; the way should have no corner of its
    curvature in between.
    """
    distance, altitude = begin
    airspeed, climb_rate = speeds
    rise = _chebyshev(Polynomial([altitude, climb_rate * duration]), duration)
    if wind.calm:
        return SpeedLaw(duration, _chebyshev(Polynomial([distance, airspeed * duration]), duration), rise)
    nodes = 0.5 * duration * (1.0 + np.cos(np.pi * np.arange(WIND_DEGREE + 1) / WIND_DEGREE))
    where = distance + airspeed * nodes
    for _ in range(WIND_SWEEPS):
        rates = [
            ground_speed(airspeed, way.pose(d).heading_deg, float(rise(t)), wind)
            for d, t in zip(where, nodes, strict=True)
        ]
        speed = Chebyshev.fit(nodes, rates, WIND_DEGREE, domain=[0.0, duration])
        series = speed.integ(lbnd=0.0, k=distance)
        previous, where = where, series(nodes)
        if np.max(np.abs(where - previous)) <= CLOSED * max(1.0, airspeed * duration):
            break
    return SpeedLaw(duration, series, rise)


def _chebyshev(polynomial: Polynomial, duration: float) -> Chebyshev:
    """A polynomial in the fraction of ``duration`` as a series in time."""
    degree = polynomial.degree()
    return Chebyshev.interpolate(lambda t: polynomial(t / duration), degree, domain=[0.0, duration])


def _part(series: Chebyshev, begin: float, end: float) -> Chebyshev:
    return Chebyshev.interpolate(lambda t: series(t + begin), series.degree(), domain=[0.0, end - begin])
