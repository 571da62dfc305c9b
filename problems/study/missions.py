"""The missions on the map, with airspeed and altitude against time."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from vrsopt.mission.flight_path import flight_path, ground_distances
from vrsopt.report.plots import flight_path_figure
from vrsopt.report.style import BLACK, NORMAL, draw_tasks, kind_handles, kinds_of, new_figure, tidy

from .finding import Finding, Table
from .flights import MISSIONS, ready


def on_the_map(mission: str) -> Any:
    """The flight path; the drawing asks a comparison for no more than this."""
    setup = ready(mission)
    return flight_path_figure(
        SimpleNamespace(mission=setup.mission, profile=setup.profile, provenance={"variables": "both"})  # type: ignore[arg-type]
    )


def against_time(missions: Sequence[str]) -> Any:
    """True airspeed and altitude, a column for each mission, its tasks along the top."""
    figure = new_figure(4.2 * len(missions) + 0.4, 5.2)
    ratios = {"height_ratios": [0.12, 1.0, 1.0]}
    grid = figure.subplots(3, len(missions), sharex="col", squeeze=False, gridspec_kw=ratios)
    for (strip, speed, height), mission in zip(grid.T, missions, strict=True):
        profile = ready(mission).profile
        path = flight_path(profile, 1.0)
        draw_tasks(strip, profile)
        strip.set_title(mission.upper(), fontsize=NORMAL, loc="left")
        speed.plot(path["time"] / 60.0, path["speed"], color=BLACK, lw=1.0)
        height.plot(path["time"] / 60.0, path["altitude"], color=BLACK, lw=1.0)
        for axes in (speed, height):
            tidy(axes)
            axes.set_ylim(bottom=0.0)
        height.set_xlabel("time, min", fontsize=NORMAL)
    grid[1, 0].set_ylabel("true airspeed, m/s", fontsize=NORMAL)
    grid[2, 0].set_ylabel("pressure altitude, m", fontsize=NORMAL)
    kinds = list(dict.fromkeys(kind for mission in missions for kind in kinds_of(ready(mission).profile)))
    figure.legend(handles=kind_handles(kinds), loc="outside lower center", ncols=len(kinds), fontsize=8, frameon=False)
    return figure


def run(missions: Sequence[str] = MISSIONS) -> Finding:
    """Length, distance, and what the mission files say of themselves."""
    rows = []
    for mission in missions:
        setup = ready(mission)
        profile, mass = setup.profile, setup.loading.takeoff_mass
        rows.append(
            [
                setup.mission.name,
                round(profile.duration / 60.0, 1),
                round(float(np.sum(ground_distances(profile))) / 1e3, 1),
                len(profile.segments),
                round(mass, 1),
            ]
        )
    sentences = ["; ".join(f"{row[0]} takes {row[1]} min over {row[2]} km" for row in rows) + "."]
    sentences.append(
        "The study's mission files are not published: places, kinds of task, climb angle and speeds are its own, "
        "masses, "
        "durations and some places are our assumptions, marked in the files."
    )
    figures = {"missions_time": against_time(missions)} | {f"map_{m}": on_the_map(m) for m in missions}
    return Finding("Missions", sentences, Table(("mission", "min", "km", "segments", "take-off kg"), rows), figures)
