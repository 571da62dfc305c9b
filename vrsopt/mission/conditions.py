"""The flight condition of a moving aircraft: speed through the air, and the steady flight that feels the same forces.

The aircraft flies quasi-steadily under the specific force f = a - g of its inertial acceleration a and gravity g. Only
the direction of f relative to the velocity through the air matters to the rotor. In the vertical plane of the velocity,
level flight that speeds up at a is therefore a steady climb at atan(a / g), of an aircraft heavier by the ratio of f to
g. What f has to the side is a coordinated turn.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vrsopt.atmosphere import GRAVITY
from vrsopt.mission.wind import Wind

Array = NDArray[Any]
SLOWEST = 1e-6  # m/s, below it a direction of flight is that of the track
# rad/s: what pushes an almost standing aircraft sideways is no turn but a tilt, and counts as load factor
FASTEST_TURN = 0.9
# Of the velocity induced in the hover: a descent faster than that, at less airspeed than the latter, nears the vortex
# ring, of which momentum theory knows nothing. There it promises a tenth of the induced power too much (measured mean:
# J. G. Leishman, Principles of Helicopter Aerodynamics, 2006, section 2.13).
FASTEST_SINKING = 0.3


@dataclass(frozen=True)
class Kinematics:
    """Motion over the ground at times (N,); the track frame is along the course, to its right and up."""

    ground_speed: Array  # m/s, horizontal
    acceleration: Array  # m/s2, along the track
    lateral_acceleration: Array  # m/s2, to the right
    altitude: Array  # m, pressure altitude
    climb_rate: Array  # m/s
    vertical_acceleration: Array  # m/s2, up


@dataclass(frozen=True)
class Conditions:
    """Flight conditions at pairs of segment and time; arrays of one shape.

    The segment belongs to the pair because at an edge the condition is that of the segment before or after it.
    ``load_factor`` over ``turn_load_factor`` is the part of the vertical plane, a little below 1 in a push-over.
    """

    segment: Array  # index
    time: Array  # s
    speed: Array  # true airspeed, m/s
    altitude: Array  # pressure altitude, m
    climb_angle: Array  # rad, of the path through the air
    load_factor: Array  # -, specific force over g
    turn_load_factor: Array  # -, at least 1: what the turn alone adds
    turn: Array  # +1 to the right, -1 to the left, 0 straight
    equivalent_climb_angle: Array  # rad, of the steady climb with the same forces
    height: Array  # of the skids above the ground, m; inf where the ground does not matter
    idle: Array  # bool: on the ground at flat pitch, at rotor speed 100 % or at ground idle
    ground_idle: Array  # bool: the engines at their ground idle

    @classmethod
    def level(cls, speed: Array, altitude: float | Array) -> Conditions:
        """Straight level flight far from the ground at airspeeds (N,) [m/s] and one or N pressure altitudes [m]."""
        zero, one = np.zeros(len(speed)), np.ones(len(speed))
        return cls(
            segment=zero.astype(int),
            time=zero,
            speed=speed,
            altitude=altitude * one,
            climb_angle=zero,
            load_factor=one,
            turn_load_factor=one,
            turn=zero,
            equivalent_climb_angle=zero,
            height=np.inf * one,
            idle=zero > 0.0,
            ground_idle=zero > 0.0,
        )


def flight_conditions(motion: Kinematics, course_deg: Array, wind: Wind) -> dict[str, Array]:
    """Speed, altitude, climb angle, load factors, turn and equivalent climb angle, by name, each (N,).

    ``course_deg`` (N,) matters only in wind.
    """
    along, across = wind.along_and_across(course_deg, motion.altitude)
    forward, sideways, up = motion.ground_speed - along, -across, motion.climb_rate
    horizontal = np.hypot(forward, sideways)
    moving = horizontal > SLOWEST
    ahead = np.where(moving, forward / np.where(moving, horizontal, 1.0), 1.0)
    aside = np.where(moving, sideways / np.where(moving, horizontal, 1.0), 0.0)
    # specific force: in the direction of flight, to its right, up
    onward = motion.acceleration * ahead + motion.lateral_acceleration * aside
    right = motion.lateral_acceleration * ahead - motion.acceleration * aside
    upward = motion.vertical_acceleration + GRAVITY
    turning = np.abs(right) <= FASTEST_TURN * horizontal
    drift = np.where(turning, 0.0, right)  # no turn: the rotor's disc tilts sideways
    plane = np.sqrt(onward**2 + upward**2 + drift**2)
    speed = np.hypot(horizontal, up)
    flying = speed > SLOWEST
    own_speed = np.where(flying, speed, 1.0)
    turn_load_factor = np.where(turning, np.hypot(1.0, right / plane), 1.0)
    return {
        "speed": speed,
        "altitude": motion.altitude,
        "climb_angle": np.where(flying, np.arctan2(up, horizontal), 0.0),
        "load_factor": plane / GRAVITY * turn_load_factor,
        "turn_load_factor": turn_load_factor,
        "turn": np.where(turning, np.sign(right), 0.0),
        "equivalent_climb_angle": np.where(
            flying, np.arcsin(np.clip((onward * horizontal + upward * up) / (plane * own_speed), -1.0, 1.0)), 0.0
        ),
    }
