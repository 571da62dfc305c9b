"""The main job on short missions: every schedule, on the surrogate and on the physics."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vrsopt import foca
from vrsopt.errors import InputError, NoSolutionError
from vrsopt.helicopter import helicopter
from vrsopt.mission.file import mission_from
from vrsopt.mission.profile import Profile
from vrsopt.mission.track import FlownMission
from vrsopt.quantity import read_toml
from vrsopt.schedule.compare import solve
from vrsopt.schedule.comparison import Comparison
from vrsopt.schedule.emission_summary import foca_estimates

SARM = Path(__file__).parents[2] / "problems" / "sarm.toml"


def hop(**changes):
    """A short mission: hover, climb, cruise, descent, hover."""
    data = {
        "name": "hop",
        "aircraft": "bo105",
        "start": "A",
        "places": {
            "A": {"latitude_deg": 48.0, "longitude_deg": 11.0, "elevation_m": 100.0},
            "B": {"latitude_deg": 48.1, "longitude_deg": 11.0, "elevation_m": 100.0},
        },
        "loading": {"empty_kg": 1300.0, "crew_kg": 170.0, "equipment_kg": {"cabin": 200.0}},
        "tasks": [
            {"kind": "idle", "duration_s": 30.0},
            {"kind": "hover", "duration_s": 60.0},
            {"kind": "climb", "altitude_m": 400.0},
            {"kind": "cruise", "to": "B", "speed_m_s": 50.0},
            {"kind": "descent"},
            {"kind": "hover", "duration_s": 60.0},
        ],
    }
    data["loading"] |= changes.pop("loading", {})
    return mission_from(data | changes, where="hop")


@pytest.fixture(scope="module")
def short() -> Comparison:
    return solve(hop(), schedules=("nominal", "trajectory"), workers=1)


def test_a_short_mission_from_python(short):
    assert short.success
    summary = short.summary()
    assert set(summary["schedules"]) == {"nominal", "trajectory"}
    saved = summary["schedules"]["trajectory"]
    assert saved["fuel_delta_percent"] < -3.0
    nominal, flight = summary["schedules"]["nominal"], short.results["nominal"].flight
    carbon = nominal["co2_kg"] / 44.009 + nominal["co_kg"] / 28.010
    unburnt = 1.0 - carbon / (3.1563 / 44.009 * nominal["fuel_kg"])
    correlated = np.sum(flight.fuel_flow * foca.hc_index(flight.power_per_engine)) / np.sum(flight.fuel_flow)
    assert unburnt == pytest.approx(correlated, rel=0.1)
    assert short.band.lower.shape == short.band.upper.shape
    assert np.all(short.band.lower <= short.band.upper)


def test_emissions_of_surrogate_and_physics_agree(short):
    """On the surrogate from tables, on the physics from the combustor's network at the flown states of the engine."""
    for result in short.results.values():
        own, physics = result.emissions, result.physics.emissions
        assert physics.total("co2") == pytest.approx(own.total("co2"), rel=2e-3)
        assert physics.total("nox") == pytest.approx(own.total("nox"), rel=5e-3)
        assert physics.total("co") == pytest.approx(own.total("co"), rel=5e-3)
        assert physics.nox_range == pytest.approx(own.nox_range, rel=5e-3)
        assert set(physics.per_segment) == {name for name in own.per_segment if not name.startswith("foca")}
        idle = [segment.kind == "idle" for segment in short.profile.segments]
        assert np.all(physics.per_segment["nox"][idle] > 0.0)
        for name in ("nox", "co"):
            assert physics.quadrature_error[name] < 2e-3 * physics.total(name)
    changes = short.results["trajectory"].changes
    assert changes["nox"] < short.results["trajectory"].fuel_delta_percent < 0.0  # NOx falls faster than fuel
    assert short.results["trajectory"].physics_changes["nox"] == pytest.approx(changes["nox"], abs=0.3)


