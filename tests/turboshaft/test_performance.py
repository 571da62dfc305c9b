"""One engine as a user asks for it: numbers, limits, maximum power, messages."""

import math
import re

import pytest

from vrsopt.errors import InputError
from vrsopt.solvers.status import Status
from vrsopt.turboshaft.cycle import sized
from vrsopt.turboshaft.data import load_engine
from vrsopt.turboshaft.performance import engine, maximum_power, minimum_power, temperature_limit


def test_take_off_rating():
    result = engine(313e3)
    assert result.success and result.status is Status.CONVERGED
    assert result.sfc_kg_kwh == pytest.approx(0.395, rel=0.005)
    assert result.fuel_flow_kg_s * 3600 == pytest.approx(123.6, rel=0.005)
    carbon = 44.009 / 28.010 * result.co_kg_s  # leaves as CO instead
    burnt = (1.0 - 1e-3 * result.hc_index_g_kg) * result.fuel_flow_kg_s
    assert result.co2_kg_s + carbon == pytest.approx(3.156 * burnt, rel=2e-4)
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
        (lambda: engine(2e5, power_offtake=-1.0), "power_offtake = -1.0: a number of at least 0"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(InputError, match=message):
        call()


@pytest.mark.parametrize("place", [{}, {"altitude": 1500.0, "isa_offset": 15.0, "mach": 0.15, "humidity": 0.015}])
def test_the_kinds_of_demand_are_one_engine(place):
    first = engine(180e3, **place)
    by_speed = engine(gas_generator_speed=first.gas_generator_speed_percent / 100.0, **place)
    by_heat = engine(inter_turbine_temperature=first.power_turbine_inlet_temperature_k, **place)
    for other in (by_speed, by_heat):
        assert other.success and other.power_w == pytest.approx(180e3, rel=1e-6)
        assert other.fuel_flow_kg_s == pytest.approx(first.fuel_flow_kg_s, rel=1e-6)


def test_bleed_and_offtake_reach_the_cycle():
    bare, loaded = engine(200e3), engine(200e3, bleed_fraction=0.03, power_offtake=5e3)
    assert loaded.fuel_flow_kg_s > 1.02 * bare.fuel_flow_kg_s
    assert loaded.surge_margin_percent != pytest.approx(bare.surge_margin_percent, abs=0.1)
    refused = engine(313e3, bleed_fraction=0.03, power_offtake=5e3)
    assert not refused.success and "bleed 3.0 %, offtake 5.0 kW" in refused.message


def test_ratings_are_those_of_the_data_file():
    assert load_engine().ratings.names == ("take_off", "maximum_continuous", "ground_idle")
    take_off = engine(rating="take_off")
    assert take_off.success and take_off.power_w == pytest.approx(313e3, rel=1e-6)
    assert take_off.message.startswith("take off: maximum power 313.0 kW, limited by the ")
    hot = engine(rating="maximum_continuous", isa_offset=20.0)
    assert hot.success and hot.power_w == pytest.approx(maximum_power(isa_offset=20.0).power, rel=1e-6)
    generic = load_engine("generic_500kw")
    continuous = engine(rating="maximum_continuous", engine_data=generic)
    limit = 0.97 * sized(generic).t45
    assert continuous.power_turbine_inlet_temperature_k == pytest.approx(limit, abs=0.01) or (
        continuous.power_w == pytest.approx(450e3) and continuous.power_turbine_inlet_temperature_k < limit
    )
    assert "turbine temperature of the rating" in continuous.message


def test_ground_idle_runs_with_a_slow_power_turbine():
    idle = engine(rating="ground_idle")
    assert idle.success and idle.gas_generator_speed_percent == pytest.approx(62.0)
    assert idle.power_turbine_speed_percent == pytest.approx(65.0)
    assert 0.0 < idle.power_w < 40e3
    # recalled: 0.0077 kg/s; FOCA at 7 %: 0.0107 kg/s
    assert 0.0077 < idle.fuel_flow_kg_s < 1.1 * 0.0107
    for altitude, speed in ((0.0, 0.5), (2000.0, 0.6), (2000.0, 0.75)):
        assert engine(rating="ground_idle", altitude=altitude, power_turbine_speed=speed, isa_offset=30.0).success
    refused = engine(rating="ground_idle", power_turbine_speed=1.0)
    assert not refused.success and refused.status is Status.INFEASIBLE and refused.power_w < 0
    assert "gas-generator speed 62.00 % can not be had: minimum gas-generator speed 63." in refused.message


@pytest.mark.parametrize(
    ("demand", "message"),
    [
        (
            {"gas_generator_speed": 1.08},
            "108.00 % can not be had: maximum gas-generator speed 100.00 %, limited by the tur",
        ),
        ({"gas_generator_speed": 0.45}, "minimum gas-generator speed 63.[0-9]* %, limited by the power turbine, which"),
        ({"inter_turbine_temperature": 1200.0}, "1200.0 K can not be had: maximum inter-turbine temperature 1113.4 K"),
        ({"inter_turbine_temperature": 760.0}, "760.0 K can not be had: it does not fall below 781.[0-9] K, at 0 m"),
        ({"inter_turbine_temperature": 782.0}, "782.0 K can not be had: minimum power 0.0 kW, limited by the power"),
        ({"power": 2e3, "power_turbine_speed": 0.65, "power_offtake": 10e3}, "minimum power 5.9 kW, .* sustain itself"),
    ],
)
def test_a_demand_that_can_not_be_met_says_which_limit_and_where_it_is(demand, message):
    result = engine(**demand)
    assert not result.success and result.status is Status.INFEASIBLE
    assert re.search(message, result.message), result.message
    assert "\n" not in result.message


def test_the_least_power_meets_its_limit():
    place = {"power_turbine_speed": 0.65, "power_offtake": 10e3}
    least = minimum_power(**place)
    assert least.success and least.inter_turbine_temperature == pytest.approx(
        temperature_limit(load_engine()), rel=1e-6
    )
    assert engine(1.02 * least.power, **place).success and not engine(0.98 * least.power, **place).success
    assert minimum_power().power == pytest.approx(0.0, abs=1.0)
    # with a surge line close by, power taken from a slow gas generator leads to surge first
    close = load_engine().changed("compressor", surge_coordinate=-0.35)
    surging = minimum_power(engine_data=close, power_offtake=10e3)
    assert surging.power > 100.0 and "surge" in surging.limit
    assert engine(0.0, engine_data=close, power_offtake=10e3).surge_margin_percent < 0.0
    assert "surge" in engine(0.0, engine_data=close, power_offtake=10e3).message


def test_no_power_without_surge():
    close = load_engine().changed("compressor", surge_coordinate=-0.02)
    most = maximum_power(engine_data=close, power_offtake=10e3)
    assert not most.success and "no power without surge: margin -" in most.message
    assert not minimum_power(engine_data=close, power_offtake=10e3).success
    for demand in ({"power": 200e3}, {"rating": "take_off"}):
        refused = engine(**demand, engine_data=close, power_offtake=10e3)
        assert not refused.success and "no power without surge" in refused.message


@pytest.mark.parametrize("offtake", [60e3, 200e3, 1e9])
def test_no_power_where_the_turbines_are_too_hot_at_any_speed(offtake):
    """So much is taken from the gas generator that no speed of it keeps the limit: 313 kW would, far beyond it."""
    most, least = maximum_power(power_offtake=offtake), minimum_power(power_offtake=offtake)
    for extreme in (most, least):
        assert not extreme.success and extreme.status is Status.INFEASIBLE
        assert "no power inside the limits" in extreme.message and "\n" not in extreme.message
    assert least.end == "minimum"
    for demand in ({"power": 100e3}, {"rating": "take_off"}):
        refused = engine(**demand, power_offtake=offtake)
        assert not refused.success and refused.status is Status.INFEASIBLE
        assert "no power inside the limits" in refused.message


def test_the_maximum_of_a_rating_is_at_the_speed_of_the_rating():
    idle = maximum_power(rating="ground_idle")
    assert idle.power == pytest.approx(engine(rating="ground_idle").power_w, rel=1e-9) and idle.power > 0.0
    assert maximum_power(rating="ground_idle", power_turbine_speed=0.6).power > idle.power


def test_inside_and_outside_the_map():
    assert engine(200e3).inside_map and engine(200e3).map_note == ""
    slow = engine(gas_generator_speed=0.42, power_turbine_speed=0.5)
    assert not slow.inside_map and "corrected speed 42 % outside 50 to 110" in str(slow)


def test_emissions_belong_to_the_gas_path():
    from vrsopt.combustor.emissions import emissions
    from vrsopt.turboshaft.operating_range import checked_place, solve

    result, data = engine(200e3, humidity=0.01), load_engine()
    exact = emissions(data, solve(data, "power", 200e3, checked_place(humidity=0.01)))
    assert result.nox_kg_s == pytest.approx(exact.nox, rel=1e-7) and result.co_kg_s == pytest.approx(exact.co, rel=1e-7)
    assert result.nox_index_g_kg == pytest.approx(1e3 * result.nox_kg_s / result.fuel_flow_kg_s)
    assert result.nox_range_kg_s[0] <= result.nox_kg_s <= result.nox_range_kg_s[1]
    assert result.nox_kg_s < engine(200e3).nox_kg_s
    assert f"{result.nox_index_g_kg:.2f} g/kg" in str(result)
    assert "g/kg by FOCA's correlation; at idle NOx and CO are indicative only" in str(result)


def test_emissions_that_fail_do_not_fail_the_engine(monkeypatch):
    from dataclasses import replace

    from vrsopt.combustor import emissions as module

    real = module.emissions
    monkeypatch.setattr(module, "emissions", lambda data, path: replace(real(data, path), success=False, message="out"))
    result = engine(200e3)
    assert result.success and math.isnan(result.nox_kg_s) and math.isnan(result.co_index_g_kg)
    assert result.co2_kg_s == pytest.approx(3.156 * result.fuel_flow_kg_s, rel=2e-4)
    assert result.message.endswith("; emissions: out")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: engine(),
            "no demand given: exactly one of power, gas_generator_speed, inter_turbine_temperature, rating",
        ),
        (lambda: engine(2e5, rating="take_off"), "power and rating given: exactly one"),
        (
            lambda: engine(rating="cruise"),
            "rating = 'cruise': expected one of: take_off, maximum_continuous, ground_idle",
        ),
        (lambda: engine(2e5, humidity=0.2), "humidity = 0.2: a number from 0 to 0.05"),
        (lambda: engine(gas_generator_speed=95.0), "gas_generator_speed = 95.0: a number from 0.3 to 1.3"),
        (lambda: maximum_power(speed=1.0), "unknown argument 'speed'"),
    ],
)
def test_wrong_arguments_of_the_new_demands(call, message):
    with pytest.raises(InputError, match=message):
        call()
