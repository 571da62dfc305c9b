"""Least fuel in one flight by a few trims, where the rotor turns as slowly as the limits or its bound allow.

At a given rotor speed the twist of least power is that of least fuel, and of least use of all limits, whatever the
engine. So the optimum is known as soon as its rotor speed is, and nearly always that is the least allowed. It is tried
first: rotor speed of the blade loading, twist from a parabola through three trims, then a rotor as much faster as the
other limits want, then whether a still faster one would burn less. Where that is so, or something is not solved, the
whole problem is (:mod:`vrsopt.point_problem`). Both ways agree to 1e-6 of fuel.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import brentq, newton

from vrsopt.atmosphere import standard_air
from vrsopt.drive_train import engine_power
from vrsopt.errors import NoSolutionError
from vrsopt.helicopter import Helicopter
from vrsopt.limits import Limits
from vrsopt.point_optimum import NOMINAL_BOUNDS
from vrsopt.point_problem import ACTIVE, PointProblem
from vrsopt.solution import Solution

TWIST_STEP = math.radians(1.5)  # between the trims of the parabola
FASTER = 1.01  # rotor speed at which it must burn more
ALLOWED = 1e-6  # of a usage
AT_BOUND = 1e-4  # rad
FURTHEST = 1.3  # how much faster a rotor may have to turn
TIMES = 3  # parabolas at most, each around the twist of the one before


@dataclass(frozen=True)
class Flown:
    """One trim with its engines: fuel flow of all [kg/s], power of both rotors [W], usages by name."""

    fuel_flow: float
    power: float
    usages: Mapping[str, float]
    trim: Solution

    @property
    def largest(self) -> float:
        """Largest usage."""
        return max(self.usages.values())


@dataclass(frozen=True)
class Optimum:
    """Nominal and least fuel flow [kg/s], rotor speed over nominal, twist [rad], what is active, and the trims."""

    nominal: float
    least: float
    rotor_speed: float
    twist: float
    active: tuple[str, ...]
    trims: tuple[Solution, Solution] | None
    message: str = ""


class Optimiser:
    """Optima of one aircraft with one engine under its limits."""

    def __init__(self, machine: Helicopter, limits: Limits) -> None:
        self.machine, self.limits = machine, limits
        self.nominal = machine.aircraft.main_rotor.nominal_rotor_speed
        self.slowest = NOMINAL_BOUNDS[0][0] * self.nominal

    @cached_property
    def problem(self) -> PointProblem:
        """The whole problem, built where it is needed."""
        return PointProblem(self.machine, self.limits)

    def fly(self, flight: Mapping[str, float], guess: Solution | None) -> Flown:
        """Trim and engines; raises :class:`NoSolutionError` without one."""
        trim = self.machine.trim(flight, guess=guess)
        if not trim.success:
            raise NoSolutionError(trim.reason or trim.solution.message)
        power = float(engine_power(self.machine.aircraft, self.machine.engine, trim.power))
        state = self.machine.engine_state(power, flight)
        if not state.success:
            raise NoSolutionError(state.message)
        usages = self.limits.usages(
            flight["load_factor"] * flight["mass"],
            flight["rotor_speed"],
            speed=flight["speed"],
            density=standard_air(flight["altitude"], flight["isa_offset"]).density,
            power=power,
            temperature=state.outputs["power_turbine_inlet_temperature"],
            tail_loading=trim.solution.outputs["tail_blade_loading"],
        )
        fuel = self.machine.aircraft.transmission.engines * state.outputs["fuel_flow"]
        return Flown(fuel, trim.power, {name: float(value) for name, value in usages.items()}, trim.solution)

    def least_speed(self, flight: Mapping[str, float]) -> float:
        """Least rotor speed [rad/s] that blade loading with its margin, and the bound, allow."""
        density = standard_air(flight["altitude"], flight["isa_offset"]).density
        zero = {"power": 0.0, "temperature": 0.0, "tail_loading": 0.0}

        def excess(rotor_speed: float) -> float:
            weight = flight["load_factor"] * flight["mass"]
            used = self.limits.usages(weight, rotor_speed, speed=flight["speed"], density=density, **zero)
            return float(used["blade loading"]) - 1.0

        fastest = NOMINAL_BOUNDS[0][1] * self.nominal
        return self.slowest if excess(self.slowest) <= 0.0 else float(brentq(excess, self.slowest, fastest))

    def solve(
        self, flight: Mapping[str, float], twist: float, guesses: tuple[Solution, Solution] | None = None
    ) -> Optimum:
        """Least fuel in ``flight`` (with the nominal rotor), the search of the twist begun at ``twist`` [rad].

        ``guesses``: of the trims with nominal and with best rotor. Raises :class:`NoSolutionError` where the nominal
        rotor has no trim.
        """
        usual = self.fly(flight, guesses[0] if guesses else None)
        try:
            slow = {**flight, "rotor_speed": self.least_speed(flight)}
            best, twist = self.best_twist(slow, twist, guesses[1] if guesses else usual.trim)
            for _ in range(TIMES):
                if best.largest <= 1.0 + ALLOWED:
                    break
                slow["rotor_speed"] = self.allowed_speed({**slow, "twist": twist}, best)
                best, twist = self.best_twist(slow, twist, best.trim)
            faster = self.fly({**slow, "twist": twist, "rotor_speed": FASTER * slow["rotor_speed"]}, best.trim)
        except NoSolutionError:
            return self.searched(flight)
        if best.largest > 1.0 + ALLOWED or faster.fuel_flow <= best.fuel_flow:
            return self.searched(flight)
        active = [name for name, usage in best.usages.items() if usage > 1.0 - ACTIVE]
        active += ["rotor speed at its lower bound"] if slow["rotor_speed"] == self.slowest else []
        sides = zip(("lower", "upper"), NOMINAL_BOUNDS[1], strict=True)
        active += [f"twist at its {side} bound" for side, end in sides if abs(twist - end) < AT_BOUND]
        speed, trims = slow["rotor_speed"] / self.nominal, (usual.trim, best.trim)
        return Optimum(usual.fuel_flow, best.fuel_flow, speed, twist, tuple(active), trims)

    def allowed_speed(self, flight: Mapping[str, float], flown: Flown) -> float:
        """Rotor speed [rad/s] above that of ``flight``, flown beyond a limit, at which the limit is met.

        Raises :class:`NoSolutionError` where there is none nearby.
        """
        slow = flight["rotor_speed"]

        def excess(ratio: float) -> float:
            if ratio == 1.0:
                return flown.largest - 1.0
            return self.fly({**flight, "rotor_speed": ratio * slow}, flown.trim).largest - 1.0

        ratio, found = newton(excess, 1.0, x1=FASTER, tol=1e-8, maxiter=8, full_output=True, disp=False)
        if not (found.converged and 1.0 < ratio < FURTHEST):
            raise NoSolutionError(f"no rotor speed near {slow:g} rad/s keeps the limits")
        return float(ratio * slow)

    def best_twist(self, flight: Mapping[str, float], twist: float, guess: Solution) -> tuple[Flown, float]:
        """The flight with the twist [rad] of least power, within its bounds."""
        low, high = NOMINAL_BOUNDS[1]
        for _ in range(TIMES):
            centre = float(np.clip(twist, low + TWIST_STEP, high - TWIST_STEP))
            places = centre + TWIST_STEP * np.array([-1.0, 0.0, 1.0])
            powers = []
            for place in places.tolist():
                flown = self.fly({**flight, "twist": place}, guess)
                powers.append(flown.power)
                guess = flown.trim
            bend, slope = powers[0] - 2 * powers[1] + powers[2], 0.5 * (powers[2] - powers[0])
            twist = (
                float(np.clip(centre - TWIST_STEP * slope / bend, low, high)) if bend > 0 else places[np.argmin(powers)]
            )
            if abs(twist - centre) <= 1.5 * TWIST_STEP:
                break
        return self.fly({**flight, "twist": twist}, guess), twist

    def searched(self, flight: Mapping[str, float]) -> Optimum:
        """By the whole problem."""
        bounds = np.array([[end * self.nominal for end in NOMINAL_BOUNDS[0]], NOMINAL_BOUNDS[1]]).T
        found = self.problem.solve(flight, bounds=bounds)
        return Optimum(
            found.nominal_fuel_flow,
            found.fuel_flow,
            found.rotor_speed / self.nominal,
            found.twist,
            tuple(found.multipliers),
            None,
            "" if found.success else found.message,
        )
