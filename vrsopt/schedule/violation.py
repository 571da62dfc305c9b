"""What a flown schedule does that it must not: breach a limit, or stay in a forbidden band of the rotor speed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from vrsopt.schedule.bands import ForbiddenBand
from vrsopt.schedule.schedule import ON_LIMIT


@dataclass(frozen=True)
class Violation:
    """The worst breach of one limit: which, in which task, when [s], and by how much (0.01 is 1 % over)."""

    limit: str
    task: str
    time: float
    excess: float

    def __str__(self) -> str:
        return f"{self.limit} {100 * self.excess:.2f} % over its limit at {self.time:.0f} s ({self.task})"


@dataclass(frozen=True)
class Stay(Violation):
    """The longest stay in a forbidden band, ``duration`` [s] from ``time`` on; ``allowed`` [s]."""

    duration: float
    allowed: float

    def __str__(self) -> str:
        crossing = f"at most {self.allowed:g} s" if self.allowed > 0.0 else "not at all"
        return f"{self.limit}: {self.duration:.1f} s from {self.time:.0f} s on ({self.task}): {crossing}"


def too_long_stays(
    bands: Sequence[ForbiddenBand],
    *,
    nominal: float,
    tasks: Sequence[str],
    time: np.ndarray,
    rotor_speed: np.ndarray,
) -> tuple[Stay, ...]:
    """The longest stay of a flight in each band, where it is longer than the band's crossing time.

    ``rotor_speed`` [rad/s] at ``time`` [s], both (N,), linear in between; ``tasks`` at the nodes; ``nominal`` [rad/s].
    The edges of a band, and a thousandth of it inside, are outside.
    """
    found = []
    for band in bands:
        edge = ON_LIMIT * (band.upper - band.lower)
        stays = list(_stays(time, rotor_speed, band.lower + edge, band.upper - edge))
        start, end = max(stays, key=lambda stay: stay[1] - stay[0], default=(0.0, 0.0))
        if end - start > (1.0 + ON_LIMIT) * band.crossing_time:
            low, high = (100.0 * ends / nominal for ends in (band.lower, band.upper))
            task = tasks[int(np.searchsorted(time, start, side="right")) - 1]
            name = f"forbidden rotor speed {low:.4g} to {high:.4g} %"
            excess = (end - start) / band.crossing_time - 1.0 if band.crossing_time > 0.0 else float("inf")
            found.append(Stay(name, task, start, excess, end - start, band.crossing_time))
    return tuple(found)


def _stays(time: np.ndarray, values: np.ndarray, low: float, high: float) -> Iterator[tuple[float, float]]:
    """From when to when [s] ``values`` (N,), linear between the nodes, are between ``low`` and ``high``."""
    start, change = values[:-1], np.diff(values)
    steady = change == 0.0
    ends = [np.divide(bound - start, change, out=np.zeros(len(start)), where=~steady) for bound in (low, high)]
    enter, leave = np.clip(np.minimum(*ends), 0.0, 1.0), np.clip(np.maximum(*ends), 0.0, 1.0)
    inside = (start > low) & (start < high)
    enter, leave = np.where(steady, 0.0, enter), np.where(steady, np.where(inside, 1.0, 0.0), leave)
    step, begun = np.diff(time), None
    for i in np.flatnonzero(leave > enter):
        begun = float(time[i] + enter[i] * step[i]) if begun is None or enter[i] > 0.0 else begun
        if leave[i] < 1.0 or i + 1 == len(step) or not leave[i + 1] > enter[i + 1] or enter[i + 1] > 0.0:
            yield begun, float(time[i] + leave[i] * step[i])
            begun = None
