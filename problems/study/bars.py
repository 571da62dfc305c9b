"""Fuel, CO2 and NOx of the three strategies on the three missions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vrsopt.report.style import BLACK, BLUE, NORMAL, ORANGE, SKY, SMALL, new_figure, tidy

from .finding import Finding, Picture, Table
from .flights import MISSIONS, STRATEGIES, change_percent, flown

STUDY = {"fuel": 5.0, "nox": 8.0}  # % saved, as the study states them together
WORDS = {"fuel": "fuel", "co2": "CO$_2$", "nox": "NO$_x$"}
LOOKS = dict(zip(STRATEGIES, ((ORANGE, ""), (SKY, "///"), (BLUE, "")), strict=True))  # colour, hatching


def draw(changes: dict[tuple[str, str], dict[str, float]], missions: Sequence[str]) -> Any:
    """A panel for each of fuel, CO2 and NOx, groups of missions."""
    figure = new_figure(11.0, 4.2)
    for axes, (name, words) in zip(figure.subplots(1, 3), WORDS.items(), strict=True):
        for k, (strategy, label) in enumerate(STRATEGIES.items()):
            saved = [-changes[mission, strategy][name] for mission in missions]
            place = np.arange(len(missions)) + 0.27 * (k - 1)
            colour, hatch = LOOKS[strategy]
            bars = axes.bar(place, saved, 0.25, color=colour, hatch=hatch, edgecolor=BLACK, linewidth=0.5, label=label)
            axes.bar_label(bars, fmt="%.1f", fontsize=SMALL - 1, padding=2)
        axes.set_xticks(range(len(missions)), [mission.upper() for mission in missions])
        axes.set_ylabel(f"{words} saved against the nominal rotor, %", fontsize=NORMAL)
        axes.margins(y=0.08)
        tidy(axes)
        axes.grid(False, axis="x")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=SMALL, frameon=False)
    return figure


def run(missions: Sequence[str] = MISSIONS) -> Finding:
    """Solve nine trajectories."""
    changes = {(m, s): change_percent(m, s) for m in missions for s in STRATEGIES}
    rows = []
    for mission in missions:
        for strategy, words in (("nominal", "nominal"), *STRATEGIES.items()):
            own, total = flown(mission, strategy), flown(mission, strategy).totals
            change = changes.get((mission, strategy), dict.fromkeys(total, 0.0))
            numbers = [round(total["fuel"], 2), round(total["co2"], 1), round(1e3 * total["nox"], 1)]
            numbers += [round(change[name], 2) for name in WORDS]
            rows.append([mission.upper(), words, *numbers, "flyable" if own.flight.success else own.flight.message])
    sentences = [
        f"{mission.upper()}: fuel {changes[mission, 'speed']['fuel']:+.2f} % with the rotor speed alone, "
        f"{changes[mission, 'twist']['fuel']:+.2f} % with the twist alone, {changes[mission, 'both']['fuel']:+.2f} % "
        f"with both; NOx {changes[mission, 'both']['nox']:+.1f} %."
        for mission in missions
    ]
    both = [changes[mission, "both"] for mission in missions]
    ratio = [change["nox"] / change["fuel"] for change in both]
    share = [100.0 * changes[mission, "speed"]["fuel"] / changes[mission, "both"]["fuel"] for mission in missions]
    sentences.append(
        f"The rotor speed alone saves {min(share):.0f} to {max(share):.0f} % of what both save; a per cent of fuel is "
        f"{min(ratio):.1f} to {max(ratio):.1f} per cent of NOx."
    )
    sentences.append(
        "Flown on the surrogate alone, whole-mission optima within the rates of change that the actuators allow; "
        "problems/missions.md flies those with both variables on the physics too."
    )
    said = (
        f"About {STUDY['nox']:g} % of NOx to {STUDY['fuel']:g} % of fuel, a ratio of "
        f"{STUDY['nox'] / STUDY['fuel']:.1f}. Its missions are not published in full, so the kilograms cannot be "
        "compared."
    )
    head = ("mission", "free", "fuel kg", "CO2 kg", "NOx g", "fuel %", "CO2 %", "NOx %", "verdict")
    title = "Fuel, CO2 and NOx of the strategies on the missions"
    caption = (
        "What each strategy saves on each mission against the same mission flown with the nominal rotor. The three "
        "panels have scales of their own."
    )
    return Finding(title, said, sentences, Table(head, rows), {"bars": Picture(draw(changes, missions), caption)})
