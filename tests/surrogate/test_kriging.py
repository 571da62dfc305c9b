"""Kriging: accuracy on a rotor-like function, exact gradient and leave-one-out, smoothing, estimator, errors."""

import analytic_rotor as rotor
import numpy as np
import pytest
from sklearn.base import clone
from sklearn.model_selection import cross_val_score

from vrsopt.errors import InputError
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.likelihood import (
    CORRELATIONS,
    NUGGET_START,
    metrics,
    negative_log_likelihood,
    trend,
)
from vrsopt.surrogate.space import LEVEL

BOX = {"names": LEVEL.names, "lower": rotor.LOWER, "upper": rotor.UPPER}


@pytest.fixture(scope="module", params=CORRELATIONS)
def fitted(request):
    inputs = rotor.design(300, seed=1)
    return Kriging(request.param, **BOX).fit(inputs, rotor.shaft_power(inputs))


def test_predicts_points_it_has_not_seen(fitted):
    inputs = rotor.design(500, seed=2)
    truth = rotor.shaft_power(inputs)
    error = np.sqrt(np.mean((fitted.predict(inputs) / truth - 1.0) ** 2))
    assert error < (0.005 if fitted.correlation == "squared_exponential" else 0.015)
    assert fitted.score(inputs, truth) > 0.99


def test_quadratic_function_is_its_own_trend():
    inputs = rotor.design(60, seed=3)
    scaled = (inputs - rotor.LOWER) / (rotor.UPPER - rotor.LOWER)
    output = trend(scaled) @ np.arange(1.0, 22.0)
    model = Kriging(**BOX, theta=np.full(5, 2.5), nugget=1e-6).fit(inputs, output)
    other = rotor.design(40, seed=4)
    expected = trend((other - rotor.LOWER) / (rotor.UPPER - rotor.LOWER)) @ np.arange(1.0, 22.0)
    np.testing.assert_allclose(model.predict(other), expected, rtol=1e-10)


