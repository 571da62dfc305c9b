"""The coupled chain at one operating point: trim, drive train, engine, combustor, limits.

Engine power = ((main + tail rotor power) / transmission efficiency + accessories) / operating engines, not below idle;
the free turbine turns at the rotor's speed ratio.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Literal

from vrsopt.aircraft import Aircraft, data_hash, load_aircraft
from vrsopt.atmosphere import standard_air
from vrsopt.combustor.emissions import INDICES, SPECIES, emissions, reactor_fits
from vrsopt.drive_train import engine_parameters, engine_power, operating_engines
from vrsopt.equilibrium import trim_system
from vrsopt.errors import InputError
from vrsopt.flight import trim_parameters
from vrsopt.limits import Limits
from vrsopt.operating_point import CONTROLS, ENGINE_RESULTS, ROTOR_OUTPUTS, OperatingPoint, classify
from vrsopt.rotor.ground import LARGEST_PROXIMITY
from vrsopt.solution import Solution
from vrsopt.trimming import Trim, find_trim
from vrsopt.turboshaft.cycle import gas_path
from vrsopt.turboshaft.data import EngineData, load_engine

MODEL_VERSION = "4"  # changes whenever the physics does: a design of experiments belongs to one version

ALLOWED = {
    "mass": (500.0, 5000.0),  # of the Bo 105
    "speed": (0.0, 90.0),
    "altitude": (-500.0, 6000.0),
    "rotor_speed": (0.5, 1.3),  # over nominal
    "twist": (-0.1, 0.4),
    "climb_angle": (-0.35, 0.35),
    "load_factor": (1.0, 3.0),
    "isa_offset": (-50.0, 50.0),
    "cg_shift": (-0.5, 0.5),
}
MASSES = (0.2, 2.0)  # of any aircraft, over its largest: what ALLOWED has for the Bo 105
EASY_SPEED = 30.0  # m/s: about that of least power


def allowed_ranges(aircraft: Aircraft) -> dict[str, tuple[float, float]]:
    """Least and largest value of each quantity of a flight that a trim is tried for, SI units."""
    low, high = (end * aircraft.main_rotor.nominal_rotor_speed for end in ALLOWED["rotor_speed"])
    lightest, heaviest = (end * aircraft.loading.largest_mass for end in MASSES)
    return {**ALLOWED, "rotor_speed": (low, high), "mass": (lightest, heaviest)}


class Helicopter:
    """Trim and engine of one aircraft, ready to solve many points; keeps nothing between points."""

    def __init__(self, aircraft: Aircraft) -> None:
        self.aircraft = aircraft
        self.engine: EngineData = load_engine(self.aircraft.engine)

    @property
    def data_hash(self) -> str:
        """Hash of all numbers behind a point: those of aircraft and engine, and the other fits of its combustor."""
        return data_hash(self.aircraft, self.engine, *reactor_fits(self.engine).values())

    def trim(
        self,
        flight: Mapping[str, float],
        *,
        guess: Solution | None = None,
        method: Literal["ipopt", "newton"] = "newton",
    ) -> Trim:
        """Trim at ``flight`` (see :func:`vrsopt.flight.trim_parameters`), from ``guess`` or by the cascade of
        :mod:`vrsopt.trimming`."""
        return find_trim(
            trim_system(self.aircraft),
            trim_parameters(self.aircraft, flight),
            easy=self._easy_flight(flight),
            easier=lambda: trim_system(self.aircraft, stalling_tail=False),
            guess=guess,
            method=method,
        )

    def _easy_flight(self, flight: Mapping[str, float]) -> dict[str, float]:
        """What makes any flight easy: a light aircraft, level, straight and not fast, the rotor not slow."""
        rotor = self.aircraft.main_rotor
        return {
            "mass": min(flight["mass"], 0.5 * self.aircraft.loading.largest_mass),
            "speed": min(flight["speed"], EASY_SPEED),
            "rotor_speed": max(flight["rotor_speed"], rotor.nominal_rotor_speed),
            "climb_angle": 0.0,
            "vertical_speed": 0.0,
            "turn_rate": 0.0,
        }

    def engine_state(
        self,
        power: float,
        flight: Mapping[str, float],
        *,
        guess: Solution | None = None,
        method: Literal["ipopt", "newton"] = "newton",
    ) -> Solution:
        """Gas path of one engine at shaft power [W] in ``flight``, from a neighbour's solution or the design point.

        Without emissions: :func:`vrsopt.combustor.emissions.emissions` takes the solution.
        """
        demand = engine_parameters(self.aircraft, power, flight)
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
        engines_operating: int | None = None,
    ) -> OperatingPoint:
        """Solve and classify the point ``flight`` (see :func:`vrsopt.flight.trim_parameters`) under ``limits``.

        ``engines_operating`` defaults to all; with fewer the limits are those of an engine left alone. Raises
        :class:`InputError` for a number of engines that the aircraft can not fly with.
        """
        operating = operating_engines(self.aircraft, engines_operating)
        if operating < self.aircraft.transmission.engines:
            limits = replace(limits, one_engine_inoperative=True)
        trim = self.trim(flight, guess=guess, method=method)
        if not trim.success:
            return self._unsolved(flight, trim, limits, operating)
        power = float(engine_power(self.aircraft, self.engine, trim.power, engines_operating=operating))
        engine = self.engine_state(power, flight, method=method)
        emitted = emissions(self.engine, engine)
        usages = self.usages(flight, trim.solution, engine, power, limits)
        classification, reason = classify(usages, trim, engine, power, limits)
        if classification == "ok" and not engine.success:
            classification, reason = "not converged", engine.message
        out = {name: value if engine.success else math.nan for name, value in engine.outputs.items()}
        messages = dict.fromkeys((trim.solution.message, engine.message, emitted.message))
        return OperatingPoint(
            success=engine.success,
            status=engine.status,
            message="; ".join(messages),
            feasible=classification == "ok",
            reason=reason,
            classification=classification,
            residual_norm=max(trim.solution.residual_norm, engine.residual_norm),
            iterations=trim.solution.iterations + engine.iterations,
            engines_operating=operating,
            main_rotor_power=trim.solution.outputs["main_rotor_power"],
            tail_rotor_power=trim.solution.outputs["tail_rotor_power"],
            shaft_power_per_engine=power,
            fuel_flow=operating * out["fuel_flow"],
            **{name: operating * getattr(emitted, name) for name in SPECIES},
            **{name: getattr(emitted, name) for name in INDICES},
            nox_of_fits={name: operating * value for name, value in emitted.nox_of_fits.items()},
            **{name: trim.solution.values[name] for name in CONTROLS},
            gas_generator_speed=out["gas_generator_speed"],
            turbine_inlet_temperature=out["turbine_inlet_temperature"],
            power_turbine_inlet_temperature=out["power_turbine_inlet_temperature"],
            **{name: trim.solution.outputs[name] for name in ROTOR_OUTPUTS},
            one_engine_inoperative_margin=self._one_engine_margin(trim.power),
            autorotative_energy=0.5 * self.aircraft.main_rotor.polar_inertia * flight["rotor_speed"] ** 2,
            usages=usages,
            trim=trim,
            gas_path=engine,
            aircraft=self.aircraft,
            engine=self.engine,
        )

    def _one_engine_margin(self, rotor_power: float) -> float:
        """Rating of the engines left when one has failed less the power they would have to give [W]."""
        drive = self.aircraft.transmission
        needed = drive.power_per_engine(rotor_power) * drive.engines
        alone = Limits(self.aircraft, self.engine, one_engine_inoperative=True)
        return (drive.engines - 1) * alone.rated_power - needed

    def usages(
        self, flight: Mapping[str, float], trim: Solution, engine: Solution, power: float, limits: Limits
    ) -> dict[str, float]:
        """Usage of each limit (1 = at the limit), in the order of LIMIT_NAMES."""
        return limits.usages(
            flight["load_factor"] * flight["mass"],
            flight["rotor_speed"],
            speed=flight["speed"],
            density=standard_air(flight["altitude"], flight["isa_offset"]).density,
            power=power,
            temperature=engine.outputs["power_turbine_inlet_temperature"] if engine.success else math.nan,
            tail_loading=trim.outputs["tail_blade_loading"],
            larger=max,
        )

    def _unsolved(self, flight: Mapping[str, float], trim: Trim, limits: Limits, operating: int) -> OperatingPoint:
        """A point without trim: classified by the blade loading, then by the thrust demanded of the tail rotor."""
        density = standard_air(flight["altitude"], flight["isa_offset"]).density
        weight = flight["load_factor"] * flight["mass"]
        loading, largest = limits.blade_loading(weight, density, flight["rotor_speed"], flight["speed"])
        classification, reason = "not converged", trim.reason or trim.solution.message
        if loading > largest:
            classification, reason = "stalled", f"blade loading {loading:.4f} above {largest:.4f}"
        else:
            tail = self._tail_demand(flight)
            usage = limits.tail_usage(tail, flight["rotor_speed"], flight["speed"])
            if usage > 1:
                classification = "tail rotor"
                reason = f"tail-rotor blade loading {tail:.4f} needed, {usage:.3f} times the largest allowed"
        nan = {name: math.nan for name in (*CONTROLS, *ROTOR_OUTPUTS, *ENGINE_RESULTS)}
        nan |= {"blade_loading": loading}
        return OperatingPoint(
            success=False,
            status=trim.solution.status,
            message=trim.solution.message,
            feasible=False,
            reason=reason,
            classification=classification,
            residual_norm=trim.solution.residual_norm,
            iterations=trim.solution.iterations,
            engines_operating=operating,
            nox_of_fits={},
            usages={},
            trim=trim,
            gas_path=None,
            aircraft=self.aircraft,
            engine=self.engine,
            **nan,
        )

    def _tail_demand(self, flight: Mapping[str, float]) -> float:
        """Blade loading of a tail rotor that never stalls, nan where even that trim fails."""
        trim = find_trim(
            trim_system(self.aircraft, stalling_tail=False),
            trim_parameters(self.aircraft, flight),
            easy=self._easy_flight(flight),
        )
        return trim.solution.outputs["tail_blade_loading"] if trim.success else math.nan


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
    hub_height: float | None = None,
    cg_shift: float = 0.0,
    engines_operating: int | None = None,
    aircraft: Aircraft | str | Path = "bo105",
    method: Literal["ipopt", "newton"] = "ipopt",
) -> OperatingPoint:
    """Trim the aircraft with its engines: gross ``mass`` [kg], true airspeed ``speed`` [m/s], pressure ``altitude``
    [m].

    ``rotor_speed`` [rad/s] and ``twist`` [rad, washout positive] default to the aircraft's nominal; ``climb_angle``
    [rad], ``isa_offset`` [K]. ``load_factor`` [-]: of a steady coordinated turn to the right. ``hub_height``: of the
    hub above the ground [m], None far from it. ``cg_shift``: of the centre of gravity, forward of the reference of
    ``aircraft`` [m] (see :func:`vrsopt.balance.balance`). ``engines_operating``: None for all; with fewer, those left
    carry the power, and the ratings are those with one engine inoperative. ``method`` is the solver of trim and engine,
    "ipopt" or "newton"; both end at the same residual. The point is classified under the flight manual's engine limits
    and the blade-loading limit without margin. Raises :class:`InputError` for a value out of range.
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
        "cg_shift": cg_shift,
    }
    ranges = allowed_ranges(machine.aircraft)
    for name, value in flight.items():
        low, high = ranges[name]
        if not (math.isfinite(value) and low <= value <= high):
            raise InputError(f"trim: {name} = {value:g}: a number from {low:g} to {high:g}")
    if hub_height is not None:
        lowest = rotor.radius / LARGEST_PROXIMITY
        if not hub_height >= lowest:
            raise InputError(f"trim: hub_height = {hub_height:g}: at least {lowest:g}, half the rotor radius")
        flight["ground_proximity"] = rotor.radius / hub_height
    limits = Limits(machine.aircraft, machine.engine)
    return machine.point(flight, limits=limits, method=method, engines_operating=engines_operating)
