"""The whole-mission problem re-solved with other parameters, and its optional constraints, costs and results."""

from dataclasses import replace

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.schedule.additions import Additions, Constraint, quantities
from vrsopt.schedule.bounds import Corridor
from vrsopt.schedule.mesh import MeshOptions
from vrsopt.schedule.nominal import constant_schedule
from vrsopt.schedule.refinement import refined_trajectory
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.trajectory import TrajectoryProblem

FREE = ScheduleSettings(ends="free")


@pytest.fixture(scope="module")
def errand(make_profile):
    """Out fast, back slowly, a hover in between."""
    return make_profile(
        {"task": "transit", "kind": "cruise", "duration": 150.0, "speed": 55.0},
        {"task": "winch", "kind": "hover", "duration": 60.0, "mass_change": 100.0},
        {"task": "loiter", "duration": 150.0, "speed": 30.0},
    )


@pytest.fixture(scope="module")
def solved(errand, make_model):
    problem = TrajectoryProblem(errand, make_model(), settings=FREE)
    return problem, problem.solve(2000.0)


@pytest.mark.parametrize(("transcription", "order"), [("hermite_simpson", 4), ("radau", 5)])
def test_order_of_convergence(make_profile, make_model, transcription, order):
    """Fuel flow proportional to mass: the mass decays exponentially, and the mesh error is known."""
    rate, duration = 6e-5, 9000.0
    profile = make_profile({"task": "cruise", "duration": duration, "speed": 40.0})
    exact = 2450.0 * (1 - np.exp(-rate * duration))
    steps, errors = duration / np.array([1, 2, 4, 8]), []
    for step in steps:
        mesh = MeshOptions(first_step=step, largest_step=step)
        model = make_model(constant_fuel=rate, blade_loading_limit=1.0)
        problem = TrajectoryProblem(profile, model, mesh=mesh, transcription=transcription, ipopt={"tol": 1e-10})
        solution = problem.solve(2450.0)
        errors.append(solution.fuel - exact)
        # at the end of the mission errors of early intervals have lost some of their weight
        assert 0.7 < errors[-1] / solution.mesh_error.sum() <= 1.0
    slope = np.polyfit(np.log(steps), np.log(np.abs(errors)), 1)[0]
    assert slope == pytest.approx(order, abs=0.15)


def test_radau_finds_what_hermite_simpson_finds(errand, make_model, solved):
    radau = TrajectoryProblem(errand, make_model(), settings=FREE, transcription="radau").solve(2000.0)
    grid = FlightGrid(errand, make_model())
    assert radau.success and radau.transcription == "radau"
    fuel = [grid.fly(one.schedule, takeoff_mass=2000.0).fuel for one in (radau, solved[1])]
    assert fuel[0] == pytest.approx(fuel[1], rel=2e-5)


def test_a_point_of_its_own_for_every_evaluation_changes_nothing(errand, make_model, solved):
    problem = TrajectoryProblem(errand, make_model(), settings=FREE, shared=False)
    assert len(problem.points.time) == 3 * len(problem.mesh) > len(solved[0].points.time)
    assert problem.solve(2000.0).fuel == pytest.approx(solved[1].fuel, rel=1e-9)
    mass, rotor_speed, twist, _ = problem.inputs(solved[1].x, 2000.0)
    at = problem.points.segment, problem.points.time
    np.testing.assert_allclose(np.array([rotor_speed, twist]), solved[1].schedule.at(*at), rtol=1e-12)
    assert mass[0] == 2000.0 and mass[-1] == pytest.approx(solved[1].mass[-1])


def test_changed_parameters_need_no_new_problem(errand, make_model, solved):
    problem, _ = solved
    slow = replace(FREE, rotor_speed_rate=0.004 * 44.4, ends="pinned", twist_bounds=(0.11, 0.2))
    again = problem.solve(1900.0, settings=slow, limits={"engine power": 0.9})
    fresh = TrajectoryProblem(errand, make_model(power_limit=0.9 * 257e3), settings=slow, mesh=problem.mesh).solve(
        1900.0
    )
    assert again.success and again.fuel == pytest.approx(fresh.fuel, rel=1e-6)
    np.testing.assert_allclose(again.schedule.rotor_speed, fresh.schedule.rotor_speed, rtol=1e-3)


