"""The three missions of the study: what they last, where they lead, how they turn, and that their books close."""

import re
from pathlib import Path

import numpy as np
import pytest

from tests.mission.flight_checks import book, distance, gaps, stated_by_kind, time_by_kind
from vrsopt.mission.file import read_mission
from vrsopt.mission.profile import Profile
from vrsopt.mission.route import Arc, Spiral

PROBLEMS = Path(__file__).parents[2] / "problems"
NAMES = ("patm", "lem", "sarm")
MISSIONS = {name: read_mission(PROBLEMS / f"{name}.toml") for name in NAMES}
PROFILES = {name: Profile.of(mission) for name, mission in MISSIONS.items()}
GRIDS = {name: profile.grid(0.5) for name, profile in PROFILES.items()}
# keys whose numbers are the study's or follow from nothing else; positions of fields are public, any other is marked
SOURCED = {
    "latitude_deg",
    "longitude_deg",
    "elevation_m",
    "climb_angle_deg = 7.12",
    "climb_angle_deg = -7.12",
    "rotor_speed_percent",
    "twist_deg",
}
BY_STUDY = {"patm": set(), "lem": set(), "sarm": {"speed_m_s = 35.0", "altitude_m = 50.0"}}
EACH = pytest.mark.parametrize("name", NAMES)


def banks(name: str, kind: str) -> np.ndarray:
    """Bank [deg] at the nodes of one kind."""
    kinds = np.array([segment.kind for segment in PROFILES[name].segments])[GRIDS[name].segment]
    return np.degrees(np.arccos(1.0 / GRIDS[name].turn_load_factor[kinds == kind]))


def turns(name: str) -> int:
    """How often the bank rises over 10 degrees."""
    banked = np.arccos(1.0 / GRIDS[name].turn_load_factor) > np.radians(10.0)
    return np.count_nonzero(banked[1:] & ~banked[:-1])


@EACH
def test_edges_have_no_gaps(name):
    found = gaps(PROFILES[name])
    assert found.pop("position") < 1e-7  # m, rounding of latitude and longitude
    assert found.pop("course") < 1e-6  # deg
    for what, gap in found.items():
        assert gap < 1e-9, what


@EACH
def test_books_of_distance_and_height_close(name):
    for segment in PROFILES[name].segments:
        entry = book(segment)
        assert entry.flown == pytest.approx(entry.covered, abs=1e-9)
        assert entry.climbed == pytest.approx(entry.risen, abs=1e-9)
        assert entry.covered <= segment.motion.path.length + 1e-6 or segment.motion.path.length == 0.0
    assert sum(book(segment).risen for segment in PROFILES[name].segments) == pytest.approx(0.0, abs=1e-9)


@EACH
def test_times_stated_are_flown(name):
    profile, stated = PROFILES[name], stated_by_kind(MISSIONS[name])
    times = time_by_kind(profile)
    for kind in ("idle", "hover", "loiter", "search"):
        assert times[kind] == pytest.approx(stated[kind], abs=1e-9)
    assert sum(times.values()) == pytest.approx(profile.duration, abs=1e-9)
    np.testing.assert_allclose(np.diff(profile.edges), [s.duration for s in profile.segments], atol=1e-9)
    assert profile.edges[0] == 0.0 and profile.edges[-1] == profile.duration


@EACH
def test_ends_where_it_began(name):
    profile = PROFILES[name]
    first, last = profile.segments[0], profile.segments[-1]
    ends = profile.positions([0, len(profile.segments) - 1], [0.0, profile.duration])
    assert distance(*zip(*ends, strict=True)) < 1e-6
    assert first.motion.altitude(0.0) == last.motion.altitude(last.duration) == first.ground_elevation
    assert first.kind == last.kind == "idle"
    assert profile.mass_changes.sum() == 0.0


@EACH
def test_conditions_are_those_of_a_helicopter_in_flight(name):
    grid = GRIDS[name]
    elevation = min(place.elevation_m for place in MISSIONS[name].places.values())
    assert np.all((grid.altitude >= elevation - 1e-9) & (grid.altitude <= 700.0))
    assert np.all(grid.speed <= 63.0 + 1e-9)
    assert grid.load_factor.min() > 0.94 and grid.load_factor.max() < 1.19
    assert np.all(grid.turn_load_factor >= 1.0)
    assert np.abs(np.degrees(grid.climb_angle[grid.speed > 5.0])).max() <= 7.12 + 1e-6
    assert np.abs(np.degrees(grid.equivalent_climb_angle[grid.speed > 5.0])).max() < 13.0
    assert np.all(grid.height > -1e-9)
    assert np.all(grid.speed[grid.idle] == 0.0) and not grid.ground_idle.any()


