from math import degrees, pi, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from vrsopt.mission.route import (
    WGS84,
    Arc,
    Leg,
    Point,
    Pose,
    Spiral,
    Stay,
    length_of,
    offset,
    plane_pose,
    plane_shape,
    spiral_shape,
    turned_by,
)

PLACES = {
    "EGTC": Point(52.0722, -0.61667),
    "milton_keynes": Point(52.0406, -0.7594),
    "EGGW": Point(51.8747, -0.36833),
    "LIMA": Point(45.0864, 7.60337),
    "torino": Point(45.0711, 7.6858),
    "brookside": Point(37.9553, -122.3375),
    "KSFO": Point(37.618806, -122.375417),
}


HERE = Pose(PLACES["KSFO"], 77.0)
ANTIMERIDIAN = Pose(Point(70.0, 179.9999), 80.0)
ROLL = (0.0, 1.0 / 350.0)
PIECES = [
    Leg(*HERE, 1000.0),
    Leg(*ANTIMERIDIAN, 1000.0),
    Arc.from_pose(HERE, 350.0, sweep_deg=-170.0),
    Arc.from_pose(ANTIMERIDIAN, 350.0, sweep_deg=200.0),
    Spiral.from_pose(HERE, 120.0, curvatures=ROLL),
    Spiral.from_pose(ANTIMERIDIAN, 300.0, curvatures=(-1.0 / 350.0, 1.0 / 200.0)),
]


def distance(a: Point, b: Point) -> float:
    return WGS84.Inverse(*a, *b)["s12"]


@pytest.mark.parametrize(
    ("start", "end", "metres"),
    [
        (Point(40.6, -73.8), Point(51.6, -0.5), 5551759.400),  # Karney, GeographicLib: JFK to LHR
        (Point(0.0, 0.0), Point(90.0, 0.0), 10001965.729),  # quarter meridian of WGS 84
        (Point(0.0, 0.0), Point(0.0, 1.0), 6378137.0 * pi / 180.0),  # equator
    ],
)
def test_leg_has_the_published_geodesic_length(start, end, metres):
    assert Leg.between(start, end).length == pytest.approx(metres, abs=1e-3)


@pytest.mark.parametrize(
    ("start", "end", "kilometres"),
    [
        ("EGTC", "milton_keynes", 10.37),
        ("milton_keynes", "EGGW", 32.53),
        ("EGTC", "EGGW", 27.78),
        ("LIMA", "torino", 6.69),
        ("brookside", "KSFO", 37.56),
    ],
)
def test_leg_agrees_with_the_great_circles_of_the_reference(start, end, kilometres):
    """The reference is spherical and rounded to 10 m: sphere and ellipsoid differ by up to 0.4 %."""
    length = Leg.between(PLACES[start], PLACES[end]).length
    assert length == pytest.approx(1e3 * kilometres, rel=4e-3, abs=5.0)


def test_sections_of_a_leg_join_and_stay_on_it():
    leg = Leg.between(PLACES["KSFO"], PLACES["brookside"])
    first, second = leg.section(0.0, 10_000.0), leg.section(10_000.0, leg.length)
    assert first.length + second.length == pytest.approx(leg.length, abs=1e-9)
    assert distance(first.position(first.length), second.start) < 1e-6
    assert distance(second.position(second.length), PLACES["brookside"]) < 1e-6
    assert distance(second.position(5000.0), leg.position(15_000.0)) < 1e-6


def flown_by_small_steps(pose: Pose, curvature, length: float, *, steps: int) -> Pose:
    """Geodesic steps with the turn of each made in its middle: second order in the step."""
    step = length / steps
    for number in range(steps):
        middle = Leg(*pose, 0.5 * step).pose(0.5 * step)
        turned = middle.heading_deg + degrees(float(curvature((number + 0.5) * step)) * step)
        pose = Leg(middle.point, turned, 0.5 * step).pose(0.5 * step)
    return pose


@pytest.mark.parametrize("piece", PIECES[2:])
def test_curves_are_what_a_pilot_flies_who_keeps_their_curvature(piece):
    steps = 1000
    coarse, fine = (
        flown_by_small_steps(piece.pose(0.0), piece.curvature, piece.length, steps=n) for n in (steps, 2 * steps)
    )
    end = piece.pose(piece.length)
    along, across, turned = (
        (4.0 * b - a) / 3.0 for a, b in zip(plane_shape(end, coarse), plane_shape(end, fine), strict=True)
    )
    assert abs(along) < 1e-5 and abs(across) < 1e-5  # the plane of the curve is 700 m wide
    assert abs(turned) < 1e-6


@pytest.mark.parametrize("curvatures", [ROLL, (0.005, 0.0), (-0.005, 0.003), (0.02, 0.01)])
def test_spiral_against_quadrature(curvatures):
    whole = 200.0
    before, after = curvatures

    def curvature(d):
        return before + (after - before) * (3.0 * (d / whole) ** 2 - 2.0 * (d / whole) ** 3)

    def turned(d):
        return quad(curvature, 0.0, d, epsabs=1e-14)[0]

    spiral = Spiral.from_pose(HERE, whole, curvatures=curvatures)
    for d in (1.0, 70.0, 200.0):
        assert spiral.curvature(d) == pytest.approx(curvature(d), rel=1e-13)
        assert turned_by(d, whole=whole, curvatures=curvatures) == pytest.approx(turned(d), rel=1e-13)
        along, across = spiral_shape(d, whole=whole, curvatures=curvatures)
        assert along == pytest.approx(quad(lambda x: np.cos(turned(x)), 0.0, d, epsabs=1e-11)[0], abs=1e-9)
        assert across == pytest.approx(quad(lambda x: np.sin(turned(x)), 0.0, d, epsabs=1e-11)[0], abs=1e-9)
        assert distance(HERE.point, spiral.position(d)) == pytest.approx(np.hypot(along, across), abs=1e-7)
    assert turned_by(whole, whole=whole, curvatures=curvatures) == pytest.approx(0.5 * (before + after) * whole)