@pytest.mark.parametrize("factor", [0.7, 1.3])
def test_a_warm_start_after_a_changed_rate_limit_pays(solved, factor):
    problem, cold = solved
    changed = replace(FREE, rotor_speed_rate=factor * FREE.rotor_speed_rate)
    first, warm = problem.solve(2000.0, settings=changed), problem.solve(2000.0, cold, settings=changed)
    assert warm.success and warm.iterations <= 0.7 * first.iterations
    assert warm.fuel == pytest.approx(first.fuel, rel=1e-5)
    assert problem.solve(2000.0, cold).iterations <= 5


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"twist_rate": None}, "twist_rate = None: the problem was built with"),
        ({"rotor_speed_acceleration": 0.1}, "rotor_speed_acceleration = 0.1"),
        ({"spin_down_credit": False}, "spin_down_credit = False"),
        ({"ends": "periodic"}, "ends = periodic: the problem was built with free"),
    ],
)
def test_what_changes_the_structure_is_refused(solved, changes, message):
    with pytest.raises(InputError, match=message):
        solved[0].solve(2000.0, settings=replace(FREE, **changes))


def test_what_can_not_be_bounded_is_refused(solved, errand, make_model):
    problem, _ = solved
    with pytest.raises(InputError, match="limits = noise: must be of blade loading, engine power, torque"):
        problem.solve(2000.0, limits={"noise": 1.0})
    count = len(problem.nodes.time)
    with pytest.raises(InputError, match=r"corridor of the rotor speed at 0 s \(transit\): lower is above upper"):
        problem.solve(2000.0, corridor=Corridor(rotor_speed=(np.full(count, 45.0), np.full(count, 44.0))))
    with pytest.raises(InputError, match="transcription = euler: must be hermite_simpson or radau"):
        TrajectoryProblem(errand, make_model(), transcription="euler")


def test_costates_are_derivatives_of_the_fuel(solved):
    problem, _ = solved
    count, fuel = len(problem.nodes.time), []
    for start in (43.0, 43.05):
        corridor = Corridor(rotor_speed=(np.full(count, 30.0), np.full(count, 55.0)))
        corridor.rotor_speed[0][0] = corridor.rotor_speed[1][0] = start
        held = problem.solve(2000.0, corridor=corridor)
        fuel.append(held.fuel)
    slope = (fuel[1] - fuel[0]) / 0.05
    assert held.bound_multipliers["rotor_speed"][0] == pytest.approx(-slope, rel=0.1)
    assert 0.5 * slope < held.costates["rotor_speed"][0] < slope  # at the end of the first interval, 2 s later


def test_limits_give_way_at_the_price_of_their_multipliers(solved):
    problem, tight = solved
    loose = problem.solve(2000.0, limits={"blade loading": 1.001})
    expected = sum(tight.lam_g[row] * 100.0 * 0.001 for row in problem.rows.where("limit", "blade loading"))
    assert expected > 0.0 and tight.fuel - loose.fuel == pytest.approx(expected, rel=0.1)


def test_arcs_follow_one_another_and_name_what_is_active(solved, errand):
    _, solution = solved
    arcs = solution.arcs
    assert arcs[0].start == 0.0 and arcs[-1].end == pytest.approx(errand.duration)
    assert all(one.end == pytest.approx(two.start) for one, two in zip(arcs[:-1], arcs[1:], strict=True))
    active = {name for arc in arcs for name in arc.active}
    assert "blade loading" in active and {arc.task for arc in arcs} == {"transit", "winch", "loiter"}
    for arc in arcs:  # a rate on its limit moves the rotor by as much as it may
        if "rotor speed rate at upper bound" in arc.active:
            inside = (solution.schedule.time >= arc.start - 1e-6) & (solution.schedule.time <= arc.end + 1e-6)
            inside &= np.isin(solution.schedule.segment, [k for k in range(3) if errand.segments[k].task == arc.task])
            moved = np.ptp(solution.schedule.rotor_speed[inside])
            assert moved == pytest.approx(FREE.rotor_speed_rate * (arc.end - arc.start), rel=1e-3)


