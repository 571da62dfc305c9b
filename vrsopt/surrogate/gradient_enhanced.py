"""Covariance of outputs and their gradients: gradient-enhanced Kriging.

If the process has covariance k(x - x'), so have its derivatives: cov(y, dy'/dx'_b) = -k_b and
cov(dy/dx_a, dy'/dx'_b) = -k_ab, subscripts being derivatives by the distance. Morris, Mitchell and Ylvisaker (1993),
Bayesian design and analysis of computer experiments: use of derivatives in surface prediction; Forrester, Sobester and
Keane (2008), Engineering Design via Surrogate Modelling, section 7.2. The data are ordered by kind: n outputs, then n
derivatives by the first input, and so on. With a product k of factors r_a, and p = r'/r, q = r''/r:
k_a = k p_a, k_ab = k p_a p_b, k_aa = k q_a.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vrsopt.surrogate.correlation import Array, correlate, log_theta_ratios, ratios
from vrsopt.surrogate.trend import basis, basis_gradient


@dataclass(frozen=True)
class JointCovariance:
    """R of outputs and gradients at ``scaled`` (n, d); N = n (1 + d). Distances are of scaled inputs."""

    correlation: str
    scaled: Array

    @property
    def sizes(self) -> tuple[int, ...]:
        """Number of outputs and of gradients' components: (n, n d)."""
        return self.scaled.shape[0], self.scaled.size

    @cached_property
    def _difference(self) -> Array:
        return np.asarray(self.scaled[:, :, None] - self.scaled.T[None])  # (n, d, n)

    def matrix(self, theta: Array) -> Array:
        """R (N, N); only the blocks in and above the diagonal are filled."""
        size, dimensions = self.scaled.shape
        value = correlate(self.correlation, 0.0, theta, self._difference)
        first, second = ratios(self.correlation, 0.0, theta[:, None], self._difference, 2)
        result = np.zeros((1 + dimensions, size, 1 + dimensions, size))
        result[0, :, 0] = value
        for b in range(dimensions):
            slope = -value * first[:, b]
            result[0, :, 1 + b] = slope
            for a in range(b):
                result[1 + a, :, 1 + b] = slope * first[:, a]
            result[1 + b, :, 1 + b] = -value * second[:, b]
        return result.reshape(size * (1 + dimensions), -1)

    def slopes(self, theta: Array, matrix: Array, weight: Array) -> Array:
        """sum(weight * dR/d log theta_k) (d,), where the upper triangle of the weight also stands for the lower.

        Only one factor of each block depends on theta_k: r, its p or its q.
        """
        size, dimensions = self.scaled.shape
        value = correlate(self.correlation, 0.0, theta, self._difference)
        first, _ = ratios(self.correlation, 0.0, theta[:, None], self._difference, 2)
        by_value, by_first, by_second = log_theta_ratios(self.correlation, theta[:, None], self._difference)
        shape = (1 + dimensions, size, 1 + dimensions, size)
        blocks, weights = matrix.reshape(shape), weight.reshape(shape)
        product = np.zeros((1 + dimensions, size, size))  # weight * R summed over the blocks that involve k; 0: all
        slope = np.zeros((dimensions, size, size))  # weight / p_k summed over the blocks of p_k
        total = np.zeros(dimensions)
        for b in range(1 + dimensions):
            for a in range(b + 1):
                # The lower triangle of a block on the diagonal is a copy of the upper one, which counts double.
                part = np.triu(weights[a, :, b]) if a == b else weights[a, :, b]
                term = part * blocks[a, :, b]
                for involved in {0, a, b}:
                    product[involved] += term
                if a == b and b > 0:
                    total[b - 1] -= np.sum(part * value * by_second[:, b - 1])
                elif b > 0:
                    slope[b - 1] += part if a == 0 else part * first[:, a - 1]
                    if a > 0:
                        slope[a - 1] += part * first[:, b - 1]
        for k in range(dimensions):
            total[k] += np.sum((product[0] - product[1 + k]) * by_value[:, k])
            total[k] -= np.sum(slope[k] * value * by_first[:, k])
        return total


def joint_basis(scaled: Array, trend: str) -> Array:
    """Trend terms of outputs and gradients at ``scaled`` (n, d): (n (1 + d), p)."""
    return np.concatenate([basis(scaled, trend), *basis_gradient(scaled, trend)])


def joint_data(outputs: Array, gradients: Array) -> Array:
    """Outputs (n,) and gradients (n, d), in the order of the covariance: (n (1 + d),)."""
    return np.concatenate([outputs, gradients.T.ravel()])
