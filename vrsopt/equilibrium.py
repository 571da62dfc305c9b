"""Trim: periodic rotor response, inflow and the six force and moment equations solved together.

Body axes: x forward, y right, z down. Level, climbing, descending and turning flight without sideslip. A turn is
steady and coordinated: the aircraft turns about the vertical with ``turn_rate`` (positive to the right), and feels the
centripetal acceleration, its own rotation and the gyroscopic loads of the rotor.
"""

from __future__ import annotations

from functools import cache, cached_property
from math import pi
from typing import Any

import casadi as ca
import numpy as np

from vrsopt.aircraft import Aircraft
from vrsopt.airframe import AirframeLoads, airframe_loads
from vrsopt.atmosphere import GRAVITY, standard_air
from vrsopt.residual import Named, ResidualSystem, Unknown
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.rotor.response import Response, RotorModel, RotorState
from vrsopt.rotor.tail_rotor import TailRotorLoads, symmetric_section, tail_rotor_loads, without_stall
from vrsopt.trim_guess import momentum_guess

FLIGHT_PARAMETERS = (
    Named("mass", "kg"),
    Named("altitude", "m"),
    Named("isa_offset", "K"),
    Named("speed", "m/s"),
    Named("climb_angle", "rad"),
    Named("vertical_speed", "m/s"),  # upward through the air, beside that of the climb angle: vertical flight
    Named("turn_rate", "rad/s"),
    Named("rotor_speed", "rad/s"),
    Named("twist", "rad"),
    Named("ground_proximity", "-"),  # rotor radius over height of the hub above ground, 0 far away
    Named("cg_shift", "m"),  # of the centre of gravity, forward of where the aircraft's arms are measured from
)
CALIBRATED_PARAMETERS = (
    Named("induced_power_factor", "-"),
    Named("section_drag_level", "-"),
    Named("parasite_area", "m2"),
)
AT_REST = 1e-6  # m/s, below which the speed along the tail rotor's disc is rounded
CONTROLS = (
    Unknown("collective", "rad", 0.1, -0.35, 0.7, 0.15),
    Unknown("lateral_cyclic", "rad", 0.1, -0.35, 0.35),
    Unknown("longitudinal_cyclic", "rad", 0.1, -0.5, 0.35),
    Unknown("tail_collective", "rad", 0.1, -0.6, 0.8, 0.1),
    Unknown("pitch", "rad", 0.1, -0.7, 0.7),
    Unknown("roll", "rad", 0.1, -1.3, 1.3),
    Unknown("tail_inflow", "-", 0.05, -0.3, 0.5, 0.05),
    Unknown("tail_teeter_cos", "rad", 0.05, -0.5, 0.5),
    Unknown("tail_teeter_sin", "rad", 0.05, -0.5, 0.5),
)


def calibrated_constants(aircraft: Aircraft) -> dict[str, float]:
    """The constants that calibration may set, as the aircraft's data file gives them."""
    return {
        "induced_power_factor": aircraft.main_rotor.induced_power_factor,
        "section_drag_level": aircraft.main_rotor.section_drag_level,
        "parasite_area": aircraft.fuselage.parasite_area,
    }


@cache
def rotor_model(aircraft: Aircraft, fidelity: Fidelity) -> RotorModel:
    """The main rotor of ``aircraft``, built once."""
    return RotorModel(aircraft.main_rotor, fidelity)


