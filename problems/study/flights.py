"""The three missions flown on the surrogate: nominal, and optimised with one or both variables. Made once in a run.

Without the physics, which problems/missions.md has for the trajectories with both variables: there the two differ by a
few hundredths of a per cent of the fuel.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from vrsopt.mission.file import read_mission
from vrsopt.schedule.emissions import Emitted
from vrsopt.schedule.mission_setup import MissionSetup
from vrsopt.schedule.refinement import refined_trajectory
from vrsopt.schedule.refly import Flight

PROBLEMS = Path(__file__).parents[1]
MISSIONS = ("patm", "lem", "sarm")
STRATEGIES: Mapping[str, str] = {"speed": "rotor speed only", "twist": "twist only", "both": "both"}


@dataclass(frozen=True)
class Flown:
    """A flight with its emissions."""

    flight: Flight
    emissions: Emitted

    @property
    def totals(self) -> dict[str, float]:
        """Fuel, CO2 and NOx of the mission, kg."""
        return {"fuel": self.flight.fuel} | {name: self.emissions.total(name) for name in ("co2", "nox")}


@cache
def ready(mission: str) -> MissionSetup:
    """The mission ``patm``, ``lem`` or ``sarm``, or the file of another."""
    return MissionSetup(read_mission(PROBLEMS / f"{mission}.toml" if mission in MISSIONS else Path(mission)))


@cache
def flown(mission: str, strategy: str) -> Flown:
    """The mission with the ``strategy`` "nominal", "speed", "twist" or "both", all from one take-off mass."""
    setup = ready(mission)
    mass = setup.loading.takeoff_mass
    schedule = setup.nominal
    if strategy != "nominal":
        settings = setup.settings.restricted(strategy)
        schedule = refined_trajectory(setup.grid, setup.make, takeoff_mass=mass, settings=settings).schedule
    flight = setup.grid.fly(schedule, takeoff_mass=mass)
    return Flown(flight, setup.grid.emissions(flight))


def change_percent(mission: str, strategy: str) -> dict[str, float]:
    """Change of fuel, CO2 and NOx against the nominal rotor."""
    own, base = flown(mission, strategy).totals, flown(mission, "nominal").totals
    return {name: 100.0 * (own[name] / base[name] - 1.0) for name in own}


def benefit_percent(mission: str) -> tuple[np.ndarray, np.ndarray]:
    """Fuel flow saved with both variables at every node (N,), and the time that each stands for (N,) [s].

    NaN on the ground, where no schedule does anything.
    """
    grid, own, base = ready(mission).grid, flown(mission, "both").flight, flown(mission, "nominal").flight
    step = np.where(np.diff(grid.segment) == 0, np.diff(grid.time), 0.0)
    weight = 0.5 * (np.append(step, 0.0) + np.append(0.0, step))
    saved = 100.0 * (1.0 - own.fuel_flow / base.fuel_flow)
    return np.where(np.asarray(grid.conditions.idle), np.nan, saved), weight
