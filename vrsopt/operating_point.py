"""The coupled chain at one operating point: trim, drive train, engine, limits.

Engine power = ((main + tail rotor power) / transmission efficiency + accessories) / engines, not below idle; the free
turbine turns at the rotor's speed ratio. Converged is not flyable: every point is classified, with the reason and the
numbers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Literal

from vrsopt.aircraft import Aircraft, load_aircraft
from vrsopt.atmosphere import standard_air
from vrsopt.drive_train import engine_power
from vrsopt.equilibrium import calibrated_constants, trim_system
from vrsopt.errors import InputError
from vrsopt.limits import Limits
from vrsopt.residual import ResidualSystem, Solution
from vrsopt.solvers.status import Status
from vrsopt.turboshaft.cycle import gas_path
from vrsopt.turboshaft.data import EngineData, load_engine

MODEL_VERSION = "1"  # changes whenever the physics does: a design of experiments belongs to one version
SIMPLIFICATIONS = "turns are flown as their load factor; hover is out of ground effect"

ALLOWED = {
    "mass": (500.0, 5000.0),
    "speed": (0.0, 90.0),
    "altitude": (-500.0, 6000.0),
    "rotor_speed": (0.5, 1.3),  # over nominal
    "twist": (-0.1, 0.4),
    "climb_angle": (-0.35, 0.35),
    "load_factor": (0.5, 3.0),
    "isa_offset": (-50.0, 50.0),
}


@dataclass(frozen=True)
class OperatingPoint:
    """Trimmed aircraft with its engines, SI units; powers, fuel and CO2 are those of all engines unless named so.

    ``success``: trim and engine solved. ``feasible``: flyable as well; ``reason`` says why not. Numbers of a point that
    was not solved are nan.
    """

    success: bool
    status: Status
    message: str
    feasible: bool
    reason: str
    classification: str
    residual_norm: float
    iterations: int
    main_rotor_power: float
    tail_rotor_power: float
    shaft_power_per_engine: float
    fuel_flow: float
    co2: float
    collective: float
    lateral_cyclic: float
    longitudinal_cyclic: float
    tail_collective: float
    pitch: float
    roll: float
    gas_generator_speed: float
    turbine_inlet_temperature: float
    power_turbine_inlet_temperature: float
    blade_loading: float
    advance_ratio: float
    figure_of_merit: float
    tail_blade_loading: float
    usages: Mapping[str, float]
    solution: Solution = field(repr=False)

    def __str__(self) -> str:
        def degrees(*names: str) -> str:
            return ", ".join(f"{math.degrees(getattr(self, name)):.2f}" for name in names)

        rows = (
            ("main, tail rotor", f"{self.main_rotor_power / 1e3:.1f} kW, {self.tail_rotor_power / 1e3:.1f} kW"),
            ("shaft per engine", f"{self.shaft_power_per_engine / 1e3:.1f} kW"),
            ("fuel flow, CO2", f"{self.fuel_flow * 3600:.1f} kg/h, {self.co2 * 3600:.1f} kg/h"),
            ("collective", f"{degrees('collective')} deg; tail rotor {degrees('tail_collective')} deg"),
            ("cyclic", f"lateral, longitudinal {degrees('lateral_cyclic', 'longitudinal_cyclic')} deg"),
            ("attitude", f"pitch, roll {degrees('pitch', 'roll')} deg"),
            ("gas generator", f"{100 * self.gas_generator_speed:.1f} %"),
            ("turbine inlet", f"{self.turbine_inlet_temperature:.0f} K"),
            ("blade loading", f"{self.blade_loading:.4f} at advance ratio {self.advance_ratio:.3f}"),
            ("figure of merit", f"{self.figure_of_merit:.3f}" if self.advance_ratio < 0.01 else "- (not a hover)"),
            ("flyable", "yes" if self.feasible else f"no: {self.reason}"),
            ("result", f"{self.message}; {SIMPLIFICATIONS}"),
        )
        return "\n".join(f"{label:<17}{text}" for label, text in rows)


class Helicopter:
    """Trim and engine of one aircraft, ready to solve many points; keeps nothing between points."""

    def __init__(self, aircraft: Aircraft) -> None:
        self.aircraft = aircraft
        self.engine: EngineData = load_engine(self.aircraft.engine)

    def trim(
        self,
        flight: Mapping[str, float],
        *,
        guess: Solution | None = None,
        method: Literal["ipopt", "newton"] = "newton",
    ) -> Solution:
        """Trim at ``flight`` (FLIGHT_PARAMETERS by name), by the first way that succeeds.

        From ``guess``; from momentum theory; from the trim with a tail rotor that never stalls; by homotopy.
        """
        system = trim_system(self.aircraft)
        parameters = {**flight, **calibrated_constants(self.aircraft)}
        if guess is not None:
            solution = system.solve(parameters, guess, method=method)
            if solution.success:
                return solution
        solution = system.solve(parameters, method=method)
        if solution.success:
            return solution
        easier = trim_system(self.aircraft, stalling_tail=False).solve(parameters, method="newton")
        if easier.success:
            retried = system.solve(parameters, easier.values, method=method)
            if retried.success:
                return retried
        return self._homotopy(system, parameters, solution)

    def _homotopy(self, system: ResidualSystem, parameters: Mapping[str, float], failed: Solution) -> Solution:
        """Follow the trim from a light aircraft at nominal rotor speed; returns ``failed`` if the path ends early."""
        easy = {
            **parameters,
            "mass": min(parameters["mass"], 0.5 * self.aircraft.loading.largest_mass),
            "load_factor": 1.0,
            "rotor_speed": max(parameters["rotor_speed"], self.aircraft.main_rotor.nominal_rotor_speed),
            "climb_angle": 0.0,
        }
        solution = system.solve(easy, method="newton")
        position, step, effort = 0.0, 0.25, failed.iterations + solution.iterations
        while solution.success and position < 1.0 and step > 0.01:
            target = min(1.0, position + step)
            between = {name: easy[name] + target * (parameters[name] - easy[name]) for name in parameters}
            trial = system.solve(between, solution, method="newton", max_iterations=30)
            effort += trial.iterations
            if trial.success:
                solution, position, step = trial, target, 2 * step
            else:
                step /= 2
        return solution if position >= 1.0 else failed

    def engine_state(
        self,
        power: float,
        flight: Mapping[str, float],
        *,
        guess: Solution | None = None,
        method: Literal["ipopt", "newton"] = "newton",
    ) -> Solution:
        """Gas path of one engine at shaft power [W] in ``flight``, from a neighbour's solution or the design point."""
        air = standard_air(flight["altitude"], flight["isa_offset"])
        demand = {
            "demand": power,
            "power_turbine_speed": flight["rotor_speed"] / self.aircraft.main_rotor.nominal_rotor_speed,
            "altitude": flight["altitude"],
            "isa_offset": flight["isa_offset"],
            "mach": flight["speed"] / air.speed_of_sound,
            "bleed_fraction": 0.0,
            "power_offtake": 0.0,
        }
        system = gas_path(self.engine, "power")
        solution = system.solve(demand, guess, method=method)
        return solution if solution.success or guess is None else system.solve(demand, method=method)

    def point(
        self,
        flight: Mapping[str, float],
        *,
        limits: Limits,
        guess: Solution | None = None,
        method: Literal["ipopt", "newton"] = "newton",
    ) -> OperatingPoint:
        """Solve and classify the point ``flight`` (FLIGHT_PARAMETERS by name, SI units) under ``limits``."""
        trim = self.trim(flight, guess=guess, method=method)
        rotor_power = trim.outputs["main_rotor_power"] + trim.outputs["tail_rotor_power"]
        if not trim.success:
            return self._unsolved(flight, trim, limits)
        power = float(engine_power(self.aircraft, self.engine, rotor_power))
        engine = self.engine_state(power, flight, method=method)
        usages = self.usages(flight, trim, engine, power, limits)
        classification, reason = (
            _classify(usages, trim, engine, power, limits)
            if engine.success
            else (
                "not converged",
                engine.message,
            )
        )
        success = engine.success
        engines = self.aircraft.transmission.engines
        out = {name: value if success else math.nan for name, value in engine.outputs.items()}
        return OperatingPoint(
            success=success,
            status=engine.status,
            message=f"{trim.message}; {engine.message}",
            feasible=classification == "ok",
            reason=reason,
            classification=classification,
            residual_norm=max(trim.residual_norm, engine.residual_norm),
            iterations=trim.iterations + engine.iterations,
            main_rotor_power=trim.outputs["main_rotor_power"],
            tail_rotor_power=trim.outputs["tail_rotor_power"],
            shaft_power_per_engine=power,
            fuel_flow=engines * out["fuel_flow"],
            co2=engines * out["co2_flow"],
            **{name: trim.values[name] for name in _CONTROLS},
            gas_generator_speed=out["gas_generator_speed"],
            turbine_inlet_temperature=out["turbine_inlet_temperature"],
            power_turbine_inlet_temperature=out["power_turbine_inlet_temperature"],
            **{name: trim.outputs[name] for name in _ROTOR_OUTPUTS},
            usages=usages,
            solution=trim,
        )

    def usages(
        self, flight: Mapping[str, float], trim: Solution, engine: Solution, power: float, limits: Limits
    ) -> dict[str, float]:
        """Usage of each limit (1 = at the limit), in the order of LIMIT_NAMES."""
        density = standard_air(flight["altitude"], flight["isa_offset"]).density
        weight = flight["load_factor"] * flight["mass"]
        loading = limits.blade_loading_usage(weight, density, flight["rotor_speed"], flight["speed"], smooth_max=max)
        return {
            "blade loading": loading,
            "engine power": limits.power_usage(power),
            "torque": limits.torque_usage(power, flight["rotor_speed"]),
            "turbine temperature": limits.temperature_usage(engine.outputs["power_turbine_inlet_temperature"]),
            "tail rotor loading": limits.tail_usage(
                trim.outputs["tail_blade_loading"], flight["rotor_speed"], flight["speed"]
            ),
        }

    def _unsolved(self, flight: Mapping[str, float], trim: Solution, limits: Limits) -> OperatingPoint:
        """A point without trim: classified by the blade loading, then by the thrust demanded of the tail rotor."""
        density = standard_air(flight["altitude"], flight["isa_offset"]).density
        weight = flight["load_factor"] * flight["mass"]
        loading, largest = limits.blade_loading(weight, density, flight["rotor_speed"], flight["speed"])
        classification, reason = "not converged", trim.message
        if loading > largest:
            classification, reason = "stalled", f"blade loading {loading:.4f} above {largest:.4f}"
        else:
            tail = self._tail_demand(flight, trim)
            usage = limits.tail_usage(tail, flight["rotor_speed"], flight["speed"])
            if usage > 1:
                classification = "tail rotor"
                reason = f"tail-rotor blade loading {tail:.4f} needed, {usage:.3f} times the largest allowed"
        nan = {name: math.nan for name in (*_CONTROLS, *_ROTOR_OUTPUTS, *_ENGINE_RESULTS)}
        nan |= {"blade_loading": loading}
        return OperatingPoint(
            success=False,
            status=trim.status,
            message=trim.message,
            feasible=False,
            reason=reason,
            classification=classification,
            residual_norm=trim.residual_norm,
            iterations=trim.iterations,
            usages={},
            solution=trim,
            **nan,
        )

    def _tail_demand(self, flight: Mapping[str, float], failed: Solution) -> float:
        """Blade loading of a tail rotor that never stalls, nan where even that trim fails."""
        system = trim_system(self.aircraft, stalling_tail=False)
        parameters = {**flight, **calibrated_constants(self.aircraft)}
        solution = system.solve(parameters, method="newton")
        if not solution.success:
            solution = self._homotopy(system, parameters, failed)
        return solution.outputs["tail_blade_loading"] if solution.success else math.nan


