"""Figures of emissions: NOx and CO over the mission, and NOx by phase with its range over the fits of the combustor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vrsopt.report.emission_tables import foremost, label
from vrsopt.report.series import legend_beside, schedule_lines
from vrsopt.report.style import (
    GREY,
    MINUTE,
    NORMAL,
    SCHEDULE_STYLES,
    SMALL,
    draw_tasks,
    kind_handles,
    kinds_of,
    name_tasks,
    new_figure,
    tidy,
)
from vrsopt.report.tables import title
from vrsopt.schedule.emissions import nox_fits, phases

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vrsopt.schedule.comparison import Comparison

GRAMS_PER_MINUTE = 6e4  # from kg/s


def emission_figure(comparison: Comparison) -> Figure:
    """NOx and CO flow over the mission, tasks along the top; the range of NOx of the schedule that matters most."""
    figure = new_figure(10.0, 6.0)
    heights = [0.35, 1.7, 1.3]
    strip, nox, co = figure.subplots(3, 1, sharex=True, gridspec_kw={"height_ratios": heights})
    draw_tasks(strip, comparison.profile)
    _range(nox, comparison)
    for axes, name, text in ((nox, "nox", "NOx, g/min"), (co, "co", "CO, g/min")):
        flows = {key: GRAMS_PER_MINUTE * one.emissions.flow[name] for key, one in comparison.results.items()}
        schedule_lines(axes, comparison, flows)
        axes.set_ylabel(text, fontsize=NORMAL)
        axes.set_ylim(bottom=0.0)
        tidy(axes)
    legend_beside(nox, title="schedule")
    legend_beside(co, handles=kind_handles(kinds_of(comparison.profile)), title="task")
    co.set_xlabel("time, min", fontsize=NORMAL)
    co.set_xlim(0.0, comparison.profile.duration / MINUTE)
    figure.align_ylabels([nox, co])
    strip.set_title(f"{title(comparison)}: emissions", loc="left", fontsize=NORMAL + 2)
    figure.draw_without_rendering()
    name_tasks(strip, comparison.profile)
    return figure


def _range(axes: Axes, comparison: Comparison) -> None:
    """Band of NOx over the fits of the combustor."""
    name = foremost(comparison)
    result, colour = comparison.results[name], SCHEDULE_STYLES[name][0]
    flow = result.emissions.flow
    fits = GRAMS_PER_MINUTE * np.array([flow[fit] for fit in nox_fits(flow)])
    axes.fill_between(
        result.flight.time / MINUTE,
        fits.min(axis=0),
        fits.max(axis=0),
        color=colour,
        alpha=0.25,
        lw=0,
        label=f"all fits, {label(name)}",
    )


def phase_figure(comparison: Comparison) -> Figure:
    """NOx of every phase and schedule as bars, with its range over the fits of the combustor."""
    results = comparison.results
    flown = {
        name: phases(comparison.profile, result.flight.fuel_per_segment, result.emissions)
        for name, result in results.items()
    }
    names = [name for name, phase in flown["nominal"].items() if phase.duration > 0.0]
    figure = new_figure(max(6.0, 3.0 + 1.3 * len(names)), 4.5)
    axes = figure.subplots()
    place, width = np.arange(len(names)), 0.8 / len(results)
    for number, (name, phase) in enumerate(flown.items()):
        nox = 1e3 * np.array([phase[key].nox for key in names])
        low, high = 1e3 * np.array([phase[key].nox_range for key in names]).T
        axes.bar(
            place + (number - 0.5 * (len(results) - 1)) * width,
            np.nan_to_num(nox),
            width=0.92 * width,
            yerr=np.nan_to_num([nox - low, high - nox]).tolist(),  # rows of one number trip older Matplotlib
            color=GREY if name == "nominal" else SCHEDULE_STYLES[name][0],  # whiskers are not seen on black
            label=label(name),
            error_kw={"lw": 1.0, "capsize": 2.5},
        )
    axes.set_xticks(place, [f"{name}\n(indicative)" if name == "idle" else name for name in names])
    axes.set_ylabel("NOx, g", fontsize=NORMAL)
    axes.set_title(f"{title(comparison)}: NOx by phase", loc="left", fontsize=NORMAL + 2)
    tidy(axes)
    axes.grid(False, axis="x")
    legend_beside(axes, title="schedule")
    axes.tick_params(axis="x", labelsize=SMALL)
    return figure
