"""Loads of blade elements from the velocities they feel, for a section in steady flow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from vrsopt.atmosphere import Air
from vrsopt.rotor.airfoil import Airfoil

SLOWEST = 2.0  # m/s: keeps the reversed-flow circle regular


@dataclass(frozen=True)
class SectionLoads:
    """Loads per length of the blade, each (E, N): stations by azimuths.

    up, along (the motion of the blade), outward [N/m]; dissipation: power that the section drag takes [W/m]; moment
    about the quarter chord, nose up [N].
    """

    up: Any
    along: Any
    outward: Any
    dissipation: Any
    moment: Any


def blade_loads(
    section: Airfoil, *, chord: float, velocities: tuple[Any, Any, Any], pitch: Any, air: Air, drag_level: Any
) -> SectionLoads:
    """Loads on an (E, N) grid of elements whose section follows its static tables.

    velocities: of the air relative to the element [m/s], (E, N) each: against its motion U_T, upward U_P, outward U_R.
    pitch: (E, N) rad. drag_level: drag coefficient of the section at zero incidence and low Mach number.
    The section feels the velocity normal to the span; the drag along the span is that of the yawed section.
    """
    shape = pitch.shape
    elements = shape[0] * shape[1]
    rows = [ca.reshape(value, 1, elements) for value in (*velocities, pitch)]
    common = ca.repmat(ca.vertcat(air.speed_of_sound, air.density, drag_level), 1, elements)
    loads = _kernel(section, chord).map(elements)(ca.vertcat(*rows), common)
    return SectionLoads(*(ca.reshape(loads[k, :], *shape) for k in range(5)))


def flow_angles(U_T: Any, U_P: Any, pitch: Any) -> tuple[Any, Any, Any]:
    """Speed normal to the span, never less than ``SLOWEST``, and sine and cosine of the angle of attack."""
    U = ca.sqrt(U_T**2 + U_P**2 + SLOWEST**2)
    sine, cosine = ca.sin(pitch), ca.cos(pitch)
    return U, (U_T * sine + U_P * cosine) / U, (U_T * cosine - U_P * sine) / U


def resolved(
    velocities: tuple[Any, Any, Any], U: Any, coefficients: tuple[Any, Any, Any], *, density: Any, chord: float
) -> tuple[Any, Any, Any, Any, Any]:
    """Loads of :class:`SectionLoads` from the coefficients of lift, drag and moment."""
    U_T, U_P, U_R = velocities
    c_l, c_d, c_m = coefficients
    scale = 0.5 * density * chord * U
    return (
        scale * (c_l * U_T + c_d * U_P),
        scale * (c_l * U_P - c_d * U_T),
        scale * c_d * U_R,
        scale * c_d * (U_T**2 + U_P**2 + U_R**2),
        scale * c_m * U * chord,
    )


def _kernel(section: Airfoil, chord: float) -> ca.Function:
    """One element: (U_T, U_P, U_R, pitch), (speed of sound, density, drag level) -> the five loads."""
    state, common = ca.SX.sym("state", 4), ca.SX.sym("common", 3)
    U_T, U_P, U_R, pitch = ca.vertsplit(state)
    speed_of_sound, density, drag_level = ca.vertsplit(common)
    U, sine, cosine = flow_angles(U_T, U_P, pitch)
    coefficients = section.coefficients(sine, cosine, U / speed_of_sound, drag_level)
    loads = resolved((U_T, U_P, U_R), U, coefficients, density=density, chord=chord)
    return ca.Function("element", [state, common], [ca.vertcat(*loads)])
