"""A solved whole-mission problem in a NetCDF file: its schedule, and the unknowns and multipliers for a warm start.

Numbers are variables, everything else is one attribute of JSON text; no pickle. The structure (transcription, mesh,
numbers of unknowns and constraints, names of limits) is stored as a hash, so that a problem can say at once whether the
multipliers are of its own kind.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vrsopt.errors import InputError
from vrsopt.quantity import is_number
from vrsopt.schedule.mesh import Mesh
from vrsopt.schedule.schedule import Schedule
from vrsopt.schedule.trajectory_solution import Arc, Trajectory
from vrsopt.solvers.status import Status
from vrsopt.surrogate import digested
from vrsopt.surrogate.classic_netcdf import Variable

FORM = digested.Format("vrsopt trajectory", 2, "trajectory", "solve it again")
# name in the file -> dimension; the arrays of the schedule, of the mesh, and of the trajectory itself
SCHEDULE = {"segment": "node", "time": "node", "rotor_speed": "node", "twist": "node"}
MESH = {"mesh_segment": "interval", "mesh_start": "interval", "mesh_step": "interval"}
OWN = {"mass": "node", "mesh_error": "interval", "x": "unknown", "lam_x": "unknown", "lam_g": "constraint"}
BY_NAME = ("costates", "limit_multipliers", "bound_multipliers")  # name -> array
NUMBERS = ("fuel", "objective", "cost_factor", "regularisation", "max_residual", "build_s", "solve_s")
WHOLE = ("iterations", "rounds")
FIGURES = ("integral_multipliers", "integrals")  # name -> number

# What text of a stranger's making brings about
UNUSABLE = (ValueError, TypeError, AttributeError, OverflowError, RecursionError)


def save_trajectory(path: Path | str, trajectory: Trajectory) -> None:
    """Write ``trajectory`` to ``path``; an existing file is replaced at once or, on an error, not at all.

    Raises :class:`InputError` if ``path`` can not be written.
    """
    schedule, mesh = trajectory.schedule, trajectory.mesh
    variables: dict[str, Any] = {name: (size, _doubles(getattr(schedule, name))) for name, size in SCHEDULE.items()}
    variables |= {name: (size, _doubles(getattr(mesh, name.removeprefix("mesh_")))) for name, size in MESH.items()}
    variables |= {name: (size, _doubles(getattr(trajectory, name))) for name, size in OWN.items()}
    names = {}
    for group in BY_NAME:
        found: Mapping[str, np.ndarray] = getattr(trajectory, group)
        names[group] = list(found)
        for k, values in enumerate(found.values()):
            variables[f"{group}_{k}"] = (f"{group}_{k}", _doubles(values))
    text = {
        "names": names,
        "arcs": [[arc.start, arc.end, arc.task, list(arc.active)] for arc in trajectory.arcs],
        **{name: getattr(trajectory, name) for name in (*NUMBERS, *WHOLE, *FIGURES)},
        "schedule": [schedule.name, _written(schedule), dict(schedule.details)],
        "transcription": trajectory.transcription,
        "end": _written(trajectory),
    }
    attributes = {"structure": structure_hash(trajectory), "record": json.dumps(text, ensure_ascii=True)}
    digested.save(path, variables, attributes, form=FORM)


def load_trajectory(path: Path | str) -> Trajectory:
    """The trajectory that :meth:`Trajectory.save` wrote to ``path``, to the last bit.

    Safe for files of strangers. Raises :class:`InputError` for a file that is missing, foreign, damaged, of another
    version, or whose parts do not fit each other.
    """
    attributes, variables = digested.load(Path(path), form=FORM, shown=str(path))
    try:
        trajectory = _trajectory(json.loads(str(attributes["record"])), variables)
    except KeyError as error:
        raise InputError(f"{path}: not a complete trajectory: {error.args[0]} is missing") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    except UNUSABLE:
        raise InputError(f"{path}: record: not what this program writes") from None
    if structure_hash(trajectory) != attributes.get("structure"):
        raise InputError(f"{path}: structure: does not match its arrays")
    return trajectory


def structure_hash(trajectory: Trajectory) -> str:
    """SHA-256 of what a problem must have in common with ``trajectory`` to take its multipliers."""
    mesh = trajectory.mesh
    sizes = len(trajectory.x), len(trajectory.lam_g)
    words = [trajectory.transcription, *trajectory.limit_multipliers, "", *trajectory.integrals]
    digest = hashlib.sha256(json.dumps([sizes, words]).encode())
    for values in (mesh.segment, mesh.start, mesh.step):
        digest.update(_doubles(values).tobytes())
    return digest.hexdigest()


def _written(result: Schedule | Trajectory) -> list[Any]:
    return [result.success, result.status.name, result.message]


def _doubles(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, dtype=np.float64)


def _trajectory(record: Mapping[str, Any], variables: Mapping[str, Variable]) -> Trajectory:
    """Raises :class:`KeyError` for what is missing, and what else :func:`load_trajectory` catches."""
    arrays: dict[str, Any] = {name: variables[name].values for name in (*SCHEDULE, *MESH, *OWN)}
    for sizes in (SCHEDULE, MESH, OWN):
        for name, size in sizes.items():
            first = next(known for known, other in (SCHEDULE | MESH | OWN).items() if other == size)
            if arrays[name].shape != arrays[first].shape or arrays[name].ndim != 1:
                raise InputError(f"{name} has shape {arrays[name].shape}: that of {first} is needed")
            if name != "mesh_error" and not np.all(np.isfinite(arrays[name])):
                raise InputError(f"{name}: finite numbers only")
    by_name: dict[str, Any] = {
        group: {str(key): variables[f"{group}_{k}"].values for k, key in enumerate(record["names"][group])}
        for group in BY_NAME
    }
    lengths = len(arrays["time"]), len(arrays["mesh_step"])
    for group, arrays_of in by_name.items():
        for name, values in arrays_of.items():
            if values.ndim != 1 or len(values) not in lengths:
                raise InputError(f"{group} of {name!r} has shape {values.shape}: one value a node or interval")
    numbers: dict[str, Any] = {item: float(record[item]) for item in NUMBERS}
    if not is_number(numbers["cost_factor"]):
        raise InputError(f"cost_factor = {numbers['cost_factor']}: a finite number")
    numbers |= {item: int(record[item]) for item in WHOLE}
    figures: dict[str, Any] = {
        item: {str(key): float(value) for key, value in record[item].items()} for item in FIGURES
    }
    return Trajectory(
        schedule=_schedule(record["schedule"], arrays),
        mesh=Mesh(_whole(arrays["mesh_segment"]), arrays["mesh_start"], arrays["mesh_step"]),
        transcription=str(record["transcription"]),
        arcs=tuple(Arc(float(a), float(b), str(task), tuple(map(str, on))) for a, b, task, on in record["arcs"]),
        **{item: arrays[item] for item in OWN},
        **by_name,
        **numbers,
        **figures,
        **_end(record["end"]),
    )


def _schedule(record: Sequence[Any], arrays: Mapping[str, np.ndarray]) -> Schedule:
    name, end, details = record
    return Schedule(
        name=str(name),
        segment=_whole(arrays["segment"]),
        time=arrays["time"],
        rotor_speed=arrays["rotor_speed"],
        twist=arrays["twist"],
        details={str(key): float(value) for key, value in details.items()},
        **_end(end),
    )


def _end(record: Sequence[Any]) -> dict[str, Any]:
    success, status, message = record
    if status not in Status.__members__:
        raise InputError(f"status = {status!r}: one of {', '.join(Status.__members__)}")
    return {"success": bool(success), "status": Status[status], "message": str(message)}


def _whole(values: np.ndarray) -> np.ndarray:
    if np.any(values != np.floor(values)) or np.any((values < 0) | (values > 1e6)):
        raise InputError("segments: whole numbers from 0")
    return values.astype(int)
