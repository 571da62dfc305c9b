"""The flight path: what a mission is over time, consistent with itself and with its units."""

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.mission.flight_path import FLAGS, SERIES, flight_path, flight_path_at, ground_distances
from vrsopt.mission.motion import PathMotion
from vrsopt.mission.profile import Profile
from vrsopt.mission.route import Arc, Leg, Point, Stay
from vrsopt.mission.segment import Segment
from vrsopt.mission.wind import CALM, Wind

RADIUS, SPEED = 300.0, 40.0
START = Point(50.0, 8.0)


def moving(path, duration, climb=0.0, altitude=200.0):
    from numpy.polynomial import Chebyshev, Polynomial

    window = [0.0, duration]
    distance, height = Polynomial([0.0, path.length / duration]), Polynomial([altitude, climb])
    pieces = [one.convert(kind=Chebyshev, domain=window) for one in (distance, height)]
    return PathMotion(path, *pieces)


def flown(wind=CALM):
    """On the ground, 2 km to the north-east in a climb, a right half circle, 400 m back."""
    leg = Leg(START, 45.0, 2000.0)
    turn = Arc.from_pose(leg.pose(2000.0), RADIUS, sweep_deg=180.0)
    back = Leg(*turn.pose(turn.length), 400.0)
    pieces = [
        ("idle", Stay(START), 20.0, 0.0, 200.0, 200.0),
        ("climb", leg, 2000.0 / SPEED, 2.0, 200.0, None),
        ("loiter", turn, turn.length / SPEED, 0.0, 300.0, None),
        ("cruise", back, 400.0 / SPEED, 0.0, 300.0, None),
    ]
    segments, time = [], 0.0
    for kind, path, duration, climb, altitude, ground in pieces:
        segments.append(
            Segment(f"{kind} it", kind, time, duration, 0.0, moving(path, duration, climb, altitude), ground)
        )
        time += duration
    return Profile(tuple(segments), 0.0, wind)


def test_it_has_every_series_with_its_unit():
    path = flight_path(flown(), 2.0)
    assert set(path.data_vars) == {*SERIES, *FLAGS, "task", "kind"} and set(path.coords) == {"time", "segment"}
    assert all(path[name].attrs["units"] == units for name, (units, _) in SERIES.items())
    assert all("long_name" in path[name].attrs for name in path.variables)
    assert np.diff(path["time"]).max() <= 2.0 + 1e-9
    np.testing.assert_array_equal(
        np.flatnonzero(np.diff(path["time"]) == 0.0) + 1, np.flatnonzero(np.diff(path["segment"])) + 1
    )
    assert list(dict.fromkeys(path["kind"].values.tolist())) == ["idle", "climb", "loiter", "cruise"]
    assert path["task"].values[-1] == "cruise it"
    inside = path["segment"].values == 0
    assert path["idle"].values[inside].all() and not path["idle"].values[~inside].any()
    assert not path["ground_idle"].values.any()


def test_positions_speeds_and_angles_are_those_of_the_profile():
    profile = flown()
    path = flight_path(profile, 1.0)
    nodes = profile.conditions(path["segment"].values, path["time"].values)
    latitude, longitude = profile.positions(path["segment"].values, path["time"].values)
    np.testing.assert_allclose(path["latitude_deg"], latitude, rtol=0, atol=1e-12)
    np.testing.assert_allclose(path["longitude_deg"], longitude, rtol=0, atol=1e-12)
    for name in ("speed", "altitude", "climb_angle", "equivalent_climb_angle", "load_factor", "turn_load_factor"):
        np.testing.assert_array_equal(path[name], getattr(nodes, name))
    assert path["height"].values[0] == 0.0 and np.isinf(path["height"].values[-1])
    assert path["distance"].values[-1] == pytest.approx(2400.0 + np.pi * RADIUS)
    np.testing.assert_allclose(ground_distances(profile), [0.0, 2000.0, np.pi * RADIUS, 400.0])


def test_a_turn_has_its_bank_and_its_rate():
    path = flight_path(flown(), 1.0)
    turning = path["segment"].values == 2
    np.testing.assert_allclose(path["bank"].values[turning], np.arctan(SPEED**2 / (9.80665 * RADIUS)))
    np.testing.assert_allclose(path["turn_rate"].values[turning], SPEED / RADIUS)
    assert not path["bank"].values[~turning].any() and not path["turn_rate"].values[~turning].any()
    course = np.unwrap(path["course"].values[turning])
    assert course[-1] - course[0] == pytest.approx(np.pi, rel=1e-4)
    np.testing.assert_allclose(path["heading"], path["course"])


def test_in_wind_heading_and_airspeed_add_up_to_the_way_over_the_ground():
    wind = Wind.from_directions([0.0, 1000.0], [200.0, 260.0], [5.0, 20.0])
    path = flight_path(flown(wind), 1.0)
    flying = path["idle"].values == 0
    course, heading = path["course"].values[flying], path["heading"].values[flying]
    level = path["speed"].values[flying] * np.cos(path["climb_angle"].values[flying])
    east, north = wind.at(path["altitude"].values[flying])
    ground = path["ground_speed"].values[flying]
    np.testing.assert_allclose(level * np.sin(heading) + east, ground * np.sin(course), atol=1e-9)
    np.testing.assert_allclose(level * np.cos(heading) + north, ground * np.cos(course), atol=1e-9)
    np.testing.assert_allclose(
        np.hypot(path["wind_along"].values[flying], path["wind_across"].values[flying]), np.hypot(east, north)
    )
    # the rate of turn is that of the heading
    turning = path["segment"].values[flying] == 2
    time, turned = path["time"].values[flying][turning], np.unwrap(heading[turning])
    rate = path["turn_rate"].values[flying][turning]
    np.testing.assert_allclose(np.gradient(turned, time)[2:-2], rate[2:-2], rtol=2e-3)
    np.testing.assert_allclose(path["speed"].values[~flying], 0.0)


def test_pairs_out_of_order_are_refused():
    profile = flown()
    for segment, time in (([1, 0], [30.0, 5.0]), ([0, 0], [5.0, 4.0])):
        with pytest.raises(InputError, match="in the order of segments and time"):
            flight_path_at(profile, segment, time)
    with pytest.raises(InputError, match="max_step"):
        flight_path(profile, 0.0)
