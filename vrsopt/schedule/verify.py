"""A schedule flown on the full physics: trim and engine solved at every node, no surrogate.

The physics of a node are in :mod:`vrsopt.schedule.physics_node`. The mass is integrated along the way with the fuel
flow of the physics itself (trapezoidal rule, predicted by Euler's). Trims start from their neighbours and carry the
inverse Jacobian along; where nothing changes from one segment to the next, the trim itself is used again. A point that
is not solved makes the flight fail: nothing is interpolated over.

Emissions come from the combustor's network at the flown states of the engine, solved together after the flight. The
network takes as long as thirty gas paths, so it is not solved at nodes between which the fuel flow is a straight line:
NOx and CO are straight lines there too. On the rescue mission this changes them by less than 0.01 %.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.combustor.emissions import INLET
from vrsopt.errors import NoSolutionError
from vrsopt.helicopter import helicopter
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.schedule.emissions import Emitted, emitted
from vrsopt.schedule.flight_nodes import STEP, flight_nodes
from vrsopt.schedule.physics_node import Engines, NodePhysics, Rotors, Transmission
from vrsopt.schedule.quadrature import filled, per_segment, smooth_error, sparse
from vrsopt.schedule.schedule import ON_LIMIT, Schedule
from vrsopt.schedule.shaft_power import PARTS, ShaftPower, parts_of
from vrsopt.surrogate.emission_table import flows_of_fits

if TYPE_CHECKING:
    from vrsopt.mission.conditions import Conditions
    from vrsopt.mission.profile import Profile

STRAIGHT = 5e-4  # relative: departure of the fuel flow from a straight line up to which nodes in between are left out
LONGEST_PIECE = 12  # steps
STEEPEST = 4.0  # relative change of an emission over that of the fuel flow: 3.7 for NOx at idle
# A schedule that follows a limit on the surrogate may pass it by the surrogate's own error on the physics.
ALLOWED_BREACH = 3 * ON_LIMIT


@dataclass(frozen=True)
class PhysicsFlight:
    """A schedule flown on the physics at the N nodes of the grid, both ends of every segment among them.

    fuel [kg] burned, quadrature_error [kg] (against Simpson's rule); mass (N,) [kg], fuel_flow (N,) [kg/s] with the
    power that speeds up the rotor; usages (m, N) of LIMIT_NAMES, nan in idle; residual_norm: the largest of trim and
    engine. ``emissions`` were solved at the nodes ``emission_nodes``; None if the flight was not solved.
    ``shaft_power`` says where the power goes; None if that is not known.
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
    shaft_power: ShaftPower | None = None


class PhysicsPilot:
    """Flies one schedule node by node."""

    def __init__(self, physics: NodePhysics) -> None:
        self.physics, self.machine = physics, physics.machine

    def fly(self, profile: Profile, schedule: Schedule, *, takeoff_mass: float, nodes: Conditions) -> PhysicsFlight:
        """Fly ``schedule`` from ``takeoff_mass`` [kg] on ``nodes``, both ends of every segment among them."""
        physics, count = self.physics, len(nodes.time)
        rotor_speed, twist = schedule.at(np.asarray(nodes.segment), np.asarray(nodes.time))
        sides, inlets = np.full((count, 2), np.nan), np.full((count, 2, len(INLET)), np.nan)
        mass, usages = np.full(count, np.nan), np.full((len(LIMIT_NAMES), count), np.nan)
        parts, speeds = np.full((len(PARTS), count, 2), np.nan), np.full((count, 2), np.nan)
        message, here = "", takeoff_mass
        for i in range(count):
            first = i == 0 or nodes.segment[i] != nodes.segment[i - 1]
            last = i == count - 1 or nodes.segment[i] != nodes.segment[i + 1]
            if first:
                here += profile.mass_changes[nodes.segment[i]]
            before = 0.0 if first else (rotor_speed[i] - rotor_speed[i - 1]) / (nodes.time[i] - nodes.time[i - 1])
            after = 0.0 if last else (rotor_speed[i + 1] - rotor_speed[i]) / (nodes.time[i + 1] - nodes.time[i])
            predicted = here if first else here - sides[i - 1, 1] * (nodes.time[i] - nodes.time[i - 1])
            rates = (after, after) if first else (before, before) if last else (before, after)
            try:
                rotors = physics.rotors(nodes, i, mass=predicted, rotor_speed=rotor_speed[i], twist=twist[i])
                both = self._sides(rotors, rates)
            except NoSolutionError as error:
                task = profile.segments[nodes.segment[i]].task
                message = f"no physics at {nodes.time[i]:.0f} s ({task}): {error}"
                break
            usages[:, i] = np.maximum(both[0].usages, both[1].usages)
            inlets[i] = [[side.state.outputs[name] for name in INLET.values()] for side in both]
            sides[i] = [physics.engines * side.state.outputs["fuel_flow"] for side in both]
            speeds[i] = [side.state.parameters["power_turbine_speed"] for side in both]
            parts[:, i] = np.transpose([parts_of(physics, rotors, *one) for one in zip(both, rates, strict=True)])
            if not first:
                here -= 0.5 * (sides[i - 1, 1] + sides[i, 0]) * (nodes.time[i] - nodes.time[i - 1])
            mass[i] = here
        flight = self._judged(profile, nodes, mass, sides, inlets, usages, message)
        return replace(flight, shaft_power=ShaftPower(parts, sides, speeds)) if math.isfinite(flight.fuel) else flight

    def _sides(self, rotors: Rotors, rates: tuple[float, float]) -> tuple[Engines, Engines]:
        """One engine before and after a node, with the rates [rad/s2] of the rotor speed there."""
        before = self.physics.engine(rotors, rates[0])
        return before, before if rates[1] == rates[0] else self.physics.engine(rotors, rates[1])

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
        fuel = error = math.nan
        emission_nodes, emissions = np.array([], dtype=int), None
        if not message:
            fuel = float(np.sum(per_segment(segment, time, sides, np.arange(len(time)), len(profile.segments))))
            error = smooth_error(segment, time, sides)
            emission_nodes, emissions, message = self._emissions(profile, segment, time, sides, inlets)
            message = message or _worst(profile, segment, time, usages)
        return PhysicsFlight(
            segment=segment,
            time=time,
            mass=mass,
            fuel_flow=sides.mean(axis=1),
            usages=usages,
            fuel=fuel,
            quadrature_error=error,
            residual_norm=self.physics.residual_norm,
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
    step: float = STEP,
    nodes: Conditions | None = None,
    kinetic_energy: bool = True,
    spin_down_credit: bool = True,
    transmission: Transmission = "fixed",
) -> PhysicsFlight:
    """Fly ``schedule`` on the physics from ``takeoff_mass`` [kg]; a function of its own for worker processes.

    On ``nodes``, if given (several schedules are compared on the same), else on those of the schedule itself, at most
    ``step`` [s] apart. For the other options see :class:`NodePhysics`. These are ``kinetic_energy``,
    ``spin_down_credit`` and ``transmission``.
    """
    physics = NodePhysics(
        helicopter(limits.aircraft),
        limits,
        profile.isa_offset,
        kinetic_energy=kinetic_energy,
        spin_down_credit=spin_down_credit,
        transmission=transmission,
    )
    nodes = flight_nodes(profile, [schedule], step=step) if nodes is None else nodes
    return PhysicsPilot(physics).fly(profile, schedule, takeoff_mass=takeoff_mass, nodes=nodes)


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
