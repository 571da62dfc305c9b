"""Trim: periodic rotor response, inflow and the six force and moment equations solved together.

Body axes: x forward, y right, z down. Level, climbing or descending flight without sideslip. A turn is flown as its
load factor: it multiplies the weight; hub rates are not modelled. The ground is far away.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from math import pi, sqrt
from typing import Any

import casadi as ca
import numpy as np

from vrsopt.aircraft import Aircraft
from vrsopt.airframe import airframe_loads
from vrsopt.atmosphere import GRAVITY, standard_air
from vrsopt.residual import Named, ResidualSystem, Unknown
from vrsopt.rotor.response import Discretisation, Response, RotorModel
from vrsopt.rotor.tail_rotor import TailRotorLoads, symmetric_section, tail_rotor_loads, without_stall

FLIGHT_PARAMETERS = (
    Named("mass", "kg"),
    Named("altitude", "m"),
    Named("isa_offset", "K"),
    Named("speed", "m/s"),
    Named("climb_angle", "rad"),
    Named("load_factor", "-"),
    Named("rotor_speed", "rad/s"),
    Named("twist", "rad"),
)
CALIBRATED_PARAMETERS = (
    Named("induced_power_factor", "-"),
    Named("section_drag_level", "-"),
    Named("parasite_area", "m2"),
)
CONTROLS = (
    Unknown("collective", "rad", 0.1, -0.35, 0.7, 0.15),
    Unknown("lateral_cyclic", "rad", 0.1, -0.35, 0.35),
    Unknown("longitudinal_cyclic", "rad", 0.1, -0.5, 0.35),
    Unknown("tail_collective", "rad", 0.1, -0.6, 0.8, 0.1),
    Unknown("pitch", "rad", 0.1, -0.7, 0.7),
    Unknown("roll", "rad", 0.1, -0.7, 0.7),
    Unknown("tail_inflow", "-", 0.05, -0.3, 0.5, 0.05),
    Unknown("tail_teeter_cos", "rad", 0.05, -0.5, 0.5),
    Unknown("tail_teeter_sin", "rad", 0.05, -0.5, 0.5),
)
FLAP_SCALE = (0.3, 0.05, 0.05)  # m, typical size of the modal coordinates


def calibrated_constants(aircraft: Aircraft) -> dict[str, float]:
    """The constants that calibration may set, as the aircraft's data file gives them."""
    return {
        "induced_power_factor": aircraft.main_rotor.induced_power_factor,
        "section_drag_level": aircraft.main_rotor.section_drag_level,
        "parasite_area": aircraft.fuselage.parasite_area,
    }


