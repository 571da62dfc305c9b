"""The aircraft along a mission from its surrogate: against the Kriging, against the physics, and its derivatives."""

import numpy as np
import pytest

from vrsopt.atmosphere import standard_air
from vrsopt.drive_train import idle_power, smooth_max
from vrsopt.errors import InputError
from vrsopt.helicopter import helicopter
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.mission.conditions import Conditions
from vrsopt.schedule.nlp import node_functions
from vrsopt.schedule.plant import TAIL_MARGIN
from vrsopt.schedule.rotor_tables import POWER_DEGREES
from vrsopt.schedule.similarity import standard_day
from vrsopt.schedule.surrogate_path import SurrogateAircraft
from vrsopt.surrogate import chebyshev, store
from vrsopt.surrogate.export import path_predict
from vrsopt.turboshaft.performance import engine as run_engine

MACHINE = helicopter("bo105")
LIMITS = Limits(MACHINE.aircraft, MACHINE.engine, "manual", 1.3)


@pytest.fixture(scope="module")
def surrogate():
    return store.load("level")


@pytest.fixture(scope="module")
def make(surrogate):
    return SurrogateAircraft(surrogate, LIMITS)


def conditions(speed, altitude=50.0, climb_angle=0.0, load_factor=1.0, idle=False, height=np.inf, ground_idle=False):
    """Steady flight conditions at nodes; arguments broadcast."""
    numbers = (speed, altitude, climb_angle, load_factor, height, idle, ground_idle)
    speed, altitude, climb_angle, load_factor, height, idle, ground_idle = np.broadcast_arrays(
        *(np.atleast_1d(v).astype(float) for v in numbers)
    )
    return Conditions(
        segment=np.zeros(speed.shape, dtype=int),
        time=np.arange(float(speed.size)),
        speed=speed,
        altitude=altitude,
        climb_angle=climb_angle,
        load_factor=load_factor,
        turn_load_factor=np.ones(speed.shape),
        turn=np.zeros(speed.shape),
        equivalent_climb_angle=climb_angle,
        height=height,
        idle=(idle > 0) | (ground_idle > 0),
        ground_idle=ground_idle > 0,
    )


def rotor_power(path, mass, rotor_speed, twist):
    """Of both rotors at one node [W], from the power of an engine that is well above idle."""
    drive = MACHINE.aircraft.transmission
    engine = path.evaluate(np.array([mass]), rotor_speed, twist).power_per_engine[0]
    assert engine > 1.5 * idle_power(MACHINE.engine)
    return drive.efficiency * (drive.engines * engine - 1e3 * drive.accessory_power)


def physics(mass, rotor_speed, twist, **flight):
    """Of both rotors in the trim [W], and the use of the tail rotor."""
    flight = {"altitude": 50.0, "isa_offset": 0.0, "climb_angle": 0.0, "load_factor": 1.0, **flight}
    flight |= {"mass": mass, "rotor_speed": rotor_speed, "twist": twist}
    trim = MACHINE.trim(flight)
    assert trim.success
    loading = trim.solution.outputs["tail_blade_loading"]
    return trim.power, LIMITS.tail_usage(loading, rotor_speed, flight["speed"])


def tail_usage(path, mass, rotor_speed, twist):
    row = LIMIT_NAMES.index("tail rotor loading")
    return path.evaluate(np.array([mass]), rotor_speed, twist).limits[row, 0] + 1 - TAIL_MARGIN


def test_polynomials_hold_the_kriging_over_the_whole_box(make, surrogate):
    rng = np.random.default_rng(1)
    nodes = conditions(rng.uniform(0, 70, 30), rng.uniform(0, 2000, 30))
    path = make(nodes)
    plant = make.plant
    free = rng.uniform(plant.lower, plant.upper, (30, 40, 3))
    fixed = {"altitude": nodes.altitude, "speed": nodes.speed}
    exact = sum(path_predict(surrogate.models[n], fixed, free) for n in ("main_rotor_power", "tail_rotor_power"))
    series = path.power_series[path.condition]
    assert series.shape[1:] == tuple(d + 1 for d in POWER_DEGREES)
    error = chebyshev.evaluate(series, free, lower=plant.lower, upper=plant.upper) / exact - 1
    assert np.sqrt(np.mean(error**2)) < 1e-4


