"""A schedule flown on the full physics: trim and engine solved at every grid point, no surrogate.

The aircraft is trimmed in the steady flight that feels the same forces: heavier or lighter where it accelerates in the
vertical plane, at the equivalent climb angle, turning to its side, near the ground where it is. The mass is integrated
along the way with the fuel flow of the physics itself (trapezoidal rule, predicted by Euler's). Neighbouring trims
start from each other and re-use their factorisation; where nothing changes from one segment to the next, the trim
itself is used again. A point that is not solved makes the flight fail: nothing is interpolated over.

Emissions come from the combustor's network at the flown states of the engine, solved together after the flight. The
network takes as long as thirty gas paths, so it is not solved at nodes between which the fuel flow is a straight line:
NOx and CO are straight lines there too. On the rescue mission this changes them by less than 0.01 %.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.combustor.emissions import INLET
from vrsopt.drive_train import engine_power
from vrsopt.errors import InputError
from vrsopt.flat_pitch import flat_pitch_power
from vrsopt.helicopter import Helicopter, helicopter
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.residual import Solution
from vrsopt.schedule.emissions import Emitted, emitted
from vrsopt.schedule.ground_idle import ground_idle
from vrsopt.schedule.quadrature import filled, per_segment, sparse, thinned
from vrsopt.schedule.schedule import ON_LIMIT, Schedule
from vrsopt.surrogate.emission_table import flows_of_fits
from vrsopt.trimming import Trim

if TYPE_CHECKING:
    from vrsopt.mission.conditions import Conditions
    from vrsopt.mission.profile import Profile

GRID_STEP = 5.0  # s
STRAIGHT = 5e-4  # relative: departure of the fuel flow from a straight line up to which nodes in between are left out
LONGEST_PIECE = 12  # steps
STEEPEST = 4.0  # relative change of an emission over that of the fuel flow: 3.7 for NOx at idle
# A schedule that follows a limit on the surrogate may pass it by the surrogate's own error on the physics.
ALLOWED_BREACH = 3 * ON_LIMIT
STEEP = 0.3  # rad: a steeper climb is flown as forward and vertical speed
SAME_MASS = 1e-5  # relative: what the prediction of the mass at the end of a segment is wrong by


@dataclass(frozen=True)
class PhysicsFlight:
    """A schedule flown on the physics at the N nodes of the grid, both ends of every segment among them.

    fuel [kg] burned, quadrature_error [kg] (from every second node); mass (N,) [kg], fuel_flow (N,) [kg/s] with the
    power that speeds up the rotor; usages (m, N) of LIMIT_NAMES, nan in idle; residual_norm: the largest of trim and
    engine. ``emissions`` were solved at the nodes ``emission_nodes``; None if the flight was not solved.
    """

    segment: np.ndarray
    time: np.ndarray
    mass: np.ndarray
    fuel_flow: np.ndarray
    usages: np.ndarray
    fuel: float
    quadrature_error: float
    residual_norm: float
    emission_nodes: np.ndarray
    emissions: Emitted | None
    success: bool
    message: str


class PhysicsPilot:
    """Flies one schedule node by node; remembers the last trim as the start of the next."""

    def __init__(self, machine: Helicopter, limits: Limits, isa_offset: float, *, kinetic_energy: bool = True) -> None:
        self.machine, self.limits, self.isa_offset = machine, limits, isa_offset
        rotor = machine.aircraft.main_rotor
        self.inertia = rotor.polar_inertia if kinetic_energy else 0.0
        self.trim: Trim | None = None
        self.flight: Mapping[str, float] = {}  # of the trim
        self.engine: Solution | None = None
        self.idle: dict[float, float] = {}  # power of the rotors at flat pitch by altitude
        self.residual_norm = 0.0

    def fly(self, profile: Profile, schedule: Schedule, *, takeoff_mass: float, step: float) -> PhysicsFlight:
        """Fly ``schedule`` from ``takeoff_mass`` [kg] on a grid of at most ``step`` [s]."""
        nodes = profile.grid(step)
        count = len(nodes.time)
        rotor_speed, twist = schedule.at(np.asarray(nodes.segment), np.asarray(nodes.time))
        sides, inlets = np.full((count, 2), np.nan), np.full((count, 2, len(INLET)), np.nan)
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
            flight = self._flight(nodes, i, predicted, rotor_speed[i], twist[i])
            rates = (after,) if first else (before,) if last else (before, after)
            states, usages[:, i], message = self._node(flight, rates, nodes.idle[i], nodes.ground_idle[i])
            if message:
                task = profile.segments[nodes.segment[i]].task
                message = f"no physics at {nodes.time[i]:.0f} s ({task}): {message}"
                break
            inlets[i] = [[state[name] for name in INLET.values()] for state in (states[0], states[-1])]
            sides[i] = [self.machine.aircraft.transmission.engines * s["fuel_flow"] for s in (states[0], states[-1])]
            if not first:
                here -= 0.5 * (sides[i - 1, 1] + sides[i, 0]) * (nodes.time[i] - nodes.time[i - 1])
            mass[i] = here
        return self._judged(profile, nodes, mass, sides, inlets, usages, message)

    def _flight(self, nodes: Conditions, i: int, mass: float, rotor_speed: float, twist: float) -> dict[str, float]:
        """The steady flight with the forces of node ``i``, see :func:`vrsopt.flight.trim_parameters`."""
        rotor, speed, angle = self.machine.aircraft.main_rotor, nodes.speed[i], nodes.equivalent_climb_angle[i]
        steep = abs(angle) > STEEP
        return {
            "mass": float(mass * nodes.load_factor[i] / nodes.turn_load_factor[i]),
            "altitude": float(nodes.altitude[i]),
            "isa_offset": self.isa_offset,
            "speed": float(speed * np.cos(angle) if steep else speed),
            "climb_angle": 0.0 if steep else float(angle),
            "vertical_speed": float(speed * np.sin(angle)) if steep else 0.0,
            "load_factor": float(nodes.turn_load_factor[i]),
            "turn": float(nodes.turn[i]),
            "ground_proximity": float(rotor.radius / (nodes.height[i] + rotor.hub_above_skids)),
            "rotor_speed": float(rotor_speed),
            "twist": float(twist),
        }

    def _node(
        self, flight: Mapping[str, float], rates: tuple[float, ...], idle: bool, at_ground_idle: bool
    ) -> tuple[list[Mapping[str, float]], np.ndarray, str]:
        """Outputs of one engine for each rate of the rotor speed, the larger usage of each limit, what went wrong."""
        nothing, place = np.full(len(LIMIT_NAMES), np.nan), {"altitude": flight["altitude"]}
        if at_ground_idle:
            engine = ground_idle(self.machine.engine, **place, isa_offset=self.isa_offset)
            return [engine.outputs], nothing, ""
        if idle:
            if flight["altitude"] not in self.idle:
                power = flat_pitch_power(self.machine.aircraft, **place, isa_offset=self.isa_offset)
                self.idle[flight["altitude"]] = power
            rotor_power = self.idle[flight["altitude"]]
        else:
            try:
                trim = self._trimmed(flight)
            except InputError as error:  # a turn too tight for the trim
                return [], nothing, str(error)
            if not trim.success:
                return [], nothing, trim.reason or trim.solution.message
            rotor_power = trim.power
        states: list[Mapping[str, float]] = []
        usages: list[list[float]] = []
        for rate in rates:
            kinetic = self.inertia * flight["rotor_speed"] * rate
            power = float(engine_power(self.machine.aircraft, self.machine.engine, rotor_power + kinetic))
            engine = self.machine.engine_state(power, flight, guess=self.engine)
            if not engine.success:
                return [], nothing, engine.message
            self.engine = engine
            self.residual_norm = max(self.residual_norm, engine.residual_norm)
            states.append(engine.outputs)
            if not idle:
                usages.append(list(self.machine.usages(flight, trim.solution, engine, power, self.limits).values()))
        return states, np.max(usages, axis=0) if usages else nothing, ""

    def _trimmed(self, flight: Mapping[str, float]) -> Trim:
        """The trim of ``flight``: the last one if that is the same flight, as at most edges between segments."""
        if self.trim is not None and _same(flight, self.flight):
            return self.trim
        trim = self.machine.trim(flight, guess=self.trim.solution if self.trim else None)
        if trim.success:
            self.trim, self.flight = trim, flight
            self.residual_norm = max(self.residual_norm, trim.solution.residual_norm)
        return trim

    def _emissions(
        self, profile: Profile, segment: np.ndarray, time: np.ndarray, sides: np.ndarray, inlets: np.ndarray
    ) -> tuple[np.ndarray, Emitted, str]:
        """Nodes at which the combustor was solved, the emissions, and what went wrong.

        Fuel flow of all engines ``sides`` (N, 2) [kg/s]; ``inlets`` (N, 2, 4): of one engine's combustor. A fit of the
        combustor other than the shipped one that was not solved makes the range of NOx unknown, and no more.
        """
        nodes = sparse(segment, time, sides, tolerance=STRAIGHT, longest=LONGEST_PIECE)
        states, place = np.unique(inlets[nodes].reshape(-1, len(INLET)), axis=0, return_inverse=True)
        one = flows_of_fits(self.machine.engine, dict(zip(INLET.values(), states.T, strict=True)))
        engines = self.machine.aircraft.transmission.engines
        known = {name: engines * flow[place.ravel()].reshape(-1, 2) for name, flow in one.items()}
        unsolved, message = nodes[np.isnan(known["nox"]).any(axis=1)], ""
        if unsolved.size:
            task = profile.segments[segment[unsolved[0]]].task
            message = f"physics: combustor not solved at {time[unsolved[0]]:.0f} s ({task})"
        flows = {name: filled(time, nodes, flow) for name, flow in known.items()}
        found = emitted(segment, time, flows, len(profile.segments))
        return nodes, replace(found, quadrature_error=_errors(found, segment, time, sides, nodes)), message

    def _judged(
        self,
        profile: Profile,
        nodes: Conditions,
        mass: np.ndarray,
        sides: np.ndarray,
        inlets: np.ndarray,
        usages: np.ndarray,
        message: str,
    ) -> PhysicsFlight:
        segment, time = np.asarray(nodes.segment), np.asarray(nodes.time)
        fuel = coarse = math.nan
        emission_nodes, emissions = np.array([], dtype=int), None
        if not message:
            fuel, coarse = (
                float(np.sum(per_segment(segment, time, sides, some, len(profile.segments))))
                for some in (np.arange(len(time)), thinned(segment, 2))
            )
            emission_nodes, emissions, message = self._emissions(profile, segment, time, sides, inlets)
            message = message or _worst(profile, segment, time, usages)
        return PhysicsFlight(
            segment=segment,
            time=time,
            mass=mass,
            fuel_flow=sides.mean(axis=1),
            usages=usages,
            fuel=fuel,
            quadrature_error=abs(coarse - fuel) / 3.0,
            residual_norm=self.residual_norm,
            emission_nodes=emission_nodes,
            emissions=emissions,
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


def _same(one: Mapping[str, float], other: Mapping[str, float]) -> bool:
    """Whether two flights are one but for an error of the predicted mass."""
    return math.isclose(one["mass"], other["mass"], rel_tol=SAME_MASS) and all(
        math.isclose(value, other[name], rel_tol=1e-9, abs_tol=1e-9) for name, value in one.items() if name != "mass"
    )


def _errors(
    found: Emitted, segment: np.ndarray, time: np.ndarray, sides: np.ndarray, nodes: np.ndarray
) -> dict[str, float]:
    """Quadrature errors with what is lost by straight lines between ``nodes``: as much of the fuel, times STEEPEST."""
    every, count = np.arange(len(time)), int(segment[-1]) + 1
    exact, rough = (
        per_segment(segment, time, flow, every, count) for flow in (sides, filled(time, nodes, sides[nodes]))
    )
    lost = STEEPEST * float(np.sum(np.abs(rough - exact)) / np.sum(exact))
    return {name: error + lost * found.total(name) for name, error in found.quadrature_error.items()}


def _worst(profile: Profile, segment: np.ndarray, time: np.ndarray, usages: np.ndarray) -> str:
    """The worst breach of a limit in words, empty if there is none."""
    excess = np.nan_to_num(usages, nan=0.0) - 1.0
    row, node = np.unravel_index(int(np.argmax(excess)), excess.shape)
    if excess[row, node] <= ALLOWED_BREACH:
        return ""
    task = profile.segments[segment[node]].task
    over = 100 * excess[row, node]
    return f"physics: {LIMIT_NAMES[row]} {over:.2f} % over its limit at {time[node]:.0f} s ({task})"
