"""Flown tracks with defects, and tracks that can not be flown: each is put right or refused, and said."""

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
    pilot_height,
    record,
    rms,
    surveillance,
    track_of,
    write_gpx,
)
from vrsopt.errors import InputError
from vrsopt.mission.profile import Profile
from vrsopt.mission.track import Track, TrackProfile, read_track, track_profile
from vrsopt.mission.track_limits import FlightBox, unflyable


@pytest.fixture(scope="module")
def flight() -> Profile:
    return surveillance(circuits=4)


@pytest.fixture(scope="module", params=[1.0, 5.0], ids=["each second", "every five seconds"])
def noisy(request, flight, tmp_path_factory) -> TrackProfile:
    path = tmp_path_factory.mktemp("track") / "noisy.gpx"
    return track_profile(read_track(write_gpx(path, record(flight, replace(TYPICAL, interval=request.param)))))


def test_what_is_wrong_with_a_record_is_said(noisy):
    text = "\n".join(noisy.notes)
    for words in (
        "5 times go back: fixes sorted by time",
        "12 fixes of the same time as another: averaged with it",
        "8 positions left out, the first at",
        "they need more than 120 m/s over the ground",
        "they need more than 15 m/s up or down",
        "gaps of up to a minute, the longest 30 s at 1500 s: bridged by the filter",
        "altitudes of the file are taken as pressure altitudes",
        "s in position and 25 s in altitude",
        "60 s of hover assumed beside the flight",
    ):
        assert words in text, words


@pytest.mark.slow
def test_a_long_gap_is_flown_straight_and_a_longer_one_refused(flight):
    fixes = record(flight, QUIET)
    keep = (fixes.time < 290.0) | (fixes.time > 390.0)
    gap = Fixes(*(getattr(fixes, name)[keep] for name in ("time", "latitude", "longitude", "altitude")))
    found = track_profile(track_of(gap))
    assert "gap of 102 s at 289 s: bridged straight, at a constant" in "\n".join(found.notes)
    grid = found.profile.grid(1.0)
    assert np.ptp(grid.speed[(grid.time > 305.0) & (grid.time < 375.0)]) < 0.5
    keep = (fixes.time < 300.0) | (fixes.time > 950.0)
    gap = Fixes(*(getattr(fixes, name)[keep] for name in ("time", "latitude", "longitude", "altitude")))
    with pytest.raises(InputError, match=r"track: no fix from 299 to 951 s: allowed: gaps of at most 600 s; split"):
        track_profile(track_of(gap))


@pytest.mark.slow
def test_fixes_without_altitude_and_repeated_positions(flight):
    fixes = record(flight, QUIET)
    altitude = np.where((fixes.time > 500) & (fixes.time < 520), np.nan, fixes.altitude)
    latitude, longitude = fixes.latitude.copy(), fixes.longitude.copy()
    for first in (600, 700):
        latitude[first : first + 5], longitude[first : first + 5] = latitude[first], longitude[first]
    found = track_profile(Track(fixes.time, latitude, longitude, altitude))
    text = "\n".join(found.notes)
    assert "19 fixes have no altitude" in text
    assert "8 positions repeat the one before although it moved on: left out" in text
    grid = found.profile.grid(1.0)
    assert rms(grid.speed[(grid.time > 590) & (grid.time < 720)] - 40.0) < 0.5


@pytest.mark.slow
def test_tight_turns_of_a_sparse_record_are_no_outliers():
    pilot = Pilot(600.0).fly("cruise", 30.0, speed=35.0).fly("cruise", 60.0)
    pilot.circuit(1500.0, 200.0, 4).fly("cruise", 60.0)
    for interval in (1.0, 5.0, 8.0):
        fixes = record(pilot.profile(None), replace(QUIET, interval=interval))
        assert not any("left out" in note for note in track_profile(track_of(fixes)).notes)


@pytest.mark.slow
def test_noise_about_sea_level_is_no_depth():
    flight = surveillance(circuits=1)
    fixes = record(flight, TYPICAL)
    found = track_profile(track_of(replace(fixes, altitude=fixes.altitude - GROUND)))
    assert found.profile.grid(1.0).altitude.min() >= 0.0
    assert any("those below 0 m are taken as 0 m" in note for note in found.notes)


@pytest.mark.slow
def test_speeds_and_courses_of_the_file_are_compared(flight):
    fixes = record(flight, QUIET)
    speed = at(flight, fixes.time)[0].speed
    same = track_profile(track_of(fixes, ground_speed=speed))
    assert not any("ground speeds" in note for note in same.notes)
    knots = track_profile(track_of(fixes, ground_speed=speed / 0.5144, course_deg=np.full(len(speed), 77.0)))
    assert "ground speeds of the file are 1.94 times those of its positions: not used" in knots.notes
    assert any(note.startswith("courses of the file differ") for note in knots.notes)


