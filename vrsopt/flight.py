"""Flight condition as users give it, and as the trim's parameters."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, sqrt

from vrsopt.aircraft import Aircraft
from vrsopt.atmosphere import GRAVITY
from vrsopt.equilibrium import calibrated_constants
from vrsopt.errors import InputError

LARGEST_TURN_RATE = 1.0  # rad/s, assumed: tighter, the rotor would fly in its own wake


def turn_rate(load_factor: float, speed: float, climb_angle: float = 0.0) -> float:
    """Rate of turn [rad/s], to the right, of a steady coordinated turn: tan(bank) = rate V cos(climb) / g.

    Its derivative by the load factor is infinite at one: a turn begins with the square root of the extra load.
    Raises :class:`InputError` for a load factor below one, or one that would need a turn too tight at this speed.
    """
    if load_factor == 1.0:
        return 0.0
    if load_factor < 1.0:
        raise InputError(f"trim: load_factor = {load_factor:g}: at least 1, which is straight flight")
    along = speed * cos(climb_angle)
    lateral = GRAVITY * sqrt(load_factor**2 - 1)
    if lateral > LARGEST_TURN_RATE * along:
        largest = sqrt(1 + (LARGEST_TURN_RATE * along / GRAVITY) ** 2)
        tight = f"a turn of {LARGEST_TURN_RATE:g} rad/s"
        raise InputError(f"trim: load_factor = {load_factor:g}: at most {largest:.3f} at {speed:g} m/s, {tight}")
    return lateral / along


def trim_parameters(aircraft: Aircraft, flight: Mapping[str, float]) -> dict[str, float]:
    """Parameters of the trim at ``flight``: mass, altitude, isa_offset, speed, climb_angle, load_factor, rotor_speed,
    twist, and where they matter vertical_speed (upward, beside that of the climb angle, which can not be vertical),
    ground_proximity, cg_shift and turn (-1: the turn is to the left); SI units, without them 0, and turns to the right.
    """
    rest = {name: value for name, value in flight.items() if name not in ("load_factor", "turn")}
    rate = turn_rate(flight["load_factor"], flight["speed"], flight["climb_angle"])
    rest["turn_rate"] = -rate if flight.get("turn", 1.0) < 0 else rate
    return {"vertical_speed": 0.0, "ground_proximity": 0.0, "cg_shift": 0.0, **rest, **calibrated_constants(aircraft)}
