"""A noisy track as a smooth curve whose speeds and accelerations belong to it.

The filter is a smoothing spline of degree 5 (Reinsch 1967; with a basis of B-splines on uniform knots: O'Sullivan 1986,
"A statistical perspective on ill-posed inverse problems"): of all curves the one with the least sum of the squared
distance from the fixes and the squared third derivative, each integrated over time. It is a low-pass without delay: an
oscillation of the period T keeps 1 / (1 + (P / T)^6) of its amplitude, half of it at the filter's period P.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, pi
from typing import Any

import numpy as np
import scipy.sparse as sparse
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.linalg import solveh_banded

Array = NDArray[Any]
DEGREE = 5
KNOTS_PER_PERIOD = 12
ROBUST_SWEEPS = 8
OUTLIER = 5.0  # times the scatter
ROUGH = 10.0  # m, no fix closer to the smoothed track is an outlier


@dataclass(frozen=True)
class Hold:
    """A time [s] over which the curve stays at a value (k,)."""

    start: float
    end: float
    value: Array


@dataclass(frozen=True)
class SmoothingSpline:
    """The filter with its period [s], for tracks of ``duration`` [s]."""

    period: float
    duration: float

    def fit(self, time: Array, values: Array, weight: Array, holds: Sequence[Hold] = ()) -> BSpline:
        """The curve (k values) through ``values`` (N, k) at ``time`` (N,) [s], constant over the ``holds``.

        ``weight`` (N,): the time each fix stands for, see :func:`time_weights`. Outside a hold the curve leaves it with
        continuous derivatives up to the fourth.
        """
        knots = self._knots()
        inside = np.clip(time, knots[DEGREE], knots[-DEGREE - 1])
        design = BSpline.design_matrix(inside, knots, DEGREE).tocsr()
        matrix = (design.T @ sparse.diags(weight) @ design + self._roughness(knots)).tocsr()
        right = design.T @ (weight[:, None] * values)
        fixed = np.zeros(len(right), dtype=bool)
        coefficients = np.zeros(right.shape)
        for hold in holds:
            first = int(np.searchsorted(knots, hold.start, side="right")) - 1 - DEGREE
            last = int(np.searchsorted(knots, hold.end, side="left"))
            touched = slice(max(first, 0), min(last, len(right)))
            fixed[touched] = True
            coefficients[touched] = hold.value
        free = ~fixed
        right = right - matrix[:, fixed] @ coefficients[fixed]
        if free.any():
            coefficients[free] = _solved(matrix[free][:, free], right[free])
        return BSpline(knots, coefficients, DEGREE)

    def robust(self, time: Array, values: Array, manoeuvre: float) -> tuple[BSpline, Array]:
        """The curve, and which fixes it leaves out because they are too far off the others.

        Fixes far off lose weight (Huber's) until the curve stays; then those go that are more than five times the
        scatter and 10 m away, and further than the filter itself can be from a circle flown at ``manoeuvre`` [m/s2].
        """
        weight = time_weights(time, self.period)
        trust = np.ones(len(time))
        rough = max(ROUGH, 0.5 * manoeuvre * (self.period / (2.0 * pi)) ** 2)
        for _ in range(ROBUST_SWEEPS):
            distance = np.linalg.norm(self.fit(time, values, weight * trust)(time) - values, axis=1)
            limit = max(OUTLIER * scatter(distance, values.shape[1]), rough)
            trust = np.minimum(1.0, 0.5 * limit / np.maximum(distance, 1e-9))
        outlier = distance > limit
        return self.fit(time[~outlier], values[~outlier], time_weights(time[~outlier], self.period)), outlier

    def _knots(self) -> Array:
        intervals = max(1, ceil(self.duration * KNOTS_PER_PERIOD / self.period))
        return self.duration / intervals * np.arange(-DEGREE, intervals + DEGREE + 1)

    def _roughness(self, knots: Array) -> Any:
        """(P / 2 pi)^6 times the integral of the squared third derivative, as a matrix on the coefficients.

        The derivative is piecewise quadratic, so three Gauss points in each interval are exact.
        """
        step = knots[1] - knots[0]
        third = sparse.eye(len(knots) - DEGREE - 1, format="csr")
        for _ in range(3):
            third = (third[1:] - third[:-1]) / step
        points, weights = np.polynomial.legendre.leggauss(3)
        start = knots[DEGREE : -DEGREE - 1]
        at = (start[:, None] + 0.5 * step * (1.0 + points)).ravel()
        values = BSpline.design_matrix(at, knots[3:-3], DEGREE - 3).tocsr() @ third
        scale = (self.period / (2.0 * pi)) ** 6
        return values.T @ sparse.diags(scale * np.tile(0.5 * step * weights, len(start))) @ values


def time_weights(time: Array, period: float) -> Array:
    """The time each fix stands for [s]: half of the way to its neighbours, at most half of the filter's period."""
    return np.minimum(np.gradient(time), 0.5 * period)


def scatter(distance: Array, axes: int) -> float:
    """Standard deviation per axis, from the median distance in one or two axes of normal noise."""
    return float(np.median(distance)) / (0.6745 if axes == 1 else 1.1774)


def _solved(matrix: Any, right: Array) -> Array:
    """Solve a symmetric banded system."""
    size = matrix.shape[0]
    banded = np.zeros((DEGREE + 1, size))
    for below in range(min(DEGREE + 1, size)):
        banded[below, : size - below] = matrix.diagonal(-below)
    return np.asarray(solveh_banded(banded, right, lower=True))
