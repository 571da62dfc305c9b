"""How tasks are flown: legs, changes of height and speed, turns, lift-off, mass."""

import re
from itertools import pairwise
from math import radians, sin, tan

import numpy as np
import pytest

from tests.mission.flight_checks import GRAVITY, book, distance, gaps, state
from tests.mission.small_missions import (
    BREEZE,
    HOVER,
    IDLE,
    PLACES,
    SHEAR,
    climb,
    cruise,
    data,
    descent,
    flown,
    mission,
    place,
)
from vrsopt.errors import InputError
from vrsopt.mission.file import mission_from
from vrsopt.mission.profile import Profile, Segment
from vrsopt.mission.route import Leg, Spiral

NORTH, HOME = ((PLACES[name]["latitude_deg"], PLACES[name]["longitude_deg"]) for name in ("north", "home"))


def there_and_down(*tasks, **others) -> Profile:
    """A mission that ends in a hover over what the last cruise leads to."""
    return flown(HOVER, *tasks, descent(), HOVER, **others)


def point(segment: Segment, end: bool = True) -> tuple[float, float]:
    found = state(segment, segment.duration if end else 0.0)
    return found["latitude"], found["longitude"]


def motion(segment: Segment, count: int = 401):
    return segment.motion.kinematics(np.linspace(0.0, segment.duration, count))


def of(profile: Profile, *kinds: str) -> list[Segment]:
    return [segment for segment in profile.segments if segment.kind in kinds]


def refusal(*tasks, **others) -> str:
    with pytest.raises(InputError) as error:
        flown(*tasks, **others)
    message = str(error.value)
    assert "\n" not in message and message.startswith("test: ")
    return message.removeprefix("test: ")


# legs


@pytest.mark.parametrize("wind", [None, BREEZE, SHEAR], ids=["calm", "breeze", "shear"])
@pytest.mark.parametrize("to", ["north", "east"])
def test_a_leg_from_hover_to_hover_is_the_geodesic(to, wind):
    profile = there_and_down(climb(600.0), cruise(to), **({} if wind is None else {"wind": wind}))
    goal = (PLACES[to]["latitude_deg"], PLACES[to]["longitude_deg"])
    covered = sum(book(segment).covered for segment in profile.segments)
    assert covered == pytest.approx(distance(HOME, goal), abs=1e-6)
    assert distance(point(profile.segments[-1]), goal) < 1e-6
    assert distance(point(profile.segments[-2]), goal) < 1e-6
    assert profile.segments[0].motion.path.point == HOME


def test_a_leg_with_a_turn_ends_at_the_place():
    profile = there_and_down(climb(600.0), cruise("north"), cruise("east"), cruise("home"))
    for name in ("north", "east", "home"):
        goal = (PLACES[name]["latitude_deg"], PLACES[name]["longitude_deg"])
        last = [segment for segment in profile.segments if segment.task.endswith(f"to {name}")][-1]
        assert distance(point(last), goal) < 1e-3
    lengths = [
        sum(book(segment).covered for segment in profile.segments if segment.task.endswith(f"to {name}"))
        for name in ("north", "east")
    ]
    assert lengths[0] == pytest.approx(12_000.0, abs=1e-6)
    assert distance(NORTH, point(profile.segments[-1])) < lengths[1] < 1.1 * distance(NORTH, (47.0, 8.2))
    assert gaps(profile)["position"] < 1e-3


@pytest.mark.parametrize(
    ("tasks", "others"),
    [
        ((climb(600.0), cruise("goal"), descent()), {}),
        ((climb(600.0, 50.0, 4.0), cruise("goal", 65.0), descent(450.0, 30.0, -3.0), descent(angle=-12.0)), {}),
        ((cruise("goal", 30.0),), {}),
        ((climb(500.0), climb(600.0, 55.0, 3.0), cruise("goal", 30.0), descent()), {"handling": {"bank_deg": 30.0}}),
        ((climb(600.0), cruise("goal"), descent()), {"wind": {"from_deg": 30.0, "speed_m_s": 11.0}}),
        ((climb(600.0), cruise("goal"), descent()), {"handling": {"acceleration_m_s2": 0.3}}),
    ],
)
def test_the_least_leg_is_right_to_a_metre(tasks, others):
    def fly(away: float) -> Profile:
        return flown(HOVER, *tasks, HOVER, places={"home": place(), "goal": place(away, 30.0)}, **others)

    with pytest.raises(InputError) as error:
        fly(500.0)
    pattern = r"test: tasks\[\d\]\.to = 'goal': allowed: a place at least (\d+) m away, as far as .*; it is 500 m away"
    least = int(re.fullmatch(pattern, str(error.value))[1])
    profile = fly(least + 1.0)
    assert sum(book(segment).covered for segment in profile.segments) == pytest.approx(least + 1.0, abs=1e-6)
    with pytest.raises(InputError, match=f"at least {least} m away.*it is {least - 1} m away"):
        fly(least - 1.0)


