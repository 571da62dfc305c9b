"""Least fuel flow over rotor speed and twist at many nodes at once.

A coarse grid finds the basins. From the best of them projected Newton goes down with exact derivatives where the model
has them (``at_mass``, see :class:`Points`). Models that have none, and the few nodes at which no start settles within
the limits, are left to nested grids: 5 x 5 points of half the spacing again and again, which kinks do not trouble.
Limits are honoured by rank: a candidate inside the limits beats any outside them, outside the smaller breach wins.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np

from vrsopt.schedule.bands import ForbiddenBand, allowed_regions
from vrsopt.schedule.jets import Jet
from vrsopt.schedule.newton import projected_newton
from vrsopt.schedule.path_model import PathModel

COARSE = (17, 11)  # grid over (rotor speed, twist)
STARTS = 3  # basins of the grid from which projected Newton starts
FINE = 5  # points per variable of the nested grids
REFINEMENTS = 14  # halvings of their spacing: 1e-6 of the box
BREACH = 1e6  # kg/s per unit of breach: dwarfs any fuel flow
ALLOWED_BREACH = 1e-9
BLOCK = 1000  # nodes at a time: bounds the memory


class Points(Protocol):
    """Nodes at given masses, smooth in rotor speed and twist (:class:`vrsopt.schedule.point_tables.PointTables`)."""

    def values(self, rotor_speed: np.ndarray, twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Fuel flow (N, p, q) [kg/s] and limits (m, N, p, q) on the grid of rotor speeds (p,) and twists (q,) or, each
        node its own, (N, q)."""
        ...

    def jets(self, node: np.ndarray, x: np.ndarray) -> tuple[Jet, Jet]:
        """Fuel flow (n,) and limits (m, n) with their derivatives at points ``x`` (n, 2) of the nodes (n,)."""
        ...


@dataclass(frozen=True)
class PointOptima:
    """Optimum at each of N nodes, and its largest normalised limit (above zero: no point of the box is allowed)."""

    rotor_speed: np.ndarray  # rad/s
    twist: np.ndarray  # rad
    fuel_flow: np.ndarray  # kg/s
    power_per_engine: np.ndarray  # W
    excess: np.ndarray  # -
    nearest_limit: np.ndarray  # index of the limit behind ``excess``

    def where(self, chosen: np.ndarray, other: PointOptima) -> PointOptima:
        """These, or those of ``other`` where ``chosen`` (N,)."""
        pairs = ((getattr(self, field.name), getattr(other, field.name)) for field in fields(self))
        return PointOptima(*(np.where(chosen, theirs, own) for own, theirs in pairs))


def point_optima(model: PathModel, mass: np.ndarray, points: np.ndarray) -> PointOptima:
    """What rotor speed and twist ``points`` (N, 2) amount to at mass (N,) [kg]."""
    values = model.evaluate(mass, points[:, 0], points[:, 1])
    return PointOptima(
        rotor_speed=points[:, 0],
        twist=points[:, 1],
        fuel_flow=values.fuel_flow,
        power_per_engine=values.power_per_engine,
        excess=np.max(values.limits, axis=0),
        nearest_limit=np.argmax(values.limits, axis=0),
    )


def _rank(fuel_flow: np.ndarray, excess: np.ndarray) -> np.ndarray:
    """Least is best: fuel flow [kg/s], or far above it outside a limit."""
    return fuel_flow + np.where(excess > ALLOWED_BREACH, BREACH * (1.0 + excess), 0.0)


