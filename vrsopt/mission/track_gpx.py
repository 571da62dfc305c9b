"""Tracks in GPX files, read by gpxpy."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import pairwise
from typing import Any

import gpxpy
import numpy as np

from vrsopt.errors import InputError
from vrsopt.mission.track_data import Track

MOST_BAD = 0.1  # of the points, that have no time


@dataclass(frozen=True)
class _Piece:
    """A segment of a track, or a route: where it is in the file, and its points that have a time."""

    label: str
    points: Sequence[Any]
    untimed: int

    @property
    def begin(self) -> float:
        """Unix time of its earliest point [s]."""
        return min(_seconds(point) for point in self.points)

    @property
    def end(self) -> float:
        """Unix time of its latest point [s]."""
        return max(_seconds(point) for point in self.points)


def parse_gpx(text: str, *, where: str, name: str) -> Track:
    """The track in a GPX document; its tracks and their segments are joined in the order of time.

    Routes count where there is no track; waypoints do not. ``text``: content of the file; ``where``: how messages call
    it; ``name``: of the track. Raises :class:`InputError` for what is no GPX, for a document type declaration (its
    entities could stand for anything), for points without times, and for tracks that overlap.
    """
    document = _document(text, where)
    pieces, notes = _pieces(document, where)
    points = [point for piece in pieces for point in piece.points]
    altitude = np.array([np.nan if point.elevation is None else point.elevation for point in points], dtype=float)
    if not np.isfinite(altitude).any():
        raise InputError(f"{where}: ele: no point has one: allowed: the altitude of the points [m]")
    seconds = np.array([_seconds(point) for point in points])
    latitude, longitude = (
        np.array([getattr(p, side) for p in points], dtype=float) for side in ("latitude", "longitude")
    )
    try:
        return Track(
            time=seconds - seconds.min(),
            latitude_deg=latitude,
            longitude_deg=longitude,
            altitude=altitude,
            name=name,
            begin=datetime.fromtimestamp(float(seconds.min()), UTC).strftime("%Y-%m-%d %H:%M:%S UTC"),
            notes=tuple(notes),
        )
    except InputError as error:
        raise InputError(f"{where}: {str(error).removeprefix(f'{name}: ')}") from None


def _document(text: str, where: str) -> gpxpy.gpx.GPX:
    if re.search(r"<!\s*(DOCTYPE|ENTITY)", text, re.IGNORECASE):
        raise InputError(f"{where}: document type declaration: allowed: GPX without one")
    body = re.sub(r"^\s*<\?xml[^>]*\?>", "", text)  # the text is decoded: what it says of its encoding is past
    try:
        return gpxpy.parse(body)
    except gpxpy.gpx.GPXException as error:
        reason = " ".join(str(error).split()).removeprefix("Error parsing XML: ")
    except (ValueError, TypeError, AttributeError, LookupError) as error:  # elements gpxpy does not expect there
        reason = " ".join(str(error).split())
    raise InputError(f"{where}: not a GPX file: {reason[:200]}")


def _pieces(document: gpxpy.gpx.GPX, where: str) -> tuple[list[_Piece], list[str]]:
    """The pieces in the order of time, and what was left out or joined."""
    found: list[tuple[str, Sequence[Any]]] = [
        (f"track {t} segment {s}", segment.points)
        for t, track in enumerate(document.tracks, start=1)
        for s, segment in enumerate(track.segments, start=1)
    ]
    notes = []
    if not any(points for _, points in found):
        found = [(f"route {r}", route.points) for r, route in enumerate(document.routes, start=1)]
    elif document.routes:
        notes.append(f"{len(document.routes)} routes beside the tracks: left out")
    if document.waypoints:
        notes.append(f"{len(document.waypoints)} waypoints: left out")
    pieces = []
    for label, points in found:
        timed = [point for point in points if point.time is not None]
        if timed:
            pieces.append(_Piece(label, timed, len(points) - len(timed)))
        elif points:
            notes.append(f"{label}: no point has a time: left out")
    count, timed_count = sum(len(points) for _, points in found), sum(len(piece.points) for piece in pieces)
    if not count:
        raise InputError(f"{where}: no track: allowed: a track (trk) or a route (rte) with points")
    if count - timed_count > MOST_BAD * count:
        missing = count - timed_count
        raise InputError(f"{where}: time: {missing} of {count} points have none that can be read: allowed: ISO 8601")
    if timed_count < 2:
        raise InputError(f"{where}: {timed_count} points: allowed: at least 2")
    if untimed := sum(piece.untimed for piece in pieces):
        notes.append(f"{untimed} of {count} points have no time: left out")
    pieces.sort(key=lambda piece: piece.begin)
    for before, after in pairwise(pieces):
        if after.begin < before.end:
            raise InputError(
                f"{where}: {after.label} begins before {before.label} ends: allowed: tracks of one aircraft, "
                "one after the other"
            )
    if len(pieces) > 1:
        notes.append(f"{len(pieces)} tracks, segments or routes: joined in the order of time")
    return pieces, notes


def _seconds(point: Any) -> float:
    """Unix time [s]; without a time zone it is UTC."""
    when: datetime = point.time
    return (when if when.tzinfo else when.replace(tzinfo=UTC)).timestamp()
