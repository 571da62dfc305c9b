"""Checks of what a Kriging is given: tables, boxes, and whether the rows determine the trend.

``field`` and ``names``: how messages call what is checked; ``scaled`` (n, d): inputs; ``enhanced``: gradients are
fitted too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import issparse
from sklearn.utils import column_or_1d

from vrsopt.errors import InputError
from vrsopt.surrogate import trend as trends
from vrsopt.surrogate.box import check_inside
from vrsopt.surrogate.correlation import Array
from vrsopt.surrogate.gradient_enhanced import joint_basis
from vrsopt.surrogate.state import KrigingState

BOX_TOLERANCE = 1e-9  # of an input's range: rounding, not extrapolation


def one_of(field: str, value: str, allowed: Sequence[str]) -> None:
    """Raise :class:`InputError` unless ``value`` is ``allowed``."""
    if value not in allowed:
        raise InputError(f"kriging: {field} = {value!r}: one of {', '.join(allowed)}")


def table(field: str, values: Any) -> Array:
    """``values`` as a finite array (n, d), d > 0, that nobody else changes."""
    if issparse(values):
        raise InputError(f"kriging: {field} is sparse: sparse data is not supported, give a dense array")
    result = _real(field, values)
    if result.ndim != 2:
        raise InputError(f"kriging: {field} has {result.ndim} dimensions: (rows, inputs) expected. Reshape your data")
    if result.shape[1] == 0:
        raise InputError(f"kriging: {field}: 0 feature(s) (shape={result.shape}) while a minimum of 1 is required.")
    return result


def column_names(values: Any) -> tuple[str, ...] | None:
    """Names of the columns of a data frame, if all of them are texts.

    ``values``: a data frame, or what is none.
    """
    columns = tuple(getattr(values, "columns", ()))
    return columns if columns and all(isinstance(name, str) for name in columns) else None


def check_columns(columns: Sequence[str] | None, names: Sequence[str] | None) -> None:
    """Raise :class:`InputError` if both are known and differ: a data frame of other inputs, or in another order.

    ``columns``: of the data frame; ``names``: those of the fit.
    """
    if columns is not None and names is not None and tuple(columns) != tuple(names):
        raise InputError(f"kriging: X has columns {', '.join(columns)}: {', '.join(names)}, in this order, expected")


def column(values: Any) -> Array:
    """``values`` as a finite array (n,); a column (n, 1) is taken with scikit-learn's warning."""
    if values is None:
        raise InputError("kriging: Kriging requires y to be passed, but the target y is None")
    values = np.asarray(values)
    if values.ndim == 2 and values.shape[1] == 1:
        values = column_or_1d(values, warn=True)
    result = _real("y", values)
    if result.ndim != 1:
        raise InputError(f"kriging: y has shape {result.shape}: one output in each row expected")
    return result


def _real(field: str, values: ArrayLike) -> Array:
    """A copy as finite real numbers."""
    found = np.asarray(values)
    if np.iscomplexobj(found):
        raise InputError(f"kriging: {field}: Complex data not supported")
    result = np.array(found, dtype=float)
    bad = np.argwhere(~np.isfinite(result))
    if bad.size:
        place = tuple(bad[0].tolist())
        where = ", ".join(map(str, place))
        raise InputError(f"kriging: {field}[{where}] = {result[place]}: finite numbers only, neither NaN nor inf")
    return result


def check_rows(scaled: Array, trend: str, *, enhanced: bool) -> None:
    """Raise :class:`InputError` if the rows (n, d) do not determine the trend."""
    basis = joint_basis(scaled, trend) if enhanced else trends.basis(scaled, trend)
    if np.linalg.matrix_rank(basis) < basis.shape[1]:
        raise InputError(f"kriging: {len(scaled)} rows do not determine a {trend} trend: vary the inputs independently")


def check_size(size: int, dimensions: int, trend: str, *, enhanced: bool) -> None:
    """Raise :class:`InputError` for fewer rows than the trend needs and one to leave out.

    ``size``: rows; ``dimensions``: inputs.
    """
    needed = 1 + (dimensions + 1 if enhanced else trends.size(dimensions, trend))
    if size < needed:
        raise InputError(f"kriging: n_samples = {size}: at least {needed} for a {trend} trend in {dimensions} inputs")


def check_box(state: KrigingState, points: Array) -> None:
    """Raise :class:`InputError` for the first of ``points`` (..., d) outside the sampled box."""
    check_bounds(state.names, state.lower, state.upper, points)


def check_bounds(names: Sequence[str], lower: Array, upper: Array, points: Array) -> None:
    """Raise :class:`InputError` for the first of ``points`` (..., d) outside [lower, upper], or not a number."""
    check_inside(points, lower, upper, tolerance=BOX_TOLERANCE, names=names, model="kriging", box="sampled")
