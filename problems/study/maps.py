"""Maps of the fuel saved over the flight envelope: rotor speed only, twist only, both."""

from __future__ import annotations

import numpy as np

import vrsopt
from vrsopt.envelope_map import MASSES, POINTS
from vrsopt.report.envelope_plots import map_figure

from .finding import Finding, Picture, Table
from .flights import STRATEGIES

FREE = {"speed": ("rotor_speed",), "twist": ("twist",), "both": ("rotor_speed", "twist")}
CAPTIONS = {
    "fuel": "Change of the fuel flow against the nominal rotor (100 % speed, 8 deg of twist) in level flight",
    "rotor_speed": "Rotor speed of least fuel",
    "twist": "Blade twist of least fuel",
}


def run(points: int = POINTS, masses: tuple[float, ...] = MASSES) -> Finding:
    """Three maps."""
    figures: dict[str, Picture] = {}
    rows, means, flyable = [], {}, {}
    for strategy, words in STRATEGIES.items():
        found = vrsopt.envelope(variables=strategy, points=points, masses=masses)  # type: ignore[arg-type]
        for name in ("fuel", *FREE[strategy]):
            figure = map_figure(found.dataset, "fuel_flow" if name == "fuel" else name)
            figures[f"map_{strategy}_{name}"] = Picture(
                figure, f"{CAPTIONS[name]}, {words} free; a panel for each mass."
            )
        for mass, row in found.summary()["masses_kg"].items():
            most = -float(np.nanmin(found.dataset.sel(mass=float(mass))["fuel_flow_delta_percent"], initial=0.0))
            columns = ("feasible_percent", "mean_rotor_speed_percent", "mean_twist_deg")
            saved = -row["mean_fuel_flow_delta_percent"]
            means[strategy, mass], flyable[strategy, mass] = saved, row["feasible_percent"]
            cells = [*(row[name] for name in columns), saved, most, -row["mean_nox_delta_percent"]]
            rows.append([words, float(mass), *(round(c, 2) if np.isfinite(c) else None for c in cells)])
    light, heavy = f"{masses[0]:g}", f"{masses[-1]:g}"
    sentences = [
        f"At {mass} kg the fuel flow falls on average by {means['speed', mass]:.1f} % with the rotor speed alone, "
        f"{means['twist', mass]:.1f} % with the twist alone and {means['both', mass]:.1f} % with both."
        for mass in (light, heavy)
    ]
    sentences.append(
        f"Each average is over the map that can be flown with what is free: with both {flyable['both', light]:.1f} % "
        f"of it at {light} kg and {flyable['both', heavy]:.1f} % at {heavy} kg, with the rotor speed alone "
        f"{flyable['speed', heavy]:.1f} %. What the margin for manoeuvres does to the saving: problems/envelope.md."
    )
    said = "The same maps from closed codes, with little or no reduction at 2400 kg."
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
    return Finding("Maps of the strategies", said, sentences, Table(head, rows), figures)
