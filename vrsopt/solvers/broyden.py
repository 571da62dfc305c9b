"""Broyden's good method with an inverse Jacobian that is carried from one system to the next.

For many neighbouring systems, one after another: the rank-one updates keep the inverse Jacobian of the last system good
for the next, so that the Jacobian itself, which costs as much as thirty residuals, is hardly ever needed.

C. G. Broyden, A class of methods for solving nonlinear simultaneous equations (1965).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

CONTRACTION = 0.7  # of the largest residual per step, below which the inverse Jacobian is good enough
MAX_STEPS = 12


@dataclass(frozen=True)
class BroydenResult:
    """The last iterate (n,) with its residual, the updated inverse Jacobian (n, n), and the number of residuals."""

    root: np.ndarray
    residual: np.ndarray
    inverse: np.ndarray
    evaluations: int
    success: bool


def broyden(
    residual: Callable[[np.ndarray], np.ndarray],
    *,
    start: np.ndarray,
    inverse: np.ndarray,
    tolerance: float,
    reach: float = np.inf,
) -> BroydenResult:
    """Solve ``residual(x) = 0`` from ``start`` (n,), with an approximate inverse Jacobian (n, n).

    Ends without success as soon as a step does not contract, or has a component above ``reach``: then the inverse is
    not good enough, and it is returned as it came, or the start is too far away, and may lead to another root.
    ``tolerance``: largest component of the residual at the root.
    """
    x, r, updated = start, residual(start), inverse
    for count in range(1, MAX_STEPS + 1):
        size = np.max(np.abs(r))
        if size < tolerance:
            return BroydenResult(x, r, updated, count, True)
        step = -updated @ r
        if not np.max(np.abs(step)) <= reach:
            return BroydenResult(x, r, inverse, count, False)
        r_trial = residual(x + step)
        if not np.max(np.abs(r_trial)) < max(CONTRACTION * size, tolerance):  # so written, nan does not contract
            return BroydenResult(x, r, inverse, count + 1, False)
        change = updated @ (r_trial - r)
        # Sherman-Morrison form; the denominator is near step'step wherever the residual contracts
        updated = updated + np.outer(step - change, (step @ updated) / (step @ change))
        x, r = x + step, r_trial
    return BroydenResult(x, r, inverse, MAX_STEPS + 1, bool(np.max(np.abs(r)) < tolerance))