def test_accelerations_are_kept_from_rest_to_rest(errand, make_model):
    limit = 0.01  # rad/s3
    settings = ScheduleSettings(rotor_speed_acceleration=limit, twist_acceleration=0.005)
    problem = TrajectoryProblem(errand, make_model(), settings=settings)
    solution = problem.solve(2000.0)
    free = TrajectoryProblem(errand, make_model()).solve(2000.0)
    mesh, nodes = solution.mesh, solution.schedule
    change = {}
    for one in (solution, free):
        rate = (one.schedule.at(mesh.segment, mesh.end)[0] - one.schedule.at(mesh.segment, mesh.start)[0]) / mesh.step
        change[one.fuel] = np.abs(np.diff(rate)) / (0.5 * (mesh.step[1:] + mesh.step[:-1]))
        last = abs(rate[0]) / (0.5 * mesh.step[0])
    assert solution.success and solution.fuel > free.fuel and len(nodes.time)
    assert change[solution.fuel].max() <= limit * (1 + 1e-6) < change[free.fuel].max()
    assert problem.solve(2000.0, settings=replace(settings, rotor_speed_acceleration=0.1)).fuel < solution.fuel
    assert last > 0.0


def test_without_credit_what_slows_the_rotor_down_is_lost(errand, make_model):
    credit, lost = (
        TrajectoryProblem(errand, make_model(), settings=replace(FREE, spin_down_credit=on)).solve(2000.0)
        for on in (True, False)
    )
    assert lost.success and lost.fuel > credit.fuel
    problem = TrajectoryProblem(errand, make_model(), settings=replace(FREE, spin_down_credit=False))
    rate, charged = (lost.x[problem.columns.where(family)] for family in ("rotor speed rate", "charged rate"))
    assert rate.min() < -0.01  # ten times what the charged rate may be off
    np.testing.assert_allclose(charged, np.maximum(rate, 0.0), atol=1e-3)


def test_an_own_constraint_holds_in_its_tasks_and_gives_way_when_told(errand, make_model):
    q = quantities()
    slow = Constraint("slow rotor", q["rotor_speed"], upper=41.0, unit="rad/s", tasks=("loiter",))
    power = Constraint("power", q["power_per_engine"], upper=240e3, unit="W")
    problem = TrajectoryProblem(errand, make_model(), settings=FREE, additions=Additions((slow, power)))
    solution = problem.solve(1800.0, settings=replace(FREE, rotor_speed_bounds=(40.5, 51.0)))
    assert solution.success, solution.message
    inside = solution.schedule.segment == 2
    assert solution.schedule.rotor_speed[inside].max() <= 41.0 * (1 + 1e-6)
    row = problem.rows[int(problem.rows.where("own", "power")[0])]
    assert row.kind.unit == "W" and row.kind.scale == 240e3
    raised = problem.solve(1800.0, limits={"slow rotor": (42.0, 43.0)})
    assert raised.schedule.rotor_speed[inside].min() >= 42.0 * (1 - 1e-6)


def test_fuel_and_emissions_are_weighed_and_bounded(errand, make_model):
    """The least-NOx schedule, and least fuel with NOx bounded half-way to it."""
    q = quantities()
    both = Additions(integrals=(Constraint("mission nox", q["nox"], upper=1.0, unit="kg"),))
    problem = TrajectoryProblem(errand, make_model(), settings=FREE, ipopt={"tol": 1e-9}, additions=both)
    fuel = problem.solve(2000.0)
    cost = Additions(cost={"nox": 1.0})
    clean = TrajectoryProblem(errand, make_model(), settings=FREE, ipopt={"tol": 1e-9}, additions=cost).solve(2000.0)
    assert clean.success and clean.objective < fuel.integrals["mission nox"] and clean.fuel > fuel.fuel
    middle = 0.5 * (clean.objective + fuel.integrals["mission nox"])
    bounded = problem.solve(2000.0, fuel, limits={"mission nox": (None, middle)})
    assert bounded.success and bounded.integrals["mission nox"] == pytest.approx(middle, rel=1e-6)
    assert fuel.fuel < bounded.fuel < clean.fuel
    assert fuel.integral_multipliers["mission nox"] == pytest.approx(0.0, abs=1e-6)
    assert bounded.integral_multipliers["mission nox"] > 1e-3
    weighed = Additions(cost={"fuel": 1.0, "nox": bounded.integral_multipliers["mission nox"]})
    same = TrajectoryProblem(errand, make_model(), settings=FREE, ipopt={"tol": 1e-9}, additions=weighed).solve(2000.0)
    assert same.fuel == pytest.approx(bounded.fuel, rel=1e-5)  # the multiplier is the price of the emission


