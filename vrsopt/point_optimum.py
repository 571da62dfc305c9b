"""The optimum of the physics at one point: least fuel over rotor speed and twist, with no surrogate.

Trim and gas path are lifted into one problem: their unknowns are unknowns, their residuals are constraints, beside
rotor speed and twist, all limits and the fuel flow. IPOPT solves it from the point with the nominal rotor; what it
finds is solved again as any other operating point, from a fresh start, and compared.
"""

from __future__ import annotations

import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from math import radians
from pathlib import Path
from typing import Any, Literal, get_args

import casadi as ca
import numpy as np

from vrsopt.aircraft import Aircraft
from vrsopt.atmosphere import standard_air
from vrsopt.drive_train import engine_parameters, engine_power
from vrsopt.equilibrium import trim_system
from vrsopt.errors import InputError, NoSolutionError
from vrsopt.flight import trim_parameters
from vrsopt.helicopter import Helicopter, allowed_ranges, helicopter
from vrsopt.limits import LIMIT_NAMES, MARGINS, Limits, Setting
from vrsopt.quantity import is_number
from vrsopt.residual import ResidualSystem
from vrsopt.solvers.ipopt import ipopt_options, ipopt_status
from vrsopt.solvers.status import Status
from vrsopt.turboshaft.cycle import gas_path

TOLERANCE = 1e-7
ACCEPTED_RESIDUAL = 1e-6  # largest scaled residual of a solution that counts
SAME_FUEL = 1e-6  # relative: by how much the point solved again may differ
ACTIVE = 1e-4  # of a usage or of the box: within it a limit or bound is active
FLIGHT = ("load_factor",)  # beside the parameters of the trim
NOMINAL_BOUNDS = ((0.75, 1.15), (radians(6.0), radians(16.0)))  # of nominal rotor speed; rad


@dataclass(frozen=True)
class PointOptimum:
    """Least fuel of the physics at one point.

    ``fuel_flow`` [kg/s] of all engines, ``nominal_fuel_flow`` with the nominal rotor; ``rotor_speed`` [rad/s],
    ``twist`` [rad]; ``usages`` by name, 1 at the limit; ``multipliers`` of active limits and bounds: the fall of
    the fuel flow [kg/s] per unit of usage, per rad/s or per rad by which they are relaxed; ``residual_norm`` scaled;
    ``solved_again``: relative difference of the fuel flow of the same point from a fresh start.
    """

    success: bool
    status: Status
    message: str
    rotor_speed: float
    twist: float
    fuel_flow: float
    nominal_fuel_flow: float
    usages: Mapping[str, float]
    multipliers: Mapping[str, float]
    residual_norm: float
    solved_again: float
    iterations: int
    cpu_s: float
    flight: Mapping[str, float] = field(repr=False)


