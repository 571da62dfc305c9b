"""The algebra of universal Kriging: correlation, quadratic trend, generalised least squares, concentrated likelihood.

Everything here works on inputs scaled to [0, 1] and on a standardised output. The correlation is a product over the
inputs, R(u, v) = prod_k exp(-theta_k m(u_k - v_k)), with the metric m of the correlation; the covariance of the data is
proportional to K = R + nugget I. Equations: Sacks, Welch, Mitchell and Wynn (1989), eqs. 4-7; leave-one-out with trend:
Dubrule (1983).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dpotrf, dpotri
from scipy.optimize import minimize

Array = NDArray[np.float64]

CORRELATIONS = ("squared_exponential", "exponential")
THETA_START, THETA_BOUNDS = 2.5, (1e-3, 50.0)
NUGGET_START, NUGGET_BOUNDS = 1e-5, (1e-12, 1e-1)
STARTS = (1.0, 4.0)  # factors on THETA_START: smaller starts run into the ill-conditioned corner of the likelihood
SUBSET = 500  # rows on which the starts compete before the best one is finished on all rows
REJECTED = 1e10  # value of the likelihood where K is not positive definite


def metric(correlation: str, smoothing: float, difference: Any) -> Any:
    """m(d) in the one-dimensional correlation exp(-theta m(d)); numpy arrays or CasADi expressions.

    d^2 (squared exponential), |d| (exponential) or sqrt(d^2 + eps^2) - eps (exponential with ``smoothing`` eps > 0).
    """
    if correlation == "squared_exponential":
        return difference * difference
    if smoothing > 0.0:
        return (difference * difference + smoothing**2) ** 0.5 - smoothing
    return abs(difference)


def metrics(correlation: str, smoothing: float, scaled: Array) -> Array:
    """The metric between all pairs of rows of ``scaled`` (n, d), for each input: (d, n * n)."""
    difference = scaled.T[:, :, None] - scaled.T[:, None, :]
    return np.asarray(metric(correlation, smoothing, difference)).reshape(scaled.shape[1], -1)


def trend_pairs(dimensions: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pairs (i, j), i <= j, into (1, u_1, ..., u_d): the trend's terms are their products (1, then u, then squares)."""
    return np.triu_indices(dimensions + 1)


def trend(scaled: Array) -> Array:
    """Full quadratic trend at ``scaled`` (n, d): (n, (d + 1)(d + 2)/2), in the order of :func:`trend_pairs`."""
    first, second = trend_pairs(scaled.shape[1])
    extended = np.concatenate([np.ones((len(scaled), 1)), scaled], axis=1)
    return extended[:, first] * extended[:, second]


@dataclass(frozen=True)
class LeastSquares:
    """Generalised least squares with covariance K = L L': trend coefficients (p,), weights K^-1 (y - F beta) (n,),
    process variance, L^-T Q (n, p) with the thin QR of L^-1 F, and L as LAPACK leaves it (n, n)."""

    coefficients: Array
    weights: Array
    variance: float
    projection: Array
    factor: Array

    def inverse(self) -> Array:
        """K^-1: upper triangle and diagonal; zeros below (n, n)."""
        inverse, _ = dpotri(self.factor, lower=1)
        return np.asarray(inverse).T

    def log_determinant(self) -> float:
        return 2.0 * float(np.sum(np.log(np.diag(self.factor))))

    def leave_one_out(self) -> Array:
        """Errors e_i = [Q y]_i / Q_ii (n,), Q = K^-1 - K^-1 F (F' K^-1 F)^-1 F' K^-1: data minus prediction without it.

        Q y equals the weights; the trend is estimated anew without each point, the correlation is kept.
        """
        return self.weights / (np.diag(self.inverse()) - np.sum(self.projection**2, axis=1))


