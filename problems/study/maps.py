"""Maps of the fuel saved over the flight envelope: rotor speed only, twist only, both."""

from __future__ import annotations

from typing import Any

import numpy as np

import vrsopt
from vrsopt.envelope_map import MASSES
from vrsopt.report.envelope_plots import map_figure

from .finding import Finding, Table
from .flights import STRATEGIES

POINTS = 12_000  # of a map; problems/envelope.py draws them with 56,000


def run(points: int = POINTS, masses: tuple[float, ...] = MASSES) -> Finding:
    """Three maps."""
    figures: dict[str, Any] = {}
    rows, means = [], {}
    for strategy, words in STRATEGIES.items():
        found = vrsopt.envelope(variables=strategy, points=points, masses=masses)  # type: ignore[arg-type]
        figures[f"map_{strategy}_fuel"] = map_figure(found.dataset, "fuel_flow")
        if strategy != "twist":
            figures[f"map_{strategy}_rotor_speed"] = map_figure(found.dataset, "rotor_speed")
        if strategy != "speed":
            figures[f"map_{strategy}_twist"] = map_figure(found.dataset, "twist")
        for mass, row in found.summary()["masses_kg"].items():
            most = -float(np.nanmin(found.dataset.sel(mass=float(mass))["fuel_flow_delta_percent"], initial=0.0))
            names = ("feasible_percent", "mean_rotor_speed_percent", "mean_twist_deg")
            saved = -row["mean_fuel_flow_delta_percent"]
            means[strategy, mass] = saved
            cells = [*(row[name] for name in names), saved, most, -row["mean_nox_delta_percent"]]
            rows.append([words, float(mass), *(round(c, 2) if np.isfinite(c) else None for c in cells)])
    light, heavy = f"{masses[0]:g}", f"{masses[-1]:g}"
    sentences = [
        f"At {mass} kg the fuel flow falls on average by {means['speed', mass]:.1f} % with the rotor speed alone, "
        f"{means['twist', mass]:.1f} % with the twist alone and {means['both', mass]:.1f} % with both."
        for mass in (light, heavy)
    ]
    sentences.append(
        "The study finds little or no reduction at 2400 kg. Averages are over the flyable points alone, "
        "which are fewer "
        "at that mass; problems/envelope.md has what the manoeuvre margin does to it. Its maps come from closed codes."
    )
    head = (
        "free",
        "mass kg",
        "flyable %",
        "mean speed %",
        "mean twist deg",
        "mean fuel saved %",
        "most fuel saved %",
        "mean NOx saved %",
    )
    return Finding("Maps of the strategies", sentences, Table(head, rows), figures)
