"""A rotor alone, on a test stand or in a wind tunnel, at given controls: no trim, only the response and the inflow.

For the validation against rotor tests, and for the rotor tests of users.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, hypot, pi, sin, sqrt

import casadi as ca

from vrsopt.aircraft import Blade, MainRotor
from vrsopt.atmosphere import GRAVITY, standard_air
from vrsopt.quantity import validated
from vrsopt.residual import Named, ResidualSystem, Unknown
from vrsopt.rotor.airfoil import Airfoil
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.rotor.response import RotorModel, RotorState

PARAMETERS = (
    Named("collective", "rad"),  # at three quarters of the radius
    Named("lateral_cyclic", "rad"),
    Named("longitudinal_cyclic", "rad"),
    Named("twist", "rad"),
    Named("rotor_speed", "rad/s"),
    Named("speed", "m/s"),
    Named("shaft_angle", "rad"),  # of the shaft aft of the normal to the wind: -pi/2 is an axial climb
    Named("altitude", "m"),
    Named("isa_offset", "K"),
    Named("ground_proximity", "-"),  # rotor radius over height of the hub above ground, 0 far away
    Named("induced_power_factor", "-"),
    Named("section_drag_level", "-"),
)


def conditions(rotor: MainRotor, **given: float) -> dict[str, float]:
    """All parameters of :func:`isolated_system`: the given ones, else hover at sea level at the rotor's nominal speed,
    cyclic pitch zero, with the twist and the section drag level of the rotor and no empirical induced power."""
    return {
        "collective": 0.0,
        "lateral_cyclic": 0.0,
        "longitudinal_cyclic": 0.0,
        "twist": rotor.twist,
        "rotor_speed": rotor.nominal_rotor_speed,
        "speed": 0.0,
        "shaft_angle": 0.0,
        "altitude": 0.0,
        "isa_offset": 0.0,
        "ground_proximity": 0.0,
        "induced_power_factor": 1.0,
        "section_drag_level": rotor.section_drag_level,
    } | given


def stiff_blade(*, root: float, tip: float, mass_per_length: float = 5.0) -> Blade:
    """A uniform blade from ``root`` to ``tip`` [m] that hardly bends or twists, as a model rotor's blade.

    ``mass_per_length`` [kg/m].
    """
    length = tip - root
    bending = 1e5 * mass_per_length * length**4  # first flap frequency 3.52 sqrt(1e5) rad/s
    numbers: dict[str, tuple[str, float | tuple[float, ...]]] = {
        "station": ("m", (root, tip)),
        "mass_per_length": ("kg/m", (mass_per_length,) * 2),
        "bending_stiffness_flap": ("N m2", (bending,) * 2),
        "bending_stiffness_lag": ("N m2", (bending,) * 2),
        "torsional_stiffness": ("N m2", (bending,) * 2),
        "polar_inertia": ("kg m", (1e-3 * mass_per_length * length**2,) * 2),
        "mass_centre_offset": ("m", 0.0),
        "aerodynamic_centre_offset": ("m", 0.0),
        "structural_damping": ("-", 0.01),
        "structural_damping_lag": ("-", 0.01),
    }
    table = {name: {"value": value, "unit": unit, "source": "stiff blade"} for name, (unit, value) in numbers.items()}
    return validated(Blade, table, where="stiff blade")


def isolated_system(rotor: MainRotor, fidelity: Fidelity | None = None) -> ResidualSystem:
    """The response of ``rotor`` at given controls as a :class:`ResidualSystem`; parameters by :func:`conditions`.

    Outputs: thrust [N] along the shaft, power [W] and its induced and profile parts, their coefficients C_T and C_Q by
    the tip speed, blade loading C_T / sigma, figure of merit (of hover), force aft [N], moments of the rotor on the hub
    (roll to the right, nose up) [N m], mean induced velocity [m/s], advance ratio and tip Mach number.
    """
    model = RotorModel(rotor, fidelity or Fidelity())
    blade, inflow = model.blade, model.inflow
    count = blade.harmonics.size
    motion = [
        Unknown(f"{name}_{k}", "rad" if name.startswith("torsion") else "m", scale)
        for name, scale in zip(blade.names, blade.scales, strict=True)
        for k in range(count)
    ]
    equations = [
        Named(f"equation of {name}_{k}", "N m" if name.startswith("torsion") else "N", scale)
        for name, scale in zip(blade.names, blade.equation_scales, strict=True)
        for k in range(count)
    ]
    x, p = ca.MX.sym("x", len(motion) + inflow.size), ca.MX.sym("p", len(PARAMETERS))
    value = {parameter.name: p[k] for k, parameter in enumerate(PARAMETERS)}
    speed, angle = value.pop("speed"), value.pop("shaft_angle")
    air = standard_air(value.pop("altitude"), value.pop("isa_offset"))
    state = RotorState(
        blade=ca.reshape(x[: len(motion)], count, len(blade.names)).T,
        inflow=x[len(motion) :],
        wind=speed * ca.vertcat(ca.cos(angle), 0, ca.sin(angle)),
        hub_rate=ca.DM.zeros(3),
        specific_force=ca.DM([0, 0, GRAVITY]),
        air=air,
        **value,
    )
    response = model.response(state)
    loads, tip_speed, area = response.loads, value["rotor_speed"] * rotor.radius, pi * rotor.radius**2
    thrust, power = loads.force[2], loads.power
    dynamic = air.density * area * tip_speed**2
    outputs = {
        "thrust": ("N", thrust),
        "power": ("W", power),
        "induced_power": ("W", loads.induced_power),
        "profile_power": ("W", loads.profile_power),
        "thrust_coefficient": ("-", thrust / dynamic),
        "torque_coefficient": ("-", power / (dynamic * tip_speed)),
        "blade_loading": ("-", thrust / dynamic / rotor.solidity),
        "figure_of_merit": ("-", ca.fmax(thrust, 0.0) ** 1.5 / ca.sqrt(2 * air.density * area) / power),
        "force_aft": ("N", loads.force[0]),
        "hub_roll_moment": ("N m", -loads.moment[0]),
        "hub_pitch_moment": ("N m", loads.moment[1]),
        "mean_induced_velocity": ("m/s", response.mean_induced * tip_speed),
        "advance_ratio": ("-", response.advance_ratio),
        "tip_mach": ("-", tip_speed / air.speed_of_sound),
    }
    return ResidualSystem(
        name="isolated rotor",
        unknowns=(*motion, *(Unknown(name, "-", 0.02) for name in inflow.names)),
        parameters=PARAMETERS,
        residuals=(*equations, *(Named(f"equation of {name}", "-", 0.002) for name in inflow.names)),
        outputs=tuple(Named(name, unit) for name, (unit, _) in outputs.items()),
        x=x,
        p=p,
        r=ca.vertcat(response.blade_residual, response.inflow_residual),
        y=ca.vertcat(*[expression for _, expression in outputs.values()]),
        guess=lambda given: {"inflow_cos_0_1": _induced(rotor, given) / sqrt(3.0)},
    )


def model_rotor(
    like: MainRotor, section: Airfoil, *, radius: float, chord: float, tip_speed: float, root_cutout: float
) -> MainRotor:
    """Rotor of a hover test: two stiff blades without twist and precone; lengths in m, tip speed in m/s.

    root_cutout: over the radius. Drag level of the section 0.0085, that of NACA 0012 at a Reynolds number of about 2e6.
    What a rotor alone does not need is taken from ``like``. radius and chord [m].
    """
    return like.replaced(
        blades=2,
        radius=radius,
        chord=chord,
        nominal_rotor_speed=tip_speed / radius,
        built_in_twist=0.0,
        root_cutout=root_cutout,
        precone=0.0,
        section=section,
        section_drag_level=0.0085,
        blade=stiff_blade(root=0.1 * radius, tip=radius),
    )


def _induced(rotor: MainRotor, given: Mapping[str, float]) -> float:
    """Induced inflow ratio by momentum theory and a lift slope of 5.9, at least that of a small thrust."""
    tip_speed = given["rotor_speed"] * rotor.radius
    along, up = (given["speed"] * wave(given["shaft_angle"]) / tip_speed for wave in (cos, sin))
    induced = 0.05
    for _ in range(60):
        thrust = rotor.solidity * 2.95 * (given["collective"] * (1 / 3 + along**2 / 2) - (induced - up) / 2)
        induced += (max(thrust, 1e-4) / (2 * hypot(along, induced - up) + 1e-4) - induced) / 4
    return induced
