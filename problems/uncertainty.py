"""How sure is the saving of a mission? A tornado and a band over every assumed number; writes problems/uncertainty.md.

    python problems/uncertainty.py [--workers 2] [--rows build/uncertainty.jsonl]

Every number with a range is set to both its ends, and all of them are drawn together from a Latin hypercube. Each time
the rotor is calibrated again, and rotor speed and twist are optimised on the physics in the flights that stand for the
missions. Rows are kept as they come: the same command continues an interrupted run. It takes about half an hour on one
core.
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
from uncertainty_page import write_page
from uncertainty_points import MISSIONS, Representation, Sampled, represented, sampled, spread
from uncertainty_response import fitted_response, held, response

import vrsopt
from vrsopt.helicopter import MODEL_VERSION, helicopter
from vrsopt.mission.file import read_mission

HERE = Path(__file__).parent
RESULT = HERE / "uncertainty.json"
FLIGHTS = 9  # that stand for the missions
SAMPLES, SEED = 200, 20
AGAIN = 12  # samples flown again with the manoeuvre margin held
CHECKED, DENSE = 2, 24  # samples flown in so many flights of every mission
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
    if not file.exists():
        found = {}
        for name in MISSIONS:
            result = vrsopt.solve(HERE / f"{name}.toml", schedules=("nominal", "pointwise", "trajectory"))
            savings = {one: -result.results[one].fuel_physics_delta_percent for one in ("pointwise", "trajectory")}
            found[name] = {**savings, "nominal_kg": result.results["nominal"].physics.fuel}
        file.write_text(json.dumps(found))
    return dict(json.loads(file.read_text()))


def figures_of(row: dict[str, Any], representation: Representation) -> dict[str, dict[str, Any]]:
    """Outcome by mission."""
    return {name: vars(outcome(row, representation, name)) for name in representation.weights}


def summary_of_samples(rows: Sequence[dict[str, Any]], representation: Representation) -> dict[str, Any]:
    """Outcomes and bands of samples; those without a solution are listed, and in no band."""
    solved = [row for row in rows if not row["message"]]
    found = [figures_of(row, representation) for row in solved]
    values = {
        quantity: {name: [one[name][quantity] for one in found] for name in representation.weights}
        for quantity in QUANTITIES
    }
    return {
        "keys": [row["key"] for row in solved],
        "values": values,
        "bands": {q: {name: band(np.array(row)) for name, row in by.items()} for q, by in values.items()},
        "constants": [row["constants"] for row in solved],
        "unsolved": [{"key": row["key"], "message": row["message"]} for row in rows if row["message"]],
    }


def margin_held(content: Any, values: Sequence[dict[str, float]], flown: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """What the samples in ``content`` (at ``values``) would have found with the manoeuvre margin as shipped, by the
    response; its errors in samples left out of its fit, and in those that were ``flown`` again with the margin held."""
    paths, keys = [one["path"] for one in content["numbers"]], content["samples"]["keys"]
    points = np.array([[row[path] for path in paths] for row in values])
    again = {row["key"]: figures_of(row, Representation.from_dict(content["representation"])) for row in flown}
    found: dict[str, Any] = {"values": {}, "left_out": {}, "flown_again": {}}
    for quantity in QUANTITIES:
        for part in found.values():
            part[quantity] = {}
        for name, own in content["samples"]["values"][quantity].items():
            fitted, errors = fitted_response(response(content, quantity, name), points, np.array(own))
            kept = held(fitted, points, np.array(own), paths.index(MARGIN))
            found["values"][quantity][name] = kept.tolist()
            found["left_out"][quantity][name] = float(np.sqrt(np.mean(errors**2)))
            found["flown_again"][quantity][name] = [
                [float(kept[keys.index(key.replace("held", "sample"))]), row[name][quantity]]
                for key, row in again.items()
            ]
    found["bands"] = {q: {name: band(np.array(row)) for name, row in by.items()} for q, by in found["values"].items()}
    return found


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


def result(
    representation: Representation, rows: dict[str, Any], sampled_jobs: Sequence[Job], held_jobs: Sequence[Job]
) -> dict[str, Any]:
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
    content: dict[str, Any] = {
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
        "samples": summary_of_samples([rows[job.key] for job in sampled_jobs], representation),
    }
    solved = [job for job in sampled_jobs if not rows[job.key]["message"]]
    flown = [rows[job.key] for job in held_jobs if not rows[job.key]["message"]]
    content["margin_held"] = margin_held(content, [dict(job.values) for job in solved], flown)
    return content


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--rows", type=Path, default=Path("build/uncertainty.jsonl"))
    parser.add_argument("--page", action="store_true", help="write the page from problems/uncertainty.json")
    options = parser.parse_args()
    if not options.page:
        options.rows.parent.mkdir(parents=True, exist_ok=True)
        missions = [sampled(read_mission(HERE / f"{name}.toml"), name) for name in MISSIONS]
        few, varied = represented(missions, FLIGHTS), numbers()
        points = draws(varied, SAMPLES, SEED)
        samples = [Job(f"sample {k}", values) for k, values in enumerate(points)]
        shipped = {number.path: number.value for number in varied}
        kept = [Job(f"held {k}", {**points[k], MARGIN: shipped[MARGIN]}) for k in range(AGAIN)]
        others = [Job(f"variant {name}", variant=name) for name in variants()]
        rows = run([REFERENCE, *others, *tornado_jobs(varied), *samples, *kept], few, options.rows, options.workers)
        content = result(few, rows, samples, kept)
        content["schedules"] = scheduled(options.rows.with_suffix(".schedules.json"))
        content["check"] = checked(missions, few, samples[:CHECKED], options.rows, options.workers)
        content["disagreement"] = max(disagreement(job, few) for job in (REFERENCE, *samples[:CHECKED]))
        RESULT.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    write_page(json.loads(RESULT.read_text(encoding="utf-8")), HERE)


if __name__ == "__main__":
    main()
