"""A design of experiments as one SQLite file: what was sampled, with which model, and every point's result."""

from __future__ import annotations

import json
import re
import sqlite3
from collections.abc import Iterable, Mapping
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from vrsopt.errors import InputError

APPLICATION_ID = 0x7672736F  # "vrso" in the header of the file
SCHEMA_VERSION = 1
FLYABLE = "ok"  # status of a point that may be flown
EFFORT = ("status", "reason", "iterations", "residual_norm")


@dataclass(frozen=True)
class PointRecord:
    """Result of one point: outputs by name (SI units; those it has), why it is not flyable, and the solver's effort."""

    outputs: Mapping[str, float]
    status: str
    reason: str
    iterations: int
    residual_norm: float


@dataclass(frozen=True)
class Row:
    """One point of the design: its index, inputs by name (SI units) and result."""

    index: int
    inputs: Mapping[str, float]
    record: PointRecord


@dataclass(frozen=True)
class DesignMeta:
    """What a design of experiments is: two files with the same meta hold the same points.

    ``block_size``: points of one Latin-hypercube block; ``data_hash``: of the aircraft and engine data.
    """

    model_version: str
    data_hash: str
    seed: int
    block_size: int
    names: tuple[str, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    outputs: tuple[str, ...]

    def __post_init__(self) -> None:
        columns = [*self.names, *self.outputs]
        for name in columns:
            if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or name.lower() in ("point", *EFFORT):
                raise InputError(f"design: name {name!r}: letters, digits and _, and no name of the file's own")
        if len({name.lower() for name in columns}) != len(columns):
            raise InputError(f"design: names {', '.join(columns)}: all different")
        if not len(self.names) == len(self.lower) == len(self.upper):
            raise InputError(f"design: {len(self.names)} inputs, {len(self.lower)} and {len(self.upper)} bounds")


class Database:
    """An open design of experiments. Use :meth:`create` or :meth:`open`; a context manager that closes the file."""

    def __init__(self, path: Path, connection: sqlite3.Connection, meta: DesignMeta) -> None:
        self.path = path
        self.meta = meta
        self._connection = connection
        self._columns = ("point", *meta.names, *meta.outputs, *EFFORT)

    @classmethod
    def create(cls, path: Path | str, meta: DesignMeta) -> Database:
        """A new, empty file. Raises :class:`InputError` if ``path`` exists or can not be written."""
        path = Path(path)
        if path.exists():
            raise InputError(f"{path}: exists already: resume it or name another file")
        try:
            connection = sqlite3.connect(path)
        except sqlite3.Error as error:
            raise InputError(f"{path}: can not be written: {error}") from None
        real = ", ".join(f'"{name}" REAL NOT NULL' for name in meta.names)
        results = ", ".join(f'"{name}" REAL' for name in meta.outputs)
        try:
            # One transaction: a file that was only half created is not taken for a design.
            with connection:
                connection.execute("BEGIN")
                connection.execute("CREATE TABLE meta (name TEXT PRIMARY KEY, value TEXT NOT NULL)")
                connection.executemany(
                    "INSERT INTO meta VALUES (?, ?)", [(key, json.dumps(value)) for key, value in asdict(meta).items()]
                )
                connection.execute(
                    f"CREATE TABLE points (point INTEGER PRIMARY KEY, {real}, {results}, status TEXT NOT NULL, "
                    "reason TEXT NOT NULL, iterations INTEGER NOT NULL, residual_norm REAL)"
                )
                connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
                connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
        except sqlite3.Error as error:
            connection.close()
            raise InputError(f"{path}: can not be written: {error}") from None
        return cls(path, connection, meta)

    @classmethod
    def open(cls, path: Path | str, expected: DesignMeta | None = None, *, write: bool = False) -> Database:
        """An existing file, by default without the right to change it.

        Raises :class:`InputError` for a file that is missing or is no design of experiments, or whose meta differs from
        ``expected`` in any field.
        """
        path = Path(path)
        if not path.is_file():
            raise InputError(f"{path}: no such file")
        try:
            connection = sqlite3.connect(f"{path.resolve().as_uri()}?mode={'rw' if write else 'ro'}", uri=True)
        except sqlite3.Error as error:
            raise InputError(f"{path}: can not be opened: {error}") from None
        try:
            meta = _read_meta(path, connection)
            if expected is not None:
                _compare(path, meta, expected)
        except InputError:
            connection.close()
            raise
        return cls(path, connection, meta)

    def __enter__(self) -> Database:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        self._connection.close()

    def append(self, rows: Iterable[Row]) -> None:
        """Add ``rows`` in one transaction: all of them or, on an error, none.

        Raises :class:`InputError` for an index that is there already, inputs or outputs with other names than the
        file's, an output of a flyable point that is not a number, or a file that can not be written.
        """
        added = list(rows)
        values = [self._values(row) for row in added]
        marks = ", ".join("?" * len(self._columns))
        try:
            with self._connection:
                self._connection.executemany(f"INSERT INTO points VALUES ({marks})", values)
        except sqlite3.IntegrityError as error:
            indices = [row.index for row in added]
            raise InputError(f"{self.path}: points {min(indices)} to {max(indices)}: not stored: {error}") from None
        except sqlite3.Error as error:
            raise InputError(f"{self.path}: can not be written: {error}") from None

    def _values(self, row: Row) -> tuple[float | str | None, ...]:
        record, meta = row.record, self.meta
        if set(row.inputs) != set(meta.names):
            raise InputError(f"{self.path}: point {row.index}: inputs {', '.join(row.inputs)}: the file's inputs")
        unknown = sorted(set(record.outputs) - set(meta.outputs))
        if unknown:
            raise InputError(f"{self.path}: point {row.index}: output {unknown[0]!r}: one of {', '.join(meta.outputs)}")
        outputs = [float(record.outputs.get(name, np.nan)) for name in meta.outputs]
        for name, value in record.outputs.items():
            if record.status == FLYABLE and not np.isfinite(value):
                raise InputError(f"{self.path}: point {row.index}: {name} = {value} although the point is flyable")
        inputs = [float(row.inputs[name]) for name in meta.names]
        effort = (record.status, record.reason, int(record.iterations), float(record.residual_norm))
        return (int(row.index), *inputs, *outputs, *effort)

    def _select(self, columns: Iterable[str], where: str = "") -> list[tuple]:
        quoted = ", ".join(f'"{column}"' for column in columns)
        try:
            with closing(self._connection.execute(f"SELECT {quoted} FROM points {where} ORDER BY point")) as cursor:
                return cursor.fetchall()
        except sqlite3.Error as error:
            raise InputError(f"{self.path}: can not be read: {error}") from None

    def status(self) -> list[str]:
        """Status of every point in index order. Raises :class:`InputError` if points are missing in between."""
        rows = self._select(("point", "status"))
        if [index for index, _ in rows] != list(range(len(rows))):
            raise InputError(f"{self.path}: points 0 to {rows[-1][0]}: {len(rows)} of them: some are missing")
        return [status for _, status in rows]

    def arrays(self, *, flyable: bool = True) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Inputs (n, d) and outputs (n, m) in the order of ``meta``, SI units: flyable points only, or all.

        Outputs that a point does not have are NaN.
        """
        where = f"WHERE status = '{FLYABLE}'" if flyable else ""
        rows = self._select((*self.meta.names, *self.meta.outputs), where)
        width = len(self.meta.names)
        table = np.array(rows, dtype=float).reshape(len(rows), width + len(self.meta.outputs))
        return table[:, :width], table[:, width:]

    def dataset(self) -> xr.Dataset:
        """All points along dimension "point": inputs, outputs, status, reason and effort; the meta as attributes."""
        rows = self._select(self._columns)
        columns = dict(zip(self._columns, zip(*rows, strict=True) if rows else [()] * len(self._columns), strict=True))
        kinds: dict[str, type] = {"point": int, "iterations": int, "status": str, "reason": str}
        arrays: dict[str, Any] = {
            name: ("point", np.array(values, dtype=kinds.get(name, float))) for name, values in columns.items()
        }
        meta = {key: list(value) if isinstance(value, tuple) else value for key, value in asdict(self.meta).items()}
        return xr.Dataset(
            {name: array for name, array in arrays.items() if name != "point"},
            coords={"point": arrays["point"]},
            attrs=meta,
        )


def _read_meta(path: Path, connection: sqlite3.Connection) -> DesignMeta:
    """Meta of a design; raises :class:`InputError` for any other file."""
    try:
        identity = connection.execute("PRAGMA application_id").fetchone()[0]
        version = connection.execute("PRAGMA user_version").fetchone()[0]
        if identity != APPLICATION_ID:
            raise InputError(f"{path}: not a design of experiments")
        if version != SCHEMA_VERSION:
            raise InputError(f"{path}: schema version {version}: this program reads {SCHEMA_VERSION}")
        pairs = dict(connection.execute("SELECT name, value FROM meta").fetchall())
        columns = [row[1] for row in connection.execute("PRAGMA table_info(points)").fetchall()]
    except sqlite3.Error as error:
        if error.sqlite_errorcode == sqlite3.SQLITE_READONLY_ROLLBACK:
            raise InputError(
                f"{path}: a run was killed while it wrote: resume the sampling to repair the file"
            ) from None
        raise InputError(f"{path}: not a readable design of experiments: {error}") from None
    try:
        fields: dict[str, Any] = {key: json.loads(value) for key, value in pairs.items()}
        fields = {key: tuple(value) if isinstance(value, list) else value for key, value in fields.items()}
        meta = DesignMeta(**fields)
    except (TypeError, json.JSONDecodeError):
        raise InputError(f"{path}: not a design of experiments: its meta table is damaged") from None
    if columns != ["point", *meta.names, *meta.outputs, *EFFORT]:
        raise InputError(f"{path}: not a design of experiments: its points table is damaged")
    return meta


def _compare(path: Path, found: DesignMeta, expected: DesignMeta) -> None:
    for field, value in asdict(found).items():
        wanted = getattr(expected, field)
        if value != wanted:
            name = "samples" if field == "block_size" else field.replace("_", " ")
            raise InputError(f"{path}: {name} = {value}: this run has {wanted}")
