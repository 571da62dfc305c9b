"""The algebra of universal Kriging: generalised least squares, leave-one-out, concentrated likelihood and its maximum.

The data (N,) are outputs, or outputs and their gradients; their covariance is proportional to K = R(theta) +
diag(nuggets) and their trend is F beta. Equations: Sacks, Welch, Mitchell and Wynn (1989), eqs. 4-7; leave-one-out with
trend: Dubrule (1983), Cross validation of Kriging in a unique neighborhood.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dpocon, dpotrf, dpotri
from scipy.optimize import minimize

from vrsopt.surrogate.correlation import correlation_matrix, log_theta_ratio, upper_blocks

Array = NDArray[np.float64]

THETA_STARTS = (2.5, 10.0)  # smaller ones run into the ill-conditioned corner of the likelihood
THETA_BOUNDS = (1e-3, 50.0)
NUGGET_START, NUGGET_BOUNDS = 1e-5, (1e-12, 1e-1)
SUBSET = 500  # data on which the starts compete before the best one is finished on all of them
REJECTED = 1e10  # value of the likelihood where K is not positive definite


class Covariance(Protocol):
    """R(theta) of the data, and what the likelihood's gradient needs of it."""

    @property
    def sizes(self) -> tuple[int, ...]:
        """Number of data under each nugget, in their order: (outputs,) or (outputs, gradients)."""

    def matrix(self, theta: Array) -> Array:
        """R (N, N); only the upper triangle is filled."""

    def slopes(self, theta: Array, matrix: Array, weight: Array) -> Array:
        """sum(weight * dR/d log theta_k) (d,), where the upper triangle of the weight also stands for the lower."""


@dataclass(frozen=True)
class ValueCovariance:
    """R of outputs alone at ``scaled`` (n, d)."""

    correlation: str
    smoothing: float
    scaled: Array

    @property
    def sizes(self) -> tuple[int, ...]:
        """Number of outputs: (n,)."""
        return (len(self.scaled),)

    def matrix(self, theta: Array) -> Array:
        """Correlations R (n, n) of the outputs at ``theta`` (d,); only the upper triangle is filled."""
        return correlation_matrix(self.correlation, self.smoothing, theta, self.scaled)

    def slopes(self, theta: Array, matrix: Array, weight: Array) -> Array:
        """As of :class:`Covariance`: (d,), with R as ``matrix`` and ``weight`` (n, n) at ``theta`` (d,)."""
        total = np.zeros(len(theta))
        for rows, columns, difference in upper_blocks(self.scaled):
            product = weight[rows, columns] * matrix[rows, columns]
            width = product.shape[0]
            product[:, :width] = np.triu(product[:, :width])
            ratio = log_theta_ratio(self.correlation, theta[:, None], difference)
            total += np.matmul(ratio, product[:, :, None]).sum(axis=0)[:, 0]
        return total


@dataclass(frozen=True)
class LeastSquares:
    """Generalised least squares with covariance K = L L'.

    Trend coefficients (p,), weights K^-1 (y - F beta) (N,), squared residual (y - F beta)' K^-1 (y - F beta),
    L^-T Q (N, p) and R (p, p) with the thin QR of L^-1 F, and L as LAPACK leaves it (N, N).
    """

    coefficients: Array
    weights: Array
    squares: float
    projection: Array
    triangular: Array
    factor: Array

    @property
    def likely_variance(self) -> float:
        """Process variance of greatest likelihood."""
        return self.squares / len(self.weights)

    def inverse(self) -> Array:
        """K^-1: upper triangle and diagonal; zeros below (N, N)."""
        inverse, _ = dpotri(self.factor, lower=1)
        return np.asarray(inverse).T

    def log_determinant(self) -> float:
        """Logarithm of the determinant of K."""
        return 2.0 * float(np.sum(np.log(np.diag(self.factor))))

    def condition_number(self, norm: float) -> float:
        """LAPACK's estimate of the condition number of K, given the 1-norm of K."""
        reciprocal, _ = dpocon(self.factor, norm, uplo="L")
        return 1.0 / float(reciprocal) if reciprocal > 0.0 else np.inf

    def leave_one_out(self, points: int) -> tuple[Array, Array]:
        """Data minus prediction of the outputs at each of n ``points`` without it, and the variance of that (n,).

        With Q = K^-1 - K^-1 F (F' K^-1 F)^-1 F' K^-1, Q y = the weights w. Leaving out the data of one point, the
        errors are the solution of Q_ii e_i = w_i, of covariance Q_ii^-1 (times the process variance; it includes the
        nuggets); the block Q_ii is of the output and, if there are any, its gradient. The trend is estimated anew, the
        correlation is kept.
        """
        per_point = len(self.weights) // points
        shape = (per_point, points, per_point, points)
        upper = np.einsum("aibi->iab", self.inverse().reshape(shape))
        blocks = np.triu(upper) + np.swapaxes(np.triu(upper, 1), 1, 2)
        projection = self.projection.reshape(per_point, points, -1)
        blocks -= np.einsum("aip,bip->iab", projection, projection)
        covariance = np.linalg.inv(blocks)
        weights = self.weights.reshape(per_point, points).T
        return np.einsum("ia,ia->i", covariance[:, 0], weights), covariance[:, 0, 0]

    def variance(self, points: int) -> float:
        """Process variance with which the leave-one-out errors of the outputs are, on average, as large as predicted.

        mean(e_i^2 / (Q_ii^-1)_00): Cressie (1993), Statistics for Spatial Data, section 2.6.4; Bachoc (2013), Cross
        validation and maximum likelihood estimations of hyper-parameters of Gaussian processes with model
        misspecification. Physics is not stationary: errors are larger near its limits than the likelihood's variance
        says, while this one gives deviations that hold on unseen points.
        """
        errors, covariances = self.leave_one_out(points)
        return float(np.mean(errors**2 / covariances))


