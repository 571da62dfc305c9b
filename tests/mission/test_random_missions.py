"""Random missions: flown with every invariant kept, or refused in one line that says why."""

import re

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from tests.mission.flight_checks import book, distance, gaps, stated_by_kind, time_by_kind
from tests.mission.random_missions import missions
from vrsopt.errors import InputError
from vrsopt.mission.file import Mission, mission_from
from vrsopt.mission.profile import Profile

REFUSAL = re.compile(r"^random: (tasks\[\d+\](\.\w+)?( = .+)?: |wind = ).*(allowed|missing|needed)")
# in the units of each; in wind an edge passes on how exactly patterns and ways meet their goals, 1e-6 degrees of course
GAPS = {
    "position": 1e-4,
    "course": 1e-5,
    "ground_speed": 1e-5,
    "lateral_acceleration": 1e-5,
    "altitude": 1e-9,
    "climb_rate": 1e-9,
    "vertical_acceleration": 1e-9,
}


def flown(data: dict) -> tuple[Mission, Profile] | None:
    """The mission and its profile, or None after a look at why there is none."""
    try:
        mission = mission_from(data, where="random")
        return mission, Profile.of(mission)
    except InputError as error:
        assert REFUSAL.match(str(error)) and "\n" not in str(error), str(error)
        return None


def check(mission: Mission, profile: Profile) -> None:
    for what, gap in gaps(profile).items():
        calm = profile.wind.calm and what in ("ground_speed", "lateral_acceleration", "acceleration")
        assert gap <= (1e-9 if calm else GAPS.get(what, np.inf)), what
    for segment in profile.segments:
        entry = book(segment)
        assert segment.duration > 0.0
        assert entry.flown == pytest.approx(entry.covered, abs=1e-9)
        assert entry.climbed == pytest.approx(entry.risen, abs=1e-9)
        assert entry.covered >= 0.0
    times, stated = time_by_kind(profile), stated_by_kind(mission)
    for kind in ("idle", "ground_idle", "hover", "loiter", "search"):
        assert times[kind] == pytest.approx(stated[kind], abs=1e-8)
    carried = sum(getattr(task, "mass_change_kg", 0.0) for task in mission.tasks)
    assert profile.mass_changes.sum() == pytest.approx(carried, abs=1e-9)
    check_conditions(mission, profile)


def check_conditions(mission: Mission, profile: Profile) -> None:
    grid = profile.grid(max(1.0, profile.duration / 400.0))
    for name, values in vars(grid).items():
        assert name == "height" or np.all(np.isfinite(np.asarray(values, dtype=float))), name
    assert np.all((grid.altitude >= -1e-9) & (grid.altitude <= 2000.0 + 1e-9))
    assert np.all(grid.height >= -1e-9)
    assert np.all((grid.speed >= 0.0) & (grid.speed <= 70.0 + 2.0 * profile.wind.strongest))
    assert np.all(grid.turn_load_factor >= 1.0)
    assert np.all(grid.load_factor >= 0.7 * grid.turn_load_factor) and np.all(grid.load_factor < 2.1)
    assert np.abs(grid.climb_angle).max() <= np.pi / 2.0 and np.abs(grid.equivalent_climb_angle).max() <= np.pi / 2.0
    last = len(profile.segments) - 1
    task = profile.segments[last].task.partition(" at ")[2]
    assert distance(profile.positions(last, profile.duration), mission.places[task].point) < 1e-6


@pytest.mark.slow
@settings(deadline=None, max_examples=150, database=None, suppress_health_check=list(HealthCheck))
@given(missions())
def test_random_missions(data):
    found = flown(data)
    if found is not None:
        check(*found)


@pytest.mark.slow
@settings(deadline=None, max_examples=40, database=None, suppress_health_check=list(HealthCheck))
@given(missions())
def test_random_missions_are_read_again_as_they_were_written(data):
    found = flown(data)
    if found is not None:
        mission, profile = found
        again = Mission.model_validate_json(mission.model_dump_json())
        assert again == mission
        np.testing.assert_array_equal(Profile.of(again).edges, profile.edges)
