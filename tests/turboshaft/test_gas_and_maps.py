"""Gas properties against air tables and each other; component maps at and around the design point."""

import numpy as np
import pytest

from vrsopt.turboshaft import gas, maps
from vrsopt.turboshaft.data import load_engine

TEMPERATURES = np.array([230.0, 300.0, 600.0, 1000.0, 1400.0, 1790.0])


@pytest.mark.parametrize("ratio", [0.0, 0.02, 0.03])
def test_enthalpy_and_entropy_are_integrals_of_the_heat_capacity(ratio):
    step = 1e-2
    high, low = TEMPERATURES + step, TEMPERATURES - step
    slope = (gas.enthalpy(high, ratio) - gas.enthalpy(low, ratio)) / (2 * step)
    assert slope == pytest.approx(gas.heat_capacity(TEMPERATURES, ratio), rel=1e-8)
    slope = (gas.entropy_function(high, ratio) - gas.entropy_function(low, ratio)) / (2 * step)
    assert slope * TEMPERATURES == pytest.approx(gas.heat_capacity(TEMPERATURES, ratio), rel=1e-8)


def test_air_table():
    # ideal-gas air, Moran & Shapiro table A-22: h and s0 between 300 and 1000, 300 and 1500 K
    assert gas.enthalpy(1000.0) - gas.enthalpy(300.0) == pytest.approx(745.85e3, rel=1e-3)
    assert gas.enthalpy(1500.0) - gas.enthalpy(300.0) == pytest.approx(1335.78e3, rel=1e-3)
    assert gas.entropy_function(1000.0) - gas.entropy_function(300.0) == pytest.approx(1265.67, rel=1e-3)
    assert gas.gas_constant() == pytest.approx(287.05, rel=1e-4)


def test_products_of_kerosene_at_stoichiometric_ratio():
    # CO2, H2O, N2, Ar of C12H23 burnt in air at 1000 K, from tabulated molar heat capacities (JANAF)
    moles = {"CO2": (12.0, 54.308, 44.010), "H2O": (11.5, 41.268, 18.015), "N2": (66.15, 32.697, 28.013)}
    moles["Ar"] = (0.79, 20.786, 39.948)
    mass = sum(n * weight for n, _, weight in moles.values())
    heat = sum(n * cp for n, cp, _ in moles.values()) / mass * 1e3
    fuel_air_ratio = 0.068163  # stoichiometric
    assert gas.heat_capacity(1000.0, fuel_air_ratio) == pytest.approx(heat, rel=2e-3)


def test_maps_pass_through_the_design_point():
    data = load_engine().compressor
    flow, ratio, efficiency = maps.compressor_map(data, 1.0, 0.0, pressure_ratio=7.1)
    assert (flow, ratio, efficiency) == (1.0, pytest.approx(7.1), data.efficiency)
    for turbine in (load_engine().power_turbine, load_engine().gas_generator_turbine):
        assert maps.turbine_map(turbine, maps.TurbineState(1.0, 1.0, 1.0, 2.6, 2.6)) == (1.0, 1.0)


def test_speed_lines_choke_and_fall():
    data = load_engine().compressor
    beta = np.linspace(-1.0, 6.0, 50)
    flow, ratio, _ = maps.compressor_map(data, 0.9, beta, pressure_ratio=7.1)
    assert np.all(np.diff(flow.full().ravel()) > 0) and np.all(np.diff(ratio.full().ravel()) < 0)
    ends = flow.full().ravel()
    assert ends[-1] - ends[-2] < 0.01 * (ends[1] - ends[0])


def test_turbine_work_is_efficiency_times_isentropic_work():
    spouting, speed, curvature = 0.8, 1.1, 0.75
    efficiency = 1.0 - curvature * (speed / spouting - 1.0) ** 2
    assert maps.turbine_work(curvature, speed, spouting) == pytest.approx(efficiency * spouting**2, rel=1e-12)


def test_the_best_velocity_ratio_is_where_efficiency_is_highest():
    ratio = np.linspace(0.6, 1.5, 901)
    efficiency = maps.turbine_work(0.9, 0.8 * ratio, 0.8, best=1.1) / 0.8**2
    assert ratio[np.argmax(efficiency)] == pytest.approx(1.1)
    assert maps.turbine_work(0.9, 1.0, 1.0, best=1.1) == pytest.approx(1.0, rel=1e-14)


def test_combustion_efficiency_falls_with_loading_to_a_floor():
    data = load_engine().combustor
    assert maps.combustion_efficiency(data, 1.0) == pytest.approx(data.efficiency, rel=1e-14)
    loading = np.linspace(1.1, 6.0, 50)
    efficiency = maps.combustion_efficiency(data, loading).full().ravel()
    assert np.all(np.diff(efficiency) < 0) and efficiency[-1] > 1.0 - 1.05 * data.loss_ceiling
    # Walsh & Fletcher: loading ~ W / (P^1.8 10^(0.00145 (T - 400)))
    assert maps.combustor_loading(2.0, 3.0, 500.0) / maps.combustor_loading(1.0, 1.0, 400.0) == pytest.approx(
        2.0 / (3.0**1.8 * 10.0**0.145), rel=2e-3
    )
