"""How far should the rotor slow down, above all when the aircraft is heavy, and what does the answer rest on?

    python problems/optimum_speed.py --out optimum_speed.nc [--workers 2] [--reuse optimum_speed.nc]

A full factorial over section drag, tail rotor, inflow, calibration split, manoeuvre margin and engine coupling. Every
physics model is calibrated on the hover and cruise power of the flight manual, then walked along rotor speed at every
mass, altitude and airspeed. All results go to a NetCDF file, tables and figures to problems/optimum_speed.md, below the
text. With --reuse the power curves of an earlier run are taken, and only optima and page are made again.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import joblib
import numpy as np
import xarray as xr
from calibrate_rotor import allowed_range
from optimum_speed_curves import (
    COARSE,
    ENDS,
    INFLOWS,
    NODES,
    REFINEMENTS,
    SECTIONS,
    SPLIT_NAMES,
    TAIL_ROTORS,
    Curve,
    Flight,
    Physics,
    Walk,
    slowest,
)
from optimum_speed_limits import ACTIVE, ENGINES, MARGINS, Engine, optimum
from optimum_speed_page import write_page
from optimum_speed_results import curve_at
from rich.progress import Progress

from vrsopt.aircraft import load_aircraft
from vrsopt.equilibrium import rotor_model, trim_system
from vrsopt.errors import NoSolutionError
from vrsopt.limits import Limits
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.turboshaft.data import load_engine

Grid = tuple[Sequence[float], Sequence[float], Sequence[float]]
GRID: Grid = ((1600.0, 2000.0, 2400.0), (0.0, 1000.0, 2000.0), tuple(10.0 * k for k in range(8)))  # kg, m, m/s
CONSTANTS = ("induced_power_factor", "section_drag_level", "parasite_area")
INGREDIENTS = {"section": SECTIONS, "tail_rotor": TAIL_ROTORS, "inflow": INFLOWS, "split": SPLIT_NAMES}
FLIGHT = ("mass", "altitude", "speed")
WIDTH = NODES + 2 * REFINEMENTS
CHECKED = [Flight(mass, 0.0, speed) for mass in (1600.0, 2400.0) for speed in (0.0, 30.0, 60.0)]


@dataclass(frozen=True)
class Mapped:
    """One physics model: its constants, nan where it can not be calibrated, and its curves, none then."""

    physics: Physics
    constants: dict[str, float]
    curves: tuple[tuple[Flight, Curve], ...]
    message: str
    duration: float  # s


def mapped(physics: Physics, grid: Grid) -> Mapped:
    """Calibrate and walk one physics model over masses, altitudes and speeds."""
    begin = time.perf_counter()
    try:
        constants = physics.constants()
    except NoSolutionError as error:
        return Mapped(physics, dict.fromkeys(CONSTANTS, np.nan), (), str(error), time.perf_counter() - begin)
    curves = tuple(Walk(physics, constants).curves(*grid))
    trim_system.cache_clear()  # systems are large, and no other model uses this one
    rotor_model.cache_clear()
    return Mapped(physics, constants, curves, "", time.perf_counter() - begin)


def checked(physics: Physics, flights: Sequence[Flight] = CHECKED) -> dict[str, float]:
    """Largest errors of the curves of ``physics``, relative to power: of the coarse resolution against the package's
    own, each with constants of its own, in power and in its change against nominal; and of interpolating."""
    fine = replace(Fidelity(), highest_shape=max(Fidelity().highest_shape, COARSE.highest_shape))
    constants = physics.constants()
    walks = (Walk(physics, constants), Walk(physics, physics.constants(fine), fine), Walk(physics, constants))
    errors: dict[str, list[float]] = {name: [0.0] for name in ("resolution", "resolution_change", "interpolation")}
    for flight in flights:
        low = slowest(walks[0].limits, flight)
        counts = (NODES, NODES, 2 * NODES - 1)
        curves = [walk.curve(flight, np.linspace(1.15, low, n))[0] for walk, n in zip(walks, counts, strict=True)]
        ratio = np.linspace(max(curve.ratio[-1] for curve in curves) + 1e-9, 1.15, 81)
        coarse, finer, denser = (curve.between(np.log(curve.power), ratio) for curve in curves)
        at_nominal = int(np.argmin(np.abs(ratio - 1.0)))
        errors["resolution"].append(np.max(np.abs(coarse - finer)))
        errors["resolution_change"].append(np.max(np.abs(coarse - finer - (coarse - finer)[at_nominal])))
        errors["interpolation"].append(np.max(np.abs(coarse - denser)))
    return {name: float(max(values)) for name, values in errors.items()}


def factorial() -> Iterator[Physics]:
    return (Physics(*names) for names in product(*INGREDIENTS.values()))


def run(models: Sequence[Physics], grid: Grid, workers: int) -> tuple[xr.Dataset, dict[str, float]]:
    """Curves of all ``models`` on the grid, in processes, and the checks of the default model."""
    begin, found = time.perf_counter(), []
    jobs = [joblib.delayed(checked)(Physics()), *(joblib.delayed(mapped)(physics, grid) for physics in models)]
    with joblib.parallel_config(backend="loky", inner_max_num_threads=1), Progress() as progress:
        task = progress.add_task("physics models", total=len(jobs))
        for result in joblib.Parallel(n_jobs=workers, return_as="generator")(jobs):
            found.append(result)
            progress.advance(task)
    checks, *rest = found
    dataset = gathered(rest, grid)
    dataset.attrs |= {"wall_time": time.perf_counter() - begin, "workers": workers}
    return dataset, checks


def gathered(models: Sequence[Mapped], grid: Grid) -> xr.Dataset:
    """Constants and curves as one data set; nan beyond the end of a curve and for combinations not in ``models``."""
    coords = {name: list(levels) for name, levels in INGREDIENTS.items()} | dict(
        zip(FLIGHT, map(list, grid), strict=True)
    )
    sizes = tuple(len(values) for values in coords.values())
    curves = {name: np.full((*sizes, WIDTH), np.nan) for name in ("rotor_speed", "power", "tail_loading")}
    constants, end = np.full((*sizes[:4], len(CONSTANTS)), np.nan), np.full(sizes, -1, dtype=np.int8)
    duration = np.full(sizes[:4], np.nan)
    for model in models:
        place = tuple(levels.index(getattr(model.physics, name)) for name, levels in INGREDIENTS.items())
        constants[place] = [model.constants[name] for name in CONSTANTS]
        duration[place] = model.duration
        for flight, curve in model.curves:
            where = place + tuple(values.index(part) for values, part in zip(grid, flight, strict=True))
            end[where] = ENDS.index(curve.end)
            for name, values in zip(curves, (100 * curve.ratio, curve.power, curve.tail_loading), strict=True):
                curves[name][where][: len(values)] = values
    nodes, units = (*coords, "node"), {"rotor_speed": "percent of nominal", "power": "W", "tail_loading": "1"}
    dataset = xr.Dataset(
        {f"curve_{name}": (nodes, values, {"units": units[name]}) for name, values in curves.items()}
        | {
            "curve_end": (
                tuple(coords),
                end,
                {"flag_values": list(range(len(ENDS))), "flag_meanings": ", ".join(ENDS)},
            ),
            "constants": ((*INGREDIENTS, "constant"), constants),
            "duration": (tuple(INGREDIENTS), duration, {"units": "s"}),
        },
        coords=coords | {"constant": list(CONSTANTS)},
    )
    for name, unit in zip(FLIGHT, ("kg", "m", "m/s"), strict=True):
        dataset[name].attrs["units"] = unit
    return dataset


def with_optima(dataset: xr.Dataset) -> xr.Dataset:
    """The data set with the optimum of every curve under every margin and engine coupling."""
    aircraft = load_aircraft("bo105")
    engine_data = load_engine(aircraft.engine)
    limits = [Limits(aircraft, engine_data, manoeuvre_margin=margin) for margin in MARGINS]
    sizes = dataset.curve_end.shape
    names = ("rotor_speed", "power_change", "fuel_change", "band_low", "band_high")
    values = {name: np.full((*sizes, len(MARGINS), len(ENGINES)), np.nan) for name in names}
    active = np.full((*sizes, len(MARGINS), len(ENGINES)), -1, dtype=np.int8)
    flyable = np.zeros_like(active)
    engines = {(h, v): Engine.at(h, v) for h in dataset.altitude.values for v in dataset.speed.values}
    for index in np.ndindex(sizes):
        curve = curve_at(dataset, index)
        if curve is None:
            continue
        flight = Flight(*(float(dataset[name].values[k]) for name, k in zip(FLIGHT, index[4:], strict=True)))
        stalling = dataset.tail_rotor.values[index[1]] == TAIL_ROTORS[0]
        for m, e in product(range(len(MARGINS)), range(len(ENGINES))):
            best = optimum(
                curve,
                flight,
                limits[m],
                engines[flight.altitude, flight.speed],
                coupled=ENGINES[e] == "coupled",
                tail_limit=stalling,
            )
            if best is None:
                continue
            numbers = (best.ratio, best.power_change, best.fuel_change, *best.band)
            for name, number in zip(names, numbers, strict=True):
                values[name][(*index, m, e)] = 100 * number
            active[(*index, m, e)] = ACTIVE.index(best.active)
            flyable[(*index, m, e)] = best.flyable
    dims = (*dataset.curve_end.dims, "margin", "engine")
    flags = {"flag_values": list(range(len(ACTIVE))), "flag_meanings": ", ".join(ACTIVE)}
    return dataset.assign_coords(margin=list(MARGINS), engine=list(ENGINES)).assign(
        {f"optimum_{name}": (dims, array, {"units": "percent"}) for name, array in values.items()}
        | {"active": (dims, active, flags), "flyable": (dims, flyable)}
    )


def main() -> None:
    parser = argparse.ArgumentParser(description="Optimum rotor speed: full factorial of models.")
    parser.add_argument("--out", type=Path, required=True, help="NetCDF file of all results")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--reuse", type=Path, help="take the power curves of this earlier result")
    options = parser.parse_args()
    if options.reuse:
        dataset = xr.load_dataset(options.reuse, engine="scipy")
        checks = {name.removeprefix("check_"): value for name, value in dataset.attrs.items() if "check_" in name}
        dataset = dataset[[name for name in dataset if str(name).startswith("curve_")] + ["constants", "duration"]]
    else:
        dataset, checks = run(list(factorial()), GRID, options.workers)
    dataset = with_optima(dataset)
    dataset.attrs |= {f"check_{name}": value for name, value in checks.items()}
    dataset.to_netcdf(options.out, engine="scipy", format="NETCDF3_64BIT")
    aircraft = load_aircraft("bo105")
    write_page(Path(__file__).parent, dataset, {name: allowed_range(aircraft, name) for name in CONSTANTS})


if __name__ == "__main__":
    main()
