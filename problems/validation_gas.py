"""Gas properties against Cantera's NASA polynomials: dry and humid air, and the lean products of kerosene in both.

Numbers and a table for problems/validation.md. Imported by validation.py, and by tests/turboshaft/test_gas_cantera.py,
which holds them to their bounds.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import cantera
import numpy as np
from page_table import table

from vrsopt.turboshaft import gas

TEMPERATURES = np.linspace(230.0, 1790.0, 79)  # K
FUEL_AIR_RATIOS, HUMIDITIES = (0.0, 0.012, 0.025), (0.0, 0.015, 0.03)
AIR = {"N2": 0.78084, "O2": 0.209476, "Ar": 0.009365, "CO2": 0.000319}  # moles
SPECIES = [item for item in cantera.Species.list_from_file("nasa_gas.yaml") if item.name in (*AIR, "H2O")]
CARBON, HYDROGEN = 12.0, 23.0  # atoms of the fuel


def products(fuel_air_ratio: float, humidity: float) -> cantera.Solution:
    """Moles of complete combustion of C12H23 in one mole of dry air with ``humidity`` [kg/kg]."""
    solution = cantera.Solution(thermo="ideal-gas", species=SPECIES)
    weight = dict(zip(solution.species_names, solution.molecular_weights, strict=True))
    mass = sum(weight[name] * moles for name, moles in AIR.items())
    fuel = fuel_air_ratio * mass / (CARBON * 12.011 + HYDROGEN * 1.008)
    moles = {**AIR, "H2O": humidity * mass / weight["H2O"] + fuel * HYDROGEN / 2, "CO2": AIR["CO2"] + fuel * CARBON}
    moles["O2"] -= fuel * (CARBON + HYDROGEN / 4)
    solution.TPX = 300.0, cantera.one_atm, moles
    return solution


class Difference(NamedTuple):
    """Largest differences over TEMPERATURES: enthalpy and entropy as temperature [K], heat capacity [%]."""

    fuel_air_ratio: float
    humidity: float
    enthalpy: float
    entropy: float
    heat_capacity: float


@cache
def differences(fuel_air_ratio: float, humidity: float) -> Difference:
    mixture = products(fuel_air_ratio, humidity)

    def state(temperature: float) -> tuple[float, float, float]:
        mixture.TP = temperature, cantera.one_atm
        return mixture.enthalpy_mass, mixture.entropy_mass, mixture.cp_mass

    where = fuel_air_ratio, humidity
    h, s, cp = np.array([state(float(t)) for t in TEMPERATURES]).T
    h0, s0, _ = state(gas.REFERENCE_TEMPERATURE)
    entropy = gas.entropy_function(TEMPERATURES, *where) - gas.entropy_function(gas.REFERENCE_TEMPERATURE, *where)
    return Difference(
        *where,
        float(np.max(np.abs((gas.enthalpy(TEMPERATURES, *where) - (h - h0)) / cp))),
        float(np.max(np.abs((entropy - (s - s0)) * TEMPERATURES / cp))),
        100.0 * float(np.max(np.abs(gas.heat_capacity(TEMPERATURES, *where) / cp - 1.0))),
    )


@cache
def all_differences() -> list[Difference]:
    return [differences(ratio, humidity) for ratio in FUEL_AIR_RATIOS for humidity in HUMIDITIES]


def gas_table() -> Iterator[str]:
    yield (
        f"Gas properties against Cantera's, {TEMPERATURES[0]:.0f} to {TEMPERATURES[-1]:.0f} K, largest difference of "
        "enthalpy and entropy (as temperature) and of the heat capacity:\n"
    )
    rows = [
        (
            f"{d.fuel_air_ratio:g}",
            f"{d.humidity:g}",
            f"{d.enthalpy:.3f} K",
            f"{d.entropy:.3f} K",
            f"{d.heat_capacity:.3f} %",
        )
        for d in all_differences()
    ]
    yield from table(("fuel-air ratio", "humidity kg/kg", "enthalpy", "entropy", "heat capacity"), rows)
