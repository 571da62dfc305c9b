from math import pi

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vrsopt.mission.pattern import creeping_line
from vrsopt.mission.route import WGS84, Arc, Leg, Point, offset
from vrsopt.mission.tasks import Search

CENTRE = Point(37.792, -122.56)


def search(**changes) -> Search:
    values = {"around": "area", "leg_m": 4000.0, "spacing_m": 400.0, "turn_radius_m": 200.0, "speed_m_s": 35.0}
    return Search(kind="search", **{**values, "duration_s": 2160.0, **changes})


def distance(a: Point, b: Point) -> float:
    return WGS84.Inverse(*a, *b)["s12"]


def tracks_of(pieces, task):
    return [piece for piece in pieces[1:] if isinstance(piece, Leg) and piece.length == task.leg_m]


@settings(deadline=None, max_examples=40, database=None)
@given(
    east=st.floats(-8000.0, 8000.0),
    north=st.floats(-8000.0, 8000.0),
    leg=st.floats(500.0, 8000.0),
    radius=st.floats(100.0, 400.0),
    straight=st.sampled_from([0.0, 150.0]),
    bearing=st.floats(0.0, 360.0),
    duration=st.floats(700.0, 6000.0),
)
def test_pattern_is_continuous_and_exactly_as_long_as_its_time(east, north, leg, radius, straight, bearing, duration):
    task = search(
        leg_m=leg,
        turn_radius_m=radius,
        spacing_m=2.0 * radius + straight,
        leg_bearing_deg=bearing,
        duration_s=duration,
    )
    position = offset(CENTRE, 0.0, along=north, across=east)
    pieces = creeping_line(position, CENTRE, task)
    assert distance(pieces[0].position(0.0), position) < 1e-3
    for before, after in zip(pieces, pieces[1:], strict=False):
        assert distance(before.position(before.length), after.position(0.0)) < 1e-3
    assert all(piece.length > 0.0 for piece in pieces[1:])
    if len(pieces) > 1:
        assert sum(piece.length for piece in pieces) == pytest.approx(35.0 * duration, abs=2e-6)


def test_half_circles_join_tracks_one_spacing_apart():
    task = search()
    pieces = creeping_line(CENTRE, CENTRE, task)
    turns = [piece for piece in pieces if isinstance(piece, Arc)]
    tracks = tracks_of(pieces, task)
    assert len(turns) >= 14 and all(turn.length == pytest.approx(pi * 200.0) for turn in turns[:-1])
    assert [turn.sweep_deg > 0.0 for turn in turns[:4]] in ([True, False] * 2, [False, True] * 2)
    for one, next_one in zip(tracks, tracks[1:], strict=False):
        assert distance(one.position(4000.0), next_one.start) == pytest.approx(400.0, abs=1e-3)
        assert distance(one.start, next_one.position(4000.0)) == pytest.approx(400.0, abs=0.05)


def test_wider_spacing_is_flown_with_a_straight_between_quarter_turns():
    task = search(spacing_m=1000.0)
    pieces = creeping_line(CENTRE, CENTRE, task)
    first_turn = pieces[2:5]
    assert [type(piece) for piece in first_turn] == [Arc, Leg, Arc]
    assert first_turn[1].length == pytest.approx(600.0)
    tracks = tracks_of(pieces, task)
    assert distance(tracks[0].position(4000.0), tracks[1].start) == pytest.approx(1000.0, abs=0.05)


@pytest.mark.parametrize("bearing", [0.0, 35.0, 200.0])
def test_pattern_is_centred(bearing):
    """With time for exactly nine tracks, the middle of the fifth is the centre."""
    middle_entry = ((4 * 400.0) ** 2 + 2000.0**2) ** 0.5
    length = middle_entry + 9 * 4000.0 + 8 * pi * 200.0
    task = search(leg_bearing_deg=bearing, duration_s=length / 35.0 - 1e-3)
    pieces = creeping_line(CENTRE, CENTRE, task)
    assert pieces[0].length == pytest.approx(middle_entry, abs=0.01)
    fifth = tracks_of(pieces, task)[4]
    assert distance(fifth.position(2000.0), CENTRE) < 2.0


def test_search_begins_at_the_nearest_corner_and_crosses_the_centre():
    task = search()
    for along, across in ((3000.0, 4000.0), (3000.0, -4000.0), (-3000.0, 4000.0), (-3000.0, -4000.0)):
        pieces = creeping_line(offset(CENTRE, 0.0, along=along, across=across), CENTRE, task)
        corner = pieces[1].position(0.0)
        assert (corner.latitude_deg > CENTRE.latitude_deg) == (along > 0.0)
        assert (corner.longitude_deg > CENTRE.longitude_deg) == (across > 0.0)
        first, second = [distance(track.position(2000.0), CENTRE) for track in tracks_of(pieces, task)[:2]]
        assert first - second == pytest.approx(400.0, abs=0.1)  # it creeps toward the centre


def test_a_pattern_out_of_reach_is_the_way_to_it_alone():
    far = offset(CENTRE, 90.0, along=100_000.0, across=0.0)
    pieces = creeping_line(far, CENTRE, search())
    assert len(pieces) == 1 and pieces[0].length > 35.0 * 2160.0
