"""Collocation of a mission as sparse linear maps around one node function.

Unknowns, all of order one: fuel burned at the mesh nodes and inside the intervals, rotor speed and twist at the mesh
nodes, and their rates, constant over an interval (so both are linear in it, exactly as a schedule is flown). The node
function y = (fuel flow, limits) of z = (mass, rotor speed, twist, rotor speed rate) is evaluated at the stages of a
Runge-Kutta method in every interval, and everything else is linear:

    z = E x + e m0 + z0,     constraints g = A x + B y.

So the Jacobian is A + B J E and the Hessian of the Lagrangian E' H E, with block-diagonal J and H that come from the
node function alone: exact, and cheap to build whatever the length of the mission.
Mass is take-off mass minus fuel burned plus the mass changes so far, which makes mass events exact.

Two methods: Lobatto IIIA with three stages, which is separated Hermite-Simpson (order 4; D. G. Hull, Conversion of
optimal control problems into parameter optimization problems, 1997), and Radau IIA with three stages (order 5;
E. Hairer, G. Wanner, Solving ordinary differential equations II, 1996, table IV.5.6).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal

import numpy as np
from scipy import sparse

from vrsopt.errors import InputError
from vrsopt.schedule.layout import FUEL_SCALE, Layout
from vrsopt.schedule.mesh import Mesh

Transcription = Literal["hermite_simpson", "radau"]
STATES = 3  # mass, rotor speed, twist; the node inputs are these and the rates on either side of the node


@dataclass(frozen=True)
class Method:
    """A Runge-Kutta method: the fuel at ``shares[1:]`` of an interval is that at its start plus step * matrix @ (fuel
    flow at ``stages``)."""

    shares: np.ndarray
    stages: np.ndarray
    matrix: np.ndarray

    @property
    def weights(self) -> np.ndarray:
        """Quadrature weights of the stages."""
        return np.asarray(self.matrix[-1])


def _methods() -> dict[str, Method]:
    root = np.sqrt(6.0)
    inner = [(4.0 - root) / 10.0, (4.0 + root) / 10.0]
    radau = [
        [(88.0 - 7.0 * root) / 360.0, (296.0 - 169.0 * root) / 1800.0, (-2.0 + 3.0 * root) / 225.0],
        [(296.0 + 169.0 * root) / 1800.0, (88.0 + 7.0 * root) / 360.0, (-2.0 - 3.0 * root) / 225.0],
        [(16.0 - root) / 36.0, (16.0 + root) / 36.0, 1.0 / 9.0],
    ]
    lobatto = [[5.0 / 24.0, 1.0 / 3.0, -1.0 / 24.0], [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0]]
    thirds = np.array([0.0, 0.5, 1.0])
    return {
        "hermite_simpson": Method(thirds, thirds, np.array(lobatto)),
        "radau": Method(np.array([0.0, *inner, 1.0]), np.array([*inner, 1.0]), np.array(radau)),
    }


METHODS = _methods()


def method_of(transcription: str) -> Method:
    """The method by its name; raises InputError.

    ``transcription``: its name.
    """
    if transcription not in METHODS:
        raise InputError(f"trajectory: transcription = {transcription}: must be {' or '.join(METHODS)}")
    return METHODS[transcription]


@dataclass(frozen=True)
class Points:
    """Pairs (P,) of segment and time [s] where the aircraft is needed, in the order of time."""

    segment: np.ndarray
    time: np.ndarray


@dataclass(frozen=True)
class Places:
    """Evaluations (M,) of the node function, in the order of time, and the points (P,) they are at.

    Where two intervals of a segment meet, the point is evaluated with the rates of both, by a function that shares what
    does not depend on the rate: ``rates`` (P,) is how many a point has.
    """

    points: Points
    rates: np.ndarray  # (P,) 1 or 2
    interval: np.ndarray  # (M,)
    share: np.ndarray  # (M,) of the interval before it
    stage: np.ndarray  # (M,) number of the stage, -1 for an evaluation only for the sake of limits
    point: np.ndarray  # (M,)
    again: np.ndarray  # (M,) whether the evaluation before it is at the same place and time

    def with_outputs(self, outputs: int) -> Evaluations:
        """The same in the vectors of inputs and outputs of a node function with ``outputs``."""
        order = np.argsort(self.rates, kind="stable")
        z_size, y_size = (STATES + self.rates)[order], (outputs * self.rates)[order]
        state_row, output = np.empty(len(order), dtype=int), np.empty(len(order), dtype=int)
        state_row[order], output[order] = np.cumsum(z_size) - z_size, np.cumsum(y_size) - y_size
        second = np.append(False, np.diff(self.point) == 0)
        return Evaluations(
            **{one.name: getattr(self, one.name) for one in fields(self)},
            order=order,
            state_row=state_row[self.point],
            rate_row=state_row[self.point] + STATES + second,
            output=output[self.point] + outputs * second,
            inputs=int(z_size.sum()),
            outputs=int(y_size.sum()),
        )


@dataclass(frozen=True)
class Evaluations(Places):
    """Evaluations with their places in the inputs z and outputs y: the points with one rate come first in both."""

    order: np.ndarray  # (P,) the points in the order of z and y
    state_row: np.ndarray  # (M,) first of its three states in z
    rate_row: np.ndarray  # (M,) its rate in z
    output: np.ndarray  # (M,) first of its outputs in y
    inputs: int  # length of z
    outputs: int  # length of y


def make_places(mesh: Mesh, method: Method, *, shared: bool = True) -> Places:
    """Where a method evaluates the aircraft on a mesh; every evaluation is a point of its own if not ``shared``.

    A method without a stage at the start of an interval gets one at the start of each segment, where limits may be
    tightest.
    """
    count, stages = len(mesh), len(method.stages)
    interval, share = np.repeat(np.arange(count), stages), np.tile(method.stages, count)
    stage = np.tile(np.arange(stages), count)
    if method.stages[0] > 0.0:
        first = np.flatnonzero(np.append(True, np.diff(mesh.segment) != 0))
        interval, stage = np.append(interval, first), np.append(stage, np.full(len(first), -1))
        share = np.append(share, np.zeros(len(first)))
        order = np.lexsort((share, interval))
        interval, share, stage = interval[order], share[order], stage[order]
    segment = mesh.segment[interval]
    again = (share == 0.0) & np.append(False, (share[:-1] == 1.0) & (segment[1:] == segment[:-1]))
    leads = ~(again & shared)
    point = np.cumsum(leads) - 1
    time = mesh.start[interval] + share * mesh.step[interval]
    return Places(Points(segment[leads], time[leads]), np.bincount(point), interval, share, stage, point, again)


def make_nodes(mesh: Mesh) -> tuple[Points, np.ndarray]:
    """Mesh nodes as in a schedule, both ends of every segment among them, and those (N, 2) at the ends of intervals."""
    rank = np.cumsum(np.append(0, np.diff(mesh.segment) != 0)) + np.arange(len(mesh))
    at = np.column_stack([rank, rank + 1])
    segment, time = np.empty(rank[-1] + 2, dtype=int), np.empty(rank[-1] + 2)
    segment[at] = mesh.segment[:, None]
    time[at[:, 0]], time[at[:, 1]] = mesh.start, mesh.end
    return Points(segment, time), at


def input_map(layout: Layout, evaluations: Evaluations) -> sparse.csc_matrix:
    """E (inputs, n_x): node inputs of all evaluations, without the constant part of the mass."""
    _, lead = np.unique(evaluations.point, return_index=True)
    row, interval, share = (part[lead] for part in (evaluations.state_row, evaluations.interval, evaluations.share))
    place = np.searchsorted(layout.shares, share)
    entries = [
        (row, layout.fuel[interval, place], np.full(len(row), -FUEL_SCALE)),
        (
            evaluations.rate_row,
            layout.charged_rate[evaluations.interval],
            np.full(len(evaluations.interval), layout.controls[0].rate_scale),
        ),
    ]
    for control in layout.controls:
        entries += [
            (row + control.row, control.start[interval], (1.0 - share) * control.scale),
            (row + control.row, control.end[interval], share * control.scale),
        ]
    return matrix(entries, (evaluations.inputs, layout.size))


def fuel_defects(
    mesh: Mesh, method: Method, layout: Layout, evaluations: Evaluations
) -> tuple[sparse.csc_matrix, sparse.csc_matrix]:
    """A and B of the fuel burned from the start of each interval, (N s, n_x) and (N s, n_y): rows are interval by
    interval, to each of ``method.shares[1:]``; the first output of an evaluation is the fuel flow."""
    count, rows = len(mesh), len(method.shares) - 1
    of_interval = rows * np.arange(count)
    linear, weights = [], []
    used = evaluations.stage >= 0
    interval, stage, output = (part[used] for part in (evaluations.interval, evaluations.stage, evaluations.output))
    for row in range(rows):
        linear += [
            (of_interval + row, layout.fuel[:, row + 1], np.ones(count)),
            (of_interval + row, layout.fuel[:, 0], -np.ones(count)),
        ]
        weights.append((rows * interval + row, output, -mesh.step[interval] / FUEL_SCALE * method.matrix[row, stage]))
    return (
        matrix(linear, (rows * count, layout.size)),
        matrix(weights, (rows * count, evaluations.outputs)),
    )


def control_defects(mesh: Mesh, layout: Layout) -> sparse.csc_matrix:
    """A (2N, n_x) of rotor speed and twist: the change over each interval is its rate times its step."""
    count = len(mesh)
    one, entries = np.ones(count), []
    for control in layout.controls:
        rows = (control.row - 1) * count + np.arange(count)
        entries += [
            (rows, control.end, one),
            (rows, control.start, -one),
            (rows, control.rate, -mesh.step * control.rate_scale / control.scale),
        ]
    return matrix(entries, (2 * count, layout.size))


def quadrature(mesh: Mesh, method: Method, evaluations: Evaluations, output: int, wanted: np.ndarray) -> np.ndarray:
    """Weights (n_y,) [s] that integrate one output over the intervals ``wanted`` (N,)."""
    used = (evaluations.stage >= 0) & wanted[evaluations.interval]
    interval = evaluations.interval[used]
    found = np.zeros(evaluations.outputs)
    found[evaluations.output[used] + output] = mesh.step[interval] * method.weights[evaluations.stage[used]]
    return found


def matrix(entries: list[tuple[np.ndarray, np.ndarray, np.ndarray]], shape: tuple[int, int]) -> sparse.csc_matrix:
    """Sparse matrix of (rows, columns, values), added up; entries of zero are left out.

    ``shape``: (rows, columns).
    """
    rows, columns, values = (np.concatenate(part) for part in zip(*entries, strict=True))
    there = values != 0.0
    return sparse.csc_matrix((values[there], (rows[there], columns[there])), shape=shape)
