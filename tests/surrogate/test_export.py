"""Kriging as CasADi function and along a path: the same mean, exact derivatives, Chebyshev error."""

import logging

import analytic_rotor as rotor
import casadi as ca
import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.surrogate import chebyshev
from vrsopt.surrogate.export import FREE, path_coefficients, path_predict, to_casadi
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.likelihood import CORRELATIONS
from vrsopt.surrogate.space import LEVEL

COLUMNS = [LEVEL.names.index(name) for name in FREE]
FREE_LOWER, FREE_UPPER = rotor.LOWER[COLUMNS], rotor.UPPER[COLUMNS]
FIXED = {"speed": np.linspace(0.0, 70.0, 15), "altitude": np.linspace(2000.0, 0.0, 15)}


def model(correlation, rows=400, order=(0, 1, 2, 3, 4)):
    order = list(order)
    inputs = rotor.design(rows, seed=1)
    names = [LEVEL.names[k] for k in order]
    box = {"names": names, "lower": rotor.LOWER[order], "upper": rotor.UPPER[order]}
    return Kriging(correlation, **box).fit(inputs[:, order], rotor.shaft_power(inputs))


@pytest.fixture(scope="module", params=CORRELATIONS)
def kriging(request):
    return model(request.param)


@pytest.fixture(scope="module")
def squared():
    return model("squared_exponential")


def candidates(count, seed=2):
    return FREE_LOWER + (FREE_UPPER - FREE_LOWER) * np.random.default_rng(seed).random((15, count, 3))


def full_points(free_values):
    points = np.empty((*free_values.shape[:2], 5))
    points[..., COLUMNS] = free_values
    for name, values in FIXED.items():
        points[..., LEVEL.names.index(name)] = values[:, None]
    return points


def test_path_prediction_equals_prediction(kriging):
    free = candidates(20)
    expected = kriging.predict(full_points(free).reshape(-1, 5)).reshape(15, 20)
    np.testing.assert_allclose(path_predict(kriging, FIXED, free), expected, rtol=1e-7)


def test_casadi_function_equals_prediction_and_differences(squared):
    function = to_casadi(squared)
    points = full_points(candidates(1))[:4, 0]
    inside = np.clip(points, rotor.LOWER + 0.01 * (rotor.UPPER - rotor.LOWER), rotor.UPPER * 0.99)
    derivatives = function.factory("derivatives", ["x"], ["y", "grad:y:x", "hess:y:x:x"])
    gradient = function.factory("gradient", ["x"], ["grad:y:x"])
    step = 1e-4 * (rotor.UPPER - rotor.LOWER)
    for point in inside:
        value, slope, hessian = (item.full() for item in derivatives(point))
        assert value[0, 0] == pytest.approx(squared.predict(point[None])[0], rel=1e-7)
        shifts = np.diag(step)
        rise = [(float(function(point + s)) - float(function(point - s))) for s in shifts]
        np.testing.assert_allclose(slope.ravel() * step, np.array(rise) / 2, rtol=1e-5, atol=1e-3)
        bend = np.column_stack([(gradient(point + s).full() - gradient(point - s).full()).ravel() / 2 for s in shifts])
        # CasADi gives one triangle of a symmetric matrix
        symmetric = hessian + hessian.T - np.diag(np.diag(hessian)) if np.allclose(np.tril(hessian, -1), 0) else hessian
        np.testing.assert_allclose(symmetric * step * step[:, None], bend * step[:, None], rtol=1e-3, atol=1e-4)


def test_exponential_enters_casadi_smoothed_and_says_so(caplog):
    rough = model("exponential", rows=150)
    with caplog.at_level(logging.WARNING):
        function = to_casadi(rough)
    assert "smoothed with eps = 0.1" in caplog.text
    point = rotor.design(1, seed=3)
    assert float(function(point[0])) == pytest.approx(rough.smoothed(0.1).predict(point)[0], rel=1e-10)


def test_smoothed_model_is_taken_as_it_is(caplog):
    smooth = model("exponential", rows=150).smoothed(0.05)
    with caplog.at_level(logging.WARNING):
        function = to_casadi(smooth)
    assert not caplog.text
    point = rotor.design(1, seed=3)
    assert float(function(point[0])) == pytest.approx(smooth.predict(point)[0], rel=1e-10)


def test_chebyshev_error_falls_with_the_degree_and_is_below_a_hundredth_of_a_per_cent(squared):
    free = candidates(60, seed=4)
    exact = path_predict(squared, FIXED, free)
    errors = []
    for degrees in ((2, 8, 8), (4, 14, 10), (5, 16, 12)):
        table = path_coefficients(squared, FIXED, FREE_LOWER, FREE_UPPER, degrees)
        assert table.shape == (15, *(degree + 1 for degree in degrees))
        values = chebyshev.evaluate(table, free, lower=FREE_LOWER, upper=FREE_UPPER)
        errors.append(np.sqrt(np.mean((values / exact - 1.0) ** 2)))
    assert errors[0] > errors[1] > errors[2]
    assert errors[1] < 1e-4


def test_coefficients_feed_the_casadi_expression(squared):
    degrees = (3, 12, 10)
    table = path_coefficients(squared, FIXED, FREE_LOWER, FREE_UPPER, degrees)
    x, c = ca.SX.sym("x", 3), ca.SX.sym("c", table[0].size)
    value = chebyshev.expression(c, ca.vertsplit(x), degrees, lower=FREE_LOWER, upper=FREE_UPPER)
    function = ca.Function("node", [x, c], [value])
    free = candidates(1, seed=5)
    mapped = function.map(15)(free[:, 0].T, table.reshape(15, -1).T).full().ravel()
    np.testing.assert_allclose(mapped, path_predict(squared, FIXED, free)[:, 0], rtol=1e-3)


def test_variables_go_by_name_not_by_position(squared):
    turned = model("squared_exponential", order=(4, 2, 0, 3, 1))
    free = candidates(5)
    expected = path_predict(squared, FIXED, free)
    # the optimiser takes another route to the same optimum: equal as models, not to rounding
    np.testing.assert_allclose(path_predict(turned, FIXED, free), expected, rtol=2e-3)


def test_window_of_one_variable_outside_the_box_is_refused(squared):
    with pytest.raises(InputError, match=r"mass = 2600: outside the sampled box 1400 to 2500"):
        path_coefficients(squared, FIXED, FREE_LOWER, FREE_UPPER + np.array([100.0, 0.0, 0.0]), (2, 8, 8))
    with pytest.raises(InputError, match=r"speed = 75"):
        path_predict(squared, {**FIXED, "speed": np.full(15, 75.0)}, candidates(2))


def test_every_input_is_given_once(squared):
    with pytest.raises(InputError, match="each of mass, altitude"):
        path_predict(squared, {"speed": FIXED["speed"]}, candidates(2))
    with pytest.raises(InputError, match="each of mass, altitude"):
        path_predict(squared, {**FIXED, "mass": FIXED["speed"]}, candidates(2))
    with pytest.raises(InputError, match=r"expected \(15, k, 3\)"):
        path_predict(squared, FIXED, candidates(2)[:4])
