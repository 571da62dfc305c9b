"""How air, fuel and burnt gas meet in the zones of a combustor: streams, pockets and volumes, for any kind of number.

Used twice: with symbols by the network, with arrays by the search for its start.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from vrsopt.combustor.species import ATOMIC_MASS, Thermo, all_species

PRIMARY, INTERMEDIATE = 9, 3  # pockets
DRY_AIR = {"N2": 0.7809, "O2": 0.2095, "Ar": 0.0096}  # mole fractions


@dataclass(frozen=True)
class Stream:
    """What a kilogram of gas brings along, all of which mixes linearly.

    Atoms of C, H, O [mol/kg], molecules of N2 and Ar [mol/kg], enthalpy with formation [J/kg], and the three quantities
    that change slowly: moles in all, CO and NO [mol/kg].
    """

    carbon: Any
    hydrogen: Any
    oxygen: Any
    nitrogen: Any
    argon: Any
    enthalpy: Any
    moles: Any
    co: Any
    no: Any

    def mixed(self, other: Stream, share: Any) -> Stream:
        """``1 - share`` of this and ``share`` of the other (which may be more than 1: this is taken out again)."""
        return Stream(*((1.0 - share) * a + share * b for a, b in zip(self.parts(), other.parts(), strict=True)))

    def parts(self) -> list[Any]:
        """The nine quantities in their order."""
        return [getattr(self, field.name) for field in fields(self)]


def air_stream(temperature: Any, humidity: Any) -> Stream:
    """A kilogram of air at ``temperature`` [K] with ``humidity`` kg of vapour per kg of dry air (CasADi)."""
    thermo, known = Thermo.at(temperature / 1000.0), all_species()
    dry_mass = sum(share * known[name].molar_mass for name, share in DRY_AIR.items())
    amount = {name: share / dry_mass / (1.0 + humidity) for name, share in DRY_AIR.items()}
    amount["H2O"] = humidity / (1.0 + humidity) / known["H2O"].molar_mass
    return Stream(
        carbon=0.0,
        hydrogen=2.0 * amount["H2O"],
        oxygen=2.0 * amount["O2"] + amount["H2O"],
        nitrogen=amount["N2"],
        argon=amount["Ar"],
        enthalpy=sum(moles * thermo.enthalpy(name) for name, moles in amount.items()),
        moles=sum(amount.values()),
        co=0.0,
        no=0.0,
    )


def fuel_stream(hydrogen_to_carbon: float, heating_value: float) -> Stream:
    """A kilogram of fuel CHx, liquid at 298.15 K, as what it breaks up into with half an O2 per carbon: CO and H2.

    ``hydrogen_to_carbon``: x [-]; ``heating_value`` [J/kg].
    """
    known = all_species()
    carbon = 1.0 / (ATOMIC_MASS["C"] + hydrogen_to_carbon * ATOMIC_MASS["H"])
    products = known["CO2"].h298 + 0.5 * hydrogen_to_carbon * known["H2O"].h298
    return Stream(
        carbon=carbon,
        hydrogen=hydrogen_to_carbon * carbon,
        oxygen=0.0,
        nitrogen=0.0,
        argon=0.0,
        enthalpy=heating_value + carbon * products,
        moles=carbon * (0.5 + 0.5 * hydrogen_to_carbon),
        co=carbon,
        no=0.0,
    )


def spread(cutoff: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (count,) and weights (count,) of a normal distribution cut off at +-``cutoff``: Gauss-Legendre."""
    z, w = np.polynomial.legendre.leggauss(count)
    w = w * np.exp(-0.5 * (cutoff * z) ** 2)
    return cutoff * z, w / w.sum()


@dataclass(frozen=True)
class Zones:
    """The zones at one state: fuel mass fractions and volume over flow [m3 s/kg] of each."""

    data: Any  # the numbers of ReactorData
    air: Stream
    fuel: Stream
    fuel_fractions: tuple[Any, Any, Any]
    volumes: tuple[Any, Any, Any]
    pockets: int

    @staticmethod
    def of(data: Any, air: Stream, fuel: Stream, air_flow: Any, fuel_flow: Any, pockets: int = PRIMARY) -> Zones:
        """The zones with ``air_flow`` and ``fuel_flow`` [kg/s]."""
        shares = (data.primary_air_fraction, data.primary_air_fraction + data.intermediate_air_fraction, 1.0)
        sizes = (data.primary_volume, data.intermediate_volume, data.dilution_volume)
        flows = [fuel_flow + share * air_flow for share in shares]
        first, second, third = (fuel_flow / flow for flow in flows)
        volumes = [size / flow for size, flow in zip(sizes, flows, strict=True)]
        # What is mixed in adds to the flow through the primary reactors, so that one passage is shorter.
        volumes[0] *= 1.0 - data.recirculation
        return Zones(data, air, fuel, (first, second, third), (volumes[0], volumes[1], volumes[2]), pockets)

    @property
    def primary_weights(self) -> np.ndarray:
        """Share of the primary flow in each pocket."""
        return spread(self.data.mixture_cutoff, self.pockets)[1]

    @property
    def intermediate_weights(self) -> np.ndarray:
        """Share of the intermediate flow in each pocket."""
        return spread(self.data.mixture_cutoff, INTERMEDIATE)[1]

    def fresh(self) -> list[Stream]:
        """Air and fuel of every primary pocket, before burnt gas is mixed in."""
        mean, s = self.fuel_fractions[0], self.data.primary_unmixedness
        nodes = spread(self.data.mixture_cutoff, self.pockets)[0]
        return [self.air.mixed(self.fuel, mean * (1.0 + s * float(z))) for z in nodes]

    def methylene(self) -> list[Any]:
        """Fuel carbon that passes through CH2 in every primary pocket [mol per kg of what flows in]."""
        share = self.data.methylene_fraction * (1.0 - self.data.recirculation)
        return [share * one.carbon for one in self.fresh()]

    def primary_mean(self) -> Stream:
        """Mean composition and enthalpy of the primary zone; moles, CO and NO still unburnt."""
        return self.air.mixed(self.fuel, self.fuel_fractions[0])

    def intermediate(self, burnt: Stream) -> list[Stream]:
        """What enters every intermediate pocket: ``burnt`` gas of the primary zone and air."""
        share, s = self.fuel_fractions[1] / self.fuel_fractions[0], self.data.intermediate_unmixedness
        nodes = spread(self.data.mixture_cutoff, INTERMEDIATE)[0]
        return [self.air.mixed(burnt, share * (1.0 + s * float(z))) for z in nodes]

    def dilution(self, burnt: Stream) -> Stream:
        """What enters the dilution zone: ``burnt`` gas of the intermediate zone and air."""
        return self.air.mixed(burnt, self.fuel_fractions[2] / self.fuel_fractions[1])


def leaving(inflows: Sequence[Stream], weights: np.ndarray, slow: Sequence[tuple[Any, Any, Any]]) -> Stream:
    """Mean of a zone's pockets with the moles, CO and NO [mol/kg] that each of them has in the end.

    ``inflows`` of the pockets, ``weights`` (pockets,) of the mean; ``slow``: these three of each pocket.
    """
    kept = [sum(float(w) * stream.parts()[i] for w, stream in zip(weights, inflows, strict=True)) for i in range(6)]
    changed = [sum(float(w) * one[i] for w, one in zip(weights, slow, strict=True)) for i in range(3)]
    return Stream(*kept, *changed)