@EACH
def test_load_factor_and_equivalent_climb_angle_have_no_jumps_in_flight(name):
    """In still air; at rest there is no direction of flight."""
    profile = PROFILES[name]
    inner = np.arange(len(profile.segments) - 1)
    before, after = (profile.conditions(inner + step, profile.edges[1:-1]) for step in (0, 1))
    moving = before.speed > 1e-3
    for what, gap in (("load_factor", 1e-12), ("turn_load_factor", 1e-12), ("equivalent_climb_angle", 1e-12)):
        jumps = np.abs(getattr(after, what) - getattr(before, what))
        assert jumps[moving].max() < gap, what
    np.testing.assert_allclose(after.speed, before.speed, atol=1e-12)


LEGS = {
    "patm": {"milton_keynes": "EGTC", "EGGW": "milton_keynes", "EGTC": "EGGW"},
    "lem": {"area_A": "LIMA"},
    "sarm": {"brookside": "incident", "KSFO": "brookside"},
}


@pytest.mark.parametrize(("name", "to"), [(name, to) for name, legs in LEGS.items() for to in legs])
def test_legs_from_a_hover_are_geodesics(name, to):
    covered = sum(book(s).covered for s in PROFILES[name].segments if s.task.endswith(f" to {to}"))
    ends = [MISSIONS[name].places[place].point for place in (LEGS[name][to], to)]
    assert covered == pytest.approx(distance(*ends), abs=1e-6)


@EACH
def test_every_cruise_ends_at_its_place(name):
    profile, mission = PROFILES[name], MISSIONS[name]
    for index, segment in enumerate(profile.segments[:-1]):
        goal = segment.task.partition(" to ")[2]
        if goal and profile.segments[index + 1].task.partition(" to ")[2] != goal:
            end = profile.positions(index, segment.end)
            assert distance(end, mission.places[goal].point) < 1e-3, segment.task


def test_patm():
    profile = PROFILES["patm"]
    assert profile.duration == pytest.approx(2357.0, abs=1.0)
    assert time_by_kind(profile)["idle"] == pytest.approx(540.0, abs=1e-9)
    boarding = {segment.task: segment.mass_change for segment in profile.segments if segment.mass_change}
    assert boarding == {"idle at milton_keynes": 360.0, "idle at EGGW": -360.0}
    assert turns("patm") == 0
    assert max(banks("patm", "cruise")) == 0.0
    cruises = {float(s.motion.kinematics(np.zeros(1)).ground_speed[0]) for s in profile.segments if s.kind == "cruise"}
    assert {round(speed, 9) for speed in cruises} == {50.0, 63.0}
    hovering = [s for s in profile.segments if s.kind == "hover"]
    places = MISSIONS["patm"].places
    np.testing.assert_allclose(
        sorted({float(s.motion.altitude(0.0)) for s in hovering if s.duration > 5.0}),
        [places["EGTC"].elevation_m + 2.0, places["milton_keynes"].elevation_m + 2.0, places["EGGW"].elevation_m + 2.0],
        rtol=1e-12,
    )


def test_lem_loiters_for_most_of_its_time_and_turns_all_the_while():
    """46 half circles on two race-tracks, each of 25 minutes; bank 25 degrees."""
    profile, grid = PROFILES["lem"], GRIDS["lem"]
    kinds = np.array([segment.kind for segment in profile.segments])[grid.segment]
    times = time_by_kind(profile)
    assert times["loiter"] / profile.duration > 0.75
    assert times["loiter"] / (profile.duration - times["idle"] - times["hover"]) > 0.83
    arcs = [s for s in profile.segments if s.kind == "loiter" and isinstance(s.motion.path, Arc)]
    assert 40 <= len(arcs) <= 48 and 42 <= turns("lem") <= 50
    assert banks("lem", "loiter").max() == pytest.approx(25.0, abs=0.2)
    assert grid.turn_load_factor.max() == pytest.approx(1.104, abs=0.002)
    radii = np.array([segment.motion.path.radius for segment in arcs])
    assert np.count_nonzero(np.abs(radii - 350.0) < 1.5) >= 42  # the others lead to the race-tracks
    assert radii.min() > 348.0
    loiter = kinds == "loiter"
    np.testing.assert_allclose(grid.speed[loiter], 40.0, rtol=1e-9)
    np.testing.assert_allclose(grid.altitude[loiter], 600.0, rtol=1e-12)
    right = grid.turn[loiter][np.degrees(np.arccos(1.0 / grid.turn_load_factor[loiter])) > 20.0]
    assert np.mean(right == 1.0) > 0.9
    rolls = [s.duration for s in profile.segments if s.kind == "loiter" and isinstance(s.motion.path, Spiral)]
    np.testing.assert_allclose(rolls[4:20], 3.0, rtol=1e-9)