class _Builder:
    """Collects the expressions of one trim system; the methods follow the order of the equations."""

    def __init__(self, aircraft: Aircraft, discretisation: Discretisation, stalling_tail: bool) -> None:
        self.aircraft = aircraft
        section = symmetric_section(aircraft.main_rotor.section)
        self.tail_section = section if stalling_tail else without_stall(section)
        self.model = RotorModel(aircraft.main_rotor, discretisation)
        count, modes = self.model.coefficient_count, discretisation.flap_modes
        n_cos, n_sin = len(self.model.inflow.cosine), len(self.model.inflow.sine)
        names = [f"flap{i + 1}_{k}" for i in range(modes) for k in range(count)]
        self.unknowns = (
            *CONTROLS,
            *(Unknown(name, "m", FLAP_SCALE[min(i // count, 2)]) for i, name in enumerate(names)),
            *(Unknown(f"inflow_cos_{m}_{n}", "-", 0.02) for m, n in self.model.inflow.cosine),
            *(Unknown(f"inflow_sin_{m}_{n}", "-", 0.02) for m, n in self.model.inflow.sine),
        )
        self.parameters = (*FLIGHT_PARAMETERS, *CALIBRATED_PARAMETERS)
        self.x = ca.MX.sym("x", len(self.unknowns))
        self.p = ca.MX.sym("p", len(self.parameters))
        self.value = {u.name: self.x[i] for i, u in enumerate(self.unknowns)}
        self.value |= {q.name: self.p[i] for i, q in enumerate(self.parameters)}
        first = len(CONTROLS)
        self.flap = ca.reshape(self.x[first : first + modes * count], count, modes).T
        rest = self.x[first + modes * count :]
        self.inflow = (rest[:n_cos], rest[n_cos : n_cos + n_sin])
        self.air = standard_air(self.value["altitude"], self.value["isa_offset"])

    def velocity(self) -> tuple[Any, Any]:
        """Velocity of the aircraft through the air, forward and down; no sideslip.

        The body angle of attack a follows from sin(climb) = sin(pitch) cos(a) - cos(roll) cos(pitch) sin(a).
        """
        v = self.value
        A, B = ca.sin(v["pitch"]), ca.cos(v["roll"]) * ca.cos(v["pitch"])
        alpha = ca.atan2(A, B) - ca.asin(ca.sin(v["climb_angle"]) / ca.sqrt(A**2 + B**2))
        return v["speed"] * ca.cos(alpha), v["speed"] * ca.sin(alpha)

    def rotor(self, velocity: tuple[Any, Any]) -> tuple[Response, Any]:
        """Response of the main rotor, and the rotation (3, 3) from hub axes (aft, right, up) to body axes."""
        v = self.value
        tilt = np.radians(self.aircraft.main_rotor.shaft_tilt_forward)
        c, s = float(np.cos(tilt)), float(np.sin(tilt))
        to_body = ca.DM([[-c, 0, s], [0, 1, 0], [-s, 0, -c]])
        wind = ca.mtimes(to_body.T, -ca.vertcat(velocity[0], 0, velocity[1]))
        response = self.model.response(
            flap=self.flap,
            inflow=self.inflow,
            collective=v["collective"],
            lateral_cyclic=v["lateral_cyclic"],
            longitudinal_cyclic=v["longitudinal_cyclic"],
            twist=v["twist"],
            rotor_speed=v["rotor_speed"],
            wind=wind,
            air=self.air,
            induced_power_factor=v["induced_power_factor"],
            section_drag_level=v["section_drag_level"],
        )
        return response, to_body

    def tail_rotor(self) -> TailRotorLoads:
        v, tail = self.value, self.aircraft.tail_rotor
        return tail_rotor_loads(
            tail,
            self.tail_section,
            collective=v["tail_collective"],
            inflow=v["tail_inflow"],
            teeter=(v["tail_teeter_cos"], v["tail_teeter_sin"]),
            rotor_speed=v["rotor_speed"] * tail.speed_ratio,
            speed=v["speed"],
            air=self.air,
            drag_level=v["section_drag_level"],
        )

    def balance(self, velocity: tuple[Any, Any], response: Response, to_body: Any, tail: TailRotorLoads) -> Any:
        """Sum of forces [N] and moments about the centre of gravity [N m], (6,)."""
        v, aircraft, rotor = self.value, self.aircraft, self.aircraft.main_rotor
        tip_speed = v["rotor_speed"] * rotor.radius
        hub_force = ca.mtimes(to_body, response.loads.force)
        hub_moment = ca.mtimes(to_body, response.loads.moment)
        hub = ca.DM([-rotor.hub_aft_of_cg, 0, -rotor.hub_height])
        frame = airframe_loads(
            aircraft,
            velocity=velocity,
            air=self.air,
            downwash=response.mean_induced * tip_speed * response.skew,
            parasite_area=v["parasite_area"],
        )
        tail_force = ca.vertcat(-tail.drag, aircraft.tail_rotor.fin_blockage * tail.thrust, 0)
        tail_arm = ca.DM([-aircraft.tail_rotor.behind_cg, 0, -aircraft.tail_rotor.above_cg])
        download = rotor.download_fraction * response.loads.force[2] * (1 - response.skew) ** 2
        weight = v["load_factor"] * v["mass"] * GRAVITY
        gravity = weight * ca.vertcat(
            -ca.sin(v["pitch"]), ca.sin(v["roll"]) * ca.cos(v["pitch"]), ca.cos(v["roll"]) * ca.cos(v["pitch"])
        )
        force = hub_force + frame.force + tail_force + gravity + ca.vertcat(0, 0, download)
        moment = hub_moment + ca.cross(hub, hub_force) + frame.moment + ca.cross(tail_arm, tail_force)
        return ca.vertcat(force, moment)

    def outputs(self, response: Response, tail: TailRotorLoads) -> dict[str, tuple[str, Any]]:
        v, rotor = self.value, self.aircraft.main_rotor
        tip_speed = v["rotor_speed"] * rotor.radius
        pressure_area = self.air.density * tip_speed**2 * rotor.blade_area
        weight = v["load_factor"] * v["mass"] * GRAVITY
        thrust = response.loads.force[2]
        ideal = thrust * ca.sqrt(ca.fmax(thrust, 0.0) / (2 * self.air.density * pi * rotor.radius**2))
        return {
            "main_rotor_power": ("W", response.loads.power),
            "tail_rotor_power": ("W", tail.power),
            "induced_power": ("W", response.loads.induced_power),
            "profile_power": ("W", response.loads.profile_power),
            "propulsive_power": ("W", -ca.dot(response.loads.force, response.wind)),
            "thrust": ("N", thrust),
            "blade_loading": ("-", weight / pressure_area),
            "advance_ratio": ("-", response.advance_ratio),
            "figure_of_merit": ("-", ideal / response.loads.power),
            "tail_thrust": ("N", tail.thrust),
            "tail_blade_loading": ("-", tail.thrust_over_solidity),
            "tail_advance_ratio": ("-", tail.advance_ratio),
            "mean_induced_velocity": ("m/s", response.mean_induced * tip_speed),
        }


@cache
def trim_system(
    aircraft: Aircraft, discretisation: Discretisation | None = None, *, stalling_tail: bool = True
) -> ResidualSystem:
    """The trim of ``aircraft`` as a :class:`ResidualSystem`.

    With ``stalling_tail=False`` the tail rotor never stalls: such a trim tells how much thrust the tail rotor would
    have to give where the real one can not.

    Parameters: FLIGHT_PARAMETERS and CALIBRATED_PARAMETERS. Outputs: powers [W], thrust [N], blade loading
    n m g / (rho A_b (Omega R)^2), advance ratio, figure of merit, tail-rotor thrust and loading.
    """
    builder = _Builder(aircraft, discretisation or Discretisation(), stalling_tail)
    velocity = builder.velocity()
    response, to_body = builder.rotor(velocity)
    tail = builder.tail_rotor()
    residual = ca.vertcat(
        builder.balance(velocity, response, to_body, tail),
        tail.inflow_residual,
        tail.teeter_residual,
        response.flap_residual,
        response.inflow_residual,
    )
    outputs = builder.outputs(response, tail)
    return ResidualSystem(
        name="trim",
        unknowns=builder.unknowns,
        parameters=builder.parameters,
        residuals=_residual_names(aircraft, builder),
        outputs=tuple(Named(name, unit) for name, (unit, _) in outputs.items()),
        x=builder.x,
        p=builder.p,
        r=residual,
        y=ca.vertcat(*[value for _, value in outputs.values()]),
        guess=lambda parameters: momentum_guess(aircraft, parameters),
    )


def _residual_names(aircraft: Aircraft, builder: _Builder) -> tuple[Named, ...]:
    rotor = aircraft.main_rotor
    weight = aircraft.loading.reference_mass * GRAVITY
    load = 0.1 * rotor.nominal_rotor_speed**2 * rotor.radius**2  # N: 0.1 m modal mass at the tip's acceleration
    names = [
        Named("force x", "N", weight / 10),
        Named("force y", "N", weight / 10),
        Named("force z", "N", weight),
        Named("moment roll", "N m", weight / 5),
        Named("moment pitch", "N m", weight / 5),
        Named("moment yaw", "N m", weight / 5),
        Named("tail inflow", "-", 0.005),
        Named("tail teeter cos", "N m", 200.0),
        Named("tail teeter sin", "N m", 200.0),
    ]
    flap = [u for u in builder.unknowns if u.name.startswith("flap")]
    inflow = [u for u in builder.unknowns if u.name.startswith("inflow")]
    names += [Named(f"equation of {u.name}", "N", load) for u in flap]
    names += [Named(f"equation of {u.name}", "-", 0.002) for u in inflow]
    return tuple(names)


def momentum_guess(aircraft: Aircraft, parameters: Mapping[str, float]) -> dict[str, float]:
    """Start of a trim from momentum theory and a uniform blade: inflow, controls, attitude, torque."""
    rotor, tail = aircraft.main_rotor, aircraft.tail_rotor
    air = standard_air(parameters["altitude"], parameters["isa_offset"])
    V, Omega = parameters["speed"], parameters["rotor_speed"]
    weight = parameters["load_factor"] * parameters["mass"] * GRAVITY
    tip_speed = Omega * rotor.radius
    mu, sigma = V / tip_speed, rotor.solidity
    C_T = weight / (air.density * pi * rotor.radius**2 * tip_speed**2)
    drag = 0.5 * air.density * V**2 * parameters["parasite_area"]
    climb = V * np.sin(parameters["climb_angle"]) / tip_speed
    tilt = drag / weight + parameters["climb_angle"]
    induced = _glauert(C_T, mu, mu * drag / weight + climb)
    through = induced + mu * drag / weight + climb
    slope = 5.9
    pitch75 = 3 * (2 * C_T / (sigma * slope) + through / 2) / (1 + 1.5 * mu**2) + 0.017
    power = weight * 1.15 * induced * tip_speed + drag * V + weight * V * np.sin(parameters["climb_angle"])
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
        "roll": -tail_thrust / weight,
        "tail_inflow": tail_inflow,
        "inflow_cos_0_1": induced / sqrt(3.0),
    }


def _glauert(C_T: float, mu: float, axial: float) -> float:
    """Induced inflow ratio of momentum theory, lambda_i = C_T / (2 sqrt(mu^2 + (lambda_i + axial)^2))."""
    induced = sqrt(max(C_T, 1e-6) / 2)
    for _ in range(60):
        induced = 0.5 * induced + 0.5 * C_T / (2 * sqrt(mu**2 + (induced + axial) ** 2 + 1e-9))
    return induced
