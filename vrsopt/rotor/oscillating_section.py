"""A section that pitches in a steady stream: the loops of its coefficients, by the equations of the rotor blade."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import casadi as ca
import numpy as np

from vrsopt.atmosphere import standard_air
from vrsopt.errors import InputError
from vrsopt.rotor.airfoil import Airfoil
from vrsopt.rotor.dynamic_stall import unsteady_blade_loads
from vrsopt.rotor.section_loads import SLOWEST


@dataclass(frozen=True)
class SectionLoop:
    """Coefficients of a section over one period of pitching about its quarter chord, each (N,).

    phase [rad] of the period, pitch [rad], normal force, chord force (forward), moment about the quarter chord, lift
    and drag.
    """

    phase: np.ndarray
    pitch: np.ndarray
    c_n: np.ndarray
    c_c: np.ndarray
    c_m: np.ndarray
    c_l: np.ndarray
    c_d: np.ndarray


def harmonic_pitch(mean: float, amplitude: float, count: int = 180) -> np.ndarray:
    """mean + amplitude sin(phase) at ``count`` times of one period; rad."""
    return mean + amplitude * np.sin(2 * pi * np.arange(count) / count)


def section_loop(
    section: Airfoil,
    pitch: np.ndarray,
    *,
    mach: float,
    reduced_frequency: float,
    drag_level: float | None = None,
    chord_recovery: float | None = None,
) -> SectionLoop:
    """Loads of a section in a steady stream that repeats the schedule ``pitch`` (N,) [rad], uniform in time.

    reduced_frequency: k = omega c / (2 U) of the whole period. drag_level: the fit's own by default. chord_recovery:
    share of the chord force of attached flow; None: the section's drag. Raises :class:`InputError` when the schedule is
    too short or a number is impossible.
    """
    pitch = np.asarray(pitch, dtype=float)
    if pitch.ndim != 1 or len(pitch) < 8 or not np.all(np.isfinite(pitch)):
        raise InputError(f"section_loop: pitch of shape {pitch.shape}: at least 8 finite angles in a row")
    if not (0 < mach < 1 and reduced_frequency > 0):
        raise InputError(
            f"section_loop: mach = {mach}, reduced_frequency = {reduced_frequency}: between 0 and 1, and positive"
        )
    chord, air, count = 1.0, standard_air(0.0), len(pitch)
    U = mach * air.speed_of_sound
    U_T = float(np.sqrt(U**2 - SLOWEST**2))
    frequency = 2 * reduced_frequency * U / chord  # rad/s
    harmonics = np.fft.rfft(pitch) * 1j * np.arange(count // 2 + 1)
    harmonics[-1] *= count % 2  # the highest one of an even number has no slope at the samples
    loads = unsteady_blade_loads(
        section,
        chord=chord,
        velocities=(ca.MX.ones(1, count) * U_T, ca.MX.zeros(1, count), ca.MX.zeros(1, count)),
        pitch=ca.MX(ca.DM(pitch).T),
        pitch_rate=ca.MX(ca.DM(frequency * np.fft.irfft(harmonics, count)).T),
        rotor_speed=frequency,
        air=air,
        drag_level=section.drag_reference if drag_level is None else drag_level,
        chord_recovery=chord_recovery,
    )
    force, pressure = 0.5 * air.density * U * U_T * chord, 0.5 * air.density * U**2 * chord**2
    values = ca.evalf(ca.vertcat(loads.up / force, -loads.along / force, loads.moment / pressure)).full()
    c_l, c_d, c_m = values
    sine, cosine = np.sin(pitch), np.cos(pitch)
    return SectionLoop(
        phase=2 * pi * np.arange(count) / count,
        pitch=pitch,
        c_n=c_l * cosine + c_d * sine,
        c_c=c_l * sine - c_d * cosine,
        c_m=c_m,
        c_l=c_l,
        c_d=c_d,
    )
