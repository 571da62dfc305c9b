"""Free speeds and altitudes of a mission file: what they free, what they keep, what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.mission.small_missions import HOVER, climb, cruise, descent, mission
from vrsopt.errors import InputError
from vrsopt.mission.file import Mission
from vrsopt.mission.flight_path import ground_distances
from vrsopt.mission.profile import Profile
from vrsopt.mission.ranges import free_values, with_values

SPEEDS, ALTITUDES = {"speed_range_m_s": [40.0, 60.0]}, {"altitude_range_m": [600.0, 900.0]}
LOITER = {"kind": "loiter", "leg_m": 1500.0, "duration_s": 300.0, "around": "north", "turn_radius_m": 350.0}


def tour(*, there: dict[str, Any] = SPEEDS, loiter: dict[str, Any] = SPEEDS) -> Mission:
    """Out to the north, loiter there, cruise by distance and by time, and home."""
    return mission(
        HOVER,
        climb(700.0),
        cruise("north", 50.0, **there),
        {**LOITER, "speed_m_s": 45.0, **loiter},
        climb(950.0),
        cruise(distance_m=4000.0, course_deg=90.0, **SPEEDS),
        cruise(duration_s=120.0, **SPEEDS),
        descent(700.0),
        cruise("home", 50.0),
        descent(),
        HOVER,
    )


def flown(stated: Mission, **numbers: float) -> Profile:
    """The profile with ``task_field`` values, by the index of the task."""
    values = {value: numbers.get(f"t{value.task}", value.stated) for value in free_values(stated.tasks)}
    return Profile.of(stated.model_copy(update={"tasks": with_values(stated.tasks, values)}))


def test_speeds_and_altitudes_left_free_are_found_in_order_with_what_is_stated():
    stated = tour(there=SPEEDS | ALTITUDES, loiter={"altitude_range_m": [500.0, 800.0]})
    found = [(str(v), v.stated, v.lower, v.upper) for v in free_values(stated.tasks)]
    assert found == [
        ("tasks[1].altitude_m", 700.0, 600.0, 800.0),  # one altitude for both tasks
        ("tasks[2].speed_m_s", 50.0, 40.0, 60.0),
        ("tasks[5].speed_m_s", 50.0, 40.0, 60.0),
        ("tasks[6].speed_m_s", 50.0, 40.0, 60.0),
    ]


def test_ranges_change_nothing_by_themselves():
    assert flown(tour()).edges == pytest.approx(Profile.of(tour()).edges, abs=1e-9)


def span(profile: Profile, task: str) -> tuple[float, float, float]:
    """Duration [s], ground distance [m] and highest speed [m/s] of the segments of a task."""
    here = [k for k, s in enumerate(profile.segments) if s.task == task]
    grid = profile.grid(1.0)
    duration = sum(profile.segments[k].duration for k in here)
    return duration, float(ground_distances(profile)[here].sum()), float(grid.speed[np.isin(grid.segment, here)].max())


def test_distance_or_duration_is_kept_at_any_speed():
    slow, fast = (flown(tour(), t2=v, t3=v, t5=v, t6=v) for v in (41.0, 58.0))
    assert span(fast, "loiter around north")[2] == pytest.approx(58.0, abs=1e-3)
    for profile in (slow, fast):
        assert span(profile, "loiter around north")[0] == pytest.approx(300.0)
        numbers = sorted({s.number for s in profile.segments if s.task == "cruise"})
        by_distance, by_time = ([k for k, s in enumerate(profile.segments) if s.number == n] for n in numbers)
        assert ground_distances(profile)[by_distance].sum() == pytest.approx(4000.0, abs=1e-3)
        assert sum(profile.segments[k].duration for k in by_time) == pytest.approx(120.0)
    out = [ground_distances(p)[[s.task.endswith("to north") for s in p.segments]].sum() for p in (slow, fast)]
    assert out[0] == pytest.approx(out[1], abs=0.01)  # the way to a place
    reached = [min(s.start for s in p.segments if s.kind == "loiter") for p in (slow, fast)]
    assert reached[0] > reached[1] + 30.0


def test_altitude_of_a_stretch_is_flown_by_all_of_it():
    stated = tour(there=ALTITUDES, loiter=ALTITUDES | SPEEDS)
    profile = flown(stated, t1=820.0)
    here = [k for k, s in enumerate(profile.segments) if s.kind == "loiter"]
    grid = profile.grid(5.0)
    assert grid.altitude[np.isin(grid.segment, here)] == pytest.approx(820.0, abs=1e-6)


REFUSED = [
    ({"speed_range_m_s": [60.0, 40.0]}, {}, "tasks[2].speed_range_m_s = [60.0, 40.0]: allowed: [lower, upper]"),
    ({"speed_range_m_s": [55.0, 60.0]}, {}, "tasks[2].speed_range_m_s = [55.0, 60.0]: allowed: around speed_m_s, 50"),
    ({"speed_range_m_s": [40.0, 71.0]}, {}, "tasks[2].speed_range_m_s[1] = 71.0: allowed: a number from 1 to 70"),
    ({"speed_range_m_s": [40.0]}, {}, "tasks[2].speed_range_m_s"),
    (
        {"altitude_range_m": [800.0, 900.0]},
        ALTITUDES,
        "tasks[2].altitude_range_m = [800.0, 900.0]: allowed: around",
    ),
    (ALTITUDES, {}, "tasks[2].altitude_range_m = [600.0, 900.0]: allowed where all level tasks of that altitude state"),
    (
        {},
        {"turn_radius_m": 160.0, **SPEEDS},
        "tasks[3].turn_radius_m = 160.0: allowed: at least 212.0, a bank of 60",
    ),
]


@pytest.mark.parametrize(("there", "loiter", "message"), REFUSED, ids=[e[2][:40] for e in REFUSED])
def test_a_range_that_can_not_be_is_refused_by_field(there, loiter, message):
    with pytest.raises(InputError) as error:
        tour(there=there, loiter=loiter)
    assert str(error.value).startswith(f"test: {message}")


def test_altitude_is_free_only_after_a_climb_to_it():
    with pytest.raises(InputError, match=r"tasks\[3\]\.altitude_range_m = .*: allowed: after a climb or descent that"):
        mission(HOVER, climb(700.0), HOVER, cruise("north", 50.0, **ALTITUDES), HOVER)


def test_searches_have_no_ranges():
    search = {"kind": "search", "spacing_m": 800.0, "leg_m": 3000.0, "duration_s": 200.0, "around": "north"}
    with pytest.raises(InputError, match=r"speed_range_m_s = \[40.0, 60.0\]: unknown key"):
        mission(HOVER, {**search, "speed_m_s": 40.0, "turn_radius_m": 350.0, **SPEEDS}, HOVER)
