"""Rotor speed, twist and fuel flow against time on each mission, the nominal beside."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vrsopt.report.style import (
    BLACK,
    GREY,
    NORMAL,
    SMALL,
    VERMILION,
    at_gaps,
    draw_tasks,
    kind_handles,
    kinds_of,
    line_scale,
    new_figure,
    tidy,
)

from .finding import Finding, Picture, Table
from .flights import MISSIONS, flown, ready
from .missions import WORDS

QUANTITIES = ("rotor speed,\n% of nominal", "twist, deg", "fuel flow, kg/h")


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
    figure = new_figure(9.5, 6.8)
    strip, *panels = figure.subplots(4, 1, sharex=True, gridspec_kw={"height_ratios": [0.12, 1.0, 1.0, 1.0]})
    draw_tasks(strip, setup.profile)
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
    handles = panels[0].get_legend_handles_labels()[0]
    strip.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=SMALL, frameon=False)
    strip.set_title(WORDS.get(mission, mission), loc="left", fontsize=NORMAL + 1)
    kinds = kind_handles(kinds_of(setup.profile))
    figure.legend(handles=kinds, loc="outside lower center", ncols=len(kinds), fontsize=SMALL, frameon=False)
    panels[-1].set_ylim(bottom=0.0)
    panels[-1].set_xlabel("time, min", fontsize=NORMAL)
    panels[-1].set_xlim(0.0, setup.profile.duration / 60.0)
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
            f"{WORDS.get(mission, mission)}: off the ground, rotor speed from {speed.min():.0f} to {speed.max():.0f} "
            f"%, half of the nodes below {np.median(speed):.0f} %; twist from {twist.min():.1f} to {twist.max():.1f} "
            "deg."
        )
    head = [
        "mission",
        *(f"{which} {what}" for what in ("speed %", "twist deg") for which in ("least", "median", "most")),
    ]
    head += ["most nominal kg/h", "most optimum kg/h"]
    caption = (
        "Rotor speed, twist and fuel flow against time: nominal rotor in black, the optimum of the whole mission in "
        "colour, within rates of change and bounds; the kind of task along the top. On the ground no schedule acts."
    )
    figures = {f"schedules_{m}": Picture(draw(m), f"{WORDS.get(m, m)}. {caption}") for m in missions}
    said = (
        "The same three quantities against time, each operating point optimised by itself, climbs and descents by its "
        "table."
    )
    sentences.append(
        "Ours are optima of the whole mission; problems/missions.md has schedules of the study's kind beside them."
    )
    return Finding("Schedules against time", said, sentences, Table(head, rows), figures)
