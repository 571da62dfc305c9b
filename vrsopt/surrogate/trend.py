"""Polynomial trends of a Kriging in the scaled inputs u: constant, linear or full quadratic.

With e = (1, u_1, ..., u_d) every term is a product e_i e_j, i <= j, ordered (0, 0), (0, 1), ..., (0, d), (1, 1), ...:
the constant trend is the first term, the linear one the first d + 1. ``kind``: "constant", "linear" or "quadratic";
``dimensions``: d; ``coefficients`` (p,), one per term.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TRENDS = ("constant", "linear", "quadratic")


def size(dimensions: int, kind: str) -> int:
    """Number of terms p."""
    return {"constant": 1, "linear": dimensions + 1, "quadratic": (dimensions + 1) * (dimensions + 2) // 2}[kind]


def pairs(dimensions: int, kind: str) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """i and j of each term: (p,) each."""
    first, second = np.triu_indices(dimensions + 1)
    terms = size(dimensions, kind)
    return first[:terms], second[:terms]


def _extended(scaled: Array) -> Array:
    return np.concatenate([np.ones((len(scaled), 1)), scaled], axis=1)


def basis(scaled: Array, kind: str) -> Array:
    """The terms at ``scaled`` (n, d): (n, p)."""
    first, second = pairs(scaled.shape[1], kind)
    extended = _extended(scaled)
    return np.asarray(extended[:, first] * extended[:, second])


def basis_gradient(scaled: Array, kind: str) -> Array:
    """Derivatives of the terms at ``scaled`` (n, d) by each input: (d, n, p)."""
    first, second = pairs(scaled.shape[1], kind)
    extended = _extended(scaled)
    inputs = np.arange(1, scaled.shape[1] + 1)[:, None, None]
    return np.asarray((first == inputs) * extended[:, second] + (second == inputs) * extended[:, first])


def quadratic_form(coefficients: Array, dimensions: int, kind: str) -> Array:
    """Symmetric matrix S (d + 1, d + 1) with trend e'Se/2, gradient (Se)[1:] and Hessian S[1:, 1:]."""
    form = np.zeros((dimensions + 1, dimensions + 1))
    form[pairs(dimensions, kind)] = coefficients
    return form + form.T


def factors(scaled: Array, column: int, dimensions: int, kind: str, order: int = 0) -> Array:
    """The powers of input ``column``, at ``scaled`` (m,), in each term, differentiated ``order`` times: (m, p)."""
    power = sum((index == column + 1).astype(int) for index in pairs(dimensions, kind))
    one, zero = np.ones_like(scaled), np.zeros_like(scaled)
    table = {0: (one, scaled, scaled**2), 1: (zero, one, 2.0 * scaled), 2: (zero, zero, 2.0 * one)}
    return np.stack(table.get(order, (zero, zero, zero)), axis=-1)[:, power]
