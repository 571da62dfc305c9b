"""The best constant rotor speed and twist of a mission."""

from dataclasses import replace

import numpy as np
import pytest

from vrsopt.schedule.bands import ForbiddenBand
from vrsopt.schedule.constant import best_constant_schedule
from vrsopt.schedule.limiter import followed, rate_limited_schedule
from vrsopt.schedule.nominal import constant_schedule, nominal_schedule
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import ScheduleSettings

MASS = 2000.0
SETTINGS = ScheduleSettings()


@pytest.fixture(scope="module")
def grid(transport, make_model):
    return FlightGrid(transport, make_model(), step=2.0)


@pytest.fixture(scope="module")
def best(grid):
    return best_constant_schedule(grid, takeoff_mass=MASS, settings=SETTINGS)


def flown(grid, rotor_speed, twist):
    """A constant schedule as it can be flown."""
    target = constant_schedule(grid.profile, rotor_speed=rotor_speed, twist=twist)
    return grid.fly(rate_limited_schedule(target, grid, takeoff_mass=MASS, settings=SETTINGS), takeoff_mass=MASS)


def test_neighbours_burn_more_or_break_a_limit(grid, best):
    own = grid.fly(best, takeoff_mass=MASS)
    assert own.success and own.fuel < 0.99 * grid.fly(nominal_schedule(grid.profile), takeoff_mass=MASS).fuel
    for away in ((0.1, 0.0), (-0.1, 0.0), (0.0, 0.003), (0.0, -0.003), (0.1, 0.003), (-0.1, -0.003)):
        other = flown(grid, best.details["rotor_speed"] + away[0], best.details["twist"] + away[1])
        assert other.fuel > own.fuel or np.max(other.limits) > 0.0


def test_no_point_of_a_grid_over_the_box_is_better(grid, best):
    own = grid.fly(best, takeoff_mass=MASS).fuel
    for rotor_speed in np.linspace(36.0, 48.0, 5):
        for twist in (0.14, 0.19):
            other = flown(grid, rotor_speed, twist)
            assert not other.success or other.fuel > own


def test_it_is_nominal_in_idle_and_at_the_ends_and_keeps_the_rates(grid, best):
    pinned = np.asarray(grid.conditions.idle).copy()
    pinned[[0, -1]] = True
    np.testing.assert_allclose(best.rotor_speed[pinned], SETTINGS.nominal_rotor_speed, rtol=1e-12)
    np.testing.assert_allclose(best.twist[pinned], SETTINGS.nominal_twist, rtol=1e-12)
    flight = grid.fly(best, takeoff_mass=MASS)
    assert flight.max_rotor_speed_rate <= SETTINGS.rotor_speed_rate * (1 + 1e-9)
    in_cruise = grid.segment == 3
    assert np.ptp(best.rotor_speed[in_cruise][60:-60]) == 0.0 == np.ptp(best.twist[in_cruise][60:-60])


def test_a_limit_is_kept_and_met(transport, make_model):
    grid = FlightGrid(transport, make_model(blade_loading_limit=0.085))
    flight = grid.fly(best_constant_schedule(grid, takeoff_mass=MASS), takeoff_mass=MASS)
    assert flight.success and -2e-3 < np.max(flight.limits[0]) <= 0.0


def test_a_forbidden_band_is_left_to_the_better_side(grid, best):
    optimum = best.details["rotor_speed"]
    band = ForbiddenBand(optimum - 0.4, optimum + 1.0, 10.0)
    settings = replace(SETTINGS, forbidden_bands=(band,))
    banded = FlightGrid(grid.profile, lambda conditions: grid.model, step=2.0, settings=settings)
    schedule = best_constant_schedule(banded, takeoff_mass=MASS, settings=settings)
    own = banded.fly(schedule, takeoff_mass=MASS)
    assert own.success
    edges = [band.lower, band.upper]
    assert min(abs(schedule.details["rotor_speed"] - edge) for edge in edges) < 0.02
    others = [flown(grid, edge, schedule.details["twist"]) for edge in edges]
    assert all(other.fuel > 0.99999 * own.fuel or np.max(other.limits) > 0.0 for other in others)


def test_a_variable_that_is_held_stays(grid):
    schedule = best_constant_schedule(grid, takeoff_mass=MASS, settings=SETTINGS.restricted("twist"))
    assert np.all(schedule.rotor_speed == SETTINGS.nominal_rotor_speed)
    assert schedule.details["twist"] != SETTINGS.nominal_twist


def test_limits_that_can_not_be_kept_are_said(transport, make_model):
    grid = FlightGrid(transport, make_model(power_limit=100e3))
    schedule = best_constant_schedule(grid, takeoff_mass=MASS)
    assert not schedule.success and "no constant rotor speed and twist keep all limits" in schedule.message
    flight = grid.fly(schedule, takeoff_mass=MASS)
    assert not flight.success and "engine power" in flight.message


def test_free_ends_are_free_in_the_limiter_too(grid, make_profile):
    free = replace(SETTINGS, ends="free")
    target = np.full(len(grid.time), 40.0)
    flying = followed(grid, free, target, np.full(len(grid.time), 0.15))
    assert flying[0][0] == SETTINGS.nominal_rotor_speed  # this mission begins in idle
    cruise = FlightGrid(make_profile({"task": "cruise", "duration": 9.0, "speed": 40.0}), lambda c: grid.model)
    assert np.all(followed(cruise, free, np.full(len(cruise.time), 40.0), np.full(len(cruise.time), 0.15))[0] == 40.0)


def test_accelerations_are_kept_on_the_way_and_the_ends_are_nominal_all_the_same(grid):
    gentle = replace(SETTINGS, rotor_speed_acceleration=0.02, twist_acceleration=1e-3)
    moving = 40.0 + 3.0 * np.sign(np.sin(grid.time / 40.0))
    speed, twist = followed(grid, gentle, moving, np.full(len(grid.time), 0.2))
    for values, nominal, rate, acceleration in (
        (speed, 44.4, SETTINGS.rotor_speed_rate, 0.02),
        (twist, SETTINGS.nominal_twist, SETTINGS.twist_rate, 1e-3),
    ):
        pinned = np.asarray(grid.conditions.idle).copy()
        pinned[[0, -1]] = True
        np.testing.assert_allclose(values[pinned], nominal, rtol=1e-9)
        steps = np.diff(grid.time) > 0.0
        slope = np.diff(values)[steps] / np.diff(grid.time)[steps]
        assert np.max(np.abs(slope)) <= rate * (1 + 1e-9)
        assert 0.4 * acceleration < np.max(np.abs(np.diff(slope))) / 2.0 <= acceleration * (1 + 1e-6)  # nodes 2 s apart
    assert np.ptp(speed) > 4.0