def test_a_leg_that_its_changes_fill_has_no_cruise():
    """Of the room left a hundredth of a metre is still flown, as a piece of a segment."""

    def fly(away: float) -> Profile:
        return there_and_down(climb(600.0), cruise("goal"), places={"home": place(), "goal": place(away)})

    low, high = 3000.0, 9000.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        try:
            fly(middle)
            high = middle
        except InputError:
            low = middle
    assert of(fly(high), "cruise") == []
    assert 0.0 < sum(s.duration for s in of(fly(high + 0.01), "cruise")) < 0.01 / 49.0


@pytest.mark.parametrize("before", [(HOVER,), (HOVER, climb(600.0)), (HOVER, climb(600.0), cruise("home", 40.0))])
def test_a_cruise_to_where_the_aircraft_is_is_refused(before):
    message = refusal(*before, cruise("home"), HOVER)
    index = 2 if len(before) == 3 else len(before)
    assert message == f"tasks[{index}].to = 'home': allowed: a place where the aircraft is not already"


def test_a_cruise_to_where_the_one_before_led_is_refused():
    message = refusal(HOVER, climb(600.0), cruise("north"), cruise("north"), descent(), HOVER)
    assert message == "tasks[3].to = 'north': allowed: a place where the aircraft is not already"


# cruise by time and by distance


@pytest.mark.parametrize("course", [{}, {"course_deg": 200.0}])
def test_cruise_by_time_and_by_distance(course):
    profile = there_and_down(
        climb(600.0),
        cruise("north"),
        cruise(duration_s=123.0, speed=60.0, **course),
        cruise(distance_m=4321.0, speed=45.0, **course),
        cruise("home"),
    )
    tasks = [segment for segment in profile.segments if segment.task == "cruise"]
    speeds = [motion(segment).ground_speed for segment in tasks]
    slowing = next(i for i, speed in enumerate(speeds) if speed[-1] < speed[0] - 1e-9)
    assert sum(segment.duration for segment in tasks[:slowing]) == pytest.approx(123.0, abs=1e-9)
    assert sum(book(segment).covered for segment in tasks[slowing:]) == pytest.approx(4321.0, abs=1e-6)
    assert speeds[slowing - 1][-1] == pytest.approx(60.0) and speeds[-1][-1] == pytest.approx(45.0)
    if course:
        assert state(tasks[-1], 0.0)["course"] % 360.0 == pytest.approx(200.0, abs=0.05)  # meridians converge


@pytest.mark.parametrize(
    ("stated", "what"),
    [("duration_s", "the time of the change of speed"), ("distance_m", "the way flown while the speed changes")],
)
def test_a_cruise_briefer_than_its_change_of_speed_is_refused(stated, what):
    def fly(value: float) -> Profile:
        straight = {"kind": "cruise", "speed_m_s": 65.0, "course_deg": 0.0, stated: value}
        return there_and_down(climb(600.0, 35.0), cruise("north", 35.0), straight, cruise("home", 50.0))

    exact = {"duration_s": 112.5, "distance_m": 112.5 * 50.0}[stated]  # 30 m/s at 0.4 m/s2 peak
    with pytest.raises(InputError) as error:
        fly(exact - 0.1 if stated == "duration_s" else exact - 1.0)
    least = float(re.search(rf"tasks\[3\]\.{stated} = .*: allowed: at least ([\d.]+), {what}", str(error.value))[1])
    assert least == pytest.approx(exact, abs=0.1) and least >= exact
    fly(least)


def test_a_cruise_by_time_from_rest_needs_a_course():
    expected = "course_deg: missing, needed where a cruise by time or distance begins at rest"
    assert refusal(HOVER, cruise(duration_s=90.0), HOVER) == f"tasks[1].{expected}"
    assert refusal(HOVER, climb(500.0), cruise(duration_s=90.0), HOVER) == f"tasks[2].{expected}"


# changes of height and speed


