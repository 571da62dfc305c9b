"""Tables and figures of the study of the optimum rotor speed, written below the text of its page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from optimum_speed_figures import draw
from optimum_speed_results import METRICS, default, effect, levels, named, power_ratio, usable
from page_table import table, write_below

Ranges = Mapping[str, tuple[float, float] | None]
MARKER = "<!-- tables: everything below is written by problems/optimum_speed.py -->"
LETTERS = {
    "none": "",
    "lower bound": "l",
    "upper bound": "u",
    "fold": "f",
    "no trim": "x",
    "blade loading": "b",
    "tail rotor": "t",
    "engine power": "p",
    "torque": "q",
    "turbine temperature": "T",
}
SHOWN = ("optimum_rotor_speed", "optimum_fuel_change")
NOTABLE = 0.5  # points of fuel or percent of rotor speed: interactions that are listed


def calibration(dataset: xr.Dataset, ranges: Ranges) -> Iterator[str]:
    yield "### Calibrated constants\n"
    yield "Solved on the hover and cruise of the flight manual with the model itself. Bold: outside its sourced range "
    yield "(" + ", ".join(f"{name.replace('_', ' ')} {low} to {high}" for name, (low, high) in _known(ranges)) + ").\n"
    rows = []
    for split in dataset.split.values:
        for section in dataset.section.values:
            for inflow in dataset.inflow.values:
                row = [split, section, inflow]
                for tail in dataset.tail_rotor.values:
                    place = {"split": split, "section": section, "inflow": inflow, "tail_rotor": tail}
                    row.append(" / ".join(_constants(dataset.constants.sel(place), ranges)))
                rows.append(row)
    header = ["split", "section", "inflow", *(f"tail rotor {tail}" for tail in dataset.tail_rotor.values)]
    yield from table(header, rows)


def _known(ranges: Ranges) -> list[tuple[str, tuple[float, float]]]:
    return [(name, allowed) for name, allowed in ranges.items() if allowed is not None]


def _constants(values: xr.DataArray, ranges: Ranges) -> Iterator[str]:
    for name, (low, high) in _known(ranges):
        value = float(values.sel(constant=name))
        text = f"{value:.4f}" if value < 0.1 else f"{value:.3f}"
        yield "not solved" if not np.isfinite(value) else text if low <= value <= high else f"**{text}**"


def maps(dataset: xr.Dataset) -> Iterator[str]:
    base = default(dataset)
    yield "### Default model\n"
    yield (
        "Rotor speed of least fuel, percent of nominal, and what it rests on: l lower bound, b blade loading with the "
        "margin, q torque, p engine power, T turbine temperature, t tail-rotor loading, f fold of the trims, u upper "
        "bound; no letter: interior. In parentheses: the nominal rotor is itself beyond a limit of engines or tail "
        "rotor, and the optimum may use as much of it; such points are in no mean below.\n"
    )
    yield from _flights(dataset.sel(base), _speed_cell)
    yield "Change of power / of fuel against 100 %, percent:\n"
    yield from _flights(
        dataset.sel(base), lambda d: f"{float(d.optimum_power_change):.1f} / {float(d.optimum_fuel_change):.1f}"
    )
    yield "Rotor speeds within 0.5 % of the least fuel and within the limits, percent:\n"
    yield from _flights(
        dataset.sel(base), lambda d: f"{float(d.optimum_band_low):.1f} to {float(d.optimum_band_high):.1f}"
    )
    yield "With margin 1.0, all else default, rotor speed of least fuel and change of fuel, percent:\n"
    yield from _flights(
        dataset.sel(base | {"margin": 1.0}), lambda d: f"{_speed_cell(d)}, {float(d.optimum_fuel_change):.1f}"
    )


def _speed_cell(point: xr.Dataset) -> str:
    text = f"{float(point.optimum_rotor_speed):.1f} {LETTERS[_flag(point.active)]}".strip()
    return text if int(point.flyable) else f"({text})"


def _flag(active: xr.DataArray) -> str:
    return str(active.attrs["flag_meanings"]).split(", ")[int(active)]


def _flights(chosen: xr.Dataset, cell: Any) -> Iterator[str]:
    rows = [
        [
            f"{mass:.0f} kg, {altitude:.0f} m",
            *(_cell(chosen.sel(mass=mass, altitude=altitude, speed=v), cell) for v in chosen.speed.values),
        ]
        for mass in chosen.mass.values
        for altitude in chosen.altitude.values
    ]
    yield from table(["", *(f"{v:.0f} m/s" for v in chosen.speed.values)], rows)


def _cell(point: xr.Dataset, cell: Any) -> str:
    return str(cell(point)) if int(point.active) >= 0 else "-"


def effects(dataset: xr.Dataset) -> Iterator[str]:
    yield "### What moves the answer\n"
    yield (
        "Difference that one change of the default model makes, mean over all altitudes and speeds where both are "
        "flyable (smallest to largest): rotor speed in percent of nominal, changes of power and fuel in points. "
        "Positive is a faster rotor, and less saved.\n"
    )
    for mass in dataset.mass.values[::-1]:
        base = usable(dataset, default(dataset)).sel(mass=mass)
        means = ", ".join(f"{label} {float(base[name].mean()):.1f}" for name, label in METRICS.items())
        yield f"{mass:.0f} kg; default model, mean over its flyable points: {means} %.\n"
        rows = []
        for change in levels(dataset):
            found = effect(dataset, change, mass)
            rows.append([named(change), *(_spread(found[name]) for name in METRICS)])
        yield from table(["change", *METRICS.values()], rows)
    yield f"Interactions of two changes at once, beyond the sum of both, of {NOTABLE} or more in fuel at 2400 kg:\n"
    yield from table(["changes", "rotor speed", "fuel"], interactions(dataset, float(dataset.mass.values[-1])))


def _spread(values: xr.DataArray) -> str:
    if not np.isfinite(values).any():
        return "-"
    return f"{float(values.mean()):+.1f} ({float(values.min()):+.1f} to {float(values.max()):+.1f})"


def interactions(dataset: xr.Dataset, mass: float) -> list[list[str]]:
    """Pairs of changes whose joint effect differs notably from the sum, largest first."""
    rows = []
    for first, second in combinations(levels(dataset), 2):
        if first.keys() == second.keys():
            continue
        both = effect(dataset, first | second, mass)
        rest = (both - effect(dataset, first, mass) - effect(dataset, second, mass)).mean()
        if abs(float(rest.optimum_fuel_change)) >= NOTABLE:
            rows.append((rest, f"{named(first)}; {named(second)}"))
    rows.sort(key=lambda row: -abs(float(row[0].optimum_fuel_change)))
    return [
        [name, f"{float(rest.optimum_rotor_speed):+.1f}", f"{float(rest.optimum_fuel_change):+.1f}"]
        for rest, name in rows[:12]
    ]


def all_models(dataset: xr.Dataset, ranges: Ranges) -> Iterator[str]:
    inside = xr.ones_like(dataset.duration, dtype=bool)
    for name, (low, high) in _known(ranges):
        value = dataset.constants.sel(constant=name)
        inside = inside & (value >= low) & (value <= high)
    yield "### All models\n"
    yield (
        "Mean optimum of each physics model over its flyable points: least, median and largest of all models, then of "
        f"the {int(inside.sum())} models with all constants inside their ranges; what the optima of all rest on; "
        "and the share of them where the rotor slows by less than 3 %.\n"
    )
    rows = []
    for mass in dataset.mass.values:
        for margin in sorted(dataset.margin.values):
            for engine in dataset.engine.values:
                place = {"margin": margin, "engine": engine, "mass": mass}
                found = usable(dataset, place)
                columns = [_three(found[name], kept) for kept in (True, inside) for name in SHOWN]
                known = found.optimum_rotor_speed.values[np.isfinite(found.optimum_rotor_speed.values)]
                share = f"{100 * np.mean(known > 97):.0f} %"
                rows.append([f"{mass:.0f} kg", margin, engine, *columns, _supports(dataset.sel(place)), share])
    header = ("rotor speed %", "fuel %", "rotor speed %, inside", "fuel %, inside", "rests on", "little or none")
    yield from table(["mass", "margin", "engine", *header], rows)


def _three(values: xr.DataArray, kept: xr.DataArray | bool) -> str:
    """Least, median and largest of the models' means over the flights."""
    means = values.mean(("altitude", "speed")).where(kept).values
    means = means[np.isfinite(means)]
    return f"{means.min():.1f}, {np.median(means):.1f}, {means.max():.1f}" if means.size else "-"


