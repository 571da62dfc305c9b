from math import acos, atan2, cos, degrees, hypot, pi, radians, sin, sqrt

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from vrsopt.mission.join import direct_to, join
from vrsopt.mission.route import WGS84, Arc, Leg, Point, Pose, length_of, plane_pose, plane_shape
from vrsopt.mission.turns import end_of

HERE = Pose(Point(37.8, -122.5), 33.0)
LEM = {"radius": 350.0, "roll_length": 120.0}
SIZES = [LEM, {"radius": 200.0, "roll_length": 105.0}, {"radius": 200.0, "roll_length": 700.0}]

starts = st.builds(
    lambda latitude, longitude, heading: Pose(Point(latitude, longitude), heading),
    st.sampled_from([0.0, 45.0, -70.0, 85.0]),
    st.sampled_from([7.0, 179.999, -180.0]),
    st.floats(-180.0, 180.0),
)
distances = st.one_of(st.floats(0.0, 2000.0), st.floats(2000.0, 300_000.0))
angles = st.one_of(st.floats(-180.0, 180.0), st.sampled_from([0.0, 1e-9, 1e-4, 90.0, -90.0, 180.0]))


def check_flyable(way, start: Pose, *, radius: float, **_) -> None:
    """Each piece begins as the one before ended: position, course, curvature; none bends more than the radius."""
    pose, curvature = start, 0.0
    for piece in way:
        assert piece.length > 0.0
        along, across, turned = plane_shape(pose, piece.pose(0.0))
        assert hypot(along, across) < 1e-6 and abs(turned) < 2e-8
        assert piece.curvature(0.0) == pytest.approx(curvature, abs=1e-12)
        assert np.abs(piece.curvature(np.linspace(0.0, piece.length, 9))).max() <= 1.0 / radius + 1e-12
        pose, curvature = piece.pose(piece.length), float(piece.curvature(piece.length))
    assert curvature == pytest.approx(0.0, abs=1e-12)


@settings(deadline=None, max_examples=60, database=None)
@given(start=starts, distance=distances, bearing=angles, turned=angles, size=st.sampled_from(SIZES))
@example(start=HERE, distance=0.0, bearing=0.0, turned=0.0, size=LEM)
@example(start=HERE, distance=1e-3, bearing=0.0, turned=0.0, size=LEM)
@example(start=HERE, distance=1e-3, bearing=180.0, turned=0.0, size=LEM)
@example(start=HERE, distance=0.0, bearing=0.0, turned=180.0, size=LEM)
@example(start=HERE, distance=350.0, bearing=0.0, turned=1e-5, size=LEM)
@example(start=Pose(Point(0.0, 7.0), 0.0), distance=0.0, bearing=0.0, turned=2.0**-23, size=LEM)  # straight: -1e-6 m
def test_join_ends_in_its_goal(start, distance, bearing, turned, size):
    ahead, aside = distance * cos(radians(bearing)), distance * sin(radians(bearing))
    goal = plane_pose(start, ahead, across=aside, turned_deg=turned)
    way = join(start, goal, **size)
    check_flyable(way, start, **size)
    along, across, course = plane_shape(goal, end_of(way, start))
    assert hypot(along, across) < 1e-4 and abs(course) < 1e-7
    assert length_of(way) > distance - 1e-3


@settings(deadline=None, max_examples=60, database=None)
@given(start=starts, distance=distances, bearing=angles, size=st.sampled_from(SIZES))
@example(start=HERE, distance=1e-3, bearing=0.05, size=LEM)
@example(start=HERE, distance=200.0, bearing=90.0, size=LEM)
@example(start=Pose(Point(0.0, 7.0), 0.0), distance=0.5, bearing=2.0**-14, size=SIZES[1])
def test_direct_ends_at_its_target(start, distance, bearing, size):
    target = plane_pose(start, distance * cos(radians(bearing)), across=distance * sin(radians(bearing))).point
    way = direct_to(start, target, **size)
    check_flyable(way, start, **size)
    assert WGS84.Inverse(*end_of(way, start).point, *target)["s12"] < 1e-4


