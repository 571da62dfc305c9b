"""Where a surrogate may be believed to fly: the limits of the aircraft over the surrogate's own inputs.

Blade loading is known in closed form; powers, tail-rotor loading and turbine temperature come from the Krigings, and
the power of the engines from the drive train. The same expressions serve arrays and CasADi, so that a search and an
optimal-control problem keep inside the same region as the sampled points that are called flyable.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from vrsopt.atmosphere import GRAVITY, standard_air
from vrsopt.drive_train import engine_power
from vrsopt.errors import InputError
from vrsopt.flight import LARGEST_TURN_RATE
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.surrogate.export import to_casadi
from vrsopt.surrogate.kriging import Array, Kriging

USED = ("main_rotor_power", "tail_rotor_power", "tail_blade_loading", "power_turbine_inlet_temperature")
TURN = "turn rate"


@dataclass(frozen=True)
class Region:
    """The flyable region of the surrogate ``models`` (Krigings by output) under ``limits``.

    A usage is 1 at its limit. Level flight and flight with climb angle and load factor alike: what the surrogate has no
    input for is level flight at load factor one, on a standard day.
    """

    models: Mapping[str, Kriging]
    limits: Limits

    def __post_init__(self) -> None:
        missing = [name for name in USED if name not in self.models]
        if missing:
            raise InputError(f"region: {missing[0]}: missing in the surrogate")

    @property
    def names(self) -> tuple[str, ...]:
        """The inputs, in the order of the columns of a point."""
        return self.models[USED[0]].state_.names

    @property
    def limit_names(self) -> tuple[str, ...]:
        """What is limited, in the order of the usages: where turns are flown, how tight they are too."""
        return (*LIMIT_NAMES, TURN) if "load_factor" in self.names else LIMIT_NAMES

    def usages(self, points: ArrayLike) -> Array:
        """Usage of each limit (m, k) at ``points`` (k, d), physical units.

        Raises :class:`InputError` for a point outside the sampled box.
        """
        table = np.asarray(points, dtype=float)
        outputs = {name: self.models[name].predict(table) for name in USED}
        rows = self.expressions(dict(zip(self.names, table.T, strict=True)), outputs)
        return np.stack([np.broadcast_to(row, len(table)) for row in rows])

    def function(self, size: int) -> ca.Function:
        """The same as CasADi Function ``usages(x) -> u``, x (d, size) and u (m, size), twice differentiable."""
        x = ca.MX.sym("x", len(self.names), size)
        outputs = {name: to_casadi(self.models[name], size=size)(x) for name in USED}
        rows = self.expressions(dict(zip(self.names, ca.vertsplit(x), strict=True)), outputs)
        return ca.Function("usages", [x], [ca.vertcat(*rows)], ["x"], ["u"])

    def expressions(self, inputs: Mapping[str, Any], outputs: Mapping[str, Any]) -> tuple[Any, ...]:
        """Usages from inputs and the surrogate's outputs, each by name; numbers, arrays and CasADi expressions."""
        rotor_power = outputs["main_rotor_power"] + outputs["tail_rotor_power"]
        usage = self.limits.usages(
            inputs["mass"] * inputs.get("load_factor", 1.0),
            inputs["rotor_speed"],
            speed=inputs["speed"],
            density=standard_air(inputs["altitude"]).density,
            power=engine_power(self.limits.aircraft, self.limits.engine, rotor_power),
            temperature=outputs["power_turbine_inlet_temperature"],
            tail_loading=outputs["tail_blade_loading"],
        )
        if "load_factor" in inputs:
            tightest = LARGEST_TURN_RATE * inputs["speed"] * _cos(inputs["climb_angle"]) / GRAVITY
            usage[TURN] = inputs["load_factor"] / (1.0 + tightest**2) ** 0.5
        return tuple(usage[name] for name in self.limit_names)


def _cos(angle: Any) -> Any:
    return ca.cos(angle) if isinstance(angle, ca.SX | ca.MX | ca.DM) else np.cos(angle)
