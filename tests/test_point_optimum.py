"""The optimum of the physics at a point: better than its neighbours, within all limits, its multipliers are slopes."""

import numpy as np
import pytest

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.helicopter import helicopter
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.point_optimum import physics_optimum

MACHINE = helicopter("bo105")
ROTOR = MACHINE.aircraft.main_rotor
LIMITS = Limits(MACHINE.aircraft, MACHINE.engine, "manual", 1.3)


def test_no_allowed_neighbour_burns_less():
    """A climb whose optimum is on the blade loading with the twist free inside its bounds."""
    best = physics_optimum(1850.0, 35.0, altitude=400.0, climb_angle=0.05)
    assert best.success and best.residual_norm < 1e-6 and abs(best.solved_again) < 1e-6
    assert best.cpu_s < 2.0 and best.fuel_flow < 0.9 * best.nominal_fuel_flow
    assert max(best.usages.values()) < 1.0 + 1e-6 and list(best.usages) == list(LIMIT_NAMES)
    assert list(best.multipliers) == ["blade loading"] and best.multipliers["blade loading"] > 0.0
    assert str(best).splitlines()[4] == "active           blade loading" and "result           optimal" in str(best)
    flat = []
    for speed, twist in ((0.01, 0.0), (0.0, 0.01), (0.0, -0.01), (0.01, 0.01), (-0.01, 0.0)):
        flight = {**best.flight, "rotor_speed": best.rotor_speed * (1 + speed), "twist": best.twist + twist}
        trim = MACHINE.trim(flight)
        engine = MACHINE.engine_state(MACHINE.aircraft.transmission.power_per_engine(trim.power), flight)
        usages = MACHINE.usages(flight, trim.solution, engine, engine.outputs["power"], LIMITS)
        more = 2 * engine.outputs["fuel_flow"] / best.fuel_flow - 1
        if speed < 0.0:
            assert usages["blade loading"] > 1.01
        else:
            assert more > 0.0
            flat.append(more)
    assert flat[1] < 1e-3 and flat[2] < 1e-3  # the twist: of second order
    wider = physics_optimum(1850.0, 35.0, altitude=400.0, climb_angle=0.05, manoeuvre_margin=1.3 / 1.01)
    fall = (best.fuel_flow - wider.fuel_flow) / 0.01
    assert best.multipliers["blade loading"] == pytest.approx(fall, rel=0.03)


def test_one_variable_alone_and_bounds():
    """Held variables are nominal; a bound that is active has a multiplier; no limit but the bound in a light hover."""
    twist = physics_optimum(1900.0, 40.0, variables="twist")
    assert twist.success and twist.rotor_speed == ROTOR.nominal_rotor_speed and not twist.multipliers
    assert np.radians(8.0) < twist.twist < np.radians(16.0)
    narrow = physics_optimum(
        1600.0, 0.0, rotor_speed_bounds=(40.0, 44.4), twist_bounds=(ROTOR.twist, np.radians(10.0)), setting="study"
    )
    assert narrow.success and narrow.rotor_speed == pytest.approx(40.0, rel=1e-6)
    assert set(narrow.multipliers) == {"rotor speed at its lower bound", "twist at its upper bound"}
    assert all(value > 0.0 for value in narrow.multipliers.values())


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"variables": "none"}, r"variables = 'none': one of both, speed, twist"),
        ({"setting": "x"}, r"setting = 'x': one of manual, study"),
        ({"setting": ["manual"]}, r"setting = \['manual'\]: one of"),
        ({"manoeuvre_margin": float("nan")}, r"manoeuvre_margin = nan: a number from 1 to 2"),
        ({"manoeuvre_margin": "1.3"}, r"manoeuvre_margin = '1\.3': a number from 1 to 2"),
        (
            {"rotor_speed_bounds": (45.0, 40.0)},
            r"rotor_speed_bounds = \(45\.0, 40\.0\): lower, upper, numbers in order",
        ),
        ({"rotor_speed_bounds": (0, 1000)}, r"rotor_speed_bounds = \(0, 1000\): .* from 22\.2 to 57\.72$"),
        ({"rotor_speed_bounds": 5}, r"rotor_speed_bounds = 5: lower, upper"),
        ({"rotor_speed_bounds": ()}, r"rotor_speed_bounds = \(\): lower, upper"),
        ({"twist_bounds": (0.1,)}, r"twist_bounds = \(0\.1,\): lower, upper"),
        ({"twist_bounds": (0.1, float("nan"))}, r"twist_bounds = \(0\.1, nan\): lower, upper"),
        ({"mass": "a"}, r"mass = 'a': a number from 500 to 5000"),
        ({"mass": -5}, r"mass = -5: a number from 500 to 5000"),
        ({"speed": -40.0}, r"speed = -40\.0: a number from 0 to 90"),
        ({"altitude": None}, r"altitude = None: a number from -500 to 6000"),
        ({"altitude": "5"}, r"altitude = '5': a number from -500 to 6000"),
    ],
)
def test_refused_input(changed, message):
    """One line, that names the field, its value and what is allowed."""
    with pytest.raises(InputError, match=f"^optimum of the physics: {message}") as caught:
        physics_optimum(**{"mass": 1900.0, "speed": 40.0, **changed})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("aircraft", [5, None, ["bo105"], b"bo105", "none"])
def test_refused_aircraft(aircraft):
    with pytest.raises(InputError, match="^aircraft = .*: a .* path to a .toml file") as caught:
        physics_optimum(1900.0, 40.0, aircraft=aircraft)
    assert repr(aircraft) in str(caught.value)


@pytest.mark.slow
def test_limits_that_can_not_be_met_are_named():
    """A climb that no rotor makes within the rated power: no success, and the message says which limit."""
    none = physics_optimum(2400.0, 45.0, climb_angle=0.25)
    assert not none.success and "% of its limit" in none.message
    with pytest.raises(NoSolutionError, match="no trim to start from"):
        physics_optimum(2500.0, 70.0, altitude=2000.0, climb_angle=0.1)
