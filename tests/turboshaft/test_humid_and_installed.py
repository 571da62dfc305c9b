"""What the air, the intake and other component maps do to the gas path."""

import itertools

import casadi as ca
import numpy as np
import pytest

from vrsopt.atmosphere import SEA_LEVEL_PRESSURE, standard_air
from vrsopt.turboshaft import gas, maps
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.cycle import gas_path, sized
from vrsopt.turboshaft.data import load_engine
from vrsopt.turboshaft.map_range import outside_map
from vrsopt.turboshaft.stations import similarity, stagnation

ENGINE = load_engine()
PLACE = {
    "power_turbine_speed": 1.0,
    "altitude": 0.0,
    "isa_offset": 0.0,
    "mach": 0.0,
    "bleed_fraction": 0.0,
    "power_offtake": 0.0,
    "humidity": 0.0,
}


def solved(demand, mode="power", engine=ENGINE, component_maps=maps.ANALYTIC, **changes):
    system = gas_path(engine, mode, maps=component_maps)
    solution = system.solve({"demand": demand, **PLACE, **changes}, method="newton")
    assert solution.success, solution.message
    return solution.outputs


@pytest.mark.parametrize("humidity", [0.0, 0.03])
@pytest.mark.parametrize("mach", [0.0, 0.2, 0.4])
def test_ram_conserves_energy_and_entropy_of_the_real_gas(mach, humidity):
    air = standard_air(1000.0, 15.0)
    total, ratio = (float(value) for value in stagnation(air.temperature, mach, humidity))
    gamma, constant = gas.heat_capacity_ratio(air.temperature, 0.0, humidity), gas.gas_constant(0.0, humidity)
    kinetic = 0.5 * mach**2 * gamma * constant * air.temperature
    rise = gas.enthalpy(total, 0.0, humidity) - gas.enthalpy(air.temperature, 0.0, humidity)
    assert rise == pytest.approx(kinetic, rel=1e-9, abs=1e-6)
    if humidity == 0.0:  # nearly the textbook's gas of 1.4
        assert total == pytest.approx(air.temperature * (1 + 0.2 * mach**2), rel=1e-4)
        assert ratio == pytest.approx((1 + 0.2 * mach**2) ** 3.5, rel=1e-3)
    entropy = gas.entropy_function(total, 0.0, humidity) - gas.entropy_function(air.temperature, 0.0, humidity)
    assert entropy == pytest.approx(constant * np.log(ratio), abs=1e-9)


@pytest.mark.parametrize("humidity", [0.01, 0.03])
def test_humid_air_is_another_gas_at_the_same_mach_numbers(humidity):
    """At equal speeds and powers over the speed of sound the compressor works where it did, nearly: gamma changes."""
    sound, _ = (float(value) for value in similarity(288.15, SEA_LEVEL_PRESSURE, humidity))
    assert sound > 1.0 + 0.2 * humidity
    dry = solved(200e3)
    moist = solved(200e3 * sound, power_turbine_speed=sound, humidity=humidity)
    assert moist["compressor_speed"] == pytest.approx(dry["compressor_speed"], rel=4e-3)
    assert moist["pressure_ratio"] == pytest.approx(dry["pressure_ratio"], rel=1e-2)
    assert moist["air_flow"] == pytest.approx(dry["air_flow"] / sound, rel=1e-2)


def test_humidity_costs_temperature_margin_and_fuel_at_power():
    dry, moist = (solved(257e3, humidity=w) for w in (0.0, 0.02))
    assert 0.0 < moist["fuel_flow"] / dry["fuel_flow"] - 1.0 < 0.02
    assert moist["gas_generator_speed"] > dry["gas_generator_speed"]
    assert moist["air_flow"] < dry["air_flow"]


