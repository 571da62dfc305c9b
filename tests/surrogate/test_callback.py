"""Numpy functions of many points in CasADi: sparsity, derivatives, one evaluation for each x, life of the callbacks."""

import gc

import casadi as ca
import numpy as np
import pytest

from vrsopt.surrogate.callback import pointwise

SIZE = 7
WEIGHT = np.array([0.5, -1.0, 2.0])


class Wave:
    """exp(w . x) + x_0 x_1 with its derivatives; counts how often it is asked."""

    def __init__(self):
        self.asked = 0

    def __call__(self, points):
        self.asked += 1
        value = np.exp(points @ WEIGHT)
        gradient = value[:, None] * WEIGHT
        hessian = value[:, None, None] * np.outer(WEIGHT, WEIGHT)
        gradient[:, [0, 1]] += points[:, [1, 0]]
        hessian[:, [0, 1], [1, 0]] += 1.0
        return value + points[:, 0] * points[:, 1], gradient, hessian


def at(seed=0):
    return np.random.default_rng(seed).standard_normal((3, SIZE))


def block_diagonal(blocks):
    return np.array(ca.diagcat(*[ca.DM(block) for block in blocks]))


def lagrangian(function):
    """Value, Jacobian and Hessian of the weighted sum, as an NLP asks for them."""
    x, weights = ca.MX.sym("x", 3, SIZE), ca.MX.sym("l", SIZE)
    y = function(x)
    hessian, _ = ca.hessian(ca.dot(weights, y.T), x)
    return ca.Function("all", [x, weights], [y, ca.jacobian(y, x), hessian])


def test_value_jacobian_and_hessian_are_those_of_the_function():
    every = lagrangian(pointwise("wave", Wave(), 3, SIZE))
    x, weights = at(), np.linspace(-1.0, 2.0, SIZE)
    value, gradient, hessian = Wave()(x.T)
    y, jacobian, bend = every(x, weights)
    np.testing.assert_array_equal(np.array(y), value[None])
    np.testing.assert_array_equal(np.array(jacobian), block_diagonal(gradient[:, None]))
    np.testing.assert_allclose(np.array(bend), block_diagonal(weights[:, None, None] * hessian), rtol=1e-15)
    assert (jacobian.nnz(), bend.nnz()) == (3 * SIZE, 9 * SIZE)


def test_one_evaluation_for_each_x_whatever_is_asked_in_which_order():
    wave = Wave()
    function = pointwise("wave", wave, 3, SIZE)
    first, second = ca.MX.sym("a", 3, SIZE), ca.MX.sym("b", 3, SIZE)
    total = ca.sum2(function(first) * function(second))
    both = ca.vertcat(ca.vec(first), ca.vec(second))
    every = ca.Function("all", [first, second], [total, *ca.hessian(total, both)])
    every(at(1), at(2))
    every(at(1), at(3))
    assert wave.asked == 3
    function(at(3))
    assert wave.asked == 3


def test_results_are_not_kept_for_ever():
    wave = Wave()
    function = pointwise("wave", wave, 3, SIZE)
    for seed in range(20):
        function(at(seed))
    function(at(0))
    assert wave.asked == 21


def test_lives_as_long_as_what_is_made_of_it():
    """CasADi knows no Python references: without help the callbacks are deleted under its feet."""
    every = lagrangian(pointwise("wave", Wave(), 3, SIZE))
    gc.collect()
    assert np.all(np.isfinite(np.array(every(at(), 1.0)[2])))


def test_failure_of_the_function_reaches_the_caller():
    def broken(points):
        raise ArithmeticError("no value there")

    with pytest.raises(RuntimeError, match="no value there"):
        pointwise("broken", broken, 3, SIZE)(at())