def _merit(model: PathModel, mass: np.ndarray, rotor_speed: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """Rank (N, k) of k candidates per node."""
    values = model.evaluate(mass[:, None], rotor_speed, twist)
    return _rank(values.fuel_flow, np.max(values.limits, axis=0))


def batched_minimum(
    model: PathModel, mass: np.ndarray, *, box: np.ndarray, bands: Sequence[ForbiddenBand] = ()
) -> PointOptima:
    """Least fuel flow within the limits at each node of ``model``.

    ``mass`` (N,) [kg]; ``box`` (2, 2) lower and upper rotor speed [rad/s] and twist [rad], a variable with equal ends
    is held; ``bands`` of rotor speed are left out. Raises :class:`InputError` for bands that leave nothing of the box.
    """
    best: PointOptima | None = None
    for region in allowed_regions(bands, box[0, 0], box[1, 0]):
        part = np.column_stack([region, box[:, 1]])
        found = point_optima(model, mass, _searched(model, mass, part))
        better = None if best is None else _rank(found.fuel_flow, found.excess) < _rank(best.fuel_flow, best.excess)
        best = found if best is None or better is None else best.where(better, found)
    assert best is not None  # there is a region, or allowed_regions has raised
    return best


def _searched(model: PathModel, mass: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Optimum (N, 2) at each node inside the box, block by block."""
    found = np.empty((len(mass), 2))
    for block in _blocks(len(mass), BLOCK):
        points = _points(model.nodes(block), mass[block])
        left = np.ones(len(block), dtype=bool)
        if points is not None:
            found[block], settled = _descended(points, box)
            left = ~settled
        if np.any(left):
            rest = block[left]
            found[rest] = nested_grids(model.nodes(rest), mass[rest], box=box)
    return found


def _blocks(count: int, size: int) -> Iterator[np.ndarray]:
    """The numbers below ``count``, ``size`` at a time."""
    for begin in range(0, count, size):
        yield np.arange(begin, min(begin + size, count))


def _points(model: PathModel, mass: np.ndarray) -> Points | None:
    """The nodes at their masses as smooth functions, of a model that has them."""
    smooth: Callable[[np.ndarray], Points | None] | None = getattr(model, "at_mass", None)
    return smooth(mass) if smooth else None


def _axes(box: np.ndarray, counts: tuple[int, int]) -> list[np.ndarray]:
    """Coarse grid of each variable; one point where it is held."""
    return [np.linspace(low, high, count if high > low else 1) for low, high, count in zip(*box, counts, strict=True)]


def _descended(points: Points, box: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Best point (N, 2) that projected Newton finds from the basins of the coarse grid, and whether it settled there
    within the limits (N,)."""
    axes = _axes(box, COARSE)
    fuel_flow, limits = points.values(*axes)
    node, place = _basins(_rank(fuel_flow, np.max(limits, axis=0)))
    start = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)[place]
    reach = (box[1] - box[0]) / (np.array(COARSE) - 1)
    x, settled = projected_newton(lambda k, x: points.jets(node[k], x), start, box=box, reach=reach)
    fuel, excess = (part.value for part in points.jets(node, x))
    rank = _rank(fuel, np.max(excess, axis=0))
    settled &= np.max(excess, axis=0) <= ALLOWED_BREACH
    order = np.lexsort((rank, ~settled, node))  # the first of each node is its best
    first = order[np.unique(node[order], return_index=True)[1]]
    return x[first], settled[first]


def _basins(rank: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Node and flat index of the grid point of the STARTS best local minima of ``rank`` (N, p, q)."""
    n, p, q = rank.shape
    padded = np.pad(rank, ((0, 0), (1, 1), (1, 1)), constant_values=np.inf)
    lowest = np.min([padded[:, i : i + p, j : j + q] for i in range(3) for j in range(3)], axis=0)
    minima = np.where(rank <= lowest, rank, np.inf).reshape(n, -1)
    best = np.argsort(minima, axis=1)[:, :STARTS]
    node = np.repeat(np.arange(n), best.shape[1])
    exists = np.isfinite(minima[node, best.ravel()])
    return node[exists], best.ravel()[exists]


def nested_grids(model: PathModel, mass: np.ndarray, *, box: np.ndarray) -> np.ndarray:
    """Optimum (N, 2) by grids alone, to 1e-6 of the box; arguments as of :func:`batched_minimum`."""
    every = np.arange(len(mass))
    axes = _axes(box, COARSE)
    candidates = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(1, -1, 2)
    candidates = np.broadcast_to(candidates, (len(mass), *candidates.shape[1:]))
    stencil_axes = [np.arange(FINE) - FINE // 2 if len(axis) > 1 else np.zeros(1) for axis in axes]
    stencil = np.stack(np.meshgrid(*stencil_axes, indexing="ij"), axis=-1).reshape(1, -1, 2)
    spacing = (box[1] - box[0]) / np.maximum(np.array([len(axis) for axis in axes]) - 1, 1)
    for refinement in range(REFINEMENTS + 1):
        merit = _merit(model, mass, candidates[..., 0], candidates[..., 1])
        centre = candidates[every, np.argmin(merit, axis=1)]
        spacing = spacing / 2.0
        if refinement < REFINEMENTS:
            candidates = np.clip(centre[:, None, :] + stencil * spacing, box[0], box[1])
    return centre


def rotor_speed_band(
    model: PathModel,
    mass: np.ndarray,
    *,
    optima: PointOptima,
    box: np.ndarray,
    tolerance: float = 0.005,
    points: int = 321,
) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest allowed rotor speed (N,) [rad/s] whose fuel flow stays within ``tolerance`` of the optimum.

    Twist stays at its optimum; the band is the connected one around the optimum. ``mass`` (N,) [kg]; ``box`` (2, 2):
    lower and upper rotor speed [rad/s] and twist [rad]; ``points``: rotor speeds tried.
    """
    rotor_speed = np.linspace(box[0, 0], box[1, 0], points)
    ends = np.empty((2, len(mass)))
    for block in _blocks(len(mass), BLOCK // 2):
        rank = _along(model.nodes(block), mass[block], rotor_speed, optima.twist[block])
        good = rank <= (1.0 + tolerance) * optima.fuel_flow[block, None]
        best = optima.rotor_speed[block, None]
        below = rotor_speed <= best
        bad_below = np.where(below & ~good, rotor_speed, -np.inf).max(axis=1, keepdims=True)
        bad_above = np.where(~below & ~good, rotor_speed, np.inf).min(axis=1, keepdims=True)
        inside = good & (rotor_speed > bad_below) & (rotor_speed < bad_above)
        low, high = np.where(inside, rotor_speed, best), np.where(inside, rotor_speed, best)
        ends[:, block] = low.min(axis=1), high.max(axis=1)
    return ends[0], ends[1]


def _along(model: PathModel, mass: np.ndarray, rotor_speed: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """Rank (N, p) at rotor speeds (p,) and the twist (N,) of each node."""
    points = _points(model, mass)
    if points is not None:
        fuel_flow, limits = points.values(rotor_speed, twist[:, None])
        return _rank(fuel_flow, np.max(limits, axis=0))[:, :, 0]
    grid = np.broadcast_to(rotor_speed, (len(mass), len(rotor_speed)))
    return _merit(model, mass, grid, np.broadcast_to(twist[:, None], grid.shape))
