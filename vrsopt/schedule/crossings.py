"""When the rotor crosses its forbidden bands: windows in time, and the bounds of its speed that follow."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vrsopt.schedule.mesh import Mesh

SAME_TIME = 1e-3  # s
PARTS = 4  # of a window, each with a rate of its own


@dataclass(frozen=True)
class Window:
    """From ``start`` to ``end`` [s] the rotor speed goes from one region to the next, ``before`` and ``after``."""

    start: float
    end: float
    before: int
    after: int


@dataclass(frozen=True)
class Crossings:
    """Bounds of the rotor speed: outside the windows the region it is in, inside both regions and the band between.

    ``regions``: what the bands leave, each from and to [rad/s]; ``first``: the region at the start of the mission.
    """

    regions: tuple[tuple[float, float], ...]
    first: int
    windows: tuple[Window, ...]

    def bounds(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper rotor speed (n,) [rad/s] at ``time`` (n,) [s]; at both ends of a window it is closed."""
        low, high = np.array(self.regions).T
        region = np.full(time.shape, self.first)
        for window in self.windows:
            region[time >= window.end - SAME_TIME] = window.after
        lower, upper = low[region], high[region]
        for window in self.windows:
            inside = (time > window.start + SAME_TIME) & (time < window.end - SAME_TIME)
            sides = [window.before, window.after]
            lower[inside], upper[inside] = low[sides].min(), high[sides].max()
        return lower, upper

    def split(self, mesh: Mesh) -> Mesh:
        """``mesh`` with edges at the start and the end of every window, and inside so that it can be crossed at any
        time."""
        edges = [np.linspace(window.start, window.end, PARTS + 1) for window in self.windows]
        for time in np.unique(edges):
            inside = (mesh.start < time - SAME_TIME) & (time + SAME_TIME < mesh.end)
            interval = np.flatnonzero(inside)
            mesh = mesh.split(interval, np.full(len(interval), time)) if len(interval) else mesh
        return mesh


def windows_around(ramps: list[tuple[float, float, int, int]], lengths: list[float], end: float) -> tuple[Window, ...]:
    """Windows of at most these ``lengths`` [s] about ``ramps`` (start, end [s], region before and after), apart from
    each other and inside a mission that ends at ``end`` [s]."""
    between = [0.0, *(0.5 * (one[1] + other[0]) for one, other in pairwise(ramps)), end]
    windows = []
    for ramp, length, earliest, latest in zip(ramps, lengths, between, between[1:], strict=False):
        spare = 0.5 * max(length - (ramp[1] - ramp[0]), 0.0)
        windows.append(Window(max(ramp[0] - spare, earliest), min(ramp[1] + spare, latest), *ramp[2:]))
    return tuple(windows)
