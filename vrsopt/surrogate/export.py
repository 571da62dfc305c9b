"""Kriging in optimal control: as a CasADi function of N points, and reduced to polynomials along a path.

Two forms, both with exact first and second derivatives. "callback" is the Kriging itself, evaluated by numpy.
"chebyshev" is a polynomial for each point in a window, made of CasADi operations alone, so that it can be saved and
compiled; what it neglects is measured. Inputs that are known at the points fold into weights or coefficients before.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.surrogate import chebyshev
from vrsopt.surrogate.callback import pointwise
from vrsopt.surrogate.checks import check_bounds
from vrsopt.surrogate.kriging import Array, Kriging
from vrsopt.surrogate.reduced import Reduced, reduce
from vrsopt.surrogate.state import KrigingState, factors

FREE = ("mass", "rotor_speed", "twist")
METHODS = ("callback", "chebyshev")
SMOOTHING = 0.1  # eps of the exponential correlation in an NLP
TOLERANCE = 1e-5  # of the mean: what each input's neglected degrees may amount to
NEGLIGIBLE = 1e-8  # of the mean: coefficients that are left out
MOST_DEGREES = 20
MOST_COEFFICIENTS = 60_000  # of one polynomial
CHECKS = 2_000  # random points at which the error is measured
TOUCH = 1e-3  # of a window: an interior-point solution on its edge is this near to it
BLOCK = 2_000_000  # numbers in a work array at a time

logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Exported:
    """The mean of a Kriging at N points as CasADi ``function`` of the ``free`` inputs: (f, N) -> (1, N).

    In physical units. ``lower``, ``upper`` (f,): the window it is made for, inside the sampled box ``box`` (2, f).
    ``error``: root mean square of its difference from the exact mean at random points of the window, over that of the
    mean itself; ``largest_error``: the largest difference over the same. Both are 0 for a callback. Bound the variables
    of the NLP by the window; :meth:`check` tells afterwards whether it has cut off the solution.
    """

    function: ca.Function
    free: tuple[str, ...]
    lower: Array
    upper: Array
    box: Array
    error: float = 0.0
    largest_error: float = 0.0

    def __call__(self, x: Any) -> Any:
        return self.function(x)

    def check(self, solution: ArrayLike) -> None:
        """Raise :class:`NoSolutionError` for a ``solution`` (f, N) that the window has shaped.

        That is: a value outside the window or, on a side on which it is narrower than the box, one that touches it.
        Raises :class:`InputError` for another shape.
        """
        x = np.array(solution, dtype=float)
        if x.shape != self.function.size_in(0):
            raise InputError(f"check: solution has shape {x.shape}: expected {self.function.size_in(0)}")
        width = (self.upper - self.lower)[:, None]
        away = np.stack([x - self.lower[:, None], self.upper[:, None] - x]) / width
        narrow = np.stack([self.lower > self.box[0], self.upper < self.box[1]])
        wrong = ~(away > np.where(narrow, TOUCH, -chebyshev.BOX_TOLERANCE)[:, :, None])
        if np.any(wrong):
            side, k, node = np.unravel_index(int(np.argmin(np.where(wrong, away, np.inf))), wrong.shape)
            window = "window" if narrow[side, k] else "sampled box"
            share = 100.0 * away[side, k, node]
            place = "inside" if share >= 0 else "beyond"
            raise NoSolutionError(
                f"surrogate: {self.free[k]} = {x[k, node]:g} at node {node}: {abs(share):.2g} % of the width "
                f"{place} an end of the {window} {self.lower[k]:g} to {self.upper[k]:g}: the optimum may lie elsewhere"
            )


def to_casadi(
    kriging: Kriging,
    *,
    method: str = "callback",
    fixed: Mapping[str, ArrayLike] | None = None,
    free: Sequence[str] | None = None,
    size: int | None = None,
    window: Mapping[str, tuple[float, float]] | None = None,
    degrees: Sequence[int] | None = None,
) -> Exported:
    """The mean at N points as CasADi function ``mean(x) -> y``, x (f, N) the ``free`` inputs, y (1, N).

    ``fixed``: (N,) each, by name; without any, ``size`` is N. ``free``: names in the order of the rows of x, by default
    those that are not fixed, as the model has them. ``window``: (low, high) of free inputs, default the box; it may be
    narrower for the sake of ``degrees`` (of "chebyshev"; one per free input, by default as many as the mean needs).

    An exponential correlation is replaced by its smoothed variant (eps 0.1, weights solved again), which is logged. A
    callback needs this process; a Chebyshev form can be serialised, and has at most 60000 coefficients. ``method``:
    "callback" or "chebyshev", polynomials. Raises :class:`InputError` for inputs, windows or degrees that do not fit
    the model.
    """
    if method not in METHODS:
        raise InputError(f"to_casadi: method = {method!r}: one of {', '.join(METHODS)}")
    kriging = _smooth(kriging)
    given = {} if fixed is None else fixed
    names = kriging.state_.names
    reduced = reduce(kriging, given, [name for name in names if name not in given] if free is None else free)
    count = _size(reduced, size)
    lower, upper = _window(kriging, reduced, window or {})
    frame: dict[str, Any] = {"free": reduced.free, "box": np.stack([reduced.lower, reduced.upper])}
    if method == "callback":
        if degrees is not None:
            raise InputError("to_casadi: degrees: of the method 'chebyshev' only")
        return Exported(pointwise("mean", reduced, len(reduced.free), count), lower=lower, upper=upper, **frame)
    if degrees is None:
        degrees = _degrees(reduced, lower, upper)
    table = _tables(reduced, lower, upper, _checked_degrees(degrees, reduced.free))
    points, exact = _check_points(reduced, lower, upper)
    magnitude = float(np.sqrt(np.mean(exact**2)))
    kept = np.max(np.abs(table), axis=0) > NEGLIGIBLE * magnitude
    table = np.where(kept, table, 0.0)
    error = chebyshev.evaluate(table, points, lower=lower, upper=upper, extrapolate=True) - exact
    errors = {"error": np.sqrt(np.mean(error**2)) / magnitude, "largest_error": np.max(np.abs(error)) / magnitude}
    return Exported(_polynomials(table, kept, count, lower, upper), lower=lower, upper=upper, **frame, **errors)


def path_coefficients(
    kriging: Kriging,
    fixed: Mapping[str, ArrayLike],
    free_lower: ArrayLike,
    free_upper: ArrayLike,
    degrees: Sequence[int],
    *,
    free: Sequence[str] = FREE,
) -> Array:
    """Chebyshev coefficients of the mean in the ``free`` variables at N points of the ``fixed`` ones.

    ``fixed``: (N,) each, by name; ``free_lower``, ``free_upper``, ``degrees``: one per free variable. Result
    (N, d1 + 1, d2 + 1, ...), in the order of ``free``, for ``chebyshev.expression`` and ``chebyshev.evaluate``.
    An exponential correlation is smoothed as in :func:`to_casadi`. Raises :class:`InputError` for an input that is
    missing, named twice or outside the box.
    """
    lower, upper = np.asarray(free_lower, dtype=float), np.asarray(free_upper, dtype=float)
    if not len(free) == len(degrees) == lower.size == upper.size:
        raise InputError(f"path: {len(degrees)} degrees, {lower.size} and {upper.size} bounds: {len(free)} of each")
    reduced = reduce(_smooth(kriging), fixed, free)
    _check_free(kriging, reduced, np.stack([lower, upper]))
    return _tables(reduced, lower, upper, degrees)


def path_predict(
    kriging: Kriging, fixed: Mapping[str, ArrayLike], free_values: Array, *, free: Sequence[str] = FREE
) -> Array:
    """Exact mean for k candidates at each of N points of the ``fixed`` variables.

    ``fixed``: (N,) each, by name; ``free_values`` (N, k, number of free) in the order of ``free``. Result (N, k).
    The correlation is that of ``kriging``: an exponential one is not smoothed. Raises as :func:`path_coefficients`.
    """
    candidates = np.asarray(free_values, dtype=float)
    reduced = reduce(kriging, fixed, free)
    nodes = len(reduced.weights)
    if candidates.ndim != 3 or candidates.shape[::2] != (nodes, len(free)):
        raise InputError(f"path: free values {candidates.shape}: expected ({nodes}, k, {len(free)})")
    _check_free(kriging, reduced, candidates)
    return reduced.values(candidates)


def _smooth(kriging: Kriging) -> Kriging:
    state: KrigingState = kriging.state_
    if state.correlation == "exponential" and state.smoothing == 0.0:
        logger.warning("exponential correlation has kinks: smoothed with eps = %g for the NLP", SMOOTHING)
        return kriging.smoothed(SMOOTHING)
    return kriging


def _size(reduced: Reduced, size: int | None) -> int:
    nodes = len(reduced.weights) if reduced.fixed else size
    if nodes is None or nodes < 1 or size not in (None, nodes):
        raise InputError(f"to_casadi: size = {size}: the number of points, {nodes or 'as nothing is fixed'}")
    return nodes


def _window(kriging: Kriging, reduced: Reduced, window: Mapping[str, tuple[float, float]]) -> tuple[Array, Array]:
    lower, upper = reduced.lower.copy(), reduced.upper.copy()
    for name, (low, high) in window.items():
        if name not in reduced.free:
            raise InputError(f"to_casadi: window of {name!r}: one of the free inputs {', '.join(reduced.free)}")
        if not low < high:
            raise InputError(f"to_casadi: window of {name} = {low} to {high}: low < high")
        k = reduced.free.index(name)
        lower[k], upper[k] = low, high
    _check_free(kriging, reduced, np.stack([lower, upper]))
    return lower, upper


def _check_free(kriging: Kriging, reduced: Reduced, points: Array) -> None:
    if not kriging.extrapolate:
        check_bounds(reduced.free, reduced.lower, reduced.upper, points)


def _checked_degrees(degrees: Sequence[int], free: Sequence[str]) -> Sequence[int]:
    if len(degrees) != len(free) or any(degree < 1 for degree in degrees):
        raise InputError(f"to_casadi: degrees = {tuple(degrees)}: at least 1 for each of {', '.join(free)}")
    count = math.prod(degree + 1 for degree in degrees)
    if count > MOST_COEFFICIENTS:
        raise InputError(
            f"to_casadi: {count} coefficients of degrees {tuple(degrees)}: at most {MOST_COEFFICIENTS}; "
            "fix more inputs, give lower degrees or use the method 'callback'"
        )
    return degrees


def _random_points(reduced: Reduced, lower: Array, upper: Array, count: int) -> Array:
    """``count`` points for each node (N, count, f), the same each time."""
    shape = (len(reduced.weights), count, len(lower))
    return lower + (upper - lower) * np.random.default_rng(0).random(shape)


def _check_points(reduced: Reduced, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Random points (N, k, f) and the exact mean there (N, k)."""
    points = _random_points(reduced, lower, upper, -(-CHECKS // len(reduced.weights)))
    return points, reduced.values(points)


def _degrees(reduced: Reduced, lower: Array, upper: Array) -> list[int]:
    """Of each input, the least degree beyond which the mean along this input has less than ``TOLERANCE`` of itself."""
    result = []
    nodes = len(reduced.weights)
    some = np.unique(np.linspace(0, nodes - 1, min(nodes, 20)).astype(int))
    lines = -(-60 // len(some))
    for k in range(len(lower)):
        at = chebyshev.nodes(lower[k], upper[k], MOST_DEGREES)
        points = np.repeat(_random_points(reduced, lower, upper, lines)[some], len(at), axis=1)
        points[:, :, k] = np.tile(at, lines)
        values = Reduced(reduced.state, {n: v[some] for n, v in reduced.fixed.items()}, reduced.free).values(points)
        series = chebyshev.coefficients(values.reshape(-1, len(at)), 1)
        size = np.sqrt(np.mean(series**2, axis=0))
        tails = np.sqrt(np.cumsum(size[::-1] ** 2))[::-1]  # of this degree and all beyond
        needed = np.flatnonzero(tails > TOLERANCE * np.sqrt(np.mean(values**2)))
        result.append(max(1, int(needed[-1]) if len(needed) else 1))
    return result


def _tables(reduced: Reduced, lower: Array, upper: Array, degrees: Sequence[int]) -> Array:
    """Chebyshev coefficients (N, d1 + 1, ...): a matrix product over the separable terms."""
    series = []
    for k, column in enumerate(reduced.columns):
        at = chebyshev.nodes(lower[k], upper[k], degrees[k])
        scaled = (at - reduced.lower[k]) / (reduced.upper[k] - reduced.lower[k])
        series.append(chebyshev.coefficients(factors(reduced.state, column, scaled).T, 1))
    left = reduced.weights
    sizes = [degree + 1 for degree in degrees]
    result = np.zeros((len(left), math.prod(sizes)))
    step = max(1, BLOCK // result.shape[1])
    with threadpool_limits(limits=1, user_api="blas"):
        for begin in range(0, left.shape[1], step):
            rows = slice(begin, begin + step)
            right = np.ones((left[:, rows].shape[1], 1))
            for one in series:
                right = (right[:, :, None] * one[rows, None, :]).reshape(len(right), -1)
            result += left[:, rows] @ right
    result *= reduced.state.scale
    result[:, 0] += reduced.state.mean
    return result.reshape(len(left), *sizes)


def _polynomials(table: Array, kept: Array, count: int, lower: Any, upper: Any) -> ca.Function:
    """One polynomial for each column of x, or the same for all."""
    degrees = [size - 1 for size in kept.shape]
    used = np.flatnonzero(kept.ravel())
    chosen = ca.Sparsity.triplet(kept.size, 1, used.tolist(), [0] * len(used))
    x, c = ca.SX.sym("x", len(degrees)), ca.SX.sym("c", len(used))
    node_values = c if len(table) > 1 else ca.SX(ca.DM(table[0].ravel()[used]))
    value = chebyshev.expression(ca.SX(chosen, node_values), ca.vertsplit(x), degrees, lower=lower, upper=upper)
    columns = ca.MX.sym("x", len(degrees), count)
    if len(table) == 1:
        every = ca.Function("node", [x], [value]).map(count)(columns)
    else:
        node = ca.Function("node", [x, c], [value], {"is_diff_in": [True, False]})
        every = node.map(count)(columns, ca.DM(table.reshape(len(table), -1)[:, used].T))
    return ca.Function("mean", [columns], [every], ["x"], ["y"])
