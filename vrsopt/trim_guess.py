"""Start of a trim from momentum theory and a uniform blade."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi, sqrt

import numpy as np

from vrsopt.aircraft import Aircraft
from vrsopt.atmosphere import GRAVITY, standard_air


def momentum_guess(aircraft: Aircraft, parameters: Mapping[str, float]) -> dict[str, float]:
    """Start of a trim from momentum theory and a uniform blade: inflow, controls, attitude, torque.

    ``parameters``: of the trim, by name, SI units.
    """
    rotor, tail = aircraft.main_rotor, aircraft.tail_rotor
    air = standard_air(parameters["altitude"], parameters["isa_offset"])
    V, Omega = parameters["speed"], parameters["rotor_speed"]
    lateral = V * np.cos(parameters["climb_angle"]) * parameters["turn_rate"] / GRAVITY  # tangent of the bank
    weight = sqrt(1 + lateral**2) * parameters["mass"] * GRAVITY
    tip_speed = Omega * rotor.radius
    mu, sigma = V / tip_speed, rotor.solidity
    C_T = weight / (air.density * pi * rotor.radius**2 * tip_speed**2)
    drag = 0.5 * air.density * V**2 * parameters["parasite_area"]
    climb = (V * np.sin(parameters["climb_angle"]) + parameters["vertical_speed"]) / tip_speed
    tilt = drag / weight + parameters["climb_angle"]
    induced = _glauert(C_T, mu, mu * drag / weight + climb)
    through = induced + mu * drag / weight + climb
    slope = 5.9
    pitch75 = 3 * (2 * C_T / (sigma * slope) + through / 2) / (1 + 1.5 * mu**2) + 0.017
    power = weight * 1.15 * induced * tip_speed + drag * V + weight * climb * tip_speed
    power += sigma * 0.011 / 8 * (1 + 4.6 * mu**2) * air.density * pi * rotor.radius**2 * tip_speed**3
    tail_thrust = max(power, 0.0) / Omega / tail.behind_cg
    tail_tip = Omega * tail.speed_ratio * tail.radius
    tail_C_T = tail_thrust / (air.density * pi * tail.radius**2 * tail_tip**2)
    tail_inflow = _glauert(tail_C_T, V / tail_tip, 0.0)
    tail_sigma = tail.blade_area / (pi * tail.radius**2)
    return {
        "collective": pitch75,
        "longitudinal_cyclic": -0.96 * mu * pitch75 * 2,
        "lateral_cyclic": 0.02,
        "tail_collective": 3 * (2 * tail_C_T / (tail_sigma * slope) + tail_inflow / 2),
        "pitch": np.radians(rotor.shaft_tilt_forward) - tilt + parameters["climb_angle"],
        "roll": float(np.arctan(lateral)) - tail_thrust / weight,
        "tail_inflow": tail_inflow,
        "inflow_cos_0_1": induced / sqrt(3.0),
    }


def _glauert(C_T: float, mu: float, axial: float) -> float:
    """Induced inflow ratio of momentum theory, lambda_i = C_T / (2 sqrt(mu^2 + (lambda_i + axial)^2))."""
    induced = sqrt(max(C_T, 1e-6) / 2)
    for _ in range(60):
        induced = 0.5 * induced + 0.5 * C_T / (2 * sqrt(mu**2 + (induced + axial) ** 2 + 1e-9))
    return induced
