"""The schedule of the reference study: rotor speed from a table in climb and descent, least fuel everywhere else.

In climb the rotor turns at 100 %, in descent at 95, 90 or 85 % by gross mass, with 8 deg of twist: the study's
surrogate knew level flight only. A mass on the boundary of two classes belongs to the heavier one.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from vrsopt.mission.segment import same_task
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import Schedule, ScheduleSettings

CLIMB = 1.0  # rotor speed over nominal
DESCENT = ((2300.0, 0.95), (2100.0, 0.90), (0.0, 0.85))  # from this gross mass [kg] on: rotor speed over nominal
TWIST = math.radians(8.0)
CLIMBS, DESCENTS = ("climb", "vertical_climb"), ("descent",)


def descent_speed(mass: float) -> float:
    """Rotor speed over nominal in descent at a gross mass [kg]."""
    return next(ratio for least, ratio in DESCENT if mass >= least)


def prescribed_schedule(
    pointwise: Schedule, grid: FlightGrid, *, takeoff_mass: float, settings: ScheduleSettings | None = None
) -> Schedule:
    """``pointwise`` with the table in climb and descent, within the bounds of ``settings``.

    The class of a descent is that of the mass [kg] at which its task begins, as ``pointwise`` burns.
    """
    settings = settings or ScheduleSettings()
    mass = grid.fly(pointwise, takeoff_mass=takeoff_mass).mass
    rotor_speed, twist = pointwise.rotor_speed.copy(), pointwise.twist.copy()
    begun = 0.0  # mass at the start of the descent
    for index, segment in enumerate(grid.profile.segments):
        before = grid.profile.segments[index - 1] if index else None
        if segment.kind not in CLIMBS + DESCENTS:
            continue
        if before is None or not same_task(before, segment):
            begun = float(mass[np.searchsorted(grid.segment, index)])
        ratio = CLIMB if segment.kind in CLIMBS else descent_speed(begun)
        here = pointwise.segment == index
        rotor_speed[here] = np.clip(ratio * settings.nominal_rotor_speed, *settings.rotor_speed_bounds)
        twist[here] = np.clip(TWIST, *settings.twist_bounds)
    return replace(pointwise, name="prescribed", rotor_speed=rotor_speed, twist=twist)
