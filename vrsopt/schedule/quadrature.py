"""Integrals over a mission of what may jump at a node: it has one value before and one after each node.

``segment`` (N,) is that of each node, sorted; both ends of every segment are nodes, so edges occur twice. ``time`` (N,)
[s] and ``sides`` (N, 2), the values before and after, are given by node.
"""

from __future__ import annotations

import numpy as np


def per_segment(segment: np.ndarray, time: np.ndarray, sides: np.ndarray, nodes: np.ndarray, count: int) -> np.ndarray:
    """Integral (count,) over each segment, by the trapezoidal rule on ``nodes``, of what has a value before and one
    after every node, (N, 2). A segment that has a value that is not a number has none itself."""
    here = segment[nodes]
    same = np.diff(here) == 0
    step = np.diff(time[nodes])[same]
    start, end = nodes[:-1][same], nodes[1:][same]
    return np.bincount(here[:-1][same], weights=0.5 * step * (sides[start, 1] + sides[end, 0]), minlength=count)


def smooth_error(segment: np.ndarray, time: np.ndarray, sides: np.ndarray) -> float:
    """Error of the trapezoidal rule where nodes are evenly spaced: its difference from Simpson's rule, on pairs of
    equal steps. Jumps of the slope at other nodes cost it nothing, and are not counted."""
    error, node = 0.0, 1
    while node < len(time) - 1:
        before, after = time[node] - time[node - 1], time[node + 1] - time[node]
        if segment[node - 1] == segment[node + 1] and abs(before - after) <= 1e-6 * before:
            error += before / 6.0 * (sides[node - 1, 1] - np.sum(sides[node]) + sides[node + 1, 0])
            node += 1
        node += 1
    return float(abs(error))


def thinned(segment: np.ndarray, stride: int) -> np.ndarray:
    """Indices of every ``stride``-th node of each segment, and of its last.

    Two is the grid of twice the step, from which the quadrature error is estimated.
    """
    every = np.arange(len(segment))
    first = np.searchsorted(segment, segment, side="left")
    last = np.searchsorted(segment, segment, side="right") - 1
    return np.flatnonzero(((every - first) % stride == 0) | (every == last))


def mean_of_sides(values: np.ndarray, segment: np.ndarray) -> np.ndarray:
    """Mean (N,) of the values (N, 2) before and after each node; at an edge only the side inside the segment counts."""
    inside = np.diff(segment) == 0
    before, after = np.append(False, inside), np.append(inside, False)
    return np.where(before, np.where(after, values.mean(axis=-1), values[:, 0]), values[:, 1])


def sparse(segment: np.ndarray, time: np.ndarray, sides: np.ndarray, *, tolerance: float, longest: int) -> np.ndarray:
    """Indices of few nodes between which ``sides`` (N, 2) is a straight line within ``tolerance``, relative.

    Both ends of every segment are among them and both sides of every jump; no piece has more than ``longest`` steps.
    What varies smoothly with ``sides`` can be integrated on these nodes in place of all.
    """
    kept, start = [0], 0
    for node in range(1, len(time)):
        if segment[node] != segment[start]:
            kept += [node - 1, node]
            start = node
        elif node - start > longest or not _straight(time, sides, start, node, tolerance):
            start = node - 1  # the piece up to the node before was straight
            kept.append(start)
    return np.unique([*kept, len(time) - 1])


def _straight(time: np.ndarray, sides: np.ndarray, start: int, end: int, tolerance: float) -> bool:
    """Whether both sides of the nodes between ``start`` and ``end`` lie on the line from one to the other."""
    share = (time[start + 1 : end] - time[start]) / (time[end] - time[start])
    line = sides[start, 1] + share * (sides[end, 0] - sides[start, 1])
    return bool(np.all(np.abs(sides[start + 1 : end] - line[:, None]) <= tolerance * line[:, None]))


def filled(time: np.ndarray, nodes: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Values (N, 2) at all nodes from ``sides`` (n, 2) at those of :func:`sparse`: straight lines in between."""
    every = np.arange(len(time))
    before = np.searchsorted(nodes, every, side="right") - 1
    after = np.minimum(before + 1, len(nodes) - 1)
    span = np.where(nodes[before] == every, 1.0, time[nodes[after]] - time[nodes[before]])
    line = sides[before, 1] + (time - time[nodes[before]]) / span * (sides[after, 0] - sides[before, 1])
    return np.where((nodes[before] == every)[:, None], sides[before], line[:, None])