class PointProblem:
    """The lifted problem of one aircraft under its limits, built once for all points."""

    def __init__(self, machine: Helicopter, limits: Limits) -> None:
        self.machine, self.limits = machine, limits
        self.systems: tuple[ResidualSystem, ResidualSystem] = (
            trim_system(machine.aircraft),
            gas_path(machine.engine, "power"),
        )
        self.names = [parameter.name for parameter in self.systems[0].parameters]
        self.rotor = machine.aircraft.main_rotor
        self.scale = np.array([self.rotor.nominal_rotor_speed, 0.1])  # of rotor speed and twist
        sizes = [len(system.unknowns) for system in self.systems]
        x = ca.MX.sym("x", 2 + sum(sizes))
        p = ca.MX.sym("p", len(self.names) + len(FLIGHT) + 1)  # the last is the scale of the fuel flow
        free, trim, engine = ca.vertsplit(x, [0, 2, 2 + sizes[0], 2 + sum(sizes)])
        value = dict(zip((*self.names, *FLIGHT, "fuel"), ca.vertsplit(p), strict=True))
        value |= {"rotor_speed": free[0] * self.scale[0], "twist": free[1] * self.scale[1]}
        balance, rotor = self._lifted(0, trim, ca.vertcat(*(value[name] for name in self.names)))
        power = engine_power(machine.aircraft, machine.engine, rotor["main_rotor_power"] + rotor["tail_rotor_power"])
        demand = engine_parameters(machine.aircraft, power, value)
        gas, out = self._lifted(
            1, engine, ca.vertcat(*(demand[parameter.name] for parameter in self.systems[1].parameters))
        )
        usages = limits.usages(
            value["load_factor"] * value["mass"],
            value["rotor_speed"],
            speed=value["speed"],
            density=standard_air(value["altitude"], value["isa_offset"]).density,
            power=power,
            temperature=out["power_turbine_inlet_temperature"],
            tail_loading=rotor["tail_blade_loading"],
        )
        used = ca.vertcat(*usages.values())
        self.equations = sum(sizes)
        problem = {"x": x, "p": p, "f": out["fuel_flow"] / value["fuel"], "g": ca.vertcat(balance, gas, used)}
        options = ipopt_options(
            hessian_approximation="limited-memory",
            tol=TOLERANCE,
            constr_viol_tol=TOLERANCE,
            acceptable_iter=0,
            max_iter=100,
            mu_init=1e-4,
            nlp_scaling_method="none",
            bound_relax_factor=0.0,
        )
        self._solver = ca.nlpsol("point", "ipopt", problem, options)

    def _lifted(self, which: int, unknowns: Any, parameters: Any) -> tuple[Any, dict[str, Any]]:
        """Residual and outputs of one of the systems in unknowns and parameters of the whole."""
        system = self.systems[which]
        z, p, r, y = system.nlp_terms()
        if isinstance(z, ca.MX):  # in the graph itself: of a function all derivatives would be taken
            residual, outputs = ca.substitute([r, y], [z, p], [unknowns, parameters])
        else:
            residual, outputs = ca.Function("system", [z, p], [r, y])(unknowns, parameters)
        names = (output.name for output in system.outputs)
        return residual, dict(zip(names, ca.vertsplit(outputs), strict=True))

    def solve(self, flight: Mapping[str, float], *, bounds: np.ndarray) -> PointOptimum:
        """Least fuel in ``flight`` (see :func:`vrsopt.flight.trim_parameters`; its rotor speed and twist are the start)
        with rotor speed and twist within ``bounds`` (2, 2), lower then upper.

        Raises :class:`NoSolutionError` where the start has no trim.
        """
        begin = clock.process_time()
        start = self.machine.trim(flight)
        if not start.success:
            raise NoSolutionError(f"optimum of the physics: no trim to start from: {start.reason}")
        power = float(engine_power(self.machine.aircraft, self.machine.engine, start.power))
        engine = self.machine.engine_state(power, flight)
        if not engine.success:
            raise NoSolutionError(f"optimum of the physics: no engine to start from: {engine.message}")
        fuel = engine.outputs["fuel_flow"]
        free = np.clip([flight["rotor_speed"], flight["twist"]], *bounds) / self.scale
        parameters = trim_parameters(self.machine.aircraft, flight)
        (low_t, high_t), (low_e, high_e) = (system.bounds for system in self.systems)
        found = self._solver(
            x0=np.concatenate([free, start.solution.scaled, engine.scaled]),
            p=[*(parameters[name] for name in self.names), *(flight[name] for name in FLIGHT), fuel],
            lbx=np.concatenate([bounds[0] / self.scale, low_t, low_e]),
            ubx=np.concatenate([bounds[1] / self.scale, high_t, high_e]),
            lbg=np.concatenate([np.zeros(self.equations), np.full(len(LIMIT_NAMES), -np.inf)]),
            ubg=np.concatenate([np.zeros(self.equations), np.ones(len(LIMIT_NAMES))]),
        )
        values = {name: found[name].full().ravel() for name in ("x", "g", "lam_x", "lam_g")}
        unit = self.machine.aircraft.transmission.engines * fuel
        return self._result(flight, values, float(found["f"]), unit, bounds, begin)

    def _result(
        self,
        flight: Mapping[str, float],
        found: Mapping[str, np.ndarray],
        objective: float,
        unit: float,
        bounds: np.ndarray,
        begin: float,
    ) -> PointOptimum:
        stats = self._solver.stats()
        free = found["x"][:2] * self.scale
        residual = float(np.max(np.abs(found["g"][: self.equations])))
        usages = dict(zip(LIMIT_NAMES, found["g"][self.equations :].tolist(), strict=True))
        flown = {**flight, "rotor_speed": float(free[0]), "twist": float(free[1])}
        again = self._fuel_flow(flown) / (unit * objective) - 1.0
        status = ipopt_status(stats)
        message = f"optimal to {TOLERANCE:g}"
        name, usage = max(usages.items(), key=lambda item: item[1])
        if status is not Status.CONVERGED or residual > ACCEPTED_RESIDUAL:
            message = f"{status}; largest residual {residual:.1e}; {name} at {100 * usage:.2f} % of its limit"
            status = Status.NO_PROGRESS if status is Status.CONVERGED else status
        elif not abs(again) <= SAME_FUEL:
            status = Status.NO_PROGRESS
            message = f"the point solved again has another fuel flow, by {100 * again:.3g} %"
        return PointOptimum(
            success=status is Status.CONVERGED,
            status=status,
            message=message,
            rotor_speed=float(free[0]),
            twist=float(free[1]),
            fuel_flow=unit * objective,
            nominal_fuel_flow=unit,
            usages=usages,
            multipliers=self._multipliers(found, usages, unit, free, bounds),
            residual_norm=residual,
            solved_again=again,
            iterations=int(stats["iter_count"]),
            cpu_s=clock.process_time() - begin,
            flight=flown,
        )

    def _multipliers(
        self,
        found: Mapping[str, np.ndarray],
        usages: Mapping[str, float],
        unit: float,
        free: np.ndarray,
        bounds: np.ndarray,
    ) -> dict[str, float]:
        """Of active limits and bounds."""
        limits = zip(usages.items(), found["lam_g"][self.equations :], strict=True)
        result = {name: unit * float(value) for (name, usage), value in limits if usage > 1.0 - ACTIVE}
        width = ACTIVE * (bounds[1] - bounds[0])
        for k, name in enumerate(("rotor speed", "twist")):
            for end, side in enumerate(("lower", "upper")):
                if width[k] > 0.0 and abs(free[k] - bounds[end, k]) < width[k]:
                    result[f"{name} at its {side} bound"] = float(unit * abs(found["lam_x"][k]) / self.scale[k])
        return result

    def _fuel_flow(self, flight: Mapping[str, float]) -> float:
        """Of all engines [kg/s], from a fresh start; nan without a solution."""
        trim = self.machine.trim(flight)
        if not trim.success:
            return float("nan")
        power = float(engine_power(self.machine.aircraft, self.machine.engine, trim.power))
        engine = self.machine.engine_state(power, flight)
        engines = self.machine.aircraft.transmission.engines
        return engines * engine.outputs["fuel_flow"] if engine.success else float("nan")


