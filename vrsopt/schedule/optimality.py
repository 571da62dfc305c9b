"""First-order optimality of a schedule, whatever has led to it."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import casadi as ca
import numpy as np

from vrsopt.schedule.bounds import Bounds
from vrsopt.schedule.layout import FUEL_SCALE
from vrsopt.schedule.trajectory import Trajectory, TrajectoryProblem

NEAR_BOUND = 1e-3  # of a scaled unknown: further away its multiplier is that of a trust region, and does not count


@dataclass(frozen=True)
class Optimality:
    """First-order optimality at a schedule, with the multipliers of its solve.

    ``stationarity``: largest slope of the Lagrangian by rotor speed and twist, no other unknown, kg per relative change
    at one node, inside the bounds; ``at_stake``: what all of them together leave to be saved by moving every node by
    1 % of rotor speed and 1 deg of twist, kg; ``excess``: worst usage of a limit less 1.
    """

    stationarity: float
    at_stake: float
    excess: float


def optimality_at(
    problem: TrajectoryProblem, trajectory: Trajectory, x: np.ndarray, p: ca.DM, bounds: Bounds, *, excess: float
) -> Optimality:
    """Karush-Kuhn-Tucker residual of ``problem`` at unknowns x and parameters p, with the multipliers of
    ``trajectory``; ``bounds`` are those of the problem itself.

    ``excess`` is kept with the result.
    """
    nlp = problem.nlp.problem
    slope = ca.Function("slope", [nlp["x"], nlp["p"]], [ca.gradient(nlp["f"], nlp["x"])])(x, p).full().ravel()
    jacobian = problem.nlp.jacobian(x, p)[1]
    slope = slope + ca.mtimes(jacobian.T, trajectory.lam_g).full().ravel()
    held_below = np.where(x - bounds.lbx < NEAR_BOUND, np.minimum(trajectory.lam_x, 0.0), 0.0)
    held_above = np.where(bounds.ubx - x < NEAR_BOUND, np.maximum(trajectory.lam_x, 0.0), 0.0)
    slope = np.where(bounds.ubx > bounds.lbx, slope + held_below + held_above, 0.0)
    found = {name: FUEL_SCALE * slope[problem.columns.where(name)] for name in ("rotor speed", "twist")}
    stake = 0.01 * np.sum(np.abs(found["rotor speed"]))
    stake += radians(1.0) / problem.settings.nominal_twist * np.sum(np.abs(found["twist"]))
    largest = max(float(np.max(np.abs(part), initial=0.0)) for part in found.values())
    return Optimality(largest, float(stake), excess)
