"""The engine as a table: as exact as it says, the same in numpy and CasADi, smooth past its ends."""

import casadi as ca
import numpy as np
import pytest

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.surrogate.engine_table import ALTITUDES, MACHS, SPEEDS, engine_table
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.cycle import gas_path
from vrsopt.turboshaft.data import load_engine

OFFSET = 20.0


@pytest.fixture(scope="module")
def table():
    return engine_table(isa_offset=OFFSET)


def box(table, count, seed):
    rng = np.random.default_rng(seed)
    bounds = (table.power_range, SPEEDS, ALTITUDES, MACHS)
    columns = [rng.uniform(*bound, count) for bound in bounds]
    for k, (low, high) in enumerate(bounds):  # corners and faces too
        columns[k][rng.random(count) < 0.05], columns[k][rng.random(count) < 0.05] = low, high
    return columns


@pytest.mark.parametrize("offset", [-20.0, 0.0, OFFSET, 40.0])
def test_fuel_flow_to_a_millionth_everywhere(offset):
    table = engine_table(isa_offset=offset)
    power, speed, altitude, mach = box(table, 3000, seed=7)
    zero = np.zeros_like(power)
    exact = solve_many(np.column_stack([power, speed, altitude, zero + offset, mach, zero, zero, zero]))
    assert exact.success.all()
    fuel, temperature = table.evaluate(table.contract(altitude, mach), power, speed)
    assert np.max(np.abs(fuel / exact.outputs["fuel_flow"] - 1.0)) < 1e-6
    assert np.max(np.abs(temperature / exact.outputs["power_turbine_inlet_temperature"] - 1.0)) < 1e-6
    assert max(table.error) < 1e-6


def test_box_covers_the_task():
    table = engine_table()
    assert table.power_range[0] <= 15e3 and table.power_range[1] >= 330e3
    assert SPEEDS[0] <= 0.70 and SPEEDS[1] >= 1.20 and ALTITUDES[0] < 0 and ALTITUDES[1] > 2000 and MACHS[1] >= 0.22


def test_candidates_per_node_and_casadi_agree(table):
    power, speed, altitude, mach = box(table, 40, seed=9)
    nodes = table.contract(altitude, mach)
    assert nodes.shape == (40, 2, *table.sizes)
    many = np.linspace(-20e3, 380e3, 11) + 0.0 * power[:, None]
    fuel, temperature = table.evaluate(nodes, many, speed[:, None])
    assert fuel.shape == (40, 11)
    columns = nodes.reshape(40, -1).T
    for k in range(11):
        out = table.function.map(40)(many[:, k], speed, columns)
        assert out[0].full().ravel() == pytest.approx(fuel[:, k], rel=1e-12)
        assert out[1].full().ravel() == pytest.approx(temperature[:, k], rel=1e-12)


@pytest.mark.parametrize("end", [0, 1])
def test_twice_smooth_across_the_ends_of_the_power_axis(table, end):
    c = table.contract(np.array([500.0]), np.array([0.1])).ravel()
    power, speed = ca.SX.sym("power"), ca.SX.sym("speed")
    for output in table.function(power, speed, ca.DM(c)):
        gradient = ca.gradient(output, ca.vertcat(power, speed))
        bend = ca.jacobian(gradient, ca.vertcat(power, speed))
        jet = ca.Function("jet", [power, speed], [ca.vertcat(output, gradient, ca.vec(bend))])
        edge = table.power_range[end]
        inside, outside = (jet(edge * (1 + sign * 1e-9), 0.93).full() for sign in (-1, 1))
        assert inside == pytest.approx(outside, rel=1e-5, abs=1e-15)


def test_derivatives_are_those_of_the_engine(table):
    system = gas_path(load_engine())
    values = {"demand": 170e3, "power_turbine_speed": 0.9, "altitude": 800.0, "isa_offset": OFFSET, "mach": 0.1}
    solution = system.solve({**values, "bleed_fraction": 0.0, "power_offtake": 0.0, "humidity": 0.0})
    exact = system.sensitivities(solution)["fuel_flow"]
    c = ca.DM(table.contract(np.array([800.0]), np.array([0.1])).ravel())
    power, speed = ca.SX.sym("power"), ca.SX.sym("speed")
    fuel = table.function(power, speed, c)[0]
    slope = ca.Function("slope", [power, speed], [ca.gradient(fuel, ca.vertcat(power, speed))])(170e3, 0.9).full()
    assert slope[0, 0] == pytest.approx(exact["demand"], rel=1e-4)
    assert slope[1, 0] == pytest.approx(exact["power_turbine_speed"], rel=1e-4)


def test_outside_the_table_is_an_input_error(table):
    with pytest.raises(InputError, match="altitude = 3000: -50 to 2100"):
        table.contract(np.array([0.0, 3000.0]), np.array([0.1, 0.1]))
    with pytest.raises(InputError, match="mach = 0.5"):
        table.contract(np.array([0.0]), np.array([0.5]))
    nodes = table.contract(np.zeros(2), np.zeros(2))
    with pytest.raises(InputError, match="power-turbine speed"):
        table.evaluate(nodes, np.full(2, 1e5), np.full(2, 1.4))
    with pytest.raises(InputError, match="shape"):
        table.evaluate(nodes, np.full(3, 1e5), np.ones(3))


@pytest.mark.slow
def test_an_engine_that_can_not_be_solved_is_refused():
    with pytest.raises(NoSolutionError, match="points not solved"):
        engine_table(engine_data=load_engine().variant("flight_manual_slope"))
