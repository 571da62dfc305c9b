"""Kriging in CasADi and along a path: the same mean, exact derivatives, error of the polynomials, optima, windows."""

import logging

import analytic_rotor as rotor
import casadi as ca
import numpy as np
import pytest
from scipy.optimize import minimize

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.surrogate import chebyshev
from vrsopt.surrogate.correlation import CORRELATIONS
from vrsopt.surrogate.export import FREE, METHODS, path_coefficients, path_predict, to_casadi
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.space import FLIGHT, LEVEL

COLUMNS = [LEVEL.names.index(name) for name in FREE]
FREE_LOWER, FREE_UPPER = rotor.LOWER[COLUMNS], rotor.UPPER[COLUMNS]
FIXED = {"speed": np.linspace(0.0, 70.0, 15), "altitude": np.linspace(2000.0, 0.0, 15)}
THETA = {"mass": 0.3, "altitude": 0.1, "speed": 2.0, "rotor_speed": 0.8, "twist": 0.2, "climb_angle": 0.2}
KINDS = (*CORRELATIONS, "gradient-enhanced")


def flight_power(inputs):
    """Power of seven variables: the weight times the load factor, and the climb."""
    level = inputs[:, :5].copy()
    level[:, 0] *= inputs[:, 6]
    return rotor.shaft_power(level) + inputs[:, 0] * 9.81 * inputs[:, 2] * np.sin(inputs[:, 5])


def slopes(function, inputs, span):
    steps = np.diag(1e-5 * span)
    return np.stack([(function(inputs + s) - function(inputs - s)) / (2 * s.max()) for s in steps], axis=1)


def model(kind, *, order=(0, 1, 2, 3, 4), space=LEVEL, rows=None):
    """Fast to make: theta is given. The inputs of the space in any ``order``."""
    order = list(order)
    lower, upper = np.array(space.lower), np.array(space.upper)
    count = rows or (80 if kind == "gradient-enhanced" else 300)
    inputs = lower + (upper - lower) * np.random.default_rng(1).random((count, len(lower)))
    names = [space.names[k] for k in order]
    function = rotor.shaft_power if space is LEVEL else flight_power
    settings = {"names": names, "lower": lower[order], "upper": upper[order], "nugget": 1e-6}
    settings["theta"] = [THETA.get(name, 0.2) for name in names]
    if kind == "gradient-enhanced":
        fitted = Kriging("matern52", gradient_nugget=1e-6, trend="linear", **settings)
        return fitted.fit(inputs[:, order], function(inputs), slopes(function, inputs, upper - lower)[:, order])
    return Kriging(kind, **settings).fit(inputs[:, order], function(inputs))


@pytest.fixture(scope="module", params=KINDS)
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


def differentiated(exported):
    """Value (N,), gradient (N, f), Hessian (N, f, f) and their sparsity counts, by CasADi."""
    x = ca.MX.sym("x", exported.function.size_in(0))
    y = exported(x)
    hessian, gradient = ca.hessian(ca.sum2(y), x)
    every = ca.Function("all", [x], [y, gradient, hessian, ca.jacobian(y, x)])

    def at(points):
        value, gradient, hessian, jacobian = every(points.T)
        size, f = points.shape
        assert (jacobian.nnz(), hessian.nnz()) == (size * f, size * f * f)
        blocks = np.array(hessian).reshape(size, f, size, f)[range(size), :, range(size)]
        return np.array(value)[0], np.array(gradient).reshape(f, size, order="F").T, blocks

    return at


def same(found, expected, tolerance):
    for one, other in zip(found, expected, strict=True):
        assert np.max(np.abs(one - other)) <= tolerance * np.max(np.abs(other))


def test_path_prediction_equals_prediction(kriging):
    free = candidates(20)
    expected = kriging.predict(full_points(free).reshape(-1, 5)).reshape(15, 20)
    np.testing.assert_allclose(path_predict(kriging, FIXED, free), expected, rtol=1e-7)


def test_callback_has_the_derivatives_of_the_kriging(kriging):
    exported = to_casadi(kriging, fixed=FIXED, free=FREE)
    smooth = kriging.smoothed(0.1) if kriging.correlation == "exponential" else kriging
    free = candidates(1)[:, 0]
    points = full_points(free[:, None])[:, 0]
    expected = (smooth.predict(points), smooth.gradient(points)[:, COLUMNS])
    expected += (smooth.hessian(points)[:, COLUMNS][:, :, COLUMNS],)
    same(differentiated(exported)(free), expected, 1e-7)
    assert exported.error == exported.largest_error == 0.0


