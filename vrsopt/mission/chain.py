"""A way over the ground that is taken up piece by piece, as far as it is flown."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator

from vrsopt.mission.route import SHORTEST, Path, Pose


class Chain:
    """A chain of pieces, each beginning where the one before ended; a pattern may go on for ever."""

    def __init__(self, pieces: Iterable[Path]) -> None:
        self._rest: Iterator[Path] = iter(pieces)
        self._pieces: list[Path] = []
        self._starts: list[float] = [0.0]  # of each piece, and of the next

    def _reach(self, distance: float) -> None:
        """Take pieces until the way is ``distance`` [m] long, or ends."""
        while self._starts[-1] < distance:
            piece = next(self._rest, None)
            if piece is None:
                return
            if piece.length >= SHORTEST:
                self._pieces.append(piece)
                self._starts.append(self._starts[-1] + piece.length)

    @property
    def length(self) -> float:
        """Length [m] of a way that ends."""
        self._reach(float("inf"))
        return self._starts[-1]

    def piece_at(self, distance: float) -> tuple[Path, float, float]:
        """The piece that continues at ``distance`` [m], and where it starts and ends.

        The last one goes on for ever; what is asked about before the start of the way concerns the first.
        """
        self._reach(distance + SHORTEST)
        index = max(0, min(bisect_right(self._starts, distance + 0.5 * SHORTEST), len(self._pieces)) - 1)
        self._reach(self._starts[index + 1] + SHORTEST)
        last = index == len(self._pieces) - 1
        return self._pieces[index], self._starts[index], float("inf") if last else self._starts[index + 1]

    def pose(self, distance: float) -> Pose:
        """Position and course ``distance`` [m] along the way."""
        piece, start, _ = self.piece_at(distance)
        return piece.pose(distance - start)
