"""Decision nodes: few where a mission goes on smoothly, as many as it takes to keep the limits in between."""

import numpy as np
import pytest

from tests.schedule.smooth_profiles import SmoothFlight, rescue, surveillance
from vrsopt.errors import InputError
from vrsopt.schedule.decision import GROUND, decision_nodes
from vrsopt.schedule.limiter import rate_limited_schedule
from vrsopt.schedule.pointwise import pointwise_schedule
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.trajectory import TrajectoryProblem


def test_an_edge_without_a_jump_needs_one_search_and_idle_none():
    flight = SmoothFlight().hold("idle", 60.0).hold("hover", 30.0).hold("hover", 30.0)
    profile = flight.hold("hover", 30.0, mass_change=100.0).profile()
    nodes = decision_nodes(profile, 60.0)
    assert nodes.segment.tolist() == [0, 0, 1, 1, 2, 2, 3, 3]
    assert nodes.search.tolist() == [GROUND, GROUND, 0, 1, 1, 2, 3, 4]  # the load changes the mass at 120 s
    assert nodes.first.tolist() == [2, 3, 5, 6, 7]
    assert nodes.conditions().time.tolist() == [60.0, 90.0, 120.0, 120.0, 150.0]
    assert nodes.spread(np.arange(5.0), -7.0).tolist() == [-7.0, -7.0, 0.0, 1.0, 1.0, 2.0, 3.0, 4.0]


def test_ground_idle_is_left_alone_as_idle_is(make_model):
    flight = SmoothFlight().hold("ground_idle", 30.0).hold("hover", 60.0).hold("ground_idle", 30.0)
    profile, nominal = flight.hold("idle", 30.0).profile(), ScheduleSettings()
    grid = FlightGrid(profile, make_model())
    pointwise = pointwise_schedule(profile, make_model(), takeoff_mass=1900.0, method="batched", grid=grid)
    assert pointwise.details["nodes"] == 2
    for schedule in (
        pointwise,
        rate_limited_schedule(pointwise, grid, takeoff_mass=1900.0),
        TrajectoryProblem(profile, make_model()).solve(1900.0).schedule,
    ):
        still = schedule.segment != 1
        np.testing.assert_allclose(schedule.rotor_speed[still], nominal.nominal_rotor_speed, rtol=1e-9)
        np.testing.assert_allclose(schedule.twist[still], nominal.nominal_twist, rtol=1e-9)
        assert schedule.rotor_speed[~still].min() < 0.98 * nominal.nominal_rotor_speed


def test_a_roll_has_its_edges_only_and_a_change_of_speed_more():
    flight = SmoothFlight().hold("cruise", 90.0).change("cruise", 40.0, speed=40.0).hold("cruise", 20.0)
    profile = flight.turn("cruise", 24.0).hold("cruise", 20.0).profile()
    nodes = decision_nodes(profile, 60.0)
    assert np.bincount(nodes.segment).tolist() == [3, 8, 2, 2, 2, 2, 2]
    more = nodes.with_nodes(np.array([3]), np.array([151.0]))
    assert np.bincount(more.segment).tolist() == [3, 8, 2, 3, 2, 2, 2]
    assert len(more.first) == len(nodes.first) + 1 and np.all(np.diff(more.time) >= 0.0)


@pytest.mark.parametrize("profile", [surveillance(46), rescue()], ids=["surveillance", "rescue"])
def test_whole_missions_stay_affordable(profile):
    nodes = decision_nodes(profile, 60.0)
    assert len(profile.segments) < len(nodes.first) < 300
    assert np.all(nodes.search[np.isin(nodes.segment, np.flatnonzero(nodes.shape.idle))] == GROUND)


def test_values_on_the_fine_grid_are_found_at_the_searches(make_model):
    profile = surveillance(1)
    grid, nodes = FlightGrid(profile, make_model()), decision_nodes(profile, 60.0)
    found = nodes.interpolated(grid, grid.time + 1000.0 * grid.segment)
    np.testing.assert_allclose(found, nodes.time[nodes.first] + 1000.0 * nodes.segment[nodes.first])


def test_limits_broken_between_nodes_get_a_node(make_model):
    """A sharp turn rolled into in six seconds: the load factor is not linear in time."""
    flight = SmoothFlight(100.0).change("cruise", 30.0, speed=40.0).turn("loiter", 30.0, load_factor=1.3, roll=6.0)
    profile, model = flight.hold("cruise", 60.0).profile(), make_model(blade_loading_limit=0.08, torque_limit=1e9)
    grid = FlightGrid(profile, model)
    settings = {"takeoff_mass": 1800.0, "method": "batched", "grid": grid}
    schedule = pointwise_schedule(profile, model, **settings)
    flown = grid.fly(schedule, takeoff_mass=1800.0)
    assert flown.success, flown.message
    assert schedule.details["nodes"] > len(decision_nodes(profile, 60.0).first)
    rolls = np.isin(schedule.segment, [1, 3])
    assert rolls.sum() > 4


def test_a_schedule_is_continuous_where_the_mission_is(make_model):
    profile = surveillance(2)
    schedule = pointwise_schedule(profile, make_model(), takeoff_mass=1900.0, method="batched")
    edges = np.flatnonzero(np.diff(schedule.segment))
    jumps = np.abs(np.diff(schedule.rotor_speed)[edges]) > 0.0
    assert jumps.sum() == 2  # between idle and hover only
    assert set(schedule.segment[edges[jumps]]) == {0, len(profile.segments) - 2}


def test_steps_and_profiles_that_can_not_be_used_are_refused(make_model):
    idle = SmoothFlight().hold("idle", 60.0).profile()
    with pytest.raises(InputError, match="only idle"):
        decision_nodes(idle, 60.0)
    with pytest.raises(InputError, match="decision_step = -1.0"):
        decision_nodes(surveillance(1), -1.0)
