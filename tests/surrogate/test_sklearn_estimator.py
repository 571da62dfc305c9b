"""Kriging among scikit-learn's estimators, and against its Gaussian process with the same covariance."""

import analytic_rotor as rotor
import numpy as np
import pandas as pd
import pytest
from sklearn.base import clone
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Matern
from sklearn.model_selection import GridSearchCV, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import check_estimator

from vrsopt.errors import InputError
from vrsopt.surrogate.kriging import Kriging


@pytest.mark.filterwarnings("ignore::sklearn.exceptions.SkipTestWarning")
def test_conventions_of_scikit_learn():
    check_estimator(Kriging("matern52", trend="constant", extrapolate=True, starts=(2.5,)))


def test_parameters_are_kept_by_clone():
    model = Kriging("matern52", trend="linear", names=("a", "b"), lower=[0.0, 0.0], starts=(1.0,))
    assert clone(model).get_params() == model.get_params()
    assert set(model.get_params()) >= {"correlation", "trend", "names", "lower", "upper", "theta", "nugget", "starts"}
    assert clone(model).set_params(trend="constant").trend == "constant"


def test_pipeline_cross_validation_and_grid_search():
    inputs = rotor.design(100, seed=11)
    output = rotor.shaft_power(inputs)
    settings = {"theta": np.ones(5), "nugget": 1e-6}
    piped = make_pipeline(StandardScaler(), Kriging(**settings, extrapolate=True))
    box = Kriging(**settings, lower=rotor.LOWER, upper=rotor.UPPER)
    for model in (piped, box):
        assert cross_val_score(model, inputs, output, cv=3).min() > 0.98
    assert piped.fit(inputs, output).score(inputs, output) > 0.9999
    search = GridSearchCV(box, {"trend": ["constant", "quadratic"]}, cv=3).fit(inputs, output)
    assert search.best_params_ == {"trend": "quadratic"}


def test_cross_validation_hands_on_the_gradients():
    inputs = np.random.default_rng(1).random((45, 2))
    output = np.sin(9.0 * inputs[:, 0]) + inputs[:, 1] ** 2
    slopes = np.stack([9.0 * np.cos(9.0 * inputs[:, 0]), 2.0 * inputs[:, 1]], axis=1)
    model = Kriging(trend="constant", lower=[0.0, 0.0], upper=[1.0, 1.0], starts=(2.5,))
    plain = cross_val_score(model, inputs, output, cv=3)
    enhanced = cross_val_score(model, inputs, output, cv=3, params={"gradients": slopes})
    assert (1.0 - enhanced).max() < 0.1 * (1.0 - plain).max()


def test_columns_of_a_data_frame_are_told_apart_by_name():
    inputs = np.random.default_rng(2).random((20, 2))
    frame = pd.DataFrame(inputs, columns=["speed", "mass"])
    output = np.sin(3.0 * inputs[:, 0]) + inputs[:, 1] ** 2
    settings = {"theta": [1.0, 1.0], "nugget": 1e-6, "extrapolate": True}
    unnamed, named = Kriging(**settings), Kriging(**settings, names=("speed", "mass")).fit(inputs, output)
    from_frame = Kriging(**settings).fit(frame, output)
    assert from_frame.state_.names == ("speed", "mass")
    for model in (from_frame, named, Kriging.from_state(named.state_)):
        np.testing.assert_array_equal(model.predict(frame), model.predict(inputs))
        with pytest.raises(InputError, match="X has columns mass, speed: speed, mass, in this order"):
            model.predict(frame[["mass", "speed"]])
    with pytest.raises(InputError, match="X has columns speed, mass: a, b, in this order"):
        Kriging(names=("a", "b")).fit(frame, output)
    assert unnamed.fit(inputs, output).predict(frame).shape == (20,)


def test_can_not_be_used_before_it_is_fitted():
    with pytest.raises(ValueError, match="not fitted yet"):
        Kriging().predict([[0.0]])
    with pytest.raises(InputError, match="X has 3 features, but Kriging is expecting 1 features as input: x0"):
        Kriging(trend="constant", theta=[1.0], nugget=0.0).fit([[0.0], [1.0]], [0.0, 1.0]).predict([[0.0, 1.0, 2.0]])


THETA = 3.0
SAME = [
    ("squared_exponential", RBF(np.sqrt(0.5 / THETA)), 2),
    ("matern52", Matern(1.0 / THETA, nu=2.5), 1),
    ("exponential", Matern(1.0 / THETA, nu=0.5), 1),
]


@pytest.mark.parametrize(("correlation", "kernel", "dimensions"), SAME)
def test_equals_scikit_learns_gaussian_process(correlation, kernel, dimensions):
    """Same covariance and nugget. Theirs has a known mean: ours with a constant trend, its estimate taken off the data,
    and its uncertainty taken off the variance. A product equals their radial kernels in one input, or without roots."""
    rng = np.random.default_rng(3)
    inputs, points = rng.random((25, dimensions)), rng.random((40, dimensions))
    output, nugget = 7.0 + np.sin(6.0 * inputs).sum(axis=1), 1e-5
    box = {"lower": np.zeros(dimensions), "upper": np.ones(dimensions)}
    settings = {"theta": np.full(dimensions, THETA), "nugget": nugget}
    ours = Kriging(correlation, trend="constant", **box, **settings).fit(inputs, output)
    state = ours.state_
    level = state.mean + state.scale * state.coefficients[0]
    variance = state.scale**2 * state.variance
    theirs = GaussianProcessRegressor(ConstantKernel(variance) * kernel, alpha=variance * nugget, optimizer=None)
    mean, deviation = theirs.fit(inputs, output - level).predict(points, return_std=True)
    own, uncertain = ours.predict(points, return_std=True)
    np.testing.assert_allclose(own, level + mean, atol=1e-8)
    by_trend = np.linalg.solve(kernel(inputs) + nugget * np.eye(25), np.ones(25))
    missing = 1.0 - by_trend @ kernel(inputs, points)
    np.testing.assert_allclose(uncertain**2, deviation**2 + variance * missing**2 / by_trend.sum(), rtol=1e-6)
