"""Tensor-product Chebyshev interpolation on a box: nodes, coefficients, evaluation in numpy and CasADi, contraction.

p(x) = sum c[a, b, ...] T_a(t_1) T_b(t_2) ..., t = 2 (x - lower)/(upper - lower) - 1, through the Chebyshev points of
the first kind (Trefethen, Approximation Theory and Approximation Practice, 2013, chapters 2-3). A coefficient array has
one axis per dimension, of length degree + 1, in the order of the dimensions; as a vector it is flattened in C order
(the last dimension runs fastest). ``lower`` and ``upper`` (d,) are the box, ``degrees`` the degree of each of its
dimensions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from vrsopt.errors import InputError
from vrsopt.surrogate.box import check_inside

Array = NDArray[np.float64]
BOX_TOLERANCE = 1e-6  # of a range: what an NLP solver oversteps its bounds by


def nodes(lower: float, upper: float, degree: int) -> Array:
    """The degree + 1 interpolation points of one dimension, ascending."""
    if degree < 0 or not lower < upper:
        raise InputError(f"chebyshev: degree = {degree} on {lower} to {upper}: degree >= 0 and lower < upper")
    t = -np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    return lower + (upper - lower) * (t + 1.0) / 2.0


def grid(lower: Sequence[float] | Array, upper: Sequence[float] | Array, degrees: Sequence[int]) -> Array:
    """All nodes of the box as points (n1, n2, ..., d), n = degree + 1, for tabulating a function."""
    axes = [nodes(*bounds) for bounds in zip(lower, upper, degrees, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def transform(degree: int) -> Array:
    """Matrix (degree + 1, degree + 1) from values at the nodes of one dimension to its coefficients."""
    size = degree + 1
    angle = np.pi * (np.arange(size)[::-1] + 0.5) / size
    weights = np.where(np.arange(size) == 0, 1.0, 2.0) / size
    cosines: Array = np.cos(np.outer(np.arange(size), angle))
    return weights[:, None] * cosines


def coefficients(values: Array, dimensions: int) -> Array:
    """Coefficients from ``values`` at the nodes: the last ``dimensions`` axes are the box, those before are a batch."""
    result = np.asarray(values, dtype=float)
    if not 1 <= dimensions <= result.ndim:
        raise InputError(f"chebyshev: dimensions = {dimensions}: 1 to {result.ndim} for values of this shape")
    for axis in range(result.ndim - dimensions, result.ndim):
        matrix = transform(result.shape[axis] - 1)
        result = np.moveaxis(np.moveaxis(result, axis, -1) @ matrix.T, -1, axis)
    return result


def basis(points: Array, lower: float, upper: float, degree: int) -> Array:
    """T_0 ... T_degree of one dimension at ``points`` (...): (..., degree + 1). Polynomials: valid outside the box."""
    t = 2.0 * (np.asarray(points, dtype=float) - lower) / (upper - lower) - 1.0
    return np.asarray(np.polynomial.chebyshev.chebvander(t, degree), dtype=np.float64)


def evaluate(table: Array, points: Array, *, lower: ArrayLike, upper: ArrayLike, extrapolate: bool = False) -> Array:
    """The polynomial at ``points`` (..., k, d): (..., k).

    ``table`` (..., n1, ..., nd) coefficients; its leading axes broadcast against those of ``points``: one table per
    node with candidates of its own (N, ...) and (N, k, d), or m tables at common points (m, ...) and (k, d).
    Raises :class:`InputError` for a point outside the box unless ``extrapolate``.
    """
    low, high = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
    dimensions = points.shape[-1]
    if low.shape != (dimensions,) or high.shape != (dimensions,) or table.ndim < dimensions:
        raise InputError(f"chebyshev: bounds {low.shape}, {high.shape} and table {table.shape} for {dimensions} inputs")
    if not extrapolate:
        _check_box(points, low, high)
    sizes = table.shape[-dimensions:]
    values = [basis(points[..., k], low[k], high[k], sizes[k] - 1) for k in range(dimensions)]
    # The leading dimensions of the box are kept in one axis: (..., n1 * ... * n(k-1), nk, points).
    result = table.reshape(*table.shape[:-dimensions], -1, sizes[-1]) @ np.swapaxes(values[-1], -1, -2)
    for k in reversed(range(dimensions - 1)):
        folded = result.reshape(*result.shape[:-2], -1, sizes[k], result.shape[-1])
        result = np.einsum("...qnp,...pn->...qp", folded, values[k])
    return result[..., 0, :]


def low_total_degree(degrees: Sequence[int], total: float) -> Array:
    """Which coefficients (n1, ..., nd) of a tensor have sum_k index_k / degree_k <= ``total``.

    The others of a smooth function are small: with a total of 1.3 half of the tensor can be left out.
    """
    axes = np.meshgrid(*(np.arange(degree + 1) / degree for degree in degrees), indexing="ij")
    return np.asarray(sum(axes) <= total + 1e-9)


def expression(
    table: Any,
    point: Sequence[Any],
    degrees: Sequence[int],
    *,
    lower: Sequence[float],
    upper: Sequence[float],
    kept: Array | None = None,
) -> Any:
    """The polynomial as a CasADi expression.

    ``table``: coefficient vector (SX, MX or DM column, C order: last dimension fastest); ``point``: one scalar
    expression per dimension; ``kept`` (n1, ..., nd): coefficients that are not zero, default all. One multiplication
    per kept coefficient: the last dimension is contracted first.
    """
    size = math.prod(degree + 1 for degree in degrees)
    if table.numel() != size or not len(point) == len(degrees) == len(lower) == len(upper):
        raise InputError(f"chebyshev: {table.numel()} coefficients, {len(point)} inputs: degrees {tuple(degrees)}")
    table = _without_zeros(table, degrees, kept)
    for k in reversed(range(len(degrees))):
        t = 2.0 * (point[k] - lower[k]) / (upper[k] - lower[k]) - 1.0
        polynomials = [t * 0 + 1, t]
        while len(polynomials) <= degrees[k]:
            polynomials.append(2.0 * t * polynomials[-1] - polynomials[-2])
        row = ca.horzcat(*polynomials[: degrees[k] + 1])
        # CasADi reshapes by columns: one column per combination of the leading dimensions, in C order.
        table = ca.mtimes(row, ca.reshape(table, degrees[k] + 1, -1)).T
    return table


def quadratic(
    table: Any,
    point: Sequence[Any],
    centre: Sequence[Any],
    degrees: Sequence[int],
    *,
    lower: Sequence[float],
    upper: Sequence[float],
    kept: Array | None = None,
) -> Any:
    """Second-order Taylor polynomial about ``centre`` of :func:`expression`, at ``point``, as a CasADi expression.

    At the centre value, first and second derivatives are those of the polynomial itself, and each costs one contraction
    with derivatives of T_n instead of a pass of automatic differentiation. Other arguments as :func:`expression`.
    ``table``, ``degrees`` and ``kept`` are these.
    """
    contracted: dict[tuple[int, ...], Any] = {(): _without_zeros(table, degrees, kept)}
    for k in reversed(range(len(degrees))):
        rows = _basis_jet(centre[k], degrees[k], lower[k], upper[k])
        contracted = {
            (order, *others): ca.mtimes(rows[order], ca.reshape(part, degrees[k] + 1, -1)).T
            for others, part in contracted.items()
            for order in range(3 - sum(others))
        }
    away = [p - c for p, c in zip(point, centre, strict=True)]
    total = 0.0
    for orders, derivative in contracted.items():
        term = derivative
        for order, distance in zip(orders, away, strict=True):
            term = term * distance**order / math.factorial(order)
        total += term
    return total


def _basis_jet(x: Any, degree: int, lower: float, upper: float) -> list[Any]:
    """T_0 ... T_degree at ``x`` as a row, and their first and second derivatives by ``x``."""
    scale = 2.0 / (upper - lower)
    t = scale * (x - lower) - 1.0
    values, first, second = [1.0, t], [0.0, 1.0], [0.0, 0.0]
    for n in range(2, degree + 1):
        second.append(4.0 * first[n - 1] + 2.0 * t * second[n - 1] - second[n - 2])
        first.append(2.0 * values[n - 1] + 2.0 * t * first[n - 1] - first[n - 2])
        values.append(2.0 * t * values[n - 1] - values[n - 2])
    jets = [(values, 1.0), (first, scale), (second, scale**2)]
    return [factor * ca.sparsify(ca.horzcat(*(ca.SX(v) for v in row[: degree + 1]))) for row, factor in jets]


def _without_zeros(table: Any, degrees: Sequence[int], kept: Array | None) -> Any:
    """The coefficient vector with only those in ``kept`` as structural non-zeros."""
    if kept is None:
        return table
    rows = np.flatnonzero(kept.ravel()).tolist()
    size = math.prod(degree + 1 for degree in degrees)
    return ca.project(table, ca.Sparsity.triplet(size, 1, rows, [0] * len(rows)))


def contract(table: Array, axes: Sequence[int], points: Array, *, lower: ArrayLike, upper: ArrayLike) -> Array:
    """Coefficients in the other dimensions with those in ``axes`` fixed at ``points`` (N, len(axes)).

    ``table`` (n1, ..., nd); ``lower`` and ``upper`` (len(axes),) are the bounds of the fixed dimensions. The result is
    (N, the remaining axes in their order): (n1, n2, n3, n4) with axes (0, 1) becomes (N, n3, n4). An axis that is not
    fixed may also be a list of outputs. Raises :class:`InputError` for a point outside the box.
    """
    low, high = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
    if points.ndim != 2 or not points.shape[1] == len(axes) == low.size == high.size:
        raise InputError(f"chebyshev: points {points.shape}: expected (N, {len(axes)}), and as many bounds")
    if len(set(axes)) != len(axes) or not all(0 <= axis < table.ndim for axis in axes):
        raise InputError(f"chebyshev: axes = {tuple(axes)}: different axes of a table {table.shape}")
    _check_box(points, low, high)
    result = np.moveaxis(table, axes, range(len(axes)))
    for k, axis in enumerate(axes):
        values = basis(points[:, k], low[k], high[k], table.shape[axis] - 1)
        result = np.tensordot(values, result, axes=1) if k == 0 else np.einsum("na,na...->n...", values, result)
    return result


def _check_box(points: Array, lower: Array, upper: Array) -> None:
    names = [f"input {k}" for k in range(len(lower))]
    check_inside(points, lower, upper, tolerance=BOX_TOLERANCE, names=names, model="chebyshev", box="tabulated")
