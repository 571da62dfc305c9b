"""The check on the physics, in words and numbers: every schedule flown on the surrogate and on the physics."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.limits import LIMIT_NAMES
from vrsopt.report.emission_tables import label, number
from vrsopt.report.style import MINUTE, TaskSpan, task_spans
from vrsopt.schedule.quadrature import per_segment

if TYPE_CHECKING:
    from vrsopt.schedule.comparison import Comparison, ScheduleResult

PHYSICS_HEADINGS = (
    "schedule",
    "surrogate kg",
    "physics kg",
    "differ %",
    "most in",
    "there g",
    "there %",
    "std %",
    "quadrature g",
    "residual",
    "nodes",
)
PHYSICS_LEGEND = (
    "differ: fuel on the surrogate against the physics; most in: the task in which they differ by most fuel; std: "
    "largest standard deviation of the rotors' power that the surrogate predicts along the flight, against that "
    "power; quadrature: error of the integral on the physics; residual: the largest of all trims and gas paths, scaled"
)
USAGE_HEADINGS = ("limit", "surrogate %", "physics %", "at min", "task")
USAGE_LEGEND = "largest use of each limit in flight, 100 is on the limit; time and task are those on the physics"


def physics_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    """One row per schedule, in the order of PHYSICS_HEADINGS."""
    rows: list[tuple[str, ...]] = []
    for name, result in comparison.results.items():
        flight, physics = result.flight, result.physics
        rows.append(
            (
                label(name),
                number(flight.fuel, ".3f"),
                number(physics.fuel, ".3f"),
                number(100.0 * (flight.fuel / physics.fuel - 1.0), "+.3f"),
                *_worst_task(comparison, result),
                number(result.surrogate_std_percent, ".2f"),
                number(1e3 * physics.quadrature_error, ".1f"),
                f"{physics.residual_norm:.0e}",
                str(len(physics.time)),
            )
        )
    return rows


def _worst_task(comparison: Comparison, result: ScheduleResult) -> tuple[str, str, str]:
    """Task in which surrogate and physics differ most, by how much [g], and by how much of its fuel [%]."""
    power = result.physics.shaft_power
    if power is None:
        return "-", "-", "-"
    physics, count = result.physics, len(comparison.profile.segments)
    segment, time = np.asarray(physics.segment), np.asarray(physics.time)
    burned = per_segment(segment, time, power.fuel_flow, np.arange(len(time)), count)

    def both(span: TaskSpan) -> tuple[float, float]:
        here = list(span.segments)
        return float(result.flight.fuel_per_segment[here].sum()), float(burned[here].sum())

    known = {span: both(span) for span in task_spans(comparison.profile)}
    span = max(known, key=lambda one: abs(known[one][0] - known[one][1]))
    surrogate, own = known[span]
    words = f"{span.task}, {span.start / MINUTE:.1f} min"
    return words, number(1e3 * (surrogate - own), "+.1f"), number(100.0 * (surrogate / own - 1.0), "+.2f")


def usage_rows(comparison: Comparison, name: str) -> list[tuple[str, ...]]:
    """One row per limit of the schedule ``name``, in the order of USAGE_HEADINGS."""
    result = comparison.results[name]
    physics, rows = result.physics, list[tuple[str, ...]]()
    for limit, own, usages in zip(LIMIT_NAMES, result.flight.limits, physics.usages, strict=True):
        surrogate = 100.0 * (1.0 + np.max(own, where=np.isfinite(own), initial=-1.0))
        known = np.flatnonzero(np.isfinite(usages))
        if not known.size:
            rows.append((limit, number(surrogate, ".2f"), "-", "-", "-"))
            continue
        node = known[np.argmax(usages[known])]
        task = comparison.profile.segments[physics.segment[node]].task
        at = number(physics.time[node] / MINUTE, ".1f")
        rows.append((limit, number(surrogate, ".2f"), number(100.0 * usages[node], ".2f"), at, task))
    return rows


def largest_usage(result: ScheduleResult) -> tuple[str, float]:
    """The limit that is used most on the physics, and by how much [%]; nan if nothing was flown."""
    largest = [float(np.max(row, where=np.isfinite(row), initial=-math.inf)) for row in result.physics.usages]
    most = int(np.argmax(largest))
    return LIMIT_NAMES[most], 100.0 * largest[most] if math.isfinite(largest[most]) else math.nan
