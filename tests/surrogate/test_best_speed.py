"""The engine at its own best speed: the least fuel of the engine table at every power."""

import numpy as np
import pytest

from tests.schedule.test_surrogate_path import LIMITS, check_function, conditions
from vrsopt.errors import InputError
from vrsopt.limits import LIMIT_NAMES
from vrsopt.schedule.surrogate_path import SurrogateAircraft
from vrsopt.surrogate import store
from vrsopt.surrogate.best_speed import BestSpeedTable
from vrsopt.surrogate.engine_table import SPEEDS, engine_table
from vrsopt.turboshaft.performance import engine as run_engine

PLACES = np.array([0.0, 600.0, 1500.0]), np.array([0.0, 0.12, 0.18])  # altitude, Mach number
POWERS = np.linspace(25e3, 320e3, 60)


@pytest.fixture(scope="module")
def tables():
    table = engine_table()
    return table, BestSpeedTable.of(table)


@pytest.fixture(scope="module")
def paths():
    surrogate = store.load("level")
    speed, climb = [0.0, 40.0, 48.0, 0.0, 0.0], [0, 0.12, -0.05, 0, 0]
    nodes = conditions(speed, 100.0, climb, 1.0, [0, 0, 0, 1, 0], ground_idle=[0, 0, 0, 0, 1])
    return [SurrogateAircraft(surrogate, LIMITS, transmission=kind)(nodes) for kind in ("fixed", "variable")]


def test_fuel_is_the_least_over_all_speeds(tables):
    table, best = tables
    speeds = np.linspace(*SPEEDS, 1001)
    nodes, own = table.contract(*PLACES), best.contract(*PLACES)
    fuel, _ = best.evaluate(own, np.tile(POWERS, (3, 1)), 1.0)
    for k, power in enumerate(POWERS):
        all_speeds, _ = table.evaluate(nodes, np.full((3, len(speeds)), power), speeds[None, :])
        np.testing.assert_allclose(fuel[:, k], all_speeds.min(axis=1), rtol=2e-5)
        assert np.all(fuel[:, k, None] < all_speeds * (1 + 2e-5))


def test_best_speed_rises_with_power_and_is_that_of_the_engine_itself(tables):
    speed = tables[1].best_speed(*PLACES, POWERS)
    assert np.all(np.diff(speed) >= 0.0)
    assert speed[0, 0] == SPEEDS[0] and 0.9 < speed[0, -1] < 1.05
    power = 180e3
    at = float(tables[1].best_speed(*(place[:1] for place in PLACES), np.array([power]))[0, 0])
    burned = [run_engine(power, power_turbine_speed=at + away).fuel_flow_kg_s for away in (-0.02, 0.0, 0.02)]
    assert burned[1] < min(burned[0], burned[2])


def test_casadi_form_is_that_of_the_arrays(paths):
    check_function(paths[1])


def test_variable_transmission_never_burns_more_and_leaves_the_rotor_alone(paths):
    mass, rotor_speed, twist = np.full((5, 1), 1900.0), np.linspace(36.0, 50.0, 15)[None, :], 0.16
    fixed, variable = (path.evaluate(mass, rotor_speed, twist) for path in paths)
    np.testing.assert_array_equal(variable.power_per_engine, fixed.power_per_engine)
    assert np.all(variable.fuel_flow <= fixed.fuel_flow * (1 + 2e-5))
    assert np.all(variable.fuel_flow[:3, -1] < 0.96 * fixed.fuel_flow[:3, -1])  # rotor at 113 %
    for name in ("blade loading", "engine power", "torque", "tail rotor loading"):
        row = LIMIT_NAMES.index(name)
        np.testing.assert_array_equal(variable.limits[row], fixed.limits[row])
    assert np.all(variable.fuel_flow[4] == fixed.fuel_flow[4])  # at ground idle the engine drives nothing


def test_emissions_are_those_of_the_engine_at_that_speed(paths):
    fixed, variable = paths
    power = np.full((5, 1), 150e3)
    altitude, mach = variable.flight[1], fixed.plant.mach(*variable.flight[:2])
    ratio = variable.plant.table.best_speed(altitude, mach, power[0])[variable.condition]
    fuel = np.full((5, 1), 0.04)
    at_best = fixed.emissions(fuel, power, 44.4 * ratio)
    for name, flow in variable.emissions(fuel, power, 44.4).items():
        assert flow[:3] == pytest.approx(at_best[name][:3], rel=2e-4), name


def test_other_transmissions_are_refused():
    with pytest.raises(InputError, match="surrogate: transmission = 'belt': one of fixed, variable"):
        SurrogateAircraft(store.load("level"), LIMITS, transmission="belt")
