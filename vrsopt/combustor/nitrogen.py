"""NO in a reactor's gas: thermal, by N2O, by NNH and prompt. Too little to change the gas itself.

``a`` is NO over the NO in equilibrium with the gas's own N2 and O2 (N2 + O2 = 2 NO). Rate constants: GRI-Mech 3.0.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import casadi as ca

from vrsopt.combustor.kinetics import N2O_BODIES
from vrsopt.combustor.species import GAS_CONSTANT, REFERENCE_PRESSURE

if TYPE_CHECKING:
    from vrsopt.combustor.reactor import Gas

METHYLIDYNE = 0.0


def balance(one: Gas, incoming: Any, volume_per_flow: Any, burning: Any) -> Any:
    """NO of the gas ``one`` minus what comes in and what is made [mol/kg], zero in steady state.

    Thermal (extended Zeldovich), N2O and NNH paths with N, N2O and NNH in steady state, prompt NO from ``burning``
    moles of fuel carbon per kg. Reactions that turn O and H into O2 and OH are reversed only as far as the radicals
    are in equilibrium: their reverse rates carry E = exp(-affinity of recombination).
    """
    thermo, c, surplus = one.thermo, one.pool.concentration, ca.exp(-one.recombination_affinity)
    equilibrium = ca.exp(0.5 * thermo.log_equilibrium({"N2": 1, "O2": 1}, {"NO": 2})) * ca.sqrt(c["N2"] * c["O2"])
    a = one.no * one.density / equilibrium
    rate = _thermal(one, equilibrium, a) + _nitrous_oxide(one, a, surplus, volume_per_flow) + _diazenyl(one, a, surplus)
    return one.no - incoming - volume_per_flow * rate - prompt(one) * burning


def _thermal(one: Gas, equilibrium: Any, a: Any) -> Any:
    """N2 + O = NO + N, N + O2 = NO + O, N + OH = NO + H with N in steady state."""
    pool, c = one.pool, one.pool.concentration
    back = pool.constant(2.7e13, energy=355.0)
    forward = back * ca.exp(one.thermo.log_equilibrium({"N2": 1, "O": 1}, {"NO": 1, "N": 1})) * c["N2"] * c["O"]
    used = pool.constant(9.0e9, 1.0, 6500.0) * c["O2"] + pool.constant(3.36e13, energy=385.0) * c["OH"]
    return 2.0 * forward * (1.0 - a * a) / (1.0 + a * back * equilibrium / used)


def _nitrous_oxide(one: Gas, a: Any, surplus: Any, volume_per_flow: Any) -> Any:
    """N2 + O (+M) = N2O, then N2O + O = 2 NO, against N2O + O = N2 + O2, N2O + H = N2 + OH and outflow."""
    pool, c = one.pool, one.pool.concentration
    n2o = _combined(one, "O", "N2O")
    falls_apart = pool.falloff((6.37e14, 56640.0), (7.91e10, 56020.0), N2O_BODIES, 1) * n2o
    to_no = pool.constant(2.9e13, energy=23150.0) * n2o * c["O"]
    to_n2 = (pool.constant(1.4e12, energy=10810.0) * c["O"] + pool.constant(3.87e14, energy=18880.0) * c["H"]) * n2o
    total = falls_apart + to_no + to_n2 + n2o / (one.density * volume_per_flow)
    made = falls_apart + to_n2 * surplus
    return 2.0 * to_no * (made - surplus * a * a * (total - to_no)) / total


def _diazenyl(one: Gas, a: Any, surplus: Any) -> Any:
    """N2 + H = NNH in equilibrium, NNH + O = NH + NO (7e13), NH on to NO (J. W. Bozzelli & A. M. Dean, 1995)."""
    pool, c = one.pool, one.pool.concentration
    return 2.0 * pool.constant(7.0e13) * _combined(one, "H", "NNH") * c["O"] * (1.0 - surplus * a * a)


def _combined(one: Gas, atom: str, product: str) -> Any:
    """Concentration [mol/m3] of ``product`` in equilibrium with N2 and an atom."""
    constant = ca.exp(one.thermo.log_equilibrium({"N2": 1, atom: 1}, {product: 1}))
    c = one.pool.concentration
    return constant * c["N2"] * c[atom] * GAS_CONSTANT * one.temperature / REFERENCE_PRESSURE


def prompt(one: Gas) -> Any:
    """Prompt NO [mol per mol of fuel carbon that breaks up in the gas ``one``] (C. P. Fenimore, 1971).

    Part of the carbon passes through CH; CH + N2 = HCN + N competes with the oxidation of CH, and lean gas turns both
    nitrogen atoms into NO.
    """
    pool, c = one.pool, one.pool.concentration
    fixing = pool.constant(3.12e9, 0.88, 20130.0) * c["N2"]
    rest = (
        pool.constant(6.71e13) * c["O2"]
        + pool.constant(5.71e12, energy=-755.0) * c["H2O"]
        + pool.constant(3.0e13) * c["OH"]
        + pool.constant(5.7e13) * c["O"]
        + pool.constant(1.65e14) * c["H"]
        + pool.constant(1.08e14, energy=3110.0) * c["H2"]
        + pool.constant(1.9e14, energy=15792.0) * c["CO2"]
    )
    return 2.0 * METHYLIDYNE * fixing / (rest + fixing)
