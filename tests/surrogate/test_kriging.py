"""Kriging: accuracy on a rotor-like function, derivatives, deviation, smoothing, kinks, noise, threads, errors."""

import pickle

import analytic_rotor as rotor
import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from vrsopt.errors import InputError
from vrsopt.surrogate import kriging as kriging_module
from vrsopt.surrogate.correlation import CORRELATIONS
from vrsopt.surrogate.kriging import Kriging, factors, terms
from vrsopt.surrogate.likelihood import SUBSET, negative_log_likelihood
from vrsopt.surrogate.space import LEVEL
from vrsopt.surrogate.trend import TRENDS, basis

BOX = {"names": LEVEL.names, "lower": rotor.LOWER, "upper": rotor.UPPER}


@pytest.fixture(scope="module", params=CORRELATIONS)
def fitted(request):
    inputs = rotor.design(300, seed=1)
    return Kriging(request.param, **BOX).fit(inputs, rotor.shaft_power(inputs))


def test_predicts_points_it_has_not_seen(fitted):
    inputs = rotor.design(500, seed=2)
    truth = rotor.shaft_power(inputs)
    error = np.sqrt(np.mean((fitted.predict(inputs) / truth - 1.0) ** 2))
    assert error < (0.015 if fitted.correlation == "exponential" else 0.005)
    assert fitted.score(inputs, truth) > 0.99


def test_quadratic_function_is_its_own_trend():
    inputs = rotor.design(60, seed=3)
    scaled = (inputs - rotor.LOWER) / (rotor.UPPER - rotor.LOWER)
    output = basis(scaled, "quadratic") @ np.arange(1.0, 22.0)
    model = Kriging(**BOX, theta=np.full(5, 2.5), nugget=1e-6).fit(inputs, output)
    other = rotor.design(40, seed=4)
    expected = basis((other - rotor.LOWER) / (rotor.UPPER - rotor.LOWER), "quadratic") @ np.arange(1.0, 22.0)
    np.testing.assert_allclose(model.predict(other), expected, rtol=1e-10)


@pytest.mark.parametrize("correlation", ["squared_exponential", "matern52"])
def test_nugget_takes_up_noise(correlation):
    inputs = rotor.design(300, seed=7)
    inputs = inputs[rotor.blade_loading(inputs) < 0.12]
    truth = rotor.shaft_power(inputs)
    noise = 1000.0 * np.random.default_rng(8).standard_normal(len(inputs))
    model = Kriging(correlation, **BOX).fit(inputs, truth + noise)
    assert model.state_.output_error == pytest.approx(1000.0, rel=0.25)
    assert np.std(model.predict(inputs) - truth) < 850.0  # smoothed, not interpolated


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


@pytest.mark.parametrize("trend", TRENDS)
@pytest.mark.parametrize(("correlation", "eps"), [*((name, 0.0) for name in CORRELATIONS), ("exponential", 0.1)])
def test_gradient_and_hessian_equal_differences(correlation, eps, trend):
    inputs = rotor.design(60, seed=16)
    settings = {**BOX, "trend": trend, "theta": np.array([0.8, 0.4, 2.0, 1.5, 0.7]), "nugget": 1e-5}
    model = Kriging(correlation, **settings).fit(inputs, rotor.shaft_power(inputs))
    model = model.smoothed(eps) if eps else model
    points, span = 0.98 * rotor.design(4, seed=17) + 0.01 * (rotor.LOWER + rotor.UPPER), rotor.UPPER - rotor.LOWER
    gradient, hessian = model.gradient(points) * span, model.hessian(points) * span[:, None] * span
    np.testing.assert_allclose(hessian, np.swapaxes(hessian, 1, 2), atol=1e-12 * np.abs(hessian).max())
    step = 1e-6
    for k in range(5):
        shift = step * span * np.eye(5)[k]
        slope = (model.predict(points + shift) - model.predict(points - shift)) / (2 * step)
        np.testing.assert_allclose(gradient[:, k], slope, rtol=1e-6, atol=1e-2)  # of 1e5 W
        bend = (model.gradient(points + shift) - model.gradient(points - shift)) * span / (2 * step)
        np.testing.assert_allclose(hessian[:, k], bend, rtol=1e-5, atol=1.0)


