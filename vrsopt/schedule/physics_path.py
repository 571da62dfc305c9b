"""The physics along a whole-mission problem: flown at its own evaluations, with exact derivatives there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import joblib
import numpy as np

from vrsopt.aircraft import Aircraft
from vrsopt.errors import NoSolutionError
from vrsopt.helicopter import helicopter
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.residual import Solution
from vrsopt.schedule.corrected import FirstOrder
from vrsopt.schedule.physics_node import Engines, NodePhysics, Rotors, rotor_slopes

if TYPE_CHECKING:
    from vrsopt.mission.profile import Conditions, Profile
    from vrsopt.schedule.schedule import Schedule
    from vrsopt.schedule.trajectory import TrajectoryProblem

CHUNKS = 8  # of trims per worker


@dataclass(frozen=True)
class FlownPath:
    """A schedule flown at the M evaluations of a problem of its mesh.

    ``inputs`` (4, M): mass [kg], rotor speed [rad/s], twist [rad], charged rate [rad/s2]; ``fuel_flow`` (M,) [kg/s];
    ``excess`` (m, M): usages less 1, -1 on the ground; ``weights`` (M,) [s] of the quadrature; ``fuel`` [kg].
    """

    inputs: np.ndarray
    fuel_flow: np.ndarray
    excess: np.ndarray
    weights: np.ndarray
    fuel: float
    states: Sequence[tuple[Rotors, Engines]] = field(repr=False, default=())


class PhysicsTruth:
    """The full physics as what a surrogate is corrected with. ``trims`` and ``derivatives`` count what was solved.

    ``workers``: processes that share the derivatives of the trims.
    """

    def __init__(
        self,
        profile: Profile,
        limits: Limits,
        *,
        kinetic_energy: bool = True,
        workers: int = 2,
    ) -> None:
        self.profile, self.workers = profile, workers
        self.physics = NodePhysics(
            helicopter(limits.aircraft),
            limits,
            profile.isa_offset,
            kinetic_energy=kinetic_energy,
        )
        self.trims = self.derivatives = 0

    def fly(self, problem: TrajectoryProblem, schedule: Schedule, takeoff_mass: float) -> FlownPath:
        """Fly ``schedule`` of the problem's mesh, the mass integrated by Simpson's rule with the physics' fuel flow.

        Raises :class:`NoSolutionError` that names time and task of a point that is not solved.
        """
        inputs, weights, nodes = path_of(problem, schedule)
        count, changes = inputs.shape[1], np.asarray(self.profile.mass_changes)
        flow, excess = np.empty(count), np.full((len(LIMIT_NAMES), count), -1.0)
        states: list[tuple[Rotors, Engines]] = []
        here, segment = takeoff_mass, -1
        for first in range(0, count, 3):
            if nodes.segment[first] != segment:
                segment = int(nodes.segment[first])
                here += float(changes[segment])
            step = float(nodes.time[first + 2] - nodes.time[first])
            for k in range(first, first + 3):
                before = 0.0 if k == first else 0.5 * step * (k - first) * flow[k - 1]
                inputs[0, k] = here - before
                states.append(self._node(nodes, k, inputs[:, k], states))
                flow[k] = self.physics.engines * states[-1][1].state.outputs["fuel_flow"]
                if states[-1][0].trim is not None:
                    excess[:, k] = states[-1][1].usages - 1.0
            here -= float(weights[first : first + 3] @ flow[first : first + 3])
        return FlownPath(inputs, flow, excess, weights, float(weights @ flow), states)

    def _node(
        self, nodes: Conditions, k: int, x: np.ndarray, states: Sequence[tuple[Rotors, Engines]]
    ) -> tuple[Rotors, Engines]:
        try:
            rotors = self.physics.rotors(nodes, k, mass=x[0], rotor_speed=x[1], twist=x[2])
            self.trims += rotors.trim is not None and not (states and states[-1][0] is rotors)
            return rotors, self.physics.engine(rotors, float(x[3]))
        except NoSolutionError as error:
            task = self.profile.segments[nodes.segment[k]].task
            raise NoSolutionError(f"no physics at {nodes.time[k]:.0f} s ({task}): {error}") from None

    def first_order(self, problem: TrajectoryProblem, flown: FlownPath, *, everywhere: bool = False) -> FirstOrder:
        """Values and exact slopes of a flown schedule.

        The slopes of the rotors in the middle of an interval are the mean of those at its ends, unless asked for
        ``everywhere``: that takes twice as long.
        """
        nodes = problem.profile.conditions(problem.points.segment, problem.points.time)
        count = flown.inputs.shape[1]
        values = np.vstack([flown.fuel_flow, flown.excess])
        slopes = np.zeros((len(values), 4, count))
        rotor = self._rotor_slopes(flown, np.arange(count) if everywhere else np.flatnonzero(np.arange(count) % 3 != 1))
        if not everywhere:
            rotor[1::3] = 0.5 * (rotor[0::3] + rotor[2::3])
        for k, state in enumerate(flown.states):
            if state[0].trim is not None:
                mass, rate = flown.inputs[[0, 3], k]
                values[:, k], slopes[:, :, k] = self.physics.jacobian(
                    nodes, k, state, mass=mass, rate=rate, rotor=rotor[k]
                )
        return FirstOrder(flown.inputs, values, slopes)

    def _rotor_slopes(self, flown: FlownPath, wanted: np.ndarray) -> np.ndarray:
        """Slopes (M, 2, 3) of the rotors at the evaluations ``wanted`` (n,), shared between processes."""
        rotors = {id(flown.states[k][0]): flown.states[k][0] for k in wanted}
        trims = {key: one.trim for key, one in rotors.items() if one.trim is not None}
        self.derivatives += len(trims)
        aircraft, solutions = self.physics.machine.aircraft, list(trims.values())
        parts = [solutions[i :: CHUNKS * self.workers] for i in range(CHUNKS * self.workers)]
        with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
            found = joblib.Parallel(n_jobs=self.workers)(
                joblib.delayed(_slopes)(aircraft, [_bare(one) for one in part]) for part in parts if part
            )
        pairs = zip((part for part in parts if part), found, strict=True)
        known = {id(one): row for part, rows in pairs for one, row in zip(part, rows, strict=True)}
        result = np.zeros((len(flown.states), 2, 3))
        for k in wanted:
            trim = flown.states[k][0].trim
            if trim is not None:
                result[k] = known[id(trim)]
        return result


def path_of(problem: TrajectoryProblem, schedule: Schedule) -> tuple[np.ndarray, np.ndarray, Conditions]:
    """Inputs (4, M) of a schedule of the problem's mesh at its evaluations, without mass; weights (M,) [s] of Simpson's
    rule; conditions there. The evaluations are those of Hermite-Simpson, three of each interval, none shared."""
    mesh, points = problem.mesh, problem.points
    inputs = np.zeros((4, len(points.time)))
    inputs[1], inputs[2] = schedule.at(points.segment, points.time)
    rate = (inputs[1, 2::3] - inputs[1, 0::3]) / mesh.step
    inputs[3] = np.repeat(rate if problem.settings.spin_down_credit else np.maximum(rate, 0.0), 3)
    weights = (mesh.step[:, None] * np.array([1.0, 4.0, 1.0]) / 6.0).ravel()
    return inputs, weights, problem.profile.conditions(points.segment, points.time)


def _bare(solution: Solution) -> Solution:
    """A solution that travels light."""
    return Solution(
        success=solution.success,
        status=solution.status,
        message=solution.message,
        values={},
        outputs={},
        parameters=solution.parameters,
        residual_norm=solution.residual_norm,
        iterations=solution.iterations,
        scaled=solution.scaled,
    )


def _slopes(aircraft: Aircraft, solutions: Sequence[Solution]) -> list[np.ndarray]:
    return [rotor_slopes(aircraft, solution) for solution in solutions]
