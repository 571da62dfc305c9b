"""Flown tracks as missions: put right, smoothed, divided into stops and flight, and checked against the model.

Altitudes are taken as pressure altitude. A receiver that gives heights above the ellipsoid or above sea level differs
from it by the geoid and by the weather, some tens of metres: a constant that changes the air's density by less than one
per cent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vrsopt.errors import InputError
from vrsopt.mission.file import Limits, Place
from vrsopt.mission.profile import Profile
from vrsopt.mission.track_clean import cleaned
from vrsopt.mission.track_curve import Smoothing, smoothed
from vrsopt.mission.track_data import Track
from vrsopt.mission.track_file import read_bytes, read_track
from vrsopt.mission.track_limits import BOX, Stretch, listed, unflyable
from vrsopt.mission.track_motion import SmoothTrack
from vrsopt.mission.track_phases import segments_of_track
from vrsopt.mission.track_stops import Stop
from vrsopt.mission.wind import CALM, Wind

ASSUMED_HOVER = 60.0  # s, as the shipped missions hover beside an idle
BRIEF, STEEP = 15.0, 45.0  # s and deg: a steeper or longer climb beyond the box is refused
DIFFERENT = 0.2  # by which speeds of the file and of the positions may differ unsaid
RELAXED, RELAXATION = 5, 0.3  # times, factor: how often fixes that lead out of the box lose weight, and how much
MOST_MOVED = 20.0  # m, what noise can explain
LARGEST_BURN = 0.06  # kg/s

__all__ = ["FlownMission", "Track", "TrackProfile", "read_track", "track_mission", "track_profile", "unflyable"]


@dataclass(frozen=True)
class TrackProfile:
    """A track as a profile; ``notes`` say in sentences all that was changed and assumed.

    ``places``: where it started, stood and ended. ``beyond``: brief stretches beyond the model's box that it is flown
    through all the same.
    """

    profile: Profile
    notes: tuple[str, ...]
    places: Mapping[str, Place]
    beyond: tuple[Stretch, ...] = ()


@dataclass(frozen=True)
class FlownMission:
    """A flown track with the take-off mass [kg] of the aircraft, and what schedules and reports need of a mission."""

    name: str
    takeoff_mass: float
    profile: Profile
    places: Mapping[str, Place]
    notes: tuple[str, ...]
    source_hash: str  # SHA-256 of the file
    aircraft: str = "bo105"
    isa_offset_k: float = 0.0
    limits: Limits = field(default_factory=Limits)


def track_mission(
    path: str | Path,
    takeoff_mass: float,
    *,
    aircraft: str = "bo105",
    limits: Limits | None = None,
    isa_offset: float = 0.0,
    wind: Wind = CALM,
) -> FlownMission:
    """The track in a file (CSV, GPX), flown with a take-off mass [kg] on a day ``isa_offset`` [K] off standard.

    ``path``: of the file; ``aircraft``: shipped, or a TOML file; ``limits``: of schedules; ``wind`` by altitude. Raises
    :class:`InputError` for a file that can not be used, and for a track that leaves what the model covers.
    """
    low, high = BOX.mass
    if not low <= takeoff_mass <= high:
        raise InputError(f"{path}: take-off mass = {takeoff_mass:g}: allowed: a number from {low:g} to {high:g}")
    track = read_track(path)
    try:
        flown = track_profile(track, isa_offset=isa_offset, wind=wind)
        time = flown.profile.grid(1.0).time
        # what is too heavy even if it burns more than it can; the rest shows when the fuel is known
        heavy = unflyable(flown.profile, mass=np.maximum(takeoff_mass - LARGEST_BURN * time, low))
        if stretches := [stretch for stretch in heavy if stretch.unit == "kg"]:
            raise InputError(f"{listed(stretches)}: fly it with less mass")
    except InputError as error:
        raise InputError(f"{path}: {str(error).removeprefix(f'{track.name}: ')}") from None
    return FlownMission(
        name=track.name,
        takeoff_mass=float(takeoff_mass),
        profile=flown.profile,
        places=flown.places,
        notes=flown.notes,
        source_hash=sha256(read_bytes(Path(path))).hexdigest(),
        aircraft=aircraft,
        isa_offset_k=isa_offset,
        limits=limits or Limits(),
    )


def track_profile(
    track: Track, *, isa_offset: float = 0.0, wind: Wind = CALM, assumed_hover: float = ASSUMED_HOVER
) -> TrackProfile:
    """The track as a profile.

    ``assumed_hover`` [s]: where noise hides when it lifted off, it hovered that long beside the flight (at most half
    of the stop). Raises :class:`InputError` for a track that can not be used: too short, gaps of more than ten minutes,
    too many impossible fixes; or that leaves the model's box, except for a few seconds of steep climb, which are said.
    """
    fixes = cleaned(track)
    notes = [*track.notes, *fixes.notes, "altitudes of the file are taken as pressure altitudes"]
    if wind == CALM:
        notes.append("without wind, speeds over the ground are taken as airspeeds")
    smoothing = smoothed(track, fixes, notes, assumed_hover=assumed_hover)
    curve, profile, beyond = _within_the_box(smoothing, isa_offset, wind, notes)
    found = smoothing.stops
    _compare(track, curve, notes)
    notes += _stop_notes(curve, found)
    if all(segment.kind == "idle" for segment in profile.segments):
        raise InputError(f"{track.name}: it stands on the ground all the time: allowed: a flight")
    refused = [one for one in beyond if not _passable(one)]
    if refused:
        raise InputError(f"{track.name}: beyond the model: {listed(refused)}: {_advice(refused[0], wind)}")
    if beyond:
        notes.append(f"briefly beyond the model's range, flown all the same: {listed(beyond)}")
    return TrackProfile(profile, tuple(notes), _places(curve, found), tuple(beyond))


def _within_the_box(
    smoothing: Smoothing, isa_offset: float, wind: Wind, notes: list[str]
) -> tuple[SmoothTrack, Profile, list[Stretch]]:
    """The curve, its profile and what of it is beyond the model: where smoothing more helps, that is done."""

    def flown(trust: NDArray[Any]) -> tuple[SmoothTrack, Profile, list[Stretch]]:
        curve = smoothing.curve(trust)
        profile = Profile(segments_of_track(curve, smoothing.stops), isa_offset, wind)
        return curve, profile, unflyable(profile)

    def moved(to: SmoothTrack) -> tuple[float, float]:
        place, height = to.place(time) - first[0].place(time), to.heights(time) - first[0].heights(time)
        return float(np.max(np.linalg.norm(place, axis=1))), float(np.max(np.abs(height)))

    def refused(one: tuple[SmoothTrack, Profile, list[Stretch]]) -> tuple[int, int]:
        return sum(not _passable(stretch) for stretch in one[2]), len(one[2])

    time = smoothing.time
    trust = np.ones(len(time))
    first = last = best = flown(trust)
    for _ in range(RELAXED):
        if not last[2]:
            break
        for stretch in last[2]:
            around = smoothing.along.period
            trust[(time > stretch.start - around) & (time < stretch.end + around)] *= RELAXATION
        last = flown(trust)
        # smoothing more cures one excess and may cause another: the least refused counts
        if refused(last) < refused(best) and max(moved(last[0])) <= MOST_MOVED:
            best = last
    if best is first:
        return first
    aside, lifted = moved(best[0])
    notes.append(
        f"beyond the model's range as noise can be, {len(first[2])} stretches, the first at {first[2][0].start:.0f} s: "
        f"smoothed more there, moved by up to {aside:.1f} m, and {lifted:.1f} m in altitude"
    )
    return best


def _compare(track: Track, curve: SmoothTrack, notes: list[str]) -> None:
    """Say where the file's own speeds and courses contradict its positions."""
    inside = np.clip(track.time, 0.0, curve.duration)
    velocity = curve.velocity(inside)
    speed = np.linalg.norm(velocity, axis=1)
    fast = speed > 10.0
    if track.ground_speed is not None and np.any(known := fast & np.isfinite(track.ground_speed)):
        ratio = float(np.median(track.ground_speed[known] / speed[known]))
        if abs(ratio - 1.0) > DIFFERENT:
            notes.append(f"ground speeds of the file are {ratio:.2f} times those of its positions: not used")
    if track.course_deg is not None and np.any(known := fast & np.isfinite(track.course_deg)):
        course = np.degrees(np.arctan2(velocity[known, 0], velocity[known, 1]))
        off = (track.course_deg[known] - course + 180.0) % 360.0 - 180.0
        if abs(float(np.median(off))) > 90.0 * DIFFERENT:
            notes.append(f"courses of the file differ from its positions' by {np.median(off):.0f} deg: not used")


