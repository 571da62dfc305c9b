"""Fit the combustor's species to one temperature range each: python problems/fit_species.py

GRI-Mech 3.0 gives a species two polynomials that meet at 1000 K with a kink in cp, which a Newton solver feels. Here
each is fitted again over 298.15 to 3000 K: cp/R = sum of a_k (T/1000 K)^k, k = -2 to 4, with enthalpy and entropy exact
at 298.15 K. Writes vrsopt/data/combustion_species.toml. Needs Cantera, which brings the original coefficients.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cantera
import numpy as np

FILE = Path(__file__).parents[1] / "vrsopt" / "data" / "combustion_species.toml"
SPECIES = "CO2 CO H2O O2 OH O H H2 N2 AR NO N2O N NO2 HO2 H2O2 NH NNH HCO".split()
POWERS = np.arange(-2, 5)
GAS_CONSTANT = 8.314462618  # J/(mol K)
REFERENCE, LOWEST, HIGHEST = 298.15, 298.15, 3000.0  # K

HEADER = """\
# Thermodynamic data of the combustor's gas: written by problems/fit_species.py, not to be edited.
# cp/R = sum over k = -2..4 of coefficients[k + 2] (T/1000 K)^k, one range {low:g} to {high:g} K, ideal gas at the
# reference pressure; molar enthalpy (with formation) h298 and entropy s298 at 298.15 K are exact. Largest differences
# from the source over the range: enthalpy_error in h, gibbs_error in g/(R T).

source = "GRI-Mech 3.0 (Smith et al. 1999), NASA polynomials of Cantera {version} gri30.yaml, refitted to one range"
reference_temperature = {{ value = 298.15, unit = "K" }}
reference_pressure = {{ value = {pressure!r}, unit = "Pa" }}
temperature_range = {{ value = [{low!r}, {high!r}], unit = "K" }}
units = {{ h298 = "J/mol", s298 = "J/(mol K)", coefficients = "-", enthalpy_error = "J/mol", gibbs_error = "-" }}
"""


def enthalpy_basis(temperature: np.ndarray) -> np.ndarray:
    """(h(T) - h(298.15 K))/R [K] of every coefficient, (N, 7)."""
    t, t0 = temperature[:, None] / 1e3, REFERENCE / 1e3
    power = np.where(POWERS == -1, 1, POWERS + 1)
    return 1e3 * np.where(POWERS == -1, np.log(t / t0), (t**power - t0**power) / power)


def entropy_basis(temperature: np.ndarray) -> np.ndarray:
    """(s(T) - s(298.15 K))/R of every coefficient, (N, 7)."""
    t, t0 = temperature[:, None] / 1e3, REFERENCE / 1e3
    power = np.where(POWERS == 0, 1, POWERS)
    return np.where(POWERS == 0, np.log(t / t0), (t**power - t0**power) / power)


@dataclass(frozen=True)
class Fit:
    """One species: h298 [J/mol], s298 [J/(mol K)], coefficients (7,), largest errors in h [J/mol] and g/(R T)."""

    composition: dict[str, float]
    h298: float
    s298: float
    coefficients: np.ndarray
    enthalpy_error: float
    gibbs_error: float


def fit(species: cantera.Species) -> Fit:
    """Least largest error in h and g/(R T) together, each in parts of the error that is allowed (10 J/mol, 3e-4)."""
    temperature = LOWEST + (HIGHEST - LOWEST) * (1 - np.cos(np.linspace(0, np.pi, 400))) / 2  # denser at the ends
    thermo = species.thermo
    h298, s298 = thermo.h(REFERENCE) / 1e3, thermo.s(REFERENCE) / 1e3
    h = np.array([thermo.h(T) / 1e3 for T in temperature]) - h298
    s = np.array([thermo.s(T) / 1e3 for T in temperature]) - s298
    target = (h / temperature - s) / GAS_CONSTANT
    h_matrix = GAS_CONSTANT * enthalpy_basis(temperature)
    g_matrix = enthalpy_basis(temperature) / temperature[:, None] - entropy_basis(temperature)
    matrix = np.vstack([h_matrix / 10.0, g_matrix / 3e-4])
    solved = least_largest(matrix, np.concatenate([h / 10.0, target / 3e-4]))
    coefficients = np.array([float(f"{a:.12e}") for a in solved])
    return Fit(
        composition=dict(species.composition),
        h298=h298,
        s298=s298,
        coefficients=coefficients,
        enthalpy_error=float(np.abs(h_matrix @ coefficients - h).max()),
        gibbs_error=float(np.abs(g_matrix @ coefficients - target).max()),
    )


def least_largest(matrix: np.ndarray, target: np.ndarray) -> np.ndarray:
    """x of the least max |matrix x - target|: least squares, weights grown where the error is large (Lawson 1961)."""
    scale = np.linalg.norm(matrix, axis=0)
    weight = np.full(len(target), 1 / len(target))
    best, lowest = np.zeros(matrix.shape[1]), np.inf
    for _ in range(200):
        root = np.sqrt(weight)[:, None]
        x = np.linalg.lstsq(root * matrix / scale, root[:, 0] * target, rcond=1e-14)[0] / scale
        error = np.abs(matrix @ x - target)
        if error.max() < lowest:
            best, lowest = x, error.max()
        weight = weight * (error + 1e-9)
        weight = weight / weight.sum()
    return best


def table(name: str, found: Fit) -> str:
    """The species as a table of the data file."""
    composition = ", ".join(f"{_plain(element)} = {count:g}" for element, count in found.composition.items())
    return (
        f"\n[species.{_plain(name)}]\ncomposition = {{ {composition} }}\n"
        f"h298 = {found.h298:.9e}\ns298 = {found.s298:.9e}\n"
        f"coefficients = [{', '.join(f'{a:.12e}' for a in found.coefficients)}]\n"
        f"enthalpy_error = {found.enthalpy_error:.2g}\ngibbs_error = {found.gibbs_error:.2g}\n"
    )


def _plain(name: str) -> str:
    return "Ar" if name.upper() == "AR" else name


def main() -> None:
    gas = cantera.Solution("gri30.yaml")
    fits = {name: fit(gas.species(name)) for name in SPECIES}
    pressure = gas.species("N2").thermo.reference_pressure
    header = HEADER.format(low=LOWEST, high=HIGHEST, pressure=pressure, version=cantera.__version__)
    FILE.write_text(header + "".join(table(name, found) for name, found in fits.items()), encoding="utf-8")
    for name, found in fits.items():
        print(f"{name:5s} {found.enthalpy_error:8.2f} J/mol {found.gibbs_error:10.1e} in g/RT")


if __name__ == "__main__":
    main()
