"""Periodic motion of an elastic rotor blade by harmonic balance.

The modal coordinates of flap, lag and torsion are Fourier series of the azimuth. The equations of motion
(``blade_equations``) are evaluated at the azimuths and projected on the same series (Galerkin). Hub frame: x aft,
y right, z up; psi = 0 aft, counter-clockwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from vrsopt.aircraft import MainRotor
from vrsopt.rotor.blade_equations import BladeEquations, Frame, RootPitch
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.rotor.harmonics import Harmonics


@dataclass(frozen=True)
class Motion:
    """Elastic motion of the blade on the (E, N) grid, without precone, root pitch and twist: m, rad, 1/s.

    flap up, lag positive along the blade's motion (leading), torsion nose up.
    """

    flap: Any
    flap_slope: Any
    flap_rate: Any
    lag: Any
    lag_slope: Any
    lag_rate: Any
    torsion: Any
    torsion_rate: Any


class BladeDynamics:
    """Motion and modal equations of a blade on radial stations ``radius`` with weights ``weight`` (E,), both m."""

    def __init__(self, rotor: MainRotor, fidelity: Fidelity, radius: np.ndarray, weight: np.ndarray) -> None:
        self.rotor, self.radius, self.weight = rotor, radius, weight
        self.harmonics = Harmonics(fidelity.harmonics, fidelity.azimuths)
        self.equations = BladeEquations(rotor, fidelity)
        families = {"flap": self.equations.flap, "lag": self.equations.lag, "torsion": self.equations.torsion}
        self.names = self.equations.names
        usual = {"flap1": 0.3, "flap": 0.05, "lag1": 0.1, "lag": 0.02, "torsion1": 0.03, "torsion": 0.01}
        # m and rad, typical motion
        self.scales = tuple(usual.get(name, usual[name.rstrip("0123456789")]) for name in self.names)
        stiffness = np.concatenate(
            [np.diag(m.elastic + rotor.nominal_rotor_speed**2 * m.centrifugal) for m in families.values()]
        )
        self.equation_scales = tuple(float(x) for x in stiffness * self.scales)  # N and N m
        self._shapes = {family: (modes.at(radius), modes.at(radius, 1)) for family, modes in families.items()}

    def motion(self, q: Any, rotor_speed: Any) -> Motion:
        """Motion for the Fourier coefficients ``q`` (n_modes, n_c) of the modal coordinates."""
        values = self.equations.split(ca.mtimes(q, self.harmonics.values))
        rates = self.equations.split(rotor_speed * ca.mtimes(q, self.harmonics.rates))
        flap, lag, torsion = self._shapes["flap"], self._shapes["lag"], self._shapes["torsion"]
        return Motion(
            flap=ca.mtimes(flap[0], values[0]),
            flap_slope=ca.mtimes(flap[1], values[0]),
            flap_rate=ca.mtimes(flap[0], rates[0]),
            lag=ca.mtimes(lag[0], values[1]),
            lag_slope=ca.mtimes(lag[1], values[1]),
            lag_rate=ca.mtimes(lag[0], rates[1]),
            torsion=ca.mtimes(torsion[0], values[2]),
            torsion_rate=ca.mtimes(torsion[0], rates[2]),
        )

    def residual(
        self,
        q: Any,
        *,
        up: Any,
        along: Any,
        moment: Any,
        root_pitch: Any,
        twist: Any,
        rotor_speed: Any,
        hub_rate: Any,
        specific_force: Any,
    ) -> Any:
        """Residuals (n_modes * n_c,) of the modal equations, mode by mode: generalised forces in N and N m.

        q: (n_modes, n_c). up, along, moment: aerodynamic loads (E, N) per length, N/m, N/m and N, the moment nose-up
        about the quarter chord. root_pitch (1, N): pitch at 3/4 radius, rad. hub_rate: angular velocity of the
        aircraft about the aft, right and up axes, rad/s; specific_force: acceleration minus gravity along them,
        m/s2 ((0, 0, 9.81) at rest).
        """
        basis = self.harmonics
        q_values = ca.mtimes(q, basis.values)
        pitch = ca.mtimes(root_pitch, basis.projection)
        inertial = self.equations.imbalance(
            q_values,
            rotor_speed * ca.mtimes(q, basis.rates),
            rotor_speed**2 * ca.mtimes(q, basis.accelerations),
            pitch=RootPitch(
                root_pitch,
                rotor_speed * ca.mtimes(pitch, basis.rates),
                rotor_speed**2 * ca.mtimes(pitch, basis.accelerations),
            ),
            twist=twist,
            frame=self._frame(rotor_speed, hub_rate, specific_force),
        )
        balance = inertial - self._aerodynamic(q_values, up, along, moment, root_pitch, twist)
        return ca.reshape(ca.mtimes(balance, basis.projection).T, -1, 1)

    def _frame(self, rotor_speed: Any, hub_rate: Any, specific_force: Any) -> Frame:
        azimuth = self.harmonics.azimuth
        cos, sin = ca.DM(np.cos(azimuth)).T, ca.DM(np.sin(azimuth)).T
        return Frame(
            rotor_speed=rotor_speed,
            yaw_rate=hub_rate[2],
            radial_rate=hub_rate[0] * cos + hub_rate[1] * sin,
            tangential_rate=hub_rate[1] * cos - hub_rate[0] * sin,
            force_up=specific_force[2],
            force_along=specific_force[1] * cos - specific_force[0] * sin,
        )

    def _aerodynamic(self, q: Any, up: Any, along: Any, moment: Any, root_pitch: Any, twist: Any) -> Any:
        """Generalised aerodynamic forces (n_modes, N)."""
        flap, lag, torsion = (self._shapes[family][0] for family in ("flap", "lag", "torsion"))
        dr = self.weight[:, None]
        offset = self.rotor.blade.aerodynamic_centre_offset
        if offset:
            outer = self.radius / self.rotor.radius - 0.75
            theta = (
                ca.mtimes(ca.DM.ones(len(outer)), root_pitch)
                - ca.mtimes(twist * outer, ca.DM.ones(1, self.harmonics.count))
                + ca.mtimes(torsion, self.equations.split(q)[2])
            )
            moment = moment + offset * (ca.cos(theta) * up - ca.sin(theta) * along)
        return ca.vertcat(
            ca.mtimes((flap * dr).T, up), ca.mtimes((lag * dr).T, along), ca.mtimes((torsion * dr).T, moment)
        )
