"""The trajectory of least fuel on the physics: the surrogate's, corrected until nothing is left of its errors.

The whole-mission problem is solved with a path model corrected to first order at the schedule that is held
(:mod:`vrsopt.schedule.corrected`), within a trust region of rotor speed and twist about it. The schedule found is
flown on the physics: it is kept if that lowers the mission's fuel, else the region halves, as it does where little of
what was promised comes. The limits are corrected like the fuel flow, and a breach of one on the physics counts as fuel,
at more than its multiplier.

It ends where problem and physics agree on the fuel and the schedule changes no more, though the region would let it.
It is a success if first-order optimality holds too, with the physics' own derivatives at the schedule itself. The rotor
crosses forbidden bands where it does in the surrogate's schedule.
"""

from __future__ import annotations

import logging
import time as clock
from dataclasses import dataclass, field, replace
from math import radians
from typing import TYPE_CHECKING, Protocol

import numpy as np

from vrsopt.errors import InputError
from vrsopt.schedule.corrected import CorrectedPath, FirstOrder, corrected
from vrsopt.schedule.optimality import Optimality, optimality_at
from vrsopt.schedule.path_model import PathModelFactory
from vrsopt.schedule.physics_path import FlownPath
from vrsopt.schedule.schedule import ON_LIMIT, Schedule, ScheduleSettings
from vrsopt.schedule.trajectory import Trajectory, TrajectoryProblem
from vrsopt.schedule.trust_region import TrustRegion, flown_stays

if TYPE_CHECKING:
    from vrsopt.mission.profile import Profile

logger = logging.getLogger(__name__)

SAME_FUEL = 1e-6  # relative: a fall of the fuel by less is none
POOR = 0.25  # of the fall that the problem promised: a step that gains less halves the region, kept or not
DEAR = 2.0  # times its largest multiplier, what a breach of a limit costs
LEFT_OPEN = 1e-5  # of the fuel: what the slopes between nodes, means of those at the nodes, may promise in error
AT_ITS_EDGE = 0.9  # of the region: a step as long as this is short because of the region; IPOPT keeps a little off


@dataclass(frozen=True)
class ConsistentOptions:
    """When a trajectory is consistent: problem and physics agree on the fuel to ``gap``, the root mean square change of
    the schedule is below ``rotor_speed`` (of nominal) and ``twist`` [rad], and with the physics' own derivatives no
    more than ``at_stake`` of the fuel is left to be saved, see :class:`Optimality`: a fifth of the gap, so that what is
    missing to the optimum is less than what is not known of its fuel. ``region``: how far the first solution may be
    from the schedule that is held, of nominal and rad; ``most_solves``: the surrogate's own included.
    """

    gap: float = 5e-4
    at_stake: float = 1e-4
    rotor_speed: float = 1e-3
    twist: float = radians(0.1)
    region: tuple[float, float] = (0.04, radians(2.0))
    most_solves: int = 12

    def __post_init__(self) -> None:
        for name in ("gap", "at_stake", "rotor_speed", "twist"):
            if not getattr(self, name) > 0.0:
                raise InputError(f"consistent trajectory: {name} = {getattr(self, name):g}: must be above 0")
        if self.most_solves < 2:
            raise InputError(f"consistent trajectory: most_solves = {self.most_solves}: must be at least 2")


@dataclass(frozen=True)
class Step:
    """One solve: fuel [kg] of the problem and of the physics, worst excess of a limit on the physics, root mean square
    change of the schedule (of nominal, rad), trust region, whether it was kept, and IPOPT's iterations."""

    fuel: float
    fuel_physics: float
    excess: float
    rotor_speed: float
    twist: float
    region: tuple[float, float]
    kept: bool
    iterations: int


@dataclass(frozen=True)
class Consistent:
    """The consistent trajectory; ``fuel_physics`` [kg] is the physics' by the problem's own quadrature.

    ``surrogate`` and ``optimality`` are of the surrogate's optimum and of this, both with the physics' derivatives.
    ``trims`` and ``derivatives``: points of the physics solved and differentiated; times in s.
    """

    trajectory: Trajectory
    fuel_physics: float
    history: tuple[Step, ...]
    surrogate: Optimality
    optimality: Optimality
    trims: int
    derivatives: int
    cpu_s: float
    wall_s: float
    success: bool
    message: str
    flown: FlownPath = field(repr=False)


