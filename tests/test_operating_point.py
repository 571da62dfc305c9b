"""The coupled chain: drive train, engine, limits, classes with their reasons, robustness."""

import math
import time
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import qmc

from vrsopt.aircraft import load_aircraft
from vrsopt.atmosphere import GRAVITY, standard_air
from vrsopt.combustor.emissions import emissions
from vrsopt.errors import InputError
from vrsopt.helicopter import Helicopter, helicopter, trim
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.operating_point import OperatingPoint
from vrsopt.residual import TOLERANCE
from vrsopt.turboshaft.performance import engine

MACHINE = helicopter("bo105")
ROTOR = MACHINE.aircraft.main_rotor
NOMINAL = ROTOR.nominal_rotor_speed
LIMITS = Limits(MACHINE.aircraft, MACHINE.engine)
CLASSES = {"ok", "stalled", "over power", "over torque", "over temperature", "tail rotor", "not converged"}


def flight(mass: float, speed: float, **changes: float) -> dict[str, float]:
    base = {
        "mass": mass,
        "altitude": 0.0,
        "isa_offset": 0.0,
        "speed": speed,
        "climb_angle": 0.0,
        "load_factor": 1.0,
        "rotor_speed": NOMINAL,
        "twist": ROTOR.twist,
    }
    return {**base, **changes}


def point(mass: float, speed: float, limits: Limits = LIMITS, **changes: float) -> OperatingPoint:
    return MACHINE.point(flight(mass, speed, **changes), limits=limits)


def test_a_flyable_point():
    result = point(2200.0, 30.0)
    assert result.success and result.feasible and result.classification == "ok" and result.reason == ""
    assert result.residual_norm < TOLERANCE
    rotors = result.main_rotor_power + result.tail_rotor_power
    assert result.shaft_power_per_engine == pytest.approx((rotors / 0.975 + 8e3) / 2)
    assert 100 < result.fuel_flow * 3600 < 160  # kg/h, both engines
    assert result.co2 / result.fuel_flow == pytest.approx(3.156, rel=0.03)  # kerosene, less what leaves as CO
    assert tuple(result.usages) == LIMIT_NAMES and max(result.usages.values()) < 1
    text = str(result)
    assert "kW" in text and "flyable" in text and "yes" in text


def test_emissions_of_all_engines_are_those_of_one_times_their_number():
    """The point, the engine verb at its power, and the carbon of the fuel tell the same."""
    where = {"altitude": 700.0, "isa_offset": 10.0, "rotor_speed": 42.0}
    result = point(2200.0, 45.0, **where)
    mach = 45.0 / standard_air(700.0, 10.0).speed_of_sound
    one = engine(
        result.shaft_power_per_engine, power_turbine_speed=42.0 / NOMINAL, altitude=700.0, isa_offset=10.0, mach=mach
    )
    for name in ("nox", "co", "co2"):
        assert getattr(result, name) == pytest.approx(2 * getattr(one, f"{name}_kg_s"), rel=1e-6)
        assert getattr(result, name) == pytest.approx(getattr(result, f"{name}_index") * result.fuel_flow, rel=1e-12)
    assert result.nox_range == pytest.approx([2 * flow for flow in one.nox_range_kg_s], rel=1e-6)
    assert result.nox_range[0] <= result.nox <= result.nox_range[1]
    burnt = (1.0 - 1e-3 * one.hc_index_g_kg) * result.fuel_flow
    carbon = MACHINE.engine.combustor.co2_per_fuel * burnt
    assert result.co2 + 44.009 / 28.010 * result.co == pytest.approx(carbon, rel=1e-5)
    assert "NOx" in str(result) and "no hydrocarbons listed; at idle power" in str(result)


