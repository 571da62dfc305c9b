"""Derivatives of the operating point through trim, drive train, gas path and combustor, against points solved again."""

import math
from dataclasses import replace

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.flight import turn_rate
from vrsopt.helicopter import helicopter
from vrsopt.limits import Limits
from vrsopt.operating_point import OperatingPoint

MACHINE = helicopter("bo105")
LIMITS = Limits(MACHINE.aircraft, MACHINE.engine)
STEPS = {
    "mass": 4.0,
    "altitude": 20.0,
    "speed": 0.1,
    "rotor_speed": 0.1,
    "twist": 2e-3,
    "climb_angle": 1e-3,
    "load_factor": 5e-3,
    "isa_offset": 0.5,
}
LEVEL = {
    "mass": 2100.0,
    "altitude": 400.0,
    "isa_offset": 5.0,
    "speed": 35.0,
    "climb_angle": 0.0,
    "load_factor": 1.0,
    "rotor_speed": 42.0,
    "twist": 0.15,
}


def solved(flight: dict[str, float], engines: int | None, near: OperatingPoint | None = None) -> OperatingPoint:
    guess = None if near is None else near.solution
    point = MACHINE.point(flight, limits=LIMITS, guess=guess, engines_operating=engines)
    assert point.success, point.message
    return point


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "engines"),
    [
        ({}, None),
        ({"load_factor": 1.25, "climb_angle": 0.04, "speed": 45.0}, None),
        ({"speed": 5.0, "altitude": 1500.0, "isa_offset": 20.0, "rotor_speed": 44.4}, None),
        ({"climb_angle": -0.05, "mass": 1700.0}, 1),
    ],
    ids=["level", "climbing turn", "slow, hot and high", "one engine, descent"],
)
def test_against_points_solved_again(changes, engines):
    flight = {**LEVEL, **changes}
    point = solved(flight, engines)
    slopes = point.derivatives()

    def numbers(**new: float) -> np.ndarray:
        near = solved({**flight, **new}, engines, point)
        return np.array([getattr(near, name) for name in slopes])

    for name, h in STEPS.items():
        exact = np.array([slopes[output][name] for output in slopes])
        if name == "load_factor" and flight[name] == 1.0:
            assert np.isnan(exact).all()
            continue
        near, far = (
            (numbers(**{name: flight[name] + s}) - numbers(**{name: flight[name] - s})) / (2 * s) for s in (h, 2 * h)
        )
        for output, ours, theirs in zip(slopes, exact, (4 * near - far) / 3, strict=True):
            size = abs(getattr(point, output) / max(abs(flight[name]), 100 * h))
            assert ours == pytest.approx(theirs, rel=1e-5, abs=1e-6 * size), (output, name)


def test_a_turn_begins_with_its_rate():
    """In straight flight the derivative by rate of turn is the slope that turns of either side share."""
    slope = solved(LEVEL, None).derivatives()["fuel_flow"]["turn_rate"]
    speed, rates = LEVEL["speed"], []
    for load_factor in (1.0 + 1e-6, 1.0 + 4e-6):
        rate = turn_rate(load_factor, speed)
        turning = solved({**LEVEL, "load_factor": load_factor}, None)
        rates.append((turning.fuel_flow - solved(LEVEL, None).fuel_flow) / rate)
    assert slope == pytest.approx(2 * rates[0] - rates[1], rel=1e-3)


def test_what_may_be_differentiated():
    slopes = solved({**LEVEL, "load_factor": 1.1}, None).derivatives()
    assert {"main_rotor_power", "tail_rotor_power", "shaft_power_per_engine", "fuel_flow", "nox", "co", "co2"} <= set(
        slopes
    )
    assert all(math.isfinite(value) for row in slopes.values() for value in row.values())
    with pytest.raises(InputError, match="no derivatives of a point that was not solved: stuck"):
        replace(solved(LEVEL, None), success=False, message="stuck").derivatives()


def test_without_a_combustor_the_other_derivatives_are_left():
    point = MACHINE.point(LEVEL, limits=LIMITS)
    whole, rest = point.derivatives(), replace(point, nox=math.nan).derivatives()
    assert all(math.isnan(value) for value in rest["nox"].values())
    assert rest["fuel_flow"]["mass"] == whole["fuel_flow"]["mass"]
