from collections import Counter
from dataclasses import replace
from math import atan, cos, radians
from pathlib import Path

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.mission.file import Mission, mission_from, read_mission
from vrsopt.mission.profile import Profile
from vrsopt.mission.route import WGS84, Arc

SARM = Path(__file__).parents[2] / "problems" / "sarm.toml"


@pytest.fixture(scope="module")
def mission() -> Mission:
    return read_mission(SARM)


@pytest.fixture(scope="module")
def profile(mission) -> Profile:
    return Profile.of(mission)


def distance(a, b) -> float:
    return WGS84.Inverse(*a, *b)["s12"]


def test_sarm_lasts_about_eighty_minutes_and_searches_for_nearly_half_of_it(profile):
    shares = Counter()
    for segment in profile.segments:
        shares[segment.kind] += segment.duration / profile.duration
    assert 75.0 * 60.0 < profile.duration < 95.0 * 60.0
    assert 0.40 < shares["search"] < 0.55
    assert sum(shares.values()) == pytest.approx(1.0, abs=1e-12)


def test_time_bookkeeping(mission, profile):
    edges = profile.edges
    assert edges.shape == (len(profile.segments) + 1,)
    assert edges[0] == 0.0 and edges[-1] == profile.duration
    np.testing.assert_allclose(np.diff(edges), [segment.duration for segment in profile.segments], atol=1e-9)
    for kind in ("idle", "hover", "search"):
        stated = sum(task.duration_s for task in mission.tasks if task.kind == kind)
        assert sum(s.duration for s in profile.segments if s.kind == kind) == pytest.approx(stated, abs=1e-9)


def test_distance_and_height_bookkeeping(profile):
    for segment in profile.segments:
        ground = segment.speed * cos(segment.climb_angle) * segment.duration
        assert ground == pytest.approx(segment.path.length, rel=1e-9, abs=1e-9)
        rise = segment.speed * np.sin(segment.climb_angle) * segment.duration
        assert segment.altitude_start + rise == pytest.approx(segment.altitude_end, abs=1e-9)
        assert 0.0 <= segment.altitude_start <= 2000.0 and 0.0 <= segment.altitude_end <= 2000.0


def test_climb_cruise_and_descent_add_up_to_the_geodesic(mission, profile):
    legs = Counter()
    for segment in profile.segments:
        if segment.kind in ("climb", "cruise", "descent") and "incident" not in segment.task:
            legs[segment.task.split()[-1]] += segment.path.length
    place = {name: entry.point for name, entry in mission.places.items()}
    assert legs["brookside"] == pytest.approx(distance(place["incident"], place["brookside"]), abs=1.0)
    assert legs["KSFO"] == pytest.approx(distance(place["brookside"], place["KSFO"]), abs=1.0)
    outbound = sum(segment.path.length for segment in profile.segments[2:5])
    assert outbound == pytest.approx(distance(place["KSFO"], place["incident"]), abs=1.0)


def test_positions_are_continuous_and_the_mission_ends_where_it_began(profile):
    before = profile.positions(np.arange(len(profile.segments) - 1), profile.edges[1:-1])
    after = profile.positions(np.arange(1, len(profile.segments)), profile.edges[1:-1])
    gaps = [distance(a, b) for a, b in zip(zip(*before, strict=True), zip(*after, strict=True), strict=True)]
    assert max(gaps) < 0.01
    last = len(profile.segments) - 1
    latitude, longitude = profile.positions([0, last], [0.0, profile.duration])
    assert distance((latitude[0], longitude[0]), (latitude[1], longitude[1])) < 1e-6


def test_positions_move_at_the_ground_speed(profile):
    grid = profile.grid(5.0)
    points = list(zip(*profile.positions(grid.segment, grid.time), strict=True))
    for k in range(0, len(points) - 1, 7):
        if grid.segment[k] == grid.segment[k + 1]:
            flown = grid.speed[k] * np.cos(grid.climb_angle[k]) * (grid.time[k + 1] - grid.time[k])
            assert distance(points[k], points[k + 1]) <= flown + 1e-6
            assert distance(points[k], points[k + 1]) >= 0.96 * flown  # chord of a turn


def test_the_pick_up_is_at_the_incident(mission, profile):
    index = int(np.flatnonzero(profile.mass_changes > 0.0)[0])
    segment = profile.segments[index]
    assert (segment.kind, segment.mass_change, segment.altitude_start) == ("hover", 240.0, 30.0)
    assert distance(profile.positions(index, segment.start), mission.places["incident"].point) < 1.0
    assert profile.mass_changes.sum() == 0.0