def dubins(x: float, y: float, turned: float, radius: float) -> float:
    """Length of the shortest turn, straight, turn with turns of constant radius: circles and their tangents."""
    lengths = []
    for first in (1.0, -1.0):
        for last in (1.0, -1.0):
            dx, dy = x - last * radius * sin(turned), y + last * radius * cos(turned) - first * radius
            apart, bearing = hypot(dx, dy), atan2(dy, dx)
            if first == last:
                course, straight = bearing, apart
            elif apart >= 2.0 * radius:
                course = bearing + first * (pi / 2.0 - acos(2.0 * radius / apart))
                straight = sqrt(apart**2 - 4.0 * radius**2)
            else:
                continue
            turns = (first * course) % (2.0 * pi) + (last * (turned - course)) % (2.0 * pi)
            lengths.append(straight + radius * turns)
    return min(lengths)


@settings(deadline=None, max_examples=40, database=None)
@given(x=st.floats(-3000.0, 3000.0), y=st.floats(1500.0, 3000.0), turned=st.floats(-3.1, 3.1))
def test_with_roll_in_no_time_it_is_the_shortest_of_the_classic_ways(x, y, turned):
    goal = plane_pose(HERE, x, across=y, turned_deg=degrees(turned))
    way = join(HERE, goal, radius=300.0, roll_length=0.01)
    assert length_of(way) == pytest.approx(dubins(x, y, turned, 300.0), abs=0.1)


@pytest.mark.parametrize(("x", "y", "turned"), [(3000.0, 2000.0, 100.0), (-500.0, 4000.0, -10.0), (50e3, 80e3, 170.0)])
def test_the_way_back_and_the_mirrored_way_are_as_long(x, y, turned):
    goal = plane_pose(HERE, x, across=y, turned_deg=turned)
    there = join(HERE, goal, **LEM)
    back = join(goal.reversed, HERE.reversed, **LEM)
    assert length_of(back) == pytest.approx(length_of(there), abs=1e-5)
    mirrored = join(HERE, plane_pose(HERE, x, across=-y, turned_deg=-turned), **LEM)
    assert length_of(mirrored) == pytest.approx(length_of(there), rel=1e-6)


def test_a_goal_ahead_is_one_leg_and_the_place_itself_none():
    ahead = Leg(*HERE, 5000.0)
    for way in (
        join(HERE, ahead.pose(5000.0), **LEM),
        direct_to(HERE, ahead.position(5000.0), **LEM),
    ):
        assert [type(piece) for piece in way] == [Leg] and way[0].length == pytest.approx(5000.0, abs=1e-6)
    assert join(HERE, HERE, **LEM) == [] == direct_to(HERE, HERE.point, **LEM)


def test_direct_turns_the_shorter_way_round():
    for across, sign in ((3000.0, 1.0), (-3000.0, -1.0)):
        way = direct_to(HERE, plane_pose(HERE, -2000.0, across=across).point, **LEM)
        assert sign * float(way[1].curvature(0.0)) > 0.0 and isinstance(way[1], Arc)
        assert 90.0 < abs(way[1].sweep_deg) < 180.0


def test_a_target_inside_the_circle_is_reached_the_other_way_round():
    way = direct_to(HERE, plane_pose(HERE, 0.0, across=350.0).point, **LEM)
    assert isinstance(way[1], Arc) and way[1].sweep_deg < -180.0


def test_close_goals_are_not_circled_for():
    """The next track of a pattern, a little closer than two quarter turns: some way ahead makes room for them."""
    goal = plane_pose(HERE, 60.0, across=700.0, turned_deg=180.0)
    way = join(HERE, goal, **LEM)
    assert isinstance(way[0], Leg) and len(way) > 1
    assert length_of(way) < 2000.0
