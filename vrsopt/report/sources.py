"""The numbers that a result rests on, each with its source as the data files state it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vrsopt.quantity import Provenance, Record

if TYPE_CHECKING:
    from vrsopt.schedule.comparison import Comparison

INPUT_HEADINGS = ("number", "value", "unit", "range", "source", "note")
SETTING_HEADINGS = ("schedules may", "value")
SILENT = {"provenance", "variants", "calibration"}  # what no schedule is flown with
UNSURE = ("assumed", "solved", "recalled")  # words in a source that is none
SHOWN = 5  # numbers of a list that are shown


@dataclass(frozen=True)
class Number:
    """One number of a data file, or list of them: the tables that it is in and its name, what it is, its origin."""

    path: tuple[str, ...]
    value: object
    origin: Provenance
    unsure: bool  # it has a range, or its source says that it is assumed, solved or recalled

    @property
    def cells(self) -> tuple[str, ...]:
        """In the order of INPUT_HEADINGS."""
        between = "" if self.origin.range is None else f"{self.origin.range[0]:g} to {self.origin.range[1]:g}"
        words = ": ".join(part.replace("_", " ") for part in self.path)
        return words, _value(self.value), self.origin.unit, between, self.origin.source, self.origin.note


def numbers(record: Record, sources: dict[str, str]) -> Iterator[Number]:
    """Every number of ``record``, an aircraft or an engine, whose ``sources`` are told by their keys."""
    yield from _numbers(record, sources, ())


def _numbers(part: object, sources: dict[str, str], path: tuple[str, ...]) -> Iterator[Number]:
    if isinstance(part, dict):
        for name, inner in part.items():
            yield from _numbers(inner, sources, (*path, str(name)))
    if not isinstance(part, Record):
        return
    for name, origin in part.provenance.items():
        value = getattr(part, name)
        if value is not None:
            told = f"{origin.source} {sources.get(origin.source, '')}"
            unsure = origin.range is not None or any(word in told for word in UNSURE)
            yield Number((*path, name), value, origin, unsure)
    for name in type(part).model_fields:
        if name not in SILENT:
            yield from _numbers(getattr(part, name), sources, (*path, name))


def setting_rows(comparison: Comparison) -> list[tuple[str, str]]:
    """What the schedules may do, and the limits that they keep."""
    settings, limits = comparison.settings, comparison.limits
    percent = 100.0 / settings.nominal_rotor_speed
    speed, twist = (
        " to ".join(f"{scale * bound:g}" for bound in bounds)
        for scale, bounds in ((percent, settings.rotor_speed_bounds), (180.0 / math.pi, settings.twist_bounds))
    )
    rows = [
        ("have rotor speeds of", f"{speed} % of {settings.nominal_rotor_speed:g} rad/s"),
        ("change the rotor speed by", _rate(settings.rotor_speed_rate, percent, "%/s")),
        ("have a blade twist of", f"{twist} deg; nominal {math.degrees(settings.nominal_twist):g} deg"),
        ("change the twist by", _rate(settings.twist_rate, 180.0 / math.pi, "deg/s")),
        ("begin and end", {"pinned": "nominal", "free": "with any", "periodic": "with the same"}[settings.ends]),
        ("get back from a slowing rotor", "down to the engines' idle" if settings.spin_down_credit else "nothing"),
        ("keep a manoeuvre margin of", f"{limits.manoeuvre_margin:g} to the blade-loading limit"),
    ]
    stated = (f"{name} {value:.0f} {unit}" for name, (value, unit) in limits.stated.items())
    origin = {"manual": "flight manual", "study": "the engine's own rating"}[limits.setting]
    rows.append(("use at most", f"{', '.join(stated)} ({origin}; power is that of one engine)"))
    bands = [
        f"{percent * band.lower:g} to {percent * band.upper:g} %, crossed in {band.crossing_time:g} s"
        for band in settings.forbidden_bands
    ]
    return rows + ([("not stay at rotor speeds of", "; ".join(bands))] if bands else [])


def _rate(rate: float | None, scale: float, unit: str) -> str:
    return "any rate" if rate is None else f"at most {scale * rate:g} {unit}"


def _value(value: object) -> str:
    if isinstance(value, tuple):
        texts = [f"{one:g}" for one in value[:SHOWN]]
        return ", ".join(texts) + (f", ... ({len(value)})" if len(value) > SHOWN else "")
    return f"{value:g}" if isinstance(value, int | float) else str(value)
