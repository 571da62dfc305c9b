"""Least fuel flow node by node, and what an aircraft can fly of it."""

from dataclasses import replace

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.helicopter import helicopter
from vrsopt.limits import Limits
from vrsopt.mission.conditions import Conditions
from vrsopt.schedule.across_bands import across_bands
from vrsopt.schedule.bands import ForbiddenBand
from vrsopt.schedule.batched import batched_minimum, nested_grids, point_optima, rotor_speed_band
from vrsopt.schedule.genetic import GeneticOptions, genetic_minimum
from vrsopt.schedule.limiter import rate_limited_schedule
from vrsopt.schedule.nominal import nominal_schedule
from vrsopt.schedule.path_model import PathValues
from vrsopt.schedule.pointwise import pointwise_schedule
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import Schedule, ScheduleSettings
from vrsopt.schedule.surrogate_path import SurrogateAircraft
from vrsopt.schedule.violation import too_long_stays
from vrsopt.solvers.status import Status
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.store import load

SETTINGS = ScheduleSettings()
FEW = np.arange(0, 30, 8)  # nodes that NSGA-II searches


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


def test_nsga2_ends_at_the_least_breach_where_nothing_is_allowed(transport, make_model):
    grid = FlightGrid(transport, make_model(torque_limit=2500.0), step=120.0)
    hover = np.flatnonzero(~grid.conditions.idle)[:1]
    model, mass = grid.model.nodes(hover), np.array([2200.0])
    box = SETTINGS.box(model.bounds)
    found, _ = genetic_minimum(model, mass, box=box, options=GeneticOptions(most_generations=60))
    least = batched_minimum(model, mass, box=box).excess
    assert 0.0 < least[0] <= found.excess[0] < 1.02 * least[0]


@pytest.mark.slow
def test_nsga2_finds_the_optimum_of_the_nested_grids(nodes):
    model, mass = nodes[0].nodes(FEW), nodes[1][FEW]
    box = SETTINGS.box(model.bounds)
    optima = batched_minimum(model, mass, box=box)
    options = GeneticOptions()
    found, generations = genetic_minimum(model, mass, box=box, options=options)
    assert np.max(np.abs(found.fuel_flow / optima.fuel_flow - 1)) < 1e-4
    assert np.all(found.excess <= 0)
    assert generations.min() > options.period and generations.max() < options.most_generations


@pytest.mark.slow
def test_nsga2_does_not_depend_on_the_number_of_workers(nodes):
    model, mass = nodes
    few, box = FEW, SETTINGS.box(model.bounds)
    options = GeneticOptions(most_generations=20)
    one, two = (genetic_minimum(model.nodes(few), mass[few], box=box, options=options, workers=n)[0] for n in (1, 2))
    np.testing.assert_array_equal(one.rotor_speed, two.rotor_speed)
    np.testing.assert_array_equal(one.twist, two.twist)


@pytest.mark.slow
@pytest.mark.parametrize(("variables", "held"), [("speed", "twist"), ("twist", "rotor_speed")])
def test_a_variable_that_is_not_free_stays_nominal(nodes, variables, held):
    model, mass = nodes[0].nodes(FEW), nodes[1][FEW]
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


@pytest.fixture(scope="module")
def shipped():
    """The shipped surrogate at random operating points, with their masses."""
    machine = helicopter()
    make = SurrogateAircraft(load("level"), Limits(machine.aircraft, machine.engine, "manual", 1.3))
    random = np.random.default_rng(3)
    flown = Conditions.level(random.uniform(0.0, 70.0, 80), random.uniform(0.0, 2000.0, 80))
    return make(flown), random.uniform(1600.0, 2400.0, 80)


