"""One stirred reactor: partial equilibrium of the fast reactions, two slow constraints, and NO.

Rate-controlled constrained equilibrium (J. C. Keck & D. Gillespie, Combustion and Flame 17, 1971): two-body reactions
of H, O, OH, H2, H2O, O2 are in equilibrium with each other; the number of moles falls only as fast as radicals
recombine, and CO burns as fast as OH and O allow. Fuel breaks up at once into CO and H2.

Seven unknowns per reactor: ln n [mol/kg] of CO2, CO, H2O, O2, OH; temperature [K]; NO [mol/kg].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import casadi as ca

from vrsopt.combustor import nitrogen
from vrsopt.combustor.kinetics import Pool, co_with_hydroxyl, co_with_oxygen_atoms, recombination
from vrsopt.combustor.species import GAS_CONSTANT, REFERENCE_PRESSURE, Thermo
from vrsopt.combustor.zones import Stream

Mode = Literal["kinetic", "equilibrium"]

UNKNOWNS = ("ln CO2", "ln CO", "ln H2O", "ln O2", "ln OH", "temperature", "NO")
RESIDUALS = ("carbon", "hydrogen", "oxygen", "enthalpy", "moles", "CO", "NO")
MAJOR = ("CO2", "CO", "H2O", "O2", "OH")
NO_SCALE = 1e-3  # mol/kg: 30 ppm, the size of NO behind the combustor
MOLES_SCALE = 3.5e-2  # mol/kg: 0.1 % of the moles
ENTHALPY_SCALE = 1e6  # J/kg


@dataclass(frozen=True)
class Gas:
    """The gas in a reactor: amounts [mol/kg] by species, their sum, temperature [K], affinities, density [kg/m3]."""

    amount: dict[str, Any]
    moles: Any
    temperature: Any
    thermo: Thermo
    pool: Pool
    density: Any
    recombination_affinity: Any  # of H + OH = H2O, which every recombination shares, over R T
    co_affinity: Any  # of CO + OH = CO2 + H, over R T
    no: Any

    @property
    def slow(self) -> tuple[Any, Any, Any]:
        """Moles in all, CO and NO [mol/kg]: what changes slowly."""
        return self.moles, self.amount["CO"], self.no


def gas(x: Any, pressure: Any, stream: Stream) -> Gas:
    """The gas of the unknowns ``x`` (7,), with N2 and Ar of ``stream``.

    ``pressure`` [Pa].
    """
    log = dict(zip(MAJOR, ca.vertsplit(x)[:5], strict=True))
    t = x[5] / 1000.0
    thermo = Thermo.at(t)
    log["O"] = 2.0 * log["OH"] - log["H2O"] - thermo.log_equilibrium({"O": 1, "H2O": 1}, {"OH": 2})
    log["H"] = log["OH"] + log["O"] - log["O2"] - thermo.log_equilibrium({"H": 1, "O2": 1}, {"OH": 1, "O": 1})
    log["H2"] = log["H2O"] + log["H"] - log["OH"] - thermo.log_equilibrium({"H2": 1, "OH": 1}, {"H2O": 1, "H": 1})
    amount = {name: ca.exp(value) for name, value in log.items()}
    amount |= {"N2": stream.nitrogen, "Ar": stream.argon}
    moles = sum(amount.values())
    temperature = x[5]
    density = pressure / (moles * GAS_CONSTANT * temperature)
    activity = ca.log(pressure / REFERENCE_PRESSURE / moles)  # of one mol/kg
    return Gas(
        amount=amount,
        moles=moles,
        temperature=temperature,
        thermo=thermo,
        pool=Pool({name: density * value for name, value in amount.items()}, temperature),
        density=density,
        recombination_affinity=thermo.log_equilibrium({"H": 1, "OH": 1}, {"H2O": 1})
        + log["H"]
        + log["OH"]
        - log["H2O"]
        + activity,
        co_affinity=thermo.log_equilibrium({"CO": 1, "OH": 1}, {"CO2": 1, "H": 1})
        + log["CO"]
        + log["OH"]
        - log["CO2"]
        - log["H"],
        no=x[6],
    )


def equations(
    x: Any,
    pressure: Any,
    inflow: Stream,
    volume_per_flow: Any,
    *,
    methylene: Any,
    renewed: Any = 1.0,
    mode: Mode = "kinetic",
) -> Any:
    """Seven scaled residuals of a reactor with ``inflow``; ``volume_per_flow`` [m3 s/kg] is volume over mass flow.

    ``methylene``: fuel carbon that passes through CH2 in this reactor [mol per kg of inflow]. ``renewed``: share of the
    inflow that is not the zone's own gas. In ``"equilibrium"`` mode both slow constraints are dropped (a start for the
    kinetic one). ``x`` (7,): unknowns as of :func:`gas`; ``pressure`` [Pa].
    """
    one = gas(x, pressure, inflow)
    n = one.amount
    atoms = {
        "C": (n["CO2"] + n["CO"]) / inflow.carbon,
        "H": (2.0 * (n["H2O"] + n["H2"]) + n["OH"] + n["H"]) / inflow.hydrogen,
        "O": (2.0 * (n["CO2"] + n["O2"]) + n["CO"] + n["H2O"] + n["OH"] + n["O"]) / inflow.oxygen,
    }
    enthalpy = sum(amount * one.thermo.enthalpy(name) for name, amount in n.items())
    if mode == "equilibrium":
        slow = [one.recombination_affinity, one.co_affinity]
    else:
        slow = _slow(one, inflow, volume_per_flow)
    return ca.vertcat(
        *(ca.log(ratio) for ratio in atoms.values()),
        (enthalpy - inflow.enthalpy) / ENTHALPY_SCALE,
        *slow,
        nitrogen.balance(one, inflow.no, volume_per_flow, methylene=methylene, renewed=renewed) / NO_SCALE,
    )


def _slow(one: Gas, inflow: Stream, volume_per_flow: Any) -> list[Any]:
    """Balances of moles and of CO, over smooth positive sizes that keep them of order one when kinetics are fast."""
    recombined = 1.0 - ca.exp(-one.recombination_affinity)
    both = 1.0 - ca.exp(-one.recombination_affinity - one.co_affinity)
    radicals, hydroxyl, atoms = recombination(one.pool), co_with_hydroxyl(one.pool), co_with_oxygen_atoms(one.pool)
    burnt = hydroxyl * (1.0 - ca.exp(-one.co_affinity)) + atoms * both
    lost = radicals * recombined + atoms * both
    return [
        (one.moles - inflow.moles + volume_per_flow * lost) / (MOLES_SCALE + volume_per_flow * radicals),
        (one.amount["CO"] - inflow.co + volume_per_flow * burnt) / (1e-3 * inflow.carbon + volume_per_flow * hydroxyl),
    ]