def test_summary_of_emissions_adds_up(short):
    summary = short.summary()
    for name, figures in summary["schedules"].items():
        result = short.results[name]
        phases = figures["phases"].values()
        assert sum(phase["duration_s"] for phase in phases) == pytest.approx(summary["duration_s"], rel=1e-9)
        for key in ("fuel_kg", "co2_kg", "nox_kg", "co_kg"):
            assert sum(phase[key] for phase in phases) == pytest.approx(figures[key], rel=1e-9)
        low, high = figures["nox_range_kg"]
        assert low <= figures["nox_kg"] <= high
        low, high = figures["nox_delta_range_percent"]
        assert low <= figures["nox_delta_percent"] <= high
        assert figures["nox_physics_kg"] == result.physics.emissions.total("nox")
        # FOCA's index of NOx rises with power: between those of the least and the largest power of the flight
        power, index = result.flight.power_per_engine, figures["foca_nox_kg"] / figures["fuel_kg"]
        assert foca.nox_index(power.min()) < index < foca.nox_index(power.max())
    cycle, mission = summary["foca"]["landing_take_off"], summary["foca"]["mission"]
    assert summary["foca"]["landings"] == 1 and "factor of 2" in summary["foca"]["note"]
    assert cycle["total"]["duration_s"] == 810.0 and mission["total"]["fuel_kg"] >= cycle["total"]["fuel_kg"]
    assert "indicative" in summary["emissions_note"]


def test_flights_without_stops_on_the_ground_are_one_landing(transport, search):
    machine = helicopter("bo105")
    landings = [foca_estimates(profile, machine.aircraft, machine.engine)[2] for profile in (transport, search)]
    assert landings == [2, 2]
    away = Profile(transport.segments[:1])
    assert foca_estimates(away, machine.aircraft, machine.engine)[2] == 0


@pytest.mark.slow
def test_a_combustor_that_was_not_solved_fails_the_physics(monkeypatch):
    def unsolved(engine, states):
        flows = {name: 1e-4 * states["burnt_fuel_flow"] for name in ("nox", "co", "co2")}
        flows["nox"][0] = np.nan
        return flows

    monkeypatch.setattr("vrsopt.schedule.verify.flows_of_fits", unsolved)
    result = solve(hop(), schedules=("nominal",), workers=1).results["nominal"]
    assert not result.success and np.isfinite(result.physics.fuel)
    assert "physics: combustor not solved at" in result.message


@pytest.mark.slow
def test_a_light_aircraft_is_closed_from_below_the_sampled_box():
    """Empty it would weigh less than the lightest sampled mass, with its fuel it does not."""
    loading = {"empty_kg": 1000.0, "equipment_kg": {"cabin": 195.0}, "reserve_minutes": 60.0}
    comparison = solve(hop(loading=loading), schedules=("nominal",), workers=1)
    closed = comparison.loading
    assert comparison.mission.loading.zero_fuel_mass < 1400 < closed.landing_mass
    burned = comparison.results["nominal"].flight.fuel
    assert closed.fuel_loaded - burned == pytest.approx(closed.reserve_fuel, abs=2e-6)
    with pytest.raises(
        InputError, match=r"hop: gross mass = 1\d\d\d.\d kg at \d+ s \(.*\): the aircraft's model holds"
    ):
        solve(hop(loading={"empty_kg": 900.0}), schedules=("nominal",), workers=1)


@pytest.mark.slow
def test_a_flown_mission_takes_off_with_its_own_mass():
    mission = hop()
    flown = FlownMission(
        name="track",
        takeoff_mass=1900.0,
        profile=Profile.of(mission),
        places=mission.places,
        notes=("as it was flown",),
        source_hash="",
        limits=mission.limits,
    )
    comparison = solve(flown, schedules=("nominal", "trajectory"), workers=1)
    assert comparison.success
    for result in comparison.results.values():
        assert result.flight.mass[0] == 1900.0
        # nothing to close: the fuel saved is fuel left
        assert result.fuel_delta_closed_percent == pytest.approx(result.fuel_delta_percent, abs=1e-6)
    summary = comparison.summary()
    assert summary["takeoff_mass_kg"] == 1900.0 and summary["reserve_kg"] is None
    assert summary["notes"] == ["as it was flown"]
    with pytest.raises(NoSolutionError, match=r"track: gross mass 2510 kg at 0 s .* 10 kg over the largest mass"):
        solve(replace(flown, takeoff_mass=2510.0), schedules=("nominal",), workers=1)


