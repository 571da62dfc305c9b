"""Pseudo-arclength continuation: a curve of roots of r(z, s) = 0 followed through its folds to a target value of s.

H. B. Keller (1977), Numerical solution of bifurcation and nonlinear eigenvalue problems; E. L. Allgower and K. Georg,
Introduction to Numerical Continuation Methods (1990): orientation by the sign of the bordered determinant (ch. 2),
steps controlled by contraction, first correction and angle (ch. 6.1).

A curve point is u = (z, w s): n unknowns and the parameter weighted so that both move alike at the start. Where the
parameter stops growing along the curve, Newton at fixed s has no root ahead, although the curve goes on: a fold.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isfinite, sqrt

import numpy as np
from scipy.linalg import LinAlgWarning, lu_factor, lu_solve

from vrsopt.solvers.newton import Factorisation, newton
from vrsopt.solvers.status import Status

LARGEST_STEP = 1.5  # along the curve, in scaled unknowns
FIRST_STEP, SMALLEST_STEP = 0.5, 1e-4
CONTRACTION, DISTANCE, ANGLE = 0.4, 0.6, 0.5  # wanted: second over first correction, first correction, turn [rad]
CORRECTIONS = 8  # at most, at one point of the curve
Equations = Callable[[np.ndarray, float], np.ndarray]


@dataclass(frozen=True)
class CurveResult:
    """End of a curve: ``root`` (n,) at the target parameter when ``status`` is CONVERGED, else its last point.

    ``folds``: parameter at the folds between the start and the end, in their order, by interpolation. ``parameters``
    (m,): of the points found on the curve, the start first. ``jacobians``: the effort. ``factorisation``: of r_z near
    the root. Other ends: OUT_OF_BOUNDS where ``admissible`` no longer held, INFEASIBLE when the curve came back to the
    parameter it started from, ITERATION_LIMIT when the effort was spent.
    """

    root: np.ndarray
    parameter: float
    status: Status
    folds: tuple[float, ...]
    jacobians: int
    parameters: np.ndarray
    factorisation: Factorisation | None


@dataclass(frozen=True)
class _Point:
    """A point of the curve with its unit tangent, oriented along the curve, and the bordered matrix's factors."""

    u: np.ndarray  # (n + 1,)
    tangent: np.ndarray  # (n + 1,)
    factorisation: Factorisation
    sign: float  # of the determinant of the bordered matrix: constant along a curve


class _Curve:
    """Equations in the weighted unknowns u, and the count of Jacobians."""

    def __init__(self, residual: Equations, jacobian: Equations) -> None:
        self._residual, self._jacobian = residual, jacobian
        self.weight, self.jacobians = 1.0, 0

    def residual(self, u: np.ndarray) -> np.ndarray:
        return self._residual(u[:-1], u[-1] / self.weight)

    def jacobian(self, u: np.ndarray) -> np.ndarray:
        """Derivative (n, n + 1) with respect to u."""
        self.jacobians += 1
        matrix = self._jacobian(u[:-1], u[-1] / self.weight).copy()
        matrix[:, -1] /= self.weight
        return matrix

    def start(self, z: np.ndarray, first: float, direction: float) -> _Point | None:
        """First point; its tangent dz/ds gives the parameter the weight with which both move alike."""
        derivative = self.jacobian(np.append(z, first))
        factorisation = _factorised(derivative[:, :-1])
        if factorisation is None:
            return None
        slope = float(np.linalg.norm(lu_solve(factorisation, derivative[:, -1], check_finite=False)))
        self.weight = slope if isfinite(slope) and slope > 0 else 1.0
        derivative[:, -1] /= self.weight
        border = np.append(np.zeros(len(z)), direction)
        return self._point(np.append(z, self.weight * first), derivative, border, None)

    def point(self, u: np.ndarray, before: _Point) -> _Point | None:
        """The point u of the curve, which comes after ``before``."""
        return self._point(u, self.jacobian(u), before.tangent, before.sign)

    def _point(self, u: np.ndarray, derivative: np.ndarray, border: np.ndarray, sign: float | None) -> _Point | None:
        factorisation = _factorised(np.vstack([derivative, border]))
        if factorisation is None:
            return None
        tangent = lu_solve(factorisation, np.eye(len(u))[-1], check_finite=False)
        size = float(np.linalg.norm(tangent))
        if not isfinite(size):
            return None
        tangent /= size
        # det [J; t] has the sign of det [J; border] times that of t . border > 0
        here = _determinant_sign(factorisation)
        if sign is not None and here != sign:
            tangent, here = -tangent, -here
        return _Point(u, tangent, factorisation, here)


