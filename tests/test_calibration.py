"""Calibration: what is solved, on what, and that the shipped values are what the model itself gives."""

import runpy
import tomllib
from pathlib import Path

import pytest

from vrsopt.aircraft import DATA, load_aircraft
from vrsopt.equilibrium import calibrated_constants
from vrsopt.rotor.airfoil import load_section
from vrsopt.rotor.fidelity import Fidelity

SCRIPT = runpy.run_path(str(Path(__file__).parents[1] / "problems" / "calibrate_rotor.py"), run_name="calibrate_rotor")
AIRCRAFT = load_aircraft("bo105")
CONTENT = tomllib.loads((DATA / "bo105.toml").read_text())


def solved_keys(content: dict, path: str = "") -> set[str]:
    keys: set[str] = set()
    for name, entry in content.items():
        if isinstance(entry, dict) and "value" in entry:
            keys |= {f"{path}{name}"} if entry["source"] == "solved" else set()
        elif isinstance(entry, dict):
            keys |= solved_keys(entry, f"{path}{name}.")
    return keys


def test_calibration_points_are_the_flight_manual_s():
    hover, cruise = SCRIPT["HOVER"], SCRIPT["CRUISE"]
    assert (hover.mass, hover.altitude, hover.temperature, hover.speed) == (2448.0, pytest.approx(1219.2), 10.0, 0.0)
    assert (cruise.mass, cruise.altitude, cruise.temperature) == (2400.0, 0.0, 15.0)
    assert cruise.speed == pytest.approx(65.334, abs=1e-3)
    assert hover.engine_power == cruise.engine_power == 514e3


def test_only_two_constants_are_solved_in_each_split():
    assert solved_keys(CONTENT) == {
        "main_rotor.induced_power_factor",
        "fuselage.parasite_area",
        "variants.section_drag_level.section_drag_level",
        "variants.section_drag_level.parasite_area",
    }
    assert set(SCRIPT["SPLITS"]["induced factor"]) == {"induced_power_factor", "parasite_area"}


def test_default_values_are_inside_their_ranges():
    for name, record in (("induced_power_factor", AIRCRAFT.main_rotor), ("parasite_area", AIRCRAFT.fuselage)):
        low, high = SCRIPT["allowed_range"](AIRCRAFT, name)
        assert low < getattr(record, name) < high


def test_default_split_reproduces_the_shipped_values():
    solved = SCRIPT["calibrate"](AIRCRAFT, "induced factor")
    assert solved["induced_power_factor"] == pytest.approx(AIRCRAFT.main_rotor.induced_power_factor, rel=1e-4)
    assert solved["parasite_area"] == pytest.approx(AIRCRAFT.fuselage.parasite_area, rel=1e-4)


def test_other_split_reproduces_the_shipped_variant():
    solved = SCRIPT["calibrate"](AIRCRAFT, "section drag level")
    variant = AIRCRAFT.variants["section_drag_level"]
    assert variant.induced_power_factor == 1.0
    assert solved["section_drag_level"] == pytest.approx(variant.section_drag_level, rel=1e-4)
    assert solved["parasite_area"] == pytest.approx(variant.parasite_area, rel=1e-4)


@pytest.mark.parametrize("variant", [None, "section_drag_level"])
def test_both_splits_meet_both_points(variant):
    aircraft = AIRCRAFT if variant is None else AIRCRAFT.variant(variant)
    for point in (SCRIPT["HOVER"], SCRIPT["CRUISE"]):
        _, solution = SCRIPT["trim_at"](point, aircraft, calibrated_constants(aircraft))
        engines = aircraft.transmission.power_per_engine(SCRIPT["rotor_power"](solution)) * 2
        assert engines == pytest.approx(514e3, rel=1e-4)


def test_another_model_meets_both_points_with_constants_of_its_own():
    coarse = Fidelity(harmonics=2, azimuths=16, stations=6, flap_modes=1, lag_modes=1, dynamic_stall=False)
    aircraft = AIRCRAFT.replaced(main_rotor=AIRCRAFT.main_rotor.replaced(section=load_section("naca_0012")))
    solved = SCRIPT["calibrate"](aircraft, "section drag level", fidelity=coarse, stalling_tail=False)
    constants = SCRIPT["starting_constants"](aircraft, "section drag level") | solved
    assert constants["induced_power_factor"] == 1.0
    for point in (SCRIPT["HOVER"], SCRIPT["CRUISE"]):
        _, solution = SCRIPT["trim_at"](point, aircraft, constants, fidelity=coarse, stalling_tail=False)
        engines = aircraft.transmission.power_per_engine(SCRIPT["rotor_power"](solution)) * 2
        assert engines == pytest.approx(514e3, rel=1e-6)
