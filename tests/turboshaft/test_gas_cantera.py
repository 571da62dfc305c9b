"""Gas properties against Cantera's NASA polynomials: dry and humid air, and the lean products of kerosene in both."""

import cantera
import numpy as np
import pytest

from vrsopt.turboshaft import gas

TEMPERATURES = np.linspace(230.0, 1790.0, 79)
AIR = {"N2": 0.78084, "O2": 0.209476, "Ar": 0.009365, "CO2": 0.000319}  # moles
SPECIES = [item for item in cantera.Species.list_from_file("nasa_gas.yaml") if item.name in (*AIR, "H2O")]
CARBON, HYDROGEN = 12.0, 23.0  # atoms of the fuel


def products(fuel_air_ratio, humidity):
    """Moles of complete combustion of C12H23 in one mole of dry air with ``humidity``."""
    solution = cantera.Solution(thermo="ideal-gas", species=SPECIES)
    weight = dict(zip(solution.species_names, solution.molecular_weights, strict=True))
    mass = sum(weight[name] * moles for name, moles in AIR.items())
    fuel = fuel_air_ratio * mass / (CARBON * 12.011 + HYDROGEN * 1.008)
    moles = {**AIR, "H2O": humidity * mass / weight["H2O"] + fuel * HYDROGEN / 2, "CO2": AIR["CO2"] + fuel * CARBON}
    moles["O2"] -= fuel * (CARBON + HYDROGEN / 4)
    solution.TPX = 300.0, cantera.one_atm, moles
    return solution


@pytest.mark.parametrize("humidity", [0.0, 0.015, 0.03])
@pytest.mark.parametrize("ratio", [0.0, 0.012, 0.025])
def test_enthalpy_and_entropy_are_those_of_the_mixture(ratio, humidity):
    mixture = products(ratio, humidity)

    def state(temperature):
        mixture.TP = temperature, cantera.one_atm
        return mixture.enthalpy_mass, mixture.entropy_mass, mixture.cp_mass

    h, s, cp = np.array([state(float(t)) for t in TEMPERATURES]).T
    h0, s0, _ = state(gas.REFERENCE_TEMPERATURE)
    phi0 = gas.entropy_function(gas.REFERENCE_TEMPERATURE, ratio, humidity)
    kelvin = (gas.enthalpy(TEMPERATURES, ratio, humidity) - (h - h0)) / cp
    assert np.max(np.abs(kelvin)) < 0.1
    kelvin = (gas.entropy_function(TEMPERATURES, ratio, humidity) - phi0 - (s - s0)) * TEMPERATURES / cp
    assert np.max(np.abs(kelvin)) < 0.1
    assert gas.heat_capacity(TEMPERATURES, ratio, humidity) == pytest.approx(cp, rel=2e-3)
    assert gas.gas_constant(ratio, humidity) == pytest.approx(
        cantera.gas_constant / mixture.mean_molecular_weight, rel=1e-5
    )
    cold = gas.heat_capacity_ratio(300.0, ratio, humidity)
    mixture.TP = 300.0, cantera.one_atm
    assert cold == pytest.approx(mixture.cp / mixture.cv, rel=1e-3)


def test_pure_vapour():
    water = cantera.Solution(thermo="ideal-gas", species=SPECIES)
    water.X = {"H2O": 1.0}
    water.TP = gas.REFERENCE_TEMPERATURE, cantera.one_atm
    start, much = water.enthalpy_mass, 1e9  # kg of vapour per kg of air
    for temperature, value in zip(TEMPERATURES, gas.enthalpy(TEMPERATURES, 0.0, much), strict=True):
        water.TP = temperature, cantera.one_atm
        assert abs(value - (water.enthalpy_mass - start)) / water.cp_mass < 0.1
