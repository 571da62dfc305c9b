"""Ideal-gas species of the combustor: enthalpy and Gibbs energy as CasADi expressions of temperature.

cp/R = sum over k = -2..4 of a_k (T/1000 K)^k in one range (298 to 3000 K): a polynomial with a kink at 1000 K, as the
usual two-range fits have, would stop a Newton solver there. The numbers are in ``data/combustion_species.toml``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from typing import Any

import casadi as ca
import numpy as np

from vrsopt.quantity import read_toml

GAS_CONSTANT = 8.314462618  # J/(mol K)
REFERENCE_PRESSURE = 101325.0  # Pa
REFERENCE_TEMPERATURE = 0.29815  # 1000 K
ATOMIC_MASS = {"C": 12.011e-3, "H": 1.008e-3, "O": 15.999e-3, "N": 14.007e-3, "Ar": 39.95e-3}  # kg/mol


@dataclass(frozen=True)
class Species:
    """One species: atoms by element, molar enthalpy [J/mol] and entropy [J/(mol K)] at 298.15 K, cp/R coefficients."""

    name: str
    composition: dict[str, float]
    h298: float
    s298: float
    coefficients: tuple[float, ...]

    @property
    def molar_mass(self) -> float:
        """Molar mass [kg/mol]."""
        return sum(count * ATOMIC_MASS[element] for element, count in self.composition.items())


@lru_cache(maxsize=1)
def all_species() -> dict[str, Species]:
    """The species of the data file by name."""
    with resources.as_file(resources.files("vrsopt") / "data" / "combustion_species.toml") as path:
        entries = read_toml(path)["species"]
    return {
        name: Species(name, entry["composition"], entry["h298"], entry["s298"], tuple(entry["coefficients"]))
        for name, entry in entries.items()
    }


@dataclass(frozen=True)
class Thermo:
    """The integrals of the powers of t = T/1000 K that all species share, built once per temperature."""

    t: Any
    heat: Any  # integral of t^k dt from the reference temperature, k = -2..4
    gibbs: Any  # the same over t, minus the integral of t^(k-1) dt

    @staticmethod
    def at(t: Any) -> Thermo:
        """The integrals at ``t`` [1000 K]."""
        r, log = REFERENCE_TEMPERATURE, ca.log(t / REFERENCE_TEMPERATURE)
        powers = {0: 1.0, 1: t, -1: 1.0 / t}
        powers[-2] = powers[-1] * powers[-1]
        for k in range(2, 6):
            powers[k] = powers[k - 1] * t

        def rise(k: int) -> Any:
            return log if k == 0 else (powers[k] - r**k) / k

        heat = ca.vertcat(*(rise(k + 1) for k in range(-2, 5)))
        entropy = ca.vertcat(*(rise(k) for k in range(-2, 5)))
        return Thermo(t, heat, heat / t - entropy)

    def enthalpy(self, name: str) -> Any:
        """Molar enthalpy [J/mol] with the enthalpy of formation."""
        one = all_species()[name]
        return one.h298 + 1000.0 * GAS_CONSTANT * ca.dot(ca.DM(one.coefficients), self.heat)

    def log_equilibrium(self, left: dict[str, float], right: dict[str, float]) -> Any:
        """ln K of ``left`` = ``right`` (species and counts), activities being partial pressures in atm."""
        change: dict[str, float] = {name: -count for name, count in left.items()}
        for name, count in right.items():
            change[name] = change.get(name, 0.0) + count
        one = all_species()
        a = sum((count * np.array(one[name].coefficients) for name, count in change.items()), np.zeros(7))
        h = sum(count * one[name].h298 for name, count in change.items())
        s = sum(count * one[name].s298 for name, count in change.items())
        return -(h / (1000.0 * GAS_CONSTANT * self.t) - s / GAS_CONSTANT + ca.dot(ca.DM(a), self.gibbs))
