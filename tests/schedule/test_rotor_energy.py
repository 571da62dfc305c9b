"""The rotor's kinetic energy on its way through a flight, and forbidden bands of its speed."""

import numpy as np
import pytest

from vrsopt.schedule.bands import ForbiddenBand
from vrsopt.schedule.nominal import nominal_schedule
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.rotor_energy import rotor_energy
from vrsopt.schedule.schedule import Schedule, ScheduleSettings

INERTIA = 973.0


@pytest.fixture(scope="module")
def cruise(make_profile):
    return make_profile(
        {"task": "transit", "duration": 60.0, "speed": 50.0}, {"task": "search", "duration": 60.0, "speed": 40.0}
    )


def through(*points: tuple[int, float, float]) -> Schedule:
    """A schedule through segment, time and rotor speed."""
    segment, time, rotor_speed = (np.array(row) for row in zip(*points, strict=True))
    return Schedule("own", segment.astype(int), time.astype(float), rotor_speed.astype(float), np.full(len(time), 0.14))


def kinetic(*speeds: float) -> float:
    """What it takes from the first to the second rotor speed [J]."""
    return 0.5 * INERTIA * (speeds[1] ** 2 - speeds[0] ** 2)


def test_energy_is_conserved_above_idle(cruise, make_model):
    grid = FlightGrid(cruise, make_model(), step=2.0)
    schedule = through((0, 0, 44.4), (0, 30, 41.0), (0, 60, 43.0), (1, 60, 43.0), (1, 120, 45.0))
    energy = rotor_energy(grid, grid.fly(schedule, takeoff_mass=2000.0))
    assert energy.charged == pytest.approx(kinetic(41.0, 45.0), rel=3e-3)
    assert energy.credited == pytest.approx(kinetic(41.0, 44.4), rel=3e-3)
    assert energy.end_minus_start == pytest.approx(kinetic(44.4, 45.0))
    assert energy.jumped == 0.0


def test_what_a_jump_needs_comes_from_nowhere_and_is_said(cruise, make_model):
    grid = FlightGrid(cruise, make_model(), step=2.0)
    flight = grid.fly(through((0, 0, 44.4), (0, 60, 44.4), (1, 60, 42.0), (1, 120, 42.0)), takeoff_mass=2000.0)
    energy = rotor_energy(grid, flight)
    assert (energy.charged, energy.credited) == (0.0, 0.0)
    assert energy.jumped == pytest.approx(kinetic(44.4, 42.0)) == pytest.approx(energy.end_minus_start)
    assert flight.max_rotor_speed_acceleration == np.inf


def test_without_credit_spin_up_costs_and_spin_down_gives_nothing(cruise, make_model):
    schedule = through((0, 0, 44.4), (0, 30, 40.0), (0, 60, 44.4), (1, 60, 44.4), (1, 120, 44.4))
    found = {}
    for name, inertia, credit in (("credit", INERTIA, True), ("none", INERTIA, False), ("massless", 0.0, True)):
        grid = FlightGrid(cruise, make_model(inertia=inertia), settings=ScheduleSettings(spin_down_credit=credit))
        flight = grid.fly(schedule, takeoff_mass=2000.0)
        found[name] = flight.fuel, rotor_energy(grid, flight)
    assert found["none"][1].credited == 0.0
    assert found["none"][1].charged == pytest.approx(found["credit"][1].charged, rel=1e-6)
    assert found["massless"][1].charged == found["massless"][1].credited == 0.0
    assert found["none"][0] > found["massless"][0] + 0.01
    assert found["credit"][0] == pytest.approx(found["massless"][0], rel=1e-3)


def test_at_idle_there_is_nothing_to_credit(make_profile, make_model):
    """In a steep descent the engines are at their least: what the rotor gives is lost, what it takes is partly free."""
    profile = make_profile({"task": "descent", "duration": 60.0, "speed": 40.0, "climb": np.radians(-20.0)})
    grid = FlightGrid(profile, make_model())
    energy = rotor_energy(grid, grid.fly(through((0, 0, 44.4), (0, 60, 40.0)), takeoff_mass=2000.0))
    assert energy.end_minus_start == pytest.approx(kinetic(44.4, 40.0))
    assert 0.0 <= energy.credited < 0.05 * kinetic(40.0, 44.4)


def test_acceleration_is_that_between_the_pieces_of_a_schedule(cruise, make_model):
    grid = FlightGrid(cruise, make_model())
    flight = grid.fly(
        through((0, 0, 44.4), (0, 40, 42.4), (0, 60, 42.4), (1, 60, 42.4), (1, 120, 42.4)), takeoff_mass=2000.0
    )
    assert flight.max_rotor_speed_acceleration == pytest.approx(0.05 / 30.0)


BAND = ForbiddenBand(40.0, 42.0, 10.0)
CROSSES = through(
    (0, 0, 44.4), (0, 12, 44.4), (0, 36, 39.6), (0, 60, 39.6), (1, 60, 39.6), (1, 78, 44.4), (1, 120, 44.4)
)


@pytest.mark.parametrize(
    ("band", "message"),
    [
        (BAND, ""),  # 2 rad/s at 0.2 rad/s2
        (
            ForbiddenBand(40.0, 42.0, 9.0),
            "forbidden rotor speed 90.09 to 94.59 %: 10.0 s from 24 s on (transit): at most 9 s",
        ),
        (
            ForbiddenBand(38.0, 40.0, 20.0),
            "forbidden rotor speed 85.59 to 90.09 %: 27.5 s from 34 s on (transit): at mo",
        ),
        (ForbiddenBand(39.6, 42.0, 12.0), ""),  # on the edge is outside
        (ForbiddenBand(45.0, 46.0, 0.0), ""),
        (ForbiddenBand(40.0, 42.0, 0.0), "on (transit): not at all"),
    ],
)
def test_a_stay_in_a_forbidden_band_is_named_with_task_and_time(cruise, make_model, band, message):
    """Between the nodes too: 7 s apart, the speed crosses a band inside a step."""
    for step in (1.0, 6.0):
        grid = FlightGrid(cruise, make_model(), step=step, settings=ScheduleSettings(forbidden_bands=(band,)))
        flight = grid.fly(CROSSES, takeoff_mass=2000.0)
        assert flight.success == (not message)
        assert message in flight.message


def test_bands_do_not_concern_a_flight_that_stays_outside(cruise, make_model):
    grid = FlightGrid(cruise, make_model(), settings=ScheduleSettings(forbidden_bands=(BAND,)))
    assert grid.fly(nominal_schedule(cruise), takeoff_mass=2000.0).success
