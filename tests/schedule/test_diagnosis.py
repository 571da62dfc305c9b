"""Problems without a solution, each explained by what has to give way, where and when."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.mission.profile import Profile
from vrsopt.schedule.additions import Additions, Constraint, quantities
from vrsopt.schedule.bands import ForbiddenBand
from vrsopt.schedule.bounds import Corridor
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.trajectory import TrajectoryProblem
from vrsopt.solvers.status import Status

MASS = 2150.0  # kg
CLIMB = np.radians(7.12)
SETTINGS = ScheduleSettings()
NOMINAL = SETTINGS.nominal_rotor_speed
FOUND = re.compile(r"infeasible; it would take (.+?); IPOPT .+, largest residual \S+ \(.+\)$")


@pytest.fixture(scope="module")
def flight(make_profile: Callable[..., Profile]) -> Profile:
    """Idle, hover, climb, cruise, descent and landing."""
    return make_profile(
        {"task": "idle", "duration": 30.0},
        {"task": "hover", "duration": 10.0},
        {"task": "climb", "duration": 40.0, "speed": 40.0, "climb": CLIMB},
        {"task": "cruise", "duration": 90.0, "speed": 55.0},
        {"task": "descent", "duration": 40.0, "speed": 40.0, "climb": -CLIMB},
        {"task": "landing", "kind": "hover", "duration": 20.0},
    )


@pytest.fixture(scope="module")
def turn(make_profile: Callable[..., Profile]) -> Callable[..., Profile]:
    """A turn that asks for a fast rotor, after a hover of some seconds."""

    def make(*before: dict[str, Any]) -> Profile:
        hard = {"task": "turn", "kind": "cruise", "duration": 40.0, "speed": 40.0, "load": 1.25}
        return make_profile(*before, hard, {"task": "landing", "kind": "hover", "duration": 30.0})

    return make


def explained(problem: TrajectoryProblem, **options: Any) -> str:
    """What ``problem`` says has to give way."""
    trajectory = problem.solve(MASS, **options)
    assert not trajectory.success and trajectory.status is Status.INFEASIBLE
    assert not trajectory.schedule.success and trajectory.schedule.message == trajectory.message
    found = FOUND.match(trajectory.message)
    assert found, trajectory.message
    return found[1]


def test_power_rating_too_small_for_the_climb(make_profile, make_model):
    """The relaxation that is named is enough, and nothing less is."""
    profile = make_profile(
        {"task": "hover", "duration": 20.0},
        {"task": "climb", "duration": 40.0, "speed": 40.0, "climb": 0.4},
        {"task": "cruise", "duration": 60.0, "speed": 40.0},
    )
    problem = TrajectoryProblem(profile, make_model(power_limit=257e3, torque_limit=9e3))
    named = re.fullmatch(r"engine power (1\d\d\.\d) % against 100\.0 % at \d+ s \(climb\)", explained(problem))
    needed = float(named[1]) / 100.0
    assert problem.solve(MASS, limits={"engine power": 1.001 * needed}).success
    assert not problem.solve(MASS, limits={"engine power": 0.999 * needed}).success


def test_rate_too_slow_between_idle_and_a_turn(turn, make_model):
    profile = turn({"task": "idle", "duration": 30.0}, {"task": "hover", "duration": 10.0})
    settings = replace(SETTINGS, rotor_speed_rate=0.006 * NOMINAL)
    named = explained(TrajectoryProblem(profile, make_model(blade_loading_limit=0.0745), settings=settings))
    assert re.fullmatch(r"rotor speed rate 0\.69\d+ %/s against 0\.6000 %/s at 3\d s \(hover\)", named)


def test_acceleration_too_small_for_a_turn(turn, make_model):
    settings = replace(SETTINGS, rotor_speed_acceleration=0.00032 * NOMINAL)
    profile = turn({"task": "hover", "duration": 20.0})
    named = explained(TrajectoryProblem(profile, make_model(blade_loading_limit=0.0745), settings=settings))
    assert re.match(r"rotor speed acceleration 0\.03\d+ %/s2 against 0\.03200 %/s2 at \d+ s \(hover\)", named)


def test_own_constraint_against_a_limit(flight, make_model):
    slow = Constraint("tip speed", 4.912 * quantities()["rotor_speed"], upper=180.0, unit="m/s", tasks=("cruise",))
    problem = TrajectoryProblem(flight, make_model(blade_loading_limit=0.09), additions=Additions((slow,)))
    named = explained(problem)
    assert re.fullmatch(r"tip speed 191\.\d m/s against 180\.0 m/s at \d+ s \(cruise\)", named)


def test_lower_bound_of_an_own_constraint_too_high(flight, make_model):
    power = quantities()["power_per_engine"] / 1e3
    reserve = Constraint("least power", power, lower=200.0, unit="kW", tasks=("descent",))
    named = explained(TrajectoryProblem(flight, make_model(), additions=Additions((reserve,))))
    assert re.match(r"least power 1\d\d\.\d kW against 200\.0 kW at \d+ s \(descent\)", named)


def test_nox_budget_too_small(flight, make_model):
    budget = Constraint("mission NOx", quantities()["nox"], upper=0.01, unit="kg")
    named = explained(TrajectoryProblem(flight, make_model(), additions=Additions(integrals=(budget,))))
    assert re.fullmatch(r"mission NOx 0\.02\d+ kg against 0\.01\d* kg", named)


def test_mass_beyond_the_box_after_a_pick_up(make_profile, make_model):
    profile = make_profile(
        {"task": "hover", "duration": 30.0},
        {"task": "pick-up", "kind": "hover", "duration": 30.0, "mass_change": 400.0},
        {"task": "cruise", "duration": 60.0, "speed": 40.0},
    )
    strong = make_model(power_limit=400e3, torque_limit=9e3, blade_loading_limit=0.2)
    named = explained(TrajectoryProblem(profile, strong))
    assert re.fullmatch(r"gross mass 254\d kg against 2500 kg at 30 s \(pick-up; also in cruise\)", named)


def test_pinned_end_outside_a_corridor(flight, make_model):
    problem = TrajectoryProblem(flight, make_model(blade_loading_limit=0.2))
    time = problem.nodes.time
    slow = (time > 200.0) & (time < 227.0)
    corridor = Corridor(rotor_speed=(np.full(len(time), 33.3), np.where(slow, 0.9 * NOMINAL, 51.0)))
    named = explained(problem, corridor=corridor)
    assert re.match(r"rotor speed rate \S+ %/s against 1\.000 %/s at 22\d s \(landing.*\)", named)


def test_a_limit_by_its_stated_value_and_unit(flight, make_model):
    """As a model states what a usage of 1 is."""
    problem = TrajectoryProblem(flight, make_model(power_limit=400e3, torque_limit=9e3))
    problem.model.stated_limits = {"engine power": (700.0, "kW")}
    named = explained(problem, limits={"engine power": 0.5})
    assert re.match(r"engine power 36\d\.\d kW against 350\.0 kW at \d+ s \(", named)


def test_bands_that_cover_all_rotor_speeds():
    with pytest.raises(InputError, match=r"forbidden bands 30 to 60 rad/s: leave none of 33\.3 to 51\.06 rad/s"):
        replace(SETTINGS, forbidden_bands=(ForbiddenBand(30.0, 60.0, 10.0),))


def test_twist_bounds_outside_the_model(flight, make_model):
    settings = replace(SETTINGS, twist_bounds=(0.3, 0.4), nominal_twist=0.35)
    with pytest.raises(InputError, match="twist_bounds: outside the range 0.1..0.29 of the model"):
        TrajectoryProblem(flight, make_model(), settings=settings).solve(MASS)


def test_no_iterations_left_is_no_infeasibility(flight, turn, make_model):
    ended = TrajectoryProblem(flight, make_model(), ipopt={"max_iter": 1}).solve(MASS)
    assert not ended.success and ended.status is Status.ITERATION_LIMIT
    assert ended.message == "IPOPT ran out of iterations; all limits are kept, but the objective is not yet the least"
    profile, tight = turn({"task": "hover", "duration": 20.0}), make_model(blade_loading_limit=0.0745)
    ended = TrajectoryProblem(profile, tight, ipopt={"max_iter": 1}).solve(MASS)
    assert ended.status is Status.ITERATION_LIMIT
    assert "; a schedule that keeps all limits exists: more iterations (max_iter)" in ended.message
