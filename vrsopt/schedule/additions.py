"""Constraints and costs of a user's own in the whole-mission problem, as CasADi expressions of named quantities."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from vrsopt.errors import InputError
from vrsopt.limits import LIMIT_NAMES
from vrsopt.quantity import is_number
from vrsopt.schedule.path_model import PathModel
from vrsopt.schedule.path_quantities import QUANTITY_NAMES

if TYPE_CHECKING:
    from vrsopt.mission.profile import Conditions

STATES = ("mass", "rotor_speed", "twist", "rotor_speed_rate")
CONDITIONS = ("time", "speed", "altitude", "climb_angle", "equivalent_climb_angle", "load_factor")
# What is free, and how large it is: mass, rotor speed, twist, rate; fuel flow, powers, ... in the units of quantities()
SIZES = {
    **dict(zip(STATES, (2e3, 44.0, 0.15, 0.4), strict=True)),
    "fuel_flow": 0.03,
    **dict.fromkeys(LIMIT_NAMES, 1.0),
    **dict(zip(QUANTITY_NAMES, (2e5, 4e5, 1e4, 1e3, 0.1, 2e-4, 2e-4, 0.1), strict=True)),
}
CONDITION_SIZES = dict(zip(CONDITIONS, (1e3, 40.0, 500.0, 0.1, 0.1, 1.0), strict=True))
LEAST_SCALE = 0.1  # of what the quantities of an expression bring to it: a bound of zero says nothing of its size
WEIGHTED = {"fuel": "fuel_flow", "nox": "nox", "co": "co", "co2": "co2"}  # what a cost may weigh, and its flow


class Quantities(Mapping[str, Any]):
    """Named quantities of a node as CasADi symbols, in SI units."""

    def __init__(self) -> None:
        names = (*STATES, *CONDITIONS, "fuel_flow", *LIMIT_NAMES, *QUANTITY_NAMES)
        self._symbols = {name: ca.SX.sym(name) for name in names}

    def __getitem__(self, name: str) -> Any:
        if name not in self._symbols:
            raise InputError(f"quantities: {name!r}: must be one of {', '.join(self._symbols)}")
        return self._symbols[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._symbols)

    def __len__(self) -> int:
        return len(self._symbols)


@cache
def quantities() -> Quantities:
    """What expressions are made of, the same symbols in the whole process.

    States ``mass`` [kg], ``rotor_speed`` [rad/s], ``twist`` [rad], ``rotor_speed_rate`` [rad/s2] as it is charged to
    the engines; conditions ``time`` [s], ``speed`` [m/s], ``altitude`` [m], ``climb_angle``, ``equivalent_climb_angle``
    [rad], ``load_factor``; ``fuel_flow`` [kg/s]; by the names of the aircraft's limits their usages minus one; where
    the path model offers them ``power_per_engine``, ``rotor_power`` [W], ``torque`` [N m], ``turbine_temperature`` [K],
    ``blade_loading`` and the emissions ``nox``, ``co``, ``co2`` [kg/s].
    """
    return Quantities()


@dataclass(frozen=True)
class Constraint:
    """``lower`` <= ``expression`` <= ``upper``, in ``unit``; None leaves a side open.

    ``expression`` is made of :func:`quantities`; ``tasks`` are those during which it holds, None for the whole flight
    (on the ground nothing is free). As an integral it is per second, and the bounds are those of its integral over the
    whole mission or these tasks.
    """

    name: str
    expression: Any
    lower: float | None = None
    upper: float | None = None
    unit: str = "-"
    tasks: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        where = f"constraint {self.name}"
        if not isinstance(self.name, str) or not isinstance(self.unit, str):
            raise InputError(f"{where}: name and unit = {self.name!r}, {self.unit!r}: must be words")
        for side, bound in (("lower", self.lower), ("upper", self.upper)):
            if bound is not None and not is_number(bound):
                raise InputError(f"{where}: {side} = {bound!r}: must be a number or None")
        tasks = self.tasks
        if tasks is not None and (isinstance(tasks, str) or not isinstance(tasks, Sequence) or not tasks):
            raise InputError(f"{where}: tasks = {tasks!r}: must be names of tasks, or None for the whole flight")
        _symbols(self.name, self.expression)
        if self.lower is None and self.upper is None:
            raise InputError(f"constraint {self.name}: lower and upper = None: must have one of them")
        if self.lower is not None and self.upper is not None and self.lower > self.upper:
            raise InputError(f"constraint {self.name}: lower = {self.lower:g}: must not be above {self.upper:g}")

    @cached_property
    def scale(self) -> float:
        """What brings the expression to order one: its larger bound, or a part of what its quantities bring to it."""
        bound = max(abs(bound) for bound in (self.lower, self.upper) if bound is not None)
        return max(bound, LEAST_SCALE * _size(self.expression)) or 1.0


@dataclass(frozen=True)
class Additions:
    """``constraints`` along the flight, ``integrals`` over it, and a ``cost`` in place of the fuel.

    ``cost``: an expression per second whose integral is minimised, or weights of ``fuel``, ``nox``, ``co`` and ``co2``.
    """

    constraints: tuple[Constraint, ...] = ()
    cost: Any = None
    integrals: tuple[Constraint, ...] = ()

    def __post_init__(self) -> None:
        names = self.names
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"additions: {name}: two constraints of this name")
            if name in LIMIT_NAMES:
                raise InputError(f"additions: {name}: the aircraft already has a limit of this name")

    @property
    def names(self) -> list[str]:
        """Names of all constraints."""
        return [constraint.name for constraint in (*self.constraints, *self.integrals)]

    def cost_expression(self) -> Any | None:
        """The cost as an expression per second; None for the fuel itself."""
        if self.cost is None:
            return None
        if not isinstance(self.cost, Mapping):
            if not _symbols("cost", self.cost):
                raise InputError(f"objective = {self.cost}: must depend on one of quantities()")
            return self.cost
        unknown = sorted(set(self.cost) - set(WEIGHTED))
        if unknown or not self.cost:
            wrong = ", ".join(map(repr, unknown)) or "nothing"
            raise InputError(f"objective: {wrong}: weights of {', '.join(WEIGHTED)}")
        if not all(map(is_number, self.cost.values())) or not any(self.cost.values()):
            raise InputError(f"objective = {dict(self.cost)}: weights must be numbers, not all zero")
        return sum(weight * quantities()[WEIGHTED[name]] for name, weight in self.cost.items())


@dataclass(frozen=True)
class Extended:
    """Node function with one output (fuel flow, limits, constraints, integrands, cost if there is one), all but the
    first of order one, and its coefficients: the model's own (n_c, P), then the conditions."""

    function: ca.Function
    coefficients: np.ndarray
    conditions: np.ndarray = field(repr=False)

    def with_own(self, coefficients: np.ndarray | None) -> np.ndarray:
        """All coefficients with ``coefficients`` in place of the model's own."""
        own = self.coefficients if coefficients is None else np.asarray(coefficients, dtype=float)
        if own.shape != self.coefficients.shape:
            raise InputError(f"trajectory: coefficients: shape {own.shape}: must be {self.coefficients.shape}")
        return np.vstack([own, self.conditions])