@pytest.mark.parametrize(
    ("speed", "climb_deg", "load_factor", "mass", "ratio", "twist_deg"),
    [
        (0.0, 0.0, 1.0, 1900.0, 0.95, 10.0),
        (35.0, 0.0, 1.18, 1850.0, 0.90, 12.0),
        (48.0, 0.0, 1.0, 2100.0, 0.88, 12.0),
        (40.0, 7.12, 1.0, 1950.0, 0.92, 12.0),
        (40.0, -7.12, 1.0, 1950.0, 0.85, 8.0),
    ],
)
def test_fuel_flow_is_that_of_the_physics(make, speed, climb_deg, load_factor, mass, ratio, twist_deg):
    rotor_speed, twist = 44.4 * ratio, np.radians(twist_deg)
    flight = {
        "mass": mass,
        "altitude": 200.0,
        "isa_offset": 0.0,
        "speed": speed,
        "climb_angle": np.radians(climb_deg),
        "load_factor": load_factor,
        "rotor_speed": rotor_speed,
        "twist": twist,
    }
    physics = MACHINE.point(flight, limits=LIMITS)
    path = make(conditions(speed, 200.0, np.radians(climb_deg), load_factor))
    values = path.evaluate(np.array([mass]), rotor_speed, twist)
    assert values.fuel_flow[0] == pytest.approx(physics.fuel_flow, rel=2.5e-3)
    assert values.power_per_engine[0] == pytest.approx(physics.shaft_power_per_engine, abs=400.0)
    usage = dict(zip(LIMIT_NAMES, values.limits[:, 0] + 1, strict=True))
    assert usage["blade loading"] == pytest.approx(physics.usages["blade loading"], rel=1e-4)
    assert usage["turbine temperature"] == pytest.approx(physics.usages["turbine temperature"], rel=2e-3)


def test_casadi_node_equals_the_arrays_with_exact_derivatives(make):
    path = make(
        conditions(
            [0.0, 40.0, 40.0, 35.0, 0.0, 2.0, 4.0, 0.0],
            100.0,
            [0, 0.12, -0.12, 0, 0, np.pi / 2, -0.2, 0],
            [1, 1, 1, 1.18, 1, 1, 0.98, 1],
            [0, 0, 0, 0, 1, 0, 0, 0],
            [2, *[np.inf] * 5, 6, 0],
            [0, 0, 0, 0, 0, 0, 0, 1],
        )
    )
    check_function(path)


def test_casadi_node_on_a_hot_day(surrogate):
    """Speeds and masses are scaled to the standard day in both."""
    nodes = conditions([0.0, 40.0, 0.0], [-30.0, 500.0, 100.0], 0.0, 1.0, [0, 0, 1])
    check_function(SurrogateAircraft(surrogate, LIMITS, isa_offset=25.0)(nodes))


def check_function(path):
    function, coefficients = path.function()
    count = coefficients.shape[1]
    node = node_functions(function)
    point = np.array([1900.0, 41.0, 0.18, 0.2])
    steps, weights = (1.0, 0.01, 1e-3, 0.01), np.array([100.0, 1.0, 0.7, 0.5, 0.3, 0.2])
    values = path.evaluate(*(np.full(count, value) for value in point))
    for k in range(count):
        c = coefficients[:, k]
        y = node.values(point, c).full().ravel()
        assert y[0] == pytest.approx(values.fuel_flow[k], rel=1e-10)
        assert y[1:] == pytest.approx(values.limits[:, k], rel=1e-9, abs=1e-10)
        jacobian, hessian = node.jacobian(point, c).full(), node.hessian(point, c, weights).full()
        for i, step in enumerate(steps):
            high, low = point.copy(), point.copy()
            high[i] += step
            low[i] -= step
            slope = (node.values(high, c) - node.values(low, c)).full().ravel() / (2 * step)
            assert jacobian[:, i] == pytest.approx(slope, rel=1e-4, abs=1e-7 * abs(jacobian).max())
            bend = (node.jacobian(high, c) - node.jacobian(low, c)).full().T @ weights / (2 * step)
            assert hessian[:, i] == pytest.approx(bend, rel=2e-3, abs=1e-6 * abs(hessian).max())


