"""Why a whole-mission problem has no solution: the smallest relaxation with which it has one.

IPOPT spreads a contradiction over many intervals. The elastic problem (:mod:`vrsopt.schedule.elastic`) finds what has
to give way; here it is put into words, in the units that people read.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from vrsopt.schedule.elastic import Given, elastic
from vrsopt.schedule.solution import breaches
from vrsopt.solvers.ipopt import ipopt_status, ipopt_words
from vrsopt.solvers.status import Status

if TYPE_CHECKING:
    from vrsopt.schedule.bounds import Bounds
    from vrsopt.schedule.labels import Label
    from vrsopt.schedule.trajectory import TrajectoryProblem

ACCEPTED_RESIDUAL = 1e-6  # largest scaled one of a solution that counts
# name -> what a value in SI units is multiplied by ("%": over the nominal rotor speed), and the unit then
READ: dict[str, tuple[float | str, str]] = {
    "rotor speed": ("%", "%"),
    "rotor speed rate": ("%", "%/s"),
    "rotor speed acceleration": ("%", "%/s2"),
    "twist": (math.degrees(1.0), "deg"),
    "twist rate": (math.degrees(1.0), "deg/s"),
    "twist acceleration": (math.degrees(1.0), "deg/s2"),
}


@dataclass(frozen=True)
class Relaxation:
    """A constraint that has to give way in a task: to ``value`` from ``limit`` [``unit``], pressed most at ``time`` [s]
    (not a number where it is one of the whole mission)."""

    name: str
    task: str
    time: float
    value: float
    limit: float
    unit: str

    def __str__(self) -> str:
        return self.text()

    def text(self, others: Sequence[str] = ()) -> str:
        """In words; ``others``: tasks in which it has to give way as well."""
        digits = _digits(self.value, self.limit)
        unit = "" if self.unit == "-" else f" {self.unit}"
        task = f"{self.task}; also in {', '.join(others)}" if others else self.task
        where = "" if math.isnan(self.time) else f" at {self.time:.0f} s ({task})"
        return f"{self.name} {self.value:.{digits}f}{unit} against {self.limit:.{digits}f}{unit}{where}"


@dataclass(frozen=True)
class Diagnosis:
    """What was found out; ``relaxations`` by their share of the limit, the largest first."""

    status: Status
    message: str
    relaxations: tuple[Relaxation, ...] = ()


def diagnose(
    problem: TrajectoryProblem,
    takeoff_mass: float,
    *,
    bounds: Bounds,
    x0: np.ndarray,
    p: Any,
    g: np.ndarray,
    stats: dict[str, Any],
) -> Diagnosis:
    """Why IPOPT, which ended with ``stats`` and constraints ``g``, did not solve ``problem``.

    ``bounds``, start ``x0`` and parameters ``p``: those that it was solved with.
    """
    ended = f"IPOPT {ipopt_words(stats)}"
    if ipopt_status(stats) is Status.NOT_FINITE:
        at_start = np.array(problem.nlp.jacobian(x0, p)[0]).ravel()
        wrong = np.flatnonzero(~np.isfinite(at_start) | ~np.isfinite(g))
        where = _place(problem, problem.rows[int(wrong[0])]) if wrong.size else "the objective or a derivative"
        return Diagnosis(Status.NOT_FINITE, f"{ended}: {where}")
    breach = np.nan_to_num(breaches(g, bounds), nan=np.inf)
    row = int(np.argmax(breach))
    if breach[row] <= ACCEPTED_RESIDUAL:
        return Diagnosis(ipopt_status(stats), f"{ended}; all limits are kept, but the objective is not yet the least")
    ended += f", largest residual {breach[row]:.2g} ({_place(problem, problem.rows[row])})"
    found = elastic(problem, takeoff_mass, bounds=bounds, x0=x0, p=p)
    if not found.success:
        return Diagnosis(ipopt_status(stats), f"{ended}; nor was a relaxation found: there IPOPT {found.words}")
    if not found.given:
        advice = "a schedule that keeps all limits exists: more iterations (max_iter) or another start may find it"
        return Diagnosis(ipopt_status(stats), f"{ended}; {advice}")
    relaxations = tuple(_relaxation(problem, takeoff_mass, given) for given in found.given)
    message = f"infeasible; it would take {_named(relaxations)}; {ended}"
    return Diagnosis(Status.INFEASIBLE, message, relaxations)


def _named(relaxations: Sequence[Relaxation]) -> str:
    """The largest relaxation of every name."""
    by_name: dict[str, list[Relaxation]] = {}
    for relaxation in relaxations:
        by_name.setdefault(relaxation.name, []).append(relaxation)
    texts = [first.text([other.task for other in others]) for first, *others in by_name.values()]
    return ", ".join(texts)


def _place(problem: TrajectoryProblem, label: Label) -> str:
    if label.interval < 0:
        return label.kind.name
    return f"{label.kind.name} at {label.time:.0f} s ({problem.profile.segments[label.segment].task})"


def _relaxation(problem: TrajectoryProblem, takeoff_mass: float, given: Given) -> Relaxation:
    """In the units that people read."""
    label, kind = given.label, given.label.kind
    name, value, limit = kind.name, given.value, given.limit
    if kind.family == "fuel":  # bounds of the mass for which the aircraft's model holds
        unburned = takeoff_mass + float(np.sum(problem.profile.mass_changes[: label.segment + 1]))
        name, unit, value, limit = "gross mass", "kg", unburned - value, unburned - limit
    elif kind.family == "limit":
        factor, unit = _stated(problem).get(name, (100.0, "%"))
        value, limit = factor * value, factor * limit
    elif name in READ and kind.family not in ("own", "integral"):
        of_nominal, unit = READ[name]
        factor = 100.0 / problem.settings.nominal_rotor_speed if of_nominal == "%" else float(of_nominal)
        value, limit = factor * value, factor * limit
    else:
        unit = kind.unit
    if label.interval < 0:
        return Relaxation(name, "", math.nan, value, limit, unit)
    return Relaxation(name, problem.profile.segments[label.segment].task, label.time, value, limit, unit)


def _stated(problem: TrajectoryProblem) -> Mapping[str, tuple[float, str]]:
    """What a usage of 1 stands for, where the aircraft's model says it."""
    return getattr(problem.model, "stated_limits", {})


def _digits(value: float, limit: float) -> int:
    """Digits behind the point with which the two can be told apart, four or more of them in all."""
    size, apart = max(abs(value), abs(limit), 1e-12), max(abs(value - limit), 1e-12)
    return int(np.clip(max(3 - np.floor(np.log10(size)), 1 - np.floor(np.log10(apart))), 0, 9))
