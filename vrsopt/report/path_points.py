"""Points and lines of the flight path with what is flown there: what the map files, GeoJSON and KML, have in common."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.mission.flight_path import flight_path_at
from vrsopt.report.style import TaskSpan, task_spans
from vrsopt.schedule.quadrature import thinned

if TYPE_CHECKING:
    import xarray as xr

    from vrsopt.mission.profile import Profile
    from vrsopt.schedule.comparison import Comparison, ScheduleResult

STEP = 10  # s, between points; they are some of the nodes a second apart on which schedules are flown
ALTITUDE_NOTE = "Altitude is pressure altitude in m, taken as height above mean sea level."
# name of a column: variable of the flight path, factor, what it is
COLUMNS: dict[str, tuple[str, float, str]] = {
    "altitude_m": ("altitude", 1.0, "pressure altitude, m"),
    "height_m": ("height", 1.0, "height of the skids above the ground where it matters, m"),
    "speed_m_s": ("speed", 1.0, "true airspeed, m/s"),
    "ground_speed_m_s": ("ground_speed", 1.0, "ground speed, m/s"),
    "course_deg": ("course", 180.0 / np.pi, "course over the ground, deg"),
    "climb_angle_deg": ("climb_angle", 180.0 / np.pi, "flight-path angle, deg"),
    "bank_deg": ("bank", 180.0 / np.pi, "bank to the right, deg"),
    "load_factor": ("load_factor", 1.0, "load factor"),
}
FLOWN = {
    "rotor_speed_percent": "rotor speed, % of nominal",
    "twist_deg": "blade twist, deg",
    "fuel_flow_kg_h": "fuel flow, kg/h",
    "mass_kg": "gross mass, kg",
    "blade_loading_percent": "use of the blade-loading limit, %",
}


@dataclass(frozen=True)
class Line:
    """The path of one task: longitude [deg], latitude [deg] and altitude [m] (N, 3) of nodes that differ, N >= 1."""

    span: TaskSpan
    coordinates: np.ndarray


def task_lines(profile: Profile, path: xr.Dataset) -> list[Line]:
    """One line per task from a flight path on the grid of a profile; at a task that stands still it is one point."""
    where = coordinates(path)
    segment = path["segment"].to_numpy()
    lines = []
    for span in task_spans(profile):
        own = where[(segment >= span.segments.start) & (segment < span.segments.stop)]
        moved = np.append(True, np.any(np.diff(own, axis=0) != 0.0, axis=1))
        lines.append(Line(span, own[moved]))
    return lines


def coordinates(path: xr.Dataset) -> np.ndarray:
    """Longitude [deg], latitude [deg] and altitude [m] (N, 3)."""
    return np.column_stack([path[name].to_numpy() for name in ("longitude_deg", "latitude_deg", "altitude")])


def point_nodes(comparison: Comparison) -> np.ndarray:
    """Indices of the nodes of the flown schedules that become points: every 10 s, at the start of each segment, and on
    both sides of an edge between tasks."""
    flight = next(iter(comparison.results.values())).flight
    nodes = thinned(flight.segment, STEP)
    last_segments = [span.segments.stop - 1 for span in task_spans(comparison.profile)]
    ends = np.append(np.diff(flight.segment) != 0, True)[nodes]
    return nodes[~ends | np.isin(flight.segment[nodes], last_segments)]


def points(comparison: Comparison, nodes: np.ndarray) -> xr.Dataset:
    """The flight path at nodes of the flown schedules."""
    flight = next(iter(comparison.results.values())).flight
    return flight_path_at(comparison.profile, flight.segment[nodes], flight.time[nodes])


def point_columns(comparison: Comparison, path: xr.Dataset, nodes: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of numbers (N,) at the points: COLUMNS, and FLOWN for every schedule, as ``trajectory_twist_deg``.

    Not a number where there is none: heights where the ground does not matter, limits in idle. ``nodes`` (N,): indices
    of the points on the fine grid.
    """
    columns = {name: factor * path[variable].to_numpy() for name, (variable, factor, _) in COLUMNS.items()}
    for schedule, result in comparison.results.items():
        flown = _flown(result, comparison.settings.nominal_rotor_speed)
        columns |= {f"{schedule}_{name}": flown[name][nodes] for name in FLOWN}
    return {name: np.where(np.isfinite(values), values, np.nan) for name, values in columns.items()}


def _flown(result: ScheduleResult, nominal_rotor_speed: float) -> dict[str, np.ndarray]:
    """What a schedule did at all its nodes, in engineering units."""
    flight = result.flight
    return {
        "rotor_speed_percent": 100.0 * flight.rotor_speed / nominal_rotor_speed,
        "twist_deg": np.degrees(flight.twist),
        "fuel_flow_kg_h": 3600.0 * flight.fuel_flow,
        "mass_kg": flight.mass,
        "blade_loading_percent": 100.0 * (1.0 + flight.limits[list(flight.time_on_limits).index("blade loading")]),
    }


def task_fuel(comparison: Comparison, span: TaskSpan) -> dict[str, float]:
    """Fuel [kg] of every schedule in a task."""
    own = slice(span.segments.start, span.segments.stop)
    return {name: float(np.sum(result.flight.fuel_per_segment[own])) for name, result in comparison.results.items()}


def cut_at_antimeridian(line: np.ndarray) -> list[np.ndarray]:
    """The pieces (N, 3) of a line of longitude, latitude [deg] and altitude [m] on either side of 180 deg.

    A step of more than half way round the earth crosses it; there, the pieces end and begin at +-180 deg, on the
    straight line between the points (RFC 7946, section 3.1.9).
    """
    pieces, start = [], 0
    begin: list[np.ndarray] = []
    for step in map(int, np.flatnonzero(np.abs(np.diff(line[:, 0])) > 180.0)):
        before, after = line[step], line[step + 1]
        side = 180.0 if before[0] > 0.0 else -180.0
        beyond = after[0] + 2.0 * side  # longitude counted on across the antimeridian
        share = (side - before[0]) / (beyond - before[0])
        crossing = before + share * (np.array([beyond, *after[1:]]) - before)
        pieces.append(np.array([*begin, *line[start : step + 1], [side, *crossing[1:]]]))
        begin, start = [np.array([-side, *crossing[1:]])], step + 1
    return [*pieces, np.array([*begin, *line[start:]])]