_CONTROLS = ("collective", "lateral_cyclic", "longitudinal_cyclic", "tail_collective", "pitch", "roll")
_ROTOR_OUTPUTS = ("blade_loading", "advance_ratio", "figure_of_merit", "tail_blade_loading")
_ENGINE_RESULTS = (
    "main_rotor_power",
    "tail_rotor_power",
    "shaft_power_per_engine",
    "fuel_flow",
    "co2",
    "gas_generator_speed",
    "turbine_inlet_temperature",
    "power_turbine_inlet_temperature",
)


def _classify(
    usages: Mapping[str, float], trim: Solution, engine: Solution, power: float, limits: Limits
) -> tuple[str, str]:
    """Class of a solved point and the reason with its numbers; the first limit that is broken, rotor before engine."""
    out, allowance = trim.outputs, 1 + 1e-6
    rated = limits.rated_power
    temperature = engine.outputs["power_turbine_inlet_temperature"]
    causes = {
        "blade loading": (
            "stalled",
            f"blade loading {out['blade_loading']:.4f} is {usages['blade loading']:.3f} times the largest allowed "
            f"at advance ratio {out['advance_ratio']:.3f}",
        ),
        "tail rotor loading": (
            "tail rotor",
            f"tail-rotor blade loading {out['tail_blade_loading']:.4f} is {usages['tail rotor loading']:.3f} times the "
            f"largest allowed at advance ratio {out['tail_advance_ratio']:.3f}",
        ),
        "engine power": ("over power", f"{power / 1e3:.1f} kW per engine above {rated / 1e3:.1f} kW"),
        "torque": ("over torque", f"torque {100 * usages['torque']:.1f} % of the rated torque"),
        "turbine temperature": (
            "over temperature",
            f"inter-turbine temperature {temperature:.0f} K above {limits.temperature:.0f} K",
        ),
    }
    for name, cause in causes.items():
        if usages[name] > allowance:
            return cause
    return "ok", ""


