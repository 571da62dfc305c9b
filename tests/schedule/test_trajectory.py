"""The whole-mission problem: accuracy, limiting cases, rates, and what it says when there is no solution."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.mission.profile import Profile
from vrsopt.schedule.additions import Additions, Constraint, quantities
from vrsopt.schedule.limiter import rate_limited_schedule
from vrsopt.schedule.mesh import MeshOptions
from vrsopt.schedule.pointwise import pointwise_schedule
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.resimulation import mesh_error, resimulation_error
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.trajectory import TrajectoryProblem
from vrsopt.solvers.status import Status

SETTINGS = ScheduleSettings()
FREE_ENDS = ScheduleSettings(ends="free")
FREE_RATES = ScheduleSettings(rotor_speed_rate=None, twist_rate=None)


def test_derivatives_of_the_nlp_are_those_of_automatic_differentiation(transport, make_model):
    problem = TrajectoryProblem(transport, make_model(), mesh=MeshOptions(most_intervals=30))
    nlp = problem.nlp
    rng = np.random.default_rng(5)
    bounds = problem.bounds(2150.0)
    lower, upper = bounds.lbx, bounds.ubx
    x = np.clip(rng.normal(0.9, 0.05, len(lower)), lower, np.maximum(upper, lower))
    p = problem.parameters(2150.0)
    f, g = nlp.problem["f"], nlp.problem["g"]
    lam_g = rng.normal(size=g.numel())
    symbols = nlp.problem["x"], nlp.problem["p"]
    jacobian = ca.Function("j", symbols, [ca.jacobian(g, symbols[0])])(x, p)
    lagrangian = 0.7 * f + ca.dot(ca.DM(lam_g), g)
    hessian = ca.Function("h", symbols, [ca.triu(ca.hessian(lagrangian, symbols[0])[0])])(x, p)
    np.testing.assert_allclose(np.array(nlp.jacobian(x, p)[1]), np.array(jacobian), atol=1e-11)
    np.testing.assert_allclose(np.array(nlp.hessian(x, p, 0.7, lam_g)), np.array(hessian), atol=1e-9)


@pytest.mark.parametrize("limit", [0.2, 0.1])
def test_without_rates_and_inertia_it_is_the_pointwise_optimum(transport, make_model, limit):
    model = make_model(inertia=0.0, blade_loading_limit=limit)
    grid = FlightGrid(transport, model)
    pointwise = grid.fly(
        pointwise_schedule(transport, model, takeoff_mass=2150.0, method="batched"), takeoff_mass=2150.0
    )
    solution = TrajectoryProblem(transport, model, settings=replace(FREE_RATES, ends="free")).solve(2150.0)
    flight = grid.fly(solution.schedule, takeoff_mass=2150.0)
    assert solution.success and flight.success, flight.message
    assert flight.fuel == pytest.approx(pointwise.fuel, rel=2e-4)
    assert flight.max_rotor_speed_rate == np.inf


def test_at_rate_zero_the_schedule_is_constant(transport, make_model):
    still = ScheduleSettings(rotor_speed_rate=0.0, twist_rate=0.0)
    solution = TrajectoryProblem(transport, make_model(), settings=still).solve(2150.0)
    assert solution.success
    np.testing.assert_allclose(solution.schedule.rotor_speed, SETTINGS.nominal_rotor_speed, rtol=1e-7)
    np.testing.assert_allclose(solution.schedule.twist, SETTINGS.nominal_twist, rtol=1e-7)


@pytest.fixture(scope="module")
def solved(search, make_model):
    problem = TrajectoryProblem(search, make_model())
    start = pointwise_schedule(search, make_model(), takeoff_mass=2150.0, method="batched")
    return problem, start, problem.solve(2150.0, start)


def test_search_mission_keeps_rates_and_beats_the_limited_pointwise_schedule(search, make_model, solved):
    _, start, solution = solved
    assert solution.success and solution.iterations <= 60, solution.message
    grid = FlightGrid(search, make_model())
    flight = grid.fly(solution.schedule, takeoff_mass=2150.0)
    limited = grid.fly(rate_limited_schedule(start, grid, takeoff_mass=2150.0), takeoff_mass=2150.0)
    assert flight.success and limited.success, (flight.message, limited.message)
    assert flight.max_rotor_speed_rate <= SETTINGS.rotor_speed_rate * (1 + 1e-6)
    assert flight.max_twist_rate <= SETTINGS.twist_rate * (1 + 1e-6)
    assert flight.fuel <= limited.fuel * (1 + 2e-4)
    assert abs(solution.fuel / flight.fuel - 1) < 1e-4
    assert solution.regularisation < 1e-5 * solution.fuel
    assert np.all(flight.rotor_speed[grid.conditions.idle] == pytest.approx(SETTINGS.nominal_rotor_speed, rel=1e-9))


def test_mass_events_conserve_mass(search, solved):
    _, _, solution = solved
    edge = np.flatnonzero(np.diff(solution.schedule.segment))
    np.testing.assert_allclose(
        solution.mass[edge + 1] - solution.mass[edge], search.mass_changes[1:], rtol=0, atol=1e-9
    )
    assert solution.mass[-1] == pytest.approx(2150.0 - solution.fuel + search.mass_changes.sum(), abs=1e-9)


def test_costate_of_mass_is_the_fuel_that_a_kilogram_costs(solved):
    problem, start, solution = solved
    heavier = problem.solve(2151.0, start)
    assert solution.costates["mass"][0] == pytest.approx(heavier.fuel - solution.fuel, rel=0.02)
    assert solution.costates["mass"][-1] == pytest.approx(0.0, abs=1e-6)


def test_multipliers_are_positive_only_where_a_limit_is_active(search, make_model, solved):
    _, _, solution = solved
    grid = FlightGrid(search, make_model())
    flight = grid.fly(solution.schedule, takeoff_mass=2150.0)
    active = solution.limit_multipliers["blade loading"] > 1e-4
    assert 0.3 < solution.mesh.step[active].sum() / search.duration < 1.0
    for begin, end in zip(solution.mesh.start[active], solution.mesh.end[active], strict=True):
        during = (flight.time > begin - 1.0) & (flight.time < end + 1.0)
        assert flight.limits[0, during].max() > -5e-3
    assert np.all(solution.limit_multipliers["torque"] < 1e-2)


def test_one_variable_alone_saves_less_than_both(transport, make_model):
    fuel = {
        variables: TrajectoryProblem(transport, make_model(), settings=SETTINGS.restricted(variables)).solve(2150.0)
        for variables in ("both", "speed", "twist")
    }
    assert all(solution.success for solution in fuel.values())
    assert fuel["both"].fuel < min(fuel["speed"].fuel, fuel["twist"].fuel)
    np.testing.assert_allclose(fuel["speed"].schedule.twist, SETTINGS.nominal_twist, rtol=1e-9)


def test_periodic_ends_meet_and_need_no_more_fuel_than_pinned_ones(make_profile, make_model):
    profile = make_profile(
        {"task": "cruise", "duration": 200.0, "speed": 50.0}, {"task": "loiter", "duration": 200.0, "speed": 30.0}
    )
    pinned, periodic, free = (
        TrajectoryProblem(profile, make_model(), settings=replace(SETTINGS, ends=ends)).solve(2000.0)
        for ends in ("pinned", "periodic", "free")
    )
    for values in (periodic.schedule.rotor_speed, periodic.schedule.twist):
        assert values[0] == pytest.approx(values[-1], rel=1e-9)
    assert pinned.schedule.rotor_speed[0] == pytest.approx(SETTINGS.nominal_rotor_speed)
    assert free.fuel < periodic.fuel < pinned.fuel


def test_no_solution_is_explained_by_the_limit_the_task_and_the_time(transport, make_model):
    solution = TrajectoryProblem(transport, make_model(torque_limit=3500.0)).solve(2150.0)
    assert not solution.success and not solution.schedule.success
    assert "infeasible; it would take torque 1" in solution.message
    assert " % against 100.0 % at " in solution.message and "(hover; also in climb" in solution.message


def test_pinned_ends_in_the_way_of_a_limit_are_named_by_their_time(make_profile, make_model):
    """Each instant could be flown, but not with the nominal rotor speed the ends ask for: only there it gives way."""
    profile = make_profile({"task": "cruise", "duration": 120.0, "speed": 40.0})
    solution = TrajectoryProblem(profile, make_model(blade_loading_limit=0.066)).solve(2200.0)
    assert not solution.success and solution.status is not Status.CONVERGED
    assert "blade loading 105.8 % against 100.0 % at 0 s (cruise);" in solution.message


def test_take_off_mass_outside_the_model_is_refused(transport, make_model):
    problem = TrajectoryProblem(transport, make_model())
    with pytest.raises(InputError, match="takeoff_mass = 2600 kg: must be 1400 to 2500 kg"):
        problem.solve(2600.0)


def test_mesh_error_adds_up_to_the_difference_in_fuel_and_falls_on_a_finer_mesh(transport, make_model):
    grid = FlightGrid(transport, make_model(), step=0.1)
    largest = []
    for options in (MeshOptions(first_step=60.0), MeshOptions(first_step=2.0)):
        solution = TrajectoryProblem(transport, make_model(), mesh=options).solve(2150.0)
        flight = grid.fly(solution.schedule, takeoff_mass=2150.0)
        error = mesh_error(solution, flight)
        assert error.shape == (len(solution.mesh),)
        assert error.sum() == pytest.approx(resimulation_error(solution, flight) * flight.fuel, abs=1e-6)
        largest.append(np.abs(error).max())
    assert largest[1] < 0.5 * largest[0]


def test_an_added_limit_is_kept_and_named(transport, make_model):
    speed = quantities()["rotor_speed"]
    quiet = Additions((Constraint("tip speed", speed, upper=41.0, unit="rad/s"),))
    model = make_model(blade_loading_limit=0.2)
    solution = TrajectoryProblem(transport, model, additions=quiet).solve(2000.0)
    assert not solution.success and "tip speed" in solution.message  # the first hover begins with the nominal of idle
    profile = build(transport, start=2, stop=5)
    limit = 0.86 * SETTINGS.nominal_rotor_speed
    capped = Additions((Constraint("tip speed", speed, lower=limit, unit="rad/s"),))
    plain, added = (
        TrajectoryProblem(profile, make_model(), additions=additions, settings=FREE_ENDS).solve(2000.0)
        for additions in (None, capped)
    )
    assert plain.schedule.rotor_speed.min() < limit * 0.99
    assert added.success and added.schedule.rotor_speed.min() == pytest.approx(limit, rel=1e-4)
    assert added.limit_multipliers["tip speed"].min() < -1e-3


def build(profile, *, start, stop):
    """Part of a profile, moved to time 0."""
    begin = profile.segments[start].start
    return Profile(tuple(replace(s, start=s.start - begin) for s in profile.segments[start:stop]))


@pytest.mark.parametrize("cost", [None, {"fuel": 1.0, "nox": 30.0}])
def test_multipliers_of_a_limit_add_up_to_what_shifting_it_changes(transport, make_model, cost):
    """Of a usage over the mission, and of a constraint of one's own over one of its tasks, by central differences."""
    speed = Constraint("speed", quantities()["rotor_speed"], lower=43.0, unit="rad/s", tasks=("cruise",))
    problem = TrajectoryProblem(
        build(transport, start=2, stop=5), make_model(), additions=Additions((speed,), cost), settings=FREE_ENDS
    )
    solution = problem.solve(2100.0)
    for name, bound, shift in (("blade loading", 1.0, 1e-3), ("speed", 43.0, 1e-2)):
        lower, upper = (
            problem.solve(2100.0, solution, limits={name: value if bound == 1.0 else (value, None)}).objective
            for value in (bound - shift, bound + shift)
        )
        total = solution.limit_multipliers[name].sum()
        assert abs(total) > 0.1 and total == pytest.approx((lower - upper) / (2 * shift), rel=0.01)
    cruise = solution.mesh.segment == 1
    assert abs(solution.limit_multipliers["speed"][~cruise].sum()) < 1e-3