def one_norm(matrix: Array, nuggets: Array) -> float:
    """1-norm of the symmetric matrix given by its upper triangle, plus diag(nuggets)."""
    upper = np.abs(np.triu(matrix))
    return float(np.max(upper.sum(axis=0) + upper.sum(axis=1) - np.diag(upper) + nuggets))


def least_squares(matrix: Array, nuggets: Array, basis: Array, data: Array) -> LeastSquares | None:
    """Solve for the trend and the weights; None where K, ``matrix`` (upper triangle) + diag(``nuggets`` (N,)), is not
    positive definite.

    ``basis`` (N, p): terms of the trend; ``data`` (N,).
    """
    size = len(data)
    covariance = matrix.copy()
    covariance.flat[:: size + 1] += nuggets
    factor, info = dpotrf(covariance.T, lower=1, overwrite_a=1, clean=1)
    if info != 0:
        return None
    whitened = solve_triangular(factor, np.column_stack([basis, data]), lower=True, check_finite=False)
    orthogonal, triangular = np.linalg.qr(whitened[:, :-1])
    projected = orthogonal.T @ whitened[:, -1]
    residual = whitened[:, -1] - orthogonal @ projected
    back = solve_triangular(factor, np.column_stack([residual, orthogonal]), lower=True, trans="T", check_finite=False)
    coefficients = solve_triangular(triangular, projected, check_finite=False)
    return LeastSquares(coefficients, back[:, 0], float(residual @ residual), back[:, 1:], triangular, factor)


@dataclass(frozen=True)
class Problem:
    """What the likelihood is of: covariance model, trend terms (N, p) and data (N,)."""

    covariance: Covariance
    basis: Array
    data: Array

    def solve(self, matrix: Array, nuggets: Any) -> LeastSquares | None:
        """``nuggets``: one for each kind of data."""
        return least_squares(matrix, np.repeat(nuggets, self.covariance.sizes), self.basis, self.data)


def negative_log_likelihood(logarithms: Array, problem: Problem) -> tuple[float, Array]:
    """Concentrated negative log-likelihood N/2 log(variance) + 1/2 log det K and its gradient.

    ``logarithms``: of theta (d,), then of the nuggets. Trend and variance are at their optimum, so that only the
    explicit dependence on K is left in the gradient: 1/2 tr(K^-1 dK) - w' dK w / (2 variance).
    """
    sizes = problem.covariance.sizes
    theta, nuggets = np.split(np.exp(logarithms), [-len(sizes)])
    matrix = problem.covariance.matrix(theta)
    solved = problem.solve(matrix, nuggets)
    if solved is None or solved.squares <= 0.0:
        return REJECTED, np.zeros_like(logarithms)
    inverse, weights, variance = solved.inverse(), solved.weights, solved.likely_variance
    value = 0.5 * len(weights) * np.log(variance) + 0.5 * solved.log_determinant()
    excess = np.diag(inverse) - weights**2 / variance
    slope_nuggets = nuggets * np.add.reduceat(excess, np.cumsum((0, *sizes[:-1])))
    inverse -= np.outer(weights / variance, weights)
    inverse *= 2.0
    inverse.flat[:: len(weights) + 1] = excess
    slope_theta = problem.covariance.slopes(theta, matrix, inverse)
    return float(value), 0.5 * np.append(slope_theta, slope_nuggets)


def _minimise(start: Array, problem: Problem) -> tuple[float, Array]:
    nuggets = len(problem.covariance.sizes)
    bounds = [tuple(np.log(THETA_BOUNDS))] * (len(start) - nuggets) + [tuple(np.log(NUGGET_BOUNDS))] * nuggets
    result = minimize(
        negative_log_likelihood,
        start,
        args=(problem,),
        jac=True,
        method="L-BFGS-B",
        bounds=bounds,
        options={"ftol": 1e-6, "gtol": 1e-2, "maxiter": 60, "maxfun": 100},
    )
    return float(result.fun), np.asarray(result.x)


def maximise(
    problem: Callable[[NDArray[np.intp]], Problem], points: int, dimensions: int, starts: Sequence[float]
) -> tuple[Array, Array]:
    """theta (d,) and nuggets of greatest likelihood: L-BFGS-B on the logarithms, from each theta of ``starts``.

    ``problem(rows)`` is the likelihood of some rows of the design of ``points`` rows. With more than ``SUBSET`` data
    the starts compete on evenly spaced rows, if these determine the trend, and the best is finished on all of them.
    ``dimensions``: d.
    """
    everything = problem(np.arange(points))
    rows = np.linspace(0, points - 1, max(1, points * min(len(everything.data), SUBSET) // len(everything.data)))
    some = problem(rows.round().astype(np.intp)) if len(rows) < points else everything
    if np.linalg.matrix_rank(some.basis) < some.basis.shape[1]:
        some = everything
    nuggets = len(everything.covariance.sizes)
    guesses = [np.log([start] * dimensions + [NUGGET_START] * nuggets) for start in starts]
    _, best = min((_minimise(guess, some) for guess in guesses), key=lambda item: item[0])
    if some is not everything:
        _, best = _minimise(best, everything)
    theta, fitted = np.split(np.exp(best), [-nuggets])
    return theta, fitted
