"""Speed laws against the closed form of what they are."""

from math import sin

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.mission.route import Arc, Leg, Point, Pose
from vrsopt.mission.speed_law import change, change_duration, course_along, ground_speed, hold
from vrsopt.mission.wind import CALM, Wind

HERE = Point(47.0, 8.0)
LEG = Leg(HERE, 30.0, 1e5)
STRAIGHT = course_along(LEG, 0.0, 0.0, LEG.length)


def rates(law, time):
    """Ground speed, acceleration, climb rate and vertical acceleration."""
    return tuple(series.deriv(order)(time) for series in (law.distance, law.altitude) for order in (1, 2))


def test_a_change_is_the_smoothstep_of_both_speeds():
    law = change((100.0, 300.0), ((10.0, 40.0), (0.0, 5.0)), 20.0)
    time = np.linspace(0.0, 20.0, 41)
    share = 3.0 * (time / 20.0) ** 2 - 2.0 * (time / 20.0) ** 3
    speed, _, rate, _ = rates(law, time)
    np.testing.assert_allclose(speed, 10.0 + 30.0 * share, rtol=1e-14)
    np.testing.assert_allclose(rate, 5.0 * share, atol=1e-14)
    assert law.distance(0.0) == pytest.approx(100.0, abs=1e-12) and law.altitude(0.0) == pytest.approx(300.0)
    assert law.distance(20.0) == pytest.approx(100.0 + 20.0 * 25.0, abs=1e-11)
    assert law.altitude(20.0) == pytest.approx(300.0 + 20.0 * 2.5, abs=1e-11)


def test_the_peak_of_a_change_is_half_way_and_one_and_a_half_times_the_mean():
    law = change((0.0, 0.0), ((0.0, 40.0), (0.0, -5.0)), 60.0)
    time = np.linspace(0.0, 60.0, 2001)
    _, acceleration, _, upward = rates(law, time)
    assert acceleration.max() == pytest.approx(1.5 * 40.0 / 60.0, rel=1e-12)
    assert time[acceleration.argmax()] == 30.0
    assert upward.min() == pytest.approx(-1.5 * 5.0 / 60.0, rel=1e-12)
    np.testing.assert_allclose([acceleration[0], acceleration[-1], upward[0], upward[-1]], 0.0, atol=1e-14)


@pytest.mark.parametrize(("differences", "expected"), [((40.0, 0.0), 60.0), ((-4.0, 5.0), 15.0), ((0.0, 0.0), 0.0)])
def test_duration_of_a_change_is_that_of_the_slower_of_both(differences, expected):
    assert change_duration(differences, (1.0, 0.5)) == pytest.approx(expected, rel=1e-15)


def test_parts_of_a_law_are_the_law():
    law = change((55_000.0, 600.0), ((40.0, 55.0), (5.0, 0.0)), 22.0)
    for begin, end in ((0.0, 7.0), (7.0, 22.0), (3.3, 3.3 + 1e-6)):
        part = law.part(begin, end)
        time = np.linspace(0.0, end - begin, 7)
        assert part.duration == end - begin
        np.testing.assert_allclose(part.distance(time), law.distance(time + begin), rtol=1e-14)
        np.testing.assert_allclose(part.altitude(time), law.altitude(time + begin), rtol=1e-14)
        for one, other, exact in zip(rates(part, time), rates(law, time + begin), (1e-12, 1e-7) * 2, strict=True):
            np.testing.assert_allclose(one, other, atol=exact)


@pytest.mark.parametrize("duration", [1e-7, 1e-4, 1.0])
def test_speeds_of_the_briefest_change_far_along_the_way_are_exact(duration):
    """Not lost in the rounding of distances: a corner of the way may leave any piece of a change."""
    law = change((200_000.0, 1900.0), ((40.0, 40.0 + duration), (5.0, 5.0 - 0.5 * duration)), duration)
    speed, acceleration, rate, upward = rates(law, np.linspace(0.0, duration, 5))
    smoothstep = np.array([0.0, 1.125, 1.5, 1.125, 0.0])  # its slope, in quarters
    np.testing.assert_allclose(speed, 40.0, atol=1.1 * duration + 1e-12)
    np.testing.assert_allclose(rate, 5.0, atol=1.1 * duration + 1e-12)
    np.testing.assert_allclose(acceleration, smoothstep, atol=1e-13 / duration + 1e-12)
    np.testing.assert_allclose(upward, -0.5 * smoothstep, atol=1e-13 / duration + 1e-12)


