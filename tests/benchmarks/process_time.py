"""Time of the process that a piece of work takes: the machines are noisy, so figures are ratios of these."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable


def process_time(action: Callable[[], object], repeats: int = 7) -> float:
    """Median of the process times [s]."""
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        action()
        times.append(time.process_time() - begin)
    return statistics.median(times)
