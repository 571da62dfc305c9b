"""From the numbers of a solved NLP to a trajectory: schedule, multipliers, costates and switching structure."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from vrsopt.schedule.bounds import Bounds
from vrsopt.schedule.labels import Labels
from vrsopt.schedule.layout import FUEL_SCALE
from vrsopt.schedule.rows import Discretisation
from vrsopt.schedule.schedule import ON_LIMIT, Schedule
from vrsopt.schedule.trajectory_solution import Arc

if TYPE_CHECKING:
    from vrsopt.schedule.transcription import Points

AT_BOUND = 1e-4  # of the bound, or of the unknown's scale: nearer counts as active


@dataclass(frozen=True)
class Optimum:
    """What IPOPT returned, with the bounds it kept; ``unit``: one of f in units of the objective."""

    x: np.ndarray
    g: np.ndarray
    lam_x: np.ndarray
    lam_g: np.ndarray
    bounds: Bounds
    unit: float


def scheduled(
    of: Discretisation, nodes: Points, at: np.ndarray, x: np.ndarray, unburned: np.ndarray
) -> tuple[Schedule, np.ndarray]:
    """Schedule at the mesh nodes and the mass [kg] there; ``unburned`` (N,) [kg]: mass but for the fuel burned.

    ``x``: unknowns of the NLP, scaled; ``at`` (N, 2): indices of the ends of the intervals among ``nodes``.
    """
    values = np.empty((3, len(nodes.time)))
    values[0, at] = unburned[:, None] - FUEL_SCALE * x[of.layout.fuel[:, [0, -1]]]
    for control in of.layout.controls:
        values[control.row, at] = np.column_stack([x[control.start], x[control.end]]) * control.scale
    return Schedule("trajectory", nodes.segment, nodes.time, values[1], values[2]), values[0]


def costates(of: Discretisation, rows: Labels, optimum: Optimum, fuel_counts: bool) -> dict[str, np.ndarray]:
    """Derivatives of the objective still to come by the states at the end of each interval, each (N,).

    The multiplier of a defect is minus the change of the objective with that defect, which in the case of the fuel is
    both burned and no longer carried. ``fuel_counts``: the objective is the fuel.
    """
    burned = optimum.lam_g[rows.where("defect", "fuel burned")] * optimum.unit / FUEL_SCALE
    found = {"mass": burned + 1.0 if fuel_counts else burned}
    for control in of.layout.controls:
        defect = optimum.lam_g[rows.where("defect", f"{control.name} rate")]
        found[control.name.replace(" ", "_")] = -defect * optimum.unit / control.scale
    return found


def limit_multipliers(rows: Labels, optimum: Optimum, count: int) -> dict[str, np.ndarray]:
    """Fall of the objective per unit by which a limit or own constraint is raised over each of the ``count`` intervals
    (N,): the sum of the multipliers of its rows there, negative for a lower bound.

    A node where two intervals meet is a row of the second one, unless the rate is felt: then of both.
    """
    found = {}
    for kind in rows.kinds:
        if kind.family in ("limit", "own"):
            places = rows.where(kind.family, kind.name)
            values = optimum.lam_g[places] * optimum.unit / kind.scale
            found[kind.name] = np.bincount(rows.interval[places], weights=values, minlength=count)
    return found


def bound_multipliers(of: Discretisation, at: np.ndarray, optimum: Optimum) -> dict[str, np.ndarray]:
    """Multipliers of the bounds of rotor speed and twist (n,) at the nodes, and of their rates (N,)."""
    found: dict[str, np.ndarray] = {}
    for control in of.layout.controls:
        name, values = control.name.replace(" ", "_"), np.empty(int(at.max()) + 1)
        values[at] = optimum.lam_x[np.column_stack([control.start, control.end])] * optimum.unit / control.scale
        found[name] = values
        found[f"{name}_rate"] = optimum.lam_x[control.rate] * optimum.unit / control.rate_scale
    return found


def integrals(rows: Labels, optimum: Optimum) -> tuple[dict[str, float], dict[str, float]]:
    """Values of the constrained integrals and their multipliers, by name."""
    places = rows.where("integral").tolist()
    kinds = [rows[place].kind for place in places]
    return (
        {kind.name: float(optimum.g[place] * kind.scale) for kind, place in zip(kinds, places, strict=True)},
        {
            kind.name: float(optimum.lam_g[place]) * optimum.unit / kind.scale
            for kind, place in zip(kinds, places, strict=True)
        },
    )


def arcs(of: Discretisation, rows: Labels, optimum: Optimum) -> tuple[Arc, ...]:
    """Stretches of intervals on which the same limits and bounds are active. In idle nothing is free."""
    mesh, active = of.mesh, _active(of, rows, optimum)
    names = np.array(list(active), dtype=object)
    table = np.array(list(active.values()), dtype=bool).reshape(len(names), len(mesh)) & ~of.idle
    found, begin = [], 0
    for _, group in groupby(range(len(mesh)), key=lambda k: (of.tasks[mesh.segment[k]], table[:, k].tobytes())):
        last = begin + sum(1 for _ in group) - 1
        task, on = of.tasks[mesh.segment[begin]], tuple(names[table[:, begin]].tolist())
        found.append(Arc(float(mesh.start[begin]), float(mesh.end[last]), task, on))
        begin = last + 1
    return tuple(found)


def _active(of: Discretisation, rows: Labels, optimum: Optimum) -> dict[str, np.ndarray]:
    """By name, whether (N,) a limit is active somewhere in an interval, or a bound at both its ends."""
    bounds, count, found = optimum.bounds, len(of.mesh), {}
    for kind in rows.kinds:
        if kind.family not in ("limit", "own", "acceleration"):
            continue
        places = rows.where(kind.family, kind.name)
        for side, slack in (
            ("lower", optimum.g[places] - bounds.lbg[places]),
            ("upper", bounds.ubg[places] - optimum.g[places]),
        ):
            on = np.zeros(count, dtype=bool)
            on[rows.interval[places[slack < ON_LIMIT]]] = True
            found[kind.name if kind.family == "limit" else f"{kind.name} at {side} bound"] = on
    for control in of.layout.controls:
        ends = np.column_stack([control.start, control.end])
        for name, places in ((control.name, ends), (f"{control.name} rate", control.rate[:, None])):
            low, high = bounds.lbx[places], bounds.ubx[places]
            free = low < high
            found[f"{name} at lower bound"] = np.all((optimum.x[places] < low + AT_BOUND) & free, axis=1)
            found[f"{name} at upper bound"] = np.all((optimum.x[places] > high - AT_BOUND) & free, axis=1)
    return {name: on for name, on in found.items() if np.any(on)}


def residual(optimum: Optimum) -> float:
    """Largest breach of a row, scaled."""
    return float(np.max(breaches(optimum.g, optimum.bounds), initial=0.0))


def breaches(g: np.ndarray, bounds: Bounds) -> np.ndarray:
    """Breach of every row, scaled; 0 where it is kept.

    ``g``: values of the rows, scaled.
    """
    return np.asarray(np.maximum(np.maximum(bounds.lbg - g, g - bounds.ubg), 0.0))


def details(of: Discretisation, rows: Labels, at: np.ndarray, optimum: Optimum, *, fuel_counts: bool) -> dict[str, Any]:
    """What a trajectory has of multipliers and structure, by the names of its fields.

    ``at`` as of :func:`scheduled`; ``fuel_counts``: whether fuel is part of the objective.
    """
    values, multipliers = integrals(rows, optimum)
    return {
        "costates": costates(of, rows, optimum, fuel_counts),
        "limit_multipliers": limit_multipliers(rows, optimum, len(of.mesh)),
        "bound_multipliers": bound_multipliers(of, at, optimum),
        "integrals": values,
        "integral_multipliers": multipliers,
        "arcs": arcs(of, rows, optimum),
    }
