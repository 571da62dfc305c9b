"""A mission over time: segments, and the flight condition and position at any time of them.

Within a segment everything is smooth. Speeds and heights are continuous from one segment to the next; load factor and
flight-path angle may still have corners there, and what is lifted or set down changes the mass at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vrsopt.errors import InputError
from vrsopt.mission.conditions import Conditions, flight_conditions
from vrsopt.mission.plan import segments_of
from vrsopt.mission.segment import ON_THE_GROUND, Segment
from vrsopt.mission.wind import CALM, Wind

if TYPE_CHECKING:
    from vrsopt.mission.file import Mission

Array = NDArray[Any]
SAME_TIME = 1e-6  # s
CONTINUOUS = (
    "speed",
    "altitude",
    "climb_angle",
    "load_factor",
    "turn_load_factor",
    "turn",
    "equivalent_climb_angle",
    "height",
)

__all__ = ["Conditions", "Profile", "Segment"]


@dataclass(frozen=True)
class Profile:
    """A mission as segments contiguous in time, from time 0, on a day ``isa_offset`` [K] warmer than standard."""

    segments: tuple[Segment, ...]
    isa_offset: float = 0.0
    wind: Wind = CALM

    def __post_init__(self) -> None:
        if not self.segments:
            raise InputError("profile: segments = (): allowed: at least one")
        end = 0.0
        for index, segment in enumerate(self.segments):
            if not segment.duration > 0.0:
                raise InputError(f"profile: segments[{index}].duration = {segment.duration!r}: allowed: above 0")
            if not abs(segment.start - end) <= SAME_TIME:
                raise InputError(f"profile: segments[{index}].start = {segment.start!r}: allowed: {end!r}")
            end = segment.end

    @classmethod
    def of(cls, mission: Mission, *, where: str | None = None) -> Profile:
        """The profile of a mission.

        Raises :class:`InputError` (one line that begins with ``where``, or the mission's name) for tasks that can not
        follow each other; see :func:`vrsopt.mission.plan.segments_of`.
        """
        try:
            return cls(segments_of(mission), mission.isa_offset_k, mission.wind.field)
        except InputError as error:
            raise InputError(f"{where or mission.name}: {error}") from None

    @property
    def duration(self) -> float:
        """Length of the mission [s]."""
        return self.segments[-1].end

    @property
    def edges(self) -> Array:
        """Times between segments, with both ends of the mission [s], (n_segments + 1,)."""
        return np.array([segment.start for segment in self.segments] + [self.duration])

    @property
    def mass_changes(self) -> Array:
        """Mass added at the start of each segment [kg], (n_segments,)."""
        return self._of_segments("mass_change")

    def conditions(self, segment: ArrayLike, time: ArrayLike) -> Conditions:
        """Conditions at ``time`` [s] of the segments with index ``segment``, broadcast to one shape.

        Raises :class:`InputError` for a segment that does not exist or a time outside its segment.
        """
        segment, time = self._located(segment, time)
        found = {name: np.zeros(segment.shape) for name in CONTINUOUS}
        for index in np.unique(segment):
            here, item = segment == index, self.segments[index]
            own = np.clip(time[here] - item.start, 0.0, item.duration)
            course = np.zeros(len(own)) if self.wind.calm else item.motion.track(own)[2]
            motion = item.motion.kinematics(own)
            wind = CALM if item.kind in ON_THE_GROUND else self.wind
            ground = -np.inf if item.ground_elevation is None else item.ground_elevation
            for name, value in flight_conditions(motion, course, wind).items():
                found[name][here] = value
            found["height"][here] = motion.altitude - ground
        kind = self._of_segments("kind")[segment]
        idle, ground_idle = np.isin(kind, ON_THE_GROUND), kind == "ground_idle"
        return Conditions(segment=segment, time=time, idle=idle, ground_idle=ground_idle, **found)

    def grid(self, max_step: float) -> Conditions:
        """Conditions on a grid of uniform steps of at most ``max_step`` [s] in each segment.

        Every segment has nodes at both its ends, so each edge between segments appears twice, at the same time.
        """
        if not 0.0 < max_step < float("inf"):
            raise InputError(f"grid: max_step = {max_step!r}: allowed: a number above 0")
        indices, times = [], []
        for index, item in enumerate(self.segments):
            steps = max(1, ceil(item.duration / max_step - 1e-9))
            times.append(np.linspace(item.start, item.end, steps + 1))
            indices.append(np.full(steps + 1, index))
        return self.conditions(np.concatenate(indices), np.concatenate(times))

    def positions(self, segment: ArrayLike, time: ArrayLike) -> tuple[Array, Array]:
        """Latitude and longitude [deg] at ``time`` [s] of the segments with index ``segment``; as :meth:`conditions`.

        On geodesics and arcs of the WGS-84 ellipsoid, not interpolated between nodes.
        """
        segment, time = self._located(segment, time)
        latitude, longitude = np.zeros(segment.shape), np.zeros(segment.shape)
        for index in np.unique(segment):
            here, item = segment == index, self.segments[index]
            latitude[here], longitude[here], _ = item.motion.track(time[here] - item.start)
        return latitude, longitude

    def _of_segments(self, name: str) -> Array:
        """One attribute of all segments, as an array."""
        return np.array([getattr(segment, name) for segment in self.segments])

    def _located(self, segment: ArrayLike, time: ArrayLike) -> tuple[Array, Array]:
        """Segment index and time in one shape, checked."""
        index, at = np.broadcast_arrays(np.asarray(segment), np.asarray(time, dtype=float))
        if not np.issubdtype(index.dtype, np.integer):
            raise InputError(f"profile: segment of type {index.dtype}: allowed: integers")
        wrong = (index < 0) | (index >= len(self.segments))
        if wrong.any():
            raise InputError(f"profile: segment = {index[wrong][0]}: allowed: 0 to {len(self.segments) - 1}")
        start, end = self._of_segments("start")[index], self._of_segments("end")[index]
        outside = ~((at >= start - SAME_TIME) & (at <= end + SAME_TIME))
        if outside.any():
            number, low, high = index[outside][0], start[outside][0], end[outside][0]
            raise InputError(f"profile: time = {at[outside][0]}: allowed in segment {number}: {low:g} to {high:g} s")
        return index, np.clip(at, start, end)
