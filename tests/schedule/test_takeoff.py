"""Take-off mass: closed on the reserve, or given; and what the aircraft may weigh on the way."""

import math

import numpy as np
import pytest

from vrsopt.airframe_data import Loading as AircraftLoading
from vrsopt.errors import InputError, NoSolutionError
from vrsopt.helicopter import helicopter
from vrsopt.mission.file import Loading
from vrsopt.schedule.nominal import nominal_schedule
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.takeoff import closed_loading, given_loading

RESERVE_FLOW = 0.04  # kg/s


@pytest.fixture(scope="module")
def flight(make_profile, make_model):
    def make(pick_up: float, duration: float = 1800.0):
        profile = make_profile(
            {"task": "cruise", "duration": duration, "speed": 40.0},
            {"task": "pick-up", "kind": "hover", "duration": 60.0, "mass_change": pick_up},
            {"task": "cruise", "duration": 600.0, "speed": 40.0},
        )
        return FlightGrid(profile, make_model()), nominal_schedule(profile)

    return make


@pytest.fixture(scope="module")
def aircraft() -> AircraftLoading:
    return helicopter("bo105").aircraft.loading


def close(grid, schedule, aircraft, empty):
    loading = Loading(empty_kg=empty, crew_kg=170.0)
    return closed_loading(
        grid, schedule, loading=loading, aircraft=aircraft, endurance_flow=lambda mass: RESERVE_FLOW * mass / 2000.0
    )


def test_closed_mass_lands_with_the_reserve(flight, aircraft):
    grid, schedule = flight(200.0)
    closed = close(grid, schedule, aircraft, 1500.0)
    burned = grid.fly(schedule, takeoff_mass=closed.takeoff_mass).fuel
    assert closed.fuel_loaded - burned == pytest.approx(1800.0 * RESERVE_FLOW * closed.landing_mass / 2000.0, abs=1e-5)
    assert closed.landing_mass == pytest.approx(closed.takeoff_mass - burned + 200.0, abs=1e-6)


def test_a_pick_up_beyond_the_largest_mass_is_named_with_task_and_time(flight, aircraft):
    grid, schedule = flight(800.0)
    with pytest.raises(NoSolutionError, match=r"gross mass 2\d\d\d kg at 1800 s \(pick-up\), \d+ kg over the largest"):
        close(grid, schedule, aircraft, 1650.0)


def test_an_aircraft_lighter_than_the_model_holds_for_is_named(flight, aircraft):
    """Iterates without fuel are lighter too; only what is flown in the end counts."""
    grid, schedule = flight(0.0)
    closed = close(grid, schedule, aircraft, 1180.0)
    assert 1180.0 + 170.0 < 1400.0 < closed.landing_mass
    with pytest.raises(InputError, match=r"gross mass = 13\d\d.\d kg at 2460 s \(cruise\)"):
        close(grid, schedule, aircraft, 1100.0)


def test_a_given_mass_is_flown_as_it_is(flight, aircraft):
    grid, schedule = flight(200.0)
    given = given_loading(grid, schedule, takeoff_mass=2000.0, aircraft=aircraft)
    assert given.takeoff_mass == 2000.0 and math.isnan(given.reserve_fuel) and math.isnan(given.fuel_loaded)
    flown = grid.fly(schedule, takeoff_mass=2000.0)
    assert given.fuel_burned == pytest.approx(flown.fuel, rel=1e-9)
    assert given.landing_mass == pytest.approx(flown.mass[-1], rel=1e-9)


@pytest.mark.parametrize(
    ("mass", "pick_up", "duration", "error", "message"),
    [
        (
            2600.0,
            0.0,
            600.0,
            NoSolutionError,
            r"gross mass 2600 kg at 0 s \(cruise\), 100 kg over the largest",
        ),
        (2400.0, 300.0, 600.0, NoSolutionError, r"gross mass 26\d\d kg at 600 s \(pick-up\)"),
        (2450.0, 0.0, 20_000.0, NoSolutionError, r"fuel: \d+.\d kg are burned, \d+.\d kg more than the tank holds"),
        (1405.0, 0.0, 600.0, InputError, r"gross mass = 13\d\d.\d kg .* holds from 1400.0 to 2500.0"),
    ],
)
def test_masses_that_can_not_be_flown_say_why(flight, aircraft, mass, pick_up, duration, error, message):
    grid, schedule = flight(pick_up, duration)
    with pytest.raises(error, match=message):
        given_loading(grid, schedule, takeoff_mass=mass, aircraft=aircraft)


def test_rounding_does_not_make_a_mass_too_large(flight, aircraft):
    grid, schedule = flight(0.0, 600.0)
    given = given_loading(grid, schedule, takeoff_mass=2500.0, aircraft=aircraft)
    assert np.isfinite(given.fuel_burned)
