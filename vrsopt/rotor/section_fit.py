"""Fit of the smooth section of :mod:`vrsopt.rotor.airfoil` to a deck of tables, by least squares.

Lift and drag are fitted one after the other over all Mach numbers at once, each coefficient being a polynomial in Mach
number that starts from what the deck itself shows (slope, break, drag rise); the moment then follows linearly. The
attached range counts most.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import casadi as ca
import numpy as np
from numpy.polynomial import polynomial as npoly
from scipy.optimize import least_squares

from vrsopt.errors import NoSolutionError
from vrsopt.quantity import Provenance
from vrsopt.rotor.airfoil import NACA_0012_SOURCE, NACA_0012_STALL, Airfoil
from vrsopt.rotor.c81 import QUANTITIES, Deck, Table
from vrsopt.rotor.section_points import (
    CENTRE,
    HIGHEST_DRAG_MACH,
    HIGHEST_MACH,
    WIDTH,
    Points,
    check,
    columns,
    drag_start,
    lift_start,
    points_of,
)

LIFT_DEGREES = {
    "lift_slope": 5,
    "zero_lift_sine": 2,
    "break_sine": 4,
    "log_break_width": 2,
    "negative_break_sine": 3,
    "log_negative_break_width": 2,
    "separated_lift": 2,
    "separated_width": 0,
}
DRAG_DEGREES = {
    "drag_level": 3,
    "drag_parabola": 2,
    "drag_bucket_sine": 2,
    "ramp_sine": 5,
    "ramp_slope": 4,
    "log_ramp_width": 4,
    "negative_ramp_sine": 4,
    "negative_ramp_slope": 3,
    "log_negative_ramp_width": 2,
}
MOMENT_DEGREES = {
    "moment_level": 4,
    "moment_slope": 4,
    "separated_moment": 0,
    "separated_moment_cosine": 2,
    "reversed_moment": 0,
}
RANGES = {"attached": (-4.0, 10.0), "stall": (-12.0, 19.0)}  # deg, of the errors reported
# Largest error where attached that passes without a word; the shipped aircraft's NACA 23012 has 0.044, 0.011, 0.015.
LARGEST_ERROR = {"lift": 0.05, "drag": 0.02, "moment": 0.03}
EVALUATIONS = 400
SETTLING = 100  # further ones, among which a step must change the cost by less than this part of it:
SETTLED = 3e-5


@dataclass(frozen=True)
class FitError:
    """Error of one coefficient at one Mach number of the deck: root mean square over each of ``RANGES``, and the mean
    and the largest one where attached."""

    quantity: str
    mach: float
    attached: float
    stall: float
    bias: float
    largest: float


@dataclass(frozen=True)
class SectionFit:
    """How closely a fitted section follows its deck; prints as a table."""

    name: str
    errors: tuple[FitError, ...]

    def worst(self, quantity: str) -> FitError:
        """The entry of "lift", "drag" or "moment" with the largest error where attached."""
        return max((e for e in self.errors if e.quantity == quantity), key=lambda e: e.largest)

    def __str__(self) -> str:
        lines = [
            f"{self.name}: fit less deck, attached {RANGES['attached']}, stall {RANGES['stall']} deg",
            "coefficient  Mach   rms attached  rms stall  mean attached  largest attached",
        ]
        for e in self.errors:
            lines.append(
                f"{e.quantity:11s}  {e.mach:4.2f}   {e.attached:12.4f}  {e.stall:9.4f}"
                f"  {e.bias:13.4f}  {e.largest:16.4f}"
            )
        return "\n".join(lines)


def fit_section(deck: Deck) -> tuple[Airfoil, SectionFit]:
    """Section fitted to ``deck`` and the errors of the fit.

    The time constants of dynamic stall are those of NACA 0012, except for the critical normal force, which follows the
    break of the section's own lift. Coefficients are rounded to six digits. Raises :class:`InputError` where the tables
    can not carry a fit, :class:`NoSolutionError` where the search does not settle; one line names deck and table.
    """
    check(deck)
    values: dict[str, list[float]] = {name: [0.0] for name in (*LIFT_DEGREES, *DRAG_DEGREES, *MOMENT_DEGREES)}
    name = deck.name or "deck"
    points = points_of(deck.lift, (-20.0, 19.9), HIGHEST_MACH)
    values |= _fit(points, values, lift_start(deck.lift), LIFT_DEGREES, "lift", name)
    points = points_of(deck.drag, (-90.0, 90.0), HIGHEST_DRAG_MACH, between=True)
    values |= _fit(points, values, drag_start(deck.drag), DRAG_DEGREES, "drag", name)
    section = _section(values, deck.name, drag_reference=0.0)
    level = float(section.coefficients(0.0, 1.0, 0.3, 0.0)[1])
    section = section.replaced(
        drag_reference=round(level, 5),
        critical_normal_force=_critical_normal_force(section, deck.lift),
        **_fit_moment(deck.moment, section),
    )
    return section, section_fit(section, deck)


def section_fit(section: Airfoil, deck: Deck) -> SectionFit:
    """Errors of ``section`` against the tables of ``deck`` at its Mach numbers between 0.2 and 0.8.

    Raises :class:`InputError` as :func:`fit_section` does.
    """
    check(deck)
    errors = []
    for k, (quantity, table) in enumerate(zip(QUANTITIES, (deck.lift, deck.drag, deck.moment), strict=True)):
        points = points_of(table, RANGES["stall"], HIGHEST_MACH)
        state = ca.SX.sym("state", 3)
        model = section.coefficients(state[0], state[1], state[2], section.drag_reference)[k]
        error = ca.Function("model", [state], [model])(points.state).full().ravel() - points.value
        angle = np.degrees(points.alpha)
        close = (angle >= RANGES["attached"][0] - 1e-9) & (angle <= RANGES["attached"][1] + 1e-9)
        for mach in np.unique(points.mach):
            here = points.mach == mach
            near = error[here & close]
            errors.append(
                FitError(quantity, float(mach), _rms(near), _rms(error[here]), float(near.mean()), np.abs(near).max())
            )
    return SectionFit(deck.name, tuple(errors))


def _critical_normal_force(section: Airfoil, table: Table) -> list[float]:
    """Normal force where separation has taken the part of the attached lift that goes with 30 % of separated chord.

    For NACA 0012 that is Leishman and Beddoes's critical normal force.
    """
    part = ((1 + 0.7**0.5) / 2) ** 2
    alpha, state = np.radians(np.linspace(0.5, 30, 591)), ca.SX.sym("state", 3)
    m = state[2]
    slope, zero = section.attached_lift(m)
    attached = slope * (state[0] * ca.sqrt(1 - zero**2) - state[1] * zero)
    lift, drag, _ = section.coefficients(state[0], state[1], m, section.drag_reference)
    normal = lift * state[1] + drag * state[0]
    function = ca.Function("normal", [state], [ca.vertcat(normal, attached)])
    mach = columns(table)[0]
    forces = []
    for value in mach:
        force, attached = function(np.vstack([np.sin(alpha), np.cos(alpha), np.full_like(alpha, value)])).full()
        broken = (force < part * attached) & (force > 0.1)
        forces.append(float(force[np.argmax(broken)]) if broken.any() else float(force.max()))
    return [float(f"{c:.4g}") for c in npoly.polyfit(mach, forces, min(3, len(mach) - 1))]


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _section(values: dict[str, list[float]], name: str, **others: Any) -> Airfoil:
    """A section of fitted coefficients with the dynamic stall of NACA 0012."""
    data = {**values, **NACA_0012_STALL, **others}
    published = set(NACA_0012_STALL) - {"critical_normal_force"}  # that one follows the deck
    provenance = {
        key: Provenance(unit="-", source=NACA_0012_SOURCE if key in published else name or "deck") for key in data
    }
    return Airfoil.model_validate({**data, "provenance": provenance})


def _fit(
    points: Points,
    known: dict[str, list[float]],
    start: dict[str, tuple[float, ...]],
    degrees: dict[str, int],
    quantity: str,
    name: str,
) -> dict[str, list[float]]:
    """The coefficients named in ``degrees`` as polynomials in Mach number, constant term first, rounded."""
    highest = len(np.unique(points.mach)) - 1
    degrees = {name: min(degree, highest) for name, degree in degrees.items()}
    sizes = [degree + 1 for degree in degrees.values()]
    matrix = _monomials(sizes)
    function = _function(known, degrees, quantity).map(len(points.alpha))
    x = ca.MX.sym("x", sum(sizes))
    model = function(points.state, ca.repmat(ca.DM(matrix) @ x, 1, len(points.alpha))).T
    evaluate, slopes = ca.Function("f", [x], [model]), ca.Function("j", [x], [ca.jacobian(model, x)])

    first = np.concatenate([np.pad(start[n], (0, max(0, d + 1 - len(start[n]))))[: d + 1] for n, d in degrees.items()])
    size = np.concatenate([np.full(degree + 1, abs(start[n][0])) for n, degree in degrees.items()])
    powers = np.concatenate([np.arange(degree + 1) for degree in degrees.values()])
    angle = np.degrees(points.alpha)
    # The pull towards the start keeps the high powers from wandering.
    if quantity == "lift":
        weight = np.where((angle > -5) & (angle < 11), 1 / 0.01, 1 / 0.04)
        pull = np.where(powers > 1, 1.5 / np.maximum(size, 0.1), 0.0)
        scale: str | np.ndarray = np.maximum(size, 0.05)
    else:
        is_width = np.concatenate([np.full(degree + 1, n.startswith("log_")) for n, degree in degrees.items()])
        importance = np.where((angle > -5) & (angle < 10), 1.0, np.where((angle > -9) & (angle < 20), 0.5, 0.1))
        weight = importance / (0.0008 + 0.05 * points.value)
        pull = np.where(powers > np.where(is_width, 0, 2), 0.3 / np.maximum(size, 0.05), 0.0)
        scale = "jac"

    def residual(z: np.ndarray) -> np.ndarray:
        return np.concatenate([(evaluate(z).full().ravel() - points.value) * weight, pull * (z - first)])

    def jacobian(z: np.ndarray) -> np.ndarray:
        return np.vstack([slopes(z).full() * weight[:, None], np.diag(pull)])

    search = partial(least_squares, residual, jac=jacobian, loss="soft_l1", x_scale=scale)
    best = search(first, max_nfev=EVALUATIONS)
    # In a flat valley the evaluations may end before its bottom; what they leave must be small.
    if best.status <= 0 and search(best.x, ftol=SETTLED, max_nfev=SETTLING).status <= 0:
        raise NoSolutionError(f"{name}: {quantity}: the fit does not settle in {EVALUATIONS} evaluations")
    return _split(matrix @ best.x, degrees)


def _fit_moment(table: Table, section: Airfoil) -> dict[str, list[float]]:
    """Linear in its coefficients once the weights of attached and of forward flow are known."""
    points = points_of(table, (-180.0, 180.0), HIGHEST_MACH)
    highest = len(np.unique(points.mach)) - 1
    degrees = {name: min(degree, highest) for name, degree in MOMENT_DEGREES.items()}
    matrix = _monomials([degree + 1 for degree in degrees.values()])
    known = {name: list(getattr(section, name)) for name in (*LIFT_DEGREES, *DRAG_DEGREES)}
    function = _function(known, degrees, "moment").map(len(points.alpha))
    x = ca.MX.sym("x", matrix.shape[0])
    model = function(points.state, ca.repmat(ca.DM(matrix) @ x, 1, len(points.alpha))).T
    slopes = ca.Function("j", [x], [ca.jacobian(model, x)])(0).full()
    weight = np.where(np.abs(points.alpha) < np.radians(13), 1.0, np.where(np.abs(points.alpha) < 0.35, 0.5, 0.1))
    best = np.linalg.lstsq(slopes * weight[:, None], points.value * weight, rcond=None)[0]
    return _split(matrix @ best, degrees)


def _function(known: dict[str, list[float]], degrees: dict[str, int], quantity: str) -> ca.Function:
    """One coefficient as a function of (sine, cosine, Mach number) and the coefficients named in ``degrees``."""
    sizes = [degree + 1 for degree in degrees.values()]
    parameters, point = ca.SX.sym("p", sum(sizes)), ca.SX.sym("point", 3)
    pieces = dict(zip(degrees, ca.vertsplit(parameters, np.cumsum([0, *sizes]).tolist()), strict=True))
    values: dict[str, Any] = {**known, **{name: ca.vertsplit(piece) for name, piece in pieces.items()}}
    section = Airfoil.model_construct(**values, drag_reference=0.0, provenance={})
    output = section.coefficients(point[0], point[1], point[2], 0.0)[QUANTITIES.index(quantity)]
    return ca.Function("section", [point, parameters], [output])


def _monomials(sizes: list[int]) -> np.ndarray:
    """Block matrix from coefficients of powers of (Mach - CENTRE) / WIDTH to those of powers of the Mach number."""
    matrix, first = np.zeros((sum(sizes), sum(sizes))), 0
    for size in sizes:
        for power in range(size):
            column = npoly.polypow([-CENTRE / WIDTH, 1 / WIDTH], power)
            matrix[first : first + power + 1, first + power] = column
        first += size
    return matrix


def _split(coefficients: np.ndarray, degrees: dict[str, int]) -> dict[str, list[float]]:
    pieces = np.split(coefficients, np.cumsum([degree + 1 for degree in degrees.values()])[:-1])
    return {name: [float(f"{c:.6g}") for c in piece] for name, piece in zip(degrees, pieces, strict=True)}
