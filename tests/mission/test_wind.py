"""Wind, and flight in it, against the triangle of velocities."""

import re

import numpy as np
import pytest

from tests.mission.flight_checks import gaps, seen
from tests.mission.small_missions import BREEZE, HOVER, IDLE, SHEAR, TOUR, climb, cruise, descent, flown
from vrsopt.errors import InputError
from vrsopt.mission.profile import Profile
from vrsopt.mission.route import WGS84
from vrsopt.mission.wind import CALM, Wind

NORTHERLY = {"from_deg": 0.0, "speed_m_s": 10.0}


@pytest.fixture(scope="module", params=[BREEZE, SHEAR], ids=["breeze", "shear"])
def windy(request) -> Profile:
    return flown(*TOUR, wind=request.param)


def held(profile: Profile) -> list[int]:
    """Segments of constant airspeed in wind: written as longer series than changes of speed are."""
    return [i for i, s in enumerate(profile.segments) if s.motion.distance.degree() > 4]


def test_directions_are_those_of_weather_reports():
    east, north = Wind.from_directions([0.0, 100.0, 300.0], [0.0, 90.0, 225.0], [1.0, 2.0, 4.0]).at([0.0, 100.0, 300.0])
    np.testing.assert_allclose(east, [0.0, -2.0, 8.0**0.5], atol=1e-15)
    np.testing.assert_allclose(north, [-1.0, 0.0, 8.0**0.5], atol=1e-15)


def test_wind_is_linear_between_altitudes_and_constant_beyond():
    wind = Wind((100.0, 300.0), (2.0, 6.0), (0.0, -8.0))
    east, north = wind.at([[-50.0, 100.0, 150.0], [200.0, 300.0, 5000.0]])
    np.testing.assert_allclose(east, [[2.0, 2.0, 3.0], [4.0, 6.0, 6.0]])
    np.testing.assert_allclose(north, [[0.0, 0.0, -2.0], [-4.0, -8.0, -8.0]])
    assert wind.strongest == 10.0 and not wind.calm
    assert CALM.calm and CALM.strongest == 0.0


def test_along_a_course_and_across():
    wind = Wind.from_directions([0.0], [270.0], [7.0])  # blows east
    along, across = wind.along_and_across([90.0, 0.0, 180.0, 270.0, 45.0], 300.0)
    np.testing.assert_allclose(along, [7.0, 0.0, 0.0, -7.0, 24.5**0.5], atol=1e-14)
    np.testing.assert_allclose(across, [0.0, 7.0, -7.0, 0.0, 24.5**0.5], atol=1e-14)


def test_out_and_back_along_the_wind_takes_what_the_textbook_says():
    """2 L V / (V^2 - w^2) for legs of L, on the longest pieces of both legs, which are held."""
    stop = (descent(), HOVER, climb(600.0))
    profile = flown(HOVER, climb(600.0), cruise("north"), *stop, cruise("home"), descent(), HOVER, wind=NORTHERLY)
    out, back = (
        max((s for s in profile.segments if s.task == f"cruise to {name}"), key=lambda s: s.duration)
        for name in ("north", "home")
    )
    lengths = [segment.motion.distance(segment.duration) - segment.motion.distance(0.0) for segment in (out, back)]
    assert out.duration == pytest.approx(lengths[0] / 40.0, rel=1e-12)
    assert back.duration == pytest.approx(lengths[1] / 60.0, rel=1e-12)
    per_metre = out.duration / lengths[0] + back.duration / lengths[1]
    assert per_metre == pytest.approx(2.0 * 50.0 / (50.0**2 - 10.0**2), rel=1e-12)


def test_a_leg_across_the_wind_is_flown_at_the_root_of_the_difference_of_squares():
    profile = flown(HOVER, climb(600.0), cruise("east"), descent(), HOVER, wind=NORTHERLY)
    leg = max(profile.segments, key=lambda s: s.duration)
    speed = leg.motion.kinematics(np.linspace(0.0, leg.duration, 9)).ground_speed
    np.testing.assert_allclose(speed, (50.0**2 - 10.0**2) ** 0.5, rtol=5e-4)  # the course changes by 0.1 degrees
    assert leg.task == "cruise to east"