@pytest.mark.parametrize("method", METHODS)
def test_derivatives_are_those_of_differences(kriging, method):
    exported = to_casadi(kriging, method=method, fixed=FIXED, free=FREE)
    at = differentiated(exported)
    free = np.clip(candidates(1)[:, 0], FREE_LOWER * 1.01, FREE_UPPER * 0.99)
    _, gradient, hessian = at(free)
    for k, step in enumerate(1e-4 * (FREE_UPPER - FREE_LOWER)):
        low, high = free.copy(), free.copy()
        low[:, k] -= step
        high[:, k] += step
        below, above = at(low), at(high)
        slope, bend = ((b - a) / (2 * step) for a, b in zip(below[:2], above[:2], strict=True))
        same((gradient[:, k], hessian[:, k]), (slope, bend), 2e-5)


def test_polynomials_say_how_far_they_are_from_the_kriging(kriging):
    exported = to_casadi(kriging, method="chebyshev", fixed=FIXED, free=FREE)
    smooth = kriging.smoothed(0.1) if kriging.correlation == "exponential" else kriging
    free = candidates(40, seed=7)
    exact = path_predict(smooth, FIXED, free)
    found = np.stack([np.array(exported(free[:, k].T))[0] for k in range(free.shape[1])], axis=1)
    error = np.sqrt(np.mean((found - exact) ** 2) / np.mean(exact**2))
    assert error == pytest.approx(exported.error, rel=0.3)
    assert exported.error < exported.largest_error < 2e-3
    if kriging.correlation == "squared_exponential":
        assert exported.largest_error < 1e-4
        assert to_casadi(kriging, method="chebyshev", fixed=FIXED, degrees=(2, 2, 2)).error > 10 * exported.error


def test_a_narrow_window_needs_fewer_degrees_or_has_less_error(squared):
    window = {"mass": (1900.0, 2100.0), "rotor_speed": (38.0, 46.0)}
    whole, part = (
        to_casadi(squared, method="chebyshev", fixed=FIXED, degrees=(3, 5, 4), window=w) for w in ({}, window)
    )
    assert part.error < 0.05 * whole.error
    np.testing.assert_array_equal(part.lower, [1900.0, 38.0, FREE_LOWER[2]])


def test_polynomials_can_be_saved(squared):
    exported = to_casadi(squared, method="chebyshev", fixed=FIXED)
    again = ca.Function.deserialize(exported.function.serialize())
    free = candidates(1)[:, 0].T
    np.testing.assert_array_equal(np.array(again(free)), np.array(exported(free)))


@pytest.mark.parametrize("kind", ["squared_exponential", "gradient-enhanced"])
def test_seven_variables(kind):
    kriging = model(kind, space=FLIGHT, order=range(7), rows=200)
    lower, upper = np.array(FLIGHT.lower), np.array(FLIGHT.upper)
    points = lower + (upper - lower) * np.random.default_rng(3).random((6, 7))
    expected = kriging.predict(points), kriging.gradient(points), kriging.hessian(points)
    same(differentiated(to_casadi(kriging, size=6))(points), expected, 1e-7)
    fixed = {name: points[:, FLIGHT.names.index(name)] for name in ("altitude", "speed", "climb_angle", "load_factor")}
    part = [expected[0], expected[1][:, [0, 3, 4]], expected[2][:, [0, 3, 4]][:, :, [0, 3, 4]]]
    same(differentiated(to_casadi(kriging, fixed=fixed))(points[:, [0, 3, 4]]), part, 1e-6)
    polynomials = to_casadi(kriging, method="chebyshev", fixed=fixed)
    error = np.abs(np.array(polynomials(points[:, [0, 3, 4]].T))[0] - expected[0])
    assert np.max(error) < 2.0 * polynomials.largest_error * np.max(expected[0])
    assert polynomials.error < 1e-3


def test_all_inputs_free_as_polynomial(squared):
    exported = to_casadi(squared, method="chebyshev", size=4, degrees=(3, 2, 7, 5, 3))
    points = rotor.design(4, seed=6)
    np.testing.assert_allclose(np.array(exported(points.T))[0], squared.predict(points), rtol=2e-3)
    with pytest.raises(InputError, match=r"coefficients of degrees .*: at most 60000; fix more inputs"):
        to_casadi(squared, method="chebyshev", size=4, degrees=(9, 9, 9, 9, 9))


