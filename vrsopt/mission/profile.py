"""A mission over time: segments, and the flight condition and position at any time of them.

Within a segment airspeed, flight-path angle and load factor are constant and the altitude is linear in time. At the
edges of tasks the speed jumps: finite acceleration is not modelled yet.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vrsopt.errors import InputError
from vrsopt.mission.plan import segments_of
from vrsopt.mission.segment import Segment

if TYPE_CHECKING:
    from vrsopt.mission.file import Mission

Array = NDArray[Any]
SAME_TIME = 1e-6  # s

__all__ = ["Conditions", "Profile", "Segment"]


@dataclass(frozen=True)
class Conditions:
    """Flight conditions at pairs of segment and time; arrays of one shape.

    The segment belongs to the pair because at an edge the condition is that of the segment before or after it.
    """

    segment: Array  # index
    time: Array  # s
    speed: Array  # true airspeed, m/s
    altitude: Array  # pressure altitude, m
    climb_angle: Array  # rad
    load_factor: Array  # -
    idle: Array  # bool: on the ground at flat pitch


@dataclass(frozen=True)
class Profile:
    """A mission as segments contiguous in time, from time 0, on a day ``isa_offset`` [K] warmer than standard."""

    segments: tuple[Segment, ...]
    isa_offset: float = 0.0

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
            return cls(segments_of(mission), mission.isa_offset_k)
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
        segment, time, fraction = self._located(segment, time)
        begin, end = self._of_segments("altitude_start")[segment], self._of_segments("altitude_end")[segment]
        return Conditions(
            segment=segment,
            time=time,
            speed=self._of_segments("speed")[segment],
            altitude=(1.0 - fraction) * begin + fraction * end,  # exact at both ends
            climb_angle=self._of_segments("climb_angle")[segment],
            load_factor=self._of_segments("load_factor")[segment],
            idle=(self._of_segments("kind") == "idle")[segment],
        )

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
        segment, _, fraction = self._located(segment, time)
        points = [
            self.segments[index].path.position(part * self.segments[index].path.length)
            for index, part in zip(segment.flat, fraction.flat, strict=True)
        ]
        latitude, longitude = np.array(points, dtype=float).reshape(-1, 2).T
        return latitude.reshape(segment.shape), longitude.reshape(segment.shape)

    def _of_segments(self, name: str) -> Array:
        """One attribute of all segments, as an array."""
        return np.array([getattr(segment, name) for segment in self.segments])

    def _located(self, segment: ArrayLike, time: ArrayLike) -> tuple[Array, Array, Array]:
        """Segment index and time in one shape, and how far through the segment the time is (0..1)."""
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
        return index, at, np.clip((at - start) / (end - start), 0.0, 1.0)
