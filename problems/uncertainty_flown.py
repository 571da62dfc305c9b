"""Physics of one case: fuel of the nominal rotor and least fuel at every flight of the representation, and in idle."""

from __future__ import annotations

import hashlib
import json
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import joblib
import numpy as np
from rich.progress import Progress
from uncertainty_numbers import Case
from uncertainty_optimum import Optimiser, Optimum
from uncertainty_points import FAR, Representation

from vrsopt.drive_train import engine_power
from vrsopt.equilibrium import rotor_model, trim_system
from vrsopt.errors import InputError, NoSolutionError
from vrsopt.flat_pitch import flat_pitch_power, flat_pitch_system
from vrsopt.helicopter import MODEL_VERSION, Helicopter, helicopter
from vrsopt.limits import Limits

PERCENT = 100.0


@dataclass(frozen=True)
class Job:
    """One case by name: a variant of the data files, and other values by path; ``held``: a manoeuvre margin with which
    all flights are optimised once more."""

    key: str
    values: Mapping[str, float] = field(default_factory=dict)
    variant: str = ""
    held: float | None = None

    @property
    def case(self) -> Case:
        case = Case.shipped()
        return (case.variant(self.variant) if self.variant else case).changed(self.values)


def flown(job: Job, representation: Representation) -> dict[str, Any]:
    """The row of one job, for JSON. Without a solution somewhere ``message`` says where and why."""
    begin = time.process_time()
    row: dict[str, Any] = {"key": job.key, "values": dict(job.values), "variant": job.variant, "message": ""}
    try:
        case = job.case
        rotor = case.aircraft.main_rotor
        row["constants"] = [rotor.induced_power_factor, rotor.section_drag_level, case.aircraft.fuselage.parasite_area]
        starts = _starts(representation)
        found = _optima(_optimiser(case), case, representation, starts)
        row["flights"], row["whole"] = _plain(found), sum(one.trims is None for one in found)
        if job.held is not None:
            again = _optima(_optimiser(case, job.held), case, representation, starts)
            row["flights_held"], found = _plain(again), found + again
        row["message"] = "; ".join(one.message for one in found if one.message)
        row["idle"] = {name: _idle(case, place[1]) for name, place in representation.idle.items()}
    except (InputError, NoSolutionError) as error:
        row["message"] = str(error)
    trim_system.cache_clear()  # systems are large, and no other case uses these
    rotor_model.cache_clear()
    flat_pitch_system.cache_clear()
    return row | {"cpu_s": time.process_time() - begin}


def _flights(case: Case, representation: Representation) -> Iterator[dict[str, float]]:
    """Flights of the case with the nominal rotor."""
    rotor = case.aircraft.main_rotor
    for stored in representation.flights:
        flight = {name: value for name, value in stored.items() if name != "height"}
        flight |= {"rotor_speed": rotor.nominal_rotor_speed, "twist": rotor.twist}
        flight["mass"] *= case.mass_factor
        if stored["height"] != FAR:
            flight["ground_proximity"] = rotor.radius / (stored["height"] + rotor.hub_above_skids)
        yield flight


def _optimiser(case: Case, margin: float | None = None) -> Optimiser:
    """With a manoeuvre ``margin`` other than the aircraft's, if given."""
    own = case.aircraft.blade_loading_limit.manoeuvre_margin if margin is None else margin
    return Optimiser(_machine(case), Limits(case.aircraft, case.engine, manoeuvre_margin=own))


def _optima(
    optimiser: Optimiser, case: Case, representation: Representation, starts: Sequence[Optimum] | None
) -> list[Optimum]:
    """Of all flights. ``starts``: those of another case; without them the result is the same, and takes longer."""
    found = []
    for k, flight in enumerate(_flights(case, representation)):
        twist, trims = (starts[k].twist, starts[k].trims) if starts else (flight["twist"], None)
        found.append(optimiser.solve(flight, twist, trims))
    return found


def _plain(found: Sequence[Optimum]) -> list[list[Any]]:
    """For JSON; the twist in degrees."""
    return [[one.nominal, one.least, one.rotor_speed, math.degrees(one.twist), list(one.active)] for one in found]


