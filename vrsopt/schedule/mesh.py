"""Collocation mesh of a mission: every segment edge is a mesh edge, steps are small where a schedule has to move fast.

That is where conditions jump, where a long change of them begins or ends, and beside a roll into a turn, which takes
the rotor longer than the aircraft: as far as that reaches, the mesh has one step. Within a roll two steps do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.errors import InputError
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.smoothness import Smoothness, smoothness

if TYPE_CHECKING:
    from vrsopt.mission.profile import Profile

COARSEN = 1.1  # factor on the first step while the mesh has too many intervals
STEEPEST_GROWTH = 100.0  # beside rolls
ROLL = 6.0  # s, a varying segment no longer than this is a roll
ROLL_INTERVALS = 2
LEAST_REACH, LARGEST_REACH = 1.0, 8.0  # s, how far beside a roll its own change of rotor speed is taken to reach
REACH = 1.1  # times the estimate


@dataclass(frozen=True)
class MeshOptions:
    """Steps grow from ``first_step`` [s] at an edge by ``growth`` up to ``largest_step`` [s].

    A mission that would need more than ``most_intervals`` has its steps grow faster beside rolls into turns, after that
    its first steps are made longer, until they suffice or only those are left that resolve changes of the conditions.
    On the rescue and surveillance missions the default is within 0.002 % of the fuel of a mesh three times as fine.
    """

    first_step: float = 2.0
    growth: float = 1.4
    largest_step: float = 60.0
    most_intervals: int = 600

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

    def split(self, interval: np.ndarray, time: np.ndarray) -> Mesh:
        """The same mesh with one more edge at ``time`` (n,) [s] inside each of the intervals ``interval`` (n,)."""
        end = self.end
        end[interval] = time
        segment, start = np.append(self.segment, self.segment[interval]), np.append(self.start, time)
        step = np.append(end - self.start, self.end[interval] - time)
        order = np.argsort(start)
        return Mesh(segment[order], start[order], step[order])


@dataclass(frozen=True)
class Grading:
    """How steps grow from one end of a segment: the first of them [s], and the factor from one to the next."""

    first: float
    growth: float


def make_mesh(
    profile: Profile, options: MeshOptions | None = None, *, settings: ScheduleSettings | None = None
) -> Mesh:
    """Mesh of a mission for a schedule with the rates of ``settings``."""
    options, settings = options or MeshOptions(), settings or ScheduleSettings()
    shape, durations = smoothness(profile), np.diff(profile.edges)
    reach = _reach(shape, durations, settings)
    beside_rolls = options.growth
    while True:
        steps = _steps(shape, durations, reach, options, beside_rolls)
        total = sum(len(part) for part in steps)
        if total <= options.most_intervals or options.first_step >= options.largest_step:
            break
        if beside_rolls < STEEPEST_GROWTH and np.any(reach > 0.0):
            beside_rolls *= 2.0
        else:
            options = replace(options, first_step=min(COARSEN * options.first_step, options.largest_step))
    starts = [
        start + np.concatenate([[0.0], np.cumsum(part)[:-1]]) for start, part in zip(profile.edges, steps, strict=False)
    ]
    index = [np.full(len(part), s) for s, part in enumerate(steps)]
    return Mesh(np.concatenate(index), np.concatenate(starts), np.concatenate(steps))


def graded_steps(duration: float, *, largest: float, gradings: tuple[Grading | None, Grading | None]) -> np.ndarray:
    """Fewest steps [s] of at most ``largest`` that grow from the graded ends and fill ``duration``."""
    count = 1
    while True:
        order = np.arange(count)
        steps = np.full(count, largest)
        for grading, distance in zip(gradings, (order, order[::-1]), strict=True):
            if grading is not None and grading.first < largest:
                # beyond the power that reaches the cap the exact power does not matter, and would overflow
                powers = np.minimum(distance, np.log(largest / grading.first) / np.log(grading.growth))
                steps = np.minimum(steps, grading.first * grading.growth**powers)
        if steps.sum() >= duration * (1.0 - 1e-9):
            return _filling(steps, duration)
        count += 1


def _filling(steps: np.ndarray, duration: float) -> np.ndarray:
    """The same steps made to fill ``duration`` [s]: the long ones alone if that is enough, else all."""
    longest = steps > 0.5 * steps.max()
    rest = (duration - np.sum(steps[~longest])) / np.sum(longest)
    if rest >= np.max(steps[~longest], initial=0.0):
        return np.where(longest, rest, steps)
    return steps * (duration / steps.sum())


def _steps(
    shape: Smoothness, durations: np.ndarray, reach: np.ndarray, options: MeshOptions, beside_rolls: float
) -> list[np.ndarray]:
    """Steps of every segment."""

    def grading(s: int, edge: int, other: int) -> Grading | None:
        if shape.jumps[edge]:
            return Grading(options.first_step, options.growth)
        if not shape.held[s] or shape.held[other]:
            return None
        if reach[other] > 0.0:
            return Grading(reach[other] * options.first_step / MeshOptions.first_step, beside_rolls)
        return Grading(options.first_step, options.growth)

    steps: list[np.ndarray] = []
    for s, duration in enumerate(durations):
        if shape.idle[s]:  # nothing is free there, and nothing changes
            steps.append(np.array([duration]))
            continue
        pieces = ROLL_INTERVALS if reach[s] > 0.0 else np.ceil(shape.changes[s])
        ends = grading(s, s, s - 1), grading(s, s + 1, s + 1)
        steps.append(
            graded_steps(duration, largest=min(options.largest_step, duration / max(1, pieces)), gradings=ends)
        )
    return steps


def _reach(shape: Smoothness, durations: np.ndarray, settings: ScheduleSettings) -> np.ndarray:
    """Seconds (n,) before and after each roll in which the rotor speed is changed for its sake; 0 for other segments.

    A roll is short and between held segments. At the same blade loading the rotor speed goes with the root of the load
    factor, at its rate.
    """
    rate = settings.rotor_speed_rate
    needed = 0.5 * shape.load_change * settings.nominal_rotor_speed / rate if rate else np.zeros(len(durations))
    beside = np.clip(REACH * 0.5 * (needed - durations), LEAST_REACH, LARGEST_REACH)
    before, after = np.append(False, shape.held[:-1]), np.append(shape.held[1:], False)
    alone = before & after & ~shape.jumps[:-1] & ~shape.jumps[1:]
    return np.where(~shape.held & (durations <= ROLL) & alone, beside, 0.0)
