"""Gradient-enhanced Kriging: likelihood, derivatives, leave-one-out of points with their gradients, what it gains."""

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.surrogate.correlation import DIFFERENTIABLE, factor
from vrsopt.surrogate.gradient_enhanced import JointCovariance, joint_basis
from vrsopt.surrogate.kriging import Kriging, factors, terms
from vrsopt.surrogate.likelihood import negative_log_likelihood
from vrsopt.surrogate.state import fit_problem
from vrsopt.surrogate.trend import TRENDS, basis

LOWER, UPPER = np.array([-1.0, 10.0, 0.0]), np.array([2.0, 14.0, 0.5])  # scales that differ
SPAN = UPPER - LOWER
BOX = {"lower": LOWER, "upper": UPPER}
FIXED = {"theta": np.array([1.1, 0.6, 2.0]), "nugget": 1e-5, "gradient_nugget": 1e-4}


def design(size, seed):
    return LOWER + SPAN * np.random.default_rng(seed).random((size, 3))


def function(inputs):
    a, b, c = ((inputs - LOWER) / SPAN).T
    return 50.0 + 20.0 * np.sin(3.0 * a) * np.exp(b) + 30.0 * c**3 * a


def gradient(inputs):
    a, b, c = ((inputs - LOWER) / SPAN).T
    by_a = 60.0 * np.cos(3.0 * a) * np.exp(b) + 30.0 * c**3
    return np.stack([by_a, 20.0 * np.sin(3.0 * a) * np.exp(b), 90.0 * c**2 * a], axis=1) / SPAN


def fit(correlation, size=30, seed=1, **settings):
    inputs = design(size, seed)
    return Kriging(correlation, **BOX, **{**FIXED, **settings}).fit(inputs, function(inputs), gradient(inputs))


@pytest.mark.parametrize("correlation", DIFFERENTIABLE)
def test_covariance_is_the_derivative_of_that_of_the_outputs(correlation):
    """Against differences of the covariance between two points, each moved by itself."""
    pair, theta = np.array([[0.2, 0.7, 0.4], [0.5, 0.4, 0.6]]), np.array([1.1, 0.6, 2.0])
    upper = JointCovariance(correlation, pair).matrix(theta)

    def covariance(one, other):
        return np.prod([factor(correlation, 0.0, theta[k], one[k] - other[k]) for k in range(3)])

    step = 1e-4
    shift = step * np.eye(3)
    for b in range(3):
        slope = (covariance(pair[0], pair[1] + shift[b]) - covariance(pair[0], pair[1] - shift[b])) / (2 * step)
        assert upper[0, 2 + 2 * b + 1] == pytest.approx(slope, abs=1e-7)
        for a in range(b + 1):
            corners = [
                one * other * covariance(pair[0] + one * shift[a], pair[1] + other * shift[b])
                for one in (1, -1)
                for other in (1, -1)
            ]
            assert upper[2 + 2 * a, 2 + 2 * b + 1] == pytest.approx(sum(corners) / (4 * step**2), abs=1e-6)
    assert np.linalg.eigvalsh(np.triu(upper) + np.triu(upper, 1).T)[0] > 0.0


