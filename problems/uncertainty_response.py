"""Samples that were not flown: a response made of the tornado and of those that were.

Each number contributes the parabola through both ends of its range and the shipped value. What the flown samples have
beyond the sum of these is fitted by products of the numbers that matter most, and by a constant.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np

PAIRED = 5  # numbers whose products are fitted


@dataclass(frozen=True)
class Response:
    """A quantity of one mission over the numbers: ``low``, ``shipped``, ``high`` (n,) of each, the ``effects`` (n, 2)
    of its ends, the ``reference``, and the ``factors`` of 1 and of the products of ``pairs``."""

    low: np.ndarray
    shipped: np.ndarray
    high: np.ndarray
    effects: np.ndarray
    reference: float
    pairs: Sequence[tuple[int, int]] = ()
    factors: np.ndarray = field(default_factory=lambda: np.zeros(1))

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """At ``values`` (N, n) of the numbers."""
        return self.sum(values) + self.products(values) @ self.factors

    def sum(self, values: np.ndarray) -> np.ndarray:
        """Reference and parabolas."""
        left, right, x = self.low - self.shipped, self.high - self.shipped, values - self.shipped
        total = np.full(len(values), self.reference)
        for k in range(x.shape[1]):
            ends = [(end, effect) for end, effect in zip((left[k], right[k]), self.effects[k], strict=True) if end]
            shape = np.array([[end, end**2] for end, _ in ends])[:, : len(ends)]  # a line where one end is shipped
            slopes = np.linalg.solve(shape, [effect for _, effect in ends])
            total += x[:, k] * slopes[0] + (x[:, k] ** 2 * slopes[1] if len(ends) > 1 else 0.0)
        return total

    def products(self, values: np.ndarray) -> np.ndarray:
        """1 and the products of pairs, each number as a fraction of its range."""
        unit = (values - self.shipped) / (self.high - self.low)
        return np.column_stack([np.ones(len(values)), *(unit[:, i] * unit[:, j] for i, j in self.pairs)])


def response(content: Mapping[str, Any], quantity: str, mission: str) -> Response:
    """The parabolas of the tornado alone."""
    entries, reference = content["numbers"], content["reference"][mission][quantity]
    effects = [[one["at"][side][mission][quantity] - reference for side in ("low", "high")] for one in entries]
    low, shipped, high = (np.array([one[name] for one in entries]) for name in ("low", "value", "high"))
    return Response(low, shipped, high, np.array(effects), reference)


def fitted_response(start: Response, values: np.ndarray, found: np.ndarray) -> tuple[Response, np.ndarray]:
    """With products fitted to what the samples ``values`` (N, n) ``found`` (N,), and the error of each sample when it
    is left out of the fit."""
    most = np.argsort(-np.max(np.abs(start.effects), axis=1))[:PAIRED].tolist()
    pairs = list(combinations(sorted(most), 2))
    whole = Response(start.low, start.shipped, start.high, start.effects, start.reference, pairs)
    design, left = whole.products(values), found - start.sum(values)
    factors = np.linalg.lstsq(design, left, rcond=None)[0]
    leverage = np.einsum("ij,ji->i", design, np.linalg.pinv(design))
    fitted = Response(start.low, start.shipped, start.high, start.effects, start.reference, pairs, factors)
    return fitted, (left - design @ factors) / (1.0 - leverage)
