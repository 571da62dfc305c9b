"""NO in a reactor's gas: thermal, by N2O, by NNH and prompt. Taken as too little to change the gas itself.

In equilibrium of the hottest gas NO would cool it by 11 K; after some milliseconds there, NO is up to 6 % less with
that. ``a`` is NO over the NO in equilibrium with the gas's own N2 and O2 (N2 + O2 = 2 NO). Rate constants: GRI-Mech
3.0, where nothing else is said. Assumed: HNO and NCO end as NO and NH, nothing reduces NO but N and NH.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import casadi as ca

from vrsopt.combustor.kinetics import N2O_BODIES
from vrsopt.combustor.species import GAS_CONSTANT, REFERENCE_PRESSURE

if TYPE_CHECKING:
    from vrsopt.combustor.reactor import Gas

ETHYLENE = 0.2  # share of carbon through CH2 that fits ethylene's NO in GRI-Mech: 0.72 to 1.33 of it in one reactor


def balance(one: Gas, incoming: Any, volume_per_flow: Any, *, methylene: Any, renewed: Any) -> Any:
    """NO of the gas ``one`` minus what comes in and what is made [mol/kg], zero in steady state.

    ``methylene``: fuel carbon that passes through CH2 in this gas [mol/kg]. ``renewed``: share of the inflow that
    brings no N2O along. N, NH, N2O and NNH are in steady state. ``incoming``: NO of the inflow [mol/kg];
    ``volume_per_flow`` [m3 s/kg].
    """
    thermo, c = one.thermo, one.pool.concentration
    surplus = ca.exp(-one.recombination_affinity)
    equilibrium = ca.exp(0.5 * thermo.log_equilibrium({"N2": 1, "O2": 1}, {"NO": 2})) * ca.sqrt(c["N2"] * c["O2"])
    a = one.no * one.density / equilibrium
    rate = _nitrous_oxide(one, a, surplus, volume_per_flow / renewed)
    rate += _atoms(one, a, surplus, equilibrium, prompt(one) * methylene / volume_per_flow)
    return one.no - incoming - volume_per_flow * rate


def _nitrous_oxide(one: Gas, a: Any, surplus: Any, stay: Any) -> Any:
    """NO made [mol/m3/s] by N2 + O (+M) = N2O, then N2O + O = 2 NO.

    It competes with N2O + O = N2 + O2, N2O + H = N2 + OH and outflow. Reactions that turn O and H into O2 and OH are
    reversed only as far as the radicals are in equilibrium: their reverse rates carry ``surplus``.
    """
    pool, c = one.pool, one.pool.concentration
    n2o = _combined(one, "O", "N2O")
    falls_apart = pool.falloff((6.37e14, 56640.0), (7.91e10, 56020.0), N2O_BODIES, 1) * n2o
    to_no = pool.constant(2.9e13, energy=23150.0) * n2o * c["O"]
    to_n2 = (pool.constant(1.4e12, energy=10810.0) * c["O"] + pool.constant(3.87e14, energy=18880.0) * c["H"]) * n2o
    total = falls_apart + to_no + to_n2 + n2o / (one.density * stay)
    made = falls_apart + to_n2 * surplus
    return 2.0 * to_no * (made - surplus * a * a * (total - to_no)) / total


def _atoms(one: Gas, a: Any, surplus: Any, equilibrium: Any, fixed: Any) -> Any:
    """NO made [mol/m3/s] by way of N and NH: extended Zeldovich, NNH, and the prompt path's ``fixed`` N2 [mol/m3/s].

    Every rate is that at equilibrium of NO, N and NH with the gas's own N2, O and OH; ``n`` and ``nh`` are the amounts
    over those. Half of the nitrogen that the prompt path fixes arrives as N, the other half (HCN) by way of NCO as NH.
    """
    pool, thermo, c = one.pool, one.thermo, one.pool.concentration
    n_at = ca.exp(thermo.log_equilibrium({"N2": 1, "O": 1}, {"NO": 1, "N": 1})) * c["N2"] * c["O"] / equilibrium
    nh_at = ca.exp(thermo.log_equilibrium({"N": 1, "H2": 1}, {"NH": 1, "H": 1})) * n_at * c["H2"] / c["H"]
    zeldovich = pool.constant(2.7e13, energy=355.0) * n_at * equilibrium  # N + NO = N2 + O
    burnt_n = (pool.constant(9.0e9, 1.0, 6500.0) * c["O2"] + pool.constant(3.36e13, energy=385.0) * c["OH"]) * n_at
    burnt_nh = nh_at * (
        pool.constant(4.0e13) * c["O"]
        + pool.constant(2.0e13) * c["OH"]
        + (pool.constant(1.28e6, 1.5, 100.0) + pool.constant(4.61e5, 2.0, 6500.0)) * c["O2"]
        + pool.constant(2.0e13, energy=13850.0) * c["H2O"]
    )
    stripped = nh_at * (pool.constant(3.2e13, energy=330.0) * c["H"] + pool.constant(2.0e9, 1.2) * c["OH"])  # NH to N
    reduced = nh_at * equilibrium * (pool.constant(2.16e13, -0.23) + pool.constant(3.65e14, -0.45))  # NH + NO
    diazenyl = pool.constant(7.0e13) * _combined(one, "H", "NNH") * c["O"]  # NNH + O = NH + NO
    # Steady state of N and NH, two linear equations
    n_n, n_nh, n_0 = zeldovich * a + burnt_n + stripped, stripped, zeldovich + burnt_n * a + fixed
    nh_nh = (diazenyl * surplus + reduced) * a + burnt_nh + stripped
    nh_0 = diazenyl + reduced + burnt_nh * a + fixed
    determinant = n_n * nh_nh - n_nh * stripped
    n, nh = (n_0 * nh_nh + n_nh * nh_0) / determinant, (nh_0 * n_n + stripped * n_0) / determinant
    return (
        zeldovich * (1.0 - a * n)
        + burnt_n * (n - a)
        + burnt_nh * (nh - a)
        + diazenyl * (1.0 - surplus * a * nh)
        + reduced * (1.0 - a * nh)
    )


def _combined(one: Gas, atom: str, product: str) -> Any:
    """Concentration [mol/m3] of ``product`` in equilibrium with N2 and an atom."""
    constant = ca.exp(one.thermo.log_equilibrium({"N2": 1, atom: 1}, {product: 1}))
    c = one.pool.concentration
    return constant * c["N2"] * c[atom] * GAS_CONSTANT * one.temperature / REFERENCE_PRESSURE


def prompt(one: Gas) -> Any:
    """N2 fixed by CH [mol per mol of carbon that passes through CH2 in the gas ``one``] (C. P. Fenimore, 1971).

    CH2 becomes CH as far as H and OH strip it before O, O2 and OH oxidise it; CH + N2 = HCN + N then competes with
    the oxidation of CH. CH2 + H = CH + H2 is the reverse of GRI-Mech's CH + H2, simplified (6 to 15 % low at 1800 to
    2600 K). That CH2 is the only way to CH is assumed; the carbon that takes it is a number of the data file.
    """
    pool, c = one.pool, one.pool.concentration
    stripping = pool.constant(1.7e14, energy=450.0) * c["H"] + pool.constant(1.13e7, 2.0, 3000.0) * c["OH"]
    oxidation = (
        pool.constant(2.0e13) * c["OH"]
        + pool.constant(8.0e13) * c["O"]
        + pool.constant(1.32e13, energy=1500.0) * c["O2"]
    )
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
    return stripping / (stripping + oxidation) * fixing / (rest + fixing)