def test_a_combustor_that_was_not_solved_costs_the_emissions_alone(monkeypatch):
    whole = point(2200.0, 30.0)
    solved = emissions(MACHINE.engine, whole.gas_path)
    lost = replace(solved, success=False, message="combustor: stuck", nox=math.nan, nox_of_fits={"shipped": math.nan})
    monkeypatch.setattr("vrsopt.helicopter.emissions", lambda *_: lost)
    result = point(2200.0, 30.0)
    assert result.success and result.feasible and result.fuel_flow == whole.fuel_flow
    assert math.isnan(result.nox) and np.isnan(result.nox_range).all() and "combustor: stuck" in result.message


def test_power_split_margins_and_hub_moments():
    result = point(2200.0, 50.0, load_factor=1.1, climb_angle=0.02)
    rotors = result.main_rotor_power + result.tail_rotor_power
    assert sum(result.powers.values()) == pytest.approx(rotors, rel=0.01)
    assert set(result.powers) == {"induced", "profile", "parasite", "climb", "tail rotor"}
    assert result.powers["climb"] == pytest.approx(2200 * GRAVITY * 50.0 * np.sin(0.02))
    assert result.margins["torque"] == pytest.approx(1 - result.usages["torque"])
    tip = standard_air(0.0).speed_of_sound
    assert result.advancing_tip_mach == pytest.approx((NOMINAL * ROTOR.radius + 50.0) / tip, rel=5e-3)
    assert result.hub_pitch_moment > 0  # the hub holds the nose up against the fuselage's and the tailplane's moment
    needed = rotors / 0.975 + 8e3
    assert result.one_engine_inoperative_margin == pytest.approx(283.9e3 - needed)
    energy = 0.5 * 4 * ROTOR.flap_inertia * NOMINAL**2
    assert energy < result.autorotative_energy < 1.3 * energy


def test_load_factor_is_a_turn():
    straight, turn = point(2000.0, 40.0), point(2000.0, 40.0, load_factor=1.3)
    assert turn.roll - straight.roll == pytest.approx(np.arccos(1 / 1.3), abs=np.radians(2.5))
    assert turn.blade_loading == pytest.approx(1.3 * straight.blade_loading)
    assert turn.usages["blade loading"] == pytest.approx(1.3 * straight.usages["blade loading"], rel=1e-9)
    assert turn.fuel_flow > straight.fuel_flow


def test_the_public_verb_is_the_same_point():
    public, bulk = trim(2200.0, 30.0), point(2200.0, 30.0)
    assert public.main_rotor_power == pytest.approx(bulk.main_rotor_power, rel=1e-7)
    assert public.fuel_flow == pytest.approx(bulk.fuel_flow, rel=1e-7)


def test_engine_state_hears_altitude_temperature_and_rotor_speed():
    base = MACHINE.engine_state(200e3, flight(2200.0, 30.0)).outputs["fuel_flow"]
    for change in ({"altitude": 1500.0}, {"isa_offset": 20.0}, {"rotor_speed": 0.8 * NOMINAL}, {"speed": 60.0}):
        other = MACHINE.engine_state(200e3, {**flight(2200.0, 30.0), **change})
        assert other.success and other.outputs["fuel_flow"] != pytest.approx(base, rel=1e-4), change


@pytest.mark.parametrize(
    "expected, arguments, changes, words",
    [
        ("tail rotor", (1700.0, 60.0), {"rotor_speed": 0.8 * NOMINAL, "climb_angle": 0.03}, ["tail-rotor", "largest"]),
        ("over power", (2400.0, 70.0), {}, ["kW per engine above 257.0 kW"]),
        ("over torque", (2300.0, 66.5), {"rotor_speed": 0.95 * NOMINAL}, ["torque", "%"]),
        ("over temperature", (2200.0, 0.0), {"altitude": 3000.0, "isa_offset": 20.0}, ["inter-turbine", "1113 K"]),
    ],
)
def test_each_way_to_be_unflyable(expected, arguments, changes, words):
    result = point(*arguments, **changes)
    check_unflyable(result, expected, words)
    if result.success:
        assert "no: " in str(result)


