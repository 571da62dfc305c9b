from itertools import islice, pairwise
from math import hypot

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.mission.pattern import (
    CORNERS,
    Corner,
    circle,
    expanding_square,
    parallel_tracks,
    race_track,
    sector_search,
    track_pitch,
)
from vrsopt.mission.route import WGS84, Arc, Leg, Point, Pose, Spiral, length_of, plane_pose, plane_shape
from vrsopt.mission.turns import end_of, lead

CENTRE = Point(37.792, -122.56)
FAR_NORTH = Point(70.0, 179.99)
LEM = {"radius": 350.0, "roll_length": 120.0}
SARM = {"radius": 200.0, "roll_length": 105.0}


def creeping(centre=CENTRE, bearing=35.0, *, spacing=400.0, tracks=9, corner=CORNERS[0]):
    return parallel_tracks(centre, bearing, leg=4000.0, spacing=spacing, tracks=tracks, corner=corner, **SARM)


PATTERNS = {
    "creeping line": lambda centre: creeping(centre),
    "creeping line, wide": lambda centre: creeping(centre, spacing=1000.0, corner=CORNERS[3]),
    "square": lambda centre: expanding_square(centre, 35.0, spacing=800.0, **SARM),
    "square, left": lambda centre: expanding_square(centre, 35.0, spacing=800.0, right=False, **SARM),
    "sector": lambda centre: sector_search(centre, 35.0, reach=3000.0, **LEM),
    "race-track": lambda centre: race_track(centre, 35.0, leg=1500.0, **LEM),
    "race-track, left": lambda centre: race_track(centre, 35.0, leg=1500.0, right=False, **LEM),
    "circle": lambda centre: circle(centre, 35.0, **LEM),
    "circle, left": lambda centre: circle(centre, 35.0, right=False, **LEM),
}


def distance(a: Point, b: Point) -> float:
    return WGS84.Inverse(*a, *b)["s12"]


def seen(centre: Point, pose: Pose, bearing=35.0):
    return plane_shape(Pose(centre, bearing), pose)


def legs_of(pattern, number):
    return list(islice((piece for piece in pattern.pieces if isinstance(piece, Leg)), number))


@pytest.mark.parametrize("centre", [CENTRE, FAR_NORTH])
@pytest.mark.parametrize("name", PATTERNS)
def test_patterns_are_endless_and_smooth(name, centre):
    pattern = PATTERNS[name](centre)
    pose, curvature = pattern.entry, 0.0
    pieces = list(islice(pattern.pieces, 100))
    assert len(pieces) == 100
    for piece in pieces:
        along, across, turned = plane_shape(pose, piece.pose(0.0))
        assert hypot(along, across) < 1e-7 and abs(turned) < 1e-6
        assert piece.curvature(0.0) == pytest.approx(curvature, abs=1e-15)
        assert piece.length > 10.0
        pose, curvature = piece.pose(piece.length), float(piece.curvature(piece.length))


@pytest.mark.parametrize("centre", [CENTRE, FAR_NORTH])
@pytest.mark.parametrize("spacing", [400.0, 500.0, 1000.0])
def test_tracks_are_parallel_and_one_spacing_apart(spacing, centre):
    tracks = legs_of(creeping(centre, spacing=spacing), 60)
    tracks = [leg for leg in tracks if leg.length == 4000.0][:20]
    for one, other in pairwise(tracks):
        for d in (0.0, 2000.0, 4000.0):
            along, across, turned = plane_shape(one.pose(d), other.pose(4000.0 - d))
            assert (along, abs(across)) == pytest.approx((0.0, spacing), abs=1e-3)
            assert abs(turned) == pytest.approx(180.0, abs=1e-4)
    for d in (1000.0, 3000.0):
        assert seen(centre, tracks[0].pose(d))[:2] == pytest.approx((d - 2000.0, -4.0 * spacing), abs=0.01)


def test_turns_between_tracks():
    """A half circle, or two quarters with what is left of the spacing between them."""
    near, middle, wide = (list(islice(creeping(spacing=spacing).pieces, 8)) for spacing in (400.0, 500.0, 1000.0))
    for pieces, radius in ((near, 200.0), (middle, 250.0)):
        assert [type(piece) for piece in pieces[:5]] == [Leg, Spiral, Arc, Spiral, Leg]
        assert 0.98 * radius < pieces[2].radius < radius
    assert [type(piece) for piece in wide] == [Leg, Spiral, Arc, Spiral, Leg, Spiral, Arc, Spiral]
    assert wide[2].radius == pytest.approx(200.0)
    assert wide[4].length == pytest.approx(1000.0 - 2.0 * lead(90.0, **SARM))


