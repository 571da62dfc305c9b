"""The lifted problem of one operating point: trim and gas path beside rotor speed and twist, all solved as one.

The unknowns of trim and gas path are unknowns, their residuals are constraints, beside all limits and the fuel flow.
IPOPT solves it from the point with the nominal rotor; what it finds is solved again as any other operating point, from
a fresh start, and compared.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from vrsopt.atmosphere import standard_air
from vrsopt.drive_train import engine_parameters, engine_power
from vrsopt.equilibrium import trim_system
from vrsopt.errors import NoSolutionError
from vrsopt.flight import trim_parameters
from vrsopt.helicopter import Helicopter
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.residual import ResidualSystem
from vrsopt.solvers.ipopt import ipopt_options, ipopt_status
from vrsopt.solvers.status import Status
from vrsopt.turboshaft.cycle import gas_path

TOLERANCE = 1e-7
ACCEPTED_RESIDUAL = 1e-6  # largest scaled residual of a solution that counts
SAME_FUEL = 1e-6  # relative: by how much the point solved again may differ
ACTIVE = 1e-4  # of a usage or of the box: within it a limit or bound is active
FLIGHT = ("load_factor",)  # beside the parameters of the trim


@dataclass(frozen=True)
class PointOptimum:
    """Least fuel of the physics at one point.

    ``fuel_flow`` [kg/s] of all engines, ``nominal_fuel_flow`` [kg/s] with the nominal rotor; ``rotor_speed`` [rad/s],
    ``twist`` [rad]; ``usages`` by name [-], 1 at the limit; ``multipliers`` of active limits and bounds: the fall of
    the fuel flow [kg/s] per unit of usage, per rad/s or per rad by which they are relaxed; ``residual_norm`` scaled
    [-]; ``solved_again``: relative difference [-] of the fuel flow of the same point from a fresh start;
    ``iterations`` of IPOPT, ``cpu_s``: time it took [s]; ``flight``: the point [SI units] by the names
    of :func:`vrsopt.flight.trim_parameters`.
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

    def __str__(self) -> str:
        name, usage = max(self.usages.items(), key=lambda item: item[1])
        saved = 100 * (self.fuel_flow / self.nominal_fuel_flow - 1)
        rows = (
            ("rotor speed", f"{self.rotor_speed:.3f} rad/s"),
            ("twist", f"{math.degrees(self.twist):.2f} deg"),
            ("fuel flow", f"{self.fuel_flow * 3600:.2f} kg/h, {saved:+.2f} % of the nominal rotor's"),
            ("nearest limit", f"{name}, {100 * usage:.1f} % of it used"),
            ("active", ", ".join(self.multipliers) or "nothing"),
            ("result", self.message),
        )
        return "\n".join(f"{label:<16} {text}" for label, text in rows)


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
