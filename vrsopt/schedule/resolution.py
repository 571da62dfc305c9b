"""What a schedule that is straight within each interval of its mesh may cost over one that is free to bend."""

from __future__ import annotations

import numpy as np

from vrsopt.schedule.trajectory import TrajectoryProblem
from vrsopt.schedule.trajectory_solution import Trajectory

STEPS = (0.2, 0.004)  # rad/s and rad, of the differences of the fuel flow


def resolution_loss(problem: TrajectoryProblem, trajectory: Trajectory) -> np.ndarray:
    """Estimate (N,) [kg] of the fuel that straight pieces of rotor speed and twist cost in each interval.

    Where the slope changes by s from one piece to the next, a curve would leave them by up to step * s / 8, which
    costs by the curvature of the fuel flow. Beside jumps of the conditions that is too little, in fast turns too much.
    """
    mesh, of, x = trajectory.mesh, problem.discretisation, trajectory.x
    layout, e = of.layout, of.evaluations
    inside = np.flatnonzero((e.share > 0.0) & (e.share < 1.0))
    chosen = inside[np.unique(e.interval[inside], return_index=True)[1]]
    model = problem.model.nodes(e.point[chosen])
    takeoff_mass = trajectory.mass[0] - problem.profile.mass_changes[0]
    mass, *values, _ = problem.inputs(x, takeoff_mass)[:, chosen]
    loss = np.zeros(len(mesh))
    for k, (control, step) in enumerate(zip(layout.controls, STEPS, strict=True)):
        low, high = problem.model.bounds[("rotor_speed", "twist")[k]]
        flows = []
        for side in (-step, 0.0, step):
            moved = [np.clip(v + side, low, high) if n == k else v for n, v in enumerate(values)]
            flows.append(model.evaluate(mass, *moved).fuel_flow)
        curvature = np.maximum(flows[2] - 2.0 * flows[1] + flows[0], 0.0) / step**2
        change = np.abs(np.diff(x[control.rate] * control.rate_scale))
        bow = mesh.step * 0.5 * (np.append(0.0, change) + np.append(change, 0.0)) / 8.0
        loss += mesh.step * 0.5 * curvature * bow**2 * 8.0 / 15.0  # the mean square of a parabola of this height
    return np.where(of.idle, 0.0, loss)
