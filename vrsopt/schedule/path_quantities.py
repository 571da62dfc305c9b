"""What can be asked of the aircraft on its way besides fuel flow and limits: for constraints and costs of users."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import casadi as ca

from vrsopt.errors import InputError

EMITTED = ("nox", "co", "co2")  # kg/s, all engines

# W of one engine; W of main and tail rotor, without what speeds the rotor up; N m of all engines, as the main rotor's
# shaft turns; K between the turbines; n m g / (rho A_b (Omega R)^2); kg/s of all engines
QUANTITY_NAMES = ("power_per_engine", "rotor_power", "torque", "turbine_temperature", "blade_loading", *EMITTED)


def checked_quantities(names: Iterable[str], known: Sequence[str]) -> tuple[str, ...]:
    """``names``; raises :class:`InputError` for one that is not ``known``."""
    names = tuple(names)
    for name in names:
        if name not in known:
            raise InputError(f"path model: quantity = {name!r}: one of {', '.join(known)}")
    return names


def second_order(values: Sequence[Any], x: Any, point: Sequence[Any], centre: Sequence[Any]) -> list[Any]:
    """Expressions ``values`` of the symbols ``x`` at ``point``, to second order about ``centre``.

    At the centre value, first and second derivatives are those of the expressions themselves, but what follows has a
    parabola to differentiate and no more.
    """
    about, away = ca.vertcat(*centre), ca.vertcat(*point) - ca.vertcat(*centre)
    results = []
    for value in values:
        hessian, gradient = ca.hessian(value, x)
        value, gradient, hessian = ca.substitute([value, gradient, hessian], [x], [about])
        results.append(value + ca.dot(gradient, away) + 0.5 * ca.bilin(hessian, away, away))
    return results
