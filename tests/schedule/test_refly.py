"""Flying schedules on the fine grid."""

import numpy as np
import pytest

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


def test_quadrature_error_estimate_is_honest_and_of_second_order(transport, make_model):
    schedule = nominal_schedule(transport)
    fuel, estimate = [], []
    for step in (30.0, 15.0, 7.5, 0.5):
        flight = FlightGrid(transport, make_model(), step=step).fly(schedule, takeoff_mass=2150.0)
        fuel.append(flight.fuel)
        estimate.append(flight.quadrature_error)
    error = np.abs(np.array(fuel[:3]) - fuel[3])
    assert np.all(error < 2.0 * np.array(estimate[:3]))
    assert np.log2(error[0] / error[2]) / 2 > 1.7


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