def test_altitude_is_continuous_but_for_lift_off_and_touch_down(profile):
    for before, after in zip(profile.segments, profile.segments[1:], strict=False):
        jump = 2.0 if "idle" in (before.kind, after.kind) else 0.0
        assert abs(after.altitude_start - before.altitude_end) == pytest.approx(jump, abs=1e-9)


def test_turns_are_flown_at_their_load_factor(profile):
    turning = [s for s in profile.segments if isinstance(s.path, Arc)]
    assert len(turning) == 16
    for segment in turning:
        assert segment.kind == "search"
        assert segment.load_factor == pytest.approx(1.0 / cos(atan(35.0**2 / (9.80665 * 200.0))), rel=1e-12)
        assert segment.load_factor == pytest.approx(1.1790, abs=1e-4)
    assert all(s.load_factor == 1.0 for s in profile.segments if not isinstance(s.path, Arc))


def test_grid_has_both_ends_of_every_segment_and_uniform_steps(profile):
    grid = profile.grid(10.0)
    for index, segment in enumerate(profile.segments):
        times = grid.time[grid.segment == index]
        assert times[0] == segment.start and times[-1] == segment.end
        steps = np.diff(times)
        assert steps.max() <= 10.0 + 1e-9 and np.ptp(steps) < 1e-9
    assert np.all(np.diff(grid.time) >= 0.0)
    assert np.count_nonzero(np.diff(grid.time) == 0.0) == len(profile.segments) - 1


def test_grid_of_a_minute_has_the_size_of_the_study(profile):
    grid = profile.grid(60.0)
    assert 150 <= grid.time.size <= 250
    assert np.diff(grid.time).max() <= 60.0
    np.testing.assert_array_equal(np.unique(grid.segment), np.arange(len(profile.segments)))


def test_conditions_at_both_sides_of_an_edge(profile):
    climb = next(i for i, s in enumerate(profile.segments) if s.kind == "climb")
    edge = profile.edges[climb + 1]
    found = profile.conditions([[climb - 1, climb], [climb, climb + 1]], [[profile.edges[climb]] * 2, [edge] * 2])
    np.testing.assert_array_equal(found.speed, [[0.0, 40.0], [40.0, 48.0]])
    np.testing.assert_array_equal(found.altitude, [[6.0, 6.0], [300.0, 300.0]])
    np.testing.assert_allclose(found.climb_angle, [[0.0, radians(7.12)], [radians(7.12), 0.0]])
    assert not found.idle.any()
    middle = profile.conditions(climb, 0.5 * (profile.edges[climb] + edge))
    assert middle.altitude == pytest.approx(153.0) and middle.altitude.shape == ()


def test_idle_is_on_the_ground(profile):
    grid = profile.grid(60.0)
    assert np.all(grid.speed[grid.idle] == 0.0)
    assert sum(s.duration for s in profile.segments if s.kind == "idle") == pytest.approx(360.0)
    assert set(grid.altitude[grid.idle]) == {4.0, 20.0}


@pytest.mark.parametrize(
    ("segment", "time", "message"),
    [
        (99, 0.0, "profile: segment = 99: allowed: 0 to 52"),
        (-1, 0.0, "profile: segment = -1: allowed: 0 to 52"),
        (0.5, 0.0, "profile: segment of type float64: allowed: integers"),
        (0, 121.0, "profile: time = 121.0: allowed in segment 0: 0 to 120 s"),
        (0, np.nan, "profile: time = nan: allowed in segment 0: 0 to 120 s"),
    ],
)
def test_times_outside_their_segment_are_refused(profile, segment, time, message):
    with pytest.raises(InputError) as error:
        profile.conditions(segment, time)
    assert str(error.value) == message


@pytest.mark.parametrize("step", [0.0, -1.0, np.nan, np.inf])
def test_grid_needs_a_step(profile, step):
    with pytest.raises(InputError, match="grid: max_step"):
        profile.grid(step)


def test_segments_have_to_be_contiguous(profile):
    first, second = profile.segments[:2]
    with pytest.raises(InputError, match=r"segments\[1\].start = 121.0: allowed: 120.0"):
        Profile((first, replace(second, start=121.0)))
    with pytest.raises(InputError, match=r"segments\[0\].duration = 0.0: allowed: above 0"):
        Profile((replace(first, duration=0.0),))
    with pytest.raises(InputError, match="at least one"):
        Profile(())


