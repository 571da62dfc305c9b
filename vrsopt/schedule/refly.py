"""Any schedule flown on one fine grid: the fuel of every comparison comes from here.

The flown schedule is the given one sampled at the grid nodes and linear between them, so the rate of the rotor speed
is constant over a step. Fuel flow is evaluated at both ends of each step with the rate of that step and integrated with
the trapezoidal rule: jumps of the rate cost no accuracy and the rotor's kinetic energy is conserved exactly. Every
segment has an even number of steps, so that every second node is a uniform grid too and shows the quadrature error.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.errors import InputError
from vrsopt.schedule.emissions import Emitted, emitted
from vrsopt.schedule.path_model import PathModelFactory, PathValues
from vrsopt.schedule.quadrature import mean_of_sides, thinned
from vrsopt.schedule.schedule import ON_LIMIT, Schedule, ScheduleSettings
from vrsopt.schedule.violation import Violation, too_long_stays

if TYPE_CHECKING:
    from vrsopt.mission.profile import Conditions, Profile

logger = logging.getLogger(__name__)

MASS_TOLERANCE = 1e-10  # of the take-off mass: where the sweeps over the mass history stop
MAX_SWEEPS = 30
SAME_MASS = 1e-6  # kg, by which a mass may be outside those for which the aircraft's model holds
JUMP = 1e-9  # relative change across a segment edge that counts as a jump


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
    max_rotor_speed_acceleration: float  # rad/s3, between the schedule's own nodes; inf if it jumps
    time_on_limits: Mapping[str, float]  # share of the mission time with the limit active (within 0.1 %)
    violations: tuple[Violation, ...]
    sweeps: int
    success: bool
    message: str

    @property
    def fuel(self) -> float:
        """Fuel burned over the mission, kg."""
        return float(np.sum(self.fuel_per_segment))


@dataclass(frozen=True)
class _Sweeps:
    """The last sweep over the mass history: at which mass (N,) [kg] the aircraft was evaluated, the values there, the
    fuel burned (N,) [kg], how far it moved [kg], and the number of sweeps."""

    mass: np.ndarray
    values: PathValues
    burned: np.ndarray
    change: float
    count: int


class FlightGrid:
    """The fine grid of a mission and the aircraft along it, built once and flown with any schedule."""

    def __init__(
        self,
        profile: Profile,
        make_path_model: PathModelFactory,
        *,
        step: float = 1.0,
        settings: ScheduleSettings | None = None,
    ) -> None:
        """Nodes at most ``step`` [s] apart, with both ends of every segment.

        Of ``settings`` the credit for spin-down and the forbidden bands apply to every flight.
        """
        self.profile, self.settings = profile, settings or ScheduleSettings()
        self.conditions = even_grid(profile, step)
        self.model = make_path_model(self.conditions)
        self.segment = np.asarray(self.conditions.segment)
        self.time = np.asarray(self.conditions.time, dtype=float)

    def under(self, settings: ScheduleSettings) -> FlightGrid:
        """The same grid with other settings."""
        other = copy(self)
        other.settings = settings
        return other

    @cached_property
    def mass_bounds(self) -> np.ndarray:
        """Least and largest mass (2, N) [kg] for which the aircraft's model holds at the nodes."""
        return np.array([np.broadcast_to(bound, self.time.shape) for bound in self.model.bounds["mass"]])

    @cached_property
    def _all(self) -> np.ndarray:
        return np.arange(len(self.time))

    @cached_property
    def _coarse(self) -> np.ndarray:
        return thinned(self.segment, 2)

    def rates(self, values: np.ndarray, nodes: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Rate (N, 2) before and after each node, both inside its segment; steps (n - 1,) [s], zero across edges."""
        nodes = self._all if nodes is None else nodes
        inside = np.diff(self.segment[nodes]) == 0
        step = np.where(inside, np.diff(self.time[nodes]), 0.0)
        slope = np.divide(np.diff(values[nodes]), step, out=np.zeros(len(step)), where=step > 0)
        both = np.zeros((len(self.time), 2))
        both[nodes[1:], 0] = both[nodes[:-1], 1] = slope
        first, last = nodes[np.append(True, ~inside)], nodes[np.append(~inside, True)]
        both[first, 0], both[last, 1] = both[first, 1], both[last, 0]
        return both, step

    def evaluate(self, mass: np.ndarray, rotor_speed: np.ndarray, twist: np.ndarray) -> PathValues:
        """Path values (N, 2) on both sides of each node, with the rates of the steps before and after it."""
        return self._evaluate(mass, rotor_speed, twist, self.rates(rotor_speed)[0])

    def _evaluate(self, mass: np.ndarray, rotor_speed: np.ndarray, twist: np.ndarray, rate: np.ndarray) -> PathValues:
        charged = rate if self.settings.spin_down_credit else np.maximum(rate, 0.0)
        return self.model.evaluate(mass[:, None], rotor_speed[:, None], twist[:, None], charged)

    def _burn(self, fuel_flow: np.ndarray, nodes: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Fuel [kg] burned before each of ``nodes``, by the trapezoidal rule."""
        increments = 0.5 * step * (fuel_flow[nodes[:-1], 1] + fuel_flow[nodes[1:], 0])
        return np.concatenate([[0.0], np.cumsum(increments)])

    def mass_after(self, takeoff_mass: float, burned: np.ndarray) -> np.ndarray:
        """Mass (N,) [kg] after ``burned`` fuel and all mass changes up to and including the segment's own."""
        return takeoff_mass - burned + np.cumsum(self.profile.mass_changes)[self.segment]

    def worst(
        self, limits: np.ndarray, *, above: float = ON_LIMIT, names: Sequence[str] | None = None
    ) -> tuple[Violation, ...]:
        """The worst breach of every limit (m, N) that is broken by more than ``above``, largest first."""
        found = []
        for name, row in zip(names or self.model.limit_names, limits, strict=True):
            node = int(np.argmax(row))
            if row[node] > above:
                task = self.profile.segments[self.segment[node]].task
                found.append(Violation(name, task, float(self.time[node]), float(row[node])))
        return tuple(sorted(found, key=lambda violation: -violation.excess))

    def flyable_limits(self, values: PathValues) -> np.ndarray:
        """Limits (m, N) of both sides of the nodes together; idle, where a schedule has no say, as -inf."""
        return np.where(np.asarray(self.conditions.idle), -np.inf, np.max(values.limits, axis=-1))

    def burned(self, schedule: Schedule, *, takeoff_mass: float) -> tuple[np.ndarray, np.ndarray]:
        """Mass (N,) [kg] from ``takeoff_mass`` before the mission's first mass change, and fuel burned (N,) [kg].

        Where the aircraft's model does not hold for the mass, the nearest mass for which it does burns in its place:
        what is found there shows how far off a take-off mass is, and no more.
        """
        burned = self._sweep(takeoff_mass, *schedule.at(self.segment, self.time)).burned
        return self.mass_after(takeoff_mass, burned), burned

    def _sweep(self, takeoff_mass: float, rotor_speed: np.ndarray, twist: np.ndarray) -> _Sweeps:
        rate, step = self.rates(rotor_speed)
        burned, change, count = np.zeros(len(self.time)), np.inf, 0
        while change > MASS_TOLERANCE * takeoff_mass and count < MAX_SWEEPS:  # ends on a change that is no number too
            count += 1
            mass = np.clip(self.mass_after(takeoff_mass, burned), *self.mass_bounds)
            values = self._evaluate(mass, rotor_speed, twist, rate)
            previous, burned = burned, self._burn(values.fuel_flow, self._all, step)
            change = float(np.max(np.abs(burned - previous)))
        return _Sweeps(mass, values, burned, change, count)

    def fly(self, schedule: Schedule, *, takeoff_mass: float) -> Flight:
        """Integrate dm/dt = -fuel_flow with the mission's mass changes, from ``takeoff_mass`` [kg] before the first.

        Sweeps over the whole time line until the mass history is a fixed point to 1e-10 of the take-off mass. Where the
        aircraft's model gives no number the fuel is not a number either, and the message names the place. Raises
        InputError where the mass is one for which the model does not hold.
        """
        rotor_speed, twist = schedule.at(self.segment, self.time)
        last = self._sweep(takeoff_mass, rotor_speed, twist)
        values, burned = last.values, last.burned
        mass = self.mass_after(takeoff_mass, burned)
        self.check_mass(mass)
        logger.debug("flown %s: %d sweeps, %.4f kg", schedule.name, last.count, burned[-1])
        rate, step = self.rates(rotor_speed, self._coarse)
        coarse = self._burn(self._evaluate(last.mass, rotor_speed, twist, rate).fuel_flow, self._coarse, step)
        limits = self.flyable_limits(values)
        violations = (*self.worst(limits), *self._stays(rotor_speed))
        problem = self._problem(values, last.change, takeoff_mass) or "; ".join(
            str(violation) for violation in violations
        )
        return Flight(
            schedule=schedule,
            segment=self.segment,
            time=self.time,
            mass=mass,
            rotor_speed=rotor_speed,
            twist=twist,
            fuel_flow=mean_of_sides(values.fuel_flow, self.segment),
            power_per_engine=mean_of_sides(values.power_per_engine, self.segment),
            limits=limits,
            fuel_per_segment=self._per_segment(burned),
            quadrature_error=abs(float(coarse[-1] - burned[-1])) / 3.0,
            max_rotor_speed_rate=self._max_rate(rotor_speed),
            max_twist_rate=self._max_rate(twist),
            max_rotor_speed_acceleration=schedule.rotor_speed_acceleration,
            time_on_limits=self.time_on_limits(limits),
            violations=violations,
            sweeps=last.count,
            success=not problem and schedule.success,
            message=problem or schedule.message,
        )

    def check_mass(self, mass: np.ndarray) -> None:
        """Raises InputError for the mass (N,) [kg] that is furthest outside those for which the model holds."""
        low, high = self.mass_bounds
        outside = np.maximum(mass - high, low - mass)
        node = int(np.argmax(np.where(np.isnan(outside), -np.inf, outside)))
        if outside[node] > SAME_MASS:
            task = self.profile.segments[self.segment[node]].task
            load = float(self.conditions.load_factor[node])
            raise InputError(
                f"gross mass = {mass[node]:.1f} kg at {self.time[node]:.0f} s ({task}): the aircraft's model holds "
                f"from {low[node]:.1f} to {high[node]:.1f} kg there, at a load factor of {load:.2f}"
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

    def _stays(self, rotor_speed: np.ndarray) -> tuple[Violation, ...]:
        settings = self.settings
        return too_long_stays(
            settings.forbidden_bands,
            nominal=settings.nominal_rotor_speed,
            tasks=[self.profile.segments[index].task for index in self.segment] if settings.forbidden_bands else [],
            time=self.time,
            rotor_speed=rotor_speed,
        )

    def time_on_limits(self, limits: np.ndarray) -> dict[str, float]:
        """Share of the mission time with each limit (m, N) active."""
        step = self.rates(self.time)[1]
        weight = 0.5 * (np.append(step, 0.0) + np.append(0.0, step))
        share = (np.abs(limits) <= ON_LIMIT) @ weight / np.sum(weight)
        return dict(zip(self.model.limit_names, share.tolist(), strict=True))


def even_grid(profile: Profile, step: float) -> Conditions:
    """Conditions on uniform steps of at most ``step`` [s] in each segment, an even number of them.

    Raises InputError for a step that is not a number above 0.
    """
    if not 0.0 < step < float("inf"):
        raise InputError(f"flight grid: step = {step!r}: allowed: a number above 0")
    segments, times = [], []
    for index, item in enumerate(profile.segments):
        count = 2 * ceil(item.duration / (2.0 * step) - 1e-9)
        times.append(np.linspace(item.start, item.end, count + 1))
        segments.append(np.full(count + 1, index))
    return profile.conditions(np.concatenate(segments), np.concatenate(times))
