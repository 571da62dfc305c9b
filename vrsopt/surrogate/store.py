"""A set of fitted Krigings in one NetCDF file (classic format, 64-bit offsets), with where it comes from.

Variables: ``inputs_0``, ``inputs_1``, ... the sampled inputs, one for all outputs that were fitted on the same rows;
for each output ``weights_<output>`` (its scalars and leave-one-out figures are attributes of it), ``coefficients_``,
``lower_``, ``upper_``, ``theta_`` and, if gradients were fitted, ``gradient_weights_<output>``. The digest is of all
bytes of the file but its own. It tells damage, not intent: whatever is read is checked as if a stranger had written it.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field, fields
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from vrsopt.errors import InputError
from vrsopt.surrogate import classic_netcdf, digested
from vrsopt.surrogate import trend as trends
from vrsopt.surrogate.checks import BOX_TOLERANCE
from vrsopt.surrogate.correlation import CORRELATIONS, DIFFERENTIABLE
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.state import KrigingState
from vrsopt.surrogate.validation import Accuracy

FORM = digested.Format("vrsopt surrogate", 2, "surrogate", "fit it again")
TEXTS = ("model_version", "data_hash", "space", "method")
SCALARS = ("smoothing", "nugget", "gradient_nugget", "variance", "mean", "scale")
VECTORS = ("lower", "upper", "theta")
SHIPPED = {"level": "surrogate.nc", "flight": "flight_surrogate.nc"}
DATA = Path(__file__).parents[1] / "data"
MOST_POINTS, MOST_INPUTS, MOST_OUTPUTS = 20_000, 20, 200
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,99}")


@cache
def _versions() -> dict[str, str]:
    return {name: metadata.version(name) for name in ("vrsopt", "numpy", "scipy")}


@dataclass(frozen=True)
class Surrogate:
    """Fitted Krigings and their leave-one-out figures by output, and where they come from.

    ``models``: :class:`vrsopt.surrogate.kriging.Kriging` by the name of the output, SI units; ``accuracy``: their
    figures.
    ``model_version`` and ``data_hash``: of the physics and of the aircraft and engine data; ``space``, ``method``,
    ``samples`` and ``seed``: of the design of experiments; ``versions``: of the libraries they were fitted with.
    All models have the same inputs.
    """

    models: Mapping[str, Kriging]
    accuracy: Mapping[str, Accuracy]
    _: KW_ONLY
    model_version: str
    data_hash: str
    space: str
    method: str
    samples: int
    seed: int
    versions: Mapping[str, str] = field(default_factory=_versions)

    def __post_init__(self) -> None:
        if not self.models or set(self.models) != set(self.accuracy):
            raise InputError(f"surrogate: outputs {', '.join(self.models)}: one or more, each with its accuracy")
        for name in (*self.models, *self.names):
            if not NAME.fullmatch(name):
                raise InputError(f"surrogate: name {name!r}: letters, digits and _, at most 100")
        for name, model in self.models.items():
            if model.state_.names != self.names:
                raise InputError(f"surrogate: {name} of {', '.join(model.state_.names)}: of {', '.join(self.names)}")
            if len(model.state_.inputs) > MOST_POINTS:
                raise InputError(f"surrogate: {name}: {len(model.state_.inputs)} points: at most {MOST_POINTS}")
        for name in TEXTS:
            text = getattr(self, name)
            if not (text.isascii() and text.isprintable()):
                raise InputError(f"surrogate: {name} = {text!r}: printable ASCII characters")
        if self.samples < 1:
            raise InputError(f"surrogate: samples = {self.samples}: at least 1")

    @property
    def names(self) -> tuple[str, ...]:
        """The inputs, in the order of the columns."""
        names: tuple[str, ...] = next(iter(self.models.values())).state_.names
        return names

    @property
    def fingerprint(self) -> str:
        """SHA-256 of all that decides on predictions."""
        digest = hashlib.sha256()
        for name, model in self.models.items():
            state = model.state_
            arrays = (state.inputs, state.weights, state.coefficients, state.gradient_weights)
            digest.update(repr([name, state.names, state.correlation, state.trend]).encode())
            for values in (*arrays, *(getattr(state, item) for item in (*SCALARS, *VECTORS))):
                digest.update(np.ascontiguousarray(values, dtype=np.float64).tobytes())
        return digest.hexdigest()


def save(path: Path | str, surrogate: Surrogate) -> None:
    """Write ``surrogate`` to ``path``; an existing file is replaced at once or, on an error, not at all.

    Raises :class:`InputError` if ``path`` can not be written.
    """
    digested.save(path, _variables(surrogate), _attributes(surrogate), form=FORM)


def load(path: Path | str, *, model_version: str | None = None, data_hash: str | None = None) -> Surrogate:
    """Read the surrogate in the file ``path``, or a shipped one by its space: "level" or "flight".

    Predictions equal those of the saved models to the last bit. Safe for files of strangers: nothing in them is run,
    and sizes and shapes are checked before memory is used. Raises :class:`InputError` for a file that is missing,
    foreign, larger than 64 MiB, damaged or of another format version, and for one of another ``model_version`` or
    ``data_hash`` where these are given.
    """
    file = DATA / SHIPPED[path] if isinstance(path, str) and path in SHIPPED else Path(path)
    attributes, variables = digested.load(file, form=FORM, shown=str(path))
    try:
        surrogate = _surrogate(attributes, variables)
    except KeyError as error:
        raise InputError(f"{path}: not a complete surrogate: {error.args[0]} is missing") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    for name, wanted in (("model_version", model_version), ("data_hash", data_hash)):
        found = getattr(surrogate, name)
        if wanted is not None and found != wanted:
            raise InputError(f"{path}: {name.replace('_', ' ')} = {found}: this run has {wanted}")
    return surrogate


def _attributes(surrogate: Surrogate) -> dict[str, Any]:
    return {
        **{name: getattr(surrogate, name) for name in TEXTS},
        "samples": surrogate.samples,
        "seed": str(surrogate.seed),  # the classic format has no 64-bit integers
        "versions": ", ".join(f"{name} {version}" for name, version in surrogate.versions.items()),
        "inputs": " ".join(surrogate.names),
        "outputs": " ".join(surrogate.models),
    }


def _variables(surrogate: Surrogate) -> dict[str, Any]:
    variables: dict[str, Any] = {}
    known: dict[bytes, int] = {}
    for name, model in surrogate.models.items():
        state: KrigingState = model.state_
        table = np.ascontiguousarray(state.inputs)
        number = known.setdefault(table.tobytes(), len(known))
        points = f"point_{number}"
        variables[f"inputs_{number}"] = ((points, "input"), table)
        attributes: dict[str, Any] = {item: float(getattr(state, item)) for item in SCALARS}
        attributes |= surrogate.accuracy[name].as_dict()
        attributes |= {"correlation": state.correlation, "trend": state.trend, "rows": number}
        variables[f"weights_{name}"] = ((points,), state.weights, attributes)
        variables[f"coefficients_{name}"] = ((f"term_{len(state.coefficients)}",), state.coefficients)
        for item in VECTORS:
            variables[f"{item}_{name}"] = (("input",), getattr(state, item))
        if state.enhanced:
            variables[f"gradient_weights_{name}"] = (("input", points), state.gradient_weights.T)
    return variables


def _surrogate(attributes: Mapping[str, Any], variables: Mapping[str, classic_netcdf.Variable]) -> Surrogate:
    """Raises :class:`KeyError` for what is missing and :class:`InputError` for what can not be."""
    names, outputs = (_names(attributes, item) for item in ("inputs", "outputs"))
    if len(names) > MOST_INPUTS or len(outputs) > MOST_OUTPUTS:
        raise InputError(f"{len(names)} inputs, {len(outputs)} outputs: at most {MOST_INPUTS} and {MOST_OUTPUTS}")
    models, accuracy = {}, {}
    for name in outputs:
        state = _state(name, names, variables)
        models[name] = Kriging.from_state(state)
        own = variables[f"weights_{name}"].attributes
        figures = {item.name: _number(name, own, item.name) for item in fields(Accuracy)}
        accuracy[name] = Accuracy(**figures)
    seed = _text(attributes, "seed")
    if not (seed.removeprefix("-").isdecimal() and len(seed) <= 20):
        raise InputError(f"seed = {seed[:40]!r}: a whole number")
    return Surrogate(
        models,
        accuracy,
        **{item: _text(attributes, item) for item in TEXTS},
        samples=int(_number("design", attributes, "samples")),
        seed=int(seed),
        versions=dict(_pair(part) for part in _text(attributes, "versions").split(", ")),
    )


def _state(name: str, names: tuple[str, ...], variables: Mapping[str, classic_netcdf.Variable]) -> KrigingState:
    """One model; raises as :func:`_surrogate`."""
    own = variables[f"weights_{name}"].attributes
    correlation, trend = _text(own, "correlation"), _text(own, "trend")
    if correlation not in CORRELATIONS or trend not in trends.TRENDS:
        raise InputError(
            f"{name}: correlation {correlation[:40]!r}, trend {trend[:40]!r}: none that this program knows"
        )
    arrays: dict[str, Any] = {
        item: variables[f"{item}_{name}"].values for item in ("weights", "coefficients", *VECTORS)
    }
    arrays["inputs"] = variables[f"inputs_{_number(name, own, 'rows'):g}"].values
    slopes = variables.get(f"gradient_weights_{name}")
    points, inputs = arrays["weights"].size, len(names)
    if points > MOST_POINTS:
        raise InputError(f"{name}: {points} points: at most {MOST_POINTS}")
    shapes = {"inputs": (points, inputs), "weights": (points,), "coefficients": (trends.size(inputs, trend),)}
    shapes |= {item: (inputs,) for item in VECTORS}
    if slopes is not None:
        arrays["gradient_weights"], shapes["gradient_weights"] = slopes.values, (inputs, points)
    for item, values in arrays.items():
        if values.shape != shapes[item]:
            raise InputError(f"{name}: {item} has shape {values.shape}: expected {shapes[item]}")
        if not np.all(np.isfinite(values)):
            raise InputError(f"{name}: {item}: finite numbers only")
    arrays["gradient_weights"] = arrays["gradient_weights"].T if slopes is not None else np.zeros((0, inputs))
    arrays |= {item: _number(name, own, item) for item in SCALARS}
    state = KrigingState(names=names, correlation=correlation, trend=trend, **arrays)
    _check(name, state)
    return state


def _check(name: str, state: KrigingState) -> None:
    """Raise :class:`InputError` for values that no fit has."""
    if not (np.all(state.lower < state.upper) and np.all(state.theta > 0)):
        raise InputError(f"{name}: lower < upper and theta > 0")
    with np.errstate(all="ignore"):
        scaled = state.scale_inputs(state.inputs)
    if not np.all((scaled >= -BOX_TOLERANCE) & (scaled <= 1 + BOX_TOLERANCE)):
        raise InputError(f"{name}: inputs: between lower and upper")
    if min(state.nugget, state.gradient_nugget, state.variance) < 0 or not state.scale > 0:
        raise InputError(f"{name}: nuggets and variance >= 0, and scale > 0")
    if state.smoothing != 0 and not (state.correlation == "exponential" and 0 < state.smoothing <= 1):
        raise InputError(f"{name}: smoothing = {state.smoothing:g}: 0, or up to 1 for the exponential correlation")
    if state.enhanced and state.correlation not in DIFFERENTIABLE:
        raise InputError(
            f"{name}: gradients with correlation {state.correlation!r}: one of {', '.join(DIFFERENTIABLE)}"
        )


def _text(attributes: Mapping[str, Any], item: str) -> str:
    value = attributes[item]
    if not isinstance(value, str) or len(value) > 10_000:
        raise InputError(f"{item}: a text of at most 10000 characters")
    return value


def _number(name: str, attributes: Mapping[str, Any], item: str) -> float:
    value = attributes[item]
    if not isinstance(value, float) or not np.isfinite(value):
        raise InputError(f"{name}: {item}: a finite number")
    return value


def _names(attributes: Mapping[str, Any], item: str) -> tuple[str, ...]:
    names = tuple(_text(attributes, item).split(" "))
    if len(set(names)) != len(names) or not all(NAME.fullmatch(name) for name in names):
        raise InputError(f"{item}: different names of letters, digits and _")
    return names


def _pair(text: str) -> tuple[str, str]:
    name, _, version = text.partition(" ")
    return name, version
