"""The flight path as GeoJSON says what the profile and the flown schedules say."""

import json
import math

import numpy as np
import pytest

from tests.report.synthetic import Flight, Place, compare
from vrsopt.mission.route import Point, Pose
from vrsopt.report.files import write_results
from vrsopt.report.path_points import cut_at_antimeridian


@pytest.fixture(scope="module")
def collection(windy, mission_text, tmp_path_factory):
    folder = tmp_path_factory.mktemp("geojson")
    write_results(windy, folder, mission_text=mission_text)
    return json.loads((folder / "flight_path.geojson").read_text(encoding="utf-8"))


def of(collection, what):
    return [one for one in collection["features"] if one["properties"]["feature"] == what]


def test_it_is_a_feature_collection_of_positions_on_earth(collection, windy):
    assert collection["type"] == "FeatureCollection" and collection["name"] == "Hop <über>"
    count = sum(len(of(collection, what)) for what in ("task", "point", "place"))
    assert count == len(collection["features"]) and len(of(collection, "place")) == 2
    for feature in collection["features"]:
        assert set(feature) == {"type", "geometry", "properties"} and feature["type"] == "Feature"
        positions = np.array(feature["geometry"]["coordinates"], ndmin=2)
        depth = {"Point": 1, "LineString": 2}[feature["geometry"]["type"]]
        assert np.array(feature["geometry"]["coordinates"]).ndim == depth and positions.shape[1] == 3
        assert depth == 1 or len(positions) > 1
    place = {one["properties"]["name"]: one["geometry"] for one in of(collection, "place")}["quay"]
    assert place == {"type": "Point", "coordinates": [-122.4, 37.66, 0.0]}


def test_tasks_are_lines_on_the_profile(collection, windy):
    tasks = of(collection, "task")
    assert [one["properties"]["kind"] for one in tasks][:5] == [
        "ground_idle",
        "idle",
        "hover",
        "vertical_climb",
        "climb",
    ]
    assert tasks[0]["properties"]["start_s"] == 0.0
    assert tasks[-1]["properties"]["end_s"] == pytest.approx(windy.profile.duration, abs=1e-4)
    starts = np.array([segment.start for segment in windy.profile.segments])
    for task in tasks:
        told = task["properties"]
        first = int(np.argmin(np.abs(starts - told["start_s"])))
        begin = np.array(task["geometry"]["coordinates"], ndmin=2)[0]
        latitude, longitude = windy.profile.positions(first, starts[first])
        altitude = windy.profile.conditions(first, starts[first]).altitude
        np.testing.assert_allclose(begin[:2], [longitude, latitude], rtol=0, atol=1e-9)
        assert begin[2] == pytest.approx(float(altitude), abs=1e-3)
        assert task["geometry"]["type"] == (
            "Point" if told["distance_m"] == 0.0 and "vert" not in told["kind"] else "LineString"
        )
    circle = next(one for one in tasks if one["properties"]["kind"] == "loiter")
    assert circle["properties"]["distance_m"] == pytest.approx(2 * math.pi * 300.0, abs=1e-3)
    for name, result in windy.results.items():
        total = sum(one["properties"][f"{name}_fuel_kg"] for one in tasks)
        assert total == pytest.approx(result.flight.fuel, abs=1e-3)


