"""How long things take, as one JSON object: python tests/benchmarks/speed.py [trims] [engine] [trajectory] [whole]

Trims in ms of CPU time of one core, means over the level-flight box below the blade-loading limit; the rest in seconds
on whatever machine this runs. Ratios compare two ways of one process run and are the figures to quote. Nothing here
gates a test.
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from vrsopt.aircraft import Aircraft
from vrsopt.atmosphere import standard_air
from vrsopt.equilibrium import trim_system
from vrsopt.flight import trim_parameters
from vrsopt.helicopter import helicopter
from vrsopt.limits import Limits
from vrsopt.mission.file import read_mission
from vrsopt.mission.profile import Profile
from vrsopt.schedule.compare import solve
from vrsopt.schedule.study_input import loaded
from vrsopt.schedule.surrogate_path import SurrogateAircraft
from vrsopt.schedule.trajectory import TrajectoryProblem
from vrsopt.surrogate.design import model_data_hash
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.cycle import gas_path
from vrsopt.turboshaft.data import load_engine

SARM = Path(__file__).parents[2] / "problems" / "sarm.toml"


def cpu(action: Callable[[], object]) -> float:
    """CPU time of one call in ms."""
    begin = time.process_time()
    action()
    return 1e3 * (time.process_time() - begin)


def box(aircraft: Aircraft, limits: Limits, count: int) -> list[dict[str, float]]:
    """Level flights of a Latin hypercube of the study's box that are below the blade-loading limit."""
    low = (1400.0, 0.0, 0.0, 0.75, np.radians(6.0))
    high = (2500.0, 2000.0, 70.0, 1.15, np.radians(16.0))
    found = []
    for mass, altitude, speed, ratio, twist in qmc.scale(
        qmc.LatinHypercube(len(low), seed=17).random(count), low, high
    ).tolist():
        rotor_speed = ratio * aircraft.main_rotor.nominal_rotor_speed
        loading, largest = limits.blade_loading(mass, standard_air(altitude).density, rotor_speed, speed)
        if loading <= largest:
            flight = {"mass": mass, "altitude": altitude, "speed": speed, "rotor_speed": rotor_speed, "twist": twist}
            found.append({**flight, "isa_offset": 0.0, "climb_angle": 0.0, "load_factor": 1.0})
    return found


