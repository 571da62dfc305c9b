"""Flown tracks as missions: what comes back of a flight that was recorded, well or badly."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from tests.mission.noisy_track import (
    GROUND,
    QUIET,
    TYPICAL,
    Fixes,
    Pilot,
    at,
    record,
    rms,
    surveillance,
    track_of,
    write_csv,
    write_gpx,
)
from vrsopt.errors import InputError
from vrsopt.mission.profile import Profile
from vrsopt.mission.track import TrackProfile, read_track, track_mission, track_profile
from vrsopt.mission.wind import Wind


@pytest.fixture(scope="module")
def flight() -> Profile:
    return surveillance(circuits=4)


@pytest.fixture(scope="module")
def clean(flight) -> TrackProfile:
    return track_profile(track_of(record(flight, QUIET)))


@pytest.fixture(scope="module", params=[1.0, 5.0], ids=["each second", "every five seconds"])
def noisy(request, flight, tmp_path_factory) -> TrackProfile:
    path = tmp_path_factory.mktemp("track") / "noisy.gpx"
    return track_profile(read_track(write_gpx(path, record(flight, replace(TYPICAL, interval=request.param)))))


def airborne(flight: Profile) -> np.ndarray:
    return np.arange(200.0, flight.duration - 150.0, 1.0)


def bank(conditions) -> np.ndarray:
    return np.degrees(conditions.turn * np.arccos(1.0 / conditions.turn_load_factor))


def test_a_clean_record_returns_the_flight(flight, clean):
    time = airborne(flight)
    (truth, there), (found, here) = at(flight, time), at(clean.profile, time)
    metres = (here - there) * 111_200.0 * np.array([[1.0], [np.cos(np.radians(45.1))]])
    assert rms(metres) < 0.3
    assert rms(found.speed - truth.speed) < 0.1
    assert rms(found.altitude - truth.altitude) < 0.3
    assert rms(np.degrees(found.equivalent_climb_angle - truth.equivalent_climb_angle)) < 0.3
    steady = (
        np.convolve(np.abs(np.gradient(bank(truth), time)) > 1e-3, np.ones(13), mode="same") == 0
    )  # no roll-in near
    assert steady.mean() > 0.4
    assert np.abs(bank(found) - bank(truth))[steady].max() < 1.0


def test_noise_makes_no_power(flight, noisy):
    time = airborne(flight)
    (truth, _), (found, _) = at(flight, time), at(noisy.profile, time)
    assert abs(np.mean(found.speed - truth.speed)) < 0.1
    assert abs(np.degrees(np.mean(found.equivalent_climb_angle - truth.equivalent_climb_angle))) < 0.05
    assert abs(np.mean(found.load_factor - truth.load_factor)) < 0.003
    assert rms(found.speed - truth.speed) < 0.8
    assert rms(np.degrees(found.equivalent_climb_angle - truth.equivalent_climb_angle)) < 2.0
    assert rms(bank(found) - bank(truth)) < 3.5


def test_speeds_and_accelerations_belong_to_the_positions(noisy):
    profile = noisy.profile
    for index in [k for k, segment in enumerate(profile.segments) if segment.kind == "loiter"][3:6]:
        segment, step = profile.segments[index], 1e-3
        time = np.array([0.4, 0.5, 0.6]) * segment.duration
        motion = segment.motion.kinematics(time)
        before, after = segment.motion.kinematics(time - step), segment.motion.kinematics(time + step)
        np.testing.assert_allclose(
            (after.ground_speed - before.ground_speed) / (2 * step), motion.acceleration, atol=1e-5
        )
        np.testing.assert_allclose((after.altitude - before.altitude) / (2 * step), motion.climb_rate, atol=1e-5)
        turn = np.radians(segment.motion.track(time + step)[2] - segment.motion.track(time - step)[2]) / (2 * step)
        np.testing.assert_allclose(turn * motion.ground_speed, motion.lateral_acceleration, atol=1e-2)
        north = (segment.motion.track(time + step)[0] - segment.motion.track(time - step)[0]) * 111_140.0 / (2 * step)
        course = np.radians(segment.motion.track(time)[2])
        np.testing.assert_allclose(north, motion.ground_speed * np.cos(course), atol=0.05)


def test_speed_and_load_factor_are_continuous_and_altitude_but_at_lift_off(noisy):
    profile = noisy.profile
    index, edges = np.arange(len(profile.segments) - 1), profile.edges[1:-1]
    before, after = profile.conditions(index, edges), profile.conditions(index + 1, edges)
    np.testing.assert_allclose(before.speed, after.speed, atol=1e-6)
    np.testing.assert_allclose(before.load_factor, after.load_factor, atol=1e-6)
    lifts = before.idle | after.idle
    np.testing.assert_allclose(np.abs(before.altitude - after.altitude), np.where(lifts, 2.0, 0.0), atol=1e-6)
    places = np.array(profile.positions(index, edges)) - np.array(profile.positions(index + 1, edges))
    assert np.abs(places).max() < 1e-7


def shares(profile: Profile) -> Counter:
    found = Counter()
    for segment in profile.segments:
        found[segment.kind] += segment.duration
    return found


def test_stops_climbs_and_loiter_are_recognised(flight, clean, noisy):
    for found in (clean.profile, noisy.profile):
        kinds = [segment.kind for segment in found.segments]
        assert kinds[:3] == ["idle", "hover", "climb"] and kinds[-3:] == ["descent", "hover", "idle"]
        time = shares(found)
        assert time["idle"] == pytest.approx(182.0, abs=16.0)
        assert time["hover"] == pytest.approx(121.0, abs=16.0)  # with the slowest seconds of the flight beside
        assert time["loiter"] > 0.9 * shares(flight)["loiter"]
        assert time["climb"] == pytest.approx(85.0, abs=25.0)
        assert set(time) == {"idle", "hover", "climb", "cruise", "loiter", "descent"}
        turns = [segment for segment in found.segments if segment.kind == "loiter"]
        assert len(turns) == pytest.approx(33, abs=4)  # straights and turns
        assert {segment.task for segment in found.segments} >= {"idle 1", "hover 2", "climb", "loiter", "descent"}


def test_standing_is_standing_and_low_over_known_ground(noisy):
    grid = noisy.profile.grid(1.0)
    kinds = np.array([segment.kind for segment in noisy.profile.segments])[grid.segment]
    still = np.isin(kinds, ["idle", "hover"])
    assert np.all(grid.speed[still] == 0.0) and np.all(grid.load_factor[still] == 1.0)
    np.testing.assert_allclose(grid.height[kinds == "hover"], 2.0)
    low = np.isfinite(grid.height) & ~np.isin(kinds, ["idle", "hover"])
    assert set(kinds[low]) == {"climb", "descent"} and grid.height[low].min() > 0.5 and grid.height[low].max() < 30.0
    assert abs(noisy.places["start"].elevation_m - GROUND) < 12.0


def test_a_clean_step_in_altitude_shows_the_lift_off(clean):
    assert "its altitude steps at lift-off" in "\n".join(clean.notes)
    assert clean.profile.segments[0].duration == pytest.approx(121.0, abs=2.0)


@pytest.mark.slow
def test_the_file_s_own_word_on_the_ground_counts(flight):
    fixes = record(flight, TYPICAL)
    on_ground = (fixes.time < 100.0) | (fixes.time > flight.duration - 40.0)
    found = track_profile(track_of(fixes, on_ground=on_ground))
    assert found.profile.segments[0].duration == pytest.approx(99.0, abs=1.0)
    assert found.profile.segments[-1].duration == pytest.approx(39.0, abs=2.0)
    assert "the file says so" in "\n".join(found.notes)


def test_a_track_that_begins_and_ends_in_the_air(flight):
    fixes = record(flight, QUIET)
    cut = slice(300, 1000)
    part = Fixes(fixes.time[cut], fixes.latitude[cut], fixes.longitude[cut], fixes.altitude[cut])
    found = track_profile(track_of(replace(part, time=part.time - part.time[0])))
    assert {"the track begins in the air", "the track ends in the air"} <= set(found.notes)
    assert {segment.kind for segment in found.profile.segments} <= {"cruise", "loiter"}
    assert set(found.places) == {"start", "end"}


def rescue() -> Profile:
    """A hover over a place away from the base and a vertical climb there."""
    pilot = Pilot().fly("idle", 90.0).fly("climb", 80.0, speed=40.0, climb_rate=2.0, over=60.0)
    pilot.fly("cruise", 60.0, climb_rate=0.0, over=10.0).fly("descent", 30.0, speed=20.0, climb_rate=-1.0, over=20.0)
    pilot.fly("hover", 30.0, speed=0.0, climb_rate=0.0, over=30.0).fly("hover", 120.0)
    pilot.fly("vertical_climb", 40.0, climb_rate=2.5, over=5.0).fly("hover", 60.0, climb_rate=0.0, over=5.0)
    pilot.fly("climb", 60.0, speed=40.0, climb_rate=3.0, over=50.0).fly("cruise", 100.0, climb_rate=0.0, over=10.0)
    return pilot.profile()


def test_a_hover_in_the_air_and_a_vertical_climb():
    found = track_profile(track_of(record(rescue(), QUIET))).profile
    kinds = [segment.kind for segment in found.segments]
    over = [kind for kind in kinds[kinds.index("cruise") :] if kind in ("idle", "hover", "vertical_climb")]
    assert over == ["hover", "vertical_climb", "hover"]
    hovers = [segment for segment in found.segments if segment.kind == "hover"][-2:]
    assert all(segment.ground_elevation is None for segment in hovers)
    assert hovers[0].duration == pytest.approx(125.0, abs=15.0)
    rise = found.segments[kinds.index("vertical_climb")]
    motion = rise.motion.kinematics(np.linspace(0.0, rise.duration, 20))
    assert np.all(motion.ground_speed < 0.02) and np.ptp(motion.altitude) > 75.0


@pytest.mark.slow
def test_the_date_line_does_not_matter(flight):
    fixes = record(flight, QUIET)
    here = track_profile(track_of(fixes)).profile.grid(5.0)
    moved = (fixes.longitude - np.mean(fixes.longitude)) % 360.0 - 180.0
    there = track_profile(track_of(replace(fixes, longitude=moved))).profile
    assert np.ptp(moved) > 359.0
    np.testing.assert_allclose(there.grid(5.0).speed, here.speed, atol=1e-3)


@pytest.mark.slow
def test_wind_changes_the_airspeed_and_stays_off_the_ground(flight):
    east = Wind((0.0,), (5.0,), (0.0,))
    windy = track_profile(track_of(record(flight, QUIET)), wind=east)
    found, grid = windy.profile, windy.profile.grid(1.0)
    assert not any(note.startswith("without wind") for note in windy.notes)
    assert grid.speed.max() == pytest.approx(45.0, abs=0.6)
    kinds = np.array([segment.kind for segment in found.segments])[grid.segment]
    np.testing.assert_allclose(grid.speed[kinds == "hover"], 5.0)
    assert np.all(grid.speed[kinds == "idle"] == 0.0)


def test_a_track_as_a_mission(flight, tmp_path):
    path = write_csv(tmp_path / "patrol.csv", record(flight, QUIET))
    mission = track_mission(path, 2000.0, isa_offset=10.0)
    assert "without wind, speeds over the ground are taken as airspeeds" in mission.notes
    assert (mission.name, mission.aircraft, mission.takeoff_mass, mission.isa_offset_k) == (
        "patrol",
        "bo105",
        2000.0,
        10.0,
    )
    assert mission.profile.isa_offset == 10.0 and len(mission.source_hash) == 64
    assert set(mission.places) == {"start", "end"} and mission.places["start"].elevation_m == pytest.approx(GROUND)
    assert mission.limits.rotor_speed_percent == (75.0, 115.0)
    for mass, words in (
        (900.0, rf"^{path}: take-off mass = 900: allowed: a number from 1400 to 2500"),
        (float("nan"), rf"^{path}: take-off mass = nan: allowed"),
        (2490.0, rf"{path}: .* mass times load factor up to 2\d\d\d kg, allowed 1400 to 2500.*with less mass"),
    ):
        with pytest.raises(InputError, match=words):
            track_mission(path, mass)
    with pytest.raises(InputError, match="no such file"):
        track_mission(tmp_path / "none.gpx", 2000.0)
