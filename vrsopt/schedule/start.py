"""Where the solution of the whole-mission problem starts: a schedule, or the solution of a problem much like it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from vrsopt.schedule.bounds import Bounds
from vrsopt.schedule.nlp import Maps, Nlp
from vrsopt.schedule.rows import Discretisation
from vrsopt.schedule.schedule import Schedule, ScheduleSettings

FUEL_SWEEPS = 3
ASIDE = 0.02  # of rotor speed and twist
AWAY = 1e-5  # of an unknown's scale: farther from its bound a start does not feel it
# Options of IPOPT. Newton's method can go round in circles at an early barrier problem that nobody needs: it is solved
# to three times IPOPT's own factor, and a step has to be better by more to be taken.
BARRIER = {"barrier_tol_factor": 30.0, "gamma_phi": 1e-3, "gamma_theta": 1e-3}
# Cold: a tenth of its own, as the unknowns are of order one and the objective per interval is not.
COLD = {**BARRIER, "mu_init": 1e-2}
# Warm: at the end of the central path, with the multipliers known there is no need to walk it again; where they lead
# astray it shows soon
PUSHES = ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mult_bound_push")
WARM = {
    **BARRIER,
    "mu_init": 3e-9,
    "max_iter": 80,
    "warm_start_init_point": "yes",
    **{f"warm_start_{push}": 1e-6 for push in PUSHES},
}


def within_rates(schedule: Schedule, settings: ScheduleSettings) -> Schedule:
    """``schedule`` raised where it is steeper than ``settings`` allow, by no more than it takes.

    Raised because a faster rotor keeps its blade loading.
    """
    values, rates = (schedule.rotor_speed, schedule.twist), (settings.rotor_speed_rate, settings.twist_rate)
    raised = []
    for value, rate in zip(values, rates, strict=True):
        if rate is not None:
            climb = rate * schedule.time
            value = np.maximum(np.maximum.accumulate(value + climb) - climb, value)
            value = np.maximum(np.maximum.accumulate((value - climb)[::-1])[::-1] + climb, value)
        raised.append(value)
    return replace(schedule, rotor_speed=raised[0], twist=raised[1])


def still_felt(lam_x: np.ndarray, x: np.ndarray, bounds: Bounds) -> np.ndarray:
    """Multipliers ``lam_x`` of bounds that ``x`` is at; none of those that have moved away from it, as a wider rate."""
    return np.where((x > bounds.lbx + AWAY) & (x < bounds.ubx - AWAY), 0.0, lam_x)


def start_on(
    schedule: Schedule, of: Discretisation, nlp: Nlp, maps: Maps, p: Any, settings: ScheduleSettings
) -> tuple[np.ndarray, float]:
    """Unknowns on ``schedule``: its values at the nodes, rates within their bounds, its own fuel.

    Also the factor on the cost that makes it as large as the fuel is, 0 without a cost. ``p``: parameters of the NLP.
    """
    layout, mesh = of.layout, of.mesh
    x = np.zeros(layout.size)
    starts, ends = schedule.at(mesh.segment, mesh.start), schedule.at(mesh.segment, mesh.end)
    bounds = settings.rotor_speed_rate, settings.twist_rate
    for control, start, end, bound in zip(layout.controls, starts, ends, bounds, strict=True):
        x[control.end] = end / control.scale
        x[control.start] = start / control.scale
        slope = (x[control.end] - x[control.start]) * control.scale / mesh.step
        x[control.rate] = (slope if bound is None else np.clip(slope, -bound, bound)) / control.rate_scale
    if layout.charged is not None:
        x[layout.charged] = np.maximum(x[layout.controls[0].rate], 0.0)
    defects = maps.weights[: len(mesh) * (len(layout.shares) - 1)]
    for _ in range(FUEL_SWEEPS):
        outputs = np.array(nlp.values(x, p)).ravel()
        burned = -(defects @ outputs).reshape(len(mesh), -1)
        before = np.concatenate([[0.0], np.cumsum(burned[:, -1])[:-1]])
        x[layout.fuel[:, 0]] = before
        x[layout.fuel[:, 1:]] = before[:, None] + burned
    return x, float(x[layout.fuel[-1, -1]]) / _size_of_cost(of, nlp, maps, x, p) if np.any(maps.cost) else 0.0


def _size_of_cost(of: Discretisation, nlp: Nlp, maps: Maps, x: np.ndarray, p: Any) -> float:
    """How large the cost is at x, or near it: one that measures the distance from the start is nothing there."""
    moved = x.copy()
    for control in of.layout.controls:
        moved[np.concatenate([control.start, control.end])] *= 1.0 - ASIDE
        moved[control.rate] = 1.0
    moved[of.layout.charged_rate] = 1.0
    sizes = [abs(float(maps.cost @ np.array(nlp.values(at, p)).ravel())) for at in (x, moved)]
    found = [size for size in sizes if np.isfinite(size) and size > 0.0]
    return max(found, default=1.0)