def air_taxi() -> Mission:
    """Three fields, passengers for one of the legs, places above sea level."""

    def stop(*tasks):
        return [{"kind": "hover", "duration_s": 45}, *tasks, {"kind": "hover", "duration_s": 45}]

    def leg(to, speed):
        return [
            {"kind": "climb", "altitude_m": 560},
            {"kind": "cruise", "to": to, "speed_m_s": speed},
            {"kind": "descent"},
        ]

    board = {"kind": "idle", "duration_s": 180, "mass_change_kg": 360}
    leave = {"kind": "idle", "duration_s": 180, "mass_change_kg": -360}
    return mission_from(
        {
            "name": "air taxi",
            "aircraft": "bo105",
            "start": "EGTC",
            "isa_offset_k": 10,
            "places": {
                "EGTC": {"latitude_deg": 52.0722, "longitude_deg": -0.61667, "elevation_m": 109.1},
                "MK": {"latitude_deg": 52.0406, "longitude_deg": -0.7594, "elevation_m": 110},
                "EGGW": {"latitude_deg": 51.8747, "longitude_deg": -0.36833, "elevation_m": 160.3},
            },
            "loading": {"empty_kg": 1300, "crew_kg": 170},
            "tasks": [
                {"kind": "idle", "duration_s": 120},
                {"kind": "hover", "duration_s": 60},
                *leg("MK", 50),
                *stop(board),
                *leg("EGGW", 63),
                *stop(leave),
                *leg("EGTC", 63),
                {"kind": "hover", "duration_s": 60},
                {"kind": "idle", "duration_s": 60},
            ],
        },
        where="air taxi",
    )


def test_a_mission_between_fields_of_different_elevation():
    profile = Profile.of(air_taxi())
    assert profile.isa_offset == 10.0
    by_task = {segment.task: segment for segment in profile.segments}
    assert by_task["descent to EGGW"].altitude_end == pytest.approx(162.3)
    assert by_task["climb to EGTC"].altitude_start == pytest.approx(162.3)
    np.testing.assert_array_equal(profile.mass_changes[profile.mass_changes != 0.0], [360.0, -360.0])


def test_a_leg_without_room_for_level_flight_has_no_cruise_segment():
    """A cruise is left out where climb and descent fill the leg exactly, and refused where they overfill it."""
    data = air_taxi().model_dump()
    climb = next(task for task in data["tasks"] if task["kind"] == "climb")
    room = distance((52.0722, -0.61667), (52.0406, -0.7594))
    per_metre = 1.0 / np.tan(radians(7.12))
    highest = 0.5 * (room / per_metre + 111.1 + 112.0)
    climb["altitude_m"] = highest
    tasks = [segment.task for segment in Profile.of(mission_from(data, where="x")).segments]
    assert "cruise to MK" not in tasks and "descent to MK" in tasks
    climb["altitude_m"] = highest + 1.0
    with pytest.raises(InputError) as error:
        Profile.of(mission_from(data, where="x"))
    assert str(error.value).startswith("air taxi: tasks[3].to = 'MK': allowed: a place at least ")


def test_steps_in_altitude_on_the_way():
    """Two cruises with a climb between, then a descent before a cruise: each on the geodesic to its own goal."""
    data = air_taxi().model_dump()
    data["tasks"] = [
        {"kind": "hover", "duration_s": 60},
        {"kind": "climb", "altitude_m": 300},
        {"kind": "climb", "altitude_m": 400, "climb_angle_deg": 4.0, "speed_m_s": 50},
        {"kind": "cruise", "to": "MK", "speed_m_s": 50},
        {"kind": "climb", "altitude_m": 700},
        {"kind": "cruise", "to": "EGGW", "speed_m_s": 60},
        {"kind": "descent", "altitude_m": 500},
        {"kind": "descent", "altitude_m": 300},
        {"kind": "cruise", "to": "EGTC", "speed_m_s": 60},
        {"kind": "descent"},
        {"kind": "hover", "duration_s": 60},
    ]
    segments = Profile.of(mission_from(data, where="x")).segments
    assert [s.kind for s in segments] == [task["kind"] for task in data["tasks"]]
    assert [s.task.split()[-1] for s in segments[4:8]] == ["EGGW"] * 4
    assert sum(s.path.length for s in segments[4:8]) == pytest.approx(
        distance((52.0406, -0.7594), (51.8747, -0.36833)), abs=1e-3
    )
    assert [s.altitude_end for s in segments] == pytest.approx(
        [111.1, 300, 400, 400, 700, 700, 500, 300, 300, 111.1, 111.1]
    )
