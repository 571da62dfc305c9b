"""The gas path against pyCycle's with the same component maps, as one JSON object; exit code 1 if a target is missed.

    python tests/benchmarks/pycycle_comparison.py [--environment PATH]

Makes a virtual environment (PATH, or a temporary one) with om-pycycle and the numpy it works with, runs there
pycycle_engine.py, and solves the product's gas path at the same points with pyCycle's own tables (compressor AXI5,
LPT2269 for both turbines), scaled as pyCycle scales them. Alike on both sides: design point, losses and their laws
(but the exhaust is a nozzle of fixed area there), cooling air, mechanical losses, accessories; combustion efficiency
is constant. The two heat balances meet in one number, the heating value with which the product needs pyCycle's fuel at
the design point. Times are process times of this one run.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import venv
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from made_with import made_with
from process_time import process_time
from pycycle_maps import CompressorTables, TurbineTables, component_maps

from vrsopt.bulk import BulkSolver
from vrsopt.residual import ResidualSystem, Solution
from vrsopt.turboshaft.cycle import gas_path, sized
from vrsopt.turboshaft.data import EngineData, load_engine
from vrsopt.turboshaft.design_point import KILOWATT_HOUR
from vrsopt.turboshaft.gas import enthalpy, fuel_enthalpy

PACKAGES = ("numpy==2.2.6", "openmdao==3.45.1", "om-pycycle==4.4.0")  # TABULAR thermodynamics fail with numpy 2.4
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
HIGH_POWER, HIGH_TARGET, LOW_TARGET = 120e3, 0.5, 1.0  # W; % of fuel above and below it
SMALLEST_TIME_RATIO = 1000.0
PLACE = {"power_turbine_speed": 1.0, "altitude": 0.0, "isa_offset": 0.0, "mach": 0.0}
POWERS = (319e3, 300e3, 280e3, 257e3, 230e3, 207e3, 180e3, 157e3, 121e3, 76e3, 48e3, 20e3)
ELSEWHERE: tuple[dict[str, float], ...] = (
    {"power": 280e3, "power_turbine_speed": 0.9},
    {"power": 207e3, "power_turbine_speed": 0.85},
    {"power": 207e3, "power_turbine_speed": 0.7},
    {"power": 207e3, "power_turbine_speed": 1.1},
    {"power": 207e3, "altitude": 2000.0},
    {"power": 207e3, "altitude": 2000.0, "isa_offset": 20.0},
    {"power": 207e3, "altitude": 1000.0, "isa_offset": -15.0, "mach": 0.2},
    {"power": 150e3, "power_turbine_speed": 0.9, "altitude": 3000.0, "mach": 0.15},
)
COMPARED = (
    "fuel_flow",
    "air_flow",
    "pressure_ratio",
    "gas_generator_speed",
    "compressor_exit_temperature",
    "turbine_inlet_temperature",
    "power_turbine_inlet_temperature",
    "exhaust_temperature",
)


def environment(folder: Path) -> Path:
    """The interpreter of the virtual environment in ``folder``, which is made if it is not there."""
    python = folder / "bin" / "python"
    if not python.exists():
        venv.create(folder, with_pip=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", *PACKAGES], check=True, stdout=sys.stderr)
    return python


def like_pycycle(engine: EngineData) -> EngineData:
    """The engine with a constant combustion efficiency: pyCycle burns everything."""
    return engine.changed("combustor", loss_slope=0.0, loss_curvature=0.0)


def request(engine: EngineData) -> dict[str, Any]:
    """What pycycle_engine.py is asked: the engine's numbers and the points, in two series."""
    given, ggt, pt = engine.design_point, engine.gas_generator_turbine, engine.power_turbine
    numbers = {
        "power": given.power,
        "air_flow": given.air_flow,
        "pressure_ratio": given.pressure_ratio,
        "turbine_inlet_temperature": sized(engine).t4,
        "intake_loss": engine.intake.pressure_loss,
        "compressor_efficiency": engine.compressor.efficiency,
        "cooling_fraction": ggt.cooling_fraction,
        "burner_loss": engine.combustor.pressure_loss,
        "ggt_efficiency": ggt.efficiency,
        "gg_mechanical_efficiency": ggt.mechanical_efficiency,
        "accessory_power": ggt.accessory_power,
        "duct_loss": pt.duct_pressure_loss,
        "pt_mechanical_efficiency": pt.mechanical_efficiency,
        "exhaust_loss": engine.exhaust.pressure_loss,
    }
    series = [[{**PLACE, "power": power} for power in POWERS], [{**PLACE, **point} for point in ELSEWHERE]]
    return {"engine": numbers, "series": series}


