"""Fronts of fuel against NOx, of an aircraft whose NOx falls with the rotor speed and one whose NOx goes with fuel."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.schedule.conftest import Aircraft, AnalyticModel, maker
from tests.schedule.smooth_profiles import jumping_profile
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.tradeoff import step_front, step_fronts, trajectory_front

MASS = 1900.0  # kg
SETTINGS = ScheduleSettings()


class Conflict(AnalyticModel):
    """NOx that falls with the rotor speed: least where the rotor is fastest, where fuel is not."""

    def emissions(self, fuel_flow: Any, power_per_engine: Any, rotor_speed: Any) -> dict[str, Any]:
        nox = 1e-4 * (44.4 / rotor_speed) ** 3 + 0.0 * fuel_flow
        return {**super().emissions(fuel_flow, power_per_engine, rotor_speed), "nox": nox}

    def nodes(self, index: np.ndarray) -> Conflict:
        return Conflict(self.aircraft, self.coefficients[:, index])


def make(conditions: Any) -> Conflict:
    return Conflict(Aircraft(), maker()(conditions).coefficients)


@pytest.fixture(scope="module")
def grid() -> FlightGrid:
    tasks = ("cruise", 50.0, 120.0), ("loiter", 30.0, 60.0)
    profile = jumping_profile(*({"task": task, "speed": speed, "duration": last} for task, speed, last in tasks))
    return FlightGrid(profile, make)


def test_steps_give_a_front_and_more_nox_saved_costs_more_fuel(grid):
    fronts = step_fronts(grid, make, takeoff_mass=MASS, settings=SETTINGS, generations=25)
    for front in fronts.points:
        order = np.argsort(front[:, 2])
        assert np.all(np.diff(front[order, 3]) <= 0.0)  # none is better in both
    found = step_front(fronts, grid, takeoff_mass=MASS, settings=SETTINGS)
    fuel, nox = np.array([(point.fuel, point.nox) for point in found]).T
    assert np.all(np.diff(fuel) >= -1e-6) and np.all(np.diff(nox) <= 1e-9)
    assert nox[-1] < 0.95 * nox[0] and fuel[-1] > fuel[0]


def test_trajectories_keep_the_bound_and_its_multiplier_is_the_slope(grid):
    found = trajectory_front(grid, make, takeoff_mass=MASS, settings=SETTINGS, points=7)
    fuel, nox, price = np.array([(point.fuel, point.nox, point.price) for point in found]).T
    assert all(point.success for point in found)
    assert np.diff(nox) == pytest.approx(np.full(6, (nox[-1] - nox[0]) / 6), rel=0.02)
    slopes = -np.diff(fuel) / np.diff(nox)
    assert np.all(np.diff(slopes) > 0.0)  # a convex front
    between = slopes[:-1] < price[1:-1]
    assert np.all(between) and np.all(price[1:-1] < slopes[1:])


def test_without_conflict_there_is_one_point(grid):
    """NOx of the analytic aircraft goes with fuel times power: least fuel is least NOx."""
    plain = FlightGrid(grid.profile, maker())
    found = trajectory_front(plain, maker(), takeoff_mass=MASS, settings=SETTINGS, points=3)
    assert found[-1].nox == pytest.approx(found[0].nox, rel=1e-3)
    assert found[-1].fuel == pytest.approx(found[0].fuel, rel=1e-3)
