"""Schedules that tell apart what is saved by what: set once, changed in flight, by the rotor, by the engine."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.mission.file import read_mission
from vrsopt.report.tables import verdict
from vrsopt.schedule import common_flights
from vrsopt.schedule.compare import solve
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.surrogate_path import SurrogateAircraft
from vrsopt.schedule.verify import PhysicsFlight
from vrsopt.schedule.violation import Stay, Violation
from vrsopt.surrogate import store

HOP = Path(__file__).parents[1] / "hop.toml"
SCHEDULES = ("nominal", "constant", "trajectory", "variable_transmission")


def quick_physics(profile, schedule, *, limits, takeoff_mass, nodes, transmission, spin_down_credit):
    """The surrogate in place of the physics, which takes longer and is tested elsewhere."""
    make = SurrogateAircraft(store.load("level"), limits, transmission=transmission)
    grid = FlightGrid(profile, make, step=10.0)
    flight = grid.fly(schedule, takeoff_mass=takeoff_mass)
    series = {"segment": flight.segment, "time": flight.time, "mass": flight.mass, "fuel_flow": flight.fuel_flow}
    return PhysicsFlight(
        **series,
        usages=1.0 + flight.limits,
        fuel=flight.fuel,
        quadrature_error=flight.quadrature_error,
        residual_norm=0.0,
        emission_nodes=np.arange(len(flight.time)),
        emissions=grid.emissions(flight),
        success=flight.success,
        message=flight.message,
    )


@pytest.fixture(scope="module")
def compared():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(common_flights, "fly_physics", quick_physics)
        return solve(read_mission(HOP), schedules=SCHEDULES, workers=1)


def test_names_and_order(compared):
    names = ["nominal", "constant", "trajectory", "nominal_variable_transmission", "trajectory_variable_transmission"]
    assert list(compared.results) == list(compared.summary()["schedules"]) == names
    assert compared.success
    assert all(result.schedule.name == name for name, result in compared.results.items())


def test_each_freedom_saves_fuel(compared):
    fuel = {name: result.flight.fuel for name, result in compared.results.items()}
    assert fuel["trajectory"] < fuel["constant"] < fuel["nominal"]
    assert fuel["trajectory_variable_transmission"] < fuel["trajectory"]
    assert fuel["trajectory_variable_transmission"] < fuel["nominal_variable_transmission"] < fuel["nominal"]
    engine = 1.0 - fuel["nominal_variable_transmission"] / fuel["nominal"]
    assert 0.02 < engine < 0.12  # at the loads of this mission


def test_all_begin_and_end_alike_and_the_rotor_s_energy_balances(compared):
    settings = compared.settings
    for result in compared.results.values():
        flight = result.flight
        assert flight.rotor_speed[[0, -1]] == pytest.approx(settings.nominal_rotor_speed)
        assert flight.twist[[0, -1]] == pytest.approx(settings.nominal_twist)
        assert flight.mass[0] == compared.loading.takeoff_mass
        energy = result.energy
        assert energy.end_minus_start == pytest.approx(0.0, abs=1.0)
        assert energy.charged == pytest.approx(energy.credited + energy.jumped, rel=1e-3, abs=1.0)
    figures = compared.summary()["schedules"]["trajectory"]
    assert figures["rotor_energy_kj"]["charged"] > 100.0
    assert figures["active_limits_percent"]["rotor speed at its lower bound"] > 30.0


def test_every_step_is_timed_once(compared):
    steps = compared.summary()["steps"]
    assert {"trajectory", "variable transmission", "best constant rotor speed and twist"} < set(steps)
    assert "free speeds and altitudes" not in steps
    assert all(times["wall_s"] >= 0.0 and times["cpu_s"] >= 0.0 for times in steps.values())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"schedules": ("best",)}, "'best': some of nominal, constant, pointwise, prescribed, trajectory, consistent"),
        ({"objective": {"soot": 1.0}}, "soot"),
        ({"objective": {"nox": 1.0}, "schedules": ("consistent",)}, "solve: objective: not with the schedule consist"),
    ],
)
def test_what_can_not_be_compared_is_refused(options, message):
    with pytest.raises(InputError) as error:
        solve(HOP, **options)
    assert message in str(error.value)


def test_limits_of_a_corrected_schedule_count_on_the_physics(compared):
    result = compared.results["trajectory"]
    broken = Violation("tail rotor loading", "climb", 30.0, 0.005)
    flight = replace(result.flight, success=False, violations=(broken,), message=f"infeasible: {broken}")
    plain, corrected = (replace(result, flight=flight, corrected=is_it) for is_it in (False, True))
    assert not plain.success and verdict(plain) == f"infeasible: {broken}"
    assert corrected.success and verdict(corrected) == "flyable"
    assert corrected.message == f"on the surrogate alone: infeasible: {broken}"
    for wrong in (
        replace(corrected, schedule=replace(result.schedule, success=False)),
        replace(corrected, physics=replace(result.physics, success=False, message="stalled")),
        replace(corrected, flight=replace(flight, violations=(Stay("87 to 95 %", "climb", 30.0, 1.0, 9.0, 4.0),))),
    ):
        assert not wrong.success and verdict(wrong) != "flyable"