class Truth(Protocol):
    """What a surrogate is corrected with, see :class:`vrsopt.schedule.physics_path.PhysicsTruth`."""

    trims: int
    derivatives: int

    def fly(self, problem: TrajectoryProblem, schedule: Schedule, takeoff_mass: float) -> FlownPath:
        """The schedule flown at the problem's evaluations."""
        ...

    def first_order(self, problem: TrajectoryProblem, flown: FlownPath, *, everywhere: bool = False) -> FirstOrder:
        """Values and slopes there."""
        ...


def consistent_trajectory(
    profile: Profile,
    make_path_model: PathModelFactory,
    truth: Truth,
    *,
    takeoff_mass: float,
    trajectory: Trajectory,
    settings: ScheduleSettings | None = None,
    options: ConsistentOptions | None = None,
) -> Consistent:
    """The optimum of ``truth`` near the ``trajectory`` that is optimal to the path model, on its mesh.

    At every node the rotor stays on the side of the forbidden bands of ``settings`` on which the ``trajectory`` is.
    Without success the message says what is missing. Raises :class:`NoSolutionError` for a point of the physics that is
    not solved, named by time and task.
    """
    search = _Search(profile, make_path_model, truth, takeoff_mass, settings or ScheduleSettings(), trajectory)
    return search.run(options or ConsistentOptions())


