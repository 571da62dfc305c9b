"""Any schedule flown on one fine grid: the fuel of every comparison comes from here.

The flown schedule is the given one sampled at the grid nodes and linear between them, so the rate of the rotor speed
is constant over a step. Fuel flow is evaluated at both ends of each step with the rate of that step and integrated with
the trapezoidal rule: jumps of the rate cost no accuracy and the rotor's kinetic energy is conserved exactly.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.schedule.emissions import Emitted, emitted
from vrsopt.schedule.path_model import PathModelFactory, PathValues
from vrsopt.schedule.quadrature import mean_of_sides, thinned
from vrsopt.schedule.schedule import ON_LIMIT, Schedule

if TYPE_CHECKING:
    from vrsopt.mission.profile import Profile

logger = logging.getLogger(__name__)

MASS_TOLERANCE = 1e-10  # of the take-off mass: where the sweeps over the mass history stop
MAX_SWEEPS = 30
JUMP = 1e-9  # relative change across a segment edge that counts as a jump


@dataclass(frozen=True)
class Violation:
    """The worst breach of one limit: which, in which task, when [s], and by how much (0.01 is 1 % over)."""

    limit: str
    task: str
    time: float
    excess: float

    def __str__(self) -> str:
        return f"{self.limit} {100 * self.excess:.2f} % over its limit at {self.time:.0f} s ({self.task})"


@dataclass(frozen=True)
class Flight:
    """A flown schedule at the N nodes of the grid. Rates and shares refer to the flown, sampled schedule."""

    schedule: Schedule
    segment: np.ndarray  # (N,)
    time: np.ndarray  # s
    mass: np.ndarray  # kg
    rotor_speed: np.ndarray  # rad/s
    twist: np.ndarray  # rad
    fuel_flow: np.ndarray  # kg/s, mean of the two sides of a node
    power_per_engine: np.ndarray  # W, mean of the two sides of a node
    limits: np.ndarray  # (m, N), the higher of the two sides; -inf in idle
    fuel_per_segment: np.ndarray  # kg
    quadrature_error: float  # kg, estimated from the grid of twice the step
    max_rotor_speed_rate: float  # rad/s2, inf if the schedule jumps
    max_twist_rate: float  # rad/s, inf if the schedule jumps
    time_on_limits: Mapping[str, float]  # share of the mission time with the limit active (within 0.1 %)
    violations: tuple[Violation, ...]
    sweeps: int
    success: bool
    message: str

    @property
    def fuel(self) -> float:
        """Fuel burned over the mission, kg."""
        return float(np.sum(self.fuel_per_segment))


class FlightGrid:
    """The fine grid of a mission and the aircraft along it, built once and flown with any schedule."""

    def __init__(self, profile: Profile, make_path_model: PathModelFactory, *, step: float = 1.0) -> None:
        """Nodes at most ``step`` [s] apart, with both ends of every segment."""
        self.profile = profile
        self.conditions = profile.grid(step)
        self.model = make_path_model(self.conditions)
        self.segment = np.asarray(self.conditions.segment)
        self.time = np.asarray(self.conditions.time, dtype=float)

    @cached_property
    def _all(self) -> np.ndarray:
        return np.arange(len(self.time))

    @cached_property
    def _coarse(self) -> np.ndarray:
        return thinned(self.segment, 2)

    def rates(self, values: np.ndarray, nodes: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Rate of change (N, 2) before and after each node, zero across edges, and the steps (n - 1,) [s]."""
        nodes = self._all if nodes is None else nodes
        inside = np.diff(self.segment[nodes]) == 0
        step = np.where(inside, np.diff(self.time[nodes]), 0.0)
        slope = np.divide(np.diff(values[nodes]), step, out=np.zeros(len(step)), where=step > 0)
        both = np.zeros((len(self.time), 2))
        both[nodes[1:], 0] = slope
        both[nodes[:-1], 1] = slope
        return both, step

    def evaluate(self, mass: np.ndarray, rotor_speed: np.ndarray, twist: np.ndarray) -> PathValues:
        """Path values (N, 2) on both sides of each node, with the rates of the steps before and after it."""
        return self._evaluate(mass, rotor_speed, twist, self.rates(rotor_speed)[0])

    def _evaluate(self, mass: np.ndarray, rotor_speed: np.ndarray, twist: np.ndarray, rate: np.ndarray) -> PathValues:
        return self.model.evaluate(mass[:, None], rotor_speed[:, None], twist[:, None], rate)

    def _burn(self, fuel_flow: np.ndarray, nodes: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Fuel [kg] burned before each of ``nodes``, by the trapezoidal rule."""
        increments = 0.5 * step * (fuel_flow[nodes[:-1], 1] + fuel_flow[nodes[1:], 0])
        return np.concatenate([[0.0], np.cumsum(increments)])

    def mass_after(self, takeoff_mass: float, burned: np.ndarray) -> np.ndarray:
        """Mass (N,) [kg] after ``burned`` fuel and all mass changes up to and including the segment's own."""
        return takeoff_mass - burned + np.cumsum(self.profile.mass_changes)[self.segment]

    def worst(self, limits: np.ndarray, *, above: float = ON_LIMIT) -> tuple[Violation, ...]:
        """The worst breach of every limit (m, N) that is broken by more than ``above``, largest first."""
        found = []
        for name, row in zip(self.model.limit_names, limits, strict=True):
            node = int(np.argmax(row))
            if row[node] > above:
                task = self.profile.segments[self.segment[node]].task
                found.append(Violation(name, task, float(self.time[node]), float(row[node])))
        return tuple(sorted(found, key=lambda violation: -violation.excess))

    def flyable_limits(self, values: PathValues) -> np.ndarray:
        """Limits (m, N) of both sides of the nodes together; idle, where a schedule has no say, as -inf."""
        return np.where(np.asarray(self.conditions.idle), -np.inf, np.max(values.limits, axis=-1))

    def fly(self, schedule: Schedule, *, takeoff_mass: float) -> Flight:
        """Integrate dm/dt = -fuel_flow with the mission's mass changes, from ``takeoff_mass`` [kg] before the first.

        Sweeps over the whole time line until the mass history is a fixed point to 1e-10 of the take-off mass. Where the
        aircraft's model gives no number the fuel is not a number either, and the message names the place.
        """
        rotor_speed, twist = schedule.at(self.segment, self.time)
        rate, step = self.rates(rotor_speed)
        burned, change, sweeps = np.zeros(len(self.time)), np.inf, 0
        while change > MASS_TOLERANCE * takeoff_mass and sweeps < MAX_SWEEPS:  # ends on a change that is no number too
            sweeps += 1
            mass = self.mass_after(takeoff_mass, burned)
            values = self._evaluate(mass, rotor_speed, twist, rate)
            previous, burned = burned, self._burn(values.fuel_flow, self._all, step)
            change = float(np.max(np.abs(burned - previous)))
        logger.debug("flown %s: %d sweeps, %.4f kg", schedule.name, sweeps, burned[-1])
        coarse_rate, coarse_step = self.rates(rotor_speed, self._coarse)
        coarse = self._burn(self._evaluate(mass, rotor_speed, twist, coarse_rate).fuel_flow, self._coarse, coarse_step)
        limits = self.flyable_limits(values)
        violations = self.worst(limits)
        problem = self._problem(values, change, takeoff_mass) or "; ".join(str(violation) for violation in violations)
        return Flight(
            schedule=schedule,
            segment=self.segment,
            time=self.time,
            mass=self.mass_after(takeoff_mass, burned),
            rotor_speed=rotor_speed,
            twist=twist,
            fuel_flow=mean_of_sides(values.fuel_flow, self.segment),
            power_per_engine=mean_of_sides(values.power_per_engine, self.segment),
            limits=limits,
            fuel_per_segment=self._per_segment(burned),
            quadrature_error=abs(float(coarse[-1] - burned[-1])) / 3.0,
            max_rotor_speed_rate=self._max_rate(rotor_speed),
            max_twist_rate=self._max_rate(twist),
            time_on_limits=self._time_on_limits(limits, step),
            violations=violations,
            sweeps=sweeps,
            success=not problem and schedule.success,
            message=problem or schedule.message,
        )

    def emissions(self, flight: Flight) -> Emitted:
        """What a flight of this grid emits; apart from the flight because a search for schedules does not need it."""
        values = self.evaluate(flight.mass, flight.rotor_speed, flight.twist)
        flows = self.model.emissions(values.fuel_flow, values.power_per_engine, flight.rotor_speed[:, None])
        return emitted(self.segment, self.time, flows, len(self.profile.segments))

    def _problem(self, values: PathValues, change: float, takeoff_mass: float) -> str:
        """Why the flight cannot be believed, in words; empty if it can."""
        bad = ~np.isfinite(values.fuel_flow).all(axis=-1)
        if bad.any():
            node = int(np.argmax(bad))
            task = self.profile.segments[self.segment[node]].task
            return f"no fuel flow at {int(bad.sum())} nodes, first at {self.time[node]:.0f} s ({task})"
        if change > MASS_TOLERANCE * takeoff_mass:
            return f"mass history still moves by {change:.2g} kg after {MAX_SWEEPS} sweeps"
        return ""

    def _per_segment(self, burned: np.ndarray) -> np.ndarray:
        segments = np.arange(len(self.profile.segments))
        first = np.searchsorted(self.segment, segments, side="left")
        last = np.searchsorted(self.segment, segments, side="right") - 1
        return burned[last] - burned[first]

    def _max_rate(self, values: np.ndarray) -> float:
        across = np.diff(self.segment) != 0
        if np.any(np.abs(np.diff(values))[across] > JUMP * np.max(np.abs(values))):
            return float("inf")
        return float(np.max(np.abs(self.rates(values)[0])))

    def _time_on_limits(self, limits: np.ndarray, step: np.ndarray) -> dict[str, float]:
        weight = 0.5 * (np.append(step, 0.0) + np.append(0.0, step))
        share = (np.abs(limits) <= ON_LIMIT) @ weight / np.sum(weight)
        return dict(zip(self.model.limit_names, share.tolist(), strict=True))