@pytest.mark.parametrize(
    ("angle", "handling", "first", "last"),
    [
        (7.12, {}, "acceleration", "acceleration"),
        (30.0, {"cruise_acceleration_m_s2": 1.0}, "vertical_acceleration", "vertical_acceleration"),
        (7.12, {"acceleration_m_s2": 0.5, "vertical_acceleration_m_s2": 2.0}, "acceleration", "acceleration"),
        (15.0, {"acceleration_m_s2": 3.0, "vertical_acceleration_m_s2": 0.3}, "vertical_acceleration", "acceleration"),
    ],
)
def test_peak_accelerations_are_those_of_the_handling(angle, handling, first, last):
    """From rest, and under way to the speed of the cruise; the slower of horizontal and vertical change counts."""
    profile = there_and_down(
        climb(1900.0, 40.0, angle),
        cruise("far", 55.0),
        places={"home": place(), "far": place(40_000.0)},
        handling=handling,
    )
    limits = {"acceleration": 1.0, "cruise_acceleration": 0.4, "vertical_acceleration": 0.5}
    limits |= {name.removesuffix("_m_s2"): value for name, value in handling.items()}
    away, *_, level = of(profile, "climb")
    for segment, decisive, horizontal in ((away, first, "acceleration"), (level, last, "cruise_acceleration")):
        for name, limit in (("acceleration", horizontal), ("vertical_acceleration", "vertical_acceleration")):
            peak = np.abs(getattr(motion(segment), name)).max()
            assert peak <= limits[limit] * (1.0 + 1e-9)
            if name == decisive:
                assert peak == pytest.approx(limits[limit], rel=1e-9)


def test_a_climb_from_rest_keeps_its_angle_and_holds_its_airspeed():
    profile = there_and_down(climb(900.0, 42.0, 6.0), cruise("north"))
    away, steady, level = of(profile, "climb")
    times = np.linspace(away.start + 0.01, away.end, 50)
    np.testing.assert_allclose(profile.conditions(1, times).climb_angle, radians(6.0), rtol=1e-7)
    held = profile.conditions(2, np.linspace(steady.start, steady.end, 9))
    np.testing.assert_allclose(held.speed, 42.0, rtol=1e-12)
    np.testing.assert_allclose(held.climb_angle, radians(6.0), rtol=1e-12)
    after = state(level, level.duration)
    assert (after["altitude"], after["climb_rate"]) == (pytest.approx(900.0, abs=1e-9), pytest.approx(0.0, abs=1e-12))
    assert after["ground_speed"] == pytest.approx(50.0, rel=1e-12)


@pytest.mark.parametrize("rise", [1e-3, 5.0, 60.0, 190.0, 210.0, 400.0])
@pytest.mark.parametrize("speed_then", [40.0, 65.0])
def test_small_changes_of_height_are_flown_flatter(rise, speed_then):
    """The steady part shrinks to nothing; below that the whole climb has a flatter angle. The height is exact."""
    profile = there_and_down(climb(402.0 + rise), cruise("far", speed_then), places={**PLACES, "far": place(20_000.0)})
    parts = of(profile, "climb")
    risen = sum(book(segment).risen for segment in parts)
    assert risen == pytest.approx(rise, abs=1e-9)
    assert state(parts[-1], parts[-1].duration)["altitude"] == pytest.approx(402.0 + rise, abs=1e-9)
    steepest = max(motion(segment).climb_rate.max() for segment in parts)
    if len(parts) == 3:
        assert steepest == pytest.approx(40.0 * sin(radians(7.12)), rel=1e-12)
    else:
        assert len(parts) == 2 and steepest < 40.0 * sin(radians(7.12))
        assert rise == pytest.approx(0.5 * steepest * sum(segment.duration for segment in parts), rel=1e-9)
    for segment in parts:
        assert np.abs(motion(segment).acceleration).max() <= 1.0 + 1e-9
        assert np.abs(motion(segment).vertical_acceleration).max() <= 0.5 + 1e-9


def test_both_shapes_of_small_changes_occur():
    counts = {rise: len(of(there_and_down(climb(402.0 + rise), cruise("north")), "climb")) for rise in (60.0, 400.0)}
    assert counts == {60.0: 2, 400.0: 3}


