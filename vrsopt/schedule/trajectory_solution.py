"""What comes out of the whole-mission problem."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vrsopt.schedule.mesh import Mesh
from vrsopt.schedule.schedule import Schedule
from vrsopt.solvers.status import Status


@dataclass(frozen=True)
class Arc:
    """A stretch of time [s] within a task on which the same limits and bounds are active, by name."""

    start: float
    end: float
    task: str
    active: tuple[str, ...]


@dataclass(frozen=True)
class Trajectory:
    """Solution of the whole-mission problem; N intervals, n nodes of the schedule.

    ``fuel`` [kg] burned and ``mass`` (n,) [kg] at the nodes; ``mesh`` and ``transcription``: how it was discretised,
    ``mesh_error`` (N,) [kg]: fuel of each interval less that of a finer quadrature; ``rounds``: meshes it was solved
    on. ``costates``: (N,) by state; ``limit_multipliers`` (N,) by limit or constraint, ``bound_multipliers`` (n,) or
    (N,) by variable or rate [objective per unit]; ``integrals`` [their units] and ``integral_multipliers`` [objective
    per unit]: of constraints over the mission, by name; ``arcs``: what is active when. ``x``, ``lam_x``, ``lam_g``:
    unknowns and multipliers of the NLP [scaled], for a warm start; ``cost_factor`` scales the cost in it [-],
    ``regularisation`` is what the penalty on the rates adds to the objective, ``max_residual`` the largest scaled
    residual; ``iterations`` of IPOPT; ``build_s`` and ``solve_s``: time [s].

    Without success ``schedule`` is IPOPT's last iterate, ``message`` names what it could not meet. Multipliers and
    costates are derivatives of ``objective``: kg of fuel, or units of a cost of one's own.
    """

    schedule: Schedule
    fuel: float  # kg, as the NLP integrates it
    objective: float  # kg, or of the cost of one's own; without the penalty on the rates
    mass: np.ndarray  # kg at the nodes of ``schedule``
    mesh: Mesh
    transcription: str
    # (N,) objective still to come per kg more of ``mass``, per rad/s more of ``rotor_speed`` and rad of ``twist``, at
    # the end of each interval
    costates: dict[str, np.ndarray]
    # name -> (N,) fall of the objective per unit by which a limit (usage) or constraint is raised all over an interval,
    # the sum of the multipliers of its rows there; negative for a lower bound. Over the mission: the sum of all
    limit_multipliers: dict[str, np.ndarray]
    # likewise of the bounds: rotor_speed, twist (n,) at the nodes, rotor_speed_rate, twist_rate (N,)
    bound_multipliers: dict[str, np.ndarray]
    integrals: dict[str, float]  # values of constraints on integrals, in their units
    integral_multipliers: dict[str, float]
    arcs: tuple[Arc, ...]  # the switching structure
    mesh_error: np.ndarray  # (N,) kg, fuel of each interval minus that of a finer quadrature
    x: np.ndarray  # unknowns and multipliers of the NLP, for a warm start
    lam_x: np.ndarray
    lam_g: np.ndarray
    cost_factor: float  # of the cost in the NLP
    regularisation: float  # what the penalty on the rates adds to the objective
    max_residual: float  # scaled
    iterations: int
    build_s: float
    solve_s: float
    success: bool
    status: Status
    message: str
    rounds: int = 1  # meshes it was solved on; iterations and times are those of all of them

    def save(self, path: Path | str) -> None:
        """Write it to a NetCDF file that :func:`vrsopt.load_trajectory` reads.

        An existing file is replaced at once or, on an error, not at all. Raises InputError if ``path`` can not be
        written.
        """
        from vrsopt.schedule.trajectory_file import save_trajectory

        save_trajectory(path, self)
