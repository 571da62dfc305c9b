import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vrsopt.mission.route import Arc, Point, Pose, Spiral, length_of, plane_shape
from vrsopt.mission.turns import end_of, half_circle_radius, lead, turn, turn_shape

HERE = Pose(Point(45.06, 7.66), 33.0)
NORTH = Pose(Point(70.0, 179.9999), 100.0)
LEM = {"radius": 350.0, "roll_length": 120.0}
SARM = {"radius": 200.0, "roll_length": 105.0}
SLOW_ROLL = {"radius": 200.0, "roll_length": 900.0}  # a half circle ends before the full bank is reached


@pytest.mark.parametrize("size", [LEM, SARM, SLOW_ROLL])
@pytest.mark.parametrize("angle", [0.01, -5.0, 30.0, -90.0, 180.0, 300.0, -400.0])
@pytest.mark.parametrize("pose", [HERE, NORTH])
def test_turn_changes_the_course_by_its_angle_and_ends_where_its_shape_says(pose, angle, size):
    way = turn(pose, angle, **size)
    along, across, turned = plane_shape(pose, end_of(way, pose))
    assert abs((turned - angle + 180.0) % 360.0 - 180.0) < 1e-5  # the sphere's excess of the area turned about
    shape = turn_shape(angle, **size)
    assert (along, across) == pytest.approx((float(shape.along), float(shape.across)), abs=1e-4)
    assert length_of(way) == pytest.approx(float(shape.length))


@pytest.mark.parametrize("size", [LEM, SARM, SLOW_ROLL])
def test_shape_of_a_turn_is_the_integral_of_its_curvature(size):
    way = turn(HERE, 130.0, **size)
    along = across = direction = 0.0
    for piece in way:

        def rates(d, state, piece=piece):
            return [np.cos(state[2]), np.sin(state[2]), float(piece.curvature(d))]

        flown = solve_ivp(rates, (0.0, piece.length), [along, across, direction], rtol=1e-11, atol=1e-11)
        along, across, direction = flown.y[:, -1]
    shape = turn_shape(130.0, **size)
    assert direction == pytest.approx(np.radians(130.0), abs=1e-9)
    assert (along, across) == pytest.approx((float(shape.along), float(shape.across)), abs=1e-6)


def test_a_turn_is_spiral_arc_spiral():
    way = turn(HERE, -90.0, **LEM)
    assert [type(piece) for piece in way] == [Spiral, Arc, Spiral]
    assert [piece.length for piece in way] == pytest.approx([120.0, 350.0 * np.pi / 2.0 - 120.0, 120.0])
    assert way[1].curvature(0.0) == -1.0 / 350.0 == way[0].curvature(120.0) == way[2].curvature(0.0)
    assert way[0].curvature(0.0) == 0.0 == way[2].curvature(120.0)


def test_a_small_turn_is_gentle_and_keeps_the_rate_of_roll():
    full, small, smaller = (turn(HERE, angle, **LEM) for angle in (30.0, 4.0, 1.0))
    assert [type(piece) for piece in small] == [Spiral, Spiral]
    assert small[0].length == pytest.approx(2.0 * smaller[0].length)
    rates = [np.gradient(way[0].curvature(np.linspace(0.0, way[0].length, 99)), way[0].length / 98).max()
             for way in (full, small, smaller)]  # fmt: skip
    assert rates == pytest.approx([rates[0]] * 3)
    assert small[0].curvature(small[0].length) < 1.0 / 350.0
    assert turn(HERE, 1e-9, **LEM) == [] and end_of([], HERE) == HERE


@pytest.mark.parametrize("angle", [3.0, 75.0, -180.0])
def test_turns_lead_back_the_way_they_came(angle):
    there = turn(HERE, angle, **LEM)
    end = end_of(there, HERE)
    back = turn(end.reversed, -angle, **LEM)
    assert plane_shape(HERE.reversed, end_of(back, end.reversed)) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    middle = 0.5 * back[0].length
    assert plane_shape(there[-1].pose(there[-1].length - middle).reversed, back[0].pose(middle))[:2] == pytest.approx(
        (0.0, 0.0), abs=1e-6
    )


def test_shapes_come_as_arrays():
    angles = np.array([[0.0, 30.0], [-30.0, 179.0]])
    shape = turn_shape(angles, **LEM)
    assert shape.along.shape == shape.length.shape == (2, 2)
    assert shape.along[0, 0] == shape.length[0, 0] == 0.0
    assert shape.across[1, 0] == -shape.across[0, 1] and shape.along[1, 0] == shape.along[0, 1]
    assert shape.across[1, 1] == pytest.approx(float(turn_shape(179.0, **LEM).across))


@pytest.mark.parametrize("angle", [1.0, 30.0, 90.0, 120.0, -120.0])
def test_lead_is_from_the_corner_to_both_ends(angle):
    shape, before = turn_shape(angle, **SARM), lead(angle, **SARM)
    assert shape.along == pytest.approx(before * (1.0 + np.cos(np.radians(angle))))
    assert shape.across == pytest.approx(before * np.sin(np.radians(angle)))


@pytest.mark.parametrize(("across", "roll_length"), [(400.0, 105.0), (700.0, 120.0), (500.0, 1e-3), (100.0, 900.0)])
def test_half_circle_ends_where_it_is_meant_to(across, roll_length):
    radius = half_circle_radius(across, roll_length=roll_length)
    shape = turn_shape(180.0, radius=radius, roll_length=roll_length)
    assert (float(shape.along), float(shape.across)) == pytest.approx((0.0, across), abs=1e-9)
    assert radius < 0.5 * across


def test_half_circle_of_the_missions_is_little_tighter_than_without_roll():
    assert 0.99 < half_circle_radius(400.0, roll_length=105.0) / 200.0 < 0.995