def check_unflyable(result: OperatingPoint, expected: str, words: list[str]) -> None:
    assert result.classification == expected, result.reason
    assert not result.feasible
    for word in words:
        assert word in result.reason, result.reason


@pytest.mark.slow
def test_a_stalled_point_without_trim_has_no_numbers_but_its_loading():
    stalled = point(2400.0, 50.0, rotor_speed=0.8 * NOMINAL, load_factor=1.2)
    check_unflyable(stalled, "stalled", ["blade loading", "0.1429", "0.1173"])
    assert not stalled.success
    assert math.isnan(stalled.main_rotor_power) and math.isnan(stalled.fuel_flow) and math.isnan(stalled.collective)
    assert stalled.blade_loading == pytest.approx(0.1429, abs=1e-4)


def test_the_study_s_setting_allows_the_take_off_rating():
    study = Limits(MACHINE.aircraft, MACHINE.engine, setting="study")
    assert point(2200.0, 67.0).classification == "over power"
    assert point(2200.0, 67.0, study).classification == "ok"


def test_margin_makes_a_point_unflyable_below_nominal_speed_only():
    keep = Limits(MACHINE.aircraft, MACHINE.engine, manoeuvre_margin=1.3)
    slow = {"rotor_speed": 0.78 * NOMINAL}
    assert point(2200.0, 35.0, **slow).feasible
    assert point(2200.0, 35.0, keep, **slow).classification == "stalled"
    assert point(2200.0, 35.0, keep).feasible


@pytest.mark.parametrize(
    "keywords, words",
    [
        ({"mass": 100.0, "speed": 30.0}, ["mass = 100", "500", "5000"]),
        ({"mass": 2200.0, "speed": -1.0}, ["speed = -1", "0 to 90"]),
        ({"mass": 2200.0, "speed": math.nan}, ["speed = nan"]),
        ({"mass": 2200.0, "speed": 30.0, "rotor_speed": 100.0}, ["rotor_speed = 100", "57.72"]),
        ({"mass": 2200.0, "speed": 30.0, "twist": 8.0}, ["twist = 8", "0.4"]),
        ({"mass": 2200.0, "speed": 30.0, "aircraft": "no such machine"}, ["no such machine"]),
        ({"mass": 2200.0, "speed": 30.0, "method": "bisection"}, ["bisection"]),
    ],
)
def test_bad_input_is_one_line(keywords, words):
    with pytest.raises(InputError) as caught:
        trim(**keywords)
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message, message


def test_trim_reaches_difficult_points_from_a_guess_or_without():
    near = MACHINE.trim(flight(2200.0, 30.0))
    far = MACHINE.trim(flight(1500.0, 68.0, altitude=1800.0), guess=near.solution)
    alone = MACHINE.trim(flight(1500.0, 68.0, altitude=1800.0))
    assert far.success and alone.success
    assert far.power == pytest.approx(alone.power, rel=1e-7)
    assert (far.stage, alone.stage) == ("guess", "momentum")


@pytest.mark.slow
def test_bulk_solver_and_ipopt_give_the_same_points():
    """The same root over the flyable box, by two unrelated solvers."""
    low = (1400.0, 0.0, 0.0, 0.9, 0.105)
    high = (2500.0, 2000.0, 60.0, 1.1, 0.279)
    for mass, altitude, speed, ratio, twist in qmc.scale(qmc.LatinHypercube(5, seed=11).random(10), low, high).tolist():
        where = flight(mass, speed, altitude=altitude, rotor_speed=ratio * NOMINAL, twist=twist)
        newton, ipopt = (MACHINE.trim(where, method=method).solution for method in ("newton", "ipopt"))
        assert newton.success and ipopt.success
        assert newton.values == pytest.approx(ipopt.values, abs=1e-7)
        for name in ("main_rotor_power", "tail_rotor_power", "induced_power", "profile_power", "thrust"):
            assert newton.outputs[name] == pytest.approx(ipopt.outputs[name], rel=1e-7)


