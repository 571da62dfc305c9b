"""The take-off mass with which a mission ends with exactly its reserve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite

from vrsopt.errors import NoSolutionError

FUEL_TOLERANCE = 1e-6  # kg, fuel left at landing against the reserve
MAX_ITERATIONS = 50


@dataclass(frozen=True)
class TakeoffLoading:
    """Masses [kg] of a mission that lands with its reserve."""

    takeoff_mass: float
    fuel_loaded: float
    fuel_burned: float
    reserve_fuel: float
    landing_mass: float


def close_takeoff_mass(
    burn: Callable[[float], float],
    reserve: Callable[[float], float],
    *,
    zero_fuel_mass: float,
    max_takeoff_mass: float,
    tank_capacity: float,
    payload_change: float = 0.0,
) -> TakeoffLoading:
    """The take-off mass with which the fuel left at landing equals the reserve, to 1e-6 kg.

    ``burn(takeoff_mass)`` is the fuel [kg] the nominal schedule burns over the mission, ``reserve(landing_mass)`` the
    fuel [kg] that has to be left. ``zero_fuel_mass`` is the mass at take-off without fuel (``Loading.zero_fuel_mass``),
    ``tank_capacity`` the usable fuel [kg] and ``payload_change`` the sum of the mission's mass changes.

    A heavier aircraft burns more, so the fixed-point map rises, and its iterates, begun without fuel, stay below the
    solution: an iterate over a limit proves that there is none. Secant steps shorten the way. Neither callable is
    evaluated above a limit.

    Raises :class:`NoSolutionError` if the take-off mass would exceed ``max_takeoff_mass`` or the fuel
    ``tank_capacity``, and if the burn is not a number or grows too fast with mass for any fuel to suffice.
    """
    heaviest = min(max_takeoff_mass, zero_fuel_mass + tank_capacity)
    mass, previous = zero_fuel_mass, None
    _check_limits(mass, zero_fuel_mass, max_takeoff_mass, tank_capacity)
    for _ in range(MAX_ITERATIONS):
        burned = float(burn(mass))
        landing_mass = mass + payload_change - burned
        kept = float(reserve(landing_mass))
        needed = zero_fuel_mass + burned + kept
        excess = mass - needed
        if not isfinite(needed):
            raise NoSolutionError(f"take-off mass: fuel burned {burned} kg and reserve {kept} kg at {mass:.1f} kg")
        if abs(excess) <= FUEL_TOLERANCE:
            return TakeoffLoading(mass, mass - zero_fuel_mass, burned, kept, landing_mass)
        _check_limits(needed, zero_fuel_mass, max_takeoff_mass, tank_capacity)
        step = needed
        if previous is not None and excess != previous[1]:
            secant = mass - excess * (mass - previous[0]) / (excess - previous[1])
            if min(mass, needed) < secant <= heaviest:
                step = secant
        previous, mass = (mass, excess), step
    raise NoSolutionError(
        f"take-off mass: not closed in {MAX_ITERATIONS} iterations, fuel left misses the reserve by {excess:g} kg"
    )


def _check_limits(mass: float, zero_fuel_mass: float, max_takeoff_mass: float, tank_capacity: float) -> None:
    """Raises :class:`NoSolutionError` if a mission that needs at least this take-off mass can not be loaded."""
    if mass > max_takeoff_mass:
        over = mass - max_takeoff_mass
        raise NoSolutionError(
            f"take-off mass: at least {mass:.1f} kg is needed, {over:.1f} kg over the maximum {max_takeoff_mass:g} kg"
        )
    fuel = mass - zero_fuel_mass
    if fuel > tank_capacity:
        over = fuel - tank_capacity
        raise NoSolutionError(
            f"take-off fuel: at least {fuel:.1f} kg is needed, {over:.1f} kg over the tank's {tank_capacity:g} kg"
        )
