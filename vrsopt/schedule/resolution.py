"""What a schedule that is straight within each interval of its mesh may cost over one that is free to bend."""

from __future__ import annotations

import numpy as np

from vrsopt.schedule.trajectory import TrajectoryProblem
from vrsopt.schedule.trajectory_solution import Trajectory

STEPS = (0.2, 0.004)  # rad/s and rad, of the differences of the fuel flow
MULTIPLIER = 1e-4  # kg per s and unit of usage: a limit with more is active


def resolution_loss(problem: TrajectoryProblem, trajectory: Trajectory) -> np.ndarray:
    """Estimate (N,) [kg] of the fuel that straight pieces of rotor speed and twist cost in each interval.

    Where the slope changes by s from one piece to the next, a curve would leave them by up to step * s / 8. That costs
    the curvature of the fuel flow over rotor speed and twist, and its slope where a limit is active.
    """
    mesh, of, x = trajectory.mesh, problem.discretisation, trajectory.x
    layout, e = of.layout, of.evaluations
    inside = np.flatnonzero((e.share > 0.0) & (e.share < 1.0))
    chosen = inside[np.unique(e.interval[inside], return_index=True)[1]]
    model = problem.model.nodes(e.point[chosen])
    takeoff_mass = trajectory.mass[0] - problem.profile.mass_changes[0]
    mass, *values, _ = problem.inputs(x, takeoff_mass)[:, chosen]
    limited = np.zeros(len(mesh), dtype=bool)
    for multipliers in trajectory.limit_multipliers.values():
        limited |= np.abs(multipliers) > MULTIPLIER * mesh.step
    loss = np.zeros(len(mesh))
    for k, (control, step) in enumerate(zip(layout.controls, STEPS, strict=True)):
        low, high = problem.model.bounds[("rotor_speed", "twist")[k]]
        flows = []
        for side in (-step, 0.0, step):
            moved = [np.clip(v + side, low, high) if n == k else v for n, v in enumerate(values)]
            flows.append(model.evaluate(mass, *moved).fuel_flow)
        slope = np.abs(flows[2] - flows[0]) / (2.0 * step)
        curvature = np.maximum(flows[2] - 2.0 * flows[1] + flows[0], 0.0) / step**2
        change = np.abs(np.diff(x[control.rate] * control.rate_scale))
        bow = mesh.step * 0.5 * (np.append(0.0, change) + np.append(change, 0.0)) / 8.0
        # means over the interval of a parabola of this height (2/3) and of its square (8/15)
        loss += mesh.step * (np.where(limited, slope, 0.0) * bow * 2.0 / 3.0 + 0.5 * curvature * bow**2 * 8.0 / 15.0)
    return np.where(of.idle, 0.0, loss)