def test_steps_in_altitude_on_one_way():
    profile = flown(
        HOVER,
        climb(500.0),
        climb(700.0, 50.0, 4.0),
        cruise("north", 60.0),
        climb(800.0),
        cruise("east"),
        descent(600.0, 45.0),
        descent(500.0, 35.0, -4.0),
        cruise("home"),
        descent(),
        HOVER,
    )
    ends = {before.task: before.motion.altitude(before.duration) for before in profile.segments}
    assert ends == pytest.approx(
        {
            "hover at home": 402.0,
            "climb to north": 700.0,
            "cruise to north": 700.0,
            "climb to east": 800.0,
            "cruise to east": 800.0,
            "descent to east": 500.0,
            "cruise to home": 500.0,
            "descent to home": 402.0,
        },
        abs=1e-9,
    )
    goals = [segment for segment in profile.segments if segment.task == "descent to east"]
    east = (PLACES["east"]["latitude_deg"], PLACES["east"]["longitude_deg"])
    assert distance(point(goals[-1]), east) < 1e-3
    assert state(goals[-1], goals[-1].duration)["ground_speed"] == pytest.approx(50.0)


def test_a_descent_before_its_cruise_lies_on_the_way_of_that():
    profile = there_and_down(
        climb(900.0), cruise("north"), cruise(duration_s=60.0), climb(950.0), descent(600.0), cruise("home")
    )
    names = [task for task, _ in pairwise([s.task for s in profile.segments] + [""]) if "home" in task]
    assert list(dict.fromkeys(names))[:4] == ["hover at home", "climb to home", "descent to home", "cruise to home"]
    assert distance(point(profile.segments[-1]), HOME) < 1e-6


def test_climbs_on_the_way_to_a_high_place():
    """Only the altitude over the place has to be above it."""
    high = {"home": place(), "peak": place(15_000.0, elevation=900.0)}
    profile = flown(HOVER, climb(600.0), climb(1100.0), cruise("peak"), descent(), HOVER, places=high)
    assert profile.segments[-1].motion.altitude(0.0) == pytest.approx(902.0)
    tasks = (HOVER, climb(600.0), cruise("peak"), descent(), HOVER)
    message = refusal(*tasks, places=high)
    assert message.startswith("tasks[2].to = 'peak': allowed: a place no higher than 600 m, the altitude flown there")


def test_a_descent_below_the_place_is_refused():
    message = refusal(HOVER, climb(600.0), cruise("north"), descent(390.0), cruise("home"), descent(), HOVER)
    assert message.startswith("tasks[2].to = 'north': allowed: a place no higher than 390 m")


@pytest.mark.parametrize("before", [climb(600.0), cruise("north", 40.0)])
def test_a_change_of_speed_has_the_acceleration_stated(before):
    """After a climb too, which levels off at its own speed."""
    change = {"kind": "speed_change", "speed_m_s": 60.0, "acceleration_m_s2": 0.3}
    way = (climb(600.0),) if before["kind"] == "climb" else (climb(600.0), before)
    profile = there_and_down(*way, change, cruise("east", 60.0))
    changing = [s for s in of(profile, "cruise") if motion(s).ground_speed[-1] > motion(s).ground_speed[0] + 1e-3]
    peaks = [motion(segment).acceleration.max() for segment in changing]
    assert max(peaks) == pytest.approx(0.3, rel=1e-4)
    assert sum(segment.duration for segment in changing) == pytest.approx(1.5 * 20.0 / 0.3, rel=1e-9)


# turns


@pytest.mark.parametrize(("goal", "side"), [("east", 1.0), ("west", -1.0)])
def test_a_turn_between_legs_has_the_bank_and_the_roll_of_the_handling(goal, side):
    places = {**PLACES, "west": place(15_000.0, -90.0)}
    profile = there_and_down(climb(600.0), cruise("north"), cruise(goal), places=places)
    roll_in, steady, roll_out = (
        (i, s) for i, s in enumerate(profile.segments) if not isinstance(s.motion.path, Leg) and s.kind == "cruise"
    )
    for _, segment in (roll_in, roll_out):
        assert isinstance(segment.motion.path, Spiral)
        assert segment.duration == pytest.approx(3.0, rel=1e-9)
    index, segment = steady
    found = profile.conditions(index, np.linspace(segment.start, segment.end, 5))
    np.testing.assert_allclose(np.degrees(np.arccos(1.0 / found.turn_load_factor)), 20.0, rtol=1e-6)
    np.testing.assert_array_equal(found.turn, side)
    radius = 50.0**2 / (GRAVITY * tan(radians(20.0)))
    rate = np.tan(np.arccos(1.0 / found.turn_load_factor)) * GRAVITY / found.speed
    np.testing.assert_allclose(rate, 50.0 / radius, rtol=1e-6)
    courses = np.unwrap(segment.motion.track(np.linspace(0.0, segment.duration, 50))[2], period=360.0)
    assert np.radians(courses[-1] - courses[0]) / segment.duration == pytest.approx(side * 50.0 / radius, rel=1e-3)
    ends = profile.conditions([roll_in[0], roll_out[0]], [roll_in[1].start, roll_out[1].end])
    np.testing.assert_allclose(ends.turn_load_factor, 1.0, atol=1e-12)


