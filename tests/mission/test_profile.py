"""A profile as such: segments in time, conditions and positions at any of them, grids."""

from dataclasses import replace
from math import radians
from pathlib import Path

import numpy as np
import pytest

from tests.mission.flight_checks import distance
from tests.mission.small_missions import HOVER, IDLE, climb, cruise, descent, flown
from vrsopt.errors import InputError
from vrsopt.mission.file import read_mission
from vrsopt.mission.profile import Profile

PATM = Path(__file__).parents[2] / "problems" / "patm.toml"


@pytest.fixture(scope="module")
def profile() -> Profile:
    return Profile.of(read_mission(PATM))


def test_grid_has_both_ends_of_every_segment_and_uniform_steps(profile):
    grid = profile.grid(10.0)
    for index, segment in enumerate(profile.segments):
        times = grid.time[grid.segment == index]
        assert times[0] == segment.start and times[-1] == segment.end
        steps = np.diff(times)
        assert steps.max() <= 10.0 + 1e-9 and np.ptp(steps) < 1e-9
    assert np.all(np.diff(grid.time) >= 0.0)
    assert np.count_nonzero(np.diff(grid.time) == 0.0) == len(profile.segments) - 1


def test_grid_needs_no_more_steps_than_fit(profile):
    grid = profile.grid(60.0)
    counts = np.bincount(grid.segment)
    for segment, count in zip(profile.segments, counts, strict=True):
        assert count == max(2, int(np.ceil(segment.duration / 60.0 - 1e-9)) + 1)


def test_grid_is_made_of_conditions(profile):
    grid = profile.grid(30.0)
    for name, values in vars(profile.conditions(grid.segment, grid.time)).items():
        np.testing.assert_array_equal(values, getattr(grid, name))


def test_conditions_at_both_sides_of_an_edge(profile):
    first, steady, level = (i for i, s in enumerate(profile.segments[:8]) if s.kind == "climb")
    edges = profile.edges
    found = profile.conditions(
        [[steady - 1, steady], [level, level + 1]], [[edges[steady]] * 2, [edges[level + 1]] * 2]
    )
    np.testing.assert_allclose(found.speed, [[40.0, 40.0], [50.0, 50.0]], rtol=1e-12)
    np.testing.assert_allclose(found.climb_angle, [[radians(7.12)] * 2, [0.0] * 2], atol=1e-12)
    np.testing.assert_allclose(found.altitude[1], 559.1, rtol=1e-12)
    assert found.speed.shape == (2, 2) and first == steady - 1
    assert not found.idle.any()


def test_times_a_hair_outside_are_taken_to_the_end(profile):
    for index, time in ((0, -5e-7), (0, 120.0 + 5e-7)):
        assert profile.conditions(index, time).altitude == 109.1


def test_scalars_give_scalars(profile):
    middle = profile.conditions(5, 250.0)
    assert middle.altitude.shape == () and middle.idle.dtype == bool
    latitude, longitude = profile.positions(5, 250.0)
    assert latitude.shape == longitude.shape == ()


def test_idle_is_on_the_ground_and_at_rest(profile):
    grid = profile.grid(60.0)
    assert np.all(grid.speed[grid.idle] == 0.0) and np.all(grid.height[grid.idle] == 0.0)
    assert set(grid.altitude[grid.idle]) == {109.1, 110.0, 160.3}
    assert not grid.ground_idle.any()
    assert np.all(grid.load_factor[grid.idle] == 1.0)


def test_ground_idle_is_idle_too():
    ground = {"kind": "ground_idle", "duration_s": 30.0}
    profile = flown(ground, IDLE, HOVER, ground)
    grid = profile.grid(10.0)
    kinds = np.array([segment.kind for segment in profile.segments])[grid.segment]
    np.testing.assert_array_equal(grid.ground_idle, kinds == "ground_idle")
    np.testing.assert_array_equal(grid.idle, np.isin(kinds, ["idle", "ground_idle"]))
    assert [segment.kind for segment in profile.segments][:2] == ["ground_idle", "idle"]


def test_offset_of_the_day_is_kept():
    assert flown(HOVER, climb(600.0), cruise("north"), descent(), HOVER, isa_offset_k=15.0).isa_offset == 15.0


def test_positions_are_exact_between_nodes(profile):
    """Over a long leg the geodesic is not the straight line between its ends."""
    index = max(
        range(len(profile.segments)),
        key=lambda i: profile.segments[i].duration * (profile.segments[i].kind == "cruise"),
    )
    segment = profile.segments[index]
    times = segment.start + segment.duration * np.array([0.0, 0.25, 1.0])
    start, quarter, end = zip(*profile.positions([index] * 3, times), strict=True)
    whole = distance(start, end)
    assert whole > 20_000.0
    assert distance(start, quarter) == pytest.approx(0.25 * whole, abs=1e-6)
    assert distance(quarter, end) == pytest.approx(0.75 * whole, abs=1e-6)


@pytest.mark.parametrize(
    ("segment", "time", "message"),
    [
        (99, 0.0, "profile: segment = 99: allowed: 0 to 42"),
        (-1, 0.0, "profile: segment = -1: allowed: 0 to 42"),
        (0.5, 0.0, "profile: segment of type float64: allowed: integers"),
        (0, 121.0, "profile: time = 121.0: allowed in segment 0: 0 to 120 s"),
        (0, np.nan, "profile: time = nan: allowed in segment 0: 0 to 120 s"),
        ([0, 1], [0.0, 119.0], "profile: time = 119.0: allowed in segment 1: 120 to 122.449 s"),
    ],
)
def test_times_outside_their_segment_are_refused(profile, segment, time, message):
    for ask in (profile.conditions, profile.positions):
        with pytest.raises(InputError) as error:
            ask(segment, time)
        assert str(error.value) == message


@pytest.mark.parametrize("step", [0.0, -1.0, np.nan, np.inf])
def test_grid_needs_a_step(profile, step):
    with pytest.raises(InputError, match="grid: max_step"):
        profile.grid(step)


def test_segments_have_to_be_contiguous(profile):
    first, second = profile.segments[:2]
    with pytest.raises(InputError, match=r"segments\[1\].start = 121.0: allowed: 120.0"):
        Profile((first, replace(second, start=121.0)))
    with pytest.raises(InputError, match=r"segments\[0\].start = 1.0: allowed: 0.0"):
        Profile((replace(first, start=1.0),))
    for duration in (0.0, -3.0, np.nan):
        with pytest.raises(InputError, match=rf"segments\[0\].duration = {duration}: allowed: above 0"):
            Profile((replace(first, duration=duration),))
    with pytest.raises(InputError, match="at least one"):
        Profile(())
