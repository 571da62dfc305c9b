"""A design of experiments for other programs: an xarray data set, a NetCDF file, a CSV file; and points from a CSV."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from vrsopt.errors import InputError
from vrsopt.surrogate.schema import EFFORT, DesignMeta

if TYPE_CHECKING:
    from vrsopt.surrogate.database import Database

UNITS = {
    "mass": "kg",
    "altitude": "m",
    "speed": "m/s",
    "rotor_speed": "rad/s",
    "twist": "rad",
    "climb_angle": "rad",
    "load_factor": "1",
    "specific_fuel_consumption": "kg/J",
    "residual_norm": "1",
    "seconds": "s",
}
UNITS_BY_WORD = {"power": "W", "flow": "kg/s", "temperature": "K", "loading": "1"}
ATTRIBUTES = ("model_version", "data_hash", "space", "method", "seed", "block_size")


def unit(name: str) -> str:
    """SI unit of an input or output; empty where its name does not tell."""
    words = [UNITS_BY_WORD[word] for word in name.split("_") if word in UNITS_BY_WORD]
    return UNITS.get(name) or (words[-1] if words else "")  # the last: a power turbine has a temperature


def dataset(database: Database) -> xr.Dataset:
    """All rows along dimension "point", SI units in the attributes.

    Inputs, outputs (nan: the point has none), status, reason, iterations, residual_norm, seconds (CPU time);
    ``sequence``: index in the design's sequence, -1 for points added by hand. ``d_<output>`` (point, input): its
    derivatives by the inputs. Along "input": its unit and box. The meta data are attributes.
    """
    meta, rows = database.meta, database.rows()
    kinds: dict[str, type] = {"iterations": int, "status": str, "reason": str}
    variables: dict[str, Any] = {
        name: ("point", np.array(rows[name], dtype=kinds.get(name, float)), {"units": unit(name)} if unit(name) else {})
        for name in (*meta.names, *meta.outputs, *EFFORT)
    }
    sequence = np.maximum(np.array(rows["point"], dtype=int), -1)
    slopes = database.derivatives(flyable=False)
    for name in meta.derivatives:
        units = {"units": f"{unit(name) or '1'} per unit of the input"}
        variables[f"d_{name}"] = (("point", "input"), slopes[:, meta.outputs.index(name)], units)
    variables |= {"lower": ("input", np.array(meta.lower)), "upper": ("input", np.array(meta.upper))}
    return xr.Dataset(
        {"sequence": ("point", sequence), **variables},
        coords={
            "point": np.arange(len(sequence)),
            "input": np.array(meta.names),
            "unit": ("input", np.array([unit(name) for name in meta.names])),
        },
        attrs={name: getattr(meta, name) for name in ATTRIBUTES}
        | {"samples": database.samples, "outputs": " ".join(meta.outputs)},
    )


def write_netcdf(database: Database, path: Path) -> None:
    """Write the data set as NetCDF (classic format, 64-bit offsets); the seed, which may be long, as text."""
    check_target(database.path, path)
    data = dataset(database)
    data.attrs["seed"] = str(data.attrs["seed"])
    content = bytes(data.to_netcdf(None, engine="scipy", format="NETCDF3_64BIT"))
    try:
        path.write_bytes(content)
    except OSError as error:
        raise InputError(f"{path}: can not be written: {error.strerror}") from None


def write_csv(database: Database, path: Path) -> None:
    """Write one line per point, numbers to the last bit, empty where there is none."""
    check_target(database.path, path)
    meta, rows = database.meta, database.rows()
    slopes = database.derivatives(flyable=False)
    points = rows.pop("point")
    columns = {"point": range(len(points)), "sequence": [point if point >= 0 else None for point in points], **rows}
    for name in meta.derivatives:
        for k, variable in enumerate(meta.names):
            values = slopes[:, meta.outputs.index(name), k].tolist()
            columns[f"d_{name}_d_{variable}"] = [None if value != value else value for value in values]
    assert tuple(columns) == csv_columns(meta)
    try:
        with path.open("w", newline="", encoding="utf-8") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(columns)
            writer.writerows(zip(*columns.values(), strict=True))
    except OSError as error:
        raise InputError(f"{path}: can not be written: {error.strerror}") from None


def check_target(design: Path, path: Path) -> None:
    """Raise :class:`InputError` if writing to ``path`` would overwrite the ``design`` it comes from."""
    if path.exists() and design.exists() and path.samefile(design):
        raise InputError(f"{path}: can not be written: it is the design of experiments itself")


def csv_columns(meta: DesignMeta) -> tuple[str, ...]:
    """Columns of the CSV file, in order."""
    slopes = (f"d_{name}_d_{variable}" for name in meta.derivatives for variable in meta.names)
    return ("point", "sequence", *meta.names, *meta.outputs, *EFFORT, *slopes)


def read_points(path: Path | str, meta: DesignMeta) -> NDArray[np.float64]:
    """Inputs (k, d) of the points of a CSV file, SI units: a column per input; those of an export beside them are left.

    Raises :class:`InputError` for a file that can not be read, other columns, missing ones, and values that are no
    numbers.
    """
    path = Path(path)
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            lines = [(reader.line_num, line) for reader in [csv.reader(stream)] for line in reader if line]
    except OSError as error:
        raise InputError(f"{path}: can not be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error):
        raise InputError(f"{path}: not a CSV file") from None
    header = [name.strip() for name in lines[0][1]] if lines else []
    _check_header(path, header, meta)
    points = [_numbers(f"{path}: line {number}", header, line, meta.names) for number, line in lines[1:]]
    if not points:
        raise InputError(f"{path}: no points: a line for each is needed")
    return np.array(points)


def _check_header(path: Path, header: list[str], meta: DesignMeta) -> None:
    missing = [name for name in meta.names if name not in header]
    if missing:
        raise InputError(f"{path}: no column {missing[0]}: needed are {', '.join(meta.names)} (SI units)")
    allowed = csv_columns(meta)
    for name in header:
        if name not in allowed:
            raise InputError(f"{path}: column {name!r}: one of {', '.join(meta.names)}, or of an export")
        if header.count(name) > 1:
            raise InputError(f"{path}: column {name}: {header.count(name)} times: allowed once")


def _numbers(where: str, header: list[str], line: list[str], names: tuple[str, ...]) -> list[float]:
    if len(line) != len(header):
        raise InputError(f"{where}: {len(line)} values: {len(header)}, one for each column")
    values = []
    for name in names:
        text = line[header.index(name)]
        try:
            values.append(float(text))
        except ValueError:
            raise InputError(f"{where}: {name} = {text!r}: a number") from None
    return values