@pytest.mark.parametrize("wind", [None, BREEZE])
@pytest.mark.parametrize(
    "after",
    [
        (cruise("east", 65.0),),
        (climb(900.0, 65.0), cruise("east", 30.0)),
        ({"kind": "speed_change", "speed_m_s": 65.0, "acceleration_m_s2": 3.0}, cruise("east", 30.0)),
    ],
)
def test_no_turn_between_legs_is_steeper_than_the_handling_says(after, wind):
    """Whatever task begins in it, and whatever way the wind blows."""
    profile = there_and_down(climb(600.0, 30.0), cruise("north", 30.0), *after, **({"wind": wind} if wind else {}))
    found = profile.grid(0.5)
    assert np.degrees(np.arccos(1.0 / found.turn_load_factor)).max() < 20.5
    assert np.degrees(np.arccos(1.0 / found.turn_load_factor)).max() > 4.0


# at rest


@pytest.mark.parametrize("height", [0.5, 2.0, 5.0])
def test_lift_off_and_touch_down_are_part_of_the_hover(height):
    hover = {"kind": "hover", "duration_s": 45.0, "height_m": height}
    profile = flown(IDLE, hover, IDLE)
    parts = of(profile, "hover")
    assert sum(segment.duration for segment in parts) == pytest.approx(45.0, abs=1e-12)
    assert state(parts[0], 0.0)["altitude"] == 400.0
    assert state(parts[-1], parts[-1].duration)["altitude"] == pytest.approx(400.0, abs=1e-12)
    rates = np.concatenate([motion(segment).climb_rate for segment in parts])
    upward = np.concatenate([motion(segment).vertical_acceleration for segment in parts])
    assert rates.max() == -rates.min() == pytest.approx(min(1.0, (height * 0.5 / 1.5) ** 0.5), rel=1e-9)
    assert upward.max() == pytest.approx(0.5, rel=1e-9)
    still = max(parts, key=lambda segment: segment.duration)
    np.testing.assert_allclose(motion(still).altitude, 400.0 + height, rtol=1e-15)
    grid = profile.grid(1.0)
    np.testing.assert_allclose(grid.height, grid.altitude - 400.0, atol=1e-12)
    assert grid.height.min() > -1e-9


def test_a_hover_too_short_to_lift_off_is_refused_with_a_duration_that_is_flown():
    message = refusal(IDLE, {"kind": "hover", "duration_s": 3.0, "height_m": 1.7}, IDLE)
    least = float(re.match(r"tasks\[1\].duration_s = 3.0: allowed: at least ([\d.]+), the time to lift", message)[1])
    flown(IDLE, {"kind": "hover", "duration_s": least, "height_m": 1.7}, IDLE)
    refusal(IDLE, {"kind": "hover", "duration_s": least - 0.1, "height_m": 1.7}, IDLE)


@pytest.mark.parametrize(("height", "rate", "reached"), [(100.0, 3.0, 3.0), (4.0, 3.0, (2.0 / 3.0) ** 0.5)])
def test_vertical_climb(height, rate, reached):
    up = {"kind": "vertical_climb", "height_m": height, "climb_rate_m_s": rate}
    profile = flown(HOVER, up, {**HOVER, "height_m": height})
    parts = of(profile, "vertical_climb")
    assert max(motion(segment).climb_rate.max() for segment in parts) == pytest.approx(reached, rel=1e-9)
    assert max(motion(segment).vertical_acceleration.max() for segment in parts) == pytest.approx(0.5, rel=1e-9)
    assert sum(book(segment).risen for segment in parts) == pytest.approx(height - 2.0, abs=1e-9)
    index = profile.segments.index(parts[0])
    middle = profile.conditions(index, parts[0].start + 0.5 * parts[0].duration)
    assert middle.climb_angle == pytest.approx(np.pi / 2.0)
    assert middle.equivalent_climb_angle == pytest.approx(np.pi / 2.0)


