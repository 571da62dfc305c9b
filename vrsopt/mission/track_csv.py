"""Tracks in text tables, as surveillance receivers and loggers write them.

The delimiter is a comma, a semicolon (then decimals may have commas), a tab or a bar; the columns are known by name,
see :mod:`vrsopt.mission.track_columns`. A few rows that can not be read are left out and counted.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vrsopt.errors import InputError
from vrsopt.mission.track_columns import Column, recognised
from vrsopt.mission.track_data import ALTITUDES, Track
from vrsopt.mission.track_time import ALLOWED, DAY, Stamp, parse_number, parse_time, said, unrolled

DELIMITERS = ",;\t|"
HEADER_WITHIN = 20  # lines
MOST_BAD = 0.1  # of the rows, that can not be read
NO_VALUE = ("", "na", "n/a", "nan", "null", "none", "-", "--")
FASTEST = 500.0  # m/s, that a receiver can mean
NEEDED = {
    "time": "time, timestamp, utc, ...",
    "latitude": "latitude, lat",
    "longitude": "longitude, lon, lng",
    "altitude": "altitude, alt, ele, baroaltitude, ... with the unit if not metres: altitude_ft",
}


class _Unusable(Exception):
    """A cell that makes its row useless: the heading, the text, what is allowed."""

    def __init__(self, heading: str, text: str, allowed: str) -> None:
        super().__init__()
        self.heading, self.text, self.allowed = heading, text, allowed


@dataclass(frozen=True)
class _Fix:
    """One row: time, position, and what else it says."""

    line: int
    stamp: Stamp
    latitude: float
    longitude: float
    altitude: float  # m
    ground_speed: float  # m/s
    course: float  # deg
    on_ground: bool
    aircraft: str


def parse_csv(text: str, *, where: str, name: str) -> Track:
    """The track in a text table; raises :class:`InputError` (file, line, column, value, what is allowed).

    ``text``: content of the file; ``where``: how messages call it; ``name``: of the track.
    """
    header, delimiter, columns = _header(text, where)
    rows = list(_rows(text, delimiter, where, after=header))
    chosen = _chosen(columns, [cells for _, cells in rows], where, header)
    fixes, empty, bad = _fixes(rows, chosen, delimiter, where)
    _one_aircraft(fixes, chosen, where)
    notes = [column.note for column in chosen.values() if column.note]
    notes += [f"{empty} of {len(rows)} rows have no position: left out"] if empty else []
    notes += [f"{len(bad)} of {len(rows)} rows can not be read: left out, the first is {bad[0]}"] if bad else []
    return replace(_track(fixes, chosen, where), name=name, notes=tuple(notes))


def _header(text: str, where: str) -> tuple[int, str, dict[str, list[Column]]]:
    """Line number of the headings, the delimiter, and the columns found."""
    best: tuple[int, int, str, dict[str, list[Column]]] | None = None
    first = ""
    for number, line in enumerate(text.splitlines()[:HEADER_WITHIN], start=1):
        first = first or line.strip()
        for delimiter in DELIMITERS:
            try:
                headings = next(csv.reader([line.lstrip("#").strip(" ")], delimiter=delimiter), [])
            except csv.Error:
                continue
            columns = recognised(headings)
            if best is None or len(columns) > best[0]:
                best = (len(columns), number, delimiter, columns)
    if best is None or not best[3]:
        allowed = "; ".join(f"{quantity} ({names})" for quantity, names in NEEDED.items())
        raise InputError(
            f"{where}: line 1: {_shown(first)}: no column recognised, allowed: a row of headings: {allowed}"
        )
    return best[1], best[2], best[3]


def _rows(text: str, delimiter: str, where: str, *, after: int) -> Iterator[tuple[int, list[str]]]:
    """Line number and cells of every row that is not blank, after the line of the headings."""
    reader = csv.reader(text.splitlines()[after:], delimiter=delimiter)
    while True:
        try:
            cells = next(reader)
        except StopIteration:
            return
        except csv.Error as error:
            raise InputError(f"{where}: line {after + reader.line_num}: not a row of a table: {error}") from None
        cells = [cell.strip() for cell in cells]
        if any(cells) and not cells[0].startswith("#"):
            yield after + reader.line_num, cells


def _chosen(
    columns: dict[str, list[Column]], rows: Sequence[Sequence[str]], where: str, line: int
) -> dict[str, Column]:
    """One column for each quantity: of several, the one to prefer among those that are filled in half of the rows."""
    if "date" in columns and "time" not in columns:
        columns = columns | {"time": columns["date"]}
    needed = [name for name in NEEDED if not ("position" in columns and name in ("latitude", "longitude"))]
    if missing := [name for name in needed if name not in columns]:
        found = ", ".join(column.heading for group in columns.values() for column in group)
        allowed = "; ".join(NEEDED[name] for name in missing)
        raise InputError(f"{where}: line {line}: column for {missing[0]}: missing among ({found}), allowed: {allowed}")
    if not rows:
        raise InputError(f"{where}: line {line}: no rows after the headings: allowed: at least 2 fixes")

    def filled(column: Column) -> int:
        return sum(column.index < len(cells) and cells[column.index].lower() not in NO_VALUE for cells in rows)

    chosen = {}
    for quantity, group in columns.items():
        counts = [filled(column) for column in group]
        enough = [column for column, count in zip(group, counts, strict=True) if 2 * count >= len(rows)]
        chosen[quantity] = enough[0] if enough else group[int(np.argmax(counts))]
    if "latitude" in chosen and "longitude" in chosen:
        chosen.pop("position", None)
    return chosen


def _fixes(
    rows: Sequence[tuple[int, list[str]]], chosen: dict[str, Column], delimiter: str, where: str
) -> tuple[list[_Fix], int, list[str]]:
    """The rows that can be read, the number of those without a position, and what is wrong with the others."""
    fixes, empty, bad, kind = [], 0, [], ""
    for line, cells in rows:
        try:
            fix = _fix(line, cells, chosen, comma=delimiter == ";")
            if fix is None:
                empty += 1
                continue
            if (kind := kind or fix.stamp.kind) != fix.stamp.kind:
                raise _Unusable(chosen["time"].heading, cells[chosen["time"].index], "times of one form")
            fixes.append(fix)
        except _Unusable as cell:
            bad.append(f"line {line}: {cell.heading} = {_shown(cell.text)}: allowed: {cell.allowed}")
    if len(bad) > MOST_BAD * len(rows):
        raise InputError(f"{where}: {bad[0]} ({len(bad)} of {len(rows)} rows can not be read, at most 10 % may)")
    if len(fixes) < 2:
        raise InputError(f"{where}: {len(fixes)} rows with a position: allowed: at least 2")
    return fixes, empty, bad


def _fix(line: int, cells: list[str], chosen: dict[str, Column], *, comma: bool) -> _Fix | None:
    """One row, None without a position; raises :class:`_Unusable`."""

    def text(quantity: str) -> str:
        column = chosen.get(quantity)
        cell = cells[column.index] if column and column.index < len(cells) else ""
        return cell.replace(",", ".") if comma and quantity != "position" else cell

    def number(quantity: str, low: float, high: float, cell: str, *, needed: bool = True) -> float:
        column = chosen[quantity]
        if cell.lower() in NO_VALUE and not needed:
            return np.nan
        try:
            value = parse_number(cell) * column.factor
        except ValueError:
            value = np.nan
        if not low <= value <= high:
            unit = column.factor
            raise _Unusable(column.heading, cell, f"a number from {low / unit:.6g} to {high / unit:.6g}")
        return value

    if "position" in chosen:
        latitude, _, longitude = text("position").partition(",")
        places = ("position", "position")
    else:
        latitude, longitude = text("latitude"), text("longitude")
        places = ("latitude", "longitude")
    if latitude.lower() in NO_VALUE and longitude.lower() in NO_VALUE:
        return None
    height, ground = text("altitude"), text("on_ground").lower() in ("1", "true", "t", "yes", "y", "ground")
    if height.lower() in ("ground", "gnd"):
        height, ground = "", True
    course, speed = text("course"), text("ground_speed")
    return _Fix(
        line,
        _stamp(text("time"), text("date"), chosen["time"]),
        number(places[0], -90.0, 90.0, latitude.strip()),
        number(places[1], -180.0, 180.0, longitude.strip()),
        number("altitude", *ALTITUDES, height, needed=False),
        number("ground_speed", 0.0, FASTEST, speed, needed=False) if "ground_speed" in chosen else np.nan,
        number("course", -360.0, 360.0, course, needed=False) if "course" in chosen else np.nan,
        ground,
        text("aircraft" if "aircraft" in chosen else "flight"),
    )


def _stamp(text: str, date: str, column: Column) -> Stamp:
    try:
        stamp = parse_time(text, column.factor)
        if stamp.kind == "clock" and date:
            try:
                midnight = parse_time(date)
            except ValueError:  # a form of date that depends on the country
                return stamp
            return Stamp("date", midnight.seconds - midnight.seconds % DAY + stamp.seconds)
        return stamp
    except (ValueError, OverflowError):
        raise _Unusable(column.heading, text, ALLOWED) from None


def _one_aircraft(fixes: Sequence[_Fix], chosen: dict[str, Column], where: str) -> None:
    names = sorted({fix.aircraft for fix in fixes if fix.aircraft.lower() not in NO_VALUE})
    if len(names) > 1:
        column = chosen["aircraft" if "aircraft" in chosen else "flight"].heading
        several = ", ".join(_shown(name) for name in names[:4]) + (", ..." if len(names) > 4 else "")
        raise InputError(f"{where}: {column} = {several}: {len(names)} aircraft, allowed: the rows of one")


def _track(fixes: Sequence[_Fix], chosen: dict[str, Column], where: str) -> Track:
    seconds = [fix.stamp.seconds for fix in fixes]
    if fixes[0].stamp.kind == "clock":
        seconds = unrolled(seconds)
    time = np.array(seconds)
    altitude = np.array([fix.altitude for fix in fixes])
    if not np.isfinite(altitude).any():
        raise InputError(f"{where}: {chosen['altitude'].heading}: no row has a value: allowed: altitudes of the fixes")
    known = {name: chosen.get(name) is not None for name in ("ground_speed", "course")}
    ground = np.array([fix.on_ground for fix in fixes])
    return Track(
        time=time - time.min(),
        latitude_deg=np.array([fix.latitude for fix in fixes]),
        longitude_deg=np.array([fix.longitude for fix in fixes]),
        altitude=altitude,
        ground_speed=np.array([fix.ground_speed for fix in fixes]) if known["ground_speed"] else None,
        course_deg=np.array([fix.course for fix in fixes]) if known["course"] else None,
        on_ground=ground if "on_ground" in chosen or ground.any() else None,
        begin=said(fixes[int(np.argmin(time))].stamp),
    )


def _shown(text: str) -> str:
    """A cell in a message: one line, not too long."""
    shown = repr(text)
    return shown if len(shown) <= 60 else shown[:57] + "..."
