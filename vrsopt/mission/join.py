"""Ways between poses: turns and a straight, fitted together in the plane and then exactly on the ellipsoid."""

from __future__ import annotations

from vrsopt.mission.route import Point, Pose, Way


def direct_to(pose: Pose, target: Point, *, radius: float, roll_length: float) -> Way:
    """From ``pose``, turn towards ``target`` and fly straight there: the shorter of right and left.

    Ends exactly at ``target``; empty if already there. No turn if already on course. A target too close to be turned
    to is first flown away from, straight ahead, as far as it takes. ``radius`` and ``roll_length`` [m] of the turn as
    in :mod:`vrsopt.mission.turns`.
    """
    raise NotImplementedError


def join(pose: Pose, goal: Pose, *, radius: float, roll_length: float) -> Way:
    """From ``pose``, a turn, a straight and a turn that end in ``goal``: the shortest of the four choices of sides.

    Ends within 1e-4 m and 1e-7 degrees of ``goal``; empty if already there. Pieces that are not needed are left out.
    Where no choice exists (``goal`` close by), it is first flown straight ahead, as far as it takes.
    """
    raise NotImplementedError
