"""Periodic response and loads of the main rotor by harmonic balance, as CasADi expressions.

Flap, lag and torsion of a blade are Fourier series of N_h harmonics of their modal coordinates. The modal equations are
projected on the same harmonics at N azimuths (Galerkin), the lags of the unsteady section and of the wake are solved
exactly for periodic motion: the response is a set of algebraic equations and nothing is marched in time. Hub frame: x
aft, y right, z up; psi = 0 aft, counter-clockwise; e_r outward, e_psi along the blade's motion.

W. Johnson, Rotorcraft Aeromechanics (2013), for the velocities, loads and mean hub reactions used here.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from typing import Any

import casadi as ca
import numpy as np

from vrsopt.aircraft import MainRotor
from vrsopt.atmosphere import Air
from vrsopt.rotor.blade_dynamics import BladeDynamics, Motion
from vrsopt.rotor.dynamic_stall import unsteady_blade_loads
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.rotor.ground import ground_factor
from vrsopt.rotor.inflow import Inflow
from vrsopt.rotor.section_loads import SectionLoads, blade_loads


@dataclass(frozen=True)
class RotorState:
    """What the rotor is asked to do; numbers or expressions.

    blade: modal Fourier coefficients (n_modes, n_coefficients); inflow: states (n_inflow,). Pitch angles in rad:
    root pitch = collective + lateral_cyclic cos psi + longitudinal_cyclic sin psi at three quarters of the radius,
    twist positive washout. wind: air velocity relative to the hub (aft, right, up) [m/s]. hub_rate: angular velocity of
    the hub about the same axes [rad/s]. specific_force: acceleration minus gravity of the aircraft's centre of gravity
    [m/s2]. ground_proximity: rotor radius over height of the hub above ground, 0 far from it.
    """

    blade: Any
    inflow: Any
    collective: Any
    lateral_cyclic: Any
    longitudinal_cyclic: Any
    twist: Any
    rotor_speed: Any
    wind: Any
    hub_rate: Any
    specific_force: Any
    ground_proximity: Any
    air: Air
    induced_power_factor: Any
    section_drag_level: Any


@dataclass(frozen=True)
class Elements:
    """What the blade elements feel, (E, N) each: velocities of the air against their motion, upward and outward [m/s],
    pitch [rad], rotation about the span [rad/s] (a coned blade turns about its span too), induced velocity [m/s, down];
    ``root_pitch`` (1, N).

    The directions are those of the deflected blade with slopes w' and v': outward e_r + v' e_psi + w' e_z, along
    e_psi - v' e_r, and up e_z - w' e_r - w' v' e_psi, to second order; loads go back by the same rotation, so that no
    work is lost between them.
    """

    tangential: Any
    upward: Any
    outward: Any
    pitch: Any
    pitch_rate: Any
    induced: Any
    root_pitch: Any
    motion: Motion


@dataclass(frozen=True)
class HubLoads:
    """Mean loads of the rotor on the hub, hub frame, and the power it takes; CasADi expressions.

    force: aft, right, up [N]; moment about the hub: about the aft, right and up axes [N m], both of the air alone.
    mast_moment [N m]: what of it reaches the mast when the rotating hub has turned the angular momentum.
    angular_momentum of the blades [N m s]: along the shaft and, with the disc, tilted from it; a hub that rotates has
    to turn it. power [W] at the shaft. induced_power: work of the lift against the induced velocity [W]. profile_power:
    drag of the sections times the velocity they feel [W]. Shaft power = induced + profile - force . wind + moment .
    hub rate, up to the work of structural damping and of the blade's own pitching.
    """

    force: Any
    moment: Any
    mast_moment: Any
    angular_momentum: Any
    power: Any
    induced_power: Any
    profile_power: Any


@dataclass(frozen=True)
class Response:
    """Residuals and results of the periodic response as expressions of its unknowns."""

    blade_residual: Any  # (n_modes * n_coefficients,), generalised force
    inflow_residual: Any  # (n_inflow,), dimensionless
    loads: HubLoads
    wind: Any  # air velocity relative to the hub, as given
    advance_ratio: Any
    mean_induced: Any  # mean induced velocity seen by the blades over tip speed
    skew: Any  # tan(chi / 2)


class RotorModel:
    """Main rotor with fixed fidelity; builds expressions for any operating state."""

    def __init__(self, rotor: MainRotor, fidelity: Fidelity | None = None) -> None:
        self.rotor = rotor
        self.fidelity = fidelity or Fidelity()
        points, weights = np.polynomial.legendre.leggauss(self.fidelity.stations)
        inner, outer = rotor.root_cutout * rotor.radius, rotor.radius
        self.radius = inner + (points + 1) / 2 * (outer - inner)  # (E,)
        self.weight = weights / 2 * (outer - inner)  # (E,) quadrature weights, m
        self.blade = BladeDynamics(rotor, self.fidelity, self.radius, self.weight)
        self.azimuth = self.blade.harmonics.azimuth
        self.inflow = Inflow.at(
            self.radius / rotor.radius,
            self.weight / rotor.radius,
            self.azimuth,
            blades=rotor.blades,
            highest_harmonic=self.fidelity.highest_harmonic,
            highest_shape=self.fidelity.highest_shape,
            blade_passage=self.fidelity.blade_passage,
        )
        self.cos, self.sin = (ca.DM(wave(self.azimuth)).T for wave in (np.cos, np.sin))  # (1, N)

    def response(self, state: RotorState) -> Response:
        """Expressions of residuals and loads in ``state``."""
        rotor, Omega = self.rotor, state.rotor_speed
        tip_speed = Omega * rotor.radius
        elements = self.elements(state)
        section = self.section_loads(elements, state)
        blade_residual = self.blade.residual(
            state.blade,
            up=section.up,
            along=section.along,
            moment=section.moment,
            root_pitch=elements.root_pitch,
            twist=state.twist,
            rotor_speed=Omega,
            hub_rate=state.hub_rate,
            specific_force=state.specific_force,
        )
        wind = state.wind / tip_speed
        inflow_residual = self.inflow.residual(
            state.inflow,
            section.up / (state.air.density * Omega**2 * rotor.radius**3),
            wind=wind,
            hub_rate=state.hub_rate[:2] / Omega,
            curvature=self.fidelity.wake_curvature,
        )
        return Response(
            blade_residual=blade_residual,
            inflow_residual=inflow_residual,
            loads=self._hub_loads(section, elements, state),
            wind=state.wind,
            advance_ratio=_in_plane(wind),
            mean_induced=self._induced_factor(state) * self.inflow.mean(state.inflow),
            skew=self.inflow.skew(state.inflow, wind),
        )

    def elements(self, state: RotorState) -> Elements:
        """Velocities and pitch of the blade elements on the grid of radii and azimuths."""
        rotor, Omega, cos, sin = self.rotor, state.rotor_speed, self.cos, self.sin
        radius, column = ca.DM(self.radius), ca.DM.ones(len(self.radius))
        motion = self.blade.motion(state.blade, Omega)
        induced = self._induced_factor(state) * Omega * rotor.radius * self.inflow.induced(state.inflow)
        outward = ca.mtimes(column, cos * state.wind[0] + sin * state.wind[1]) + Omega * motion.lag
        tilt = -sin * state.hub_rate[0] + cos * state.hub_rate[1]  # rate of the hub about e_psi (1, N)
        tangential = (
            ca.mtimes((Omega + state.hub_rate[2]) * radius, ca.DM.ones(1, len(self.azimuth)))
            + ca.mtimes(column, sin * state.wind[0] - cos * state.wind[1])
            + motion.lag_rate
        )
        upward = state.wind[2] - induced - motion.flap_rate + ca.mtimes(radius, tilt)
        roll = cos * state.hub_rate[0] + sin * state.hub_rate[1]  # and about e_r
        w_r, v_r = motion.flap_slope + radians(rotor.precone), motion.lag_slope
        root_pitch = state.collective + state.lateral_cyclic * cos + state.longitudinal_cyclic * sin
        pitch_rate = Omega * (state.longitudinal_cyclic * cos - state.lateral_cyclic * sin)
        twist = ca.mtimes(state.twist * (radius / rotor.radius - 0.75), ca.DM.ones(1, len(self.azimuth)))
        return Elements(
            tangential=tangential + v_r * outward,
            upward=upward - w_r * outward + w_r * v_r * tangential,
            outward=outward - v_r * tangential + w_r * upward,
            pitch=ca.mtimes(column, root_pitch) - twist + motion.torsion,
            pitch_rate=ca.mtimes(column, pitch_rate + roll) + motion.torsion_rate + Omega * w_r,
            induced=induced,
            root_pitch=root_pitch,
            motion=motion,
        )

    def section_loads(self, elements: Elements, state: RotorState) -> SectionLoads:
        """Loads of the sections on the grid, with or without their unsteady part."""
        common: dict[str, Any] = {
            "chord": self.rotor.chord,
            "velocities": (elements.tangential, elements.upward, elements.outward),
            "pitch": elements.pitch,
            "air": state.air,
            "drag_level": state.section_drag_level,
        }
        if not self.fidelity.dynamic_stall:
            return blade_loads(self.rotor.section, **common)
        return unsteady_blade_loads(
            self.rotor.section,
            **common,
            pitch_rate=elements.pitch_rate,
            rotor_speed=state.rotor_speed,
            chord_recovery=self.fidelity.chord_recovery,
        )

    def _induced_factor(self, state: RotorState) -> Any:
        """Induced velocity at the blades over that of the mean inflow states: tip loss and ground."""
        advance_ratio = _in_plane(state.wind / (state.rotor_speed * self.rotor.radius))
        near_ground = ground_factor(state.ground_proximity, advance_ratio, self.inflow.mean(state.inflow))
        return state.induced_power_factor * near_ground

    def _hub_loads(self, section: SectionLoads, elements: Elements, state: RotorState) -> HubLoads:
        """Mean over a revolution of the aerodynamic loads at their deflected positions r e_r + v e_psi + h e_z.

        In steady periodic motion the mean inertial force and moment of the blades vanish, but for the angular momentum
        that the hub's own rotation turns: the shaft gives its part about the shaft, the rest is the aircraft's matter.
        """
        motion, precone = elements.motion, radians(self.rotor.precone)
        r = ca.mtimes(ca.DM(self.radius), ca.DM.ones(1, len(self.azimuth)))
        v, h = motion.lag, motion.flap + precone * r
        w_r, v_r = motion.flap_slope + precone, motion.lag_slope
        F_r = section.outward - w_r * section.up - v_r * section.along
        F_t = section.along + v_r * section.outward - w_r * v_r * section.up
        F_z = section.up + w_r * section.outward
        M = section.moment  # about the deflected span
        about_r, about_psi, about_z = v * F_z - h * F_t + M, h * F_r - r * F_z + v_r * M, r * F_t - v * F_r + w_r * M
        cos, sin, ones = self.cos.T, self.sin.T, ca.DM.ones(len(self.azimuth))
        blades_over_azimuths = self.rotor.blades / len(self.azimuth)

        def mean(values: Any, wave: Any = ones) -> Any:
            return blades_over_azimuths * ca.mtimes([ca.DM(self.weight).T, values, wave])

        force = ca.vertcat(mean(F_r, cos) - mean(F_t, sin), mean(F_r, sin) + mean(F_t, cos), mean(F_z))
        moment = ca.vertcat(
            mean(about_r, cos) - mean(about_psi, sin), mean(about_r, sin) + mean(about_psi, cos), mean(about_z)
        )
        angular_momentum = self._angular_momentum(state)
        mast_moment = moment - ca.cross(state.hub_rate, angular_momentum)
        return HubLoads(
            force,
            moment,
            mast_moment,
            angular_momentum,
            power=-mast_moment[2] * state.rotor_speed,
            induced_power=mean(F_z * elements.induced),
            profile_power=mean(section.dissipation),
        )

    def _angular_momentum(self, state: RotorState) -> Any:
        """Mean of r x v dm over all blades (3,), hub frame, to the first order in their flapping."""
        flap, *_ = self.blade.equations.split(state.blade)
        tilt = ca.mtimes(ca.DM(self.blade.equations.flap_moment).T, flap[:, 1:3])
        inertia = ca.vertcat(-tilt[0], -tilt[1], self.rotor.flap_inertia)
        return self.rotor.blades * state.rotor_speed * inertia


def _in_plane(wind: Any) -> Any:
    """Advance ratio from the wind over the tip speed, rounded at zero over 1e-5 of the tip speed."""
    return ca.sqrt(wind[0] ** 2 + wind[1] ** 2 + 1e-10)
