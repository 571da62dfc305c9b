"""Each mission's time over the map of the benefit: why the missions differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import MaxNLocator

import vrsopt
from vrsopt.envelope_map import POINTS
from vrsopt.errors import InputError
from vrsopt.report.style import BLACK, NORMAL, SMALL, new_figure, tidy

from .finding import Finding, Picture, Table
from .flights import MISSIONS, benefit_percent, flown, ready
from .missions import WORDS

if TYPE_CHECKING:
    import xarray as xr

CELL = np.array([1.0, 25.0])  # m/s, m: none of the missions' steady speeds and altitudes is between two
THRESHOLDS = (3.0, 5.0)  # % of the fuel flow, the study's
OWN_THRESHOLDS = (10.0, 15.0)  # %, which tell our missions apart
HIGHEST = 1000.0  # m, of the maps: above all missions
LEVELS = 10  # or a few more or less, of the colour scale
SIZES = (1.0, 10.0, 50.0)  # % of the time, of the legend


def shares(mission: str) -> list[float]:
    """Shares of the time in flight [%] with a benefit of more than the THRESHOLDS and ours, and the mean benefit over
    it [%]."""
    saved, weight = benefit_percent(mission)
    air = np.isfinite(saved)
    saved, weight = saved[air], weight[air]
    above = [100.0 * float(weight[saved > least].sum() / weight.sum()) for least in (*THRESHOLDS, *OWN_THRESHOLDS)]
    return [*above, float(np.average(saved, weights=weight))]


def mean_mass(mission: str) -> float:
    """Mean gross mass of the mission [kg]."""
    return float(np.mean(flown(mission, "both").flight.mass))


def places(mission: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The mission off the ground in cells of CELL: their airspeed [m/s], altitude [m], share of the time and mean
    benefit [%], the cell with most time first, so that it hides none."""
    saved, weight = benefit_percent(mission)
    where, air = ready(mission).grid.conditions, np.isfinite(saved) & (weight > 0.0)
    at = np.column_stack([np.asarray(where.speed), np.asarray(where.altitude)])[air]
    cells, index = np.unique(np.round(at / CELL), axis=0, return_inverse=True)
    time = np.bincount(index.ravel(), weight[air])
    mean = np.bincount(index.ravel(), (weight * saved)[air]) / time
    order = np.argsort(-time)
    speed, altitude = (cells * CELL)[order].T
    return speed, altitude, 100.0 * time[order] / time.sum(), mean[order]


def benefit_map(mass: float, points: int) -> xr.DataArray:
    """Fuel flow saved in level flight [%] over (altitude, speed) at a ``mass`` [kg]; NaN where it can not be flown."""
    found = vrsopt.envelope(points=points, masses=(mass,), altitudes=(0.0, HIGHEST))
    return -found.dataset["fuel_flow_delta_percent"].isel(mass=0)


def on_map(mission: str, saved: xr.DataArray) -> tuple[float, float]:
    """Mean of the map over the places of the mission, by their time [%], and the share of the time [%] at places that
    the map has no value for, which the mean leaves out.

    InputError: the mission is below or above the altitudes of the map.
    """
    speed, altitude, share, _ = places(mission)
    low, high = (float(end) for end in saved["altitude"].values[[0, -1]])
    if altitude.min() < low or altitude.max() > high:
        raise InputError(
            f"{mission}: altitudes from {altitude.min():.0f} to {altitude.max():.0f} m; the map of the benefit allows "
            f"{low:.0f} to {high:.0f} m"
        )
    values = saved.interp({"speed": ("place", speed), "altitude": ("place", altitude)}).values
    known = np.isfinite(values)
    return float(np.average(values[known], weights=share[known])), float(share[~known].sum())


def draw(maps: Mapping[str, xr.DataArray]) -> Any:
    """The map at each mission's mean mass, its seconds on it in the colour of what they really save."""
    figure = new_figure(4.0 * len(maps) + 0.8, 5.0)
    panels = figure.subplots(1, len(maps), sharey=True, squeeze=False)[0]
    low, high = (float(end([end(saved) for saved in maps.values()])) for end in (np.nanmin, np.nanmax))
    levels = MaxNLocator(LEVELS, steps=[1, 2, 5, 10]).tick_values(low, high)
    for axes, (mission, saved) in zip(panels, maps.items(), strict=True):
        place = saved["speed"].values, saved["altitude"].values
        axes.contourf(*place, saved.values, levels=levels, cmap="cividis")
        axes.contour(*place, saved.values, levels=levels, colors="white", linewidths=0.6)
        least, notes = float(saved.min()), []
        for threshold, line in zip(THRESHOLDS, ("--", "-"), strict=True):
            if least > threshold:
                notes.append(f"{threshold:g} %")
            elif threshold < float(saved.max()):
                axes.contour(*place, saved.values, levels=[threshold], colors=BLACK, linestyles=line, linewidths=1.6)
        bad = np.isnan(saved.values).astype(float)
        if bad.any():
            axes.contourf(*place, bad, levels=[0.5, 1.5], colors="none", hatches=["////"])
        speed, altitude, share, own = places(mission)
        look = {"cmap": "cividis", "vmin": levels[0], "vmax": levels[-1], "edgecolors": BLACK, "linewidths": 0.5}
        marks = axes.scatter(speed, altitude, c=own, s=size(share), clip_on=False, zorder=3, **look)
        above = f"\nwhole map above {' and '.join(notes)}: {least:.1f} % and more" if notes else "\n"
        title = f"{WORDS.get(mission, mission)}; map at {mean_mass(mission):.0f} kg"
        axes.set_title(title + above, fontsize=NORMAL)
        axes.set_xlabel("true airspeed, m/s", fontsize=NORMAL)
        axes.set(xlim=(0.0, 70.0), ylim=(0.0, HIGHEST))
        tidy(axes)
    panels[0].set_ylabel("pressure altitude, m", fontsize=NORMAL)
    bar = figure.colorbar(marks, ax=list(panels), pad=0.02, ticks=levels, extend="both")
    bar.set_label("fuel flow saved, %\n(map: level flight; dots: as flown)", fontsize=SMALL)
    bar.ax.tick_params(labelsize=SMALL)
    look = {"color": "white", "edgecolors": BLACK, "linewidths": 0.5}
    handles = [panels[0].scatter([], [], s=size(part), label=f"{part:g} % of the time", **look) for part in SIZES]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(SIZES), fontsize=SMALL, frameon=False)
    return figure


