"""Speeds and altitudes chosen for least fuel: against a scan, against their neighbours, and what is refused."""

from __future__ import annotations

import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.mission.file import mission_from
from vrsopt.mission.flight_path import ground_distances
from vrsopt.mission.profile import Profile
from vrsopt.mission.ranges import free_values
from vrsopt.schedule.free_flight import _Search, free_flight
from vrsopt.schedule.mission_setup import MissionSetup

WAYS = ("nominal", "scheduled")
HOP = Path(__file__).parents[1] / "hop.toml"


def hop_with(
    site: float = 47.12, limits: dict[str, float] | None = None, load: float = 0.0, **ranges: Any
) -> MissionSetup:
    """The hop, to a site further north, with these limits and load [kg], and with these ranges for its cruise."""
    data = tomllib.loads(HOP.read_text())
    data["places"]["site"]["latitude_deg"] = site
    data["tasks"][2] |= ranges
    data["limits"] = limits or {}
    data["loading"]["equipment_kg"] = {"load": load}
    return MissionSetup(mission_from(data, where="hop"))


@pytest.fixture(scope="module")
def free() -> MissionSetup:
    return hop_with(speed_range_m_s=[35.0, 60.0])


def test_a_mission_that_leaves_nothing_free_is_left_alone():
    assert free_flight(hop_with(47.04)) is None


@pytest.mark.slow
def test_best_speed_of_the_nominal_rotor_is_that_of_a_scan():
    one = hop_with(speed_range_m_s=[35.0, 60.0])
    search = _Search(one, one.mission, free_values(one.mission.tasks), one.settings)
    speeds = np.arange(52.0, 55.6, 0.5)
    fuels = [search.flight(search.nominal, np.array([speed]), 4.0).fuel for speed in speeds]
    parabola = np.polynomial.Polynomial.fit(speeds, fuels, 3)
    (lowest,) = [root.real for root in parabola.deriv().roots() if parabola.deriv(2)(root.real) > 0]
    assert search.best(search.nominal, search.scanned(search.nominal, search.stated)) == pytest.approx(
        [lowest], abs=0.15
    )


@pytest.mark.slow
def test_a_limit_ends_the_choice_of_an_altitude():
    """With a margin that is nearly used up as stated, the altitude stays far below that of least fuel, 680 m."""
    data = {"altitude_range_m": [420.0, 800.0], "load": 700.0}
    wide = hop_with(**data)
    usage = 1.0 + float(np.max(wide.grid.fly(wide.nominal, takeoff_mass=wide.loading.takeoff_mass).limits[0]))
    one = hop_with(**data, limits={"manoeuvre_margin": 1.3 * 0.99 / usage})
    search = _Search(one, one.mission, free_values(one.mission.tasks), one.settings)
    (best,) = search.best(search.nominal, search.scanned(search.nominal, search.stated))
    limits = search.flight(search.nominal, np.array([best]), 4.0).limits.max(axis=1)
    assert 440.0 < best < 600.0
    assert limits[0] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.slow
def test_scheduled_rotor_has_its_own_best_speed(free, monkeypatch):
    monkeypatch.setattr("vrsopt.schedule.free_flight.SCANNED", 4)
    found = free_flight(free)
    assert found is not None
    fuel = found.fuels
    assert fuel["nominal_best"] < 0.99 * fuel["nominal_stated"]
    assert fuel["scheduled_best"] <= fuel["scheduled_nominal"] < 0.9 * fuel["nominal_best"]
    assert fuel["scheduled_best"] < fuel["scheduled_stated"]
    speed = {name: values[free_values(free.mission.tasks)[0]] for name, values in vars(found).items() if name in WAYS}
    assert speed["scheduled"] < speed["nominal"] - 1.0  # a rotor that may slow down saves most at medium speeds
    profile = Profile.of(found.mission)
    assert not free_values(found.mission.tasks)
    assert ground_distances(profile).sum() == pytest.approx(ground_distances(free.profile).sum(), abs=0.01)
    assert found.notes[0].startswith(f"tasks[2].speed_m_s = {speed['scheduled']:g}, free from 35 to 60 (stated 45; ")
    assert found.summary()["values"]["tasks[2].speed_m_s"]["nominal_rotor"] == speed["nominal"]


def test_polish_steps_to_the_minimum_and_not_where_a_neighbour_can_not_be_flown(monkeypatch):
    one = hop_with(speed_range_m_s=[35.0, 60.0])
    search = _Search(one, one.mission, free_values(one.mission.tasks), one.settings)

    def flight(make: Any, x: np.ndarray, step: float) -> Any:
        if x[0] > 52.0:
            raise InputError("a place further away")
        return SimpleNamespace(fuel=10.0 + (x[0] - 50.4) ** 2, success=True)

    monkeypatch.setattr(search, "flight", flight)
    assert search.polished(np.array([50.0])) == pytest.approx([50.4])
    assert search.polished(np.array([51.5])) == pytest.approx([51.5])  # neighbours are 1 m/s away


def test_an_end_that_can_not_be_flown_is_refused_by_field():
    with pytest.raises(InputError) as error:
        free_flight(hop_with(47.04, speed_range_m_s=[40.0, 55.0]))
    assert str(error.value).startswith("tasks[2].speed_m_s = 55, an end of its range: tasks[2].to = 'site': allowed: a")
