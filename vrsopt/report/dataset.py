"""A comparison as a data set: every time series with its units, and what is needed to repeat it."""

from __future__ import annotations

import hashlib
import io
import math
import platform
import struct
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vrsopt import __version__
from vrsopt.errors import InputError
from vrsopt.mission.flight_path import FLAGS, SERIES, flight_path_at, ground_distances
from vrsopt.report.emission_dataset import emission_variables
from vrsopt.report.saving_dataset import saving_variables

if TYPE_CHECKING:
    import xarray as xr

    from vrsopt.schedule.comparison import Comparison

FORMAT, FORMAT_VERSION = "vrsopt result", "2"
DIMENSIONS = {"schedule", "limit", "node", "physics_node", "band_node", "segment"}
RENAMED = {"variables": "free_variables"}  # scipy's NetCDF files have an attribute "variables" of their own
# What xarray and scipy raise on bytes that are no such file, or on one that was cut or damaged.
UNREADABLE = (ValueError, TypeError, KeyError, IndexError, AttributeError, EOFError, OverflowError, struct.error)

Variables = dict[str, tuple[Any, Any, dict[str, str]]]


def result_dataset(comparison: Comparison, *, mission_text: str) -> xr.Dataset:
    """``comparison`` (without its variants) and the text of its mission file.

    Dimensions: ``schedule``; ``limit``; ``node``, the fine grid on which schedules are flown on the surrogate;
    ``physics_node``, that on which they are flown on the physics; ``band_node``, the decision nodes in flight;
    ``segment``; ``phase``; ``end``, the least and the largest of a range; ``part`` of the power; ``cause`` of a saving.
    Both ends of every segment are nodes, so times at edges occur twice. Units are in the attributes,
    and so is ``mission_text``.
    """
    import xarray as xr

    results = comparison.results
    first = next(iter(results.values()))
    variables = (
        _profile(comparison) | _schedules(comparison) | _physics(comparison) | _band(comparison) | _segments(comparison)
    ) | emission_variables(comparison)
    variables |= saving_variables(comparison)
    variables |= {
        "schedule": ("schedule", np.array(list(results)), {"long_name": "name of the schedule"}),
        "limit": ("limit", np.array(list(first.flight.time_on_limits)), {"long_name": "name of the limit"}),
    }
    return xr.Dataset(variables, attrs=_attributes(comparison, mission_text)).set_coords(
        ["time", "physics_time", "band_time"]
    )


def netcdf(dataset: xr.Dataset) -> bytes:
    """The data set as a NetCDF file (classic format, 64-bit offsets): numbers and text, nothing that can be run."""
    return bytes(dataset.to_netcdf(None, engine="scipy", format="NETCDF3_64BIT"))


def read_result(path: Path | str) -> xr.Dataset:
    """The data set of a ``result.nc``, loaded whole; see :func:`result_dataset`.

    Raises :class:`InputError` for a file that is missing, foreign, damaged or of another format version.
    """
    import xarray as xr

    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: can not be read: {error.strerror}") from None
    try:
        with xr.open_dataset(io.BytesIO(content), engine="scipy", decode_times=False) as lazy:
            dataset = lazy.load()
    except UNREADABLE:
        raise InputError(f"{path}: not a result: no readable NetCDF file") from None
    if dataset.attrs.get("format") != FORMAT:
        raise InputError(f"{path}: not a result: no attribute format = {FORMAT!r}")
    if dataset.attrs.get("format_version") != FORMAT_VERSION:
        found = dataset.attrs.get("format_version")
        raise InputError(f"{path}: format_version = {found!r}: this version reads {FORMAT_VERSION!r}")
    missing = DIMENSIONS - set(map(str, dataset.dims))
    if missing:
        raise InputError(f"{path}: not a complete result: dimension {sorted(missing)[0]} is missing")
    return dataset


def _attributes(comparison: Comparison, mission_text: str) -> dict[str, Any]:
    loading, trajectory = comparison.loading, comparison.trajectory
    attributes: dict[str, Any] = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "mission": comparison.mission.name,
        "mission_text": mission_text,
        "mission_sha256": hashlib.sha256(mission_text.encode()).hexdigest(),
        **{RENAMED.get(name, name): str(value) for name, value in comparison.provenance.items()},
        "vrsopt_version": __version__,
        "python_version": platform.python_version(),
        **{f"{name}_version": version(name) for name in ("casadi", "numpy", "scipy", "pymoo")},
        "takeoff_mass_kg": loading.takeoff_mass,
        "fuel_loaded_kg": loading.fuel_loaded,
        "reserve_fuel_kg": loading.reserve_fuel,
        "duration_s": comparison.profile.duration,
        "isa_offset_k": comparison.profile.isa_offset,
        **{f"wind_{name}": values for name, values in comparison.profile.wind.as_dict().items()},
        "nominal_rotor_speed_rad_s": comparison.settings.nominal_rotor_speed,
        "nominal_twist_deg": math.degrees(comparison.settings.nominal_twist),
    }
    if trajectory is not None:
        attributes["trajectory_residual_norm"] = trajectory.max_residual
        attributes["trajectory_iterations"] = float(trajectory.iterations)
    return attributes


