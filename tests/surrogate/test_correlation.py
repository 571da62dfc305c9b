"""One-dimensional correlations and their derivatives, against differences; trends."""

import numpy as np
import pytest

from vrsopt.surrogate import trend as trends
from vrsopt.surrogate.correlation import (
    CORRELATIONS,
    DIFFERENTIABLE,
    correlate,
    correlation_matrix,
    factor,
    log_theta_ratio,
    log_theta_ratios,
)

DISTANCES = np.array([-0.9, -0.31, -0.02, 0.003, 0.2, 0.77])
FAMILIES = [*((name, 0.0) for name in CORRELATIONS), ("exponential", 0.1)]


@pytest.mark.parametrize(("correlation", "smoothing"), FAMILIES)
@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivatives_by_the_distance(correlation, smoothing, order):
    step = 1e-6
    high, low = (factor(correlation, smoothing, 1.7, DISTANCES + sign * step, order - 1) for sign in (1, -1))
    exact = factor(correlation, smoothing, 1.7, DISTANCES, order)
    np.testing.assert_allclose(exact, (high - low) / (2 * step), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("correlation", CORRELATIONS)
def test_derivative_by_log_theta(correlation):
    step = 1e-6
    high, low = (factor(correlation, 0.0, 1.7 * np.exp(sign * step), DISTANCES) for sign in (1, -1))
    exact = log_theta_ratio(correlation, 1.7, DISTANCES) * factor(correlation, 0.0, 1.7, DISTANCES)
    np.testing.assert_allclose(exact, (high - low) / (2 * step), rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("correlation", DIFFERENTIABLE)
def test_derivatives_by_log_theta_of_each_order(correlation):
    step = 1e-6
    for order, ratio in enumerate(log_theta_ratios(correlation, 1.7, DISTANCES)):
        high, low = (factor(correlation, 0.0, 1.7 * np.exp(sign * step), DISTANCES, order) for sign in (1, -1))
        exact = ratio * factor(correlation, 0.0, 1.7, DISTANCES)
        np.testing.assert_allclose(exact, (high - low) / (2 * step), rtol=1e-6, atol=1e-7)


def test_published_values():
    """At one length: exp(-1), exp(-1) and Matern's (1 + sqrt 5 + 5/3) exp(-sqrt 5) = 0.52399."""
    one = np.array([1.0])
    assert factor("exponential", 0.0, 1.0, -one)[0] == pytest.approx(np.exp(-1.0), rel=1e-15)
    assert factor("squared_exponential", 0.0, 1.0, one)[0] == pytest.approx(np.exp(-1.0), rel=1e-15)
    assert factor("matern52", 0.0, 1.0, one)[0] == pytest.approx(0.52399411, rel=1e-7)


def test_only_the_exponential_has_a_kink():
    """The slope jumps by 2 theta across a sample; for the others it goes through zero."""
    tiny = np.array([-1e-9, 1e-9])
    assert np.diff(factor("exponential", 0.0, 3.0, tiny, 1))[0] == pytest.approx(-6.0)
    for correlation, smoothing in (("matern52", 0.0), ("squared_exponential", 0.0), ("exponential", 0.1)):
        assert abs(np.diff(factor(correlation, smoothing, 3.0, tiny, 1))[0]) < 1e-6


@pytest.mark.parametrize(("correlation", "smoothing"), FAMILIES)
def test_matrix_is_the_product_of_the_factors_and_positive_definite(correlation, smoothing):
    scaled, theta = np.random.default_rng(1).random((70, 3)), np.array([2.0, 0.6, 5.0])
    expected = np.prod(
        [factor(correlation, smoothing, theta[k], scaled[:, None, k] - scaled[:, k]) for k in range(3)], axis=0
    )
    upper = correlation_matrix(correlation, smoothing, theta, scaled)
    np.testing.assert_allclose(np.triu(upper), np.triu(expected), rtol=1e-12)
    difference = scaled[:, :, None] - scaled.T[None]
    np.testing.assert_allclose(correlate(correlation, smoothing, theta, difference), expected, rtol=1e-12)
    assert np.linalg.eigvalsh(expected)[0] > -1e-12


@pytest.mark.parametrize("kind", trends.TRENDS)
def test_trend_terms_and_their_derivatives(kind):
    rng = np.random.default_rng(2)
    scaled = rng.random((6, 3))
    basis = trends.basis(scaled, kind)
    assert basis.shape == (6, {"constant": 1, "linear": 4, "quadratic": 10}[kind]) == (6, trends.size(3, kind))
    step = 1e-6
    for k, gradient in enumerate(trends.basis_gradient(scaled, kind)):
        shift = step * np.eye(3)[k]
        high, low = trends.basis(scaled + shift, kind), trends.basis(scaled - shift, kind)
        np.testing.assert_allclose(gradient, (high - low) / (2 * step), atol=1e-8)
    for orders in ((0, 0, 0), (1, 0, 0), (0, 1, 1), (0, 0, 2)):
        product = np.prod([trends.factors(scaled[:, k], k, 3, kind, order) for k, order in enumerate(orders)], axis=0)
        if sum(orders) == 0:
            np.testing.assert_allclose(product, basis)
        elif sum(orders) == 1:
            np.testing.assert_allclose(product, trends.basis_gradient(scaled, kind)[0])
        else:
            coefficients = rng.random(basis.shape[1])
            i, j = [k for k, order in enumerate(orders) for _ in range(order)]
            form = trends.quadratic_form(coefficients, 3, kind)
            np.testing.assert_allclose(product @ coefficients, form[1 + i, 1 + j], atol=1e-12)
