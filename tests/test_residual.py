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
