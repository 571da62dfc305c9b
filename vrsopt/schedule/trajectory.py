"""The schedule of least fuel over the whole mission: one direct-collocation NLP with bounded rates.

The transcription is in :mod:`vrsopt.schedule.transcription`; here are the bounds, the start, the solve and the verdict.
The fuel it reports is the NLP's own; fuel that is compared comes from flying the schedule on the fine grid.
"""

from __future__ import annotations

import time as clock
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import casadi as ca
import numpy as np
from scipy import sparse

from vrsopt.errors import InputError
from vrsopt.schedule import transcription as tr
from vrsopt.schedule.additions import Additions, extended
from vrsopt.schedule.batched import batched_minimum
from vrsopt.schedule.mesh import Mesh, MeshOptions, make_mesh
from vrsopt.schedule.nominal import nominal_schedule
from vrsopt.schedule.path_model import PathModelFactory
from vrsopt.schedule.refly import Violation
from vrsopt.schedule.schedule import ON_LIMIT, Schedule, ScheduleSettings
from vrsopt.schedule.trajectory_solution import Trajectory
from vrsopt.solvers.ipopt import ipopt_options, ipopt_status
from vrsopt.solvers.status import Status

if TYPE_CHECKING:
    from vrsopt.mission.profile import Profile

Ends = Literal["pinned", "free", "periodic"]
TOLERANCE = 1e-7
MAX_ITERATIONS = 300
ACCEPTED_RESIDUAL = 1e-6  # largest scaled defect or limit of a solution that counts
__all__ = ["Trajectory", "TrajectoryProblem"]
DEFECTS = ("fuel burned", "fuel burned at midpoints", "rotor speed rate", "twist rate")


