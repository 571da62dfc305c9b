"""Periodic filters against marching the same differential equation in small steps."""

from math import pi

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vrsopt.rotor.periodic import driven, fed, lagged, rate_of_change


def rate(t: float | np.ndarray) -> float | np.ndarray:
    return 1.3 + 0.9 * np.sin(t) + 0.2 * np.cos(3 * t)


def value(t: float | np.ndarray) -> float | np.ndarray:
    return np.cos(t) + 0.5 * np.sin(2 * t) ** 3


def gate(t: float | np.ndarray) -> float | np.ndarray:
    return 0.5 + 0.5 * np.tanh(4 * np.sin(t + 0.3))


def slope(t: float) -> float:
    return float(-np.sin(t) + 3 * np.sin(2 * t) ** 2 * np.cos(2 * t))


def marched(right, count: int) -> np.ndarray:
    """Values at ``count`` times of the last of six periods."""
    times = 5 * 2 * pi + 2 * pi * np.arange(count) / count
    result = solve_ivp(lambda t, x: right(t, x), (0, times[-1]), [0.0], t_eval=times, rtol=1e-10, atol=1e-12)
    return result.y[0]


def series(*functions, count: int) -> list[ca.DM]:
    t = 2 * pi * np.arange(count) / count
    return [ca.DM(np.asarray(f(t))) for f in functions]


def solved(result: ca.MX | ca.DM) -> np.ndarray:
    return ca.evalf(ca.MX(result)).full().ravel()


def test_lag_converges_to_the_marched_solution_with_second_order():
    errors = []
    for count in (24, 48, 96):
        u, a = series(value, lambda t: rate(t) * 2 * pi / len(t), count=count)
        expected = marched(lambda t, x: rate(t) * (value(t) - x), count)
        errors.append(np.abs(solved(lagged(a, u)) - expected).max())
    assert errors[2] < 2e-3 and np.log2(errors[0] / errors[1]) > 1.7 and np.log2(errors[1] / errors[2]) > 1.7, errors


def test_fed_filter_converges_to_the_marched_solution():
    errors = []
    for count in (48, 96, 192):
        u, a, g = series(value, lambda t: rate(t) * 2 * pi / len(t), gate, count=count)
        expected = marched(lambda t, x: gate(t) * slope(t) - rate(t) * x, count)
        errors.append(np.abs(solved(fed(a, u, g)) - expected).max())
    assert errors[2] < 4e-3 and np.log2(errors[1] / errors[2]) > 1.7, errors


def test_driven_filter_counts_time_while_its_gate_is_open():
    """A clock that hardly leaks while it runs and falls back fast when it stops: no overshoot where the rate jumps."""
    count, leak, back = 36, 1e-3, 5.0
    is_open = np.zeros(count)
    is_open[10:16] = 1.0
    rates = ca.DM(leak + back * (1 - is_open))
    clock = solved(driven(rates, ca.DM(is_open)))
    assert np.diff(clock[10:16]) == pytest.approx(np.ones(5), rel=0.01)
    assert 5.0 < clock.max() < 6.0
    assert clock[20:].max() < 1e-6
    u, a = series(value, lambda t: rate(t) * 2 * pi / len(t), count=36)
    constant = ca.DM.ones(36) * 0.3
    assert solved(driven(constant, constant * u)) == pytest.approx(solved(lagged(constant, u)), abs=1e-14)


def test_lag_is_exact_for_constant_rate_and_straight_input():
    """A triangle wave through a first-order lag, solved in closed form on each straight piece."""
    count, a = 8, 0.35
    t = np.arange(count)
    u = np.abs(t - 4.0)
    x = solved(lagged(ca.DM.ones(count) * a, ca.DM(u)))
    for k in range(count):
        rise = u[(k + 1) % count] - u[k]
        end = u[k] + rise * (1 - 1 / a) + (x[k] - u[k] + rise / a) * np.exp(-a)
        assert x[(k + 1) % count] == pytest.approx(end, abs=1e-12)


def test_slow_and_fast_lags():
    """Very slow: the mean. Very fast: the input itself."""
    u = series(value, count=36)[0]
    slow = solved(lagged(ca.DM.ones(36) * 1e-6, u))
    assert slow == pytest.approx(np.mean(u.full()) * np.ones(36), abs=1e-4)
    assert solved(lagged(ca.DM.ones(36) * 1e3, u)) == pytest.approx(u.full().ravel(), abs=2e-3)


def test_columns_are_independent():
    u, a = series(value, lambda t: rate(t) * 2 * pi / len(t), count=36)
    both = ca.evalf(lagged(ca.MX(ca.horzcat(a, 2 * a)), ca.MX(ca.horzcat(u, -u)))).full()
    assert both[:, 0] == pytest.approx(solved(lagged(a, u)), abs=1e-14)
    assert both[:, 1] == pytest.approx(solved(lagged(2 * a, -u)), abs=1e-14)


def test_rate_of_change_of_a_wave():
    t = 2 * pi * np.arange(72) / 72
    assert solved(rate_of_change(ca.DM(np.sin(t)), 2 * pi / 72)) == pytest.approx(np.cos(t), abs=2e-3)
