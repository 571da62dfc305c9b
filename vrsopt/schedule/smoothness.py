"""Where the flight conditions of a mission jump, where they vary, and how much."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from vrsopt.mission.profile import Profile

# What decides on the best rotor speed and twist: what counts as a jump at an edge, and what change of it a schedule may
# take for linear. The equivalent climb rate is the airspeed times the sine of the equivalent climb angle.
JUMPS = {"speed": 0.1, "equivalent_climb_rate": 0.1, "load_factor": 0.005}  # m/s, m/s, -
RESOLVED = {"speed": 6.0, "equivalent_climb_rate": 3.0, "load_factor": 0.05}
HELD = 0.02  # of RESOLVED: a segment that changes by less is held
ROLL = 6.0  # s, a varying segment no longer than this, between held ones, is a roll into or out of a turn
SAMPLING, LEAST_SAMPLES = 2.0, 16  # s between samples at most, intervals between them in a segment at least


@dataclass(frozen=True)
class Smoothness:
    """Of n segments and n + 1 edges, both ends of the mission among them.

    ``jumps`` (n + 1,): conditions or mass are not continuous there, or it is an end of the mission, where a schedule
    may be pinned. ``changes`` (n,): total variation of the conditions over what a schedule may take for linear.
    ``load_change`` (n,): logarithm of the largest load factor over the smallest. ``idle`` (n,): on the ground.
    ``durations`` (n,) [s].
    """

    durations: np.ndarray
    jumps: np.ndarray
    changes: np.ndarray
    load_change: np.ndarray
    idle: np.ndarray

    @property
    def rolls(self) -> np.ndarray:
        """Segments (n,) that are short and vary, between held ones that they go on from smoothly."""
        before, after = np.append(False, self.held[:-1]), np.append(self.held[1:], False)
        smooth = ~self.jumps[:-1] & ~self.jumps[1:]
        return ~self.held & (self.durations <= ROLL) & before & after & smooth

    @property
    def held(self) -> np.ndarray:
        """Segments (n,) in which nothing changes to speak of."""
        return self.changes <= HELD


def smoothness(profile: Profile) -> Smoothness:
    """Jumps and changes of the conditions of ``profile``."""
    edges = np.asarray(profile.edges)
    counts = np.maximum(np.ceil(np.diff(edges) / SAMPLING), LEAST_SAMPLES).astype(int) + 1
    index = np.repeat(np.arange(len(counts)), counts)
    parts = [np.linspace(start, end, count) for start, end, count in zip(edges, edges[1:], counts, strict=False)]
    time = np.concatenate(parts)
    nodes = profile.conditions(index, time)
    first = np.cumsum(counts) - counts
    last = first + counts - 1
    idle = np.asarray(nodes.idle)[first]
    seen = {
        "speed": nodes.speed,
        "equivalent_climb_rate": nodes.speed * np.sin(nodes.equivalent_climb_angle),
        "load_factor": nodes.load_factor,
    }
    jumps = (idle[1:] != idle[:-1]) | (np.asarray(profile.mass_changes)[1:] != 0.0)
    changes = np.zeros(len(counts))
    for name, values in seen.items():
        jumps |= np.abs(values[first[1:]] - values[last[:-1]]) > JUMPS[name]
        inside = np.abs(np.diff(values)) * (np.diff(index) == 0)
        changes = np.maximum(changes, np.bincount(index[:-1], inside, len(counts)) / RESOLVED[name])
    load = np.log(nodes.load_factor)
    return Smoothness(
        durations=np.diff(edges),
        jumps=np.concatenate([[True], jumps, [True]]),
        changes=np.where(idle, 0.0, changes),
        load_change=np.where(idle, 0.0, np.maximum.reduceat(load, first) - np.minimum.reduceat(load, first)),
        idle=idle,
    )
