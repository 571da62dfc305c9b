"""Times as loggers write them: seconds, Unix time, ISO 8601, time of day with or without a date."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from math import isfinite

ALLOWED = "seconds, Unix seconds or milliseconds, ISO 8601 (2024-05-17T10:30:00Z) or hh:mm:ss"
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
CLOCK = re.compile(r"(\d{1,2}):(\d{2})(?::(\d{2}(?:[.,]\d+)?))?(?:Z|z)?")
COMPACT = re.compile(r"(?:19|20)\d{12}")
UNIX = 1e8  # s, a larger number is a date: March 1973
LATEST = 4.1e9  # s, Unix time of the year 2099
DAY = 86_400.0  # s


@dataclass(frozen=True)
class Stamp:
    """A time [s], counted from what its kind says: "date" (Unix time), "clock" (midnight) or "seconds" (any start)."""

    kind: str
    seconds: float


def parse_number(text: str) -> float:
    """A finite decimal number; raises :class:`ValueError` for anything else, infinities and nan too.

    ``text``: of a field.
    """
    if not NUMBER.fullmatch(text) or not isfinite(value := float(text)):
        raise ValueError(text)
    return value


def parse_time(text: str, factor: float = 1.0) -> Stamp:
    """A time in any of the forms; plain numbers are multiplied by ``factor`` to seconds.

    ``text``: of a field. Raises :class:`ValueError` for what is none.
    """
    if COMPACT.fullmatch(text):
        return _date(datetime.strptime(text, "%Y%m%d%H%M%S"))
    if NUMBER.fullmatch(text):
        return _number(parse_number(text), factor)
    if found := CLOCK.fullmatch(text):
        hours, minutes, seconds = (float((part or "0").replace(",", ".")) for part in found.groups())
        if hours < 24.0 and minutes < 60.0 and seconds < 61.0:
            return Stamp("clock", 3600.0 * hours + 60.0 * minutes + seconds)
        raise ValueError(text)
    return _date(datetime.fromisoformat(re.sub(r"^(\d{4})/(\d{1,2})/", r"\1-\2-", text).removesuffix(" UTC")))


def _number(value: float, factor: float) -> Stamp:
    seconds = value * factor
    if factor == 1.0:
        for scale in (1e-9, 1e-6, 1e-3):  # nano-, micro-, milliseconds of the present time
            if UNIX < abs(value) * scale < LATEST and abs(value) > LATEST:
                seconds = value * scale
                break
    if abs(seconds) > LATEST:
        raise ValueError(value)
    return Stamp("date" if seconds > UNIX else "seconds", seconds)


def _date(when: datetime) -> Stamp:
    """Without a time zone the date counts as UTC."""
    return Stamp("date", (when if when.tzinfo else when.replace(tzinfo=UTC)).timestamp())


def unrolled(seconds: Sequence[float]) -> list[float]:
    """Times of day in the order they were recorded, counted on past midnight."""
    days, out, last = 0.0, [], None
    for value in seconds:
        if last is not None and value - last < -0.5 * DAY:
            days += DAY
        elif last is not None and value - last > 0.5 * DAY and days > 0.0:
            days -= DAY  # written out of order around midnight
        out.append(value + days)
        last = value
    return out


def said(stamp: Stamp) -> str:
    """The time in words; empty if it has no date."""
    if stamp.kind != "date":
        return ""
    return datetime.fromtimestamp(stamp.seconds, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