def _profile(comparison: Comparison) -> Variables:
    """The mission on the fine grid; tasks and kinds are with the segments."""
    flight = next(iter(comparison.results.values())).flight
    path = flight_path_at(comparison.profile, flight.segment, flight.time)
    variables: Variables = {
        "time": ("node", flight.time, _attrs("s", "time from the start of the mission")),
        "segment_index": ("node", flight.segment.astype("i4"), _attrs("1", "index of the segment")),
    }
    for name in (*SERIES, *FLAGS):
        variables[name] = ("node", path[name].to_numpy(), dict(path[name].attrs))
    return variables


def _schedules(comparison: Comparison) -> Variables:
    """The schedules flown on the surrogate, and their totals."""
    results = list(comparison.results.values())
    flights = [result.flight for result in results]
    each, usage = ("schedule", "node"), ("schedule", "limit", "node")
    percent = 100 / comparison.settings.nominal_rotor_speed
    limits = np.array([flight.limits for flight in flights])
    shares = np.array([list(flight.time_on_limits.values()) for flight in flights])
    return {
        "mass": (each, np.array([flight.mass for flight in flights]), _attrs("kg", "gross mass")),
        "rotor_speed_percent": (
            each,
            percent * np.array([flight.rotor_speed for flight in flights]),
            _attrs("%", "rotor speed over nominal"),
        ),
        "twist_deg": (
            each,
            np.degrees([flight.twist for flight in flights]),
            _attrs("deg", "blade twist, washout positive"),
        ),
        "fuel_flow": (
            each,
            np.array([flight.fuel_flow for flight in flights]),
            _attrs("kg/s", "fuel flow of both engines"),
        ),
        "power_per_engine": (
            each,
            np.array([flight.power_per_engine for flight in flights]),
            _attrs("W", "shaft power of one engine"),
        ),
        "limit_usage": (
            usage,
            np.where(np.isfinite(limits), 1.0 + limits, np.nan),
            _attrs("1", "value over allowed value; not a number in idle"),
        ),
        "time_on_limits": (("schedule", "limit"), shares, _attrs("1", "share of the time on the limit")),
        "fuel": ("schedule", np.array([flight.fuel for flight in flights]), _attrs("kg", "fuel burned")),
        "quadrature_error": (
            "schedule",
            np.array([flight.quadrature_error for flight in flights]),
            _attrs("kg", "error of the fuel burned"),
        ),
        "success": (
            "schedule",
            np.array([result.success for result in results], dtype="i1"),
            _attrs("1", "1 if flyable"),
        ),
        "message": (
            "schedule",
            np.array([result.message for result in results]),
            {"long_name": "what there is to say"},
        ),
    }


def _physics(comparison: Comparison) -> Variables:
    """The schedules flown on the physics, and their totals."""
    flights = [result.physics for result in comparison.results.values()]
    each, usage = ("schedule", "physics_node"), ("schedule", "limit", "physics_node")
    return {
        "physics_time": ("physics_node", flights[0].time, _attrs("s", "time from the start of the mission")),
        "physics_segment_index": ("physics_node", flights[0].segment.astype("i4"), _attrs("1", "index of the segment")),
        "physics_mass": (each, np.array([flight.mass for flight in flights]), _attrs("kg", "gross mass")),
        "physics_fuel_flow": (
            each,
            np.array([flight.fuel_flow for flight in flights]),
            _attrs("kg/s", "fuel flow of both engines"),
        ),
        "physics_limit_usage": (
            usage,
            np.array([flight.usages for flight in flights]),
            _attrs("1", "value over allowed value; not a number in idle"),
        ),
        "physics_fuel": ("schedule", np.array([flight.fuel for flight in flights]), _attrs("kg", "fuel burned")),
        "physics_quadrature_error": (
            "schedule",
            np.array([flight.quadrature_error for flight in flights]),
            _attrs("kg", "error of the fuel burned"),
        ),
        "physics_residual_norm": (
            "schedule",
            np.array([flight.residual_norm for flight in flights]),
            _attrs("1", "largest scaled residual of trim and engine"),
        ),
    }


def _band(comparison: Comparison) -> Variables:
    band, percent = comparison.band, 100 / comparison.settings.nominal_rotor_speed
    what = "rotor speed within 0.5 % of the least fuel flow"
    return {
        "band_time": ("band_node", band.time, _attrs("s", "time from the start of the mission")),
        "band_segment_index": ("band_node", band.segment.astype("i4"), _attrs("1", "index of the segment")),
        "band_lower_percent": ("band_node", percent * band.lower, _attrs("%", f"lowest {what}")),
        "band_upper_percent": ("band_node", percent * band.upper, _attrs("%", f"highest {what}")),
    }


def _segments(comparison: Comparison) -> Variables:
    segments = comparison.profile.segments
    return {
        "task": ("segment", np.array([segment.task for segment in segments]), {"long_name": "task of the segment"}),
        "kind": ("segment", np.array([segment.kind for segment in segments]), {"long_name": "kind of the task"}),
        "start": ("segment", np.array([segment.start for segment in segments]), _attrs("s", "time of the start")),
        "end": ("segment", np.array([segment.end for segment in segments]), _attrs("s", "time of the end")),
        "mass_change": ("segment", comparison.profile.mass_changes, _attrs("kg", "mass added at the start")),
        "ground_distance": (
            "segment",
            ground_distances(comparison.profile),
            _attrs("m", "distance flown over the ground in the segment"),
        ),
        "segment_fuel": (
            ("schedule", "segment"),
            np.array([result.flight.fuel_per_segment for result in comparison.results.values()]),
            _attrs("kg", "fuel burned in the segment"),
        ),
    }


def _attrs(units: str, text: str) -> dict[str, str]:
    return {"units": units, "long_name": text}