def test_the_ground_matters_near_places_only():
    profile = flown(IDLE, HOVER, climb(900.0), cruise("north"), cruise("home"), descent(), HOVER, IDLE)
    near = [segment.ground_elevation is not None for segment in profile.segments]
    kinds = [segment.kind for segment in profile.segments]
    assert all(segment.ground_elevation in (None, 400.0) for segment in profile.segments)
    assert all(here for here, kind in zip(near, kinds, strict=True) if kind in ("idle", "hover"))
    assert [here for here, kind in zip(near, kinds, strict=True) if kind == "climb"] == [True, False, False]
    assert [here for here, kind in zip(near, kinds, strict=True) if kind == "descent"] == [False, False, True]
    assert not any(here for here, kind in zip(near, kinds, strict=True) if kind == "cruise")
    grid = profile.grid(5.0)
    np.testing.assert_array_equal(np.isinf(grid.height), ~np.array(near)[grid.segment])


def test_the_ground_falls_away_below_a_descent_from_a_place():
    profile = there_and_down(
        descent(300.0), cruise("low"), places={"home": place(), "low": place(9000.0, elevation=200.0)}
    )
    grid = profile.grid(1.0)
    assert grid.altitude.min() == pytest.approx(202.0, abs=1e-9)
    assert grid.height.min() > 1.9
    assert np.isinf(grid.height[grid.altitude < 400.0].max())


# mass


def changes(profile: Profile) -> dict[str, float]:
    return {s.task: s.mass_change for s in profile.segments if s.mass_change}


def event(kilograms: float) -> dict:
    return {"kind": "mass_change", "mass_change_kg": kilograms}


def test_mass_changes_at_the_start_of_its_task():
    profile = flown(
        IDLE,
        {**HOVER, "mass_change_kg": 40.0},
        climb(600.0),
        event(-10.0),
        event(-20.0),
        cruise("north"),
        event(5.0),
        descent(),
        {**HOVER, "mass_change_kg": 60.0},
        {**IDLE, "mass_change_kg": -100.0},
    )
    assert changes(profile) == {
        "hover at home": 40.0,
        "cruise to north": -30.0,
        "descent to north": 5.0,
        "hover at north": 60.0,
        "idle at north": -100.0,
    }
    for task in changes(profile):
        first = next(segment for segment in profile.segments if segment.task == task)
        assert first.mass_change != 0.0


def test_an_event_and_the_change_of_the_task_after_it_add_up():
    profile = there_and_down(climb(600.0), cruise("north"), event(-10.0), cruise("home"))
    assert changes(profile) == {"cruise to home": -10.0}
    profile = flown(HOVER, event(-10.0), {**HOVER, "mass_change_kg": 25.0})
    assert [segment.mass_change for segment in profile.segments] == [0.0, 15.0]


def test_an_event_before_a_task_that_takes_no_time_is_kept():
    same = {"kind": "speed_change", "speed_m_s": 50.0, "acceleration_m_s2": 0.5}
    profile = there_and_down(climb(600.0), cruise("north", 50.0), event(-33.0), same, event(-7.0), cruise("east", 50.0))
    assert changes(profile) == {"cruise to east": -40.0}
    assert profile.mass_changes.sum() == -40.0


def test_refusals_count_all_tasks_of_the_file():
    tasks = [HOVER, climb(600.0), event(-1.0), cruise("north"), event(-1.0), descent(300.0), HOVER]
    with pytest.raises(InputError, match=r"^x: tasks\[3\]\.to = 'north': allowed: a place no higher than 300 m"):
        Profile.of(mission_from(data(*tasks), where="x"), where="x")


@pytest.mark.parametrize(
    ("dropped", "index", "aboard"),
    [([-150.0, -60.0], 2, "50"), ([-201.0], 1, "200"), ([-100.0, 30.0, -131.0], 3, "130")],
)
def test_no_more_is_dropped_than_is_aboard(dropped, index, aboard):
    with pytest.raises(InputError) as error:
        mission(HOVER, *map(event, dropped), HOVER)
    expected = f"test: tasks[{index}].mass_change_kg = {dropped[-1]}: allowed: no more than is aboard, {aboard} kg"
    assert str(error.value) == expected


def test_all_that_is_aboard_may_be_dropped():
    profile = flown(HOVER, event(-120.5), {**HOVER, "mass_change_kg": -79.5})
    assert profile.mass_changes.sum() == -200.0
