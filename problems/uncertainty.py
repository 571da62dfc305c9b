"""How sure is the saving of a mission? A tornado and a band over every assumed number; writes problems/uncertainty.md.

    python problems/uncertainty.py [--workers 2] [--rows build/uncertainty.jsonl]

Every number with a range is set to both its ends, and all of them are drawn together from a Latin hypercube. Each time
the rotor is calibrated again, and rotor speed and twist are optimised on the physics in the flights that stand for the
missions, with the margin drawn and with the shipped one. Rows are kept as they come: the same command continues an
interrupted run. It takes about 25 minutes on two cores.
"""

from __future__ import annotations

import argparse
import json
import platform
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc
from uncertainty_flown import Job, disagreement, outcome, run
from uncertainty_numbers import Number, numbers, variants
from uncertainty_page import shifted, write_page
from uncertainty_points import MISSIONS, Representation, Sampled, represented, sampled, spread

import vrsopt
from vrsopt.helicopter import MODEL_VERSION, helicopter
from vrsopt.mission.file import read_mission
from vrsopt.report import saving_band

HERE = Path(__file__).parent
RESULT = HERE / "uncertainty.json"
BANDS = HERE.parent / "vrsopt" / "data" / saving_band.BANDS
FLIGHTS = 9  # that stand for the missions
SAMPLES, SEED = 200, 20
CHECKED, DENSE = 2, 16  # samples flown in so many flights of every mission
MARGIN = "blade_loading_limit.manoeuvre_margin"
REFERENCE = Job("reference")
PERCENTILES = (5, 50, 95)
QUANTITIES = ("saving", "rotor_speed")


def tornado_jobs(varied: Sequence[Number]) -> list[Job]:
    """Each number at both ends of its range, all others as shipped."""
    return [
        Job(f"{number.path} = {end:.6g}", {number.path: end})
        for number in varied
        for end in number.ends
        if end != number.value
    ]


def draws(varied: Sequence[Number], count: int, seed: int) -> list[dict[str, float]]:
    """Values of all numbers, independent and uniform over their ranges, by Latin hypercube."""
    cube = qmc.LatinHypercube(len(varied), rng=np.random.default_rng(seed)).random(count)
    return [{number.path: float(number.at(u)) for number, u in zip(varied, row, strict=True)} for row in cube]


def band(values: np.ndarray) -> list[float]:
    """5th, 50th and 95th percentile."""
    return [float(value) for value in np.percentile(values, PERCENTILES)]


def scheduled(file: Path) -> dict[str, dict[str, float]]:
    """Saving [%] of the pointwise schedule and of the trajectory on the physics by mission, kept in ``file``."""
    hashes = [saving_band.mission_hash(read_mission(HERE / f"{name}.toml")) for name in MISSIONS]
    mark = [vrsopt.__version__, MODEL_VERSION, helicopter().data_hash, *hashes]
    found = dict(json.loads(file.read_text(encoding="utf-8"))) if file.exists() else {}
    if found.pop("of", None) != mark:
        found = {}
        for name in MISSIONS:
            result = vrsopt.solve(HERE / f"{name}.toml", schedules=("nominal", "pointwise", "trajectory"))
            savings = {one: -result.results[one].fuel_physics_delta_percent for one in ("pointwise", "trajectory")}
            found[name] = {**savings, "nominal_kg": result.results["nominal"].physics.fuel}
        file.write_text(json.dumps(found | {"of": mark}), encoding="utf-8")
    return found


def figures_of(row: dict[str, Any], representation: Representation, flights: str = "flights") -> dict[str, Any]:
    """Outcome by mission."""
    return {name: vars(outcome(row, representation, name, flights)) for name in representation.weights}


def spread_of(rows: Sequence[dict[str, Any]], representation: Representation) -> dict[str, Any]:
    """Outcomes and bands of the samples, drawn (``samples``) and with the margin held, by quantity and mission."""
    solved = [row for row in rows if not row["message"]]
    parts: dict[str, Any] = {}
    for kind, flights in (("samples", "flights"), ("margin_held", "flights_held")):
        found = {
            name: [outcome(row, representation, name, flights) for row in solved] for name in representation.weights
        }
        values = {q: {name: [getattr(one, q) for one in row] for name, row in found.items()} for q in QUANTITIES}
        bands = {q: {name: band(np.array(row)) for name, row in by.items()} for q, by in values.items()}
        parts[kind] = {"values": values, "bands": bands}
    parts["constants"] = [row["constants"] for row in solved]
    parts["unsolved"] = [{"key": row["key"], "message": row["message"]} for row in rows if row["message"]]
    return parts


