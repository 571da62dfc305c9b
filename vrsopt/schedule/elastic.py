"""The elastic form of a whole-mission problem: its constraints give way by as little as there is no way around.

Every limit, own constraint, integral, rate, acceleration, held value and bound of the mass gives way as a whole, task
by task and side by side; the weighted sum (L1) of what they give way by, each as a share of its limit, is least. So few
of them give way, and where the one that does presses hardest is the place. A little of the objective stays, which
settles what is not in the way. Exact penalties: J. Nocedal, S. J. Wright, Numerical Optimization (2006), 17.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np
from scipy import sparse

from vrsopt.solvers.ipopt import ipopt_options, ipopt_status, ipopt_words
from vrsopt.solvers.status import Status

if TYPE_CHECKING:
    from vrsopt.schedule.bounds import Bounds
    from vrsopt.schedule.labels import Label, Labels
    from vrsopt.schedule.trajectory import TrajectoryProblem

ROWS = ("limit", "own", "integral", "acceleration")  # families that give way
COLUMNS = ("fuel", "rotor speed rate", "twist rate")
HELD = ("rotor speed", "twist")  # only where held at one value: beyond its bounds a model means nothing
# What a share is worth against that of a limit: actuators can be chosen; a held value is soon far from what it was
WEIGHTS = {"rotor speed rate": 0.1, "twist rate": 0.1, "acceleration": 0.1, "rotor speed": 10.0, "twist": 10.0}
OBJECTIVE = 1e-4  # weight of the objective
LEAST = 1e-5  # share of a limit that counts as giving way
MAX_ITERATIONS = 500


@dataclass(frozen=True)
class Given:
    """A constraint that gave way, by its label where it presses hardest: to ``value`` from ``limit``, in its unit."""

    label: Label
    value: float
    limit: float
    share: float  # of the limit, weighted


@dataclass(frozen=True)
class Elastic:
    """``given``: the largest shares first; none of them: there is a point that keeps all constraints."""

    success: bool
    words: str
    given: tuple[Given, ...] = ()


@dataclass(frozen=True)
class _Side:
    """One side of the bounds of n rows of g, or columns of x, that give way.

    ``index`` of them; ``sign`` +1 for upper bounds; ``limit`` (n,) as the NLP scales it; ``size`` (n,): a weighted
    share of 1; ``group`` (n,): what gives way as one.
    """

    labels: Labels
    of_rows: bool
    index: np.ndarray
    sign: float
    limit: np.ndarray
    size: np.ndarray
    group: np.ndarray


def elastic(problem: TrajectoryProblem, takeoff_mass: float, *, bounds: Bounds, x0: np.ndarray, p: ca.DM) -> Elastic:
    """What has to give way in ``problem`` with these bounds, started at ``x0``, with parameters ``p``."""
    columns = _elastic_columns(problem.columns, bounds)
    rows = np.flatnonzero(_of_families(problem.rows, ROWS))
    sides: list[_Side] = []
    for labels, index, high, low in (
        (problem.rows, rows, bounds.ubg, bounds.lbg),
        (problem.columns, columns, bounds.ubx, bounds.lbx),
    ):
        for sign, bound in ((1.0, high), (-1.0, low)):
            first = max((int(side.group.max()) + 1 for side in sides), default=0)
            sides += _side(problem, labels, index[np.isfinite(bound[index])], sign, bound, takeoff_mass, first)
    lower, upper = _released(problem.columns, columns, bounds)
    x0 = np.clip(x0, lower, upper)
    solver, arguments = _problem(problem, sides, np.setdiff1d(np.arange(len(bounds.lbg)), rows), bounds)
    shares = _first_shares(problem, sides, x0, p)
    found = solver(
        x0=np.concatenate([x0, shares]),
        p=p,
        lbx=np.concatenate([lower, np.zeros(len(shares))]),
        ubx=np.concatenate([upper, np.full(len(shares), np.inf)]),
        **arguments,
    )
    stats = solver.stats()
    if ipopt_status(stats) is not Status.CONVERGED:
        return Elastic(False, ipopt_words(stats))
    pressure = np.abs(np.array(found["lam_g"]).ravel()[len(bounds.lbg) - len(rows) :])
    return Elastic(True, "", _given(sides, np.array(found["x"]).ravel()[len(x0) :], pressure))


def _of_families(labels: Labels, families: tuple[str, ...]) -> np.ndarray:
    return np.array([kind.family in families for kind in labels.kinds])[labels.kind]


def _elastic_columns(labels: Labels, bounds: Bounds) -> np.ndarray:
    """Columns that give way: of the rates and the fuel burned, and what is held though the others of its kind are free.

    The mission begins with no fuel burned, whatever gives way.
    """
    held = bounds.lbx == bounds.ubx
    giving = _of_families(labels, COLUMNS) & ~(_of_families(labels, ("fuel",)) & held)
    for k in np.flatnonzero([kind.family in HELD for kind in labels.kinds]):
        own = labels.kind == k
        giving |= own & held & np.any(own & ~held)
    return np.flatnonzero(giving)


def _released(labels: Labels, columns: np.ndarray, bounds: Bounds) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of x without those that give way; what was held keeps the widest bounds of its kind."""
    lower, upper = bounds.lbx.copy(), bounds.ubx.copy()
    lower[columns], upper[columns] = -np.inf, np.inf
    for k in np.flatnonzero([kind.family in HELD for kind in labels.kinds]):
        given = columns[labels.kind[columns] == k]
        lower[given] = np.min(bounds.lbx[labels.kind == k])
        upper[given] = np.max(bounds.ubx[labels.kind == k])
    return lower, upper