def physics_optimum(
    mass: float,
    speed: float,
    *,
    altitude: float = 0.0,
    climb_angle: float = 0.0,
    load_factor: float = 1.0,
    isa_offset: float = 0.0,
    variables: Literal["both", "speed", "twist"] = "both",
    rotor_speed_bounds: tuple[float, float] | None = None,
    twist_bounds: tuple[float, float] = NOMINAL_BOUNDS[1],
    setting: Setting = "manual",
    manoeuvre_margin: float | None = None,
    aircraft: Aircraft | str | Path = "bo105",
) -> PointOptimum:
    """Rotor speed and twist of least fuel at gross mass [kg], true airspeed [m/s] and pressure altitude [m].

    ``variables``: which of the two are free, the other is nominal. Bounds [rad/s] (75 to 115 % of nominal) and [rad];
    ``setting`` and ``manoeuvre_margin`` (the aircraft's by default) of the limits, see :class:`vrsopt.limits.Limits`.
    Raises :class:`InputError` for what is not one of these or out of range and :class:`NoSolutionError` where the
    nominal rotor has no trim.
    """
    machine = helicopter(aircraft)
    rotor = machine.aircraft.main_rotor
    nominal = rotor.nominal_rotor_speed
    _check_choice("variables", variables, ("both", "speed", "twist"))
    _check_choice("setting", setting, get_args(Setting))
    ranges = {**allowed_ranges(machine.aircraft), "manoeuvre_margin": MARGINS}
    usual = (NOMINAL_BOUNDS[0][0] * nominal, NOMINAL_BOUNDS[0][1] * nominal)
    speeds = _pair("rotor_speed", usual if rotor_speed_bounds is None else rotor_speed_bounds, ranges)
    twist_bounds = _pair("twist", twist_bounds, ranges)
    if variables == "speed":
        twist_bounds = (rotor.twist, rotor.twist)
    if variables == "twist":
        speeds = (nominal, nominal)
    flight = {
        "mass": mass,
        "altitude": altitude,
        "isa_offset": isa_offset,
        "speed": speed,
        "climb_angle": climb_angle,
        "load_factor": load_factor,
        "rotor_speed": nominal,
        "twist": rotor.twist,
    }
    margin = machine.aircraft.blade_loading_limit.manoeuvre_margin if manoeuvre_margin is None else manoeuvre_margin
    for name, value in (*flight.items(), ("manoeuvre_margin", margin)):
        low, high = ranges[name]
        if not is_number(value) or not low <= value <= high:
            raise InputError(f"optimum of the physics: {name} = {value!r}: a number from {low:g} to {high:g}")
    return _problem(machine.aircraft, setting, margin).solve(flight, bounds=np.array([speeds, twist_bounds]).T)


def _check_choice(name: str, value: Any, allowed: tuple[str, ...]) -> None:
    if not isinstance(value, str) or value not in allowed:
        raise InputError(f"optimum of the physics: {name} = {value!r}: one of {', '.join(allowed)}")


def _pair(name: str, value: Any, ranges: Mapping[str, tuple[float, float]]) -> tuple[float, float]:
    """The bounds of a variable; raises :class:`InputError` unless they are two numbers in order, within its range."""
    low, high = ranges[name]
    known = isinstance(value, Sequence) and len(value) == 2 and all(map(is_number, value))
    if not known or not low <= value[0] <= value[1] <= high:
        allowed = f"lower, upper, numbers in order from {low:g} to {high:g}"
        raise InputError(f"optimum of the physics: {name}_bounds = {value!r}: {allowed}")
    return float(value[0]), float(value[1])


@lru_cache(maxsize=4)
def _problem(aircraft: Aircraft, setting: Setting, margin: float) -> PointProblem:
    machine = helicopter(aircraft)
    return PointProblem(machine, Limits(machine.aircraft, machine.engine, setting, margin))
