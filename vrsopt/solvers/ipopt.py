"""IPOPT as every part of the package calls it: quiet, with MUMPS, and with its status in words."""

from __future__ import annotations

from typing import Any

from vrsopt.solvers.status import Status

_WORDS = {
    "Solve_Succeeded": Status.CONVERGED,
    "Solved_To_Acceptable_Level": Status.CONVERGED,
    "Feasible_Point_Found": Status.CONVERGED,
    "Infeasible_Problem_Detected": Status.INFEASIBLE,
    "Maximum_Iterations_Exceeded": Status.ITERATION_LIMIT,
    "Maximum_CpuTime_Exceeded": Status.ITERATION_LIMIT,
    "Search_Direction_Becomes_Too_Small": Status.NO_PROGRESS,
    "Restoration_Failed": Status.INFEASIBLE,
    "Invalid_Number_Detected": Status.NOT_FINITE,
}

_EXPLAINED = {
    "Infeasible_Problem_Detected": "came to a point where the constraints can not be met any better",
    "Maximum_Iterations_Exceeded": "ran out of iterations",
    "Maximum_CpuTime_Exceeded": "ran out of time",
    "Maximum_WallTime_Exceeded": "ran out of time",
    "Search_Direction_Becomes_Too_Small": "made no progress: its steps became too small",
    "Restoration_Failed": "could not find its way back towards the constraints",
    "Invalid_Number_Detected": "met a value that is infinite or not a number",
    "Diverging_Iterates": "followed unknowns that grow without bound",
    "Error_In_Step_Computation": "could not compute a step",
    "Not_Enough_Degrees_Of_Freedom": "found fewer unknowns than equations",
    "Invalid_Option": "was given an option that it does not know, or a value that is not allowed",
}


def ipopt_words(stats: dict[str, Any]) -> str:
    """How IPOPT ended, in words; the subject is IPOPT.

    ``stats``: of CasADi's solver.
    """
    found = str(stats["return_status"])
    return _EXPLAINED.get(found, found.replace("_", " ").lower())


def ipopt_options(**settings: Any) -> dict[str, Any]:
    """Options for ``casadi.nlpsol``; ``settings`` are IPOPT's own names and win over the defaults here."""
    defaults = {"print_level": 0, "sb": "yes", "linear_solver": "mumps"}
    return {
        "ipopt": {**defaults, **settings},
        "print_time": False,
        "error_on_fail": False,
        "show_eval_warnings": False,
        "record_time": False,
    }


def ipopt_status(stats: dict[str, Any]) -> Status:
    """IPOPT's return status as :class:`Status`; anything unknown counts as no progress.

    CasADi takes an interrupt (Ctrl-C) for itself and stops IPOPT: it is raised again here. ``stats``: of CasADi's
    solver.
    """
    if stats["return_status"] in ("User_Requested_Stop", "NonIpopt_Exception_Thrown"):
        raise KeyboardInterrupt
    return _WORDS.get(stats["return_status"], Status.NO_PROGRESS)