def test_at_rate_zero_and_free_ends_it_is_the_best_constant_schedule(errand, make_model):
    still = replace(FREE, rotor_speed_rate=0.0, twist_rate=0.0)
    solution = TrajectoryProblem(errand, make_model(), settings=still).solve(2000.0)
    grid = FlightGrid(errand, make_model())
    assert solution.success and np.ptp(solution.schedule.rotor_speed) < 1e-6
    found = solution.schedule.rotor_speed[0], solution.schedule.twist[0]
    best = grid.fly(solution.schedule, takeoff_mass=2000.0)
    for change in ((0.1, 0.0), (-0.1, 0.0), (0.0, 0.003), (0.0, -0.003)):
        values = {"rotor_speed": found[0] + change[0], "twist": found[1] + change[1]}
        other = grid.fly(constant_schedule(errand, **values), takeoff_mass=2000.0)
        assert other.fuel > best.fuel or not other.success


def test_a_coarse_mesh_is_refined(errand, make_model, solved):
    coarse = MeshOptions(first_step=40.0, largest_step=60.0)
    grid = FlightGrid(errand, make_model(), step=0.5)
    before = TrajectoryProblem(errand, make_model(), settings=FREE, mesh=coarse).solve(2000.0)
    after = refined_trajectory(grid, make_model(), takeoff_mass=2000.0, settings=FREE, mesh=coarse)
    fuel = [grid.fly(one.schedule, takeoff_mass=2000.0).fuel for one in (before, after, solved[1])]
    assert after.success and after.rounds > 1 and len(after.mesh) > len(before.mesh)
    assert fuel[0] - fuel[1] > 0.2 * (fuel[0] - fuel[2]) > 0.0


def test_halving_the_mesh_does_not_change_the_fuel(errand, make_model, solved):
    problem, solution = solved
    mesh = problem.mesh
    halved = mesh.split(np.arange(len(mesh)), mesh.start + 0.5 * mesh.step)
    finer = problem.on(halved).solve(2000.0)
    grid = FlightGrid(errand, make_model(), step=0.25)
    fuel = [grid.fly(one.schedule, takeoff_mass=2000.0).fuel for one in (solution, finer)]
    assert finer.success and fuel[1] == pytest.approx(fuel[0], rel=5e-5)


def test_a_cost_that_is_nothing_at_the_start_and_a_start_with_another_cost(errand, make_model, solved):
    still = Additions(cost=(quantities()["rotor_speed"] - 44.4) ** 2)
    problem = TrajectoryProblem(errand, make_model(), settings=FREE, additions=still)
    first = problem.solve(1800.0, solved[1])  # the fuel's multipliers are not this cost's
    assert first.success and first.cost_factor > 0.0
    np.testing.assert_allclose(first.schedule.rotor_speed, 44.4, atol=0.02)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"upper": float("nan")}, "constraint c: upper = nan: must be a number or None"),
        ({"upper": "50"}, "upper = '50': must be a number"),
        ({"upper": 1.0, "tasks": "cruise"}, "tasks = 'cruise': must be names of tasks"),
        ({"upper": 1.0, "tasks": ()}, r"tasks = \(\): must be names of tasks"),
        ({"upper": 1.0, "unit": None}, "name and unit = 'c', None: must be words"),
        ({"upper": 1.0, "expression": "mass"}, "c = str: must be a CasADi SX expression"),
    ],
)
def test_constraints_that_make_no_sense_are_refused_at_once(changes, message):
    with pytest.raises(InputError, match=message):
        Constraint(**{"name": "c", "expression": quantities()["mass"], **changes})


def test_numbers_that_make_no_sense_are_refused(solved, errand, make_model):
    for value in (float("nan"), -1.0, True, "x"):
        with pytest.raises(InputError, match="limits engine power = .*: must be a number above 0"):
            solved[0].solve(2000.0, limits={"engine power": value})
    for weights in ({"fuel": float("nan")}, {"fuel": 0.0}, {"fuel": None}):
        with pytest.raises(InputError, match="weights must be numbers, not all zero"):
            TrajectoryProblem(errand, make_model(), additions=Additions(cost=weights))
    with pytest.raises(InputError, match="trajectory: ipopt = .*foo"):
        TrajectoryProblem(errand, make_model(), ipopt={"foo": 1})