def test_spinning_up_costs_the_kinetic_power(make, surrogate):
    """The engines give J Omega dOmega/dt over the transmission efficiency; spin-down gives it back."""
    nodes = conditions(30.0)
    rotor, drive = MACHINE.aircraft.main_rotor, MACHINE.aircraft.transmission
    path = make(nodes)
    at = lambda rate: path.evaluate(np.array([2000.0]), 42.0, 0.14, rate).power_per_engine[0]  # noqa: E731
    expected = rotor.polar_inertia * 42.0 * 0.1 / drive.efficiency / drive.engines
    assert at(0.1) - at(0.0) == pytest.approx(expected, rel=1e-3)
    assert at(0.0) - at(-0.1) == pytest.approx(expected, rel=1e-3)
    assert at(-5.0) == pytest.approx(idle_power(MACHINE.engine), rel=1e-3)
    still = SurrogateAircraft(surrogate, LIMITS, kinetic_energy=False)(nodes)
    assert still.evaluate(np.array([2000.0]), 42.0, 0.14, 0.4).power_per_engine[0] == pytest.approx(at(0.0), rel=1e-12)


def test_idle_has_the_power_of_the_flat_pitch_rotor_whatever_the_schedule(make):
    path = make(conditions(0.0, 4.0, idle=True))
    one = path.evaluate(np.array([1500.0]), 44.4, 0.14)
    other = path.evaluate(np.array([2400.0]), 44.4, 0.20)
    assert one.power_per_engine[0] == other.power_per_engine[0]
    assert 40e3 < one.power_per_engine[0] < 55e3
    assert np.all(one.limits == -1.0)


def test_margin_is_the_nominal_rotor_s_where_that_has_less(make):
    """At 2500 kg and 2000 m the nominal rotor is inside the margin: it is allowed itself, and nothing slower is."""
    path = make(conditions(60.0, 2000.0))
    row = LIMIT_NAMES.index("blade loading")
    at = lambda ratio: path.evaluate(np.array([2500.0]), 44.4 * ratio, 0.14).limits[row, 0]  # noqa: E731
    assert abs(at(1.0)) < 5e-4
    assert at(0.99) > 5e-3
    assert at(1.02) < -5e-3


def test_nodes_can_be_taken_apart(make):
    whole = make(conditions([10.0, 20.0, 30.0, 20.0], 300.0))
    part = whole.nodes(np.array([3, 0]))
    mass, speed, twist = np.full(4, 1800.0), np.linspace(38, 44, 4), np.full(4, 0.2)
    every = whole.evaluate(mass, speed, twist)
    some = part.evaluate(mass[[3, 0]], speed[[3, 0]], twist[[3, 0]])
    assert np.array_equal(some.fuel_flow, every.fuel_flow[[3, 0]])
    assert np.array_equal(some.limits, every.limits[:, [3, 0]])


def test_outside_the_sampled_box_is_an_error(make):
    with pytest.raises(InputError, match="altitude"):
        make(conditions(30.0, 3000.0))
    path = make(conditions(30.0))
    with pytest.raises(InputError, match="load factor times mass = 2600 kg: sampled from 1400 to 2500"):
        path.evaluate(np.array([2600.0]), 44.4, 0.14)
    bounds = make(conditions([35.0, 35.0, 0.0], load_factor=[1.25, 1.0, 1.0], idle=[0, 0, 1])).bounds["mass"]
    assert bounds[0] == pytest.approx([1120.0, 1400.0, 0.0])
    assert bounds[1] == pytest.approx([2000.0, 2500.0, np.inf])


@pytest.mark.parametrize("angle", [-14.0, -9.0, 7.0, 14.0])
@pytest.mark.parametrize(("speed", "mass", "ratio"), [(5.0, 2000.0, 1.0), (12.0, 1700.0, 0.86), (20.0, 2000.0, 0.95)])
def test_slow_climbs_and_descents_are_those_of_the_physics(make, speed, angle, mass, ratio):
    """As steep as a take-off that speeds up or an approach that slows down feels."""
    free = (mass, 44.4 * ratio, 0.17)
    path = make(conditions(speed, 50.0, np.radians(angle)))
    power, tail = physics(*free, speed=speed, climb_angle=np.radians(angle))
    assert rotor_power(path, *free) == pytest.approx(power, rel=2.5e-3)
    assert tail_usage(path, *free) == pytest.approx(tail, abs=4e-3)