def _side(
    problem: TrajectoryProblem,
    labels: Labels,
    index: np.ndarray,
    sign: float,
    bound: np.ndarray,
    takeoff_mass: float,
    first: int,
) -> list[_Side]:
    """The side of the bounds ``bound`` at ``index``, grouped from ``first`` on; none if nothing is bounded there."""
    if not len(index):
        return []
    scale, offset = (
        np.array([getattr(k, item) for k in labels.kinds])[labels.kind[index]] for item in ("scale", "offset")
    )
    fuel = np.array([kind.family == "fuel" for kind in labels.kinds])[labels.kind[index]]
    limit = np.where(fuel, takeoff_mass, np.abs(offset + scale * bound[index]))
    tasks = np.unique([segment.task for segment in problem.profile.segments], return_inverse=True)[1]
    task = np.where(labels.segment[index] < 0, -1, tasks[labels.segment[index]])
    group = first + np.unique(np.column_stack([labels.kind[index], task]), axis=0, return_inverse=True)[1].ravel()
    size = np.where(limit > 0.0, limit / scale, 1.0)  # a limit of zero gives way by what the NLP calls one
    size = size / np.array([WEIGHTS.get(kind.family, 1.0) for kind in labels.kinds])[labels.kind[index]]
    return [_Side(labels, labels is problem.rows, index, sign, bound[index], size, group)]


def _first_shares(problem: TrajectoryProblem, sides: list[_Side], x0: np.ndarray, p: ca.DM) -> np.ndarray:
    """Shares (groups,) with which the start breaks nothing that gives way."""
    g = np.array(problem.nlp.jacobian(x0, p)[0]).ravel()
    shares = np.full(1 + max(int(side.group.max()) for side in sides), LEAST)
    for side in sides:
        over = side.sign * ((g if side.of_rows else x0)[side.index] - side.limit) / side.size
        np.maximum.at(shares, side.group, over)
    return shares


