"""Constraints and costs of one's own, and changed limits, where the whole-mission problem does not look by itself."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.schedule import refinement
from vrsopt.schedule.additions import Additions, Constraint, quantities
from vrsopt.schedule.bands import ForbiddenBand
from vrsopt.schedule.mesh import Mesh
from vrsopt.schedule.nominal import constant_schedule
from vrsopt.schedule.own_rows import flown_excess, judged
from vrsopt.schedule.refinement import broken_intervals, refined
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.trajectory import TrajectoryProblem
from vrsopt.solvers.status import Status

MASS, NOMINAL = 2000.0, 44.4
FREE = ScheduleSettings(ends="free")


@pytest.fixture(scope="module")
def trip(make_profile):
    return make_profile(
        {"task": "transit", "kind": "cruise", "duration": 120.0, "speed": 55.0},
        {"task": "loiter", "duration": 120.0, "speed": 30.0},
    )


def test_excess_of_a_flight_over_changed_limits_and_own_constraints(trip, make_model):
    q, grid = quantities(), FlightGrid(trip, make_model())
    flight = grid.fly(constant_schedule(trip, rotor_speed=43.0, twist=0.14), takeoff_mass=MASS)
    own = (
        Constraint("tip speed", 4.912 * q["rotor_speed"], lower=200.0, upper=220.0, unit="m/s", tasks=("loiter",)),
        Constraint("late nox", q["nox"] * q["time"], upper=1.0),
        Constraint("torque of the rotor", q["torque"], upper=5e3, unit="N m"),
        Constraint("two", 2.0, lower=1.0),
    )
    names, excess = flown_excess(grid, flight, Additions(own), {"engine power": 0.9, "late nox": (None, 1e-9)})
    assert names == ("blade loading", "engine power", "torque", "tip speed", "late nox", "torque of the rotor", "two")
    np.testing.assert_allclose(excess[:3] - flight.limits, [[0.0], [0.1], [0.0]] * np.ones(len(grid.time)), atol=1e-12)
    late = flight.segment == 1
    np.testing.assert_allclose(excess[3], np.where(late, (4.912 * 43.0 - 220.0) / 220.0, -1.0))
    assert np.all(excess[4, 1:] > 0.0) and np.all(excess[6] == -1.0)
    np.testing.assert_allclose(excess[5], 2 * flight.power_per_engine / 43.0 / 5e3 - 1.0, atol=1e-4)


@pytest.mark.parametrize(("name", "unit"), [("power_per_engine", "W"), ("turbine_temperature", "K")])
def test_a_constraint_is_judged_alike_however_it_is_written(trip, make_model, name, unit):
    """A bound on a value, on its difference to the bound, and on thousandths of that: in the problem and in flight."""
    q, grid = quantities(), FlightGrid(trip, make_model(), settings=FREE)
    free = TrajectoryProblem(trip, make_model(), settings=FREE).solve(MASS)
    flight = grid.fly(free.schedule, takeoff_mass=MASS)
    power, fuels = 0.995 * float(np.max(flight.power_per_engine)), []
    bound = power if unit == "W" else 700.0 + 1.5e-3 * power
    for value, upper in ((q[name], bound), (q[name] - bound, 0.0), (1e-3 * (q[name] - bound), 0.0)):
        additions = Additions((Constraint("own", value, upper=upper, unit=unit),))
        excess = flown_excess(grid, flight, additions, {})[1][-1].max()
        assert 1e-3 < excess < 0.1  # of the size of the value, not of 1 W or 1 K
        found = refined(
            TrajectoryProblem(trip, make_model(), settings=FREE, additions=additions), grid, takeoff_mass=MASS
        )
        assert found[0].success and found[0].iterations < 60, found[0].message
        fuels.append(found[0].fuel)
    assert fuels == pytest.approx([fuels[0]] * 3, rel=2e-6) and fuels[0] >= free.fuel * (1 - 1e-6)
    assert judged(grid, flight, additions, None).message.startswith("own ")


def test_the_ends_of_a_segment_are_judged_at_the_rate_inside_it(make_profile, make_model):
    """A rotor that slows down all the way gives its power from the first to the last moment."""
    profile = make_profile({"task": "loiter", "duration": 20.0, "speed": 30.0})
    grid = FlightGrid(profile, make_model())
    slowing = replace(constant_schedule(profile, rotor_speed=44.4, twist=0.14), rotor_speed=np.array([44.4, 36.0]))
    flight = grid.fly(slowing, takeoff_mass=MASS)
    power = (flight.limits[1] + 1.0) * 257e3
    np.testing.assert_allclose(power, flight.power_per_engine, rtol=1e-9)
    steady = grid.fly(constant_schedule(profile, rotor_speed=44.4, twist=0.14), takeoff_mass=MASS)
    assert power[0] < 0.95 * (steady.limits[1, 0] + 1.0) * 257e3


def test_a_flight_is_judged_by_what_is_asked(trip, make_model):
    grid = FlightGrid(trip, make_model(blade_loading_limit=0.07))
    flight = grid.fly(constant_schedule(trip, rotor_speed=41.0, twist=0.14), takeoff_mass=2400.0)
    over = float(np.max(flight.limits))
    assert judged(grid, flight, Additions(), None) is flight and not flight.success
    eased = judged(grid, flight, Additions(), {"blade loading": 1.0 + over})
    assert eased.success and eased.message == "" and eased.time_on_limits["blade loading"] > 0.0
    own = Additions((Constraint("fast", quantities()["rotor_speed"], lower=41.5, tasks=("loiter",)),))
    slow = judged(grid, flight, own, {"blade loading": 1.0 + over})
    assert not slow.success and slow.message.startswith("fast 1.20 % over its limit at 120 s (loiter)")


def test_what_is_allowed_splits_no_interval_and_what_is_not_does(trip, make_model):
    mesh = Mesh(np.arange(2), np.array([0.0, 120.0]), np.full(2, 120.0))
    grid = FlightGrid(trip, make_model(blade_loading_limit=0.07))
    flight = grid.fly(constant_schedule(trip, rotor_speed=41.0, twist=0.14), takeoff_mass=2400.0)
    slow = Additions((Constraint("fast", quantities()["rotor_speed"], lower=41.5, tasks=("loiter",)),))
    usage = {"blade loading": 1.0 + float(np.max(flight.limits)) + 1e-6}
    assert not flight.success
    for additions, limits, broken in ((Additions(), None, [0, 1]), (Additions(), usage, []), (slow, usage, [1])):
        found, _ = broken_intervals(mesh, flight, flown_excess(grid, flight, additions, limits)[1])
        assert found.tolist() == broken


@pytest.mark.parametrize(
    "additions",
    [
        Additions((Constraint("fast", quantities()["rotor_speed"], lower=0.97 * NOMINAL, tasks=("loiter",)),)),
        Additions(cost=(quantities()["rotor_speed"] - 1.02 * NOMINAL) ** 2),
        Additions(integrals=(Constraint("mean", quantities()["rotor_speed"] / 240.0, lower=0.97 * NOMINAL),)),
    ],
)
def test_side_of_a_forbidden_band_is_that_of_the_whole_problem(trip, make_model, additions):
    """Least fuel alone is below the band; constraints, cost and integrals ask for more than is there."""
    band = ForbiddenBand(0.88 * NOMINAL, 0.96 * NOMINAL, 0.0)
    settings, model = replace(FREE, forbidden_bands=(band,)), make_model(blade_loading_limit=0.2)
    grid = FlightGrid(trip, model, settings=settings)
    fuel = refined(TrajectoryProblem(trip, model, settings=settings), grid, takeoff_mass=MASS)[0]
    assert fuel.success and np.max(fuel.schedule.rotor_speed) <= band.lower + 1e-6
    problem = TrajectoryProblem(trip, model, settings=settings, additions=additions)
    found = refined(problem, grid, takeoff_mass=MASS)[0]
    assert found.success and np.min(found.schedule.rotor_speed) >= band.upper - 1e-6


def test_without_a_solution_as_planned_nothing_is_called_infeasible(trip, make_model):
    settings = replace(FREE, forbidden_bands=(ForbiddenBand(0.88 * NOMINAL, 0.96 * NOMINAL, 12.0),))
    grid = FlightGrid(trip, make_model(), settings=settings)
    much = Additions(integrals=(Constraint("mean", quantities()["rotor_speed"] / 240.0, lower=60.0, unit="rad/s"),))
    problem = TrajectoryProblem(trip, make_model(), settings=settings, additions=much)
    found = refined(problem, grid, takeoff_mass=MASS)[0]
    assert not found.success and found.status is found.schedule.status is not Status.INFEASIBLE
    assert found.message.startswith("nothing found where the forbidden bands are crossed as planned, nor on one")
    assert "as planned: it would take mean" in found.message


def test_what_is_not_a_number_is_named(trip, make_model):
    q = quantities()
    for additions, named in (
        (
            Additions((Constraint("far", ca.log(q["rotor_speed"] - 100.0), upper=1.0, tasks=("loiter",)),)),
            "far at 120 s",
        ),
        (Additions(cost=ca.log(q["rotor_speed"] - 100.0)), "the objective or a derivative"),
    ):
        found = TrajectoryProblem(trip, make_model(), settings=FREE, additions=additions).solve(MASS)
        assert not found.success and found.status is Status.NOT_FINITE
        assert f"is infinite or not a number: {named}" in found.message
    with pytest.raises(InputError, match=r"objective = 3: must depend on one of quantities\(\)"):
        Additions(cost=3).cost_expression()


def test_constraints_of_nothing_free_hold_or_are_named(trip, make_model):
    q, grid = quantities(), FlightGrid(trip, make_model(), settings=FREE)
    kept = Constraint("constant", 3.0, upper=5.0), Constraint("airspeed", q["speed"], upper=60.0, unit="m/s")
    clock = Constraint("length", 1.0, upper=300.0, unit="s")
    plain, found = (
        refined(TrajectoryProblem(trip, make_model(), settings=FREE, additions=one), grid, takeoff_mass=MASS)[0]
        for one in (None, Additions(kept, integrals=(clock,)))
    )
    assert found.success and found.fuel == pytest.approx(plain.fuel, rel=1e-6)
    assert found.integrals["length"] == pytest.approx(240.0)
    broken = Additions((Constraint("constant", 3, upper=2.0),))
    refused = TrajectoryProblem(trip, make_model(), settings=FREE, additions=broken).solve(MASS)
    assert not refused.success and "infeasible; it would take constant 3.000 against 2.000" in refused.message
    with pytest.raises(InputError, match="additions: none = nan: must be finite, or depend on one of quantities"):
        Constraint("none", float("nan"), upper=1.0)


def test_a_cost_starts_with_the_multipliers_of_its_own_solution(trip, make_model):
    nox = Additions(cost={"nox": 1.0})
    problem = TrajectoryProblem(trip, make_model(), settings=FREE, additions=nox, ipopt={"tol": 1e-8})
    first = problem.solve(MASS)
    again = problem.solve(MASS, first)
    assert again.success and again.iterations <= 5 < first.iterations
    assert again.objective == pytest.approx(first.objective, rel=1e-6)


def test_the_last_mesh_is_flown_too(make_profile, make_model, monkeypatch):
    """A bound that moves faster than linear between the only nodes, and no second mesh."""
    monkeypatch.setattr(refinement, "MAX_ROUNDS", 1)
    profile = make_profile({"task": "loiter", "duration": 100.0, "speed": 30.0})
    far, mesh = quantities()["time"] - 50.0, Mesh(np.zeros(1, dtype=int), np.zeros(1), np.full(1, 100.0))
    bump = Additions(
        (Constraint("bump", quantities()["rotor_speed"] - 3.0 * ca.exp(-((far + 25.0) ** 2)), lower=40.0),)
    )
    problem = TrajectoryProblem(profile, make_model(), settings=FREE, additions=bump, mesh=mesh)
    assert problem.solve(MASS).success
    found = refined(problem, FlightGrid(profile, make_model()), takeoff_mass=MASS)[0]
    assert not found.success and not found.schedule.success
    assert found.message.startswith("between its nodes, on the last of 1 meshes: bump 7.")