def trims(count: int = 60) -> dict[str, float]:
    """Mean CPU times [ms] over the level-flight box: one trim from nowhere, its derivatives, and its neighbours."""
    machine = helicopter("bo105")
    aircraft, system = machine.aircraft, trim_system(machine.aircraft)
    limits = Limits(aircraft, machine.engine)
    flights = box(aircraft, limits, count)
    warm = system.solve(trim_parameters(aircraft, flights[0]), method="newton")  # builds the functions
    system.sensitivities(warm)
    system.solve(warm.parameters, method="ipopt")
    times: dict[str, list[float]] = {name: [] for name in ("cold", "cascade", "slopes", "near_v", "near_w", "near_o")}
    ipopt, same, iterations, failed = [], 0, [], 0
    for k, flight in enumerate(flights):
        parameters = trim_parameters(aircraft, flight)
        solution = system.solve(parameters, method="newton")
        times["cascade"].append(cpu(lambda flight=flight: machine.trim(flight)))
        if not solution.success:
            failed += 1
            continue
        times["cold"].append(cpu(lambda p=parameters: system.solve(p, method="newton")))
        times["slopes"].append(cpu(lambda s=solution: system.sensitivities(s)))
        iterations.append(solution.iterations)
        for name, change in (("near_v", ("speed", 2.0)), ("near_w", ("mass", 25.0)), ("near_o", ("rotor_speed", 1.0))):
            near = {**parameters, change[0]: parameters[change[0]] + change[1]}
            times[name].append(cpu(lambda p=near, s=solution: system.solve(p, s, method="newton")))
            same += system.solve(near, solution, method="newton").factorisation is solution.factorisation
        if k % 6 == 0:
            ipopt.append(cpu(lambda p=parameters: system.solve(p, method="ipopt")) / times["cold"][-1])
    z, p = warm.scaled, system.vector(warm.parameters)
    mean = {name: statistics.mean(values) for name, values in times.items()}
    near = times["near_v"] + times["near_w"] + times["near_o"]
    return {
        "trim_points": len(flights),
        "trim_not_by_newton_alone": failed,
        "trim_cold_ms": mean["cold"],
        "trim_derivatives_ms": mean["slopes"],
        "trim_cold_with_derivatives_ms": mean["cold"] + mean["slopes"],
        "trim_cascade_ms": mean["cascade"],
        "trim_cascade_largest_ms": max(times["cascade"]),
        "trim_iterations": statistics.mean(iterations),
        "neighbour_ms": statistics.mean(near),
        "neighbour_median_ms": statistics.median(near),
        "neighbour_speed_plus_2_ms": mean["near_v"],
        "neighbour_mass_plus_25_ms": mean["near_w"],
        "neighbour_rotor_speed_plus_1_ms": mean["near_o"],
        "neighbour_kept_factorisation_percent": 100 * same / len(near),
        "ipopt_over_newton": statistics.mean(ipopt),
        "residual_ms": statistics.mean(cpu(lambda: system._residual(z, p)) for _ in range(20)),
        "jacobian_ms": statistics.mean(cpu(lambda: system._jacobian(z, p)) for _ in range(5)),
        "rough_singular_value_ms": statistics.mean(
            cpu(lambda: system.smallest_singular_value(warm, exact=False)) for _ in range(5)
        ),
    }


def engine(count: int = 2000) -> dict[str, float]:
    """Mean CPU times [us] of the gas path over its operating box: in bulk, alone by both solvers, its derivatives."""
    low, high = [20e3, 0.7, 0.0, -15.0, 0.0, 0.0, 0.0, 0.0], [330e3, 1.2, 2000.0, 30.0, 0.22, 0.05, 10e3, 0.03]
    points = qmc.scale(qmc.LatinHypercube(8, seed=17).random(count), low, high)
    system = gas_path(load_engine())
    names = [parameter.name for parameter in system.parameters]
    few = [dict(zip(names, row, strict=True)) for row in points[:50].tolist()]
    solve_many(points[:1])  # builds the functions
    solutions = [system.solve(p, method="newton") for p in few]
    system.sensitivities(solutions[0])
    system.solve(few[0])
    return {
        "engine_points": count,
        "engine_failed": count - int(solve_many(points).success.sum()),
        "engine_bulk_us": statistics.median(1e3 * cpu(lambda: solve_many(points)) / count for _ in range(5)),
        "engine_newton_us": 1e3 * statistics.mean(cpu(lambda p=p: system.solve(p, method="newton")) for p in few),
        "engine_ipopt_us": 1e3 * statistics.mean(cpu(lambda p=p: system.solve(p)) for p in few),
        "engine_derivatives_us": 1e3 * statistics.mean(cpu(lambda s=s: system.sensitivities(s)) for s in solutions),
        "engine_newton_steps": statistics.mean(s.iterations for s in solutions),
    }


def trajectory() -> dict[str, float]:
    mission = read_mission(SARM)
    machine = helicopter(mission.aircraft)
    limits = Limits(machine.aircraft, machine.engine, mission.limits.limits, mission.limits.manoeuvre_margin)
    make = SurrogateAircraft(loaded(None, model_data_hash()), limits)
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
    parts = {"trims": trims, "engine": engine, "trajectory": trajectory, "whole": whole}
    figures: dict[str, float] = {}
    for part in sys.argv[1:] or parts:
        figures |= parts[part]()
    print(json.dumps({name: float(np.round(value, 6)) for name, value in figures.items()}, indent=2))
