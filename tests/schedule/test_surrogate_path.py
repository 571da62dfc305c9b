"""The aircraft along a mission from its surrogate: against the Kriging, against the physics, and its derivatives."""

from importlib import resources
from types import SimpleNamespace

import numpy as np
import pytest

from vrsopt.drive_train import idle_power, smooth_max
from vrsopt.errors import InputError
from vrsopt.helicopter import helicopter
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.schedule.surrogate_path import POWER_DEGREES, SurrogateAircraft
from vrsopt.schedule.transcription import node_functions
from vrsopt.surrogate import chebyshev, store
from vrsopt.surrogate.export import path_predict

MACHINE = helicopter("bo105")
LIMITS = Limits(MACHINE.aircraft, MACHINE.engine, "manual", 1.3)


@pytest.fixture(scope="module")
def surrogate():
    with resources.as_file(resources.files("vrsopt") / "data" / "surrogate.nc") as path:
        return store.load(path)


@pytest.fixture(scope="module")
def make(surrogate):
    return SurrogateAircraft(surrogate, LIMITS)


def conditions(speed, altitude=50.0, climb_angle=0.0, load_factor=1.0, idle=False):
    """Flight conditions at nodes; arguments broadcast."""
    arrays = np.broadcast_arrays(*(np.atleast_1d(v).astype(float) for v in (speed, altitude, climb_angle, load_factor)))
    names = ("speed", "altitude", "climb_angle", "load_factor")
    idle = np.broadcast_to(np.atleast_1d(idle), arrays[0].shape)
    return SimpleNamespace(**dict(zip(names, arrays, strict=True)), idle=idle)


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
    flight = conditions(
        [0.0, 40.0, 40.0, 35.0, 0.0], 100.0, [0, 0.12, -0.12, 0, 0], [1, 1, 1, 1.18, 1], [0, 0, 0, 0, 1]
    )
    path = make(flight)
    function, coefficients = path.function()
    node = node_functions(function)
    point = np.array([1900.0, 41.0, 0.18, 0.2])
    steps, weights = (1.0, 0.01, 1e-3, 0.01), np.array([100.0, 1.0, 0.7, 0.5, 0.3, 0.2])
    values = path.evaluate(*(np.full(5, value) for value in point))
    for k in range(5):
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


@pytest.mark.parametrize(("offset", "altitude"), [(-30.0, 50.0), (35.0, 1950.0)])
def test_days_outside_the_sampled_densities_are_refused(surrogate, offset, altitude):
    with pytest.raises(InputError, match=r"density altitude = -?\d+ m: sampled from 0 to 2000 m"):
        SurrogateAircraft(surrogate, LIMITS, isa_offset=offset)(conditions(30.0, altitude))


def test_a_hot_day_is_that_of_the_physics_but_for_the_mach_number(surrogate):
    """The rotor flies at the density altitude: the Mach number of a hot day is lower than the surrogate's."""
    path = SurrogateAircraft(surrogate, LIMITS, isa_offset=20.0)(conditions([0.0, 40.0], 300.0))
    values = path.evaluate(np.full(2, 1900.0), 40.0, 0.2)
    for k, speed in enumerate((0.0, 40.0)):
        flight = {"mass": 1900.0, "altitude": 300.0, "isa_offset": 20.0, "speed": speed, "climb_angle": 0.0}
        flight |= {"load_factor": 1.0, "rotor_speed": 40.0, "twist": 0.2}
        assert values.fuel_flow[k] == pytest.approx(MACHINE.point(flight, limits=LIMITS).fuel_flow, rel=4e-3)


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