def answered(python: Path, asked: dict[str, Any]) -> dict[str, Any]:
    """pyCycle's answer; it leaves files where it runs."""
    script = Path(__file__).resolve().parent / "pycycle_engine.py"
    with tempfile.TemporaryDirectory() as folder:
        run = subprocess.run(
            [python, script],
            input=json.dumps(asked),
            cwd=folder,
            env={**os.environ, **ONE_THREAD},
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        )
    return json.loads(run.stdout)


def matched(engine: EngineData, fuel_flow: float) -> EngineData:
    """The engine with the heating value that gives the same turbine-inlet temperature at another design fuel flow."""
    design, given = sized(engine), engine.design_point
    ratio = fuel_flow / (given.air_flow * (1.0 - engine.gas_generator_turbine.cooling_fraction))
    heat = (enthalpy(design.t4) - enthalpy(design.t3)) / ratio + fuel_enthalpy(design.t4)
    return engine.changed("design_point", sfc=fuel_flow * KILOWATT_HOUR / given.power).changed(
        "combustor", heating_value=heat / engine.combustor.efficiency
    )


def parameters(point: dict[str, float]) -> dict[str, float]:
    """A point as parameters of the gas path."""
    names = {name: value for name, value in point.items() if name != "power"}
    return {"demand": point["power"], **names, "bleed_fraction": 0.0, "power_offtake": 0.0, "humidity": 0.0}


def solved(system: ResidualSystem, point: dict[str, float]) -> Solution:
    """The gas path at a point: Newton, and where a kink of the tables stops it IPOPT, as in a bulk solve."""
    solution = system.solve(parameters(point), method="newton")
    return solution if solution.success else system.solve(parameters(point))


def differences(ours: dict[str, float], theirs: dict[str, float]) -> dict[str, float]:
    """Product over pyCycle, less one, in per cent."""
    return {name: 100.0 * (ours[name] / theirs[name] - 1.0) for name in COMPARED}


def target(power: float) -> float:
    """Largest difference in fuel [%] at a power [W]."""
    return HIGH_TARGET if power > HIGH_POWER else LOW_TARGET


def missed(rows: Sequence[dict[str, Any]], ratios: dict[str, float]) -> list[str]:
    """The targets that are missed, one line each."""
    lines = []
    for row in rows:
        where = ", ".join(f"{name} {value:g}" for name, value in row["point"].items())
        if not row["solved"]:
            lines.append(f"{where}: not solved on both sides")
        elif not abs(row["difference_percent"]["fuel_flow"]) <= target(row["point"]["power"]):
            lines.append(f"{where}: fuel {row['difference_percent']['fuel_flow']:+.2f} %")
    return lines + [
        f"time ratio {name}: {ratio:.0f}" for name, ratio in ratios.items() if not ratio >= SMALLEST_TIME_RATIO
    ]


def compare(system: ResidualSystem, point: dict[str, Any]) -> dict[str, Any]:
    """One point on both sides; with pyCycle's failure where it has not solved it."""
    row = {"point": point["point"], "solved": False}
    if not point["converged"]:
        return {**row, "message": f"pyCycle: {point['message']}"}
    solution = solved(system, {**point["point"], "power": point["power"]})
    if not solution.success:
        return {**row, "message": solution.message}
    return {
        "point": point["point"],
        "solved": True,
        "difference_percent": differences(solution.outputs, point),
        "vrsopt": {name: solution.outputs[name] for name in COMPARED},
        "pycycle": {name: point[name] for name in COMPARED},
        "vrsopt_iterations": solution.iterations,
        "pycycle_step_s": point["step_s"],
    }


