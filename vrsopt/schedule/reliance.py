"""What a flown schedule relies on: where in the surrogate's inputs it flies, and how well the surrogate is known there.

The rotors' power along a flight is a weighted sum of sampled powers (:mod:`vrsopt.schedule.rotor_tables`). Its
predicted standard deviation is taken as the sum of theirs times the sizes of the weights: what it is at most, however
their errors hang together. That of the main rotor stands for level flight, in which the tail rotor takes a twelfth;
powers at rest are smooth functions of fewer inputs, and far better known.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace

import numpy as np
import xarray as xr

from vrsopt.atmosphere import standard_air
from vrsopt.mission.conditions import Conditions
from vrsopt.schedule.decision import DecisionNodes
from vrsopt.schedule.quadrature import per_segment
from vrsopt.schedule.refly import Flight, FlightGrid
from vrsopt.schedule.rotor_tables import CLIMB, LEVEL, TAIL
from vrsopt.schedule.rotor_tables import Flight as RotorFlight
from vrsopt.schedule.similarity import standard_day
from vrsopt.schedule.surrogate_path import SurrogateAircraft
from vrsopt.surrogate.export import FREE
from vrsopt.surrogate.kriging import Array, Kriging
from vrsopt.surrogate.reliance import Distance, weak_points

MAIN = "main_rotor_power"
UNCERTAIN = (MAIN, *CLIMB)
# Beyond these the data count as poor. Over the whole flight: two standard deviations are then 0.5 % of the fuel, more
# than good schedules differ by. Anywhere: they are a tenth of the power, behind which a broken limit can hide; in short
# descents with a slow rotor, whose level flight is not flyable and thus not sampled, 2 % is common.
LARGEST_MEAN_PERCENT = 0.25
LARGEST_PERCENT = 5.0
FURTHEST = 1.5  # of the largest distance among the data: they hardly reach the edges of the box, where a hover is
LEAST_SHARE = 0.1  # of the mean power, to which it is related where a steep descent needs next to none
WEAK_POINTS = 20  # named per schedule: a tenth of the smallest useful design


def reliance(aircraft: SurrogateAircraft, nodes: DecisionNodes, grid: FlightGrid, flight: Flight) -> xr.Dataset:
    """What ``flight``, flown on ``grid``, relies on at the decision ``nodes`` in the air.

    Per node: the point in the surrogate's inputs (SI; as the surrogate is asked: of the standard day and with the mass
    times its load factor), the predicted standard deviation in per cent of the rotors' power, and the distance to the
    nearest sampled point, in the sampled box scaled to one. ``weak_point`` (weak, input): the points whose computation
    would help most, best first, ready for :func:`vrsopt.surrogate.design.add_points`; among those at which the rotors
    do not stall in level flight. Attributes: the largest and the time's mean standard deviation; ``poor_data``: what is
    wrong with the data, in words, empty if nothing is.
    """
    flying = _nearest(nodes, grid)
    points, weights = _asked(aircraft, grid, flight, flying)
    main = aircraft.models[MAIN]
    power, deviation = _power(aircraft.models, points, weights)
    percent = 100.0 * deviation / np.maximum(power, LEAST_SHARE * np.mean(power))
    distance = Distance(main)
    away, mean = distance.nearest(points), _time_mean(nodes, percent)
    found = [f"predicted standard deviation {mean:.2f} % of the power over the flight"] * (mean > LARGEST_MEAN_PERCENT)
    found += _worst("predicted standard deviation {:.1f} % of the power", percent, LARGEST_PERCENT, (grid, flying))
    far = FURTHEST * float(np.max(distance.spacing()))
    found += _worst("{:.2f} of the box from any data", away, far, (grid, flying))
    return xr.Dataset(
        {
            "segment": ("node", grid.segment[flying]),
            "time": ("node", grid.time[flying], {"units": "s"}),
            "point": (("node", "input"), points),
            "std_percent": ("node", percent, {"units": "%"}),
            "distance": ("node", away, {"units": "1"}),
            "weak_point": (("weak", "input"), weak_points(main, _flyable(aircraft, points), WEAK_POINTS)),
        },
        {"input": list(main.state_.names)},
        {
            "largest_std_percent": float(np.max(percent)),
            "mean_std_percent": mean,
            "poor_data": "relies on poor data: " + ", ".join(found) if found else "",
        },
    )


def _asked(
    aircraft: SurrogateAircraft, grid: FlightGrid, flight: Flight, nodes: np.ndarray
) -> tuple[Array, dict[str, Array]]:
    """Points (n, d) at which the surrogate is asked for the power at ``nodes``, and the weight (n,) of each output."""
    here = Conditions(**{one.name: np.asarray(getattr(grid.conditions, one.name))[nodes] for one in fields(Conditions)})
    day = standard_day(here.altitude, aircraft.plant.isa_offset, aircraft.plant.highest_altitude)
    asked = RotorFlight(day, here.speed * day.speed, here.equivalent_climb_angle, here.height)
    weights, speed = aircraft.rotors.weights(asked)
    scales = {"mass": here.load_factor * day.mass, "rotor_speed": day.speed, "twist": 1.0}
    columns = {name: scales[name] * getattr(flight, name)[nodes] for name in FREE}
    columns |= {"altitude": day.altitude, "speed": speed}
    level = weights.pop("level")
    state = aircraft.models[MAIN].state_
    points = np.column_stack([columns[name] for name in state.names])
    return np.clip(points, state.lower, state.upper), dict.fromkeys(LEVEL, level) | weights


def _flyable(aircraft: SurrogateAircraft, points: Array) -> Array:
    """Those of ``points`` (n, d) whose rotors would not stall in level flight, which is what is sampled: a descent
    needs less of the tail rotor."""
    limits = replace(aircraft.plant.limits, manoeuvre_margin=1.0)
    at = dict(zip(aircraft.models[MAIN].state_.names, points.T, strict=True))
    density = standard_air(at["altitude"]).density
    loading = limits.blade_loading_usage(at["mass"], density, at["rotor_speed"], at["speed"], smooth_max=np.maximum)
    tail = limits.tail_usage(aircraft.models[TAIL].state_.predict(points), at["rotor_speed"], at["speed"])
    return points[(loading <= 1.0) & (tail <= 1.0)]


def _power(models: Mapping[str, Kriging], points: Array, weights: Mapping[str, Array]) -> tuple[Array, Array]:
    """Power of the rotors (n,) [W] and its standard deviation (n,) [W], at most."""
    power, deviation = np.zeros(len(points)), np.zeros(len(points))
    for name, weight in weights.items():
        some = weight != 0.0
        if np.any(some):
            power[some] += weight[some] * models[name].state_.predict(points[some])
            if name in UNCERTAIN:
                variance = models[name].posterior.variance(points[some])
                deviation[some] += np.abs(weight[some]) * np.sqrt(variance)
    return power, deviation


def _nearest(nodes: DecisionNodes, grid: FlightGrid) -> np.ndarray:
    """The nodes (m,) of the fine grid that are nearest to the decision ``nodes`` in the air."""
    segment, time = nodes.segment[nodes.first], nodes.time[nodes.first]
    begin, end = (np.searchsorted(grid.segment, segment, side=side) for side in ("left", "right"))
    pairs = zip(begin, end, time, strict=True)
    return np.array([low + int(np.argmin(np.abs(grid.time[low:high] - at))) for low, high, at in pairs])


def _time_mean(nodes: DecisionNodes, values: np.ndarray) -> float:
    """Mean over the time in the air of ``values`` (m,)."""
    every, count = np.arange(len(nodes.time)), int(nodes.segment[-1]) + 1
    both = (nodes.spread(row, 0.0) for row in (values, np.ones(len(values))))
    sides = (np.column_stack([row, row]) for row in both)
    whole, duration = (per_segment(nodes.segment, nodes.time, row, every, count).sum() for row in sides)
    return float(whole / duration)


def _worst(text: str, values: np.ndarray, largest: float, nodes: tuple[FlightGrid, np.ndarray]) -> list[str]:
    """The largest of ``values`` (n,) in words and where it is, among ``nodes`` of a grid; empty up to ``largest``."""
    grid, flying = nodes
    k = int(np.argmax(values))
    node = flying[k]
    place = f" at {grid.time[node]:.0f} s ({grid.profile.segments[grid.segment[node]].task})"
    return [text.format(values[k]) + place] if values[k] > largest else []
