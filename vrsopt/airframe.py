"""Forces of fuselage and tail surfaces, body axes (forward, right, down), as CasADi expressions.

Every force is zero at rest and has bounded derivatives there: angles enter as sines and cosines, so there is no branch
cut behind the aircraft either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import cos, radians, sin
from typing import Any

import casadi as ca
import numpy as np

from vrsopt.aircraft import Aircraft
from vrsopt.airframe_data import AngleTable, Fuselage, Surface
from vrsopt.atmosphere import Air, standard_air
from vrsopt.rotor.airfoil import logistic, polynomial

SEA_LEVEL_DENSITY = standard_air(0.0).density
STILL = 0.01  # (0.1 m/s)^2: keeps the angle of a vanishing velocity regular
HARMONICS = 10  # of the tables for large angles: within 3 % of their largest value, root mean square
NEAR, FAR = cos(radians(15.0)), cos(radians(25.0))  # polynomials within the first angle, tables beyond the second
STALL_WIDTH = 0.02  # of the hand-over from attached to separated flow, in the cosine of the angle
SATURATION = 8  # exponent of the lift's largest value: 0.05 % off the attached line at half of it

Vector = Sequence[Any]  # forward, right, down


@dataclass(frozen=True)
class AirframeLoads:
    """Force (3,) [N] and moment about the centre of gravity (3,) [N m] in body axes."""

    force: Any
    moment: Any


def airframe_loads(
    aircraft: Aircraft,
    *,
    velocity: Vector,
    air: Air,
    downwash: Any,
    parasite_area: Any,
    rates: Vector = (0.0, 0.0, 0.0),
    cg_shift: Any = 0.0,
) -> AirframeLoads:
    """Sum of fuselage, extra parasite drag, tailplane and fin.

    velocity: of the centre of gravity through the air, forward, right, down [m/s]. rates: roll, pitch and yaw rate
    [rad/s]. downwash: at the tail [m/s], positive down, per unit of the surface's downwash factor. parasite_area:
    of the whole aircraft [m2]. cg_shift: of the centre of gravity before the data's [m]. The fuselage feels the
    velocity of the centre of gravity, the surfaces that of their own place.
    """
    force, moment = ca.DM.zeros(3), ca.DM.zeros(3)
    for part, couple, arm in (
        _fuselage(aircraft.fuselage, velocity, air),
        _extra_drag(aircraft.fuselage, velocity, air, parasite_area),
        _tailplane(aircraft.tailplane, velocity, rates, air, downwash, cg_shift),
        _fin(aircraft.fin, velocity, rates, air, cg_shift),
    ):
        force += part
        moment += couple + ca.cross(ca.vertcat(arm[0] - cg_shift, arm[1], arm[2]), part)
    return AirframeLoads(force, moment)


def local_velocity(velocity: Vector, rates: Vector, arm: Vector) -> Vector:
    """Velocity through the air of a point at ``arm`` from the centre of gravity, V + omega x arm; all in body axes."""
    (u, v, w), (p, q, r), (x, y, z) = velocity, rates, arm
    return u + q * z - r * y, v + r * x - p * z, w + p * y - q * x


def _fuselage(fuselage: Fuselage, velocity: Vector, air: Air) -> tuple[Any, Any, Vector]:
    """Polynomials at small angles, tables at large ones; the pitch plane and the yaw plane each by the velocity in it.

    With V the velocity in the plane: X, Z and M follow angle and dynamic pressure of (u, w), Y and N those of (u, v).
    Acts at the centre of gravity of the data. At 20 deg the tables, which are those of helicopters in general, have
    the polynomials' signs but half of X, one to two times Z and three times Y, and only a fifth of M and a twentieth
    of N: between 15 and 25 deg the blend joins two sources that disagree.
    """
    u, v, w = velocity
    reference = 0.5 * SEA_LEVEL_DENSITY * fuselage.reference_speed**2
    attack, sideslip = _Angle.of(u, w), _Angle.of(u, v)
    plan, side = reference * fuselage.plan_area, reference * fuselage.side_area
    X = plan * attack.blended(fuselage.force_x, plan, fuselage.far_x)
    Z = plan * attack.blended(fuselage.force_z, plan, fuselage.far_z)
    M = plan * fuselage.length * attack.blended(fuselage.moment_y, plan * fuselage.length, fuselage.far_moment_y)
    Y = side * sideslip.blended(fuselage.force_y, side, fuselage.far_y)
    N = side * fuselage.length * sideslip.blended(fuselage.moment_z, side * fuselage.length, fuselage.far_moment_z)
    pitch = 0.5 * air.density * (u**2 + w**2) / reference
    yaw = 0.5 * air.density * (u**2 + v**2) / reference
    return ca.vertcat(pitch * X, yaw * Y, pitch * Z), ca.vertcat(0, pitch * M, yaw * N), (0.0, 0.0, 0.0)


def _extra_drag(fuselage: Fuselage, velocity: Vector, air: Air, parasite_area: Any) -> tuple[Any, Any, Vector]:
    """The drag area that the fuselage alone leaves out (hub, skids), along the flight path."""
    u, v, w = velocity
    own_area = -fuselage.force_x[0] / (0.5 * SEA_LEVEL_DENSITY * fuselage.reference_speed**2)
    factor = -0.5 * air.density * (parasite_area - own_area) * ca.sqrt(u**2 + v**2 + w**2 + STILL)
    return factor * ca.vertcat(u, v, w), ca.DM.zeros(3), (0.0, 0.0, -fuselage.extra_drag_above_cg)


@dataclass(frozen=True)
class _Angle:
    """Sine and cosine of the angle of a flow in a plane of symmetry, and those of its multiples."""

    sine: Any
    cosine: Any

    @classmethod
    def of(cls, forward: Any, across: Any) -> _Angle:
        speed = ca.sqrt(forward**2 + across**2 + STILL)
        return cls(across / speed, forward / speed)

    def blended(self, near: tuple[float, ...], scale: float, far: AngleTable) -> Any:
        """The polynomial ``near`` over ``scale`` within 15 deg, the table beyond 25 deg, between them a blend with
        continuous curvature."""
        step = ca.fmin(ca.fmax((self.cosine - FAR) / (NEAR - FAR), 0.0), 1.0)
        weight = step**3 * (10 - 15 * step + 6 * step**2)
        angle = ca.atan(self.sine / ca.fmax(self.cosine, 0.5))  # the angle wherever the weight is not zero
        return weight * polynomial(near, angle) / scale + (1 - weight) * self._series(far)

    def _series(self, table: AngleTable) -> Any:
        coefficients = series_coefficients(table.angle, table.coefficient)
        cosine, sine = self.cosine, self.sine
        value = float(coefficients[0])
        for k in range(1, HARMONICS + 1):
            value = value + float(coefficients[2 * k - 1]) * cosine + float(coefficients[2 * k]) * sine
            cosine, sine = cosine * self.cosine - sine * self.sine, sine * self.cosine + cosine * self.sine
        return value


@lru_cache(maxsize=64)
def series_coefficients(angle: tuple[float, ...], coefficient: tuple[float, ...]) -> np.ndarray:
    """Least-squares Fourier series (1 + 2 HARMONICS,) of a table over the circle, linear between its angles [deg]:
    constant, cos, sin, cos 2, sin 2, ..."""
    circle = np.arange(-180.0, 180.0, 0.5)
    orders = np.radians(circle)[:, None] * np.arange(1, HARMONICS + 1)
    waves = np.stack([np.cos(orders), np.sin(orders)], axis=2).reshape(len(circle), -1)
    basis = np.column_stack([np.ones(len(circle)), waves])
    return np.asarray(np.linalg.lstsq(basis, np.interp(circle, angle, coefficient), rcond=None)[0])


def _tailplane(
    surface: Surface, velocity: Vector, rates: Vector, air: Air, downwash: Any, cg_shift: Any
) -> tuple[Any, Any, Vector]:
    arm = (-surface.behind_cg, 0.0, -surface.above_cg)
    u, _, w = local_velocity(velocity, rates, (arm[0] - cg_shift, arm[1], arm[2]))
    along, normal = _surface(surface, u, w - surface.downwash_factor * downwash, air)
    return ca.vertcat(along, 0, -normal), ca.DM.zeros(3), arm


def _fin(surface: Surface, velocity: Vector, rates: Vector, air: Air, cg_shift: Any) -> tuple[Any, Any, Vector]:
    """Lifts to the right by its incidence: it unloads the tail rotor."""
    arm = (-surface.behind_cg, 0.0, -surface.above_cg)
    u, v, _ = local_velocity(velocity, rates, (arm[0] - cg_shift, arm[1], arm[2]))
    along, normal = _surface(surface, u, -v, air)
    return ca.vertcat(along, normal, 0), ca.DM.zeros(3), arm


def _surface(surface: Surface, forward: Any, against: Any, air: Air) -> tuple[Any, Any]:
    """Force forward and along the surface's lift at zero incidence [N], over the whole circle.

    forward: its velocity forward; against: its velocity against that lift, so that positive is a positive angle of
    attack [m/s]. Attached: lift slope times the sine of the angle, up to the largest lift, normal to the flow; its
    drag belongs to the parasite area. Separated: the normal force of a plate, proportional to the sine of the angle,
    which is a lift like sin 2 alpha. The hand-over is half-way at 1.7 times the angle of stall.
    """
    speed = ca.sqrt(forward**2 + against**2 + STILL)
    c_i, s_i = cos(radians(surface.incidence)), sin(radians(surface.incidence))
    sine = (against * c_i + forward * s_i) / speed
    cosine = (forward * c_i - against * s_i) / speed
    stall = surface.largest_lift / surface.lift_slope
    attached = logistic((cosine - cos(1.7 * stall)) / STALL_WIDTH)
    ratio = sine / stall
    lift = attached * surface.largest_lift * ratio / (1 + ratio**SATURATION) ** (1 / SATURATION)
    plate = (1 - attached) * surface.plate_normal_force * sine
    pressure_area = 0.5 * air.density * surface.area * speed**2
    return (
        pressure_area * (lift * against / speed - plate * s_i),
        pressure_area * (lift * forward / speed + plate * c_i),
    )
