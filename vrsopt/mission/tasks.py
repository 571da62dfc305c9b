"""The tasks a mission is made of, as a mission file states them: engineering units, the unit in the name.

Each ``[[tasks]]`` table has a ``kind``; the kind decides which other keys it takes. What a task means in the air
(where it starts, how far it goes) is worked out in :mod:`vrsopt.mission.plan`, because it depends on its neighbours.
"""

from __future__ import annotations

from collections.abc import Callable
from math import atan, cos, degrees, radians, tan
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from vrsopt.atmosphere import GRAVITY

MAX_ALTITUDE = 2000.0  # m, upper end of the study's altitudes
MAX_BANK_DEG = 60.0  # load factor 2


def within(low: float, high: float) -> Callable[[Any], float]:
    """A check for a number from ``low`` to ``high``; one message for a wrong type, NaN and a wrong size alike."""

    def check(value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise ValueError(f"allowed: a number from {low:g} to {high:g}")
        return float(value)

    return check


def complaint(field: str, value: Any, allowed: str) -> PydanticCustomError:
    """An error about ``field`` of a table as a whole (it depends on other fields), for its validator to raise."""
    return PydanticCustomError("complaint", "{allowed}", {"field": field, "value": value, "allowed": allowed})


Speed = Annotated[float, BeforeValidator(within(1.0, 70.0))]
Duration = Annotated[float, BeforeValidator(within(1.0, 20_000.0))]
Altitude = Annotated[float, BeforeValidator(within(0.0, MAX_ALTITUDE))]
Height = Annotated[float, BeforeValidator(within(0.0, 500.0))]
MassChange = Annotated[float, BeforeValidator(within(-1000.0, 1000.0))]
Name = Annotated[str, Field(min_length=1)]


class Table(BaseModel):
    """Base of everything read from a mission file: frozen, no unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Idle(Table):
    """On the ground at a place, rotor at nominal speed and flat pitch. A mass change happens at its start."""

    kind: Literal["idle"]
    duration_s: Duration
    mass_change_kg: MassChange = 0.0


class Hover(Table):
    """Still over a place, skids ``height_m`` above its elevation. A mass change happens at its start."""

    kind: Literal["hover"]
    duration_s: Duration
    height_m: Height = 2.0
    mass_change_kg: MassChange = 0.0


class Climb(Table):
    """Up to ``altitude_m``, along the route toward the place of the next cruise."""

    kind: Literal["climb"]
    altitude_m: Altitude
    speed_m_s: Speed = 40.0
    climb_angle_deg: Annotated[float, BeforeValidator(within(0.5, 30.0))] = 7.12


class Cruise(Table):
    """Level flight to a place; climbs before it and descents after it are flown on the same geodesic."""

    kind: Literal["cruise"]
    to: Name
    speed_m_s: Speed


class Descent(Table):
    """Down to ``altitude_m`` or, without it, to the height of the hover that follows.

    After a cruise it ends over that cruise's place; elsewhere it is flown toward the place of the next cruise.
    """

    kind: Literal["descent"]
    altitude_m: Altitude | None = None
    speed_m_s: Speed = 40.0
    climb_angle_deg: Annotated[float, BeforeValidator(within(-30.0, -0.5))] = -7.12


class Search(Table):
    """Parallel-track search ("creeping line") centred on the place ``around``, at the altitude the aircraft has.

    Legs of ``leg_m`` along ``leg_bearing_deg`` (true), ``spacing_m`` apart, joined by turns of ``turn_radius_m``.
    ``duration_s`` counts from the start of the task: the flight to the nearest corner of the pattern is part of it.
    """

    kind: Literal["search"]
    around: Name
    leg_m: Annotated[float, BeforeValidator(within(100.0, 50_000.0))]
    spacing_m: Annotated[float, BeforeValidator(within(50.0, 20_000.0))]
    turn_radius_m: Annotated[float, BeforeValidator(within(20.0, 10_000.0))]
    speed_m_s: Speed
    duration_s: Duration
    leg_bearing_deg: Annotated[float, BeforeValidator(within(0.0, 360.0))] = 0.0

    @model_validator(mode="after")
    def _turns_can_be_flown(self) -> Search:
        if self.spacing_m < 2.0 * self.turn_radius_m:
            allowed = f"allowed: at least twice turn_radius_m, {2.0 * self.turn_radius_m:g}"
            raise complaint("spacing_m", self.spacing_m, allowed)
        if degrees(turn_bank(self.speed_m_s, self.turn_radius_m)) > MAX_BANK_DEG:
            tightest = self.speed_m_s**2 / (GRAVITY * tan(radians(MAX_BANK_DEG)))
            allowed = f"allowed: at least {tightest:.1f}, a bank of {MAX_BANK_DEG:g} deg at {self.speed_m_s:g} m/s"
            raise complaint("turn_radius_m", self.turn_radius_m, allowed)
        return self


Task = Annotated[Idle | Hover | Climb | Cruise | Descent | Search, Field(discriminator="kind")]
TASK_TYPES: dict[str, type[Table]] = {
    "idle": Idle,
    "hover": Hover,
    "climb": Climb,
    "cruise": Cruise,
    "descent": Descent,
    "search": Search,
}


def turn_bank(speed: float, radius: float) -> float:
    """Bank angle [rad] of a level coordinated turn at ``speed`` [m/s] and ``radius`` [m]: tan(bank) = V^2/(g R)."""
    return atan(speed**2 / (GRAVITY * radius))


def turn_load_factor(speed: float, radius: float) -> float:
    """Load factor [-] of the same turn: 1/cos(bank)."""
    return 1.0 / cos(turn_bank(speed, radius))
