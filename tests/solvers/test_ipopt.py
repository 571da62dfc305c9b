"""IPOPT's options and the words of its end."""

import casadi as ca
import pytest

from vrsopt.solvers.ipopt import ipopt_options, ipopt_status
from vrsopt.solvers.status import Status


def solve(constraint, **settings) -> Status:
    x = ca.SX.sym("x")
    solver = ca.nlpsol("s", "ipopt", {"x": x, "f": (x - 2) ** 2, "g": constraint(x)}, ipopt_options(**settings))
    solver(x0=0.5, lbg=0, ubg=0, lbx=-10, ubx=10)
    return ipopt_status(solver.stats())


def test_success_and_failures_have_words(capfd):
    assert solve(lambda x: x**3 - 8) is Status.CONVERGED
    assert solve(lambda x: x**2 + 1) is Status.INFEASIBLE
    assert solve(lambda x: x**3 - 8, max_iter=1) is Status.ITERATION_LIMIT
    assert capfd.readouterr().out == ""  # quiet


def test_settings_win_over_defaults():
    options = ipopt_options(print_level=3, tol=1e-5)["ipopt"]
    assert options["print_level"] == 3 and options["tol"] == 1e-5 and options["linear_solver"] == "mumps"


def test_unknown_end_is_no_success():
    assert ipopt_status({"return_status": "Something_New"}) is Status.NO_PROGRESS


@pytest.mark.parametrize("status", list(Status))
def test_statuses_print_as_a_phrase(status):
    assert str(status) == status.value and "_" not in str(status)
