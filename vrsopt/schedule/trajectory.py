"""The schedule of least fuel over the whole mission: one direct-collocation NLP with bounded rates.

Built once and solved again and again: take-off mass, rates, accelerations, bounds, limits and ends are bounds and
parameters of the NLP. The transcription is in :mod:`vrsopt.schedule.transcription`, the rows in
:mod:`vrsopt.schedule.rows`, the bounds in :mod:`vrsopt.schedule.bounds`.
The fuel it reports is the NLP's own; fuel that is compared comes from flying the schedule on the fine grid.
"""

from __future__ import annotations

import time as clock
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from vrsopt.errors import InputError
from vrsopt.schedule import solution as results
from vrsopt.schedule import transcription as tr
from vrsopt.schedule.additions import Additions, extended
from vrsopt.schedule.bounds import Bounds, Box, Corridor, LimitBounds, check_structure, row_bounds, unknown_bounds
from vrsopt.schedule.diagnosis import ACCEPTED_RESIDUAL, diagnose
from vrsopt.schedule.labels import column_labels
from vrsopt.schedule.layout import FUEL_SCALE, make_layout
from vrsopt.schedule.maps import make_maps
from vrsopt.schedule.mesh import Mesh, MeshOptions, make_mesh
from vrsopt.schedule.nlp import assemble, node_functions
from vrsopt.schedule.nominal import nominal_schedule
from vrsopt.schedule.path_model import PathModelFactory
from vrsopt.schedule.quadrature_error import FinerQuadrature
from vrsopt.schedule.rows import Discretisation, make_rows
from vrsopt.schedule.schedule import Schedule, ScheduleSettings
from vrsopt.schedule.start import COLD, WARM, start_on, still_felt, within_rates
from vrsopt.schedule.trajectory_solution import Arc, Trajectory
from vrsopt.schedule.transcription import Transcription
from vrsopt.solvers.ipopt import ipopt_options, ipopt_status
from vrsopt.solvers.status import Status

if TYPE_CHECKING:
    from vrsopt.mission.profile import Profile

OPTIONS = {"acceptable_iter": 0, "nlp_scaling_method": "none", "max_iter": 300}
# The barrier leaves a share of the objective that grows with the tolerance and the number of rows
TOLERANCE, TOLERANCE_INTERVALS = 1e-7, 200
__all__ = ["Arc", "Corridor", "Trajectory", "TrajectoryProblem"]


