"""Limits: the table, the margin and its exception, power, torque, temperature, tail rotor."""

import numpy as np
import pytest

from vrsopt.aircraft import load_aircraft
from vrsopt.atmosphere import GRAVITY
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.turboshaft.data import load_engine

AIRCRAFT = load_aircraft("bo105")
ENGINE = load_engine(AIRCRAFT.engine)
LIMITS = Limits(AIRCRAFT, ENGINE)
TIP_SPEED = 44.4 * 4.91


def test_names_are_those_of_the_optimisers():
    assert LIMIT_NAMES == (
        "blade loading",
        "engine power",
        "torque",
        "turbine temperature",
        "tail rotor loading",
    )


@pytest.mark.parametrize("mu, limit", [(0.0, 0.145), (0.1, 0.140), (0.2, 0.130), (0.3, 0.115), (0.4, 0.095)])
def test_blade_loading_limit_goes_through_its_table(mu, limit):
    loading, largest = LIMITS.blade_loading(2200.0, 1.225, 44.4, mu * TIP_SPEED)
    assert largest == pytest.approx(limit, rel=1e-9)
    assert loading == pytest.approx(2200 * GRAVITY / (1.225 * 4 * 0.27 * 4.91 * TIP_SPEED**2))


def test_limit_falls_with_advance_ratio_also_beyond_the_table():
    """The tail rotor and a slow main rotor reach 0.45: the polynomial goes on falling and stays positive."""
    mu = np.linspace(0, 0.45, 91)
    largest = LIMITS.blade_loading(2200.0, 1.225, 44.4, mu * TIP_SPEED)[1]
    assert np.all(np.diff(largest) < 0) and largest[-1] > 0.08


def test_margin_divides_the_limit_except_where_the_nominal_rotor_has_less():
    keep = Limits(AIRCRAFT, ENGINE, manoeuvre_margin=1.3)
    light = (1800.0, 1.225, 0.9 * 44.4, 20.0)
    plain = LIMITS.blade_loading_usage(*light, smooth_max=max)
    assert keep.blade_loading_usage(*light, smooth_max=max) == pytest.approx(1.3 * plain)
    heavy = (2500.0 * 1.5, 1.1, 44.4, 50.0)  # beyond the margin at nominal speed: that speed is just allowed
    assert keep.blade_loading_usage(*heavy, smooth_max=max) == pytest.approx(1.0)
    slower = (*heavy[:2], 0.95 * 44.4, 50.0)
    assert keep.blade_loading_usage(*slower, smooth_max=max) > 1.1


def test_power_and_torque():
    assert LIMITS.power_usage(257e3) == pytest.approx(1.0)
    assert LIMITS.torque_usage(257e3, 44.4) == pytest.approx(1.0)
    assert LIMITS.torque_usage(231.3e3, 0.9 * 44.4) == pytest.approx(1.0)
    study = Limits(AIRCRAFT, ENGINE, setting="study")
    assert study.power_usage(313e3) == pytest.approx(1.0, rel=1e-3)
    assert study.torque_usage(300e3, 30.0) == 0.0


def test_temperature():
    assert LIMITS.temperature_usage(LIMITS.temperature) == 1.0
    assert 273.15 + 779 < LIMITS.temperature < 273.15 + 860  # continuous and take-off range of the 250-C20B


def test_tail_rotor_uses_its_own_tip_speed():
    """The curve of the main rotor at the tail rotor's advance ratio, never a larger one."""
    tip = 44.4 * 5.234 * 0.95
    usage = LIMITS.tail_usage(0.13, 44.4, 0.2 * tip)
    assert usage >= 1.0 - 1e-9
    assert LIMITS.tail_usage(0.095, 44.4, 0.4 * tip) == pytest.approx(usage)
    assert LIMITS.tail_usage(0.13, 0.9 * 44.4, 0.2 * tip) > usage
