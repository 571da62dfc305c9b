"""The mission file: aircraft, start, places, loading, limits and tasks, read from TOML and checked.

Whatever is wrong with a file ends in one line: file, field, value, what is allowed.
"""

from __future__ import annotations

from itertools import accumulate, pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeVar

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from vrsopt.errors import InputError
from vrsopt.mission.field import Altitude, Name, Table, complaint, number_or_list, true_or_false, within
from vrsopt.mission.file_errors import Location, first_line
from vrsopt.mission.profile import Profile
from vrsopt.mission.ranges import free_values
from vrsopt.mission.rest_tasks import GroundIdle, Hover, Idle
from vrsopt.mission.route import Point
from vrsopt.mission.task_types import TASK_TYPES, AnyTask
from vrsopt.mission.wind import Wind
from vrsopt.quantity import read_toml

T = TypeVar("T", bound=Table)
Mass = Annotated[float, BeforeValidator(within(0.0, 2500.0))]
RotorSpeedPercent = Annotated[float, BeforeValidator(within(75.0, 115.0))]
TwistDeg = Annotated[float, BeforeValidator(within(6.0, 16.0))]
Rate = Annotated[float, BeforeValidator(within(0.01, 20.0))]
Acceleration = Annotated[float, BeforeValidator(within(0.001, 100.0))]


class Place(Table):
    """A point on the ground; the elevation is above sea level and counts as pressure altitude."""

    latitude_deg: Annotated[float, BeforeValidator(within(-90.0, 90.0))]
    longitude_deg: Annotated[float, BeforeValidator(within(-180.0, 180.0))]
    elevation_m: Altitude

    @property
    def point(self) -> Point:
        """Where it is."""
        return Point(self.latitude_deg, self.longitude_deg)


class Loading(Table):
    """What the aircraft carries at the start besides fuel, and the fuel that has to be left at the end.

    ``equipment_kg`` names each item: equipment, further crew, passengers aboard from the start.
    """

    empty_kg: Mass
    crew_kg: Mass
    equipment_kg: dict[Name, Mass] = Field(default_factory=dict)
    reserve_minutes: Annotated[float, BeforeValidator(within(0.0, 120.0))] = 30.0

    @property
    def zero_fuel_mass(self) -> float:
        """Mass at the start of the mission without fuel [kg]."""
        return self.empty_kg + self.crew_kg + sum(self.equipment_kg.values())


class ForbiddenRotorSpeed(Table):
    """Rotor speeds between which the rotor may not stay, and the longest time in which it crosses them."""

    percent: tuple[Annotated[float, BeforeValidator(within(0.0, 200.0))], ...]
    crossing_s: Annotated[float, BeforeValidator(within(0.0, 3600.0))] = 10.0

    @model_validator(mode="after")
    def _two_in_order(self) -> ForbiddenRotorSpeed:
        if len(self.percent) != 2 or not self.percent[0] < self.percent[1]:
            raise complaint("percent", list(self.percent), "allowed: [lower, upper]")
        return self