def test_ten_fixes_a_second_are_averaged():
    flight = surveillance(circuits=1)
    found = track_profile(track_of(record(flight, replace(QUIET, interval=0.1))))
    assert any("fixes less than 0.5 s after another: averaged with it" in note for note in found.notes)
    grid = found.profile.grid(1.0)
    assert abs(np.max(grid.speed) - 40.0) < 0.5


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"speed": 1.9}, r"beyond the model: .* s: airspeed up to 7\d.* m/s, allowed 0 to 70: give the wind"),
        (
            {"altitude": 1500.0},
            r"beyond the model: \d+ to \d+ s: altitude up to 2\d\d\d m, allowed 0 to 2000.*altitude_ft",
        ),
        ({"altitude": -400.0}, r"beyond the model: 0 to \d+ s: altitude up to -11\d m, allowed 0 to 2000"),
        ({"factor": 4.0}, r"altitude up to \d+ m.*equivalent climb angle|equivalent climb angle up to .* deg"),
    ],
)
def test_what_can_not_be_flown_is_refused_with_its_time(flight, change, words):
    fixes = record(flight, QUIET)
    stretch = change.get("speed", 1.0)
    spoiled = Fixes(
        fixes.time,
        fixes.latitude[0] + stretch * (fixes.latitude - fixes.latitude[0]),
        fixes.longitude[0] + stretch * (fixes.longitude - fixes.longitude[0]),
        GROUND + change.get("altitude", 0.0) + change.get("factor", 1.0) * (fixes.altitude - GROUND),
    )
    with pytest.raises(InputError, match=words) as caught:
        track_profile(track_of(spoiled))
    assert str(caught.value).startswith("track: ") and "\n" not in str(caught.value)


def test_noise_that_leads_out_of_the_box_is_smoothed_more(flight):
    fixes = record(flight, TYPICAL)
    landing = flight.duration - 129.0
    kick = 15.0 * np.exp(-(((fixes.time - landing + 16.0) / 8.0) ** 2))  # m, up and down again in the approach
    found = track_profile(track_of(replace(fixes, altitude=fixes.altitude + kick)))
    assert found.beyond == () and unflyable(found.profile) == []
    said = next(note for note in found.notes if "smoothed more there" in note)
    assert "stretches, the first at 174" in said and said.endswith("m in altitude")


def test_a_fast_descent_without_airspeed_is_refused():
    pilot = Pilot(800.0).fly("cruise", 30.0, speed=30.0).fly("cruise", 60.0).fly("hover", 30.0, speed=0.0, over=30.0)
    pilot.fly("descent", 60.0, climb_rate=-6.0, over=10.0).fly("hover", 60.0, climb_rate=0.0, over=10.0)
    with pytest.raises(
        InputError,
        match=r"track: beyond the model: \d+ to \d+ s: descent rate at little airspeed .* to [\d.]+: leave these",
    ):
        track_profile(track_of(record(pilot.profile(None), QUIET)))


def test_unflyable_stretches_of_a_profile(flight):
    assert unflyable(flight, mass=2000.0) == []
    heavy = unflyable(flight, mass=2400.0)
    assert heavy and {stretch.quantity for stretch in heavy} == {"mass times load factor"}
    assert str(heavy[0]).endswith("kg, allowed 1400 to 2500")
    slow = unflyable(flight, box=FlightBox(speed=(0.0, 39.0)))
    assert sum(stretch.end - stretch.start for stretch in slow) > 0.6 * flight.duration


def test_too_little_of_a_track():
    few = Track(np.arange(9.0), np.full(9, 47.0), np.full(9, 8.0), np.full(9, 500.0), name="few")
    with pytest.raises(InputError, match="few: 9 fixes of different times: allowed: at least 10"):
        track_profile(few)
    short = Track(np.arange(20.0), np.full(20, 47.0), np.full(20, 8.0), np.full(20, 500.0))
    with pytest.raises(InputError, match=r"time: 19 s in all: allowed: 60 to 43200 s|19 s from first to last"):
        track_profile(short)
    one = np.where(np.arange(200.0) == 7.0, 500.0, np.nan)
    with pytest.raises(InputError, match="track: altitude: 1 fixes have one: allowed: at least 10"):
        track_profile(Track(np.arange(200.0), np.full(200, 47.0), np.full(200, 8.0), one))
    parked = Track(np.arange(200.0), np.full(200, 47.0), np.full(200, 8.0), np.full(200, 500.0))
    with pytest.raises(InputError, match="it stands on the ground all the time"):
        track_profile(parked)
    random = np.random.default_rng(1)
    junk = Track(np.arange(100.0), random.uniform(-80, 80, 100), random.uniform(-170, 170, 100), np.full(100, 500.0))
    with pytest.raises(InputError, match=r"9\d of 100 positions, the first at .* need more than 120 m/s"):
        track_profile(junk)
    with pytest.raises(InputError, match=r"track: latitude_deg: \(3,\) values: allowed: as many as times"):
        Track(np.arange(2.0), np.zeros(3), np.zeros(2), np.zeros(2))


