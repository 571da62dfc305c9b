"""The schedule every other one is compared with: rotor speed and twist constant."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vrsopt.schedule.schedule import Schedule, ScheduleSettings

if TYPE_CHECKING:
    from vrsopt.mission.profile import Profile


def constant_schedule(profile: Profile, *, rotor_speed: float, twist: float, name: str = "constant") -> Schedule:
    """Rotor speed [rad/s] and twist [rad] constant over the whole mission.

    ``name``: of the schedule.
    """
    edges = np.asarray(profile.edges, dtype=float)
    time = np.column_stack([edges[:-1], edges[1:]]).ravel()
    segment = np.repeat(np.arange(len(edges) - 1), 2)
    return Schedule(name, segment, time, np.full(time.shape, float(rotor_speed)), np.full(time.shape, float(twist)))


def nominal_schedule(profile: Profile, settings: ScheduleSettings | None = None) -> Schedule:
    """The nominal rotor speed and twist of ``settings`` throughout."""
    settings = settings or ScheduleSettings()
    return constant_schedule(
        profile, rotor_speed=settings.nominal_rotor_speed, twist=settings.nominal_twist, name="nominal"
    )
