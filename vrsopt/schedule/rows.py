"""The rows of the whole-mission problem: defects, limits, own constraints, accelerations, charged rate, integrals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from vrsopt.schedule.additions import Additions, Constraint
from vrsopt.schedule.labels import Kind, Labels, labels_at, per_second
from vrsopt.schedule.layout import FUEL_SCALE, Layout
from vrsopt.schedule.mesh import Mesh
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.transcription import Evaluations, Method, control_defects, fuel_defects, matrix, quadrature


@dataclass(frozen=True)
class Rows:
    """Rows g = linear x + weights y and what they are."""

    linear: sparse.csc_matrix
    weights: sparse.csc_matrix
    labels: Labels


@dataclass(frozen=True)
class Discretisation:
    """A mission on its mesh. ``idle`` (N,): intervals in which nothing is free; ``tasks``: those of the segments."""

    mesh: Mesh
    method: Method
    layout: Layout
    evaluations: Evaluations
    idle: np.ndarray
    tasks: tuple[str, ...]

    def during(self, constraint: Constraint) -> np.ndarray:
        """Intervals (N,) in which a constraint holds: all, or those of its tasks."""
        if constraint.tasks is None:
            return np.ones(len(self.mesh), dtype=bool)
        return np.isin(np.array(self.tasks)[self.mesh.segment], constraint.tasks)


def make_rows(
    of: Discretisation,
    settings: ScheduleSettings,
    limit_names: tuple[str, ...],
    additions: Additions,
    depends_on_rate: np.ndarray,
) -> Rows:
    """All rows; ``depends_on_rate`` (outputs,) tells which outputs of the node function feel the rate.

    ``limit_names``: limits of the aircraft.
    """
    parts = [_fuel(of), _controls(of), _limits(of, limit_names, additions.constraints, depends_on_rate)]
    accelerations = settings.rotor_speed_acceleration, settings.twist_acceleration
    for number, acceleration in enumerate(accelerations):
        if acceleration is not None:
            parts.append(_accelerations(of, number, acceleration, periodic=settings.ends == "periodic"))
    if of.layout.charged is not None:
        parts.append(_charged(of, of.layout.charged))
    first = 1 + len(limit_names) + len(additions.constraints)
    parts += [_integral(of, constraint, first + k) for k, constraint in enumerate(additions.integrals)]
    return Rows(
        sparse.vstack([part.linear for part in parts]).tocsc(),
        sparse.vstack([part.weights for part in parts]).tocsc(),
        Labels.joined([part.labels for part in parts]),
    )


def _linear(of: Discretisation, linear: sparse.csc_matrix, labels: Labels) -> Rows:
    return Rows(linear, sparse.csc_matrix((linear.shape[0], of.evaluations.outputs)), labels)


def _fuel(of: Discretisation) -> Rows:
    kinds = [Kind("defect", name, "kg", FUEL_SCALE) for name in ("fuel burned", "fuel burned inside intervals")]
    shares, every = of.method.shares[1:], np.arange(len(of.mesh))
    interval, share = np.repeat(every, len(shares)), np.tile(shares, len(every))
    labels = labels_at(of.mesh, kinds, (share < 1.0).astype(int), interval, share)
    return Rows(*fuel_defects(of.mesh, of.method, of.layout, of.evaluations), labels)


def _controls(of: Discretisation) -> Rows:
    count = len(of.mesh)
    kinds = [Kind("defect", f"{c.name} rate", c.unit, c.scale) for c in of.layout.controls]
    kind, interval = np.repeat([0, 1], count), np.tile(np.arange(count), 2)
    return _linear(
        of, control_defects(of.mesh, of.layout), labels_at(of.mesh, kinds, kind, interval, np.ones(2 * count))
    )


def _limits(
    of: Discretisation, names: tuple[str, ...], own: tuple[Constraint, ...], depends_on_rate: np.ndarray
) -> Rows:
    """Limits and own constraints; idle is left alone.

    Where two intervals meet in a segment, what does not feel the rate is taken from the start of the second one only:
    twice would be degenerate.
    """
    e, count = of.evaluations, len(names) + len(own)
    first_of_two = np.append(e.again[1:], False)
    wanted = ~first_of_two[:, None] | depends_on_rate[None, 1 : 1 + count]
    wanted &= ~of.idle[e.interval][:, None]
    for k, constraint in enumerate(own):
        wanted[:, len(names) + k] &= of.during(constraint)[e.interval]
    place, limit = np.nonzero(wanted)
    rows = np.arange(len(place))
    weights = matrix([(rows, e.output[place] + 1 + limit, np.ones(len(rows)))], (len(rows), e.outputs))
    kinds = [Kind("limit", name, "-", 1.0, 1.0) for name in names]
    kinds += [Kind("own", constraint.name, constraint.unit, constraint.scale) for constraint in own]
    labels = labels_at(of.mesh, kinds, limit, e.interval[place], e.share[place])
    return Rows(sparse.csc_matrix((len(rows), of.layout.size)), weights, labels)


def _accelerations(of: Discretisation, number: int, acceleration: float, *, periodic: bool) -> Rows:
    """Change of the rate from one interval to the next over the time between their middles, in units of the limit.

    The first and last rows are the change from and to rest at the ends of the mission, or from its last interval to its
    first. In idle the rate is zero to the very end, so that idle intervals take no time here.
    """
    mesh, control = of.mesh, of.layout.controls[number]
    count = len(mesh)
    scale = acceleration or control.rate_scale
    half = np.where(of.idle, 0.0, 0.5 * mesh.step)
    before, after = np.append(np.arange(-1, count - 1), count - 1), np.append(np.arange(count), 0 if periodic else -1)
    if periodic:  # the last row says what the first one does
        before, after = np.append(count - 1, before[1:-1]), after[:-1]
    rows = np.arange(len(before))
    time = np.where(before >= 0, half[before], 0.0) + np.where(after >= 0, half[after], 0.0)
    weight = control.rate_scale / scale / np.maximum(time, 1e-9)  # between two idle intervals both rates are zero
    weight = np.where(time > 0.0, weight, 0.0)
    entries = [
        (rows[after >= 0], control.rate[after[after >= 0]], weight[after >= 0]),
        (rows[before >= 0], control.rate[before[before >= 0]], -weight[before >= 0]),
    ]
    kind = Kind("acceleration", f"{control.name} acceleration", per_second(per_second(control.unit)), scale)
    interval, share = np.where(after >= 0, after, before), np.where(after >= 0, 0.0, 1.0)
    labels = labels_at(mesh, [kind], np.zeros(len(rows), dtype=int), interval, share)
    return _linear(of, matrix(entries, (len(rows), of.layout.size)), labels)


def _charged(of: Discretisation, charged: np.ndarray) -> Rows:
    """Charged rate minus rate of the rotor speed, not below zero."""
    every, control = np.arange(len(of.mesh)), of.layout.controls[0]
    one = np.ones(len(every))
    linear = matrix([(every, charged, one), (every, control.rate, -one)], (len(every), of.layout.size))
    kind = Kind("charged", "charged rotor speed rate", "rad/s2", control.rate_scale)
    return _linear(of, linear, labels_at(of.mesh, [kind], np.zeros(len(every), dtype=int), every, 0.5 * one))


def _integral(of: Discretisation, constraint: Constraint, output: int) -> Rows:
    weights = quadrature(of.mesh, of.method, of.evaluations, output, of.during(constraint))
    nowhere = np.array([-1])
    labels = Labels(
        (Kind("integral", constraint.name, constraint.unit, constraint.scale),),
        np.array([0]),
        nowhere,
        nowhere,
        np.array([np.nan]),
    )
    return Rows(sparse.csc_matrix((1, of.layout.size)), sparse.csc_matrix(weights[None, :]), labels)
