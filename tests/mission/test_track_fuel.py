"""The fuel of a mission from a noisy record of its flight."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.mission.noisy_track import TYPICAL, record, write_gpx
from vrsopt.helicopter import helicopter
from vrsopt.limits import Limits
from vrsopt.mission.file import read_mission
from vrsopt.mission.profile import Profile
from vrsopt.mission.track import track_mission
from vrsopt.schedule.nominal import nominal_schedule
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.study_input import loaded
from vrsopt.schedule.surrogate_path import SurrogateAircraft

LEM = Path(__file__).parents[2] / "problems" / "lem.toml"
MASS = 2098.4  # kg, with which LEM lands with its reserve


def fuel(profile: Profile) -> float:
    """Fuel [kg] of the nominal schedule."""
    machine = helicopter("bo105")
    limits = Limits(machine.aircraft, machine.engine)
    grid = FlightGrid(profile, SurrogateAircraft(loaded(None, machine.data_hash), limits))
    return grid.fly(nominal_schedule(profile), takeoff_mass=MASS).fuel


@pytest.mark.slow
def test_a_noisy_record_of_lem_burns_what_lem_burns(tmp_path):
    """Noise of a receiver, gaps, duplicates, outliers and jumps in altitude: required 2 %, found 0.2 %."""
    profile = Profile.of(read_mission(LEM))
    flown = fuel(profile)
    for seed, noise in ((1, TYPICAL), (2, replace(TYPICAL, interval=5.0))):
        path = write_gpx(tmp_path / f"lem{seed}.gpx", record(profile, noise, seed=seed))
        mission = track_mission(path, MASS)
        assert fuel(mission.profile) == pytest.approx(flown, rel=0.005)
        assert mission.profile.duration == pytest.approx(profile.duration, abs=10.0)
        assert np.isclose(mission.profile.mass_changes, 0.0).all()
