"""Fuel along a mission at every rotor speed of a grid, twist at its best: what a global search over speeds looks up."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vrsopt.schedule.batched import BREACH
from vrsopt.schedule.decision import GROUND, decision_nodes
from vrsopt.schedule.path_model import PathModel, PathModelFactory
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.schedule import ScheduleSettings

DECISION_STEP = 60.0  # s
TWISTS, REFINEMENTS = 11, 5  # of the grid over the twist, and how often its spacing is halved
UNLIMITED_RATE = 0.01  # of the nominal rotor speed per s: where it has no bound, what fuel is compared with
NO_BOUND = 1e9  # rad/s2


@dataclass(frozen=True)
class SpeedMaps:
    """At the start and the end of n steps in time, for K rotor speeds: arrays (2, n, K).

    ``fuel_flow`` [kg/s] at constant rotor speed, ``excess`` over the nearest limit. ``up`` and ``down``: kg of fuel
    that it costs to speed up by 1 rad/s, and that slowing down gives back. ``quickest`` [rad/s2]: the rate of
    speeding up that no limit allows to exceed. ``twist`` [rad].
    """

    fuel_flow: np.ndarray
    excess: np.ndarray
    up: np.ndarray
    down: np.ndarray
    quickest: np.ndarray
    twist: np.ndarray


def speed_maps(
    grid: FlightGrid,
    make_path_model: PathModelFactory,
    *,
    segment: np.ndarray,
    times: np.ndarray,
    mass: np.ndarray,
    rotor_speed: np.ndarray,
    settings: ScheduleSettings,
    usages: Mapping[str, float],
) -> SpeedMaps:
    """Maps at ``times`` (2, n) [s], both ends of steps inside the segments ``segment`` (n,), of K rotor speeds [rad/s].

    ``mass`` [kg] at the nodes of ``grid``; ``usages``: largest ones of limits that need not be 1. Made at the decision
    nodes of the mission, linear in time in between; idle, where nothing is free, has zeros.
    """
    nodes = decision_nodes(grid.profile, DECISION_STEP)
    model, mass = make_path_model(nodes.conditions()), nodes.interpolated(grid, mass)
    allowed = np.array([usages.get(name, 1.0) - 1.0 for name in model.limit_names])
    twist = _best_twist(model, mass, rotor_speed, settings.box(model.bounds)[:, 1], allowed)
    rate = settings.rotor_speed_rate or UNLIMITED_RATE * settings.nominal_rotor_speed
    still, faster, slower = (model.evaluate(mass[:, None], rotor_speed[None, :], twist, r) for r in (0.0, rate, -rate))
    excess, pressed = (np.max(values.limits - allowed[:, None, None], axis=0) for values in (still, faster))
    bounded = (pressed > 0.0) & (pressed > excess)
    room = np.divide(-rate * excess, pressed - excess, out=np.full(excess.shape, NO_BOUND), where=bounded)
    where = [_between(nodes.segment, nodes.time, segment, time) for time in times]

    def spread(values: np.ndarray, ground: float = 0.0) -> np.ndarray:
        at_nodes = np.where(nodes.search[:, None] == GROUND, ground, values[np.maximum(nodes.search, 0)])
        return np.stack([(1.0 - w) * at_nodes[left] + w * at_nodes[left + 1] for left, w in where])

    return SpeedMaps(
        fuel_flow=spread(still.fuel_flow),
        excess=spread(excess),
        up=spread((faster.fuel_flow - still.fuel_flow) / rate),
        down=spread((still.fuel_flow - slower.fuel_flow) / rate * settings.spin_down_credit),
        quickest=spread(np.maximum(room, 0.0)),
        twist=spread(twist, settings.nominal_twist),
    )


def _best_twist(
    model: PathModel, mass: np.ndarray, rotor_speed: np.ndarray, ends: np.ndarray, allowed: np.ndarray
) -> np.ndarray:
    """Twist (m, K) [rad] of least fuel within the limits, between ``ends``: the best of a grid, halved in on."""
    shape = len(mass), len(rotor_speed)
    candidates = np.linspace(ends[0], ends[1], TWISTS if ends[1] > ends[0] else 1)
    spacing = (ends[1] - ends[0]) / (TWISTS - 1)
    candidates = np.broadcast_to(candidates, (*shape, len(candidates)))
    for _ in range(1 + REFINEMENTS):
        speeds = np.broadcast_to(rotor_speed[:, None], candidates.shape)
        values = model.evaluate(mass[:, None], speeds.reshape(len(mass), -1), candidates.reshape(len(mass), -1))
        excess = np.max(values.limits - allowed[:, None, None], axis=0)
        merit = values.fuel_flow + BREACH * np.maximum(excess, 0.0)
        best = np.argmin(merit.reshape(candidates.shape), axis=-1)
        centre = np.take_along_axis(candidates, best[..., None], axis=-1)
        spacing = 0.5 * spacing
        candidates = np.clip(centre + spacing * np.array([-1.0, 0.0, 1.0]), ends[0], ends[1])
    return centre[..., 0]


def _between(
    known_segment: np.ndarray, known_time: np.ndarray, segment: np.ndarray, time: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The known node (n,) before each place, in the same segment, and how far (n, 1) it is to the next one."""
    first, last = (np.searchsorted(known_segment, segment, side=side) for side in ("left", "right"))
    left = np.clip(np.searchsorted(known_time, time, side="right") - 1, first, last - 2)
    share = (time - known_time[left]) / (known_time[left + 1] - known_time[left])
    return left, np.clip(share, 0.0, 1.0)[:, None]
