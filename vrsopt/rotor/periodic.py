"""First-order linear filters of series that repeat, as scans over N uniform times of one period.

Each step is the exponential integral of the linear equation with its input interpolated linearly (D. A. Pope, Comm. ACM
6, 1963); the start is the one that repeats.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import casadi as ca


def lagged(rates: Any, values: Any) -> Any:
    """Periodic solutions of x' = rate (u - x), one in each column of (N, E); ``rates`` per time step.

    Exact for u linear and a rate that is constant over each step: x+ = e x + u (w - e) + u+ (1 - w), e = exp(-z), w =
    (1 - e)/z. ``values``: u, (N, E).
    """
    return _columns(_lag, rates, values)


def driven(rates: Any, sources: Any) -> Any:
    """Periodic solutions of x' = s - rate x, one in each column of (N, E); ``rates`` and ``sources`` per time step.

    Exact for s linear and a rate that is constant over each step, also where s / rate would jump.
    """
    return _columns(_drive, rates, sources)


def fed(rates: Any, values: Any, feed: Any) -> Any:
    """Periodic solutions of x' = feed u' - rate x, one in each column of (N, E); ``rates`` per time step.

    ``values``: u, (N, E).
    """
    return _columns(_feed, rates, values, feed)


def rate_of_change(values: Any, step: Any) -> Any:
    """Central differences by time (N, E) around the circle; ``step`` between two rows.

    ``values`` (N, E).
    """
    return (ca.vertcat(values[1:, :], values[0, :]) - ca.vertcat(values[-1, :], values[:-1, :])) / (2 * step)


def _columns(scan: Callable[..., Any], *series: Any) -> Any:
    count, columns = series[0].shape
    return _kernel(scan, len(series), count).map(columns)(*series)


@cache
def _kernel(scan: Callable[..., Any], arguments: int, count: int) -> ca.Function:
    series = [ca.SX.sym(f"u{k}", count) for k in range(arguments)]
    return ca.Function("scan", series, [scan(*series)])


def _lag(rates: Any, values: Any) -> Any:
    z = 0.5 * (rates + _ahead(rates))
    e = ca.exp(-z)
    w = (1 - e) / z
    return _scan(e, values * (w - e) + _ahead(values) * (1 - w))


def _drive(rates: Any, sources: Any) -> Any:
    z = 0.5 * (rates + _ahead(rates))
    e = ca.exp(-z)
    w = (1 - e) / z
    return _scan(e, (sources * (w - e) + _ahead(sources) * (1 - w)) / z)


def _feed(rates: Any, values: Any, feed: Any) -> Any:
    z = 0.5 * (rates + _ahead(rates))
    e = ca.exp(-z)
    return _scan(e, 0.5 * (feed + _ahead(feed)) * (_ahead(values) - values) * (1 - e) / z)


def _scan(factors: Any, sources: Any) -> Any:
    """The x (N,) with x[k+1] = factors[k] x[k] + sources[k] around the circle."""
    end: Any = 0
    product: Any = 1
    for factor, source in zip(ca.vertsplit(factors), ca.vertsplit(sources), strict=True):
        end, product = factor * end + source, product * factor
    x = [end / (1 - product)]
    for k in range(factors.shape[0] - 1):
        x.append(factors[k] * x[k] + sources[k])
    return ca.vertcat(*x)


def _ahead(values: Any) -> Any:
    """The values one step later, around the circle."""
    return ca.vertcat(values[1:], values[0])
