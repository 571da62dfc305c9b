"""Vertical flight, flight that speeds up, and turns to the left, in the trim."""

from functools import cache

import numpy as np
import pytest

from vrsopt.aircraft import load_aircraft
from vrsopt.atmosphere import GRAVITY, standard_air
from vrsopt.equilibrium import TrimEquations, trim_system
from vrsopt.flight import trim_parameters
from vrsopt.residual import ResidualSystem
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.solution import Solution

AIRCRAFT = load_aircraft("bo105")
ROTOR = AIRCRAFT.main_rotor
SYSTEM = trim_system(AIRCRAFT)
HOVER = {
    "mass": 2000.0,
    "altitude": 0.0,
    "isa_offset": 0.0,
    "speed": 0.0,
    "climb_angle": 0.0,
    "load_factor": 1.0,
    "rotor_speed": ROTOR.nominal_rotor_speed,
    "twist": ROTOR.twist,
}


def trimmed(**changes: float) -> Solution:
    return _trimmed(tuple(changes.items()))


@cache
def _trimmed(changes: tuple[tuple[str, float], ...]) -> Solution:
    solution = SYSTEM.solve(trim_parameters(AIRCRAFT, {**HOVER, **dict(changes)}), method="newton")
    assert solution.success, solution.message
    return solution


def rotor_power(solution: Solution) -> float:
    return solution.outputs["main_rotor_power"] + solution.outputs["tail_rotor_power"]


@pytest.mark.parametrize("rate", [-2.0, 1.0, 2.0, 4.0, 6.0])
def test_induced_and_climb_power_of_a_vertical_climb_are_those_of_momentum_theory(rate):
    """P = T (w / 2 + sqrt(w^2 / 4 + v_h^2)); the induced part alone carries the factor for what the mean leaves out."""
    area, density = np.pi * ROTOR.radius**2, standard_air(0.0).density
    hover, climb = trimmed().outputs, trimmed(vertical_speed=rate).outputs
    at_rest = np.sqrt(hover["thrust"] / (2 * density * area))
    factor = hover["induced_power"] / (hover["thrust"] * at_rest)
    assert 1.0 < factor < 1.25
    v_h = np.sqrt(climb["thrust"] / (2 * density * area))
    induced = factor * climb["thrust"] * (np.sqrt(rate**2 / 4 + v_h**2) - rate / 2)
    assert climb["induced_power"] == pytest.approx(induced, rel=0.035)
    assert climb["climb_power"] == pytest.approx(HOVER["mass"] * GRAVITY * rate, rel=1e-12)


@pytest.mark.parametrize("rate", [-3.0, 2.0, 6.0])
def test_power_of_a_vertical_climb_is_the_sum_of_its_parts(rate):
    out = trimmed(vertical_speed=rate).outputs
    whole = sum(out[f"{name}_power"] for name in ("induced", "profile", "parasite", "climb", "tail_rotor"))
    assert whole == pytest.approx(out["main_rotor_power"] + out["tail_rotor_power"], rel=2e-3)


def test_one_climb_in_two_descriptions():
    """A speed along a climb angle, and its forward and upward parts."""
    speed, angle = 12.0, 0.2
    one = trimmed(speed=speed, climb_angle=angle)
    other = trimmed(speed=speed * np.cos(angle), vertical_speed=speed * np.sin(angle))
    assert rotor_power(one) == pytest.approx(rotor_power(other), rel=2e-4)  # the roll makes a little sideslip
    assert one.outputs["climb_power"] == pytest.approx(other.outputs["climb_power"], rel=1e-12)


def test_derivative_by_the_vertical_speed():
    point = trim_parameters(AIRCRAFT, {**HOVER, "vertical_speed": 2.0})
    base, h = SYSTEM.solve(point, method="newton"), 0.02
    exact = SYSTEM.sensitivities(base)["main_rotor_power"]["vertical_speed"]
    high, low = (
        SYSTEM.solve({**point, "vertical_speed": 2.0 + s}, base, method="newton").outputs["main_rotor_power"]
        for s in (h, -h)
    )
    assert exact == pytest.approx((high - low) / (2 * h), rel=1e-5)


def accelerating(acceleration: float) -> ResidualSystem:
    """The trim with an inertial acceleration [m/s2] along the flight, in the balance and in what the blades feel."""

    class Accelerating(TrimEquations):
        @property
        def acceleration(self):
            return super().acceleration + acceleration * self.velocity / self.value["speed"]

    return Accelerating(AIRCRAFT, Fidelity()).system("accelerating")


@pytest.mark.parametrize(("acceleration", "speed"), [(1.0, 20.0), (-1.5, 15.0), (0.5, 55.0)])
def test_level_flight_that_speeds_up_is_a_steady_climb_of_a_heavier_aircraft(acceleration, speed):
    """Only the specific force counts: sqrt(1 + (a/g)^2) times the mass, climbing at atan(a/g). The blades' own weight,
    which the heavier aircraft does not share, makes the small difference."""
    flight = {**HOVER, "mass": 1900.0, "speed": speed}
    ratio = acceleration / GRAVITY
    steady = trimmed(mass=1900.0 * np.hypot(1.0, ratio), speed=speed, climb_angle=float(np.arctan(ratio)))
    inertial = accelerating(acceleration).solve(trim_parameters(AIRCRAFT, flight), steady.values, method="newton")
    assert inertial.success, inertial.message
    assert rotor_power(inertial) == pytest.approx(rotor_power(steady), rel=1e-6)
    assert inertial.values["collective"] == pytest.approx(steady.values["collective"], abs=1e-5)
    assert steady.values["pitch"] - inertial.values["pitch"] == pytest.approx(np.arctan(ratio), abs=2e-3)


def test_a_turn_to_the_left():
    right, left = (trimmed(speed=35.0, load_factor=1.2, turn=turn) for turn in (1.0, -1.0))
    assert left.parameters["turn_rate"] == -right.parameters["turn_rate"] < 0
    assert left.outputs["load_factor"] == right.outputs["load_factor"]
    assert left.values["roll"] < 0 < right.values["roll"]
    assert rotor_power(left) == pytest.approx(rotor_power(right), rel=0.03)
