"""Rotors turning on the ground at flat pitch: no thrust, the power is that of the section drag.

Momentum theory has no inflow at zero thrust, so none is modelled: the main rotor's collective is the one at which
inboard and outboard lift cancel, the tail rotor stands at zero pitch.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import casadi as ca

from vrsopt.aircraft import Aircraft
from vrsopt.atmosphere import GRAVITY, standard_air
from vrsopt.errors import NoSolutionError
from vrsopt.residual import Named, ResidualSystem, Unknown
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.rotor.response import RotorModel, RotorState
from vrsopt.rotor.tail_rotor import symmetric_section, tail_rotor_loads


@cache
def flat_pitch_system(aircraft: Aircraft) -> ResidualSystem:
    """Zero thrust in still air: unknowns are collective and steady deflection, outputs the two rotor powers [W].

    Parameters: altitude [m], isa_offset [K], rotor_speed [rad/s], twist [rad].
    """
    rotor = aircraft.main_rotor
    # nothing varies around the azimuth
    model = RotorModel(rotor, Fidelity(harmonics=1, azimuths=4, dynamic_stall=False, wake_curvature=False))
    blade = model.blade
    modes = len(blade.names)
    names = ("altitude", "isa_offset", "rotor_speed", "twist")
    x, p = ca.MX.sym("x", 1 + modes), ca.MX.sym("p", len(names))
    altitude, isa_offset, rotor_speed, twist = ca.vertsplit(p)
    air = standard_air(altitude, isa_offset)
    state = RotorState(
        blade=ca.horzcat(x[1:], ca.MX.zeros(modes, blade.harmonics.size - 1)),
        inflow=ca.MX.zeros(model.inflow.size),
        collective=x[0],
        lateral_cyclic=0.0,
        longitudinal_cyclic=0.0,
        twist=twist,
        rotor_speed=rotor_speed,
        wind=ca.MX.zeros(3),
        hub_rate=ca.MX.zeros(3),
        specific_force=ca.DM([0, 0, GRAVITY]),
        ground_proximity=0.0,
        air=air,
        induced_power_factor=1.0,
        section_drag_level=rotor.section_drag_level,
    )
    response = model.response(state)
    tail: Any = tail_rotor_loads(
        aircraft.tail_rotor,
        symmetric_section(rotor.section),
        collective=0.0,
        inflow=0.0,
        teeter=(0.0, 0.0),
        rotor_speed=rotor_speed * aircraft.tail_rotor.speed_ratio,
        speed=0.0,
        air=air,
        drag_level=rotor.section_drag_level,
    )
    return ResidualSystem(
        name="flat pitch",
        unknowns=(
            Unknown("collective", "rad", 0.1, -0.35, 0.35, 0.0),
            *(
                Unknown(n, "rad" if n.startswith("torsion") else "m", scale)
                for n, scale in zip(blade.names, blade.scales, strict=True)
            ),
        ),
        parameters=(
            Named("altitude", "m"),
            Named("isa_offset", "K"),
            Named("rotor_speed", "rad/s"),
            Named("twist", "rad"),
        ),
        residuals=(
            Named("thrust", "N", aircraft.loading.reference_mass * GRAVITY),
            *(
                Named(f"equation of {n}", "N m" if n.startswith("torsion") else "N", scale)
                for n, scale in zip(blade.names, blade.equation_scales, strict=True)
            ),
        ),
        outputs=(Named("main_rotor_power", "W"), Named("tail_rotor_power", "W")),
        x=x,
        p=p,
        r=ca.vertcat(response.loads.force[2], response.blade_residual[:: blade.harmonics.size]),
        y=ca.vertcat(response.loads.power, tail.power),
    )


def flat_pitch_power(aircraft: Aircraft, *, altitude: float, isa_offset: float = 0.0) -> float:
    """Power of both rotors [W] at flat pitch, nominal rotor speed and twist, at a pressure altitude [m].

    Raises :class:`NoSolutionError` if the collective of zero thrust is not found.
    """
    rotor = aircraft.main_rotor
    place = {"altitude": altitude, "isa_offset": isa_offset}
    state = {"rotor_speed": rotor.nominal_rotor_speed, "twist": rotor.twist}
    solution = flat_pitch_system(aircraft).solve({**place, **state}, method="newton")
    if not solution.success:
        raise NoSolutionError(f"idle at {altitude:g} m: {solution.message}")
    return solution.outputs["main_rotor_power"] + solution.outputs["tail_rotor_power"]