def test_turns_between_tracks_alternate():
    turns = [piece for piece in islice(creeping().pieces, 40) if isinstance(piece, Arc)]
    assert [turn.sweep_deg > 0.0 for turn in turns[:4]] == [True, False, True, False]


@pytest.mark.parametrize("corner", CORNERS)
@pytest.mark.parametrize("tracks", [1, 8, 9])
def test_creeping_line_lies_around_its_centre_whatever_the_corner(corner, tracks):
    pattern = creeping(corner=corner, tracks=tracks)
    along, across, _ = seen(CENTRE, pattern.entry)
    assert (along, across) == pytest.approx((2000.0 * corner.along, 200.0 * (tracks - 1) * corner.across), abs=1e-5)
    middles = [seen(CENTRE, leg.pose(2000.0))[:2] for leg in legs_of(pattern, tracks)]
    assert np.mean(middles, axis=0) == pytest.approx([0.0, 0.0], abs=0.01)


@pytest.mark.parametrize("spacing", [400.0, 1000.0])
def test_pitch_is_the_length_of_a_track_and_a_turn(spacing):
    pattern = creeping(spacing=spacing)
    pieces = list(islice(pattern.pieces, 4 if spacing == 400.0 else 8))
    assert track_pitch(4000.0, spacing, **SARM) == pytest.approx(length_of(pieces), abs=1e-6)
    next_track = next(pattern.pieces)
    assert isinstance(next_track, Leg) and next_track.length == 4000.0


def test_tracks_closer_than_the_turns_allow():
    with pytest.raises(InputError, match=r"^spacing_m = 390: allowed: at least 400, twice the radius of the turns$"):
        creeping(spacing=390.0)


@pytest.mark.parametrize("centre", [CENTRE, FAR_NORTH])
@pytest.mark.parametrize(("right", "side"), [(True, 1.0), (False, -1.0)])
def test_square_expands_by_one_spacing_every_half_turn(right, side, centre):
    pattern = expanding_square(centre, 35.0, spacing=800.0, right=right, **SARM)
    assert pattern.entry == (centre, 35.0)
    middles = [seen(centre, leg.pose(0.5 * leg.length))[:2] for leg in legs_of(pattern, 9)]
    lines = [0.0, 800.0, 800.0, -800.0, -800.0, 1600.0, 1600.0, -1600.0, -1600.0]
    for number, (middle, line) in enumerate(zip(middles, lines, strict=True)):
        across = middle[1] if number % 2 == 0 else middle[0]
        expected = line if number % 2 else side * line
        assert across == pytest.approx(expected, abs=0.01)


def test_legs_of_the_square_are_those_between_its_corners_less_the_turns():
    cut = lead(90.0, **SARM)
    lengths = [leg.length for leg in legs_of(expanding_square(CENTRE, 35.0, spacing=800.0, **SARM), 7)]
    expected = [800.0 - cut, *(800.0 * n - 2.0 * cut for n in (1, 2, 2, 3, 3, 4))]
    assert lengths == pytest.approx(expected, abs=0.01)


def test_square_too_small_for_its_turns():
    with pytest.raises(InputError, match=r"^spacing_m = 500: allowed: at least 507.7, for two turns of radius 200$"):
        expanding_square(CENTRE, 0.0, spacing=500.0, **SARM)
    assert legs_of(expanding_square(CENTRE, 0.0, spacing=507.7, **SARM), 3)[1].length < 0.1