def test_points_have_what_is_flown_there(collection, windy):
    points = of(collection, "point")
    times = np.array([one["properties"]["time_s"] for one in points])
    assert times[0] == 0.0 and times[-1] == pytest.approx(windy.profile.duration, abs=1e-4)
    assert np.all(np.diff(times) >= 0.0) and np.diff(times).max() <= 10.0 + 1e-3
    for edge in windy.profile.edges:
        assert np.abs(times - edge).min() < 1e-4
    nominal = windy.results["nominal"].flight
    limit = list(nominal.time_on_limits).index("blade loading")
    checked = 0
    for point in points:
        told = point["properties"]
        near = np.flatnonzero(np.abs(nominal.time - told["time_s"]) < 1e-4)
        nodes = [i for i in near if windy.profile.segments[nominal.segment[i]].task == told["task"]]
        node = nodes[-1]  # of two at an edge inside a task, the one after it
        latitude, longitude = windy.profile.positions(nominal.segment[node], nominal.time[node])
        nodes = windy.profile.conditions(nominal.segment[node], nominal.time[node])
        where = point["geometry"]["coordinates"]
        np.testing.assert_allclose(where[:2], [longitude, latitude], rtol=0, atol=1e-9)
        expected = {
            "altitude_m": nodes.altitude,
            "speed_m_s": nodes.speed,
            "load_factor": nodes.load_factor,
            "bank_deg": np.degrees(nodes.turn * np.arccos(1 / nodes.turn_load_factor)),
        }
        for name, result in windy.results.items():
            flight = result.flight
            usage = 100 * (1 + flight.limits[limit, node])
            expected |= {
                f"{name}_rotor_speed_percent": 100 * flight.rotor_speed[node] / 44.4,
                f"{name}_twist_deg": np.degrees(flight.twist[node]),
                f"{name}_fuel_flow_kg_h": 3600 * flight.fuel_flow[node],
                f"{name}_mass_kg": flight.mass[node],
                f"{name}_blade_loading_percent": usage if np.isfinite(usage) else None,
            }
        for name, value in expected.items():
            assert told[name] == (None if value is None else pytest.approx(float(value), abs=5.1e-5)), name
            checked += value is not None
        assert told["height_m"] is None or told["height_m"] == pytest.approx(float(nodes.height), abs=1e-4)
    assert checked > 10 * len(points)


def test_a_line_over_the_antimeridian_is_cut_there():
    line = np.array([[179.0, 10.0, 0.0], [179.9, 10.0, 100.0], [-179.7, 14.0, 200.0], [-179.0, 14.0, 200.0]])
    west, east = cut_at_antimeridian(line)
    np.testing.assert_allclose(west, [*line[:2], [180.0, 11.0, 125.0]])
    np.testing.assert_allclose(east, [[-180.0, 11.0, 125.0], *line[2:]])
    back = cut_at_antimeridian(np.concatenate([line, line[::-1]]))
    assert [len(piece) for piece in back] == [3, 6, 3]
    np.testing.assert_allclose(back[1][[0, -1], 0], -180.0)
    assert len(cut_at_antimeridian(line[:2])) == 1
    near_prime_meridian = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    assert len(cut_at_antimeridian(near_prime_meridian)) == 1


@pytest.mark.slow
def test_a_flight_over_the_antimeridian_is_in_parts_on_one_side_each(mission_text, tmp_path):
    flight = Flight(Pose(Point(-17.0, 179.98), 90.0), altitude=100.0, speed=50.0)
    flight.fly("cruise", 120.0, task="over the line")
    places = {"Taveuni": Place(-17.0, 179.98, 0.0)}
    there = compare(flight.profile(), "Fiji", places, schedules=["nominal"])
    write_results(there, tmp_path, mission_text=mission_text)
    collection = json.loads((tmp_path / "flight_path.geojson").read_text(encoding="utf-8"))
    (task,) = of(collection, "task")
    assert task["geometry"]["type"] == "MultiLineString"
    west, east = (np.array(part) for part in task["geometry"]["coordinates"])
    assert west[0, 0] == 179.98 and west[-1, 0] == 180.0 and np.all(np.diff(west[:, 0]) > 0)
    assert east[0, 0] == -180.0 and np.all(np.diff(east[:, 0]) > 0) and east[-1, 0] < -179.9
    np.testing.assert_array_equal(west[-1, 1:], east[0, 1:])
    page = (tmp_path / "flight_path.kml").read_text(encoding="utf-8")
    assert page.count("<MultiGeometry>") == 2  # the task, and the rotor speed