def follow_curve(
    residual: Equations,
    jacobian: Equations,
    *,
    start: np.ndarray,
    first: float,
    target: float,
    tolerance: float = 1e-8,
    max_jacobians: int = 150,
    admissible: Callable[[np.ndarray], bool] | None = None,
) -> CurveResult:
    """Follow the roots of ``residual(z, s)`` (n,) from the root ``start`` (n,) at s = ``first`` to s = ``target``.

    ``jacobian(z, s)`` is (n, n + 1): [r_z, r_s]. Unknowns and residuals are scaled to order one. The root at the target
    is the first that the curve meets, solved to ``tolerance`` at exactly that parameter. The curve is given up where
    ``admissible(z)`` is false, where it comes back to where it started, or when the effort is spent. ``max_jacobians``:
    the effort.
    """
    curve = _Curve(residual, jacobian)
    here = curve.start(start, first, 1.0 if target >= first else -1.0)
    folds: list[float] = []
    z, parameters, step = start.copy(), [first], FIRST_STEP

    def ended(status: Status, lu: Factorisation | None = None) -> CurveResult:
        return CurveResult(z, parameters[-1], status, tuple(folds), curve.jacobians, np.array(parameters), lu)

    if here is None:
        return ended(Status.NOT_FINITE)
    while curve.jacobians < max_jacobians:
        step = min(step, LARGEST_STEP)
        there, factor = _step(curve, here, step, tolerance)
        met = None if there is None else _crossing(here, there, curve.weight * target)
        arrived = None if there is None or met is None else _arrival(curve, here, there, met, target, tolerance)
        if there is not None and met is not None and arrived is None:
            there, factor = None, 0.3  # the root at the target is not the one between these two points
        if there is not None:
            fold = _fold(here, there)
            if fold is not None and (met is None or fold[0] < met):
                folds.append(fold[1] / curve.weight)
        if arrived is not None:
            z, factorisation = arrived
            parameters.append(target)
            return ended(Status.CONVERGED, factorisation)
        step *= factor
        if there is None:
            if step < SMALLEST_STEP:
                return ended(Status.NO_PROGRESS)
            continue
        here, z = there, there.u[:-1]
        parameters.append(float(there.u[-1] / curve.weight))
        if admissible is not None and not admissible(z):
            return ended(Status.OUT_OF_BOUNDS)
        if (parameters[-1] - first) * (target - first) < 0:
            return ended(Status.INFEASIBLE)
    return ended(Status.ITERATION_LIMIT)


def _step(curve: _Curve, here: _Point, step: float, tolerance: float) -> tuple[_Point | None, float]:
    """Next point at arclength ``step``, or None; and the factor on the step (below 0.5 where it was refused)."""
    predicted = here.u + step * here.tangent
    u, first, contraction = _corrected(curve, here, predicted, tolerance)
    if u is None:
        return None, 0.4
    there = curve.point(u, here)
    if there is None:
        return None, 0.4
    angle = float(np.arccos(np.clip(here.tangent @ there.tangent, -1.0, 1.0)))
    excess = max(sqrt(contraction / CONTRACTION), sqrt(first / DISTANCE), angle / ANGLE, 0.5)
    if excess > 2.0 and step > 10 * SMALLEST_STEP:
        return None, max(1 / excess, 0.25)
    return there, 1 / excess


