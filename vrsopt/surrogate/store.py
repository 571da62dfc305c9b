"""A set of fitted Krigings in one NetCDF file (classic format, 64-bit offsets), with where it comes from."""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
import struct
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from vrsopt.errors import InputError
from vrsopt.surrogate.kriging import Kriging, KrigingState
from vrsopt.surrogate.likelihood import CORRELATIONS
from vrsopt.surrogate.validation import Accuracy

FORMAT, FORMAT_VERSION = "vrsopt surrogate", 1
SCALARS = ("smoothing", "nugget", "mean", "scale")
VECTORS = ("lower", "upper", "theta")
# What xarray and scipy raise on bytes that are no such file, or on one that was cut or damaged.
UNREADABLE = (ValueError, TypeError, KeyError, IndexError, AttributeError, EOFError, OverflowError, struct.error)


@dataclass(frozen=True)
class Surrogate:
    """Fitted Krigings by output and the model, data and design they come from; leave-one-out figures by output."""

    models: Mapping[str, Kriging]
    model_version: str
    data_hash: str
    seed: int
    accuracy: Mapping[str, Accuracy]

    def __post_init__(self) -> None:
        if not self.models or set(self.models) != set(self.accuracy):
            raise InputError(f"surrogate: outputs {', '.join(self.models)}: one or more, each with its accuracy")
        for name in self.models:
            if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
                raise InputError(f"surrogate: output {name!r}: letters, digits and _")


def save(path: Path | str, surrogate: Surrogate) -> None:
    """Write ``surrogate`` to ``path``; an existing file is replaced at once or, on an error, not at all.

    Raises :class:`InputError` if ``path`` can not be written.
    """
    dataset = xr.Dataset(attrs=_attributes(surrogate))
    for name, model in surrogate.models.items():
        dataset = dataset.merge(_variables(name, model.state_, surrogate.accuracy[name]))
    dataset.attrs["digest"] = _digest(dataset)
    content = bytes(dataset.to_netcdf(None, engine="scipy", format="NETCDF3_64BIT"))
    target = Path(path)
    try:
        descriptor, temporary = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
        try:
            with os.fdopen(descriptor, "wb") as stream:
                stream.write(content)
            os.chmod(temporary, 0o644)
            os.replace(temporary, target)
        finally:
            Path(temporary).unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"{target}: can not be written: {error.strerror}") from None


def load(path: Path | str, *, model_version: str | None = None, data_hash: str | None = None) -> Surrogate:
    """Read a surrogate. Predictions equal those of the saved models to the last bit.

    Raises :class:`InputError` for a file that is missing, foreign, damaged or of another format version, and for one of
    another ``model_version`` or ``data_hash`` where these are given.
    """
    path = Path(path)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: can not be read: {error.strerror}") from None
    try:
        with xr.open_dataset(io.BytesIO(content), engine="scipy") as lazy:
            dataset = lazy.load()
    except UNREADABLE:
        raise InputError(f"{path}: not a surrogate: no readable NetCDF file") from None
    if dataset.attrs.get("format") != FORMAT:
        raise InputError(f"{path}: not a surrogate: no attribute format = {FORMAT!r}")
    if dataset.attrs.get("format_version") != FORMAT_VERSION:
        raise InputError(
            f"{path}: format version {dataset.attrs.get('format_version')}: this program reads {FORMAT_VERSION}"
        )
    try:
        if dataset.attrs.pop("digest") != _digest(dataset):
            raise InputError(f"{path}: damaged: its content does not match its digest")
        surrogate = _surrogate(path, dataset)
    except (KeyError, TypeError, json.JSONDecodeError):
        raise InputError(f"{path}: not a complete surrogate: variables or attributes are missing") from None
    for field, wanted in (("model_version", model_version), ("data_hash", data_hash)):
        found = getattr(surrogate, field)
        if wanted is not None and found != wanted:
            raise InputError(f"{path}: {field.replace('_', ' ')} = {found}: this run has {wanted}")
    return surrogate


