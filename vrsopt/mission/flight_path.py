"""The flight path of a mission as time series: where the aircraft is, how it moves and what it feels there."""

from __future__ import annotations

from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import trapezoid

from vrsopt.atmosphere import GRAVITY
from vrsopt.errors import InputError
from vrsopt.mission.conditions import SLOWEST, Conditions

if TYPE_CHECKING:
    import xarray as xr

    from vrsopt.mission.profile import Profile

Array = NDArray[Any]
# name: unit, what it is
SERIES: dict[str, tuple[str, str]] = {
    "latitude_deg": ("degrees_north", "latitude, WGS 84"),
    "longitude_deg": ("degrees_east", "longitude, WGS 84"),
    "altitude": ("m", "pressure altitude"),
    "height": ("m", "height of the skids above the ground; infinite where the ground does not matter"),
    "distance": ("m", "distance flown over the ground since the start of the mission"),
    "course": ("rad", "course over the ground, clockwise from true north"),
    "heading": (
        "rad",
        "direction of flight through the air, clockwise from true north; the course in still air at rest",
    ),
    "ground_speed": ("m/s", "horizontal speed over the ground"),
    "speed": ("m/s", "true airspeed"),
    "climb_angle": ("rad", "flight-path angle through the air, climb positive"),
    "equivalent_climb_angle": ("rad", "flight-path angle of the steady flight with the same forces"),
    "load_factor": ("1", "specific force over gravity"),
    "turn_load_factor": ("1", "load factor of the turn alone"),
    "bank": ("rad", "bank of the turn, to the right positive"),
    "turn_rate": ("rad/s", "rate of turn of the flight through the air, to the right positive"),
    "wind_along": ("m/s", "wind along the course, tail wind positive; felt in the air only"),
    "wind_across": ("m/s", "wind across the course, to the right positive; felt in the air only"),
}
FLAGS = {
    "idle": "1 on the ground, at flat pitch or at ground idle",
    "ground_idle": "1 on the ground with the engines at ground idle",
}


def flight_path(profile: Profile, max_step: float = 1.0) -> xr.Dataset:
    """Time series of a mission on a grid of steps of at most ``max_step`` [s].

    Dimension ``node``, coordinates ``time`` [s] and ``segment`` (index). Both ends of every segment are nodes, so times
    at edges occur twice. Variables: those of ``SERIES`` with units in their attributes, ``idle`` and ``ground_idle``
    (0 or 1), and ``task`` and ``kind`` (text). SI units and radians, but for degrees in names that end in ``_deg``.

    Raises :class:`InputError` for a step that is not above zero.
    """
    nodes = profile.grid(max_step)
    return flight_path_at(profile, nodes.segment, nodes.time)


def flight_path_at(profile: Profile, segment: ArrayLike, time: ArrayLike) -> xr.Dataset:
    """As :func:`flight_path`, at pairs of segment index and time [s], each (N,), in the order of segments and time.

    The distance is that flown since the first of the pairs, by the trapezoidal rule.

    Raises :class:`InputError` for a segment that does not exist, a time outside its segment, or pairs out of order.
    """
    import xarray as xr

    nodes = profile.conditions(segment, time)
    if nodes.time.ndim != 1 or np.any(np.diff(nodes.segment) < 0) or np.any(np.diff(nodes.time) < 0.0):
        raise InputError("flight path: segment and time: allowed: one-dimensional, in the order of segments and time")
    values = _over_the_ground(profile, nodes) | _through_the_air(profile, nodes)
    course = values.pop("course_deg")
    values |= {"course": np.radians(course), "heading": _heading(nodes, values, np.radians(course))}
    variables: dict[str, Any] = {
        name: ("node", values[name], {"units": units, "long_name": text}) for name, (units, text) in SERIES.items()
    }
    for name, text in FLAGS.items():
        variables[name] = ("node", getattr(nodes, name).astype("i1"), {"units": "1", "long_name": text})
    for name in ("task", "kind"):
        texts = np.array([getattr(one, name) for one in profile.segments])[nodes.segment]
        variables[name] = ("node", texts, {"long_name": f"{name} of the segment"})
    coordinates = {
        "time": ("node", nodes.time, {"units": "s", "long_name": "time from the start of the mission"}),
        "segment": ("node", nodes.segment.astype("i4"), {"units": "1", "long_name": "index of the segment"}),
    }
    return xr.Dataset(variables, coords=coordinates)


def _over_the_ground(profile: Profile, nodes: Conditions) -> dict[str, Array]:
    """Position, course [deg], ground speed, distance and wind."""
    count = len(nodes.time)
    latitude, longitude, course, ground_speed = (np.zeros(count) for _ in range(4))
    for index in np.unique(nodes.segment):
        here, item = nodes.segment == index, profile.segments[index]
        own = np.clip(nodes.time[here] - item.start, 0.0, item.duration)
        latitude[here], longitude[here], course[here] = item.motion.track(own)
        ground_speed[here] = item.motion.kinematics(own).ground_speed
    along, across = profile.wind.along_and_across(course, nodes.altitude)
    steps = 0.5 * np.diff(nodes.time) * (ground_speed[1:] + ground_speed[:-1])
    return {
        "latitude_deg": latitude,
        "longitude_deg": longitude,
        "course_deg": course % 360.0,
        "ground_speed": ground_speed,
        "distance": np.concatenate([[0.0], np.cumsum(steps)]),
        "wind_along": along,
        "wind_across": across,
    }


def _through_the_air(profile: Profile, nodes: Conditions) -> dict[str, Array]:
    """What the conditions hold, with bank and rate of turn."""
    names = ("altitude", "height", "speed", "climb_angle", "equivalent_climb_angle", "load_factor", "turn_load_factor")
    bank = nodes.turn * np.arccos(1.0 / nodes.turn_load_factor)
    sideways = nodes.load_factor / nodes.turn_load_factor * GRAVITY * np.tan(bank)  # m/s2
    horizontal = nodes.speed * np.cos(nodes.climb_angle)
    flying = horizontal > SLOWEST
    turn_rate = np.where(flying, sideways / np.where(flying, horizontal, 1.0), 0.0)
    return {name: getattr(nodes, name) for name in names} | {"bank": bank, "turn_rate": turn_rate}


def _heading(nodes: Conditions, values: dict[str, Array], course: Array) -> Array:
    """Direction of the flight through the air [rad]: the velocity over the ground without that of the air."""
    forward, sideways = values["ground_speed"] - values["wind_along"], -values["wind_across"]
    still = (np.hypot(forward, sideways) <= SLOWEST) | nodes.idle
    return np.where(still, course, (course + np.arctan2(sideways, forward)) % (2.0 * np.pi))


def ground_distances(profile: Profile, max_step: float = 1.0) -> Array:
    """Distance flown over the ground in each segment [m], (n_segments,), by the trapezoidal rule on the grid.

    ``max_step``: of the grid [s].
    """
    distances = np.zeros(len(profile.segments))
    for index, item in enumerate(profile.segments):
        time = np.linspace(0.0, item.duration, max(2, ceil(item.duration / max_step) + 1))
        distances[index] = trapezoid(item.motion.kinematics(time).ground_speed, time)
    return distances