def size(share: Any) -> Any:
    """Area of a dot for a share of the time [%]."""
    return 7.0 + 7.0 * share


def reasons(maps: Mapping[str, xr.DataArray], means: Mapping[str, float]) -> list[str]:
    """Why the missions differ: what the maps hold, and the same places at the masses of the others."""
    flyable = [saved.values[np.isfinite(saved.values)] for saved in maps.values()]
    above = [100.0 * float(np.mean(values > THRESHOLDS[1])) for values in flyable]
    least, most = (end(end(values) for values in flyable) for end in (min, max))
    part = "all" if min(above) == 100.0 else f"{min(above):.1f} % or more"
    found = [
        f"Of what can be flown below {HIGHEST:.0f} m, {part} of each map saves more than {THRESHOLDS[1]:g} %; the "
        f"saving is {least:.1f} to {most:.1f} %. The largest mission mean is "
        f"{max(means.values()) / min(means.values()):.1f} times the smallest; the largest saving on the maps "
        f"{most / least:.1f} times the smallest."
    ]
    if len(maps) == 1:
        return found
    both = {place: {mass: on_map(place, saved) for mass, saved in maps.items()} for place in maps}
    cross = {place: {mass: mean for mass, (mean, _) in row.items()} for place, row in both.items()}
    by_mass = [max(row.values()) - min(row.values()) for row in cross.values()]
    by_place = [max(cross[p][m] for p in maps) - min(cross[p][m] for p in maps) for m in maps]
    found.append(
        "Level flight at the same places and shares of time: the mass alone, from mission to mission, moves the mean "
        f"by {min(by_mass):.1f} to {max(by_mass):.1f} points, the places alone by {min(by_place):.1f} to "
        f"{max(by_place):.1f}."
    )
    for mission, row in cross.items():
        speed, altitude, share, _ = places(mission)
        found.append(
            f"{WORDS.get(mission, mission)}: {share[0]:.0f} % of its time in flight is near {speed[0]:.0f} m/s and "
            f"{altitude[0]:.0f} m. Its places save {row[mission]:.1f} % on the map at its own {mean_mass(mission):.0f} "
            "kg"
            + "".join(f", {row[m]:.1f} % at the {mean_mass(m):.0f} kg of {m.upper()}" for m in maps if m != mission)
            + f"; as flown, with climbs, descents, turns and the rates of change, {means[mission]:.1f} %."
        )
    found += [
        f"{part:.2g} % of the time of {place.upper()} is at or beside places that can not be flown on the map at the "
        f"{mean_mass(mass):.0f} kg of {mass.upper()}; the mean there leaves it out."
        for place, row in both.items()
        for mass, (_, part) in row.items()
        if part > 0.0
    ]
    return found


def run(missions: Sequence[str] = MISSIONS, points: int = POINTS // len(MISSIONS)) -> Finding:
    """Maps at the missions' mean masses and the shares of time."""
    found = {mission: shares(mission) for mission in missions}
    maps = {mission: benefit_map(mean_mass(mission), points) for mission in missions}
    rows = [[m.upper(), *(round(x, 1) for x in found[m]), round(mean_mass(m))] for m in missions]
    sentences = [
        f"{WORDS.get(mission, mission)}: of the time off the ground {three:.1f} % saves more than 3 % of the fuel "
        f"flow, {five:.1f} % more than 5 %, {ten:.0f} % more than 10 %, {fifteen:.0f} % more than 15 %; on average "
        f"{mean:.1f} %."
        for mission, (three, five, ten, fifteen, mean) in found.items()
    ]
    sentences += reasons(maps, {mission: row[-1] for mission, row in found.items()})
    head = (
        "mission",
        *(f"above {least:g} %: % of time" for least in (*THRESHOLDS, *OWN_THRESHOLDS)),
        "mean saving %",
        "mean mass kg",
    )
    said = (
        "Benefits above 3 % and above 5 % in parts of the map only, and missions whose savings differ by an order of "
        "magnitude with the time that they spend there."
    )
    caption = (
        "Colours of the map: fuel flow saved in level flight with the best rotor speed and twist, at the mean mass of "
        "the mission. Dots: where the mission spends its time, area by share of time, colour what it saves there as "
        "flown. Arrows of the colour scale: dots may lie beyond what the maps have. Hatched: no rotor speed and twist "
        "keep the limits."
    )
    figures = {"benefit": Picture(draw(maps), caption)}
    return Finding("Time of the missions over the benefit", said, sentences, Table(head, rows), figures)
