"""Forces of fuselage and tail surfaces at zero sideslip, body axes (forward, right, down), as CasADi expressions."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from typing import Any

import casadi as ca

from vrsopt.aircraft import Aircraft, Fuselage, Surface
from vrsopt.atmosphere import Air, standard_air
from vrsopt.rotor.airfoil import polynomial, smooth_clip

SEA_LEVEL_DENSITY = standard_air(0.0).density


@dataclass(frozen=True)
class AirframeLoads:
    """Force (3,) [N] and moment about the centre of gravity (3,) [N m] in body axes."""

    force: Any
    moment: Any


def airframe_loads(
    aircraft: Aircraft, *, velocity: tuple[Any, Any], air: Air, downwash: Any, parasite_area: Any
) -> AirframeLoads:
    """Sum of fuselage, extra parasite drag, tailplane and fin.

    velocity: of the aircraft through the air, forward and down [m/s]. downwash: at the tail [m/s], positive down, per
    unit of the surface's downwash factor. parasite_area: of the whole aircraft [m2].
    """
    parts = [
        _fuselage(aircraft.fuselage, velocity, air, parasite_area),
        _tailplane(aircraft.tailplane, velocity, air, downwash),
        _fin(aircraft.fin, velocity, air),
    ]
    return AirframeLoads(sum((p.force for p in parts), ca.DM.zeros(3)), sum((p.moment for p in parts), ca.DM.zeros(3)))


def _fuselage(fuselage: Fuselage, velocity: tuple[Any, Any], air: Air, parasite_area: Any) -> AirframeLoads:
    """Polynomials in the angle of attack, held beyond their validity, and the drag area they leave out.

    The extra drag (hub, skids) acts along the flight path at the centre of gravity.
    """
    u, w = velocity
    speed_squared = u**2 + w**2
    speed = ca.sqrt(speed_squared + 1e-6)
    limit = radians(fuselage.validity)
    alpha = smooth_clip(w / ca.sqrt(u**2 + 1.0), -limit, limit)
    scale = air.density / SEA_LEVEL_DENSITY * speed_squared / fuselage.reference_speed**2
    own_area = -fuselage.force_x[0] / (0.5 * SEA_LEVEL_DENSITY * fuselage.reference_speed**2)
    extra = 0.5 * air.density * (parasite_area - own_area) * speed
    X = scale * polynomial(fuselage.force_x, alpha) - extra * u
    Z = scale * polynomial(fuselage.force_z, alpha) - extra * w
    M = scale * polynomial(fuselage.moment_y, alpha)
    return AirframeLoads(ca.vertcat(X, 0, Z), ca.vertcat(0, M, 0))


def _tailplane(surface: Surface, velocity: tuple[Any, Any], air: Air, downwash: Any) -> AirframeLoads:
    u, w = velocity[0], velocity[1] - surface.downwash_factor * downwash
    lift = _lift(surface, u, w, air)
    speed = ca.sqrt(u**2 + w**2 + 1.0)
    force = ca.vertcat(lift * w / speed, 0, -lift * u / speed)
    return AirframeLoads(force, _cross((-surface.behind_cg, 0, -surface.above_cg), force))


def _fin(surface: Surface, velocity: tuple[Any, Any], air: Air) -> AirframeLoads:
    """At zero sideslip the fin lifts by its incidence, to the right: it unloads the tail rotor."""
    force = ca.vertcat(0, _lift(surface, velocity[0], 0.0, air), 0)
    return AirframeLoads(force, _cross((-surface.behind_cg, 0, -surface.above_cg), force))


def _lift(surface: Surface, forward: Any, normal: Any, air: Air) -> Any:
    """Lift with a smooth largest value: c_l = c_max tanh(a alpha / c_max), alpha from sine and cosine of the flow."""
    q_speed = forward**2 + normal**2
    incidence = radians(surface.incidence)
    alpha = incidence + normal / ca.sqrt(forward**2 + 1.0)
    c_l = surface.largest_lift * ca.tanh(surface.lift_slope * alpha / surface.largest_lift)
    return 0.5 * air.density * q_speed * surface.area * c_l * forward / ca.sqrt(q_speed + 1.0)


def _cross(arm: tuple[float, float, float], force: Any) -> Any:
    return ca.cross(ca.DM(arm), force)
