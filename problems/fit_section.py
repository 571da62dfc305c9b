"""Fit the smooth section of vrsopt.rotor.airfoil to a deck of lift and drag tables, by least squares.

    python problems/fit_section.py deck.npz

The deck is a .npz file with, for each of cl and cd, angles of attack [deg] (n,) in ``c81_alpha_cl``, Mach numbers (m,)
in ``c81_mach_cl`` and the table (n, m) in ``c81_cl``. Lift and drag are fitted separately, each coefficient being a
polynomial in Mach number; the attached range counts most in lift, and drag is weighted by its own size. Prints the
errors by Mach number and the lines for the table [main_rotor.section] of an aircraft file.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from numpy.polynomial import polynomial as npoly
from scipy.optimize import least_squares

from vrsopt.rotor.airfoil import Airfoil

CENTRE, WIDTH = 0.5, 0.3  # the polynomials are fitted in (Mach - CENTRE) / WIDTH, which conditions the problem
ATTACHED = (-4.0, 10.0)  # deg
POST_STALL_BREAK = 20.0  # deg: the deck joins its large-angle table here with a jump in lift


@dataclass(frozen=True)
class Part:
    """One of the two fits: degree and start of each coefficient (the first two powers), and the data it sees."""

    table: str
    output: int  # 0 lift, 1 drag
    degrees: dict[str, int]
    start: dict[str, tuple[float, ...]]
    angles: tuple[float, float]  # deg
    highest_mach: float


LIFT = Part(
    table="cl",
    output=0,
    degrees={
        "lift_slope": 5,
        "zero_lift_sine": 2,
        "break_sine": 4,
        "log_break_width": 2,
        "negative_break_sine": 3,
        "log_negative_break_width": 2,
        "separated_lift": 2,
        "separated_width": 0,
    },
    start={
        "lift_slope": (6.0,),
        "zero_lift_sine": (-0.02,),
        "break_sine": (0.3, -0.12),
        "log_break_width": (-3.9,),
        "negative_break_sine": (-0.22,),
        "log_negative_break_width": (-3.5,),
        "separated_lift": (1.1,),
        "separated_width": (0.15,),
    },
    angles=(-20.0, 25.0),
    highest_mach=0.8,
)
DRAG = Part(
    table="cd",
    output=1,
    degrees={
        "drag_level": 3,
        "drag_parabola": 2,
        "drag_bucket_sine": 2,
        "ramp_sine": 4,
        "ramp_slope": 3,
        "log_ramp_width": 3,
        "negative_ramp_sine": 4,
        "negative_ramp_slope": 3,
        "log_negative_ramp_width": 2,
    },
    start={
        "drag_level": (0.0102,),
        "drag_parabola": (0.05,),
        "drag_bucket_sine": (-0.01,),
        "ramp_sine": (0.17, -0.12),
        "ramp_slope": (2.0,),
        "log_ramp_width": (-4.2,),
        "negative_ramp_sine": (-0.1, 0.06),
        "negative_ramp_slope": (1.5,),
        "log_negative_ramp_width": (-4.3,),
    },
    angles=(-90.0, 90.0),
    highest_mach=0.9,
)


def deck_points(deck: dict[str, np.ndarray], part: Part) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles [rad], Mach numbers and values (N,) of the deck inside the range that ``part`` is fitted on."""
    known, table = deck[f"c81_mach_{part.table}"], deck[f"c81_{part.table}"]
    # Halfway between its columns a deck is read linearly; for the drag, which rises steeply there, that is fitted too.
    grid = np.union1d(known, 0.5 * (known[:-1] + known[1:])) if part is DRAG else known
    table = np.array([np.interp(grid, known, row) for row in table])
    angles, machs = np.meshgrid(deck[f"c81_alpha_{part.table}"], grid, indexing="ij")
    inside = (angles >= part.angles[0]) & (angles <= part.angles[1]) & (machs >= 0.2) & (machs <= part.highest_mach)
    if part is LIFT:
        inside &= angles != POST_STALL_BREAK
    return np.radians(angles[inside]), machs[inside], table[inside]


def section_function(part: Part, count: int) -> ca.Function:
    """Lift or drag at ``count`` points as a function of their sine, cosine, Mach number and the coefficients."""
    sizes = [degree + 1 for degree in part.degrees.values()]
    parameters = ca.SX.sym("p", sum(sizes))
    pieces = dict(zip(part.degrees, ca.vertsplit(parameters, np.cumsum([0, *sizes]).tolist()), strict=True))
    other = DRAG if part is LIFT else LIFT
    values: dict[str, Any] = {name: ca.vertsplit(piece) for name, piece in pieces.items()}
    values |= {name: [start[0]] for name, start in other.start.items()}
    airfoil = Airfoil.model_construct(**values, drag_reference=0.0, provenance={})
    point = ca.SX.sym("point", 3)
    output = airfoil.coefficients(point[0], point[1], point[2], 0.0)[part.output]
    return ca.Function("section", [point, parameters], [output]).map(count)


