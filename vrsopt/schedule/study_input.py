"""What a comparison of schedules is given: mission or track, surrogate, names of schedules, limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from vrsopt.errors import InputError
from vrsopt.helicopter import MODEL_VERSION, Helicopter, helicopter
from vrsopt.mission.file import Mission, Weather, mission_from, read_mission, validated
from vrsopt.mission.track import FlownMission, track_mission
from vrsopt.mission.track_file import SUFFIXES
from vrsopt.schedule.bands import ForbiddenBand
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.surrogate.store import Surrogate, load

SCHEDULES = (
    "nominal",
    "constant",
    "pointwise",
    "prescribed",
    "trajectory",
    "consistent",
    "variable_transmission",
)
DEFAULT = ("nominal", "pointwise", "trajectory")


def schedule_settings(mission: Mission | FlownMission, machine: Helicopter) -> ScheduleSettings:
    """The mission's limits on schedules in SI units, around the aircraft's nominal rotor speed and twist.

    Raises :class:`InputError` for limits that contradict each other or the aircraft.
    """
    limits, rotor = mission.limits, machine.aircraft.main_rotor
    least_twist, most_twist = map(math.radians, limits.twist_deg)
    if not least_twist <= rotor.twist <= most_twist:
        allowed = f"allowed: around {math.degrees(rotor.twist):g}, the nominal twist of {machine.aircraft.name}"
        raise InputError(f"limits.twist_deg = {[*limits.twist_deg]}: {allowed}")

    def speed(percent: float) -> float:
        return percent / 100 * rotor.nominal_rotor_speed

    low, high = map(speed, limits.rotor_speed_percent)
    accelerations = limits.rotor_speed_acceleration_percent_s2, limits.twist_acceleration_deg_s2
    return ScheduleSettings(
        nominal_rotor_speed=rotor.nominal_rotor_speed,
        nominal_twist=rotor.twist,
        rotor_speed_bounds=(low, high),
        twist_bounds=(least_twist, most_twist),
        rotor_speed_rate=speed(limits.rotor_speed_rate_percent_s),
        twist_rate=math.radians(limits.twist_rate_deg_s),
        rotor_speed_acceleration=None if accelerations[0] is None else speed(accelerations[0]),
        twist_acceleration=None if accelerations[1] is None else math.radians(accelerations[1]),
        spin_down_credit=limits.spin_down_credit,
        forbidden_bands=tuple(
            ForbiddenBand(speed(band.percent[0]), speed(band.percent[1]), band.crossing_s)
            for band in limits.forbidden_rotor_speed
        ),
        ends=limits.ends,
    )


def read(
    path: Path | str,
    *,
    mass: float | None = None,
    isa_offset: float | None = None,
    wind: tuple[float, float | None] | None = None,
) -> Mission | FlownMission:
    """The mission of a file, or the track of one (CSV, GPX) with its take-off ``mass`` [kg].

    ``isa_offset`` [K] and ``wind`` (from where [deg], speed [m/s]), where given, replace those of a mission. Raises
    :class:`InputError` for a file that can not be used, also not with the aircraft that it names, and for a track
    without mass or a mission with one.
    """
    weather: dict[str, Any] = {} if isa_offset is None else {"isa_offset_k": isa_offset}
    if wind is not None:
        weather["wind"] = {"from_deg": wind[0]} | ({} if wind[1] is None else {"speed_m_s": wind[1]})
    if Path(path).suffix.lower() in SUFFIXES:
        if mass is None:
            raise InputError(f"{path}: mass: missing: needed with a flown track, the take-off mass in kg")
        stated = validated(Weather, weather, where="solve")
        return track_mission(path, mass, isa_offset=stated.isa_offset_k, wind=stated.wind.field)
    if mass is not None:
        raise InputError(f"{path}: mass = {mass:g}: allowed with a flown track; a mission file states its loading")
    mission = read_mission(path)
    if weather:
        mission = mission_from(mission.model_dump(mode="json", exclude_none=True) | weather, where=str(path))
    try:
        schedule_settings(mission, helicopter(mission.aircraft))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return mission


def checked_schedules(schedules: Sequence[str]) -> Sequence[str]:
    """``schedules`` as they are; raises :class:`InputError` for a name that is not one of SCHEDULES."""
    for name in schedules:
        if name not in SCHEDULES:
            raise InputError(f"solve: schedules: {name!r}: some of {', '.join(SCHEDULES)}")
    return schedules


def loaded(surrogate: Surrogate | Path | str | None, hashed: str) -> Surrogate:
    """The surrogate of a file, or the shipped one; it must be of this model and this aircraft.

    ``hashed``: hash of the aircraft's data.
    """
    if isinstance(surrogate, Surrogate):
        return surrogate
    if surrogate is not None:
        return load(surrogate, model_version=MODEL_VERSION, data_hash=hashed)
    return _shipped(hashed)


@lru_cache(maxsize=1)
def _shipped(hashed: str) -> Surrogate:
    return load("level", model_version=MODEL_VERSION, data_hash=hashed)
