"""The missions on the map, with airspeed and altitude against time."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from vrsopt.mission.flight_path import flight_path, ground_distances
from vrsopt.mission.profile import Profile
from vrsopt.report.plots import flight_path_figure
from vrsopt.report.style import (
    BLACK,
    NORMAL,
    draw_tasks,
    kind_handles,
    kind_name,
    kinds_of,
    new_figure,
    task_spans,
    tidy,
)

from .finding import Finding, Picture, Table
from .flights import MISSIONS, ready

WORDS = {"patm": "PATM, air taxi", "lem": "LEM, police flight", "sarm": "SARM, search and rescue"}


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
    grid = figure.subplots(3, len(missions), sharex="col", sharey="row", squeeze=False, gridspec_kw=ratios)
    for (strip, speed, height), mission in zip(grid.T, missions, strict=True):
        profile = ready(mission).profile
        path = flight_path(profile, 1.0)
        draw_tasks(strip, profile)
        strip.set_title(WORDS.get(mission, mission), fontsize=NORMAL, loc="left")
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
    rows, sentences = [], []
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
        kind, share = longest(profile)
        sentences.append(
            f"{WORDS.get(mission, mission)}: {rows[-1][1]} min over {rows[-1][2]} km; most time, {share:.0f} %, goes "
            f"to: {kind}."
        )
    sentences.append(
        "Places of the study where it names them; masses, durations and the other places are assumptions, marked in "
        "problems/*.toml."
    )
    said = (
        "Who flies where and what kinds of task, climbs and descents at 40 m/s and 7.12 deg, a loiter at 40 m/s and "
        "about 600 m for about 90 % of the police flight, a search at about 35 m/s for about half of the rescue. The "
        "mission files are not published."
    )
    caption = (
        "True airspeed and pressure altitude against time, the kind of task along the top. Vertical climbs and "
        "descents are the small marks at zero airspeed."
    )
    figures = {"missions_time": Picture(against_time(missions), caption)}
    caption = "The way over the ground; dots are places, frames are the patterns drawn larger below."
    figures |= {f"map_{m}": Picture(on_the_map(m), f"{WORDS.get(m, m)}. {caption}") for m in missions}
    head = ("mission", "min", "km", "segments", "take-off kg")
    return Finding("Missions", said, sentences, Table(head, rows), figures)


def longest(profile: Profile) -> tuple[str, float]:
    """The kind of task with most of the time, and its share [%]."""
    time = dict.fromkeys(kinds_of(profile), 0.0)
    for span in task_spans(profile):
        time[span.kind] += span.end - span.start
    kind = max(time, key=lambda name: time[name])
    return kind_name(kind), 100.0 * time[kind] / profile.duration
