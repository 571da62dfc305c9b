"""Best rotor speed and twist over the flight envelope: every operating point by itself, as maps."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from joblib import Parallel, delayed
from rich.console import Console
from rich.progress import track
from threadpoolctl import threadpool_limits

from vrsopt.errors import InputError
from vrsopt.helicopter import Helicopter, allowed_ranges, helicopter
from vrsopt.limits import LIMIT_NAMES, MARGINS, Limits, Setting
from vrsopt.mission.conditions import Conditions
from vrsopt.progress import telling
from vrsopt.schedule.batched import batched_minimum, rotor_speed_band
from vrsopt.schedule.schedule import ON_LIMIT, ScheduleSettings, Variables
from vrsopt.schedule.study_input import loaded
from vrsopt.schedule.surrogate_path import SurrogateAircraft
from vrsopt.solvers.status import Status
from vrsopt.surrogate.sampling import WORKERS, check_counts
from vrsopt.surrogate.store import Surrogate

if TYPE_CHECKING:
    import xarray as xr

MASSES = (1600.0, 2000.0, 2400.0)  # kg
POINTS = 56_000
MOST_POINTS = 10_000_000
BATCH = 600  # operating conditions at a time, at all masses: bounds the memory
BAND_POINTS = 161
SIDES = ("lowest rotor speed", "highest rotor speed", "least twist", "largest twist")
ACTIVE = (*LIMIT_NAMES, *SIDES)  # what an optimum can rest on, bit by bit
AT_SIDE = 1e-6  # of a range
PERCENT = 100.0

# of the batches, (n, masses) each: name, unit, words
VARIABLES = (
    ("rotor_speed_percent", "%", "optimum rotor speed over nominal"),
    ("twist_deg", "deg", "optimum blade twist, washout positive"),
    ("fuel_flow_kg_s", "kg s-1", "least fuel flow, both engines"),
    ("fuel_flow_delta_percent", "%", "change of fuel flow against nominal rotor speed and twist"),
    ("nox_delta_percent", "%", "change of NOx against nominal rotor speed and twist"),
    ("band_low_percent", "%", "lowest rotor speed within 0.5 % of the least fuel flow"),
    ("band_high_percent", "%", "highest rotor speed within 0.5 % of the least fuel flow"),
)


@dataclass(frozen=True)
class Envelope:
    """Maps over (mass, altitude, speed) in ``dataset``; see :func:`envelope`.

    ``success`` is false where no operating point at all can be flown.
    """

    dataset: xr.Dataset
    success: bool
    status: Status
    message: str

    @property
    def points(self) -> int:
        """Number of operating points."""
        return int(self.dataset["feasible"].size)

    def summary(self) -> dict[str, Any]:
        """Means and shares by mass, for one JSON object."""
        rows = {f"{mass:g}": self._row(self.dataset.sel(mass=mass)) for mass in self.dataset["mass"].values}
        names = ("free_variables", "manoeuvre_margin", "isa_offset_k", "rotor_speed_percent_bounds")
        settings = {name: _plain(self.dataset.attrs[name]) for name in names}
        return (
            {"success": self.success, "message": self.message, "points": self.points} | settings | {"masses_kg": rows}
        )

    @staticmethod
    def _row(maps: xr.Dataset) -> dict[str, Any]:
        feasible = maps["feasible"].values == 1
        active = maps["active"].values[feasible]
        shares = {name: _percent(active & 1 << bit != 0) for bit, name in enumerate(ACTIVE)}
        means = {
            f"mean_{name}": float(np.mean(maps[name].values[feasible])) if feasible.any() else math.nan
            for name in ("rotor_speed_percent", "twist_deg", "fuel_flow_delta_percent", "nox_delta_percent")
        }
        return {
            "feasible_percent": _percent(feasible),
            "nominal_feasible_percent": _percent(maps["nominal_feasible"].values == 1),
            **means,
            "free_percent": _percent(active == 0),
            "active_percent": shares,
        }

    def __str__(self) -> str:
        head = ("mass kg", "feasible %", "rotor %", "twist deg", "fuel %", "NOx %", "free %", "mostly on")
        lines = ["".join(f"{word:>12}" for word in head)]
        for mass, row in self.summary()["masses_kg"].items():
            shares = row["active_percent"]
            most = max(shares, key=shares.get)
            numbers = (row["feasible_percent"], *(row[name] for name in row if name.startswith("mean_")))
            cells = "".join(f"{number:12.2f}" for number in (*numbers, row["free_percent"]))
            lines.append(f"{mass:>12}{cells}   {most} {shares[most]:.0f} %")
        return "\n".join([*lines, self.message])


def envelope(
    surrogate: Surrogate | Path | str | None = None,
    *,
    variables: Variables = "both",
    points: int = POINTS,
    masses: Sequence[float] = MASSES,
    speeds: tuple[float, float] = (0.0, 70.0),
    altitudes: tuple[float, float] = (0.0, 2000.0),
    rotor_speed_bounds: tuple[float, float] | None = None,
    manoeuvre_margin: float | None = None,
    limits: Setting = "manual",
    isa_offset: float = 0.0,
    aircraft: str = "bo105",
    workers: int = 1,
    progress: bool = False,
) -> Envelope:
    """Rotor speed and twist of least fuel flow in level flight at ``points`` or a few more operating points.

    ``surrogate``: fitted by :func:`vrsopt.fit`; default the shipped one. The points are spread evenly over ``masses``
    [kg], ``speeds`` [m/s] and pressure ``altitudes`` [m]. ``variables``: what is free, "both", "speed" or "twist".
    ``rotor_speed_bounds`` [rad/s] default to 75 to 115 % of nominal; ``manoeuvre_margin`` to the aircraft's; ``limits``
    "manual" or "study"; ``isa_offset`` [K]. The result does not depend on ``workers``, the number of processes;
    ``progress`` shows how far it is.

    Its ``dataset`` has the dimensions (mass, altitude, speed) and the maps of VARIABLES, nan where no rotor speed and
    twist keep the limits; ``feasible``, ``nominal_feasible`` (1 or 0); ``active``, of bits: what the optimum rests on;
    ``nearest_limit``, the one that is broken where it is infeasible.

    Raises :class:`InputError` for settings that can not be used.
    """
    machine = helicopter(aircraft)
    settings = _settings(machine, rotor_speed_bounds).restricted(variables)
    asked = {"mass": masses, "speed": speeds, "altitude": altitudes}
    _check(points, asked, isa_offset, allowed_ranges(machine.aircraft))
    check_counts("envelope", workers=(workers, *WORKERS))
    margin = machine.aircraft.blade_loading_limit.manoeuvre_margin if manoeuvre_margin is None else manoeuvre_margin
    if not MARGINS[0] <= margin <= MARGINS[1]:
        allowed = f"a number from {MARGINS[0]:g} to {MARGINS[1]:g}"
        raise InputError(f"envelope: manoeuvre_margin = {margin:g}: {allowed}")
    side = math.ceil(math.sqrt(points / len(masses)))
    axes = {
        "mass": np.array(masses, float),
        "altitude": np.linspace(*altitudes, side),
        "speed": np.linspace(*speeds, side),
    }
    altitude, speed = (axis.ravel() for axis in np.meshgrid(axes["altitude"], axes["speed"], indexing="ij"))
    batches = [slice(begin, begin + BATCH) for begin in range(0, len(speed), BATCH)]
    with threadpool_limits(limits=1):
        rules = Limits(machine.aircraft, machine.engine, limits, margin)
        with telling("envelope: surrogate and table of emissions", wanted=progress):
            make = SurrogateAircraft(loaded(surrogate, machine.data_hash), rules, isa_offset=isa_offset)
            _ = make.plant.emission_table  # what fails should fail at once
        search = _Search(make, settings, axes["mass"])
        jobs = (delayed(search.optima)(speed[batch], altitude[batch]) for batch in batches)
        found: Iterable[Any] = Parallel(n_jobs=workers, return_as="generator")(jobs)
        if progress:
            found = track(found, total=len(batches), description="envelope", console=Console(stderr=True))
        parts = [search.maps(speed[batch], altitude[batch], part) for batch, part in zip(batches, found, strict=True)]
    shape = (len(masses), side, side)
    maps = {name: np.concatenate([part[name] for part in parts]).T.reshape(shape) for name in parts[0]}
    return _envelope(maps, axes, _attributes(variables, settings, rules, make, machine))


@dataclass(frozen=True)
class _Search:
    """What is done at every batch of operating conditions, at all masses."""

    make: SurrogateAircraft
    settings: ScheduleSettings
    masses: np.ndarray

    def _model(self, speed: np.ndarray, altitude: np.ndarray) -> tuple[Any, np.ndarray]:
        count = len(self.masses)
        model = self.make(Conditions.level(np.repeat(speed, count), np.repeat(altitude, count)))
        return model, np.tile(self.masses, len(speed))

    def optima(self, speed: np.ndarray, altitude: np.ndarray) -> dict[str, np.ndarray]:
        """Optima and bands, (n masses,) each, SI units."""
        model, mass = self._model(speed, altitude)
        box = self.settings.box(model.bounds)
        best = batched_minimum(model, mass, box=box)
        low, high = rotor_speed_band(model, mass, optima=best, box=box, points=BAND_POINTS)
        limits = model.evaluate(mass, best.rotor_speed, best.twist).limits
        active = sum((np.abs(limit) <= ON_LIMIT) << bit for bit, limit in enumerate(limits))
        for k, value in enumerate((best.rotor_speed, best.twist)):
            span = box[1, k] - box[0, k]
            for upper in (0, 1):
                at = (np.abs(value - box[upper, k]) <= AT_SIDE * span) & (span > 0.0)
                active = active | at << len(limits) + 2 * k + upper
        own = {name: getattr(best, name) for name in ("rotor_speed", "twist", "fuel_flow", "power_per_engine")}
        flags = {"feasible": best.excess <= 1e-6, "nearest_limit": best.nearest_limit, "active": active}
        return own | flags | {"low": low, "high": high}

    def maps(self, speed: np.ndarray, altitude: np.ndarray, found: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """The maps (n, masses) of a batch: engineering units, against the nominal rotor."""
        model, mass = self._model(speed, altitude)
        nominal, twist = self.settings.nominal_rotor_speed, self.settings.nominal_twist
        base = model.evaluate(mass, nominal, twist)
        columns = (
            np.column_stack(pair)
            for pair in (
                (found["fuel_flow"], base.fuel_flow),
                (found["power_per_engine"], base.power_per_engine),
                (found["rotor_speed"], np.full(len(mass), nominal)),
            )
        )
        nox = model.emissions(*columns)["nox"]
        values = {
            "rotor_speed_percent": PERCENT * found["rotor_speed"] / nominal,
            "twist_deg": np.degrees(found["twist"]),
            "fuel_flow_kg_s": found["fuel_flow"],
            "fuel_flow_delta_percent": PERCENT * (found["fuel_flow"] / base.fuel_flow - 1.0),
            "nox_delta_percent": PERCENT * (nox[:, 0] / nox[:, 1] - 1.0),
            "band_low_percent": PERCENT * found["low"] / nominal,
            "band_high_percent": PERCENT * found["high"] / nominal,
        }
        feasible = found["feasible"]
        maps = {name: np.where(feasible, value, np.nan) for name, value in values.items()}
        maps |= {
            "feasible": feasible.astype(np.int8),
            "nominal_feasible": (np.max(base.limits, axis=0) <= ON_LIMIT).astype(np.int8),
            "active": np.where(feasible, found["active"], 0).astype(np.int16),
            "nearest_limit": np.where(feasible, -1, found["nearest_limit"]).astype(np.int8),
        }
        return {name: value.reshape(len(speed), -1) for name, value in maps.items()}


def _settings(machine: Helicopter, bounds: tuple[float, float] | None) -> ScheduleSettings:
    rotor = machine.aircraft.main_rotor
    nominal = rotor.nominal_rotor_speed
    settings = ScheduleSettings(nominal_rotor_speed=nominal, nominal_twist=rotor.twist)
    return settings if bounds is None else replace(settings, rotor_speed_bounds=bounds)


def _check(
    points: int,
    axes: Mapping[str, Sequence[float]],
    isa_offset: float,
    allowed: Mapping[str, tuple[float, float]],
) -> None:
    """Raises :class:`InputError` unless each of ``axes`` is ascending and inside what a trim allows."""
    masses = axes["mass"]
    if isinstance(points, bool) or not 4 <= 4 * len(masses) <= points <= MOST_POINTS:
        raise InputError(f"envelope: points = {points}: from 4 at each of {len(masses)} masses to {MOST_POINTS}")
    for name, values in axes.items():
        low, high = allowed[name]
        ascending = all(a < b for a, b in pairwise(values))
        if not (ascending and all(low <= value <= high for value in values)):
            raise InputError(f"envelope: {name} = {list(values)}: ascending, from {low:g} to {high:g}")
    low, high = allowed["isa_offset"]
    if not low <= isa_offset <= high:
        raise InputError(f"envelope: isa_offset = {isa_offset:g}: from {low:g} to {high:g}")


def _attributes(
    variables: str, settings: ScheduleSettings, limits: Limits, make: SurrogateAircraft, machine: Helicopter
) -> dict[str, Any]:
    bounds = np.array(settings.rotor_speed_bounds) / settings.nominal_rotor_speed
    return {
        "format": "vrsopt envelope",
        "free_variables": variables,
        "manoeuvre_margin": limits.manoeuvre_margin,
        "limits": limits.setting,
        "isa_offset_k": make.plant.isa_offset,
        "rotor_speed_percent_bounds": np.round(PERCENT * bounds, 9),
        "nominal_rotor_speed_rad_s": settings.nominal_rotor_speed,
        "nominal_twist_deg": math.degrees(settings.nominal_twist),
        "aircraft": machine.aircraft.name,
        "data_hash": machine.data_hash,
    }


def _envelope(maps: dict[str, np.ndarray], axes: dict[str, np.ndarray], attributes: dict[str, Any]) -> Envelope:
    import xarray as xr

    words: dict[str, dict[str, Any]] = {name: {"units": unit, "long_name": text} for name, unit, text in VARIABLES}
    words["feasible"] = {"long_name": "some rotor speed and twist keep all limits"}
    words["nominal_feasible"] = {"long_name": "nominal rotor speed and twist keep all limits"}
    flags = " ".join(name.replace(" ", "_") for name in ACTIVE)
    masks = np.array([1 << bit for bit in range(len(ACTIVE))], dtype=np.int16)
    words["active"] = {"long_name": "what the optimum rests on", "flag_masks": masks, "flag_meanings": flags}
    words["nearest_limit"] = {
        "long_name": "limit broken where infeasible",
        "flag_meanings": " ".join(flags.split()[:5]),
    }
    units = {"mass": "kg", "altitude": "m", "speed": "m s-1"}
    data = {name: (tuple(axes), value, words[name]) for name, value in maps.items()}
    dataset = xr.Dataset(data, {name: (name, axis, {"units": units[name]}) for name, axis in axes.items()}, attributes)
    feasible = maps["feasible"] == 1
    left = maps["nearest_limit"][~feasible]
    message = f"{feasible.size} operating points, all of them flyable"
    if left.size:
        worst = LIMIT_NAMES[int(np.bincount(left).argmax())]
        message = f"{feasible.size} operating points, {left.size} not flyable, most of them for {worst}"
    success = bool(feasible.any())
    return Envelope(dataset, success, Status.CONVERGED if success else Status.INFEASIBLE, message)


def _percent(flags: np.ndarray) -> float:
    return PERCENT * float(np.mean(flags)) if flags.size else math.nan


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value