class Limits(Table):
    """What a schedule may do. ``limits`` names the engine limits: flight manual, or the study's 313 kW per engine.

    Accelerations are those of the rates, unlimited unless stated. Without ``spin_down_credit`` the power that speeds
    the rotor up is charged, and nothing is given back. ``ends``: rotor speed and twist nominal at both ends of the
    mission, free, or at the end what they are at the start.
    """

    rotor_speed_percent: tuple[RotorSpeedPercent, RotorSpeedPercent] = (75.0, 115.0)
    twist_deg: tuple[TwistDeg, TwistDeg] = (6.0, 16.0)
    rotor_speed_rate_percent_s: Rate = 1.0
    twist_rate_deg_s: Rate = 1.0
    rotor_speed_acceleration_percent_s2: Acceleration | None = None
    twist_acceleration_deg_s2: Acceleration | None = None
    spin_down_credit: Annotated[bool, BeforeValidator(true_or_false)] = True
    forbidden_rotor_speed: tuple[ForbiddenRotorSpeed, ...] = ()
    ends: Literal["pinned", "free", "periodic"] = "pinned"
    limits: Literal["manual", "study"] = "manual"
    manoeuvre_margin: Annotated[float, BeforeValidator(within(1.0, 2.0))] | None = None  # default: the aircraft's

    @model_validator(mode="after")
    def _ranges_in_order(self) -> Limits:
        for field in ("rotor_speed_percent", "twist_deg"):
            low, high = getattr(self, field)
            if low > high:
                raise complaint(field, [low, high], "allowed: [lower, upper]")
        low, high = self.rotor_speed_percent
        if not low <= 100.0 <= high:
            raise complaint("rotor_speed_percent", [low, high], "allowed: around 100, the nominal rotor speed")
        return self

    @model_validator(mode="after")
    def _bands_can_be_kept(self) -> Limits:
        bands = sorted(band.percent for band in self.forbidden_rotor_speed)
        for below, above in pairwise(bands):
            if above[0] <= below[1]:
                raise complaint("forbidden_rotor_speed", [*map(list, bands)], "allowed: bands that do not touch")
        lowest, highest = self.rotor_speed_percent
        for index, band in enumerate(self.forbidden_rotor_speed):
            (low, high), field = band.percent, f"forbidden_rotor_speed[{index}]"
            if self.ends == "pinned" and low < 100.0 < high:
                allowed = "allowed: a band without 100 %, at which the mission begins and ends"
                raise complaint(f"{field}.percent", [low, high], allowed)
            if low < highest and lowest < high and low <= lowest and highest <= high:
                allowed = f"allowed: a band that leaves some of rotor_speed_percent, {lowest:g} to {highest:g}"
                raise complaint(f"{field}.percent", [low, high], allowed)
            least = (high - low) / self.rotor_speed_rate_percent_s
            if lowest < low and high < highest and 0.0 < band.crossing_s < least:
                allowed = f"allowed: 0 (never cross), or at least {least:g} s by rotor_speed_rate_percent_s"
                raise complaint(f"{field}.crossing_s", band.crossing_s, allowed)
        return self


class Handling(Table):
    """How the aircraft is flown from one task to the next; every figure is an assumption.

    Accelerations are the largest of a change of speed: from rest and to rest, and between speeds under way, where less
    power is left for it. ``bank_deg`` is that of turns from one leg to the next, taken up and given up in ``roll_in_s``
    each, as in all turns.
    """

    acceleration_m_s2: Annotated[float, BeforeValidator(within(0.05, 3.0))] = 1.0
    cruise_acceleration_m_s2: Annotated[float, BeforeValidator(within(0.05, 3.0))] = 0.4
    vertical_acceleration_m_s2: Annotated[float, BeforeValidator(within(0.05, 2.0))] = 0.5
    bank_deg: Annotated[float, BeforeValidator(within(5.0, 45.0))] = 20.0
    roll_in_s: Annotated[float, BeforeValidator(within(0.5, 10.0))] = 3.0


class WindTable(Table):
    """Steady wind: where it blows from (true) and how strong, the same everywhere or at the altitudes given."""

    from_deg: Annotated[float | tuple[float, ...], BeforeValidator(number_or_list(0.0, 360.0))]
    speed_m_s: Annotated[float | tuple[float, ...], BeforeValidator(number_or_list(0.0, 25.0))]
    altitude_m: tuple[Altitude, ...] | None = None

    @model_validator(mode="after")
    def _one_each(self) -> WindTable:
        altitudes = self.altitude_m
        if altitudes is not None and not (altitudes and all(a < b for a, b in pairwise(altitudes))):
            raise complaint("altitude_m", list(altitudes), "allowed: one or more altitudes, each above the one before")
        for field in ("from_deg", "speed_m_s"):
            value = getattr(self, field)
            if altitudes is None and isinstance(value, tuple):
                raise complaint(field, list(value), "allowed: one number, unless altitude_m is given")
            if altitudes is not None and not (isinstance(value, tuple) and len(value) == len(altitudes)):
                allowed = f"allowed: a list with one number for each of altitude_m, {len(altitudes)}"
                raise complaint(field, list(value) if isinstance(value, tuple) else value, allowed)
        return self

    @property
    def field(self) -> Wind:
        """The wind by altitude."""
        return Wind.from_directions(self.altitude_m or (0.0,), self.from_deg, self.speed_m_s)


class Weather(Table):
    """The day: temperature above the standard atmosphere, and wind."""

    isa_offset_k: Annotated[float, BeforeValidator(within(-40.0, 40.0))] = 0.0
    wind: WindTable = WindTable(from_deg=0.0, speed_m_s=0.0)