def _supports(chosen: xr.Dataset) -> str:
    """What the optima of flyable points rest on, most frequent first."""
    codes = chosen.active.values[chosen.flyable.values == 1]
    names = str(chosen.active.attrs["flag_meanings"]).split(", ")
    shares = sorted(((float(np.mean(codes == k)), names[k]) for k in np.unique(codes)), reverse=True)
    return ", ".join(f"{name} {100 * share:.0f} %" for share, name in shares if share >= 0.005)


def prototype(dataset: xr.Dataset) -> Iterator[str]:
    yield "### Power ratio at 30 m/s\n"
    yield "Power over power at 100 %, without limits; '-' beyond a fold or the blade-loading limit.\n"
    percent, rows, base = (75, 80, 85, 90, 115), [], default(dataset)
    for change in [{}, *(change for change in levels(dataset) if not {"margin", "engine"} & change.keys())]:
        for mass, altitude in ((1600.0, 0.0), (2400.0, 0.0), (2400.0, 1000.0), (2400.0, 2000.0)):
            choice = base | change | {"mass": mass, "altitude": altitude, "speed": 30.0}
            cells = [f"{value:.3f}" for value in power_ratio(dataset, choice, np.array(percent) / 100)]
            rows.append([named(change) or "default", f"{mass:.0f} kg, {altitude:.0f} m", *cells])
    yield from (line.replace("nan", "-") for line in table(["model", "flight", *(f"{r} %" for r in percent)], rows))