@pytest.mark.parametrize("distance", [-5.0, 0.0, 1.0, 399.0, 900.0, 1200.0, 1300.0])
def test_time_at_a_distance(distance):
    law = change((0.0, 0.0), ((0.0, 40.0), (0.0, 0.0)), 60.0)
    time = law.time_at(distance)
    assert 0.0 <= time <= 60.0
    assert law.distance(time) == pytest.approx(min(max(distance, 0.0), 1200.0), abs=1e-9)


def test_held_in_still_air():
    law = hold(None, (50.0, 300.0), (39.0, -5.0), 12.0, CALM)
    assert law.distance(12.0) == pytest.approx(50.0 + 39.0 * 12.0, rel=1e-15)
    assert law.altitude(12.0) == pytest.approx(240.0, rel=1e-15)
    assert law.distance.degree() == law.altitude.degree() == 1


@pytest.mark.parametrize(
    ("course", "expected"), [(0.0, 40.0), (180.0, 60.0), (90.0, np.sqrt(2400.0)), (45.0, np.sqrt(2450.0) - 50.0**0.5)]
)
def test_triangle_of_velocities(course, expected):
    north = Wind.from_directions([0.0], [0.0], [10.0])  # from the north
    assert ground_speed(50.0, course, 300.0, north) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("airspeed", "course", "message"),
    [
        (20.0, 0.0, "wind = 20.0 m/s against and 0.0 m/s across a course of 0 deg at 300 m: allowed at 20 m/s: what"),
        (20.9, 360.0, "wind = 20.0 m/s against and 0.0 m/s across a course of 0 deg at 300 m: allowed at 20.9 m/s: "),
        (15.0, -90.0, "wind = 0.0 m/s against and 20.0 m/s across a course of 270 deg at 300 m: allowed at 15 m/s"),
    ],
)
def test_wind_that_stops_the_aircraft_is_refused(airspeed, course, message):
    north = Wind.from_directions([0.0], [0.0], [20.0])
    with pytest.raises(InputError) as error:
        ground_speed(airspeed, course, 300.0, north)
    assert str(error.value).startswith(message)
    assert str(error.value).endswith("what leaves at least 1 m/s over the ground")


def test_the_least_ground_speed_is_flown():
    north = Wind.from_directions([0.0], [0.0], [20.0])
    assert ground_speed(21.0 + 1e-9, 0.0, 300.0, north) == pytest.approx(1.0, abs=1e-8)


def test_airspeed_is_held_around_a_whole_circle_in_a_wind_almost_as_fast():
    """The ground speed goes from 5 to 35 m/s and back; time around by quadrature over the course."""
    wind, radius = Wind.from_directions([0.0], [250.0], [15.0]), 400.0
    circle = Arc.from_pose(Pose(Point(0.0, 8.0), 10.0), radius, sweep_deg=360.0)  # where meridians are parallel
    angles = 2.0 * np.pi * np.arange(4000) / 4000
    headwind, crosswind = 15.0 * np.cos(angles), 15.0 * np.sin(angles)
    around = 2.0 * np.pi * radius * np.mean(1.0 / (np.sqrt(20.0**2 - crosswind**2) - headwind))
    law = hold(course_along(circle, 0.0, 0.0, circle.length), (0.0, 300.0), (20.0, 0.0), around, wind)
    assert law.distance(around) == pytest.approx(circle.length, abs=1e-4)
    time = np.linspace(0.0, around, 201)
    course = np.radians([circle.pose(float(d)).heading_deg for d in law.distance(time)])
    velocity = law.distance.deriv()(time) * np.array([np.sin(course), np.cos(course)])
    airspeed = np.linalg.norm(velocity - np.array(wind.at(300.0))[:, None], axis=0)
    assert np.ptp(law.distance.deriv()(time)) > 29.0
    np.testing.assert_allclose(airspeed, 20.0, atol=1e-9)


def test_airspeed_is_held_on_a_climb_through_a_wind_that_grows():
    wind = Wind((0.0, 1000.0), (0.0, 12.0), (0.0, -9.0))
    law = hold(STRAIGHT, (0.0, 100.0), (40.0, 5.0), 150.0, wind)
    time = np.linspace(0.0, 150.0, 31)
    course = np.radians([LEG.pose(float(d)).heading_deg for d in law.distance(time)])
    velocity = law.distance.deriv()(time) * np.array([np.sin(course), np.cos(course)])
    blowing = np.outer([0.012, -0.009], law.altitude(time))
    np.testing.assert_allclose(np.linalg.norm(velocity - blowing, axis=0), 40.0, atol=1e-9)
    assert sin(course[0]) == pytest.approx(0.5, abs=1e-12)