class _Search:
    def __init__(
        self,
        profile: Profile,
        make: PathModelFactory,
        truth: Truth,
        takeoff_mass: float,
        settings: ScheduleSettings,
        trajectory: Trajectory,
    ) -> None:
        self.truth, self.takeoff_mass, self.settings = truth, takeoff_mass, settings
        self.begin = clock.process_time(), clock.perf_counter()
        mesh, make = trajectory.mesh, corrected(make)
        self.problem = TrajectoryProblem(profile, make, settings=settings, mesh=mesh, shared=False)
        assert isinstance(self.problem.model, CorrectedPath)
        self.model = self.problem.model
        self.first = trajectory
        self.trusted = TrustRegion.about(trajectory.schedule, settings, self.model.bounds)
        self.weights = np.zeros(len(trajectory.schedule.time))
        places = np.searchsorted(trajectory.schedule.time, mesh.start, side="right") - 1
        np.add.at(self.weights, places, 0.5 * mesh.step)
        np.add.at(self.weights, np.minimum(places + 1, len(self.weights) - 1), 0.5 * mesh.step)

    def run(self, options: ConsistentOptions) -> Consistent:
        held = self.problem.solve(self.takeoff_mass, self.first.schedule, corridor=self.trusted.widest)
        flown = self.truth.fly(self.problem, held.schedule, self.takeoff_mass)
        model = self._coefficients(flown)
        before = self.optimality(held, flown, model)
        region, message, everywhere = np.array(options.region), "", False
        history = [self._step(held, flown, held.schedule, region, kept=True)]
        while len(history) < options.most_solves:
            corridor = self.trusted.around(held.schedule, region)
            trial = self.problem.solve(self.takeoff_mass, held, corridor=corridor, coefficients=model)
            if not trial.success:
                message = f"corrected problem not solved: {trial.message}"
                break
            tried = self.truth.fly(self.problem, trial.schedule, self.takeoff_mass)
            price = self._price(trial)
            before_it = self._merit(flown, price)
            gained, promised = before_it - self._merit(tried, price), before_it - trial.fuel
            better = gained >= -SAME_FUEL * flown.fuel
            step, moved = self._step(trial, tried, held.schedule, region, kept=better), self._largest(trial, held)
            history.append(step)
            logger.info("consistent trajectory: %s", step)
            settled = step.rotor_speed < options.rotor_speed and step.twist < options.twist
            if better:
                agree = abs(trial.fuel / tried.fuel - 1.0) < options.gap
                held, flown = trial, tried
                model = self._coefficients(flown, everywhere=everywhere)
                if settled and agree and step.excess <= ON_LIMIT:
                    if self.optimality(held, flown, model).at_stake <= options.at_stake * flown.fuel:
                        break
            elif not everywhere:  # slopes between nodes may have promised what is not there
                everywhere, model = True, self._coefficients(flown, everywhere=True)
                continue
            elif settled:  # the schedule that is held can not be told from a better one, if the region let the step end
                if promised > LEFT_OPEN * flown.fuel and np.any(moved > AT_ITS_EDGE * region):
                    message = f"not settled after {len(history)} solves: no room to tell, the region has shrunk"
                break
            if gained < POOR * promised:
                region = 0.5 * min(1.0, float(np.max(moved / region))) * region
        else:
            message = f"not settled after {options.most_solves} solves"
        return self._result(held, flown, history, before, message, options)

    def _result(
        self,
        held: Trajectory,
        flown: FlownPath,
        history: list[Step],
        before: Optimality,
        message: str,
        options: ConsistentOptions,
    ) -> Consistent:
        final = self.optimality(held, flown, self._coefficients(flown, everywhere=True))
        if not message and final.excess > ON_LIMIT:
            message = f"limits on the physics exceeded by {100 * final.excess:.2f} %"
        gap = abs(held.fuel / flown.fuel - 1.0)
        if not message and gap >= options.gap:
            message = f"problem and physics differ by {100 * gap:.3f} % of the fuel"
        if not message and not final.at_stake <= options.at_stake * flown.fuel:
            share, allowed = (100 * one for one in (final.at_stake / flown.fuel, options.at_stake))
            message = f"no optimum of the physics: {share:.3g} % of the fuel at stake, {allowed:g} % allowed"
        stays = flown_stays(self.problem.profile, held.schedule, self.settings)
        message = "; ".join([message] * bool(message) + [str(stay) for stay in stays])
        success = not message
        message = message or f"optimal to the physics after {len(history)} solves"
        message += f"; stationarity {final.stationarity:.1e} kg per 100 % at a node"
        schedule = replace(held.schedule, name="consistent", success=success, message=message)
        return Consistent(
            trajectory=replace(held, schedule=schedule),
            fuel_physics=flown.fuel,
            history=tuple(history),
            surrogate=before,
            optimality=final,
            trims=self.truth.trims,
            derivatives=self.truth.derivatives,
            cpu_s=clock.process_time() - self.begin[0],
            wall_s=clock.perf_counter() - self.begin[1],
            success=success,
            message=message,
            flown=flown,
        )

    def _coefficients(self, flown: FlownPath, *, everywhere: bool = False) -> np.ndarray:
        return self.model.coefficients(self.truth.first_order(self.problem, flown, everywhere=everywhere))

    def _price(self, trajectory: Trajectory) -> np.ndarray:
        """What a breach of each limit costs, kg per s and unit of usage (m,)."""
        step = trajectory.mesh.step
        found = [np.max(np.abs(trajectory.limit_multipliers[name]) / step) for name in self.problem.model.limit_names]
        return DEAR * np.array(found)

    def _merit(self, flown: FlownPath, price: np.ndarray) -> float:
        """Fuel [kg] and what the breaches of the limits cost."""
        breach = np.maximum(flown.excess - 0.5 * ON_LIMIT, 0.0) @ flown.weights
        return flown.fuel + float(price @ breach)

    def _largest(self, new: Trajectory, old: Trajectory) -> np.ndarray:
        """Largest change (2,) of rotor speed (of nominal) and twist [rad] at a node."""
        one, other = new.schedule, old.schedule
        changes = (one.rotor_speed - other.rotor_speed) / self.settings.nominal_rotor_speed, one.twist - other.twist
        return np.max(np.abs(changes), axis=1)

    def _step(
        self, trajectory: Trajectory, flown: FlownPath, before: Schedule, region: np.ndarray, *, kept: bool
    ) -> Step:
        new, share = trajectory.schedule, self.weights / self.weights.sum()
        speed = (new.rotor_speed - before.rotor_speed) / self.settings.nominal_rotor_speed
        return Step(
            fuel=trajectory.fuel,
            fuel_physics=flown.fuel,
            excess=float(np.max(flown.excess)),
            rotor_speed=float(np.sqrt(share @ speed**2)),
            twist=float(np.sqrt(share @ (new.twist - before.twist) ** 2)),
            region=(float(region[0]), float(region[1])),
            kept=kept,
            iterations=trajectory.iterations,
        )

    def optimality(self, trajectory: Trajectory, flown: FlownPath, coefficients: np.ndarray) -> Optimality:
        """First-order optimality at the schedule itself, with the physics' derivatives as ``coefficients``."""
        start = self.problem.start(trajectory.schedule, self.takeoff_mass, coefficients=coefficients)
        bounds = self.problem.bounds(self.takeoff_mass, corridor=self.trusted.widest)
        return optimality_at(self.problem, trajectory, *start, bounds, excess=float(np.max(flown.excess)))
