"""Figures of the study of the flight envelope: maps with different bounds side by side, saving against margin."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.envelope_map import Envelope
from vrsopt.report.style import BLUE, GREEN, NORMAL, ORANGE, SKY, SMALL, VERMILION, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEVELS = np.arange(75.0, 105.1, 2.5)
LOOKS = ((BLUE, "o"), (ORANGE, "s"), (GREEN, "^"))  # colour, mark


def bounds_figure(cases: Mapping[str, Envelope]) -> Figure:
    """Optimum rotor speed of each case, a row, at each mass, a column; where it rests on a bound is outlined."""
    masses = next(iter(cases.values())).dataset["mass"].values
    figure = new_figure(3.4 * len(masses) + 0.9, 2.7 * len(cases) + 0.4)
    axes = figure.subplots(len(cases), len(masses), sharex=True, sharey=True, squeeze=False)
    for row, (words, found) in zip(axes, cases.items(), strict=True):
        for ax, mass in zip(row, masses, strict=True):
            maps = found.dataset.sel(mass=mass)
            place = maps["speed"].values, maps["altitude"].values
            values = np.clip(maps["rotor_speed_percent"].values, LEVELS[0] + 1e-6, LEVELS[-1])
            filled = ax.contourf(*place, values, levels=LEVELS, cmap="viridis")
            on_bound = ((maps["active"].values >> 5) & 3 > 0).astype(float)
            if 0 < on_bound.mean() < 1:
                ax.contour(*place, on_bound, levels=[0.5], colors=VERMILION, linewidths=1.4)
            if (maps["feasible"].values == 0).any():
                bad = (maps["feasible"].values == 0).astype(float)
                ax.contourf(*place, bad, levels=[0.5, 1.5], colors="none", hatches=["////"])
            ax.set_title(f"{words}, {mass:g} kg", fontsize=SMALL)
            ax.tick_params(labelsize=SMALL)
    for ax in axes[-1]:
        ax.set_xlabel("airspeed, m/s", fontsize=NORMAL)
    for ax in axes[:, 0]:
        ax.set_ylabel("pressure altitude, m", fontsize=NORMAL)
    figure.suptitle(
        "optimum rotor speed, % of nominal; red: edge of the region on a bound; hatched: not flyable",
        fontsize=NORMAL + 1,
        x=0.01,
        ha="left",
    )
    figure.colorbar(filled, ax=axes.ravel().tolist(), pad=0.02).ax.tick_params(labelsize=SMALL)
    return figure


def margin_figure(
    envelopes: Mapping[str, Envelope], saved: Mapping[str, Mapping[float, Mapping[str, float]]]
) -> Figure:
    """Saving against manoeuvre margin: of the missions, and the mean over the envelope at each mass."""
    figure = new_figure(9.6, 4.2)
    left, right = figure.subplots(1, 2)
    for (colour, mark), (mission, by_margin) in zip(LOOKS, saved.items(), strict=True):
        margins = list(by_margin)
        for name, style in (("trajectory", "-"), ("pointwise", "--")):
            saving = [-row[name] for row in by_margin.values()]
            look = {"color": colour, "marker": mark, "ls": style, "markersize": 5, "linewidth": 1.2}
            left.plot(margins, saving, label=f"{mission}, {name}", **look)
    left.set_title("missions", fontsize=NORMAL)
    margins = [float(margin) for margin in envelopes]
    rows = [found.summary()["masses_kg"] for found in envelopes.values()]
    for colour, mark, mass in zip((SKY, BLUE, VERMILION), "os^", rows[0], strict=True):
        saving = [-row[mass]["mean_fuel_flow_delta_percent"] for row in rows]
        right.plot(margins, saving, f"{mark}-", color=colour, label=f"{mass} kg", markersize=5, linewidth=1.2)
    right.set_title("mean over the flight envelope, rotor speed and twist free", fontsize=NORMAL)
    for ax in (left, right):
        ax.set_xlabel("manoeuvre margin (thrust available over thrust flown)", fontsize=NORMAL)
        ax.set_ylabel("fuel saved against nominal, %", fontsize=NORMAL)
        ax.set_ylim(bottom=0.0)
        ax.legend(fontsize=SMALL, frameon=False)
        tidy(ax)
    return figure
