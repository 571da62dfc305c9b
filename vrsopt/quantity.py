"""Data files in which every number carries its unit, its source and, where it is assumed, its range.

A number in a data file is a table ``{ value = 4.91, unit = "m", source = "PAD" }``; an assumed one has
``range = [low, high]`` beside it. A model declares the unit it expects with ``Annotated[float, Unit("m")]``; the file
must say the same unit, so that a number can not be read in another one. In Python the field is the plain number;
``model.provenance["radius"]`` tells where it comes from.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic.fields import FieldInfo

from vrsopt.errors import InputError


@dataclass(frozen=True)
class Unit:
    """The unit a field is given in; "-" for a pure number."""

    name: str


class Provenance(BaseModel):
    """Where a number comes from: unit, source and, for an assumed or solved value, its range (low, high)."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    unit: str
    source: Annotated[str, Field(min_length=1)]
    range: tuple[float, float] | None = None
    note: str = ""


class Record(BaseModel):
    """Base of all data records: frozen, no unknown keys, numbers with provenance.

    Fields marked with :class:`Unit` are read from ``{value, unit, source[, range][, note]}`` tables.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    provenance: dict[str, Provenance] = Field(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _unwrap(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        if "provenance" in data:
            return _with_provenance(cls, data)
        values, provenance = dict(data), {}
        for name, field in cls.model_fields.items():
            unit = _unit(field)
            if unit is None or name not in data:
                continue
            entry = data[name]
            if not isinstance(entry, dict) or "value" not in entry:
                raise ValueError(f"{name}: {entry!r}: expected {{ value, unit = {unit.name!r}, source }}")
            rest = {key: value for key, value in entry.items() if key != "value"}
            try:
                provenance[name] = Provenance(**rest)
            except ValidationError as error:
                raise ValueError(f"{name}: {_first(error)}") from None
            if provenance[name].unit != unit.name:
                raise ValueError(f"{name}: unit {provenance[name].unit!r}: expected {unit.name!r}")
            values[name] = entry["value"]
        return {**values, "provenance": provenance}

    @model_validator(mode="after")
    def _inside_range(self) -> Record:
        for name, origin in self.provenance.items():
            value = getattr(self, name)
            for number in value if isinstance(value, tuple) else (value,):
                if origin.range and not origin.range[0] <= number <= origin.range[1]:
                    raise ValueError(f"{name}: {number}: outside its own range {list(origin.range)}")
        return self

    def replaced(self, **changes: Any) -> Any:
        """A copy with other values, validated again; the provenance is kept, without the range."""
        values = {name: getattr(self, name) for name in type(self).model_fields}
        unknown = sorted(set(changes) - set(values))
        if unknown:
            raise InputError(f"{type(self).__name__}: unknown field {unknown[0]!r}")
        provenance = {
            name: origin.model_copy(update={"range": None}) if name in changes else origin
            for name, origin in self.provenance.items()
        }
        return validated(type(self), {**values, **changes, "provenance": provenance}, where=type(self).__name__)


def _with_provenance(model: type[Record], data: dict[str, Any]) -> dict[str, Any]:
    """The content of a record that was written out before: every number must still have its unit and source."""
    known = data["provenance"] if isinstance(data["provenance"], dict) else {}
    for name, field in model.model_fields.items():
        if _unit(field) is not None and name in data and name not in known:
            raise ValueError(f"{name}: neither unit nor source")
    return data


def _unit(field: FieldInfo) -> Unit | None:
    return next((item for item in field.metadata if isinstance(item, Unit)), None)


def _first(error: ValidationError) -> str:
    """The first complaint of pydantic as one line: field, value, what is allowed."""
    item = error.errors(include_url=False)[0]
    where = ".".join(str(part) for part in item["loc"])
    message = item["msg"].removeprefix("Value error, ")
    if item["type"] == "missing":
        return f"{where}: missing"
    if item["type"] == "extra_forbidden":
        return f"{where}: unknown key"
    value = item["input"]
    shown = "" if isinstance(value, dict | list) or item["type"] == "value_error" else f" = {value!r}"
    return f"{where}{shown}: {message}" if where else message


ModelT = TypeVar("ModelT", bound=BaseModel)


def validated(model: type[ModelT], data: dict[str, Any], *, where: str) -> ModelT:
    """``data`` as ``model``; raises :class:`InputError` with one line that begins with ``where``."""
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise InputError(f"{where}: {_first(error)}") from None


def read_toml(path: Path) -> dict[str, Any]:
    """The content of a TOML file; raises :class:`InputError` if it is missing or not TOML."""
    try:
        with path.open("rb") as stream:
            return tomllib.load(stream)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (IsADirectoryError, PermissionError) as error:
        raise InputError(f"{path}: can not be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a TOML file: its byte {error.start + 1} is no text in UTF-8") from None
    except (ValueError, RecursionError) as error:  # besides syntax: an integer or a nesting beyond all bounds
        raise InputError(f"{path}: not a TOML file: {error}") from None


def is_number(value: object) -> bool:
    """Whether ``value`` is a finite number, which a truth value is not."""
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)


def check_increasing(name: str, values: Sequence[float]) -> None:
    """Raise ValueError, for a validator, unless each value is larger than the one before it.

    ``name``: how the message calls ``values``.
    """
    if any(b <= a for a, b in zip(values[:-1], values[1:], strict=True)):
        raise ValueError(f"{name}: {list(values)}: must increase")
