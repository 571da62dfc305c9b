"""A mission as a problem that one states as one would write it down, solves and solves again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import NoneType
from typing import Any

import casadi as ca
import numpy as np

from vrsopt.errors import InputError
from vrsopt.mission.file import Mission
from vrsopt.mission.profile import Profile
from vrsopt.mission.track import FlownMission
from vrsopt.mission.track_file import SUFFIXES
from vrsopt.quantity import is_number
from vrsopt.schedule.additions import Additions, Constraint, Quantities, quantities
from vrsopt.schedule.labels import Labels
from vrsopt.schedule.mesh import Mesh, MeshOptions
from vrsopt.schedule.mission_setup import MissionSetup
from vrsopt.schedule.own_rows import judged
from vrsopt.schedule.refinement import refined
from vrsopt.schedule.refly import Flight, FlightGrid
from vrsopt.schedule.schedule import Schedule, ScheduleSettings, Variables
from vrsopt.schedule.study_input import read
from vrsopt.schedule.trajectory import Trajectory, TrajectoryProblem
from vrsopt.schedule.transcription import Transcription
from vrsopt.schedule.verify import PhysicsFlight, fly_physics
from vrsopt.surrogate.store import Surrogate

SAME_TIME = 1e-6  # s


@dataclass(frozen=True)
class Functions:
    """The problem as CasADi functions of its unknowns x and parameters p, as ``nlpsol`` takes them.

    ``objective`` (x, p) -> f, ``constraints`` (x, p) -> g, ``jacobian`` (x, p) -> (g, dg/dx), ``hessian`` (x, p, lam_f,
    lam_g) -> upper triangle of that of the Lagrangian; ``rows`` and ``columns`` say what g and x are.
    """

    objective: ca.Function
    constraints: ca.Function
    jacobian: ca.Function
    hessian: ca.Function
    rows: Labels = field(repr=False)
    columns: Labels = field(repr=False)


class MissionProblem:
    """Least fuel, or another objective, over a mission, with constraints of one's own.

    >>> problem = MissionProblem("problems/sarm.toml")
    >>> q = problem.quantities
    >>> problem.add_constraint("tip speed", 4.912 * q["rotor_speed"], upper=200.0, unit="m/s", tasks=["search"])
    >>> problem.add_integral("mission NOx", q["nox"], upper=0.5, unit="kg")
    >>> trajectory = problem.solve()

    It is built at the first solve; what :meth:`solve` changes needs no rebuild, an added constraint or objective does.
    ``transcription`` and ``mesh`` (intervals; None: as fine as it needs) say how it is discretised; ``setup``:
    aircraft, surrogate, fine grid and settings of the mission.
    """

    def __init__(
        self,
        mission: Mission | FlownMission | Path | str,
        surrogate: Surrogate | Path | str | None = None,
        *,
        mass: float | None = None,
        objective: Any = "fuel",
        variables: Variables = "both",
        settings: ScheduleSettings | None = None,
        transcription: Transcription = "hermite_simpson",
        mesh: MeshOptions | Mesh | None = None,
        ipopt: Mapping[str, Any] | None = None,
    ) -> None:
        """``mission``: a mission file (TOML) or :class:`Mission`; a flown track (CSV, GPX), or a :class:`FlownMission`.

        ``surrogate``: fitted by :func:`vrsopt.fit`; default the shipped one. ``mass``: take-off mass [kg]; needed with
        the file of a track, by default a mission's is closed, so that the nominal schedule lands with the reserve.
        ``objective``: see :meth:`minimize`. ``settings``: in place of the mission's own limits on schedules, of which
        ``variables`` are free. ``transcription``: "hermite_simpson" or "radau"; ``mesh``: how fine, or the mesh itself.
        ``ipopt``: options by IPOPT's own names.

        Raises :class:`InputError` for unusable input and :class:`NoSolutionError` where the mission can not be flown.
        """
        if mass is not None and not (is_number(mass) and mass > 0.0):
            raise InputError(f"mission problem: mass = {mass!r}: a number above 0, kg")
        for name, given, kinds in (
            ("mission", mission, (Mission, FlownMission, Path, str)),
            ("surrogate", surrogate, (Surrogate, Path, str, NoneType)),
            ("settings", settings, (ScheduleSettings, NoneType)),
            ("mesh", mesh, (MeshOptions, Mesh, NoneType)),
            ("ipopt", ipopt, (Mapping, NoneType)),
        ):
            if not isinstance(given, kinds):
                allowed = ", ".join(kind.__name__ for kind in kinds if kind is not NoneType)
                raise InputError(f"mission problem: {name} = {given!r}: must be of {allowed}")
        if isinstance(mission, Path | str):
            of_track = Path(mission).suffix.lower() in SUFFIXES
            mission = read(mission, mass=mass if of_track else None)
        self.setup = MissionSetup(mission, surrogate)
        self.takeoff_mass = self.setup.loading.takeoff_mass if mass is None else float(mass)
        self.settings = (settings or self.setup.settings).restricted(variables)
        self._transcription: Transcription = transcription
        self._mesh, self._ipopt = mesh, dict(ipopt or {})
        self._constraints: list[Constraint] = []
        self._integrals: list[Constraint] = []
        self._cost: Any = None
        self._built: TrajectoryProblem | None = None
        self.minimize(objective)

    @property
    def profile(self) -> Profile:
        """The mission in time."""
        return self.setup.profile

    @property
    def quantities(self) -> Quantities:
        """Named quantities, CasADi symbols in SI units, of which constraints and objectives are made."""
        return quantities()

    def add_constraint(
        self,
        name: str,
        expression: Any,
        lower: float | None = None,
        upper: float | None = None,
        *,
        unit: str = "-",
        tasks: Sequence[str] | None = None,
    ) -> None:
        """Keep ``expression`` of :attr:`quantities` between ``lower`` and ``upper`` [``unit``], in flight.

        ``name``: how results call it; ``tasks``: labels of the mission's tasks in which it holds; None for all. Raises
        :class:`InputError`.
        """
        self._constraints.append(self._constraint(name, expression, lower, upper, unit, tasks))
        self._built = None

    def add_integral(
        self,
        name: str,
        expression: Any,
        lower: float | None = None,
        upper: float | None = None,
        *,
        unit: str = "-",
        tasks: Sequence[str] | None = None,
    ) -> None:
        """Keep the integral of ``expression`` (per second) over the mission, or over ``tasks``, between the bounds.

        ``lower`` and ``upper`` [``unit``], None for no bound; ``name``: how results call it. Raises
        :class:`InputError`.
        """
        self._integrals.append(self._constraint(name, expression, lower, upper, unit, tasks))
        self._built = None

    def minimize(self, objective: Any) -> None:
        """What is minimised: "fuel", weights like ``{"fuel": 1.0, "nox": 30.0}`` of fuel, nox, co and co2 [kg], or an
        expression of :attr:`quantities`, integrated over the mission."""
        if isinstance(objective, str):
            if objective != "fuel":
                raise InputError(f"mission problem: objective = {objective!r}: allowed: fuel, weights or an expression")
            objective = None
        Additions(cost=objective).cost_expression()  # complains of weights that it does not know
        self._cost, self._built = objective, None

    def _constraint(
        self,
        name: str,
        expression: Any,
        lower: float | None,
        upper: float | None,
        unit: str,
        tasks: Sequence[str] | None,
    ) -> Constraint:
        known = list(dict.fromkeys(segment.task for segment in self.profile.segments))
        if isinstance(tasks, str) or tasks is not None and not (isinstance(tasks, Sequence) and tasks):
            raise InputError(
                f"constraint {name}: tasks = {tasks!r}: a list of some of {', '.join(known)}, or None for all"
            )
        for task in tasks or ():
            if task not in known:
                raise InputError(f"constraint {name}: tasks = {task!r}: allowed: {', '.join(known)}")
        added = Constraint(name, expression, lower, upper, unit, None if tasks is None else tuple(tasks))
        Additions((*self._constraints, added), integrals=tuple(self._integrals))  # complains of names there twice
        return added

    @property
    def problem(self) -> TrajectoryProblem:
        """The NLP, built if need be."""
        if self._built is None:
            self._built = TrajectoryProblem(
                self.profile,
                self.setup.make,
                settings=self.settings,
                mesh=self._mesh,
                transcription=self._transcription,
                additions=Additions(tuple(self._constraints), self._cost, tuple(self._integrals)),
                ipopt=self._ipopt,
            )
        return self._built

    @property
    def functions(self) -> Functions:
        """The problem as CasADi functions."""
        problem = self.problem
        x, p, f, g = (problem.nlp.problem[name] for name in ("x", "p", "f", "g"))
        return Functions(
            ca.Function("objective", [x, p], [f], ["x", "p"], ["f"]),
            ca.Function("constraints", [x, p], [g], ["x", "p"], ["g"]),
            problem.nlp.jacobian,
            problem.nlp.hessian,
            problem.rows,
            problem.columns,
        )

    def solve(
        self,
        initial: Schedule | Trajectory | None = None,
        *,
        limits: Mapping[str, Any] | None = None,
        refine: bool = True,
        **changes: Any,
    ) -> Trajectory:
        """Solve, and solve again on a finer mesh where a flight of the solution asks for it (unless not ``refine``).

        ``initial``: where to start; a trajectory of this problem, from :func:`vrsopt.load_trajectory` too, starts with
        its mesh and its multipliers. ``limits``: name -> other largest usage of a limit of the aircraft, or (lower,
        upper) of a constraint of one's own. ``changes``: other values of fields of :class:`ScheduleSettings`, for this
        solve: ``rotor_speed_rate=0.2`` [rad/s2], ``ends="free"``, ... Without success the message says what is in the
        way. Raises :class:`InputError` for changes that are not possible.
        """
        settings = self._changed(changes)
        problem = self.problem
        if isinstance(initial, Trajectory):
            _check_same_mission(initial, self.profile)
            if initial.transcription == problem.transcription:
                problem = problem.on(initial.mesh)
        if not refine and not settings.forbidden_bands:
            return problem.solve(self.takeoff_mass, initial, settings=settings, limits=limits)
        trajectory, self._built = refined(
            problem,
            self._grid(settings),
            takeoff_mass=self.takeoff_mass,
            initial=initial,
            settings=settings,
            limits=limits,
        )
        return trajectory

    def fly(
        self, schedule: Schedule | Trajectory, *, limits: Mapping[str, Any] | None = None, **changes: Any
    ) -> Flight:
        """Fly a schedule on the surrogate, on the fine grid; ``limits`` and ``changes`` as of :meth:`solve`.

        Constraints of one's own are judged as well. Its ``limits`` are those of the aircraft, over what is asked.
        """
        grid, additions = self._grid(self._changed(changes)), Additions(tuple(self._constraints))
        if limits:
            self.problem.bounds(self.takeoff_mass, limits=limits)  # complains of what can not be
        return judged(grid, grid.fly(_schedule(schedule), takeoff_mass=self.takeoff_mass), additions, limits)

    def verify(self, schedule: Schedule | Trajectory) -> PhysicsFlight:
        """Fly a schedule on the full physics: trim, engine and combustor at every node, no surrogate."""
        return fly_physics(
            self.profile,
            _schedule(schedule),
            limits=self.setup.limits,
            takeoff_mass=self.takeoff_mass,
            spin_down_credit=self.settings.spin_down_credit,
        )

    def _changed(self, changes: Mapping[str, Any]) -> ScheduleSettings:
        known = ScheduleSettings.__dataclass_fields__
        for name in changes:
            if name not in known:
                raise InputError(f"mission problem: {name}: allowed changes: {', '.join(known)}")
        return replace(self.settings, **changes)

    def _grid(self, settings: ScheduleSettings) -> FlightGrid:
        """The fine grid, under these settings."""
        grid = self.setup.grid
        return grid if settings == grid.settings else grid.under(settings)


def _schedule(given: Schedule | Trajectory) -> Schedule:
    return given.schedule if isinstance(given, Trajectory) else given


def _check_same_mission(trajectory: Trajectory, profile: Profile) -> None:
    """Raises :class:`InputError` for a trajectory that belongs to another mission, by the first field that differs."""
    segments = int(trajectory.mesh.segment[-1]) + 1
    if segments != len(profile.segments):
        raise InputError(f"trajectory: segments = {segments}: this mission has {len(profile.segments)}")
    first = np.searchsorted(trajectory.mesh.segment, np.arange(segments))
    for k, (own, item) in enumerate(zip(trajectory.mesh.start[first], profile.segments, strict=True)):
        if abs(own - item.start) > SAME_TIME:
            here = f"in this mission {item.start:.3f} s ({item.task})"
            raise InputError(f"trajectory: start of segment {k} = {own:.3f} s: {here}")
