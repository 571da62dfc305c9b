"""How a solve ended, in one vocabulary for all solvers."""

from __future__ import annotations

from enum import Enum


class Status(Enum):
    """The end of a solve. Only CONVERGED is a success; the text says what happened."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "iteration limit reached"
    NO_PROGRESS = "no progress: the step became too small"
    NOT_FINITE = "a value became infinite or not a number"
    OUT_OF_BOUNDS = "a root outside the bounds of an unknown"
    INFEASIBLE = "no root inside the bounds"

    def __str__(self) -> str:
        return self.value
