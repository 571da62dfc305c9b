"""Masses of a mission: the take-off mass that leaves exactly the reserve, and the gross mass along the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vrsopt.errors import InputError, NoSolutionError

MAX_TAKEOFF_MASS = 2500.0  # kg, Bo 105 CBS-4 flight manual
TANK_CAPACITY = 456.0  # kg, usable fuel, Bo 105 flight manual
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
    payload_change: float = 0.0,
    max_takeoff_mass: float = MAX_TAKEOFF_MASS,
    tank_capacity: float = TANK_CAPACITY,
) -> TakeoffLoading:
    """The take-off mass with which the fuel left at landing equals the reserve, to 1e-6 kg.

    ``burn(takeoff_mass)`` is the fuel [kg] the nominal schedule burns over the mission, ``reserve(landing_mass)`` the
    fuel [kg] that has to be left. ``zero_fuel_mass`` is the mass at take-off without fuel (``Loading.zero_fuel_mass``)
    and ``payload_change`` the sum of the mission's mass changes.

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


def gross_mass(takeoff_mass: float, mass_changes: ArrayLike, fuel_burned: ArrayLike) -> tuple[NDArray, NDArray]:
    """Gross mass [kg] at the start (after its mass change) and at the end of each segment, two arrays (n_segments,).

    ``mass_changes`` [kg], (n_segments,), happen at the starts; ``fuel_burned`` [kg], (n_segments,), is that of each
    segment. Raises :class:`InputError` for arrays of different shapes.
    """
    changes, burned = np.asarray(mass_changes, dtype=float), np.asarray(fuel_burned, dtype=float)
    if changes.shape != burned.shape or changes.ndim != 1:
        raise InputError(f"gross_mass: fuel_burned of shape {burned.shape}: allowed: {changes.shape}")
    end = takeoff_mass + np.cumsum(changes - burned)
    return end + burned, end


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
