"""How long things take, as one JSON object: python tests/benchmarks/speed.py

Times are medians in seconds on whatever machine this runs; ratios compare two ways of one process run and are the
figures to quote. Nothing here gates a test.
"""

from __future__ import annotations

import json
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from vrsopt.equilibrium import calibrated_constants, trim_system
from vrsopt.mission.file import read_mission
from vrsopt.mission.profile import Profile
from vrsopt.helicopter import helicopter
from vrsopt.schedule.compare import SurrogateAircraft, _shipped, solve
from vrsopt.schedule.trajectory import TrajectoryProblem
from vrsopt.surrogate.design import model_data_hash

SARM = Path(__file__).parents[2] / "problems" / "sarm.toml"


def median(action: Callable[[], object], repeats: int = 7) -> float:
    action()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        action()
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


def trims() -> dict[str, float]:
    machine = helicopter("bo105")
    system = trim_system(machine.aircraft)
    flight = {
        "mass": 2000.0,
        "altitude": 200.0,
        "isa_offset": 0.0,
        "speed": 40.0,
        "climb_angle": 0.0,
        "load_factor": 1.0,
        "rotor_speed": 42.0,
        "twist": 0.17,
        **calibrated_constants(machine.aircraft),
    }
    near = {**flight, "mass": 2020.0, "speed": 41.0}
    start = system.solve(flight, method="newton")
    cold = median(lambda: system.solve(flight, method="newton"))
    ipopt = median(lambda: system.solve(flight, method="ipopt"))
    chord = median(lambda: system.solve(near, start, method="newton"))
    slopes = median(lambda: system.sensitivities(start))
    return {
        "trim_cold_newton_s": cold,
        "trim_cold_ipopt_s": ipopt,
        "trim_neighbour_s": chord,
        "trim_sensitivities_s": slopes,
        "ipopt_over_newton": ipopt / cold,
        "cold_over_neighbour": cold / chord,
    }


def trajectory() -> dict[str, float]:
    mission = read_mission(SARM)
    machine = helicopter(mission.aircraft)
    from vrsopt.limits import Limits

    limits = Limits(machine.aircraft, machine.engine, mission.limits.limits, mission.limits.manoeuvre_margin)
    make = SurrogateAircraft(_shipped(model_data_hash()), limits)
    problem = TrajectoryProblem(Profile.of(mission), make)
    solutions = [problem.solve(1855.0) for _ in range(3)]
    return {
        "trajectory_build_s": solutions[0].build_s,
        "trajectory_solve_s": statistics.median(s.solve_s for s in solutions),
        "trajectory_iterations": solutions[0].iterations,
        "trajectory_intervals": len(problem.mesh),
    }


def whole() -> dict[str, float]:
    begin = time.perf_counter()
    result = solve(SARM)
    nodes = len(result.results["nominal"].physics.time)
    return {"sarm_wall_s": time.perf_counter() - begin, "physics_nodes_per_schedule": nodes}


if __name__ == "__main__":
    figures = {**trims(), **trajectory(), **whole()}
    print(json.dumps({name: float(np.round(value, 6)) for name, value in figures.items()}, indent=2))
