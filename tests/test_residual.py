"""Residual systems: both solvers, derivatives, embedding, and what a failure says."""

import casadi as ca
import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.residual import TOLERANCE, Named, ResidualSystem, Unknown
from vrsopt.solvers.status import Status


def duct(lower: float = 0.0) -> ResidualSystem:
    """Hover momentum theory with a loss: thrust = 2 rho A v (v + k), power = thrust (v + k)."""
    x, p = ca.SX.sym("x", 2), ca.SX.sym("p", 2)
    velocity, power = ca.vertsplit(x)
    thrust, loss = ca.vertsplit(p)
    return ResidualSystem(
        name="duct",
        unknowns=(
            Unknown("velocity", "m/s", scale=10.0, lower=lower, upper=100.0, start=20.0),
            Unknown("power", "W", scale=1e5, start=1e5),
        ),
        parameters=(Named("thrust", "N"), Named("loss", "m/s")),
        residuals=(Named("momentum", scale=1e4), Named("power", scale=1e5)),
        outputs=(Named("power", "W"), Named("velocity squared", "m2/s2")),
        x=x,
        p=p,
        r=ca.vertcat(thrust - 2 * 1.225 * 75.0 * velocity * (velocity + loss), power - thrust * (velocity + loss)),
        y=ca.vertcat(power, velocity**2),
    )


def closed_form(thrust: float, loss: float) -> float:
    return -loss / 2 + np.sqrt(loss**2 / 4 + thrust / (2 * 1.225 * 75.0))


@pytest.mark.parametrize("method", ["ipopt", "newton"])
def test_both_solvers_reach_the_closed_form(method):
    solution = duct().solve({"thrust": 21575.0, "loss": 1.5}, method=method)
    assert solution.success and solution.status is Status.CONVERGED
    assert solution.residual_norm < TOLERANCE
    assert solution.values["velocity"] == pytest.approx(closed_form(21575.0, 1.5), rel=1e-8)


def test_sensitivities_equal_resolved_differences():
    system = duct()
    base = {"thrust": 21575.0, "loss": 1.5}
    exact = system.sensitivities(system.solve(base, method="newton"))
    for name, step in {"thrust": 10.0, "loss": 1e-3}.items():
        high = system.solve({**base, name: base[name] + step}, method="newton").outputs
        low = system.solve({**base, name: base[name] - step}, method="newton").outputs
        for output in high:
            assert exact[output][name] == pytest.approx((high[output] - low[output]) / (2 * step), rel=1e-5)


def test_sensitivities_of_some_outputs_by_some_parameters():
    system = duct()
    solution = system.solve({"thrust": 21575.0, "loss": 1.5}, method="newton")
    every = system.sensitivities(solution)
    some = system.sensitivities(solution, outputs=("velocity squared",), parameters=("loss",))
    assert list(some) == ["velocity squared"] and list(some["velocity squared"]) == ["loss"]
    assert some["velocity squared"]["loss"] == pytest.approx(every["velocity squared"]["loss"], rel=1e-14)


def test_embedded_function_has_the_same_root_and_derivative():
    system = duct()
    solution = system.solve({"thrust": 21575.0, "loss": 1.5}, method="newton")
    function = system.function()
    y, _, residual = function([21575.0, 1.5], [2.0, 1.0])
    assert float(residual) < TOLERANCE
    assert float(y[0]) == pytest.approx(solution.outputs["power"], rel=1e-8)
    p, z0 = ca.MX.sym("p", 2), ca.DM([2.0, 1.0])
    slope = ca.Function("slope", [p], [ca.jacobian(function(p, z0)[0], p)])([21575.0, 1.5])
    assert float(slope[0, 0]) == pytest.approx(system.sensitivities(solution)["power"]["thrust"], rel=1e-7)


def test_neighbouring_solution_is_reused_without_a_new_jacobian():
    system = duct()
    first = system.solve({"thrust": 21575.0, "loss": 1.5}, method="newton")
    second = system.solve({"thrust": 21800.0, "loss": 1.5}, first, method="newton")
    assert second.success
    assert second.factorisation is first.factorisation


