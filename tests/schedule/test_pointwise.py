"""Least fuel flow node by node, and what an aircraft can fly of it."""

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.schedule.batched import batched_minimum, rotor_speed_band
from vrsopt.schedule.genetic import GeneticOptions, genetic_minimum
from vrsopt.schedule.limiter import rate_limited_schedule
from vrsopt.schedule.nominal import nominal_schedule
from vrsopt.schedule.pointwise import pointwise_schedule
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import Schedule, ScheduleSettings
from vrsopt.solvers.status import Status

SETTINGS = ScheduleSettings()


@pytest.fixture(scope="module")
def nodes(transport, make_model):
    grid = FlightGrid(transport, make_model(), step=120.0)
    flying = np.flatnonzero(~grid.conditions.idle)
    return grid.model.nodes(flying), np.linspace(2200.0, 2100.0, len(flying))


def test_batched_minimum_is_the_minimum_of_a_fine_enumeration(nodes):
    model, mass = nodes
    box = SETTINGS.box(model.bounds)
    optima = batched_minimum(model, mass, box=box)
    omega, twist = (axis.ravel() for axis in np.meshgrid(*(np.linspace(*box[:, i], 301) for i in (0, 1))))
    values = model.evaluate(mass[:, None], omega[None, :], twist[None, :])
    allowed = np.where(values.limits.max(axis=0) <= 0, values.fuel_flow, np.inf)
    assert np.all(optima.fuel_flow <= allowed.min(axis=1))
    assert np.all(optima.fuel_flow >= allowed.min(axis=1) * (1 - 1e-3))
    assert np.all(optima.excess <= 1e-8)


@pytest.mark.slow
def test_nsga2_finds_the_optimum_of_the_nested_grids(nodes):
    model, mass = nodes
    box = SETTINGS.box(model.bounds)
    optima = batched_minimum(model, mass, box=box)
    found, generations = genetic_minimum(model, mass, box=box)
    assert np.max(np.abs(found.fuel_flow / optima.fuel_flow - 1)) < 1e-4
    assert np.all(found.excess <= 0)
    assert generations.min() > 15 and generations.max() < 200


@pytest.mark.slow
def test_nsga2_does_not_depend_on_the_number_of_workers(nodes):
    model, mass = nodes
    few, box = np.arange(4), SETTINGS.box(model.bounds)
    options = GeneticOptions(most_generations=20)
    one, two = (genetic_minimum(model.nodes(few), mass[few], box=box, options=options, workers=n)[0] for n in (1, 2))
    np.testing.assert_array_equal(one.rotor_speed, two.rotor_speed)
    np.testing.assert_array_equal(one.twist, two.twist)


@pytest.mark.slow
@pytest.mark.parametrize(("variables", "held"), [("speed", "twist"), ("twist", "rotor_speed")])
def test_a_variable_that_is_not_free_stays_nominal(nodes, variables, held):
    model, mass = nodes
    box = SETTINGS.restricted(variables).box(model.bounds)
    nominal = {"twist": SETTINGS.nominal_twist, "rotor_speed": SETTINGS.nominal_rotor_speed}[held]
    optima = batched_minimum(model, mass, box=box)
    found, _ = genetic_minimum(model, mass, box=box)
    for result in (optima, found):
        np.testing.assert_allclose(getattr(result, held), nominal, rtol=1e-12)
    np.testing.assert_allclose(found.fuel_flow, optima.fuel_flow, rtol=1e-4)


def test_band_of_rotor_speed_ends_where_fuel_flow_is_half_a_per_cent_more(nodes):
    model, mass = nodes
    box = SETTINGS.box(model.bounds)
    optima = batched_minimum(model, mass, box=box)
    low, high = rotor_speed_band(model, mass, optima=optima, box=box)
    assert np.all(low <= optima.rotor_speed) and np.all(high >= optima.rotor_speed) and np.all(high - low > 0.2)
    at_high = model.evaluate(mass, high, optima.twist).fuel_flow / optima.fuel_flow
    beyond = model.evaluate(mass, high + 0.3, optima.twist).fuel_flow / optima.fuel_flow
    assert np.all(at_high <= 1.005) and np.all(beyond > 1.005)


