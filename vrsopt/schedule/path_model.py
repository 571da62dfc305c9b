"""What a schedule needs to know of the aircraft: powers, fuel flow and limits along given nodes.

The rate of the rotor speed is the one that is charged: without credit for a rotor that slows down, not below zero.
Speed, altitude, climb angle, load factor and temperature are known at every node; mass, rotor speed, twist and the rate
of the rotor speed are free. A surrogate, the full physics or an analytic aircraft all take this form.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from vrsopt.mission.profile import Conditions


@dataclass(frozen=True)
class PathValues:
    """Outputs along the nodes, each of the broadcast shape of the arguments, (N,) or (N, k).

    ``limits`` has shape (m, N) or (m, N, k), is normalised and not above zero where the aircraft is allowed to be:
    0.01 is 1 % over the limit.
    """

    fuel_flow: np.ndarray  # kg/s, both engines
    power_per_engine: np.ndarray  # W
    limits: np.ndarray  # -


class PathModel(Protocol):
    """The aircraft along N nodes whose flight conditions are fixed."""

    @property
    def limit_names(self) -> tuple[str, ...]:
        """Names of the m limits, in the order of ``PathValues.limits``."""
        ...

    @property
    def quantity_names(self) -> tuple[str, ...]:
        """Names of what else :meth:`function` gives."""
        ...

    @property
    def polar_inertia(self) -> float:
        """Of all that turns with the main rotor [kg m2]; zero leaves its kinetic energy out."""
        ...

    @property
    def engine_share(self) -> float:
        """Power of one engine per power at the main rotor's shaft, above the engines' idle."""
        ...

    @property
    def bounds(self) -> Mapping[str, tuple[Any, Any]]:
        """Lower and upper ends of ``mass`` [kg], ``rotor_speed`` [rad/s] and ``twist`` [rad] where the model holds.

        Those of the mass may differ from node to node: numbers or arrays (N,).
        """
        ...

    def evaluate(self, mass: Any, rotor_speed: Any, twist: Any, rotor_speed_rate: Any = 0.0) -> PathValues:
        """Values at all nodes; arguments [kg, rad/s, rad, rad/s2] broadcast to (N,), or (N, k): k candidates each."""
        ...

    def emissions(self, fuel_flow: np.ndarray, power_per_engine: np.ndarray, rotor_speed: Any) -> dict[str, np.ndarray]:
        """Emissions of all engines [kg/s] by name (see :mod:`vrsopt.schedule.emissions`), each (N, k).

        Fuel flow [kg/s] and power [W] as of :meth:`evaluate`, (N, k); rotor speed [rad/s] broadcasts to them. A flight
        that is reported asks for them, a search for the best schedule never does.
        """
        ...

    def nodes(self, index: np.ndarray) -> PathModel:
        """The same aircraft at the nodes ``index`` (n,) only, able to travel to another process."""
        ...

    def function(self, quantities: Sequence[str] = ()) -> tuple[Any, np.ndarray]:
        """CasADi function f(mass, rotor_speed, twist, rotor_speed_rate, c) -> (fuel_flow, limits[m]) of one node, twice
        differentiable, and the coefficients C (n_c, N): node k takes C[:, k].

        With ``quantities``, some of ``quantity_names``, these are a third output, in that order; the units are those of
        :data:`vrsopt.schedule.path_quantities.QUANTITY_NAMES`. Raises :class:`InputError` for others.

        With a sixth input ``centre`` (4,) f need only be exact to second order about it: value, first and second
        derivatives are taken at the first four inputs = centre, which spares differentiating what f knows better.
        """
        ...


PathModelFactory: TypeAlias = "Callable[[Conditions], PathModel]"
