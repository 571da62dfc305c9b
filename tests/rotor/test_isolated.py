"""The rotor alone against momentum theory and the ground-effect formula; hover tests: tests/test_validation_page.py."""

from functools import cache, partial
from math import pi, radians

import numpy as np
import pytest
from scipy.optimize import brentq

from vrsopt.aircraft import load_aircraft
from vrsopt.rotor.airfoil import load_section
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.rotor.isolated import conditions, isolated_system, model_rotor

SPEED_OF_SOUND = 340.294
hover_rotor = partial(model_rotor, load_aircraft().main_rotor, load_section("naca_0012"))


@cache
def system(case: str, passage: bool = False):
    """The rotor and its system: a rotor test, or the main rotor of the aircraft."""
    if case == "caradonna-tung":
        rotor = hover_rotor(radius=1.143, chord=0.191, tip_speed=0.439 * SPEED_OF_SOUND, root_cutout=0.167)
    elif case == "harrington":
        rotor = hover_rotor(radius=3.81, chord=0.027 * pi * 3.81 / 2, tip_speed=152.4, root_cutout=0.16)
    else:
        rotor = load_aircraft().main_rotor
    fidelity = Fidelity(highest_harmonic=3, highest_shape=5, blade_passage=passage, dynamic_stall=False)
    return rotor, isolated_system(rotor, fidelity)


def outputs(case: str, passage: bool = False, **given: float) -> dict[str, float]:
    rotor, residuals = system(case, passage)
    solution = residuals.solve(conditions(rotor, **given), method="newton")
    assert solution.success, solution.message
    return solution.outputs


def test_caradonna_tung_tip_mach_number():
    assert outputs("caradonna-tung", collective=0.1)["tip_mach"] == pytest.approx(0.439, abs=1e-4)


@pytest.mark.parametrize("climb_speed", [0.0, 5.0, 15.0])
def test_momentum_theory_in_axial_flight(climb_speed):
    """Mean induced flow -c / 2 + sqrt(c^2 / 4 + C_T / 2); the power can not be less than the ideal induced and climb
    power."""
    rotor, _ = system("aircraft")
    given = {"collective": radians(8 + 0.35 * climb_speed), "speed": climb_speed, "shaft_angle": -pi / 2}
    out = outputs("aircraft", **given)
    tip_speed = rotor.nominal_rotor_speed * rotor.radius
    c = climb_speed / tip_speed
    ideal = -c / 2 + np.sqrt(c**2 / 4 + out["thrust_coefficient"] / 2)
    assert out["mean_induced_velocity"] / tip_speed == pytest.approx(ideal, rel=0.015)
    assert 1.0 < out["induced_power"] / (out["thrust"] * ideal * tip_speed) < 1.17
    parts = out["induced_power"] + out["profile_power"] + out["thrust"] * climb_speed
    # the section's moment turns with the coned blade: a few parts in ten thousand
    assert out["power"] == pytest.approx(parts, rel=1e-3)


@pytest.mark.parametrize(
    ("height", "ratio"), [(0.5, 1.3333), (0.8, 1.1082), (1.0, 1.0667), (1.5, 1.0286), (2.0, 1.0159)]
)
def test_ground_effect_at_constant_induced_power(height, ratio):
    """Thrust near the ground over that far from it, of the elastic rotor with all its inflow states."""
    far = outputs("aircraft", collective=radians(8))

    def excess(collective: float) -> float:
        near = outputs("aircraft", collective=collective, ground_proximity=1 / height)
        return near["induced_power"] / far["induced_power"] - 1

    collective = brentq(excess, radians(7.5), radians(11), xtol=1e-6)
    near = outputs("aircraft", collective=collective, ground_proximity=1 / height)
    assert near["thrust"] / far["thrust"] == pytest.approx(ratio, rel=0.002)


def test_thrust_of_a_turned_shaft():
    """A stiff rotor in a wind tunnel: thrust rises as the shaft turns back into the wind, with force aft as well."""
    thrust = [
        outputs("harrington", collective=radians(6), speed=30.0, shaft_angle=radians(angle))["thrust"]
        for angle in (-5, 0, 5)
    ]
    assert thrust[0] < thrust[1] < thrust[2]


def test_stiff_blade_hardly_moves():
    rotor, residuals = system("caradonna-tung")
    values = residuals.solve(conditions(rotor, collective=radians(8)), method="newton").values
    assert all(abs(v) < 5e-4 for name, v in values.items() if not name.startswith("inflow"))
