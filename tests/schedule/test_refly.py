"""Flying schedules on the fine grid."""

import numpy as np
import pytest

from tests.schedule.smooth_profiles import surveillance
from vrsopt.errors import InputError
from vrsopt.schedule.nominal import constant_schedule, nominal_schedule
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import Schedule, ScheduleSettings


def test_fuel_proportional_to_mass_burns_exponentially_and_mass_events_add_up(make_profile, make_model):
    rate = 4e-5
    profile = make_profile(
        {"task": "cruise", "duration": 1500.0, "speed": 40.0},
        {"task": "hover", "duration": 300.0, "mass_change": 200.0},
        {"task": "cruise", "duration": 900.0, "speed": 40.0, "mass_change": -120.0},
    )
    grid = FlightGrid(profile, make_model(constant_fuel=rate), step=1.0)
    flight = grid.fly(nominal_schedule(profile), takeoff_mass=2000.0)
    mass = 2000.0 * np.exp(-rate * 1500.0)
    fuel = [2000.0 - mass]
    for change, duration in ((200.0, 300.0), (-120.0, 900.0)):
        mass += change
        fuel.append(mass * (1 - np.exp(-rate * duration)))
        mass *= np.exp(-rate * duration)
    np.testing.assert_allclose(flight.fuel_per_segment, fuel, rtol=1e-9)
    assert flight.mass[-1] == pytest.approx(2000.0 - flight.fuel + 80.0, abs=1e-9)
    edge = np.flatnonzero(np.diff(flight.segment))
    np.testing.assert_allclose(flight.mass[edge + 1] - flight.mass[edge], [200.0, -120.0], atol=1e-9)
    assert flight.success


@pytest.fixture(scope="module")
def smooth():
    """A take-off, turns of 3 s, and a landing."""
    return surveillance(6)


def test_quadrature_error_estimate_is_honest_and_of_second_order(make_profile, make_model):
    profile = make_profile(
        {"task": "climb", "duration": 320.0, "speed": 40.0, "climb": np.radians(6.0)},
        {"task": "descent", "duration": 160.0, "speed": 40.0, "climb": np.radians(-3.0)},
    )
    flights = [
        FlightGrid(profile, make_model(), step=step).fly(nominal_schedule(profile), takeoff_mass=2000.0)
        for step in (40.0, 20.0, 10.0, 0.5)
    ]
    error = np.array([abs(flight.fuel - flights[3].fuel) for flight in flights[:3]])
    assert [flight.quadrature_error for flight in flights[:3]] == pytest.approx(error, rel=0.1)
    np.testing.assert_allclose(np.log2(error[:-1] / error[1:]), 2.0, atol=0.1)


def test_a_second_resolves_rolls_of_three_seconds(smooth, make_model):
    schedule = nominal_schedule(smooth)
    fuel, estimate = [], []
    for step in (1.0, 0.5, 0.1):
        flight = FlightGrid(smooth, make_model(), step=step).fly(schedule, takeoff_mass=2150.0)
        fuel.append(flight.fuel)
        estimate.append(flight.quadrature_error)
    assert estimate[0] < 2e-5 * fuel[0]
    assert fuel[0] == pytest.approx(fuel[2], rel=2e-5)
    assert abs(fuel[1] / fuel[0] - 1.0) < 2e-4  # twice the resolution in time


def test_every_segment_has_an_even_number_of_steps(smooth, make_model):
    grid = FlightGrid(smooth, make_model())
    steps = np.bincount(grid.segment) - 1
    assert np.all(steps % 2 == 0) and np.all(np.diff(grid.time) <= 1.0 + 1e-9)
    with pytest.raises(InputError, match="step = 0.0"):
        FlightGrid(smooth, make_model(), step=0.0)


def test_a_mass_outside_the_model_is_named_and_only_where_it_is_flown(make_profile, make_model):
    """Before the pick-up fuel is burned: the sum of take-off mass and pick-up is above the bound, the mass is not."""
    profile = make_profile(
        {"task": "cruise", "duration": 3000.0, "speed": 40.0},
        {"task": "pick-up", "kind": "hover", "duration": 60.0, "mass_change": 360.0},
    )
    grid = FlightGrid(profile, make_model())
    flight = grid.fly(nominal_schedule(profile), takeoff_mass=2200.0)
    assert flight.mass.max() < 2500.0 < 2200.0 + 360.0
    with pytest.raises(InputError, match=r"gross mass = 25\d\d.\d kg at 3000 s \(pick-up\).* from 1400.0 to 2500.0"):
        grid.fly(nominal_schedule(profile), takeoff_mass=2300.0)
    mass, burned = grid.burned(nominal_schedule(profile), takeoff_mass=2300.0)
    assert mass.max() > 2500.0 and burned[-1] > flight.fuel


