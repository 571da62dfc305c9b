"""A few flights with weights that stand for a whole mission: a quadrature whose nodes are flights of the missions.

What a mission burns is an integral over its time. Its weights on the few flights are not negative, and such that the
integrals of a family of functions are the mission's own: time, nominal and least fuel flow, rotor speed of least fuel,
for the aircraft as it is, lighter and heavier, with other manoeuvre margins. The flights are chosen one after the other
out of those of all missions, each time the one that leaves the smallest errors. They are the same for all missions,
which differ in the weights. Nominal and least fuel share them: what is wrong with both cancels in the saving.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from scipy.optimize import nnls

from vrsopt.atmosphere import standard_air
from vrsopt.limits import LIMIT_NAMES
from vrsopt.mission.conditions import Conditions
from vrsopt.mission.file import Mission
from vrsopt.schedule.batched import PointOptima, batched_minimum
from vrsopt.schedule.flight_nodes import flight_nodes
from vrsopt.schedule.mission_setup import MissionSetup
from vrsopt.schedule.physics_node import NodePhysics
from vrsopt.schedule.schedule import ON_LIMIT
from vrsopt.schedule.surrogate_path import SurrogateAircraft

MISSIONS = ("patm", "lem", "sarm")
FAR = -1.0  # m, as the height of a flight far from the ground: JSON knows no infinity
STEP = 20.0  # s, at most, between the flights that may be chosen
MARGIN = 1.3  # of the missions
SETTINGS = ((1.0, MARGIN), (1.0, 1.0), (1.0, 1.5), (0.95, MARGIN), (1.05, MARGIN))  # mass factor, manoeuvre margin
ON = ("blade loading", "tail rotor loading", "least rotor speed")
FAMILY = (
    *("time", "density x speed^3"),
    *(f"time, twice on {name}" for name in ON),  # twice: a mission may spend none there
    *(f"{what}, mass x {m:g}, margin {n:g}" for m, n in SETTINGS for what in ("nominal fuel", "least fuel", "speed")),
)
FUEL_COUNTS = 9.0  # an error of fuel as much as so many times the error of anything else
IMPORTANCE = np.array([FUEL_COUNTS if "fuel" in name else 1.0 for name in FAMILY])


@dataclass(frozen=True)
class Sampled:
    """A mission at its nodes in flight: ``flights`` (without rotor speed and twist), ``values`` (m, N) of FAMILY there,
    ``weights`` (N,) [s] and the integrals ``target`` (m,); ``idle`` [s] on the ground at a mean altitude [m];
    ``carried``: least fuel with the mass of a flight that has burned the least, over that with the mass of the nominal
    flight."""

    name: str
    flights: list[dict[str, float]]
    values: np.ndarray
    target: np.ndarray
    weights: np.ndarray
    idle: tuple[float, float]
    carried: float


@dataclass(frozen=True)
class Representation:
    """Flights (n); by mission their weights (n,) [s], ``idle`` [s] at an altitude [m], ``carried`` as of
    :class:`Sampled`, and ``error``: the largest relative error of an integral of fuel."""

    flights: list[dict[str, float]]
    weights: Mapping[str, np.ndarray]
    idle: Mapping[str, tuple[float, float]]
    carried: Mapping[str, float]
    error: Mapping[str, float]

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "flights": self.flights,
            "weights_s": {name: row.tolist() for name, row in self.weights.items()},
            "idle_s_m": {name: list(pair) for name, pair in self.idle.items()},
            "carried": dict(self.carried),
            "largest_fuel_error": dict(self.error),
        }

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Representation:
        return cls(
            list(content["flights"]),
            {name: np.array(row) for name, row in content["weights_s"].items()},
            {name: (pair[0], pair[1]) for name, pair in content["idle_s_m"].items()},
            dict(content["carried"]),
            dict(content["largest_fuel_error"]),
        )


def sampled(mission: Mission, name: str, step: float = STEP) -> Sampled:
    """A mission at its nodes, on the surrogate."""
    setup = MissionSetup(mission)
    every = flight_nodes(setup.profile, [setup.nominal], step=step)
    mass, weights = _flown(setup, every)
    idle = np.asarray(every.idle)
    waiting = float(weights[idle].sum())
    altitude = float(weights[idle] @ every.altitude[idle]) / waiting if waiting else 0.0
    nodes = replace(every, **{one.name: np.asarray(getattr(every, one.name))[~idle] for one in fields(Conditions)})
    mass, weights = mass[~idle], weights[~idle]
    values = family(setup, nodes, mass)
    nominal, least = values[[FAMILY.index(f"{what} fuel, mass x 1, margin 1.3") for what in ("nominal", "least")]]
    saved = weights * (nominal - least)
    heavier = _least(setup, nodes, mass + np.cumsum(saved) - 0.5 * saved, MARGIN).fuel_flow
    physics = NodePhysics(setup.machine, setup.limits, setup.profile.isa_offset)
    flights = []
    for i, one in enumerate(mass.tolist()):
        height = float(nodes.height[i])
        near = {"ground_proximity": 0.0, "height": height if math.isfinite(height) else FAR}
        flights.append({**physics.flight(nodes, i, one, 0.0, 0.0), **near})
    carried = float(heavier @ weights / (least @ weights))
    return Sampled(name, flights, values, values @ weights, weights, (waiting, altitude), carried)


def _flown(setup: MissionSetup, nodes: Conditions) -> tuple[np.ndarray, np.ndarray]:
    """Mass [kg] of the nominal flight at the nodes and their weights [s] by the trapezoidal rule, (N,)."""
    flown = setup.grid.fly(setup.nominal, takeoff_mass=setup.loading.takeoff_mass)
    mass, weights = np.empty(len(nodes.time)), np.empty(len(nodes.time))
    for index in range(len(setup.profile.segments)):
        here, fine = nodes.segment == index, flown.segment == index
        mass[here] = np.interp(nodes.time[here], flown.time[fine], flown.mass[fine])
        steps = np.diff(nodes.time[here])
        weights[here] = 0.5 * (np.append(steps, 0.0) + np.append(0.0, steps))
    return mass, weights


def family(setup: MissionSetup, nodes: Conditions, mass: np.ndarray) -> np.ndarray:
    """Values (m, N) of FAMILY on the surrogate at nodes in flight with ``mass`` (N,) [kg]."""
    settings, isa = setup.settings, setup.profile.isa_offset
    air = np.array([standard_air(altitude, isa).density for altitude in nodes.altitude])
    rows = [np.ones(len(mass)), air * np.asarray(nodes.speed) ** 3]
    best = _least(setup, nodes, mass, MARGIN)
    on = [(best.excess > -ON_LIMIT) & (best.nearest_limit == LIMIT_NAMES.index(name)) for name in ON[:2]]
    on.append(best.rotor_speed < (1.0 + ON_LIMIT) * settings.rotor_speed_bounds[0])
    rows += [1.0 + active for active in on]
    model = setup.make(nodes)
    for factor, margin in SETTINGS:
        usual = model.evaluate(_within(model, factor * mass), settings.nominal_rotor_speed, settings.nominal_twist)
        best = _least(setup, nodes, factor * mass, margin)
        rows += [usual.fuel_flow, best.fuel_flow, best.rotor_speed / settings.nominal_rotor_speed]
    return np.array(rows)


def _least(setup: MissionSetup, nodes: Conditions, mass: np.ndarray, margin: float) -> PointOptima:
    """Optima on the surrogate with ``mass`` (N,) [kg] and a manoeuvre margin."""
    limits = replace(setup.limits, manoeuvre_margin=margin)
    model = SurrogateAircraft(setup.surrogate, limits, isa_offset=setup.profile.isa_offset)(nodes)
    return batched_minimum(model, _within(model, mass), box=setup.settings.box(model.bounds))


def _within(model: Any, mass: np.ndarray) -> np.ndarray:
    """Masses for which the surrogate holds."""
    return np.clip(mass, *model.bounds["mass"])


def represented(missions: Sequence[Sampled], count: int) -> Representation:
    """The flights, at most ``count``, that stand for all ``missions``."""
    values, fuel = np.hstack([mission.values for mission in missions]), IMPORTANCE > 1.0
    chosen = greedy(values, [mission.target for mission in missions], count)
    used = sum(fitted(values[:, chosen], mission.target)[0] for mission in missions) > 0.0
    chosen = [k for k, needed in zip(chosen, used, strict=True) if needed]
    flights = [flight for mission in missions for flight in mission.flights]
    found = {mission.name: fitted(values[:, chosen], mission.target) for mission in missions}
    return Representation(
        [flights[k] for k in chosen],
        {name: weights for name, (weights, _) in found.items()},
        {mission.name: mission.idle for mission in missions},
        {mission.name: mission.carried for mission in missions},
        {name: float(np.max(np.abs(error[fuel]))) for name, (_, error) in found.items()},
    )


def spread(mission: Sampled, count: int) -> Representation:
    """A mission by ``count`` of its flights at equal distances in time, all with one weight."""
    middle = (np.arange(count) + 0.5) / count * mission.weights.sum()
    places = np.searchsorted(np.cumsum(mission.weights), middle).tolist()
    name = mission.name
    return Representation(
        [mission.flights[k] for k in places],
        {name: np.full(count, mission.weights.sum() / count)},
        {name: mission.idle},
        {name: mission.carried},
        {},
    )


def fitted(values: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weights (n,), not negative, with which ``values`` (m, n) come closest to ``target`` (m,) in the least squares of
    relative errors times IMPORTANCE, and the relative errors (m,) that remain."""
    scaled = values / target[:, None]
    weights = nnls(IMPORTANCE[:, None] * scaled, IMPORTANCE)[0]
    return weights, scaled @ weights - 1.0


def greedy(values: np.ndarray, targets: Sequence[np.ndarray], count: int) -> list[int]:
    """Places of ``count`` columns of ``values`` (m, N): each the one that with those before it leaves the least sum of
    squared errors of all ``targets`` (m,), weighted as in :func:`fitted`."""
    chosen: list[int] = []
    for _ in range(count):
        errors = np.full(values.shape[1], np.inf)
        for k in range(values.shape[1]):
            if k not in chosen:
                left = (IMPORTANCE * fitted(values[:, [*chosen, k]], target)[1] for target in targets)
                errors[k] = sum(float(one @ one) for one in left)
        chosen.append(int(np.argmin(errors)))
    return chosen
