"""Flight conditions against statics, vectors, and what the positions of whole missions show."""

import numpy as np
import pytest

from tests.mission.flight_checks import GRAVITY, Seen, felt, seen
from tests.mission.small_missions import BREEZE, SHEAR, TOUR, flown
from vrsopt.mission.conditions import Kinematics, flight_conditions
from vrsopt.mission.profile import Profile
from vrsopt.mission.wind import CALM, Wind


def conditions(wind=CALM, course=0.0, **given) -> dict[str, float]:
    """Of one instant; what is not given is zero."""
    names = Kinematics.__dataclass_fields__
    motion = Kinematics(**{name: np.array([given.get(name, 0.0)]) for name in names})
    return {name: float(value[0]) for name, value in flight_conditions(motion, np.array([course]), wind).items()}


def test_steady_climb_is_itself():
    found = conditions(ground_speed=40.0, climb_rate=5.0, altitude=300.0)
    assert found["speed"] == pytest.approx(np.hypot(40.0, 5.0), rel=1e-15)
    assert found["climb_angle"] == pytest.approx(np.arctan2(5.0, 40.0), rel=1e-15)
    assert found["equivalent_climb_angle"] == pytest.approx(found["climb_angle"], rel=1e-13)
    assert (found["load_factor"], found["turn_load_factor"], found["turn"]) == (1.0, 1.0, 0.0)
    assert found["altitude"] == 300.0


def test_level_acceleration_is_a_climb_of_a_heavier_aircraft():
    found = conditions(ground_speed=30.0, acceleration=1.0)
    assert found["climb_angle"] == 0.0
    assert found["equivalent_climb_angle"] == pytest.approx(np.arctan(1.0 / GRAVITY), rel=1e-14)
    assert found["load_factor"] == pytest.approx(np.hypot(1.0, 1.0 / GRAVITY), rel=1e-15)
    assert found["turn_load_factor"] == 1.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_level_turn_has_the_load_factor_of_its_bank(side):
    found = conditions(ground_speed=40.0, lateral_acceleration=side * 40.0**2 / 350.0)
    bank = np.arctan(40.0**2 / 350.0 / GRAVITY)
    assert found["load_factor"] == found["turn_load_factor"] == pytest.approx(1.0 / np.cos(bank), rel=1e-14)
    assert found["turn"] == side
    assert found["equivalent_climb_angle"] == pytest.approx(0.0, abs=1e-15)


def test_push_over_is_lighter():
    found = conditions(ground_speed=40.0, climb_rate=5.0, vertical_acceleration=-0.5)
    assert found["load_factor"] == pytest.approx(1.0 - 0.5 / GRAVITY, rel=1e-15)
    assert found["equivalent_climb_angle"] == pytest.approx(found["climb_angle"], rel=1e-13)


@pytest.mark.parametrize("rate", [3.0, -1.0])
def test_vertical_flight(rate):
    found = conditions(climb_rate=rate)
    assert found["speed"] == abs(rate)
    assert found["climb_angle"] == pytest.approx(np.copysign(np.pi / 2.0, rate))
    assert found["equivalent_climb_angle"] == pytest.approx(np.copysign(np.pi / 2.0, rate))


def test_at_rest_there_is_no_direction():
    found = conditions(vertical_acceleration=0.5, acceleration=0.2)
    assert found["speed"] == found["climb_angle"] == found["equivalent_climb_angle"] == found["turn"] == 0.0
    assert found["load_factor"] == pytest.approx(np.hypot(0.2, GRAVITY + 0.5) / GRAVITY, rel=1e-15)


def test_hover_in_wind_is_level_flight():
    found = conditions(Wind.from_directions([0.0], [250.0], [9.0]))
    assert found["speed"] == pytest.approx(9.0, rel=1e-14)
    assert found["load_factor"] == 1.0 and found["climb_angle"] == 0.0
    assert found["equivalent_climb_angle"] == pytest.approx(0.0, abs=1e-15)


def test_what_pushes_an_almost_standing_aircraft_aside_is_no_turn():
    slow = conditions(ground_speed=0.6, lateral_acceleration=0.6)
    assert (slow["turn"], slow["turn_load_factor"]) == (0.0, 1.0)
    assert slow["load_factor"] == pytest.approx(np.hypot(1.0, 0.6 / GRAVITY), rel=1e-14)
    faster = conditions(ground_speed=0.7, lateral_acceleration=0.6)
    assert faster["turn"] == 1.0 and faster["load_factor"] == pytest.approx(slow["load_factor"], rel=1e-14)


