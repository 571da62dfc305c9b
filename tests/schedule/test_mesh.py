"""Meshes of missions that jump and of missions that go on smoothly."""

from pathlib import Path

import numpy as np
import pytest

from tests.schedule.smooth_profiles import SmoothFlight, rescue, surveillance
from vrsopt.errors import InputError
from vrsopt.mission.file import read_mission
from vrsopt.mission.profile import Profile
from vrsopt.schedule.decision import decision_nodes
from vrsopt.schedule.mesh import Grading, Mesh, MeshOptions, graded_steps, make_mesh
from vrsopt.schedule.refinement import broken_intervals, refined_trajectory
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.resolution import resolution_loss
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.smoothness import smoothness
from vrsopt.schedule.trajectory import TrajectoryProblem

PROBLEMS = Path(__file__).parents[2] / "problems"


def complete(mesh, profile):
    """Contiguous, with every edge of the profile."""
    np.testing.assert_allclose(mesh.end[:-1], mesh.start[1:], rtol=0, atol=1e-9)
    assert mesh.end[-1] == pytest.approx(profile.duration, abs=1e-9)
    assert set(np.round(profile.edges[:-1], 6)) <= set(np.round(mesh.start, 6))
    for s, segment in enumerate(profile.segments):
        assert mesh.step[mesh.segment == s].sum() == pytest.approx(segment.duration, rel=1e-12)
    return mesh


def test_mesh_has_small_steps_where_conditions_jump(search):
    mesh = complete(make_mesh(search), search)
    assert 200 <= len(mesh) <= 600
    idle = np.array([segment.kind == "idle" for segment in search.segments])
    flying = ~idle[mesh.segment]
    assert np.all(np.bincount(mesh.segment)[idle] == 1)  # nothing is decided there
    assert mesh.step[flying].max() <= 60.0
    first = np.append(True, np.diff(mesh.segment) != 0)
    assert mesh.step[first & flying].max() < 4.0
    growth = mesh.step[1:] / mesh.step[:-1]
    assert growth[(np.diff(mesh.segment) == 0) & flying[1:]].max() <= 2.5


def test_a_roll_has_two_intervals_and_a_short_one_on_either_side():
    profile = surveillance(46)
    mesh = complete(make_mesh(profile), profile)
    assert len(mesh) <= 600
    count = np.bincount(mesh.segment)
    durations = np.diff(profile.edges)
    rolls = np.array([s.task == "loiter" for s in profile.segments]) & (durations == 3.0)
    assert rolls.sum() == 92 and np.all(count[rolls] == 2)
    inner = np.flatnonzero(rolls)[2]
    beside = mesh.step[mesh.segment == inner + 1]
    assert beside[0] == beside[-1] == 1.0 and len(beside) == 3
    slower = make_mesh(profile, settings=ScheduleSettings(rotor_speed_rate=0.005 * 44.4))
    # 10 % of load factor are 4.8 % of rotor speed: 9.5 s at half a per cent per second, of which the roll takes 3
    reach = 1.1 * 0.5 * (0.5 * np.log(1.1) / 0.005 - 3.0)
    assert slower.step[slower.segment == inner + 1][0] == pytest.approx(reach, rel=0.01)


def test_a_change_of_speed_has_several_intervals_and_a_continued_flight_no_small_steps():
    profile = SmoothFlight().hold("cruise", 60.0).change("cruise", 40.0, speed=40.0).hold("cruise", 200.0)
    profile = profile.hold("cruise", 200.0).profile()
    shape = smoothness(profile)
    assert shape.jumps.tolist() == [True, False, False, False, True]
    assert shape.held.tolist() == [True, False, True, True]
    mesh = complete(make_mesh(profile), profile)
    assert np.bincount(mesh.segment)[1] >= 7
    assert mesh.step[mesh.segment == 3][0] > 30.0 and mesh.step[mesh.segment == 3][-1] < 3.0


def test_mass_idle_and_conditions_make_jumps():
    flight = SmoothFlight().hold("idle", 30.0).hold("hover", 30.0).hold("hover", 30.0, mass_change=100.0)
    shape = smoothness(flight.hold("hover", 30.0).profile())
    assert shape.jumps.tolist() == [True, True, True, False, True]
    assert shape.idle.tolist() == [True, False, False, False] and np.all(shape.held)


def test_steps_grow_from_the_graded_ends():
    steps = graded_steps(600.0, largest=60.0, gradings=(Grading(2.0, 2.0), None))
    assert steps.sum() == pytest.approx(600.0)
    assert steps[0] == 2.0 and np.all(np.diff(steps) > -1e-9)
    assert np.ptp(graded_steps(600.0, largest=60.0, gradings=(None, None))) < 1e-9
    assert len(graded_steps(3.0, largest=60.0, gradings=(None, None))) == 1
    both = graded_steps(37.5, largest=60.0, gradings=(Grading(1.0, 50.0), Grading(1.5, 50.0)))
    np.testing.assert_allclose(both, [1.0, 35.0, 1.5])
    for options in ({"growth": 1.0}, {"first_step": 0.0}, {"first_step": 90.0}):
        with pytest.raises(InputError, match=next(iter(options))):
            MeshOptions(**options)