def test_pointwise_schedule_saves_fuel_and_is_nominal_in_idle(transport, make_model):
    schedule = pointwise_schedule(transport, make_model(), takeoff_mass=2150.0, method="batched")
    grid = FlightGrid(transport, make_model())
    flight = grid.fly(schedule, takeoff_mass=2150.0)
    assert flight.success, flight.message
    assert flight.fuel < 0.98 * grid.fly(nominal_schedule(transport), takeoff_mass=2150.0).fuel
    speed, twist = schedule.at(grid.segment, grid.time)
    assert np.all(speed[grid.conditions.idle] == SETTINGS.nominal_rotor_speed)
    assert np.all(twist[grid.conditions.idle] == SETTINGS.nominal_twist)


def test_generation_cap_is_reported(make_profile, make_model):
    profile = make_profile({"task": "hover", "duration": 30.0})
    schedule = pointwise_schedule(
        profile, make_model(), takeoff_mass=2000.0, genetic=GeneticOptions(most_generations=5)
    )
    assert schedule.status is Status.ITERATION_LIMIT and not schedule.success
    assert schedule.message == "2 of 2 nodes stopped at the cap of 5 generations"


def test_a_node_without_any_allowed_point_is_named(transport, make_model):
    schedule = pointwise_schedule(transport, make_model(torque_limit=3500.0), takeoff_mass=2150.0, method="batched")
    assert schedule.status is Status.INFEASIBLE and not schedule.success
    assert "torque" in schedule.message and "(hover)" in schedule.message
    with pytest.raises(InputError, match="method = magic"):
        pointwise_schedule(transport, make_model(), takeoff_mass=2150.0, method="magic")


@pytest.mark.parametrize("limit", [0.2, 0.1])
def test_limited_schedule_keeps_rates_limits_and_nominal_ends(transport, make_model, limit):
    grid = FlightGrid(transport, make_model(blade_loading_limit=limit))
    target = pointwise_schedule(transport, make_model(blade_loading_limit=limit), takeoff_mass=2150.0, method="batched")
    schedule = rate_limited_schedule(target, grid, takeoff_mass=2150.0)
    flight = grid.fly(schedule, takeoff_mass=2150.0)
    assert flight.success, flight.message
    assert flight.max_rotor_speed_rate <= SETTINGS.rotor_speed_rate * (1 + 1e-9)
    assert flight.max_twist_rate <= SETTINGS.twist_rate * (1 + 1e-9)
    assert np.all(flight.rotor_speed[grid.conditions.idle] == SETTINGS.nominal_rotor_speed)
    assert flight.fuel >= grid.fly(target, takeoff_mass=2150.0).fuel
    if limit == 0.2:
        assert schedule.details["look_ahead"] == 0.0
    else:  # the turn needs more rotor speed than the climb before it: arriving late would overload the blades
        assert schedule.details["look_ahead"] > 0.0
        assert "look-ahead of" in schedule.message and "blade loading" in schedule.message


def test_limiter_without_look_ahead_is_causal(make_profile, make_model):
    """What the target does later changes nothing before, except the return to nominal at the end."""
    profile = make_profile({"task": "cruise", "duration": 300.0, "speed": 40.0})
    grid = FlightGrid(profile, make_model(blade_loading_limit=1.0))
    time, zero = np.array([0.0, 100.0, 101.0, 300.0]), np.zeros(4, dtype=int)
    flown = []
    for later in (40.0, 46.0):
        target = Schedule("step", zero, time, np.array([42.0, 42.0, later, later]), np.full(4, 0.14))
        flown.append(rate_limited_schedule(target, grid, takeoff_mass=2000.0).rotor_speed)
    before = grid.time <= 100.0
    np.testing.assert_array_equal(flown[0][before], flown[1][before])
    assert np.abs(flown[0] - flown[1]).max() > 5.0
    assert flown[0][-1] == flown[1][-1] == SETTINGS.nominal_rotor_speed


def test_limiter_says_when_no_look_ahead_helps(make_profile, make_model):
    """A rotor that must be faster than nominal from the first second can not be: the start is nominal."""
    profile = make_profile({"task": "cruise", "duration": 120.0, "speed": 40.0})
    model = make_model(blade_loading_limit=0.066)
    target = pointwise_schedule(profile, model, takeoff_mass=2200.0, method="batched")
    assert target.success and target.rotor_speed.min() > 44.6
    schedule = rate_limited_schedule(target, FlightGrid(profile, model), takeoff_mass=2200.0)
    assert not schedule.success and schedule.status is Status.INFEASIBLE
    assert "no look-ahead up to 60 s" in schedule.message and "blade loading" in schedule.message
