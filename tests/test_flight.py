"""Flight conditions in the trim: coordinated turns, ground effect, shifted centre of gravity."""

from functools import cache

import casadi as ca
import numpy as np
import pytest

from vrsopt.aircraft import load_aircraft
from vrsopt.atmosphere import GRAVITY
from vrsopt.equilibrium import TrimEquations, trim_system
from vrsopt.errors import InputError
from vrsopt.flight import trim_parameters, turn_rate
from vrsopt.helicopter import trim
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.solution import Solution

AIRCRAFT = load_aircraft("bo105")
ROTOR = AIRCRAFT.main_rotor
SYSTEM = trim_system(AIRCRAFT)
LEVEL = {
    "mass": 2200.0,
    "altitude": 0.0,
    "isa_offset": 0.0,
    "climb_angle": 0.0,
    "load_factor": 1.0,
    "rotor_speed": ROTOR.nominal_rotor_speed,
    "twist": ROTOR.twist,
}


def trimmed(speed: float, **changes: float) -> Solution:
    return _trimmed(tuple({**LEVEL, "speed": speed, **changes}.items()))


@cache
def _trimmed(flight: tuple[tuple[str, float], ...]) -> Solution:
    solution = SYSTEM.solve(trim_parameters(AIRCRAFT, dict(flight)), method="newton")
    assert solution.success, solution.message
    return solution


def rotor_power(solution: Solution) -> float:
    return solution.outputs["main_rotor_power"] + solution.outputs["tail_rotor_power"]


# -- turns --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("speed, load_factor, climb_angle", [(30.0, 1.2, 0.0), (50.0, 1.5, 0.0), (40.0, 1.4, 0.1)])
def test_coordinated_turn(speed, load_factor, climb_angle):
    """tan(bank) = rate V cos(climb) / g, load factor 1 / cos(bank): the thrust carries weight and centripetal force."""
    rate = turn_rate(load_factor, speed, climb_angle)
    bank = np.arctan(rate * speed * np.cos(climb_angle) / GRAVITY)
    assert 1 / np.cos(bank) == pytest.approx(load_factor, rel=1e-12)
    level = trimmed(speed, climb_angle=climb_angle)
    turn = trimmed(speed, climb_angle=climb_angle, load_factor=load_factor)
    assert turn.outputs["load_factor"] == pytest.approx(load_factor, rel=1e-12)
    # in straight flight the tail rotor's thrust already rolls the aircraft a degree or two
    assert turn.values["roll"] - level.values["roll"] == pytest.approx(bank, abs=np.radians(2.0))
    ratio = turn.outputs["thrust"] / level.outputs["thrust"]
    assert ratio == pytest.approx(load_factor, rel=0.04)
    assert turn.outputs["blade_loading"] == pytest.approx(load_factor * level.outputs["blade_loading"], rel=1e-12)


@pytest.mark.parametrize(
    "speed, changes",
    [
        (30.0, {"load_factor": 1.2}),
        (50.0, {"load_factor": 1.5}),
        (40.0, {"load_factor": 1.8, "mass": 1800.0, "climb_angle": 0.08}),
    ],
)
def test_power_of_a_turn_is_the_sum_of_its_parts(speed, changes):
    """The rotating aircraft, its tilted rotor and the moments between them neither take nor give energy."""
    out = trimmed(speed, **changes).outputs
    names = ("induced", "profile", "parasite", "climb", "tail_rotor")
    whole = sum(out[f"{name}_power"] for name in names)
    total = out["main_rotor_power"] + out["tail_rotor_power"]
    assert whole == pytest.approx(total, rel=6e-3) and whole < total
    assert out["induced_power"] + out["profile_power"] + out["propulsive_power"] == pytest.approx(
        out["main_rotor_power"], rel=6e-3
    )


def test_a_turn_costs_induced_power_like_weight():
    """Induced power grows nearly with the square of the load factor; a heavier aircraft in straight flight needs about
    as much power. The turn is not exactly that: it rotates, and drags its tail rotor and fin sideways."""
    level, turn = trimmed(40.0, mass=2000.0), trimmed(40.0, mass=2000.0, load_factor=1.2)
    assert turn.outputs["induced_power"] / level.outputs["induced_power"] == pytest.approx(1.2**2, rel=0.08)
    assert rotor_power(turn) == pytest.approx(rotor_power(trimmed(40.0, mass=2400.0)), rel=0.03)


def test_turns_to_both_sides_differ_by_the_tail_rotor_and_the_sense_of_rotation_only():
    base = trim_parameters(AIRCRAFT, {**LEVEL, "speed": 40.0})
    right, left = (SYSTEM.solve({**base, "turn_rate": rate}, method="newton") for rate in (0.15, -0.15))
    assert right.success and left.success
    assert right.outputs["load_factor"] == left.outputs["load_factor"]
    assert rotor_power(left) == pytest.approx(rotor_power(right), rel=0.03)
    straight = trimmed(40.0).values["roll"]
    assert right.values["roll"] - straight == pytest.approx(straight - left.values["roll"], rel=0.05)