def _corrected(
    curve: _Curve, here: _Point, predicted: np.ndarray, tolerance: float
) -> tuple[np.ndarray | None, float, float]:
    """Newton steps back to the curve, normal to the tangent; the point, the first correction and the contraction.

    The factors of the point before serve first, then those of the point where they no longer contract.
    """
    u, lu, last, first, contraction = predicted, here.factorisation, inf, 0.0, 0.0
    fresh = False
    for count in range(CORRECTIONS):
        r = curve.residual(u)
        if not np.all(np.isfinite(r)):
            return None, inf, inf
        if np.max(np.abs(r)) < tolerance:
            return u, first, contraction
        correction = -lu_solve(lu, np.append(r, here.tangent @ (u - predicted)), check_finite=False)
        size = float(np.linalg.norm(correction))
        if count and size > 0.3 * last:
            if size > last and fresh:
                return None, inf, inf
            known = _factorised(np.vstack([curve.jacobian(u), here.tangent]))
            if known is None:
                return None, inf, inf
            lu, fresh = known, True
            correction = -lu_solve(lu, np.append(r, here.tangent @ (u - predicted)), check_finite=False)
            size = float(np.linalg.norm(correction))
        if not isfinite(size) or size > 2 * LARGEST_STEP:
            return None, inf, inf
        if count == 0:
            first = size
        elif count == 1:
            contraction = size / max(last, 1e-12)
        u, last = u + correction, size
    return None, inf, inf


def _cubic(here: _Point, there: _Point) -> np.ndarray:
    """Coefficients (4, n + 1), constant first, of the Hermite cubic between two points over their chord's length."""
    length = float(np.linalg.norm(there.u - here.u))
    a, b, c, d = here.u, length * here.tangent, there.u, length * there.tangent
    return np.array([a, b, 3 * (c - a) - 2 * b - d, 2 * (a - c) + b + d])


def _crossing(here: _Point, there: _Point, target: float) -> float | None:
    """First place between two points, 0..1, where the weighted parameter meets its target."""
    coefficients = _cubic(here, there)[:, -1].copy()
    coefficients[0] -= target
    roots = np.polynomial.polynomial.polyroots(np.trim_zeros(coefficients, "b")) if coefficients.any() else np.zeros(1)
    inside = sorted(float(root.real) for root in roots if abs(root.imag) < 1e-9 and 0.0 <= root.real <= 1.0)
    if inside:
        return inside[0]
    return 1.0 if there.u[-1] == target else None


def _fold(here: _Point, there: _Point) -> tuple[float, float] | None:
    """Place between two points, 0..1, where the weighted parameter turns back, and its value there."""
    if here.tangent[-1] * there.tangent[-1] >= 0:
        return None
    cubic = np.polynomial.Polynomial(_cubic(here, there)[:, -1])
    places: list[complex] = cubic.deriv().roots().tolist()
    inside = [place.real for place in places if 0.0 <= place.real <= 1.0]
    return (inside[0], float(cubic(inside[0]))) if inside else None


def _arrival(
    curve: _Curve, here: _Point, there: _Point, fraction: float, target: float, tolerance: float
) -> tuple[np.ndarray, Factorisation | None] | None:
    """Root at the target near the interpolated point; None if Newton goes elsewhere."""
    guess = (fraction ** np.arange(4) @ _cubic(here, there))[:-1]

    def square(z: np.ndarray) -> np.ndarray:
        return curve.jacobian(np.append(z, curve.weight * target))[:, :-1]

    result = newton(
        lambda z: curve.residual(np.append(z, curve.weight * target)), square, start=guess, tolerance=tolerance
    )
    near = float(np.linalg.norm(result.root - guess)) <= 0.5 * float(np.linalg.norm(there.u - here.u))
    return (result.root, result.factorisation) if result.status is Status.CONVERGED and near else None


def _factorised(matrix: np.ndarray) -> Factorisation | None:
    if not np.all(np.isfinite(matrix)):
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LinAlgWarning)  # a singular matrix shows in the steps
        return lu_factor(matrix, check_finite=False)


def _determinant_sign(factorisation: Factorisation) -> float:
    lu, pivots = factorisation
    swaps = int(np.sum(pivots != np.arange(len(pivots))))
    return float(np.prod(np.sign(np.diag(lu)))) * (-1.0 if swaps % 2 else 1.0)
