from math import pi

import pytest

from vrsopt.mission.route import WGS84, Arc, Leg, Point, Pose, offset

PLACES = {
    "EGTC": Point(52.0722, -0.61667),
    "milton_keynes": Point(52.0406, -0.7594),
    "EGGW": Point(51.8747, -0.36833),
    "LIMA": Point(45.0864, 7.60337),
    "torino": Point(45.0711, 7.6858),
    "brookside": Point(37.9553, -122.3375),
    "KSFO": Point(37.618806, -122.375417),
}


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
    cut = right.cut(0.25 * right.length)
    assert distance(cut.position(cut.length), right.position(0.25 * right.length)) < 1e-6


def test_offset_is_along_and_to_the_right():
    origin = Point(37.8, -122.5)
    east = offset(origin, 0.0, along=0.0, across=1000.0)
    assert east.longitude_deg > origin.longitude_deg and abs(east.latitude_deg - origin.latitude_deg) < 1e-5
    assert distance(origin, offset(origin, 30.0, along=-300.0, across=400.0)) == pytest.approx(500.0, abs=1e-6)