@pytest.mark.parametrize("variables", ["both", "speed", "twist"])
def test_projected_newton_finds_the_optimum_of_the_nested_grids(shipped, variables):
    model, mass = shipped
    box = SETTINGS.restricted(variables).box(model.bounds)
    grids = point_optima(model, mass, nested_grids(model, mass, box=box))
    newton = batched_minimum(model, mass, box=box)
    np.testing.assert_array_equal(newton.excess <= 1e-8, grids.excess <= 1e-8)
    allowed = newton.excess <= 1e-8
    assert allowed.mean() > 0.9
    difference = newton.fuel_flow[allowed] / grids.fuel_flow[allowed] - 1
    assert difference.max() < 1e-9 and difference.min() > -1e-5
    assert np.all(newton.rotor_speed >= box[0, 0]) and np.all(newton.twist <= box[1, 1])


def test_searched_points_are_the_model_with_exact_derivatives(shipped):
    model, mass = shipped
    points, every = model.at_mass(mass), np.arange(len(mass))
    box = np.array([[36.0, 0.12], [50.0, 0.26]])
    x = np.random.default_rng(0).uniform(*box, (len(mass), 2))

    def values(at):
        result = model.evaluate(mass, *at.T)
        return np.vstack([result.fuel_flow[None], result.limits])

    grid = points.values(x[:5, 0], x[:5, 1])
    whole = model.evaluate(mass[:, None], np.repeat(x[:5, 0], 5)[None], np.tile(x[:5, 1], 5)[None])
    usual = (whole.power_per_engine < 320e3).reshape(grid[0].shape)
    np.testing.assert_allclose(grid[0][usual], whole.fuel_flow.reshape(usual.shape)[usual], rtol=1e-12)
    np.testing.assert_allclose(grid[1][:, usual], whole.limits.reshape(grid[1].shape)[:, usual], atol=1e-12)

    fuel, limits = points.jets(every, x)
    jets = np.concatenate([fuel.parts[:, None], limits.parts], axis=1)
    usual = model.evaluate(mass, *x.T).power_per_engine < 320e3
    assert usual.mean() > 0.8
    np.testing.assert_allclose(jets[0][:, usual], values(x)[:, usual], atol=1e-12)
    for k in (0, 1):
        step = np.zeros(2)
        step[k] = 1e-3 * (box[1, k] - box[0, k])
        ahead, behind = values(x + step), values(x - step)
        for part, found in ((1 + k, (ahead - behind) / (2 * step[k])), (3 + 2 * k, None)):
            found = (ahead - 2 * values(x) + behind) / step[k] ** 2 if found is None else found
            size = 1e-12 + np.abs(jets[part][:, usual]).max(axis=1, keepdims=True)
            assert np.max(np.abs(jets[part] - found)[:, usual] / size) < 1e-4
    both = 1e-3 * (box[1] - box[0])
    corners = [values(x + both * np.array(sign)) for sign in ((1, 1), (-1, 1), (1, -1), (-1, -1))]
    mixed = (corners[0] - corners[1] - corners[2] + corners[3]) / (4 * both[0] * both[1])
    size = 1e-12 + np.abs(jets[4][:, usual]).max(axis=1, keepdims=True)
    assert np.max(np.abs(jets[4] - mixed)[:, usual] / size) < 1e-4


def test_newton_and_nsga2_keep_out_of_forbidden_bands(shipped):
    model, mass = shipped
    few, bands = np.arange(2), (ForbiddenBand(34.0, 36.0, 5.0), ForbiddenBand(37.0, 43.0, 5.0))
    box = SETTINGS.box(model.bounds)
    newton = batched_minimum(model, mass, box=box, bands=bands)
    free = batched_minimum(model, mass, box=box)
    for band in bands:
        assert np.any((free.rotor_speed > band.lower) & (free.rotor_speed < band.upper))
        assert not np.any((newton.rotor_speed > band.lower) & (newton.rotor_speed < band.upper))
    allowed = newton.excess <= 1e-8
    assert np.all(newton.fuel_flow[allowed] >= free.fuel_flow[allowed] * (1 - 1e-9))
    found, _ = genetic_minimum(model.nodes(few), mass[few], box=box, bands=bands)
    np.testing.assert_allclose(found.fuel_flow, newton.fuel_flow[few], rtol=1e-4)
    assert not any(np.any((found.rotor_speed > band.lower) & (found.rotor_speed < band.upper)) for band in bands)


