"""The gas path: design point, modes, solvers, derivatives, similarity and published trends."""

import casadi as ca
import numpy as np
import pytest

from vrsopt import foca
from vrsopt.atmosphere import standard_air
from vrsopt.errors import InputError
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.cycle import gas_path, sized
from vrsopt.turboshaft.data import load_engine
from vrsopt.turboshaft.gas import enthalpy

PLACE = {"power_turbine_speed": 1.0, "altitude": 0.0, "isa_offset": 0.0, "mach": 0.0}
EXTRAS = {"bleed_fraction": 0.0, "power_offtake": 0.0, "humidity": 0.0}
ENGINE = load_engine()
CONSTANT = ENGINE.changed(
    "combustor", loss_slope=0.0, loss_curvature=0.0
)  # combustion efficiency as at the design point


def solved(demand, mode="power", engine=ENGINE, **changes):
    solution = gas_path(engine, mode).solve({"demand": demand, **PLACE, **EXTRAS, **changes}, method="newton")
    assert solution.success, solution.message
    return solution.outputs


def many(demand, speed=1.0, altitude=0.0, isa_offset=0.0, mach=0.0, mode="power", engine=ENGINE):
    columns = np.broadcast_arrays(demand, speed, altitude, isa_offset, mach, 0.0, 0.0, 0.0)
    result = solve_many(np.column_stack([np.ravel(c) for c in columns]), mode=mode, engine_data=engine)
    assert result.success.all()
    return result.outputs


def sfc(power, **settings):
    return solved(power, **settings)["fuel_flow"] * 3.6e6 / power


