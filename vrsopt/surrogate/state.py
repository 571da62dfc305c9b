"""A fitted Kriging as data: enough to predict value, gradient and Hessian, to validate and to save.

With scaled inputs u, the mean is  mean + scale * (f(u)' beta + sum_i w_i k(u - u_i) - sum_ij v_ij k_j(u - u_i)),  where
the gradient weights v are there only if gradients were fitted. Every term is a product over the inputs: see
:func:`terms` and :func:`factors`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from vrsopt.errors import InputError
from vrsopt.surrogate import trend as trends
from vrsopt.surrogate.correlation import BLOCK, Array, factor, separable
from vrsopt.surrogate.gradient_enhanced import JointCovariance, joint_basis, joint_data
from vrsopt.surrogate.likelihood import LeastSquares, Problem, ValueCovariance, one_norm


@dataclass(frozen=True)
class KrigingState:
    """Everything a fitted Kriging is made of.

    ``inputs`` (n, d) in physical units; ``lower`` and ``upper`` (d,) scale them to [0, 1]; ``theta`` (d,) acts on the
    scaled inputs. ``coefficients`` (p,) of the trend (order: ``trend.pairs``), ``weights`` (n,) and, with fitted
    gradients, ``gradient_weights`` (n, d), else (0, d), give the output divided by ``scale`` after ``mean`` is taken
    off; ``variance`` is the process variance of that, from leave-one-out errors. ``nugget`` and
    ``gradient_nugget`` are variances of errors in the outputs and in the gradients by scaled inputs, as shares of it.
    ``smoothing`` is eps of the smoothed exponential, or 0.
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
    trend: str
    gradient_nugget: float
    gradient_weights: Array
    variance: float

    def __getstate__(self) -> dict[str, Any]:
        """Without what can be computed again: matrices (n, n)."""
        return {item.name: getattr(self, item.name) for item in fields(self)}

    @property
    def enhanced(self) -> bool:
        """Whether gradients were fitted."""
        return len(self.gradient_weights) > 0

    @property
    def output_error(self) -> float:
        """Deviation of an error in the outputs that the nugget stands for, in their units."""
        return float(self.scale * np.sqrt(self.variance * self.nugget))

    def scale_inputs(self, points: Array) -> Array:
        """``points`` (..., d) in physical units, scaled to [0, 1]."""
        return (points - self.lower) / (self.upper - self.lower)

    @cached_property
    def scaled(self) -> Array:
        """The sampled inputs scaled to [0, 1]: (n, d)."""
        return self.scale_inputs(self.inputs)

    def outputs(self) -> Array:
        """The outputs the model was fitted on (n,): the mean plus the nugget's share returns them."""
        return self.predict(self.inputs) + self.scale * self.nugget * self.weights

    def gradients(self) -> Array:
        """The gradients the model was fitted on, in physical units: (n, d)."""
        error = self.gradient_nugget * self.gradient_weights
        return self.derivatives(self.inputs, 1)[1] + self.scale * error / (self.upper - self.lower)

    def predict(self, points: Array) -> Array:
        """Mean at ``points`` (k, d) in physical units: (k,); no check of the box."""
        return self.derivatives(points, 0)[0]

    def derivatives(self, points: Array, order: int) -> tuple[Array, ...]:
        """Mean (k,), gradient (k, d) and Hessian (k, d, d), as many as ``order`` (0 to 2) asks for, at (k, d) points.

        Physical units, exact. An exponential that is not smoothed has no derivative at a sampled coordinate: the kink
        counts as level.
        """
        dimensions = len(self.names)
        form = trends.quadratic_form(self.coefficients, dimensions, self.trend)
        gradient_weights = self.gradient_weights.T if self.enhanced else None
        result: tuple[Array, ...] = tuple(np.zeros((len(points),) + (dimensions,) * k) for k in range(order + 1))
        for rows, scaled, difference in self._blocks(points):
            extended = np.concatenate([np.ones((len(scaled), 1)), scaled], axis=1)
            level = extended @ form
            process = separable(
                self.correlation, self.smoothing, self.theta, difference, self.weights, gradient_weights, order
            )
            result[0][rows] = 0.5 * np.sum(level * extended, axis=1) + process[0]
            if order > 0:
                result[1][rows] = level[:, 1:] + process[1]
            if order > 1:
                result[2][rows] = form[1:, 1:] + process[2]
        span = self.upper - self.lower
        units: tuple[Any, ...] = (1.0, span, span[:, None] * span)
        physical = tuple(self.scale * array / unit for array, unit in zip(result, units, strict=False))
        return (self.mean + physical[0], *physical[1:])

    def _blocks(self, points: Array) -> Iterator[tuple[slice, Array, Array]]:
        """Rows, scaled points (m, d) and their distances to the samples (m, d, n), a block at a time."""
        step = max(1, BLOCK // self.inputs.size)
        samples = np.ascontiguousarray(self.scaled.T)
        for begin in range(0, len(points), step):
            rows = slice(begin, begin + step)
            scaled = self.scale_inputs(points[rows])
            yield rows, scaled, scaled[:, :, None] - samples

    @property
    def problem(self) -> Problem:
        """Covariance model, trend terms and the data this was fitted on (scaled and standardised)."""
        data = (self.outputs() - self.mean) / self.scale
        gradients = self.gradients() * (self.upper - self.lower) / self.scale if self.enhanced else None
        return fit_problem(self.correlation, self.smoothing, self.trend, self.scaled, data, gradients)

    @cached_property
    def _solved(self) -> tuple[LeastSquares, float]:
        """The system solved again, and LAPACK's estimate of its condition number."""
        problem = self.problem
        nuggets = (self.nugget, self.gradient_nugget)[: len(problem.covariance.sizes)]
        with threadpool_limits(limits=1, user_api="blas"):
            matrix = problem.covariance.matrix(self.theta)
            solved = problem.solve(matrix, nuggets)
            if solved is None:
                raise InputError(f"kriging: nugget = {self.nugget:g}: {NOT_DEFINITE}")
            norm = one_norm(matrix, np.repeat(nuggets, problem.covariance.sizes))
            return solved, solved.condition_number(norm)

    @property
    def solved(self) -> LeastSquares:
        """Factor of the covariance of the data and what follows from it; computed once, when first needed."""
        return self._solved[0]

    @property
    def condition_number(self) -> float:
        """Condition number of the covariance of the data with its nuggets, LAPACK's estimate (1-norm)."""
        return self._solved[1]


NOT_DEFINITE = "the correlation matrix is not positive definite; repeated rows need a larger nugget"


def fit_problem(
    correlation: str, smoothing: float, trend: str, scaled: Array, outputs: Array, gradients: Array | None
) -> Problem:
    """The likelihood of scaled inputs (n, d), standardised outputs (n,) and gradients (n, d) by the scaled inputs.

    ``correlation`` and ``smoothing``: see :mod:`vrsopt.surrogate.correlation`; ``trend``: see
    :mod:`vrsopt.surrogate.trend`.
    """
    if gradients is None:
        return Problem(ValueCovariance(correlation, smoothing, scaled), trends.basis(scaled, trend), outputs)
    return Problem(JointCovariance(correlation, scaled), joint_basis(scaled, trend), joint_data(outputs, gradients))


def terms(state: KrigingState) -> Array:
    """Weights (q,) of the separable terms: n samples, then n gradients by the first input and so on if they were
    fitted, then p of the trend."""
    return np.concatenate([state.weights, state.gradient_weights.T.ravel(), state.coefficients])


def factors(state: KrigingState, column: int, scaled: Array, order: int = 0) -> Array:
    """The factor of input ``column`` in each term, at ``scaled`` (m,) coordinates: (m, q).

    Differentiated ``order`` (0 to 2) times by the scaled coordinate. The mean at a point is
    ``state.mean + state.scale * sum_q terms_q prod_column factors_q``.
    """
    difference = scaled[:, None] - state.scaled[:, column]
    theta = float(state.theta[column])
    parts = [factor(state.correlation, state.smoothing, theta, difference, order)]
    if state.enhanced:
        gradient = -factor(state.correlation, state.smoothing, theta, difference, order + 1)
        parts += [gradient if k == column else parts[0] for k in range(len(state.names))]
    return np.concatenate([*parts, trends.factors(scaled, column, len(state.names), state.trend, order)], axis=1)
