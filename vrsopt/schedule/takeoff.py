"""With how much mass a mission takes off, and whether the aircraft may be that heavy all the way."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from vrsopt.aircraft import Loading as AircraftLoading
from vrsopt.errors import NoSolutionError
from vrsopt.mission.file import Loading
from vrsopt.mission.loading import TakeoffLoading, close_takeoff_mass
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import Schedule


def closed_loading(
    grid: FlightGrid,
    schedule: Schedule,
    *,
    loading: Loading,
    aircraft: AircraftLoading,
    endurance_flow: Callable[[float], float],
) -> TakeoffLoading:
    """The take-off mass with which ``schedule`` lands with the reserve of ``loading``.

    ``endurance_flow(landing_mass)`` is the fuel flow [kg/s] at which the reserve time is flown. Raises
    :class:`NoSolutionError` where the aircraft would be too heavy or its tank too small, :class:`InputError` where its
    model does not hold.
    """
    closed = close_takeoff_mass(
        lambda mass: float(grid.burned(schedule, takeoff_mass=mass)[1][-1]),
        lambda landing_mass: 60.0 * loading.reserve_minutes * endurance_flow(landing_mass),
        zero_fuel_mass=loading.zero_fuel_mass,
        payload_change=float(np.sum(grid.profile.mass_changes)),
        max_takeoff_mass=aircraft.largest_mass,
        tank_capacity=aircraft.fuel_capacity,
    )
    check_gross_mass(grid, grid.burned(schedule, takeoff_mass=closed.takeoff_mass)[0], aircraft=aircraft)
    return closed


def given_loading(
    grid: FlightGrid, schedule: Schedule, *, takeoff_mass: float, aircraft: AircraftLoading
) -> TakeoffLoading:
    """The loading of a flight that takes off with a known mass [kg]: fuel loaded and reserve are not known (nan).

    Raises :class:`NoSolutionError` where the aircraft would be too heavy or its tank too small, :class:`InputError`
    where its model does not hold.
    """
    mass, burned = grid.burned(schedule, takeoff_mass=takeoff_mass)
    check_gross_mass(grid, mass, aircraft=aircraft)
    fuel = float(burned[-1])
    if fuel > aircraft.fuel_capacity:
        over = fuel - aircraft.fuel_capacity
        raise NoSolutionError(
            f"fuel: {fuel:.1f} kg are burned, {over:.1f} kg more than the tank holds ({aircraft.fuel_capacity:g} kg)"
        )
    return TakeoffLoading(takeoff_mass, math.nan, fuel, math.nan, float(mass[-1]))


def check_gross_mass(grid: FlightGrid, mass: np.ndarray, *, aircraft: AircraftLoading) -> None:
    """Raises :class:`NoSolutionError` where the aircraft is heavier than it may be, which may be after a pick-up, and
    :class:`InputError` where its model does not hold for the mass (N,) [kg] at the nodes."""
    node = int(np.argmax(mass))
    if mass[node] > aircraft.largest_mass:
        task = grid.profile.segments[grid.segment[node]].task
        raise NoSolutionError(
            f"gross mass {mass[node]:.0f} kg at {grid.time[node]:.0f} s ({task}), "
            f"{mass[node] - aircraft.largest_mass:.0f} kg over the largest mass {aircraft.largest_mass:g} kg"
        )
    grid.check_mass(mass)