def times(system: ResidualSystem, points: Sequence[dict[str, float]], copies: int = 100) -> dict[str, float]:
    """Process time [s] of one point, solved alone from the design point (median) and among many (mean)."""
    rows = np.array([system.vector(parameters(point)) for point in points] * copies)
    bulk = BulkSolver(system)
    unsolved = bulk.solve(rows[: len(points)]).failures  # builds the functions
    if unsolved:
        raise RuntimeError(f"bulk: {len(unsolved)} points not solved")
    return {
        "single_s": statistics.median(process_time(partial(solved, system, point)) for point in points),
        "bulk_s": process_time(lambda: bulk.solve(rows), repeats=3) / len(rows),
    }


def trends(own: ResidualSystem, points: Sequence[dict[str, Any]]) -> list[dict[str, float]]:
    """Fuel over fuel at 207 kW and 100 % power-turbine speed, sea level: the product with its own maps, and pyCycle."""
    level = [p for p in points if p["converged"] and not any(p["point"][name] for name in ("altitude", "mach"))]
    base = next(p for p in level if p["point"]["power"] == 207e3 and p["point"]["power_turbine_speed"] == 1.0)
    at_base = solved(own, base["point"]).outputs["fuel_flow"]
    return [
        {
            "power": p["point"]["power"],
            "power_turbine_speed": p["point"]["power_turbine_speed"],
            "vrsopt_own_maps": solved(own, p["point"]).outputs["fuel_flow"] / at_base,
            "pycycle": p["fuel_flow"] / base["fuel_flow"],
        }
        for p in level
    ]


def comparison(python: Path) -> dict[str, Any]:
    """Everything, as one record; ``missed`` names the targets that are missed."""
    shipped = load_engine()
    asked = request(like_pycycle(shipped))
    found = answered(python, asked)
    engine = matched(like_pycycle(shipped), found["design"]["fuel_flow"])
    turbine = TurbineTables(**found["maps"]["turbine"])
    maps = component_maps(CompressorTables(**found["maps"]["compressor"]), turbine, turbine)
    system, own = gas_path(engine, maps=maps), gas_path(shipped)
    rows = [compare(system, point) for point in found["points"]]
    points = [point for series in asked["series"] for point in series]
    both = {"same_maps": times(system, points), "own_maps": times(own, points)}
    steps = [p["step_s"] - p["repeat_s"] for p in found["points"] if p["converged"]]
    step = statistics.median(steps)
    ratios = {f"{name}_{way[:-2]}": step / both[name][way] for name in both for way in both[name]}
    return {
        "versions": made_with(),
        "pycycle_versions": found["versions"],
        "heating_value_times_efficiency_mj_kg": engine.combustor.heating_value * engine.combustor.efficiency / 1e6,
        "design_point": {"vrsopt": asdict(sized(engine)), "pycycle": found["design"]},
        "points": rows,
        "largest_difference_percent": largest(rows),
        "times": {
            **both,
            "pycycle_setup_s": found["setup_s"],
            "pycycle_design_s": found["design_s"],
            "pycycle_step_median_s": step,  # all steps: less what a run of a converged state takes
            "pycycle_steps_s": [min(steps), max(steps)],
        },
        "time_ratios": ratios,
        "fuel_over_fuel_at_207_kw": trends(own, found["points"]),
        "missed": missed(rows, ratios),
    }


def largest(rows: Sequence[dict[str, Any]]) -> dict[str, dict[str, float]]:
    """The largest differences above and below the power where the target changes."""
    sets = {
        "above_120_kw": [row for row in rows if row["solved"] and row["point"]["power"] > HIGH_POWER],
        "below_120_kw": [row for row in rows if row["solved"] and row["point"]["power"] <= HIGH_POWER],
    }
    return {
        name: {q: max((row["difference_percent"][q] for row in chosen), key=abs) for q in COMPARED}
        for name, chosen in sets.items()
        if chosen
    }


def main() -> int:
    """Run the comparison and print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--environment", type=Path, help="folder of the virtual environment, made if it is not there")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        result = comparison(environment(given.environment or Path(folder) / "pycycle"))
    print(json.dumps(result, indent=2))
    return 1 if result["missed"] else 0


if __name__ == "__main__":
    sys.exit(main())