def test_few_intervals_are_respected_but_changes_resolved():
    profile = rescue()
    few, fewer = (complete(make_mesh(profile, MeshOptions(most_intervals=most)), profile) for most in (450, 10))
    assert len(fewer) < len(few) <= 450
    shape = smoothness(profile)
    pieces = np.maximum(np.where(shape.rolls, 2, np.ceil(2.0 * shape.changes)), 1.0)
    assert np.all(np.bincount(fewer.segment) >= pieces) and len(fewer) < 1.5 * pieces.sum()


def test_splitting_adds_edges_and_nothing_else():
    mesh = Mesh(np.array([0, 0, 1]), np.array([0.0, 10.0, 30.0]), np.array([10.0, 20.0, 5.0]))
    finer = mesh.split(np.array([1, 2]), np.array([14.0, 33.0]))
    assert finer.segment.tolist() == [0, 0, 0, 1, 1]
    assert finer.start.tolist() == [0.0, 10.0, 14.0, 30.0, 33.0]
    assert finer.step.tolist() == [10.0, 4.0, 16.0, 3.0, 2.0]
    assert mesh.end.tolist() == [10.0, 30.0, 35.0]


@pytest.fixture(scope="module")
def turns():
    return surveillance(4)


def test_default_mesh_is_as_good_as_a_fine_one(turns, make_model):
    grid = FlightGrid(turns, make_model())
    fuel = []
    for options in (None, MeshOptions(first_step=0.8, growth=1.2, largest_step=4.0, most_intervals=5000)):
        solution = TrajectoryProblem(turns, make_model(), mesh=options).solve(1900.0)
        flight = grid.fly(solution.schedule, takeoff_mass=1900.0)
        assert solution.success and abs(solution.fuel / flight.fuel - 1.0) < 5e-5
        fuel.append(flight.fuel)
    assert fuel[0] == pytest.approx(fuel[1], rel=5e-5)


def test_slow_actuators_split_the_mesh_by_as_much_as_they_lose(turns, make_model):
    """Between turns a slow rotor dips as far as its rate lets it, which one straight piece can not."""
    model, slow = make_model(blade_loading_limit=0.07), ScheduleSettings(rotor_speed_rate=0.001 * 44.4)
    grid = FlightGrid(turns, model, settings=slow)
    fine = MeshOptions(first_step=0.8, growth=1.2, largest_step=4.0, most_intervals=5000)
    coarse, best = (TrajectoryProblem(turns, model, settings=slow, mesh=mesh) for mesh in (None, fine))
    found = coarse.solve(1900.0)
    flown, least = (grid.fly(t.schedule, takeoff_mass=1900.0).fuel for t in (found, best.solve(1900.0)))
    assert flown > least * (1.0 + 1e-4)
    assert resolution_loss(coarse, found, coarse.bounds(1900.0)).sum() == pytest.approx(flown - least, rel=0.4)
    refined = refined_trajectory(grid, model, takeoff_mass=1900.0, settings=slow)
    assert len(refined.mesh) < 0.7 * len(best.mesh)
    assert grid.fly(refined.schedule, takeoff_mass=1900.0).fuel == pytest.approx(least, rel=3e-5)


def test_a_limit_broken_between_nodes_splits_the_mesh(turns, make_model):
    """Load factor in a roll goes faster than linear toward its end: a rotor speed linear in time falls behind."""
    edges = np.asarray(turns.edges)
    coarse = Mesh(np.arange(len(edges) - 1), edges[:-1], np.diff(edges))
    quick, model = ScheduleSettings(rotor_speed_rate=0.05 * 44.4), make_model(blade_loading_limit=0.08)
    grid = FlightGrid(turns, model, step=0.25)
    flight = grid.fly(
        TrajectoryProblem(turns, model, settings=quick, mesh=coarse).solve(1900.0).schedule, takeoff_mass=1900.0
    )
    intervals, times = broken_intervals(coarse, flight, flight.limits)
    assert not flight.success and len(intervals) > 0
    assert np.all((times > coarse.start[intervals]) & (times < coarse.end[intervals]))
    solution = refined_trajectory(grid, model, takeoff_mass=1900.0, settings=quick, mesh=coarse)
    flight = grid.fly(solution.schedule, takeoff_mass=1900.0)
    assert solution.success and flight.success, flight.message
    assert 1 < solution.rounds <= 5 and len(coarse) < len(solution.mesh) < 300


@pytest.mark.parametrize("name", ["sarm", "lem", "patm"])
def test_the_shipped_missions_stay_affordable(name):
    profile = Profile.of(read_mission(PROBLEMS / f"{name}.toml"))
    assert len(complete(make_mesh(profile), profile)) <= 600
    assert len(decision_nodes(profile, 60.0).first) <= 300
