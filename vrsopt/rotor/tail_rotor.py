"""Teetering tail rotor by blade elements; its section stalls and feels Mach number.

The inflow is uniform: the steady state of first-order dynamic inflow, momentum theory with edgewise and axial flow. It
holds for an axial speed from climb to half of the induced velocity against it; no vortex ring. The teeter hinge carries
no moment and the blades are tuned to once per revolution, so the first-harmonic aerodynamic flap moment vanishes. The
pitch-flap coupling adds tan(delta3) of the flap angle to the pitch: negative, the stable sense, takes pitch off a blade
that flaps up (Padfield's sign).

Thrust follows the collective up to the largest blade loading of the aircraft's limit table (its tail-rotor fraction);
beyond it the blades stall and a degree of collective brings about half as much, or less. The yaw margin is therefore
counted in thrust: the share of that largest loading which is left, 1 - ``Limits.tail_usage``.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, radians, tan
from typing import Any

import casadi as ca
import numpy as np

from vrsopt.aircraft import TailRotor
from vrsopt.atmosphere import Air
from vrsopt.rotor.airfoil import Airfoil
from vrsopt.rotor.section_loads import blade_loads

STATIONS, AZIMUTHS = 6, 12


@dataclass(frozen=True)
class TailRotorLoads:
    """Expressions: thrust to the right [N] before fin blockage, drag aft [N], power [W], and the residuals.

    inflow_residual is dimensionless; teeter_residual (2,) is in N m. thrust_over_solidity: the blade loading
    T / (rho A_b (Omega R)^2); advance_ratio: speed along the disc over tip speed.
    """

    thrust: Any
    drag: Any
    power: Any
    inflow_residual: Any
    teeter_residual: Any
    thrust_over_solidity: Any
    advance_ratio: Any


def symmetric_section(section: Airfoil) -> Airfoil:
    """The main rotor's section without camber: lift and drag symmetric, with the break of the upper side."""
    zero = (0.0,)
    return section.replaced(
        zero_lift_sine=zero,
        drag_bucket_sine=zero,
        negative_break_sine=tuple(-c for c in section.break_sine),
        log_negative_break_width=section.log_break_width,
        negative_ramp_sine=tuple(-c for c in section.ramp_sine),
        negative_ramp_slope=section.ramp_slope,
        log_negative_ramp_width=section.log_ramp_width,
    )


def without_stall(section: Airfoil) -> Airfoil:
    """The section with both breaks moved out of reach: attached lift and drag at any angle of attack."""
    never, always = (2.0,), (-2.0,)  # as sines
    return section.replaced(break_sine=never, negative_break_sine=always, ramp_sine=never, negative_ramp_sine=always)


def tail_rotor_loads(
    rotor: TailRotor,
    section: Airfoil,
    *,
    collective: Any,
    inflow: Any,
    teeter: tuple[Any, Any],
    rotor_speed: Any,
    speed: Any,
    air: Air,
    drag_level: Any,
    axial_speed: Any = 0.0,
) -> TailRotorLoads:
    """Loads of the tail rotor.

    inflow: induced velocity over tip speed; teeter: cosine and sine flap angle [rad]; rotor_speed: its own [rad/s];
    speed: of its hub through the air along the disc [m/s]; axial_speed: of its hub through the air to the right, along
    its thrust [m/s], as in a climb: the air comes against the thrust. The inflow residual is momentum theory with both,
    C_T = 2 lambda_i sqrt(mu^2 + (lambda_i + lambda_c)^2). collective [rad]; drag_level: drag coefficient of the section
    at zero incidence.
    """
    points, weights = np.polynomial.legendre.leggauss(STATIONS)
    inner, R = rotor.root_cutout * rotor.radius, rotor.radius
    radius, dr = inner + (points + 1) / 2 * (R - inner), weights / 2 * (R - inner)
    azimuth = 2 * pi * np.arange(AZIMUTHS) / AZIMUTHS
    cos, sin, ones, column = np.cos(azimuth), np.sin(azimuth), np.ones(AZIMUTHS), np.ones(STATIONS)

    flap = teeter[0] * ca.DM(cos).T + teeter[1] * ca.DM(sin).T  # (1, N)
    flap_rate = rotor_speed * (-teeter[0] * ca.DM(sin).T + teeter[1] * ca.DM(cos).T)
    U_T = rotor_speed * ca.mtimes(radius, ones[None]) + ca.mtimes(column, speed * ca.DM(sin).T)
    U_R = ca.mtimes(column, speed * ca.DM(cos).T)
    induced = rotor.induced_power_factor * inflow * rotor_speed * R
    U_P = -induced - axial_speed - ca.mtimes(radius, flap_rate) - U_R * ca.mtimes(column, flap)
    twist = rotor.twist * (radius / R - 0.75)
    pitch = ca.mtimes(column, collective + tan(radians(rotor.delta3)) * flap) - ca.mtimes(twist, ones[None])

    loads = blade_loads(
        section, chord=rotor.chord, velocities=(U_T, U_P, U_R), pitch=pitch, air=air, drag_level=drag_level
    )
    F_z, F_t = loads.up, loads.along
    F_r = loads.outward - F_z * ca.mtimes(column, flap)  # lift is normal to the flapping blade
    share = rotor.blades / AZIMUTHS

    def mean(values: Any, wave: np.ndarray, arm: np.ndarray | None = None) -> Any:
        return share * ca.mtimes([ca.DM(dr if arm is None else dr * arm).T, values, ca.DM(wave)])

    thrust = mean(F_z, ones)
    power = -rotor_speed * mean(F_t, ones, radius)
    drag = mean(F_r, cos) - mean(F_t, sin)
    teeter_residual = ca.vertcat(mean(F_z, cos, radius), mean(F_z, sin, radius))
    tip_speed = rotor_speed * R
    mu, climb = speed / tip_speed, axial_speed / tip_speed
    pressure = air.density * tip_speed**2
    C_T = thrust / (pressure * pi * R**2)
    residual = 2 * inflow * ca.sqrt(mu**2 + (inflow + climb) ** 2 + 1e-6) - C_T
    return TailRotorLoads(thrust, drag, power, residual, teeter_residual, thrust / (pressure * rotor.blade_area), mu)