def monomials(part: Part) -> np.ndarray:
    """Block matrix from the fitted coefficients, powers of (Mach - CENTRE) / WIDTH, to powers of the Mach number."""
    sizes = [degree + 1 for degree in part.degrees.values()]
    matrix, first = np.zeros((sum(sizes), sum(sizes))), 0
    for size in sizes:
        for power in range(size):
            column = npoly.polypow([-CENTRE / WIDTH, 1 / WIDTH], power)
            matrix[first : first + power + 1, first + power] = column
        first += size
    return matrix


def fit(deck: dict[str, np.ndarray], part: Part) -> dict[str, list[float]]:
    """The coefficients of ``part`` as polynomials in Mach number, constant term first, rounded to six digits."""
    alpha, mach, value = deck_points(deck, part)
    function, matrix = section_function(part, len(alpha)), monomials(part)
    points = np.vstack([np.sin(alpha), np.cos(alpha), mach])
    x = ca.MX.sym("x", matrix.shape[0])
    model = function(points, ca.repmat(ca.DM(matrix) @ x, 1, len(alpha))).T
    evaluate, slopes = ca.Function("f", [x], [model]), ca.Function("j", [x], [ca.jacobian(model, x)])

    powers = np.concatenate([np.arange(degree + 1) for degree in part.degrees.values()])
    is_width = np.concatenate([np.full(degree + 1, n.startswith("log_")) for n, degree in part.degrees.items()])
    start = np.concatenate([np.pad(part.start[n], (0, d + 1 - len(part.start[n]))) for n, d in part.degrees.items()])
    size = np.concatenate([np.full(degree + 1, abs(part.start[n][0])) for n, degree in part.degrees.items()])
    # The pull towards the start keeps the high powers from wandering.
    if part is LIFT:
        attached = (alpha > np.radians(-5)) & (alpha < np.radians(11))
        weight = np.where(attached, 1 / 0.01, 1 / 0.04)
        pull = np.where(powers > 1, 1.5 / np.maximum(size, 0.1), 0.0)
        scale: str | np.ndarray = np.maximum(size, 0.05)
    else:
        attached = (alpha > np.radians(-5)) & (alpha < np.radians(10))
        stall = (alpha > np.radians(-9)) & (alpha < np.radians(20))
        weight = np.where(attached, 1.0, np.where(stall, 0.5, 0.1)) / (0.0008 + 0.05 * value)
        pull = np.where(powers > np.where(is_width, 0, 2), 0.3 / np.maximum(size, 0.05), 0.0)
        scale = "jac"

    def residual(z: np.ndarray) -> np.ndarray:
        return np.concatenate([(evaluate(z).full().ravel() - value) * weight, pull * (z - start)])

    def jacobian(z: np.ndarray) -> np.ndarray:
        return np.vstack([slopes(z).full() * weight[:, None], np.diag(pull)])

    best = least_squares(residual, start, jac=jacobian, loss="soft_l1", max_nfev=400, x_scale=scale)
    coefficients = np.split(matrix @ best.x, np.cumsum([degree + 1 for degree in part.degrees.values()])[:-1])
    return {n: [float(f"{c:.6g}") for c in values] for n, values in zip(part.degrees, coefficients, strict=True)}


def error_table(deck: dict[str, np.ndarray], part: Part, coefficients: dict[str, list[float]]) -> list[str]:
    """One line for each Mach number: rms error over the fitted range, rms and largest error where attached."""
    alpha, mach, value = deck_points(deck, part)
    points = np.vstack([np.sin(alpha), np.cos(alpha), mach])
    flat = np.concatenate([coefficients[name] for name in part.degrees])
    model = section_function(part, len(alpha))(points, np.tile(flat[:, None], (1, len(alpha))))
    error = model.full().ravel() - value
    attached = (alpha > np.radians(ATTACHED[0])) & (alpha < np.radians(ATTACHED[1]))
    lines = [f"{part.table}   Mach   rms all   rms attached   largest attached"]
    for m in np.unique(mach):
        here, close = mach == m, (mach == m) & attached
        rms_all, rms = np.sqrt(np.mean(error[here] ** 2)), np.sqrt(np.mean(error[close] ** 2))
        lines.append(f"     {m:4.1f}   {rms_all:7.4f}   {rms:12.4f}   {np.abs(error[close]).max():16.4f}")
    return lines


def drag_reference(coefficients: dict[str, list[float]]) -> float:
    """Drag of the fit at Mach 0.3 and zero angle of attack."""
    function = section_function(DRAG, 1)
    flat = np.concatenate([coefficients[name] for name in DRAG.degrees])
    return float(function([0.0, 1.0, 0.3], flat))


def main(path: Path) -> None:
    with np.load(path) as archive:
        deck = {name: archive[name] for name in archive.files if name.startswith("c81_")}
    lines = []
    for part in (LIFT, DRAG):
        coefficients = fit(deck, part)
        print("\n".join(error_table(deck, part, coefficients)))
        lines += [f'{n} = {{ value = {c}, unit = "-", source = "C81" }}' for n, c in coefficients.items()]
    lines.append(
        f'drag_reference = {{ value = {drag_reference(coefficients):.5f}, unit = "-", source = "C81", '
        'note = "the fit\'s own level at Mach 0.3 and zero incidence" }'
    )
    print("\n".join(lines))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit("usage: python problems/fit_section.py deck.npz")
    main(Path(sys.argv[1]))
