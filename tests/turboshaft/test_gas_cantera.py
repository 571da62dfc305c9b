"""Gas properties against Cantera's NASA polynomials: dry and humid air, and the lean products of kerosene in both."""

import sys
from pathlib import Path

import cantera
import pytest

from vrsopt.turboshaft import gas

PROBLEMS = Path(__file__).parents[2] / "problems"
sys.path.insert(0, str(PROBLEMS))
try:
    from validation_gas import FUEL_AIR_RATIOS, HUMIDITIES, SPECIES, TEMPERATURES, differences, products
finally:
    sys.path.remove(str(PROBLEMS))


@pytest.mark.parametrize("humidity", HUMIDITIES)
@pytest.mark.parametrize("ratio", FUEL_AIR_RATIOS)
def test_enthalpy_and_entropy_are_those_of_the_mixture(ratio, humidity):
    found = differences(ratio, humidity)  # what the validation page states
    assert found.enthalpy < 0.1 and found.entropy < 0.1
    assert found.heat_capacity < 0.2
    mixture = products(ratio, humidity)
    assert gas.gas_constant(ratio, humidity) == pytest.approx(
        cantera.gas_constant / mixture.mean_molecular_weight, rel=1e-5
    )
    assert gas.heat_capacity_ratio(300.0, ratio, humidity) == pytest.approx(mixture.cp / mixture.cv, rel=1e-3)


def test_pure_vapour():
    water = cantera.Solution(thermo="ideal-gas", species=SPECIES)
    water.X = {"H2O": 1.0}
    water.TP = gas.REFERENCE_TEMPERATURE, cantera.one_atm
    start, much = water.enthalpy_mass, 1e9  # kg of vapour per kg of air
    for temperature, value in zip(TEMPERATURES, gas.enthalpy(TEMPERATURES, 0.0, much), strict=True):
        water.TP = temperature, cantera.one_atm
        assert abs(value - (water.enthalpy_mass - start)) / water.cp_mass < 0.1
