"""Figures of the study of uncertainty: tornados of saving and rotor speed, and how both are spread."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from uncertainty_effects import Effect, label

from vrsopt.report.plots import png
from vrsopt.report.style import BLACK, BLUE, GREY, ORANGE, SKY, SMALL, VERMILION, new_figure, tidy

SHOWN, VISIBLE = 16, 0.02  # bars of a tornado at most, and the least effect [points] of one
COLOURS = (BLUE, VERMILION, ORANGE)
AXES = {"saving": "saving, points", "rotor_speed": "mean rotor speed, points of nominal"}


def draw(content: Mapping[str, Any], effects: Mapping[str, Sequence[Effect]], folder: Path) -> None:
    """Write the three figures. ``effects``: those of each quantity, the largest first."""
    for quantity, found in effects.items():
        figure = tornado([effect for effect in found if effect.largest >= VISIBLE][:SHOWN], AXES[quantity])
        (folder / f"uncertainty_{quantity}.png").write_bytes(png(figure))
    (folder / "uncertainty_band.png").write_bytes(png(bands(content)))


def tornado(effects: Sequence[Effect], axis: str) -> Any:
    """Change at both ends of each number's range, one panel for each mission."""
    missions = list(effects[0].low)
    figure = new_figure(10.5, 0.8 + 0.26 * len(effects))
    panels = figure.subplots(1, len(missions), sharex=True, sharey=True)
    places = np.arange(len(effects))[::-1]
    for panel, name in zip(np.ravel(panels), missions, strict=True):
        for side, colour, hatch in (("low", SKY, ""), ("high", ORANGE, "////")):
            values = [getattr(effect, side)[name] for effect in effects]
            panel.barh(places, values, color=colour, hatch=hatch, edgecolor=BLACK, linewidth=0.4, label=f"{side} end")
        panel.axvline(0.0, color=BLACK, linewidth=0.8)
        panel.set_title(name.upper(), fontsize=SMALL)
        panel.set_yticks(places, [label(effect.path) for effect in effects], fontsize=SMALL)
        panel.set_xlabel(axis, fontsize=SMALL)
        tidy(panel)
    np.ravel(panels)[-1].legend(fontsize=SMALL, frameon=False, loc="lower right")
    return figure


def bands(content: Mapping[str, Any]) -> Any:
    """Share of the samples below a saving and below a rotor speed, with the manoeuvre margin drawn and held."""
    figure = new_figure(9.0, 3.8)
    panels = figure.subplots(1, 2, sharey=True)
    names = {"saving": "saving of fuel, %", "rotor_speed": "mean rotor speed in flight, % of nominal"}
    for panel, (quantity, axis) in zip(np.ravel(panels), names.items(), strict=True):
        for kind, style in (("samples", "-"), ("margin_held", "--")):
            for colour, (name, values) in zip(COLOURS, content[kind]["values"][quantity].items(), strict=True):
                if len(values) > 1:
                    share = 100.0 * (np.arange(len(values)) + 0.5) / len(values)
                    drawn = name.upper() if kind == "samples" else None
                    panel.plot(np.sort(values), share, style, color=colour, linewidth=1.3, label=drawn)
        for colour, (_, reference) in zip(COLOURS, content["reference"].items(), strict=True):
            panel.axvline(reference[quantity], color=colour, linewidth=0.7, alpha=0.6)
        for level in (5.0, 95.0):
            panel.axhline(level, color=GREY, linewidth=0.6)
        panel.set_xlabel(axis, fontsize=SMALL)
        tidy(panel)
    np.ravel(panels)[0].set_ylabel("% of the samples below", fontsize=SMALL)
    np.ravel(panels)[0].plot([], [], "--", color=BLACK, linewidth=1.3, label="margin held")
    np.ravel(panels)[0].plot([], [], color=GREY, linewidth=0.7, label="as shipped (upright)")
    np.ravel(panels)[0].legend(fontsize=SMALL, frameon=False)
    return figure