def extended(model: PathModel, conditions: Conditions, additions: Additions) -> Extended:
    """Node function of a path model with ``additions`` behind its own outputs.

    Raises InputError for a quantity that the model does not offer or an expression that is not a single value.
    """
    cost = additions.cost_expression()
    parts = {c.name: c.expression / c.scale for c in (*additions.constraints, *additions.integrals)}
    parts |= {} if cost is None else {"cost": cost}
    used = [symbol.name() for name, part in parts.items() for symbol in _symbols(name, part)]
    wanted = [name for name in QUANTITY_NAMES if name in used]
    offered = model.quantity_names
    missing = sorted(set(wanted) - set(offered) | (set(used) & set(LIMIT_NAMES)) - set(model.limit_names))
    if missing:
        raise InputError(f"additions: {', '.join(missing)}: the aircraft's model does not offer it")
    function, coefficients = model.function(wanted) if wanted else model.function()
    states = [ca.SX.sym(name) for name in STATES]
    own = ca.SX.sym("c", coefficients.shape[0])
    known = ca.SX.sym("conditions", len(CONDITIONS))
    centre = [ca.SX.sym("centre", len(STATES))] * (function.n_in() - len(STATES) - 1)  # if the function has one
    fuel_flow, limits, *others = function(*states, own, *centre)
    values = {
        **dict(zip(STATES, states, strict=True)),
        **dict(zip(CONDITIONS, ca.vertsplit(known), strict=True)),
        **dict(zip(model.limit_names, ca.vertsplit(limits), strict=True)),
        **dict(zip(wanted, ca.vertsplit(ca.vertcat(*others)), strict=True)),
        "fuel_flow": fuel_flow,
    }
    names = [name for name in dict.fromkeys(used)]
    given, meant = [quantities()[name] for name in names], [values[name] for name in names]
    added = ca.substitute(list(parts.values()), given, meant) if names else list(parts.values())
    inputs = [*states, ca.vertcat(own, known), *centre]
    rows = np.array([np.asarray(getattr(conditions, name), dtype=float) for name in CONDITIONS])
    return Extended(ca.Function("node", inputs, [ca.vertcat(fuel_flow, limits, *added)]), coefficients, rows)


def _size(expression: Any) -> float:
    """The largest share of a free quantity in an expression: its slope times the size of the quantity; 0 if unknown."""
    symbols = ca.symvar(ca.SX(expression))
    sizes = [SIZES.get(symbol.name(), 0.0) for symbol in symbols]
    if not any(sizes):
        return 0.0
    there = [size or CONDITION_SIZES[symbol.name()] for symbol, size in zip(symbols, sizes, strict=True)]
    slopes = ca.Function("slopes", [ca.vertcat(*symbols)], [ca.gradient(expression, ca.vertcat(*symbols))])
    shares = np.abs(slopes(there).full().ravel() * sizes)
    return float(np.max(shares, where=np.isfinite(shares), initial=0.0))


def _symbols(name: str, expression: Any) -> list[Any]:
    """Quantities in an expression; raises InputError for other symbols, other shapes and what is no number."""
    if not isinstance(expression, ca.SX | int | float):
        allowed = "must be a CasADi SX expression of the symbols of quantities()"
        raise InputError(f"additions: {name} = {type(expression).__name__}: {allowed}")
    value = ca.SX(expression)
    if value.numel() != 1:
        raise InputError(f"additions: {name} = expression of shape {value.shape}: must be a single value")
    symbols = ca.symvar(value)
    if not symbols and not is_number(float(ca.evalf(value))):
        raise InputError(f"additions: {name} = {value}: must be finite, or depend on one of quantities()")
    for symbol in symbols:
        if symbol.name() not in quantities() or not ca.is_equal(symbol, quantities()[symbol.name()]):
            raise InputError(
                f"additions: {name} = expression of {symbol.name()}: must be of the symbols of quantities()"
            )
    return list(symbols)
