"""What a prediction rests on: its predicted standard deviation, how far the data are, and where data would help most.

Both measures are given with exact gradient and Hessian and as CasADi functions, so that an optimiser can keep to where
the surrogate is known, by a constraint or by a term of its objective.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from vrsopt.errors import InputError
from vrsopt.surrogate.callback import pointwise
from vrsopt.surrogate.kriging import Array, Kriging

SHARPNESS = 8  # of the mean over squared distances that stands for the nearest one
CORE = 0.01  # of the box, over which the smooth distance rounds the cone at a sampled point
BLOCK = 200_000  # numbers in a work array at a time


@dataclass(frozen=True)
class Deviation:
    """Predicted standard deviation of a Kriging's mean, in units of the output."""

    kriging: Kriging

    def __call__(self, points: Array) -> tuple[Array, Array, Array]:
        """Value (k,), gradient (k, d) and Hessian (k, d, d) at ``points`` (k, d), physical units.

        Data without noise make a kink of it at every sampled point; the fitted nugget rounds it.
        """
        posterior = self.kriging.posterior
        variance, slope, bend = posterior.derivatives(points)
        value = np.sqrt(np.maximum(variance, np.finfo(float).eps * posterior.scale))
        gradient = slope / (2.0 * value[:, None])
        return value, gradient, (0.5 * bend - gradient[:, :, None] * gradient[:, None, :]) / value[:, None, None]

    def function(self, size: int) -> ca.Function:
        """``deviation(x) -> y`` of x (d, size), y (1, size), twice differentiable."""
        return pointwise("deviation", self, len(self.kriging.state_.names), size)


@dataclass(frozen=True)
class Distance:
    """Distance to the nearest sampled point of a Kriging, inputs scaled to [0, 1] by its box."""

    kriging: Kriging

    def nearest(self, points: ArrayLike) -> Array:
        """Distance (k,) of ``points`` (k, d), physical units."""
        state = self.kriging.state_
        return np.asarray(cKDTree(state.scaled).query(state.scale_inputs(np.asarray(points, dtype=float)))[0])

    def spacing(self) -> Array:
        """Distance of each sampled point to its nearest neighbour (n,)."""
        scaled = self.kriging.state_.scaled
        return np.asarray(cKDTree(scaled).query(scaled, k=2)[0][:, 1])

    def __call__(self, points: Array) -> tuple[Array, Array, Array]:
        """Smooth distance (k,), its gradient (k, d) and Hessian (k, d, d) at ``points`` (k, d), physical units.

        Root of the mean of the squared distances s, weighted with s^-8: never below the nearest one, so that a bound on
        it holds for the nearest one too; above it by some per cent where several are equally near, and by at most 0.01
        near a sampled point.
        """
        state = self.kriging.state_
        size, d = points.shape
        value, gradient, hessian = np.empty(size), np.empty((size, d)), np.empty((size, d, d))
        step = max(1, BLOCK // state.inputs.size)
        for begin in range(0, size, step):
            block = slice(begin, begin + step)
            value[block], gradient[block], hessian[block] = self._smooth(state.scale_inputs(points[block]))
        width = state.upper - state.lower
        return value, gradient / width, hessian / np.outer(width, width)

    def function(self, size: int) -> ca.Function:
        """``distance(x) -> y`` of x (d, size), y (1, size): the smooth distance, twice differentiable."""
        return pointwise("distance", self, len(self.kriging.state_.names), size)

    def _smooth(self, scaled: Array) -> tuple[Array, Array, Array]:
        away = scaled[:, None, :] - self.kriging.state_.scaled
        squared = np.sum(away**2, axis=-1) + CORE**2
        least = np.min(squared, axis=1, keepdims=True)
        above, slope, bend = _power_sum(squared / least, away, least, 1 - SHARPNESS)
        below, slope_below, bend_below = _power_sum(squared / least, away, least, -SHARPNESS)
        mean = above / below
        gradient = (slope - mean[:, None] * slope_below) / below[:, None]
        cross = gradient[:, :, None] * slope_below[:, None, :]
        hessian = bend - mean[:, None, None] * bend_below - cross - np.swapaxes(cross, 1, 2)
        value = np.sqrt(least[:, 0] * mean)
        gradient *= least / (2.0 * value[:, None])
        hessian *= (least / (2.0 * value[:, None] * below[:, None]))[:, :, None]
        return value, gradient, hessian - gradient[:, :, None] * gradient[:, None, :] / value[:, None, None]


def _power_sum(ratio: Array, away: Array, least: Array, power: int) -> tuple[Array, Array, Array]:
    """Sum over the samples of ratio^power (k,), its gradient and Hessian; ratio (k, n) is |away|^2 / least + const."""
    one, two = ratio ** (power - 1) / least, ratio ** (power - 2) / least**2
    gradient = 2.0 * power * np.einsum("kn,knd->kd", one, away)
    hessian = 4.0 * power * (power - 1) * np.einsum("kn,knd,kne->kde", two, away, away, optimize=True)
    diagonal = 2.0 * power * np.sum(one, axis=1)
    return np.sum(ratio**power, axis=1), gradient, hessian + diagonal[:, None, None] * np.eye(away.shape[-1])


def weak_points(kriging: Kriging, candidates: ArrayLike, count: int) -> Array:
    """The ``count`` of ``candidates`` (k, d), physical units, whose computation would help most, best first.

    Greedy: the largest predicted standard deviation, then the largest that is left once the first is known, and so on.
    No output is needed for it, and a chosen point keeps the next one away by itself. Fewer where the rest would be
    known as well as the fitted nugget lets anything be known. Raises :class:`InputError` for a count below 1.
    """
    points = np.asarray(candidates, dtype=float)
    if count < 1:
        raise InputError(f"weak points: count = {count}: at least 1")
    posterior = kriging.posterior
    noise = max(kriging.state_.nugget, np.finfo(float).eps) * posterior.scale
    seen = posterior.whitened(points)
    left = posterior.variance_of(seen)
    chosen: list[int] = []
    known: list[Array] = []
    while len(chosen) < min(count, len(points)):
        worst = int(np.argmax(left))
        if left[worst] <= noise:
            break
        row = posterior.covariance(points, seen, worst)
        row -= sum((before * before[worst] for before in known), np.zeros(len(points)))
        row /= np.sqrt(row[worst] + noise)
        left = np.maximum(left - row**2, 0.0)
        left[worst] = 0.0
        chosen.append(worst)
        known.append(row)
    return points[chosen]