@pytest.mark.parametrize("power", [40e3, 313e3])
def test_energy_is_conserved_in_humid_air_through_an_installed_engine(power):
    engine, w = ENGINE.variant("installed"), 0.02
    out = solved(power, engine=engine, humidity=w, altitude=500.0, power_offtake=4e3, bleed_fraction=0.03)
    air, fuel, ggt = out["air_flow"], out["fuel_flow"], ENGINE.gas_generator_turbine
    start = gas.enthalpy(out["inlet_temperature"], 0.0, w)
    compression = air * (gas.enthalpy(out["compressor_exit_temperature"], 0.0, w) - start)
    lost = compression * (1 / ggt.mechanical_efficiency - 1) + ggt.accessory_power * out["gas_generator_speed"] + 4e3
    bled, inside = 0.03 * air, 0.97 * air
    leaving = (inside + fuel) * gas.enthalpy(out["exhaust_temperature"], fuel * (1 + w) / inside, w)
    leaving += bled * gas.enthalpy(out["compressor_exit_temperature"], 0.0, w)
    heat = fuel * out["combustion_efficiency"] * ENGINE.combustor.heating_value
    shaft = power / ENGINE.power_turbine.mechanical_efficiency
    assert leaving + shaft + lost == pytest.approx(heat + air * start, rel=1e-6)


def test_flow_functions_are_those_of_the_humid_gas():
    """Pressures from the compressor to the exhaust: every W^2 R T/P^2 over its design value has the R of its gas."""
    engine, w, design = ENGINE.variant("installed"), 0.03, sized(ENGINE)
    solution = gas_path(engine).solve({"demand": 150e3, **PLACE, "humidity": w, "bleed_fraction": 0.02})
    out, found = solution.outputs, solution.values
    fuel, burnt, t4 = out["fuel_flow"], out["combustor_air_flow"], out["turbine_inlet_temperature"]
    through, t45 = 0.98 * out["air_flow"] + fuel, out["power_turbine_inlet_temperature"]
    f4, f45 = ((1.0 + w) * fuel / air for air in (burnt, through - fuel))

    def flow(size, mass, pressure, temperature, ratio):
        return (mass / pressure) ** 2 * gas.gas_constant(ratio, w) * temperature / size

    def expansion(hot, cold, ratio):
        fall = gas.entropy_function(hot, ratio, w) - gas.entropy_function(cold, ratio, w)
        return np.exp(fall / gas.gas_constant(ratio, w))

    def swallowed(turbine, ratio, design_ratio):
        return maps.swallowing(ratio, turbine.flow_exponent) / maps.swallowing(design_ratio, turbine.flow_exponent)

    p3, t3 = out["compressor_exit_pressure"], out["compressor_exit_temperature"]
    p4 = p3 * (1.0 - engine.combustor.pressure_loss * flow(design.combustor_parameter, burnt, p3, t3, 0.0))
    first = expansion(t4, design.t45_ideal * np.exp(found["log_inter_turbine_temperature_ideal"] - 1.0), f4)
    expected = swallowed(engine.gas_generator_turbine, first, design.gas_generator_expansion)
    assert flow(design.gas_generator_constant, burnt + fuel, p4, t4, f4) == pytest.approx(expected, rel=1e-7)
    p45 = p4 / first
    p45 *= 1.0 - engine.power_turbine.duct_pressure_loss * flow(design.duct_parameter, through, p45, t45, f45)
    second = expansion(t45, t45 * np.exp(-((design.expansion * found["power_turbine_expansion"]) ** 2)), f45)
    expected = swallowed(engine.power_turbine, second, design.power_turbine_expansion)
    assert flow(design.power_turbine_constant, through, p45, t45, f45) == pytest.approx(expected, rel=1e-7)
    lost = flow(1.0 / design.exhaust_constant, through, p45 / second, out["exhaust_temperature"], f45)
    back = 1.0 + engine.installation.exhaust_back_pressure
    assert p45 / second / SEA_LEVEL_PRESSURE == pytest.approx(back + lost, rel=1e-7)


def test_installation_costs_fuel_and_temperature_but_leaves_the_design_point():
    installed = ENGINE.variant("installed")
    assert sized(installed) == sized(ENGINE)
    bare, fitted = solved(257e3), solved(257e3, engine=installed)
    assert fitted["fuel_flow"] / bare["fuel_flow"] - 1.0 == pytest.approx(0.0137, abs=0.001)
    rise = fitted["power_turbine_inlet_temperature"] - bare["power_turbine_inlet_temperature"]
    assert rise == pytest.approx(16.8, abs=1.0)
    for name in ("intake_pressure_loss", "intake_temperature_rise", "exhaust_back_pressure"):
        alone = ENGINE.changed("installation", **{name: getattr(installed.installation, name)})
        assert solved(257e3, engine=alone)["fuel_flow"] > bare["fuel_flow"] * 1.001


