"""The flyable region over a surrogate's inputs: agreement with the physics' classes, arrays and CasADi alike."""

from collections import Counter
from importlib import resources

import numpy as np
import pytest

from vrsopt.atmosphere import GRAVITY
from vrsopt.errors import InputError
from vrsopt.flight import LARGEST_TURN_RATE, turn_rate
from vrsopt.helicopter import helicopter
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.surrogate.database import Database
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.region import USED, Region
from vrsopt.surrogate.space import FLIGHT, SPACES
from vrsopt.surrogate.store import load

MACHINE = helicopter()
LIMITS = Limits(MACHINE.aircraft, MACHINE.engine, "study")
# in the order in which the physics names the first limit that is broken
CLASSES = {
    "turn rate": "turn rate",
    "blade loading": "stalled",
    "tail rotor loading": "tail rotor",
    "engine power": "over power",
    "torque": "over torque",
    "turbine temperature": "over temperature",
}


def classes(region, usages):
    """Class of each point (k,) from its usages (m, k)."""
    found = np.full(usages.shape[1], "ok", dtype=object)
    for name in reversed([name for name in CLASSES if name in region.limit_names]):
        found[usages[region.limit_names.index(name)] > 1.0 + 1e-6] = CLASSES[name]
    return found


def shipped(space):
    """Inputs and classes of all sampled points that were solved, and the region of the surrogate."""
    prefix = "" if space == "level" else f"{space}_"
    files = resources.files("vrsopt") / "data"
    with resources.as_file(files / f"{prefix}design.db") as path, Database.open(path) as database:
        inputs, _ = database.arrays(flyable=False)
        status = np.array(database.status(), dtype=object)
    with resources.as_file(files / f"{prefix}surrogate.nc") as path:
        region = Region(load(path).models, LIMITS)
    solved = status != "not converged"
    return inputs[solved], status[solved], region


@pytest.fixture(scope="module")
def region():
    return shipped("level")[2]


@pytest.mark.parametrize("space", SPACES)
def test_agrees_with_the_physics_on_the_sampled_points(space):
    """Fitted on the flyable points alone, it tells the others from them; where it errs, a limit is near."""
    inputs, status, region = shipped(space)
    usages = region.usages(inputs)
    found = classes(region, usages)
    assert {"ok", "stalled", "tail rotor", "over power", "over temperature"} <= set(status)
    confusion = Counter(zip(status, found, strict=True))
    assert np.mean(found != status) < 0.002, confusion
    wrong = (found == "ok") != (status == "ok")
    assert np.all(np.abs(np.max(usages, axis=0)[wrong] - 1.0) < 0.01), confusion


def test_casadi_gives_the_same_with_exact_derivatives(region):
    points = region.models[USED[0]].state_.inputs[:3]
    function = region.function(3)
    assert np.array(function(points.T)) == pytest.approx(region.usages(points), rel=1e-10)
    jacobian = np.array(function.jacobian()(points.T, 0)).reshape(3, 5, 3, 5)  # node, limit; node, input
    for k, step in enumerate(2e-4 * np.ptp(region.models[USED[0]].state_.inputs, axis=0)):
        shift = np.eye(5)[k] * step
        slope = (region.usages(points + shift) - region.usages(points - shift)) / (2.0 * step)
        for node in range(3):
            assert jacobian[node, :, node, k] == pytest.approx(slope[:, node], rel=1e-4, abs=1e-4 * np.abs(slope).max())
    assert np.all(jacobian[0, :, 1] == 0.0)


@pytest.fixture(scope="module")
def flight_region():
    """Seven inputs, outputs of a kind: what is known in closed form is tested with them."""
    lower, upper = np.array(FLIGHT.lower), np.array(FLIGHT.upper)
    points = lower + (upper - lower) * np.random.default_rng(1).random((60, 7))
    values = dict(zip(USED, (3e2, 3e1, 5e-5, 0.5), strict=True))
    settings = {"names": FLIGHT.names, "lower": lower, "upper": upper, "theta": np.ones(7), "nugget": 1e-4}
    return Region(
        {name: Kriging(**settings).fit(points, value * points[:, 0]) for name, value in values.items()}, LIMITS
    )


def test_flight_counts_the_load_factor_as_weight(flight_region):
    straight = np.array([1500.0, 500.0, 40.0, 44.4, 0.14, 0.0, 1.0])
    turning = straight + 0.2 * np.eye(7)[6]
    usages = flight_region.usages(np.stack([straight, turning]))
    assert usages[0, 1] == pytest.approx(1.2 * usages[0, 0], rel=1e-3)


def test_flight_counts_turns_that_are_too_tight(flight_region):
    """On the limit where the trim refuses them."""
    assert flight_region.limit_names == (*LIMIT_NAMES, "turn rate")
    speed, climb_angle = 8.0, 0.1
    tightest = np.sqrt(1.0 + (LARGEST_TURN_RATE * speed * np.cos(climb_angle) / GRAVITY) ** 2)
    point = np.array([[1500.0, 500.0, speed, 44.4, 0.14, climb_angle, tightest]])
    assert flight_region.usages(point)[-1, 0] == pytest.approx(1.0, rel=1e-12)
    assert turn_rate(0.999 * tightest, speed, climb_angle) < LARGEST_TURN_RATE
    with pytest.raises(InputError, match="a turn of 1 rad/s"):
        turn_rate(1.001 * tightest, speed, climb_angle)
    assert np.array(flight_region.function(1)(point.T)) == pytest.approx(flight_region.usages(point), rel=1e-10)


def test_outputs_that_are_missing():
    with pytest.raises(InputError, match="region: main_rotor_power: missing"):
        Region({}, LIMITS)