def least_squares(correlation: Array, nugget: float, basis: Array, output: Array) -> LeastSquares | None:
    """Solve for the trend and the weights; None where ``correlation`` (n, n) + nugget I is not positive definite."""
    size = len(output)
    covariance = correlation.copy()
    covariance.flat[:: size + 1] += nugget
    factor, info = dpotrf(covariance.T, lower=1, overwrite_a=1, clean=1)
    if info != 0:
        return None
    whitened = solve_triangular(factor, np.column_stack([basis, output]), lower=True, check_finite=False)
    orthogonal, triangular = np.linalg.qr(whitened[:, :-1])
    projected = orthogonal.T @ whitened[:, -1]
    residual = whitened[:, -1] - orthogonal @ projected
    back = solve_triangular(factor, np.column_stack([residual, orthogonal]), lower=True, trans="T", check_finite=False)
    coefficients = solve_triangular(triangular, projected, check_finite=False)
    variance = float(residual @ residual) / size
    return LeastSquares(coefficients, back[:, 0], variance, back[:, 1:], factor)


def negative_log_likelihood(logarithms: Array, distances: Array, basis: Array, output: Array) -> tuple[float, Array]:
    """Concentrated negative log-likelihood n/2 log(variance) + 1/2 log det K and its gradient.

    ``logarithms`` (d + 1,): log theta, then log nugget; ``distances`` (d, n * n) from :func:`metrics`. Trend and
    variance are at their optimum, so that only the explicit dependence on K is left in the gradient:
    1/2 tr(K^-1 dK) - w' dK w / (2 variance).
    """
    parameters = np.exp(logarithms)
    theta, nugget = parameters[:-1], float(parameters[-1])
    size = len(output)
    correlation = np.exp(-(theta @ distances)).reshape(size, size)
    solved = least_squares(correlation, nugget, basis, output)
    if solved is None or solved.variance <= 0.0:
        return REJECTED, np.zeros_like(logarithms)
    inverse, weights = solved.inverse(), solved.weights
    slope_nugget = 0.5 * nugget * (np.trace(inverse) - weights @ weights / solved.variance)
    # The upper triangle stands for both; the metrics are zero on the diagonal.
    inverse *= 2.0
    inverse -= np.outer(weights / solved.variance, weights)
    inverse *= correlation
    slope_theta = -0.5 * theta * (distances @ inverse.ravel())
    value = 0.5 * size * np.log(solved.variance) + 0.5 * solved.log_determinant()
    return float(value), np.append(slope_theta, slope_nugget)


def _minimise(start: Array, distances: Array, basis: Array, output: Array) -> tuple[float, Array]:
    bounds = [tuple(np.log(THETA_BOUNDS))] * (len(start) - 1) + [tuple(np.log(NUGGET_BOUNDS))]
    result = minimize(
        negative_log_likelihood,
        start,
        args=(distances, basis, output),
        jac=True,
        method="L-BFGS-B",
        bounds=bounds,
        options={"ftol": 1e-6, "gtol": 1e-2, "maxiter": 60, "maxfun": 100},
    )
    return float(result.fun), np.asarray(result.x)


def maximise(correlation: str, scaled: Array, output: Array) -> tuple[Array, float]:
    """theta (d,) and nugget of greatest likelihood (L-BFGS-B on the logarithms, two starts).

    With more than ``SUBSET`` rows the starts compete on evenly spaced rows and the best is finished on all of them.
    """
    rows = np.linspace(0, len(output) - 1, min(len(output), SUBSET)).round().astype(int)
    subset = (metrics(correlation, 0.0, scaled[rows]), trend(scaled[rows]), output[rows])
    starts = [np.log(np.append(np.full(scaled.shape[1], THETA_START * factor), NUGGET_START)) for factor in STARTS]
    _, best = min((_minimise(start, *subset) for start in starts), key=lambda item: item[0])
    if len(rows) < len(output):
        _, best = _minimise(best, metrics(correlation, 0.0, scaled), trend(scaled), output)
    return np.exp(best[:-1]), float(np.exp(best[-1]))
