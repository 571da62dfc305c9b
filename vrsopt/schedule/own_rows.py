"""Constraints and cost of one's own as numbers: between the nodes of a mesh, and for a search over all rotor speeds.

What the path model offers only as expressions (torque, turbine temperature, ...) is known along a flight. A search over
all rotor speeds does without: it leaves out constraints and costs of these.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from vrsopt.limits import LIMIT_NAMES
from vrsopt.schedule.additions import CONDITIONS, STATES, Additions, quantities
from vrsopt.schedule.bounds import LimitBounds
from vrsopt.schedule.path_model import PathModel, PathValues
from vrsopt.schedule.path_quantities import EMITTED, QUANTITY_NAMES
from vrsopt.schedule.refly import Flight, FlightGrid
from vrsopt.schedule.violation import Stay

if TYPE_CHECKING:
    from vrsopt.mission.profile import Conditions, Profile

EXPRESSED = {*QUANTITY_NAMES} - {*EMITTED, "power_per_engine"}  # of them some have the name of a limit
KNOWN = {*STATES, *CONDITIONS, *LIMIT_NAMES, "fuel_flow", *QUANTITY_NAMES} - EXPRESSED
DOES_NOT_HOLD = -1.0  # excess of a constraint outside its tasks: far from its bound


def asked_usages(model: PathModel, limits: LimitBounds | None) -> Mapping[str, Any]:
    """Of ``limits`` those of the aircraft."""
    return {name: bound for name, bound in (limits or {}).items() if name in model.limit_names}


class OwnRows:
    """``additions`` along P ``conditions``; ``limits`` as of :meth:`TrajectoryProblem.solve`."""

    def __init__(
        self,
        profile: Profile,
        model: PathModel,
        conditions: Conditions,
        additions: Additions,
        limits: LimitBounds | None,
        *,
        known: Set[str] = KNOWN,
    ) -> None:
        constraints = [one for one in additions.constraints if _names(one.expression) <= known]
        cost = additions.cost_expression()
        self.names = tuple(one.name for one in constraints)
        self.has_cost = cost is not None and _names(cost) <= known
        expressions = [one.expression / one.scale for one in constraints] + [cost] * self.has_cost
        outputs = ca.vertcat(quantities()["mass"], *expressions)  # never empty
        symbols = ca.symvar(outputs)
        self._used = [symbol.name() for symbol in symbols]
        self._function = ca.Function("own", [ca.vertcat(*symbols)], [outputs])
        self._model, self._conditions = model, conditions
        asked: dict[str, Any] = {one.name: (one.lower, one.upper) for one in constraints} | dict(limits or {})
        self._bounds = [
            (-np.inf if low is None else low / one.scale, np.inf if high is None else high / one.scale)
            for one, (low, high) in ((one, asked[one.name]) for one in constraints)
        ]
        tasks = np.array([segment.task for segment in profile.segments])[np.asarray(conditions.segment)]
        flying = ~np.asarray(conditions.idle, dtype=bool)
        self._holds = [flying & (one.tasks is None or np.isin(tasks, one.tasks)) for one in constraints]

    def evaluate(self, states: tuple[Any, Any, Any, Any], values: PathValues) -> tuple[np.ndarray, np.ndarray | None]:
        """Excess (k, P, n) of the k constraints, 0.01 is 1 % of the bound, and the cost (P, n) per second.

        ``states`` broadcast to (P, n): mass [kg], rotor speed [rad/s], twist [rad], its charged rate [rad/s2];
        ``values``: those of the path model there.
        """
        shape = values.fuel_flow.shape
        known: dict[str, Any] = dict(zip(STATES, states, strict=True))
        known |= {name: np.asarray(getattr(self._conditions, name))[:, None] for name in CONDITIONS}
        known |= dict(zip(self._model.limit_names, values.limits, strict=True))
        known |= {"fuel_flow": values.fuel_flow, "power_per_engine": values.power_per_engine}
        if {*self._used} & {*EMITTED}:
            known |= self._model.emissions(values.fuel_flow, values.power_per_engine, states[1])
        known |= self._expressions([name for name in self._used if name in EXPRESSED], states, shape)
        table = [np.broadcast_to(known[name], shape).ravel() for name in self._used]
        found = np.array(self._function(np.array(table))).reshape(-1, *shape)[1:]
        excess = np.full((len(self.names), *shape), DOES_NOT_HOLD)
        for row, value, (low, high), holds in zip(excess, found, self._bounds, self._holds, strict=False):
            row[holds] = np.maximum(low - value, value - high)[holds]
        return excess, found[-1] if self.has_cost else None

    def _expressions(self, names: Sequence[str], states: tuple[Any, ...], shape: tuple[int, ...]) -> dict[str, Any]:
        """Quantities that the path model offers as expressions, each of ``shape`` (P, n), by name."""
        if not names:
            return {}
        function, coefficients = self._model.function(names)
        x = np.array([np.broadcast_to(state, shape).ravel() for state in states])
        centre = [x] * (function.n_in() - len(x) - 1)  # if the function has one
        each = np.repeat(coefficients, shape[1], axis=1)
        table = function.map(x.shape[1])(*x[:, None], each, *centre)[-1].full()
        return {name: row.reshape(shape) for name, row in zip(names, table, strict=True)}


def _names(expression: Any) -> set[str]:
    return {symbol.name() for symbol in ca.symvar(ca.SX(expression))}


class PlannedModel:
    """A path model whose limits include constraints of one's own, and whose fuel flow is the cost, if there is one,
    times ``cost_scale``: what a plan of the rotor speed goes by."""

    def __init__(self, model: PathModel, own: OwnRows, cost_scale: float) -> None:
        self._model, self._own, self._cost_scale = model, own, cost_scale
        self.limit_names, self.bounds = (*model.limit_names, *own.names), model.bounds

    def evaluate(self, mass: Any, rotor_speed: Any, twist: Any, rotor_speed_rate: Any = 0.0) -> PathValues:
        """As :meth:`PathModel.evaluate`, for candidates: (N, k)."""
        values = self._model.evaluate(mass, rotor_speed, twist, rotor_speed_rate)
        excess, cost = self._own.evaluate((mass, rotor_speed, twist, rotor_speed_rate), values)
        flow = values.fuel_flow if cost is None else self._cost_scale * cost
        return replace(values, fuel_flow=flow, limits=np.concatenate([values.limits, excess]))


def flown_excess(
    grid: FlightGrid, flight: Flight, additions: Additions, limits: LimitBounds | None
) -> tuple[tuple[str, ...], np.ndarray]:
    """Names of limits and constraints of one's own, and the excess (m, N) of a flight of ``grid`` over the bounds that
    ``limits`` leave or replace."""
    usages, names = asked_usages(grid.model, limits), grid.model.limit_names
    excess = flight.limits - np.array([usages.get(name, 1.0) - 1.0 for name in names])[:, None]
    if not additions.constraints:
        return names, excess
    known = {*quantities()}
    own = OwnRows(grid.profile, grid.model, grid.conditions, Additions(additions.constraints), limits, known=known)
    rate = grid.rates(flight.rotor_speed)[0]
    charged = rate if grid.settings.spin_down_credit else np.maximum(rate, 0.0)
    values = grid.evaluate(flight.mass, flight.rotor_speed, flight.twist)
    states = flight.mass[:, None], flight.rotor_speed[:, None], flight.twist[:, None], charged
    return (*names, *own.names), np.concatenate([excess, own.evaluate(states, values)[0].max(axis=-1)])


def judged(grid: FlightGrid, flight: Flight, additions: Additions, limits: LimitBounds | None) -> Flight:
    """A flight of ``grid`` judged by what ``limits`` leave or replace, and by the constraints of one's own."""
    if not limits and not additions.constraints:
        return flight
    names, excess = flown_excess(grid, flight, additions, limits)
    stays = (violation for violation in flight.violations if isinstance(violation, Stay))
    violations = (*grid.worst(excess, names=names), *stays)
    of_aircraft = excess[: len(grid.model.limit_names)]
    found = replace(flight, limits=of_aircraft, violations=violations, time_on_limits=grid.time_on_limits(of_aircraft))
    if not flight.success and flight.message != "; ".join(map(str, flight.violations)):
        return found  # it can not be believed anyway, or its schedule is none
    message = "; ".join(map(str, violations))
    return replace(found, success=not message and flight.schedule.success, message=message or flight.schedule.message)