@pytest.mark.parametrize("method", METHODS)
def test_exponential_enters_casadi_smoothed_and_says_so(method, caplog):
    rough = model("exponential", rows=150)
    with caplog.at_level(logging.WARNING):
        exported = to_casadi(rough, method=method, fixed=FIXED, free=FREE)
    assert "smoothed with eps = 0.1" in caplog.text
    free = candidates(1)
    expected = rough.smoothed(0.1).predict(full_points(free)[:, 0])
    np.testing.assert_allclose(
        np.array(exported(free[:, 0].T))[0], expected, rtol=1e-9 if method == "callback" else 2e-3
    )
    caplog.clear()
    with caplog.at_level(logging.WARNING):
        to_casadi(rough.smoothed(0.05), method=method, fixed=FIXED, free=FREE)
    assert not caplog.text


MASS = np.linspace(2200.0, 1700.0, 15)


def solve(exported, *, burn=None):
    """Least power over all nodes by IPOPT with the exact Hessian; scaled variables. With ``burn`` [kg/J per node] the
    mass is free and falls with the power. Result: inputs (f, N), objective, iterations."""
    span, size = exported.upper - exported.lower, len(MASS)
    z = ca.MX.sym("z", len(span), size)
    x = ca.DM(exported.lower) + ca.DM(span) * z
    power = exported(x)
    equations = ca.MX(0, 1)
    if burn is not None:
        equations = (x[0, 1:] - x[0, :-1] + burn * power[:-1]).T / 100.0
        equations = ca.vertcat(equations, (x[0, 0] - 2200.0) / 100.0)
    problem = {"x": ca.vec(z), "f": ca.sum2(power) / 1e6, "g": equations}
    quiet = {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes", "ipopt.tol": 1e-9}
    solver = ca.nlpsol("solver", "ipopt", problem, quiet)
    answer = solver(x0=0.5, lbx=0.0, ubx=1.0, lbg=0.0, ubg=0.0)
    assert solver.stats()["return_status"] == "Solve_Succeeded"
    scaled = np.array(answer["x"]).reshape(len(span), size, order="F")
    return exported.lower[:, None] + span[:, None] * scaled, float(answer["f"]), solver.stats()["iter_count"]


def test_optimum_is_that_of_scipy_on_the_prediction(squared):
    fixed = {**FIXED, "mass": MASS}
    exact, least, iterations = solve(to_casadi(squared, fixed=fixed))
    polynomials, nearly, also = solve(to_casadi(squared, method="chebyshev", fixed=fixed))
    assert iterations <= 25 and also <= 25
    assert nearly == pytest.approx(least, rel=1e-5)
    widths = (FREE_UPPER - FREE_LOWER)[1:]
    np.testing.assert_allclose(exact / widths[:, None], polynomials / widths[:, None], atol=5e-3)
    inside = np.clip(exact.T, FREE_LOWER[1:], FREE_UPPER[1:])
    best = squared.predict(np.column_stack([MASS, FIXED["altitude"], FIXED["speed"], inside]))
    assert least == pytest.approx(np.sum(best) / 1e6, rel=1e-7)
    for k in (0, 7, 14):
        at = np.array([MASS[k], FIXED["altitude"][k], FIXED["speed"][k]])

        def power(scaled, at=at):
            free = FREE_LOWER[1:] + widths * np.clip(scaled, 0.0, 1.0)
            return squared.predict(np.concatenate([at, free])[None])[0] / 1e6

        found = minimize(power, [0.5, 0.5], bounds=[(0.0, 1.0)] * 2, tol=1e-10)
        assert best[k] / 1e6 == pytest.approx(found.fun, rel=1e-6)


def test_optimum_with_a_mass_that_burns_off(kriging):
    """The objective couples the nodes through the mass; a window in which the mass stays says nothing."""
    exact, least, iterations = solve(to_casadi(kriging, fixed=FIXED, free=FREE), burn=1e-4)
    assert iterations <= 40
    exported = to_casadi(kriging, method="chebyshev", fixed=FIXED, free=FREE, window={"mass": (1500.0, 2300.0)})
    found, nearly, _ = solve(exported, burn=1e-4)
    assert nearly == pytest.approx(least, rel=1e-3 if kriging.correlation == "exponential" else 2e-4)
    np.testing.assert_allclose(found[0], exact[0], atol=1.0)
    exported.check(found)


def test_a_window_that_holds_the_solution_back_is_noticed(squared):
    fixed = {**FIXED, "mass": MASS}
    for method in METHODS:
        exported = to_casadi(squared, method=method, fixed=fixed, window={"rotor_speed": (42.0, 46.0)})
        found, _, _ = solve(exported)
        assert np.any(found[0] < 42.01)
        with pytest.raises(
            NoSolutionError, match=r"rotor_speed = 42 at node \d+: .* an end of the window 42 to 46"
        ) as caught:
            exported.check(found)
        assert "\n" not in str(caught.value)


def test_only_the_sides_that_are_narrower_than_the_box_count(squared):
    exported = to_casadi(squared, fixed=FIXED, window={"mass": (1400.0, 2000.0)})
    inside = np.tile([[1700.0], [44.4], [0.14]], 15)
    exported.check(inside)
    for row, value in ((0, 1400.0), (1, FREE_UPPER[1]), (2, FREE_LOWER[2])):
        edge = inside.copy()
        edge[row, 4] = value
        exported.check(edge)
    for row, value, message in (
        (0, 1999.9, r"mass = 1999.9 at node 4: .* of the window 1400 to 2000"),
        (0, 2010.0, r"mass = 2010 at node 4: 1.7 % of the width beyond an end of the window"),
        (1, 52.0, r"rotor_speed = 52 at node 4: .* beyond an end of the sampled box 31.08 to 51.06"),
        (2, np.nan, "twist = nan at node 4"),
    ):
        wrong = inside.copy()
        wrong[row, 4] = value
        with pytest.raises(NoSolutionError, match=message):
            exported.check(wrong)
    with pytest.raises(InputError, match=r"shape \(15, 3\): expected \(3, 15\)"):
        exported.check(inside.T)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"method": "spline"}, "method = 'spline': one of callback, chebyshev"),
        ({"window": {"speed": (0.0, 1.0)}}, "window of 'speed': one of the free inputs mass, rotor_speed, twist"),
        ({"window": {"mass": (2000.0, 1500.0)}}, "window of mass = 2000.0 to 1500.0: low < high"),
        ({"window": {"mass": (1000.0, 1500.0)}}, "mass = 1000: outside the sampled box"),
        ({"degrees": (2, 2)}, "of the method 'chebyshev' only"),
        ({"method": "chebyshev", "degrees": (2, 2)}, r"degrees = \(2, 2\): at least 1 for each of mass"),
        ({"method": "chebyshev", "degrees": (2, 0, 2)}, r"degrees = \(2, 0, 2\): at least 1"),
        ({"size": 14}, "size = 14: the number of points, 15"),
        ({"fixed": {}}, "size = None: the number of points, as nothing is fixed"),
        ({"free": ("mass", "twist")}, "each of mass, altitude"),
        ({"fixed": {**FIXED, "speed": np.full(15, np.nan)}}, "speed = nan: finite numbers only"),
        ({"fixed": {**FIXED, "speed": np.zeros(14)}}, r"shapes \[\(14,\), \(15,\)\]: one shape"),
    ],
)
def test_what_does_not_fit_the_model_is_refused(squared, settings, message):
    with pytest.raises(InputError, match=message):
        to_casadi(squared, **{"fixed": FIXED, **settings})


def test_chebyshev_error_falls_with_the_degree_and_is_below_a_hundredth_of_a_per_cent(squared):
    free = candidates(60, seed=4)
    exact = path_predict(squared, FIXED, free)
    errors = []
    for degrees in ((2, 3, 3), (3, 6, 5), (5, 9, 7)):
        table = path_coefficients(squared, FIXED, FREE_LOWER, FREE_UPPER, degrees)
        assert table.shape == (15, *(degree + 1 for degree in degrees))
        values = chebyshev.evaluate(table, free, lower=FREE_LOWER, upper=FREE_UPPER)
        errors.append(np.sqrt(np.mean((values / exact - 1.0) ** 2)))
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-5


def test_variables_go_by_name_not_by_position(squared):
    turned = model("squared_exponential", order=(4, 2, 0, 3, 1))
    free = candidates(5)
    expected = path_predict(squared, FIXED, free)
    np.testing.assert_allclose(path_predict(turned, FIXED, free), expected, rtol=1e-6)
    one, other = (np.array(to_casadi(k, fixed=FIXED, free=FREE)(free[:, 0].T)) for k in (squared, turned))
    np.testing.assert_allclose(one, other, rtol=1e-6)


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
