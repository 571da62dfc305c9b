"""Turns: a spiral in, an arc, a spiral out; and their shape in the plane, from which ways are fitted together.

A turn is given by the ``radius`` [m] of its steady part and by the ``roll_length`` [m] over which the bank of that
radius is taken up; both have to be positive. A turn too small to reach that bank keeps the rate at which bank is taken
up, in the same measure smaller in length and in curvature: it has no steady part, and it vanishes with its angle.
Angles are positive to the right. An angle is the integral of the curvature over the way, which is the change of course
as the gyro sees it; the course against true north changes besides as the meridians converge.
"""

from __future__ import annotations

from math import copysign, cos, degrees, radians
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from vrsopt.mission.route import GAUSS, SHORTEST, Arc, Array, Pose, Spiral, Way

_NODES, _WEIGHTS = np.array(GAUSS).T
NO_TURN_DEG = 1e-8  # a smaller turn is left out


class TurnShape(NamedTuple):
    """Where a turn ends, in the plane, as seen from its start along its first direction."""

    along: Array  # m
    across: Array  # m, + to the right
    length: Array  # m, distance flown


class _Parts(NamedTuple):
    curvature: Array  # 1/m, the largest, not signed
    spiral: Array  # m, length of each of the two spirals
    arc: Array  # rad, angle of the steady part


def turn(pose: Pose, angle_deg: float, *, radius: float, roll_length: float) -> Way:
    """The turn by ``angle_deg`` that begins at ``pose``: up to three pieces, none if the angle is next to nothing."""
    if abs(angle_deg) < NO_TURN_DEG:
        return []
    curvature, spiral, arc = (float(part) for part in _parts(radians(angle_deg), radius, roll_length))
    curvature = copysign(curvature, angle_deg)
    way: Way = [Spiral.from_pose(pose, spiral, curvatures=(0.0, curvature))]
    if arc / abs(curvature) >= SHORTEST:
        sweep = copysign(degrees(arc), angle_deg)
        way.append(Arc.from_pose(way[-1].pose(spiral), abs(1.0 / curvature), sweep_deg=sweep))
    way.append(Spiral.from_pose(end_of(way, pose), spiral, curvatures=(curvature, 0.0)))
    return way


def turn_shape(angle_deg: ArrayLike, *, radius: float, roll_length: float) -> TurnShape:
    """Displacement and length of turns by ``angle_deg``, arrays of its shape."""
    angle = np.radians(np.asarray(angle_deg, dtype=float))
    curvature, spiral, arc = _parts(angle, radius, roll_length)
    # A turn is its own mirror image: its end lies where half its angle points, and half its chord is made by each half.
    half = np.abs(angle)[..., None] / 2.0
    whole = spiral[..., None]
    turned = curvature[..., None] * whole * _NODES**3 * (1.0 - 0.5 * _NODES)
    chord = 2.0 * (spiral * (np.cos(half - turned) @ _WEIGHTS) + radius * np.sin(arc / 2.0))
    length = 2.0 * spiral + radius * arc
    return TurnShape(chord * np.cos(angle / 2.0), chord * np.sin(angle / 2.0), length)


def lead(angle_deg: float, *, radius: float, roll_length: float) -> float:
    """How far [m] before a corner of ``angle_deg`` (below 180) a turn inside it begins; it ends as far after it."""
    along, across, _ = turn_shape(angle_deg, radius=radius, roll_length=roll_length)
    return float(np.hypot(along, across)) / (2.0 * cos(radians(angle_deg) / 2.0))


def half_circle_radius(across: float, *, roll_length: float) -> float:
    """Radius [m] of the steady part of the turn by 180 degrees that ends ``across`` [m] > 0 to the side."""

    def miss(radius: float) -> float:
        return float(turn_shape(180.0, radius=radius, roll_length=roll_length).across) - across

    # Never tighter than a part of the half circle without spirals, never wider than it
    tightest = 0.5 * across
    while miss(tightest) > 0.0:
        tightest *= 0.5
    return float(brentq(miss, tightest, 0.5 * across + SHORTEST, xtol=1e-12, rtol=1e-15))


def _parts(angle: ArrayLike, radius: float, roll_length: float) -> _Parts:
    """Largest curvature, spirals and arc of turns by ``angle`` [rad]."""
    size = np.abs(np.asarray(angle, dtype=float))
    share = np.sqrt(np.minimum(1.0, size * radius / roll_length))  # of the full bank
    arc = np.where(share < 1.0, 0.0, size - roll_length / radius)
    return _Parts(share / radius, share * roll_length, arc)


def end_of(way: Way, start: Pose) -> Pose:
    """Pose at the end of a way that begins at ``start``."""
    return way[-1].pose(way[-1].length) if way else start
