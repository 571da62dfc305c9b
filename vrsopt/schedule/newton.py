"""Projected Newton from many starts at once: least fuel flow over two variables within bounds and limits.

Each step minimises the quadratic model of the Lagrangian in the polygon that bounds, trust region and linearised limits
leave. In two dimensions its minimum is free, on one edge or in a corner, so that all of these can be tried at once
(sequential quadratic programming, J. Nocedal and S. J. Wright, Numerical Optimization, 2006, chapter 18).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vrsopt.schedule.jets import Jet

STEPS = 40
SETTLED = 1e-8  # of the box: a step that ends the search
ROUNDING = 1e-13  # of the merit
TOLERANCE = 1e-10  # of a limit, and of the box: what a corner of the polygon may be outside
PENALTY = 5.0  # of the merit, of the fuel flow per unit of the worst limit; multipliers are 0.1 to 1

Derivatives = Callable[[np.ndarray, np.ndarray], tuple[Jet, Jet]]


@dataclass(frozen=True)
class Local:
    """Values and derivatives at n points by variables that go from 0 to 1 over the box; first the fuel flow over that
    of the start, then the limits: (n, 1 + m, ...)."""

    value: np.ndarray
    gradient: np.ndarray
    hessian: np.ndarray

    @property
    def merit(self) -> np.ndarray:
        """Objective with what is over a limit charged, (n,)."""
        return self.value[:, 0] + PENALTY * np.maximum(np.max(self.value[:, 1:], axis=1), 0.0)

    def where(self, chosen: np.ndarray, other: Local) -> Local:
        """These, or those of ``other`` where ``chosen`` (n,)."""
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return Local(*(np.where(chosen.reshape(-1, *[1] * (a.ndim - 1)), b, a) for a, b in pairs))

    def take(self, index: np.ndarray) -> Local:
        """Those at ``index``."""
        return Local(self.value[index], self.gradient[index], self.hessian[index])


def projected_newton(
    derivatives: Derivatives, start: np.ndarray, *, box: np.ndarray, reach: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) where the search from ``start`` (n, 2) ended, and whether it settled there (n,).

    ``derivatives(k, x)``: fuel flow (n,) and limits (m, n) of the starts ``k`` (n,) at points ``x`` (n, 2); ``box``
    (2, 2); ``reach`` (2,): the first trust region, in the units of the box.
    """
    span = np.where(box[1] > box[0], box[1] - box[0], 1.0)
    bounds = (box - box[0]) / span
    every = np.arange(len(start))
    found, settled = (start - box[0]) / span, np.zeros(len(start), dtype=bool)
    scale = derivatives(every, start)[0].value

    def local(index: np.ndarray, x: np.ndarray) -> Local:
        fuel, limits = derivatives(index, box[0] + x * span)
        fuel = fuel * (1.0 / scale[index])
        parts = np.concatenate([fuel.parts[:, None], limits.parts], axis=1)
        both = Jet(np.moveaxis(parts, 1, -1))
        stretch = span[:, None] * span
        return Local(both.value, both.gradient * span, both.hessian * stretch)

    active, x, here = every, found, local(every, found)
    radius = np.full(len(start), np.max(reach / span))
    multipliers = np.zeros_like(here.value[:, 1:])
    for _ in range(STEPS):
        step, multipliers = _step(here, multipliers, bounds - x[:, None], radius)
        length = np.max(np.abs(step), axis=1)
        there = local(active, x + step)
        better = there.merit <= here.merit + ROUNDING
        done = (length < SETTLED) & (length < radius)
        x, here = np.where(better[:, None], x + step, x), here.where(better, there)
        radius = np.where(better, np.maximum(radius, 2.0 * length), 0.3 * np.minimum(length, radius))
        found[active] = x
        settled[active[done]] = True
        going = np.flatnonzero(~done & (radius > 0.1 * SETTLED))
        if not len(going):
            break
        active, x, here, radius, multipliers = (
            active[going],
            x[going],
            here.take(going),
            radius[going],
            multipliers[going],
        )
    return np.clip(box[0] + found * span, box[0], box[1]), settled


