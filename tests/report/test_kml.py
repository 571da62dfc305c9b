"""The flight path as KML: well formed, elements in the order of the schema, the numbers of profile and schedules."""

from datetime import datetime
from xml.etree import ElementTree

import numpy as np
import pytest

from vrsopt.report.kml import flight_path_kml
from vrsopt.report.style import KIND_COLOURS, task_spans

KML, GX = "{http://www.opengis.net/kml/2.2}", "{http://www.google.com/kml/ext/2.2}"
# Order of the children in the schemas of OGC 07-147r2 and of Google's extension, as far as they are used
FEATURE = ["name", "visibility", "open", "description", "styleUrl", "Style", "ExtendedData", "Schema"]
ORDER = {
    "kml": ["Document"],
    "Document": [*FEATURE, "Folder"],
    "Folder": [*FEATURE, "Placemark"],
    "Placemark": [*FEATURE, "Point", "LineString", "MultiGeometry", "gx:Track"],
    "Style": ["LineStyle"],
    "LineStyle": ["color", "width"],
    "Schema": ["gx:SimpleArrayField"],
    "gx:SimpleArrayField": ["displayName"],
    "ExtendedData": ["Data", "SchemaData"],
    "Data": ["value"],
    "SchemaData": ["gx:SimpleArrayData"],
    "gx:SimpleArrayData": ["gx:value"],
    "Point": ["altitudeMode", "coordinates"],
    "LineString": ["altitudeMode", "coordinates"],
    "MultiGeometry": ["LineString"],
    "gx:Track": ["altitudeMode", "when", "gx:coord", "ExtendedData"],
}


@pytest.fixture(scope="module")
def document(windy):
    return ElementTree.fromstring(flight_path_kml(windy)).find(f"{KML}Document")


def short(tag):
    return tag.removeprefix(KML).replace(GX, "gx:")


def folder(document, name):
    (found,) = [one for one in document.iter(f"{KML}Folder") if one.findtext(f"{KML}name").startswith(name)]
    return found.findall(f"{KML}Placemark")


def coordinates(text):
    return np.array([[float(number) for number in point.split(",")] for point in text.split()])


def test_elements_are_in_the_order_of_the_schema(windy):
    root = ElementTree.fromstring(flight_path_kml(windy))
    assert root.tag == f"{KML}kml"
    for element in root.iter():
        children = [short(child.tag) for child in element]
        places = [ORDER[short(element.tag)].index(child) for child in children] if children else []
        assert places == sorted(places), (element.tag, children)
    names = [element.get("id") for element in root.iter() if element.get("id")]
    assert len(names) == len(set(names))
    wanted = {element.text.removeprefix("#") for element in root.iter(f"{KML}styleUrl")}
    assert wanted <= set(names)
    assert all(one.get("schemaUrl").removeprefix("#") in names for one in root.iter(f"{KML}SchemaData"))


def test_places_and_tasks_are_those_of_the_mission(document, windy):
    places = {
        one.findtext(f"{KML}name"): one.findtext(f"{KML}Point/{KML}coordinates") for one in folder(document, "places")
    }
    assert {name: coordinates(text)[0].tolist() for name, text in places.items()} == {
        "base": [-122.4, 37.6, 0.0],
        "quay": [-122.4, 37.66, 0.0],
    }
    tasks, spans = folder(document, "tasks"), task_spans(windy.profile)
    assert [one.findtext(f"{KML}name") for one in tasks] == [span.task for span in spans]
    for task, span in zip(tasks, spans, strict=True):
        style = document.find(f"{KML}Style[@id='{span.kind}']")
        colour = style.findtext(f"{KML}LineStyle/{KML}color")
        assert f"#{colour[6:8]}{colour[4:6]}{colour[2:4]}" == KIND_COLOURS[span.kind].lower() and colour[:2] == "ff"
        data = {one.get("name"): one.findtext(f"{KML}value") for one in task.iter(f"{KML}Data")}
        assert float(data["start_s"]) == pytest.approx(span.start, abs=1e-4) and data["kind"] == span.kind
        where = coordinates(next(task.iter(f"{KML}coordinates")).text)
        first = span.segments.start
        latitude, longitude = windy.profile.positions(first, span.start)
        np.testing.assert_allclose(where[0, :2], [longitude, latitude], rtol=0, atol=1e-9)