@pytest.mark.parametrize("centre", [CENTRE, FAR_NORTH])
def test_every_sector_leads_straight_over_the_datum(centre):
    """Three times per circuit, on courses 120 degrees apart, 30 degrees from those of the circuit before."""
    pattern = sector_search(centre, 35.0, reach=3000.0, **LEM)
    assert pattern.entry == (centre, 35.0)
    crossings = []
    for leg in legs_of(pattern, 24):
        along, across, _ = plane_shape(leg.pose(0.0), Pose(centre, 0.0))
        if abs(across) < 1.0:
            assert abs(across) < 1e-5
            assert -1e-6 < along <= leg.length - 149.0  # straight flown on after it
            crossings.append(leg.pose(along).heading_deg - 35.0)
    circuits = np.array([0.0, 240.0, 120.0, 0.0, 270.0, 150.0, 30.0, 300.0, 180.0, 60.0])
    turned = np.array(crossings[: len(circuits)]) - circuits
    assert (turned + 180.0) % 360.0 == pytest.approx(180.0, abs=1e-4)


def test_sectors_reach_as_far_as_they_say_and_turn_right():
    pieces = list(islice(sector_search(CENTRE, 35.0, reach=3000.0, **LEM).pieces, 100))
    assert all(piece.sweep_deg > 0.0 for piece in pieces if isinstance(piece, Arc))
    cross = [piece for piece in pieces if isinstance(piece, Leg)][1]
    assert cross.length == pytest.approx(3000.0 - 2.0 * lead(120.0, **LEM), abs=0.01)
    along, across, turned = seen(CENTRE, cross.pose(0.5 * cross.length))
    assert hypot(along, across) == pytest.approx(3000.0 * np.sqrt(0.75), abs=0.01)
    assert turned == pytest.approx(120.0, abs=1e-4)


def test_sectors_too_small_for_their_turns():
    with pytest.raises(InputError, match=r"^sector_m = 1300: allowed: at least 1336, for two turns of radius 350$"):
        sector_search(CENTRE, 0.0, reach=1300.0, **LEM)
    smallest = sector_search(CENTRE, 0.0, reach=1336.0, **LEM)
    assert min(leg.length for leg in legs_of(smallest, 30)) > 0.0


@pytest.mark.parametrize("centre", [CENTRE, FAR_NORTH])
@pytest.mark.parametrize(("right", "side"), [(True, 1.0), (False, -1.0)])
def test_race_track_is_closed_and_around_its_centre(right, side, centre):
    pattern = race_track(centre, 35.0, leg=1500.0, right=right, **LEM)
    assert seen(centre, pattern.entry) == pytest.approx((-750.0, -350.0 * side, 0.0), abs=1e-6)
    pieces = list(islice(pattern.pieces, 20 * 8))
    end = end_of(pieces, pattern.entry)
    assert plane_shape(pattern.entry, end) == pytest.approx((0.0, 0.0, 0.0), abs=1e-7)
    there, back = pieces[0], pieces[4]
    assert there.length == 1500.0 and back.length == pytest.approx(1500.0, abs=1e-3)
    along, across, turned = seen(centre, back.pose(750.0))
    assert (along, across, abs(turned)) == pytest.approx((0.0, 350.0 * side, 180.0), abs=1e-4)
    assert side * pieces[2].sweep_deg > 0.0 and 345.0 < pieces[2].radius < 350.0


@pytest.mark.parametrize("bearing", [0.0, 135.0, -60.0])
@pytest.mark.parametrize(("right", "side"), [(True, 1.0), (False, -1.0)])
def test_circle_keeps_its_radius(right, side, bearing):
    pattern = circle(FAR_NORTH, bearing, right=right, **LEM)
    assert seen(FAR_NORTH, Pose(pattern.entry.point, 0.0), bearing)[1] == pytest.approx(0.0, abs=1e-6)
    spiral, orbit = islice(pattern.pieces, 2)
    for d in np.linspace(0.0, orbit.length, 7):
        assert distance(FAR_NORTH, orbit.position(d)) == pytest.approx(350.0, abs=1e-6)
    assert all(distance(FAR_NORTH, spiral.position(d)) > 350.0 for d in (0.0, 50.0, 110.0))
    along, across, _ = plane_shape(orbit.pose(100.0), Pose(FAR_NORTH, 0.0))
    assert (along, side * across) == pytest.approx((0.0, 350.0), abs=1e-6)


def test_corners_are_all_there():
    assert set(CORNERS) == {Corner(a, b) for a in (1, -1) for b in (1, -1)}
    for corner in CORNERS:
        first = legs_of(creeping(corner=corner), 2)
        inward = plane_pose(first[0].pose(0.0), 2000.0, across=0.0).point
        assert distance(first[1].position(2000.0), CENTRE) < distance(inward, CENTRE) - 399.0
