"""The problem that the trajectory benchmarks share: the air taxi on the shipped surrogate, on meshes of any size."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vrsopt.mission.file import read_mission
from vrsopt.mission.profile import Profile
from vrsopt.schedule.mesh import Mesh
from vrsopt.schedule.mission_setup import MissionSetup

PATM = Path(__file__).parents[2] / "problems" / "patm.toml"


@dataclass(frozen=True)
class Task:
    """Mission with its aircraft on the surrogate, and the mass [kg] it takes off with."""

    setup: MissionSetup
    takeoff_mass: float

    @property
    def profile(self) -> Profile:
        """What is flown."""
        return self.setup.profile


def air_taxi() -> Task:
    """The shipped mission PATM, 43 segments, limits as shipped."""
    setup = MissionSetup(read_mission(PATM))
    return Task(setup, setup.loading.takeoff_mass)


def even_mesh(profile: Profile, count: int) -> Mesh:
    """Mesh of ``count`` intervals, as even as the edges of the segments allow."""
    durations = np.diff(np.asarray(profile.edges))
    pieces = np.ones(len(durations), dtype=int)
    for _ in range(count - len(durations)):
        pieces[np.argmax(durations / pieces)] += 1
    segment = np.repeat(np.arange(len(pieces)), pieces)
    step = np.repeat(durations / pieces, pieces)
    within = np.concatenate([np.arange(n) for n in pieces])
    start = np.repeat(np.asarray(profile.edges)[:-1], pieces) + within * step
    return Mesh(segment, start, step)
