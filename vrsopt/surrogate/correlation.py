"""One-dimensional correlations, of which the correlation of a Kriging is the product over its inputs.

r(d) of the signed distance d between two scaled inputs, with theta > 0 (an inverse length or its square):

* "exponential":         exp(-theta |d|), kinked at d = 0; smoothed: exp(-theta (sqrt(d^2 + eps^2) - eps));
* "squared_exponential": exp(-theta d^2);
* "matern52":            (1 + s + s^2/3) exp(-s), s = sqrt(5) theta |d|.

Each is P(s) exp(-s) with s = theta m(d): the metric m and the polynomial P are all that differ. The first two are those
of Sacks, Welch, Mitchell and Wynn (1989), Design and Analysis of Computer Experiments; the last is Matern's, product
form. Derivatives by d are given as ratios to r, which stay finite where r underflows. ``correlation`` is the name,
``smoothing`` is eps (0: none), ``theta`` (d,), ``difference`` signed distances d.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CORRELATIONS = ("squared_exponential", "matern52", "exponential")
DIFFERENTIABLE = ("squared_exponential", "matern52")  # often enough for a process whose gradients are observed
BLOCK = 65_536  # elements worked on at a time: the work arrays stay in the cache
ROOT_FIVE = 5.0**0.5


def metric(correlation: str, smoothing: float, difference: Any) -> Any:
    """m(d) of signed distances, of any shape: d^2, |d|, sqrt(d^2 + eps^2) - eps, or sqrt(5) |d|."""
    if correlation == "squared_exponential":
        return difference * difference
    if correlation == "matern52":
        return ROOT_FIVE * abs(difference)
    if smoothing > 0.0:
        return (difference * difference + smoothing**2) ** 0.5 - smoothing
    return abs(difference)


def correlate(correlation: str, smoothing: float, theta: Array, difference: Array) -> Array:
    """Product of the factors over the inputs: ``theta`` (d,), ``difference`` (m, d, n), result (m, n)."""
    distance = metric(correlation, smoothing, difference)
    result = np.exp(-np.matmul(theta, distance))
    if correlation == "matern52":
        s = theta[:, None] * distance
        result *= np.prod(1.0 + s * (1.0 + s / 3.0), axis=-2)
    return np.asarray(result)


def ratios(correlation: str, smoothing: float, theta: Any, difference: Array, order: int) -> tuple[Array, ...]:
    """r'/r, r''/r and r'''/r, as many as ``order`` asks for; derivatives by the signed distance.

    ``theta`` broadcasts to ``difference``. At the kink of the exponential the slope is taken as zero.
    """
    if correlation == "matern52":
        return _matern_ratios(ROOT_FIVE * np.asarray(theta), difference)[:order]
    first, second, third = _metric_derivatives(correlation, smoothing, difference)
    slope = -theta * first
    result: tuple[Array, ...] = (slope,)
    if order > 1:
        curvature = -theta * second
        result += (slope**2 + curvature,)
    if order > 2:
        result += (slope**3 + 3.0 * slope * curvature - theta * third,)
    return result


def _metric_derivatives(correlation: str, smoothing: float, d: Array) -> tuple[Any, Any, Any]:
    if correlation == "squared_exponential":
        return 2.0 * d, 2.0, 0.0
    if smoothing == 0.0:
        return np.sign(d), 0.0, 0.0
    root = np.sqrt(d * d + smoothing**2)
    return d / root, smoothing**2 / root**3, -3.0 * smoothing**2 * d / root**5


def _matern_ratios(rate: Any, d: Array) -> tuple[Array, ...]:
    s = rate * np.abs(d)
    shared = rate**2 / (3.0 + s * (3.0 + s))
    return -shared * d * (1.0 + s), -shared * (1.0 + s - s * s), shared * rate**2 * d * (3.0 - s)


def factor(correlation: str, smoothing: float, theta: float, difference: Array, order: int = 0) -> Array:
    """r of signed distances of any shape, differentiated ``order`` (0 to 3) times by the distance."""
    s = theta * metric(correlation, smoothing, difference)
    result = np.exp(-s)
    if correlation == "matern52":
        result *= 1.0 + s * (1.0 + s / 3.0)
    if order > 0:
        result *= ratios(correlation, smoothing, theta, difference, order)[-1]
    return np.asarray(result)


def log_theta_ratio(correlation: str, theta: Any, difference: Array) -> Array:
    """Derivative of r by log theta, divided by r, without smoothing. ``theta`` broadcasts to ``difference``."""
    s = theta * metric(correlation, 0.0, difference)
    if correlation == "matern52":
        return np.asarray(-s * s * (1.0 + s) / (3.0 + s * (3.0 + s)))
    return np.asarray(-s)


def log_theta_ratios(correlation: str, theta: Any, difference: Array) -> tuple[Array, Array, Array]:
    """Derivatives of r, r' and r'' by log theta, each divided by r; only for the ``DIFFERENTIABLE`` ones.

    r depends on theta^h d alone, h = 1/2 (squared exponential) or 1, so that
    theta d/dtheta r^(m) = h (m r^(m) + d r^(m+1)).
    """
    h = 0.5 if correlation == "squared_exponential" else 1.0
    first, second, third = ratios(correlation, 0.0, theta, difference, 3)
    return h * difference * first, h * (first + difference * second), h * (2.0 * second + difference * third)


def upper_blocks(scaled: Array) -> Iterator[tuple[slice, slice, Array]]:
    """Rows, columns and differences (rows, d, columns) of the upper triangle of a matrix over ``scaled`` (n, d)."""
    size, dimensions = scaled.shape
    step = max(1, BLOCK // (size * dimensions))
    columns = np.ascontiguousarray(scaled.T)
    for begin in range(0, size, step):
        rows = slice(begin, min(begin + step, size))
        yield rows, slice(begin, size), scaled[rows, :, None] - columns[None, :, begin:]


def correlation_matrix(correlation: str, smoothing: float, theta: Array, scaled: Array) -> Array:
    """Correlations of all pairs of ``scaled`` (n, d): (n, n), of which only the upper triangle is filled."""
    result = np.zeros((len(scaled), len(scaled)))
    for rows, columns, difference in upper_blocks(scaled):
        result[rows, columns] = correlate(correlation, smoothing, theta, difference)
    return result


def separable(
    correlation: str,
    smoothing: float,
    theta: Array,
    difference: Array,
    weights: Array,
    gradient_weights: Array | None,
    order: int,
) -> tuple[Array, ...]:
    """sum_i w_i k(d_i) - sum_ij v_ij k_j(d_i) (m,), its gradient (m, d), Hessian (m, d, d), up to ``order`` (0 to 2).

    ``difference`` (m, d, n) of scaled inputs from n samples; weights w (n,) or (m, n), and v (d, n), (m, d, n) or None.
    With p = r'/r, q = r''/r of each factor: k_a = k p_a, k_ab = k p_a p_b, k_aa = k q_a, and so on.
    ``gradient_weights`` are v.
    """
    value = correlate(correlation, smoothing, theta, difference)
    if order == 0 and gradient_weights is None:
        return (value @ weights if weights.ndim == 1 else np.sum(value * weights, axis=1),)
    needed = order if gradient_weights is None else order + 1
    first, *higher = ratios(correlation, smoothing, theta[:, None], difference, needed)
    weighted = value * weights
    if gradient_weights is not None:
        slopes = value[:, None] * gradient_weights
        weighted = weighted - np.sum(slopes * first, axis=1)
    result: tuple[Array, ...] = (np.sum(weighted, axis=1),)
    if order == 0:
        return result
    tilted = weighted[:, None] * first
    if gradient_weights is None:
        result += (np.sum(tilted, axis=2),)
    else:
        # The sum over all inputs has p_a^2 where the derivative by input a has q_a.
        extra = slopes * (first**2 - higher[0])
        result += (np.sum(tilted + extra, axis=2),)
    if order > 1:
        across = np.swapaxes(first, 1, 2)
        hessian = tilted @ across
        second = weighted[:, None] * higher[0]
        if gradient_weights is not None:
            mixed = extra @ across
            hessian += mixed + np.swapaxes(mixed, 1, 2)
            second += slopes * (first * higher[0] - higher[1])
        diagonal = np.arange(len(theta))
        hessian[:, diagonal, diagonal] = np.sum(second, axis=2)
        result += (hessian,)
    return result
