"""Figures of the study of the optimum rotor speed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from optimum_speed_results import default, effect, levels, named, power_ratio, usable

from vrsopt.report.style import BLACK, BLUE, GREEN, PURPLE, VERMILION

COLOURS = (BLUE, VERMILION, GREEN, PURPLE, BLACK)
LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
MARKS = {"none": "o", "lower bound": "_", "blade loading": "v", "torque": "s", "tail rotor": "D"}
STYLE: dict[Any, Any] = {"axes.spines.top": False, "axes.spines.right": False, "font.size": 9, "savefig.dpi": 130}


def draw(dataset: xr.Dataset, folder: Path) -> dict[str, str]:
    """Write the figures; their file names and titles."""
    figures = {
        "optimum_speed_map.png": ("Optimum rotor speed of the default model", over_speed(dataset)),
        "optimum_speed_effects.png": ("What moves the optimum", tornado(dataset)),
        "optimum_speed_curves.png": ("Power against rotor speed at 2400 kg", power_curves(dataset)),
    }
    for name, (_, figure) in figures.items():
        figure.savefig(folder / name)
        plt.close(figure)
    return {name: title for name, (title, _) in figures.items()}


def over_speed(dataset: xr.Dataset) -> Any:
    """Optimum rotor speed and change of fuel against airspeed, one column for each mass."""
    chosen = dataset.sel(default(dataset))
    names = str(dataset.active.attrs["flag_meanings"]).split(", ")
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(
            2, dataset.sizes["mass"], figsize=(10, 5.6), sharex=True, sharey="row", layout="constrained", squeeze=False
        )
        for (upper, lower), mass in zip(axes.T, dataset.mass.values, strict=True):
            for colour, style, altitude in zip(COLOURS, LINES, dataset.altitude.values, strict=False):
                line = chosen.sel(mass=mass, altitude=altitude)
                label = f"at {altitude:.0f} m"
                upper.fill_between(line.speed, line.optimum_band_low, line.optimum_band_high, color=colour, alpha=0.15)
                upper.plot(line.speed, line.optimum_rotor_speed, color=colour, ls=style, label=label)
                lower.plot(line.speed, line.optimum_fuel_change, color=colour, ls=style)
                for code in np.unique(line.active.values[line.active.values >= 0]):
                    here = line.where(line.active == code)
                    for flyable, face in ((1, colour), (0, "white")):
                        points = here.where(here.flyable == flyable)
                        mark = MARKS.get(names[code], "x")
                        face_colour = {} if mark in "_x" else {"markerfacecolor": face}
                        upper.plot(points.speed, points.optimum_rotor_speed, mark, color=colour, **face_colour)
            upper.set_title(f"{mass:.0f} kg", fontsize=9)
            lower.set_xlabel("true airspeed, m/s")
            lower.axhline(0, color="0.7", lw=0.8, zorder=0)
            upper.axhline(100, color="0.7", lw=0.8, zorder=0)
        axes[0, 0].set_ylabel("rotor speed of least fuel,\n% of nominal")
        axes[1, 0].set_ylabel("change of fuel flow, %")
        used = {names[code] for code in np.unique(chosen.active.values) if code >= 0}
        marks = [
            plt.Line2D([], [], color="0.3", marker=MARKS.get(n, "x"), ls="", label=f"rests on {n}")
            for n in names
            if n in used
        ]
        hollow = plt.Line2D(
            [], [], color="0.3", marker="o", markerfacecolor="white", ls="", label="nominal not flyable"
        )
        handles = [*axes[0, 0].get_legend_handles_labels()[0], *marks, hollow]
        figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, fontsize=8)
    return figure


def tornado(dataset: xr.Dataset) -> Any:
    """Main effects on rotor speed and change of fuel: mean bar, line from smallest to largest over the flights."""
    masses = [float(dataset.mass.values[k]) for k in (-1, 0)]
    changes = levels(dataset)
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 2, figsize=(10, 6.6), sharex="col", sharey=True, layout="constrained")
        for row, mass in zip(axes, masses, strict=True):
            base = usable(dataset, default(dataset)).sel(mass=mass)
            for axis, name, unit in (
                (row[0], "optimum_rotor_speed", "rotor speed"),
                (row[1], "optimum_fuel_change", "change of fuel flow"),
            ):
                for k, change in enumerate(changes):
                    values = effect(dataset, change, mass)[name].values
                    values = values[np.isfinite(values)]
                    if not values.size:
                        continue
                    axis.barh(k, values.mean(), color=COLOURS[0] if values.mean() < 0 else COLOURS[1], height=0.6)
                    axis.plot([values.min(), values.max()], [k, k], color="0.3", lw=1)
                axis.axvline(0, color="0.3", lw=0.8)
                axis.set_title(f"{mass:.0f} kg: default model {float(base[name].mean()):.1f} % {unit}", fontsize=9)
            row[0].set_yticks(range(len(changes)), [named(change) for change in changes])
        axes[0, 0].invert_yaxis()
        axes[1, 0].set_xlabel("effect on the rotor speed of least fuel, points of nominal")
        axes[1, 1].set_xlabel("effect on the change of fuel flow, points")
    return figure


def power_curves(dataset: xr.Dataset) -> Any:
    """Power over that at 100 % for every section, and thin for every other physics model, at the largest mass."""
    mass, altitude = float(dataset.mass.values[-1]), float(dataset.altitude.values[0])
    speeds = [float(v) for v in dataset.speed.values if v in (0.0, 30.0, 60.0)]
    ratio = np.linspace(0.75, 1.15, 161)
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(1, len(speeds), figsize=(10, 3.6), sharey=True, layout="constrained", squeeze=False)
        for axis, speed in zip(axes[0], speeds, strict=True):
            place = default(dataset) | {"mass": mass, "altitude": altitude, "speed": speed}
            for tail in dataset.tail_rotor.values:
                for inflow in dataset.inflow.values:
                    for split in dataset.split.values:
                        for section in dataset.section.values:
                            choice = place | {"tail_rotor": tail, "inflow": inflow, "split": split, "section": section}
                            axis.plot(100 * ratio, power_ratio(dataset, choice, ratio), color="0.85", lw=0.6)
            for colour, style, section in zip(COLOURS, LINES, dataset.section.values, strict=False):
                curve = power_ratio(dataset, place | {"section": section}, ratio)
                axis.plot(100 * ratio, curve, color=colour, ls=style, lw=1.8, label=f"section: {section}")
            axis.plot([], [], color="0.85", lw=0.6, label="other models")
            axis.set_title(f"{mass:.0f} kg, {altitude:.0f} m, {speed:.0f} m/s", fontsize=9)
            axis.set_xlabel("rotor speed, % of nominal")
            axis.set_xlim(74, 116)
            axis.set_ylim(0.75, 1.3)
        axes[0, 0].set_ylabel("power over that at 100 %")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False, fontsize=8)
    return figure
