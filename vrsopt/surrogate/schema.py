"""What a design of experiments is on file: its meta data, the records of its points, its tables."""

from __future__ import annotations

import json
import re
import sqlite3
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from vrsopt.errors import InputError

APPLICATION_ID = 0x7672736F  # "vrso" in the header of the file
SCHEMA_VERSION = 2
FLYABLE = "ok"  # status of a point that may be flown
EFFORT = ("status", "reason", "iterations", "residual_norm", "seconds")
OWN_NAMES = {"point", "sequence", "output", "input", "unit", "lower", "upper", *EFFORT}


@dataclass(frozen=True)
class PointRecord:
    """Result of one point: outputs by name (SI units; those it has), why it is not flyable, and the solver's effort.

    ``derivatives``: by output and input, SI units, nan where there is none; an output's entry has every input.
    """

    outputs: Mapping[str, float]
    status: str
    reason: str
    iterations: int
    residual_norm: float
    derivatives: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class Row:
    """One computed point: inputs by name (SI units), result, and CPU time [s].

    ``point``: index in the design's own sequence; -1, -2, ... for points added by hand, in the order of adding.
    """

    point: int
    inputs: Mapping[str, float]
    record: PointRecord
    seconds: float = 0.0


@dataclass(frozen=True)
class DesignMeta:
    """What a design of experiments is: files with the same meta hold points of the same sequence and model.

    ``block_size``: points of the first block of the sequence; ``data_hash``: of the aircraft and engine data;
    ``derivatives``: those of the ``outputs`` whose derivatives are stored.
    """

    model_version: str
    data_hash: str
    space: str
    method: str
    seed: int
    block_size: int
    names: tuple[str, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    outputs: tuple[str, ...]
    derivatives: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        columns = [*self.names, *self.outputs]
        for name in columns:
            if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or name.lower() in OWN_NAMES or name.startswith("d_"):
                raise InputError(f"design: name {name!r}: letters, digits and _, and no name of the file's own")
        if len({name.lower() for name in columns}) != len(columns):
            raise InputError(f"design: names {', '.join(columns)}: all different")
        if not len(self.names) == len(self.lower) == len(self.upper):
            raise InputError(f"design: {len(self.names)} inputs, {len(self.lower)} and {len(self.upper)} bounds")
        unknown = [name for name in self.derivatives if name not in self.outputs]
        if unknown:
            raise InputError(f"design: derivatives of {unknown[0]!r}: of one of {', '.join(self.outputs)}")


def quoted(names: Iterable[str]) -> str:
    """Names of columns as SQL wants them; ``DesignMeta`` has made sure that no name holds a quote."""
    return ", ".join(f'"{name}"' for name in names)


def create_tables(connection: sqlite3.Connection, meta: DesignMeta) -> None:
    """All tables, in one transaction: a file that was only half created stays empty."""
    inputs = ", ".join(f'"{name}" REAL NOT NULL' for name in meta.names)
    results = ", ".join(f'"{name}" REAL' for name in meta.outputs)
    slopes = ", ".join(f'"{name}" REAL' for name in meta.names)
    with connection:
        connection.execute("BEGIN")
        connection.execute("CREATE TABLE meta (name TEXT PRIMARY KEY, value TEXT NOT NULL)")
        entries = {**asdict(meta), "samples": meta.block_size}
        connection.executemany(
            "INSERT INTO meta VALUES (?, ?)", [(key, json.dumps(value)) for key, value in entries.items()]
        )
        connection.execute(
            f"CREATE TABLE points (point INTEGER PRIMARY KEY, {inputs}, {results}, status TEXT NOT NULL, "
            "reason TEXT NOT NULL, iterations INTEGER NOT NULL, residual_norm REAL, seconds REAL NOT NULL)"
        )
        connection.execute(
            f"CREATE TABLE derivatives (point INTEGER NOT NULL, output TEXT NOT NULL, {slopes}, "
            "PRIMARY KEY (point, output)) WITHOUT ROWID"
        )
        connection.execute(f"CREATE TABLE added (point INTEGER PRIMARY KEY, {inputs})")
        connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")


def read_meta(path: Path, connection: sqlite3.Connection) -> tuple[DesignMeta, int]:
    """Meta data of a design, and how many flyable points it is to have; :class:`InputError` for any other file."""
    try:
        identity = connection.execute("PRAGMA application_id").fetchone()[0]
        version = connection.execute("PRAGMA user_version").fetchone()[0]
        if identity != APPLICATION_ID:
            raise InputError(f"{path}: not a design of experiments")
        if version != SCHEMA_VERSION:
            raise InputError(f"{path}: schema version {version}: this program reads {SCHEMA_VERSION}: sample it again")
        pairs = dict(connection.execute("SELECT name, value FROM meta").fetchall())
        columns = {
            table: [row[1] for row in connection.execute(f"PRAGMA table_info({table})").fetchall()]
            for table in ("points", "derivatives", "added")
        }
    except sqlite3.Error as error:
        if error.sqlite_errorcode == sqlite3.SQLITE_READONLY_ROLLBACK:
            raise InputError(
                f"{path}: a run was killed while it wrote: resume the sampling to repair the file"
            ) from None
        raise InputError(f"{path}: not a readable design of experiments: {error}") from None
    try:
        entries: dict[str, Any] = {key: json.loads(value) for key, value in pairs.items()}
        entries = {key: tuple(value) if isinstance(value, list) else value for key, value in entries.items()}
        samples = int(entries.pop("samples"))
        meta = DesignMeta(**entries)
    except (TypeError, ValueError, KeyError):
        raise InputError(f"{path}: not a design of experiments: its meta table is damaged") from None
    expected = {
        "points": ["point", *meta.names, *meta.outputs, *EFFORT],
        "derivatives": ["point", "output", *meta.names],
        "added": ["point", *meta.names],
    }
    for table, names in expected.items():
        if columns[table] != names:
            raise InputError(f"{path}: not a design of experiments: its {table} table is damaged")
    return meta, samples


def compare(path: Path, found: DesignMeta, expected: Mapping[str, Any]) -> None:
    """Raises :class:`InputError` naming the first field of ``found`` that differs from ``expected``."""
    for name, value in asdict(found).items():
        if name in expected and value != expected[name]:
            raise InputError(f"{path}: {name.replace('_', ' ')} = {value}: this run has {expected[name]}")
