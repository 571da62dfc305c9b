"""Rotor speed, twist and fuel flow against time on each mission, the nominal beside."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vrsopt.report.style import BLACK, GREY, NORMAL, SMALL, VERMILION, at_gaps, line_scale, new_figure, tidy

from .finding import Finding, Table
from .flights import MISSIONS, flown, ready

QUANTITIES = ("rotor speed, %", "twist, deg", "fuel flow, kg/h")


def values(mission: str, strategy: str) -> list[np.ndarray]:
    """The QUANTITIES (N,) along the mission."""
    flight, settings = flown(mission, strategy).flight, ready(mission).settings
    speed = 100.0 * flight.rotor_speed / settings.nominal_rotor_speed
    return [speed, np.degrees(flight.twist), 3600.0 * flight.fuel_flow]


def draw(mission: str) -> Any:
    """Three panels over time, the bounds of rotor speed and twist drawn."""
    setup = ready(mission)
    settings, grid = setup.settings, setup.grid
    bounds = [100.0 * np.array(settings.rotor_speed_bounds) / settings.nominal_rotor_speed]
    bounds += [np.degrees(settings.twist_bounds)]
    figure = new_figure(9.5, 6.4)
    panels = figure.subplots(3, 1, sharex=True)
    for axes, words, k in zip(panels, QUANTITIES, range(3), strict=True):
        for strategy, colour in (("nominal", BLACK), ("both", VERMILION)):
            label = "nominal" if strategy == "nominal" else "optimum of the mission"
            pieces = at_gaps(grid.segment, grid.time, values(mission, strategy)[k])
            times = at_gaps(grid.segment, grid.time, grid.time / 60.0)
            for time, piece in zip(times, pieces, strict=True):
                axes.plot(time, piece, color=colour, lw=1.3 * line_scale(setup.profile), label=label)
                label = None
        for bound in bounds[k] if k < 2 else ():
            axes.axhline(bound, color=GREY, ls="--", lw=1.0)
        axes.set_ylabel(words, fontsize=NORMAL)
        tidy(axes)
    panels[0].plot([], [], color=GREY, ls="--", lw=1.0, label="bounds")
    panels[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, fontsize=SMALL, frameon=False)
    panels[0].set_title(mission.upper(), loc="right", fontsize=NORMAL + 1)
    panels[-1].set_ylim(bottom=0.0)
    panels[-1].set_xlabel("time, min", fontsize=NORMAL)
    figure.align_ylabels(panels)
    return figure


def run(missions: Sequence[str] = MISSIONS) -> Finding:
    """Nominal and optimum on each mission."""
    rows, sentences = [], []
    for mission in missions:
        air = ~np.asarray(ready(mission).grid.conditions.idle)
        speed, twist, fuel = (value[air] for value in values(mission, "both"))
        base = values(mission, "nominal")[2][air]
        cells = [speed.min(), np.median(speed), speed.max(), twist.min(), np.median(twist), twist.max()]
        rows.append([mission.upper(), *(round(float(cell), 2) for cell in (*cells, base.max(), fuel.max()))])
        sentences.append(
            f"{mission.upper()}: rotor speed from {speed.min():.0f} to {speed.max():.0f} %, half of the nodes below "
            f"{np.median(speed):.0f} %; twist from {twist.min():.1f} to {twist.max():.1f} deg."
        )
    head = [
        "mission",
        *(f"{which} {what}" for what in ("speed %", "twist deg") for which in ("least", "median", "most")),
    ]
    head += ["most nominal kg/h", "most optimum kg/h"]
    figures = {f"schedules_{mission}": draw(mission) for mission in missions}
    return Finding("Schedules against time", sentences, Table(head, rows), figures)
