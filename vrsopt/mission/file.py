"""The mission file: aircraft, start, places, loading, limits and tasks, read from TOML and checked.

Whatever is wrong with a file ends in one line: file, field, value, what is allowed.
"""

from __future__ import annotations

import json
import re
from itertools import accumulate
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from vrsopt.errors import InputError
from vrsopt.mission.profile import Profile
from vrsopt.mission.route import Point
from vrsopt.mission.tasks import TASK_TYPES, Altitude, Cruise, Hover, Idle, Name, Search, Table, Task, complaint, within
from vrsopt.quantity import read_toml

Mass = Annotated[float, BeforeValidator(within(0.0, 2500.0))]
RotorSpeedPercent = Annotated[float, BeforeValidator(within(75.0, 115.0))]
TwistDeg = Annotated[float, BeforeValidator(within(6.0, 16.0))]
Rate = Annotated[float, BeforeValidator(within(0.01, 20.0))]


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


class Limits(Table):
    """What a schedule may do. ``limits`` names the engine limits: flight manual, or the study's 313 kW per engine."""

    rotor_speed_percent: tuple[RotorSpeedPercent, RotorSpeedPercent] = (75.0, 115.0)
    twist_deg: tuple[TwistDeg, TwistDeg] = (6.0, 16.0)
    rotor_speed_rate_percent_s: Rate = 1.0
    twist_rate_deg_s: Rate = 1.0
    limits: Literal["manual", "study"] = "manual"
    manoeuvre_margin: Annotated[float, BeforeValidator(within(1.0, 2.0))] | None = None  # default: the aircraft's

    @model_validator(mode="after")
    def _ranges_in_order(self) -> Limits:
        for field in ("rotor_speed_percent", "twist_deg"):
            low, high = getattr(self, field)
            if low > high:
                raise complaint(field, [low, high], "allowed: [lower, upper]")
        return self


class Mission(Table):
    """A mission as its file states it."""

    name: Name
    aircraft: Name
    start: Name
    isa_offset_k: Annotated[float, BeforeValidator(within(-40.0, 40.0))] = 0.0
    places: Annotated[dict[Name, Place], Field(min_length=1)]
    loading: Loading
    limits: Limits = Limits()
    tasks: Annotated[tuple[Task, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _places_known(self) -> Mission:
        named = [("start", self.start)]
        for index, task in enumerate(self.tasks):
            if isinstance(task, Cruise):
                named.append((f"tasks[{index}].to", task.to))
            elif isinstance(task, Search):
                named.append((f"tasks[{index}].around", task.around))
        for field, place in named:
            if place not in self.places:
                raise complaint(field, place, f"allowed: a place of this file ({', '.join(self.places)})")
        return self

    @model_validator(mode="after")
    def _begins_and_ends_at_rest(self) -> Mission:
        for index in (0, len(self.tasks) - 1):
            if not isinstance(self.tasks[index], Idle | Hover):
                allowed = "allowed for the first and the last task: idle, hover"
                raise complaint(f"tasks[{index}].kind", self.tasks[index].kind, allowed)
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
    """The mission in a TOML file, its route checked too.

    Raises :class:`InputError` (file, field, value, what is allowed) for a file that is missing, is not TOML, or states
    something that can not be flown.
    """
    path = Path(path)
    mission = mission_from(read_toml(path), where=str(path))
    Profile.of(mission, where=str(path))
    return mission


def mission_from(data: dict[str, Any], *, where: str) -> Mission:
    """``data`` (as read from TOML) as a mission; raises :class:`InputError` that begins with ``where``."""
    try:
        return Mission.model_validate(data)
    except ValidationError as error:
        raise InputError(f"{where}: {_first_line(error)}") from None


def _first_line(error: ValidationError) -> str:
    """The first complaint as ``field = value: what is allowed``."""
    item = error.errors(include_url=False)[0]
    where = tuple(part for part in item["loc"] if part != "[key]")  # pydantic's mark of a bad name
    kind, context = item["type"], item.get("ctx", {})
    model = _model_at(where[:-1] if kind in ("missing", "extra_forbidden") else where)
    if kind == "missing":
        return f"{_field(where)}: missing"
    if kind == "extra_forbidden":
        return f"{_field(where)} = {_shown(item['input'])}: unknown key, allowed: {', '.join(model.model_fields)}"
    if kind == "union_tag_not_found":
        return f"{_field(where)}.kind: missing, allowed: {', '.join(TASK_TYPES)}"
    if kind == "union_tag_invalid":
        return f"{_field(where)}.kind = {_shown(item['input']['kind'])}: allowed: {', '.join(TASK_TYPES)}"
    if kind == "complaint":
        return (
            f"{'.'.join(filter(None, (_field(where), context['field'])))} = {_shown(context['value'])}: {item['msg']}"
        )
    return f"{_field(where)} = {_shown(item['input'])}: {_allowed(kind, item['msg'])}"


def _allowed(kind: str, message: str) -> str:
    """What pydantic's own complaints mean to someone who writes a TOML file."""
    words = {
        "model_type": "allowed: a table",
        "model_attributes_type": "allowed: a table",
        "dict_type": "allowed: a table",
        "tuple_type": "allowed: a list",
        "string_type": "allowed: a text",
        "string_too_short": "allowed: a text that is not empty",
        "too_short": "allowed: at least one entry",
        "too_long": "allowed: two numbers, [lower, upper]",
    }
    return words.get(kind, message.removeprefix("Value error, ").replace("Input should be", "allowed:"))


def _model_at(where: tuple[int | str, ...]) -> type[Table]:
    """The model of the table at a location of pydantic's."""
    match where:
        case ("places", _, *_):
            return Place
        case ("loading", *_):
            return Loading
        case ("limits", *_):
            return Limits
        case ("tasks", int(), str(kind), *_):
            return TASK_TYPES[kind]
    return Mission


def _field(where: tuple[int | str, ...]) -> str:
    """A location as a reader of the file would write it: ``tasks[3].speed_m_s``."""
    if where[:1] == ("tasks",):
        where = where[:2] + where[3:]  # pydantic puts the kind of the task after its index
    text = ""
    for part in where:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            bare = part if re.fullmatch(r"[A-Za-z0-9_-]+", part) else json.dumps(part)
            text += f".{bare}" if text else bare
    return text


def _shown(value: Any) -> str:
    """A value in a message: one line, not too long."""
    try:
        text = repr(value)
    except ValueError:  # an integer too long to print in decimal
        text = "(a number of thousands of digits)"
    return text if len(text) <= 60 else text[:57] + "..."
