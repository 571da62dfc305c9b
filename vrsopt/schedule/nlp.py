"""The NLP of linear maps around a node function, with exact sparse derivatives, as CasADi functions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from scipy import sparse

from vrsopt.schedule.transcription import STATES


@dataclass(frozen=True)
class NodeFunctions:
    """Of one node with one or two rates: values y(z, c), Jacobian of y and Hessian of w'y by z, as CasADi functions.

    z are mass, rotor speed, twist and the rates; y the ``outputs`` with the first rate, then with the second.
    """

    values: ca.Function
    jacobian: ca.Function
    hessian: ca.Function
    outputs: int
    depends_on_rate: np.ndarray  # (outputs,)


def node_functions(function: ca.Function, rates: int = 1) -> NodeFunctions:
    """Derivatives of a path model's node function, once for all nodes with this number of rates.

    A function that is exact about a centre only is differentiated first and then centred where it is evaluated.
    """
    z, c = ca.SX.sym("z", STATES + rates), ca.SX.sym("c", function.size1_in(STATES + 1))
    states = ca.vertsplit(z)
    points = [[*states[:STATES], rate] for rate in states[STATES:]]
    centres = [ca.SX.sym("centre", STATES + 1)] * (function.n_in() - STATES - 2)
    own = [[ca.SX.sym("centre", STATES + 1) for _ in centres] for _ in points]
    y = ca.vertcat(*(ca.vertcat(*function.call([*point, c, *of])) for point, of in zip(points, own, strict=True)))
    w = ca.SX.sym("w", y.numel())
    jacobian = ca.jacobian(y, z)
    hessian = ca.hessian(ca.dot(w, y), z)[0]
    outputs = y.numel() // rates
    on_rate = np.array(ca.DM(jacobian.sparsity(), 1)).reshape(y.numel(), STATES + rates)[:outputs, STATES] != 0
    if centres:
        about = [of[0] for of in own], [ca.vertcat(*point) for point in points]
        y, jacobian, hessian = ca.substitute([y, jacobian, hessian], *about)
    options = {"cse": True}
    return NodeFunctions(
        ca.Function("values", [z, c], [y], options),
        ca.Function("jacobian", [z, c], [jacobian], options),
        ca.Function("hessian", [z, c, w], [hessian], options),
        outputs,
        on_rate,
    )


@dataclass(frozen=True)
class Nlp:
    """The NLP as CasADi functions in the form ``nlpsol`` takes them, and the outputs y of all evaluations."""

    problem: dict[str, Any]  # x, p, f, g
    jacobian: ca.Function  # (x, p) -> g and its Jacobian
    hessian: ca.Function  # (x, p, lam_f, lam_g) -> upper triangle of the Hessian of lam_f f + lam_g' g
    values: ca.Function  # (x, p) -> y


@dataclass(frozen=True)
class Maps:
    """The linear maps: z = inputs x + takeoff m0 + constant, g = linear x + weights y, and the objective
    objective'x + factor * cost'y + penalty'x^2."""

    inputs: sparse.csc_matrix
    takeoff: np.ndarray
    constant: np.ndarray
    linear: sparse.csc_matrix
    weights: sparse.csc_matrix
    objective: np.ndarray
    cost: np.ndarray
    penalty: np.ndarray


def assemble(groups: Sequence[tuple[NodeFunctions, int]], maps: Maps) -> Nlp:
    """The NLP of ``maps`` around node functions, each with the number of its points, in the order of z and y.

    Parameters p: take-off mass [kg], the factor on the cost, then the coefficients (n_c, P) column by column.
    """
    n_c, points = groups[0][0].values.size1_in(1), [count for _, count in groups]
    e_map, a_map, b_map = (ca.DM(part) for part in (maps.inputs, maps.linear, maps.weights))
    cost = ca.sparsify(ca.DM(maps.cost))
    x, p = ca.MX.sym("x", e_map.size2()), ca.MX.sym("p", 2 + n_c * sum(points))
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", a_map.size1())
    takeoff_mass, factor, *own = ca.vertsplit(p, [0, 1, *(2 + n_c * np.cumsum([0, *points])).tolist()])
    coefficients = [ca.reshape(part, n_c, count) for part, count in zip(own, points, strict=True)]
    z = ca.mtimes(e_map, x) + takeoff_mass * ca.DM(maps.takeoff) + ca.DM(maps.constant)

    def each(name: str, *per_point: ca.MX) -> list[ca.MX]:
        """One of the node functions of every group, mapped; ``per_point`` are vectors to be dealt out to the points."""
        results, begins = [], [0] * len(per_point)
        for (node, count), c in zip(groups, coefficients, strict=True):
            function, arguments = getattr(node, name), []
            for k, vector in enumerate(per_point):
                rows = function.size1_in(2 * k)
                arguments.append(ca.reshape(vector[begins[k] : begins[k] + rows * count], rows, count))
                begins[k] += rows * count
            results.append(function.map(count)(arguments[0], c, *arguments[1:]))
        return results

    y = ca.vertcat(*(ca.vec(part) for part in each("values", z)))
    f = ca.dot(ca.DM(maps.objective), x) + factor * ca.dot(cost, y) + ca.dot(ca.DM(maps.penalty), x * x)
    g = ca.densify(ca.mtimes(a_map, x) + ca.mtimes(b_map, y))  # a row beside idle may be empty
    slopes = _blocks(each("jacobian", z), [node.jacobian for node, _ in groups])
    jacobian = a_map + ca.mtimes(b_map, ca.mtimes(slopes, e_map))
    w = ca.mtimes(b_map.T, lam_g) + lam_f * factor * cost
    curvature = _blocks(each("hessian", z, ca.densify(w)), [node.hessian for node, _ in groups])
    hessian = ca.mtimes(e_map.T, ca.mtimes(curvature, e_map)) + 2 * lam_f * ca.diag(ca.DM(maps.penalty))
    multipliers = ["x", "p", "lam_f", "lam_g"]
    return Nlp(
        {"x": x, "p": p, "f": f, "g": g},
        ca.Function("jac_g", [x, p], [g, jacobian], ["x", "p"], ["g", "jac_g_x"]),
        ca.Function("hess_lag", [x, p, lam_f, lam_g], [ca.triu(hessian)], multipliers, ["hess_gamma_x_x"]),
        ca.Function("values", [x, p], [y]),
    )


def _blocks(mapped: Sequence[ca.MX], functions: Sequence[ca.Function]) -> ca.MX:
    """Blocks side by side, as mapped functions return them, as one block-diagonal matrix."""
    diagonals = []
    for blocks, function in zip(mapped, functions, strict=True):
        block = function.sparsity_out(0)
        diagonals.append(ca.sparsity_cast(blocks, ca.diagcat(*[block] * (blocks.size2() // block.size2()))))
    return ca.diagcat(*diagonals)
