"""Hermite-Simpson collocation of a mission as sparse linear maps around one node function.

Unknowns, all of order one: fuel burned at the mesh nodes and midpoints, rotor speed and twist at the mesh nodes, and
their rates, constant over an interval (so both are linear in it, exactly as a schedule is flown). The node function
y = (fuel flow, limits) of z = (mass, rotor speed, twist, rotor speed rate) is evaluated at the start, middle and end of
every interval, and everything else is linear:

    z = E x + e m0 + z0,     constraints g = A x + B y.

So the Jacobian is A + B J E and the Hessian of the Lagrangian E' H E, with block-diagonal J and H that come from the
node function alone: exact, and cheap to build whatever the length of the mission.
Mass is take-off mass minus fuel burned plus the mass changes so far, which makes mass events exact.
Equations: D. G. Hull, Conversion of optimal control problems into parameter optimization problems (1997), separated
Hermite-Simpson form.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from scipy import sparse

from vrsopt.schedule.mesh import Mesh
from vrsopt.schedule.schedule import ScheduleSettings

FUEL_SCALE = 100.0  # kg
PARTS = 3  # evaluations per interval: start, middle, end
INPUTS = 4  # mass, rotor speed, twist, rotor speed rate


@dataclass(frozen=True)
class Control:
    """A scheduled variable and its rate: their places in x, sizes and bounds, in units of the variable."""

    row: int  # of the node inputs
    start: np.ndarray  # (N,) place of its value at the start of each interval
    end: np.ndarray  # (N,)
    rate: np.ndarray  # (N,) place of its rate
    nominal: float
    bounds: tuple[float, float]
    rate_bound: float | None  # per s
    scale: float
    rate_scale: float


@dataclass(frozen=True)
class Layout:
    """Places in the vector x of the unknowns: fuel burned (N+1,), at midpoints (N,), rotor speed and twist."""

    fuel: np.ndarray
    middle: np.ndarray
    controls: tuple[Control, Control]
    size: int


def make_layout(mesh: Mesh, settings: ScheduleSettings, *, box: np.ndarray, periodic: bool) -> Layout:
    """Nodes of rotor speed and twist are shared between segments, unless their rate is unlimited: then each segment has
    its own. If ``periodic`` the last node is the first. ``box`` (2, 2) holds the bounds of both variables."""
    count = len(mesh)
    k = np.arange(count)
    size = 2 * count + 1
    controls = []
    for column, (nominal, rate_bound, unlimited_scale) in enumerate(
        (
            (settings.nominal_rotor_speed, settings.rotor_speed_rate, 0.01),
            (settings.nominal_twist, settings.twist_rate, 0.1),
        )
    ):
        start = k + (mesh.segment if rate_bound is None else 0)
        end = start + 1
        nodes = int(end[-1]) + 1
        if periodic:
            nodes -= 1
            end[-1] = 0
        controls.append(
            Control(
                row=1 + column,
                start=size + start,
                end=size + end,
                rate=size + nodes + k,
                nominal=nominal,
                bounds=(float(box[0, column]), float(box[1, column])),
                rate_bound=rate_bound,
                scale=nominal,
                rate_scale=rate_bound or unlimited_scale * nominal,
            )
        )
        size += nodes + count
    return Layout(np.arange(count + 1), count + 1 + k, (controls[0], controls[1]), size)


@dataclass(frozen=True)
class Points:
    """Where the aircraft is needed: mesh nodes (doubled at segment edges) and midpoints, P in all."""

    of_interval: np.ndarray  # (N, 3) point of each evaluation
    segment: np.ndarray  # (P,)
    time: np.ndarray  # (P,) s


def make_points(mesh: Mesh) -> Points:
    """Points of a mesh, in the order of time."""
    first = 2 * np.arange(len(mesh)) + mesh.segment
    of_interval = np.column_stack([first, first + 1, first + 2])
    count = int(of_interval.max()) + 1
    segment, time = np.empty(count, dtype=int), np.empty(count)
    segment[of_interval] = mesh.segment[:, None]
    time[of_interval] = np.column_stack([mesh.start, mesh.start + 0.5 * mesh.step, mesh.end])
    return Points(of_interval, segment, time)


def input_map(layout: Layout) -> sparse.csc_matrix:
    """E (4 * 3N, n_x): node inputs of all evaluations, without the constant part of the mass."""
    count = len(layout.middle)
    entries = []

    def add(part: int, row: int, columns: np.ndarray, value: float) -> None:
        rows = INPUTS * (PARTS * np.arange(count) + part) + row
        entries.append((rows, columns, np.full(count, value)))

    for part, fuel in enumerate((layout.fuel[:-1], layout.middle, layout.fuel[1:])):
        add(part, 0, fuel, -FUEL_SCALE)
        add(part, 3, layout.controls[0].rate, layout.controls[0].rate_scale)
    for control in layout.controls:
        add(0, control.row, control.start, control.scale)
        add(1, control.row, control.start, 0.5 * control.scale)
        add(1, control.row, control.end, 0.5 * control.scale)
        add(2, control.row, control.end, control.scale)
    return _matrix(entries, (INPUTS * PARTS * count, layout.size))


def defect_maps(mesh: Mesh, layout: Layout, outputs: int) -> tuple[sparse.csc_matrix, sparse.csc_matrix]:
    """A (4N, n_x) and B (4N, outputs * 3N) of the defects: fuel at the end, fuel in the middle, rotor speed, twist.

    The first of the ``outputs`` per evaluation is the fuel flow.
    """
    count = len(mesh)
    k, one = np.arange(count), np.ones(count)
    linear = [
        (k, layout.fuel[1:], one),
        (k, layout.fuel[:-1], -one),
        (count + k, layout.middle, one),
        (count + k, layout.fuel[1:], -0.5 * one),
        (count + k, layout.fuel[:-1], -0.5 * one),
    ]
    for control in layout.controls:
        rows = (1 + control.row) * count + k
        linear += [
            (rows, control.end, one),
            (rows, control.start, -one),
            (rows, control.rate, -mesh.step * control.rate_scale / control.scale),
        ]
    first, middle, last = (outputs * (PARTS * k + part) for part in range(PARTS))
    step = mesh.step / FUEL_SCALE
    weights = [
        (k, first, -step / 6),
        (k, middle, -4 * step / 6),
        (k, last, -step / 6),
        (count + k, first, -step / 8),
        (count + k, last, step / 8),
    ]
    return _matrix(linear, (4 * count, layout.size)), _matrix(weights, (4 * count, outputs * PARTS * count))


def _matrix(entries: list[tuple[np.ndarray, np.ndarray, np.ndarray]], shape: tuple[int, int]) -> sparse.csc_matrix:
    rows, columns, values = (np.concatenate(part) for part in zip(*entries, strict=True))
    return sparse.csc_matrix((values, (rows, columns)), shape=shape)


@dataclass(frozen=True)
class NodeFunctions:
    """Of one node: values y(z, c), Jacobian (outputs, 4) and Hessian (4, 4) of w'y, as CasADi functions."""

    values: ca.Function
    jacobian: ca.Function
    hessian: ca.Function
    outputs: int
    depends_on_rate: np.ndarray  # (m,) which limits do
    has_cost: bool  # is the last output a cost per second