def test_airspeed_is_held(windy):
    checked = held(windy)
    assert len(checked) > 60
    for index in checked:
        segment = windy.segments[index]
        found = windy.conditions(index, np.linspace(segment.start, segment.end, 25))
        horizontal = found.speed * np.cos(found.climb_angle)
        assert np.ptp(horizontal) < 1e-9, segment


def test_airspeeds_held_are_those_stated(windy):
    speeds = {
        round(float(windy.conditions(index, windy.segments[index].start).speed), 6)
        for index in held(windy)
        if windy.segments[index].kind in ("cruise", "loiter", "search")
    }
    assert speeds == {55.0, 40.0, 60.0, 50.0, 45.0}


def test_triangle_of_velocities_of_the_positions(windy):
    """What the positions show, less the wind, is the airspeed that is held."""
    for index in held(windy)[::3]:
        segment = windy.segments[index]
        if segment.duration < 1.0:
            continue
        times = np.linspace(0.2, segment.duration - 0.2, 7)
        flight = seen(segment, times, 0.05)
        through_air = flight.velocity[:, :2] - np.stack(windy.wind.at(flight.altitude), -1)
        found = windy.conditions(index, segment.start + times)
        horizontal = found.speed * np.cos(found.climb_angle)
        np.testing.assert_allclose(np.linalg.norm(through_air, axis=-1), horizontal, atol=3e-6)


def test_ground_speed_varies_around_a_circle_in_wind():
    tasks = (HOVER, climb(600.0), cruise("north", 40.0), TOUR[8], cruise("home"), descent(), HOVER)
    for wind, low, high in ((BREEZE, 28.0, 52.0), ({"from_deg": 0.0, "speed_m_s": 0.0}, 40.0, 40.0)):
        profile = flown(*tasks, wind=wind)
        orbit = [s for s in profile.segments if s.kind == "loiter" and s.duration > 20.0]
        speeds = [s.motion.kinematics(np.linspace(0.0, s.duration, 400)).ground_speed for s in orbit]
        assert np.min(np.concatenate(speeds)) == pytest.approx(low, abs=0.01)
        assert np.max(np.concatenate(speeds)) == pytest.approx(high, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [20.0, 25.0, 65.0])
@pytest.mark.parametrize("from_deg", [0.0, 90.0, 200.0])
def test_a_long_change_of_speed_in_a_turn_ends_at_the_speed_held_after_it(speed, from_deg):
    """The course turns by radians while the speed changes, and with it the ground speed to end with."""
    orbit = {**TOUR[8], "speed_m_s": speed, "turn_radius_m": 550.0, "duration_s": 1500.0}
    way = (HOVER, climb(600.0), cruise("north", 50.0), orbit, cruise("home"), descent(), HOVER)
    profile = flown(*way, wind={"from_deg": from_deg, "speed_m_s": 15.0})
    for what, gap in gaps(profile).items():
        assert what == "acceleration" or gap < 1e-7, what


def test_a_hover_feels_the_wind_and_the_ground_does_not():
    profile = flown(IDLE, HOVER, climb(600.0), cruise("north"), descent(), HOVER, IDLE, wind=SHEAR)
    grid = profile.grid(5.0)
    kinds = np.array([segment.kind for segment in profile.segments])[grid.segment]
    np.testing.assert_array_equal(grid.speed[kinds == "idle"], 0.0)
    still = (kinds == "hover") & (grid.altitude == 402.0)
    east, north = profile.wind.at(402.0)
    assert still.sum() > 5
    np.testing.assert_allclose(grid.speed[still], np.hypot(east, north), rtol=1e-12)
    np.testing.assert_allclose(grid.load_factor[still], 1.0, atol=1e-12)


def test_altitudes_of_the_wind_part_a_climb():
    wind = {"altitude_m": [650.0, 800.0, 1500.0], "from_deg": [200.0, 230.0, 280.0], "speed_m_s": [3.0, 8.0, 14.0]}
    profile = flown(HOVER, climb(1000.0), cruise("east"), descent(), HOVER, wind=wind)
    ends = [segment.motion.altitude(segment.duration) for segment in profile.segments if segment.kind == "climb"]
    for level in (650.0, 800.0):
        assert min(abs(end - level) for end in ends) < 1e-9