def test_continuation_goes_through_folds():
    """x^3 - 3 x = load: from the left branch to load 3, which only the right branch has."""
    x, p = ca.SX.sym("x"), ca.SX.sym("p", 2)
    spring = ResidualSystem(
        name="spring",
        unknowns=(Unknown("length", "m", scale=0.5, lower=-10.0, upper=10.0, start=-3.0),),
        parameters=(Named("load", "N"), Named("stiffness", "N/m")),
        residuals=(Named("balance", "N", 5.0),),
        outputs=(Named("length", "m"),),
        x=x,
        p=p,
        r=p[1] * (x**3 - 3 * x) - p[0],
        y=x,
    )
    start = spring.solve({"load": -6.0, "stiffness": 1.0}, method="newton")
    branch = spring.follow(start, {"load": 3.0, "stiffness": 1.0})
    assert branch.solution.success and branch.furthest == 1.0 and branch.jacobians <= 25
    assert branch.solution.values["length"] == pytest.approx(2.1038034, abs=1e-6)
    assert branch.solution.parameters == {"load": 3.0, "stiffness": 1.0}
    assert [-6 + fold * 9 for fold in branch.folds] == pytest.approx([2.0, -2.0], abs=0.1)
    both = spring.follow(start, {"load": 6.0, "stiffness": 2.0})  # two parameters on one straight way
    assert both.solution.values["length"] == pytest.approx(2.1038034, abs=1e-6)
    ended = spring.follow(start, {"load": 3.0, "stiffness": 1.0}, max_jacobians=5)
    assert not ended.solution.success and ended.solution.status is Status.ITERATION_LIMIT
    assert "% of the way" in ended.solution.message and ended.furthest < 1


def test_continuation_ends_at_a_bound():
    system = duct(lower=10.0)
    start = system.solve({"thrust": 100e3, "loss": 0.0}, method="newton")
    branch = system.follow(start, {"thrust": 5e3, "loss": 0.0})
    assert branch.solution.status is Status.OUT_OF_BOUNDS and branch.folds == ()
    assert branch.solution.residual_norm < TOLERANCE  # the last point of the curve solves its own parameters


def test_smallest_singular_value_vanishes_at_a_fold():
    """Momentum theory folds where v = -loss / 2: d(thrust)/dv is zero there."""
    system = duct()
    normal = system.solve({"thrust": 21575.0, "loss": 1.5}, method="newton")
    slope = -2 * 1.225 * 75.0 * (2 * normal.values["velocity"] + 1.5) * 10 / 1e4
    matrix = np.array([[slope, 0.0], [-21575.0 * 10 / 1e5, 1.0]])
    expected = np.linalg.svd(matrix)[1][-1]
    assert system.smallest_singular_value(normal) == pytest.approx(expected, rel=1e-9)
    assert system.smallest_singular_value(normal, exact=False) == pytest.approx(expected, rel=0.1)
    folded = system.solve({"thrust": 1e-7, "loss": 0.0}, {"velocity": 1e-5, "power": 0.0}, method="newton")
    assert system.smallest_singular_value(folded) < 1e-4 * expected


def test_failure_names_equation_and_bound():
    bounded = duct(lower=50.0)
    solution = bounded.solve({"thrust": 21575.0, "loss": 1.5}, method="ipopt")
    assert not solution.success
    assert "momentum" in solution.message and "velocity" in solution.message
    newton = bounded.solve({"thrust": 21575.0, "loss": 1.5}, method="newton")
    assert not newton.success and newton.status is Status.OUT_OF_BOUNDS
    with pytest.raises(InputError, match="no derivatives at a failed solution"):
        bounded.sensitivities(newton)


def test_no_root_is_no_success():
    solution = duct().solve({"thrust": -1e6, "loss": 0.0}, method="newton")
    assert not solution.success and solution.residual_norm > TOLERANCE


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"thrust": 1.0}, "duct: loss: missing"),
        ({"thrust": 1.0, "loss": 0.0, "swirl": 2.0}, "duct: unknown parameter 'swirl'"),
        ({"thrust": float("nan"), "loss": 0.0}, "duct: thrust = nan: a finite number"),
    ],
)
def test_bad_parameters_are_named(parameters, message):
    with pytest.raises(InputError, match=message):
        duct().solve(parameters)