def node_functions(function: ca.Function) -> NodeFunctions:
    """Derivatives of a path model's node function, once for all nodes; a third output of it is a cost per second.

    A function that is exact about a centre only is differentiated first and then centred where it is evaluated.
    """
    z, c = ca.SX.sym("z", INPUTS), ca.SX.sym("c", function.size1_in(INPUTS))
    centre = [ca.SX.sym("centre", INPUTS)] * (function.n_in() - INPUTS - 1)
    parts = function.call([*ca.vertsplit(z), c, *centre])
    y = ca.vertcat(*parts)
    w = ca.SX.sym("w", y.numel())
    jacobian = ca.jacobian(y, z)
    hessian = ca.hessian(ca.dot(w, y), z)[0]
    on_rate = np.array(ca.DM(jacobian.sparsity(), 1)).reshape(y.numel(), INPUTS)[:, 3] != 0
    if centre:
        y, jacobian, hessian = ca.substitute([y, jacobian, hessian], centre, [z])
    options = {"cse": True}
    return NodeFunctions(
        ca.Function("values", [z, c], [y], options),
        ca.Function("jacobian", [z, c], [jacobian], options),
        ca.Function("hessian", [z, c, w], [hessian], options),
        y.numel(),
        on_rate[1 : 1 + parts[1].numel()],
        len(parts) == 3,
    )