def on_ground(flight: Profile, time) -> np.ndarray:
    idle = [(s.start, s.start + s.duration) for s in flight.segments if s.kind == "idle"]
    return np.any([(time >= start) & (time <= end) for start, end in idle], axis=0)


@pytest.mark.parametrize("step", [0.0, 7.62], ids=["exact", "steps of 25 ft"])
def test_on_the_ground_a_receiver_gives_no_altitude(flight, step):
    fixes = record(flight, replace(QUIET, interval=3.0))
    down = on_ground(flight, fixes.time)
    altitude = np.round(fixes.altitude / step) * step if step else fixes.altitude
    track = track_of(replace(fixes, altitude=np.where(down, np.nan, altitude)), on_ground=down)
    found = track_profile(track)
    assert f"{down.sum()} fixes on the ground have no altitude, the first at 0 s" in "\n".join(found.notes)
    assert found.beyond == ()
    grid = found.profile.grid(1.0)
    assert np.any(grid.idle) and np.ptp(grid.altitude[grid.idle]) < 10.0
    assert abs(grid.altitude.min() - GROUND) < 10.0


def test_a_long_time_on_the_ground_needs_no_altitudes_and_the_nearest_place_gives_them(flight):
    fixes = record(flight, QUIET)
    down = on_ground(flight, fixes.time)
    first, last = fixes.time[~down][0], fixes.time[~down][-1]
    wait = np.arange(1.0, 900.0)
    time = np.concatenate([fixes.time[fixes.time <= last], last + wait])
    latitude, longitude, altitude = (
        np.concatenate([values[fixes.time <= last], np.full(len(wait), values[-1])])
        for values in (fixes.latitude, fixes.longitude, fixes.altitude)
    )
    stands = (time < first) | (time > last)
    silent = Track(time, latitude, longitude, np.where(stands, np.nan, altitude), on_ground=stands)
    grid = track_profile(silent).profile.grid(1.0)
    assert np.all(np.abs(grid.altitude[grid.idle] - GROUND) < 10.0)
    with pytest.raises(InputError, match="track: no altitude from .* gaps of at most 600 s"):
        track_profile(replace(silent, on_ground=None))


def test_altitudes_are_not_carried_on_beyond_the_known_ones(flight):
    fixes = record(flight, QUIET)
    unknown = (fixes.time < 500.0) | (fixes.time > fixes.time[-1] - 200.0)
    found = track_profile(track_of(replace(fixes, altitude=np.where(unknown, np.nan, fixes.altitude))))
    words = f"{unknown.sum()} fixes at the ends of the track have no altitude: the first or last known one is kept"
    assert words in found.notes
    known = fixes.altitude[~unknown]
    grid = found.profile.grid(1.0)
    assert known.min() - 3.0 < grid.altitude.min() and grid.altitude.max() < known.max() + 3.0


def test_an_outlier_at_the_end_of_a_climb_leaves_the_altitude_before_it():
    pilot = Pilot(300.0).fly("cruise", 100.0, speed=40.0).fly("climb", 100.0, climb_rate=4.0, over=10.0)
    fixes = record(pilot.profile(None), replace(QUIET, interval=5.0))
    altitude = fixes.altitude.copy()
    altitude[-1] += 60.0
    found = track_profile(track_of(replace(fixes, altitude=altitude)))
    assert any("1 altitudes left out, the first at 195 s: they need" in note for note in found.notes)
    assert abs(found.profile.grid(1.0).altitude[-1] - altitude[-2]) < 5.0


@pytest.mark.parametrize("seed", [1, 2, 5])
def test_noise_in_a_quick_landing_is_no_vortex_ring(seed):
    pilot = Pilot().fly("idle", 90.0).fly("hover", 4.0, climb_rate=1.0, over=2.0)
    pilot.fly("hover", 20.0, climb_rate=0.0, over=2.0).fly("climb", 45.0, speed=39.7, climb_rate=5.0, over=45.0)
    pilot.fly("climb", 40.0).fly("cruise", 10.0, speed=40.0, climb_rate=0.0, over=10.0).fly("cruise", 200.0)
    down = (pilot_height(pilot) - GROUND - 2.0 - 4.0 * 17.5) / 4.0
    pilot.fly("descent", 10.0, climb_rate=-4.0, over=10.0).fly("descent", down)
    pilot.fly("descent", 25.0, speed=0.0, climb_rate=0.0, over=25.0).fly("hover", 10.0)
    pilot.fly("hover", 4.0, climb_rate=(GROUND - pilot_height(pilot)) / 4.0, over=2.0)
    pilot.fly("idle", 2.0, climb_rate=0.0, over=2.0).fly("idle", 60.0)
    noise = replace(QUIET, interval=3.0, correlated=2.0, white=1.5, white_vertical=2.0)
    found = track_profile(track_of(record(pilot.profile(), noise, seed=seed)))
    assert any("smoothed more there" in note for note in found.notes)
    assert all(stretch.quantity == "equivalent climb angle" for stretch in found.beyond)
