"""Damped Newton method with error-oriented step control and re-use of the factorisation.

P. Deuflhard, Newton Methods for Nonlinear Problems (2004), algorithm NLEQ-ERR: a damped step is accepted when the
simplified Newton correction, taken with the same Jacobian, shrinks. Unlike a line search on the residual norm the test
does not depend on how the residuals are scaled. Once full steps contract well the factorisation is kept (chord steps).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import LinAlgWarning, lu_factor, lu_solve

from vrsopt.solvers.status import Status

CHORD_CONTRACTION = 0.3  # keep the factorisation while each step is at most this fraction of the one before
SMALLEST_DAMPING = 1e-3
LARGEST_CHORD_START = 0.5  # a neighbour's factorisation is dropped when its second step shrinks less than this

Factorisation = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class NewtonResult:
    """Root (n,), its residual (n,), the last factorisation and the effort."""

    root: np.ndarray
    residual: np.ndarray
    factorisation: Factorisation | None
    status: Status
    iterations: int
    jacobians: int


@np.errstate(over="ignore")  # a diverging iterate may overflow: it ends without success
def newton(
    residual: Callable[[np.ndarray], np.ndarray],
    jacobian: Callable[[np.ndarray], np.ndarray],
    *,
    start: np.ndarray,
    tolerance: float = 1e-8,
    max_iterations: int = 60,
    factorisation: Factorisation | None = None,
) -> NewtonResult:
    """Solve ``residual(x) = 0`` from ``start`` (n,) until its largest component is below ``tolerance``.

    ``factorisation`` is a neighbour's: it is used for chord steps first, and given up as soon as they contract badly.
    ``jacobian(x)`` is (n, n); ``max_iterations``: steps after which it gives up.
    """
    x, r = start.copy(), residual(start)
    iterations, jacobians = 0, 0
    if factorisation is not None:
        x, r, iterations = _chord(residual, factorisation, x=x, r=r, tolerance=tolerance, limit=max_iterations // 2)
    lu = factorisation
    damping = 1.0
    while not np.max(np.abs(r)) < tolerance:  # so written, nan is not a root
        if iterations >= max_iterations:
            return NewtonResult(x, r, lu, Status.ITERATION_LIMIT, iterations, jacobians)
        matrix = jacobian(x)
        jacobians += 1
        if not (np.all(np.isfinite(matrix)) and np.all(np.isfinite(r))):
            return NewtonResult(x, r, lu, Status.NOT_FINITE, iterations, jacobians)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", LinAlgWarning)  # a singular matrix shows in the step
            lu = lu_factor(matrix, check_finite=False)
        step = -lu_solve(lu, r, check_finite=False)
        size = np.linalg.norm(step)
        if not np.isfinite(size):
            return NewtonResult(x, r, None, Status.NO_PROGRESS, iterations, jacobians)
        damping = min(1.0, 4.0 * damping)
        while True:
            iterations += 1
            trial = x + damping * step
            r_trial = residual(trial)
            finite = bool(np.all(np.isfinite(r_trial)))
            correction = -lu_solve(lu, r_trial, check_finite=False) if finite else step
            contraction = np.linalg.norm(correction) / size if finite else np.inf
            if contraction < 1.0 - damping / 4.0 or (finite and np.max(np.abs(r_trial)) < tolerance):
                break
            damping *= 0.5
            if damping < SMALLEST_DAMPING:
                return NewtonResult(x, r, lu, Status.NO_PROGRESS, iterations, jacobians)
        x, r = trial, r_trial
        if damping == 1.0 and contraction < CHORD_CONTRACTION:
            x, r, extra = _chord(residual, lu, x=x, r=r, tolerance=tolerance, limit=max_iterations - iterations)
            iterations += extra
    if lu is not None and iterations:
        x, r = _polished(residual, lu, x=x, r=r)
    return NewtonResult(x, r, lu, Status.CONVERGED, iterations, jacobians)


def _polished(
    residual: Callable[[np.ndarray], np.ndarray], lu: Factorisation, *, x: np.ndarray, r: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """One more chord step, for unknowns as good as the residual where the Jacobian is ill-conditioned."""
    trial = x - lu_solve(lu, r, check_finite=False)
    r_trial = residual(trial)
    return (trial, r_trial) if np.max(np.abs(r_trial)) <= np.max(np.abs(r)) else (x, r)


def _chord(
    residual: Callable[[np.ndarray], np.ndarray],
    lu: Factorisation,
    *,
    x: np.ndarray,
    r: np.ndarray,
    tolerance: float,
    limit: int,
) -> tuple[np.ndarray, np.ndarray, int]:
    """Simplified Newton steps while they contract; returns the best point, its residual and the number of steps."""
    last = np.inf
    for count in range(max(limit, 0)):
        if np.max(np.abs(r)) < tolerance:
            return x, r, count
        step = -lu_solve(lu, r, check_finite=False)
        size: Any = np.linalg.norm(step)
        if not np.isfinite(size) or size > (CHORD_CONTRACTION if count > 1 else LARGEST_CHORD_START) * last:
            return x, r, count
        trial = x + step
        r_trial = residual(trial)
        if not np.all(np.isfinite(r_trial)):
            return x, r, count
        x, r, last = trial, r_trial, size
    return x, r, max(limit, 0)
