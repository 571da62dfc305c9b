"""The flight path as GeoJSON (RFC 7946): tasks as lines, points with what is flown there, places.

Every feature has the property ``feature``: "task", "point" or "place". Numbers have their unit in the name; those of a
schedule begin with its name, as ``trajectory_rotor_speed_percent``, so that map programs see plain columns.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from vrsopt.mission.flight_path import flight_path
from vrsopt.report.json_value import json_value
from vrsopt.report.path_points import (
    ALTITUDE_NOTE,
    Line,
    coordinates,
    cut_at_antimeridian,
    point_columns,
    point_nodes,
    points,
    task_fuel,
    task_lines,
)

if TYPE_CHECKING:
    from vrsopt.schedule.comparison import Comparison

LINE_STEP = 1.0  # s
ANGLE_DIGITS, METRE_DIGITS, DIGITS = 9, 3, 4  # decimals: 0.1 mm in a coordinate, of altitudes, of everything else


def flight_path_geojson(comparison: Comparison) -> dict[str, Any]:
    """The feature collection of ``comparison`` (without its variants), ready for JSON."""
    return {
        "type": "FeatureCollection",
        "name": comparison.mission.name,
        "description": f"{ALTITUDE_NOTE} Times are in s from the start of the mission.",
        "features": [*_tasks(comparison), *_points(comparison), *_places(comparison)],
    }


def _tasks(comparison: Comparison) -> Iterable[dict[str, Any]]:
    path = flight_path(comparison.profile, LINE_STEP)
    segment, distance = path["segment"].to_numpy(), path["distance"].to_numpy()
    for line in task_lines(comparison.profile, path):
        span = line.span
        own = distance[(segment >= span.segments.start) & (segment < span.segments.stop)]
        yield _feature(
            _geometry(line),
            {
                "feature": "task",
                "task": span.task,
                "kind": span.kind,
                "start_s": _rounded(span.start),
                "end_s": _rounded(span.end),
                "distance_m": _rounded(own[-1] - own[0]),
                **{f"{name}_fuel_kg": _rounded(fuel) for name, fuel in task_fuel(comparison, span).items()},
            },
        )


def _geometry(line: Line) -> dict[str, Any]:
    """A line, in parts where it crosses the antimeridian; a task that stands still is a point."""
    if len(line.coordinates) == 1:
        return _point(line.coordinates[0])
    parts = [[_position(point) for point in part] for part in cut_at_antimeridian(line.coordinates)]
    if len(parts) == 1:
        return {"type": "LineString", "coordinates": parts[0]}
    return {"type": "MultiLineString", "coordinates": parts}


def _points(comparison: Comparison) -> Iterable[dict[str, Any]]:
    nodes = point_nodes(comparison)
    path = points(comparison, nodes)
    columns = point_columns(comparison, path, nodes)
    where, time = coordinates(path), path["time"].to_numpy()
    for index, (task, kind) in enumerate(zip(path["task"].to_numpy(), path["kind"].to_numpy(), strict=True)):
        numbers = {name: _rounded(values[index]) for name, values in columns.items()}
        told = {"feature": "point", "task": str(task), "kind": str(kind), "time_s": _rounded(time[index])}
        yield _feature(_point(where[index]), told | numbers)


def _places(comparison: Comparison) -> Iterable[dict[str, Any]]:
    for name, place in comparison.mission.places.items():
        where = np.array([place.longitude_deg, place.latitude_deg, place.elevation_m])
        yield _feature(_point(where), {"feature": "place", "name": name, "elevation_m": _rounded(place.elevation_m)})


def _feature(geometry: dict[str, Any], properties: dict[str, Any]) -> dict[str, Any]:
    return {"type": "Feature", "geometry": geometry, "properties": json_value(properties)}


def _point(where: np.ndarray) -> dict[str, Any]:
    return {"type": "Point", "coordinates": _position(where)}


def _position(where: np.ndarray) -> list[float]:
    longitude, latitude, altitude = map(float, where)
    return [round(longitude, ANGLE_DIGITS), round(latitude, ANGLE_DIGITS), round(altitude, METRE_DIGITS)]


def _rounded(value: float) -> float:
    return round(float(value), DIGITS) + 0.0  # no -0.0
