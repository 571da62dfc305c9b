"""What the tables of a mission file have in common: typed, frozen, each number with its range."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError


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


MAX_ALTITUDE = 2000.0  # m, upper end of the study's altitudes

Altitude = Annotated[float, BeforeValidator(within(0.0, MAX_ALTITUDE))]
Bearing = Annotated[float, BeforeValidator(within(0.0, 360.0))]
Name = Annotated[str, Field(min_length=1)]


class Table(BaseModel):
    """Base of everything read from a mission file: frozen, no unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")
