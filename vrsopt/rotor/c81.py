"""Section decks in the C81 text form: tables of lift, drag and moment coefficient over angle of attack and Mach number.

First line: a title of 30 columns, then the numbers of Mach numbers and angles of the three tables, two columns each.
Then each table: its Mach numbers, and for each angle of attack [deg] the values at all Mach numbers. Fields are 7 (or
10) columns wide; the first holds the angle, nine values follow, and further ones stand on lines that leave it blank.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vrsopt.errors import InputError

VALUES_PER_LINE = 9
WIDTHS = (7, 10)  # columns of a field
QUANTITIES = ("lift", "drag", "moment")


@dataclass(frozen=True)
class Table:
    """One coefficient: angles of attack (n,) in degrees, Mach numbers (m,), values (n, m)."""

    angle_deg: np.ndarray
    mach: np.ndarray
    value: np.ndarray


@dataclass(frozen=True)
class Deck:
    """The three tables of a section."""

    name: str
    lift: Table
    drag: Table
    moment: Table


def read_c81(path: str | Path) -> Deck:
    """The deck in a text file; raises :class:`InputError` with one line that names line and field."""
    path = Path(path)
    try:
        lines = path.read_text(encoding="latin-1").splitlines()
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except OSError as error:
        raise InputError(f"{path}: can not be read: {error.strerror}") from None
    numbered = ((number, line) for number, line in enumerate(lines, 1) if number == 1 or line.strip())
    name, counts = _header(next(numbered, (1, ""))[1], path.name)
    tables = [
        _table(numbered, f"{path.name}: {quantity}", *counts[2 * k : 2 * k + 2])
        for k, quantity in enumerate(QUANTITIES)
    ]
    return Deck(name, *tables)


def _header(line: str, where: str) -> tuple[str, list[int]]:
    """Title and the six counts, at their columns or as the last six words of the line."""
    fields = [line[30 + 2 * k : 32 + 2 * k].strip() for k in range(6)]
    words = line.split()[-6:]
    for counts in (fields, words):
        if len(counts) == 6 and all(re.fullmatch(r"\d{1,2}", count) for count in counts):
            numbers = [int(count) for count in counts]
            break
    else:
        raise InputError(
            f"{where}: line 1 = {line.strip()[:60]!r}: expected a title of 30 columns and six counts of two columns"
        )
    for number, what in zip(numbers, ("Mach numbers", "angles") * 3, strict=True):
        if number < (1 if what == "Mach numbers" else 2):
            raise InputError(f"{where}: line 1: {number} {what}: too few for a table")
    return line[:30].strip(), numbers


def _table(lines: Iterator[tuple[int, str]], where: str, machs: int, angles: int) -> Table:
    mach = _row(lines, where, machs, what="Mach numbers")[1]
    rows = [_row(lines, where, machs, what=f"angle {k + 1} of {angles}") for k in range(angles)]
    first = [row[0] for row in rows]
    for (number, angle), (_, before) in zip(first[1:], first[:-1], strict=True):
        if angle <= before:
            raise InputError(f"{where}: line {number}, angle = {angle:g}: must be above the one before, {before:g}")
    if any(b <= a for a, b in zip(mach[:-1], mach[1:], strict=True)):
        raise InputError(f"{where}: Mach numbers = {mach}: must increase")
    return Table(np.array([angle for _, angle in first]), np.array(mach), np.array([row[1] for row in rows]))


def _row(
    lines: Iterator[tuple[int, str]], where: str, count: int, *, what: str
) -> tuple[tuple[int, float], list[float]]:
    """One row over all its lines: (number of its first line, its angle; zero for Mach numbers), the values."""
    values: list[float] = []
    start, angle = 0, 0.0
    while len(values) < count:
        number, line = next(lines, (0, ""))
        if not number:
            raise InputError(f"{where}: {what}: the file ends before it is complete")
        leading = what != "Mach numbers" and not start
        room = min(VALUES_PER_LINE, count - len(values))
        numbers = _numbers(line.rstrip(), leading, room, f"{where}: line {number}")
        if not start:
            start = number
        if leading:
            angle = numbers.pop(0)
        values += numbers
    return (start, angle), values


def _numbers(line: str, leading: bool, room: int, where: str) -> list[float]:
    """The numbers of one line; ``leading``: the first field holds the angle, else it is blank."""
    expected = room + leading
    for width in WIDTHS:
        fields = [line[k : k + width].strip() for k in range(0, len(line), width)]
        if not leading and fields and not fields[0]:
            fields = fields[1:]
        if len(fields) == expected and all(map(_is_number, fields)):
            return [float(field) for field in fields]
    words = line.split()
    wrong = next(((k, word) for k, word in enumerate(words, 1) if not _is_number(word)), None)
    if wrong:
        raise InputError(f"{where}, field {wrong[0]} = {wrong[1]!r}: a number expected")
    if len(words) != expected:
        raise InputError(f"{where}: {len(words)} numbers: expected {expected}")
    return [float(word) for word in words]


def _is_number(text: str) -> bool:
    return re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", text) is not None
