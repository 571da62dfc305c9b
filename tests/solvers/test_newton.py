"""Damped Newton: scaling, damping, chord steps, and how a failure ends."""

import numpy as np
import pytest

from vrsopt.solvers.newton import newton
from vrsopt.solvers.status import Status


class Counted:
    """A system of equations that counts its calls."""

    def __init__(self, residual, jacobian) -> None:
        self._residual, self._jacobian, self.residuals, self.jacobians = residual, jacobian, 0, 0

    def residual(self, x: np.ndarray) -> np.ndarray:
        self.residuals += 1
        return np.asarray(self._residual(x), dtype=float)

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        self.jacobians += 1
        return np.asarray(self._jacobian(x), dtype=float)


def circle(radius: float = 2.0, weight: float = 1.0) -> Counted:
    """x^2 + y^2 = radius^2, x y = 1, the second equation multiplied by ``weight``."""
    return Counted(
        lambda x: [x[0] ** 2 + x[1] ** 2 - radius**2, weight * (x[0] * x[1] - 1)],
        lambda x: [[2 * x[0], 2 * x[1]], [weight * x[1], weight * x[0]]],
    )


def root(radius: float) -> np.ndarray:
    total, difference = np.sqrt(radius**2 + 2), np.sqrt(radius**2 - 2)
    return np.array([(total + difference) / 2, (total - difference) / 2])


def test_root_and_effort():
    system = circle()
    result = newton(system.residual, system.jacobian, start=np.array([2.0, 0.3]))
    assert result.status is Status.CONVERGED
    assert result.root == pytest.approx(root(2.0), abs=1e-9)
    assert np.abs(result.residual).max() < 1e-8
    assert result.jacobians == system.jacobians <= 3


@pytest.mark.parametrize("weight", [1e-6, 1e6])
def test_badly_scaled_equations_take_the_same_way(weight):
    """The step control looks at the corrections: scaling an equation changes neither root nor number of Jacobians."""
    plain, scaled = circle(), circle(weight=weight)
    start = np.array([3.0, -1.0])
    expected = newton(plain.residual, plain.jacobian, start=start, tolerance=1e-9)
    result = newton(scaled.residual, scaled.jacobian, start=start, tolerance=1e-9 * min(weight, 1.0))
    assert result.status is expected.status is Status.CONVERGED
    assert result.root == pytest.approx(expected.root, abs=1e-8)
    assert result.jacobians == expected.jacobians


def test_damping_tames_an_overshooting_step():
    """atan from 3: the full Newton step diverges."""
    full = 3.0 - np.arctan(3.0) * (1 + 9.0)
    assert abs(full) > 3.0
    system = Counted(lambda x: np.arctan(x), lambda x: [[1 / (1 + x[0] ** 2)]])
    result = newton(system.residual, system.jacobian, start=np.array([3.0]))
    assert result.status is Status.CONVERGED and result.root == pytest.approx([0.0], abs=1e-8)


def test_a_neighbours_factorisation_saves_the_jacobian():
    first = circle()
    known = newton(first.residual, first.jacobian, start=np.array([2.0, 0.3]))
    near = circle(2.001)
    result = newton(near.residual, near.jacobian, start=known.root, factorisation=known.factorisation)
    assert result.status is Status.CONVERGED and near.jacobians == 0
    assert result.factorisation is known.factorisation
    assert result.root == pytest.approx(root(2.001), abs=1e-8)


def test_a_useless_factorisation_is_given_up():
    far = circle(6.0)
    stranger = newton(circle().residual, circle().jacobian, start=np.array([2.0, 0.3])).factorisation
    wrong = (-stranger[0], stranger[1])  # steps the wrong way
    result = newton(far.residual, far.jacobian, start=np.array([5.0, 1.0]), factorisation=wrong)
    assert result.status is Status.CONVERGED and far.jacobians > 0
    assert sorted(result.root)[::-1] == pytest.approx(root(6.0), abs=1e-8)


def test_a_start_at_the_root_costs_one_residual():
    system = Counted(lambda x: x - 1.0, lambda x: np.eye(2))
    result = newton(system.residual, system.jacobian, start=np.ones(2))
    assert result.status is Status.CONVERGED
    assert (system.residuals, system.jacobians, result.iterations) == (1, 0, 0)


def test_no_root_is_no_progress():
    system = Counted(lambda x: x**2 + 1.0, lambda x: [[2 * x[0]]])
    result = newton(system.residual, system.jacobian, start=np.array([1.5]))
    assert result.status in (Status.NO_PROGRESS, Status.ITERATION_LIMIT)
    assert np.abs(result.residual).max() >= 1.0


def test_iteration_limit():
    system = Counted(lambda x: np.arctan(x), lambda x: [[1 / (1 + x[0] ** 2)]])
    result = newton(system.residual, system.jacobian, start=np.array([50.0]), max_iterations=2)
    assert result.status is Status.ITERATION_LIMIT and result.iterations >= 2


def test_not_finite_jacobian_or_start():
    bad_jacobian = Counted(lambda x: x - 1.0, lambda x: [[np.nan]])
    assert newton(bad_jacobian.residual, bad_jacobian.jacobian, start=np.zeros(1)).status is Status.NOT_FINITE
    bad_start = Counted(lambda x: x * np.inf, lambda x: [[1.0]])
    assert newton(bad_start.residual, bad_start.jacobian, start=np.ones(1)).status is Status.NOT_FINITE


def test_an_undefined_start_is_no_root():
    undefined = Counted(lambda x: x * np.nan, lambda x: [[1.0]])
    assert newton(undefined.residual, undefined.jacobian, start=np.ones(1)).status is Status.NOT_FINITE


def test_steps_into_undefined_ground_are_shortened():
    """log(x) from 3: the full step lands below zero, where the residual is not a number."""

    def residual(x):
        return np.array([np.log(x[0])]) if x[0] > 0 else np.array([np.nan])

    system = Counted(residual, lambda x: [[1 / x[0]]])
    assert 3.0 - np.log(3.0) * 3.0 < 0
    result = newton(system.residual, system.jacobian, start=np.array([3.0]))
    assert result.status is Status.CONVERGED and result.root == pytest.approx([1.0])


def test_singular_jacobian_does_not_pass_for_a_root():
    system = Counted(lambda x: [x[0] + x[1] - 1, x[0] + x[1] - 2], lambda x: [[1.0, 1.0], [1.0, 1.0]])
    result = newton(system.residual, system.jacobian, start=np.zeros(2))  # and without a warning
    assert result.status is not Status.CONVERGED


def test_numbers_beyond_all_bounds_end_without_success_and_without_a_warning():
    def residual(x):
        return np.where(np.all(x == 1.0), 1.0, 1e300) * np.ones(2)

    result = newton(residual, lambda x: np.eye(2), start=np.ones(2), max_iterations=20)
    assert result.status is not Status.CONVERGED
