"""The nodes of a mission at which a schedule is decided: few where the mission goes on smoothly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.errors import InputError
from vrsopt.schedule.smoothness import Smoothness, smoothness

if TYPE_CHECKING:
    from vrsopt.mission.profile import Conditions, Profile
    from vrsopt.schedule.refly import FlightGrid

GROUND = -1  # search of a node at which nothing is free


@dataclass(frozen=True)
class DecisionNodes:
    """n nodes, both ends of every segment among them, and the m searches that they need.

    ``segment`` and ``time`` [s] (n,), in order. ``search`` (n,): which search a node takes its values from, GROUND in
    idle. The two nodes of an edge share one search if nothing jumps there.
    """

    profile: Profile
    shape: Smoothness
    segment: np.ndarray
    time: np.ndarray

    @property
    def search(self) -> np.ndarray:
        """Index of the search of each node."""
        same = (np.diff(self.segment) == 1) & ~self.shape.jumps[self.segment[1:]]
        flying = ~self.shape.idle[self.segment]
        first = flying & np.append(True, ~same)
        return np.where(flying, np.cumsum(first) - 1, GROUND)

    @property
    def first(self) -> np.ndarray:
        """The node (m,) that stands for each search."""
        search = self.search
        return np.flatnonzero(np.diff(search, prepend=GROUND) * (search != GROUND) != 0)

    def conditions(self) -> Conditions:
        """Conditions of the searches (m,)."""
        return self.profile.conditions(self.segment[self.first], self.time[self.first])

    def spread(self, values: np.ndarray, ground: float) -> np.ndarray:
        """Values (m,) of the searches at all nodes (n,), ``ground`` in idle."""
        search = self.search
        return np.where(search == GROUND, ground, values[np.maximum(search, 0)])

    def interpolated(self, grid: FlightGrid, values: np.ndarray) -> np.ndarray:
        """Values (N,) on a fine grid at the searches (m,)."""
        found = np.empty(len(self.first))
        for k, node in enumerate(self.first):
            here = slice(*np.searchsorted(grid.segment, [self.segment[node], self.segment[node] + 1]))
            found[k] = np.interp(self.time[node], grid.time[here], values[here])
        return found

    def with_nodes(self, segment: np.ndarray, time: np.ndarray) -> DecisionNodes:
        """These and more nodes, inside segments."""
        where = np.append(self.segment, segment), np.append(self.time, time)
        order = np.lexsort((where[1], where[0]))
        return DecisionNodes(self.profile, self.shape, where[0][order], where[1][order])


def decision_nodes(profile: Profile, step: float) -> DecisionNodes:
    """Nodes at most ``step`` [s] apart, and so close that the conditions between them are about linear in time.

    Raises InputError for a step that is not a number above 0, and for a profile that is idle throughout.
    """
    if not 0.0 < step < float("inf"):
        raise InputError(f"pointwise schedule: decision_step = {step!r}: allowed: a number above 0")
    shape, edges = smoothness(profile), np.asarray(profile.edges)
    if np.all(shape.idle):
        raise InputError("pointwise schedule: profile: has no task in flight, only idle")
    linear = np.where(shape.rolls, 1.0, np.maximum(1.0, np.ceil(shape.changes)))
    pieces = np.maximum(np.ceil(shape.durations / step - 1e-9), linear).astype(int)
    times = [np.linspace(start, end, count + 1) for start, end, count in zip(edges, edges[1:], pieces, strict=False)]
    return DecisionNodes(profile, shape, np.repeat(np.arange(len(pieces)), pieces + 1), np.concatenate(times))
