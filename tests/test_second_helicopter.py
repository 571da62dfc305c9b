"""The UH-60A and its T700, data files alone: they load, balance, trim, and their power is that of public figures."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import trapezoid

import vrsopt
from vrsopt.aircraft import DATA, load_aircraft
from vrsopt.balance import balance
from vrsopt.errors import InputError
from vrsopt.helicopter import allowed_ranges
from vrsopt.rotor.blade_frequencies import coupled_frequencies
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.turboshaft.cycle import sized
from vrsopt.turboshaft.data import load_engine

AIRCRAFT = load_aircraft("uh60a")
ENGINE = load_engine("t700")
HORSEPOWER, POUND = 745.69987, 0.45359237
GEN_HEL_MASS = 16825 * POUND
RESULTS = Path(__file__).parents[1] / "problems" / "second_helicopter.json"


def entries(content):
    """Every number of a data file, as its table."""
    for entry in content.values():
        if isinstance(entry, dict):
            yield from [entry] if "value" in entry else entries(entry)


@pytest.mark.parametrize("name", ["uh60a", "t700"])
def test_every_number_has_a_known_source_and_every_assumed_one_a_range(name):
    content = tomllib.loads((DATA / f"{name}.toml").read_text())
    sources = content.pop("sources")
    for entry in entries(content):
        first = entry["source"].split(";")[0]
        assert first in sources, entry
        if first in ("assumed", "TYPICAL") and not isinstance(entry["value"], list):
            assert entry["range"][0] <= entry["value"] <= entry["range"][1], entry


def test_geometry_is_that_of_public_tables():
    rotor, tail = AIRCRAFT.main_rotor, AIRCRAFT.tail_rotor
    assert rotor.solidity == pytest.approx(0.0821, abs=1e-4)  # NASA TM-85890
    assert tail.blade_area / (np.pi * tail.radius**2) == pytest.approx(0.1875, abs=1e-3)
    # blade about its hinge (NASA CR-166309): 256.9 lb, 86.7 slug ft, 1512.6 slug ft2
    r, m = np.array(rotor.blade.station), np.array(rotor.blade.mass_per_length)
    fine = np.linspace(r[0], r[-1], 20001)
    mass, arm = np.interp(fine, r, m), fine - r[0]
    for power, public in ((0, 116.53), (1, 385.66), (2, 2050.8)):
        assert trapezoid(mass * arm**power, fine) == pytest.approx(public, rel=0.025)


def test_hinge_and_blade_frequencies():
    """Bowen-Davies's fan plot: 1.04 flap, 2.84 flap, 0.28 lag, 4.9 torsion per revolution."""
    rotor = AIRCRAFT.main_rotor
    fidelity = Fidelity(flap_modes=4, lag_modes=3)
    found = coupled_frequencies(rotor, fidelity, rotor.nominal_rotor_speed, 0.14) / rotor.nominal_rotor_speed
    flap1, flap2, lag1, torsion = found[0], found[1], found[4], found[7]
    assert flap1 == pytest.approx(1.04, abs=0.01) and lag1 == pytest.approx(0.28, abs=0.01)
    assert flap2 == pytest.approx(2.84, abs=0.2) and torsion == pytest.approx(4.9, abs=0.3)


def test_weight_and_balance():
    light = balance(AIRCRAFT)
    assert light.mass == pytest.approx(5118 + 90 + 1061) and abs(light.cg_shift) < 0.05
    full = balance(AIRCRAFT, payload=1300.0, crew=180.0)
    assert full.foremost < full.cg_arm < full.aftmost
    with pytest.raises(InputError, match="gross mass"):
        balance(AIRCRAFT, payload=4000.0)


def test_range_of_masses_is_that_of_the_aircraft():
    assert allowed_ranges(AIRCRAFT)["mass"] == pytest.approx((1837.0, 18370.0))
    assert allowed_ranges(load_aircraft("bo105"))["mass"] == pytest.approx((500.0, 5000.0))
    with pytest.raises(InputError, match="mass = 1500: a number from 1837 to 18370"):
        vrsopt.trim(1500.0, 0.0, aircraft="uh60a")


@pytest.mark.parametrize("speed", [0.0, 41.156, 60.0])
def test_trims_in_hover_and_cruise(speed):
    """Power near Gen Hel's (NASA TM-100991, 16825 lb, sea level): 1613 hp of the main rotor in hover, 1018 at 80 kt."""
    point = vrsopt.trim(GEN_HEL_MASS, speed, aircraft="uh60a", method="newton")
    assert point.success and point.feasible, point.reason
    assert point.residual_norm < 1e-7
    power = point.main_rotor_power / HORSEPOWER
    if speed == 0.0:
        assert 1.0 < power / 1613.4 < 1.15 and 0.68 < point.figure_of_merit < 0.78
        assert 1.0 < point.shaft_power_per_engine / HORSEPOWER / 911.1 < 1.18
        assert np.degrees(point.collective) == pytest.approx(8.7, abs=1.0)  # TM-85890, 16400 lb
    elif speed < 50.0:
        assert 1.0 < power / 1018.5 < 1.15
    else:
        assert 350.0 < 3600 * point.fuel_flow < 450.0  # kg/h


def test_engine_closes_on_its_design_point_and_its_deck():
    result = vrsopt.engine(1209.5e3, engine_data=ENGINE)
    assert result.success and result.sfc_kg_kwh == pytest.approx(0.2763, rel=1e-6)
    assert result.pressure_ratio == pytest.approx(16.6, rel=1e-6)
    assert result.air_flow_kg_s == pytest.approx(4.31, rel=1e-6)
    design = sized(ENGINE)
    assert design.t3 == pytest.approx(2.4875 * 288.15, abs=8.0)  # TM-100991, figure A2
    assert 0.80 < design.power_turbine_efficiency < 0.90 and 1400.0 < design.t4 < 1550.0
    # table B.1 of TM-100991: shp, lb/h, gas-generator speed over 44700 rpm
    for shaft, fuel, speed in ((911.1, 476.3, 0.9315), (552.6, 349.3, 0.8897), (302.6, 267.7, 0.8517)):
        part = vrsopt.engine(shaft * HORSEPOWER, engine_data=ENGINE)
        assert 3600 * part.fuel_flow_kg_s / POUND == pytest.approx(fuel, rel=0.02)
        assert part.gas_generator_speed_percent / 100 * 0.975 == pytest.approx(speed, rel=0.01)


@pytest.mark.parametrize("rating", ["take_off", "maximum_continuous", "ground_idle"])
def test_ratings(rating):
    result = vrsopt.engine(rating=rating, engine_data=ENGINE)
    assert result.success and result.inside_map, result.message


def test_page_is_that_of_its_results():
    """Savings of the results are read again from their own walks."""
    results = json.loads(RESULTS.read_text())
    hover = next(w for w in results["walks"] if w["speed"] == 0.0)
    best = next(o for o in results["optima"] if (o["mass"], o["altitude"], o["speed"]) == (hover["mass"], 0.0, 0.0))
    inside = [p for r, p in zip(hover["ratio"], hover["main_rotor_power"], strict=True) if 0.849 < r < 1.001]
    nominal = hover["main_rotor_power"][hover["ratio"].index(1.0)]
    assert best["narrow_power_saving"] == pytest.approx(100 * (1 - min(inside) / nominal), abs=0.2)
    page = RESULTS.with_suffix(".md").read_text()
    assert f"{best['nominal_power_kw']:.0f}" in page and "Steiner" in page