def _attributes(surrogate: Surrogate) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "model_version": surrogate.model_version,
        "data_hash": surrogate.data_hash,
        "seed": str(surrogate.seed),  # the classic format has no 64-bit integers
        "outputs": json.dumps(list(surrogate.models)),
    }


def _variables(name: str, state: KrigingState, accuracy: Accuracy) -> xr.Dataset:
    """The arrays of one model, its scalars and figures as attributes of the weights."""
    points, inputs = f"{name}_point", f"{name}_input"
    attributes: dict[str, Any] = {field: float(getattr(state, field)) for field in SCALARS} | accuracy.as_dict()
    attributes |= {"correlation": state.correlation, "names": json.dumps(list(state.names))}
    variables: dict[str, Any] = {
        f"{name}_inputs": ((points, inputs), state.inputs),
        f"{name}_weights": ((points,), state.weights, attributes),
        f"{name}_coefficients": ((f"{name}_term",), state.coefficients),
    }
    return xr.Dataset(variables | {f"{name}_{field}": ((inputs,), getattr(state, field)) for field in VECTORS})


def _surrogate(path: Path, dataset: xr.Dataset) -> Surrogate:
    models, figures = {}, {}
    for name in json.loads(dataset.attrs["outputs"]):
        attributes = dataset[f"{name}_weights"].attrs
        arrays = ("inputs", "weights", "coefficients", *VECTORS)
        values: dict[str, Any] = {
            field: np.array(dataset[f"{name}_{field}"].values, dtype=float) for field in arrays
        } | {field: float(attributes[field]) for field in SCALARS}
        state = KrigingState(
            names=tuple(json.loads(attributes["names"])), correlation=attributes["correlation"], **values
        )
        _check(path, name, state)
        models[name] = Kriging.from_state(state)
        figures[name] = Accuracy(**{field.name: float(attributes[field.name]) for field in fields(Accuracy)})
    attrs = dataset.attrs
    return Surrogate(models, attrs["model_version"], attrs["data_hash"], int(attrs["seed"]), figures)


def _check(path: Path, name: str, state: KrigingState) -> None:
    """Shapes and values that a fitted state has; raises :class:`InputError` for others."""
    points, inputs = state.inputs.shape if state.inputs.ndim == 2 else (0, 0)
    terms = (inputs + 1) * (inputs + 2) // 2
    shapes = {"weights": (points,), "coefficients": (terms,), **{field: (inputs,) for field in VECTORS}}
    for field, shape in shapes.items():
        if getattr(state, field).shape != shape:
            raise InputError(f"{path}: {name}: {field} has shape {getattr(state, field).shape}: expected {shape}")
    numbers = [getattr(state, field) for field in ("inputs", *shapes, *SCALARS)]
    if not all(np.all(np.isfinite(number)) for number in numbers):
        raise InputError(f"{path}: {name}: finite numbers only")
    if len(state.names) != inputs or state.correlation not in CORRELATIONS:
        raise InputError(f"{path}: {name}: {len(state.names)} names, correlation {state.correlation!r}: damaged")
    if not (np.all(state.lower < state.upper) and np.all(state.theta > 0) and state.nugget >= 0 and state.scale > 0):
        raise InputError(f"{path}: {name}: lower < upper, theta > 0, nugget >= 0 and scale > 0")


def _digest(dataset: xr.Dataset) -> str:
    """SHA-256 of all numbers and attributes: NetCDF has no check of its own."""
    digest = hashlib.sha256()
    for name in sorted(map(str, dataset.variables)):
        variable = dataset[name]
        digest.update(repr((name, variable.shape, _plain(variable.attrs))).encode())
        digest.update(np.ascontiguousarray(variable.values, dtype="<f8").tobytes())
    digest.update(repr(_plain(dataset.attrs)).encode())
    return digest.hexdigest()


def _plain(attributes: Mapping[Any, Any]) -> list[tuple[str, str]]:
    """Attributes as they come back from a file: numbers as Python floats, in order of their names."""
    return sorted(
        (str(key), value if isinstance(value, str) else repr(float(value))) for key, value in attributes.items()
    )
