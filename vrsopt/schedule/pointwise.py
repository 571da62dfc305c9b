"""The schedule that takes the least fuel flow at every decision step by itself, blind to rates of change.

The reference study's method: NSGA-II on rotor speed and twist, population 25 per variable. The nested grids of
:mod:`vrsopt.schedule.batched` give the same optimum much faster; they are its check and the start of the trajectory.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from vrsopt.errors import InputError
from vrsopt.schedule.batched import PointOptima, batched_minimum
from vrsopt.schedule.nominal import nominal_schedule
from vrsopt.schedule.path_model import PathModelFactory
from vrsopt.schedule.refly import FlightGrid, Violation
from vrsopt.schedule.schedule import ON_LIMIT, Schedule, ScheduleSettings
from vrsopt.solvers.status import Status

if TYPE_CHECKING:
    from vrsopt.mission.profile import Profile
    from vrsopt.schedule.genetic import GeneticOptions

Method = Literal["nsga2", "batched"]
MASS_SWEEPS = 2


def pointwise_schedule(
    profile: Profile,
    make_path_model: PathModelFactory,
    *,
    takeoff_mass: float,
    settings: ScheduleSettings | None = None,
    method: Method = "nsga2",
    decision_step: float = 60.0,
    genetic: GeneticOptions | None = None,
    workers: int = 1,
    progress: bool = False,
) -> Schedule:
    """Least fuel flow at each decision node, at most ``decision_step`` [s] apart and at both ends of every segment.

    The mass history burns the schedule's own fuel: two sweeps of batched optimum and flight, of which the second moves
    the mass by grams only; NSGA-II then searches at that mass. The result does not depend on ``workers``. A node
    without any allowed point, or one stopped by the cap on the generations, makes ``success`` false.
    """
    settings = settings or ScheduleSettings()
    if method not in ("nsga2", "batched"):
        raise InputError(f"pointwise schedule: method = {method}: must be nsga2 or batched")
    grid = FlightGrid(profile, make_path_model, step=decision_step)
    flying = np.flatnonzero(~np.asarray(grid.conditions.idle))
    if not len(flying):
        raise InputError("pointwise schedule: profile: has no task in flight, only idle")
    model = grid.model.nodes(flying)
    box = settings.box(model.bounds)
    schedule = nominal_schedule(profile, settings)
    for _ in range(MASS_SWEEPS):
        mass = grid.fly(schedule, takeoff_mass=takeoff_mass).mass
        optima = batched_minimum(model, mass[flying], box=box)
        schedule = _schedule(grid, flying, optima, settings)
    if method == "batched":
        return schedule

    from vrsopt.schedule.genetic import GeneticOptions, genetic_minimum  # pymoo is slow to import

    genetic = genetic or GeneticOptions()
    mass = grid.fly(schedule, takeoff_mass=takeoff_mass).mass
    optima, generations = genetic_minimum(
        model, mass[flying], box=box, options=genetic, workers=workers, progress=progress
    )
    return _schedule(grid, flying, optima, settings, generations=generations, cap=genetic.most_generations)


def _schedule(
    grid: FlightGrid,
    flying: np.ndarray,
    optima: PointOptima,
    settings: ScheduleSettings,
    *,
    generations: np.ndarray | None = None,
    cap: int = 0,
) -> Schedule:
    """Schedule of the optima at the ``flying`` nodes of the decision grid and nominal values elsewhere."""
    rotor_speed = np.full(len(grid.time), settings.nominal_rotor_speed)
    twist = np.full(len(grid.time), settings.nominal_twist)
    rotor_speed[flying], twist[flying] = optima.rotor_speed, optima.twist
    status, message = Status.CONVERGED, ""
    details = {"nodes": float(len(flying))}
    if generations is not None:
        capped = int(np.sum(generations >= cap))
        details |= {"mean_generations": float(generations.mean()), "nodes_at_generation_cap": float(capped)}
        if capped:
            status = Status.ITERATION_LIMIT
            message = f"{capped} of {len(flying)} nodes stopped at the cap of {cap} generations"
    worst = int(np.argmax(optima.excess))
    if optima.excess[worst] > ON_LIMIT:
        node = flying[worst]
        violation = Violation(
            grid.model.limit_names[optima.nearest_limit[worst]],
            grid.profile.segments[grid.segment[node]].task,
            float(grid.time[node]),
            float(optima.excess[worst]),
        )
        status, message = Status.INFEASIBLE, f"no rotor speed and twist meet the limits: at best {violation}"
    return Schedule(
        name="pointwise",
        segment=grid.segment,
        time=grid.time,
        rotor_speed=rotor_speed,
        twist=twist,
        success=status is Status.CONVERGED,
        status=status,
        message=message,
        details=details,
    )