def test_surge_margin_is_that_of_its_definition():
    data = ENGINE.compressor
    assert 0.15 < solved(313e3)["surge_margin"] < 0.25
    for change in ({}, {"power_offtake": 10e3, "bleed_fraction": 0.0}):
        out = solved(150e3, altitude=1500.0, **change)
        speed, ratio = out["compressor_speed"], sized(ENGINE).pressure_ratio
        flow, reached, _ = maps.compressor_map(data, speed, out["map_coordinate"], pressure_ratio=ratio)
        flow_s, reached_s, _ = maps.compressor_map(data, speed, data.surge_coordinate, pressure_ratio=ratio)
        assert out["surge_margin"] == pytest.approx(reached_s / flow_s / (reached / flow) - 1.0, rel=1e-9)
    # power taken from the gas generator slows the air down, bleed opens the way for it
    changes = ({"power_offtake": 10e3}, {}, {"bleed_fraction": 0.03})
    margins = [solved(150e3, **change)["surge_margin"] for change in changes]
    assert margins[0] < margins[1] < margins[2]


def test_outside_map_says_what_leaves_its_range():
    assert outside_map(ENGINE, solved(200e3)) == ""
    slow = solved(0.45, "gas_generator_speed", power_turbine_speed=0.5)
    assert outside_map(ENGINE, slow) == "corrected speed 45 % outside 50 to 110"
    hot = solved(1.15, "gas_generator_speed", altitude=3000.0, isa_offset=-50.0)
    assert outside_map(ENGINE, hot) == (
        "corrected speed 131.9 % outside 50 to 110; inlet temperature 218.6 K outside 220 to 1800; "
        "turbine inlet temperature 1907 K outside 220 to 1800"
    )


def table(data, speed, beta, *, pressure_ratio):
    """The analytic compressor map as a spline through a table, as a user's map would be."""
    speeds, betas = np.linspace(0.4, 1.3, 40), np.linspace(-1.6, 1.6, 30)
    n, b = (part.ravel(order="F") for part in np.meshgrid(speeds, betas, indexing="ij"))
    values = np.vstack(
        [np.array(ca.DM(v)).ravel() for v in maps.compressor_map(data, n, b, pressure_ratio=pressure_ratio)]
    )
    spline = ca.interpolant("table", "bspline", [speeds, betas], values.ravel(order="F"))
    return tuple(ca.vertsplit(spline(ca.vertcat(speed, beta))))


def test_component_maps_can_be_replaced():
    own = maps.ComponentMaps(table, maps.turbine_map, maps.turbine_map, symbols=ca.MX)
    place = {"altitude": 1200.0, "isa_offset": 10.0, "mach": 0.1, "humidity": 0.01}
    for power in (60e3, 257e3):
        ours, theirs = solved(power, **place), solved(power, component_maps=own, **place)
        assert theirs == pytest.approx(ours, rel=2e-4, abs=2e-4)
    slack = maps.ComponentMaps(maps.compressor_map, maps.turbine_map, lambda data, state: (
        maps.turbine_map(data, state)[0], state.spouting**2))  # fmt: skip
    peak = solved(120e3, component_maps=slack, power_turbine_speed=0.6)["fuel_flow"]  # efficiency knows no speed
    assert peak == pytest.approx(solved(120e3, component_maps=slack)["fuel_flow"], rel=1e-9)
    assert gas_path(ENGINE) is gas_path(load_engine()) and gas_path(ENGINE) is not gas_path(ENGINE, maps=slack)


def test_the_corners_of_the_box_are_solved():
    ends = [(20e3, 313e3), (1.0,), (0.0, 2000.0), (-15.0, 30.0), (0.0, 0.22), (0.0, 0.05), (0.0, 10e3), (0.0, 0.03)]
    assert solve_many(np.array(list(itertools.product(*ends)))).success.all()
