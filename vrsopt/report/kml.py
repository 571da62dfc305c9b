"""The flight path as KML 2.2 with a time track (gx:Track): tasks, points with what is flown there, rotor speed, places.

Element names carry their prefix as written in the file: the two name spaces are declared at the root, and nothing is
registered with the XML library, which would be for the whole process.
"""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from vrsopt.mission.flight_path import flight_path
from vrsopt.report.emission_tables import foremost, label
from vrsopt.report.path_points import (
    ALTITUDE_NOTE,
    COLUMNS,
    FLOWN,
    coordinates,
    cut_at_antimeridian,
    point_columns,
    point_nodes,
    points,
    task_fuel,
    task_lines,
)
from vrsopt.report.style import KIND_COLOURS, kinds_of

if TYPE_CHECKING:
    import xarray as xr

    from vrsopt.schedule.comparison import Comparison

NAMESPACES = {"xmlns": "http://www.opengis.net/kml/2.2", "xmlns:gx": "http://www.google.com/kml/ext/2.2"}
START = datetime(2000, 1, 1, tzinfo=UTC)  # a mission has no date, a track needs one
LINE_STEP = 1.0  # s
CLASS = 2.0  # % of rotor speed with one colour, 99 to 101 % among them
WIDTH, ROTOR_WIDTH = "2", "7"  # pixels: the tasks are drawn on a ribbon in the colours of the rotor speed
NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def flight_path_kml(comparison: Comparison) -> bytes:
    """The file of ``comparison`` (without its variants)."""
    root = Element("kml", NAMESPACES)
    document = SubElement(root, "Document")
    _text(document, "name", comparison.mission.name)
    _text(document, "description", f"{ALTITUDE_NOTE} The mission has no date: its start is {_when(0.0)}.")
    path = flight_path(comparison.profile, LINE_STEP)
    name = foremost(comparison)
    speed = _rotor_speed(comparison, name, path)
    for kind in kinds_of(comparison.profile):
        _style(document, kind, KIND_COLOURS[kind], WIDTH)
    for number in np.unique(_classes(speed)):
        _style(document, _class_id(number), _class_colour(number, comparison), ROTOR_WIDTH)
    nodes = point_nodes(comparison)
    at = points(comparison, nodes)
    columns = point_columns(comparison, at, nodes)
    _schema(document, comparison, columns)
    _places(document, comparison)
    _tasks(document, comparison, path)
    _track(document, at, columns)
    _rotor_speed_lines(document, f"rotor speed, {label(name)}", coordinates(path), speed)
    ElementTree.indent(root, "")
    return bytes(ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True))


def _places(document: Element, comparison: Comparison) -> None:
    folder = _folder(document, "places")
    for name, place in comparison.mission.places.items():
        mark = SubElement(folder, "Placemark")
        _text(mark, "name", name)
        where = np.array([[place.longitude_deg, place.latitude_deg, place.elevation_m]])
        _coordinates(SubElement(mark, "Point"), where)


def _tasks(document: Element, comparison: Comparison, path: xr.Dataset) -> None:
    folder = _folder(document, "tasks")
    for line in task_lines(comparison.profile, path):
        span = line.span
        mark = SubElement(folder, "Placemark")
        _text(mark, "name", span.task)
        _text(mark, "styleUrl", f"#{span.kind}")
        data = SubElement(mark, "ExtendedData")
        known = {"kind": span.kind, "start_s": _number(span.start), "end_s": _number(span.end)}
        known |= {f"{name}_fuel_kg": _number(fuel) for name, fuel in task_fuel(comparison, span).items()}
        for name, value in known.items():
            _text(SubElement(data, "Data", name=name), "value", value)
        _geometry(mark, line.coordinates)


def _geometry(mark: Element, where: np.ndarray) -> None:
    """A line, in parts where it crosses the antimeridian; a task that stands still is a point."""
    if len(where) == 1:
        _coordinates(SubElement(mark, "Point"), where)
        return
    parts = cut_at_antimeridian(where)
    parent = mark if len(parts) == 1 else SubElement(mark, "MultiGeometry")
    for part in parts:
        _coordinates(SubElement(parent, "LineString"), part)