def _stop_notes(curve: SmoothTrack, found: Sequence[Stop]) -> list[str]:
    notes = []
    for stop in found:
        kinds = " and ".join(dict.fromkeys(rest.kind for rest in stop.rests))
        why = f" ({stop.how})" if stop.how else ""
        notes.append(f"stop at {stop.start:.0f} s for {stop.length:.0f} s: {kinds}{why}")
    if found and not any(rest.kind == "idle" for stop in found for rest in stop.rests):
        notes.append("it never stood on the ground, as far as the track tells")
    first, last = (found[0].rests[0], found[-1].rests[-1]) if found else (None, None)
    if first is None or first.start > 0.0 or first.kind != "idle":
        notes.append("the track begins in the air")
    if last is None or last.end < curve.duration or last.kind != "idle":
        notes.append("the track ends in the air")
    return notes


def _passable(stretch: Stretch) -> bool:
    return stretch.unit == "deg" and abs(stretch.worst) <= STEEP and stretch.end - stretch.start <= BRIEF


def _advice(stretch: Stretch, wind: Wind) -> str:
    if stretch.quantity == "airspeed" and wind.calm:
        return "give the wind if there was one, or leave these times out"
    if stretch.quantity == "altitude":
        return "name the unit in the heading if it is not metres (altitude_ft), or leave these times out"
    return "leave these times out"


def _places(curve: SmoothTrack, found: Sequence[Stop]) -> dict[str, Place]:
    """Start and end, and the landings between."""
    ends = {"start": 0.0, "end": curve.duration}
    landings = [stop for stop in found if any(rest.kind == "idle" for rest in stop.rests)]
    between = [stop for stop in landings if stop.start > 0.0 and stop.end < curve.duration]
    ends |= {f"landing {number}": 0.5 * (stop.start + stop.end) for number, stop in enumerate(between, start=1)}
    places = {}
    for name, time in ends.items():
        at = np.array([time])
        latitude, longitude, _ = curve.track(at)
        here = [stop.ground for stop in landings if stop.start <= time <= stop.end and stop.ground is not None]
        elevation = float(np.clip(here[0] if here else curve.heights(at)[0], 0.0, BOX.altitude[1]))
        places[name] = Place(latitude_deg=float(latitude[0]), longitude_deg=float(longitude[0]), elevation_m=elevation)
    return places