def test_steps_across_a_band_are_shortened_to_what_is_allowed():
    segment, time = np.zeros(3, dtype=int), np.array([0.0, 60.0, 63.0])
    bands = (ForbiddenBand(38.0, 40.0, 6.0), ForbiddenBand(41.0, 42.0, 60.0))
    rows = across_bands(segment, time, np.array([36.0, 44.0, 38.0]), np.array([0.1, 0.22, 0.22]), bands)
    # the first band takes 15 s of the step of 60 s, the second 7.5 s; the second step takes 3 s in all
    np.testing.assert_allclose(rows[1], [0.0, 21.0, 24.0, 60.0, 63.0])
    np.testing.assert_allclose(rows[2], [36.0, 38.0, 40.0, 44.0, 38.0])
    np.testing.assert_allclose(rows[3], [0.1, 0.142, 0.148, 0.22, 0.22])


def test_pointwise_schedule_crosses_bands_in_time_or_not_at_all(transport, make_model):
    grid = FlightGrid(transport, make_model())
    free = pointwise_schedule(transport, make_model(), takeoff_mass=2150.0, method="batched", grid=grid)
    flown = free.at(grid.segment, grid.time)[0]
    middle = 0.5 * (flown.min() + 44.4)
    for crossing in (4.0, 0.0):
        bands = (ForbiddenBand(middle - 0.6, middle + 0.6, crossing),)
        settings = replace(SETTINGS, forbidden_bands=bands, rotor_speed_rate=None)
        schedule = pointwise_schedule(
            transport, make_model(), takeoff_mass=2150.0, method="batched", grid=grid, settings=settings
        )
        speed = schedule.at(grid.segment, grid.time)[0]
        stays = too_long_stays(
            bands, nominal=44.4, tasks=["flight"] * len(grid.time), time=grid.time, rotor_speed=speed
        )
        assert not stays or stays[0].duration <= crossing
        assert (speed.min() > middle) == (crossing == 0.0)


class ExponentialFuel:
    """A path model of one Kriging with exponential correlation of rotor speed and twist, without limits."""

    limit_names = ("none",)

    def __init__(self, kriging):
        self.kriging = kriging

    def evaluate(self, mass, rotor_speed, twist, rotor_speed_rate=0.0):
        mass, rotor_speed, twist = np.broadcast_arrays(mass, rotor_speed, twist)
        x = np.column_stack([rotor_speed.ravel(), twist.ravel()])
        fuel_flow = self.kriging.predict(x).reshape(rotor_speed.shape)
        return PathValues(fuel_flow, 0.0 * fuel_flow, np.full((1, *fuel_flow.shape), -1.0))

    def nodes(self, index):
        return self


def test_nsga2_finds_the_least_of_the_sample_coordinates_of_an_exponential_correlation():
    """The mean has a kink at every coordinate of a sample: its minimum is at a crossing of two of them."""
    box = SETTINGS.box({"rotor_speed": (33.0, 52.0), "twist": (0.1, 0.3)})
    samples = np.random.default_rng(5).uniform(*box, (40, 2))
    fuel = 0.04 + 1e-4 * (samples[:, 0] - 40.0) ** 2 + 0.5 * (samples[:, 1] - 0.2) ** 2
    inputs = {"names": ("rotor_speed", "twist"), "lower": box[0], "upper": box[1]}
    kriging = Kriging("exponential", trend="constant", **inputs).fit(samples, fuel)
    model, mass = ExponentialFuel(kriging), np.array([2000.0])
    speeds, twists = (np.unique([*samples[:, k], *box[:, k]]) for k in (0, 1))
    crossings = model.evaluate(2000.0, speeds[:, None], twists[None, :]).fuel_flow
    found, _ = genetic_minimum(model, mass, box=box)
    assert found.fuel_flow[0] == pytest.approx(crossings.min(), rel=1e-4)
    grids = point_optima(model, mass, nested_grids(model, mass, box=box))
    assert crossings.min() <= grids.fuel_flow[0] * (1 + 1e-9)