def _track(document: Element, path: xr.Dataset, columns: dict[str, np.ndarray]) -> None:
    """The points in time order, each with its numbers."""
    mark = SubElement(_folder(document, "points"), "Placemark")
    _text(mark, "name", "flight")
    track = SubElement(mark, "gx:Track")
    _text(track, "altitudeMode", "absolute")
    for time in path["time"].to_numpy():
        _text(track, "when", _when(float(time)))
    for where in coordinates(path):
        _text(track, "gx:coord", _position(where, " "))
    data = SubElement(SubElement(track, "ExtendedData"), "SchemaData", schemaUrl="#point")
    for name, values in columns.items():
        array = SubElement(data, "gx:SimpleArrayData", name=name)
        for value in values:
            _text(array, "gx:value", _number(value))


def _rotor_speed_lines(document: Element, name: str, where: np.ndarray, speed: np.ndarray) -> None:
    """The path in pieces of one colour each; every piece goes on to the first point of the next."""
    folder = _folder(document, name)
    classes = _classes(speed)
    starts = np.append(0, np.flatnonzero(np.diff(classes)) + 1)
    for start, end in zip(starts, np.append(starts[1:], len(classes) - 1), strict=True):
        piece = where[start : end + 1]
        if not np.ptp(piece, axis=0).any():
            continue  # stands still
        mark = SubElement(folder, "Placemark")
        middle = CLASS * classes[start]
        _text(mark, "name", f"{middle - CLASS / 2:g} to {middle + CLASS / 2:g} %")
        _text(mark, "styleUrl", f"#{_class_id(classes[start])}")
        _geometry(mark, piece)


def _rotor_speed(comparison: Comparison, name: str, path: xr.Dataset) -> np.ndarray:
    """Rotor speed of a schedule along the path [% of nominal]."""
    schedule = comparison.results[name].flight.schedule
    rotor_speed, _ = schedule.at(path["segment"].to_numpy(), path["time"].to_numpy())
    return 100.0 * rotor_speed / comparison.settings.nominal_rotor_speed


def _classes(speed: np.ndarray) -> np.ndarray:
    """Which class of one colour each rotor speed [%] belongs to."""
    return np.round(speed / CLASS).astype(int)


def _coordinates(geometry: Element, where: np.ndarray) -> None:
    _text(geometry, "altitudeMode", "absolute")
    _text(geometry, "coordinates", " ".join(_position(point, ",") for point in where))


def _position(where: np.ndarray, separator: str) -> str:
    """Longitude and latitude to 0.1 mm, altitude to 1 mm."""
    return separator.join((f"{where[0]:.9f}", f"{where[1]:.9f}", f"{where[2]:.3f}"))


def _style(document: Element, identifier: str, colour: str, width: str) -> None:
    """``colour`` as #rrggbb; KML has it the other way round, after the opacity."""
    line = SubElement(SubElement(document, "Style", id=identifier), "LineStyle")
    _text(line, "color", f"ff{colour[5:7]}{colour[3:5]}{colour[1:3]}".lower())
    _text(line, "width", width)


def _class_id(number: int) -> str:
    return f"rotor-speed-{number}"


def _class_colour(number: int, comparison: Comparison) -> str:
    """From blue at the lowest allowed rotor speed to yellow at the highest."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    low, high = (
        100.0 * bound / comparison.settings.nominal_rotor_speed for bound in comparison.settings.rotor_speed_bounds
    )
    return to_hex(colormaps["plasma"]((CLASS * number - low) / max(high - low, CLASS)))


def _schema(document: Element, comparison: Comparison, columns: dict[str, np.ndarray]) -> None:
    """What the numbers of the points are."""
    schema = SubElement(document, "Schema", name="point", id="point")
    told = {name: text for name, (_, _, text) in COLUMNS.items()}
    told |= {f"{one}_{name}": f"{label(one)}: {text}" for one in comparison.results for name, text in FLOWN.items()}
    for name in columns:
        field = SubElement(schema, "gx:SimpleArrayField", name=name, type="float")
        _text(field, "displayName", told[name])


def _folder(document: Element, name: str) -> Element:
    folder = SubElement(document, "Folder")
    _text(folder, "name", name)
    return folder


def _text(parent: Element, tag: str, text: str) -> None:
    SubElement(parent, tag).text = NOT_XML.sub(" ", text)


def _when(time: float) -> str:
    """``time`` [s] of the mission as xsd:dateTime, to a millisecond."""
    return (START + timedelta(seconds=time)).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _number(value: float) -> str:
    """To 4 decimals; "NaN", as XML schema writes it, where there is none."""
    return f"{value + 0.0:.4f}" if np.isfinite(value) else "NaN"
