"""How long the steps of a comparison took: on the clock, and of the processor."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass


@dataclass
class StepTime:
    """Seconds on the clock, and of the processor: of this process, and of the others where these say how much."""

    wall_s: float = 0.0
    cpu_s: float = 0.0


class StepTimes:
    """Times by the name of the step; ``say`` is told what begins."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self.known: dict[str, StepTime] = {}
        self.say = say

    @contextmanager
    def __call__(self, name: str) -> Iterator[StepTime]:
        """Time what is done in this context, added to what the step took before."""
        self.say(name)
        step = self.known.setdefault(name, StepTime())
        begun = clock.perf_counter(), clock.process_time()
        try:
            yield step
        finally:
            step.wall_s += clock.perf_counter() - begun[0]
            step.cpu_s += clock.process_time() - begun[1]

    def as_dict(self) -> dict[str, dict[str, float]]:
        """The times for ``summary.json``."""
        return {name: {"wall_s": step.wall_s, "cpu_s": step.cpu_s} for name, step in self.known.items()}
