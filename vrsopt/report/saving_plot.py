"""Figure of where the saving comes from: by cause, one on top of the other to what is saved, and by task."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vrsopt.report.emission_tables import label, number
from vrsopt.report.saving_tables import foremost_saving, grouped
from vrsopt.report.series import legend_beside
from vrsopt.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    NORMAL,
    ORANGE,
    SKY,
    SMALL,
    VERMILION,
    YELLOW,
    kind_name,
    new_figure,
    task_spans,
    tidy,
)
from vrsopt.report.tables import title

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vrsopt.schedule.comparison import Comparison
    from vrsopt.schedule.saving import Saving

CAUSE_COLOURS = {
    "rotor profile": BLUE,
    "rotor induced": SKY,
    "tail rotor": GREEN,
    "other power": GREY,
    "rotor energy": YELLOW,
    "engine load": VERMILION,
    "turbine speed": ORANGE,
}
MOST_TASKS = 24  # bars; a mission of more tasks is shown by kinds of task
BAR = 0.26  # inches


def saving_figure(comparison: Comparison) -> Figure | None:
    """What the flyable schedule that matters most saves, by cause and by task; None if there is nothing to show."""
    found = foremost_saving(comparison)
    if found is None:
        return None
    name, saved = found
    tasks = _tasks(comparison, saved)
    each = "task by task" if len(tasks) == len(task_spans(comparison.profile)) else "by kind of task"
    sizes = len(CAUSE_COLOURS) + 1, len(tasks)
    figure = new_figure(10.0, 2.2 + BAR * sum(sizes))
    causes, bars = figure.subplots(2, 1, gridspec_kw={"height_ratios": [size + 2 for size in sizes]})
    _waterfall(causes, saved)
    _stacked(bars, tasks)
    words = f"{title(comparison)}: fuel saved, {label(name)} against nominal, on the physics"
    causes.set_title(words, loc="left", fontsize=NORMAL + 2)
    for axes, text in ((causes, "fuel saved, kg: cause by cause"), (bars, f"fuel saved, kg: {each}")):
        axes.invert_yaxis()
        axes.set_xlabel(text, fontsize=NORMAL)
        axes.axvline(0.0, color=BLACK, linewidth=0.8)
        tidy(axes)
        axes.grid(False, axis="y")
    return figure


def _waterfall(axes: Axes, saved: Saving) -> None:
    """Every cause begins where the one above it ends; the last bar is the sum."""
    base, at = float(saved.base.sum()), 0.0
    causes = {cause: float(kg.sum()) for cause, kg in grouped(saved).items()}
    for row, (cause, kg) in enumerate(causes.items()):
        axes.barh(row, kg, left=at, color=CAUSE_COLOURS[cause], height=0.7)
        _tell(axes, row, max(at, at + kg), _both(kg, base))
        axes.plot([at + kg] * 2, [row + 0.35, row + 0.65], color=BLACK, linewidth=0.8)
        at += kg
    axes.barh(len(causes), at, color=BLACK, height=0.7)
    _tell(axes, len(causes), max(at, 0.0), _both(at, base))
    axes.set_yticks(np.arange(len(causes) + 1), [*causes, "saved"])
    low, high = axes.get_xlim()
    axes.set_xlim(low, high + 0.2 * (high - low))  # room for the numbers


def _stacked(axes: Axes, tasks: list[tuple[str, dict[str, float]]]) -> None:
    """One bar per task: what saves to the right, what costs to the left, a mark at the sum."""
    place = np.arange(len(tasks))
    ends = np.zeros((2, len(tasks)))
    for cause, colour in CAUSE_COLOURS.items():
        kg = np.array([causes[cause] for _, causes in tasks])
        side = (kg < 0.0).astype(int)
        left = ends[side, np.arange(len(tasks))]
        axes.barh(place, kg, left=left, color=colour, height=0.7, label=cause)
        ends[side, np.arange(len(tasks))] += kg
    axes.plot(
        ends.sum(axis=0),
        place,
        linestyle="",
        marker="D",
        markersize=5.5,
        color=BLACK,
        markeredgecolor="white",
        label="saved",
    )
    for row, (right, kg) in enumerate(zip(ends[0], ends.sum(axis=0), strict=True)):
        _tell(axes, row, right, number(kg, "+.2f"))
    axes.set_yticks(place, [task for task, _ in tasks])
    axes.margins(x=0.08)
    legend_beside(axes, title="cause")


def _both(kg: float, base: float) -> str:
    return f"{number(kg, '+.2f')} kg, {number(100.0 * kg / base, '+.1f')} %"


def _tell(axes: Axes, row: int, at: float, text: str) -> None:
    """A number to the right of a bar."""
    axes.annotate(text, (at, row), xytext=(4, 0), textcoords="offset points", va="center", fontsize=SMALL)


def _tasks(comparison: Comparison, saved: Saving) -> list[tuple[str, dict[str, float]]]:
    """Causes [kg] of every task, or kind of task, by its name."""
    profile, groups = comparison.profile, grouped(saved)
    spans = [(span.task, list(span.segments)) for span in task_spans(profile)]
    if len(spans) > MOST_TASKS:
        kinds = [segment.kind for segment in profile.segments]
        spans = [(kind_name(kind), np.flatnonzero(np.array(kinds) == kind).tolist()) for kind in dict.fromkeys(kinds)]
    return [(task, {cause: float(kg[here].sum()) for cause, kg in groups.items()}) for task, here in spans]
