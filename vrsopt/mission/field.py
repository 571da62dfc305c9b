"""What the tables of a mission file have in common: typed, frozen, each number with its range."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError


def within(low: float, high: float) -> Callable[[Any], float]:
    """A check for a number from ``low`` to ``high``; one message for a wrong type, NaN and a wrong size alike."""

    def check(value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise ValueError(f"allowed: a number from {low:g} to {high:g}")
        return float(value)

    return check


def number_or_list(low: float, high: float) -> Callable[[Any], float | tuple[float, ...]]:
    """A check for one number from ``low`` to ``high``, or a list of them."""
    check = within(low, high)

    def check_all(value: Any) -> float | tuple[float, ...]:
        try:
            return tuple(check(item) for item in value) if isinstance(value, list | tuple) else check(value)
        except ValueError as error:
            raise ValueError(f"{error}, or a list of them") from None

    return check_all


def true_or_false(value: Any) -> bool:
    """A check for a switch.

    ``value``: as read from the file.
    """
    if not isinstance(value, bool):
        raise ValueError("allowed: true or false")
    return value


def printable(text: str) -> str:
    """A check for names, which messages and tables show in one line.

    ``text``: as read from the file.
    """
    if not text.isprintable():
        raise ValueError("allowed: a text in one line, of characters that can be shown")
    return text


def tenths_up(value: float) -> str:
    """A lower limit as a message states it, in tenths and never below the limit itself.

    ``value``: the limit.
    """
    return f"{ceil(10.0 * value - 1e-9) / 10.0:.1f}"


def complaint(field: str, value: Any, allowed: str) -> PydanticCustomError:
    """An error about ``field`` of a table as a whole (it depends on other fields), for its validator to raise.

    ``value``: what the file states, None where it is missing; ``allowed``: what may stand there.
    """
    return PydanticCustomError("complaint", "{allowed}", {"field": field, "value": value, "allowed": allowed})


MAX_ALTITUDE = 2000.0  # m, upper end of the study's altitudes

Altitude = Annotated[float, BeforeValidator(within(0.0, MAX_ALTITUDE))]
Bearing = Annotated[float, BeforeValidator(within(0.0, 360.0))]
Name = Annotated[str, Field(min_length=1), AfterValidator(printable)]


class Table(BaseModel):
    """Base of everything read from a mission file: frozen, no unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")
