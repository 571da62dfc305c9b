"""Stirred reactors in Cantera with GRI-Mech 3.0: the reference that the combustor's chemistry is measured against.

The fuel has kerosene's composition and enthalpy, which no fuel of GRI-Mech has: a mixture of C2H4 and C2H2 with the
atoms H/C asked for (0.917 and 0.083 at 1.917), flowing in with the enthalpy that the heating value implies. A stirred
reactor knows its inflow by composition and enthalpy only, so the flame temperature is kerosene's; how the fuel breaks
up, and with it prompt NO, is C2H4's. ``fuel="broken"`` lets it flow in as CO and H2 (oxygen from the air) instead.

Every steady state is checked against the reactor's own balances, written here; what does not meet them raises.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cantera as ct
import numpy as np

Nitrogen = Literal["full", "no_prompt", "no_nnh", "thermal", "inert"]
Fuel = Literal["hydrocarbon", "broken"]
Way = Literal["checked", "direct", "march"]

DRY_AIR = {"N2": 0.7809, "O2": 0.2095, "AR": 0.0096}  # moles
NO2_MASS = 46.006  # kg/kmol
# Largest error of a balance (mass fractions; NO and temperature relative); marching stops where little changes
RESIDUAL: dict[Way, float] = {"checked": 1e-6, "direct": 1e-6, "march": 1e-3}
COLD = 100.0  # K above the inflow: less is a reactor that has gone out
FIXATION = ("C + N2", "CH + N2", "CH2 + N2", "CH2(S) + N2")  # of N2 by hydrocarbon radicals: prompt NO


@dataclass(frozen=True)
class Stream:
    """A flow by enthalpy [J/kg] and mass fractions."""

    enthalpy: float
    fractions: np.ndarray

    def mixed(self, other: Stream, share: float) -> Stream:
        """``share`` of ``other`` in the mixture, by mass."""
        keep = 1 - share
        return Stream(keep * self.enthalpy + share * other.enthalpy, keep * self.fractions + share * other.fractions)


@dataclass(frozen=True)
class Burnt:
    """Steady state of one reactor: outflow, temperature [K], density [kg/m3]; ``out`` if nothing burns in it."""

    stream: Stream
    temperature: float
    density: float
    out: bool


def mechanism(nitrogen: Nitrogen) -> ct.Solution:
    """GRI-Mech 3.0, whole or with less of the nitrogen chemistry.

    ``thermal``: N, NO and N2O react with N2, O2, O, H, OH only (extended Zeldovich and N2O); ``no_prompt``: no fixation
    by hydrocarbon radicals; ``no_nnh``: no NNH; ``inert``: N2 alone, which does not react.
    """
    gri = ct.Solution("gri30.yaml")
    species, reactions = gri.species(), gri.reactions()
    if nitrogen == "full":
        return gri
    if nitrogen in ("thermal", "inert"):
        kept = {"N2", "NO", "N2O", "N"} if nitrogen == "thermal" else {"N2"}
        species = [s for s in species if "N" not in s.composition or s.name in kept]
        names = {s.name for s in species}
        reactions = [r for r in reactions if {*r.reactants, *r.products} <= names and not _with_carbon(gri, r)]
    else:
        reactions = [r for r in reactions if not _removed(r, nitrogen)]
    return ct.Solution(thermo="ideal-gas", kinetics="gas", species=species, reactions=reactions)


def _with_carbon(gri: ct.Solution, reaction: ct.Reaction) -> bool:
    """Whether a reaction turns nitrogen with the help of a species that has carbon."""
    both = {**reaction.reactants, **reaction.products}
    return any(name in both for name in ("NO", "N2O", "N")) and any(gri.n_atoms(name, "C") for name in both)


def _removed(reaction: ct.Reaction, nitrogen: Nitrogen) -> bool:
    if nitrogen == "no_nnh":
        return "NNH" in {**reaction.reactants, **reaction.products}
    fixes = any(reaction.equation.startswith(f"{way} ") for way in FIXATION)
    return fixes and "N2" not in reaction.products  # CH2(S) + N2 = CH2 + N2 only takes the excitation away


class Gas:
    """A mechanism with its fuel and air."""

    def __init__(
        self,
        nitrogen: Nitrogen = "full",
        *,
        fuel: Fuel = "hydrocarbon",
        way: Way = "checked",
        hydrogen_to_carbon: float = 1.917,
        heating_value: float = 43.1e6,
    ) -> None:
        self.solution = mechanism(nitrogen)
        self.nitrogen, self.fuel, self.way, self.hydrogen_to_carbon = nitrogen, fuel, way, hydrogen_to_carbon
        x, gas = hydrogen_to_carbon, self.solution
        self.heating_value = heating_value
        self.fuel_mass = 12.011 + 1.008 * x  # kg per kmol of C
        formed = {name: gas.species(name).thermo.h(298.15) for name in ("CO2", "H2O")}
        self.fuel_enthalpy = (formed["CO2"] + x / 2 * formed["H2O"]) / self.fuel_mass + heating_value
        gas.X = {"C2H4": x - 1, "C2H2": 2 - x}
        self.fuel_fractions = gas.Y.copy()
        self.weights = gas.molecular_weights.copy()
        self.names = set(gas.species_names)

    def air(self, temperature: float, humidity: float, pressure: float) -> Stream:
        """Air with ``humidity`` [kg of vapour per kg of dry air] at a temperature [K]."""
        gas = self.solution
        mass = sum(gas.molecular_weights[gas.species_index(name)] * moles for name, moles in DRY_AIR.items())
        vapour = humidity * mass / gas.molecular_weights[gas.species_index("H2O")]
        gas.TPX = temperature, pressure, {**DRY_AIR, "H2O": vapour}
        return Stream(gas.enthalpy_mass, gas.Y.copy())

    def fresh(self, air: Stream, fuel_fraction: float) -> Stream:
        """Fuel and air, not burnt."""
        mixed = air.mixed(Stream(self.fuel_enthalpy, self.fuel_fractions), fuel_fraction)
        return mixed if self.fuel == "hydrocarbon" else Stream(mixed.enthalpy, self._broken(air, fuel_fraction))

    def _broken(self, air: Stream, fuel_fraction: float) -> np.ndarray:
        """Mass fractions with the fuel turned into CO and H2 by the air's oxygen."""
        gas, carbon = self.solution, fuel_fraction / self.fuel_mass
        moles = (1 - fuel_fraction) * air.fractions / self.weights
        for name, change in (("CO", 1.0), ("H2", self.hydrogen_to_carbon / 2), ("O2", -0.5)):
            moles[gas.species_index(name)] += change * carbon
        fractions = moles * self.weights
        return fractions / fractions.sum()

    def fuel_fraction(self, air: Stream, equivalence_ratio: float) -> float:
        """Fuel mass fraction of a mixture; at 1 the oxygen just suffices to burn it."""
        oxygen = self.moles(air, "O2")
        ratio = equivalence_ratio * oxygen / (1 + self.hydrogen_to_carbon / 4) * self.fuel_mass
        return ratio / (1 + ratio)

    def equilibrium(self, inflow: Stream, pressure: float) -> Burnt:
        """The inflow burnt for ever."""
        gas = self.solution
        gas.Y = inflow.fractions
        gas.HP = inflow.enthalpy, pressure
        gas.equilibrate("HP")
        return Burnt(Stream(gas.enthalpy_mass, gas.Y.copy()), gas.T, gas.density, False)

    def reactor(self, inflow: Stream, pressure: float, volume_per_flow: float, start: Burnt | None = None) -> Burnt:
        """A stirred reactor of ``volume_per_flow`` [m3 s/kg], from its equilibrium or from ``start``.

        By the way of this gas: ``checked`` marches ten residence times (so that it goes out where it would) and solves
        for the steady state, ``direct`` solves at once, ``march`` marches until nothing changes. Raises
        ``cantera.CanteraError`` where that fails and ``RuntimeError`` where the balances are missed.
        """
        begin = start or self.equilibrium(inflow, pressure)
        gas = self.solution
        gas.Y = inflow.fractions
        gas.HP = inflow.enthalpy, pressure
        cold = gas.T + COLD
        # One phase for all three, which is quick: each keeps its own state, the reservoirs' never change
        upstream, downstream = (ct.Reservoir(gas, clone=False) for _ in range(2))
        gas.TPY = begin.temperature, pressure, begin.stream.fractions
        reactor = ct.IdealGasReactor(gas, volume=volume_per_flow, clone=False)
        inlet = ct.MassFlowController(upstream, reactor, mdot=1.0)
        ct.PressureController(reactor, downstream, primary=inlet, K=1e-6)
        net = ct.ReactorNet([reactor])
        net.rtol, net.atol = 1e-8, 1e-15
        self._settle(net, volume_per_flow * begin.density)
        for _ in range(4):
            error = self.residual(gas, inflow, pressure, volume_per_flow)
            if error < RESIDUAL[self.way]:
                return Burnt(Stream(gas.enthalpy_mass, gas.Y.copy()), gas.T, gas.density, gas.T < cold)
            net.solve_steady()  # its own tolerance is loose next to going out
        raise RuntimeError(f"no steady state: residual {error:.1e} at {gas.T:.0f} K, {pressure / 1e5:.1f} bar")

    def _settle(self, net: ct.ReactorNet, residence: float) -> None:
        if self.way == "march":
            net.advance(10 * residence)
            net.advance_to_steady_state(max_steps=100_000)
            return
        if self.way == "checked":
            net.advance(10 * residence)
        try:
            net.solve_steady()
        except ct.CanteraError:  # close to going out it drifts for long
            net.advance(1000 * residence)
            net.solve_steady()

    def residual(self, phase: ct.Solution, inflow: Stream, pressure: float, volume_per_flow: float) -> float:
        """Largest error of the balances of species and energy: inflow - outflow + production = 0."""
        made = volume_per_flow * phase.net_production_rates * self.weights
        error = np.abs(inflow.fractions - phase.Y + made)
        k = self.solution.species_index("NO" if "NO" in self.names else "CO2")
        relative = error[k] / max(phase.Y[k], 1e-9)
        temperature = abs(inflow.enthalpy - phase.enthalpy_mass) / phase.cp_mass / phase.T
        return float(max(error.max(), relative, temperature, abs(phase.P / pressure - 1)))

    def moles(self, stream: Stream, name: str) -> float:
        """kmol of a species per kg."""
        index = self.solution.species_index(name)
        return float(stream.fractions[index] / self.weights[index])

    def nox(self, stream: Stream) -> float:
        """NO and NO2, kmol per kg."""
        return sum(self.moles(stream, name) for name in ("NO", "NO2") if name in self.names)

    def nox_index(self, stream: Stream, fuel_fraction: float) -> float:
        """NO and NO2, as NO2, kg per kg of fuel."""
        return self.nox(stream) * NO2_MASS / fuel_fraction

    def co_index(self, stream: Stream, fuel_fraction: float) -> float:
        """CO, kg per kg of fuel."""
        return float(stream.fractions[self.solution.species_index("CO")] / fuel_fraction)
