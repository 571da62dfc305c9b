"""The smooth curve of a cleaned track: twice smoothed, the second time with its stops held still."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from vrsopt.errors import InputError
from vrsopt.mission.route import Point
from vrsopt.mission.track_clean import Fixes
from vrsopt.mission.track_data import Track
from vrsopt.mission.track_motion import Plane, SmoothTrack
from vrsopt.mission.track_smooth import Hold, SmoothingSpline, scatter, time_weights
from vrsopt.mission.track_stops import Stop, stops

Array = NDArray[Any]
# s, periods of the filters. On records of surveillance and search flights with 1.5 m of white and 4 m of slowly varying
# noise in position, 2 and 6 m in altitude, these have the least error in speed; half is right without noise.
HORIZONTAL_PERIOD, VERTICAL_PERIOD = 12.0, 25.0
QUIET = 0.3  # m, scatter about the curve below which half of the periods is taken
STEPS_PER_PERIOD = 2.5  # a filter's period is at least that many times between fixes
MANOEUVRE, VERTICAL_MANOEUVRE = 6.0, 2.0  # m/s2, what smoothing may hide without making outliers of it
SPARSE, SPARSEST = 10.0, 60.0  # s between fixes: said, refused
DEEPEST = -50.0  # m, altitudes down to here count as noise about zero
FURTHEST = 1000e3  # m, from the middle of a track


@dataclass(frozen=True)
class Smoothing:
    """What is smoothed, and how: fixes at ``time`` (N,) [s] in the plane, filters, and the stops to hold still."""

    plane: Plane
    time: Array
    place: Array  # (N, 2) m
    altitude: Array  # (N,) m, nan where unknown
    usable: Array  # (N,) bool, of the positions
    across: SmoothingSpline
    along: SmoothingSpline
    stops: tuple[Stop, ...]
    floor: float

    def curve(self, trust: Array) -> SmoothTrack:
        """The curve with the weight of each fix multiplied by ``trust`` (N,)."""
        known = np.isfinite(self.altitude)
        horizontal, vertical = (
            filter_.fit(
                self.time[some], values[some], time_weights(self.time[some], filter_.period) * trust[some], holds
            )
            for filter_, some, values, holds in (
                (self.across, self.usable, self.place, _held_places(self.stops)),
                (self.along, known, self.altitude[:, None], _held_altitudes(self.stops)),
            )
        )
        return SmoothTrack(self.plane, horizontal, vertical, float(self.time[-1]), self.floor)


def smoothed(track: Track, fixes: Fixes, notes: list[str], *, assumed_hover: float) -> Smoothing:
    """How the track is smoothed; what was found out goes to ``notes``.

    ``assumed_hover``: height [m] of hovers where the track does not tell. Raises :class:`InputError` for fixes too far
    apart in time, or in place.
    """
    time, duration = fixes.time, float(fixes.time[-1])
    step = float(np.median(np.diff(time)))
    if step > SPARSEST:
        raise InputError(f"{track.name}: time: {step:.0f} s between fixes: allowed: at most {SPARSEST:g} s")
    plane = Plane(_middle(fixes))
    place = plane.project(fixes.latitude_deg, fixes.longitude_deg)
    if np.max(np.linalg.norm(place, axis=1)) > FURTHEST:
        raise InputError(f"{track.name}: positions more than {2e-3 * FURTHEST:g} km apart: allowed: less")
    known = np.isfinite(fixes.altitude)
    altitude = fixes.altitude[known, None]
    across, horizontal, off = _fitted(time, place, duration, HORIZONTAL_PERIOD, MANOEUVRE)
    along, vertical, wrong = _fitted(time[known], altitude, duration, VERTICAL_PERIOD, VERTICAL_MANOEUVRE)
    notes.append(
        f"smoothed with splines of degree 5 that halve oscillations of {across.period:.3g} s in position and "
        f"{along.period:.3g} s in altitude; fixes {step:.3g} s apart"
    )
    if step > SPARSE:
        notes.append(f"turns and changes of speed shorter than {across.period:.0f} s are not seen: too few fixes")
    _say_outliers(notes, time[off], "positions")
    _say_outliers(notes, time[known][wrong], "altitudes")
    lowest, floor = float(vertical(np.linspace(0.0, duration, int(duration) + 2)).min()), -np.inf
    if DEEPEST <= lowest < 0.0:
        floor = 0.0
        notes.append(f"altitudes down to {lowest:.1f} m: those below 0 m are taken as 0 m")
    trusted = np.full(len(time), np.nan)
    trusted[known] = np.where(wrong, np.nan, np.maximum(altitude[:, 0], floor))
    first = SmoothTrack(plane, horizontal, vertical, duration, floor)
    found = stops(first, replace(fixes, altitude=trusted), assumed_hover=assumed_hover)
    return Smoothing(plane, time, place, trusted, ~off, across, along, tuple(found), floor)


def _fitted(
    time: Array, values: Array, duration: float, period: float, manoeuvre: float
) -> tuple[SmoothingSpline, BSpline, Array]:
    """The filter, the curve and which fixes it leaves out; the filter is as sharp as the noise allows."""
    slowest = STEPS_PER_PERIOD * float(np.median(np.diff(time)))
    for share in (0.5, 1.0):
        filter_ = SmoothingSpline(max(share * period, slowest), duration)
        curve, outlier = filter_.robust(time, values, manoeuvre)
        distance = np.linalg.norm(curve(time[~outlier]) - values[~outlier], axis=1)
        if scatter(distance, values.shape[1]) < QUIET:
            break
    return filter_, curve, outlier


def _middle(fixes: Fixes) -> Point:
    """The middle of the track, of points on a sphere: it may cross the date line."""
    latitude, longitude = np.radians(fixes.latitude_deg), np.radians(fixes.longitude_deg)
    x, y = np.mean(np.cos(latitude) * np.cos(longitude)), np.mean(np.cos(latitude) * np.sin(longitude))
    north = np.degrees(np.arctan2(np.mean(np.sin(latitude)), np.hypot(x, y)))
    return Point(float(north), float(np.degrees(np.arctan2(y, x))))


def _held_places(found: Sequence[Stop]) -> list[Hold]:
    """Stops one after the other over one place, with a vertical climb between, are one hold."""
    holds: list[Hold] = []
    for stop in found:
        if holds and np.array_equal(holds[-1].value, stop.place):
            holds[-1] = Hold(holds[-1].start, stop.end, stop.place)
        else:
            holds.append(Hold(stop.start, stop.end, stop.place))
    return holds


def _held_altitudes(found: Sequence[Stop]) -> list[Hold]:
    """The altitude with which each stop begins and that with which it ends; what is on the ground between stands."""
    holds = []
    for stop in found:
        middle = 0.5 * (stop.start + stop.end)
        holds.append(Hold(stop.start, middle, np.array([stop.rests[0].altitude])))
        holds.append(Hold(middle, stop.end, np.array([stop.rests[-1].altitude])))
    return holds


def _say_outliers(notes: list[str], times: Array, what: str) -> None:
    if len(times):
        notes.append(f"{len(times)} {what} left out, the first at {times[0]:.0f} s: far off the smoothed track")
