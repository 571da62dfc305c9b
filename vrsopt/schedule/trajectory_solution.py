"""What comes out of the whole-mission problem."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vrsopt.schedule.mesh import Mesh
from vrsopt.schedule.schedule import Schedule
from vrsopt.solvers.status import Status


@dataclass(frozen=True)
class Trajectory:
    """Solution of the whole-mission problem; N intervals, m limits.

    Without success ``schedule`` is IPOPT's last iterate, ``message`` names what it could not meet.
    """

    schedule: Schedule
    fuel: float  # kg, as the NLP integrates it
    mass: np.ndarray  # kg at the nodes of ``schedule``
    mesh: Mesh
    # (N,) kg of fuel still to be burned per kg more of mass, at the end of each interval; nan with a cost of one's own
    mass_costate: np.ndarray
    limit_multipliers: dict[str, np.ndarray]  # name -> (N,) largest multiplier of a limit in each interval
    regularisation: float  # kg, what the penalty on the rates adds to the objective
    max_residual: float  # scaled
    iterations: int
    build_s: float
    solve_s: float
    success: bool
    status: Status
    message: str
    rounds: int = 1  # meshes it was solved on; iterations and times are those of all of them
