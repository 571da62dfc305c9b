"""Collocation mesh of a mission: every segment edge is a mesh edge, with small steps where the conditions jump."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.errors import InputError

if TYPE_CHECKING:
    from vrsopt.mission.profile import Profile, Segment

COARSEN = 1.1  # factor on the growth, then on the first step, while the mesh has too many intervals
STEEPEST_GROWTH = 2.0


@dataclass(frozen=True)
class MeshOptions:
    """Steps grow from ``first_step`` [s] at an edge by ``growth`` up to ``largest_step`` [s].

    A mission with many short segments would need more than ``most_intervals``: its growth is then raised up to 2 and
    after that its first step, until they suffice (two intervals per segment are the least). On a search mission of 53
    segments the default needs 430 intervals, within 0.005 % of the fuel of 730.
    """

    first_step: float = 2.0
    growth: float = 2.0
    largest_step: float = 60.0
    most_intervals: int = 500

    def __post_init__(self) -> None:
        if not 0.0 < self.first_step <= self.largest_step:
            raise InputError(
                f"mesh: first_step = {self.first_step:g}: must be above 0 and at most {self.largest_step:g} s"
            )
        if not self.growth > 1.0:
            raise InputError(f"mesh: growth = {self.growth:g}: must be above 1")


@dataclass(frozen=True)
class Mesh:
    """N intervals, each inside one segment: segment index (N,), start and length (N,) [s]."""

    segment: np.ndarray
    start: np.ndarray
    step: np.ndarray

    @property
    def end(self) -> np.ndarray:
        """End (N,) of the intervals, s."""
        return self.start + self.step

    def __len__(self) -> int:
        return len(self.step)


def make_mesh(profile: Profile, options: MeshOptions | None = None) -> Mesh:
    """Mesh of a mission."""
    options = options or MeshOptions()
    segments = profile.segments
    jumps = [_jumps(before, after) for before, after in zip(segments, segments[1:], strict=False)]
    jumps = [True, *jumps, True]  # the pinned ends of the mission cause transients too
    while True:
        steps = [
            graded_steps(segment.duration, options, small_at=(jumps[s], jumps[s + 1]))
            for s, segment in enumerate(segments)
        ]
        total = sum(len(part) for part in steps)
        if total <= max(options.most_intervals, 2 * len(segments)) or options.first_step >= options.largest_step:
            break
        options = _coarser(options)
    starts = [
        segment.start + np.concatenate([[0.0], np.cumsum(part)[:-1]])
        for segment, part in zip(segments, steps, strict=True)
    ]
    index = [np.full(len(part), s) for s, part in enumerate(steps)]
    return Mesh(np.concatenate(index), np.concatenate(starts), np.concatenate(steps))


def graded_steps(duration: float, options: MeshOptions, small_at: tuple[bool, bool]) -> np.ndarray:
    """Fewest steps [s], at least two, that grow from the ends marked in ``small_at`` and fill ``duration``."""
    count = 2
    while True:
        order = np.arange(count)
        distances = [side for side, small in ((order, small_at[0]), (order[::-1], small_at[1])) if small]
        nearest = np.min(distances, axis=0) if distances else np.full(count, np.inf)
        # beyond the power that reaches the cap the exact power does not matter, and would overflow
        reach = np.log(options.largest_step / options.first_step) / np.log(options.growth)
        steps = np.minimum(options.first_step * options.growth ** np.minimum(nearest, reach), options.largest_step)
        if steps.sum() >= duration:
            return steps * (duration / steps.sum())
        count += 1


def _coarser(options: MeshOptions) -> MeshOptions:
    if options.growth < STEEPEST_GROWTH:
        return replace(options, growth=min(COARSEN * options.growth, STEEPEST_GROWTH))
    return replace(options, first_step=min(COARSEN * options.first_step, options.largest_step))


def _jumps(before: Segment, after: Segment) -> bool:
    """Do the conditions change at the edge between two segments?"""
    same = (
        before.speed == after.speed
        and before.climb_angle == after.climb_angle
        and before.load_factor == after.load_factor
        and before.kind == after.kind
    )
    return not same or after.mass_change != 0.0
