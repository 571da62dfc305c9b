"""The whole-mission problem as one writes it down in CasADi with no library: one page of script, the yardstick.

Hermite-Simpson with midpoints: unknowns are fuel burned, rotor speed and twist at the edges of the intervals, fuel
burned at their middles, and the rates, constant over an interval. The node function is the product's own; it is mapped
over all points, and CasADi differentiates the whole.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import casadi as ca
import numpy as np
from trajectory_problem import Task

from vrsopt.schedule.mesh import Mesh
from vrsopt.schedule.schedule import Schedule

FUEL = 100.0  # kg, unit of the unknown fuel
REGULARISATION = 1e-6


@dataclass(frozen=True)
class ByHand:
    """Solution: the schedule at the edges of the intervals, fuel [kg], iterations, CPU times [s]."""

    schedule: Schedule
    fuel: float
    iterations: int
    success: bool
    build_s: float
    solve_s: float


def solve_by_hand(task: Task, mesh: Mesh) -> ByHand:
    """Least fuel with the limits of the product at start, middle and end of every interval, ends pinned."""
    begin = time.process_time()
    n, h = len(mesh), ca.DM(mesh.step).T
    times = np.stack([mesh.start, mesh.start + 0.5 * mesh.step, mesh.start + mesh.step])
    conditions = task.profile.conditions(np.tile(mesh.segment, 3), times.ravel())
    model, settings = task.setup.make(conditions), task.setup.settings
    f, coefficients = model.function()
    inputs = f.sx_in()  # its last two are not differentiated: coefficients, and the point about which f is exact
    known = {"is_diff_in": [True] * 4 + [False] * 2}
    f = ca.Function("node", inputs, f(*inputs), known).map(3 * n)
    idle = np.asarray(conditions.idle).reshape(3, n)[1]

    nominal = np.array([settings.nominal_rotor_speed, settings.nominal_twist])
    burned, middle = ca.MX.sym("burned", 1, n + 1), ca.MX.sym("middle", 1, n)
    state, rate = ca.MX.sym("state", 2, n + 1), ca.MX.sym("rate", 2, n)  # over nominal; over the largest rates
    x = ca.vertcat(burned.T, middle.T, ca.vec(state), ca.vec(rate))

    largest = np.array([settings.rotor_speed_rate, settings.twist_rate])
    added = task.takeoff_mass + np.cumsum(task.profile.mass_changes)[mesh.segment][None, :]
    start, end = state[:, :-1], state[:, 1:]
    both = ca.horzcat(start, 0.5 * (start + end), end) * nominal
    mass = ca.horzcat(*(added - FUEL * part for part in (burned[:, :-1], middle, burned[:, 1:])))
    speed_rate = ca.repmat(rate[0, :] * largest[0], 1, 3)
    point = ca.vertcat(mass, both, speed_rate)
    flow, limits = f(mass, both[0, :], both[1, :], speed_rate, coefficients, point)
    f0, f1, f2 = (flow[:, k * n : (k + 1) * n] / FUEL for k in range(3))
    defects = [
        burned[:, 1:] - burned[:, :-1] - h / 6.0 * (f0 + 4.0 * f1 + f2),
        middle - 0.5 * (burned[:, :-1] + burned[:, 1:]) - h / 8.0 * (f0 - f2),
        (end - start) * nominal / largest - ca.repmat(h, 2, 1) * rate,
    ]
    g = ca.vertcat(*(ca.vec(part) for part in (*defects, limits)))
    equal = g.numel() - limits.numel()
    cost = burned[0, n] + REGULARISATION * ca.sum2(h / ca.sum2(h) * ca.sum1(rate**2))

    box = settings.box(model.bounds) / nominal
    grounded = np.append(idle, False) | np.append(False, idle)
    grounded[[0, -1]] = True
    low, high = (np.where(grounded, 1.0, edge[:, None] * np.ones(n + 1)) for edge in box)
    lbx = np.concatenate([[0.0], np.zeros(2 * n), low.ravel("F"), -np.ones(2 * n)])
    ubx = np.concatenate([[0.0], np.full(2 * n, np.inf), high.ravel("F"), np.ones(2 * n)])
    ubg = np.concatenate([np.zeros(equal), np.where(np.tile(idle, 3), np.inf, 0.0).repeat(limits.shape[0])])
    x0 = np.concatenate([np.zeros(2 * n + 1), np.ones(2 * n + 2), np.zeros(2 * n)])
    solver = ca.nlpsol("by_hand", "ipopt", {"x": x, "f": cost, "g": g}, {"print_time": False, "ipopt.print_level": 0})
    built = time.process_time()
    lbg = np.concatenate([np.zeros(equal), np.full(limits.numel(), -np.inf)])
    found = solver(x0=x0, lbx=lbx, ubx=ubx, lbg=lbg, ubg=ubg)
    solved = time.process_time()
    values = np.array(found["x"]).ravel()
    edges = values[2 * n + 1 : 4 * n + 3].reshape(n + 1, 2)
    return ByHand(
        _schedule(mesh, edges * nominal),
        FUEL * float(values[n]),
        int(solver.stats()["iter_count"]),
        bool(solver.stats()["success"]),
        built - begin,
        solved - built,
    )


def _schedule(mesh: Mesh, edges: np.ndarray) -> Schedule:
    """Values (n + 1, 2) at the edges as a schedule, with both ends of every segment."""
    last = np.append(np.diff(mesh.segment) != 0, True)
    segment = np.append(mesh.segment, mesh.segment[last])
    times = np.append(mesh.start, (mesh.start + mesh.step)[last])
    index = np.append(np.arange(len(mesh)), np.flatnonzero(last) + 1)
    order = np.lexsort((times, segment))
    return Schedule("by hand", segment[order], times[order], edges[index[order], 0], edges[index[order], 1])
