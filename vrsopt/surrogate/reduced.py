"""A Kriging along given conditions: some inputs are known at N points, and the mean is a function of the others.

Every term of the mean is a product over the inputs. The factors of the given ones fold into the weights, so that the
cost of the rest does not depend on how many inputs are given.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vrsopt.errors import InputError
from vrsopt.surrogate import trend as trends
from vrsopt.surrogate.checks import check_bounds
from vrsopt.surrogate.correlation import separable
from vrsopt.surrogate.kriging import Array, Kriging
from vrsopt.surrogate.state import KrigingState, factors, terms

BLOCK = 32_768  # numbers in a work array at a time: several of them stay in the cache


@dataclass(frozen=True, eq=False)
class Reduced:
    """The mean of ``state`` with the ``fixed`` inputs given (N,) each, by name, as a function of the ``free`` ones.

    Calling it gives value (N,), gradient (N, f) and Hessian (N, f, f) at points (N, f), one for each node, in physical
    units; the box is not checked.
    """

    state: KrigingState
    fixed: Mapping[str, Array]
    free: tuple[str, ...]

    @property
    def columns(self) -> list[int]:
        """Columns of the free inputs among all inputs."""
        return [self.state.names.index(name) for name in self.free]

    @property
    def lower(self) -> Array:
        """Of the free inputs (f,)."""
        return self.state.lower[self.columns]

    @property
    def upper(self) -> Array:
        """Of the free inputs (f,)."""
        return self.state.upper[self.columns]

    @cached_property
    def weights(self) -> Array:
        """Weights of the separable terms times the factors of the fixed inputs: (N, q)."""
        result = terms(self.state)[None, :]
        for name, values in self.fixed.items():
            column = self.state.names.index(name)
            width = self.state.upper[column] - self.state.lower[column]
            result = result * factors(self.state, column, (values - self.state.lower[column]) / width)
        return result

    def values(self, points: Array) -> Array:
        """Mean (N, k) of k candidates at each node, ``points`` (N, k, f)."""
        result = np.empty(points.shape[:2])
        for node, candidates in enumerate(points):
            for begin, scaled, difference in self._blocks(candidates):
                at = np.full(len(scaled), node)
                result[node, begin : begin + len(at)] = self._derivatives(at, scaled, difference, 0)[0]
        return self.state.mean + self.state.scale * result

    def __call__(self, points: Array) -> tuple[Array, Array, Array]:
        size, f = points.shape
        value, gradient, hessian = np.empty(size), np.empty((size, f)), np.empty((size, f, f))
        for begin, scaled, difference in self._blocks(points):
            at = np.arange(begin, begin + len(scaled))
            value[at], gradient[at], hessian[at] = self._derivatives(at, scaled, difference, 2)
        scale, width = self.state.scale, self.upper - self.lower
        return self.state.mean + scale * value, scale * gradient / width, scale * hessian / np.outer(width, width)

    def _blocks(self, points: Array) -> Iterator[tuple[int, Array, Array]]:
        """First row, scaled points (m, f) and their distances to the samples (m, f, n)."""
        samples = np.ascontiguousarray(self.state.scaled[:, self.columns].T)
        step = max(1, BLOCK // samples.size)
        scaled = (points - self.lower) / (self.upper - self.lower)
        for begin in range(0, len(points), step):
            block = scaled[begin : begin + step]
            yield begin, block, block[:, :, None] - samples

    def _derivatives(self, at: NDArray[np.intp], scaled: Array, difference: Array, order: int) -> tuple[Array, ...]:
        """Of the standardised mean by the scaled inputs, up to ``order``, at nodes ``at`` (m,)."""
        weights, slopes, forms = self._parts
        nodes = at if self.fixed else np.zeros_like(at)
        kernel = (self.state.correlation, self.state.smoothing, self.state.theta[self.columns])
        slope = None if slopes is None else slopes[nodes]
        own = separable(*kernel, difference, weights[nodes], slope, order)
        form = forms[nodes]
        extended = np.concatenate([np.ones((len(scaled), 1)), scaled], axis=1)
        level = np.einsum("mij,mj->mi", form, extended)
        trend = (0.5 * np.sum(level * extended, axis=1), level[:, 1:], form[:, 1:, 1:])
        return tuple(a + b for a, b in zip(own, trend, strict=False))

    @cached_property
    def _parts(self) -> tuple[Array, Array | None, Array]:
        """Weights of the samples (N, n), of their slopes in the free inputs (N, f, n), and the trend (N, f + 1, f + 1).

        The slope of a sample in a fixed input is known at the node, and counts as weight of the sample itself.
        """
        state = self.state
        samples, d = state.inputs.shape
        count = samples * (1 + d) if state.enhanced else samples
        plain = self.weights[:, :samples]
        slopes = None
        if state.enhanced:
            by_input = self.weights[:, samples:count].reshape(len(plain), d, samples)
            given = [k for k in range(d) if k not in self.columns]
            plain, slopes = plain + by_input[:, given].sum(axis=1), by_input[:, self.columns]
        place = np.zeros(d + 1, dtype=int)
        place[np.array(self.columns) + 1] = np.arange(1, len(self.columns) + 1)
        form = np.zeros((len(plain), len(self.columns) + 1, len(self.columns) + 1))
        for i, j, weight in zip(*trends.pairs(d, state.trend), self.weights[:, count:].T, strict=True):
            form[:, place[i], place[j]] += weight
        return plain, slopes, form + np.swapaxes(form, 1, 2)


def reduce(kriging: Kriging, fixed: Mapping[str, ArrayLike], free: Sequence[str]) -> Reduced:
    """``kriging`` with the ``fixed`` inputs (N,) each; ``fixed`` and ``free`` name every input once.

    Raises :class:`InputError` for an input that is missing, named twice or, unless the model extrapolates, outside the
    box, and for values of different shapes.
    """
    state: KrigingState = kriging.state_
    if sorted([*fixed, *free]) != sorted(state.names):
        raise InputError(
            f"path: fixed {', '.join(fixed)} and free {', '.join(free)}: each of {', '.join(state.names)} once"
        )
    points = {name: np.array(values, dtype=float) for name, values in fixed.items()}
    shapes = {values.shape for values in points.values()}
    if len(shapes) > 1 or any(len(shape) != 1 for shape in shapes):
        raise InputError(f"path: fixed values have shapes {sorted(shapes)}: one shape (N,)")
    for name, values in points.items():
        column = [state.names.index(name)]
        if not np.all(np.isfinite(values)):
            raise InputError(f"path: {name} = {values[~np.isfinite(values)][0]}: finite numbers only")
        if not kriging.extrapolate:
            check_bounds([name], state.lower[column], state.upper[column], values[:, None])
    return Reduced(state, points, tuple(free))