def disagreement(job: Job, representation: Representation) -> float:
    """Largest relative difference of least fuel between the few trims and the whole problem, over all flights."""
    case = job.case
    optimiser = _optimiser(case)
    found = _optima(optimiser, case, representation, None)
    whole = [optimiser.searched(flight) for flight in _flights(case, representation)]
    if any(one.message for one in whole):
        raise NoSolutionError("; ".join(one.message for one in whole if one.message))
    return max(abs(one.least / other.least - 1.0) for one, other in zip(found, whole, strict=True))


_STARTS: dict[str, list[Optimum]] = {}


def _starts(representation: Representation) -> list[Optimum]:
    """Optima of the shipped aircraft, once for each process."""
    mark = fingerprint(representation)
    if mark not in _STARTS:
        case = Case.shipped()
        _STARTS[mark] = _optima(_optimiser(case), case, representation, None)
    return _STARTS[mark]


def _machine(case: Case) -> Helicopter:
    """The helicopter of a case, with its engine in place of the file's."""
    machine = Helicopter(case.aircraft)
    machine.engine = case.engine
    return machine


def _idle(case: Case, altitude: float) -> float:
    """Fuel flow [kg/s] of all engines on the ground at flat pitch and nominal rotor speed."""
    rotors = flat_pitch_power(case.aircraft, altitude=altitude)
    flight = {"altitude": altitude, "isa_offset": 0.0, "speed": 0.0}
    flight["rotor_speed"] = case.aircraft.main_rotor.nominal_rotor_speed
    state = _machine(case).engine_state(float(engine_power(case.aircraft, case.engine, rotors)), flight)
    if not state.success:
        raise NoSolutionError(f"idle: {state.message}")
    return case.aircraft.transmission.engines * state.outputs["fuel_flow"]


@dataclass(frozen=True)
class Outcome:
    """What a row means for one mission: saving of fuel [%], mean rotor speed [%] and twist [deg] of the time in flight,
    nominal fuel [kg], and the share [%] of that time by what is active."""

    saving: float
    rotor_speed: float
    twist: float
    nominal: float
    active: Mapping[str, float]


def outcome(row: Mapping[str, Any], representation: Representation, mission: str, flights: str = "flights") -> Outcome:
    """Of a row without a message, its ``flights`` or "flights_held"."""
    weights = representation.weights[mission]
    nominal, least, speed, twist = np.array([one[:4] for one in row[flights]], dtype=float).T
    idle = representation.idle[mission][0] * row["idle"][mission]
    names = sorted({name for one in row[flights] for name in one[4]})
    share, least = weights / weights.sum(), representation.carried[mission] * least
    return Outcome(
        saving=PERCENT * float(1.0 - (weights @ least + idle) / (weights @ nominal + idle)),
        rotor_speed=PERCENT * float(share @ speed),
        twist=float(share @ twist),
        nominal=float(weights @ nominal + idle),
        active={name: PERCENT * float(share @ [name in one[4] for one in row[flights]]) for name in names},
    )


def fingerprint(representation: Representation, job: Job | None = None) -> str:
    """Of the flights, the data and the model that a row belongs to, and of what the ``job`` changes."""
    own = [] if job is None else [dict(job.values), job.variant, job.held]
    text = json.dumps([representation.flights, helicopter().data_hash, MODEL_VERSION, *own], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def run(jobs: Sequence[Job], representation: Representation, file: Path, workers: int) -> dict[str, dict[str, Any]]:
    """Rows of all jobs by key. Those in ``file`` are taken from it, the others are written there as they come."""
    marks = {job.key: fingerprint(representation, job) for job in jobs}
    known = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()] if file.exists() else []
    rows = {row["key"]: row for row in known if row["of"] == marks.get(row["key"])}
    wanted = [job for job in jobs if job.key not in rows]
    file.parent.mkdir(parents=True, exist_ok=True)
    with joblib.parallel_config(backend="loky", inner_max_num_threads=1), file.open("a", encoding="utf-8") as stream:
        parallel = joblib.Parallel(n_jobs=workers, return_as="generator_unordered", batch_size=1)
        with Progress() as progress:
            task = progress.add_task("cases", total=len(wanted))
            for row in parallel(joblib.delayed(flown)(job, representation) for job in wanted):
                rows[row["key"]] = row = row | {"of": marks[row["key"]]}
                stream.write(json.dumps(row) + "\n")
                stream.flush()
                progress.advance(task)
    return {job.key: rows[job.key] for job in jobs}
