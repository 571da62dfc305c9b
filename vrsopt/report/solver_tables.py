"""How the schedules were found, in words and numbers: effort, residuals, mesh, what is active when, times."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.report.emission_tables import number
from vrsopt.report.style import MINUTE
from vrsopt.schedule.resimulation import resimulation_error

if TYPE_CHECKING:
    from vrsopt.schedule.comparison import Comparison
    from vrsopt.schedule.trajectory_solution import Arc, Trajectory

SOLVER_HEADINGS = ("trajectory", "value")
ARC_HEADINGS = ("from min", "to min", "task", "active")
ARC_LEGEND = "active: limits, bounds and rates on which the solution rests, by their multipliers"
STEP_HEADINGS = ("step", "on the clock s", "of the processor s")


def solver_rows(comparison: Comparison) -> list[tuple[str, str]]:
    """What is known of the solution of the whole-mission problem, by name; nothing without one."""
    trajectory = comparison.trajectory
    if trajectory is None:
        return []
    flight = comparison.results["trajectory"].flight
    error, step = np.abs(trajectory.mesh_error), trajectory.mesh.step
    worst = int(np.argmax(error))
    task = comparison.profile.segments[trajectory.mesh.segment[worst]].task
    rows = [
        ("result", f"{trajectory.status}: {trajectory.message}"),
        ("iterations of IPOPT", f"{trajectory.iterations} on {_meshes(trajectory)}"),
        ("largest residual, scaled", f"{trajectory.max_residual:.1e}"),
        ("transcription", str(trajectory.transcription).replace("_", "-")),
        ("intervals of the last mesh", f"{len(step)}, of {step.min():.1f} to {step.max():.0f} s"),
        ("error of its quadrature", f"{1e3 * error.sum():.2f} g of fuel, at most {1e3 * error[worst]:.3f} g in an "
         f"interval ({trajectory.mesh.start[worst] / MINUTE:.1f} min, {task})"),
        ("fuel of the problem against its re-flight", f"{100.0 * resimulation_error(trajectory, flight):+.4f} %"),
        ("penalty on the rates", f"{1e3 * trajectory.regularisation:.3f} g of fuel"),
        ("built, solved", f"{trajectory.build_s:.1f} s, {trajectory.solve_s:.1f} s"),
        ("pieces of its switching structure", str(len(trajectory.arcs))),
    ]  # fmt: skip
    rows += [(f"{name}, multiplier", f"{value:.4g}") for name, value in trajectory.integral_multipliers.items()]
    return rows + _consistent_rows(comparison)


def _meshes(trajectory: Trajectory) -> str:
    return "one mesh" if trajectory.rounds == 1 else f"{trajectory.rounds} meshes, each from the solution before"


def _consistent_rows(comparison: Comparison) -> list[tuple[str, str]]:
    """How well the trajectory on the physics is an optimum of the physics."""
    found = comparison.consistent
    if found is None:
        return []
    return [
        ("on the physics: result", found.message or "consistent"),
        ("on the physics: solves", f"{len(found.history)}, {sum(one.kept for one in found.history)} of them kept"),
        ("on the physics: trims, derivatives", f"{found.trims}, {found.derivatives}"),
        (
            "on the physics: problem against physics",
            f"{100.0 * (found.trajectory.fuel / found.fuel_physics - 1.0):+.4f} % of the fuel",
        ),
        (
            "on the physics: left to be saved",
            f"{1e3 * found.optimality.at_stake:.2f} g by moves of 1 % rotor speed and 1 deg twist, to first order "
            f"(the surrogate's optimum: {1e3 * found.surrogate.at_stake:.2f} g)",
        ),
    ]


def arc_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    """The switching structure of the trajectory: one row per stretch with the same things active."""
    arcs = () if comparison.trajectory is None else comparison.trajectory.arcs
    return [(f"{arc.start / MINUTE:.2f}", f"{arc.end / MINUTE:.2f}", arc.task, _active(arc)) for arc in arcs]


def _active(arc: Arc) -> str:
    return ", ".join(arc.active) or "nothing"


def step_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    """How long every step took, and their sum."""
    rows = [(name, one["wall_s"], one["cpu_s"]) for name, one in comparison.steps.items()]
    if rows:
        rows.append(("all", math.fsum(row[1] for row in rows), math.fsum(row[2] for row in rows)))
    return [(name, number(wall, ".1f"), number(cpu, ".1f")) for name, wall, cpu in rows]