@pytest.mark.parametrize("correlation", CORRELATIONS)
def test_mean_is_the_sum_of_its_separable_terms(correlation):
    inputs = rotor.design(60, seed=18)
    model = Kriging(correlation, **BOX, theta=np.ones(5), nugget=1e-5).fit(inputs, rotor.shaft_power(inputs))
    state, points = model.state_, rotor.design(9, seed=19)
    scaled, span = state.scale_inputs(points), state.upper - state.lower

    def mean(*orders):
        return np.prod([factors(state, k, scaled[:, k], order) for k, order in enumerate(orders)], axis=0) @ terms(
            state
        )

    np.testing.assert_allclose(state.mean + state.scale * mean(0, 0, 0, 0, 0), model.predict(points), rtol=1e-10)
    slope, hessian = (
        model.gradient(points) * span / state.scale,
        model.hessian(points) * np.outer(span, span) / state.scale,
    )
    np.testing.assert_allclose(mean(0, 0, 1, 0, 0), slope[:, 2], rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(mean(0, 1, 0, 1, 0), hessian[:, 1, 3], rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(mean(0, 0, 0, 2, 0), hessian[:, 3, 3], rtol=1e-7, atol=1e-9)


def test_deviation_at_the_data_is_what_the_nugget_leaves_and_grows_away_from_them():
    inputs = rotor.design(80, seed=20)
    output = rotor.shaft_power(inputs)
    settings = {**BOX, "extrapolate": True, "theta": np.full(5, 2.0)}
    exact, noisy = (Kriging(**settings, nugget=nugget).fit(inputs, output) for nugget in (1e-10, 1e-2))
    assert np.all(exact.standard_deviation(inputs) < 2e-5 * np.std(output))
    assert np.all(noisy.standard_deviation(inputs) < noisy.state_.output_error)
    away = inputs[:1] + np.linspace(0.0, 3.0, 7)[:, None] * (rotor.UPPER - rotor.LOWER)
    mean, deviation = exact.predict(away, return_std=True)
    np.testing.assert_array_equal(mean, exact.predict(away))
    assert np.all(np.diff(deviation) > 0.0)
    # Far out the process says nothing, and the trend's own uncertainty is all that is added.
    assert deviation[-1] > exact.state_.scale * np.sqrt(exact.state_.variance)


def test_leave_one_out_deviation_covers_the_errors(fitted):
    computed, predicted, deviation = fitted.leave_one_out(return_std=True)
    normalised = (predicted - computed) / np.hypot(deviation, fitted.state_.output_error)
    assert 0.7 < np.std(normalised) < 1.6


def minima(model, size=81):
    """Local minima of the mean in the plane of rotor speed and twist."""
    grid = np.stack(np.meshgrid(*np.linspace([0.02, 0.02], [0.98, 0.98], size).T), axis=-1).reshape(-1, 2)
    scaled = np.column_stack([np.full((len(grid), 3), 0.5), grid])
    value = model.predict(rotor.LOWER + scaled * (rotor.UPPER - rotor.LOWER)).reshape(size, size)
    inner = value[1:-1, 1:-1]
    around = [value[1 + i : size - 1 + i, 1 + j : size - 1 + j] for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]
    return int(np.sum(np.all([inner < other for other in around], axis=0)))


def test_kinks_of_the_exponential_are_local_minima_the_smooth_ones_have_none():
    inputs = rotor.design(200, seed=21)
    inputs = inputs[rotor.blade_loading(inputs) < 0.12]
    settings = {**BOX, "theta": np.full(5, 0.5), "nugget": 1e-8}
    models = {name: Kriging(name, **settings).fit(inputs, rotor.shaft_power(inputs)) for name in CORRELATIONS}
    assert minima(models["exponential"]) > 10
    assert max(minima(models[name]) for name in ("squared_exponential", "matern52")) <= 1
    assert minima(models["exponential"].smoothed(0.1)) <= 1


def test_smoothing_solves_again_for_the_weights():
    """With the weights of the kinked model a smoothed correlation would miss the data."""
    inputs = rotor.design(150, seed=9)
    output = rotor.shaft_power(inputs)
    rough = Kriging("exponential", **BOX, theta=np.full(5, 0.5), nugget=1e-9).fit(inputs, output)
    smooth = rough.smoothed(0.1).state_
    kept = type(smooth)(**{**smooth.__getstate__(), "weights": rough.state_.weights})
    miss = np.sqrt(np.mean((kept.predict(inputs) / output - 1.0) ** 2))
    assert miss > 1e3 * np.sqrt(np.mean((smooth.predict(inputs) / output - 1.0) ** 2))


def test_blas_is_held_to_one_thread_while_fitting(monkeypatch):
    seen = []

    def spy(*arguments):
        seen.extend(pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas")
        return np.ones(5), np.array([1e-6])

    monkeypatch.setattr(kriging_module, "maximise", spy)
    inputs = rotor.design(40, seed=22)
    with threadpool_limits(limits=2, user_api="blas"):
        Kriging(**BOX).fit(inputs, rotor.shaft_power(inputs))
    assert seen and set(seen) == {1}


@pytest.mark.parametrize("correlation", CORRELATIONS)
def test_repeated_rows_are_fitted_with_the_nugget(correlation):
    inputs = rotor.design(60, seed=23)
    output = rotor.shaft_power(inputs)
    noise = 2e-3 * output * np.random.default_rng(24).standard_normal((2, 60))
    twice = np.concatenate([output, output]) + noise.ravel()
    model = Kriging(correlation, **BOX).fit(np.concatenate([inputs, inputs]), twice)
    middle = twice.reshape(2, 60).mean(axis=0)
    assert np.std(model.predict(inputs) / middle - 1.0) < 2e-3
    assert model.state_.output_error == pytest.approx(np.std(noise), rel=0.6)


def test_saved_without_its_matrices(fitted):
    fitted.standard_deviation(rotor.design(2, seed=25))
    again = pickle.loads(pickle.dumps(fitted.state_))  # a worker process sends this back
    assert not {"_solved", "scaled"} & set(vars(again))
    np.testing.assert_array_equal(again.predict(fitted.state_.inputs), fitted.state_.predict(fitted.state_.inputs))


def test_query_outside_the_box_is_an_error_unless_extrapolating(fitted):
    outside = ((rotor.LOWER + rotor.UPPER) / 2)[None] + np.array([0.0, 0.0, 40.0, 0.0, 0.0])
    with pytest.raises(InputError, match=r"speed = 75: outside the sampled box 0 to 70"):
        fitted.predict(outside)
    allowed = Kriging.from_state(fitted.state_, extrapolate=True)
    assert allowed.predict(outside)[0] == pytest.approx(rotor.shaft_power(outside)[0], rel=0.05)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"correlation": "cubic"}, "correlation = 'cubic': one of squared_exponential, matern52, exponential"),
        ({"trend": "cubic"}, "trend = 'cubic': one of constant, linear, quadratic"),
        ({"names": ("a", "b")}, "5 different names"),
        ({"theta": np.ones(5)}, "theta, nugget: give all or none"),
        ({"theta": -np.ones(5), "nugget": 0.0}, "5 positive numbers"),
        ({"theta": np.ones(5), "nugget": -1e-3}, "nuggets = -0.001: numbers >= 0"),
        ({"starts": ()}, r"starts = \(\): one or more numbers from 0.001 to 50"),
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
    with pytest.raises(InputError, match="n_samples = 20: at least 22"):
        Kriging(**BOX).fit(inputs[:20], output[:20])
    same = np.where(np.arange(5) == 4, inputs[:, [3]] / rotor.UPPER[3] * rotor.UPPER[4], inputs)
    with pytest.raises(InputError, match="do not determine a quadratic trend"):
        Kriging().fit(same, output)
    with pytest.raises(InputError, match=r"y\[4\] = nan: finite numbers only"):
        Kriging(**BOX).fit(inputs, np.where(np.arange(60) == 4, np.nan, output))
    with pytest.raises(InputError, match="an output that varies"):
        Kriging(**BOX).fit(inputs, np.full(60, 3.0))
    twice = np.concatenate([inputs, inputs])
    with pytest.raises(InputError, match="not positive definite"):
        Kriging(**BOX, theta=np.ones(5), nugget=0.0).fit(twice, np.concatenate([output, output]))


def test_large_design_is_finished_on_all_rows():
    inputs = rotor.design(600, seed=14)
    inputs = inputs[rotor.blade_loading(inputs) < 0.12]
    assert len(inputs) > SUBSET
    model = Kriging(**BOX, starts=(2.5,)).fit(inputs, rotor.shaft_power(inputs))
    best, _ = negative_log_likelihood(np.log([*model.state_.theta, model.state_.nugget]), model.state_.problem)
    some = Kriging(**BOX, starts=(2.5,)).fit(inputs[:SUBSET], rotor.shaft_power(inputs[:SUBSET])).state_
    assert best < negative_log_likelihood(np.log([*some.theta, some.nugget]), model.state_.problem)[0]
    test = rotor.design(1000, seed=15)
    test = test[rotor.blade_loading(test) < 0.12]
    assert np.sqrt(np.mean((model.predict(test) / rotor.shaft_power(test) - 1.0) ** 2)) < 6e-4
