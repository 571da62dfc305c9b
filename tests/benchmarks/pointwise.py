"""How long the pointwise optimum takes, and how well the searches agree, as one JSON object:

    python tests/benchmarks/pointwise.py [pointwise] [genetic] [envelope] [--nodes 300] [--searched 40] [--points 56000]

``pointwise``: ``--nodes`` operating points by projected Newton against the nested grids: CPU time [s], and the
difference of the fuel flow [%]. ``genetic``: NSGA-II at ``--searched`` of them: largest and least difference [%],
generations, CPU time of each [s]. ``envelope``: optima at ``--points`` operating points of each of the three
strategies: CPU time [s], without and with bands and emissions, and the largest memory of the process [MB]. One process,
one BLAS thread; the surrogate's tables are part of the times. Nothing here gates a test.
"""

from __future__ import annotations

import argparse
import json
import resource
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

import vrsopt
from vrsopt.helicopter import helicopter
from vrsopt.limits import Limits
from vrsopt.mission.conditions import Conditions
from vrsopt.schedule.batched import batched_minimum, nested_grids, point_optima
from vrsopt.schedule.genetic import GeneticOptions, genetic_minimum
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.surrogate_path import SurrogateAircraft

SETTINGS = ScheduleSettings()
MASSES = (1600.0, 2000.0, 2400.0)


def timed(action: Callable[[], Any]) -> tuple[Any, float]:
    begin = time.process_time()
    return action(), time.process_time() - begin


def aircraft() -> SurrogateAircraft:
    machine = helicopter()
    limits = Limits(machine.aircraft, machine.engine, "manual", 1.3)
    return SurrogateAircraft(vrsopt.load_surrogate("level"), limits)


def some_points(make: SurrogateAircraft, count: int) -> tuple[Any, np.ndarray]:
    """Random operating points, and their masses [kg]."""
    random = np.random.default_rng(0)
    model = make(Conditions.level(random.uniform(0.0, 70.0, count), random.uniform(0.0, 2000.0, count)))
    return model, random.choice(MASSES, count)


def pointwise(make: SurrogateAircraft, options: argparse.Namespace) -> dict[str, Any]:
    (model, mass), tables = timed(lambda: some_points(make, options.nodes))
    box = SETTINGS.box(model.bounds)
    newton, seconds = timed(lambda: batched_minimum(model, mass, box=box))
    grids, slow = timed(lambda: point_optima(model, mass, nested_grids(model, mass, box=box)))
    allowed = (newton.excess <= 1e-8) & (grids.excess <= 1e-8)
    off = 100.0 * (newton.fuel_flow / grids.fuel_flow - 1.0)[allowed]
    return {
        "nodes": options.nodes,
        "tables_s": tables,
        "newton_s": seconds,
        "nested_grids_s": slow,
        "allowed": int(allowed.sum()),
        "same_allowed": bool(np.array_equal(newton.excess <= 1e-8, grids.excess <= 1e-8)),
        "most_above_grids_percent": off.max(),
        "most_below_grids_percent": off.min(),
    }


def genetic(make: SurrogateAircraft, options: argparse.Namespace) -> dict[str, Any]:
    model, mass = some_points(make, options.nodes)
    some = np.arange(min(options.searched, options.nodes))
    model, mass, box = model.nodes(some), mass[some], SETTINGS.box(model.bounds)
    newton = batched_minimum(model, mass, box=box)
    (found, generations), seconds = timed(lambda: genetic_minimum(model, mass, box=box))
    allowed = newton.excess <= 1e-8
    off = 100.0 * (found.fuel_flow / newton.fuel_flow - 1.0)[allowed]
    return {
        "nodes": len(some),
        "most_above_newton_percent": off.max(),
        "most_below_newton_percent": off.min(),
        "mean_generations": generations.mean(),
        "nodes_at_the_cap": int(np.sum(generations >= GeneticOptions().most_generations)),
        "each_s": seconds / len(some),
    }


def envelope(make: SurrogateAircraft, options: argparse.Namespace) -> dict[str, Any]:
    side = int(np.ceil(np.sqrt(options.points / len(MASSES))))
    found: dict[str, Any] = {"points": 3 * len(MASSES) * side**2}
    for name, action in (("optima_s", optima), ("maps_s", maps)):
        found[name] = {
            variables: timed(partial(action, make, side, variables))[1] for variables in ("both", "speed", "twist")
        }
        found[name]["all"] = sum(found[name].values())
    return found | {"memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0}


def optima(make: SurrogateAircraft, side: int, variables: Any) -> None:
    """The optima alone, a row of the maps at a time."""
    speed, settings = np.repeat(np.linspace(0.0, 70.0, side), len(MASSES)), SETTINGS.restricted(variables)
    mass = np.tile(MASSES, side)
    for altitude in np.linspace(0.0, 2000.0, side):
        model = make(Conditions.level(speed, float(altitude)))
        batched_minimum(model, mass, box=settings.box(model.bounds))


def maps(make: SurrogateAircraft, side: int, variables: Any) -> None:
    vrsopt.envelope(variables=variables, points=len(MASSES) * side**2)


def main() -> None:
    studies = {study.__name__: study for study in (pointwise, genetic, envelope)}
    parser = argparse.ArgumentParser(description="Pointwise optimum: time and agreement.")
    parser.add_argument("studies", nargs="*", choices=[[], *studies], help="default: all")
    parser.add_argument("--nodes", type=int, default=300)
    parser.add_argument("--searched", type=int, default=40)
    parser.add_argument("--points", type=int, default=56_000)
    options = parser.parse_args()
    with threadpool_limits(limits=1):
        make, setup = timed(aircraft)
        made = make.plant.emission_table  # once in a process: no part of the maps
        result: dict[str, Any] = {"aircraft_s": setup, "emissions": list(made.names)}
        for name in options.studies or studies:
            result[name] = studies[name](make, options)
    print(json.dumps(result, indent=1, default=float))


if __name__ == "__main__":
    main()
