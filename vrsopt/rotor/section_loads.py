"""Loads of blade elements from the velocities they feel, for a section in steady flow."""

from __future__ import annotations

from collections.abc import Callable
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
    pitch: (E, N) rad. drag_level: drag coefficient of the section at zero incidence and low Mach number. The section
    feels the velocity normal to the span; the drag along the span is that of the yawed section. chord [m], (E,).
    """

    def loads(state: Any, common: Any) -> list[Any]:
        U_T, U_P, U_R, pitch = ca.vertsplit(state)
        speed_of_sound, density, level = ca.vertsplit(common)
        U, sine, cosine = flow_angles(U_T, U_P, pitch)
        coefficients = section.coefficients(sine, cosine, U / speed_of_sound, level)
        return list(resolved((U_T, U_P, U_R), U, coefficients, density=density, chord=chord))

    return SectionLoads(*on_grid(loads, [*velocities, pitch], [air.speed_of_sound, air.density, drag_level]))


def flow_angles(U_T: Any, U_P: Any, pitch: Any) -> tuple[Any, Any, Any]:
    """Speed normal to the span, never less than ``SLOWEST``, and sine and cosine of the angle of attack.

    ``U_T`` and ``U_P``: velocities [m/s] against the motion and upward; ``pitch`` [rad].
    """
    U = ca.sqrt(U_T**2 + U_P**2 + SLOWEST**2)
    sine, cosine = ca.sin(pitch), ca.cos(pitch)
    return U, (U_T * sine + U_P * cosine) / U, (U_T * cosine - U_P * sine) / U


def resolved(
    velocities: tuple[Any, Any, Any], U: Any, coefficients: tuple[Any, Any, Any], *, density: Any, chord: float
) -> tuple[Any, Any, Any, Any, Any]:
    """Loads of :class:`SectionLoads` from the coefficients of lift, drag and moment.

    ``velocities`` [m/s], of which ``U`` is normal to the span; ``density`` [kg/m3]; ``chord`` [m].
    """
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


def on_grid(element: Callable[[Any, Any], list[Any]], values: list[Any], common: list[Any]) -> list[Any]:
    """``element(state, common)`` at every point of a grid: values (E, N) each, its results likewise.

    Derivatives go through the full Jacobian of one element, which has few arguments: half the cost of as many
    directions as the trim has unknowns.
    """
    shape = values[0].shape
    points = shape[0] * shape[1]
    state, shared = ca.SX.sym("state", len(values)), ca.SX.sym("common", len(common))
    kernel = ca.Function("element", [state, shared], [ca.vertcat(*element(state, shared))]).map(points)
    states, constants = ca.MX.sym("states", len(values), points), ca.MX.sym("common", len(common), points)
    grid = ca.Function(
        "grid", [states, constants], [kernel(states, constants)], {"jac_penalty": 0, "never_inline": True}
    )
    rows = ca.vertcat(*(ca.reshape(value, 1, points) for value in values))
    results = grid(rows, ca.repmat(ca.vertcat(*common), 1, points))
    return [ca.reshape(row, *shape) for row in ca.vertsplit(results)]
