"""Limits and costs of a user's own in the whole-mission problem, as CasADi expressions of named quantities."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import casadi as ca
import numpy as np

from vrsopt.errors import InputError

if TYPE_CHECKING:
    from vrsopt.mission.profile import Conditions

Expression: TypeAlias = Callable[[Mapping[str, Any]], Any]

STATES = ("mass", "rotor_speed", "twist", "rotor_speed_rate")
CONDITIONS = ("time", "speed", "altitude", "climb_angle", "equivalent_climb_angle", "load_factor")


@dataclass(frozen=True)
class Additions:
    """Functions of a mapping of named quantities, in SI units, each returning a CasADi expression.

    The names are ``mass``, ``rotor_speed``, ``twist``, ``rotor_speed_rate``, ``fuel_flow``, ``time``, ``speed``,
    ``altitude``, ``climb_angle``, ``equivalent_climb_angle``, ``load_factor`` and those of the aircraft's limits.
    ``limits``: name -> expression that must not be above zero in flight, of order one.
    ``cost``: expression per second whose integral is minimised in place of the fuel.
    """

    limits: Mapping[str, Expression] = field(default_factory=dict)
    cost: Expression | None = None


def extended(
    function: ca.Function,
    coefficients: np.ndarray,
    *,
    limit_names: tuple[str, ...],
    conditions: Conditions,
    additions: Additions,
) -> tuple[ca.Function, np.ndarray]:
    """Node function with the added limits behind its own, the cost as a third output (absent if there is none), and its
    coefficients (n_c, N).

    Raises InputError for a quantity that does not exist or an expression that is not a single value.
    """
    taken = set(limit_names) & set(additions.limits)
    if taken:
        raise InputError(f"additions: limits = {sorted(taken)}: the aircraft already has limits of these names")
    states = [ca.SX.sym(name) for name in STATES]
    own = ca.SX.sym("c", coefficients.shape[0])
    known = ca.SX.sym("conditions", len(CONDITIONS))
    centre = [ca.SX.sym("centre", len(STATES))] * (function.n_in() - len(STATES) - 1)  # if the function has one
    fuel_flow, limits = function(*states, own, *centre)
    quantities = {
        **dict(zip(STATES, states, strict=True)),
        **dict(zip(CONDITIONS, ca.vertsplit(known), strict=True)),
        **dict(zip(limit_names, ca.vertsplit(limits), strict=True)),
        "fuel_flow": fuel_flow,
    }
    added = [_value(name, expression, quantities) for name, expression in additions.limits.items()]
    outputs = [fuel_flow, ca.vertcat(limits, *added)]
    if additions.cost is not None:
        outputs.append(_value("cost", additions.cost, quantities))
    rows = np.array([np.asarray(getattr(conditions, name), dtype=float) for name in CONDITIONS])
    inputs = [*states, ca.vertcat(own, known), *centre]
    return ca.Function("node", inputs, outputs), np.vstack([coefficients, rows])


def _value(name: str, expression: Expression, quantities: Mapping[str, Any]) -> ca.SX:
    try:
        value = ca.SX(expression(quantities))
    except KeyError as error:
        raise InputError(f"additions: {name} = {error.args[0]!r}: quantities are {', '.join(quantities)}") from None
    if value.numel() != 1:
        raise InputError(f"additions: {name} = expression of shape {value.shape}: must be a single value")
    return value
