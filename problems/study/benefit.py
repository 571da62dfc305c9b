"""Each mission's time over the map of the benefit: why the missions differ."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import vrsopt
from vrsopt.report.style import BLACK, NORMAL, SMALL, new_figure, tidy

from .finding import Finding, Table
from .flights import MISSIONS, benefit_percent, flown, ready

POINTS = 1600  # of the map at the mean mass of a mission
CELL = np.array([2.0, 20.0])  # m/s, m
THRESHOLDS = (3.0, 5.0)  # % of the fuel flow, the study's


def shares(mission: str) -> list[float]:
    """Shares of the time in flight [%] with a benefit of more than the THRESHOLDS, and the mean benefit over it [%]."""
    saved, weight = benefit_percent(mission)
    air = np.isfinite(saved)
    saved, weight = saved[air], weight[air]
    above = [100.0 * float(weight[saved > least].sum() / weight.sum()) for least in THRESHOLDS]
    return [*above, float(np.average(saved, weights=weight))]


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


def draw(missions: Sequence[str], points: int) -> Any:
    """The map at each mission's mean mass, its seconds on it in the colour of what they really save."""
    figure = new_figure(4.0 * len(missions) + 0.8, 4.4)
    panels = figure.subplots(1, len(missions), sharey=True, squeeze=False)[0]
    levels = np.arange(0.0, 22.1, 2.0)
    for axes, mission in zip(panels, missions, strict=True):
        mass = float(np.mean(flown(mission, "both").flight.mass))
        maps = vrsopt.envelope(points=points, masses=(mass,)).dataset.isel(mass=0)
        place, saved = (maps["speed"].values, maps["altitude"].values), -maps["fuel_flow_delta_percent"].values
        axes.contourf(*place, saved, levels=levels, cmap="cividis", extend="both")
        lines = axes.contour(*place, saved, levels=THRESHOLDS, colors="white", linestyles=("--", "-"), linewidths=1.2)
        axes.clabel(lines, fmt="%g %%", fontsize=SMALL - 1)
        bad = (maps["feasible"].values == 0).astype(float)
        if bad.any():
            axes.contourf(*place, bad, levels=[0.5, 1.5], colors="none", hatches=["////"])
        speed, altitude, share, own = places(mission)
        look = {"cmap": "cividis", "vmin": levels[0], "vmax": levels[-1], "edgecolors": BLACK, "linewidths": 0.5}
        marks = axes.scatter(speed, altitude, c=own, s=12.0 + 8.0 * share, **look)
        axes.set_title(f"{mission.upper()}, map at {mass:.0f} kg", fontsize=NORMAL)
        axes.set_xlabel("true airspeed, m/s", fontsize=NORMAL)
        axes.set(xlim=(0.0, 70.0), ylim=(-20.0, 1000.0))
        tidy(axes)
    panels[0].set_ylabel("pressure altitude, m", fontsize=NORMAL)
    bar = figure.colorbar(marks, ax=list(panels), pad=0.02)
    bar.set_label("fuel flow saved, %\n(map: level flight; dots: mission, area by time)", fontsize=SMALL)
    return figure


def run(missions: Sequence[str] = MISSIONS, points: int = POINTS) -> Finding:
    """Maps at three masses and the shares of time."""
    found = {mission: shares(mission) for mission in missions}
    rows = [
        [m.upper(), *(round(x, 1) for x in found[m]), round(float(np.mean(flown(m, "both").flight.mass)))]
        for m in missions
    ]
    means = [row[-1] for row in found.values()]
    sentences = [
        f"{mission.upper()}: {three:.0f} % of the time off the ground saves more than 3 % of fuel, {five:.0f} % more "
        f"than 5 %, on average {mean:.1f} %."
        for mission, (three, five, mean) in found.items()
    ]
    sentences.append(
        f"The largest mean is {max(means) / min(means):.1f} times the smallest. The study's missions differ by an "
        "order "
        "of magnitude; ours do not, as most of our saving is that of a slower rotor nearly everywhere on the map, not "
        "of few places on it."
    )
    head = ("mission", "above 3 %: % of time", "above 5 %: % of time", "mean saving %", "mean mass kg")
    return Finding(
        "Time of the missions over the benefit", sentences, Table(head, rows), {"benefit": draw(missions, points)}
    )