def test_the_design_point_is_a_root_by_construction():
    system = gas_path(ENGINE)
    start = [unknown.start for unknown in system.unknowns]
    z, p, r, _ = system.nlp_terms()
    residual = ca.Function("residual", [z, p], [r])(start, [313e3, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).full()
    assert residual.shape == (9, 1) and np.max(np.abs(residual)) < 1e-10
    out = solved(313e3)
    assert sfc(313e3) == pytest.approx(0.395, rel=1e-6)
    assert out["air_flow"] == pytest.approx(1.56, rel=1e-6)
    assert out["pressure_ratio"] == pytest.approx(7.1, rel=1e-6)
    assert out["power"] == pytest.approx(313e3, rel=1e-6)
    assert out["co2_flow"] == pytest.approx(3.156 * out["fuel_flow"], rel=2e-4)


def test_energy_balance_leaves_the_power_turbine_a_usual_efficiency():
    assert 0.75 < sized(ENGINE).power_turbine_efficiency < 0.82


@pytest.mark.parametrize("power", [30e3, 150e3, 313e3])
def test_energy_is_conserved_from_outside(power):
    """Heat and air in = exhaust + shaft power + what bearings, gear, accessories and offtake take."""
    out = solved(power, altitude=1200.0, isa_offset=10.0, power_offtake=4e3)
    air, fuel, ggt = out["air_flow"], out["fuel_flow"], ENGINE.gas_generator_turbine
    inlet = enthalpy(standard_air(1200.0, 10.0).temperature)
    compression = air * (enthalpy(out["compressor_exit_temperature"]) - inlet)
    lost = compression * (1 / ggt.mechanical_efficiency - 1) + ggt.accessory_power * out["gas_generator_speed"] + 4e3
    exhaust = (air + fuel) * enthalpy(out["exhaust_temperature"], fuel / air)
    heat = fuel * out["combustion_efficiency"] * ENGINE.combustor.heating_value
    shaft = power / ENGINE.power_turbine.mechanical_efficiency
    assert exhaust + shaft + lost == pytest.approx(heat + air * inlet, rel=1e-6)


@pytest.mark.parametrize(
    ("power", "speed", "t4", "t45", "consumption"),
    [
        (276e3, 0.976, 1304, 1071, 0.408),
        (207e3, 0.925, 1214, 998, 0.446),
        (119e3, 0.842, 1091, 902, 0.564),
        (47e3, 0.740, 982, 823, 0.986),
    ],
)
def test_part_power_with_constant_combustion_efficiency(power, speed, t4, t45, consumption):
    """Computed earlier by an independent implementation of these equations: efficiency 0.985, curvature 0.75."""
    engine = CONSTANT.changed("combustor", efficiency=0.985).changed("power_turbine", speed_curvature=0.75)
    out = solved(power, engine=engine)
    assert out["gas_generator_speed"] == pytest.approx(speed, abs=6e-4)
    assert out["turbine_inlet_temperature"] == pytest.approx(t4, abs=0.7)
    assert out["power_turbine_inlet_temperature"] == pytest.approx(t45, abs=0.7)
    assert sfc(power, engine=engine) == pytest.approx(consumption, abs=6e-4)


def test_combustion_efficiency_follows_the_carbon_monoxide_and_unburnt_fuel_of_the_fleet():
    power = np.array([75e3, 120e3, 207e3, 313e3])
    lost = (10.1e6 * foca.co_index(power) + 43.1e6 * foca.hc_index(power)) / 43.1e6
    assert many(power)["combustion_efficiency"] == pytest.approx(1.0 - lost, abs=0.004)


def test_best_power_turbine_speed_does_not_come_from_the_combustion_efficiency():
    """The shipped engine's: tests/test_validation_page.py."""
    speeds, found = np.linspace(0.55, 1.15, 1201), []
    for generator, reference in ((1.0, 1.0), (0.95, 0.91), (0.9, 0.83), (0.85, 0.76), (0.8, 0.69)):
        out = many(generator, speeds, mode="gas_generator_speed", engine=CONSTANT)
        best = int(np.argmin(out["fuel_flow"] / out["power"]))
        assert speeds[best] == pytest.approx(reference, abs=0.02)
        assert speeds[best] == pytest.approx(out["best_power_turbine_speed"][best], rel=0.01)
        found.append(speeds[best])
    assert np.all(np.diff(found) < 0.0)


def test_the_triangles_move_the_best_speed_and_halve_what_a_slower_turbine_saves():
    saved = []
    for engine in (ENGINE, ENGINE.variant("triangles_optimum")):
        speeds = np.linspace(0.6, 1.3, 141)
        fuel = many(200e3, speeds, engine=engine)["fuel_flow"]
        best, here = int(np.argmin(fuel)), int(np.argmin(abs(speeds - 1.0)))
        out = solved(200e3, engine=engine, power_turbine_speed=speeds[best])
        assert speeds[best] == pytest.approx(out["best_power_turbine_speed"], abs=0.01)
        saved.append(1.0 - fuel[best] / fuel[here])
    assert 0.3 < saved[1] / saved[0] < 0.7


def test_gain_of_the_best_power_turbine_speed_grows_with_the_turbine_map_curvature():
    gains = []
    for curvature in (0.2, 0.75):
        engine = ENGINE.changed("power_turbine", speed_curvature=curvature)
        out = many(0.9, [1.0, 0.834], mode="gas_generator_speed", engine=engine)
        ratio = out["fuel_flow"] / out["power"]
        gains.append(1.0 - ratio[1] / ratio[0])
    assert 0.005 < gains[0] < 0.3 * gains[1] < 0.3 * 0.032


@pytest.mark.parametrize(("altitude", "offset"), [(2000.0, 0.0), (0.0, 30.0), (0.0, -15.0)])
def test_referred_parameters(altitude, offset):
    """Fuel with constant combustion efficiency, and heat released in any case. The shipped engine's fuel, speeds and
    temperatures: tests/test_validation_page.py."""
    power, speed, mach = np.array([100e3, 200e3, 280e3]), np.array([0.9, 1.0, 1.05]), 0.1
    air, ground = standard_air(altitude, offset), standard_air(0.0)
    theta, delta = air.temperature / ground.temperature, air.pressure / ground.pressure
    for engine in (CONSTANT, ENGINE):
        base = many(power, speed, mach=mach, engine=engine)
        away = many(power * delta * theta**0.5, speed * theta**0.5, altitude, offset, mach, engine=engine)
        fuel = away["fuel_flow"] / base["fuel_flow"] / (delta * theta**0.5)
        heat = fuel * away["combustion_efficiency"] / base["combustion_efficiency"]
        assert heat == pytest.approx(np.ones(3), abs=0.02)
        if engine is CONSTANT:
            assert fuel == pytest.approx(np.ones(3), abs=0.02)
            shaft = away["gas_generator_speed"] / base["gas_generator_speed"] / theta**0.5
            assert shaft == pytest.approx(np.ones(3), abs=0.004)
            assert away["pressure_ratio"] / base["pressure_ratio"] == pytest.approx(np.ones(3), abs=0.004)
            kelvin = away["turbine_inlet_temperature"] / base["turbine_inlet_temperature"] / theta
            assert kelvin == pytest.approx(np.ones(3), abs=0.01)


def test_bleed_and_offtake_cost_fuel_and_temperature():
    base = solved(313e3)
    for change, fuel, kelvin in (({"bleed_fraction": 0.03}, 0.028, 34.0), ({"power_offtake": 10e3}, 0.020, 23.0)):
        out = solved(313e3, **change)
        assert out["fuel_flow"] / base["fuel_flow"] - 1.0 == pytest.approx(fuel, abs=0.001)
        rise = out["turbine_inlet_temperature"] - base["turbine_inlet_temperature"]
        assert rise == pytest.approx(kelvin, abs=1.0)


@pytest.mark.parametrize("power", [20e3, 120e3, 250e3, 313e3])
def test_the_three_modes_are_the_same_engine(power):
    place = {"power_turbine_speed": 0.9, "altitude": 900.0, "isa_offset": 12.0, "mach": 0.15}
    first = solved(power, **place)
    by_speed = solved(first["gas_generator_speed"], "gas_generator_speed", **place)
    back = solved(by_speed["power"], **place)
    assert back["gas_generator_speed"] == pytest.approx(first["gas_generator_speed"], rel=1e-7)
    assert by_speed["power"] == pytest.approx(power, rel=1e-6)
    if power > 30e3:  # below, the temperature has its minimum over power: not a handle there
        by_temperature = solved(first["power_turbine_inlet_temperature"], "temperature", **place)
        assert by_temperature["power"] == pytest.approx(power, rel=1e-6)


def test_ipopt_and_newton_agree():
    system, rng = gas_path(ENGINE), np.random.default_rng(3)
    low, high = [20e3, 0.7, 0.0, -15.0, 0.0, 0.0, 0.0, 0.0], [330e3, 1.2, 2000.0, 30.0, 0.22, 0.05, 10e3, 0.03]
    points = rng.uniform(low, high, (25, 8))
    compiled = solve_many(points)
    for row, bulk in zip(points, compiled.scaled, strict=True):
        values = dict(zip((item.name for item in system.parameters), row.tolist(), strict=True))
        ipopt, newton = system.solve(values), system.solve(values, method="newton")
        assert ipopt.success and newton.success
        assert ipopt.scaled == pytest.approx(bulk, abs=1e-8)
        # the damped Newton stops at a residual of 1e-8, which the condition number of the Jacobian (about 90) magnifies
        assert ipopt.scaled == pytest.approx(newton.scaled, abs=1e-8 * 90)


def test_sensitivities_equal_resolved_differences():
    system = gas_path(ENGINE)
    names = [parameter.name for parameter in system.parameters]
    point = np.array([180e3, 0.93, 700.0, 8.0, 0.12, 0.01, 3e3, 0.01])
    steps = np.array([4e3, 0.02, 100.0, 2.0, 0.02, 0.003, 1e3, 0.002])
    exact = system.sensitivities(system.solve(dict(zip(names, point.tolist(), strict=True)), method="newton"))
    offsets = np.array([-2, -1, 1, 2])
    weights = np.array([1, -8, 8, -1]) / 12.0
    for j, name in enumerate(names):
        points = np.tile(point, (4, 1))
        points[:, j] += offsets * steps[j]
        out = solve_many(points).outputs
        for output, values in out.items():
            difference = weights @ values / steps[j]
            negligible = 1e-7 * np.abs(values).max() / steps[j]
            assert exact[output][name] == pytest.approx(difference, rel=1e-5, abs=negligible), (output, name)


def test_unknown_mode():
    with pytest.raises(InputError, match="mode = 'thrust': expected one of: power, gas_generator_speed, temperature"):
        gas_path(ENGINE, "thrust")
