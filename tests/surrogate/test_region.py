"""The flyable region over a surrogate's inputs: agreement with the physics' classes, arrays and CasADi alike."""

from collections import Counter
from importlib import resources

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.helicopter import helicopter
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.schedule.study_input import loaded
from vrsopt.surrogate.database import Database
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.region import USED, Region
from vrsopt.surrogate.space import FLIGHT

MACHINE = helicopter()
LIMITS = Limits(MACHINE.aircraft, MACHINE.engine, "study")
# in the order in which the physics names the first limit that is broken
CLASSES = {
    "blade loading": "stalled",
    "tail rotor loading": "tail rotor",
    "engine power": "over power",
    "torque": "over torque",
    "turbine temperature": "over temperature",
}


def classes(usages):
    """Class of each point (k,) from its usages (5, k)."""
    found = np.full(usages.shape[1], "ok", dtype=object)
    for name in reversed(CLASSES):
        found[usages[LIMIT_NAMES.index(name)] > 1.0 + 1e-6] = CLASSES[name]
    return found


@pytest.fixture(scope="module")
def region():
    return Region(loaded(None, MACHINE.data_hash).models, LIMITS)


def test_agrees_with_the_physics_on_the_sampled_points(region):
    """Fitted on the flyable points alone, it tells the others from them; where it errs, a limit is near."""
    with resources.as_file(resources.files("vrsopt") / "data" / "design.db") as path, Database.open(path) as database:
        inputs, _ = database.arrays(flyable=False)
        status = np.array(database.status(), dtype=object)
    usages = region.usages(inputs)
    found, solved = classes(usages), status != "not converged"
    confusion = Counter(zip(status[solved], found[solved], strict=True))
    wrong = {pair: count for pair, count in confusion.items() if pair[0] != pair[1]}
    assert sum(wrong.values()) < 0.005 * len(status), confusion
    assert {"ok", "stalled", "tail rotor", "over power"} <= set(status)
    near = np.min(np.abs(usages - 1.0), axis=0)[solved & (found != status)]
    assert np.all(near < 0.01), wrong
    assert np.all(found[~solved] != "ok")


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


def test_flight_counts_the_load_factor_as_weight():
    """Blade loading is known in closed form: that of a turn is that of the heavier aircraft in level flight."""
    rng = np.random.default_rng(1)
    points = np.array(FLIGHT.lower) + (np.array(FLIGHT.upper) - np.array(FLIGHT.lower)) * rng.random((60, 7))
    box = {"names": FLIGHT.names, "lower": FLIGHT.lower, "upper": FLIGHT.upper}
    values = {"main_rotor_power": 3e5, "tail_rotor_power": 3e4, "tail_blade_loading": 0.05}
    values["power_turbine_inlet_temperature"] = 900.0
    given = {"theta": np.ones(7), "nugget": 1e-4}
    models = {name: Kriging(**box, **given).fit(points, value * points[:, 0]) for name, value in values.items()}
    straight, turning = points[:1].repeat(2, axis=0)
    straight[[0, 6]], turning[[0, 6]] = (1500.0, 1.0), (1500.0, 1.2)
    usages = Region(models, LIMITS).usages(np.stack([straight, turning]))
    assert usages[0, 1] == pytest.approx(1.2 * usages[0, 0], rel=1e-3)


def test_outputs_that_are_missing():
    with pytest.raises(InputError, match="region: main_rotor_power: missing"):
        Region({}, LIMITS)
