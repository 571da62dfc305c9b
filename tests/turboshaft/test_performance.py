"""One engine as a user asks for it: numbers, limits, maximum power, messages."""

import math

import pytest

from vrsopt.errors import InputError
from vrsopt.solvers.status import Status
from vrsopt.turboshaft.cycle import sized
from vrsopt.turboshaft.data import load_engine
from vrsopt.turboshaft.performance import engine, maximum_power, temperature_limit


def test_take_off_rating():
    result = engine(313e3)
    assert result.success and result.status is Status.CONVERGED
    assert result.sfc_kg_kwh == pytest.approx(0.395, rel=0.005)
    assert result.fuel_flow_kg_s * 3600 == pytest.approx(123.6, rel=0.005)
    carbon = 44.009 / 28.010 * result.co_kg_s  # leaves as CO instead
    assert result.co2_kg_s + carbon == pytest.approx(3.156 * result.fuel_flow_kg_s, rel=2e-4)
    assert result.gas_generator_speed_percent == pytest.approx(100.0)
    assert result.residual_norm < 1e-8
    assert "313.0 kW" in str(result) and "0.395 kg/kWh" in str(result)


def test_zero_power_has_fuel_flow_but_no_specific_consumption():
    result = engine(0.0)
    assert result.success and result.sfc_kg_kwh is None
    assert 0.005 < result.fuel_flow_kg_s < engine(21.9e3).fuel_flow_kg_s


def test_maximum_power_by_limit():
    hot = maximum_power(altitude=2000.0, isa_offset=20.0)
    assert hot.success and "temperature" in hot.limit
    # driven there, the engine meets the limit; 1 % more is refused with the maximum in the message
    assert engine(hot.power, altitude=2000.0, isa_offset=20.0).success
    refused = engine(1.01 * hot.power, altitude=2000.0, isa_offset=20.0)
    assert not refused.success and refused.status is not Status.CONVERGED
    assert f"maximum power {hot.power / 1e3:.1f} kW, limited by the turbine temperature limit" in refused.message
    assert "2000 m, ISA+20 K" in refused.message and "\n" not in refused.message
    assert refused.power_turbine_inlet_temperature_k > temperature_limit(load_engine())

    cold = maximum_power(isa_offset=-30.0)
    assert cold.limit == "take-off rating" and cold.power == pytest.approx(313e3)
    assert not engine(330e3, isa_offset=-30.0).success

    slow = load_engine().changed("ratings", gas_generator_speed=0.95)
    assert maximum_power(engine_data=slow).limit == "gas-generator speed limit"
    assert maximum_power(engine_data=slow).gas_generator_speed == pytest.approx(0.95)


def test_maximum_power_falls_with_temperature_and_altitude():
    # limited by the turbine inlet instead of between the turbines, an independent implementation gave 258, 276, 229 kW
    for place, power in (((0.0, 20.0), 258e3), ((2000.0, 0.0), 276e3), ((2000.0, 20.0), 229e3)):
        assert maximum_power(altitude=place[0], isa_offset=place[1]).power == pytest.approx(power, rel=0.02)


def test_temperature_limit_is_the_design_point():
    assert temperature_limit(load_engine()) == sized(load_engine()).t45


@pytest.mark.parametrize("power", [3e6, 1e12, 1e303])
def test_a_cycle_without_solution_has_no_numbers_but_names_the_maximum(power):
    result = engine(power)
    assert not result.success and math.isnan(result.fuel_flow_kg_s)
    assert "can not be had: maximum power 313.0 kW" in result.message


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: engine(-1.0), "engine: power = -1.0"),
        (lambda: engine(math.nan), "engine: power = nan"),
        (lambda: engine(2e5, power_turbine_speed=100.0), "power_turbine_speed = 100.0: a number from 0.4 to 1.4"),
        (lambda: engine(2e5, mach=1.0), "mach = 1.0"),
        (lambda: maximum_power(altitude=20000.0), "altitude = 20000.0: a number from -500 to 6000"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(InputError, match=message):
        call()
