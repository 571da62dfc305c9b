"""The full physics at one node of a flight: the steady flight with its forces, trim, engine, limits, and derivatives.

The aircraft is trimmed in the steady flight that feels the same forces: heavier or lighter where it accelerates in the
vertical plane, at the equivalent climb angle, turning to its side, near the ground where it is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import casadi as ca
import numpy as np

from vrsopt.aircraft import Aircraft
from vrsopt.atmosphere import standard_air
from vrsopt.drive_train import engine_power
from vrsopt.equilibrium import trim_system
from vrsopt.errors import InputError, NoSolutionError
from vrsopt.flat_pitch import flat_pitch_power
from vrsopt.helicopter import Helicopter
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.residual import Solution
from vrsopt.schedule.ground_idle import ground_idle
from vrsopt.schedule.trim_path import TrimPath
from vrsopt.surrogate.best_speed import BestSpeedTable
from vrsopt.surrogate.engine_table import engine_table
from vrsopt.trimming import Trim
from vrsopt.turboshaft.cycle import gas_path

if TYPE_CHECKING:
    from vrsopt.mission.conditions import Conditions

Transmission = Literal["fixed", "variable"]
STEEP = 0.3  # rad: a steeper climb is flown as forward and vertical speed
SAME_MASS = 1e-5  # relative: what the prediction of the mass at the end of a segment is wrong by
SAME_POWER = 1e-6  # W
ROTOR_OUTPUTS = ("main_rotor_power", "tail_rotor_power", "tail_blade_loading")
ROTOR_VARIABLES = ("mass", "rotor_speed", "twist")
ENGINE_OUTPUTS = ("fuel_flow", "power_turbine_inlet_temperature")
ENGINE_VARIABLES = ("demand", "power_turbine_speed")


@dataclass(frozen=True)
class Rotors:
    """Power of both rotors [W] at one node in ``flight`` (see :func:`vrsopt.flight.trim_parameters`).

    ``trim`` is None on the ground, where ``ground_idle`` says whether the engines are at their ground idle.
    """

    flight: Mapping[str, float]
    power: float
    trim: Solution | None = None
    ground_idle: bool = False


@dataclass(frozen=True)
class Engines:
    """One engine at a node: its gas path, and the usages (m,) of LIMIT_NAMES, nan on the ground."""

    state: Solution
    power: float
    usages: np.ndarray


class NodePhysics:
    """Solves one node after the other; remembers the last ones as the start of the next.

    ``spin_down_credit=False``: power that speeds up the rotor is charged, slowing it down gives nothing back.
    ``transmission="variable"``: the free turbine turns at the speed of least fuel at every power, whatever the rotor's;
    that speed is taken from the engine's table, the gas path is solved there.
    """

    def __init__(
        self,
        machine: Helicopter,
        limits: Limits,
        isa_offset: float,
        *,
        kinetic_energy: bool = True,
        spin_down_credit: bool = True,
        transmission: Transmission = "fixed",
    ) -> None:
        self.machine, self.limits, self.isa_offset = machine, limits, isa_offset
        self.inertia = machine.aircraft.main_rotor.polar_inertia if kinetic_energy else 0.0
        self.spin_down_credit = spin_down_credit
        if transmission not in ("fixed", "variable"):
            raise InputError(f"flight on the physics: transmission = {transmission!r}: fixed or variable")
        self.transmission = transmission
        self.path = TrimPath(machine)
        self.residual_norm = 0.0
        self._rotors: Rotors | None = None  # the last in flight
        self._engines: Engines | None = None
        self._idle: dict[float, float] = {}  # power of the rotors at flat pitch by altitude

    @property
    def engines(self) -> int:
        """Number of engines."""
        return self.machine.aircraft.transmission.engines

    def flight(self, nodes: Conditions, i: int, mass: float, rotor_speed: float, twist: float) -> dict[str, float]:
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

    def rotors(self, nodes: Conditions, i: int, *, mass: float, rotor_speed: float, twist: float) -> Rotors:
        """Rotors at node ``i`` with a mass [kg]; raises :class:`NoSolutionError` where there is no trim."""
        flight = self.flight(nodes, i, mass, rotor_speed, twist)
        if nodes.ground_idle[i]:
            return Rotors(flight, 0.0, ground_idle=True)
        if nodes.idle[i]:
            altitude = flight["altitude"]
            if altitude not in self._idle:
                aircraft = self.machine.aircraft
                self._idle[altitude] = flat_pitch_power(aircraft, altitude=altitude, isa_offset=self.isa_offset)
            return Rotors(flight, self._idle[altitude])
        if self._rotors is None or not _same(flight, self._rotors.flight):
            self._rotors = Rotors(flight, *self._trimmed(flight))
        return self._rotors

    def _trimmed(self, flight: Mapping[str, float]) -> tuple[float, Solution]:
        try:
            trim: Trim = self.path.trim(flight)
        except InputError as error:  # a turn too tight for the trim
            raise NoSolutionError(str(error)) from None
        if not trim.success:
            raise NoSolutionError(trim.reason or trim.solution.message)
        self.residual_norm = max(self.residual_norm, trim.solution.residual_norm)
        return trim.power, trim.solution

    def engine(self, rotors: Rotors, rate: float) -> Engines:
        """One engine while the rotor speed changes at ``rate`` [rad/s2]; raises :class:`NoSolutionError` where it can
        not be run."""
        flight, nothing = rotors.flight, np.full(len(LIMIT_NAMES), np.nan)
        if rotors.ground_idle:
            idle = ground_idle(self.machine.engine, altitude=flight["altitude"], isa_offset=self.isa_offset)
            return Engines(idle, idle.outputs["power"], nothing)
        demand = rotors.power + self.kinetic_power(rotors, rate)
        power = float(engine_power(self.machine.aircraft, self.machine.engine, demand))
        state = self._state(power, flight)
        usages = nothing
        if rotors.trim is not None:
            usages = np.array(list(self.machine.usages(flight, rotors.trim, state, power, self.limits).values()))
        self._engines = Engines(state, power, usages)
        return self._engines

    def kinetic_power(self, rotors: Rotors, rate: float) -> float:
        """Power [W] that changes the rotor speed at ``rate`` [rad/s2], as far as it is charged or credited."""
        charged = rate if self.spin_down_credit else max(rate, 0.0)
        return self.inertia * rotors.flight["rotor_speed"] * charged

    def _state(self, power: float, flight: Mapping[str, float]) -> Solution:
        place = self._with_turbine_speed(power, flight)
        guess = self._engines.state if self._engines else None
        state = self.machine.engine_state(power, place, guess=guess)
        if not state.success:
            raise NoSolutionError(state.message)
        self.residual_norm = max(self.residual_norm, state.residual_norm)
        return state

    # -- the free turbine at its own speed ---------------------------------------------------------------------------

    @cached_property
    def _best_speed(self) -> BestSpeedTable:
        return BestSpeedTable.of(engine_table(isa_offset=self.isa_offset, engine_data=self.machine.engine))

    def _with_turbine_speed(self, power: float, flight: Mapping[str, float]) -> Mapping[str, float]:
        """``flight`` as the engine sees it: with a variable transmission the rotor speed is that of its best turbine
        speed."""
        if self.transmission == "fixed":
            return flight
        air = standard_air(flight["altitude"], flight["isa_offset"])
        place = np.array([flight["altitude"]]), np.array([flight["speed"] / air.speed_of_sound])
        ratio = self._best_speed.best_speed(*place, np.array([power]))
        return {**flight, "rotor_speed": float(ratio.item()) * self._nominal}

    @property
    def _nominal(self) -> float:
        return self.machine.aircraft.main_rotor.nominal_rotor_speed

    # -- derivatives -------------------------------------------------------------------------------------------------

    def rotor_slopes(self, rotors: Rotors) -> np.ndarray:
        """See :func:`rotor_slopes`; zero on the ground."""
        return np.zeros((2, 3)) if rotors.trim is None else rotor_slopes(self.machine.aircraft, rotors.trim)

    def engine_slopes(self, engines: Engines) -> np.ndarray:
        """Exact derivatives (2, 2) of fuel flow [kg/s] and inter-turbine temperature [K] of one engine with respect to
        its power [W] and the speed ratio of its free turbine."""
        system = gas_path(self.machine.engine, "power")
        slopes = system.sensitivities(engines.state, outputs=ENGINE_OUTPUTS, parameters=ENGINE_VARIABLES)
        return np.array([[slopes[name][variable] for variable in ENGINE_VARIABLES] for name in ENGINE_OUTPUTS])

    def jacobian(
        self, nodes: Conditions, i: int, state: tuple[Rotors, Engines], *, mass: float, rate: float, rotor: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Values (1 + m,) of the fuel flow of all engines [kg/s] and of usage - 1 of each limit at node ``i`` in
        flight, and their exact derivatives (1 + m, 4) with respect to mass, rotor speed, twist and charged rate.

        ``state`` of the node at ``mass`` [kg] and ``rate`` [rad/s2]; ``rotor`` (2, 3) of :meth:`rotor_slopes`. The
        usages are the rounded ones of smooth problems. The turbine turns with the rotor: raises :class:`InputError` for
        a variable transmission.
        """
        if self.transmission != "fixed":
            raise InputError("derivatives of the physics: transmission = variable: fixed only")
        rotors, engines = state
        flight, out = rotors.flight, engines.state.outputs
        heavier = float(nodes.load_factor[i] / nodes.turn_load_factor[i])
        assert rotors.trim is not None
        place = [
            *(heavier, float(nodes.load_factor[i]), flight["speed"]),
            float(standard_air(flight["altitude"], flight["isa_offset"]).density),
            *(rotors.power, rotors.trim.outputs["tail_blade_loading"]),
            *(out["fuel_flow"], out["power_turbine_inlet_temperature"]),
        ]
        at = [mass, flight["rotor_speed"], flight["twist"], rate]
        value, slopes = self._chain(at, at, place, rotor, self.engine_slopes(engines))
        return value.full().ravel(), slopes.full()

    @cached_property
    def _chain(self) -> ca.Function:
        """Fuel flow and usages less 1, and their derivatives, from linear rotors and engines about ``centre``."""
        x, centre, place = (ca.SX.sym(name, size) for name, size in (("x", 4), ("centre", 4), ("place", 8)))
        rotor, engine = ca.SX.sym("rotor", 2, 3), ca.SX.sym("engine", 2, 2)
        heavier, load_factor, speed, density, *about = ca.vertsplit(place)
        change = (x - centre)[:3] * ca.vertcat(heavier, 1, 1)
        power, tail = ca.vertsplit(ca.vertcat(*about[:2]) + ca.mtimes(rotor, change))
        per_engine = engine_power(self.machine.aircraft, self.machine.engine, power + self.inertia * x[1] * x[3])
        demand = ca.vertcat(per_engine, x[1] / self._nominal)
        away = demand - ca.substitute(demand, x, centre)
        fuel, temperature = ca.vertsplit(ca.vertcat(*about[2:]) + ca.mtimes(engine, away))
        usages = self.limits.usages(
            x[0] * load_factor,
            x[1],
            speed=speed,
            density=density,
            power=per_engine,
            temperature=temperature,
            tail_loading=tail,
        )
        values = ca.vertcat(self.engines * fuel, ca.vertcat(*usages.values()) - 1)
        return ca.Function("chain", [x, centre, place, rotor, engine], [values, ca.jacobian(values, x)])


def rotor_slopes(aircraft: Aircraft, trim: Solution) -> np.ndarray:
    """Exact derivatives (2, 3) of the power of both rotors [W] and the tail rotor's blade loading with respect to the
    gross mass of the steady flight [kg], rotor speed [rad/s] and twist [rad]."""
    slopes = trim_system(aircraft).sensitivities(trim, outputs=ROTOR_OUTPUTS, parameters=ROTOR_VARIABLES)
    rows = np.array([[slopes[name][variable] for variable in ROTOR_VARIABLES] for name in ROTOR_OUTPUTS])
    return np.array([rows[0] + rows[1], rows[2]])


def _same(one: Mapping[str, float], other: Mapping[str, float]) -> bool:
    """Whether two flights are one but for an error of the predicted mass."""
    return math.isclose(one["mass"], other["mass"], rel_tol=SAME_MASS) and all(
        math.isclose(value, other[name], rel_tol=1e-9, abs_tol=1e-9) for name, value in one.items() if name != "mass"
    )
