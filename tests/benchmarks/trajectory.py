"""The whole-mission problem, as one JSON object: python tests/benchmarks/trajectory.py [solve] [warm] [hand] [size]

solve: build and solve on 200 intervals with the limits as shipped, with limits of acceleration and no credit for
spin-down on top, with a constraint of one's own, and with an integral of one's own as well (everything). warm: solved
again after a changed rate limit, cold and from the last solution. hand: against a script that needs CasADi alone. size:
125 to 5000 intervals, each in a process of its own, with its memory. Process times in s; ratios of one run are the
figures to quote. Nothing here gates a test.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from dataclasses import replace
from typing import Any

import numpy as np
from trajectory_by_hand import solve_by_hand
from trajectory_problem import Task, air_taxi, even_mesh

from vrsopt.schedule.additions import Additions, Constraint, quantities
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.trajectory import Trajectory, TrajectoryProblem

INTERVALS = 200
TRANSCRIPTIONS = ("hermite_simpson", "radau")
SIZES = (125, 250, 500, 1000, 2500, 5000)
RATE_CHANGES = (0.5, 0.8, 1.25, 2.0)  # times the shipped 1 %/s and 1 deg/s
MEGABYTE = 1024.0  # kB, the unit of ru_maxrss


def timed(make: Any) -> tuple[Any, float]:
    """What ``make`` returns and the process time it takes [s]."""
    begin = time.process_time()
    made = make()
    return made, time.process_time() - begin


def report(
    task: Task, trajectory: Trajectory, settings: ScheduleSettings | None = None, **times: float
) -> dict[str, Any]:
    """Figures of one solution, with its fuel flown on the 1 s grid."""
    grid = FlightGrid(task.profile, task.setup.make, settings=settings)
    flown = grid.fly(trajectory.schedule, takeoff_mass=task.takeoff_mass)
    found = {"iterations": trajectory.iterations, "success": trajectory.success, "fuel_kg": flown.fuel}
    together = {"together_s": sum(times.values())} if times else {}
    return {**times, **together, **found, "nlp_fuel_kg": trajectory.fuel}


def solve(task: Task) -> dict[str, Any]:
    """200 intervals, limits as shipped and with more and more on top, both transcriptions."""
    mesh, shipped = even_mesh(task.profile, INTERVALS), task.setup.settings
    speed = shipped.nominal_rotor_speed
    strict = replace(
        shipped, rotor_speed_acceleration=0.005 * speed, twist_acceleration=np.radians(0.5), spin_down_credit=False
    )
    q = quantities()
    own = Additions(
        constraints=(Constraint("power", q["power_per_engine"], upper=250e3, unit="W"),),
        integrals=(Constraint("CO2", q["co2"], upper=400.0, unit="kg"),),
    )
    cases: dict[str, tuple[ScheduleSettings, Additions]] = {"as_shipped": (shipped, Additions())}
    cases["accelerations_no_credit"] = strict, Additions()
    cases["and_own_power"] = strict, Additions(constraints=own.constraints)
    cases["everything"] = strict, own
    figures: dict[str, Any] = {"intervals": len(mesh)}
    _ = task.setup.make.plant.emission_table  # made once in a process; not a part of the problem
    for transcription in TRANSCRIPTIONS:
        for name, (settings, additions) in cases.items():
            options: dict[str, Any] = {"settings": settings, "additions": additions, "transcription": transcription}
            problem, build = timed(lambda o=options: TrajectoryProblem(task.profile, task.setup.make, mesh=mesh, **o))
            trajectory, first = timed(lambda p=problem: p.solve(task.takeoff_mass))
            figures[f"{transcription}_{name}"] = report(task, trajectory, settings, build_s=build, solve_s=first)
    return figures


def warm(task: Task) -> dict[str, Any]:
    """Iterations after a changed rate limit: cold, from the last solution, and their ratio."""
    mesh, settings = even_mesh(task.profile, INTERVALS), task.setup.settings
    figures = {}
    for transcription in TRANSCRIPTIONS:
        own: dict[str, Any] = {"settings": settings, "mesh": mesh, "transcription": transcription}
        problem = TrajectoryProblem(task.profile, task.setup.make, **own)
        last = problem.solve(task.takeoff_mass)
        for change in RATE_CHANGES:
            assert settings.rotor_speed_rate is not None and settings.twist_rate is not None
            rates = {name: change * getattr(settings, name) for name in ("rotor_speed_rate", "twist_rate")}
            changed = replace(settings, **rates)
            cold, cold_s = timed(lambda p=problem, s=changed: p.solve(task.takeoff_mass, settings=s))
            again, warm_s = timed(lambda p=problem, s=changed, i=last: p.solve(task.takeoff_mass, i, settings=s))
            figures[f"{transcription}_rates_times_{change:g}"] = {
                "cold_iterations": cold.iterations,
                "warm_iterations": again.iterations,
                "iterations_percent": 100.0 * again.iterations / cold.iterations,
                "time_percent": 100.0 * warm_s / cold_s,
                "fuel_difference_kg": again.fuel - cold.fuel,
            }
    return figures


def hand(task: Task) -> dict[str, Any]:
    """The script against the product on the same mesh, node function and start."""
    mesh = even_mesh(task.profile, INTERVALS)
    own: dict[str, Any] = {"settings": task.setup.settings, "mesh": mesh}
    problem, build = timed(lambda: TrajectoryProblem(task.profile, task.setup.make, **own))
    trajectory, first = timed(lambda: problem.solve(task.takeoff_mass))
    script = solve_by_hand(task, mesh)
    flown = task.setup.grid.fly(script.schedule, takeoff_mass=task.takeoff_mass)
    product = report(task, trajectory, build_s=build, solve_s=first)
    together = script.build_s + script.solve_s
    return {
        "product": product,
        "by_hand": {
            "build_s": script.build_s,
            "solve_s": script.solve_s,
            "together_s": together,
            "iterations": script.iterations,
            "success": script.success,
            "fuel_kg": flown.fuel,
            "nlp_fuel_kg": script.fuel,
        },
        "by_hand_over_product": together / product["together_s"],
    }


def one_size(task: Task, count: int, transcription: str) -> dict[str, float]:
    """Build and solve on ``count`` intervals; memory is what the process grew by since the mission was ready."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    mesh = even_mesh(task.profile, count)
    own: dict[str, Any] = {"settings": task.setup.settings, "mesh": mesh, "transcription": transcription}
    problem, build = timed(lambda: TrajectoryProblem(task.profile, task.setup.make, **own))
    trajectory, first = timed(lambda: problem.solve(task.takeoff_mass))
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / MEGABYTE
    return {
        "build_s": build,
        "solve_s": first,
        "iterations": trajectory.iterations,
        "ms_per_iteration_and_interval": 1e3 * first / trajectory.iterations / count,
        "memory_mb": grown,
        **report(task, trajectory),
    }


def size(_: Task) -> dict[str, Any]:
    """One process for each size and transcription, so that memory is that of one problem."""
    figures = {}
    for transcription in TRANSCRIPTIONS:
        for count in SIZES:
            command = [sys.executable, __file__, "one", str(count), transcription]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            figures[f"{transcription}_{count}"] = json.loads(done.stdout[done.stdout.index("{") :])
    return figures


if __name__ == "__main__":
    if sys.argv[1:2] == ["one"]:
        print(json.dumps(one_size(air_taxi(), int(sys.argv[2]), sys.argv[3])))
    else:
        parts = {"solve": solve, "warm": warm, "hand": hand, "size": size}
        mission = air_taxi()
        print(json.dumps({part: parts[part](mission) for part in sys.argv[1:] or parts}, indent=2))
