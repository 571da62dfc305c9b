"""What of the physics of the main rotor is resolved, and how finely."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Fidelity:
    """Resolution and ingredients of the periodic response.

    harmonics, azimuths, stations: of the blade motion, of one revolution and of the blade's aerodynamics.
    highest_harmonic, highest_shape: of the Peters-He inflow. blade_passage: with the inflow's own harmonics of the
    blade-passage frequency, which replace an empirical tip loss. dynamic_stall: Leishman-Beddoes, else the static
    section. chord_recovery: chord force by that recovery factor instead of the section's drag table.
    """

    harmonics: int = 4
    azimuths: int = 36
    stations: int = 12
    flap_modes: int = 3
    lag_modes: int = 2
    torsion_modes: int = 1
    highest_harmonic: int = 3
    highest_shape: int = 5
    blade_passage: bool = False
    wake_curvature: bool = True
    dynamic_stall: bool = True
    chord_recovery: float | None = None