class Mission(Weather):
    """A mission as its file states it."""

    name: Name
    aircraft: Name
    start: Name
    places: Annotated[dict[Name, Place], Field(min_length=1)]
    loading: Loading
    limits: Limits = Limits()
    handling: Handling = Handling()
    tasks: Annotated[tuple[AnyTask, ...], Field(min_length=1)]
    notes: ClassVar[tuple[str, ...]] = ()  # what was changed to make it flyable: nothing, a file says what it means

    @model_validator(mode="after")
    def _places_known(self) -> Mission:
        named = [("start", self.start)]
        for index, task in enumerate(self.tasks):
            place = getattr(task, task.place_field) if task.place_field else None
            if place is not None:
                named.append((f"tasks[{index}].{task.place_field}", place))
        for field, place in named:
            if place not in self.places:
                raise complaint(field, place, f"allowed: a place of this file ({', '.join(self.places)})")
        return self

    @model_validator(mode="after")
    def _begins_and_ends_at_rest(self) -> Mission:
        for index in (0, len(self.tasks) - 1):
            if not isinstance(self.tasks[index], Idle | GroundIdle | Hover):
                allowed = "allowed for the first and the last task: idle, ground_idle, hover"
                raise complaint(f"tasks[{index}].kind", self.tasks[index].kind, allowed)
        return self

    @model_validator(mode="after")
    def _bands_without_idle(self) -> Mission:
        idle = next((k for k, task in enumerate(self.tasks) if isinstance(task, Idle | GroundIdle)), None)
        for index, band in enumerate(self.limits.forbidden_rotor_speed):
            if idle is not None and band.percent[0] < 100.0 < band.percent[1]:
                where = f"tasks[{idle}] ({self.tasks[idle].kind})"
                allowed = f"allowed: a band without 100 %, at which the rotor turns in {where}"
                raise complaint(f"limits.forbidden_rotor_speed[{index}].percent", list(band.percent), allowed)
        return self

    @model_validator(mode="after")
    def _ranges_possible(self) -> Mission:
        free_values(self.tasks)
        return self

    @model_validator(mode="after")
    def _mass_changes_possible(self) -> Mission:
        changes = [getattr(task, "mass_change_kg", 0.0) for task in self.tasks]
        if changes[0]:
            allowed = "allowed for the first task: 0 (state in [loading] what is aboard at the start)"
            raise complaint("tasks[0].mass_change_kg", changes[0], allowed)
        aboard = sum(self.loading.equipment_kg.values())
        for index, carried in enumerate(accumulate(changes, initial=aboard)):
            if carried < -1e-9:
                allowed = f"allowed: no more than is aboard, {carried - changes[index - 1]:g} kg"
                raise complaint(f"tasks[{index - 1}].mass_change_kg", changes[index - 1], allowed)
        return self


def read_mission(path: str | Path) -> Mission:
    """The mission in a TOML file at ``path``, its route checked too.

    Raises :class:`InputError` (file, field, value, what is allowed) for a file that is missing, is not TOML, or states
    something that can not be flown.
    """
    path = Path(path)
    mission = mission_from(read_toml(path), where=str(path))
    Profile.of(mission, where=str(path))
    return mission


def mission_from(data: dict[str, Any], *, where: str) -> Mission:
    """``data`` (as read from TOML) as a mission; raises :class:`InputError` that begins with ``where``."""
    return validated(Mission, data, where=where)


def validated(model: type[T], data: dict[str, Any], *, where: str) -> T:
    """``data`` as one of the tables of a mission file; raises :class:`InputError` that begins with ``where``.

    ``model``: the class of the table.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise InputError(f"{where}: {first_line(error, _model_at)}") from None


def _model_at(where: Location) -> type[Table]:
    """The model of the table at a location of pydantic's."""
    match where:
        case ("places", _, *_):
            return Place
        case ("loading", *_):
            return Loading
        case ("limits", "forbidden_rotor_speed", int(), *_):
            return ForbiddenRotorSpeed
        case ("limits", *_):
            return Limits
        case ("handling", *_):
            return Handling
        case ("wind", *_):
            return WindTable
        case ("tasks", int(), str(kind), *_):
            return TASK_TYPES[kind]
    return Mission