class TrajectoryProblem:
    """The NLP of a mission: built once, solved for any take-off mass."""

    def __init__(
        self,
        profile: Profile,
        make_path_model: PathModelFactory,
        *,
        settings: ScheduleSettings | None = None,
        mesh: MeshOptions | Mesh | None = None,
        ends: Ends = "pinned",
        additions: Additions | None = None,
        regularisation: float = 1e-6,
        ipopt: Mapping[str, Any] | None = None,
    ) -> None:
        """``ends``: rotor speed and twist nominal at both ends of the mission, free, or equal to each other.

        In idle they are nominal. A rate of ``None`` in ``settings`` lets the variable jump between segments.
        ``additions`` are limits and a cost of one's own. ``regularisation`` is the weight, on fuel in units of 100 kg,
        of the mean square of the rates over their limits. ``ipopt`` are options by IPOPT's own names.
        """
        begin = clock.perf_counter()
        if ends not in ("pinned", "free", "periodic"):
            raise InputError(f"trajectory: ends = {ends}: must be pinned, free or periodic")
        self.profile, self.settings, self.ends = profile, settings or ScheduleSettings(), ends
        self.mesh = mesh if isinstance(mesh, Mesh) else make_mesh(profile, mesh, settings=self.settings)
        self._points = tr.make_points(self.mesh)
        self._mass_added = np.cumsum(profile.mass_changes)[self.mesh.segment]
        conditions = profile.conditions(self._points.segment, self._points.time)
        self._idle = np.asarray(conditions.idle)[self._points.of_interval[:, 1]]
        self.model = make_path_model(conditions)
        self._box = self.settings.box(self.model.bounds)
        self._layout = tr.make_layout(self.mesh, self.settings, box=self._box, periodic=ends == "periodic")
        additions = additions or Additions()
        self._limit_names = (*self.model.limit_names, *additions.limits)
        function, coefficients = extended(
            *self.model.function(), limit_names=self.model.limit_names, conditions=conditions, additions=additions
        )
        node = tr.node_functions(function)
        e_map = tr.input_map(self._layout)
        defects, defect_weights = tr.defect_maps(self.mesh, self._layout, node.outputs)
        self._choose_limits(node)
        limit_weights = sparse.csc_matrix(
            (np.ones(len(self._limit_rows)), (np.arange(len(self._limit_rows)), self._limit_rows)),
            shape=(len(self._limit_rows), defect_weights.shape[1]),
        )
        constant = np.zeros((tr.INPUTS, tr.PARTS * len(self.mesh)))
        constant[0] = np.repeat(self._mass_added, tr.PARTS)
        self._weights = self._penalty(regularisation)
        self._nlp = tr.assemble(
            node,
            input_matrix=e_map,
            constant=constant,
            linear=sparse.vstack([defects, sparse.csc_matrix((len(self._limit_rows), self._layout.size))]).tocsc(),
            weights=sparse.vstack([defect_weights, limit_weights]).tocsc(),
            step=self.mesh.step,
            final_fuel=int(self._layout.fuel[-1]),
            penalty=self._weights,
        )
        self._coefficients = coefficients[:, self._points.of_interval.ravel()].ravel(order="F")
        settings_: dict[str, Any] = {"tol": TOLERANCE, "acceptable_iter": 0, "nlp_scaling_method": "none"}
        settings_ |= {"max_iter": MAX_ITERATIONS, **(ipopt or {})}
        self._tolerance, self._has_cost = float(settings_["tol"]), node.has_cost
        options = ipopt_options(**settings_)
        derivatives: dict[str, Any] = {"jac_g": self._nlp.jacobian, "hess_lag": self._nlp.hessian, "calc_lam_p": False}
        self._solver = ca.nlpsol("trajectory", "ipopt", self._nlp.problem, {**options, **derivatives})
        self.build_s = clock.perf_counter() - begin

    def _penalty(self, regularisation: float) -> np.ndarray:
        """Weights (n_x,) of the squared unknowns in the objective: only the rates have any."""
        penalty = np.zeros(self._layout.size)
        for control in self._layout.controls:
            penalty[control.rate] = regularisation * self.mesh.step / self.mesh.step.sum()
        return penalty

    def _choose_limits(self, node: tr.NodeFunctions) -> None:
        """Which outputs are constrained, as rows of y, and to which interval, part and limit each belongs.

        Idle is left alone. At the end of an interval only limits that feel the rate are needed, except at the end of a
        segment: the others are those of the next interval's start, and constraining them twice would be degenerate.
        """
        last = np.append(np.diff(self.mesh.segment) != 0, True)
        wanted = np.ones((len(self.mesh), tr.PARTS, len(self._limit_names)), dtype=bool)
        wanted[:, 2, :] = last[:, None] | node.depends_on_rate[None, :]
        wanted &= ~self._idle[:, None, None]
        interval, part, limit = np.nonzero(wanted)
        self._limit_rows = node.outputs * (tr.PARTS * interval + part) + 1 + limit
        self._limit_places = np.column_stack([interval, part, limit])

    @cached_property
    def _mass_bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest mass [kg] for which the model holds, at start, middle and end of the intervals (N, 3)."""
        count = len(self._points.time)
        lightest, heaviest = (np.broadcast_to(bound, count) for bound in self.model.bounds["mass"])
        return lightest[self._points.of_interval], heaviest[self._points.of_interval]

    def _bounds(self, takeoff_mass: float) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of x for a take-off mass [kg]."""
        layout = self._layout
        lower, upper = np.full(layout.size, -np.inf), np.full(layout.size, np.inf)
        lightest, heaviest = self._mass_bounds
        unburned = takeoff_mass + self._mass_added
        for part, index in enumerate((layout.fuel[:-1], layout.middle, layout.fuel[1:])):
            lower[index] = np.maximum(lower[index], (unburned - heaviest[:, part]) / tr.FUEL_SCALE)
            upper[index] = np.minimum(upper[index], (unburned - lightest[:, part]) / tr.FUEL_SCALE)
        if lower[0] > 0.0 or upper[0] < 0.0:
            allowed = f"{lightest[0, 0]:g} to {heaviest[0, 0]:g} kg"
            raise InputError(f"trajectory: takeoff_mass = {takeoff_mass:g} kg: must be {allowed}")
        lower[0] = upper[0] = 0.0
        for control in layout.controls:
            places = np.concatenate([control.start, control.end])
            lower[places], upper[places] = np.array(control.bounds)[:, None] / control.scale
            fixed = np.concatenate([control.start[self._idle], control.end[self._idle]])
            if self.ends == "pinned":
                fixed = np.append(fixed, [control.start[0], control.end[-1]])
            lower[fixed] = upper[fixed] = control.nominal / control.scale
            if control.rate_bound is not None:
                bound = control.rate_bound / control.rate_scale
                lower[control.rate], upper[control.rate] = -bound, bound
        return lower, upper

    def _start(self, schedule: Schedule, p: np.ndarray) -> np.ndarray:
        """Start of the unknowns on ``schedule``: its values at the nodes, rates within their bounds, its own fuel.

        Sets the factor on the cost, p[1], so that at the start the cost is as large as the fuel is.
        """
        layout, mesh = self._layout, self.mesh
        x = np.zeros(layout.size)
        starts, ends = schedule.at(mesh.segment, mesh.start), schedule.at(mesh.segment, mesh.end)
        for control, start, end in zip(layout.controls, starts, ends, strict=True):
            x[control.end] = end / control.scale
            x[control.start] = start / control.scale
            slope = (x[control.end] - x[control.start]) * control.scale / mesh.step
            bound = np.inf if control.rate_bound is None else control.rate_bound
            x[control.rate] = np.clip(slope, -bound, bound) / control.rate_scale
        for _ in range(3):
            outputs = np.array(self._nlp.values(x, p)).reshape(-1, len(mesh), tr.PARTS)
            integrals = mesh.step * (outputs @ np.array([1.0, 4.0, 1.0])) / 6.0
            increments = integrals[0] / tr.FUEL_SCALE
            p[1] = np.sum(increments) / max(abs(np.sum(integrals[-1])), 1e-300)
            x[layout.fuel] = np.concatenate([[0.0], np.cumsum(increments)])
            x[layout.middle] = 0.5 * (x[layout.fuel[:-1]] + x[layout.fuel[1:]])
        return x

    def solve(self, takeoff_mass: float, initial: Schedule | None = None) -> Trajectory:
        """Least fuel from ``takeoff_mass`` [kg], started on the schedule ``initial`` (nominal if none is given).

        Raises InputError for a take-off mass outside the bounds of the aircraft's model.
        """
        begin = clock.perf_counter()
        lower, upper = self._bounds(takeoff_mass)
        p = np.concatenate([[takeoff_mass, 1.0], self._coefficients])
        start = self._start(initial or nominal_schedule(self.profile, self.settings), p)
        defects = 4 * len(self.mesh)
        below = np.concatenate([np.zeros(defects), np.full(len(self._limit_rows), -np.inf)])
        found = self._solver(x0=start, p=p, lbx=lower, ubx=upper, lbg=below, ubg=0.0)
        x, g, multipliers = (np.array(found[name]).ravel() for name in ("x", "g", "lam_g"))
        residual = float(max(np.max(np.abs(g[:defects])), np.max(g[defects:], initial=0.0)))
        stats = self._solver.stats()
        status = ipopt_status(stats)
        success = status is Status.CONVERGED and residual <= ACCEPTED_RESIDUAL
        message = f"optimal to {self._tolerance:g}"
        if not success:
            status, message = self._diagnosis(start, g, status, takeoff_mass)
        places, limit_multipliers = self._limit_places, {}
        for number, name in enumerate(self._limit_names):
            of_limit = places[:, 2] == number
            limit_multipliers[name] = np.zeros(len(self.mesh))
            np.maximum.at(limit_multipliers[name], places[of_limit, 0], multipliers[defects:][of_limit])
        schedule, mass = self._schedule(x, takeoff_mass, success, status, message)
        return Trajectory(
            schedule=schedule,
            fuel=float(x[self._layout.fuel[-1]]) * tr.FUEL_SCALE,
            mass=mass,
            mesh=self.mesh,
            mass_costate=np.full(len(self.mesh), np.nan) if self._has_cost else 1.0 + multipliers[: len(self.mesh)],
            limit_multipliers=limit_multipliers,
            regularisation=float(self._weights @ x**2) * tr.FUEL_SCALE,
            max_residual=residual,
            iterations=int(stats["iter_count"]),
            build_s=self.build_s,
            solve_s=clock.perf_counter() - begin,
            success=success,
            status=status,
            message=message,
        )

    def _schedule(
        self, x: np.ndarray, takeoff_mass: float, success: bool, status: Status, message: str
    ) -> tuple[Schedule, np.ndarray]:
        """Schedule of a solution at the mesh nodes, both ends of every segment included, and the mass [kg] there."""
        at = self._points.of_interval[:, [0, 2]]
        nodes = np.unique(at)
        place = np.searchsorted(nodes, at)
        values = np.empty((3, len(nodes)))
        fuel = np.column_stack([x[self._layout.fuel[:-1]], x[self._layout.fuel[1:]]]) * tr.FUEL_SCALE
        values[0, place] = takeoff_mass + self._mass_added[:, None] - fuel
        for control in self._layout.controls:
            values[control.row, place] = np.column_stack([x[control.start], x[control.end]]) * control.scale
        schedule = Schedule(
            name="trajectory",
            segment=self._points.segment[nodes],
            time=self._points.time[nodes],
            rotor_speed=values[1],
            twist=values[2],
            success=success,
            status=status,
            message=message,
        )
        return schedule, values[0]

    def _diagnosis(self, start: np.ndarray, g: np.ndarray, status: Status, takeoff_mass: float) -> tuple[Status, str]:
        """Why there is no solution: the place where no rotor speed and twist are allowed, else the largest breach.

        The mass history is that of the ``start``: where IPOPT gave up the fuel need not mean anything.
        """
        flying = np.flatnonzero(~self._idle)
        middle = self._points.of_interval[flying, 1]
        mass = takeoff_mass + self._mass_added[flying] - tr.FUEL_SCALE * start[self._layout.middle[flying]]
        mass = np.clip(mass, *(bound[flying, 1] for bound in self._mass_bounds))
        optima = batched_minimum(self.model.nodes(middle), mass, box=self._box, refinements=6)
        worst = int(np.argmax(optima.excess))
        if optima.excess[worst] > ON_LIMIT:
            limit = self.model.limit_names[optima.nearest_limit[worst]]
            found = self._violation(limit, middle[worst], float(optima.excess[worst]))
            return Status.INFEASIBLE, f"no rotor speed and twist meet the limits: at best {found}"
        defects = 4 * len(self.mesh)
        breach = np.concatenate([np.abs(g[:defects]), g[defects:]])
        row = int(np.argmax(breach))
        words = "infeasible" if status is Status.INFEASIBLE else str(status)
        if breach[row] <= ACCEPTED_RESIDUAL:
            return status, f"{words}: all limits and rates are met, but the fuel is not yet the least"
        advice = (
            "every time by itself has allowed points: the rates or the nominal values at ends and idle are in the way"
        )
        if row < defects:
            family, interval = divmod(row, len(self.mesh))
            task = self.profile.segments[self.mesh.segment[interval]].task
            where = f"{DEFECTS[family]} not met at {self.mesh.start[interval]:.0f} s ({task})"
        else:
            interval, part, number = self._limit_places[row - defects]
            limit = self._limit_names[number]
            where = str(self._violation(limit, self._points.of_interval[interval, part], float(breach[row])))
        return status, f"{words}: {where}; {advice}"

    def _violation(self, limit: str, point: int, excess: float) -> Violation:
        task = self.profile.segments[self._points.segment[point]].task
        return Violation(limit, task, float(self._points.time[point]), excess)