class TrajectoryProblem:
    """The NLP of a mission: built once, solved for any take-off mass, rates, bounds and limits.

    ``points``: pairs of segment and time at which the aircraft ``model`` is evaluated; ``nodes``: those of a schedule;
    ``rows`` and ``columns``: labels of g and x; ``nlp``: its functions.
    """

    def __init__(
        self,
        profile: Profile,
        make_path_model: PathModelFactory,
        *,
        settings: ScheduleSettings | None = None,
        mesh: MeshOptions | Mesh | None = None,
        transcription: Transcription = "hermite_simpson",
        shared: bool = True,
        additions: Additions | None = None,
        regularisation: float = 1e-6,
        ipopt: Mapping[str, Any] | None = None,
    ) -> None:
        """A rate of ``None`` in ``settings`` lets the variable jump between segments. In idle both are nominal.

        ``shared``: the aircraft is evaluated once where two intervals meet, else for each, as a point of its own.
        ``additions`` are constraints and a cost of one's own. ``regularisation`` is the weight, on fuel in units of 100
        kg, of the mean square of the rates over their limits. ``ipopt`` are options by IPOPT's own names.
        """
        begin = clock.perf_counter()
        same = {"settings": settings, "shared": shared, "additions": additions, "regularisation": regularisation}
        self._as_made: dict[str, Any] = {**same, "transcription": transcription, "ipopt": ipopt}
        self.profile, self.settings, self.transcription = profile, settings or ScheduleSettings(), transcription
        self.additions, self.make_path_model = additions or Additions(), make_path_model
        self.mesh = mesh if isinstance(mesh, Mesh) else make_mesh(profile, mesh, settings=self.settings)
        method = tr.method_of(transcription)
        self.nodes, self._at = tr.make_nodes(self.mesh)
        places = tr.make_places(self.mesh, method, shared=shared)
        self.points = places.points
        conditions = profile.conditions(self.points.segment, self.points.time)
        self.model = make_path_model(conditions)
        self._extended = extended(self.model, conditions, self.additions)
        kinds, counts = np.unique(places.rates, return_counts=True)
        nodes = [node_functions(self._extended.function, rates) for rates in kinds.tolist()]
        self.evaluations = places.with_outputs(nodes[0].outputs)
        self.discretisation = Discretisation(
            self.mesh,
            method,
            make_layout(self.mesh, self.settings, method.shares),
            self.evaluations,
            np.asarray(profile.conditions(self.mesh.segment, self.mesh.start).idle),
            tuple(segment.task for segment in profile.segments),
        )
        rows = make_rows(
            self.discretisation, self.settings, self.model.limit_names, self.additions, nodes[0].depends_on_rate
        )
        self.rows, self.columns = rows.labels, column_labels(self.mesh, self.discretisation.layout)
        self._maps = make_maps(
            self.discretisation,
            rows,
            mass_changes=profile.mass_changes,
            regularisation=regularisation,
            cost=None if self.additions.cost is None else nodes[0].outputs - 1,
        )
        self.nlp = assemble(list(zip(nodes, counts.tolist(), strict=True)), self._maps)
        self._ipopt = {"tol": TOLERANCE * min(1.0, TOLERANCE_INTERVALS / len(self.mesh)), **(ipopt or {})}
        self._solvers: dict[bool, Any] = {}
        self._solver(warm=False)
        self.build_s = clock.perf_counter() - begin

    def on(self, mesh: Mesh) -> TrajectoryProblem:
        """The same problem on another mesh; itself on its own."""
        return (
            self
            if mesh.equals(self.mesh)
            else TrajectoryProblem(self.profile, self.make_path_model, mesh=mesh, **self._as_made)
        )

    @cached_property
    def _box(self) -> Box:
        """Bounds of the mass wherever the aircraft is evaluated."""
        e, count = self.evaluations, len(self.points.time)
        _, lead = np.unique(e.point, return_index=True)
        layout = self.discretisation.layout
        lightest, heaviest = (np.broadcast_to(bound, count) for bound in self.model.bounds["mass"])
        place = layout.fuel[e.interval[lead], np.searchsorted(layout.shares, e.share[lead])]
        return Box(place, self._maps.constant[e.state_row[lead]], lightest, heaviest)

    @cached_property
    def finer(self) -> FinerQuadrature:
        """The aircraft at the points of a better quadrature than the transcription's."""
        return FinerQuadrature(self.profile, self.make_path_model, self.discretisation)

    def _solver(self, *, warm: bool) -> Any:
        if warm not in self._solvers:
            options = ipopt_options(**{**OPTIONS, **(WARM if warm else COLD), **self._ipopt})
            functions: dict[str, Any] = {"jac_g": self.nlp.jacobian, "hess_lag": self.nlp.hessian}
            options |= {"calc_lam_p": False, "no_nlp_grad": True}
            try:
                self._solvers[warm] = ca.nlpsol("trajectory", "ipopt", self.nlp.problem, {**options, **functions})
            except RuntimeError as error:  # of an option or its value
                told = str(error).strip().splitlines()[-1]
                raise InputError(f"trajectory: ipopt = {self._as_made['ipopt']}: {told}") from None
        return self._solvers[warm]

    def unburned(self, takeoff_mass: float) -> np.ndarray:
        """Mass (N,) [kg] in each interval but for the fuel burned."""
        return takeoff_mass + np.cumsum(self.profile.mass_changes)[self.mesh.segment]

    def parameters(
        self, takeoff_mass: float, *, cost_factor: float = 1.0, coefficients: np.ndarray | None = None
    ) -> ca.DM:
        """Parameters p of the NLP; ``coefficients`` (n_c, P) replace those of the path model at ``points``."""
        p = ca.DM(self._p) if coefficients is None else self._parameters(coefficients)
        p[0], p[1] = takeoff_mass, cost_factor
        return p

    @cached_property
    def _p(self) -> ca.DM:
        return self._parameters(None)

    def _parameters(self, coefficients: np.ndarray | None) -> ca.DM:
        """Parameters but for the first two; so many that handing them to CasADi takes longer than using them."""
        columns = self._extended.with_own(coefficients)[:, self.evaluations.order]
        return ca.DM(np.concatenate([[0.0, 0.0], columns.ravel(order="F")]))

    def bounds(
        self,
        takeoff_mass: float,
        *,
        settings: ScheduleSettings | None = None,
        limits: LimitBounds | None = None,
        corridor: Corridor | None = None,
    ) -> Bounds:
        """Bounds of x and g, see :meth:`solve`."""
        settings = settings or self.settings
        check_structure(self.settings, settings)
        allowed = settings.box(self.model.bounds)
        lower, upper = unknown_bounds(
            self.discretisation,
            self._box,
            takeoff_mass,
            settings=settings,
            allowed=allowed,
            nodes=self._at,
            corridor=corridor or Corridor(),
        )
        return Bounds(lower, upper, *row_bounds(self.rows, settings, self.additions, limits))

    def start(
        self,
        schedule: Schedule | None,
        takeoff_mass: float,
        *,
        settings: ScheduleSettings | None = None,
        coefficients: np.ndarray | None = None,
    ) -> tuple[np.ndarray, ca.DM]:
        """Start x on ``schedule`` (nominal if none is given), and p with the factor on the cost that suits it."""
        settings = settings or self.settings
        schedule = schedule or nominal_schedule(self.profile, settings)
        p = self.parameters(takeoff_mass, coefficients=coefficients)
        x, p[1] = start_on(schedule, self.discretisation, self.nlp, self._maps, p, settings)
        return x, p

    def inputs(self, x: np.ndarray, takeoff_mass: float) -> np.ndarray:
        """Mass [kg], rotor speed [rad/s], twist [rad] and charged rate [rad/s2] (4, M) of all ``evaluations``."""
        e, z = self.evaluations, self._maps.inputs @ x + self._maps.constant + takeoff_mass * self._maps.takeoff
        return np.stack([*(z[e.state_row + k] for k in range(tr.STATES)), z[e.rate_row]])

    def schedule(self, x: np.ndarray, takeoff_mass: float) -> tuple[Schedule, np.ndarray]:
        """Schedule of any x, and the mass [kg] at its nodes."""
        return results.scheduled(self.discretisation, self.nodes, self._at, x, self.unburned(takeoff_mass))

    def solve(
        self,
        takeoff_mass: float,
        initial: Schedule | Trajectory | None = None,
        *,
        settings: ScheduleSettings | None = None,
        limits: LimitBounds | None = None,
        corridor: Corridor | None = None,
        coefficients: np.ndarray | None = None,
    ) -> Trajectory:
        """Least fuel from ``takeoff_mass`` [kg], started on ``initial`` (nominal if none is given).

        A trajectory of this problem starts it with its multipliers, another one with its schedule. ``settings`` replace
        those the problem was built with, except for what changes its structure: limited or not, credit, periodic.
        ``limits``: other bounds of limits and constraints by name. ``corridor`` narrows the bounds of rotor speed and
        twist at the ``nodes``. ``coefficients`` (n_c, P) replace those of the path model at ``points``.
        Raises InputError for what can not be changed and for a mass outside the bounds of the aircraft's model.
        """
        begin = clock.perf_counter()
        settings = settings or self.settings
        bounds = self.bounds(takeoff_mass, settings=settings, limits=limits, corridor=corridor)
        warm = isinstance(initial, Trajectory) and self._knows(initial)
        first = within_rates(initial.schedule, settings) if isinstance(initial, Trajectory) else initial
        x0, p = self.start(first, takeoff_mass, settings=settings, coefficients=coefficients)
        arguments: dict[str, Any] = {**bounds.arguments(), "x0": x0}
        if isinstance(initial, Trajectory) and warm:
            ratio = float(p[1]) / initial.cost_factor if self.additions.cost is not None else 1.0  # of the objective
            arguments |= {"lam_x0": ratio * still_felt(initial.lam_x, x0, bounds), "lam_g0": ratio * initial.lam_g}
        solver, wasted = self._solver(warm=warm), 0
        values = solver(p=p, **arguments)
        if warm and ipopt_status(solver.stats()) is not Status.CONVERGED:  # its multipliers have led astray
            wasted, solver = int(solver.stats()["iter_count"]), self._solver(warm=False)
            values = solver(p=p, **arguments)
        x, g, lam_x, lam_g = (np.array(values[name]).ravel() for name in ("x", "g", "lam_x", "lam_g"))
        has_cost = self.additions.cost is not None
        optimum = results.Optimum(x, g, lam_x, lam_g, bounds, 1.0 / float(p[1]) if has_cost else FUEL_SCALE)
        stats = solver.stats()
        verdict = self._verdict(optimum, stats, x0, p, takeoff_mass)
        schedule, mass = self.schedule(x, takeoff_mass)
        regularisation = float(self._maps.penalty @ x**2) * optimum.unit
        error = np.full(len(self.mesh), np.nan)
        if coefficients is None and verdict["success"]:
            error = self.finer.error(x, self.unburned(takeoff_mass))
        return Trajectory(
            schedule=replace(schedule, **verdict),
            fuel=float(x[self.discretisation.layout.fuel[-1, -1]]) * FUEL_SCALE,
            objective=float(values["f"]) * optimum.unit - regularisation,
            mass=mass,
            mesh=self.mesh,
            transcription=self.transcription,
            **results.details(self.discretisation, self.rows, self._at, optimum, fuel_counts=not has_cost),
            mesh_error=error,
            x=x,
            lam_x=lam_x,
            lam_g=lam_g,
            cost_factor=float(p[1]),
            regularisation=regularisation,
            max_residual=results.residual(optimum),
            iterations=int(stats["iter_count"]) + wasted,
            build_s=self.build_s,
            solve_s=clock.perf_counter() - begin,
            **verdict,
        )

    def _knows(self, trajectory: Trajectory) -> bool:
        """Whether the trajectory is one of a problem of this structure."""
        sizes = len(trajectory.x) == self.discretisation.layout.size and len(trajectory.lam_g) == len(self.rows)
        sizes &= (trajectory.cost_factor != 0.0) == (self.additions.cost is not None)
        return sizes and trajectory.transcription == self.transcription and trajectory.mesh.equals(self.mesh)

    def _verdict(
        self, optimum: results.Optimum, stats: dict[str, Any], x0: np.ndarray, p: ca.DM, takeoff_mass: float
    ) -> dict[str, Any]:
        """Success, status and message."""
        status = ipopt_status(stats)
        if status is Status.CONVERGED and results.residual(optimum) <= ACCEPTED_RESIDUAL:
            return {
                "success": True,
                "status": status,
                "message": f"optimal to {self._ipopt['tol']:.2g}",
            }
        found = diagnose(self, takeoff_mass, bounds=optimum.bounds, x0=x0, p=p, g=optimum.g, stats=stats)
        return {"success": False, "status": found.status, "message": found.message}