def solution(dataset: xr.Dataset) -> Iterator[str]:
    yield "### Points and accuracy\n"
    ends = str(dataset.curve_end.attrs["flag_meanings"]).split(", ")
    codes = dataset.curve_end.values
    counts = ", ".join(f"{name} {int(np.sum(codes == k))}" for k, name in enumerate(ends))
    speeds = dataset.curve_rotor_speed
    lost = (codes >= 0) & ~((speeds.min("node") <= 100.0) & (speeds.max("node") >= 100.0)).values
    trims = int(np.isfinite(dataset.curve_power.values).sum())
    yield f"{trims} trims on {codes.size} curves, {int(np.sum(codes < 0))} without. The curves end at: {counts}. "
    yield f"Curves that do not reach 100 %, so that they have no optimum: {int(np.sum(lost))}.\n"
    rows = [
        (
            name,
            *(
                int(np.sum(dataset.curve_end.sel(section=name, mass=mass).values == k))
                for mass in dataset.mass.values
                for k in (2, 3, 4)
            ),
        )
        for name in dataset.section.values
    ]
    header = [f"{m:.0f} kg: {ends[k]}" for m in dataset.mass.values for k in (2, 3, 4)]
    yield from table(["section", *header], rows)
    check = {name.removeprefix("check_"): 100 * value for name, value in dataset.attrs.items() if "check_" in str(name)}
    yield (
        "Checks on the default model at 1600 and 2400 kg, sea level, 0, 30 and 60 m/s, largest error over all rotor "
        f"speeds: resolution of the study against the package's own, {check.get('resolution', np.nan):.2f} % of power "
        f"and {check.get('resolution_change', np.nan):.2f} points in its change against nominal; interpolation against "
        f"twice the rotor speeds, {check.get('interpolation', np.nan):.2f} % of power.\n"
    )
    if "wall_time" in dataset.attrs:
        yield (
            f"Wall time of calibrations, trims and checks {dataset.attrs['wall_time'] / 60:.1f} minutes in "
            f"{dataset.attrs['workers']} processes; {float(dataset.duration.mean()):.0f} s for one physics model.\n"
        )


def write_page(folder: Path, dataset: xr.Dataset, ranges: Ranges) -> None:
    """Keep the text of the page above the marker, write figures and tables below it."""
    page = folder / "optimum_speed.md"
    figures = draw(dataset, folder / "figures")
    lines = ["", "## Results\n", *(f"![{title}](figures/{name})\n" for name, title in figures.items())]
    for part in (maps, effects):
        lines += part(dataset)
    lines += [*all_models(dataset, ranges), *prototype(dataset), *solution(dataset), *calibration(dataset, ranges)]
    write_below(MARKER, page, "\n".join(lines), title="Optimum rotor speed")