def test_wind_too_strong_is_refused_in_one_line():
    with pytest.raises(InputError) as error:
        flown(
            HOVER,
            climb(600.0, 20.0),
            cruise("north", 20.0),
            descent(speed=20.0),
            HOVER,
            wind={"from_deg": 0.0, "speed_m_s": 19.5},
        )
    assert str(error.value).startswith("test: wind = 19.5 m/s against and ")
    assert " m/s across a course of " in str(error.value) and "\n" not in str(error.value)
    assert str(error.value).endswith(": what leaves at least 1 m/s over the ground")


@pytest.mark.slow
def test_a_radius_too_tight_down_the_wind_is_refused():
    """60 degrees of bank are the most, at the speed over the ground."""
    orbit = {"kind": "loiter", "pattern": "circle", "around": "north", "speed_m_s": 40.0, "duration_s": 300.0}
    for wind, least in ((0.0, 94.2), (15.0, 178.1)):
        for radius in (least - 0.2, least + 0.2):
            tasks = (HOVER, climb(600.0), cruise("north", 40.0), {**orbit, "turn_radius_m": radius}, cruise("home"))
            try:
                profile = flown(*tasks, descent(), HOVER, wind={"from_deg": 40.0, "speed_m_s": wind})
                assert radius > least
                assert profile.grid(1.0).turn_load_factor.max() == pytest.approx(2.0, abs=0.03)
            except InputError as error:
                assert radius < least
                assert "tasks[3].turn_radius_m = " in str(error) or "tasks[3]: turn" in str(error)


def test_a_pattern_is_reached_in_the_wind_there_is():
    """Against 20 m/s the way takes longer than in still air: what does not suffice is refused, what does gets there."""
    orbit = {"kind": "loiter", "pattern": "circle", "around": "home", "speed_m_s": 30.0, "turn_radius_m": 300.0}
    way = (HOVER, climb(600.0), cruise("north", 40.0))
    back = (cruise("east"), descent(), HOVER)
    against = {"from_deg": 180.0, "speed_m_s": 20.0}
    with pytest.raises(InputError) as error:
        flown(*way, {**orbit, "duration_s": 60.0}, *back, wind=against)
    least = float(re.search(r"allowed: more than ([\d.]+), the time to the pattern", str(error.value))[1])
    calm = pytest.raises(InputError, flown, *way, {**orbit, "duration_s": 60.0}, *back)
    assert least > 1.5 * float(re.search(r"more than ([\d.]+)", str(calm.value))[1])
    profile = flown(*way, {**orbit, "duration_s": least + 1.0}, *back, wind=against)
    last = max(index for index, segment in enumerate(profile.segments) if segment.kind == "loiter")
    place = np.array(profile.positions(last, profile.segments[last].end))
    home = np.array(profile.positions(0, 0.0))
    assert WGS84.Inverse(*place, *home)["s12"] == pytest.approx(300.0, rel=0.1)


@pytest.mark.parametrize("pattern", ["circle", "race_track"])
def test_a_pattern_is_flown_at_its_own_speed(pattern):
    """However fast the aircraft comes and however near the pattern is: its turns are made for its speed."""
    leg = {"leg_m": 1000.0} if pattern == "race_track" else {}
    orbit = {"kind": "loiter", "pattern": pattern, "around": "home", "speed_m_s": 30.0, "turn_radius_m": 100.0, **leg}
    profile = flown(
        HOVER, climb(600.0), cruise("north", 60.0), {**orbit, "duration_s": 900.0}, cruise("east"), descent(), HOVER
    )
    nodes = profile.grid(1.0)
    bank = np.degrees(np.arccos(1.0 / nodes.turn_load_factor))
    steady = np.degrees(np.arctan(30.0**2 / (9.80665 * 100.0)))
    assert steady - 0.5 < bank.max() < steady + 2.0