def _step(here: Local, multipliers: np.ndarray, room: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Best step (n, 2) and the multipliers (n, m) of the limits there; ``room`` (n, 2, 2): from the point to the lower
    and upper bounds.

    Where no step meets the linearised limits it is one to the corner that breaks them least.
    """
    n, m = multipliers.shape
    hessian = here.hessian[:, 0] + np.einsum("nm,nmij->nij", multipliers, here.hessian[:, 1:])
    gradient = here.gradient[:, 0]
    least = np.maximum(room[:, 0], -radius[:, None])
    most = np.minimum(room[:, 1], radius[:, None])
    rows = np.concatenate(
        [here.gradient[:, 1:], np.broadcast_to(np.vstack([np.eye(2), -np.eye(2)]), (n, 4, 2))], axis=1
    )
    ends = np.concatenate([-here.value[:, 1:], most, -least], axis=1)
    steps = _candidates(hessian, gradient, rows, ends)
    outside = np.max(np.einsum("nri,nci->ncr", rows, steps) - ends[:, None], axis=2)
    model = np.einsum("nci,ni->nc", steps, gradient) + 0.5 * np.einsum("nci,nij,ncj->nc", steps, hessian, steps)
    inside = np.all((steps >= least[:, None] - TOLERANCE) & (steps <= most[:, None] + TOLERANCE), axis=2)
    allowed = outside <= TOLERANCE
    rank = np.where(allowed, model, np.where(inside, 1e6 * (1.0 + outside), np.inf))
    rank = np.where(np.isfinite(rank), rank, np.inf)
    best = np.argmin(rank, axis=1)
    every = np.arange(n)
    step = np.clip(steps[every, best], least, most)
    slope = gradient + np.einsum("nij,nj->ni", hessian, step)
    found = _multipliers(slope, rows, best)
    ok = allowed[every, best] & np.all(np.isfinite(found), axis=1)
    return step, np.where(ok[:, None], np.maximum(found[:, :m], 0.0), 0.0)


def _candidates(hessian: np.ndarray, gradient: np.ndarray, rows: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Steps (n, 1 + r + pairs, 2): free, along each of the r edges ``rows`` d = ``ends``, and into their corners.

    Those that do not exist are not finite, or of a model that is not convex.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        determinant = hessian[:, 0, 0] * hessian[:, 1, 1] - hessian[:, 0, 1] ** 2
        convex = (determinant > 0.0) & (hessian[:, 0, 0] > 0.0)
        free = _solved(hessian[:, 0], hessian[:, 1], -gradient[:, 0], -gradient[:, 1])
        free = np.where(convex[:, None], free, np.nan)
        nearest = rows * (ends / np.sum(rows**2, axis=2))[..., None]
        along = np.stack([-rows[..., 1], rows[..., 0]], axis=-1)
        bend = np.einsum("nri,nij,nrj->nr", along, hessian, along)
        slope = np.einsum("nri,nri->nr", along, gradient[:, None] + np.einsum("nij,nrj->nri", hessian, nearest))
        edges = nearest + along * np.where(bend > 0.0, -slope / bend, np.nan)[..., None]
        one, two = _pairs(rows.shape[1])
        corners = _solved(rows[:, one], rows[:, two], ends[:, one], ends[:, two])
    return np.concatenate([free[:, None], edges, corners], axis=1)


def _pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """All pairs of two different edges."""
    one, two = np.triu_indices(count, 1)
    return one, two


def _multipliers(slope: np.ndarray, rows: np.ndarray, best: np.ndarray) -> np.ndarray:
    """Multipliers (n, r) of the edges on which the candidates ``best`` (n,) lie."""
    n, r, _ = rows.shape
    one, two = (np.concatenate([[0], np.arange(r), side])[best] for side in _pairs(r))
    every, result = np.arange(n), np.zeros((n, r))
    a, b = rows[every, one], rows[every, two]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        single = -np.sum(a * slope, axis=1) / np.sum(a**2, axis=1)
        both = _solved(
            np.stack([a[:, 0], b[:, 0]], axis=1), np.stack([a[:, 1], b[:, 1]], axis=1), -slope[:, 0], -slope[:, 1]
        )
    edge, corner = (best > 0) & (best <= r), best > r
    result[every[edge], one[edge]] = single[edge]
    result[every[corner], one[corner]] = both[corner, 0]
    result[every[corner], two[corner]] = both[corner, 1]
    return result


def _solved(first: np.ndarray, second: np.ndarray, p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """x (..., 2) with ``first`` x = p and ``second`` x = q."""
    determinant = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    x = p * second[..., 1] - first[..., 1] * q
    y = first[..., 0] * q - p * second[..., 0]
    return np.stack([x, y], axis=-1) / determinant[..., None]
