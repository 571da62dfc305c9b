"""What the tables and figures of the study of the optimum rotor speed read from its data set."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from optimum_speed_curves import ENDS, Curve

FACTORS = {
    "section": "section",
    "tail_rotor": "tail rotor",
    "inflow": "inflow",
    "split": "calibration split",
    "margin": "manoeuvre margin",
    "engine": "engine",
}
METRICS = {"optimum_rotor_speed": "rotor speed", "optimum_power_change": "power", "optimum_fuel_change": "fuel"}


def default(dataset: xr.Dataset) -> dict[str, Any]:
    """The default model: the first level of every factor."""
    return {name: dataset[name].values[0] for name in FACTORS}


def usable(dataset: xr.Dataset, choice: Mapping[str, Any]) -> xr.Dataset:
    """Optima of one model, nan where the nominal rotor is beyond a limit of engines or tail rotor."""
    chosen = dataset.sel(choice)
    return chosen[list(METRICS)].where(chosen.flyable == 1)


def effect(dataset: xr.Dataset, changes: Mapping[str, Any], mass: float) -> xr.Dataset:
    """Difference of the optima that ``changes`` make to the default model at ``mass``, at every altitude and speed."""
    base = default(dataset)
    return (usable(dataset, {**base, **changes}) - usable(dataset, base)).sel(mass=mass)


def levels(dataset: xr.Dataset) -> list[dict[str, Any]]:
    """Every single change of the default model."""
    return [{name: value} for name in FACTORS for value in dataset[name].values[1:]]


def named(changes: Mapping[str, Any]) -> str:
    return ", ".join(f"{FACTORS[name]} {value}" for name, value in changes.items())


def curve_at(dataset: xr.Dataset, index: tuple[int, ...]) -> Curve | None:
    """The curve at ``index`` (section, tail rotor, inflow, split, mass, altitude, speed), None where there is none."""
    end = int(dataset.curve_end.values[index])
    if end < 0:
        return None
    ratio, power, tail = (dataset[f"curve_{name}"].values[index] for name in ("rotor_speed", "power", "tail_loading"))
    known = np.isfinite(ratio)
    return Curve(ratio[known] / 100, power[known], tail[known], ENDS[end])


def power_ratio(dataset: xr.Dataset, choice: Mapping[str, Any], ratio: np.ndarray) -> np.ndarray:
    """Power over that of the nominal rotor at rotor speeds over nominal, nan beyond the end of the curve.

    choice: the levels of section, tail rotor, inflow and split, and a flight.
    """
    known = [list(dataset[name].values) for name in dataset.curve_end.dims]
    wanted = [choice[str(name)] for name in dataset.curve_end.dims]
    index = tuple(levels.index(level) if level in levels else -1 for levels, level in zip(known, wanted, strict=True))
    curve = curve_at(dataset, index) if min(index) >= 0 else None
    if curve is None or len(curve.ratio) < 4 or not curve.ratio[-1] <= 1.0 <= curve.ratio[0]:
        return np.full(len(ratio), np.nan)
    logarithm = np.log(curve.power)
    return np.exp(curve.between(logarithm, ratio) - curve.between(logarithm, np.array([1.0])))
