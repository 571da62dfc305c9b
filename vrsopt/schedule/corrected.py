"""A path model corrected to first order: what the physics say at one schedule, the model's own curvature around it.

At each evaluation k of the whole-mission problem, fuel flow and usages are those of the model plus

    c_k + g_k (x - x_k),     x = (mass, rotor speed, twist, rate of the rotor speed),

with c_k and g_k the differences of value and gradient between physics and model at the schedule's x_k. There the
corrected model has the physics' value and gradient, so a schedule that is optimal to it, and stays where it is, is
optimal to the physics. The corrections are coefficients of the node function: new ones need no new problem.
N. M. Alexandrov et al., Approximation and model management in aerodynamic optimization (2001): first-order consistency.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from vrsopt.schedule.nlp import NodeFunctions, node_functions
from vrsopt.schedule.path_model import PathModel, PathModelFactory, PathValues

if TYPE_CHECKING:
    from vrsopt.mission.profile import Conditions

INPUTS = 4  # mass, rotor speed, twist, rate


@dataclass(frozen=True)
class FirstOrder:
    """Fuel flow [kg/s] and usages less 1 at M evaluations: ``values`` (1 + m, M) and ``slopes`` (1 + m, 4, M) with
    respect to mass, rotor speed, twist and rate, at ``centre`` (4, M)."""

    centre: np.ndarray
    values: np.ndarray
    slopes: np.ndarray

    @property
    def coefficients(self) -> np.ndarray:
        """All of it, column by column (n, M)."""
        count = self.centre.shape[1]
        return np.vstack([self.centre, self.values, self.slopes.reshape(-1, count)])


class CorrectedPath:
    """A path model with first-order corrections, zero until others are passed as coefficients."""

    def __init__(self, model: PathModel, count: int) -> None:
        self.model, self.count = model, count

    @property
    def limit_names(self) -> tuple[str, ...]:
        """Those of the model."""
        return self.model.limit_names

    @property
    def quantity_names(self) -> tuple[str, ...]:
        """Those of the model, which are not corrected."""
        return self.model.quantity_names

    @property
    def polar_inertia(self) -> float:
        """That of the model."""
        return self.model.polar_inertia

    @property
    def engine_share(self) -> float:
        """That of the model."""
        return self.model.engine_share

    @property
    def bounds(self) -> Mapping[str, tuple[Any, Any]]:
        """Those of the model."""
        return self.model.bounds

    def evaluate(self, mass: Any, rotor_speed: Any, twist: Any, rotor_speed_rate: Any = 0.0) -> PathValues:
        """Values of the model, without corrections."""
        return self.model.evaluate(mass, rotor_speed, twist, rotor_speed_rate)

    def emissions(self, fuel_flow: np.ndarray, power_per_engine: np.ndarray, rotor_speed: Any) -> dict[str, np.ndarray]:
        """Those of the model."""
        return self.model.emissions(fuel_flow, power_per_engine, rotor_speed)

    def nodes(self, index: np.ndarray) -> PathModel:
        """The model at some of the nodes, without corrections."""
        return self.model.nodes(index)

    def function(self, quantities: Sequence[str] = ()) -> tuple[ca.Function, np.ndarray]:
        """The model's function with its corrections behind its own coefficients."""
        function, coefficients = self.model.function(quantities) if quantities else self.model.function()
        x = [ca.SX.sym(name) for name in ("mass", "rotor_speed", "twist", "rotor_speed_rate")]
        own, outputs = ca.SX.sym("c", len(coefficients)), 1 + len(self.limit_names)
        about, value = ca.SX.sym("about", INPUTS), ca.SX.sym("value", outputs)
        slope = [ca.SX.sym(f"slope_{k}", INPUTS) for k in range(outputs)]
        centre = [ca.SX.sym("centre", INPUTS)] * (function.n_in() - INPUTS - 1)
        fuel_flow, limits, *others = function(*x, own, *centre)
        away = ca.vertcat(*x) - about
        more = value + ca.vertcat(*(ca.dot(one, away) for one in slope))
        everything = ca.vertcat(own, about, value, *slope)
        corrected = [fuel_flow + more[0], limits + more[1:], *others]
        nothing = np.zeros((everything.numel() - len(coefficients), coefficients.shape[1]))
        return ca.Function("node", [*x, everything, *centre], corrected), np.vstack([coefficients, nothing])

    @cached_property
    def _model(self) -> tuple[NodeFunctions, np.ndarray]:
        function, coefficients = self.model.function()
        return node_functions(function), coefficients

    def coefficients(self, truth: FirstOrder) -> np.ndarray:
        """Coefficients (n_c, M) with which the corrected model has the values and slopes of ``truth``."""
        node, own = self._model
        values = node.values.map(self.count)(truth.centre, own).full()
        slopes = node.jacobian.map(self.count)(truth.centre, own)
        blocks = ca.horzsplit(ca.densify(slopes), INPUTS)
        slopes = np.stack([block.full() for block in blocks], axis=-1)
        correction = FirstOrder(truth.centre, truth.values - values, truth.slopes - slopes)
        return np.vstack([own, correction.coefficients])


def corrected(make_path_model: PathModelFactory) -> Any:
    """Maker of corrected path models from a maker of path models."""

    def make(conditions: Conditions) -> CorrectedPath:
        return CorrectedPath(make_path_model(conditions), len(np.asarray(conditions.time)))

    return make