@pytest.mark.parametrize(
    ("forward", "rate"), [(0.0, 1.0), (0.0, 4.0), (0.0, -1.0), (0.0, -2.5), (2.0, 2.0), (3.0, -1.5)]
)
@pytest.mark.parametrize(("mass", "ratio"), [(2000.0, 1.0), (1700.0, 0.86)])
def test_vertical_climb_and_descent_are_those_of_the_physics(make, forward, rate, mass, ratio):
    free = (mass, 44.4 * ratio, 0.17)
    path = make(conditions(np.hypot(forward, rate), 50.0, np.arctan2(rate, forward)))
    power, tail = physics(*free, speed=forward, vertical_speed=rate)
    assert rotor_power(path, *free) == pytest.approx(power, rel=6e-3)
    assert tail_usage(path, *free) == pytest.approx(tail, abs=6e-3)


def test_power_is_continuous_where_a_climb_becomes_steep(make):
    angles = np.linspace(0.1, 0.5, 401)
    for speed in (1.0, 8.0, 30.0):
        path = make(conditions(speed, 50.0, angles))
        power = path.evaluate(np.full(401, 1800.0), 42.0, 0.15).power_per_engine
        slope = np.diff(power)
        assert np.all(slope > 0) and slope.max() < 1.3 * slope.min()


@pytest.mark.parametrize("height", [0.0, 2.0, 8.0])
@pytest.mark.parametrize(("speed", "allowed"), [(0.0, 4e-3), (5.0, 0.015), (10.0, 0.015), (20.0, 6e-3)])
def test_ground_effect_is_that_of_the_physics(make, height, speed, allowed):
    rotor = MACHINE.aircraft.main_rotor
    proximity = rotor.radius / (height + rotor.hub_above_skids)
    for free in ((2000.0, 44.4, 0.14), (1700.0, 39.0, 0.2)):
        path = make(conditions(speed, 50.0, height=height))
        power, tail = physics(*free, speed=speed, ground_proximity=proximity)
        assert rotor_power(path, *free) == pytest.approx(power, rel=allowed)
        assert tail_usage(path, *free) == pytest.approx(tail, abs=0.01)
    far = rotor_power(make(conditions(speed, 50.0, height=1e4)), *free)
    assert far == pytest.approx(rotor_power(make(conditions(speed, 50.0)), *free), rel=1e-6)


@pytest.mark.slow
def test_ground_idle_is_the_engine_s_own_state_whatever_the_schedule(make):
    engine = MACHINE.engine
    path = make(conditions([0.0, 0.0], 60.0, idle=True, ground_idle=[1, 0]))
    one, other = (path.evaluate(np.full(2, mass), 44.4, twist) for mass, twist in ((1500.0, 0.14), (2400.0, 0.2)))
    idle = run_engine(rating="ground_idle", altitude=60.0, engine_data=engine)
    for values in (one, other):
        assert values.fuel_flow[0] == pytest.approx(2 * idle.fuel_flow_kg_s, rel=1e-8)
        assert values.power_per_engine[0] == pytest.approx(idle.power_w, rel=1e-8)
        assert np.all(values.limits == -1.0)
    assert one.fuel_flow[0] < one.fuel_flow[1]
    flows = path.emissions(one.fuel_flow[:, None], one.power_per_engine[:, None], 44.4)
    for name, flow in (("nox", idle.nox_kg_s), ("co", idle.co_kg_s), ("co2", idle.co2_kg_s)):
        assert flows[name][0, 0] == pytest.approx(2 * flow, rel=1e-6)


@pytest.mark.parametrize(("angle", "speed"), [(-np.pi / 2, 4.0), (-0.5, 9.0)])
def test_sinking_into_the_vortex_ring_is_refused(make, angle, speed):
    with pytest.raises(InputError, match=r"segment 0 at 1 s: sinks at 4.* m/s .* at most 3\.[0-9] m/s .*vortex ring"):
        make(conditions(speed, 50.0, [0.0, angle]))


