"""Kriging as a scikit-learn estimator: universal, fitted nugget, gradient-enhanced where gradients are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted
from threadpoolctl import threadpool_limits

from vrsopt.errors import InputError
from vrsopt.surrogate import trend as trends
from vrsopt.surrogate.checks import (
    check_bounds,
    check_box,
    check_columns,
    check_rows,
    check_size,
    column,
    column_names,
    one_of,
    table,
)
from vrsopt.surrogate.correlation import BLOCK, CORRELATIONS, DIFFERENTIABLE, Array
from vrsopt.surrogate.likelihood import THETA_BOUNDS, THETA_STARTS, maximise
from vrsopt.surrogate.posterior import Posterior
from vrsopt.surrogate.state import NOT_DEFINITE, KrigingState, factors, fit_problem, terms

__all__ = ["BLOCK", "Array", "Kriging", "KrigingState", "check_bounds", "check_box", "factors", "terms"]


class Kriging(RegressorMixin, BaseEstimator):
    """Universal Kriging fitted by maximum likelihood, with or without gradients.

    ``correlation``: "squared_exponential", "matern52" or "exponential" (kinked at every sample; see :meth:`smoothed`).
    ``trend``: "constant", "linear" or "quadratic" in the inputs.
    ``names``: the inputs in the order of the columns; default those of a data frame, or x0, x1, ... ``lower``,
    ``upper`` (d,): the box that is scaled to [0, 1] and outside which a query is an error unless ``extrapolate``;
    default the range of the data.
    ``theta`` (d,), ``nugget`` and, with gradients, ``gradient_nugget``: given, they are not fitted (all or none).
    ``starts``: values of theta, the same for all inputs, from which the likelihood is climbed; the best is kept.
    After :meth:`fit`, ``state_`` is the :class:`KrigingState`.
    """

    def __init__(
        self,
        correlation: str = "squared_exponential",
        *,
        trend: str = "quadratic",
        names: Sequence[str] | None = None,
        lower: ArrayLike | None = None,
        upper: ArrayLike | None = None,
        extrapolate: bool = False,
        theta: ArrayLike | None = None,
        nugget: float | None = None,
        gradient_nugget: float | None = None,
        starts: Sequence[float] = THETA_STARTS,
    ) -> None:
        self.correlation = correlation
        self.trend = trend
        self.names = names
        self.lower = lower
        self.upper = upper
        self.extrapolate = extrapolate
        self.theta = theta
        self.nugget = nugget
        self.gradient_nugget = gradient_nugget
        self.starts = starts

    @classmethod
    def from_state(cls, state: KrigingState, *, extrapolate: bool = False) -> Kriging:
        """A fitted estimator from a saved state."""
        model = cls(
            state.correlation,
            trend=state.trend,
            names=state.names,
            lower=state.lower,
            upper=state.upper,
            extrapolate=extrapolate,
            theta=state.theta,
            nugget=state.nugget,
            gradient_nugget=state.gradient_nugget if state.enhanced else None,
        )
        model._set(state)
        return model

    def fit(self, X: ArrayLike, y: ArrayLike, gradients: ArrayLike | None = None) -> Kriging:
        """Fit to ``X`` (n, d) in physical units, ``y`` (n,) and, if given, ``gradients`` (n, d) of y by the inputs.

        BLAS is held to one thread while fitting. With gradients the system has n (1 + d) rows. Raises
        :class:`InputError` for data that is not finite (rows without a gradient are to be left out), does not
        determine the trend, lies outside the given box or does not vary, and for gradients with a correlation that is
        not differentiable often enough.
        """
        inputs, output, columns = table("X", X), column(y), column_names(X)
        slopes = None if gradients is None else table("gradients", gradients)
        names, lower, upper = self._checked(inputs, output, slopes, columns)
        mean, scale = float(np.mean(output)), float(np.std(output))
        if not scale > 1e-12 * abs(mean):
            raise InputError(f"kriging: y = {mean:g} in all {len(output)} rows: an output that varies")
        scaled = (inputs - lower) / (upper - lower)
        if slopes is not None:
            slopes = slopes * (upper - lower) / scale

        def problem(rows: Any) -> Any:
            some = None if slopes is None else slopes[rows]
            return fit_problem(self.correlation, 0.0, self.trend, scaled[rows], (output[rows] - mean) / scale, some)

        with threadpool_limits(limits=1, user_api="blas"):
            if self.theta is None:
                theta, nuggets = maximise(problem, len(scaled), len(names), self.starts)
            else:
                theta, nuggets = np.array(self.theta, dtype=float), self._given_nuggets(slopes is not None)
            everything = problem(slice(None))
            solved = everything.solve(everything.covariance.matrix(theta), nuggets)
            if solved is None:
                raise InputError(f"kriging: nugget = {nuggets[0]:g}: {NOT_DEFINITE}")
            variance = solved.variance(len(inputs))
        size, dimensions = inputs.shape
        gradient_weights = solved.weights[size:].reshape(dimensions, -1).T
        self._set(
            KrigingState(
                names=names,
                correlation=self.correlation,
                smoothing=0.0,
                inputs=inputs,
                lower=lower,
                upper=upper,
                theta=theta,
                nugget=float(nuggets[0]),
                coefficients=solved.coefficients,
                weights=solved.weights[:size],
                mean=mean,
                scale=scale,
                trend=self.trend,
                gradient_nugget=0.0 if slopes is None else float(nuggets[1]),
                gradient_weights=gradient_weights,
                variance=variance,
            ),
            columns,
        )
        return self

    def predict(self, X: ArrayLike, return_std: bool = False) -> Any:
        """Mean (k,) of the output at ``X`` (k, d) in physical units; with ``return_std`` also its deviation (k,).

        The deviation is that of :meth:`standard_deviation`. Raises :class:`InputError` for a point outside the box
        unless ``extrapolate`` is set.
        """
        state, points = self._query(X)
        mean = state.predict(points)
        return (mean, np.sqrt(self.posterior.variance(points))) if return_std else mean

    def gradient(self, X: ArrayLike) -> Array:
        """Derivatives of the mean by the inputs at ``X`` (k, d): (k, d). Raises as :meth:`predict`."""
        state, points = self._query(X)
        return state.derivatives(points, 1)[1]

    def hessian(self, X: ArrayLike) -> Array:
        """Second derivatives of the mean at ``X`` (k, d): (k, d, d). Raises as :meth:`predict`."""
        state, points = self._query(X)
        return state.derivatives(points, 2)[2]

    def standard_deviation(self, X: ArrayLike) -> Array:
        """Deviation (k,) of the noise-free output from the mean at ``X`` (k, d), with the trend's uncertainty.

        theta and the nuggets count as known, the process variance is that of the leave-one-out errors. The nugget, the
        variance of an error in the data, is not part of it: add ``state_.output_error`` in squares to compare with
        computed outputs. Raises as :meth:`predict`.
        """
        _, points = self._query(X)
        return np.sqrt(self.posterior.variance(points))

    @property
    def posterior(self) -> Posterior:
        """Predicted variance and covariances; what they rest on is computed once, when first needed."""
        check_is_fitted(self, "state_")
        return self._posterior

    def smoothed(self, eps: float = 0.1) -> Kriging:
        """The model with correlation exp(-theta (sqrt(d^2 + eps^2) - eps)), d in scaled inputs: twice differentiable.

        For use in NLPs. theta and nugget are kept; trend and weights are solved again, so that it still passes through
        the data as closely as the nugget lets it. Raises :class:`InputError` unless the correlation is exponential.
        """
        check_is_fitted(self, "state_")
        state: KrigingState = self.state_
        if state.correlation != "exponential":
            raise InputError(f"kriging: correlation = {state.correlation!r}: only 'exponential' needs smoothing")
        if not 0.0 < eps <= 1.0:
            raise InputError(f"kriging: eps = {eps}: between 0 (excluded) and 1")
        data = state.problem.data
        problem = fit_problem(state.correlation, eps, state.trend, state.scaled, data, None)
        with threadpool_limits(limits=1, user_api="blas"):
            solved = problem.solve(problem.covariance.matrix(state.theta), (state.nugget,))
            if solved is None:
                raise InputError(f"kriging: nugget = {state.nugget:g}: {NOT_DEFINITE}")
            variance = solved.variance(len(data))
        changed = replace(
            state,
            smoothing=float(eps),
            coefficients=solved.coefficients,
            weights=solved.weights,
            variance=variance,
        )
        return Kriging.from_state(changed, extrapolate=self.extrapolate)

    def leave_one_out(self, return_std: bool = False) -> tuple[Array, ...]:
        """Outputs (n,) and their predictions (n,) by the model without the point in question, in physical units.

        A point is left out with its gradient. Closed form with the trend estimated anew for each point; theta, the
        nuggets and the process variance are kept. With ``return_std`` also the deviations (n,) of the noise-free
        outputs from these predictions.
        """
        check_is_fitted(self, "state_")
        state: KrigingState = self.state_
        with threadpool_limits(limits=1, user_api="blas"):
            errors, variances = state.solved.leave_one_out(len(state.inputs))
        outputs = state.outputs()
        predictions = outputs - state.scale * errors
        if not return_std:
            return outputs, predictions
        deviations = np.sqrt(state.variance * np.maximum(variances - state.nugget, 0.0))
        return outputs, predictions, state.scale * deviations

    def _set(self, state: KrigingState, columns: tuple[str, ...] | None = None) -> None:
        self.state_ = state
        self._posterior = Posterior(state)
        self.n_features_in_ = len(state.names)
        self._named = self.names is not None or columns is not None

    def _query(self, X: ArrayLike) -> tuple[KrigingState, Array]:
        """The state and the points as a table, checked."""
        check_is_fitted(self, "state_")
        state: KrigingState = self.state_
        points = table("X", X)
        check_columns(column_names(X), state.names if self._named else None)
        if points.shape[1] != len(state.names):
            raise InputError(
                f"kriging: X has {points.shape[1]} features, but Kriging is expecting {len(state.names)} features as "
                f"input: {', '.join(state.names)}"
            )
        if not self.extrapolate:
            check_box(state, points)
        return state, points

    def _given_nuggets(self, enhanced: bool) -> Array:
        return np.array([self.nugget, self.gradient_nugget][: 1 + enhanced], dtype=float)

    def _checked(
        self, inputs: Array, output: Array, slopes: Array | None, columns: tuple[str, ...] | None
    ) -> tuple[tuple[str, ...], Array, Array]:
        """Names and box for the data; raises :class:`InputError` for whatever can not be fitted."""
        size, dimensions = inputs.shape
        default = columns or tuple(f"x{k}" for k in range(dimensions))
        names = default if self.names is None else tuple(self.names)
        if len(names) != dimensions or len(set(names)) != dimensions:
            raise InputError(f"kriging: names = {', '.join(names)}: {dimensions} different names")
        check_columns(columns, names)
        one_of("correlation", self.correlation, CORRELATIONS if slopes is None else DIFFERENTIABLE)
        one_of("trend", self.trend, trends.TRENDS)
        if output.shape != (size,):
            raise InputError(f"kriging: y has shape {output.shape}: expected ({size},)")
        if slopes is not None and slopes.shape != inputs.shape:
            raise InputError(f"kriging: gradients have shape {slopes.shape}: expected {inputs.shape}")
        check_size(size, dimensions, self.trend, enhanced=slopes is not None)
        lower = np.min(inputs, axis=0) if self.lower is None else np.array(self.lower, dtype=float)
        upper = np.max(inputs, axis=0) if self.upper is None else np.array(self.upper, dtype=float)
        if lower.shape != (dimensions,) or upper.shape != (dimensions,) or not np.all(lower < upper):
            raise InputError(f"kriging: lower = {lower}, upper = {upper}: {dimensions} numbers each, lower < upper")
        check_bounds(names, lower, upper, inputs)
        check_rows((inputs - lower) / (upper - lower), self.trend, enhanced=slopes is not None)
        self._check_parameters(dimensions, enhanced=slopes is not None)
        return names, lower, upper

    def _check_parameters(self, dimensions: int, *, enhanced: bool) -> None:
        given = [self.theta, self.nugget] + [self.gradient_nugget] * enhanced
        if len({value is None for value in given}) > 1:
            raise InputError(f"kriging: theta, nugget{', gradient_nugget' * enhanced}: give all or none")
        if self.theta is not None:
            theta, nuggets = np.asarray(self.theta, dtype=float), self._given_nuggets(enhanced)
            if theta.shape != (dimensions,) or not np.all((theta > 0.0) & np.isfinite(theta)):
                raise InputError(f"kriging: theta = {theta}: {dimensions} positive numbers")
            if not np.all((nuggets >= 0.0) & np.isfinite(nuggets)):
                raise InputError(f"kriging: nuggets = {', '.join(f'{one:g}' for one in nuggets)}: numbers >= 0")
        low, high = THETA_BOUNDS
        if not self.starts or not all(low <= start <= high for start in self.starts):
            raise InputError(f"kriging: starts = {self.starts}: one or more numbers from {low} to {high}")
