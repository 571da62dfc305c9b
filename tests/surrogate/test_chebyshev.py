"""Chebyshev tables: exact on polynomials, spectral on smooth functions, equal in numpy and CasADi, contraction."""

import casadi as ca
import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.surrogate import chebyshev

LOWER, UPPER, DEGREES = np.array([1.0, -2.0, 10.0]), np.array([3.0, 2.0, 30.0]), (2, 3, 4)


def polynomial(x):
    return 1.0 + x[..., 0] ** 2 * x[..., 1] ** 3 - 1e-3 * x[..., 2] ** 4 * x[..., 0] + x[..., 1] * x[..., 2]


@pytest.fixture
def table():
    return chebyshev.coefficients(polynomial(chebyshev.grid(LOWER, UPPER, DEGREES)), 3)


def points(count, seed=1):
    return LOWER + (UPPER - LOWER) * np.random.default_rng(seed).random((count, 3))


def test_polynomial_within_the_degrees_is_exact(table):
    where = points(20)
    np.testing.assert_allclose(
        chebyshev.evaluate(table, where, lower=LOWER, upper=UPPER), polynomial(where), rtol=1e-12
    )


def test_coefficients_of_a_single_chebyshev_polynomial():
    t = chebyshev.nodes(-1.0, 1.0, 6)
    np.testing.assert_allclose(chebyshev.coefficients(4 * t**3 - 3 * t, 1), np.eye(7)[3], atol=1e-14)


def test_error_on_a_smooth_function_falls_geometrically():
    where = np.linspace(0.0, 2.0, 101)[:, None]
    errors = []
    for degree in (4, 8, 12):
        values = np.exp(np.sin(2.0 * chebyshev.nodes(0.0, 2.0, degree)))
        series = chebyshev.coefficients(values, 1)
        exact = np.exp(np.sin(2.0 * where[:, 0]))
        errors.append(np.max(np.abs(chebyshev.evaluate(series, where, lower=[0.0], upper=[2.0]) - exact)))
    assert errors[1] < 0.05 * errors[0] and errors[2] < 0.05 * errors[1]


def test_batches_of_tables_and_of_points(table):
    batch = np.stack([table, 2.0 * table])
    at = points(5)
    one = chebyshev.evaluate(table, at, lower=LOWER, upper=UPPER)
    common = chebyshev.evaluate(batch, at, lower=LOWER, upper=UPPER)
    np.testing.assert_allclose(common, np.stack([one, 2.0 * one]))
    own = np.stack([at, points(5, seed=2)])
    each = chebyshev.evaluate(batch, own, lower=LOWER, upper=UPPER)
    np.testing.assert_allclose(each, np.stack([polynomial(own[0]), 2.0 * polynomial(own[1])]), rtol=1e-12)


def test_batched_coefficients_equal_single_ones():
    values = np.random.default_rng(3).random((4, 3, 5))
    together = chebyshev.coefficients(values, 2)
    np.testing.assert_allclose(together[2], chebyshev.coefficients(values[2], 2), rtol=1e-13)


@pytest.mark.parametrize("degrees", [(2, 3, 4), (0, 1, 2), (5,)])
def test_casadi_expression_equals_numpy(degrees):
    lower, upper = LOWER[: len(degrees)], UPPER[: len(degrees)]
    table = np.random.default_rng(4).standard_normal([degree + 1 for degree in degrees])
    x, c = ca.SX.sym("x", len(degrees)), ca.SX.sym("c", table.size)
    value = chebyshev.expression(c, ca.vertsplit(x), degrees, lower=lower, upper=upper)
    function = ca.Function("table", [x, c], [value])
    for point in points(5)[:, : len(degrees)]:
        expected = chebyshev.evaluate(table, point[None], lower=lower, upper=upper)[0]
        assert float(function(point, table.ravel())) == pytest.approx(expected, rel=1e-12)


def test_casadi_expression_costs_one_product_per_coefficient():
    x, c = ca.SX.sym("x", 3), ca.SX.sym("c", 4 * 13 * 11)
    value = chebyshev.expression(c, ca.vertsplit(x), (3, 12, 10), lower=LOWER, upper=UPPER)
    # One load, one product and one sum per coefficient, and a little for the polynomials.
    assert ca.Function("table", [x, c], [value]).n_instructions() < 3.3 * c.numel()


def test_casadi_derivatives_are_those_of_the_polynomial(table):
    x = ca.SX.sym("x", 3)
    value = chebyshev.expression(ca.DM(table.ravel()), ca.vertsplit(x), DEGREES, lower=LOWER, upper=UPPER)
    hessian = ca.Function("hessian", [x], [ca.hessian(value, x)[0]])
    a, b, c = point = np.array([2.2, 0.7, 17.0])
    expected = [
        [2 * b**3, 6 * a * b**2, -4e-3 * c**3],
        [6 * a * b**2, 6 * a**2 * b, 1.0],
        [-4e-3 * c**3, 1.0, -12e-3 * c**2 * a],
    ]
    np.testing.assert_allclose(hessian(point).full(), expected, rtol=1e-9, atol=1e-9)


def test_contraction_equals_evaluation(table):
    at = points(6)
    reduced = chebyshev.contract(table, (0, 2), at[:, [0, 2]], lower=LOWER[[0, 2]], upper=UPPER[[0, 2]])
    assert reduced.shape == (6, 4)
    values = chebyshev.evaluate(reduced, at[:, [1]][:, None, :], lower=LOWER[[1]], upper=UPPER[[1]])[:, 0]
    np.testing.assert_allclose(values, polynomial(at), rtol=1e-12)


def test_contraction_keeps_the_order_of_the_other_axes():
    table = np.random.default_rng(5).standard_normal((3, 4, 5, 6))
    at = np.random.default_rng(6).random((7, 2))
    reduced = chebyshev.contract(table, (2, 0), at, lower=[0.0, 0.0], upper=[1.0, 1.0])
    last = chebyshev.basis(at[:, 0], 0.0, 1.0, 4)
    first = chebyshev.basis(at[:, 1], 0.0, 1.0, 2)
    np.testing.assert_allclose(reduced, np.einsum("abcd,nc,na->nbd", table, last, first), rtol=1e-12)


def test_points_outside_the_box_are_refused_unless_extrapolating(table):
    outside = np.array([[2.0, 2.5, 20.0]])
    with pytest.raises(InputError, match=r"input 1 = 2.5: outside the tabulated box -2 to 2"):
        chebyshev.evaluate(table, outside, lower=LOWER, upper=UPPER)
    value = chebyshev.evaluate(table, outside, lower=LOWER, upper=UPPER, extrapolate=True)
    assert value[0] == pytest.approx(polynomial(outside)[0], rel=1e-10)
    with pytest.raises(InputError, match="outside the tabulated box"):
        chebyshev.contract(table, (1,), outside[:, [1]], lower=[-2.0], upper=[2.0])


def test_shapes_that_do_not_fit_are_refused(table):
    with pytest.raises(InputError, match="59 coefficients"):
        chebyshev.expression(ca.SX.sym("c", 59), [0, 0, 0], DEGREES, lower=LOWER, upper=UPPER)
    with pytest.raises(InputError, match="different axes"):
        chebyshev.contract(table, (1, 1), np.zeros((2, 2)), lower=[-2.0, -2.0], upper=[2.0, 2.0])
    with pytest.raises(InputError, match="lower < upper"):
        chebyshev.nodes(2.0, 1.0, 3)
