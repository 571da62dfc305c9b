"""What constraints and costs of users are made of, at the nodes of a mission: values and exact derivatives."""

import casadi as ca
import numpy as np
import pytest

from tests.schedule.test_surrogate_path import LIMITS, MACHINE, conditions
from vrsopt.atmosphere import standard_air
from vrsopt.errors import InputError
from vrsopt.limits import LIMIT_NAMES
from vrsopt.schedule.path_quantities import QUANTITY_NAMES
from vrsopt.schedule.surrogate_path import SurrogateAircraft
from vrsopt.surrogate import store

POINT = np.array([1900.0, 41.0, 0.18, 0.2])  # mass, rotor speed, twist, rate


@pytest.fixture(scope="module")
def path():
    """In flight, hovering, at flat pitch and at ground idle."""
    make = SurrogateAircraft(store.load("level"), LIMITS)
    return make(
        conditions([40.0, 0.0, 0.0, 0.0], 100.0, [0.1, 0, 0, 0], [1.1, 1, 1, 1], [0, 0, 1, 0], np.inf, [0, 0, 0, 1])
    )


@pytest.fixture(scope="module")
def node(path):
    """All quantities of one node (9,), their Jacobian and the Hessian of their weighted sum, about the point itself."""
    function, coefficients = path.function(QUANTITY_NAMES)
    z, centre, c = ca.SX.sym("z", 4), ca.SX.sym("centre", 4), ca.SX.sym("c", len(coefficients))
    value = function(*ca.vertsplit(z), c, centre)[2]
    weights = ca.SX.sym("weights", value.numel())
    parts = [value, ca.jacobian(value, z), ca.hessian(ca.dot(weights, value), z)[0]]
    at_point = ca.substitute(parts, [centre], [z])
    return ca.Function("quantities", [z, c, weights], at_point), coefficients


def quantities(path, node, k):
    function, coefficients = node
    value = function(POINT, coefficients[:, k], np.ones(len(QUANTITY_NAMES)))[0].full().ravel()
    return dict(zip(QUANTITY_NAMES, value.tolist(), strict=True))


@pytest.mark.parametrize("k", range(4))
def test_quantities_are_those_of_the_arrays(path, node, k):
    found = quantities(path, node, k)
    values = path.evaluate(*(np.full(4, value) for value in POINT))
    flows = path.emissions(values.fuel_flow[:, None], values.power_per_engine[:, None], POINT[1])
    assert found["power_per_engine"] == pytest.approx(values.power_per_engine[k], rel=1e-10)
    assert found["torque"] == pytest.approx(2 * values.power_per_engine[k] / POINT[1], rel=1e-10)
    for name in ("nox", "co", "co2"):
        assert found[name] == pytest.approx(flows[name][k, 0], rel=1e-9), name


def test_quantities_that_are_limited_are_at_their_limit_where_its_usage_is_one(path, node):
    found, usage = quantities(path, node, 0), path.evaluate(*(np.full(4, value) for value in POINT)).limits[:, 0] + 1
    usages = dict(zip(LIMIT_NAMES, usage, strict=True))
    assert found["turbine_temperature"] / LIMITS.temperature == pytest.approx(usages["turbine temperature"], rel=1e-9)
    assert found["torque"] / (2 * LIMITS.rated_power / 44.4) == pytest.approx(usages["torque"], rel=1e-9)
    loading = LIMITS.blade_loading(1.1 * POINT[0], standard_air(100.0, 0.0).density, POINT[1], 40.0)[0]
    assert found["blade_loading"] == pytest.approx(loading, rel=1e-9)
    drive, kinetic = MACHINE.aircraft.transmission, MACHINE.aircraft.main_rotor.polar_inertia * POINT[1] * POINT[3]
    shaft = drive.efficiency * (2 * found["power_per_engine"] - 1e3 * drive.accessory_power)
    assert found["rotor_power"] + kinetic == pytest.approx(shaft, rel=1e-3)


@pytest.mark.parametrize("k", range(4))
def test_derivatives_are_exact(node, k):
    function, coefficients = node
    scale = np.abs(function(POINT, coefficients[:, k], np.ones(8))[0].full().ravel()) + 1e-12
    weights, c = 1.0 / scale, coefficients[:, k]
    _, jacobian, hessian = (part.full() for part in function(POINT, c, weights))
    for i, step in enumerate((1.0, 0.01, 1e-3, 0.01)):
        high, low = POINT.copy(), POINT.copy()
        high[i] += step
        low[i] -= step
        above, below = (function(point, c, weights) for point in (high, low))
        slope = (above[0] - below[0]).full().ravel() / (2 * step)
        assert jacobian[:, i] / scale == pytest.approx(slope / scale, rel=1e-3, abs=1e-9)
        bend = (above[1] - below[1]).full().T @ weights / (2 * step)
        assert hessian[:, i] == pytest.approx(bend, rel=3e-3, abs=1e-5 * abs(hessian).max())


def test_order_is_that_asked_for_and_nothing_else_is_computed(path):
    """Without emissions no emission table; fuel flow and limits are the same with and without quantities."""
    plain, few = path.function(), path.function(("torque", "power_per_engine"))
    assert len(plain[1]) == len(few[1])
    c = few[1][:, 0]
    outputs = few[0](*POINT, c, POINT)
    assert outputs[2].full().ravel() == pytest.approx([2 * float(outputs[2][1]) / POINT[1], float(outputs[2][1])])
    for with_them, without in zip(outputs[:2], plain[0](*POINT, c, POINT), strict=True):
        np.testing.assert_array_equal(with_them.full(), without.full())


def test_an_unknown_quantity_is_refused(path):
    with pytest.raises(InputError, match="path model: quantity = 'noise': one of power_per_engine, rotor_power"):
        path.function(("nox", "noise"))
