"""Least fuel flow over rotor speed and twist at many nodes at once, by nested grids.

A coarse grid finds the basin, then 5 x 5 grids of half the spacing follow it down. Limits are honoured by rank: a
candidate inside the limits beats any outside them, outside the smaller breach wins. No derivatives, so a surrogate with
kinks or an optimum on a limit does not matter; all nodes are evaluated together, which is what makes it fast.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vrsopt.schedule.path_model import PathModel

COARSE = (17, 11)  # grid over (rotor speed, twist)
FINE = 5  # points per variable of the nested grids
BREACH = 1e6  # kg/s per unit of breach: dwarfs any fuel flow
ALLOWED_BREACH = 1e-9


@dataclass(frozen=True)
class PointOptima:
    """Optimum at each of N nodes, and its largest normalised limit (above zero: no point of the box is allowed)."""

    rotor_speed: np.ndarray  # rad/s
    twist: np.ndarray  # rad
    fuel_flow: np.ndarray  # kg/s
    excess: np.ndarray  # -
    nearest_limit: np.ndarray  # index of the limit behind ``excess``


def point_optima(model: PathModel, mass: np.ndarray, points: np.ndarray) -> PointOptima:
    """What rotor speed and twist ``points`` (N, 2) amount to at mass (N,) [kg]."""
    values = model.evaluate(mass, points[:, 0], points[:, 1])
    return PointOptima(
        rotor_speed=points[:, 0],
        twist=points[:, 1],
        fuel_flow=values.fuel_flow,
        excess=np.max(values.limits, axis=0),
        nearest_limit=np.argmax(values.limits, axis=0),
    )


def _merit(model: PathModel, mass: np.ndarray, rotor_speed: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """Merit (N, k) of k candidates per node, least is best: fuel flow [kg/s], or far above it outside a limit."""
    values = model.evaluate(mass[:, None], rotor_speed, twist)
    excess = np.max(values.limits, axis=0)
    return values.fuel_flow + np.where(excess > ALLOWED_BREACH, BREACH * (1.0 + excess), 0.0)


def batched_minimum(model: PathModel, mass: np.ndarray, *, box: np.ndarray, refinements: int = 14) -> PointOptima:
    """Least fuel flow within the limits at each node of ``model``.

    ``mass`` (N,) [kg]; ``box`` (2, 2) lower and upper rotor speed [rad/s] and twist [rad], a variable with equal ends
    is held. The spacing is halved ``refinements`` times: 14 leaves 1e-6 of the box.
    """
    every = np.arange(len(mass))
    span = box[1] - box[0]
    counts = [count if width > 0 else 1 for count, width in zip(COARSE, span, strict=True)]
    axes = [np.linspace(low, high, count) for low, high, count in zip(*box, counts, strict=True)]
    candidates = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(1, -1, 2)
    candidates = np.broadcast_to(candidates, (len(mass), *candidates.shape[1:]))
    stencil_axes = [np.arange(FINE) - FINE // 2 if width > 0 else np.zeros(1) for width in span]
    stencil = np.stack(np.meshgrid(*stencil_axes, indexing="ij"), axis=-1).reshape(1, -1, 2)
    spacing = span / np.maximum(np.array(counts) - 1, 1)
    for refinement in range(refinements + 1):
        merit = _merit(model, mass, candidates[..., 0], candidates[..., 1])
        centre = candidates[every, np.argmin(merit, axis=1)]
        spacing = spacing / 2.0
        if refinement < refinements:
            candidates = np.clip(centre[:, None, :] + stencil * spacing, box[0], box[1])
    return point_optima(model, mass, centre)


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

    Twist stays at its optimum; the band is the connected one around the optimum.
    """
    rotor_speed = np.linspace(box[0, 0], box[1, 0], points)
    grid = np.broadcast_to(rotor_speed, (len(mass), points))
    merit = _merit(model, mass, grid, np.broadcast_to(optima.twist[:, None], grid.shape))
    good = merit <= (1.0 + tolerance) * optima.fuel_flow[:, None]
    below = grid <= optima.rotor_speed[:, None]
    bad_below = np.where(below & ~good, grid, -np.inf).max(axis=1, keepdims=True)
    bad_above = np.where(~below & ~good, grid, np.inf).min(axis=1, keepdims=True)
    inside = good & (grid > bad_below) & (grid < bad_above)
    low = np.where(inside, grid, np.inf).min(axis=1)
    high = np.where(inside, grid, -np.inf).max(axis=1)
    return np.minimum(low, optima.rotor_speed), np.maximum(high, optima.rotor_speed)