def test_lem_turns_at_the_rate_of_its_bank():
    """The hub of the rotor turns with g tan(bank) / speed, a half circle and its roll take 180 degrees."""
    profile = PROFILES["lem"]
    index, segment = next(
        (i, s)
        for i, s in enumerate(profile.segments)
        if isinstance(s.motion.path, Arc) and s.motion.path.sweep_deg > 150
    )
    found = profile.conditions(index, segment.start + 0.5 * segment.duration)
    rate = found.turn * np.tan(np.arccos(1.0 / found.turn_load_factor)) * 9.80665 / found.speed
    assert np.degrees(rate) * segment.duration == pytest.approx(segment.motion.path.sweep_deg, rel=1e-6)
    around = [
        profile.segments[i].motion.track(np.array([0.0, profile.segments[i].duration]))[2]
        for i in range(index - 1, index + 2)
    ]
    turned = sum((course[1] - course[0]) % 360.0 for course in around)
    assert turned == pytest.approx(180.0, abs=0.01)


def test_sarm():
    profile, grid = PROFILES["sarm"], GRIDS["sarm"]
    times = time_by_kind(profile)
    assert 75.0 * 60.0 < profile.duration < 95.0 * 60.0
    assert 0.40 < times["search"] / profile.duration < 0.55
    assert banks("sarm", "search").max() == pytest.approx(32.0, abs=0.5)
    kinds = np.array([segment.kind for segment in profile.segments])[grid.segment]
    assert grid.turn_load_factor[kinds == "search"].max() == pytest.approx(1.18, abs=0.005)
    steady = (kinds == "search") & (grid.time > grid.time[kinds == "search"][0] + 60.0)
    np.testing.assert_allclose(grid.speed[steady], 35.0, rtol=1e-9)
    np.testing.assert_allclose(grid.altitude[steady], 50.0, rtol=1e-9)
    index = int(np.flatnonzero(profile.mass_changes > 0.0)[0])
    segment = profile.segments[index]
    assert (segment.kind, segment.mass_change, segment.ground_elevation) == ("hover", 240.0, 0.0)
    np.testing.assert_allclose(segment.motion.altitude(np.array([0.0, 90.0])), 30.0, rtol=1e-12)
    assert distance(profile.positions(index, segment.start), MISSIONS["sarm"].places["incident"].point) < 1e-3


@EACH
def test_grid_of_a_minute_has_a_size_to_optimise_over(name):
    grid = PROFILES[name].grid(60.0)
    assert 90 <= grid.time.size <= 420
    np.testing.assert_array_equal(np.unique(grid.segment), np.arange(len(PROFILES[name].segments)))


@EACH
def test_numbers_that_are_not_of_the_study_are_marked(name):
    """Every number of the file, but what is public or the study's, says that it is assumed, or its table does."""
    text = (PROBLEMS / f"{name}.toml").read_text()
    marked, table_marked = 0, False
    for line in text.splitlines():
        if line.startswith("["):
            table_marked = "(assumed)" in line
        stated = re.match(r"(\w+) = (\[?-?\d[^#]*)", line)
        if stated is None:
            continue
        key, pair = stated[1], f"{stated[1]} = {stated[2].strip()}"
        climbing = pair == "speed_m_s = 40.0"  # of climb, descent and surveillance
        if key in SOURCED or pair in SOURCED or pair in BY_STUDY[name] or climbing:
            continue
        assert "(assumed)" in line or table_marked, line
        marked += 1
    assert marked > 20
    assert "What is marked (assumed) is not in" in text
