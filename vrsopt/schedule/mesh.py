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
ROLL_INTERVALS = 2
FINER = 2.0  # than what a schedule may take for linear
LEAST_REACH, LARGEST_REACH = 1.0, 8.0  # s, how far beside a roll its own change of rotor speed is taken to reach
REACH = 1.1  # times the estimate


@dataclass(frozen=True)
class MeshOptions:
    """Steps grow from ``first_step`` [s] at an edge by ``growth`` up to ``largest_step`` [s].

    A mission that would need more than ``most_intervals`` has its steps grow faster beside rolls into turns, after that
    its first steps are made longer, until they suffice; a fifth more than those that resolve changes of the conditions
    are always allowed. On the shipped missions, with actuators of 0.1 to 1 % per second, a trajectory refined from the
    default is within 0.002 % of the fuel of a mesh several times as fine.
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

    def equals(self, other: Mesh) -> bool:
        """Whether both have the same intervals."""
        pairs = (self.segment, other.segment), (self.start, other.start), (self.step, other.step)
        return all(np.array_equal(one, two) for one, two in pairs)

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
    shape = smoothness(profile)
    reach = _reach(shape, settings)
    beside_rolls = options.growth
    allowed = max(options.most_intervals, 1.2 * sum(_least(shape, reach, options)))
    while True:
        steps = _steps(shape, reach, options, beside_rolls)
        if sum(len(part) for part in steps) <= allowed or options.first_step >= options.largest_step:
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


def _steps(shape: Smoothness, reach: np.ndarray, options: MeshOptions, beside_rolls: float) -> list[np.ndarray]:
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
    for s, (duration, least) in enumerate(zip(shape.durations, _least(shape, reach, options), strict=True)):
        if shape.idle[s]:  # nothing is free there, and nothing changes
            steps.append(np.array([duration]))
            continue
        ends = grading(s, s, s - 1), grading(s, s + 1, s + 1)
        steps.append(graded_steps(duration, largest=duration / least, gradings=ends))
    return steps


def _least(shape: Smoothness, reach: np.ndarray, options: MeshOptions) -> np.ndarray:
    """Intervals (n,) of each segment before any is made for an edge."""
    changes = np.where(reach > 0.0, ROLL_INTERVALS, np.ceil(FINER * shape.changes))
    steps = np.where(shape.idle, 1.0, np.ceil(shape.durations / options.largest_step - 1e-9))
    return np.maximum(steps, np.maximum(changes, 1.0))


def _reach(shape: Smoothness, settings: ScheduleSettings) -> np.ndarray:
    """Seconds (n,) before and after each roll in which the rotor speed is changed for its sake; 0 for other segments.

    At the same blade loading the rotor speed goes with the root of the load factor, at its rate.
    """
    rate = settings.rotor_speed_rate
    needed = 0.5 * shape.load_change * settings.nominal_rotor_speed / rate if rate else np.zeros(len(shape.changes))
    beside = np.clip(REACH * 0.5 * (needed - shape.durations), LEAST_REACH, LARGEST_REACH)
    return np.where(shape.rolls, beside, 0.0)
