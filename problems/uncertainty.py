"""How sure is the saving of a mission? A tornado and a band over every assumed number; writes problems/uncertainty.md.

    python problems/uncertainty.py [--workers 2] [--rows build/uncertainty.jsonl]

Every number with a range is set to both its ends, and all of them are drawn together from a Latin hypercube. Each time
the rotor is calibrated again, and rotor speed and twist are optimised on the physics in the flights that stand for the
missions. Part of the samples are flown, the others follow from a response that is checked on them. Rows are kept as
they come: the same command continues an interrupted run. It takes about a quarter of an hour on one core.
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
from uncertainty_response import fitted_response, response

import vrsopt
from vrsopt.helicopter import MODEL_VERSION, helicopter
from vrsopt.mission.file import read_mission
from vrsopt.point_optimum import NOMINAL_BOUNDS

HERE = Path(__file__).parent
RESULT = HERE / "uncertainty.json"
FLIGHTS = 9  # that stand for the missions
SAMPLES, SEED = 200, 20
FLOWN = 40  # of the samples; the others are taken from a response
AGAIN = 22  # of those flown: once more with the manoeuvre margin held
CHECKED, DENSE = 2, 16  # samples flown in so many flights of every mission
MARGIN = "blade_loading_limit.manoeuvre_margin"
REFERENCE = Job("reference")
PERCENTILES = (5, 50, 95)
QUANTITIES = ("saving", "rotor_speed")
SLOWEST = 100.0 * NOMINAL_BOUNDS[0][0]  # % of nominal


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


def figures_of(row: dict[str, Any], representation: Representation, flights: str = "flights") -> dict[str, Any]:
    """Outcome by mission."""
    return {name: vars(outcome(row, representation, name, flights)) for name in representation.weights}


def completed(
    content: dict[str, Any], points: np.ndarray, rows: Sequence[dict[str, Any]], place: int
) -> dict[str, Any]:
    """Outcomes and bands at ``points`` (N, n) of the numbers, the first of which were flown as ``rows``: those flown,
    and the response elsewhere; drawn, and with the number at ``place`` held as shipped.

    Errors of the response: ``left_out``, of flown samples left out of its fit (root mean square); ``flown_again``,
    with the number held, what it says and what was flown.
    """
    few = Representation.from_dict(content["representation"])
    flown = np.array([not row["message"] for row in rows])
    held = np.array([bool(row.get("flights_held")) for row in rows]) & flown
    kept = points.copy()
    kept[:, place] = [one["value"] for one in content["numbers"]][place]
    parts: dict[str, Any] = {name: {} for name in ("samples", "margin_held", "left_out", "flown_again")}
    for quantity in QUANTITIES:
        for part in parts.values():
            part[quantity] = {}
        for name in few.weights:
            known = np.array([getattr(outcome(row, few, name), quantity) for row in rows if not row["message"]])
            again = [
                getattr(outcome(row, few, name, "flights_held"), quantity)
                for row, use in zip(rows, held, strict=True)
                if use
            ]
            places = np.flatnonzero(flown)
            fitted, errors = fitted_response(response(content, quantity, name), points[places], known)
            bottom = SLOWEST if quantity == "rotor_speed" else -np.inf  # a bound that the response does not know
            drawn, with_held = (np.maximum(fitted(at), bottom) for at in (points, kept))
            with_held[places] += known - drawn[places]
            drawn[places] = known
            parts["flown_again"][quantity][name] = np.transpose([with_held[np.flatnonzero(held)], again]).tolist()
            with_held[np.flatnonzero(held)] = again
            parts["samples"][quantity][name] = drawn.tolist()
            parts["margin_held"][quantity][name] = with_held.tolist()
            parts["left_out"][quantity][name] = float(np.sqrt(np.mean(errors**2)))
    for kind in ("samples", "margin_held"):
        bands = {q: {name: band(np.array(row)) for name, row in by.items()} for q, by in parts[kind].items()}
        parts[kind] = {"values": parts[kind], "bands": bands}
    parts["constants"] = [row["constants"] for row in rows if not row["message"]]
    parts["unsolved"] = [{"key": row["key"], "message": row["message"]} for row in rows if row["message"]]
    return parts | {"flown": int(flown.sum())}


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
    representation: Representation, rows: dict[str, Any], drawn: Sequence[dict[str, float]], jobs: Sequence[Job]
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
    content = {
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
    }
    points = np.array([[values[number.path] for number in varied] for values in drawn])
    place = [number.path for number in varied].index(MARGIN)
    return content | completed(content, points, [rows[job.key] for job in jobs], place)


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
        margin = {number.path: number.value for number in varied}[MARGIN]
        points = draws(varied, SAMPLES, SEED)
        samples = [Job(f"sample {k}", points[k], held=margin if k < AGAIN else None) for k in range(FLOWN)]
        others = [Job(f"variant {name}", variant=name) for name in variants()]
        rows = run([REFERENCE, *others, *tornado_jobs(varied), *samples], few, options.rows, options.workers)
        content = result(few, rows, points, samples)
        content["schedules"] = scheduled(options.rows.with_suffix(".schedules.json"))
        content["check"] = checked(missions, few, samples[:CHECKED], options.rows, options.workers)
        content["disagreement"] = max(disagreement(job, few) for job in (REFERENCE, *samples[:CHECKED]))
        RESULT.write_text(json.dumps(content) + "\n", encoding="utf-8")
    write_page(json.loads(RESULT.read_text(encoding="utf-8")), HERE)


if __name__ == "__main__":
    main()