def _problem(
    problem: TrajectoryProblem, sides: list[_Side], rigid: np.ndarray, bounds: Bounds
) -> tuple[Any, dict[str, np.ndarray]]:
    """Solver in (x, shares) with constraints P g + T x - S shares, the rigid rows first, and their bounds."""
    nlp, n_x, n_g = problem.nlp, len(bounds.lbx), len(bounds.lbg)
    shares = ca.MX.sym("shares", 1 + max(int(side.group.max()) for side in sides))
    ends = np.cumsum([len(rigid), *(len(side.index) for side in sides)])
    of_g, of_x = sparse.lil_matrix((ends[-1], n_g)), sparse.lil_matrix((ends[-1], n_x))
    of_s = sparse.lil_matrix((ends[-1], shares.numel()))
    of_g[np.arange(len(rigid)), rigid] = 1.0
    lbg, ubg = np.full(ends[-1], -np.inf), np.full(ends[-1], np.inf)
    lbg[: len(rigid)], ubg[: len(rigid)] = bounds.lbg[rigid], bounds.ubg[rigid]
    for side, begin, end in zip(sides, ends, ends[1:], strict=False):
        places = np.arange(begin, end)
        (of_g if side.of_rows else of_x)[places, side.index] = 1.0
        of_s[places, side.group] = -side.sign * side.size
        (ubg if side.sign > 0.0 else lbg)[places] = side.limit
    P, T, S = (ca.DM(matrix.tocsc()) for matrix in (of_g, of_x, of_s))
    x, p = nlp.problem["x"], nlp.problem["p"]
    u, lam_f, lam_g = ca.vertcat(x, shares), ca.MX.sym("lam_f"), ca.MX.sym("lam_g", int(ends[-1]))
    v = ca.MX.sym("v", u.numel())
    of_v, s_v = v[:n_x], v[n_x:]
    g, jacobian = nlp.jacobian(of_v, p)
    jac = ca.Function(
        "jac_g",
        [v, p],
        [ca.mtimes(P, g) + ca.mtimes(T, of_v) + ca.mtimes(S, s_v), ca.horzcat(ca.mtimes(P, jacobian) + T, S)],
        ["x", "p"],
        ["g", "jac_g_x"],
    )
    curvature = nlp.hessian(of_v, p, OBJECTIVE * lam_f, ca.mtimes(P.T, lam_g))
    hess = ca.Function(
        "hess_lag",
        [v, p, lam_f, lam_g],
        [ca.diagcat(curvature, ca.MX(shares.numel(), shares.numel()))],
        ["x", "p", "lam_f", "lam_g"],
        ["hess_gamma_x_x"],
    )
    f = ca.dot(ca.DM.ones(shares.numel()), shares) + OBJECTIVE * nlp.problem["f"]
    g = ca.mtimes(P, nlp.problem["g"]) + ca.mtimes(T, x) + ca.mtimes(S, shares)
    options = ipopt_options(tol=1e-7, acceptable_iter=0, nlp_scaling_method="none", max_iter=MAX_ITERATIONS)
    options |= {"jac_g": jac, "hess_lag": hess, "calc_lam_p": False}
    relaxed: dict[str, Any] = {"x": u, "p": p, "f": f, "g": g}
    solver = ca.nlpsol("elastic", "ipopt", relaxed, options)
    return solver, {"lbg": lbg, "ubg": ubg}


def _given(sides: list[_Side], shares: np.ndarray, pressure: np.ndarray) -> tuple[Given, ...]:
    """What gave way, ``pressure`` being the multipliers of all sides one after the other."""
    found = []
    for side, own in zip(sides, np.split(pressure, np.cumsum([len(side.index) for side in sides])), strict=False):
        for group in np.unique(side.group[shares[side.group] > LEAST]):
            here = np.flatnonzero(side.group == group)
            row = here[int(np.argmax(own[here]))]
            label = side.labels[int(side.index[row])]
            scale, offset = label.kind.scale, label.kind.offset
            limit = offset + scale * float(side.limit[row])
            value = limit + side.sign * scale * float(side.size[row] * shares[group])
            found.append(Given(label, value, limit, float(shares[group])))
    return tuple(sorted(found, key=lambda given: -given.share))
