"""The consistent trajectory on the full physics: a short flight, and a surrogate that is wrong on purpose."""

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np
import pytest

from tests.schedule.smooth_profiles import jumping_profile
from vrsopt.helicopter import helicopter
from vrsopt.limits import Limits
from vrsopt.schedule.consistent import consistent_trajectory
from vrsopt.schedule.corrected import CorrectedPath
from vrsopt.schedule.mesh import MeshOptions
from vrsopt.schedule.physics_path import PhysicsTruth
from vrsopt.schedule.schedule import ON_LIMIT
from vrsopt.schedule.study_input import loaded
from vrsopt.schedule.surrogate_path import SurrogateAircraft
from vrsopt.schedule.trajectory import TrajectoryProblem

MASS = 1950.0
COARSE = MeshOptions(first_step=25.0, largest_step=60.0)


class Biased(CorrectedPath):
    """A path model with a smooth wrong factor on its fuel flow, which moves the best twist by degrees."""

    def function(self, quantities: Sequence[str] = ()) -> tuple[ca.Function, np.ndarray]:
        inner, coefficients = self.model.function()
        x = [ca.SX.sym(name) for name in ("mass", "rotor_speed", "twist", "rotor_speed_rate")]
        own, centre = ca.SX.sym("c", len(coefficients)), ca.SX.sym("centre", 4)
        fuel, limits = inner(*x, own, centre)
        factor = 1.02 + 0.08 * (x[2] - 0.2)
        return ca.Function("node", [*x, own, centre], [factor * fuel, limits]), coefficients


@pytest.mark.slow
def test_the_optimum_of_the_physics_is_found_with_a_wrong_surrogate():
    """A few intervals of climb and cruise: problem and physics agree, and the physics' slopes have gone."""
    profile = jumping_profile(
        {"task": "climb", "duration": 60.0, "speed": 40.0, "climb": np.radians(5.0)},
        {"task": "cruise", "duration": 150.0, "speed": 50.0},
    )
    machine = helicopter("bo105")
    limits = Limits(machine.aircraft, machine.engine, "manual", 1.3)
    make = SurrogateAircraft(loaded(None, machine.data_hash), limits)

    def biased(conditions: Any) -> Biased:
        return Biased(make(conditions), len(conditions.time))

    problem = TrajectoryProblem(profile, biased, mesh=COARSE, shared=False)
    start = problem.solve(MASS)
    truth = PhysicsTruth(profile, limits, workers=1)
    found = consistent_trajectory(profile, biased, truth, takeoff_mass=MASS, trajectory=start)
    assert found.success, found.message
    first = found.history[0]
    assert abs(first.fuel / first.fuel_physics - 1) > 0.01  # the bias
    assert found.trajectory.fuel == pytest.approx(found.fuel_physics, rel=5e-4)
    assert found.fuel_physics < first.fuel_physics and found.optimality.excess <= ON_LIMIT
    assert found.optimality.at_stake < 0.2 * found.surrogate.at_stake
    own = TrajectoryProblem(profile, make, mesh=start.mesh).solve(MASS)
    assert found.fuel_physics <= truth.fly(problem, own.schedule, MASS).fuel * (1 + 5e-5)
    assert found.trajectory.schedule.twist == pytest.approx(own.schedule.twist, abs=np.radians(1.5))
