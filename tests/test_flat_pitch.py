"""Rotors at flat pitch on the ground: section drag, density, rotor speed; nothing is lifted."""

import numpy as np
import pytest

from vrsopt.aircraft import load_aircraft
from vrsopt.atmosphere import standard_air
from vrsopt.flat_pitch import flat_pitch_power, flat_pitch_system
from vrsopt.helicopter import trim

AIRCRAFT = load_aircraft("bo105")
ROTOR = AIRCRAFT.main_rotor
NOMINAL = ROTOR.nominal_rotor_speed


def test_flat_pitch_power_is_that_of_the_section_drag():
    """Untwisted: sigma c_d / 8 (1 - cut-out^4), by the drag level; compressibility adds less than a tenth."""
    place = {"altitude": 0.0, "isa_offset": 0.0, "twist": 0.0}
    outputs = []
    for speed in (NOMINAL, 0.8 * NOMINAL):
        solution = flat_pitch_system(AIRCRAFT).solve({**place, "rotor_speed": speed}, method="newton")
        assert solution.success
        tip = speed * ROTOR.radius
        disc = standard_air(0.0).density * np.pi * ROTOR.radius**2 * tip**3
        analytic = ROTOR.solidity * ROTOR.section_drag_level / 8 * (1 - ROTOR.root_cutout**4) * disc
        assert 1.0 < solution.outputs["main_rotor_power"] / analytic < 1.10
        outputs.append(solution.outputs["main_rotor_power"])
    assert outputs[1] / outputs[0] == pytest.approx(0.8**3, rel=0.05)
    twisted = flat_pitch_system(AIRCRAFT).solve({**place, "twist": 0.14, "rotor_speed": NOMINAL}, method="newton")
    assert twisted.outputs["main_rotor_power"] > outputs[0]


def test_flat_pitch_power_follows_density():
    low, high = (flat_pitch_power(AIRCRAFT, altitude=h) for h in (0.0, 2000.0))
    assert high / low == pytest.approx(standard_air(2000.0).density / standard_air(0.0).density, rel=0.02)
    hover = trim(2200.0, 0.0, method="newton")
    assert low < 0.3 * (hover.main_rotor_power + hover.tail_rotor_power)


def test_flat_pitch_carries_nothing_and_cones_by_inertia_alone():
    """No lift: the blade lies along what centrifugal force and weight leave of its precone, bent down."""
    state = {"altitude": 0.0, "isa_offset": 0.0, "twist": ROTOR.twist, "rotor_speed": NOMINAL}
    solution = flat_pitch_system(AIRCRAFT).solve(state, method="newton")
    precone = np.radians(ROTOR.precone)
    assert -1.1 * precone * ROTOR.radius < solution.values["flap1"] < -0.6 * precone * ROTOR.radius
    assert abs(solution.values["collective"]) < np.radians(2.5)
    assert abs(solution.values["lag1"]) < 0.05
