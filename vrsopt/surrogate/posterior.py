"""How uncertain a Kriging is of its own mean: the predicted variance with exact derivatives, and covariances.

Universal Kriging (Sacks, Welch, Mitchell and Wynn 1989, eq. 8): with the correlations r(x) of a point with the data
and its trend terms f(x), K the correlation of the data and F their trend terms,

    variance(x) = s^2 (1 - r' K^-1 r + u' (F' K^-1 F)^-1 u),   u = F' K^-1 r - f.

It is the variance of the mean about the function: no nugget is added, and the trend's own uncertainty is in it. r and f
are products over the inputs and the only place where x enters, so that the derivatives are those of the factors; the
data may be values, or values and gradients.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import reduce
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import solve_triangular
from threadpoolctl import threadpool_limits

from vrsopt.surrogate.likelihood import Array
from vrsopt.surrogate.state import factors

if TYPE_CHECKING:
    from vrsopt.surrogate.kriging import KrigingState

BLOCK = 200_000  # numbers in a work array at a time: it stays in the cache


@dataclass(frozen=True)
class Whitened:
    """r(x) and f(x) of m points in coordinates in which the data are uncorrelated, and in those of the trend.

    ``data`` (n, m): L^-1 r, and ``trend`` (p, m): Q' L^-1 r - R^-T f, with K = L L' and L^-1 F = Q R.
    """

    data: Array
    trend: Array

    def product(self, other: Whitened) -> Array:
        """What the data take off the covariance of these points (m,) with the same ones of ``other``."""
        return np.einsum("nm,nm->m", self.data, other.data) - np.einsum("pm,pm->m", self.trend, other.trend)


@dataclass(frozen=True, eq=False)
class Posterior:
    """Predicted variance of a fitted Kriging, from the factorisation ``state.solved``, which is made at first use."""

    state: KrigingState

    @property
    def scale(self) -> float:
        """Process variance in units of the output squared."""
        return float(self.state.scale**2 * self.state.variance)

    def variance(self, points: Array) -> Array:
        """Predicted variance (k,) of the mean at ``points`` (k, d) in physical units; no check of the box."""
        result = np.empty(len(points))
        with threadpool_limits(limits=1, user_api="blas"):
            for block in self._blocks(len(points)):
                result[block] = self.variance_of(self.whitened(points[block]))
        return result

    def variance_of(self, seen: Whitened) -> Array:
        """Predicted variance (m,) at points that are whitened already."""
        return self.scale * np.maximum(1.0 - seen.product(seen), 0.0)

    def derivatives(self, points: Array) -> tuple[Array, Array, Array]:
        """Predicted variance (k,), its gradient (k, d) and Hessian (k, d, d) at ``points`` (k, d), physical units."""
        size, d = points.shape
        value, gradient, hessian = np.empty(size), np.empty((size, d)), np.empty((size, d, d))
        with threadpool_limits(limits=1, user_api="blas"):
            for block in self._blocks(size):
                value[block], gradient[block], hessian[block] = self._derivatives(points[block])
        width = self.state.upper - self.state.lower
        scale = self.scale
        return scale * np.maximum(value, 0.0), scale * gradient / width, scale * hessian / np.outer(width, width)

    def _derivatives(self, points: Array) -> tuple[Array, Array, Array]:
        """As :meth:`derivatives`, over the process variance and by the scaled inputs."""
        d = points.shape[1]
        tables = [self._factors(self.state, points, order) for order in range(3)]

        def term(*inputs: int) -> Array:
            orders = np.bincount(inputs, minlength=d) if inputs else np.zeros(d, dtype=int)
            return _product(tables[order][k] for k, order in enumerate(orders))

        known = self._whiten(term())
        first = [term(k) for k in range(d)]
        slopes = [self._whiten(one) for one in first]
        weights = self._back(known)
        gradient = -2.0 * np.stack([np.einsum("mq,mq->m", one, weights) for one in first], axis=-1)
        hessian = np.empty((len(points), d, d))
        for i, j in combinations_with_replacement(range(d), 2):
            bend = np.einsum("mq,mq->m", term(i, j), weights) + slopes[i].product(slopes[j])
            hessian[:, i, j] = hessian[:, j, i] = -2.0 * bend
        return 1.0 - known.product(known), gradient, hessian

    def whitened(self, points: Array) -> Whitened:
        """The ``points`` (m, d) seen from the data."""
        return self._whiten(self._rows(points))

    def covariance(self, points: Array, seen: Whitened, one: int) -> Array:
        """Predicted covariance (k,) of the means at ``points`` (k, d), ``seen`` whitened, with that at ``one``."""
        none = np.empty((0, points.shape[1]))
        among = replace(self.state, inputs=points, weights=np.zeros(len(points)), gradient_weights=none)
        prior = _product(self._factors(among, points[one : one + 1], 0))[0, : len(points)]
        known = seen.data[:, one] @ seen.data - seen.trend[:, one] @ seen.trend
        return self.scale * (prior - known)

    def _blocks(self, size: int) -> list[slice]:
        step = max(1, BLOCK // self._count)
        return [slice(begin, begin + step) for begin in range(0, size, step)]

    @staticmethod
    def _factors(state: KrigingState, points: Array, order: int) -> list[Array]:
        """The factor of each input in all terms at ``points`` (m, d), differentiated ``order`` times: d of (m, q)."""
        scaled = state.scale_inputs(points)
        return [factors(state, k, column, order) for k, column in enumerate(scaled.T)]

    @property
    def _count(self) -> int:
        """Number of data: values and gradients."""
        return int(self.state.weights.size + self.state.gradient_weights.size)

    def _whiten(self, terms: Array) -> Whitened:
        """``terms`` (m, q): r and f, or their derivatives, side by side."""
        solved, seen = self.state.solved, terms[:, : self._count].T
        data = solve_triangular(solved.factor, seen, lower=True, check_finite=False)
        own = solve_triangular(solved.triangular, terms[:, self._count :].T, trans="T", check_finite=False)
        return Whitened(data, solved.projection.T @ seen - own)

    def _back(self, known: Whitened) -> Array:
        """Weights (m, q) whose product with the terms' derivatives is half the gradient of what is known."""
        solved = self.state.solved
        data = solve_triangular(solved.factor, known.data, lower=True, trans="T", check_finite=False)
        own = solve_triangular(solved.triangular, known.trend, check_finite=False)
        return np.concatenate([data - solved.projection @ known.trend, own]).T

    def _rows(self, points: Array) -> Array:
        """r and f at ``points`` (m, d): (m, q)."""
        return _product(self._factors(self.state, points, 0))


def _product(tables: Iterable[Array]) -> Array:
    return reduce(np.multiply, tables)
