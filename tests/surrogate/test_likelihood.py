"""The likelihood, its gradient and its maximum; leave-one-out in closed form; conditioning."""

import analytic_rotor as rotor
import numpy as np
import pytest

from vrsopt.surrogate.correlation import CORRELATIONS
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.likelihood import NUGGET_START, SUBSET, THETA_STARTS, _minimise, negative_log_likelihood
from vrsopt.surrogate.state import fit_problem
from vrsopt.surrogate.trend import TRENDS

BOX = {"lower": rotor.LOWER, "upper": rotor.UPPER}


def problem(correlation, trend, size, seed):
    inputs = rotor.design(size, seed=seed)
    output = rotor.shaft_power(inputs)
    scaled = (inputs - rotor.LOWER) / (rotor.UPPER - rotor.LOWER)
    return fit_problem(correlation, 0.0, trend, scaled, (output - output.mean()) / output.std(), None)


@pytest.mark.parametrize("trend", TRENDS)
@pytest.mark.parametrize("correlation", CORRELATIONS)
def test_gradient_equals_differences(correlation, trend):
    case = problem(correlation, trend, 80, seed=5)
    point = np.log([2.0, 0.7, 4.0, 1.3, 0.4, 100 * NUGGET_START])
    _, gradient = negative_log_likelihood(point, case)
    step = 1e-5
    for k, exact in enumerate(gradient):
        shift = step * np.eye(6)[k]
        high, low = (negative_log_likelihood(point + sign * shift, case)[0] for sign in (1, -1))
        assert exact == pytest.approx((high - low) / (2 * step), rel=1e-5, abs=1e-6)


def test_value_is_that_of_the_normal_distribution():
    """Up to the constant: with the covariance and trend found, -log of the density of the data."""
    case = problem("matern52", "linear", 40, seed=6)
    theta, nugget = np.array([1.0, 0.5, 2.0, 0.8, 0.6]), 1e-3
    upper = case.covariance.matrix(theta)
    matrix = np.triu(upper) + np.triu(upper, 1).T + nugget * np.eye(40)
    inverse = np.linalg.inv(matrix)
    beta = np.linalg.solve(case.basis.T @ inverse @ case.basis, case.basis.T @ inverse @ case.data)
    residual = case.data - case.basis @ beta
    variance = residual @ inverse @ residual / 40
    expected = 0.5 * (np.linalg.slogdet(variance * matrix)[1] + residual @ inverse @ residual / variance) - 20.0
    value, _ = negative_log_likelihood(np.log([*theta, nugget]), case)
    assert value == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("trend", TRENDS)
@pytest.mark.parametrize("correlation", CORRELATIONS)
def test_closed_form_leave_one_out_equals_refitting_without_each_point(correlation, trend):
    inputs = rotor.design(40, seed=6)
    output = rotor.shaft_power(inputs)
    fixed = {**BOX, "trend": trend, "theta": np.array([1.0, 0.5, 2.0, 1.5, 0.8]), "nugget": 1e-4}
    model = Kriging(correlation, **fixed).fit(inputs, output)
    computed, predicted, deviation = model.leave_one_out(return_std=True)
    np.testing.assert_allclose(computed, output, rtol=1e-12)
    for row in range(0, len(inputs), 5):
        kept = np.arange(len(inputs)) != row
        refitted = Kriging(correlation, **fixed).fit(inputs[kept], output[kept])
        mean, own = refitted.predict(inputs[[row]], return_std=True)
        assert predicted[row] == pytest.approx(mean[0], rel=1e-10)
        # The closed form keeps the process variance of all points.
        ratio = model.state_.scale**2 * model.state_.variance / (refitted.state_.scale**2 * refitted.state_.variance)
        assert deviation[row] == pytest.approx(own[0] * np.sqrt(ratio), rel=1e-8)


@pytest.mark.parametrize("correlation", CORRELATIONS)
def test_fit_is_the_optimum_of_the_likelihood(correlation):
    inputs = rotor.design(150, seed=1)
    state = Kriging(correlation, **BOX).fit(inputs, rotor.shaft_power(inputs)).state_
    best = np.log(np.append(state.theta, state.nugget))
    value, _ = negative_log_likelihood(best, state.problem)
    for shift in 0.3 * np.vstack([np.eye(6), -np.eye(6)]):
        moved = np.clip(best + shift, np.log([1e-3] * 5 + [1e-12]), np.log([50.0] * 5 + [1e-1]))
        assert negative_log_likelihood(moved, state.problem)[0] > value - 0.5


def test_condition_number_is_that_of_the_covariance():
    inputs = rotor.design(120, seed=2)
    settings = {**BOX, "theta": np.array([0.8, 0.4, 2.0, 1.0, 0.5]), "nugget": 1e-6}
    state = Kriging("matern52", **settings).fit(inputs, rotor.shaft_power(inputs)).state_
    upper = state.problem.covariance.matrix(state.theta)
    matrix = np.triu(upper) + np.triu(upper, 1).T + state.nugget * np.eye(120)
    assert state.condition_number == pytest.approx(np.linalg.cond(matrix, 1), rel=0.5)


def test_start_in_the_ill_conditioned_corner_finds_a_false_optimum_and_ours_do_not():
    """Matern 5/2 from theta = 0.3: long correlations, K nearly singular, half of the inputs given up."""
    inputs = rotor.design(150, seed=2)
    inputs = inputs[rotor.blade_loading(inputs) < 0.12]
    output = rotor.shaft_power(inputs)
    wrong, right = (Kriging("matern52", **BOX, **starts).fit(inputs, output) for starts in ({"starts": (0.3,)}, {}))
    found = {}
    for name, model in (("wrong", wrong), ("right", right)):
        state = model.state_
        value, _ = negative_log_likelihood(np.log(np.append(state.theta, state.nugget)), state.problem)
        computed, predicted = model.leave_one_out()
        found[name] = value, np.sqrt(np.mean((predicted / computed - 1.0) ** 2))
    assert found["right"][0] < found["wrong"][0] - 100.0
    assert found["right"][1] < 0.5 * found["wrong"][1]


@pytest.mark.parametrize("seed", [3, 4])
def test_tiny_nugget_is_no_better_start(seed):
    case = problem("matern52", "quadratic", 200, seed=seed)
    ours = min(_minimise(np.log([start] * 5 + [NUGGET_START]), case)[0] for start in THETA_STARTS)
    for start in (0.3, 2.5, 10.0):
        assert ours <= _minimise(np.log([start] * 5 + [1e-8]), case)[0] + 0.1


def test_rows_on_which_the_starts_compete_need_not_determine_the_trend():
    """Every other row has all values of one input: one that alternates, in the way of a table of two variants."""
    size = 2 * SUBSET - 1
    inputs = np.stack([np.random.default_rng(9).random(size), np.arange(size) % 2.0], axis=1)
    model = Kriging("matern52", trend="linear", starts=(2.5,)).fit(inputs, np.sin(6.0 * inputs[:, 0]) * inputs[:, 1])
    assert model.score(inputs, np.sin(6.0 * inputs[:, 0]) * inputs[:, 1]) > 0.999
