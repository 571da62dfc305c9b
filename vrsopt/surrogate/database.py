"""A design of experiments as one SQLite file: what was sampled, with which model, and every point's result."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from vrsopt.errors import InputError
from vrsopt.surrogate import design_table
from vrsopt.surrogate.schema import (
    EFFORT,
    FLYABLE,
    SCHEMA_VERSION,
    DesignMeta,
    PointRecord,
    Row,
    compare,
    create_tables,
    quoted,
    read_meta,
)

__all__ = ["FLYABLE", "SCHEMA_VERSION", "Database", "DesignMeta", "PointRecord", "Row"]

ORDER = "ORDER BY point < 0, abs(point)"  # the sequence, then points added by hand


class Database:
    """An open design of experiments. Use :meth:`create` or :meth:`open`; a context manager that closes the file.

    Rows are in the order of the design's sequence, points added by hand after them in the order of adding.
    ``samples``: how many flyable points of the sequence it is to have; a run that was killed has left fewer.
    """

    def __init__(self, path: Path, connection: sqlite3.Connection, meta: DesignMeta, samples: int) -> None:
        self.path = path
        self.meta = meta
        self.samples = samples
        self._connection = connection

    @classmethod
    def create(cls, path: Path | str, meta: DesignMeta) -> Database:
        """A new design without points. An empty file, as a run leaves that is killed while it begins, is filled.

        Raises :class:`InputError` if ``path`` exists or can not be written.
        """
        path = Path(path)
        if path.exists() and not is_empty(path):
            raise InputError(f"{path}: exists already: resume it or name another file")
        try:
            connection = sqlite3.connect(path)
        except sqlite3.Error as error:
            raise InputError(f"{path}: can not be written: {error}") from None
        try:
            create_tables(connection, meta)
        except sqlite3.Error as error:
            connection.close()
            raise InputError(f"{path}: can not be written: {error}") from None
        return cls(path, connection, meta, meta.block_size)

    @classmethod
    def open(
        cls, path: Path | str, expected: DesignMeta | Mapping[str, Any] | None = None, *, write: bool = False
    ) -> Database:
        """An existing file, by default without the right to change it.

        Raises :class:`InputError` for a file that is missing or is no design of experiments, or whose meta data differ
        from ``expected``, or from those fields of it that are given, in anything but the size of the first block.
        """
        path = Path(path)
        if not path.is_file():
            raise InputError(f"{path}: no such file")
        connection = _connect(path, "rw" if write else "ro")
        try:
            meta, samples = read_meta(path, connection)
            if expected is not None:
                fields = dict(vars(expected) if isinstance(expected, DesignMeta) else expected)
                compare(path, meta, {name: value for name, value in fields.items() if name != "block_size"})
        except InputError:
            connection.close()
            raise
        return cls(path, connection, meta, samples)

    def __enter__(self) -> Database:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """End the connection; what was appended is stored."""
        self._connection.close()

    def append(self, rows: Iterable[Row]) -> None:
        """Add ``rows`` with their derivatives in one transaction: all of them or, on an error, none.

        Raises :class:`InputError` for a point that is there already, inputs or outputs with other names than the
        file's, an output of a flyable point that is not a number, or a file that can not be written.
        """
        added = list(rows)
        columns = ("point", *self.meta.names, *self.meta.outputs, *EFFORT)
        numbers = [row.point for row in added]
        self._write(
            f"points {min(numbers, default=0)} to {max(numbers, default=0)}: not stored",
            (_insert("points", len(columns)), [self._values(row) for row in added]),
            (
                _insert("derivatives", 2 + len(self.meta.names)),
                [slopes for row in added for slopes in self._slopes(row)],
            ),
        )

    def extend(self, samples: int) -> None:
        """Let the design have ``samples`` flyable points; raises :class:`InputError` for fewer than it is to have."""
        if samples < self.samples:
            raise InputError(f"{self.path}: samples = {self.samples}: this run has {samples}: at least as many")
        if samples > self.samples:
            self._write("samples", ("UPDATE meta SET value = ? WHERE name = 'samples'", [(json.dumps(samples),)]))
            self.samples = samples

    def register(self, inputs: ArrayLike) -> None:
        """Note hand-chosen points (k, d), SI units, that are to be computed; those that are in the file are skipped."""
        known = {row[1:] for table in ("points", "added") for row in self._select(table, ("point", *self.meta.names))}
        last = min((row[0] for row in self._select("added", ("point",))), default=0)
        new = [point for point in dict.fromkeys(map(tuple, np.asarray(inputs, dtype=float).tolist()))]
        rows = [(last - 1 - k, *point) for k, point in enumerate(point for point in new if point not in known)]
        self._write("added points", (_insert("added", 1 + len(self.meta.names)), rows))

    def pending(self) -> dict[int, tuple[float, ...]]:
        """Hand-chosen points that are not computed yet: inputs by point."""
        there = self.found()
        rows = self._select("added", ("point", *self.meta.names))
        return {row[0]: row[1:] for row in rows if row[0] not in there}

    def cut(self, end: int) -> None:
        """Remove the points of the sequence from index ``end`` on."""
        if any(point >= end for point in self.found()):
            beyond = [(f"DELETE FROM {table} WHERE point >= ?", [(end,)]) for table in ("derivatives", "points")]
            self._write("points at the end", *beyond)

    def found(self) -> dict[int, str]:
        """Status by point (see :class:`Row`) of all that are computed."""
        return dict(self._select("points", ("point", "status")))

    def status(self) -> list[str]:
        """Status of every row."""
        return list(self.found().values())

    def arrays(self, *, flyable: bool = True) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Inputs (n, d) and outputs (n, m) in the order of ``meta``, SI units: flyable points only, or all.

        Outputs that a point does not have are NaN.
        """
        rows = self._select("points", (*self.meta.names, *self.meta.outputs), _where(flyable))
        width = len(self.meta.names)
        table = np.array(rows, dtype=float).reshape(len(rows), width + len(self.meta.outputs))
        return table[:, :width], table[:, width:]

    def derivatives(self, *, flyable: bool = True) -> NDArray[np.float64]:
        """Derivatives (n, m, d) of the outputs by the inputs, SI units; rows as in :meth:`arrays`, NaN: none."""
        meta = self.meta
        points = [row[0] for row in self._select("points", ("point",), _where(flyable))]
        place = {point: k for k, point in enumerate(points)}
        column = {name: k for k, name in enumerate(meta.outputs)}
        table = np.full((len(points), len(meta.outputs), len(meta.names)), np.nan)
        for point, output, *slopes in self._select("derivatives", ("point", "output", *meta.names)):
            if point in place:
                table[place[point], column[output]] = slopes
        return table

    def rows(self) -> dict[str, list[Any]]:
        """Every column of the table of points, by name: ``point``, inputs, outputs, status and effort."""
        columns = ("point", *self.meta.names, *self.meta.outputs, *EFFORT)
        rows = self._select("points", columns)
        return {name: [row[k] for row in rows] for k, name in enumerate(columns)}

    def dataset(self) -> xr.Dataset:
        """See :func:`vrsopt.surrogate.design_table.dataset`."""
        return design_table.dataset(self)

    def to_netcdf(self, path: Path | str) -> None:
        """Write :meth:`dataset` to ``path`` (NetCDF). Raises :class:`InputError` if it can not be written."""
        design_table.write_netcdf(self, Path(path))

    def to_csv(self, path: Path | str) -> None:
        """Write one line per point to ``path``; :func:`vrsopt.surrogate.design_table.read_points` reads it again.

        Raises :class:`InputError` if it can not be written.
        """
        design_table.write_csv(self, Path(path))

    def _values(self, row: Row) -> tuple[float | str | None, ...]:
        record, meta = row.record, self.meta
        where = f"{self.path}: point {row.point}"
        if set(row.inputs) != set(meta.names):
            raise InputError(f"{where}: inputs {', '.join(row.inputs)}: the file's inputs")
        unknown = sorted(set(record.outputs) - set(meta.outputs))
        if unknown:
            raise InputError(f"{where}: output {unknown[0]!r}: one of {', '.join(meta.outputs)}")
        for name, value in record.outputs.items():
            if record.status == FLYABLE and not np.isfinite(value):
                raise InputError(f"{where}: {name} = {value} although the point is flyable")
        inputs = [float(row.inputs[name]) for name in meta.names]
        outputs = [float(record.outputs.get(name, np.nan)) for name in meta.outputs]
        effort = (record.status, record.reason, int(record.iterations), float(record.residual_norm), row.seconds)
        return (int(row.point), *inputs, *outputs, *effort)

    def _slopes(self, row: Row) -> list[tuple[float | str, ...]]:
        names = self.meta.names
        for output, slopes in row.record.derivatives.items():
            if output not in self.meta.derivatives or set(slopes) != set(names):
                raise InputError(
                    f"{self.path}: point {row.point}: derivatives of {output!r} by {', '.join(slopes)}: the file's"
                )
        return [
            (int(row.point), output, *(float(slopes[name]) for name in names))
            for output, slopes in row.record.derivatives.items()
        ]

    def _select(self, table: str, columns: Iterable[str], where: str = "") -> list[tuple]:
        query = f"SELECT {quoted(columns)} FROM {table} {where} {ORDER}"
        try:
            with closing(self._connection.execute(query)) as cursor:
                return cursor.fetchall()
        except sqlite3.Error as error:
            raise InputError(f"{self.path}: can not be read: {error}") from None

    def _write(self, what: str, *statements: tuple[str, list[tuple[Any, ...]]]) -> None:
        """Execute ``statements`` for all their rows in one transaction."""
        try:
            with self._connection:
                for statement, rows in statements:
                    self._connection.executemany(statement, rows)
        except sqlite3.IntegrityError as error:
            raise InputError(f"{self.path}: {what}: {error}") from None
        except sqlite3.Error as error:
            raise InputError(f"{self.path}: can not be written: {error}") from None


def is_empty(path: Path) -> bool:
    """Whether ``path`` is a file without content once an unfinished transaction is taken back."""
    if not path.is_file():
        return False
    try:
        with closing(_connect(path, "rw")) as connection:
            return connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0] == 0 == path.stat().st_size
    except (sqlite3.Error, InputError):
        return False


def _connect(path: Path, mode: str) -> sqlite3.Connection:
    try:
        return sqlite3.connect(f"{path.resolve().as_uri()}?mode={mode}", uri=True)
    except sqlite3.Error as error:
        raise InputError(f"{path}: can not be opened: {error}") from None


def _insert(table: str, columns: int) -> str:
    return f"INSERT INTO {table} VALUES ({', '.join('?' * columns)})"


def _where(flyable: bool) -> str:
    return f"WHERE status = '{FLYABLE}'" if flyable else ""
