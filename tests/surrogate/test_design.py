"""The sampled physics of both spaces: what a record holds, its derivatives, and what can not be flown."""

import math

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.surrogate.database import Database
from vrsopt.surrogate.design import (
    BESIDE,
    OUTPUTS,
    PHYSICS,
    WITH_DERIVATIVES,
    add_points,
    evaluate_flight,
    evaluate_level,
    sample,
)
from vrsopt.surrogate.space import FLIGHT, LEVEL

CRUISE = {"mass": 2000.0, "altitude": 500.0, "speed": 35.0, "rotor_speed": 41.0, "twist": 0.15}
TURN = {**CRUISE, "climb_angle": 0.05, "load_factor": 1.1}
STEPS = {"speed": 0.05, "climb_angle": 5e-4, "load_factor": 5e-4}  # the inputs that load factor couples
RANGES = dict(zip(FLIGHT.names, np.subtract(FLIGHT.upper, FLIGHT.lower), strict=True))
STALLED = {**TURN, "mass": 2480.0, "altitude": 1900.0, "speed": 65.0, "rotor_speed": 32.0, "load_factor": 1.25}
WEAK_TAIL = {**TURN, "mass": 2450.0, "altitude": 1600.0, "speed": 3.0, "rotor_speed": 36.0, "load_factor": 1.0}


@pytest.fixture(scope="module")
def turn():
    return evaluate_flight(TURN)


@pytest.fixture(scope="module")
def level():
    return evaluate_level(CRUISE)


def test_outputs_of_the_spaces(turn):
    assert turn.status == "ok" and turn.reason == ""
    assert set(turn.outputs) == set(PHYSICS["flight"].outputs) == set(OUTPUTS)
    assert set(turn.derivatives) == set(WITH_DERIVATIVES) == set(OUTPUTS) - {"tail_blade_loading"}
    assert all(tuple(row) == FLIGHT.names for row in turn.derivatives.values())
    per_energy = turn.outputs["fuel_flow"] / (2 * turn.outputs["shaft_power_per_engine"])
    assert turn.outputs["specific_fuel_consumption"] == pytest.approx(per_energy, rel=1e-12)


@pytest.mark.parametrize("name", STEPS)
def test_derivatives_against_differences(turn, name):
    step = STEPS[name]
    low, high = (evaluate_flight({**TURN, name: TURN[name] + side * step}) for side in (-1, 1))
    for output in WITH_DERIVATIVES:
        difference = (high.outputs[output] - low.outputs[output]) / (2 * step)
        # near zero: relative to the output over the range of the input
        least = 1e-4 * abs(turn.outputs[output]) / RANGES[name]
        assert turn.derivatives[output][name] == pytest.approx(difference, rel=1e-3, abs=least), output


def test_level_flight_is_the_same_in_both_spaces(level):
    flight = evaluate_flight({**CRUISE, "climb_angle": 0.0, "load_factor": 1.0})
    assert set(level.outputs) == {*OUTPUTS, *BESIDE}
    assert {name: level.outputs[name] for name in OUTPUTS} == flight.outputs
    assert set(level.derivatives) == set(WITH_DERIVATIVES)
    assert all(tuple(row) == LEVEL.names for row in level.derivatives.values())
    assert flight.derivatives == {}  # a turn begins with the square root of the extra load
    slightly = evaluate_level({**CRUISE, "twist": CRUISE["twist"] + 1e-4})
    for name in WITH_DERIVATIVES:
        change = (slightly.outputs[name] - level.outputs[name]) / 1e-4
        assert level.derivatives[name]["twist"] == pytest.approx(change, rel=1e-2), name


def test_a_turn_too_tight_can_not_be_flown():
    record = evaluate_flight({**TURN, "speed": 2.0, "load_factor": 1.2})
    assert (record.status, record.outputs, record.derivatives) == ("turn rate", {}, {})
    assert record.reason == "load_factor = 1.2: at most 1.021 at 2 m/s, a turn of 1 rad/s"
    assert record.iterations == 0 and math.isnan(record.residual_norm)


def test_the_trim_of_what_can_not_be_flown_is_not_looked_for():
    stalled, tail = evaluate_flight(STALLED), evaluate_flight(WEAK_TAIL)
    assert stalled.status == "stalled" and stalled.outputs == {}
    assert stalled.reason.startswith("blade loading 0.") and stalled.reason.endswith("; its trim was not looked for")
    assert tail.status == "tail rotor" and tail.outputs == {}
    assert (
        tail.reason.startswith("tail-rotor blade loading 0.") and "times the largest allowed; its trim" in tail.reason
    )
    assert max(stalled.iterations, tail.iterations) < 120


def test_records_do_not_depend_on_the_order(level, turn):
    """Nothing is kept from point to point: not a start, not a factorisation."""
    assert evaluate_level(CRUISE) == level
    evaluate_flight(STALLED)
    assert evaluate_flight(TURN) == turn


def test_points_are_added_to_a_design_of_their_space(tmp_path, turn):
    path = tmp_path / "doe.db"
    sample(path, space="flight", samples=1, seed=4, workers=1)
    added = add_points(path, [[TURN[name] for name in FLIGHT.names]], workers=1)
    assert added.added == 1 and added.flyable == 2
    with Database.open(path) as design:
        assert (design.meta.space, design.meta.names, design.meta.outputs) == ("flight", FLIGHT.names, OUTPUTS)
        assert dict(zip(OUTPUTS, design.arrays()[1][-1], strict=True)) == turn.outputs
        slopes = design.derivatives()[-1, OUTPUTS.index("fuel_flow")]
        assert dict(zip(FLIGHT.names, slopes, strict=True)) == turn.derivatives["fuel_flow"]


def test_another_space_is_refused(tmp_path):
    with pytest.raises(InputError, match="sample: space = 'hover': one of level, flight"):
        sample(tmp_path / "doe.db", space="hover")


def test_spaces():
    assert FLIGHT.names[:5] == LEVEL.names and FLIGHT.lower[:5] == LEVEL.lower and FLIGHT.upper[:5] == LEVEL.upper
    assert np.degrees(FLIGHT.lower[5]) == pytest.approx(-8.0) and np.degrees(FLIGHT.upper[5]) == pytest.approx(8.0)
    assert (FLIGHT.lower[6], FLIGHT.upper[6]) == (1.0, 1.3)
