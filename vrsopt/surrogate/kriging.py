"""Universal Kriging as a scikit-learn estimator: quadratic trend, separable anisotropic correlation, fitted nugget."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted
from threadpoolctl import threadpool_limits

from vrsopt.errors import InputError
from vrsopt.surrogate.likelihood import (
    CORRELATIONS,
    Array,
    LeastSquares,
    least_squares,
    maximise,
    metric,
    metrics,
    trend,
)

BOX_TOLERANCE = 1e-9  # of an input's range: rounding, not extrapolation
BLOCK = 262_144  # correlations evaluated at a time: the work array stays in the cache


@dataclass(frozen=True)
class KrigingState:
    """Everything a fitted Kriging is made of; enough to predict, to validate and to save.

    ``inputs`` (n, d) in physical units; ``lower`` and ``upper`` (d,) scale them to [0, 1]; ``theta`` (d,) acts on the
    scaled inputs. ``coefficients`` (p,) of the quadratic trend (order: ``likelihood.trend``) and ``weights`` (n,) give
    the output divided by ``scale`` after ``mean`` is taken off. ``smoothing`` is eps of the smoothed exponential, or 0.
    """

    names: tuple[str, ...]
    correlation: str
    smoothing: float
    inputs: Array
    lower: Array
    upper: Array
    theta: Array
    nugget: float
    coefficients: Array
    weights: Array
    mean: float
    scale: float

    def scale_inputs(self, points: Array) -> Array:
        """``points`` (..., d) in physical units, scaled to [0, 1]."""
        return (points - self.lower) / (self.upper - self.lower)

    @cached_property
    def scaled(self) -> Array:
        """The sampled inputs scaled to [0, 1]: (n, d)."""
        return self.scale_inputs(self.inputs)

    @cached_property
    def _correlation(self) -> Array:
        distances = metrics(self.correlation, self.smoothing, self.scaled)
        return np.exp(-(self.theta @ distances)).reshape(len(self.inputs), len(self.inputs))

    def outputs(self) -> Array:
        """The outputs the model was fitted on (n,): the trend plus K times the weights returns them."""
        with threadpool_limits(limits=1, user_api="blas"):
            standard = trend(self.scaled) @ self.coefficients + self._correlation @ self.weights
        return self.mean + self.scale * (standard + self.nugget * self.weights)

    def predict(self, points: Array) -> Array:
        """Mean at ``points`` (k, d) in physical units: (k,); no check of the box."""
        result = np.empty(len(points))
        step = max(1, BLOCK // len(self.inputs))
        for begin in range(0, len(points), step):
            scaled = self.scale_inputs(points[begin : begin + step])
            exponent = sum(
                theta * metric(self.correlation, self.smoothing, column[:, None] - sampled)
                for theta, column, sampled in zip(self.theta, scaled.T, self.scaled.T, strict=True)
            )
            correlation = np.exp(-np.asarray(exponent))
            result[begin : begin + step] = trend(scaled) @ self.coefficients + correlation @ self.weights
        return self.mean + self.scale * result


class Kriging(RegressorMixin, BaseEstimator):
    """Universal Kriging with a full quadratic trend, fitted by maximum likelihood.

    ``correlation``: "squared_exponential" or "exponential" (kinked at every sample; see :meth:`smoothed`).
    ``names``: the inputs in the order of the columns; default x0, x1, ... ``lower``, ``upper`` (d,): the box that is
    scaled to [0, 1] and outside which a query is an error unless ``extrapolate``; default the range of the data.
    ``theta`` (d,) and ``nugget``: given, they are not fitted (both or neither).
    After :meth:`fit`, ``state_`` is the :class:`KrigingState`.
    """

    def __init__(
        self,
        correlation: str = "squared_exponential",
        *,
        names: Sequence[str] | None = None,
        lower: ArrayLike | None = None,
        upper: ArrayLike | None = None,
        extrapolate: bool = False,
        theta: ArrayLike | None = None,
        nugget: float | None = None,
    ) -> None:
        self.correlation = correlation
        self.names = names
        self.lower = lower
        self.upper = upper
        self.extrapolate = extrapolate
        self.theta = theta
        self.nugget = nugget

    @classmethod
    def from_state(cls, state: KrigingState, *, extrapolate: bool = False) -> Kriging:
        """A fitted estimator from a saved state."""
        model = cls(
            state.correlation,
            names=state.names,
            lower=state.lower,
            upper=state.upper,
            extrapolate=extrapolate,
            theta=state.theta,
            nugget=state.nugget,
        )
        model._set(state)
        return model

    def fit(self, X: ArrayLike, y: ArrayLike) -> Kriging:
        """Fit to ``X`` (n, d) in physical units and ``y`` (n,). BLAS is held to one thread while fitting.

        Raises :class:`InputError` for data that is not finite, has too few rows for the trend (more than
        (d + 1)(d + 2)/2 are needed), lies outside the given box, or does not vary.
        """
        inputs, output = _table(X), np.asarray(y, dtype=float)
        names, lower, upper = self._checked(inputs, output)
        mean, scale = float(np.mean(output)), float(np.std(output))
        if not scale > 1e-12 * abs(mean):
            raise InputError(f"kriging: y = {mean:g} in all {len(output)} rows: an output that varies")
        standard = (output - mean) / scale
        scaled = (inputs - lower) / (upper - lower)
        with threadpool_limits(limits=1, user_api="blas"):
            if self.theta is not None and self.nugget is not None:
                theta, nugget = np.array(self.theta, dtype=float), float(self.nugget)
            else:
                theta, nugget = maximise(self.correlation, scaled, standard)
            solved = _solve(self.correlation, 0.0, scaled, standard, theta, nugget)
        self._set(
            KrigingState(
                names,
                self.correlation,
                0.0,
                inputs,
                lower,
                upper,
                theta,
                nugget,
                solved.coefficients,
                solved.weights,
                mean,
                scale,
            )
        )
        return self

    def predict(self, X: ArrayLike) -> Array:
        """Mean of the output at ``X`` (k, d) in physical units: (k,).

        Raises :class:`InputError` for a point outside the box unless ``extrapolate`` is set.
        """
        check_is_fitted(self, "state_")
        points = _table(X)
        state = self.state_
        if points.shape[1] != len(state.names):
            raise InputError(f"kriging: {points.shape[1]} columns: expected {', '.join(state.names)}")
        if not self.extrapolate:
            check_box(state, points)
        return state.predict(points)

    def smoothed(self, eps: float = 0.1) -> Kriging:
        """The model with correlation exp(-theta (sqrt(d^2 + eps^2) - eps)), d in scaled inputs: twice differentiable.

        For use in NLPs. theta and nugget are kept; trend and weights are solved again, so that it still passes through
        the data as closely as the nugget lets it. Raises :class:`InputError` unless the correlation is exponential.
        """
        check_is_fitted(self, "state_")
        state = self.state_
        if state.correlation != "exponential":
            raise InputError(f"kriging: correlation = {state.correlation!r}: only 'exponential' needs smoothing")
        if not 0.0 < eps <= 1.0:
            raise InputError(f"kriging: eps = {eps}: between 0 (excluded) and 1")
        standard = (state.outputs() - state.mean) / state.scale
        with threadpool_limits(limits=1, user_api="blas"):
            solved = _solve(state.correlation, eps, state.scaled, standard, state.theta, state.nugget)
        fields = {name: getattr(state, name) for name in state.__dataclass_fields__}
        fields |= {"smoothing": float(eps), "coefficients": solved.coefficients, "weights": solved.weights}
        return Kriging.from_state(KrigingState(**fields), extrapolate=self.extrapolate)

    def leave_one_out(self) -> tuple[Array, Array]:
        """Outputs (n,) and their predictions (n,) by the model without the point in question, in physical units.

        Closed form with the trend estimated anew for each point; theta and nugget are kept.
        """
        check_is_fitted(self, "state_")
        state = self.state_
        outputs = state.outputs()
        standard = (outputs - state.mean) / state.scale
        with threadpool_limits(limits=1, user_api="blas"):
            solved = _solve(state.correlation, state.smoothing, state.scaled, standard, state.theta, state.nugget)
            errors = solved.leave_one_out()
        return outputs, outputs - state.scale * errors

    def _set(self, state: KrigingState) -> None:
        self.state_ = state
        self.n_features_in_ = len(state.names)

    def _checked(self, inputs: Array, output: Array) -> tuple[tuple[str, ...], Array, Array]:
        """Names and box for the data; raises :class:`InputError` for whatever can not be fitted."""
        size, dimensions = inputs.shape
        names = tuple(self.names) if self.names is not None else tuple(f"x{k}" for k in range(dimensions))
        if self.correlation not in CORRELATIONS:
            raise InputError(f"kriging: correlation = {self.correlation!r}: one of {', '.join(CORRELATIONS)}")
        if len(names) != dimensions or len(set(names)) != dimensions:
            raise InputError(f"kriging: names = {', '.join(names)}: {dimensions} different names")
        if output.shape != (size,):
            raise InputError(f"kriging: y has shape {output.shape}: expected ({size},)")
        if not np.all(np.isfinite(output)):
            raise InputError(f"kriging: y[{int(np.argmin(np.isfinite(output)))}] is not a finite number")
        needed = (dimensions + 1) * (dimensions + 2) // 2 + 1
        if size < needed:
            raise InputError(f"kriging: {size} rows: at least {needed} for a quadratic trend in {dimensions} inputs")
        lower = np.min(inputs, axis=0) if self.lower is None else np.array(self.lower, dtype=float)
        upper = np.max(inputs, axis=0) if self.upper is None else np.array(self.upper, dtype=float)
        if lower.shape != (dimensions,) or upper.shape != (dimensions,) or not np.all(lower < upper):
            raise InputError(f"kriging: lower = {lower}, upper = {upper}: {dimensions} numbers each, lower < upper")
        if (self.theta is None) != (self.nugget is None):
            raise InputError("kriging: theta, nugget: give both or neither")
        if self.theta is not None:
            theta = np.asarray(self.theta, dtype=float)
            if theta.shape != (dimensions,) or not np.all(theta > 0.0) or not float(self.nugget or 0.0) >= 0.0:
                raise InputError(f"kriging: theta = {theta}: {dimensions} positive numbers, and nugget >= 0")
        check_bounds(names, lower, upper, inputs)
        return names, lower, upper


def check_box(state: KrigingState, points: Array) -> None:
    """Raise :class:`InputError` for the first of ``points`` (..., d) outside the sampled box."""
    check_bounds(state.names, state.lower, state.upper, points)


def check_bounds(names: Sequence[str], lower: Array, upper: Array, points: Array) -> None:
    """Raise :class:`InputError` for the first of ``points`` (..., d) outside [lower, upper], or not a number."""
    margin = BOX_TOLERANCE * (upper - lower)
    inside = (points >= lower - margin) & (points <= upper + margin)
    if not np.all(inside):
        position = np.unravel_index(int(np.argmin(inside)), inside.shape)
        k = int(position[-1])
        raise InputError(
            f"kriging: {names[k]} = {points[position]:g}: outside the sampled box {lower[k]:g} to {upper[k]:g}"
        )


def _table(X: ArrayLike | Any) -> Array:
    """``X`` as a finite array (n, d) that nobody else changes."""
    table = np.array(X, dtype=float)
    if table.ndim != 2:
        raise InputError(f"kriging: X has {table.ndim} dimensions: expected (rows, inputs)")
    if not np.all(np.isfinite(table)):
        row, column = np.unravel_index(int(np.argmin(np.isfinite(table))), table.shape)
        raise InputError(f"kriging: X[{row}, {column}] is not a finite number")
    return table


def _solve(
    correlation: str, smoothing: float, scaled: Array, output: Array, theta: Array, nugget: float
) -> LeastSquares:
    matrix = np.exp(-(theta @ metrics(correlation, smoothing, scaled))).reshape(len(output), len(output))
    solved = least_squares(matrix, nugget, trend(scaled), output)
    if solved is None:
        raise InputError(
            f"kriging: nugget = {nugget:g}: the correlation matrix is not positive definite; repeated rows need a "
            "larger nugget"
        )
    return solved
