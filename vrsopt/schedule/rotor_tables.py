"""Power and tail-rotor loading of the rotors along given conditions, as polynomials in what a schedule may choose.

At one flight condition each Kriging shrinks to a Chebyshev polynomial in mass, rotor speed and twist, and the power is
a sum of these: a parabola through descent, level flight and climb; the steeper part of a climb, and vertical flight, as
an axial flow of momentum theory, scaled to the sampled vertical climb; less what the ground saves in the hover, scaled
by the method of images.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi

import numpy as np

from vrsopt.aircraft import Aircraft
from vrsopt.atmosphere import GRAVITY
from vrsopt.rotor.ground import ground_factor
from vrsopt.schedule.similarity import StandardDay
from vrsopt.surrogate import chebyshev
from vrsopt.surrogate.design import GROUND_PROXIMITY, VERTICAL_SPEED, reference_climb_sine
from vrsopt.surrogate.export import FREE, path_coefficients
from vrsopt.surrogate.kriging import Kriging

Array = np.ndarray

# (mass, rotor speed, twist), by measurement: rms error of the rotor power against the Kriging itself 0.001 %
POWER_DEGREES = (5, 9, 6)
TAIL_DEGREES = (2, 6, 3)
POWER_KEPT = chebyshev.low_total_degree(POWER_DEGREES, 1.3)  # half of the tensor, for speed
LEVEL = ("main_rotor_power", "tail_rotor_power")
CLIMB = ("climb_rotor_power", "descent_rotor_power")
AT_REST = ("hover_rotor_power", "ground_rotor_power", "vertical_rotor_power")
TAIL = "tail_blade_loading"
USED = (*LEVEL, *CLIMB, *AT_REST, TAIL)

# Up to which sine of the climb angle the parabola holds, by measurement: at low speed, and over the sampled climb's
STEEPEST, FURTHEST = 0.25, 2.2
# Of a change of power at one speed is the main rotor's, and turns the aircraft, by measurement: at rest, and how much
# more at speeds beyond 20 m/s, where the tail rotor's own power hardly depends on its thrust
MAIN_SHARE, MORE_IN_FLIGHT, FORWARD_FLIGHT = 0.88, 0.10, 20.0


@dataclass(frozen=True)
class Flight:
    """Conditions (n,) on the standard day: airspeed [m/s], climb angle [rad], skids above the ground [m]."""

    day: StandardDay
    speed: Array
    climb_angle: Array
    height: Array


@dataclass(frozen=True)
class RotorTables:
    """The Krigings ``models`` of one aircraft over the box ``lower``, ``upper`` (3,) of mass, rotor speed and twist."""

    models: Mapping[str, Kriging]
    aircraft: Aircraft
    lower: Array
    upper: Array

    def __call__(self, flight: Flight) -> tuple[Array, Array]:
        """Coefficients on the standard day of the rotors' power (n, ...) [W] and of the tail-rotor loading (n, ...).

        Raises :class:`InputError` for speeds and altitudes that are not sampled.
        """
        weights, edgewise = self.weights(flight)
        whole = np.ones_like(edgewise)
        level = self._sum(dict.fromkeys(LEVEL, whole), flight, edgewise, POWER_DEGREES)
        tail = self._sum({TAIL: whole}, flight, edgewise, TAIL_DEGREES)
        more = weights.pop("level") - whole
        change = more[:, None, None, None] * level + self._sum(weights, flight, edgewise, POWER_DEGREES)
        return (level + change) * POWER_KEPT, tail + self._tail_loading(change, flight)

    def weights(self, flight: Flight) -> tuple[dict[str, Array], Array]:
        """Weight (n,) of each sampled power in that of the flight, "level" for that of level flight, and the airspeed
        [m/s] at which they are looked up."""
        horizontal = flight.speed * np.cos(flight.climb_angle)
        rate = flight.speed * np.sin(flight.climb_angle)
        largest = np.arcsin(np.minimum(STEEPEST, FURTHEST * reference_climb_sine(flight.speed)))
        gentle = np.clip(flight.climb_angle, -largest, largest)
        steep = gentle != flight.climb_angle
        speed = np.where(steep, horizontal / np.cos(gentle), flight.speed)
        slope = np.sin(gentle) / reference_climb_sine(speed)
        weights = {"level": 1 - slope**2}
        weights |= dict(zip(CLIMB, ((slope**2 + slope) / 2, (slope**2 - slope) / 2), strict=True))
        at_rest = self.hover_velocity(flight.day.density)
        through = axial_flow(horizontal, rate, at_rest) - axial_flow(horizontal, speed * np.sin(gentle), at_rest)
        sampled = axial_flow(0.0 * at_rest, VERTICAL_SPEED, at_rest) - at_rest
        climbing = np.where(steep, through / sampled, 0.0)
        near = self._ground_share(horizontal, flight.height, at_rest)
        weights |= dict(zip(AT_REST, (-climbing - near, near, climbing), strict=True))
        return weights, speed

    def hover_velocity(self, density: Array) -> Array:
        """Induced velocity [m/s] of the hover in air of ``density`` [kg/m3], at the middle of the sampled masses."""
        thrust = 0.5 * (self.lower[0] + self.upper[0]) * GRAVITY
        return np.sqrt(thrust / (2 * density * pi * self.aircraft.main_rotor.radius**2))

    def _ground_share(self, horizontal: Array, height: Array, at_rest: Array) -> Array:
        """What the ground saves over what it saves in the sampled hover: induced velocity times its lost share."""
        rotor = self.aircraft.main_rotor
        induced = axial_flow(horizontal, 0.0, at_rest)
        saved = 1 - ground_factor(rotor.radius / (height + rotor.hub_above_skids), horizontal, induced)
        return induced / at_rest * saved / (1 - ground_factor(GROUND_PROXIMITY, 0.0, 1.0))

    def _sum(
        self, weights: Mapping[str, Array], flight: Flight, edgewise: Array, degrees: tuple[int, int, int]
    ) -> Array:
        """Coefficients (n, ...) of the sum of some outputs with ``weights`` (n,)."""
        total = np.zeros((len(edgewise), *(degree + 1 for degree in degrees)))
        for name, weight in weights.items():
            some = weight != 0
            if np.any(some):
                model = self.models[name]
                state = model.state_
                column = state.names.index("speed")
                middle = 0.5 * (state.lower[column] + state.upper[column])  # powers at rest do not depend on it
                speed = np.full(np.count_nonzero(some), middle) if name in AT_REST else edgewise[some]
                fixed = {"altitude": flight.day.altitude[some], "speed": speed}
                series = path_coefficients(model, fixed, self.lower, self.upper, degrees)
                total[some] += weight[some, None, None, None] * series
        return total

    def _tail_loading(self, change: Array, flight: Flight) -> Array:
        """Coefficients of the change of the tail rotor's loading with that of the power: it holds the torque."""
        tail = self.aircraft.tail_rotor
        power = change
        for k, (low, high) in enumerate(zip(self.lower, self.upper, strict=True)):
            at = chebyshev.basis(chebyshev.nodes(low, high, TAIL_DEGREES[k]), low, high, POWER_DEGREES[k])
            power = np.moveaxis(np.tensordot(power, at, axes=(k + 1, 1)), -1, k + 1)
        Omega = chebyshev.grid(self.lower, self.upper, TAIL_DEGREES)[..., FREE.index("rotor_speed")]
        forward = flight.speed**2 / (flight.speed**2 + FORWARD_FLIGHT**2)
        share = (MAIN_SHARE + MORE_IN_FLIGHT * forward)[:, None, None, None]
        torque = share * power / Omega
        pressure = flight.day.density[:, None, None, None] * (Omega * tail.speed_ratio * tail.radius) ** 2
        thrust = torque / (tail.behind_cg * tail.fin_blockage)
        return chebyshev.coefficients(thrust / (pressure * tail.blade_area), 3)


def axial_flow(horizontal: Array, rate: Array | float, at_rest: Array) -> Array:
    """Velocity through the disc [m/s] at a horizontal speed and a climb rate [m/s], by momentum theory.

    ``at_rest``: induced velocity of the hover, v_h. H. Glauert: v = v_h^2 / sqrt(V^2 + (w + v)^2).
    """
    induced = np.array(at_rest, dtype=float)
    for _ in range(80):
        induced = 0.5 * (induced + at_rest**2 / np.sqrt(horizontal**2 + (rate + induced) ** 2))
    return np.asarray(rate + induced)
