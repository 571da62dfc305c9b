"""Figures of a comparison: the way over the ground, the mission and the schedules over time, what they burn and emit.

Figures are made with Matplotlib's objects alone, so that they need no display and leave the user's own plots alone.
"""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.report.emission_plots import emission_figure, phase_figure
from vrsopt.report.map_plot import flight_path_figure
from vrsopt.report.mission_plot import mission_figure
from vrsopt.report.saving_plot import saving_figure
from vrsopt.report.series import schedule_figure
from vrsopt.report.style import BLUE, NORMAL, SKY, SMALL, new_figure, tidy, two_lines
from vrsopt.report.tables import label, title, verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vrsopt.schedule.comparison import Comparison, ScheduleResult

__all__ = [
    "emission_figure",
    "figures",
    "flight_path_figure",
    "fuel_figure",
    "mission_figure",
    "phase_figure",
    "png",
    "saving_figure",
    "schedule_figure",
]


LONGEST_NAME = 24  # letters of a schedule's name on one line below its bar


def figures(comparison: Comparison) -> dict[str, Figure]:
    """All figures of ``comparison`` (without its variants) by the name of their file; that of what is saved only where
    a schedule saves or costs something."""
    saving = saving_figure(comparison)
    return {
        "flight_path": flight_path_figure(comparison),
        "mission_profile": mission_figure(comparison),
        "schedules": schedule_figure(comparison),
        "fuel": fuel_figure(comparison),
        "emissions": emission_figure(comparison),
        "phases": phase_figure(comparison),
    } | ({"saving": saving} if saving is not None else {})


def png(figure: Figure, *, dpi: float = 110) -> bytes:
    """The figure as a PNG; the same figure gives the same bytes.

    ``dpi``: pixels per inch.
    """
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=dpi, metadata={"Software": None})
    return stream.getvalue()


def fuel_figure(comparison: Comparison) -> Figure:
    """Fuel of every schedule, on the surrogate and on the physics."""
    results = comparison.results
    figure = new_figure(max(6.0, 2.0 + 1.7 * len(results)), 4.5)
    axes = figure.subplots()
    place = np.arange(len(results))
    both = (
        ("surrogate", BLUE, [result.flight.fuel for result in results.values()]),
        ("physics", SKY, [result.physics.fuel for result in results.values()]),
    )
    for side, (text, colour, fuel) in zip((-0.2, 0.2), both, strict=True):
        bars = axes.bar(place + side, np.nan_to_num(fuel), width=0.38, color=colour, label=text)
        values = [f"{value:.2f}" if math.isfinite(value) else "none" for value in fuel]
        axes.bar_label(bars, values, fontsize=SMALL, padding=2)
    axes.set_xticks(place, [_bar_name(name, result) for name, result in results.items()])
    axes.set_ylabel("fuel burned, kg", fontsize=NORMAL)
    axes.set_title(f"{title(comparison)}: fuel", loc="left", fontsize=NORMAL + 2)
    tidy(axes)
    axes.grid(False, axis="x")
    axes.margins(y=0.12)
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=SMALL, frameon=False)
    return figure


def _bar_name(name: str, result: ScheduleResult) -> str:
    """Name of a schedule with its changes of fuel, or why it has none."""
    words = label(name) if len(label(name)) <= LONGEST_NAME else two_lines(label(name))
    if not result.success:
        return f"{words}\n{verdict(result).partition(':')[0]}"
    lines = [words]
    if name != "nominal":
        lines += [f"{result.fuel_delta_percent:+.2f} %", f"physics {result.fuel_physics_delta_percent:+.2f} %"]
    return "\n".join(lines)
