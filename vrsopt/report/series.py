"""The schedules over time: what is flown, what is chosen, what it burns and how near the limits it is."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from vrsopt.report.emission_tables import foremost
from vrsopt.report.style import (
    GREY,
    LIMIT_STYLES,
    MINUTE,
    NORMAL,
    SCHEDULE_STYLES,
    SMALL,
    at_gaps,
    draw_tasks,
    kind_handles,
    kinds_of,
    line_scale,
    name_tasks,
    new_figure,
    tidy,
)
from vrsopt.report.tables import label, title, verdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

    from vrsopt.schedule.comparison import Comparison

BOUND: dict[str, Any] = {"color": "#666666", "linestyle": ":", "linewidth": 1.0}


def schedule_figure(comparison: Comparison) -> Figure:
    """Speed, altitude, rotor speed, twist, fuel flow and use of the limits over the mission, tasks along the top."""
    figure = new_figure(10.0, 11.5)
    heights = [0.35, 0.8, 0.8, 1.7, 1.3, 1.3, 1.5]
    axes = figure.subplots(len(heights), 1, sharex=True, gridspec_kw={"height_ratios": heights})
    draw_tasks(axes[0], comparison.profile)
    _flight(axes[1], axes[2], comparison)
    _rotor_speed(axes[3], comparison)
    _twist(axes[4], comparison)
    _fuel_flow(axes[5], comparison)
    _limits(axes[6], comparison)
    for panel in axes[1:]:
        tidy(panel)
        panel.yaxis.label.set_size(NORMAL)
    axes[-1].set_xlabel("time, min", fontsize=NORMAL)
    axes[-1].set_xlim(0.0, comparison.profile.duration / MINUTE)
    figure.align_ylabels(axes[1:])
    axes[0].set_title(f"{title(comparison)}: schedules", loc="left", fontsize=NORMAL + 2)
    kinds = legend_beside(axes[0], handles=kind_handles(kinds_of(comparison.profile)), title="task")
    kinds.set_in_layout(False)  # reaches down beside the next panels, which have no legend
    figure.draw_without_rendering()
    name_tasks(axes[0], comparison.profile)
    return figure


def _flight(speed: Axes, altitude: Axes, comparison: Comparison) -> None:
    nodes = comparison.profile.grid(1.0)
    for axes, values, text in ((speed, nodes.speed, "speed, m/s"), (altitude, nodes.altitude, "altitude, m")):
        axes.plot(nodes.time / MINUTE, values, color="black", linewidth=1.2)
        axes.set_ylabel(text)
        axes.set_ylim(bottom=0.0)
        axes.margins(y=0.12)


def _rotor_speed(axes: Axes, comparison: Comparison) -> None:
    settings, band = comparison.settings, comparison.band
    percent = 100 / settings.nominal_rotor_speed
    columns = (at_gaps(band.segment, band.time, values) for values in (band.time, band.lower, band.upper))
    for number, (time, low, high) in enumerate(zip(*columns, strict=True)):
        text = "within 0.5 % of least fuel" if number == 0 else None
        axes.fill_between(time / MINUTE, percent * low, percent * high, color=GREY, alpha=0.4, lw=0, label=text)
    schedule_lines(
        axes, comparison, {name: percent * result.flight.rotor_speed for name, result in comparison.results.items()}
    )
    for number, forbidden in enumerate(settings.forbidden_bands):
        text = "forbidden, crossing only" if number == 0 else None
        low, high = percent * forbidden.lower, percent * forbidden.upper
        axes.axhspan(low, high, facecolor="none", edgecolor=GREY, hatch="///", linewidth=0.0, label=text, zorder=0.5)
    _bounds(axes, [percent * bound for bound in settings.rotor_speed_bounds])
    axes.set_ylabel("rotor speed, %")
    legend_beside(axes, title="schedule")


def _twist(axes: Axes, comparison: Comparison) -> None:
    schedule_lines(
        axes, comparison, {name: np.degrees(result.flight.twist) for name, result in comparison.results.items()}
    )
    _bounds(axes, [math.degrees(bound) for bound in comparison.settings.twist_bounds])
    axes.set_ylabel("blade twist, deg")
    handles, labels = axes.get_legend_handles_labels()
    legend_beside(axes, handles=handles[-1:], labels=labels[-1:])


def _fuel_flow(axes: Axes, comparison: Comparison) -> None:
    schedule_lines(
        axes, comparison, {name: 3600 * result.flight.fuel_flow for name, result in comparison.results.items()}
    )
    axes.set_ylabel("fuel flow, kg/h")


def _limits(axes: Axes, comparison: Comparison) -> None:
    """Use of every limit by the schedule that matters most."""
    name = foremost(comparison)
    flight = comparison.results[name].flight
    time, scale = flight.time / MINUTE, line_scale(comparison.profile)
    for row, (colour, width), limit in zip(flight.limits, LIMIT_STYLES, flight.time_on_limits, strict=True):
        axes.plot(time, _usage_percent(row), color=colour, linewidth=scale * width, zorder=3 - width / 10, label=limit)
    axes.axhline(100.0, **BOUND, label="limit")
    axes.set_ylabel("use of limits, %")
    axes.set_ylim(bottom=0.0)
    legend_beside(axes, title=f"limits, {label(name)}")


def schedule_lines(axes: Axes, comparison: Comparison, values: dict[str, np.ndarray]) -> None:
    """One line per schedule over the fine grid.

    ``values``: what is drawn, from the result of a schedule.
    """
    scale = line_scale(comparison.profile)
    for name, series in values.items():
        colour, style, width = SCHEDULE_STYLES[name]
        result = comparison.results[name]
        text = label(name) if result.success else f"{label(name)} ({verdict(result).partition(':')[0]})"
        axes.plot(
            result.flight.time / MINUTE, series, color=colour, linestyle=style, linewidth=scale * width, label=text
        )


def _bounds(axes: Axes, bounds: list[float]) -> None:
    for text, bound in zip(("bounds", None), bounds, strict=True):
        axes.axhline(bound, **BOUND, label=text)
    axes.margins(y=0.08)


def legend_beside(axes: Axes, **options: Any) -> Legend:
    """A legend to the right of the axes, outside the data.

    ``options`` go to matplotlib.
    """
    return axes.legend(
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        fontsize=SMALL,
        title_fontsize=SMALL,
        frameon=False,
        alignment="left",
        borderaxespad=0.0,
        **options,
    )


def _usage_percent(limits: np.ndarray) -> np.ndarray:
    """Use of a limit in per cent; idle, where there is none, as nan."""
    return np.where(np.isfinite(limits), 100.0 * (1.0 + limits), np.nan)