def test_an_approach_that_slows_down_is_no_vortex_ring(make):
    make(conditions([20.0, 14.0, 9.0, 5.0, 2.0], 50.0, np.radians(-14.0)))
    make(conditions([1.5, 4.0], 50.0, [-np.pi / 2, np.pi / 2]))
    make(conditions(4.0, 50.0, -np.pi / 2, idle=True))  # whatever: it stands on the ground


@pytest.mark.parametrize("offset", [-20.0, 20.0, 30.0])
@pytest.mark.parametrize("altitude", [0.0, 1200.0])
def test_any_day_is_that_of_the_physics(surrogate, offset, altitude):
    """By similarity: tip Mach number and thrust coefficient are the day's own."""
    speeds = (0.0, 30.0, 55.0)
    path = SurrogateAircraft(surrogate, LIMITS, isa_offset=offset)(conditions(speeds, altitude))
    for free in ((2000.0, 44.4, 0.14), (1750.0, 37.0, 0.2)):
        for k, speed in enumerate(speeds):
            node = path.nodes(np.array([k]))
            power, tail = physics(*free, speed=speed, altitude=altitude, isa_offset=offset)
            assert rotor_power(node, *free) == pytest.approx(power, rel=2.5e-3)
            assert tail_usage(node, *free) == pytest.approx(tail, abs=5e-3)


def test_standard_day_is_the_flight_itself():
    altitude = np.array([0.0, 700.0, 2000.0])
    day = standard_day(altitude, 0.0, 2000.0)
    assert np.array_equal(day.altitude, altitude)
    assert np.all(day.speed == 1.0) and np.all(day.mass == 1.0) and np.all(day.power == 1.0)
    assert np.array_equal(day.density, standard_air(altitude).density)


def test_below_sea_level_the_weight_scales_with_the_pressure(make):
    free = (1900.0, 42.0, 0.15)
    path = make(conditions(30.0, -40.0))
    power, _ = physics(*free, speed=30.0, altitude=-40.0)
    assert rotor_power(path, *free) == pytest.approx(power, rel=3e-3)
    low, high = path.bounds["mass"]
    assert low[0] > 1400.0 and high[0] > 2500.0


def test_bounds_are_those_of_the_day(surrogate):
    hot, cold = (SurrogateAircraft(surrogate, LIMITS, isa_offset=t)(conditions(30.0, 300.0)) for t in (25.0, -20.0))
    fast = np.sqrt((288.15 - 0.0065 * 300 + 25) / (288.15 - 0.0065 * 300))
    low, high = hot.bounds["rotor_speed"]
    assert low == pytest.approx(0.70 * 44.4 * fast) and low < 0.75 * 44.4
    assert high == pytest.approx(1.15 * 44.4 * fast)
    low, high = cold.bounds["rotor_speed"]
    assert low == pytest.approx(0.70 * 44.4)  # of the engine's table
    assert high < 1.15 * 44.4
    with pytest.raises(InputError, match=r"rotor speed = 31.5 rad/s: sampled from 32"):
        hot.evaluate(np.array([1900.0]), 31.5, 0.14)


def test_an_inaccurate_surrogate_is_refused_unless_forced(surrogate):
    from dataclasses import replace

    accuracy = dict(surrogate.accuracy)
    accuracy["main_rotor_power"] = replace(accuracy["main_rotor_power"], pearson_percent=90.0)
    poor = replace(surrogate, accuracy=accuracy)
    with pytest.raises(InputError, match="main_rotor_power: leave-one-out correlation 90.00 %: at least 98 %"):
        SurrogateAircraft(poor, LIMITS)
    SurrogateAircraft(poor, LIMITS, force=True)


def test_smooth_max_stays_within_half_its_width():
    a = np.linspace(-3, 3, 601)
    excess = smooth_max(a, 0.0, 0.1) - np.maximum(a, 0.0)
    assert excess.min() >= 0 and excess.max() == pytest.approx(0.05)


def test_a_surrogate_of_another_space_is_refused():
    with pytest.raises(InputError, match="space = flight: missions fly on one of the space level"):
        SurrogateAircraft(store.load("flight"), LIMITS)