@pytest.mark.parametrize("trend", TRENDS)
@pytest.mark.parametrize("correlation", DIFFERENTIABLE)
def test_likelihood_gradient_equals_differences(correlation, trend):
    inputs = design(20, seed=2)
    output, slopes = function(inputs), gradient(inputs) * SPAN
    scaled = (inputs - LOWER) / SPAN
    problem = fit_problem(correlation, 0.0, trend, scaled, (output - output.mean()) / 10.0, slopes / 10.0)
    point = np.log([1.1, 0.7, 2.0, 1e-3, 2e-3])
    _, exact = negative_log_likelihood(point, problem)
    for k, shift in enumerate(1e-5 * np.eye(5)):
        high, low = (negative_log_likelihood(point + sign * shift, problem)[0] for sign in (1, -1))
        assert exact[k] == pytest.approx((high - low) / 2e-5, rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("trend", TRENDS)
@pytest.mark.parametrize("correlation", DIFFERENTIABLE)
def test_leave_one_out_leaves_a_point_out_with_its_gradient(correlation, trend):
    inputs = design(25, seed=3)
    output, slopes = function(inputs), gradient(inputs)
    model = Kriging(correlation, trend=trend, **BOX, **FIXED).fit(inputs, output, slopes)
    computed, predicted, deviation = model.leave_one_out(return_std=True)
    np.testing.assert_allclose(computed, output, rtol=1e-11)
    for row in range(0, 25, 4):
        kept = np.arange(25) != row
        other = Kriging(correlation, trend=trend, **BOX, **FIXED).fit(inputs[kept], output[kept], slopes[kept])
        mean, own = other.predict(inputs[[row]], return_std=True)
        assert predicted[row] == pytest.approx(mean[0], rel=1e-9)
        ratio = model.state_.scale**2 * model.state_.variance / (other.state_.scale**2 * other.state_.variance)
        assert deviation[row] == pytest.approx(own[0] * np.sqrt(ratio), rel=1e-6)


@pytest.mark.parametrize("correlation", DIFFERENTIABLE)
def test_passes_through_values_and_gradients(correlation):
    model = fit(correlation, nugget=1e-12, gradient_nugget=1e-12)
    inputs = model.state_.inputs
    np.testing.assert_allclose(model.predict(inputs), function(inputs), rtol=1e-6)
    np.testing.assert_allclose(model.gradient(inputs) * SPAN, gradient(inputs) * SPAN, atol=1e-3)
    assert np.all(model.standard_deviation(inputs) < 1e-3)
    state = fit(correlation).state_  # with errors, the data are the mean and the nuggets' share
    np.testing.assert_allclose(state.outputs(), function(inputs), rtol=1e-10)
    np.testing.assert_allclose(state.gradients() * SPAN, gradient(inputs) * SPAN, atol=1e-8)


@pytest.mark.parametrize("correlation", DIFFERENTIABLE)
def test_gradient_and_hessian_of_the_mean_equal_differences(correlation):
    model, points = fit(correlation), 0.99 * design(5, seed=4) + 0.005 * (LOWER + UPPER)
    first, second = model.gradient(points) * SPAN, model.hessian(points) * np.outer(SPAN, SPAN)
    step = 1e-5
    for k in range(3):
        shift = step * SPAN * np.eye(3)[k]
        slope = (model.predict(points + shift) - model.predict(points - shift)) / (2 * step)
        np.testing.assert_allclose(first[:, k], slope, atol=1e-6)
        bend = (model.gradient(points + shift) - model.gradient(points - shift)) * SPAN / (2 * step)
        np.testing.assert_allclose(second[:, k], bend, atol=2e-5)


@pytest.mark.parametrize("correlation", DIFFERENTIABLE)
def test_mean_is_the_sum_of_its_separable_terms(correlation):
    model, points = fit(correlation, trend="linear"), design(5, seed=5)
    state = model.state_
    scaled = state.scale_inputs(points)

    def mean(*orders):
        each = [factors(state, k, scaled[:, k], order) for k, order in enumerate(orders)]
        return state.scale * (np.prod(each, axis=0) @ terms(state))

    np.testing.assert_allclose(state.mean + mean(0, 0, 0), model.predict(points), rtol=1e-10)
    np.testing.assert_allclose(mean(0, 1, 0), model.gradient(points)[:, 1] * SPAN[1], rtol=1e-8)
    np.testing.assert_allclose(mean(2, 0, 0), model.hessian(points)[:, 0, 0] * SPAN[0] ** 2, rtol=1e-8)
    np.testing.assert_allclose(mean(1, 0, 1), model.hessian(points)[:, 0, 2] * SPAN[0] * SPAN[2], rtol=1e-8)


@pytest.mark.parametrize("correlation", DIFFERENTIABLE)
def test_deviation_is_that_of_the_normal_distribution(correlation):
    """Straight from the joint covariance, inverted."""
    model, point = fit(correlation, size=15, trend="linear"), design(1, seed=6)
    state = model.state_
    scaled = np.concatenate([state.scaled, state.scale_inputs(point)])
    upper = JointCovariance(correlation, scaled).matrix(state.theta)
    full = np.triu(upper) + np.triu(upper, 1).T
    data = np.flatnonzero(np.arange(64) % 16 != 15)
    noise = np.repeat([state.nugget, state.gradient_nugget], [15, 45])
    inverse = np.linalg.inv(full[np.ix_(data, data)] + np.diag(noise))
    trend, among = joint_basis(scaled, "linear")[data], full[data, 15]
    missing = basis(scaled[15:], "linear")[0] - trend.T @ inverse @ among
    share = 1.0 - among @ inverse @ among + missing @ np.linalg.solve(trend.T @ inverse @ trend, missing)
    assert model.standard_deviation(point)[0] == pytest.approx(state.scale * np.sqrt(state.variance * share), rel=1e-6)


@pytest.mark.parametrize("correlation", DIFFERENTIABLE)
def test_gradients_are_worth_many_points(correlation):
    inputs, many, test = design(40, seed=7), design(160, seed=8), design(400, seed=9)
    enhanced = Kriging(correlation, **BOX).fit(inputs, function(inputs), gradient(inputs))
    plain, large = (Kriging(correlation, **BOX).fit(points, function(points)) for points in (inputs, many))
    errors = [np.sqrt(np.mean((model.predict(test) - function(test)) ** 2)) for model in (enhanced, plain, large)]
    assert errors[0] < 0.2 * errors[1]
    assert errors[0] < 2.0 * errors[2]


def test_both_nuggets_are_fitted_to_noise_of_their_own():
    rng, inputs = np.random.default_rng(10), design(60, seed=11)
    noise = 0.5 * rng.standard_normal(60), 3.0 * rng.standard_normal((60, 3)) / SPAN
    model = Kriging(**BOX).fit(inputs, function(inputs) + noise[0], gradient(inputs) + noise[1])
    state = model.state_
    assert state.output_error == pytest.approx(0.5, rel=0.4)
    assert state.scale * np.sqrt(state.variance * state.gradient_nugget) == pytest.approx(3.0, rel=0.3)


def test_what_can_not_be_fitted_is_named():
    inputs = design(20, seed=12)
    output, slopes = function(inputs), gradient(inputs)
    with pytest.raises(InputError, match="'exponential': one of squared_exponential, matern52"):
        Kriging("exponential").fit(inputs, output, slopes)
    with pytest.raises(InputError, match=r"gradients\[2, 1\] = nan: finite numbers only"):
        Kriging().fit(inputs, output, np.where(np.arange(60).reshape(20, 3) == 7, np.nan, slopes))
    with pytest.raises(InputError, match=r"gradients have shape \(20, 2\): expected \(20, 3\)"):
        Kriging().fit(inputs, output, slopes[:, :2])
    with pytest.raises(InputError, match="n_samples = 4: at least 5 for a quadratic trend"):
        Kriging().fit(inputs[:4], output[:4], slopes[:4])
    with pytest.raises(InputError, match="theta, nugget, gradient_nugget: give all or none"):
        Kriging(theta=np.ones(3), nugget=1e-6).fit(inputs, output, slopes)
