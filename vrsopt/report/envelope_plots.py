"""Contour maps of the flight envelope: best rotor speed and twist, what they save, and how flat the optimum is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vrsopt.report.style import (
    BLUE,
    DARK,
    GREEN,
    GREY,
    NORMAL,
    ORANGE,
    PURPLE,
    SKY,
    SMALL,
    VERMILION,
    YELLOW,
    new_figure,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# name of the figure: variable, title, colour map
MAPS = {
    "rotor_speed": ("rotor_speed_percent", "optimum rotor speed, % of nominal", "viridis"),
    "twist": ("twist_deg", "optimum blade twist, deg", "viridis"),
    "fuel_flow": ("fuel_flow_delta_percent", "change of fuel flow, %", "magma"),
    "nox": ("nox_delta_percent", "change of NOx, %", "magma"),
}
HELD = {"speed": ("twist",), "twist": ("rotor_speed", "band")}
BAND = "rotor speeds within 0.5 % of least fuel, % of nominal"
FLAT = 1e-6  # a range below which a map is one value
LEVELS = 12
KIND_COLOURS = (SKY, BLUE, ORANGE, GREEN, PURPLE, YELLOW, VERMILION)
HATCHED = "hatched: no rotor speed and twist keep the limits"
WIDTH, HEIGHT = 3.4, 3.3  # inches, of one map
VARIABLES_WORDS = {"both": "rotor speed and twist free", "speed": "rotor speed free", "twist": "twist free"}


def envelope_figures(maps: xr.Dataset) -> dict[str, Figure]:
    """The figures of ``maps`` (see :func:`vrsopt.envelope_map.envelope`) by the name of their file.

    Without those of what is held.
    """
    held = HELD.get(str(maps.attrs["free_variables"]), ())
    figures = {name: map_figure(maps, name) for name in MAPS if name not in held}
    if "band" not in held:
        figures["band"] = band_figure(maps)
    return figures | {"active": active_figure(maps)}


def map_figure(maps: xr.Dataset, name: str) -> Figure:
    """One of MAPS over airspeed and altitude, a panel for each mass.

    ``name``: which; ``maps``: those of :func:`vrsopt.envelope`.
    """
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


def active_figure(maps: xr.Dataset) -> Figure:
    """What the optimum rests on: a limit or a bound, or several; the rare cases are one colour."""
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.patches import Patch

    names = [name.replace("_", " ") for name in maps["active"].attrs["flag_meanings"].split()]
    flyable = maps["feasible"].values == 1
    kinds, counts = np.unique(maps["active"].values[flyable], return_counts=True)
    kinds = kinds[np.argsort(-counts)][: len(KIND_COLOURS)].tolist()
    words = [" and ".join(name for bit, name in enumerate(names) if kind >> bit & 1) or "nothing" for kind in kinds]
    colours = ListedColormap([*KIND_COLOURS[: len(kinds)], GREY])
    figure = new_figure(WIDTH * maps.sizes["mass"] + 0.9, HEIGHT + 0.7)
    axes = figure.subplots(1, maps.sizes["mass"], sharey=True, squeeze=False)[0]
    for ax, mass in zip(axes, maps["mass"].values, strict=True):
        here = maps.sel(mass=mass)
        place = np.full(here["active"].shape, float(len(kinds)))
        for k, kind in enumerate(kinds):
            place[here["active"].values == kind] = k
        place[here["feasible"].values == 0] = np.nan
        norm = BoundaryNorm(np.arange(len(kinds) + 2) - 0.5, len(kinds) + 1)
        ax.pcolormesh(here["speed"], here["altitude"], place, cmap=colours, norm=norm, rasterized=True)
        _hatch(ax, here)
        ax.set_title(f"{mass:g} kg", fontsize=NORMAL)
        ax.tick_params(labelsize=SMALL)
    _finish(figure, axes, maps, "what the optimum rests on")
    handles = [Patch(facecolor=colours(k), label=word) for k, word in enumerate([*words, "others"])]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=SMALL, frameon=False)
    return figure


def _hatch(axes: Axes, here: xr.Dataset) -> None:
    """Hatch where the maps ``here`` of one mass are infeasible."""
    bad = (here["feasible"].values == 0).astype(float)
    if bad.any():
        place = here["speed"].values, here["altitude"].values
        axes.contourf(*place, bad, levels=[0.5, 1.5], colors="none", hatches=["////"])
        axes.contour(*place, bad, levels=[0.5], colors=DARK, linewidths=0.8)


def _filled(figure: Figure, axes: Any, maps: xr.Dataset, rows: Any, colours: str, words: list[str | None]) -> Any:
    """Contours of ``rows`` over all masses on one scale, infeasible regions hatched; returns one for the colour bar."""
    from matplotlib.ticker import MaxNLocator

    values = np.concatenate([row.values.ravel() for row in rows.values()])
    low, high = (float(end) for end in (np.nanmin(values), np.nanmax(values))) if np.isfinite(values).any() else (0, 1)
    if high - low < FLAT:
        low, high = low - 0.5, high + 0.5
    levels = MaxNLocator(LEVELS).tick_values(low + FLAT, high)  # a map that ends at a bound begins there
    filled = None
    panels = [(word, row, mass) for word, row in zip(words, rows.values(), strict=True) for mass in maps["mass"].values]
    for ax, (word, row, mass) in zip(axes, panels, strict=True):
        here = np.clip(row.sel(mass=mass).values, levels[0], levels[-1])
        place = maps["speed"].values, maps["altitude"].values
        filled = ax.contourf(*place, here, levels=levels, cmap=colours)
        if np.nanmax(here, initial=low) - np.nanmin(here, initial=high) > FLAT:
            lines = ax.contour(*place, here, levels=levels[::2], colors="white", linewidths=0.5)
            ax.clabel(lines, fontsize=SMALL - 2, fmt="%g")
        _hatch(ax, maps.sel(mass=mass))
        ax.set_title(f"{mass:g} kg" + (f", {word}" if word else ""), fontsize=NORMAL)
        ax.tick_params(labelsize=SMALL)
    return filled


def _finish(figure: Figure, axes: Any, maps: xr.Dataset, title: str) -> None:
    free = VARIABLES_WORDS[str(maps.attrs["free_variables"])]
    low, high = maps.attrs["rotor_speed_percent_bounds"]
    within = f", {low:g} to {high:g} %" if low < high else ""
    settings = f"{free}{within}, manoeuvre margin {maps.attrs['manoeuvre_margin']:g}"
    settings += f"; {HATCHED}" if np.any(maps["feasible"].values == 0) else ""
    figure.suptitle(f"{title} ({settings})", fontsize=NORMAL, x=0.01, ha="left")
    for ax in axes:
        spec = ax.get_subplotspec()
        if spec.is_last_row():
            ax.set_xlabel("airspeed, m/s", fontsize=NORMAL)
        if spec.is_first_col():
            ax.set_ylabel("pressure altitude, m", fontsize=NORMAL)
