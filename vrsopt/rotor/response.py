"""Periodic response and loads of the main rotor by harmonic balance, as CasADi expressions.

The flap displacement of a blade is w(r, psi) = sum_i phi_i(r) q_i(psi), each q_i a Fourier series of N_h harmonics. The
modal equations are projected on the same harmonics at N azimuths (Galerkin), which makes the periodic response a set of
algebraic equations; there is no time marching. Hub frame: x aft, y right, z up; psi = 0 aft, counter-clockwise.

W. Johnson, Rotorcraft Aeromechanics (2013), for the velocities, loads and mean hub reactions used here.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from typing import Any

import casadi as ca
import numpy as np

from vrsopt.aircraft import MainRotor
from vrsopt.atmosphere import GRAVITY, Air
from vrsopt.rotor.airfoil import Airfoil
from vrsopt.rotor.blade import FlapModes, flap_modes
from vrsopt.rotor.inflow import Inflow


@dataclass(frozen=True)
class Discretisation:
    """Resolution of the periodic response; the defaults give power to 0.1 %."""

    harmonics: int = 4
    azimuths: int = 36
    stations: int = 12
    flap_modes: int = 3


@dataclass(frozen=True)
class HubLoads:
    """Mean loads of the rotor on the hub, hub frame, and the power it takes; CasADi expressions.

    force: aft, right, up [N]; moment about the hub: about the aft, right and up axes [N m]; power [W].
    induced_power: work of the lift against the induced velocity [W]. profile_power: drag of the sections times the
    velocity they feel [W]. Shaft power = induced + profile - force . wind, up to the work of structural damping.
    """

    force: Any
    moment: Any
    power: Any
    induced_power: Any
    profile_power: Any


@dataclass(frozen=True)
class Response:
    """Residuals and results of the periodic response as expressions of its unknowns."""

    flap_residual: Any  # (n_modes * n_coefficients,), N (generalised force)
    inflow_residual: Any  # (n_cosine + n_sine,), dimensionless
    loads: HubLoads
    wind: Any  # air velocity relative to the hub, as given
    advance_ratio: Any
    mean_induced: Any  # mean induced velocity seen by the blades over tip speed
    skew: Any  # tan(chi / 2)


class RotorModel:
    """Main rotor with fixed discretisation; builds expressions for any operating state."""

    def __init__(self, rotor: MainRotor, discretisation: Discretisation | None = None) -> None:
        self.rotor = rotor
        self.discretisation = discretisation or Discretisation()
        points, weights = np.polynomial.legendre.leggauss(self.discretisation.stations)
        inner, outer = rotor.root_cutout * rotor.radius, rotor.radius
        self.radius = inner + (points + 1) / 2 * (outer - inner)  # (E,)
        self.weight = weights / 2 * (outer - inner)  # (E,) quadrature weights, m
        self.azimuth = 2 * np.pi * np.arange(self.discretisation.azimuths) / self.discretisation.azimuths  # (N,)
        self.modes: FlapModes = flap_modes(
            rotor.blade, rotor_speed=rotor.nominal_rotor_speed, count=self.discretisation.flap_modes
        )
        self.inflow = Inflow.at(self.radius / rotor.radius)
        harmonic = np.arange(1, self.discretisation.harmonics + 1)
        waves = [np.ones_like(self.azimuth)]
        for k in harmonic:
            waves += [np.cos(k * self.azimuth), np.sin(k * self.azimuth)]
        self.fourier = np.array(waves)  # (n_c, N): 1, cos psi, sin psi, cos 2 psi, ...
        order = np.repeat(harmonic, 2)
        self.order_squared = np.concatenate([[0], order**2])
        self.projection = np.linalg.pinv(self.fourier)  # (N, n_c)
        self.rate = _derivative(harmonic) @ self.fourier  # d(fourier)/d(psi)

    @property
    def coefficient_count(self) -> int:
        """Number of Fourier coefficients of one mode."""
        return len(self.fourier)

    def response(
        self,
        *,
        flap: Any,
        inflow: tuple[Any, Any],
        collective: Any,
        lateral_cyclic: Any,
        longitudinal_cyclic: Any,
        twist: Any,
        rotor_speed: Any,
        wind: Any,
        air: Air,
        induced_power_factor: Any,
        section_drag_level: Any,
    ) -> Response:
        """Expressions of residuals and loads.

        flap: modal coefficients (n_modes, n_coefficients), m. inflow: cosine and sine states. Pitch angles in rad:
        theta = collective + lateral_cyclic cos psi + longitudinal_cyclic sin psi - twist (r/R - 0.75).
        wind: air velocity relative to the hub (aft, right, up), m/s.
        """
        rotor, cos, sin = self.rotor, self.fourier[1], self.fourier[2]
        R, Omega, ones = rotor.radius, rotor_speed, np.ones_like(self.azimuth)
        column = np.ones_like(self.radius)
        phi, phi_r = self.modes.at(self.radius)
        w = ca.mtimes([phi, flap, self.fourier])  # (E, N)
        w_r = ca.mtimes([phi_r, flap, self.fourier]) + radians(rotor.precone)  # slope with precone
        w_t = Omega * ca.mtimes([phi, flap, self.rate])
        height = w + radians(rotor.precone) * ca.mtimes(self.radius, ones[None])

        v = induced_power_factor * Omega * R * self._induced(inflow)
        wind_radial = ca.mtimes(column, ca.DM(cos).T * wind[0] + ca.DM(sin).T * wind[1])
        U_T = Omega * ca.mtimes(self.radius, ones[None]) + ca.mtimes(
            column, ca.DM(sin).T * wind[0] - ca.DM(cos).T * wind[1]
        )
        U_P = wind[2] - v - w_t - wind_radial * w_r
        pitch = ca.mtimes(column, collective + lateral_cyclic * ca.DM(cos).T + longitudinal_cyclic * ca.DM(sin).T)
        pitch -= twist * ca.mtimes(self.radius / R - 0.75, ones[None])

        F_z, F_t, F_r, dissipation = blade_loads(
            rotor.section,
            chord=rotor.chord,
            velocities=(U_T, U_P, wind_radial),
            pitch=pitch,
            air=air,
            drag_level=section_drag_level,
        )
        F_r -= F_z * w_r  # lift is normal to the deflected blade

        C_T_scale = air.density * Omega**2 * R**3
        return Response(
            flap_residual=self._flap_residual(flap, F_z, Omega),
            inflow_residual=self._inflow_residual(inflow, F_z / C_T_scale, wind=wind, tip_speed=Omega * R),
            loads=self._hub_loads((F_z, F_t, F_r, dissipation), height, v, Omega),
            wind=wind,
            advance_ratio=_in_plane(wind) / (Omega * R),
            mean_induced=induced_power_factor * self.inflow.mean_weight * inflow[0][0],
            skew=self._flow(inflow, wind, Omega * R)[2],
        )

    def _induced(self, inflow: tuple[Any, Any]) -> Any:
        """Induced velocity over tip speed (E, N)."""
        cosine = [
            self.inflow.cosine_shapes[:, k : k + 1] @ np.cos(m * self.azimuth)[None]
            for k, (m, _) in enumerate(self.inflow.cosine)
        ]
        sine = [
            self.inflow.sine_shapes[:, k : k + 1] @ np.sin(m * self.azimuth)[None]
            for k, (m, _) in enumerate(self.inflow.sine)
        ]
        basis = ca.DM(np.array([shape.ravel(order="F") for shape in cosine + sine]).T)
        flat = ca.mtimes(basis, ca.vertcat(*inflow))
        return ca.reshape(flat, len(self.radius), len(self.azimuth))

    def _flow(self, inflow: tuple[Any, Any], wind: Any, tip_speed: Any) -> tuple[Any, Any, Any]:
        mean_induced = self.inflow.mean_weight * inflow[0][0]
        through = mean_induced - wind[2] / tip_speed
        return self.inflow.mass_flow(_in_plane(wind) / tip_speed, through, mean_induced)

    def _inflow_residual(self, inflow: tuple[Any, Any], load: Any, *, wind: Any, tip_speed: Any) -> Any:
        """V alpha - L tau / 2 for the cosine and the sine states; ``load`` (E, N) is F_z / (rho Omega^2 R^3)."""
        R, blades = self.rotor.radius, self.rotor.blades
        dr = ca.DM(self.weight / R)
        flow = self._flow(inflow, wind, tip_speed)
        residuals = []
        for states, shapes, wave, values, V, L in (
            (
                self.inflow.cosine,
                self.inflow.cosine_shapes,
                np.cos,
                inflow[0],
                flow[0],
                self.inflow.influence(flow[2])[0],
            ),
            (self.inflow.sine, self.inflow.sine_shapes, np.sin, inflow[1], flow[1], self.inflow.influence(flow[2])[1]),
        ):
            tau = []
            for k, (m, _) in enumerate(states):
                radial = ca.mtimes((dr * ca.DM(shapes[:, k])).T, load)  # (1, N)
                share = (0.5 if m == 0 else 1.0) / np.pi * blades / len(self.azimuth)
                tau.append(share * ca.mtimes(radial, ca.DM(wave(m * self.azimuth))))
            residuals.append(V * values - 0.5 * ca.mtimes(L, ca.vertcat(*tau)))
        return ca.vertcat(*residuals)

    def _flap_residual(self, flap: Any, F_z: Any, Omega: Any) -> Any:
        """M q'' + C q' + (K_b + Omega^2 K_c) q - load, projected on the Fourier functions, mode by mode."""
        modes = self.modes
        phi, _ = modes.at(self.radius)
        load = ca.mtimes(
            [(ca.DM(phi) * ca.DM(self.weight[:, None] * np.ones((1, phi.shape[1])))).T, F_z, self.projection]
        )
        steady = -(Omega**2) * radians(self.rotor.precone) * ca.DM(modes.precone) - GRAVITY * ca.DM(modes.weight)
        load += ca.mtimes(steady, ca.DM([1] + [0] * (self.coefficient_count - 1)).T)
        nominal = modes.frequencies(self.rotor.nominal_rotor_speed)
        damping = 2 * self.rotor.blade.structural_damping * np.diag(nominal * np.diag(modes.mass))
        acceleration = -(Omega**2) * flap * ca.repmat(ca.DM(self.order_squared).T, flap.shape[0], 1)
        velocity = Omega * ca.mtimes(flap, self.rate @ self.projection)
        stiffness = ca.DM(modes.bending) + Omega**2 * ca.DM(modes.centrifugal)
        residual = (
            ca.mtimes(modes.mass, acceleration) + ca.mtimes(damping, velocity) + ca.mtimes(stiffness, flap) - load
        )
        return ca.reshape(residual.T, -1, 1)

    def _hub_loads(self, blade: tuple[Any, Any, Any, Any], w: Any, v: Any, Omega: Any) -> HubLoads:
        """Mean over a revolution of the aerodynamic loads at their deflected positions r e_r + w e_z.

        In steady periodic motion the mean inertial force and moment vanish.
        """
        F_z, F_t, F_r, dissipation = blade
        cos, sin = self.fourier[1], self.fourier[2]
        r = self.radius
        blades_over_azimuths = self.rotor.blades / len(self.azimuth)

        def mean(values: Any, wave: np.ndarray | None = None) -> Any:
            around = ca.mtimes(ca.DM(self.weight).T, values)  # (1, N)
            return blades_over_azimuths * ca.mtimes(around, ca.DM(np.ones_like(cos) if wave is None else wave))

        # e_r = (cos, sin, 0), e_psi = (-sin, cos, 0); F_t acts along e_psi
        force = ca.vertcat(mean(F_r, cos) - mean(F_t, sin), mean(F_r, sin) + mean(F_t, cos), mean(F_z))
        arm = ca.DM(r[:, None] * np.ones((1, len(cos))))
        out_of_plane = arm * F_z - w * F_r  # along -e_psi
        torque = arm * F_t
        moment = ca.vertcat(
            mean(out_of_plane, sin) - mean(w * F_t, cos), -mean(out_of_plane, cos) - mean(w * F_t, sin), mean(torque)
        )
        return HubLoads(force, moment, -moment[2] * Omega, mean(F_z * v), mean(dissipation))


