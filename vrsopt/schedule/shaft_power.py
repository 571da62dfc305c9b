"""Where the shaft power of the engines goes along a flight on the physics.

Every part is counted at the engines' shafts, so that the losses of the gearboxes are with what causes them:

    P = (P_induced + P_profile + P_parasite + P_climb + P_tail + J Omega dOmega/dt + P_rest) / efficiency + P_idle

The rotor's terms are each their own integral over its blades (:attr:`vrsopt.operating_point.OperatingPoint.powers`).
Rest: accessories, structural damping of the blades, and the whole rotor where it turns at flat pitch on the ground.
P_idle is what the engines give at their idle beyond what is asked for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from vrsopt.schedule.physics_node import Engines, NodePhysics, Rotors

OUTPUTS = ("induced_power", "profile_power", "parasite_power", "climb_power", "tail_rotor_power")  # of a trim
PARTS = ("induced", "profile", "parasite", "climb", "tail rotor", "rotor energy", "rest", "engine idle")


@dataclass(frozen=True)
class ShaftPower:
    """Shaft power of all engines by where it goes, before and after each of N nodes.

    ``parts`` (8, N, 2) [W] in the order of PARTS, whose sum is the power; ``fuel_flow`` (N, 2) [kg/s];
    ``turbine_speed`` (N, 2) of the power turbines, over nominal.
    """

    parts: np.ndarray
    fuel_flow: np.ndarray
    turbine_speed: np.ndarray

    @property
    def total(self) -> np.ndarray:
        """Shaft power (N, 2) [W] of all engines."""
        return np.asarray(self.parts.sum(axis=0))


def parts_of(physics: NodePhysics, rotors: Rotors, engines: Engines, rate: float) -> np.ndarray:
    """Parts (8,) [W] of one node, its rotor speed changing at ``rate`` [rad/s2]."""
    drive = physics.machine.aircraft.transmission
    turning = [rotors.trim.outputs[name] if rotors.trim is not None else 0.0 for name in OUTPUTS]
    kinetic = 0.0 if rotors.ground_idle else physics.kinetic_power(rotors, rate)
    asked = drive.engines * drive.power_per_engine(rotors.power + kinetic)
    known = np.array([*turning, kinetic]) / drive.efficiency
    return np.array([*known, asked - known.sum(), drive.engines * engines.power - asked])