def test_curvature_begins_and_ends_without_a_kink():
    spiral = Spiral.from_pose(HERE, 120.0, curvatures=ROLL)
    values = spiral.curvature(np.array([0.0, 0.1, 60.0, 119.9, 120.0]))
    assert values[[0, 2, 4]] == pytest.approx([0.0, 0.5 / 350.0, 1.0 / 350.0])
    assert values[1] < 1e-5 / 350.0 and values[4] - values[3] < 1e-5 / 350.0


@pytest.mark.parametrize("piece", PIECES)
def test_sections_are_parts_of_their_piece(piece):
    begin, end = 0.3 * piece.length, 0.8 * piece.length
    section = piece.section(begin, end)
    assert section.length == pytest.approx(end - begin)
    inner = section.section(0.1 * section.length, section.length)
    for part in (section, inner):
        left = end - part.length
        for d in (0.0, 0.4 * part.length, part.length):
            assert plane_shape(piece.pose(left + d), part.pose(d)) == pytest.approx((0.0, 0.0, 0.0), abs=1e-7)
            assert part.curvature(d) == pytest.approx(piece.curvature(left + d))


@pytest.mark.parametrize("piece", [*PIECES, Stay(HERE.point)])
def test_curvature_has_the_shape_of_the_distances(piece):
    distances = np.linspace(0.0, piece.length, 6).reshape(2, 3)
    values = piece.curvature(distances)
    assert values.shape == (2, 3)
    assert values[1, 1] == piece.curvature(distances[1, 1])


def test_staying_is_no_motion():
    stay = Stay(HERE.point, heading_deg=12.0)
    assert stay.section(0.0, 0.0) == stay and stay.pose(0.0) == (HERE.point, 12.0) and length_of([stay]) == 0.0


@pytest.mark.parametrize("sweep", [180.0, -180.0, 90.0, -37.0])
def test_arc_keeps_its_radius_and_is_tangent_at_both_ends(sweep):
    pose = Pose(PLACES["KSFO"], 77.0)
    arc = Arc.from_pose(pose, 350.0, sweep_deg=sweep)
    assert arc.length == pytest.approx(350.0 * abs(sweep) * pi / 180.0, rel=1e-12)
    assert distance(arc.position(0.0), pose.point) < 1e-6
    for part in (0.2, 0.7, 1.0):
        assert distance(arc.centre, arc.position(part * arc.length)) == pytest.approx(350.0, abs=1e-6)
    turned = (arc.pose(arc.length).heading_deg - pose.heading_deg - sweep + 180.0) % 360.0 - 180.0
    assert abs(turned) < 0.01  # meridians converge by a few thousandths of a degree over the turn
    small = arc.position(1.0)
    assert distance(small, Leg(*pose, 1.0).position(1.0)) < 0.01


def test_a_right_turn_goes_right():
    north = Pose(Point(45.0, 7.0), 0.0)
    assert Arc.from_pose(north, 200.0, sweep_deg=180.0).centre.longitude_deg > 7.0
    assert Arc.from_pose(north, 200.0, sweep_deg=-180.0).centre.longitude_deg < 7.0
    right = Arc.from_pose(north, 200.0, sweep_deg=180.0)
    assert right.position(0.5 * right.length).latitude_deg > 45.0


def test_offset_is_along_and_to_the_right():
    origin = Point(37.8, -122.5)
    east = offset(origin, 0.0, along=0.0, across=1000.0)
    assert east.longitude_deg > origin.longitude_deg and abs(east.latitude_deg - origin.latitude_deg) < 1e-5
    assert distance(origin, offset(origin, 30.0, along=-300.0, across=400.0)) == pytest.approx(500.0, abs=1e-6)


@settings(deadline=None, max_examples=50, database=None)
@given(
    latitude=st.sampled_from([0.0, 37.0, -70.0, 85.0]),
    longitude=st.sampled_from([7.0, 179.9999, -180.0]),
    heading=st.floats(-180.0, 180.0),
    along=st.floats(-1e5, 1e5),
    across=st.floats(-1e5, 1e5),
    turned=st.floats(-179.0, 179.0),
)
def test_plane_and_back(latitude, longitude, heading, along, across, turned):
    origin = Pose(Point(latitude, longitude), heading)
    pose = plane_pose(origin, along, across=across, turned_deg=turned)
    assert abs(pose.point.longitude_deg) <= 180.0 and abs(pose.heading_deg) <= 180.0
    assert plane_shape(origin, pose)[:2] == pytest.approx((along, across), abs=1e-6)
    if np.hypot(along, across) > 0.1:  # from a point onto itself every direction leads
        assert plane_shape(origin, pose)[2] == pytest.approx(turned, abs=1e-9)


def test_directions_in_the_plane_are_those_of_the_gyro():
    """Eastbound at 70 degrees the meridians converge by sin(latitude) of the change of longitude."""
    origin = Pose(Point(70.0, 179.9), 90.0)
    ahead = plane_pose(origin, 10_000.0, across=0.0)
    change = (ahead.point.longitude_deg - 179.9) % 360.0
    assert ahead.heading_deg - 90.0 == pytest.approx(change * np.sin(radians(70.0)), abs=1e-3)
    assert origin.reversed.heading_deg == -90.0