def checked(missions: Sequence[Sampled], few: Representation, jobs: Sequence[Job], rows: Path, workers: int) -> Any:
    """Change of the saving [points] against the reference, in many flights of each mission and in the few."""
    found: dict[str, list[list[float]]] = {}
    own = run([REFERENCE, *jobs], few, rows, workers)
    for mission in missions:
        many = spread(mission, DENSE)
        dense = run([REFERENCE, *jobs], many, rows.with_suffix(f".{mission.name}.jsonl"), workers)
        both = [(outcome(dense[key], many, mission.name), outcome(own[key], few, mission.name)) for key in own]
        (start, first), *rest = [(one.saving, other.saving) for one, other in both]
        found[mission.name] = [[one - start, other - first] for one, other in rest]
    return found


def result(representation: Representation, rows: dict[str, Any], samples: Sequence[Job]) -> dict[str, Any]:
    """All figures of the study, for JSON."""
    varied = numbers()
    reference = figures_of(rows[REFERENCE.key], representation)
    table = []
    for number in varied:
        ends = {}
        for side, end in zip(("low", "high"), number.ends, strict=True):
            row = rows.get(f"{number.path} = {end:.6g}", rows[REFERENCE.key])
            ends[side] = {"message": row["message"]} | ({} if row["message"] else figures_of(row, representation))
        table.append({**vars(number), "at": ends})
    others = {name: rows[f"variant {name}"] for name in variants()}
    machine = helicopter()
    return {
        "versions": {
            "vrsopt": vrsopt.__version__,
            "model": MODEL_VERSION,
            "data": machine.data_hash,
            "python": platform.python_version(),
            **{name: version(name) for name in ("casadi", "numpy", "scipy")},
        },
        "seed": SEED,
        "percentiles": list(PERCENTILES),
        "representation": representation.as_dict(),
        "reference": reference,
        "numbers": table,
        "variants": {
            name: {"message": row["message"]} | ({} if row["message"] else figures_of(row, representation))
            for name, row in others.items()
        },
        **spread_of([rows[job.key] for job in samples], representation),
    }


def shipped_bands(content: dict[str, Any]) -> dict[str, Any]:
    """What reports say of these missions: bands of the trajectory's saving, and what they hold for."""
    missions = {
        saving_band.mission_hash(read_mission(HERE / f"{name}.toml")): {
            "name": name.upper(),
            "shipped_percent": content["schedules"][name]["trajectory"],
            "saving_percent": shifted(content, "samples", name),
        }
        for name in content["reference"]
    }
    return {
        "command": "python problems/uncertainty.py",
        "model_version": content["versions"]["model"],
        "data_hash": content["versions"]["data"],
        "samples": len(next(iter(content["samples"]["values"]["saving"].values()))),
        "percentiles": content["percentiles"],
        "missions": missions,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--rows", type=Path, default=Path("build/uncertainty.jsonl"))
    helps = "only write the page, and the bands that reports quote, from problems/uncertainty.json"
    parser.add_argument("--page", action="store_true", help=helps)
    options = parser.parse_args()
    if not options.page:
        options.rows.parent.mkdir(parents=True, exist_ok=True)
        missions = [sampled(read_mission(HERE / f"{name}.toml"), name) for name in MISSIONS]
        few, varied = represented(missions, FLIGHTS), numbers()
        margin = {number.path: number.value for number in varied}[MARGIN]
        samples = [Job(f"sample {k}", values, held=margin) for k, values in enumerate(draws(varied, SAMPLES, SEED))]
        others = [Job(f"variant {name}", variant=name) for name in variants()]
        rows = run([REFERENCE, *others, *tornado_jobs(varied), *samples], few, options.rows, options.workers)
        content = result(few, rows, samples)
        content["schedules"] = scheduled(options.rows.with_suffix(".schedules.json"))
        content["check"] = checked(missions, few, samples[:CHECKED], options.rows, options.workers)
        content["disagreement"] = max(disagreement(job, few) for job in (REFERENCE, *samples[:CHECKED]))
        RESULT.write_text(json.dumps(content) + "\n", encoding="utf-8")
    content = json.loads(RESULT.read_text(encoding="utf-8"))
    BANDS.write_text(json.dumps(shipped_bands(content), indent=1) + "\n", encoding="utf-8")
    write_page(content, HERE)


if __name__ == "__main__":
    main()
