"""The trajectory against dymos on one problem and one surrogate, as one JSON object.

    python tests/benchmarks/dymos_comparison.py [--environment PATH] [--segments 25] [--optimisers SLSQP IPOPT]

Makes a virtual environment (PATH, or a temporary one) with dymos and CasADi, runs there dymos_trajectory.py on a flight
of the small test mission to a place further away (no mass change, no idle), and the product's Radau and Hermite-Simpson
on the same mesh. Same node function, bounds, rates and pinned ends on both sides; dymos' controls are cubic within an
interval, the product's linear. All schedules are flown on the same 1 s grid. Process times of this one run in s.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
import tomllib
import venv
from pathlib import Path
from typing import Any

import casadi
import numpy as np
from numpy.polynomial import Polynomial
from trajectory_problem import Task, even_mesh

from vrsopt.mission.file import mission_from
from vrsopt.schedule.mesh import Mesh
from vrsopt.schedule.mission_setup import MissionSetup
from vrsopt.schedule.schedule import Schedule
from vrsopt.schedule.trajectory import TrajectoryProblem

PACKAGES = ("dymos==1.15.1", "openmdao==3.45.1", f"casadi=={casadi.__version__}")
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
HERE = Path(__file__).parent
HOP, SITE = HERE.parent / "hop.toml", 47.3  # deg, latitude of where it goes
ROOT = np.sqrt(6.0)
SHARES = np.array([0.0, (4.0 - ROOT) / 10.0, (4.0 + ROOT) / 10.0, 1.0])  # of dymos' nodes in an interval, order 3


def flight() -> Task:
    """The test mission with its site further away."""
    data = tomllib.loads(HOP.read_text(encoding="utf-8"))
    data["places"]["site"]["latitude_deg"] = SITE
    setup = MissionSetup(mission_from(data, where="hop"))
    return Task(setup, setup.loading.takeoff_mass)


def node_times(mesh: Mesh) -> np.ndarray:
    """Times (N, 4) [s] of dymos' nodes."""
    return np.asarray(mesh.start[:, None] + mesh.step[:, None] * SHARES)


def export(task: Task, mesh: Mesh, folder: Path) -> None:
    """What dymos needs to know."""
    times = node_times(mesh)
    model = task.setup.make(task.profile.conditions(np.repeat(mesh.segment, len(SHARES)), times.ravel()))
    function, coefficients = model.function()
    function.save(str(folder / "node.casadi"))
    settings = task.setup.settings
    np.savez(
        folder / "problem.npz",
        coefficients=coefficients,
        edges=np.append(mesh.start, mesh.end[-1]),
        box=settings.box(model.bounds),
        rates=[settings.rotor_speed_rate, settings.twist_rate],
        nominal=[settings.nominal_rotor_speed, settings.nominal_twist],
        mass=task.takeoff_mass,
        fuel_guess=task.setup.loading.fuel_burned,
    )


def by_dymos(task: Task, mesh: Mesh, python: Path, folder: Path, optimiser: str) -> dict[str, Any]:
    """Solution of dymos, flown."""
    command = [str(python), str(HERE / "dymos_trajectory.py"), str(folder), optimiser]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | ONE_THREAD, cwd=folder)
    if done.returncode:
        return {"success": False, "message": done.stderr.strip().splitlines()[-1]}
    found = json.loads(done.stdout[done.stdout.index('{"optimiser') :])
    values = {name: np.array(found.pop(name)).reshape(len(mesh), -1) for name in ("time", "mass", "omega", "twist")}
    flown = task.setup.grid.fly(sampled(task, mesh, values["omega"], values["twist"]), takeoff_mass=task.takeoff_mass)
    return {**found, "together_s": found["build_s"] + found["solve_s"], "fuel_kg": flown.fuel, "flown": flown.message}


def sampled(task: Task, mesh: Mesh, rotor_speed: np.ndarray, twist: np.ndarray) -> Schedule:
    """Cubics through dymos' nodes (N, 4) as a schedule on the 1 s grid, within its bounds between the nodes too."""
    grid = task.setup.grid
    box = task.setup.settings.box(grid.model.bounds)
    values = np.empty((2, len(grid.time)))
    interval = np.clip(np.searchsorted(mesh.start, grid.time, side="right") - 1, 0, len(mesh) - 1)
    share = (grid.time - mesh.start[interval]) / mesh.step[interval]
    for k in range(len(mesh)):
        here = interval == k
        for row, nodes in zip(values, (rotor_speed, twist), strict=True):
            row[here] = Polynomial.fit(SHARES, nodes[k], 3)(share[here])
    values = np.clip(values, *box[:, :, None])
    return Schedule("dymos", grid.segment, grid.time, values[0], values[1])


def by_product(task: Task, mesh: Mesh, transcription: str) -> dict[str, Any]:
    """Solution of the product, flown."""
    own: dict[str, Any] = {"settings": task.setup.settings, "mesh": mesh, "transcription": transcription}
    begin = time.process_time()
    problem = TrajectoryProblem(task.profile, task.setup.make, **own)
    built = time.process_time()
    trajectory = problem.solve(task.takeoff_mass)
    solved = time.process_time()
    flown = task.setup.grid.fly(trajectory.schedule, takeoff_mass=task.takeoff_mass)
    return {
        "build_s": built - begin,
        "solve_s": solved - built,
        "together_s": solved - begin,
        "iterations": trajectory.iterations,
        "success": trajectory.success,
        "nlp_fuel_kg": trajectory.fuel,
        "fuel_kg": flown.fuel,
        "flown": flown.message,
    }


def environment(folder: Path) -> Path:
    """Python of a virtual environment with dymos in ``folder``, made if it is not there."""
    python = folder / "bin" / "python"
    if not python.exists():
        venv.create(folder, with_pip=True)
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", *PACKAGES], check=True)
    return python


def main() -> int:
    """Run, print, and tell by the exit code whether both sides were solved."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--environment", type=Path)
    parser.add_argument("--segments", type=int, nargs="+", default=[25])
    parser.add_argument("--optimisers", nargs="+", default=["SLSQP", "IPOPT"])
    arguments = parser.parse_args()
    task, figures = flight(), {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        python = environment(arguments.environment or folder / "environment")
        for count in arguments.segments:
            mesh = even_mesh(task.profile, count)
            export(task, mesh, folder)
            own = {name: by_product(task, mesh, name) for name in ("hermite_simpson", "radau")}
            other = {name: by_dymos(task, mesh, python, folder, name) for name in arguments.optimisers}
            ratios = {
                name: found["together_s"] / own["radau"]["together_s"]
                for name, found in other.items()
                if "together_s" in found
            }
            figures[f"{count}_segments"] = {"product": own, "dymos": other, "dymos_over_product_radau": ratios}
    print(json.dumps(figures, indent=2))
    return 0 if all(f["dymos_over_product_radau"] for f in figures.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
