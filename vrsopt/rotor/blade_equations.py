"""Equations of motion of one elastic rotor blade in modal coordinates, to the second order in its deflections.

Kinematics. The elastic axis, the pitch axis and the quarter-chord line of the undeformed blade are one straight line,
preconed by b. A point of it at radius r moves to the place (R, v, W) along (e_r, e_psi, e_z) of the rotating frame:

    W = b r + w,    R = r - S,    S = 1/2 integral from 0 to r of (v'^2 + W'^2)     (inextensible)

with the flap w (up), the lag v (leading) and their slopes. The section is pitched by theta = root pitch
- twist (r/R_tip - 3/4) + p, p the elastic torsion, nose up; its mass centre lies e ahead of the axis, at
(R - e (v' cos theta + W' sin theta), v + e cos theta, W + e sin theta). The frame turns at (omega_r, omega_t,
Omega + omega_z): the rotor speed and the aircraft's angular velocity; d(omega_r)/dt = Omega omega_t and d(omega_t)/dt
= -Omega omega_r, since a steady angular velocity is seen turning from the blade. f = (f_t, f_z) is the specific force.

Hamilton's principle with the Lagrangian per length, terms to the third order in deflections, hub rates and e (of the
latter without the Coriolis force, a few per mille of the blade's for an e of centimetres),

    m/2 (v_t^2 + w_t^2 + Omega^2 v^2) - Omega^2 m r S + 2 Omega m v S_t + hub rates - m (f_t v + f_z w)
    + m e [W_t (sin theta)_t + v_t (cos theta)_t + Omega^2 (v cos theta - r (v' cos theta + W' sin theta))]
    + I/2 [(theta_t + omega_r)^2 + ((Omega + omega_z) cos theta - omega_t sin theta)^2]
    - 1/2 (EI_flap (w'' cos theta - v'' sin theta)^2 + EI_lag (w'' sin theta + v'' cos theta)^2 + GJ p'^2)

gives, for a virtual flap, lag and torsion, with T = integral of m r and N = integral of m v_t, both from r to the tip,
and D = EI_lag - EI_flap (Omega stands for Omega + omega_z where it is squared):

    flap     m w_tt + (EI_flap w'')'' - Omega^2 (T W')' - 2 Omega (N W')' + [D (w'' sin^2 theta + v'' sin 2theta / 2)]''
             + m (2 Omega omega_r r + 2 omega_r v_t + 2 Omega omega_t v + f_z)
             + m e [(sin theta)_tt + 2 omega_r (cos theta)_t + 2 Omega omega_t cos theta]
             - (m e Omega^2 r sin theta)' = F_z
    lag      m (v_tt - Omega^2 v) + (EI_lag v'')'' - Omega^2 (T v')' - 2 Omega (N v')' - 2 Omega m S_t
             + [D (w'' sin 2theta / 2 - v'' sin^2 theta)]'' + m (f_t - 2 omega_r W_t + omega_r omega_t r)
             + m e [(cos theta)_tt - 2 omega_r (sin theta)_t - Omega^2 cos theta] - (m e Omega^2 r cos theta)' = F_t
    torsion  I [theta_tt + Omega^2 sin 2theta / 2 + Omega omega_t (1 + cos 2theta)] - (GJ p')'
             + D [v'' w'' cos 2theta + (w''^2 - v''^2) sin 2theta / 2]
             + m e {cos theta [w_tt + Omega^2 r W' + 2 Omega omega_r r + f_z]
                    - sin theta [v_tt - Omega^2 v + Omega^2 r v' + f_t]} = M

In order: inertia, bending, centrifugal tension, Coriolis tension, bending coupled by pitch and twist, gyroscopic and
specific forces, mass-centre offset; in the lag equation the Coriolis force of flapping (axial foreshortening S_t); in
torsion the propeller moment. The blade is thin (I is all about the normal of the section); the tension's stiffening of
torsion is left to I and GJ as calibrated.

D. H. Hodges, E. H. Dowell, NASA TN D-7818 (1974); W. Johnson, Rotorcraft Aeromechanics (2013).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from typing import Any

import casadi as ca
import numpy as np
from scipy.linalg import block_diag

from vrsopt.aircraft import MainRotor
from vrsopt.rotor.blade import Beam, Modes
from vrsopt.rotor.fidelity import Fidelity


@dataclass(frozen=True)
class Frame:
    """Motion of the rotating frame at N instants, in SI units.

    rotor_speed: relative to the aircraft; yaw_rate: of the aircraft about the shaft; radial_rate, tangential_rate
    (1, N): of the aircraft about the radius and the direction of blade motion; force_up, force_along (1, N): specific
    force (acceleration minus gravity) along the shaft and along the motion of the blade.
    """

    rotor_speed: Any
    yaw_rate: Any = 0.0
    radial_rate: Any = 0.0
    tangential_rate: Any = 0.0
    force_up: Any = 0.0
    force_along: Any = 0.0


@dataclass(frozen=True)
class RootPitch:
    """Pitch at 3/4 radius that the control system gives, and its time derivatives, at N instants (1, N)."""

    angle: Any
    rate: Any
    acceleration: Any


class BladeEquations:
    """Left-hand sides of the modal equations of a blade; every column of the arguments is one instant."""

    def __init__(self, rotor: MainRotor, fidelity: Fidelity) -> None:
        self.rotor, blade = rotor, rotor.blade
        beam = Beam(blade)
        nominal = rotor.nominal_rotor_speed
        self.flap: Modes = beam.modes("flap", rotor_speed=nominal, count=fidelity.flap_modes)
        self.lag: Modes = beam.modes("lag", rotor_speed=nominal, count=fidelity.lag_modes)
        self.torsion: Modes = beam.modes("torsion", rotor_speed=nominal, count=fidelity.torsion_modes)
        families = (self.flap, self.lag, self.torsion)
        self.names = tuple(
            f"{name}{k + 1}"
            for name, modes in zip(("flap", "lag", "torsion"), families, strict=True)
            for k in range(modes.count)
        )
        self.size = sum(modes.count for modes in families)
        self.mass = block_diag(*(modes.mass for modes in families))
        self.elastic = block_diag(*(modes.elastic for modes in families))
        # the propeller moment depends on the whole pitch and is not part of this matrix
        self.centrifugal = block_diag(self.flap.centrifugal, self.lag.centrifugal, np.zeros_like(self.torsion.mass))
        ratio = np.repeat(
            [blade.structural_damping, blade.structural_damping_lag, blade.structural_damping],
            [modes.count for modes in families],
        )
        frequency = np.concatenate([modes.frequencies(nominal) for modes in families])
        self.damping = np.diag(2 * ratio * frequency * np.diag(self.mass))
        self._integrals(beam)
        self._quadrature(beam)

    def _integrals(self, beam: Beam) -> None:
        """Load vectors of m and m r, and the tensors of the Coriolis terms, by the quadrature of the elements."""
        r, dm = beam.radius, beam.mass_per_length * beam.weight
        phi, psi = self.flap.at(r), self.lag.at(r)
        self.flap_weight, self.flap_moment = phi.T @ dm, phi.T @ (dm * r)
        self.lag_weight, self.lag_moment = psi.T @ dm, psi.T @ (dm * r)
        height = np.column_stack([phi, r])  # flap modes and precone
        self.flap_lag_mass = (height * dm[:, None]).T @ psi  # (n_flap + 1, n_lag)
        flap_slope = np.column_stack([self.flap.at(r, 1), np.ones_like(r)])
        lag_slope = self.lag.at(r, 1)
        # integral of m psi_k times S, as a form in the bending coordinates (flap, precone, lag)
        outboard = beam.outboard @ (beam.mass_per_length[:, None] * psi) * beam.weight[:, None]
        self.coriolis = [
            block_diag((flap_slope * n[:, None]).T @ flap_slope, (lag_slope * n[:, None]).T @ lag_slope)
            for n in outboard.T
        ]

    def _quadrature(self, beam: Beam) -> None:
        """Shapes at the radial points where the pitch is evaluated: Gauss points on every segment of the data."""
        blade = self.rotor.blade
        pieces = []
        for a, b in zip(blade.station[:-1], blade.station[1:], strict=True):
            points, weights = np.polynomial.legendre.leggauss(3 + int((b - a) / (0.12 * self.rotor.radius)))
            pieces.append((a + (points + 1) / 2 * (b - a), weights / 2 * (b - a)))
        r, dr = (np.concatenate(values) for values in zip(*pieces, strict=True))
        self.radius = r
        self.outer = r / self.rotor.radius - 0.75
        difference = np.subtract(blade.bending_stiffness_lag, blade.bending_stiffness_flap)
        self.stiffening = np.interp(r, blade.station, difference) * dr  # (G,), N m3
        self.section_inertia = np.interp(r, blade.station, blade.polar_inertia) * dr  # (G,), kg m2
        self.section_mass = np.interp(r, blade.station, blade.mass_per_length) * dr  # (G,), kg
        self.angle = self.torsion.at(r)
        self.flap_curvature, self.lag_curvature = self.flap.at(r, 2), self.lag.at(r, 2)
        self.flap_shape, self.flap_slope = self.flap.at(r), self.flap.at(r, 1)
        self.lag_shape, self.lag_slope = self.lag.at(r), self.lag.at(r, 1)

    def split(self, values: Any) -> tuple[Any, Any, Any]:
        """Rows of flap, lag and torsion."""
        return tuple(ca.vertsplit(values, [0, self.flap.count, self.flap.count + self.lag.count, self.size]))

    def imbalance(self, q: Any, rate: Any, acceleration: Any, *, pitch: RootPitch, twist: Any, frame: Frame) -> Any:
        """Inertial and structural generalised forces (n, N): zero is free motion, the aerodynamic ones balance them.

        q, rate, acceleration (n, N): modal coordinates in m and rad and their time derivatives.
        """
        square = (frame.rotor_speed + frame.yaw_rate) ** 2
        linear = (
            ca.mtimes(self.mass, acceleration)
            + ca.mtimes(self.damping, rate)
            + ca.mtimes(ca.DM(self.elastic) + square * ca.DM(self.centrifugal), q)
        )
        terms = [self._gyroscopic(q, rate, frame), self._pitch_coupling(q, pitch, twist, frame)]
        if self.rotor.blade.mass_centre_offset:
            terms.append(self._mass_centre(q, rate, acceleration, pitch, twist, frame))
        return linear + sum(terms)

    def _gyroscopic(self, q: Any, rate: Any, frame: Frame) -> Any:
        """Precone, specific force, Coriolis forces and hub rates, on flap and lag."""
        row = ca.DM.ones(1, q.shape[1])
        speed, precone = frame.rotor_speed + frame.yaw_rate, radians(self.rotor.precone)
        radial, tangential = frame.radial_rate * row, frame.tangential_rate * row
        w, v, p = self.split(q)
        w_rate, v_rate, _ = self.split(rate)
        height_rate = ca.vertcat(w_rate, 0 * row)
        bending, bending_rate = ca.vertcat(w, precone * row, v), ca.vertcat(height_rate, v_rate)

        swept = 2 * _rows(radial, v_rate) * v_rate + 2 * frame.rotor_speed * _rows(tangential, v) * v
        load = speed**2 * precone * row + (frame.rotor_speed + speed) * radial  # times m r
        flap = (
            ca.mtimes(self.flap_moment, load)
            + ca.mtimes(self.flap_weight, frame.force_up * row)
            + ca.mtimes(self.flap_lag_mass[:-1], swept)
        )
        lag = (
            ca.mtimes(self.lag_weight, frame.force_along * row)
            + ca.mtimes(self.lag_moment, radial * tangential)
            - 2 * ca.mtimes(self.flap_lag_mass.T, _rows(radial, height_rate) * height_rate)
        )
        for k, form in enumerate(self.coriolis):
            slopes = 2 * speed * ca.mtimes(form, bending)
            tension = slopes * _rows(v_rate[k, :], slopes)
            flap += tension[: self.flap.count, :]
            lag += tension[self.flap.count + 1 :, :]
            lag -= ca.mtimes(self._unit(k), ca.sum1(bending_rate * slopes))
        return ca.vertcat(flap, lag, 0 * p)

    def _unit(self, k: int) -> ca.DM:
        return ca.DM(np.eye(self.lag.count)[:, k])

    def _theta(self, p: Any, pitch: Any, twist: Any) -> Any:
        """Pitch of the sections (G, N)."""
        row, column = ca.DM.ones(1, p.shape[1]), ca.DM.ones(len(self.radius))
        return ca.mtimes(column, pitch) - ca.mtimes(twist * self.outer, row) + ca.mtimes(self.angle, p)

    def coupling_energy(self, q: Any, *, pitch: Any, twist: Any) -> Any:
        """Bending energy (1, N), J, beyond that of the blade at zero pitch: what the pitch couples."""
        w, v, p = self.split(q)
        theta = self._theta(p, pitch, twist)
        w_rr, v_rr = ca.mtimes(self.flap_curvature, w), ca.mtimes(self.lag_curvature, v)
        density = ca.sin(theta) ** 2 * (w_rr**2 - v_rr**2) + ca.sin(2 * theta) * v_rr * w_rr
        return 0.5 * ca.mtimes(ca.DM(self.stiffening).T, density)

    def _pitch_coupling(self, q: Any, pitch: RootPitch, twist: Any, frame: Frame) -> Any:
        """Bending coupled by the pitch (the gradient of ``coupling_energy``), propeller and pitch inertia moments."""
        w, v, p = self.split(q)
        theta = self._theta(p, pitch.angle, twist)
        sine, cosine = 0.5 * ca.sin(2 * theta), ca.cos(2 * theta)
        square = 0.5 * (1 - cosine)
        w_rr, v_rr = ca.mtimes(self.flap_curvature, w), ca.mtimes(self.lag_curvature, v)
        stiff, inertia = self.stiffening[:, None], self.section_inertia[:, None]
        speed, row = frame.rotor_speed + frame.yaw_rate, ca.DM.ones(1, q.shape[1])
        swing = frame.rotor_speed * frame.tangential_rate * row
        flap = ca.mtimes((self.flap_curvature * stiff).T, square * w_rr + sine * v_rr)
        lag = ca.mtimes((self.lag_curvature * stiff).T, sine * w_rr - square * v_rr)
        torsion = (
            ca.mtimes((self.angle * stiff).T, cosine * v_rr * w_rr + sine * (w_rr**2 - v_rr**2))
            + ca.mtimes((self.angle * inertia).T, speed**2 * sine + _rows(swing, cosine) * (1 + cosine))
            + ca.mtimes(self.angle.T @ self.section_inertia, pitch.acceleration)
        )
        return ca.vertcat(flap, lag, torsion)

    def _mass_centre(self, q: Any, rate: Any, acceleration: Any, pitch: RootPitch, twist: Any, frame: Frame) -> Any:
        """Terms of the mass centre's offset."""
        (w, v, p), (_, _, p_rate) = self.split(q), self.split(rate)
        w_tt, v_tt, p_tt = self.split(acceleration)
        column, row = ca.DM.ones(len(self.radius)), ca.DM.ones(1, q.shape[1])
        theta = self._theta(p, pitch.angle, twist)
        theta_t = ca.mtimes(column, pitch.rate) + ca.mtimes(self.angle, p_rate)
        theta_tt = ca.mtimes(column, pitch.acceleration) + ca.mtimes(self.angle, p_tt)
        sine, cosine = ca.sin(theta), ca.cos(theta)
        square = (frame.rotor_speed + frame.yaw_rate) ** 2
        slope = ca.mtimes(self.flap_slope, w) + radians(self.rotor.precone)
        lead_slope, lead = ca.mtimes(self.lag_slope, v), ca.mtimes(self.lag_shape, v)
        arm, inertia = self.radius[:, None], (self.rotor.blade.mass_centre_offset * self.section_mass)[:, None]

        radial = ca.mtimes(column, 2 * frame.radial_rate * row)
        tangential = ca.mtimes(column, 2 * frame.rotor_speed * frame.tangential_rate * row)
        up = cosine * theta_tt - sine * theta_t**2 + tangential * cosine - radial * sine * theta_t
        along = -sine * theta_tt - cosine * theta_t**2 - square * cosine - radial * cosine * theta_t
        flap = ca.mtimes((self.flap_shape * inertia).T, up)
        flap += square * ca.mtimes((self.flap_slope * arm * inertia).T, sine)
        lag = ca.mtimes((self.lag_shape * inertia).T, along)
        lag += square * ca.mtimes((self.lag_slope * arm * inertia).T, cosine)
        along_radius = ca.mtimes(self.radius, row)
        up = ca.mtimes(self.flap_shape, w_tt) + square * along_radius * slope
        up += ca.mtimes(column, frame.force_up * row)
        up += frame.rotor_speed * radial * along_radius
        along = ca.mtimes(self.lag_shape, v_tt) + square * (along_radius * lead_slope - lead)
        along += ca.mtimes(column, frame.force_along * row)
        torsion = ca.mtimes((self.angle * inertia).T, cosine * up - sine * along)
        return ca.vertcat(flap, lag, torsion)


def _rows(row: Any, like: Any) -> Any:
    """The row (1, N) as often as ``like`` has rows."""
    return ca.repmat(row, like.shape[0], 1)
