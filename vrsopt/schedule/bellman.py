"""The cheapest course through layers of states, by Bellman's recursion: rotor speeds that time carries on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vrsopt.schedule.speed_maps import SpeedMaps

BREACH = 1e6  # kg/s per unit of excess over a limit
TOO_QUICK = 1e3  # kg per rad/s2 by which the rotor speeds up more than a limit allows


@dataclass(frozen=True)
class Layers:
    """n + 1 times, the n steps between them, and K rotor speeds that ``region`` tells apart."""

    time: np.ndarray  # (n + 1,) s
    segment: np.ndarray  # (n,) of the mission, in which each step is
    idle: np.ndarray  # (n,) the step is on the ground
    speed: np.ndarray  # (K,) rad/s
    region: np.ndarray  # (K,) from which only a jump leads out
    allowed: np.ndarray  # (n + 1, K)
    reach: np.ndarray  # (n,) rad/s, by which a step may change the rotor speed


@dataclass(frozen=True)
class Jump:
    """A way from one region to another: from state to state, in so many seconds."""

    origin: int
    target: int
    duration: float


@dataclass(frozen=True)
class Course:
    """Layer and state (s,) of every stop; ``fuel`` [kg] in flight, inf if no course leads to the last layer."""

    layer: np.ndarray
    state: np.ndarray
    fuel: float


def cheapest(layers: Layers, maps: SpeedMaps, jumps: Sequence[Jump]) -> Course:
    """The course of least fuel from the first to the last layer."""
    steps, states = len(layers.segment), len(layers.speed)
    change = layers.speed[None, :] - layers.speed[:, None]
    barred = layers.region[None, :] != layers.region[:, None]
    cost = np.full((steps + 1, states), np.inf)
    cost[0, layers.allowed[0]] = 0.0
    before = np.zeros((steps + 1, states, 2), dtype=int)  # layer and state that each one comes from
    for k in range(steps):
        ways = cost[k][:, None] + _moving(maps, k, change, float(layers.time[k + 1] - layers.time[k]))
        ways[barred | (np.abs(change) > layers.reach[k] + 1e-9)] = np.inf
        origin = np.argmin(ways, axis=0)
        found = np.where(layers.allowed[k + 1], ways[origin, np.arange(states)], np.inf)
        better = found < cost[k + 1]
        cost[k + 1, better] = found[better]
        before[k + 1, better, 0], before[k + 1, better, 1] = k, origin[better]
        for jump in jumps:
            m = max(k + 1, int(np.searchsorted(layers.time, layers.time[k] + jump.duration - 1e-9)))
            if m > steps or np.any(layers.idle[k:m]) or not layers.allowed[m, jump.target]:
                continue
            total = cost[k, jump.origin] + _jumping(layers, maps, k, m, jump)
            if total < cost[m, jump.target]:
                cost[m, jump.target], before[m, jump.target] = total, (k, jump.origin)
    return _way_back(cost, before)


def _way_back(cost: np.ndarray, before: np.ndarray) -> Course:
    layer, state = len(cost) - 1, int(np.argmin(cost[-1]))
    fuel, stops = float(cost[-1, state]), [(layer, state)]
    while layer > 0:
        layer, state = before[layer, state].tolist()
        stops.append((layer, state))
    layers, states = np.array(stops[::-1]).T
    return Course(layers, states, fuel)


def _moving(maps: SpeedMaps, k: int, change: np.ndarray, step: float) -> np.ndarray:
    """Fuel (K, K) [kg] of step k from any state to any other, by the trapezoidal rule."""
    flow = maps.fuel_flow[:, k] + BREACH * np.maximum(maps.excess[:, k], 0.0)
    both, up, down = (values[0][:, None] + values[1] for values in (flow, maps.up[:, k], maps.down[:, k]))
    room = np.minimum(maps.quickest[0, k][:, None], maps.quickest[1, k])
    fuel = 0.5 * step * both + 0.5 * change * np.where(change > 0.0, up, down)
    return fuel + TOO_QUICK * np.maximum(change / step - room, 0.0)


def _jumping(layers: Layers, maps: SpeedMaps, k: int, m: int, jump: Jump) -> float:
    """Fuel [kg] of a jump over the steps from k to m; where it ends before layer m the rotor waits there."""
    ends = np.stack([layers.time[k:m], layers.time[k + 1 : m + 1]])
    share = np.minimum((ends - layers.time[k]) / jump.duration, 1.0) if jump.duration else np.ones_like(ends)
    steps, a, b = np.arange(k, m), jump.origin, jump.target
    flow, excess = (
        (1.0 - share) * values[:, steps, a] + share * values[:, steps, b] for values in (maps.fuel_flow, maps.excess)
    )
    flow = flow + BREACH * np.maximum(excess, 0.0)
    change = float(layers.speed[b] - layers.speed[a])
    price = maps.up if change > 0.0 else maps.down
    fuel = 0.5 * np.sum((ends[1] - ends[0]) * flow) + 0.5 * change * (price[0, k, a] + price[1, m - 1, b])
    if change > 0.0 and jump.duration:
        room = np.minimum(maps.quickest[:, steps, a], maps.quickest[:, steps, b]).min()
        fuel += TOO_QUICK * max(change / jump.duration - room, 0.0)
    return float(fuel)
