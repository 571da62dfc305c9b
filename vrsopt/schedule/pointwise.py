"""The schedule that takes the least fuel flow at every decision step by itself, blind to rates of change.

The reference study's method: NSGA-II on rotor speed and twist, population 25 per variable. The batched search of
:mod:`vrsopt.schedule.batched` gives the same optimum much faster: it says at which mass and at which nodes to search.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from vrsopt.errors import InputError
from vrsopt.schedule.across_bands import across_bands
from vrsopt.schedule.batched import PointOptima, batched_minimum
from vrsopt.schedule.decision import DecisionNodes, decision_nodes
from vrsopt.schedule.nominal import nominal_schedule
from vrsopt.schedule.path_model import PathModelFactory
from vrsopt.schedule.refly import FlightGrid, Violation
from vrsopt.schedule.schedule import ON_LIMIT, Schedule, ScheduleSettings
from vrsopt.solvers.status import Status

if TYPE_CHECKING:
    from vrsopt.mission.profile import Profile
    from vrsopt.schedule.genetic import GeneticOptions
    from vrsopt.schedule.path_model import PathModel
    from vrsopt.schedule.refly import Flight

Method = Literal["nsga2", "batched"]
METHODS = get_args(Method)
MASS_SWEEPS = 2  # the second moves the mass by grams
MAX_SWEEPS = 8
CHECKED_LIMIT = 0.5 * ON_LIMIT  # breaches between nodes above which there is another node: NSGA-II scatters a little


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
    grid: FlightGrid | None = None,
) -> Schedule:
    """Least fuel flow at each decision node, at most ``decision_step`` [s] apart and at both ends of every segment.

    The mass history burns the schedule's own fuel: sweeps of batched optimum and flight on the fine ``grid`` (made if
    there is none). Where the flight between two nodes breaks a limit that both of them keep, there will be a node.
    NSGA-II then searches at these nodes and masses. No node has a rotor speed inside a forbidden band, and a step
    across one takes no longer than allowed; a band that may not be crossed is kept off on the nominal side. The result
    does not depend on ``workers``. A node without any allowed point, or one stopped by the cap on the generations,
    makes ``success`` false.
    """
    settings = settings or ScheduleSettings()
    if method not in METHODS:
        raise InputError(f"pointwise schedule: method = {method}: must be nsga2 or batched")
    bands = settings.forbidden_bands
    nodes = decision_nodes(profile, decision_step)
    grid = grid or FlightGrid(profile, make_path_model)
    schedule = nominal_schedule(profile, settings)
    model = make_path_model(nodes.conditions())
    for sweep in range(MAX_SWEEPS):
        mass = _mass(nodes, grid, schedule, takeoff_mass, model)
        box = _reachable(settings.box(model.bounds), settings)
        schedule = _schedule(nodes, model, batched_minimum(model, mass, box=box, bands=bands), settings)
        if sweep + 1 < MASS_SWEEPS:
            continue
        more = _broken_between(nodes, grid.fly(schedule, takeoff_mass=takeoff_mass))
        if not len(more):
            break
        nodes = nodes.with_nodes(grid.segment[more], grid.time[more])
        model = make_path_model(nodes.conditions())
    if method == "batched":
        return schedule

    from vrsopt.schedule.genetic import GeneticOptions, genetic_minimum  # pymoo is slow to import

    genetic = genetic or GeneticOptions()
    mass = _mass(nodes, grid, schedule, takeoff_mass, model)
    optima, generations = genetic_minimum(
        model, mass, box=box, bands=bands, options=genetic, workers=workers, progress=progress
    )
    return _schedule(nodes, model, optima, settings, generations=generations, cap=genetic.most_generations)


def _reachable(box: np.ndarray, settings: ScheduleSettings) -> np.ndarray:
    """The box without what lies beyond a band that may not be crossed, as seen from the nominal rotor speed."""
    box = box.copy()
    for band in settings.forbidden_bands:
        if band.crossing_time == 0.0 and settings.nominal_rotor_speed < band.upper:
            box[1, 0] = min(box[1, 0], band.lower)
        elif band.crossing_time == 0.0:
            box[0, 0] = max(box[0, 0], band.upper)
    return box


def _mass(
    nodes: DecisionNodes, grid: FlightGrid, schedule: Schedule, takeoff_mass: float, model: PathModel
) -> np.ndarray:
    """Mass (m,) [kg] at the searches of ``nodes`` when ``schedule`` is flown, within what the model holds for."""
    mass = nodes.interpolated(grid, grid.burned(schedule, takeoff_mass=takeoff_mass)[0])
    return np.clip(mass, *model.bounds["mass"])


def _broken_between(nodes: DecisionNodes, flight: Flight) -> np.ndarray:
    """Nodes of the fine grid, one between any two decision nodes between which a limit is broken."""
    excess = np.max(flight.limits, axis=0)
    found = []
    edges = np.flatnonzero(np.diff(nodes.segment) == 0)
    for before in edges:
        inside = (flight.segment == nodes.segment[before]) & (flight.time > nodes.time[before] + 1e-6)
        between = np.flatnonzero(inside & (flight.time < nodes.time[before + 1] - 1e-6))
        if len(between):
            worst = between[np.argmax(excess[between])]
            if excess[worst] > CHECKED_LIMIT:
                found.append(int(worst))
    return np.array(found, dtype=int)


def _schedule(
    nodes: DecisionNodes,
    model: PathModel,
    optima: PointOptima,
    settings: ScheduleSettings,
    *,
    generations: np.ndarray | None = None,
    cap: int = 0,
) -> Schedule:
    """Schedule of the optima of the searches at the decision nodes, with nominal values in idle."""
    status, message, count = Status.CONVERGED, "", len(optima.rotor_speed)
    details = {"nodes": float(count)}
    if generations is not None:
        capped = int(np.sum(generations >= cap))
        details |= {"mean_generations": float(generations.mean()), "nodes_at_generation_cap": float(capped)}
        if capped:
            status = Status.ITERATION_LIMIT
            message = f"{capped} of {count} nodes stopped at the cap of {cap} generations"
    worst = int(np.argmax(optima.excess))
    if optima.excess[worst] > ON_LIMIT:
        node = nodes.first[worst]
        violation = Violation(
            model.limit_names[optima.nearest_limit[worst]],
            nodes.profile.segments[nodes.segment[node]].task,
            float(nodes.time[node]),
            float(optima.excess[worst]),
        )
        status, message = Status.INFEASIBLE, f"no rotor speed and twist meet the limits: at best {violation}"
    segment, time, rotor_speed, twist = across_bands(
        nodes.segment,
        nodes.time,
        nodes.spread(optima.rotor_speed, settings.nominal_rotor_speed),
        nodes.spread(optima.twist, settings.nominal_twist),
        settings.forbidden_bands,
    )
    return Schedule(
        name="pointwise",
        segment=segment,
        time=time,
        rotor_speed=rotor_speed,
        twist=twist,
        success=status is Status.CONVERGED,
        status=status,
        message=message,
        details=details,
    )
