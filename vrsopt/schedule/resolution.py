"""What a schedule that is straight within each interval of its mesh costs over one that may bend in the middle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vrsopt.schedule.bounds import Bounds
from vrsopt.schedule.layout import Control
from vrsopt.schedule.path_model import PathModel
from vrsopt.schedule.quadrature_error import GAUSS, lagrange
from vrsopt.schedule.trajectory import TrajectoryProblem
from vrsopt.schedule.trajectory_solution import Trajectory

STEPS = (0.2, 0.004)  # rad/s and rad, of the differences of the fuel flow
RATE_STEP = 0.02  # rad/s2, of those by the rate of the rotor speed
FARTHEST = (2.0, 0.04)  # rad/s and rad, as far as a parabola through such differences is believed


@dataclass(frozen=True)
class Slopes:
    """Derivatives by rotor speed or twist: first and second (N, s) of the fuel flow at points of the intervals, first
    (m, N) of the limits in the middle, and these limits."""

    first: np.ndarray
    second: np.ndarray
    limit_slopes: np.ndarray
    limits: np.ndarray


def resolution_loss(problem: TrajectoryProblem, trajectory: Trajectory, bounds: Bounds) -> np.ndarray:
    """Estimate (N,) [kg] of the fuel that a bend of rotor speed and twist in the middle of each interval would save.

    A bend by d, the ends of the interval left where they are, changes its fuel by g d + c d^2 / 2, with integrals g and
    c of slope and curvature of the fuel flow; d may be as large as the rates, the ranges in ``bounds`` and the limits
    in the middle allow. Constraints of one's own are not looked at.
    """
    of, finer, x, step = problem.discretisation, problem.finer, trajectory.x, trajectory.mesh.step
    flow_rises, flow_bends, rate_acts = _bend_moments(finer.shares)
    takeoff_mass = trajectory.mass[0] - problem.profile.mass_changes[0]
    nodes = finer.inputs(x, problem.unburned(takeoff_mass))
    shape = len(step), len(finer.shares)
    most = _most_usages(problem, bounds)
    loss = np.zeros(len(step))
    for control, small, farthest in zip(of.layout.controls, STEPS, FARTHEST, strict=True):
        at = _slopes(finer.model, nodes, control.row, small, shape)
        g, c = step * (at.first @ flow_rises), step * (at.second @ flow_bends)
        if control.name == "rotor speed":
            g = g + _by_rate(finer.model, nodes).reshape(shape) @ rate_acts
        down, up = _reach(control, x, bounds, step)
        room = most[:, None] - at.limits
        with np.errstate(divide="ignore", invalid="ignore"):
            to_limit = np.where(at.limit_slopes != 0.0, np.maximum(room, 0.0) / np.abs(at.limit_slopes), np.inf)
        down = np.minimum(down, np.min(to_limit, axis=0, where=at.limit_slopes < 0.0, initial=farthest))
        up = np.minimum(up, np.min(to_limit, axis=0, where=at.limit_slopes > 0.0, initial=farthest))
        bend = np.clip(np.where(c > 0.0, -g / np.maximum(c, 1e-300), -np.sign(g) * farthest), -down, up)
        loss += np.maximum(-(g + 0.5 * c * bend) * bend, 0.0)
    return np.where(of.idle, 0.0, loss)


def _bend_moments(shares: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Weights (s,) of values at ``shares`` of an interval of length one in the integrals with a bend of height one, its
    square and its slope."""
    half, weight = 0.25 * (GAUSS[0] + 1.0), 0.25 * GAUSS[1]
    share, weight = np.append(half, 1.0 - half), np.append(weight, weight)
    bend, slope = 1.0 - np.abs(2.0 * share - 1.0), np.where(share < 0.5, 2.0, -2.0)
    known = lagrange(shares, share)
    return known @ (weight * bend), known @ (weight * bend**2), known @ (weight * slope)


def _most_usages(problem: TrajectoryProblem, bounds: Bounds) -> np.ndarray:
    """Upper bounds (m,) of the limits of the aircraft."""
    places = [problem.rows.where("limit", name) for name in problem.model.limit_names]
    return np.array([np.max(bounds.ubg[place], initial=0.0) for place in places])


def _slopes(model: PathModel, nodes: list[np.ndarray], row: int, small: float, shape: tuple[int, int]) -> Slopes:
    """Differences by ``small`` of one of the inputs of ``model`` at its ``nodes``, inside the range where it holds."""
    low, high = model.bounds[("mass", "rotor_speed", "twist")[row]]
    moved, sides = list(nodes), []
    middle = np.clip(nodes[row], low + small, high - small)
    for side in (-small, 0.0, small):
        moved[row] = middle + side
        sides.append(model.evaluate(*moved))
    flows, limits = ([getattr(side, name) for side in sides] for name in ("fuel_flow", "limits"))
    first, second = (flows[2] - flows[0]) / (2.0 * small), (flows[2] - 2.0 * flows[1] + flows[0]) / small**2
    half = shape[1] // 2
    slope, value = (of.reshape(-1, *shape)[:, :, half] for of in ((limits[2] - limits[0]) / (2.0 * small), limits[1]))
    return Slopes(first.reshape(shape), second.reshape(shape), slope, value)


def _by_rate(model: PathModel, nodes: list[np.ndarray]) -> np.ndarray:
    """Derivative of the fuel flow at the ``nodes`` by the rate of the rotor speed."""
    mass, speed, twist, rate = nodes
    low, high = (model.evaluate(mass, speed, twist, rate + side).fuel_flow for side in (-RATE_STEP, RATE_STEP))
    return np.asarray((high - low) / (2.0 * RATE_STEP))


def _reach(control: Control, x: np.ndarray, bounds: Bounds, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far (N,) the middle may go down and up for the rate of the variable and its own range."""
    rate = x[control.rate]
    steeper = np.minimum(bounds.ubx[control.rate] - rate, rate - bounds.lbx[control.rate])
    by_rate = np.maximum(steeper, 0.0) * control.rate_scale * 0.5 * step
    value = 0.5 * (x[control.start] + x[control.end])
    down = value - 0.5 * (bounds.lbx[control.start] + bounds.lbx[control.end])
    up = 0.5 * (bounds.ubx[control.start] + bounds.ubx[control.end]) - value
    return tuple(np.minimum(by_rate, np.maximum(one, 0.0) * control.scale) for one in (down, up))