def test_kinetic_energy_of_a_speed_change_and_back_is_returned(make_profile, make_model):
    """The mean power of the inertia over a cycle is zero, to rounding, whatever the step."""
    profile = make_profile({"task": "cruise", "duration": 60.0, "speed": 40.0})
    grid = FlightGrid(profile, make_model(inertia=973.0), step=7.0)
    plain = FlightGrid(profile, make_model(inertia=0.0), step=7.0)
    schedule = Schedule(
        "cycle", np.zeros(3, dtype=int), np.array([0.0, 25.0, 60.0]), np.array([44.4, 40.0, 44.4]), np.full(3, 0.14)
    )
    speed, twist = schedule.at(grid.segment, grid.time)
    mass = np.full(len(grid.time), 2000.0)
    step = np.diff(grid.time)
    energy = []
    for each in (grid, plain):
        power = each.evaluate(mass, speed, twist).power_per_engine
        energy.append(np.sum(0.5 * step * (power[:-1, 1] + power[1:, 0])))
    assert energy[0] == pytest.approx(energy[1], rel=2e-4)  # what is left is the floor of the engine's power
    rate, _ = grid.rates(speed)
    assert abs(rate).max() * 973.0 * 44.0 / 2 > 2e3  # and the power that comes and goes is not small


def test_jumps_are_reported_as_infinite_rates_and_ramps_by_their_slope(make_profile, make_model):
    profile = make_profile({"task": "cruise", "duration": 60.0, "speed": 40.0}, {"task": "hover", "duration": 60.0})
    segment, time = np.array([0, 0, 1, 1]), np.array([0.0, 60.0, 60.0, 120.0])
    jump = Schedule("jump", segment, time, np.array([44.4, 44.4, 43.0, 43.0]), np.array([0.14, 0.15, 0.15, 0.15]))
    flight = FlightGrid(profile, make_model()).fly(jump, takeoff_mass=2000.0)
    assert flight.max_rotor_speed_rate == np.inf
    assert flight.max_twist_rate == pytest.approx(0.01 / 60.0)


def test_a_broken_limit_is_named_with_time_and_task(transport, make_model):
    slow = constant_schedule(transport, rotor_speed=36.0, twist=0.14, name="slow")
    flight = FlightGrid(transport, make_model(blade_loading_limit=0.08)).fly(slow, takeoff_mass=2200.0)
    assert not flight.success
    assert flight.violations[0].limit == "blade loading"
    assert flight.violations[0].task == "loiter"
    assert "blade loading" in flight.message and "over its limit at" in flight.message


def test_share_of_time_on_a_limit(make_profile, make_model):
    """A limit met exactly in one of two hovers is active for the share of that hover."""
    profile = make_profile(
        {"task": "hover", "duration": 100.0}, {"task": "loaded", "duration": 300.0, "load": 1.001 / 0.9}
    )
    grid = FlightGrid(profile, make_model(constant_fuel=1e-9))
    limits = grid.evaluate(
        np.full(len(grid.time), 2000.0), *nominal_schedule(profile).at(grid.segment, grid.time)
    ).limits
    loading = limits[0, -1, 0] + 1.0
    model = make_model(constant_fuel=1e-9, blade_loading_limit=0.1 * loading)
    flight = FlightGrid(profile, model).fly(nominal_schedule(profile), takeoff_mass=2000.0)
    assert flight.time_on_limits["blade loading"] == pytest.approx(0.75, abs=1e-6)


def test_a_node_without_a_number_fails_the_flight(transport, make_model):
    grid = FlightGrid(transport, make_model(), step=10.0)
    grid.model.coefficients[1, 20] = np.nan
    flight = grid.fly(nominal_schedule(transport), takeoff_mass=2000.0)
    assert not flight.success and np.isnan(flight.fuel)
    assert "no fuel flow at 1 nodes" in flight.message


def test_schedule_is_linear_in_time_and_complete(transport):
    schedule = nominal_schedule(transport)
    with pytest.raises(InputError, match="segment = 99"):
        schedule.at(np.array([99]), np.array([0.0]))
    with pytest.raises(InputError, match="ordered"):
        Schedule("x", np.array([0, 0]), np.array([1.0, 0.0]), np.ones(2), np.ones(2))
    with pytest.raises(InputError, match="rotor_speed_bounds"):
        ScheduleSettings(rotor_speed_bounds=(45.0, 50.0))
    with pytest.raises(InputError, match="outside the range"):
        ScheduleSettings().box({"rotor_speed": (10.0, 20.0), "twist": (0.1, 0.3)})
