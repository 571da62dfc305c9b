"""Kriging in optimal control: as a CasADi function, and reduced to the free variables along a path.

Both the correlation and the terms of the quadratic trend are products over the inputs, so that the mean is
sum_q w_q prod_k g_kq(x_k) with one factor per sample and per trend term. Along a path on which some inputs are given,
their factors fold into the weights; what is left is a function of the free inputs alone.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from vrsopt.errors import InputError
from vrsopt.surrogate import chebyshev
from vrsopt.surrogate.kriging import BLOCK, Array, Kriging, KrigingState, check_bounds
from vrsopt.surrogate.likelihood import metric, trend_pairs

FREE = ("mass", "rotor_speed", "twist")
SMOOTHING = 0.1  # eps of the exponential correlation in an NLP

logger = logging.getLogger(__name__)


def to_casadi(kriging: Kriging) -> ca.Function:
    """The mean of one point as CasADi Function ``mean(x) -> y``, x (d,) in physical units in the order of ``names``.

    Exact, with exact first and second derivatives by CasADi (MX over the n samples). An exponential correlation is
    replaced by its smoothed variant (eps 0.1, weights solved again), which is logged. The box is not checked: bound the
    variables of the NLP.
    """
    state = _smooth_state(kriging)
    x = ca.MX.sym("x", len(state.names))
    scaled = (x - ca.DM(state.lower)) / ca.DM(state.upper - state.lower)
    exponent = ca.MX.zeros(len(state.inputs), 1)
    for k, theta in enumerate(state.theta):
        difference = scaled[k] - ca.DM(state.scaled[:, k])
        exponent += float(theta) * metric(state.correlation, state.smoothing, difference)
    extended = ca.vertcat(1.0, scaled)
    first, second = (pairs.tolist() for pairs in trend_pairs(len(state.names)))
    trend = ca.dot(ca.DM(state.coefficients), extended[first] * extended[second])
    mean = trend + ca.dot(ca.DM(state.weights), ca.exp(-exponent))
    return ca.Function("mean", [x], [state.mean + state.scale * mean], ["x"], ["y"])


def path_coefficients(
    kriging: Kriging,
    fixed: Mapping[str, ArrayLike],
    free_lower: ArrayLike,
    free_upper: ArrayLike,
    degrees: Sequence[int],
    *,
    free: Sequence[str] = FREE,
) -> Array:
    """Chebyshev coefficients of the mean in the ``free`` variables at N points of the ``fixed`` ones.

    ``fixed``: (N,) each, by name; ``free_lower``, ``free_upper``, ``degrees``: one per free variable. Result
    (N, d1 + 1, d2 + 1, ...), in the order of ``free``, for ``chebyshev.expression`` and ``chebyshev.evaluate``.
    One matrix product over samples and trend terms. An exponential correlation is smoothed as in :func:`to_casadi`.
    Raises :class:`InputError` for an input that is missing, named twice or outside the box.
    """
    state = _smooth_state(kriging)
    lower, upper = np.asarray(free_lower, dtype=float), np.asarray(free_upper, dtype=float)
    if not len(free) == len(degrees) == lower.size == upper.size:
        raise InputError(f"path: {len(degrees)} degrees, {lower.size} and {upper.size} bounds: {len(free)} of each")
    _check_free(kriging, free, np.stack([lower, upper]))
    left = _path_weights(kriging, state, fixed, free)
    right = np.ones((left.shape[1], 1))
    for k, name in enumerate(free):
        values = _factors(state, name, chebyshev.nodes(lower[k], upper[k], degrees[k]))
        series = chebyshev.coefficients(values.T, 1)
        right = (right[:, :, None] * series[:, None, :]).reshape(len(right), -1)
    with threadpool_limits(limits=1, user_api="blas"):
        result = state.scale * (left @ right)
    result[:, 0] += state.mean
    return result.reshape(len(left), *(degree + 1 for degree in degrees))


def path_predict(
    kriging: Kriging, fixed: Mapping[str, ArrayLike], free_values: Array, *, free: Sequence[str] = FREE
) -> Array:
    """Exact mean for k candidates at each of N points of the ``fixed`` variables.

    ``fixed``: (N,) each, by name; ``free_values`` (N, k, number of free) in the order of ``free``. Result (N, k).
    The correlation is that of ``kriging``: an exponential one is not smoothed. Raises as :func:`path_coefficients`.
    """
    state = kriging.state_
    candidates = np.asarray(free_values, dtype=float)
    left = _path_weights(kriging, state, fixed, free)
    if candidates.ndim != 3 or candidates.shape[::2] != (len(left), len(free)):
        raise InputError(f"path: free values {candidates.shape}: expected ({len(left)}, k, {len(free)})")
    _check_free(kriging, free, candidates)
    columns = [state.names.index(name) for name in free]
    samples = len(state.inputs)
    bounds = state.lower[columns], state.upper[columns]
    scaled = (candidates - bounds[0]) / (bounds[1] - bounds[0])
    result = np.empty(candidates.shape[:2])
    step = max(1, BLOCK // samples)
    for n in range(len(left)):
        for begin in range(0, candidates.shape[1], step):
            block = scaled[n, begin : begin + step]
            exponent = np.zeros((len(block), samples))
            terms = np.ones((len(block), left.shape[1] - samples))
            for k, column in enumerate(columns):
                difference = block[:, k, None] - state.scaled[:, column]
                exponent -= state.theta[column] * metric(state.correlation, state.smoothing, difference)
                terms *= _trend_factors(state, column, block[:, k])
            result[n, begin : begin + step] = np.exp(exponent) @ left[n, :samples] + terms @ left[n, samples:]
    return state.mean + state.scale * result


def _smooth_state(kriging: Kriging) -> KrigingState:
    state: KrigingState = kriging.state_
    if state.correlation == "exponential" and state.smoothing == 0.0:
        logger.warning("exponential correlation has kinks: smoothed with eps = %g for the NLP", SMOOTHING)
        state = kriging.smoothed(SMOOTHING).state_
    return state


def _trend_factors(state: KrigingState, column: int, scaled: Array) -> Array:
    """Powers of one scaled input (m,) in the trend terms: (m, p)."""
    powers = sum((pairs == column + 1).astype(int) for pairs in trend_pairs(len(state.names)))
    return np.stack([np.ones_like(scaled), scaled, scaled**2], axis=-1)[:, powers]


def _factors(state: KrigingState, name: str, points: Array) -> Array:
    """The factor of input ``name`` at ``points`` (m,) in all samples and trend terms: (m, n + p)."""
    column = state.names.index(name)
    scaled = (points - state.lower[column]) / (state.upper[column] - state.lower[column])
    distance = metric(state.correlation, state.smoothing, scaled[:, None] - state.scaled[:, column])
    return np.concatenate([np.exp(-state.theta[column] * distance), _trend_factors(state, column, scaled)], axis=1)


def _path_weights(kriging: Kriging, state: KrigingState, fixed: Mapping[str, ArrayLike], free: Sequence[str]) -> Array:
    """Weights and trend coefficients times the factors of the fixed inputs: (N, n + p)."""
    if sorted([*fixed, *free]) != sorted(state.names):
        raise InputError(
            f"path: fixed {', '.join(fixed)} and free {', '.join(free)}: each of {', '.join(state.names)} once"
        )
    points = {name: np.asarray(values, dtype=float) for name, values in fixed.items()}
    shapes = {values.shape for values in points.values()}
    if len(shapes) != 1 or len(next(iter(shapes))) != 1:
        raise InputError(f"path: fixed values have shapes {sorted(shapes)}: one shape (N,)")
    left = np.concatenate([state.weights, state.coefficients])[None, :]
    for name, values in points.items():
        if not kriging.extrapolate:
            column = [state.names.index(name)]
            check_bounds([name], state.lower[column], state.upper[column], values[:, None])
        left = left * _factors(state, name, values)
    return left


def _check_free(kriging: Kriging, free: Sequence[str], points: Array) -> None:
    state: KrigingState = kriging.state_
    unknown = [name for name in free if name not in state.names]
    if unknown:
        raise InputError(f"path: free = {unknown[0]!r}: one of {', '.join(state.names)}")
    if not kriging.extrapolate:
        columns = [state.names.index(name) for name in free]
        check_bounds(free, state.lower[columns], state.upper[columns], points)
