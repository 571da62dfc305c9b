"""The mission over time: how high, how fast, how steep and how banked it is flown, how heavy, and what that burns."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vrsopt.mission.flight_path import flight_path
from vrsopt.report.emission_tables import foremost
from vrsopt.report.series import legend_beside, schedule_lines
from vrsopt.report.style import (
    BLACK,
    GREY,
    MINUTE,
    NORMAL,
    ORANGE,
    SKY,
    draw_tasks,
    kind_handles,
    kinds_of,
    name_tasks,
    new_figure,
    tidy,
)
from vrsopt.report.tables import title

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vrsopt.schedule.comparison import Comparison

STEP = 1.0  # s
LEAST_BANK = 5.0  # deg, ends of the axis for a mission without turns
FORWARD = 15.0  # m/s, ground speed above which a climb angle is that of forward flight
LINE = 1.0  # width


def mission_figure(comparison: Comparison) -> Figure:
    """Altitude, speeds, angles, load factor, gross mass and fuel flow over the mission, tasks along the top."""
    profile = comparison.profile
    path = flight_path(profile, STEP)
    figure = new_figure(10.0, 11.0)
    heights = [0.35, 1.0, 1.0, 1.0, 1.0, 0.8, 0.8, 1.4]
    axes = figure.subplots(len(heights), 1, sharex=True, gridspec_kw={"height_ratios": heights})
    strip, altitude, speed, angle, bank, load, mass, fuel = axes
    draw_tasks(strip, profile)
    _altitude(altitude, path)
    _speed(speed, path, windy=not profile.wind.calm)
    _angles(angle, path)
    _bank(bank, path)
    _line(load, path, path["load_factor"].to_numpy(), None)
    load.set_ylabel("load factor")
    _flown(mass, fuel, comparison)
    for panel in axes[1:]:
        tidy(panel)
        panel.yaxis.label.set_size(NORMAL)
    axes[-1].set_xlabel("time, min", fontsize=NORMAL)
    axes[-1].set_xlim(0.0, profile.duration / MINUTE)
    figure.align_ylabels(axes[1:])
    strip.set_title(f"{title(comparison)}: mission profile", loc="left", fontsize=NORMAL + 2)
    kinds = legend_beside(bank, handles=kind_handles(kinds_of(profile)), title="task")
    kinds.set_in_layout(False)  # reaches down beside the next panels, which have no legend
    figure.draw_without_rendering()
    name_tasks(strip, profile)
    return figure


def _altitude(axes: Axes, path: xr.Dataset) -> None:
    """Altitude, and the ground where it is known."""
    height = path["height"].to_numpy()
    ground = np.where(np.isfinite(height), path["altitude"].to_numpy() - height, np.nan)
    axes.set_ylabel("altitude, m")
    _line(axes, path, path["altitude"].to_numpy(), "aircraft")
    if np.isfinite(ground).any():
        axes.fill_between(path["time"] / MINUTE, ground, color=GREY, lw=0, alpha=0.6)
        axes.plot(path["time"] / MINUTE, ground, color=GREY, linewidth=2.0, label="ground", zorder=1.5)
        legend_beside(axes)
    axes.set_ylim(bottom=0.0)


def _speed(axes: Axes, path: xr.Dataset, *, windy: bool) -> None:
    axes.set_ylabel("speed, m/s")
    if windy:
        _line(axes, path, path["ground_speed"].to_numpy(), "over the ground", colour=ORANGE)
    _line(axes, path, path["speed"].to_numpy(), "true airspeed")
    if windy:
        legend_beside(axes)
    axes.set_ylim(bottom=0.0)


def _angles(axes: Axes, path: xr.Dataset) -> None:
    axes.set_ylabel("climb angle, deg")
    _line(
        axes,
        path,
        np.degrees(path["equivalent_climb_angle"].to_numpy()),
        "equal forces,\nsteady flight",
        colour=SKY,
        width=2.0,
    )
    _line(axes, path, np.degrees(path["climb_angle"].to_numpy()), "flight path")
    forward = path["ground_speed"].to_numpy() > FORWARD
    shown = np.degrees(path["equivalent_climb_angle"].to_numpy()[forward])
    if len(shown):  # vertical flight, at 90 deg, goes off the scale
        axes.set_ylim(1.2 * min(shown.min(), -5.0), 1.2 * max(shown.max(), 5.0))
    legend_beside(axes)


def _bank(axes: Axes, path: xr.Dataset) -> None:
    axes.set_ylabel("bank, deg\n(right +)")
    bank = np.degrees(path["bank"].to_numpy())
    _line(axes, path, bank, None)
    axes.set_ylim(1.1 * min(bank.min(), -LEAST_BANK), 1.1 * max(bank.max(), LEAST_BANK))


def _flown(mass: Axes, fuel: Axes, comparison: Comparison) -> None:
    """Gross mass and fuel flow of the nominal schedule and of the one that matters most."""
    names = dict.fromkeys(("nominal", foremost(comparison)))
    flights = {name: comparison.results[name].flight for name in names}
    schedule_lines(mass, comparison, {name: flight.mass for name, flight in flights.items()})
    schedule_lines(fuel, comparison, {name: 3600.0 * flight.fuel_flow for name, flight in flights.items()})
    mass.set_ylabel("gross mass, kg")
    fuel.set_ylabel("fuel flow, kg/h")
    legend_beside(fuel, title="schedule")


def _line(
    axes: Axes, path: xr.Dataset, values: np.ndarray, text: str | None, *, colour: str = BLACK, width: float = LINE
) -> None:
    axes.plot(path["time"] / MINUTE, values, color=colour, linewidth=width, label=text)