class TrimEquations:
    """The expressions of one trim system in its unknowns ``x`` and parameters ``p``.

    The properties follow the order of the equations: motion of the aircraft, rotor, tail rotor, airframe, balance.
    """

    def __init__(self, aircraft: Aircraft, fidelity: Fidelity, *, stalling_tail: bool = True) -> None:
        self.aircraft = aircraft
        section = symmetric_section(aircraft.main_rotor.section)
        self.tail_section = section if stalling_tail else without_stall(section)
        self.model = rotor_model(aircraft, fidelity)
        blade, inflow = self.model.blade, self.model.inflow
        count = blade.harmonics.size
        coefficients = [
            Unknown(f"{name}_{k}", "rad" if name.startswith("torsion") else "m", scale)
            for name, scale in zip(blade.names, blade.scales, strict=True)
            for k in range(count)
        ]
        self.unknowns = (*CONTROLS, *coefficients, *(Unknown(name, "-", 0.02) for name in inflow.names))
        self.parameters = (*FLIGHT_PARAMETERS, *CALIBRATED_PARAMETERS)
        self.x = ca.MX.sym("x", len(self.unknowns))
        self.p = ca.MX.sym("p", len(self.parameters))
        value = {u.name: self.x[i] for i, u in enumerate(self.unknowns)}
        self.value = value | {q.name: self.p[i] for i, q in enumerate(self.parameters)}
        self.air = standard_air(self.value["altitude"], self.value["isa_offset"])
        first, last = len(CONTROLS), len(CONTROLS) + len(coefficients)
        self.state = self._rotor_state(ca.reshape(self.x[first:last], count, len(blade.names)).T, self.x[last:])

    @cached_property
    def velocity(self) -> Any:
        """Velocity of the aircraft through the air (3,), body axes [m/s]; no sideslip but that of vertical flight.

        The body angle of attack a follows from sin(climb) = sin(pitch) cos(a) - cos(roll) cos(pitch) sin(a). It has no
        meaning in vertical flight, whose speed is therefore given apart.
        """
        v = self.value
        A, B = ca.sin(v["pitch"]), ca.cos(v["roll"]) * ca.cos(v["pitch"])
        alpha = ca.atan2(A, B) - ca.asin(ca.sin(v["climb_angle"]) / ca.sqrt(A**2 + B**2))
        return v["speed"] * ca.vertcat(ca.cos(alpha), 0, ca.sin(alpha)) - v["vertical_speed"] * self.down

    @cached_property
    def down(self) -> Any:
        """The direction of gravity (3,) in body axes."""
        v = self.value
        return ca.vertcat(
            -ca.sin(v["pitch"]), ca.sin(v["roll"]) * ca.cos(v["pitch"]), ca.cos(v["roll"]) * ca.cos(v["pitch"])
        )

    @property
    def rates(self) -> Any:
        """Angular velocity (3,) in body axes [rad/s] of a steady turn about the vertical."""
        return self.value["turn_rate"] * self.down

    @property
    def acceleration(self) -> Any:
        """Centripetal acceleration (3,) in body axes [m/s2]."""
        return ca.cross(self.rates, self.velocity)

    @cached_property
    def to_body(self) -> Any:
        """Rotation (3, 3) from hub axes (aft, right, up) to body axes."""
        tilt = np.radians(self.aircraft.main_rotor.shaft_tilt_forward)
        c, s = float(np.cos(tilt)), float(np.sin(tilt))
        return ca.DM([[-c, 0, s], [0, 1, 0], [-s, 0, -c]])

    @property
    def hub(self) -> Any:
        """Place of the main rotor's hub from the centre of gravity (3,), body axes [m]."""
        rotor = self.aircraft.main_rotor
        return ca.vertcat(-rotor.hub_aft_of_cg - self.value["cg_shift"], 0, -rotor.hub_height)

    @property
    def tail_hub(self) -> Any:
        """Place of the tail rotor's hub from the centre of gravity (3,), body axes [m]."""
        tail = self.aircraft.tail_rotor
        return ca.vertcat(-tail.behind_cg - self.value["cg_shift"], 0, -tail.above_cg)

    def _rotor_state(self, blade: Any, inflow: Any) -> RotorState:
        v = self.value
        hub_velocity = self.velocity + ca.cross(self.rates, self.hub)
        return RotorState(
            blade=blade,
            inflow=inflow,
            wind=ca.mtimes(self.to_body.T, -hub_velocity),
            hub_rate=ca.mtimes(self.to_body.T, self.rates),
            specific_force=ca.mtimes(self.to_body.T, self.acceleration - GRAVITY * self.down),
            air=self.air,
            **{
                name: v[name]
                for name in (
                    "collective",
                    "lateral_cyclic",
                    "longitudinal_cyclic",
                    "twist",
                    "rotor_speed",
                    "ground_proximity",
                    "induced_power_factor",
                    "section_drag_level",
                )
            },
        )

    @cached_property
    def rotor(self) -> Response:
        """Response of the main rotor."""
        return self.model.response(self.state)

    @cached_property
    def tail_rotor(self) -> TailRotorLoads:
        """Loads of the tail rotor; its disc moves with the rotation of the aircraft."""
        v, tail = self.value, self.aircraft.tail_rotor
        velocity = self.velocity + ca.cross(self.rates, self.tail_hub)
        along = ca.sqrt(self.velocity[0] ** 2 + self.velocity[2] ** 2 + AT_REST**2)
        return tail_rotor_loads(
            tail,
            self.tail_section,
            collective=v["tail_collective"],
            inflow=v["tail_inflow"],
            teeter=(v["tail_teeter_cos"], v["tail_teeter_sin"]),
            rotor_speed=v["rotor_speed"] * tail.speed_ratio,
            speed=along,
            axial_speed=velocity[1],
            air=self.air,
            drag_level=v["section_drag_level"],
        )

    @property
    def tail_force(self) -> Any:
        """Force of the tail rotor (3,), body axes [N], less what the fin takes of its thrust."""
        tail = self.tail_rotor
        return ca.vertcat(-tail.drag, self.aircraft.tail_rotor.fin_blockage * tail.thrust, 0)

    @cached_property
    def airframe(self) -> AirframeLoads:
        """Loads of fuselage and tail surfaces."""
        v, response = self.value, self.rotor
        return airframe_loads(
            self.aircraft,
            velocity=ca.vertsplit(self.velocity),
            rates=ca.vertsplit(self.rates),
            air=self.air,
            downwash=response.mean_induced * v["rotor_speed"] * self.aircraft.main_rotor.radius * response.skew,
            parasite_area=v["parasite_area"],
            cg_shift=v["cg_shift"],
        )

    @property
    def download(self) -> Any:
        """Force of the rotor's wake on the fuselage [N], down; it fades as the wake is swept back."""
        response = self.rotor
        return self.aircraft.main_rotor.download_fraction * response.loads.force[2] * (1 - response.skew) ** 2

    def balance(self) -> Any:
        """Forces [N] and moments about the centre of gravity [N m] less the rates of change of momentum, (6,).

        The blades' inertial loads on the hub are in the momentum of the whole aircraft, and in the angular momentum of
        the main rotor, which a turn has to tilt; that of the tail rotor (2 % of it) is neglected.
        """
        v, aircraft = self.value, self.aircraft
        hub_force = ca.mtimes(self.to_body, self.rotor.loads.force)
        hub_moment = ca.mtimes(self.to_body, self.rotor.loads.moment)
        frame = self.airframe
        aerodynamic = hub_force + frame.force + self.tail_force + ca.vertcat(0, 0, self.download)
        moment = hub_moment + ca.cross(self.hub, hub_force) + frame.moment + ca.cross(self.tail_hub, self.tail_force)
        spin = ca.mtimes(self.to_body, self.rotor.loads.angular_momentum)
        angular_momentum = ca.mtimes(ca.DM(aircraft.loading.inertia.matrix), self.rates) + spin
        return ca.vertcat(
            aerodynamic + v["mass"] * (GRAVITY * self.down - self.acceleration),
            moment - ca.cross(self.rates, angular_momentum),
        )

    def residual(self) -> Any:
        """All residuals, in the order of :meth:`residual_names`."""
        tail, response = self.tail_rotor, self.rotor
        return ca.vertcat(
            self.balance(),
            tail.inflow_residual,
            tail.teeter_residual,
            response.blade_residual,
            response.inflow_residual,
        )

    def residual_names(self) -> tuple[Named, ...]:
        """Name, unit and size of each residual."""
        weight = self.aircraft.loading.reference_mass * GRAVITY
        blade = self.model.blade
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
        names += [
            Named(f"equation of {name}_{k}", "N m" if name.startswith("torsion") else "N", scale)
            for name, scale in zip(blade.names, blade.equation_scales, strict=True)
            for k in range(blade.harmonics.size)
        ]
        return (*names, *(Named(f"equation of {name}", "-", 0.002) for name in self.model.inflow.names))

    def outputs(self) -> dict[str, tuple[str, Any]]:
        """Name, unit and expression of each output."""
        v, rotor, response, tail = self.value, self.aircraft.main_rotor, self.rotor, self.tail_rotor
        tip_speed = v["rotor_speed"] * rotor.radius
        weight = v["mass"] * GRAVITY
        load_factor = ca.sqrt(1 + (v["speed"] * ca.cos(v["climb_angle"]) * v["turn_rate"] / GRAVITY) ** 2)
        thrust = response.loads.force[2]
        ideal = thrust * ca.sqrt(ca.fmax(thrust, 0.0) / (2 * self.air.density * pi * rotor.radius**2))
        climb = weight * (v["speed"] * ca.sin(v["climb_angle"]) + v["vertical_speed"])
        drag = self.airframe.force + self.tail_force + ca.vertcat(0, 0, self.download)
        moment = self.airframe.moment + ca.cross(self.tail_hub, self.tail_force)
        propulsive = ca.dot(response.loads.moment, self.state.hub_rate) - ca.dot(response.loads.force, response.wind)
        return {
            "main_rotor_power": ("W", response.loads.power),
            "tail_rotor_power": ("W", tail.power),
            "induced_power": ("W", response.loads.induced_power),
            "profile_power": ("W", response.loads.profile_power),
            "propulsive_power": ("W", propulsive),
            "parasite_power": ("W", -ca.dot(drag, self.velocity) - ca.dot(moment, self.rates)),
            "climb_power": ("W", climb),
            "thrust": ("N", thrust),
            "hub_roll_moment": ("N m", -response.loads.mast_moment[0]),
            "hub_pitch_moment": ("N m", response.loads.mast_moment[1]),
            "load_factor": ("-", load_factor),
            "blade_loading": ("-", load_factor * weight / (self.air.density * tip_speed**2 * rotor.blade_area)),
            "advance_ratio": ("-", response.advance_ratio),
            "advancing_tip_mach": ("-", tip_speed * (1 + response.advance_ratio) / self.air.speed_of_sound),
            "figure_of_merit": ("-", ideal / response.loads.power),
            "tail_thrust": ("N", tail.thrust),
            "tail_blade_loading": ("-", tail.thrust_over_solidity),
            "tail_advance_ratio": ("-", tail.advance_ratio),
            "mean_induced_velocity": ("m/s", response.mean_induced * tip_speed),
        }

    def system(self, name: str) -> ResidualSystem:
        """The equations with their outputs and the start by momentum theory."""
        outputs = self.outputs()
        return ResidualSystem(
            name=name,
            unknowns=self.unknowns,
            parameters=self.parameters,
            residuals=self.residual_names(),
            outputs=tuple(Named(output, unit) for output, (unit, _) in outputs.items()),
            x=self.x,
            p=self.p,
            r=self.residual(),
            y=ca.vertcat(*[value for _, value in outputs.values()]),
            guess=lambda parameters: momentum_guess(self.aircraft, parameters),
        )


@cache
def trim_system(aircraft: Aircraft, fidelity: Fidelity | None = None, *, stalling_tail: bool = True) -> ResidualSystem:
    """The trim of ``aircraft`` as a :class:`ResidualSystem`.

    With ``stalling_tail=False`` the tail rotor never stalls: such a trim tells how much thrust the tail rotor would
    have to give where the real one can not.

    Parameters: FLIGHT_PARAMETERS and CALIBRATED_PARAMETERS. Outputs: powers [W], thrust [N], hub moments [N m] (roll to
    the right, nose up), load factor, blade loading n m g / (rho A_b (Omega R)^2), advance ratio, Mach number of the
    advancing tip, figure of merit, tail-rotor thrust and loading.
    """
    return TrimEquations(aircraft, fidelity or Fidelity(), stalling_tail=stalling_tail).system("trim")
