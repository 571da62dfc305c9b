"""Checks of what a Kriging is given: tables, boxes, and whether the rows determine the trend."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from vrsopt.errors import InputError
from vrsopt.surrogate import trend as trends
from vrsopt.surrogate.correlation import Array
from vrsopt.surrogate.gradient_enhanced import joint_basis
from vrsopt.surrogate.state import KrigingState

BOX_TOLERANCE = 1e-9  # of an input's range: rounding, not extrapolation


def one_of(field: str, value: str, allowed: Sequence[str]) -> None:
    """Raise :class:`InputError` unless ``value`` is ``allowed``."""
    if value not in allowed:
        raise InputError(f"kriging: {field} = {value!r}: one of {', '.join(allowed)}")


def table(field: str, values: ArrayLike) -> Array:
    """``values`` as a finite array (n, d) that nobody else changes."""
    result = np.array(values, dtype=float)
    if result.ndim != 2:
        raise InputError(f"kriging: {field} has {result.ndim} dimensions: expected (rows, inputs)")
    if not np.all(np.isfinite(result)):
        row, column = np.unravel_index(int(np.argmin(np.isfinite(result))), result.shape)
        raise InputError(f"kriging: {field}[{row}, {column}] is not a finite number")
    return result


def check_rows(scaled: Array, trend: str, *, enhanced: bool) -> None:
    """Raise :class:`InputError` if the rows (n, d) do not determine the trend, with one row to spare."""
    size, dimensions = scaled.shape
    needed = 1 + (dimensions + 1 if enhanced else trends.size(dimensions, trend))
    if size < needed:
        raise InputError(f"kriging: {size} rows: at least {needed} for a {trend} trend in {dimensions} inputs")
    basis = joint_basis(scaled, trend) if enhanced else trends.basis(scaled, trend)
    if np.linalg.matrix_rank(basis) < basis.shape[1]:
        raise InputError(f"kriging: {size} rows: they do not determine a {trend} trend; vary the inputs independently")


def check_box(state: KrigingState, points: Array) -> None:
    """Raise :class:`InputError` for the first of ``points`` (..., d) outside the sampled box."""
    check_bounds(state.names, state.lower, state.upper, points)


def check_bounds(names: Sequence[str], lower: Array, upper: Array, points: Array) -> None:
    """Raise :class:`InputError` for the first of ``points`` (..., d) outside [lower, upper], or not a number."""
    margin = BOX_TOLERANCE * (upper - lower)
    inside = (points >= lower - margin) & (points <= upper + margin)
    if not np.all(inside):
        position = np.unravel_index(int(np.argmin(inside)), inside.shape)
        k = int(position[-1])
        raise InputError(
            f"kriging: {names[k]} = {points[position]:g}: outside the sampled box {lower[k]:g} to {upper[k]:g}"
        )