@pytest.mark.slow
def test_one_tail_rotor_power_for_one_point():
    """Inside its limit the tail rotor has one power: approached from a heavier neighbour, or from nowhere.

    Near stall the teetering, coupled tail rotor has an attached and a stalled trim at once.
    """
    fast, neighbour, compared = {"rotor_speed": 0.9 * NOMINAL}, MACHINE.trim(flight(2500.0, 69.0, rotor_speed=40.0)), 0
    for mass in range(2500, 1899, -50):
        alone = point(float(mass), 69.0, **fast)
        neighbour = MACHINE.trim(flight(float(mass), 69.0, **fast), guess=neighbour.solution)
        if not (alone.success and neighbour.success) or alone.usages["tail rotor loading"] > 1:
            continue
        compared += 1
        assert neighbour.solution.outputs["tail_rotor_power"] == pytest.approx(alone.tail_rotor_power, rel=1e-4), mass
    slower = point(2150.0, 60.0, **fast)  # well inside: there is something to compare
    assert compared or slower.usages["tail rotor loading"] < 1


@pytest.mark.parametrize("mass", [2000.0, 2300.0])
def test_a_point_inside_all_limits_is_solved(mass):
    """Just inside the tail rotor's limit, beyond the fold of its attached branch."""
    result = point(mass, 69.0, rotor_speed=0.9 * NOMINAL)
    assert result.classification != "not converged", result.reason


@pytest.mark.slow
def test_thirty_scattered_points_are_solved_or_classified():
    low = (1400.0, 0.0, 0.0, 0.75, 0.105, -0.14, 1.0)
    high = (2500.0, 2000.0, 70.0, 1.15, 0.279, 0.14, 1.3)
    sample = qmc.scale(qmc.LatinHypercube(7, seed=3).random(30), low, high)
    flyable = 0
    for mass, altitude, speed, ratio, twist, climb_angle, load_factor in sample.tolist():
        if speed < 10:  # too slow for a steady turn
            load_factor = 1.0
        begun = time.process_time()
        result = point(
            mass,
            speed,
            altitude=altitude,
            rotor_speed=ratio * NOMINAL,
            twist=twist,
            climb_angle=climb_angle,
            load_factor=load_factor,
        )
        assert time.process_time() - begun < 20
        assert result.classification in CLASSES - {"not converged"}, result.message
        assert result.feasible == (result.classification == "ok") == (result.reason == "")
        flyable += result.feasible
        if result.success:
            powers = (result.main_rotor_power, result.tail_rotor_power, result.fuel_flow)
            assert np.all(np.isfinite(powers)) and result.tail_rotor_power > 0 and result.fuel_flow > 0
    assert flyable > 15


def test_loaded_once():
    assert helicopter("bo105") is MACHINE
    assert load_aircraft("bo105") is MACHINE.aircraft


def test_steep_descent_needs_no_less_than_idle_power():
    """Where the air drives the rotor the engines idle: as in a schedule, so in a single point."""
    point = trim(2500.0, 40.0, climb_angle=-0.33)
    assert point.success
    assert point.main_rotor_power + point.tail_rotor_power < 0
    assert point.shaft_power_per_engine == pytest.approx(0.07 * 313e3, rel=0.02)


def test_the_hash_of_the_data_counts_every_fit_of_the_combustor():
    other = Helicopter(MACHINE.aircraft)
    assert other.data_hash == MACHINE.data_hash
    changed = deepcopy(MACHINE.engine.variants)
    changed["wide_mixing"]["reactors"]["dilution_volume"]["value"] *= 0.99
    other.engine = MACHINE.engine.model_copy(update={"variants": changed})
    assert other.data_hash != MACHINE.data_hash


def test_what_one_engine_leaves_is_at_most_its_own_rating():
    weak = Helicopter(MACHINE.aircraft)
    weak.engine = MACHINE.engine.changed("ratings", take_off_power=200e3)
    assert MACHINE._one_engine_margin(150e3) - weak._one_engine_margin(150e3) == pytest.approx(83.9e3)