def blade_loads(
    section: Airfoil, *, chord: float, velocities: tuple[Any, Any, Any], pitch: Any, air: Air, drag_level: Any
) -> tuple[Any, Any, Any, Any]:
    """Blade loads per length [N/m] up, along the motion of the blade, and outward, and the power [W/m] its drag takes,
    on an (E, N) grid of elements.

    velocities: of the air relative to the element, (E, N) each: against its motion U_T, upward U_P, outward U_R.
    The section feels the velocity normal to the span; the drag along the span is that of the yawed section.
    """
    U_T, U_P, U_R = velocities
    kernel = _kernel(section)
    shape = U_T.shape
    elements = shape[0] * shape[1]
    rows = [ca.reshape(value, 1, elements) for value in (U_T, U_P, U_R, pitch)]
    common = ca.repmat(ca.vertcat(air.speed_of_sound, 0.5 * air.density * chord, drag_level), 1, elements)
    loads = kernel.map(elements)(ca.vertcat(*rows), common)
    return tuple(ca.reshape(loads[k, :], *shape) for k in range(4))


def _kernel(section: Airfoil) -> ca.Function:
    """One element: (U_T, U_P, U_R, pitch), (speed of sound, rho c / 2, drag level) -> (F_z, F_t, F_r, power)."""
    state, common = ca.SX.sym("state", 4), ca.SX.sym("common", 3)
    U_T, U_P, U_R, theta = ca.vertsplit(state)
    speed_of_sound, half_rho_chord, drag_level = ca.vertsplit(common)
    U = ca.sqrt(U_T**2 + U_P**2 + 4.0)  # 2 m/s keeps the reversed-flow circle regular
    sine = (U_T * ca.sin(theta) + U_P * ca.cos(theta)) / U
    cosine = (U_T * ca.cos(theta) - U_P * ca.sin(theta)) / U
    c_l, c_d = section.coefficients(sine, cosine, U / speed_of_sound, drag_level)
    dissipation = c_d * (U_T**2 + U_P**2 + U_R**2)
    loads = half_rho_chord * U * ca.vertcat(c_l * U_T + c_d * U_P, c_l * U_P - c_d * U_T, c_d * U_R, dissipation)
    return ca.Function("element", [state, common], [loads])


def _in_plane(wind: Any) -> Any:
    return ca.sqrt(wind[0] ** 2 + wind[1] ** 2 + 1e-6)


def _derivative(harmonic: np.ndarray) -> np.ndarray:
    """Matrix D with d(fourier)/d(psi) = D @ fourier."""
    size = 1 + 2 * len(harmonic)
    matrix = np.zeros((size, size))
    for k in harmonic:
        matrix[2 * k - 1, 2 * k], matrix[2 * k, 2 * k - 1] = -k, k
    return matrix
