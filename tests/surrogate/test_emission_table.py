"""NOx and CO of the engine as a table: as exact as it says, the same in numpy and CasADi, for every fit."""

import casadi as ca
import numpy as np
import pytest

from vrsopt.surrogate.emission_table import emission_table, flows_of_fits
from vrsopt.surrogate.engine_table import ALTITUDES, MACHS, SPEEDS, engine_table
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.data import load_engine

OFFSET = 10.0


@pytest.fixture(scope="module")
def engine():
    """The engine with a second fit of its combustor, whatever its file has."""
    data = load_engine()
    fit = {"primary_volume": {"value": 1.2 * data.reactors.primary_volume, "unit": "m3", "source": "TYPICAL"}}
    return data.model_copy(update={"variants": {"larger": {"reactors": fit}}})


@pytest.fixture(scope="module")
def table(engine):
    return emission_table(engine_data=engine, isa_offset=OFFSET)


@pytest.fixture(scope="module")
def points():
    """Power W, speed, altitude, Mach from ground idle to take-off, and the engine's states there."""
    rng = np.random.default_rng(3)
    count = 150
    return tuple(rng.uniform(*bounds, count) for bounds in ((21e3, 320e3), (0.75, 1.15), ALTITUDES, MACHS))


def exact_flows(engine, points):
    zero = np.zeros(len(points[0]))
    power, speed, altitude, mach = points
    solved = solve_many(
        np.column_stack([power, speed, altitude, zero + OFFSET, mach, zero, zero, zero]), engine_data=engine
    )
    return solved.outputs["fuel_flow"], flows_of_fits(engine, solved.outputs)


def test_every_flow_is_that_of_gas_path_and_combustor(engine, table, points):
    fuel, exact = exact_flows(engine, points)
    power, speed, altitude, mach = points
    found = table.evaluate(table.contract(altitude, mach), fuel, power, speed)
    assert set(found) == set(exact) == {"nox", "co", "co2", "nox_larger"}
    loaded = power > 60e3
    for name in found:
        error = np.abs(found[name] / exact[name] - 1.0)
        assert np.sqrt(np.mean(error**2)) < 5e-4, name
        assert error[loaded].max() < 1e-3, name
        assert error.max() < 3e-3, name
        assert table.error[name] < 3e-3
    assert not np.allclose(found["nox"], found["nox_larger"], rtol=0.01)


def test_burnt_carbon_leaves_as_carbon_dioxide_or_carbon_monoxide(engine, table, points):
    power, speed, altitude, mach = points
    found = table.evaluate(table.contract(altitude, mach), np.ones(len(power)), power, speed)
    carbon = found["co2"] / 44.009 + found["co"] / 28.010
    zero = np.zeros(len(power))
    rows = np.column_stack([power, speed, altitude, zero + table.engine.isa_offset, mach, zero, zero, zero])
    burnt = 1.0 - solve_many(rows, engine_data=engine).outputs["hydrocarbon_index"]
    assert carbon == pytest.approx(burnt * engine.combustor.co2_per_fuel / 44.009, rel=5e-4)


def test_casadi_and_candidates_agree_with_the_arrays(table, points):
    power, speed, altitude, mach = (column[:6] for column in points)
    nodes = table.contract(altitude, mach)
    many = np.linspace(5e3, 380e3, 7) + 0.0 * power[:, None]  # past both ends too
    engine = table.engine
    fuel, _ = engine.evaluate(engine.contract(altitude, mach), many, speed[:, None])
    found = table.evaluate(nodes, fuel, many, speed[:, None])
    columns = np.concatenate([part.reshape(len(power), -1) for part in nodes], axis=1).T
    for k in range(7):
        flows = table.function.map(6)(fuel[:, k], many[:, k], speed, columns).full()
        for row, name in enumerate(table.names):
            assert found[name].shape == (6, 7)
            assert flows[row] == pytest.approx(found[name][:, k], rel=1e-9)


@pytest.mark.parametrize("end", [0, 1])
def test_twice_smooth_across_the_ends_of_the_power_axis(table, end):
    nodes = table.contract(np.array([500.0]), np.array([0.1]))
    c = ca.DM(np.concatenate([part.ravel() for part in nodes]))
    x = ca.SX.sym("x", 2)
    nox = table.function(0.02, x[0], x[1], c)[0]
    hessian, gradient = ca.hessian(nox, x)
    jet = ca.Function("jet", [x], [ca.vertcat(nox, gradient, ca.vec(hessian))])
    edge = table.engine.power_range[end]
    inside, outside = (jet([edge * (1 + sign * 1e-9), 0.93]).full() for sign in (-1, 1))
    assert inside == pytest.approx(outside, rel=1e-5, abs=1e-15)


def test_derivatives_are_those_of_differences(table):
    nodes = table.contract(np.array([300.0]), np.array([0.12]))
    c = ca.DM(np.concatenate([part.ravel() for part in nodes]))
    x = ca.SX.sym("x", 2)
    nox = table.function(0.02, x[0], x[1], c)[0]
    hessian, gradient = ca.hessian(nox, x)
    first = ca.Function("first", [x], [nox, gradient, hessian])
    at, steps = np.array([150e3, 0.9]), (50.0, 1e-4)
    _, slope, bend = (part.full() for part in first(at))
    for k, step in enumerate(steps):
        shift = np.eye(2)[k] * step
        high, low = ([part.full() for part in first(at + sign * shift)] for sign in (1, -1))
        assert slope[k, 0] == pytest.approx((high[0] - low[0]).item() / (2 * step), rel=1e-5)
        assert bend[:, k] == pytest.approx(((high[1] - low[1]) / (2 * step)).ravel(), rel=1e-4)


def test_tables_are_made_once(engine, table):
    assert emission_table(engine_data=engine, isa_offset=OFFSET) is table
    assert engine_table(engine_data=engine, isa_offset=OFFSET) is table.engine
    assert SPEEDS[0] < 0.95 < SPEEDS[1]
