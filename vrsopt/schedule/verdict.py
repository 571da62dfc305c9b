"""Why the whole-mission problem has no solution, in words."""

from __future__ import annotations

import numpy as np

from vrsopt.schedule.batched import batched_minimum
from vrsopt.schedule.bounds import Box
from vrsopt.schedule.labels import Labels
from vrsopt.schedule.layout import FUEL_SCALE
from vrsopt.schedule.path_model import PathModel
from vrsopt.schedule.refly import Violation
from vrsopt.schedule.rows import Discretisation
from vrsopt.schedule.schedule import ON_LIMIT
from vrsopt.solvers.status import Status

ACCEPTED_RESIDUAL = 1e-6  # largest scaled defect or limit of a solution that counts
ADVICE = "every time by itself has allowed points: the rates or the nominal values at ends and idle are in the way"


def hopeless_place(
    of: Discretisation, model: PathModel, box: Box, *, allowed: np.ndarray, start: np.ndarray, takeoff_mass: float
) -> Violation | None:
    """Where no rotor speed and twist within ``allowed`` (2, 2) meet the limits, the worst such place.

    The mass history is that of the ``start`` x: where IPOPT gave up the fuel need not mean anything.
    """
    e = of.evaluations
    flying = np.flatnonzero(~of.idle)
    inside = np.flatnonzero((e.share > 0.0) & (e.share < 1.0))
    _, lead = np.unique(e.interval[inside], return_index=True)
    point = e.point[inside[lead]][flying]
    mass = takeoff_mass + box.mass_added[point] - FUEL_SCALE * start[box.fuel_place[point]]
    mass = np.clip(mass, box.lightest[point], box.heaviest[point])
    optima = batched_minimum(model.nodes(point), mass, box=allowed, refinements=6)
    worst = int(np.argmax(optima.excess))
    if optima.excess[worst] <= ON_LIMIT:
        return None
    name, excess = model.limit_names[optima.nearest_limit[worst]], float(optima.excess[worst])
    segment, time = e.points.segment[point[worst]], e.points.time[point[worst]]
    return Violation(name, of.tasks[segment], float(time), excess)


def what_is_broken(of: Discretisation, rows: Labels, breach: np.ndarray, status: Status) -> str:
    """The largest scaled ``breach`` (R,) of the rows."""
    row = int(np.argmax(breach))
    words = "infeasible" if status is Status.INFEASIBLE else str(status)
    if breach[row] <= ACCEPTED_RESIDUAL:
        return f"{words}: all limits and rates are met, but the fuel is not yet the least"
    label = rows[row]
    family, name = label.kind.family, label.kind.name
    if family == "integral":
        return f"{words}: {name} not met by {breach[row] * label.kind.scale:.3g} {label.kind.unit}"
    task = of.tasks[label.segment]
    if family in ("limit", "own"):
        return f"{words}: {Violation(name, task, label.time, float(breach[row]))}; {ADVICE}"
    return f"{words}: {name} not met at {of.mesh.start[label.interval]:.0f} s ({task}); {ADVICE}"
