"""Where the saving comes from, in words and numbers: by cause, by task and by schedule, on the physics."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.report.emission_tables import FOREMOST, label, number
from vrsopt.report.style import MINUTE, task_spans
from vrsopt.schedule.saving import CAUSES, Saving, savings

if TYPE_CHECKING:
    from vrsopt.schedule.comparison import Comparison

# what people are told, of what is in CAUSES
GROUPS: Mapping[str, tuple[str, ...]] = {
    "rotor profile": ("profile",),
    "rotor induced": ("induced",),
    "tail rotor": ("tail rotor",),
    "other power": ("parasite", "climb", "rest", "engine idle"),
    "rotor energy": ("rotor energy",),
    "engine load": ("engine load",),
    "turbine speed": ("turbine speed",),
}
MEANING: Mapping[str, str] = {
    "rotor profile": "drag of the main rotor's blades",
    "rotor induced": "lift of the main rotor; what is not burned is carried",
    "tail rotor": "all of the tail rotor's power",
    "other power": "parasite drag, climb, accessories, damping of the blades, and what idling engines give unasked",
    "rotor energy": "what speeds the rotor up, less what comes back",
    "engine load": "engines at another load need more or less fuel per kWh",
    "turbine speed": "power turbines at another speed need more or less fuel per kWh",
}
SAVING_HEADINGS = ("schedule", "saved kg", "saved %", *GROUPS)
SAVING_LEGEND = (
    "saved: fuel on the physics against the nominal schedule, negative where more is burned; causes in per cent of the "
    "nominal schedule's fuel, which sum to saved"
)
CAUSE_HEADINGS = ("cause", "kg", "%", "what it is")
CAUSE_LEGEND = (
    "a change of power is charged at the mean of both schedules' specific consumption, a change of specific "
    "consumption at the mean of their power, at every node of the flight on the physics; the causes sum to the "
    "difference of the two flights' fuel; powers are those at the engines' shafts, losses of the gearboxes included"
)
TASK_SAVING_HEADINGS = ("task", "at min", "min", "nominal kg", "saved kg", "saved %", "of all %", *GROUPS)
TASK_SAVING_LEGEND = "of all: share of the mission's saving; causes in kg"


def flyable_savings(comparison: Comparison) -> dict[str, Saving]:
    """What every schedule but the nominal one saves, of those that are flyable."""
    found = savings(comparison.profile, comparison.limits, comparison.results)
    return {name: one for name, one in found.items() if comparison.results[name].success}


def foremost_saving(comparison: Comparison) -> tuple[str, Saving] | None:
    """The flyable schedule that matters most, and what it saves; None if there is none but the nominal one."""
    found = flyable_savings(comparison)
    return next(((name, found[name]) for name in FOREMOST if name in found), None)


def grouped(saved: Saving) -> dict[str, np.ndarray]:
    """Fuel saved (S,) [kg] in every segment, by the causes of GROUPS."""
    row = dict(zip(CAUSES, saved.causes, strict=True))
    return {name: np.sum([row[cause] for cause in causes], axis=0) for name, causes in GROUPS.items()}


def saving_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    """One row per schedule but the nominal one, in the order of SAVING_HEADINGS; none for one that is not flyable."""
    found, rows = flyable_savings(comparison), []
    for name in comparison.results:
        if name in found:
            total = float(found[name].base.sum())
            values = [found[name].fuel, *(float(one.sum()) for one in grouped(found[name]).values())]
            texts = [number(values[0], "+.2f"), *(number(100.0 * value / total, "+.2f") for value in values)]
            rows.append((label(name), *texts))
        elif name != "nominal":
            rows.append((label(name), *("-" for _ in SAVING_HEADINGS[1:])))
    return rows


def cause_rows(comparison: Comparison, name: str) -> list[tuple[str, ...]]:
    """One row per cause of what the schedule ``name`` saves, and their sum, in the order of CAUSE_HEADINGS."""
    saved = flyable_savings(comparison)[name]
    total = float(saved.base.sum())
    rows = [(cause, float(kg.sum()), MEANING[cause]) for cause, kg in grouped(saved).items()]
    rows.append(("mission", saved.fuel, f"of {total:.2f} kg with the nominal schedule"))
    return [(cause, number(kg, "+.3f"), number(100.0 * kg / total, "+.2f"), words) for cause, kg, words in rows]


def task_saving_rows(comparison: Comparison, name: str) -> list[tuple[str, ...]]:
    """One row per task in their order, and their sum, in the order of TASK_SAVING_HEADINGS.

    ``name``: of the schedule.
    """
    saved, profile = flyable_savings(comparison)[name], comparison.profile
    groups = grouped(saved)
    spans = [(span.task, span.start, span.end, span.segments) for span in task_spans(profile)]
    spans.append(("mission", 0.0, profile.duration, range(len(profile.segments))))
    rows = []
    for task, start, end, segments in spans:
        here = list(segments)
        base, kg = float(saved.base[here].sum()), float(saved.per_segment[here].sum())
        rows.append(
            (
                task,
                number(start / MINUTE, ".1f"),
                number((end - start) / MINUTE, ".1f"),
                number(base, ".2f"),
                number(kg, "+.3f"),
                number(100.0 * kg / base if base > 0.0 else math.nan, "+.1f"),
                number(100.0 * kg / saved.fuel if saved.fuel else math.nan, ".1f"),
                *(number(float(one[here].sum()), "+.3f") for one in groups.values()),
            )
        )
    return rows
