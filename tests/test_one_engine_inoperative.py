"""Flight on fewer engines: who carries the power, under which ratings, and what is refused."""

import json
import math

import pytest

from vrsopt.aircraft import load_aircraft
from vrsopt.cli import main
from vrsopt.drive_train import engine_power, idle_power, operating_engines
from vrsopt.errors import InputError
from vrsopt.helicopter import trim
from vrsopt.limits import Limits
from vrsopt.turboshaft.data import load_engine

AIRCRAFT = load_aircraft("bo105")
ENGINE = load_engine(AIRCRAFT.engine)


def test_the_engine_left_carries_all_and_alone_burns_fuel():
    both, alone = trim(2000.0, 30.0), trim(2000.0, 30.0, engines_operating=1)
    assert (both.engines_operating, alone.engines_operating) == (2, 1)
    assert alone.main_rotor_power == pytest.approx(both.main_rotor_power, rel=1e-9)
    assert alone.shaft_power_per_engine == pytest.approx(2 * both.shaft_power_per_engine, rel=1e-5)
    assert alone.fuel_flow == pytest.approx(alone.gas_path.outputs["fuel_flow"], rel=1e-12)
    assert both.fuel_flow == pytest.approx(2 * both.gas_path.outputs["fuel_flow"], rel=1e-12)
    assert 0.6 * both.fuel_flow < alone.fuel_flow < 0.9 * both.fuel_flow  # a well loaded engine burns less per kWh
    assert alone.nox == pytest.approx(alone.nox_index * alone.fuel_flow, rel=1e-12)
    assert alone.feasible and "1 of 2 operating" in str(alone) and "operating" not in str(both)


def test_all_is_the_default():
    default, said = trim(2200.0, 30.0), trim(2200.0, 30.0, engines_operating=2)
    assert said.fuel_flow == default.fuel_flow and said.usages == default.usages


def test_ratings_of_an_engine_left_alone():
    """283.9 kW instead of 257: the margin that a point with both engines states is the one that is left."""
    both = trim(2200.0, 40.0)
    alone = trim(2200.0, 40.0, engines_operating=1)
    assert alone.usages["engine power"] == pytest.approx(alone.shaft_power_per_engine / 283.9e3)
    assert alone.usages["torque"] == pytest.approx(alone.usages["engine power"])
    assert both.one_engine_inoperative_margin == pytest.approx(283.9e3 - alone.shaft_power_per_engine, abs=100.0)
    slower = trim(2200.0, 40.0, engines_operating=1, rotor_speed=0.9 * 44.4)
    assert slower.usages["torque"] == pytest.approx(slower.usages["engine power"] / 0.9)


def test_a_rating_of_the_aircraft_above_the_engine_s_own_is_the_engine_s():
    strong = AIRCRAFT.replaced(transmission=AIRCRAFT.transmission.replaced(one_engine_inoperative_power=400.0))
    assert Limits(strong, ENGINE, one_engine_inoperative=True).rated_power == ENGINE.ratings.take_off_power
    assert Limits(AIRCRAFT, ENGINE, one_engine_inoperative=True).rated_power == pytest.approx(283.9e3)
    assert Limits(AIRCRAFT, ENGINE, "study", one_engine_inoperative=True).rated_power == 313e3


@pytest.mark.parametrize(
    ("place", "expected", "words"),
    [
        ({"mass": 2400.0, "speed": 60.0}, "over power", "kW per engine above 283.9 kW with one engine inoperative"),
        (
            {"mass": 2300.0, "speed": 35.0, "rotor_speed": 0.9 * 44.4, "load_factor": 1.15},
            "over torque",
            "% of the rated torque with one engine inoperative",
        ),
        (
            {"mass": 2200.0, "speed": 35.0, "altitude": 2500.0, "isa_offset": 25.0},
            "over temperature",
            "above 1113 K with one engine inoperative",
        ),
    ],
)
def test_what_one_engine_can_not_do_names_the_failure(place, expected, words):
    assert trim(**place).feasible
    point = trim(**place, engines_operating=1)
    assert point.classification == expected and words in point.reason, point.reason
    assert not point.feasible


def test_idle_is_the_least_power_on_one_engine_too():
    assert engine_power(AIRCRAFT, ENGINE, -50e3, engines_operating=1) == pytest.approx(idle_power(ENGINE), rel=1e-4)
    total = 0.975 * 2 * 150e3
    each, alone = (engine_power(AIRCRAFT, ENGINE, total, engines_operating=n) for n in (2, 1))
    assert alone == pytest.approx(2 * each, rel=1e-6) and each == engine_power(AIRCRAFT, ENGINE, total)


@pytest.mark.parametrize("wanted", [0, 3, -1, 1.5, math.nan, True, "one"])
def test_impossible_numbers_of_engines(wanted):
    with pytest.raises(InputError, match=f"^trim: engines_operating = {wanted}: a whole number from 1 to 2$"):
        trim(2200.0, 30.0, engines_operating=wanted)


def test_an_aircraft_with_one_engine_flies_on_it():
    single = AIRCRAFT.replaced(transmission=AIRCRAFT.transmission.replaced(engines=1))
    assert operating_engines(single, None) == operating_engines(single, 1) == 1
    with pytest.raises(InputError, match="engines_operating = 2: 1, the only one"):
        operating_engines(single, 2)


def test_on_the_command_line(capsys):
    words = ["trim", "--mass", "2400", "--speed", "60", "--json", "--engines-operating"]
    assert main([*words, "1"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert (figures["engines_operating"], figures["feasible"]) == (1, False)
    assert figures["reason"].endswith("with one engine inoperative")
    assert main([*words, "0"]) == 2
    assert capsys.readouterr().err == "vrsopt: trim: engines_operating = 0: a whole number from 1 to 2\n"
