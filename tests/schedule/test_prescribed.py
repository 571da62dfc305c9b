"""The study's table in climb and descent."""

import numpy as np
import pytest

from tests.schedule.smooth_profiles import SmoothFlight
from vrsopt.schedule.pointwise import pointwise_schedule
from vrsopt.schedule.prescribed import descent_speed, prescribed_schedule
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import ScheduleSettings

SETTINGS = ScheduleSettings()


@pytest.fixture(scope="module")
def profile():
    flight = SmoothFlight().hold("idle", 30.0).hold("hover", 30.0)
    flight.change("lift", 5.0, climb_rate=2.0, kind="vertical_climb").change("lift", 5.0, climb_rate=0.0, kind="hover")
    return flight.take_off(300.0, 48.0).hold("cruise", 120.0).land().hold("hover", 30.0).profile()


@pytest.mark.parametrize(
    ("mass", "ratio"), [(2500.0, 0.95), (2300.0, 0.95), (2299.9, 0.9), (2100.0, 0.9), (2099.9, 0.85), (1400.0, 0.85)]
)
def test_a_mass_on_a_boundary_belongs_to_the_heavier_class(mass, ratio):
    assert descent_speed(mass) == ratio


@pytest.mark.parametrize(("mass", "ratio"), [(2400.0, 0.95), (2200.0, 0.9), (1900.0, 0.85)])
def test_the_table_holds_in_climb_and_descent_and_the_optimum_elsewhere(profile, make_model, mass, ratio):
    model = make_model(blade_loading_limit=0.15, torque_limit=1e9, power_limit=1e9)
    grid = FlightGrid(profile, model)
    base = pointwise_schedule(profile, model, takeoff_mass=mass, method="batched", grid=grid)
    schedule = prescribed_schedule(base, grid, takeoff_mass=mass)
    kinds = np.array([segment.kind for segment in profile.segments])[schedule.segment]
    climb, descent = np.isin(kinds, ("climb", "vertical_climb")), kinds == "descent"
    np.testing.assert_allclose(schedule.rotor_speed[climb], SETTINGS.nominal_rotor_speed)
    np.testing.assert_allclose(schedule.rotor_speed[descent], ratio * SETTINGS.nominal_rotor_speed)
    np.testing.assert_allclose(schedule.twist[climb | descent], np.radians(8.0))
    other = ~(climb | descent)
    np.testing.assert_array_equal(schedule.rotor_speed[other], base.rotor_speed[other])
    flown = [grid.fly(one, takeoff_mass=mass) for one in (base, schedule)]
    assert flown[0].fuel < flown[1].fuel and flown[1].schedule.name == "prescribed"


def test_a_table_that_breaks_a_limit_is_flown_and_reported(profile, make_model):
    model = make_model(blade_loading_limit=0.085)
    grid = FlightGrid(profile, model)
    base = pointwise_schedule(profile, model, takeoff_mass=2050.0, method="batched", grid=grid)
    flown = grid.fly(prescribed_schedule(base, grid, takeoff_mass=2050.0), takeoff_mass=2050.0)
    assert not flown.success and "blade loading" in flown.message and "(descent)" in flown.message