@dataclass(frozen=True)
class Nlp:
    """The NLP as CasADi functions for ``nlpsol``, and the values y (outputs, 3N) of all evaluations."""

    problem: dict[str, Any]
    jacobian: ca.Function
    hessian: ca.Function
    values: ca.Function


def assemble(
    node: NodeFunctions,
    *,
    input_matrix: sparse.csc_matrix,
    constant: np.ndarray,
    linear: sparse.csc_matrix,
    weights: sparse.csc_matrix,
    step: np.ndarray,
    final_fuel: int,
    penalty: np.ndarray,
) -> Nlp:
    """Objective x[final_fuel] (or the integral of the cost) + sum(penalty * x^2) and constraints A x + B y.

    ``constant`` (4, 3N) is the part of the node inputs that is neither x nor take-off mass; ``step`` (N,) [s] are the
    intervals. Parameters p of the NLP: take-off mass [kg], the factor on the cost, then the coefficients (n_c, 3N)
    column by column.
    """
    evaluations, n_c = constant.shape[1], node.values.size1_in(1)
    e_map, a_map, b_map = (ca.DM(part) for part in (input_matrix, linear, weights))
    x, p = ca.MX.sym("x", e_map.size2()), ca.MX.sym("p", 2 + n_c * evaluations)
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", a_map.size1())
    takeoff = ca.DM(np.tile([1.0, 0.0, 0.0, 0.0], evaluations))
    z = ca.reshape(ca.mtimes(e_map, x) + p[0] * takeoff + ca.DM(constant.ravel(order="F")), INPUTS, evaluations)
    c = ca.reshape(p[2:], n_c, evaluations)

    y = node.values.map(evaluations)(z, c)
    f = ca.dot(ca.DM(penalty), x * x)
    if node.has_cost:
        simpson = ca.DM((step[:, None] * np.array([1.0, 4.0, 1.0]) / 6.0).ravel()).T
        f += p[1] * ca.dot(simpson, y[-1, :])
    else:
        f += x[final_fuel]
    g = ca.mtimes(a_map, x) + ca.mtimes(b_map, ca.vec(y))

    jacobian = a_map + ca.mtimes(b_map, ca.mtimes(_blocks(node.jacobian.map(evaluations)(z, c), node.jacobian), e_map))
    w = ca.reshape(ca.mtimes(b_map.T, lam_g), node.outputs, evaluations)
    if node.has_cost:
        w = ca.vertcat(w[:-1, :], lam_f * p[1] * simpson)
    curvature = _blocks(node.hessian.map(evaluations)(z, c, w), node.hessian)
    hessian = ca.mtimes(e_map.T, ca.mtimes(curvature, e_map)) + 2 * lam_f * ca.diag(ca.DM(penalty))
    return Nlp(
        {"x": x, "p": p, "f": f, "g": g},
        ca.Function("jac_g", [x, p], [g, jacobian], ["x", "p"], ["g", "jac_g_x"]),
        ca.Function(
            "hess_lag", [x, p, lam_f, lam_g], [ca.triu(hessian)], ["x", "p", "lam_f", "lam_g"], ["hess_gamma_x_x"]
        ),
        ca.Function("values", [x, p], [y]),
    )


def _blocks(mapped: ca.MX, function: ca.Function) -> ca.MX:
    """The blocks side by side that a mapped function returns, as a block-diagonal matrix."""
    block = function.sparsity_out(0)
    count = mapped.size2() // block.size2()
    return ca.sparsity_cast(mapped, ca.diagcat(*[block] * count))