def helicopter(aircraft: Aircraft | str | Path = "bo105") -> Helicopter:
    """The helicopter of an aircraft record, name or file, built once for the same data."""
    return _helicopter(aircraft if isinstance(aircraft, Aircraft) else load_aircraft(aircraft))


@lru_cache(maxsize=16)
def _helicopter(aircraft: Aircraft) -> Helicopter:
    return Helicopter(aircraft)


def trim(
    mass: float,
    speed: float,
    *,
    altitude: float = 0.0,
    rotor_speed: float | None = None,
    twist: float | None = None,
    climb_angle: float = 0.0,
    load_factor: float = 1.0,
    isa_offset: float = 0.0,
    aircraft: Aircraft | str | Path = "bo105",
    method: Literal["ipopt", "newton"] = "ipopt",
) -> OperatingPoint:
    """Trim the aircraft with its engines: gross mass [kg], true airspeed [m/s], pressure altitude [m].

    rotor_speed [rad/s] and twist [rad, washout positive] default to the aircraft's nominal; climb_angle in rad,
    isa_offset in K. ``method`` is the solver, "ipopt" or "newton"; both end at the same residual. The point is
    classified under the flight manual's engine limits and the blade-loading limit without margin. A turn is flown as
    its load factor, hover out of ground effect. Raises :class:`InputError` for a value out of range.
    """
    machine = helicopter(aircraft)
    rotor = machine.aircraft.main_rotor
    flight = {
        "mass": mass,
        "altitude": altitude,
        "isa_offset": isa_offset,
        "speed": speed,
        "climb_angle": climb_angle,
        "load_factor": load_factor,
        "rotor_speed": rotor.nominal_rotor_speed if rotor_speed is None else rotor_speed,
        "twist": rotor.twist if twist is None else twist,
    }
    for name, value in flight.items():
        low, high = ALLOWED[name]
        if name == "rotor_speed":
            low, high = low * rotor.nominal_rotor_speed, high * rotor.nominal_rotor_speed
        if not (math.isfinite(value) and low <= value <= high):
            raise InputError(f"trim: {name} = {value:g}: a number from {low:g} to {high:g}")
    return machine.point(flight, limits=Limits(machine.aircraft, machine.engine), method=method)