def test_a_cost_of_ones_own_replaces_the_fuel(transport, make_model):
    profile = build(transport, start=2, stop=5)
    q = quantities()
    same = Additions(cost={"fuel": 7e5})
    fast = Additions(cost=(q["rotor_speed"] - 43.0) ** 2 + 100.0 * (q["twist"] - 0.15) ** 2)
    plain, scaled, tracking = (
        TrajectoryProblem(profile, make_model(), additions=additions, settings=FREE_ENDS).solve(2000.0)
        for additions in (None, same, fast)
    )
    assert scaled.success and tracking.success
    np.testing.assert_allclose(scaled.schedule.rotor_speed, plain.schedule.rotor_speed, rtol=1e-4)
    np.testing.assert_allclose(tracking.schedule.rotor_speed, 43.0, rtol=1e-4)
    assert tracking.fuel > plain.fuel * 1.01


def test_additions_that_can_not_be_used_are_refused(transport, make_model):
    q = quantities()

    def build_with(**additions):
        return TrajectoryProblem(transport, make_model(), additions=Additions(**additions))

    with pytest.raises(InputError, match="quantities: 'nox_flow': must be one of mass"):
        q["nox_flow"]
    with pytest.raises(InputError, match="torque: the aircraft already has a limit"):
        build_with(constraints=(Constraint("torque", q["mass"], upper=1.0),))
    with pytest.raises(InputError, match="must be a single value"):
        build_with(constraints=(Constraint("pair", ca.vertcat(q["mass"], q["twist"]), upper=1.0),))
    with pytest.raises(InputError, match="turbine temperature: the aircraft's model does not offer it"):
        build_with(cost=q["turbine temperature"])
    with pytest.raises(InputError, match="lower and upper = None"):
        Constraint("open", q["mass"])
    with pytest.raises(InputError, match="expression of mass: must be of the symbols"):
        build_with(cost=ca.SX.sym("mass"))
    with pytest.raises(InputError, match="objective: 'soot': weights of fuel, nox, co, co2"):
        build_with(cost={"soot": 1.0})
