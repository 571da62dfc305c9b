"""What was asked of ``vrsopt solve``, as a result stores it, so that the result can be made again from itself."""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict, ValidationError

from vrsopt.errors import InputError
from vrsopt.helicopter import MODEL_VERSION, helicopter
from vrsopt.mission.track_file import read_text
from vrsopt.report.dataset import read_result
from vrsopt.schedule.compare import solve
from vrsopt.schedule.study_input import loaded, read

if TYPE_CHECKING:
    from vrsopt.schedule.comparison import Comparison

ATTRIBUTE = "request"  # of result.nc
LONGEST_NAME = 100  # characters


class Request(BaseModel):
    """Mission and options of a run. ``file``: name of the mission or track; ``surrogate``: path, None for the shipped
    one, ``surrogate_hash``: of its content. The other fields are the options of :func:`vrsopt.solve`."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    file: str
    schedules: tuple[str, ...]
    variables: str = "both"
    objective: dict[str, float] | None = None
    search: str = "batched"
    seed: int = 1
    mass: float | None = None
    isa_offset: float | None = None
    wind: tuple[float, float | None] | None = None
    surrogate: str | None = None
    surrogate_hash: str | None = None


@dataclass(frozen=True)
class Run:
    """A request carried out: ``comparison`` with the request in its provenance, ``mission_text`` as it was given."""

    comparison: Comparison
    mission_text: str


def run(mission: Path, request: Request, *, progress: bool = False) -> Run:
    """Solve ``mission`` as ``request`` says.

    Raises what :func:`vrsopt.solve` raises, and :class:`InputError` for a surrogate of another content than the
    request has.
    """
    task = read(mission, mass=request.mass, isa_offset=request.isa_offset, wind=request.wind)
    surrogate = loaded(request.surrogate, helicopter(task.aircraft).data_hash)
    found = surrogate.fingerprint
    if request.surrogate_hash not in (None, found):
        name = request.surrogate or "the shipped one"
        raise InputError(f"surrogate {name}: its content has the hash {found}: the result has {request.surrogate_hash}")
    comparison = solve(
        task,
        surrogate,
        schedules=request.schedules,
        variables=request.variables,
        objective=request.objective,
        search=request.search,
        seed=request.seed,
        progress=progress,
    )
    return Run(_stamped(comparison, request.model_copy(update={"surrogate_hash": found})), read_text(mission))


def repeat(result: Path, *, surrogate: Path | None = None, progress: bool = False) -> Run:
    """Make the result of the file ``result`` (a ``result.nc``) again; ``surrogate``: where its surrogate is now.

    Raises :class:`InputError` for a result that can not be repeated here: made in Python, by another version of the
    model, or with a surrogate of another content; else as :func:`run`.
    """
    attributes: Mapping[str, Any] = read_result(result).attrs
    if ATTRIBUTE not in attributes:
        raise InputError(f"{result}: request: missing: it was not written by vrsopt solve")
    try:
        request = Request.model_validate_json(str(attributes[ATTRIBUTE]))
    except ValidationError:
        raise InputError(f"{result}: request: not what this program writes") from None
    version = attributes.get("model_version")
    if version != MODEL_VERSION:
        raise InputError(f"{result}: model_version = {version}: this program has {MODEL_VERSION}")
    name, text = request.file, attributes.get("mission_text")
    if not 0 < len(name) < LONGEST_NAME or name != Path(name).name or "\\" in name or not name.isprintable():
        raise InputError(f"{result}: file = {name!r}: a name of a file")
    if not isinstance(text, str):
        raise InputError(f"{result}: mission_text: missing: it was not written by vrsopt solve")
    if attributes.get("mission_sha256") != hashlib.sha256(text.encode()).hexdigest():
        raise InputError(f"{result}: mission_text: not the one that was flown: mission_sha256 is that of another")
    if surrogate is not None:
        request = request.model_copy(update={"surrogate": str(surrogate)})
    with tempfile.TemporaryDirectory() as folder:
        mission = Path(folder) / request.file
        mission.write_text(text, encoding="utf-8")
        try:
            return run(mission, request, progress=progress)
        except InputError as error:
            raise InputError(str(error).replace(str(mission), f"{result}: {request.file}")) from None


def _stamped(comparison: Comparison, request: Request) -> Comparison:
    """``comparison`` with the request in its provenance; a variant's is for that variant alone."""
    variants = {
        name: _stamped(variant, request.model_copy(update={"variables": str(variant.provenance["variables"])}))
        for name, variant in comparison.variants.items()
    }
    provenance = {**comparison.provenance, ATTRIBUTE: request.model_dump_json()}
    return replace(comparison, provenance=provenance, variants=variants)