def test_the_track_has_a_time_a_position_and_every_number_at_each_point(document, windy):
    (mark,) = folder(document, "points")
    track = mark.find(f"{GX}Track")
    times = [datetime.fromisoformat(one.text) for one in track.findall(f"{KML}when")]
    seconds = np.array([(time - times[0]).total_seconds() for time in times])
    where = np.array([[float(number) for number in one.text.split()] for one in track.findall(f"{GX}coord")])
    arrays = {
        one.get("name"): np.array([float(value.text) for value in one]) for one in track.iter(f"{GX}SimpleArrayData")
    }
    declared = {one.get("name") for one in document.iter(f"{GX}SimpleArrayField")}
    assert set(arrays) == declared and {len(values) for values in arrays.values()} == {len(times)} == {len(where)}
    assert seconds[-1] == pytest.approx(windy.profile.duration, abs=1e-3) and np.all(np.diff(seconds) >= 0.0)
    flight = windy.results["trajectory"].flight
    flying = (seconds > 120.0) & (seconds < 200.0)
    assert flying.sum() > 7
    interpolated = np.interp(seconds, flight.time, 100 * flight.rotor_speed / 44.4)
    np.testing.assert_allclose(arrays["trajectory_rotor_speed_percent"][flying], interpolated[flying], atol=1e-3)
    segment = np.clip(
        np.searchsorted(windy.profile.edges, seconds, side="right") - 1, 0, len(windy.profile.segments) - 1
    )
    time = np.clip(seconds, windy.profile.edges[segment], windy.profile.edges[segment + 1])
    latitude, longitude = windy.profile.positions(segment, time)
    np.testing.assert_allclose(where[:, 1], latitude, rtol=0, atol=1e-6)  # a millisecond at 48 m/s is 5e-7 deg
    np.testing.assert_allclose(where[:, 0], longitude, rtol=0, atol=1e-6)
    assert np.isnan(arrays["nominal_blade_loading_percent"][seconds < 35.0]).all()


def test_rotor_speed_is_drawn_in_classes_along_the_whole_way(document, windy):
    marks = folder(document, "rotor speed, trajectory")
    assert len(marks) > 3
    ends = [coordinates(one.findtext(f"{KML}LineString/{KML}coordinates")) for one in marks]
    for one, other in zip(ends, ends[1:], strict=False):
        np.testing.assert_array_equal(one[-1], other[0])
    flight = windy.results["trajectory"].flight
    for mark, where in zip(marks, ends, strict=True):
        low, high = (float(part) for part in mark.findtext(f"{KML}name").removesuffix(" %").split(" to "))
        latitude, _ = windy.profile.positions(flight.segment, flight.time)
        altitude = windy.profile.conditions(flight.segment, flight.time).altitude
        node = int(np.argmin(np.abs(latitude - where[0, 1]) + 1e-4 * np.abs(altitude - where[0, 2])))
        ratio = 100 * flight.rotor_speed[node] / 44.4
        assert low - 1.1 <= ratio <= high + 1.1


def test_names_that_xml_can_not_hold_are_written_without_what_it_can_not_hold(windy):
    from dataclasses import replace
    from types import SimpleNamespace

    mission = SimpleNamespace(name="a <b> & \x07 \x00 ü 🚁", places=windy.mission.places)
    root = ElementTree.fromstring(flight_path_kml(replace(windy, mission=mission)))
    assert root.findtext(f"{KML}Document/{KML}name") == "a <b> &     ü 🚁"


def test_it_is_the_same_every_time_and_registers_nothing(windy):
    before = dict(ElementTree._namespace_map)
    assert flight_path_kml(windy) == flight_path_kml(windy)
    assert dict(ElementTree._namespace_map) == before
