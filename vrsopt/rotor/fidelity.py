"""What of the physics of the main rotor is resolved, and how finely."""

from __future__ import annotations

from dataclasses import dataclass

from vrsopt.errors import InputError

LEAST = {
    "harmonics": 1,
    "stations": 1,
    "flap_modes": 0,
    "lag_modes": 0,
    "torsion_modes": 0,
    "highest_harmonic": 0,
    "highest_shape": 1,
}


@dataclass(frozen=True)
class Fidelity:
    """Resolution and ingredients of the periodic response.

    harmonics, azimuths, stations: of the blade motion, of one revolution and of the blade's aerodynamics.
    highest_harmonic, highest_shape: of the Peters-He inflow. blade_passage: with the inflow's own harmonics of the
    blade-passage frequency, which replace an empirical tip loss. dynamic_stall: Leishman-Beddoes, else the static
    section. chord_recovery: chord force by that recovery factor instead of the section's drag table. Raises
    :class:`InputError` for a count that resolves nothing.
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

    def __post_init__(self) -> None:
        for name, least in LEAST.items():
            if getattr(self, name) < least:
                raise InputError(f"fidelity: {name} = {getattr(self, name)}: at least {least}")
        if self.azimuths <= 2 * self.harmonics:
            allowed = f"above {2 * self.harmonics}, twice the harmonics"
            raise InputError(f"fidelity: azimuths = {self.azimuths}: {allowed}")
        if self.chord_recovery is not None and not 0 < self.chord_recovery <= 1:
            raise InputError(f"fidelity: chord_recovery = {self.chord_recovery:g}: above 0 and at most 1, or None")