def test_any_motion_in_any_wind_against_vectors():
    """Track frame and wind turned by hand into east, north and up."""
    rng = np.random.default_rng(7)
    count = 500
    wind = Wind((0.0, 2000.0), (-8.0, 10.0), (12.0, 3.0))
    motion = Kinematics(
        ground_speed=rng.uniform(15.0, 70.0, count),
        acceleration=rng.uniform(-3.0, 3.0, count),
        lateral_acceleration=rng.uniform(-6.0, 6.0, count),
        altitude=rng.uniform(0.0, 2000.0, count),
        climb_rate=rng.uniform(-12.0, 12.0, count),
        vertical_acceleration=rng.uniform(-2.0, 2.0, count),
    )
    course = rng.uniform(0.0, 360.0, count)
    angle, zero = np.radians(course), np.zeros(count)
    ahead = np.stack([np.sin(angle), np.cos(angle), zero], -1)
    right = np.stack([np.cos(angle), -np.sin(angle), zero], -1)
    up = np.array([0.0, 0.0, 1.0])

    def vector(along, across, upward):
        return along[:, None] * ahead + across[:, None] * right + upward[:, None] * up

    flight = Seen(
        zero,
        vector(motion.ground_speed, zero, motion.climb_rate),
        vector(motion.acceleration, motion.lateral_acceleration, motion.vertical_acceleration),
        motion.altitude,
    )
    expected, found = felt(flight, wind), flight_conditions(motion, course, wind)
    through_air = np.linalg.norm(flight.velocity[:, :2] - np.stack(wind.at(motion.altitude), -1), axis=-1)
    turning = np.abs(expected["aside"]) < 0.5 * through_air
    assert turning.sum() > 450
    for name in ("speed", "climb_angle", "load_factor"):
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-12, atol=1e-12)
    for name in ("turn_load_factor", "equivalent_climb_angle"):
        np.testing.assert_allclose(found[name][turning], expected[name][turning], rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(found["turn"][turning], np.sign(expected["aside"][turning]))


@pytest.fixture(scope="module", params=[None, BREEZE, SHEAR], ids=["calm", "breeze", "shear"])
def tour(request) -> Profile:
    return flown(*TOUR, **({} if request.param is None else {"wind": request.param}))


def test_conditions_of_a_mission_are_those_its_positions_show(tour):
    """Velocity and acceleration by differences of latitude, longitude and altitude; the rest by vectors."""
    checked = 0
    for index, segment in enumerate(tour.segments):
        if segment.kind in ("idle", "ground_idle") or segment.duration < 0.5:
            continue
        times = np.linspace(0.1, segment.duration - 0.1, 7)
        found = tour.conditions(index, segment.start + times)
        flying = found.speed * np.cos(found.climb_angle) > 3.0
        if not flying.any():
            continue
        flight = seen(segment, times[flying], 0.05)
        expected, motion = felt(flight, tour.wind), segment.motion.kinematics(times[flying])
        np.testing.assert_allclose(np.linalg.norm(flight.velocity[:, :2], axis=-1), motion.ground_speed, atol=3e-6)
        np.testing.assert_allclose(flight.velocity[:, 2], motion.climb_rate, atol=1e-9)
        for name in ("speed", "climb_angle", "load_factor", "turn_load_factor", "equivalent_climb_angle"):
            np.testing.assert_allclose(
                getattr(found, name)[flying], expected[name], atol=1e-5, err_msg=f"{name} of {segment.task}"
            )
        turning = np.abs(expected["aside"]) > 1e-3
        np.testing.assert_array_equal(found.turn[flying][turning], np.sign(expected["aside"])[turning])
        checked += flying.sum()
    assert checked > 500


def test_vertical_flight_of_a_mission_is_what_its_altitudes_show(tour):
    found = 0
    for index, segment in enumerate(tour.segments):
        if segment.kind in ("hover", "vertical_climb") and segment.duration > 1.0:
            times = np.linspace(0.2, segment.duration - 0.2, 9)
            flight = seen(segment, times, 0.05)
            motion = segment.motion.kinematics(times)
            np.testing.assert_allclose(flight.velocity[:, 2], motion.climb_rate, atol=1e-8)
            np.testing.assert_allclose(flight.acceleration[:, 2], motion.vertical_acceleration, atol=1e-7)
            np.testing.assert_array_equal(flight.velocity[:, :2], 0.0)
            conditions = tour.conditions(index, segment.start + times)
            np.testing.assert_allclose(conditions.load_factor, 1.0 + motion.vertical_acceleration / GRAVITY, atol=1e-12)
            found += 1
    assert found >= 8
