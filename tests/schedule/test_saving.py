"""What saves fuel: the causes sum to what is saved, and are the known ones where these are known."""

from dataclasses import replace

import numpy as np
import pytest

from tests.schedule.test_verify import LIMITS, MACHINE, constant, flown, made, point
from vrsopt.schedule.saving import CAUSES, differences, saving
from vrsopt.schedule.shaft_power import PARTS, ShaftPower
from vrsopt.schedule.verify import fly_physics

CRUISE = {"speed": 35.0}


def powers(fuel, **parts):
    """One node with the same on both sides: parts [W] by name, and fuel flow as a function of their sum."""
    column = np.array([parts.get(name.replace(" ", "_"), 0.0) for name in PARTS])
    both = np.repeat(column[:, None, None], 2, axis=2)
    return ShaftPower(both, fuel(both.sum(axis=0)), np.ones((1, 2)))


def by_name(base, own, speed=0.0):
    found = differences(base, own, np.full((1, 2), speed))
    assert found.shape == (len(CAUSES), 1, 2)
    assert found.sum(axis=0) == pytest.approx(base.fuel_flow - own.fuel_flow, rel=1e-12)
    return dict(zip(CAUSES, found[:, 0, 0], strict=True))


def test_an_engine_of_constant_consumption_burns_less_for_what_needs_less():
    def flow(power):
        return 1e-7 * power

    base = powers(flow, induced=90e3, profile=100e3, tail_rotor=20e3, rest=10e3)
    own = powers(flow, induced=95e3, profile=70e3, tail_rotor=17e3, rest=10e3, rotor_energy=4e3)
    found = by_name(base, own)
    expected = {"induced": -5e-4, "profile": 30e-4, "tail rotor": 3e-4, "rotor energy": -4e-4}
    assert found == pytest.approx({name: expected.get(name, 0.0) for name in CAUSES}, abs=1e-15)


def test_an_engine_at_part_load_gives_back_what_it_burns_at_no_load():
    """Fuel flow a + b P: the consumption is a / P + b, and a is burned whatever the power."""
    a, b, before, after = 0.01, 6e-8, 300e3, 240e3
    base, own = (powers(lambda power: a + b * power, profile=power) for power in (before, after))
    found = by_name(base, own)
    mean = 0.5 * (a / before + a / after) + b
    assert found["profile"] == pytest.approx(mean * (before - after), rel=1e-12)
    assert found["engine load"] == pytest.approx(0.5 * (before + after) * a * (1 / before - 1 / after), rel=1e-12)
    assert found["engine load"] < 0.0 and found["turbine speed"] == 0.0


def test_a_better_engine_saves_what_its_consumption_says():
    base, own = powers(lambda power: 1.0e-7 * power, profile=2e5), powers(lambda power: 0.9e-7 * power, profile=2e5)
    found = by_name(base, own, speed=0.08e-7)
    assert found["turbine speed"] == pytest.approx(2e5 * 0.08e-7) and found["profile"] == 0.0
    assert found["engine load"] == pytest.approx(2e5 * 0.02e-7)


@pytest.fixture(scope="module")
def flights():
    """Nominal, and with a slower, more twisted rotor that speeds up on the way, on the same nodes: on the ground, in a
    cruise, in a descent with the engines near idle."""
    profile = made(
        ("idle", 30.0, {"idle": True}),
        ("cruise", 60.0, CRUISE),
        ("descent", 30.0, {"speed": 35.0, "equivalent_climb_angle": -0.13}),
    )
    nominal = MACHINE.aircraft.main_rotor.nominal_rotor_speed
    slower = replace(constant(profile, twist=0.2), rotor_speed=np.array([1.0, 1.0, 0.86, 0.9, 0.85, 0.85]) * nominal)
    return (
        profile,
        flown(profile, rotor_speed=nominal, twist=0.14),
        fly_physics(profile, slower, limits=LIMITS, takeoff_mass=1900.0, nodes=profile.grid()),
    )


def test_causes_sum_to_the_fuel_that_the_physics_saves(flights):
    profile, base, own = flights
    assert base.success and own.success, (base.message, own.message)
    found = saving(profile, LIMITS, base, own)
    assert found.fuel == pytest.approx(base.fuel - own.fuel, rel=1e-12)
    assert found.base.sum() == pytest.approx(base.fuel, rel=1e-12)
    assert sum(found.by_cause.values()) == pytest.approx(found.fuel, rel=1e-12)
    burned = base.mass[1::2] - own.mass[1::2]
    assert np.cumsum(found.per_segment) == pytest.approx(-burned, rel=1e-9, abs=1e-12)
    assert np.abs(found.causes[:, 0]).max() < 1e-12  # on the ground nothing is different


def test_causes_are_those_of_the_points_that_are_flown(flights):
    """In the middle of nothing but power: the parts are those of a trimmed point, and the engine is where it saves."""
    profile, base, own = flights
    there = point(base.mass[2], speed=35.0, rotor_speed=MACHINE.aircraft.main_rotor.nominal_rotor_speed, twist=0.14)
    drive = MACHINE.aircraft.transmission
    parts = dict(zip(PARTS, base.shaft_power.parts[:, 2, 0], strict=True))
    for name, value in there.powers.items():
        assert parts[name] * drive.efficiency == pytest.approx(value, rel=1e-5)
    assert base.shaft_power.total[2] == pytest.approx(2 * there.shaft_power_per_engine, rel=1e-6)
    assert parts["rest"] == pytest.approx(1e3 * drive.accessory_power, rel=0.05)  # and the blades' damping
    saved = dict(zip(CAUSES, saving(profile, LIMITS, base, own).causes[:, 1], strict=True))
    assert saved["profile"] > 0.0 and saved["rotor energy"] < 0.0  # it speeds up in the cruise
    assert saved["turbine speed"] * saved["engine load"] < 0.0
    descent = dict(zip(PARTS, base.shaft_power.parts[:, 5, 0], strict=True))
    assert descent["climb"] < 0.0 <= descent["engine idle"]


def test_the_turbine_speed_alone_saves_what_two_gas_paths_say():
    """A variable transmission: the same rotor, so the same power, and all that is saved is the turbine's."""
    profile = made(("cruise", 60.0, CRUISE))
    schedule = constant(profile, rotor_speed=MACHINE.aircraft.main_rotor.nominal_rotor_speed, twist=0.14)
    options = {"limits": LIMITS, "takeoff_mass": 1900.0, "nodes": profile.grid()}
    base, own = (fly_physics(profile, schedule, transmission=name, **options) for name in ("fixed", "variable"))
    found = saving(profile, LIMITS, base, own)
    assert found.fuel == pytest.approx(base.fuel - own.fuel, rel=1e-12) and found.fuel > 0.01
    assert found.by_cause["turbine speed"] == pytest.approx(found.fuel, rel=2e-3)  # the rest: less fuel burned, heavier


def test_flights_that_were_not_solved_or_not_the_same_are_not_compared(flights):
    profile, base, own = flights
    assert saving(profile, LIMITS, base, replace(own, shaft_power=None)) is None
    with pytest.raises(ValueError, match="different nodes"):
        saving(profile, LIMITS, base, replace(own, time=own.time + 1.0))