def test_air_turns_the_angular_momentum_of_the_rotor_and_the_mast_feels_the_rest():
    """Nose-up rate q in a right turn takes the roll moment N_b I Omega q, to the left if the rotor turns counter-
    clockwise from above: the air on the blades gives it, and hardly any of it reaches the mast."""
    equations = TrimEquations(AIRCRAFT, Fidelity())
    loads = equations.rotor.loads
    parts = ca.Function(
        "parts",
        [equations.x, equations.p],
        [
            equations.rates,
            *(equations.to_body @ part for part in (loads.angular_momentum, loads.moment, loads.mast_moment)),
        ],
    )

    def at(solution: Solution) -> list[np.ndarray]:
        x = [solution.values[unknown.name] for unknown in equations.unknowns]
        return [np.array(value).ravel() for value in parts(x, SYSTEM.vector(solution.parameters))]

    turn, straight = trimmed(30.0, load_factor=1.4), trimmed(30.0)
    rates, momentum, moment, mast = at(turn)
    _, _, steady, _ = at(straight)
    spin = ROTOR.blades * ROTOR.flap_inertia * ROTOR.nominal_rotor_speed
    assert rates[1] > 0.1  # the nose rises in a banked turn
    tilt = np.radians(ROTOR.shaft_tilt_forward)
    assert momentum == pytest.approx([spin * np.sin(tilt), 0.0, -spin * np.cos(tilt)], abs=0.06 * spin)
    rolling = np.cross(rates, momentum)[0]
    assert rolling == pytest.approx(-spin * rates[1], rel=0.1)
    assert moment[0] - steady[0] < -0.5 * spin * rates[1]
    assert mast == pytest.approx(moment - np.cross(rates, momentum))
    assert abs(mast[0]) < 0.15 * spin * rates[1]
    assert turn.outputs["hub_roll_moment"] == pytest.approx(mast @ [np.cos(tilt), 0.0, np.sin(tilt)])


@pytest.mark.parametrize(
    "load_factor, speed, words",
    [(0.9, 30.0, "at least 1"), (1.2, 0.5, "at most 1.001 at 0.5 m/s"), (1.2, 0.0, "at most 1.000")],
)
def test_a_load_factor_without_a_turn_is_refused(load_factor, speed, words):
    with pytest.raises(InputError, match=words):
        turn_rate(load_factor, speed)
    with pytest.raises(InputError, match="load_factor = "):
        trim(2200.0, speed, load_factor=load_factor)
    assert turn_rate(1.0, 0.0) == 0.0


# -- ground -------------------------------------------------------------------------------------------------------


def test_ground_saves_power_the_more_the_nearer():
    """Least at rest close to the ground; the induced power at one thrust falls by (1 - (R / 4 z)^2)^(3/2)."""
    heights = (0.6, 0.8, 1.0, 1.5, 3.0)  # hub above ground over the radius
    hover = [rotor_power(trimmed(0.0, ground_proximity=1 / z)) for z in heights] + [rotor_power(trimmed(0.0))]
    assert np.all(np.diff(hover) > 0)
    assert hover[4] == pytest.approx(hover[5], rel=0.01)
    for z in (0.8, 1.0):
        near, far = trimmed(0.0, ground_proximity=1 / z).outputs, trimmed(0.0).outputs
        thrust = (near["thrust"] / far["thrust"]) ** 1.5
        expected = (1 - (1 / (4 * z)) ** 2) ** 1.5 * thrust
        assert near["induced_power"] / far["induced_power"] == pytest.approx(expected, rel=0.01)


def test_ground_effect_fades_with_speed():
    savings = [
        1 - rotor_power(trimmed(speed, ground_proximity=1.0)) / rotor_power(trimmed(speed))
        for speed in (0.0, 8.0, 15.0, 30.0)
    ]
    assert np.all(np.diff(savings) < 0)
    assert savings[0] > 0.05 and 0 <= savings[3] < 0.005


def test_hub_height_is_what_the_public_verb_takes():
    height = 1.2 * ROTOR.radius
    near = trim(2200.0, 0.0, hub_height=height, method="newton")
    assert near.main_rotor_power == pytest.approx(
        trimmed(0.0, ground_proximity=1 / 1.2).outputs["main_rotor_power"], rel=1e-6
    )
    with pytest.raises(InputError, match="hub_height = 1: at least"):
        trim(2200.0, 0.0, hub_height=1.0)


# -- centre of gravity --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("speed", [0.0, 40.0])
def test_centre_of_gravity_forward_lowers_the_nose_and_loads_the_hub(speed):
    """The moment of the weight against hub moment, N_b / 2 (nu^2 - 1) I Omega^2 per tilt of the disc, and the thrust
    at the hub's height: the disc stays level, the aircraft tilts under it."""
    shift, weight = 0.1, 2200 * GRAVITY
    aft, forward = trimmed(speed, cg_shift=-shift), trimmed(speed, cg_shift=shift)
    tilt = aft.values["pitch"] - forward.values["pitch"]
    # An elastic blade bends less inboard than a hinged one: with the first mode of the beam, 1.1156 per revolution, the
    # same tilt of the tips makes 0.88 of the moment. The trim, which has more than this mode, tilts 8 to 17 % more.
    stiffness = 0.88 * ROTOR.blades / 2 * (1.1156**2 - 1) * ROTOR.flap_inertia * ROTOR.nominal_rotor_speed**2
    expected = weight * 2 * shift / (stiffness + weight * ROTOR.hub_height)
    assert expected < tilt < 1.2 * expected
    change = forward.outputs["hub_pitch_moment"] - aft.outputs["hub_pitch_moment"]
    assert change == pytest.approx(stiffness * expected, rel=0.03)
    assert forward.values["longitudinal_cyclic"] > aft.values["longitudinal_cyclic"]  # stick back
    assert rotor_power(forward) == pytest.approx(rotor_power(aft), rel=0.03)


def test_tail_rotor_needs_less_with_the_centre_of_gravity_forward():
    """A longer arm from the centre of gravity to the tail."""
    aft, forward = trimmed(0.0, cg_shift=-0.2), trimmed(0.0, cg_shift=0.2)
    assert forward.outputs["tail_thrust"] < aft.outputs["tail_thrust"]
