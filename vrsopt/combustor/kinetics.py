"""Rates of the slow reactions of a combustor's gas, whose fast ones are in partial equilibrium.

Rate constants are those of GRI-Mech 3.0 (G. P. Smith et al., 1999), written in its units (cm3, mol, s, cal) and turned
into SI once. Reactions that only shuffle bonds (two molecules into two) are fast and in equilibrium; what is slow is
every reaction that changes the number of molecules (recombination of radicals), the oxidation of CO, and all of NO.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from vrsopt.combustor.species import GAS_CONSTANT

CALORIE = 4.184  # J

# Recombination with any third body: partners, factor [cm6/mol2/s], exponent of temperature, efficiencies other than 1.
_THIRD_BODIES: tuple[tuple[tuple[str, str], float, float, dict[str, float]], ...] = (
    (("H", "OH"), 2.2e22, -2.0, {"H2": 0.73, "H2O": 3.65, "Ar": 0.38}),
    (("H", "O2"), 2.8e18, -0.86, {"CO": 0.75, "CO2": 1.5, "O2": 0.0, "H2O": 0.0, "N2": 0.0, "Ar": 0.0}),
    (("H", "O"), 5.0e17, -1.0, {"H2": 2.0, "H2O": 6.0, "CO": 1.5, "CO2": 2.0, "Ar": 0.7}),
    (("O", "O"), 1.2e17, -1.0, {"H2": 2.4, "H2O": 15.4, "CO": 1.75, "CO2": 3.6, "Ar": 0.83}),
    (("H", "H"), 1.0e18, -1.0, {"H2": 0.0, "H2O": 0.0, "CO2": 0.0, "Ar": 0.63}),
)
# Recombination with one named third body.
_NAMED_BODIES: tuple[tuple[tuple[str, str, str], float, float], ...] = (
    (("H", "O2", "O2"), 2.08e19, -1.24),
    (("H", "O2", "H2O"), 1.126e19, -0.76),
    (("H", "O2", "N2"), 2.6e19, -1.24),
    (("H", "O2", "Ar"), 7.0e17, -0.8),
    (("H", "H", "H2"), 9.0e16, -0.6),
    (("H", "H", "H2O"), 6.0e19, -1.25),
    (("H", "H", "CO2"), 5.5e20, -2.0),
)
_CO_O_BODIES = {"H2": 2.0, "O2": 6.0, "H2O": 6.0, "CO": 1.5, "CO2": 3.5, "Ar": 0.5}
N2O_BODIES = {"H2": 2.0, "H2O": 6.0, "CO": 1.5, "CO2": 2.0, "Ar": 0.625}


@dataclass(frozen=True)
class Pool:
    """What the rates need: concentrations [mol/m3] by species, temperature, and logarithms of equilibrium constants."""

    concentration: dict[str, Any]
    temperature: Any  # K

    def constant(self, factor: float, exponent: float = 0.0, energy: float = 0.0, *, order: int = 2) -> Any:
        """Rate constant [m3, mol, s] of ``factor`` [cm3, mol, s], exponent of T and activation energy [cal/mol]."""
        power = exponent * ca.log(self.temperature) if exponent else 0.0
        barrier = energy * CALORIE / GAS_CONSTANT / self.temperature if energy else 0.0
        return factor * 1e-6 ** (order - 1) * (ca.exp(power - barrier) if exponent or energy else 1.0)

    def third_body(self, efficiencies: dict[str, float]) -> Any:
        """Concentration of collision partners [mol/m3], weighted."""
        major = ("N2", "O2", "H2O", "CO2", "CO", "H2", "Ar", "OH", "O", "H")
        return sum(efficiencies.get(name, 1.0) * self.concentration[name] for name in major)

    def falloff(self, low: tuple[float, float], high: tuple[float, float], bodies: dict[str, float], order: int) -> Any:
        """Lindemann rate constant of (factor, energy) at low and at high pressure; ``order`` at high pressure."""
        first = self.constant(low[0], energy=low[1], order=order + 1) * self.third_body(bodies)
        last = self.constant(high[0], energy=high[1], order=order)
        return first * last / (first + last)


def recombination(pool: Pool) -> Any:
    """Rate at which radicals recombine [mol/m3/s], one way: H+OH, H+O2 (with HO2 in equilibrium), O+H, O+O, H+H.

    Two assumptions whose errors partly cancel: in GRI-Mech HO2 is above its equilibrium, which lowers the net rate of
    H+O2 by up to half, and H2O2, left out here, carries 15 to 50 % of the recombination.
    """
    c, total = pool.concentration, 0.0
    for (first, second), factor, exponent, bodies in _THIRD_BODIES:
        rate = pool.constant(factor, exponent, order=3) * c[first] * c[second]
        total += rate * pool.third_body(bodies)
    for (first, second, body), factor, exponent in _NAMED_BODIES:
        total += pool.constant(factor, exponent, order=3) * c[first] * c[second] * c[body]
    return total


def co_with_oxygen_atoms(pool: Pool) -> Any:
    """Rate of CO + O (+M) = CO2 (+M), one way [mol/m3/s]."""
    constant = pool.falloff((6.02e14, 3000.0), (1.8e10, 2385.0), _CO_O_BODIES, 2)
    return constant * pool.concentration["CO"] * pool.concentration["O"]


def co_with_hydroxyl(pool: Pool) -> Any:
    """Rate of CO + OH = CO2 + H and of CO + O2 = CO2 + O (same affinity), one way [mol/m3/s]."""
    c = pool.concentration
    return c["CO"] * (pool.constant(4.76e7, 1.228, 70.0) * c["OH"] + pool.constant(2.5e12, energy=47800.0) * c["O2"])
