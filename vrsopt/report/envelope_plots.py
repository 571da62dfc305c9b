"""Contour maps of the flight envelope: best rotor speed and twist, what they save, and how flat the optimum is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vrsopt.report.style import DARK, NORMAL, SMALL, new_figure

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# name of the figure: variable, title, colour map
MAPS = {
    "rotor_speed": ("rotor_speed_percent", "optimum rotor speed, % of nominal", "viridis"),
    "twist": ("twist_deg", "optimum blade twist, deg", "viridis"),
    "fuel_flow": ("fuel_flow_delta_percent", "change of fuel flow, %", "magma"),
    "nox": ("nox_delta_percent", "change of NOx, %", "magma"),
}
HELD = {"speed": ("twist",), "twist": ("rotor_speed", "band")}
BAND = "rotor speeds within 0.5 % of the least fuel flow, % of nominal"
FLAT = 1e-6  # a range below which a map is one value
LEVELS = 12
WIDTH, HEIGHT = 3.4, 3.3  # inches, of one map
VARIABLES_WORDS = {"both": "rotor speed and twist free", "speed": "rotor speed free", "twist": "twist free"}


def envelope_figures(maps: xr.Dataset) -> dict[str, Figure]:
    """The figures of ``maps`` (see :func:`vrsopt.envelope_map.envelope`) by the name of their file.

    Without those of what is held.
    """
    held = HELD.get(str(maps.attrs["free_variables"]), ())
    figures = {name: map_figure(maps, name) for name in MAPS if name not in held}
    return figures if "band" in held else figures | {"band": band_figure(maps)}


def map_figure(maps: xr.Dataset, name: str) -> Figure:
    """One of MAPS over airspeed and altitude, a panel for each mass."""
    variable, title, colours = MAPS[name]
    figure = new_figure(WIDTH * maps.sizes["mass"] + 0.9, HEIGHT)
    axes = figure.subplots(1, maps.sizes["mass"], sharey=True, squeeze=False)[0]
    filled = _filled(figure, axes, maps, {"": maps[variable]}, colours, [None])
    _finish(figure, axes, maps, title)
    figure.colorbar(filled, ax=list(axes), pad=0.02).ax.tick_params(labelsize=SMALL)
    return figure


def band_figure(maps: xr.Dataset) -> Figure:
    """Lowest and highest rotor speed within 0.5 % of the least fuel flow, a column for each mass."""
    figure = new_figure(WIDTH * maps.sizes["mass"] + 0.9, 2 * HEIGHT - 0.4)
    axes = figure.subplots(2, maps.sizes["mass"], sharex=True, sharey=True, squeeze=False)
    rows = {"lowest": maps["band_low_percent"], "highest": maps["band_high_percent"]}
    filled = _filled(figure, axes.ravel(), maps, rows, "viridis", list(rows))
    _finish(figure, axes.ravel(), maps, BAND)
    figure.colorbar(filled, ax=axes.ravel().tolist(), pad=0.02).ax.tick_params(labelsize=SMALL)
    return figure


def _filled(figure: Figure, axes: Any, maps: xr.Dataset, rows: Any, colours: str, words: list[str | None]) -> Any:
    """Contours of ``rows`` over all masses on one scale, infeasible regions hatched; returns one for the colour bar."""
    from matplotlib.ticker import MaxNLocator

    values = np.concatenate([row.values.ravel() for row in rows.values()])
    low, high = (float(end) for end in (np.nanmin(values), np.nanmax(values))) if np.isfinite(values).any() else (0, 1)
    if high - low < FLAT:
        low, high = low - 0.5, high + 0.5
    levels = MaxNLocator(LEVELS).tick_values(low, high)
    filled = None
    panels = [(word, row, mass) for word, row in zip(words, rows.values(), strict=True) for mass in maps["mass"].values]
    for ax, (word, row, mass) in zip(axes, panels, strict=True):
        here = row.sel(mass=mass).values
        place = maps["speed"].values, maps["altitude"].values
        filled = ax.contourf(*place, here, levels=levels, cmap=colours)
        if np.nanmax(here, initial=low) - np.nanmin(here, initial=high) > FLAT:
            lines = ax.contour(*place, here, levels=levels[::2], colors="white", linewidths=0.5)
            ax.clabel(lines, fontsize=SMALL - 2, fmt="%g")
        bad = (maps["feasible"].sel(mass=mass).values == 0).astype(float)
        if bad.any():
            ax.contourf(*place, bad, levels=[0.5, 1.5], colors="none", hatches=["////"])
            ax.contour(*place, bad, levels=[0.5], colors=DARK, linewidths=0.8)
        ax.set_title(f"{mass:g} kg" + (f", {word}" if word else ""), fontsize=NORMAL)
        ax.tick_params(labelsize=SMALL)
    return filled


def _finish(figure: Figure, axes: Any, maps: xr.Dataset, title: str) -> None:
    free = VARIABLES_WORDS[str(maps.attrs["free_variables"])]
    low, high = maps.attrs["rotor_speed_percent_bounds"]
    settings = f"{free}, {low:g} to {high:g} %, manoeuvre margin {maps.attrs['manoeuvre_margin']:g}"
    figure.suptitle(f"{title} ({settings})", fontsize=NORMAL + 1, x=0.01, ha="left")
    for ax in axes:
        spec = ax.get_subplotspec()
        if spec.is_last_row():
            ax.set_xlabel("airspeed, m/s", fontsize=NORMAL)
        if spec.is_first_col():
            ax.set_ylabel("pressure altitude, m", fontsize=NORMAL)
    if np.any(maps["feasible"].values == 0):
        figure.supxlabel("hatched: no rotor speed and twist keep the limits", fontsize=SMALL, x=0.01, ha="left")
