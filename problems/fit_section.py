"""Fit the smooth section of vrsopt.rotor.airfoil to a deck of tables and print it as a section file.

    python problems/fit_section.py deck.c81
    python problems/fit_section.py deck.npz
    python problems/fit_section.py naca-0012

A .npz deck holds, for each of cl, cd and cm, angles of attack [deg] (n,) in ``c81_alpha_cl``, Mach numbers (m,) in
``c81_mach_cl`` and the table (n, m) in ``c81_cl``. ``naca-0012`` is the deck drawn from published constants below.
Prints a file for vrsopt.rotor.airfoil.load_section, the errors by Mach number as comments before it; the lines of its
table [section] and its sources also serve in an aircraft file.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.quantity import Record
from vrsopt.rotor.airfoil import NACA_0012_SOURCE, NACA_0012_STALL, Airfoil
from vrsopt.rotor.c81 import Deck, Table, read_c81
from vrsopt.rotor.section_fit import SectionFit, fit_section

# NACA 0012: separation f(alpha) and moment of Leishman and Beddoes (1989), by Mach number; angles in degrees
MACH = np.array([0.3, 0.4, 0.5, 0.6, 0.7, 0.75, 0.8])
BREAK = np.array([15.25, 12.5, 10.5, 8.5, 5.6, 3.5, 0.7])
S1 = np.array([3.0, 3.25, 3.5, 4.0, 4.5, 3.5, 0.7])
S2 = np.array([2.3, 1.6, 1.2, 0.7, 0.5, 0.8, 0.18])
K0 = np.array([0.0025, 0.006, 0.02, 0.038, 0.03, 0.001, -0.01])
K1 = np.array([-0.135, -0.135, -0.125, -0.12, -0.09, -0.13, 0.02])
K2 = np.array([0.04, 0.05, 0.04, 0.04, 0.15, -0.02, -0.01])
LIFT_SLOPE = 0.108  # 1/deg in incompressible flow; by the Prandtl-Glauert rule otherwise
RECOVERY = 0.97  # of the leading-edge suction
CRITICAL = np.array([1.45, 1.2, 1.05, 0.92, 0.68, 0.5, 0.18])  # normal force beyond which the suction breaks down
BREAKDOWN = np.array([8.0, 7.75, 6.2, 6.0, 5.9, 5.5, 4.0])
DRAG_LEVEL = 0.008
LARGEST_KIRCHHOFF = 25.0  # deg: a plate beyond, blended over ten degrees


def naca_0012() -> Deck:
    """Tables that the published constants of NACA 0012 describe; a flat plate at large angles."""
    positive = np.concatenate([np.arange(0, 26, 1.0), [30, 35, 40, 50, 60, 75, 90, 105, 120, 140, 155, 165, 172, 176]])
    angle = np.concatenate([-180 + 0 * positive[:1], -positive[:0:-1], positive, [180]])
    columns = [_column(np.abs(angle), k) for k in range(len(MACH))]
    mach = np.concatenate([[0.2], MACH])  # constant below Mach 0.3
    sign = np.sign(angle)
    lift, drag, moment = (np.array([columns[0][k], *(c[k] for c in columns)]).T for k in range(3))
    odd = sign[:, None]
    return Deck("NACA 0012", Table(angle, mach, odd * lift), Table(angle, mach, drag), Table(angle, mach, odd * moment))


def _column(angle: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lift, drag and moment coefficient at positive angles [deg] for one of the Mach numbers."""
    alpha = np.radians(angle)
    slope = np.degrees(LIFT_SLOPE / np.sqrt(1 - min(MACH[k], 0.75) ** 2))
    before = 1 - 0.3 * np.exp(np.minimum(angle - BREAK[k], 0) / S1[k])
    after = 0.04 + 0.66 * np.exp(np.minimum(BREAK[k] - angle, 0) / S2[k])
    f = np.where(angle <= BREAK[k], before, after)
    normal = slope * np.sin(alpha) * ((1 + np.sqrt(f)) / 2) ** 2
    beyond = np.maximum(slope * np.sin(alpha) - CRITICAL[k], 0)
    chordwise = RECOVERY * slope * np.sin(alpha) ** 2 * f ** (0.5 + BREAKDOWN[k] * beyond)
    moment = normal * (K0[k] + K1[k] * (1 - f) + K2[k] * np.sin(np.pi * f**2))
    plate = np.clip((angle - LARGEST_KIRCHHOFF) / 10, 0, 1)
    s, c = np.sin(alpha), np.cos(alpha)
    large = (1.15 * np.sin(2 * alpha), DRAG_LEVEL + 1.9 * s**2, -0.5 * s * (1 - 0.15 * c) - 0.3 * s * (c < 0) * c**4)
    small = (normal * c + chordwise * s, DRAG_LEVEL + normal * s - chordwise * c, moment)
    lift, drag, moment = ((1 - plate) * a + plate * b for a, b in zip(small, large, strict=True))
    return lift, drag, moment


def load(name: str) -> Deck:
    if name == "naca-0012":
        return naca_0012()
    if not name.endswith(".npz"):
        return read_c81(name)
    with np.load(name) as archive:
        tables = [
            Table(*(archive[key] for key in (f"c81_alpha_{q}", f"c81_mach_{q}", f"c81_{q}")))
            for q in ("cl", "cd", "cm")
        ]
    return Deck(Path(name).stem, *tables)


def section_file(section: Airfoil, fit: SectionFit) -> str:
    """Text of a TOML file that describes ``section``; the errors of the fit are comments."""
    name = "".join(letter for letter in fit.name if letter.isprintable()) or "section"
    quoted = json.dumps(name, ensure_ascii=False)
    lines = [f"# {line}" for line in str(replace(fit, name=name)).splitlines()]
    lines += ["", f"name = {quoted}", "", "[sources]"]
    lines += [f"fit = {json.dumps('least-squares fit to the deck ' + name, ensure_ascii=False)}"]
    lines += [f'LB = "{NACA_0012_SOURCE}"', "", "[section]"]
    lines += [_line(key, getattr(section, key)) for key in Airfoil.model_fields if key not in Record.model_fields]
    return "\n".join(lines) + "\n"


def _line(key: str, value: float | tuple[float, ...]) -> str:
    origin = 'source = "fit"'
    if key == "critical_normal_force":
        origin += ', note = "where the lift of the fit breaks"'
    elif key in NACA_0012_STALL:
        origin = 'source = "LB", note = "NACA 0012"'
    return f'{key} = {{ value = {list(value) if isinstance(value, tuple) else value}, unit = "-", {origin} }}'


def main(name: str) -> None:
    try:
        print(section_file(*fit_section(load(name))), end="")
    except (InputError, NoSolutionError) as error:
        print(f"error: {error}", file=sys.stderr)
        raise SystemExit(2) from None


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    main(sys.argv[1])
