"""A schedule flown on the full physics: trim and engine solved at every grid point, no surrogate.

The mass is integrated along the way with the fuel flow of the physics itself (trapezoidal rule, predicted by Euler's).
Neighbouring trims start from each other and re-use their factorisation. A point that is not solved makes the flight
fail: nothing is interpolated over.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.drive_train import engine_power
from vrsopt.flat_pitch import flat_pitch_power
from vrsopt.helicopter import Helicopter, helicopter
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.residual import Solution
from vrsopt.schedule.refly import every_second
from vrsopt.schedule.schedule import ON_LIMIT, Schedule

if TYPE_CHECKING:
    from vrsopt.mission.profile import Conditions, Profile

GRID_STEP = 5.0  # s
# A schedule that follows a limit on the surrogate may pass it by the surrogate's own error on the physics.
ALLOWED_BREACH = 3 * ON_LIMIT


@dataclass(frozen=True)
class PhysicsFlight:
    """A schedule flown on the physics at the N nodes of the grid, both ends of every segment among them.

    fuel [kg] burned, quadrature_error [kg] (from every second node); mass (N,) [kg], fuel_flow (N,) [kg/s] with the
    power that speeds up the rotor; usages (m, N) of LIMIT_NAMES, nan in idle; residual_norm: the largest.
    """

    segment: np.ndarray
    time: np.ndarray
    mass: np.ndarray
    fuel_flow: np.ndarray
    usages: np.ndarray
    fuel: float
    quadrature_error: float
    residual_norm: float
    success: bool
    message: str


class PhysicsPilot:
    """Flies one schedule node by node; remembers the last trim as the start of the next."""

    def __init__(self, machine: Helicopter, limits: Limits, isa_offset: float, *, kinetic_energy: bool = True) -> None:
        self.machine, self.limits, self.isa_offset = machine, limits, isa_offset
        rotor = machine.aircraft.main_rotor
        self.inertia = rotor.polar_inertia if kinetic_energy else 0.0
        self.trim: Solution | None = None
        self.engine: Solution | None = None
        self.residual_norm = 0.0

    def fly(self, profile: Profile, schedule: Schedule, *, takeoff_mass: float, step: float) -> PhysicsFlight:
        """Fly ``schedule`` from ``takeoff_mass`` [kg] on a grid of at most ``step`` [s]."""
        nodes = profile.grid(step)
        count = len(nodes.time)
        rotor_speed, twist = schedule.at(np.asarray(nodes.segment), np.asarray(nodes.time))
        sides = np.full((count, 2), np.nan)
        mass, usages = np.full(count, np.nan), np.full((len(LIMIT_NAMES), count), np.nan)
        message, here = "", takeoff_mass
        for i in range(count):
            first = i == 0 or nodes.segment[i] != nodes.segment[i - 1]
            last = i == count - 1 or nodes.segment[i] != nodes.segment[i + 1]
            if first:
                here += profile.mass_changes[nodes.segment[i]]
            before = 0.0 if first else (rotor_speed[i] - rotor_speed[i - 1]) / (nodes.time[i] - nodes.time[i - 1])
            after = 0.0 if last else (rotor_speed[i + 1] - rotor_speed[i]) / (nodes.time[i + 1] - nodes.time[i])
            predicted = here if first else here - sides[i - 1, 1] * (nodes.time[i] - nodes.time[i - 1])
            flight = _flight(nodes, i, predicted, rotor_speed[i], twist[i], self.isa_offset)
            rates = (after,) if first else (before,) if last else (before, after)
            flows, usages[:, i], message = self._node(flight, bool(nodes.idle[i]), rates)
            if message:
                task = profile.segments[nodes.segment[i]].task
                message = f"no physics at {nodes.time[i]:.0f} s ({task}): {message}"
                break
            sides[i] = flows[0], flows[-1]
            if not first:
                here -= 0.5 * (sides[i - 1, 1] + sides[i, 0]) * (nodes.time[i] - nodes.time[i - 1])
            mass[i] = here
        return self._judged(profile, nodes, mass, sides, usages, message)

    def _node(
        self, flight: Mapping[str, float], idle: bool, rates: tuple[float, ...]
    ) -> tuple[list[float], np.ndarray, str]:
        """Fuel flow [kg/s] for each rate of the rotor speed, the larger usage of each limit, and what went wrong."""
        nothing = np.full(len(LIMIT_NAMES), np.nan)
        aircraft = self.machine.aircraft
        if idle:
            place = {"altitude": flight["altitude"], "isa_offset": self.isa_offset}
            rotor_power = flat_pitch_power(aircraft, **place)
        else:
            trim = self.machine.trim(flight, guess=self.trim)
            if not trim.success:
                return [], nothing, trim.reason or trim.solution.message
            self.trim = trim.solution
            self.residual_norm = max(self.residual_norm, trim.solution.residual_norm)
            rotor_power = trim.power
        flows, usages = [], []
        for rate in rates:
            kinetic = self.inertia * flight["rotor_speed"] * rate
            power = float(engine_power(aircraft, self.machine.engine, rotor_power + kinetic))
            engine = self.machine.engine_state(power, flight, guess=self.engine)
            if not engine.success:
                return [], nothing, engine.message
            self.engine = engine
            self.residual_norm = max(self.residual_norm, engine.residual_norm)
            flows.append(aircraft.transmission.engines * engine.outputs["fuel_flow"])
            if not idle:
                usages.append(list(self.machine.usages(flight, trim.solution, engine, power, self.limits).values()))
        return flows, np.max(usages, axis=0) if usages else nothing, ""

    def _judged(
        self,
        profile: Profile,
        nodes: Conditions,
        mass: np.ndarray,
        sides: np.ndarray,
        usages: np.ndarray,
        message: str,
    ) -> PhysicsFlight:
        segment, time = np.asarray(nodes.segment), np.asarray(nodes.time)
        fuel = math.nan if message else _trapezoid(segment, time, sides, np.arange(len(time)))
        coarse = math.nan if message else _trapezoid(segment, time, sides, every_second(segment))
        if not message:
            message = _worst(profile, segment, time, usages)
        return PhysicsFlight(
            segment=segment,
            time=time,
            mass=mass,
            fuel_flow=sides.mean(axis=1),
            usages=usages,
            fuel=fuel,
            quadrature_error=abs(coarse - fuel) / 3.0,
            residual_norm=self.residual_norm,
            success=not message,
            message=message,
        )


def fly_physics(
    profile: Profile,
    schedule: Schedule,
    *,
    limits: Limits,
    takeoff_mass: float,
    step: float = GRID_STEP,
    kinetic_energy: bool = True,
) -> PhysicsFlight:
    """Fly ``schedule`` on the physics from ``takeoff_mass`` [kg]; a function of its own for worker processes."""
    pilot = PhysicsPilot(helicopter(limits.aircraft), limits, profile.isa_offset, kinetic_energy=kinetic_energy)
    return pilot.fly(profile, schedule, takeoff_mass=takeoff_mass, step=step)


def _flight(nodes: Conditions, i: int, mass: float, rotor_speed: float, twist: float, isa_offset: float) -> dict:
    return {
        "mass": float(mass),
        "altitude": float(nodes.altitude[i]),
        "isa_offset": isa_offset,
        "speed": float(nodes.speed[i]),
        "climb_angle": float(nodes.climb_angle[i]),
        "load_factor": float(nodes.load_factor[i]),
        "rotor_speed": float(rotor_speed),
        "twist": float(twist),
    }


def _trapezoid(segment: np.ndarray, time: np.ndarray, sides: np.ndarray, nodes: np.ndarray) -> float:
    """Fuel [kg] from the flow on both sides of the chosen nodes."""
    same = np.diff(segment[nodes]) == 0
    step = np.where(same, np.diff(time[nodes]), 0.0)
    return float(np.sum(0.5 * step * (sides[nodes[:-1], 1] + sides[nodes[1:], 0])))


def _worst(profile: Profile, segment: np.ndarray, time: np.ndarray, usages: np.ndarray) -> str:
    """The worst breach of a limit in words, empty if there is none."""
    excess = np.nan_to_num(usages, nan=0.0) - 1.0
    row, node = np.unravel_index(int(np.argmax(excess)), excess.shape)
    if excess[row, node] <= ALLOWED_BREACH:
        return ""
    task = profile.segments[segment[node]].task
    over = 100 * excess[row, node]
    return f"physics: {LIMIT_NAMES[row]} {over:.2f} % over its limit at {time[node]:.0f} s ({task})"
