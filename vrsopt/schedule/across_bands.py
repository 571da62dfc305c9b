"""Steps of a schedule across forbidden bands, made quick: the rotor waits at an edge and then goes over at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vrsopt.schedule.bands import ForbiddenBand

SHARE = 0.5  # of the time that a crossing may take: a flight sampled each second sees it up to two seconds longer


def across_bands(
    segment: np.ndarray,
    time: np.ndarray,
    rotor_speed: np.ndarray,
    twist: np.ndarray,
    bands: Sequence[ForbiddenBand],
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Nodes (n,) of a schedule and those that it needs at the edges of ``bands``, in order.

    Where the straight line between two nodes of a segment takes longer over a band than allowed, the crossing is
    shortened about its middle; the twist stays on its line. ``segment``, ``time`` [s], ``rotor_speed`` [rad/s] and
    ``twist`` [rad] (n,) of the nodes.
    """
    rows = list(zip(segment, time, rotor_speed, twist, strict=True))
    for k in np.flatnonzero(np.diff(segment) == 0):
        (start, end), (low, high) = sorted(time[k : k + 2]), sorted(rotor_speed[k : k + 2])
        rising = rotor_speed[k + 1] > rotor_speed[k]
        for band in bands:
            if not low <= band.lower < band.upper <= high:
                continue
            rate = (high - low) / (end - start)
            duration = (band.upper - band.lower) / rate
            if duration <= band.crossing_time:
                continue
            edges = (band.lower, band.upper) if rising else (band.upper, band.lower)
            middle = start + abs(0.5 * (band.lower + band.upper) - rotor_speed[k]) / rate
            for edge, side in zip(edges, (-0.5, 0.5), strict=True):
                at = middle + side * SHARE * band.crossing_time
                rows.append((segment[k], at, edge, np.interp(at, time[k : k + 2], twist[k : k + 2])))
    rows.sort(key=lambda row: row[:2])
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return columns[0], columns[1], columns[2], columns[3]
