"""What the blades of a trimmed rotor do and feel, over radius and azimuth."""

from __future__ import annotations

from functools import lru_cache
from math import radians

import casadi as ca
import numpy as np
import xarray as xr

from vrsopt.aircraft import Aircraft
from vrsopt.equilibrium import TrimEquations
from vrsopt.errors import InputError
from vrsopt.operating_point import OperatingPoint
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.rotor.section_loads import SLOWEST

UNITS = {
    "angle_of_attack_deg": ("deg", "angle of attack, -180 to 180 in reversed flow"),
    "mach": ("1", "Mach number of the flow normal to the span"),
    "lift_coefficient": ("1", "lift coefficient"),
    "drag_coefficient": ("1", "drag coefficient"),
    "moment_coefficient": ("1", "pitching moment coefficient about the quarter chord"),
    "cl_m2": ("1", "lift coefficient times Mach number squared"),
    "cm_m2": ("1", "moment coefficient times Mach number squared"),
    "lift_n_m": ("N/m", "load normal to the blade"),
    "induced_velocity_m_s": ("m/s", "induced velocity, down"),
    "pitch_deg": ("deg", "pitch of the section, elastic twist included"),
    "flap_m": ("m", "flap deflection, up, precone excluded"),
    "lag_m": ("m", "lag deflection, along the motion of the blade"),
    "torsion_deg": ("deg", "elastic twist, nose up"),
}


def rotor_map(point: OperatingPoint) -> xr.Dataset:
    """Section loads and blade motion of a trimmed point on the grid (radius, azimuth) of the model.

    Coordinates: radius over the rotor's, and azimuth [deg] from aft, counter-clockwise, 360 closing the circle.
    Variables as in ``UNITS``, with their units as attributes. Raises :class:`InputError` for a point without trim.
    """
    if not point.trim.success:
        raise InputError(f"rotor_map: no trim at this point: {point.message}")
    solution, aircraft = point.solution, point.aircraft
    names, fields = _fields(aircraft, Fidelity())
    values = fields(list(solution.values.values()), list(solution.parameters.values()))
    raw = {name: np.asarray(value.full()) for name, value in zip(names, values, strict=True)}
    rotor = aircraft.main_rotor
    columns = {name: np.hstack([grid, grid[:, :1]]) for name, grid in _coefficients(raw, rotor.chord).items()}
    count = raw["up"].shape[1]
    return xr.Dataset(
        {name: (("radius", "azimuth"), columns[name], _attributes(name)) for name in UNITS},
        coords={
            "radius": ("radius", raw["radius"].ravel() / rotor.radius, {"units": "1", "long_name": "radius over R"}),
            "azimuth": ("azimuth", 360.0 / count * np.arange(count + 1), {"units": "deg", "long_name": "azimuth"}),
        },
        attrs={"aircraft": aircraft.name, "root_cutout": rotor.root_cutout},
    )


def _attributes(name: str) -> dict[str, str]:
    unit, words = UNITS[name]
    return {"units": unit, "long_name": words}


def _coefficients(raw: dict[str, np.ndarray], chord: float) -> dict[str, np.ndarray]:
    """Angles and coefficients (E, N) from the velocities and loads of the elements."""
    U_T, U_P, theta = raw["tangential"], raw["upward"], raw["pitch"]
    U_squared = U_T**2 + U_P**2
    U = np.sqrt(U_squared + SLOWEST**2)
    scale = 0.5 * float(raw["density"].item()) * chord * U
    mach = U / float(raw["speed_of_sound"].item())
    lift = (raw["up"] * U_T + raw["along"] * U_P) / (scale * U_squared)
    moment = raw["moment"] / (scale * U * chord)
    sine, cosine = (
        U_T * np.sin(theta) + U_P * np.cos(theta),
        U_T * np.cos(theta) - U_P * np.sin(theta),
    )
    return {
        "angle_of_attack_deg": np.degrees(np.arctan2(sine, cosine)),
        "mach": mach,
        "lift_coefficient": lift,
        "drag_coefficient": (raw["up"] * U_P - raw["along"] * U_T) / (scale * U_squared),
        "moment_coefficient": moment,
        "cl_m2": lift * mach**2,
        "cm_m2": moment * mach**2,
        "lift_n_m": raw["up"],
        "induced_velocity_m_s": raw["induced"],
        "pitch_deg": np.degrees(theta),
        "flap_m": raw["flap"],
        "lag_m": raw["lag"],
        "torsion_deg": np.degrees(raw["torsion"]),
    }


@lru_cache(maxsize=4)
def _fields(aircraft: Aircraft, fidelity: Fidelity) -> tuple[tuple[str, ...], ca.Function]:
    """Names and a CasADi Function (x, p) -> fields of the elements, in the unknowns and parameters of the trim."""
    equations = TrimEquations(aircraft, fidelity)
    model, state = equations.model, equations.state
    elements = model.elements(state)
    loads = model.section_loads(elements, state)
    fields = {
        "tangential": elements.tangential,
        "upward": elements.upward,
        "pitch": elements.pitch,
        "induced": elements.induced,
        "up": loads.up,
        "along": loads.along,
        "moment": loads.moment,
        "flap": elements.motion.flap,
        "lag": elements.motion.lag,
        "torsion": elements.motion.torsion,
        "radius": ca.DM(model.radius),
        "density": state.air.density,
        "speed_of_sound": state.air.speed_of_sound,
    }
    return tuple(fields), ca.Function("fields", [equations.x, equations.p], list(fields.values()))


def retreating_angle(dataset: xr.Dataset) -> float:
    """Largest angle of attack [rad] on the outer half of the retreating side (azimuth 180 to 360 deg)."""
    side = dataset["angle_of_attack_deg"].sel(radius=slice(0.5, None), azimuth=slice(180.0, 360.0))
    return radians(float(side.max()))
