"""What holds a flown schedule: limits of the aircraft, bounds of rotor speed and twist, their rates."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.schedule.schedule import ScheduleSettings

if TYPE_CHECKING:
    from vrsopt.schedule.refly import Flight, FlightGrid

ON_BOUND = 1e-4  # of the nominal value, within which rotor speed or twist is at a bound
AT_RATE = 1e-3  # of the largest rate, within which a rate is at it
SHORTEST = 5e-4  # share of the time: what is active for less is not listed


def active_limits(grid: FlightGrid, flight: Flight, settings: ScheduleSettings) -> Mapping[str, float]:
    """Share of the mission's time that each limit, bound and rate is active, where it is; the longest first.

    A variable that is held is at no bound, and what a schedule has no say in, on the ground, counts as free.
    """
    step = np.where(np.diff(grid.segment) == 0, np.diff(grid.time), 0.0)
    idle, weight = np.asarray(grid.conditions.idle), 0.5 * (np.append(step, 0.0) + np.append(0.0, step))
    shares = dict(flight.time_on_limits)
    total = float(np.sum(step))
    for name, active in _at_bounds(flight, settings):
        shares[name] = float(weight @ (active & ~idle)) / total
    for name, values, most in (
        ("rotor speed rate", flight.rotor_speed, settings.rotor_speed_rate),
        ("twist rate", flight.twist, settings.twist_rate),
    ):
        if most:
            rate = np.abs(np.diff(values)) / np.where(step > 0.0, step, np.inf)
            shares[name] = float(np.sum(step[rate >= (1.0 - AT_RATE) * most])) / total
    return dict(sorted(((k, v) for k, v in shares.items() if v >= SHORTEST), key=lambda item: -item[1]))


def _at_bounds(flight: Flight, settings: ScheduleSettings) -> Iterator[tuple[str, np.ndarray]]:
    for name, values, nominal, bounds in (
        ("rotor speed", flight.rotor_speed, settings.nominal_rotor_speed, settings.rotor_speed_bounds),
        ("twist", flight.twist, settings.nominal_twist, settings.twist_bounds),
    ):
        if bounds[0] < bounds[1]:
            for side, bound in zip(("lower", "upper"), bounds, strict=True):
                yield f"{name} at its {side} bound", np.abs(values - bound) <= ON_BOUND * nominal