@pytest.mark.parametrize("correlation", CORRELATIONS)
def test_likelihood_gradient_equals_differences(correlation):
    inputs = (rotor.design(80, seed=5) - rotor.LOWER) / (rotor.UPPER - rotor.LOWER)
    output = rotor.shaft_power(rotor.design(80, seed=5))
    arguments = metrics(correlation, 0.0, inputs), trend(inputs), (output - output.mean()) / output.std()
    point = np.log([2.0, 0.7, 4.0, 1.3, 0.4, 100 * NUGGET_START])
    _, gradient = negative_log_likelihood(point, *arguments)
    step = 1e-5
    for k, exact in enumerate(gradient):
        shift = step * np.eye(6)[k]
        high, low = (negative_log_likelihood(point + sign * shift, *arguments)[0] for sign in (1, -1))
        assert exact == pytest.approx((high - low) / (2 * step), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("correlation", CORRELATIONS)
def test_closed_form_leave_one_out_equals_refitting_without_each_point(correlation):
    inputs = rotor.design(60, seed=6)
    output = rotor.shaft_power(inputs)
    fixed = {"theta": np.array([1.0, 0.5, 2.0, 1.5, 0.8]), "nugget": 1e-4}
    computed, predicted = Kriging(correlation, **BOX, **fixed).fit(inputs, output).leave_one_out()
    np.testing.assert_allclose(computed, output, rtol=1e-12)
    for row in range(len(inputs)):
        kept = np.arange(len(inputs)) != row
        refitted = Kriging(correlation, **BOX, **fixed).fit(inputs[kept], output[kept])
        assert predicted[row] == pytest.approx(refitted.predict(inputs[[row]])[0], rel=1e-10)


def test_fit_is_the_optimum_of_the_likelihood(fitted):
    state = fitted.state_
    outputs = (state.outputs() - state.mean) / state.scale
    arguments = metrics(state.correlation, 0.0, state.scaled), trend(state.scaled), outputs
    best = np.log(np.append(state.theta, state.nugget))
    value, _ = negative_log_likelihood(best, *arguments)
    for shift in 0.3 * np.vstack([np.eye(6), -np.eye(6)]):
        moved = np.clip(best + shift, np.log(1e-12), np.log(50.0))
        assert negative_log_likelihood(moved, *arguments)[0] > value - 0.5


def test_nugget_takes_up_noise():
    inputs = rotor.design(400, seed=7)
    truth = rotor.shaft_power(inputs)
    noisy = truth * (1.0 + 5e-3 * np.random.default_rng(8).standard_normal(400))
    exact, model = Kriging(**BOX).fit(inputs, truth), Kriging(**BOX).fit(inputs, noisy)
    assert model.state_.nugget > 10.0 * exact.state_.nugget
    assert np.std(model.predict(inputs) / truth - 1.0) < 4e-3  # of 5e-3: smoothed, not interpolated


def test_smoothed_exponential_keeps_the_data_and_loses_the_kink():
    inputs = rotor.design(150, seed=9)
    output = rotor.shaft_power(inputs)
    rough = Kriging("exponential", **BOX, theta=np.full(5, 0.5), nugget=1e-9).fit(inputs, output)
    smooth = rough.smoothed(0.1)
    np.testing.assert_allclose(smooth.predict(inputs), output, rtol=1e-6)

    def slope_jump(model):
        middle = inputs[np.argmin(np.sum((inputs - (rotor.LOWER + rotor.UPPER) / 2) ** 2 / rotor.UPPER**2, axis=1))]
        step = 1e-4 * np.eye(5)[3] * (rotor.UPPER - rotor.LOWER)
        left, centre, right = model.predict(np.stack([middle - step, middle, middle + step]))
        return abs(right - 2 * centre + left) / 1e-4

    assert slope_jump(smooth) < 0.01 * slope_jump(rough)


def test_only_the_exponential_can_be_smoothed():
    inputs = rotor.design(60, seed=10)
    model = Kriging(**BOX, theta=np.ones(5), nugget=1e-6).fit(inputs, rotor.shaft_power(inputs))
    with pytest.raises(InputError, match="only 'exponential'"):
        model.smoothed()


def test_is_a_scikit_learn_estimator():
    model = Kriging("exponential", **BOX, theta=np.ones(5), nugget=1e-6)
    assert clone(model).get_params()["correlation"] == "exponential"
    inputs = rotor.design(150, seed=11)
    scores = cross_val_score(Kriging(**BOX, theta=np.ones(5), nugget=1e-6), inputs, rotor.shaft_power(inputs), cv=3)
    assert scores.min() > 0.98


def test_query_outside_the_box_is_an_error_unless_extrapolating(fitted):
    outside = ((rotor.LOWER + rotor.UPPER) / 2)[None] + np.array([0.0, 0.0, 40.0, 0.0, 0.0])
    with pytest.raises(InputError, match=r"speed = 75: outside the sampled box 0 to 70"):
        fitted.predict(outside)
    allowed = Kriging.from_state(fitted.state_, extrapolate=True)
    assert allowed.predict(outside)[0] == pytest.approx(rotor.shaft_power(outside)[0], rel=0.05)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"correlation": "cubic"}, "correlation = 'cubic': one of squared_exponential, exponential"),
        ({"names": ("a", "b")}, "5 different names"),
        ({"theta": np.ones(5)}, "give both or neither"),
        ({"lower": 0.9 * rotor.LOWER + 0.1 * rotor.UPPER}, "outside the sampled box"),
    ],
)
def test_settings_that_do_not_fit_the_data_are_named(change, message):
    inputs = rotor.design(60, seed=12)
    with pytest.raises(InputError, match=message):
        Kriging(**{**BOX, **change}).fit(inputs, rotor.shaft_power(inputs))


def test_data_that_can_not_be_fitted_is_named():
    inputs = rotor.design(60, seed=13)
    output = rotor.shaft_power(inputs)
    with pytest.raises(InputError, match="20 rows: at least 22"):
        Kriging(**BOX).fit(inputs[:20], output[:20])
    with pytest.raises(InputError, match=r"y\[4\] is not a finite number"):
        Kriging(**BOX).fit(inputs, np.where(np.arange(60) == 4, np.nan, output))
    with pytest.raises(InputError, match="an output that varies"):
        Kriging(**BOX).fit(inputs, np.full(60, 3.0))
    twice = np.concatenate([inputs, inputs])
    with pytest.raises(InputError, match="not positive definite"):
        Kriging(**BOX, theta=np.ones(5), nugget=0.0).fit(twice, np.concatenate([output, output]))


@pytest.mark.slow
@pytest.mark.parametrize("correlation", CORRELATIONS)
def test_design_of_the_study_is_fitted_on_all_rows(correlation):
    inputs = rotor.design(1500, seed=14)
    inputs = inputs[rotor.blade_loading(inputs) < 0.12]
    model = Kriging(correlation, **BOX).fit(inputs, rotor.shaft_power(inputs))
    test = rotor.design(1000, seed=15)
    test = test[rotor.blade_loading(test) < 0.12]
    error = np.sqrt(np.mean((model.predict(test) / rotor.shaft_power(test) - 1.0) ** 2))
    assert error < (2e-4 if correlation == "squared_exponential" else 5e-3)
