"""Ground effect on the momentum rotor: the ratios of Cheeseman and Bennett, and its limits."""

import casadi as ca
import numpy as np
import pytest

from vrsopt.rotor.ground import LARGEST_PROXIMITY, ground_factor

HEIGHTS = np.array([0.5, 0.8, 1.0, 1.5, 2.0])  # z / R
THRUST_RATIO = np.array([1.3333, 1.1082, 1.0667, 1.0286, 1.0159])  # at constant power


def power(thrust: float, proximity: float) -> float:
    """Ideal induced power of a hovering momentum rotor, C_P = C_T lambda f."""
    induced = np.sqrt(thrust / 2)
    return float(thrust * induced * ground_factor(proximity, 0.0, induced))


@pytest.mark.parametrize(("height", "ratio"), list(zip(HEIGHTS, THRUST_RATIO, strict=True)))
def test_thrust_at_constant_power(height, ratio):
    assert power(0.006 * ratio, 1 / height) == pytest.approx(power(0.006, 0.0), rel=2e-4)


def test_closest_rotor_is_the_last_row_of_the_table():
    assert 1 / LARGEST_PROXIMITY == HEIGHTS[0]


def test_no_effect_far_away_and_little_in_fast_flight():
    assert ground_factor(0.0, 0.1, 0.05) == 1
    assert ground_factor(2.0, 0.2, 0.02) == pytest.approx(1, abs=0.005)
    factors = [float(ground_factor(1.5, mu, 0.05)) for mu in (0.0, 0.02, 0.05, 0.1, 0.2)]
    assert np.all(np.diff(factors) > 0) and factors[0] < 0.8


def test_smooth_through_hover_and_no_inflow():
    mu, induced = ca.SX.sym("mu"), ca.SX.sym("induced")
    factor = ground_factor(1.5, mu, induced)
    slopes = ca.Function("slopes", [mu, induced], [ca.gradient(factor, ca.vertcat(mu, induced))])
    for point in ((0.0, 0.05), (0.0, 0.0)):
        assert np.array(slopes(*point)) == pytest.approx(0.0, abs=1e-6)
