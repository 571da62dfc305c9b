"""Where the kinetic energy of the rotor comes from and where it goes, along a flown schedule."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from vrsopt.schedule.refly import Flight, FlightGrid

PROBE = 0.05  # rad/s2, by which the rate is raised to see what the engines burn more


@dataclass(frozen=True)
class RotorEnergy:
    """Energies [J] at the main rotor's shaft.

    ``charged``: what the engines gave to speed the rotor up; ``credited``: what they did not have to give because it
    slowed down, which ends at their idle; ``end_minus_start`` of the mission; ``jumped``: what comes from nowhere
    where the schedule jumps from one segment to the next. What is missing in the balance was lost at idle.
    ``fuel``: what the engines would burn [kg] for the energy that the rotor has at the end and had not at the start:
    a schedule that ends with less of it (below zero) has borrowed that much.
    """

    charged: float
    credited: float
    jumped: float
    end_minus_start: float
    fuel: float


def rotor_energy(grid: FlightGrid, flight: Flight) -> RotorEnergy:
    """The energies of a ``flight`` of ``grid``."""
    state = flight.mass[:, None], flight.rotor_speed[:, None], flight.twist[:, None]
    rate, step = grid.rates(flight.rotor_speed)
    charged = rate if grid.settings.spin_down_credit else np.maximum(rate, 0.0)
    turning, steady, probe = (grid.model.evaluate(*state, own) for own in (charged, 0.0 * charged, charged + PROBE))
    change = (turning.power_per_engine - steady.power_per_engine) / grid.model.engine_share
    gained = np.sum(probe.power_per_engine - turning.power_per_engine) / grid.model.engine_share
    burned = np.sum(probe.fuel_flow - turning.fuel_flow) / gained if gained > 0.0 else 0.0  # kg/J
    kinetic = 0.5 * grid.model.polar_inertia * flight.rotor_speed**2
    across = np.diff(grid.segment) != 0

    def total(power: np.ndarray) -> float:
        return float(np.sum(0.5 * step * (power[:-1, 1] + power[1:, 0])))

    return RotorEnergy(
        charged=total(np.maximum(change, 0.0)),
        credited=total(np.maximum(-change, 0.0)),
        jumped=float(np.sum(np.diff(kinetic)[across])),
        end_minus_start=float(kinetic[-1] - kinetic[0]),
        fuel=float(burned * (kinetic[-1] - kinetic[0])),
    )