@pytest.mark.slow
def test_prescribed_climb_and_descent_cost_more_than_modelled_ones():
    comparison = solve(hop(), schedules=("prescribed",), variables="both", workers=1)
    names = ["nominal", "pointwise", "pointwise_rate_limited", "prescribed", "prescribed_rate_limited"]
    assert list(comparison.results) == names
    difference = comparison.summary()["prescribed_difference_percent"]
    own, base = (comparison.results[name].flight.fuel for name in ("prescribed", "pointwise"))
    assert difference["surrogate"] == pytest.approx(100.0 * (own / base - 1.0)) and difference["surrogate"] > 0.1
    assert difference["physics"] == pytest.approx(difference["surrogate"], abs=0.1)


@pytest.mark.slow
def test_one_variable_alone_saves_less_than_both(short):
    both = short.results["trajectory"].flight.fuel
    speed, twist = (
        solve(hop(), schedules=("nominal", "trajectory"), variables=name, workers=1).results["trajectory"]
        for name in ("speed", "twist")
    )
    assert both <= speed.flight.fuel * 1.0001 and both <= twist.flight.fuel * 1.0001
    assert np.ptp(speed.schedule.twist) == 0.0
    assert np.ptp(twist.schedule.rotor_speed) == 0.0


@pytest.mark.slow
def test_a_larger_margin_costs_fuel(short):
    larger = solve(hop(limits={"manoeuvre_margin": 1.5}), schedules=("nominal", "trajectory"), workers=1)
    fuel = [one.results["trajectory"].flight.fuel for one in (short, larger)]
    assert fuel[1] > fuel[0] * 1.005  # 1.5 and the aircraft's 1.3


@pytest.mark.slow
def test_results_do_not_depend_on_the_number_of_workers(short):
    two = solve(hop(), schedules=("nominal", "trajectory"), workers=2).summary()
    assert short.summary()["schedules"] == two["schedules"]


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"loading": {"empty_kg": 2300.0}}, NoSolutionError, "take-off mass: at least"),
        ({"aircraft": "helios"}, InputError, "helios"),
    ],
)
def test_missions_that_can_not_be_flown_say_why(changes, error, message):
    with pytest.raises(error, match=message):
        solve(hop(**changes), schedules=("nominal",), workers=1)


@pytest.mark.slow
def test_a_pick_up_beyond_the_largest_mass_is_named():
    data = read_toml(SARM)
    for task in data["tasks"]:
        if task.get("mass_change_kg"):
            task["mass_change_kg"] *= 3
    with pytest.raises((NoSolutionError, InputError), match="2500|mass"):
        solve(mission_from(data, where="sarm"), schedules=("nominal",), workers=1)


@pytest.mark.slow
def test_more_power_than_the_engines_have_is_infeasible():
    mission = hop(
        loading={"empty_kg": 1900.0},
        tasks=[
            {"kind": "hover", "duration_s": 30.0},
            {"kind": "climb", "altitude_m": 600.0, "speed_m_s": 60.0, "climb_angle_deg": 9.0},
            {"kind": "cruise", "to": "B", "speed_m_s": 50.0},
            {"kind": "descent"},
            {"kind": "hover", "duration_s": 30.0},
        ],
    )
    comparison = solve(mission, schedules=("nominal", "trajectory"), workers=1)
    assert not comparison.success
    for result in comparison.results.values():
        assert not result.success
        assert "over its limit" in result.message or "climb" in result.message


def test_bad_choices_are_named():
    with pytest.raises(InputError, match="schedules: 'best'"):
        solve(hop(), schedules=("best",))
    with pytest.raises(InputError, match="variables = 'some'"):
        solve(hop(), variables="some")
