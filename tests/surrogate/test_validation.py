"""Figures of predicted against computed values, on cases with a closed form."""

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.validation import (
    accuracy,
    coverage,
    held_out_coverage,
    leave_one_out,
    leave_one_out_coverage,
)

COMPUTED = np.array([1.0, 2.0, 4.0, 5.0])


def test_perfect_prediction():
    result = accuracy(COMPUTED, COMPUTED)
    assert result.pearson_percent == pytest.approx(100.0)
    assert result.slope_deg == pytest.approx(45.0)
    assert (result.bias_percent, result.rms_error_percent, result.std_error_percent) == (0.0, 0.0, 0.0)


def test_constant_relative_error_is_all_bias():
    result = accuracy(COMPUTED, 1.1 * COMPUTED)
    assert result.slope_deg == pytest.approx(np.degrees(np.arctan(1.1)))
    assert result.bias_percent == pytest.approx(10.0)
    assert result.mean_abs_error_percent == pytest.approx(10.0)
    assert result.std_error_percent == pytest.approx(0.0, abs=1e-10)


def test_slope_is_of_predicted_on_computed():
    predicted = COMPUTED + np.array([0.1, -0.1, -0.1, 0.1])
    result = accuracy(COMPUTED, predicted)
    slope, _ = np.polyfit(COMPUTED, predicted, 1)
    assert result.slope_deg == pytest.approx(np.degrees(np.arctan(slope)))
    errors = 100.0 * np.array([0.1, -0.05, -0.025, 0.02])
    assert result.mean_abs_error_percent == pytest.approx(np.mean(np.abs(errors)))
    assert result.rms_error_percent**2 == pytest.approx(result.bias_percent**2 + result.std_error_percent**2)


def test_errors_of_negative_values_keep_their_sign():
    assert accuracy(-COMPUTED, -COMPUTED + 0.1).bias_percent > 0.0


def test_leave_one_out_matches_cross_validation():
    inputs = np.random.default_rng(1).random((50, 2))
    output = 3.0 + np.sin(4.0 * inputs[:, 0]) * np.cos(3.0 * inputs[:, 1])
    box = {"lower": [0.0, 0.0], "upper": [1.0, 1.0], "theta": [3.0, 3.0], "nugget": 1e-5}
    predicted = []
    for row in range(50):
        kept = np.arange(50) != row
        predicted.append(Kriging(**box).fit(inputs[kept], output[kept]).predict(inputs[[row]])[0])
    report, expected = leave_one_out(Kriging(**box).fit(inputs, output)), accuracy(output, predicted)
    assert report.as_dict() == pytest.approx(expected.as_dict(), rel=1e-6)


@pytest.mark.parametrize(
    ("computed", "predicted", "message"),
    [
        ([1.0, 0.0], [1.0, 1.0], r"computed\[1\] = 0"),
        ([1.0, 2.0], [1.0, np.nan], "finite numbers only"),
        ([1.0, 2.0], [1.0], "one shape"),
        ([1.0, 1.0], [1.0, 2.0], "values that vary"),
    ],
)
def test_values_without_figures_are_refused(computed, predicted, message):
    with pytest.raises(InputError, match=message):
        accuracy(computed, predicted)


def test_coverage_counts_what_lies_within():
    assert coverage([0.0, 1.0, 2.0, 3.0], [0.1, 1.5, 2.0, 1.0], [0.1, 0.2, 0.0, 1.0]) == 75.0
    assert coverage([0.0, 1.0], [0.3, 1.5], [0.2, 0.2], sigmas=1.0) == 0.0


def test_coverage_is_nominal_for_draws_of_the_process_itself():
    """Outputs drawn from the covariance that is fitted: 95.4 % of them lie within two deviations."""
    rng, inputs = np.random.default_rng(2), np.random.default_rng(1).random((600, 2))
    theta, nugget = np.array([6.0, 9.0]), 1e-2
    distance = np.abs(inputs[:, None] - inputs)
    process = np.linalg.cholesky(np.exp(-(distance**2) @ theta) + nugget * np.eye(600))
    output = 5.0 + process @ rng.standard_normal(600)
    settings = {"trend": "constant", "lower": [0.0, 0.0], "upper": [1.0, 1.0], "theta": theta, "nugget": nugget}
    model = Kriging(**settings).fit(inputs[:300], output[:300])
    assert leave_one_out_coverage(model) == pytest.approx(95.4, abs=2.5)
    assert held_out_coverage(model, inputs[300:], output[300:]) == pytest.approx(95.4, abs=2.5)
    assert held_out_coverage(model, inputs[300:], output[300:], sigmas=1.0) == pytest.approx(68.3, abs=6.0)
