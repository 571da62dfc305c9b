"""Physics models of the study of the optimum rotor speed: their ingredients, and power against rotor speed.

A physics model is a section, a tail rotor, an inflow and a calibration split; it is calibrated on its own hover and
cruise before anything is mapped. Its power against rotor speed is a walk of trims from the fastest rotor down. The
manoeuvre margin and the coupling of the engine need no trim: they act on the curve of power.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from calibrate_rotor import SPLITS, calibrate, rotor_power, starting_constants
from scipy.interpolate import Akima1DInterpolator
from scipy.optimize import brentq

from vrsopt.aircraft import Aircraft, load_aircraft
from vrsopt.atmosphere import standard_air
from vrsopt.equilibrium import trim_system
from vrsopt.flight import trim_parameters
from vrsopt.limits import Limits
from vrsopt.residual import ResidualSystem
from vrsopt.rotor.airfoil import load_section, with_largest_lift
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.solution import Solution
from vrsopt.turboshaft.data import load_engine

SECTIONS = ("table", "recovery 0.95", "recovery 0.97", "NACA 0012", "largest lift -20 %")
TAIL_ROTORS = ("stalling", "linear")
INFLOWS = ("mean states", "blade passage")
SPLIT_NAMES = tuple(SPLITS)
# Coarser than the package's default, but for the inflow: shape 4 alone costs 2 % of power at 80 % rotor speed.
COARSE = Fidelity(harmonics=3, azimuths=24, stations=8, highest_shape=5)

SLOWEST, FASTEST = 0.75, 1.15  # rotor speed over nominal
NODES = 10  # rotor speeds of a curve
DEEP_STALL = 1.35  # a walk ends where power has grown so much above its least
EFFORT = 20  # Newton iterations of one step of a walk
FOLLOWING = 60  # Jacobians of a continuation where a step fails
REFINEMENTS = 2  # halvings of the steps around an interior minimum
BEFORE_FOLD = 0.98  # of the way to a fold: the last trim of a walk
ENDS = ("lower bound", "blade loading", "fold", "no trim", "deep stall")


@dataclass(frozen=True)
class Physics:
    """One physics model by the names of its ingredients; the defaults are those of the study's default model."""

    section: str = SECTIONS[0]
    tail_rotor: str = TAIL_ROTORS[0]
    inflow: str = INFLOWS[0]
    split: str = SPLIT_NAMES[0]

    @cached_property
    def aircraft(self) -> Aircraft:
        """The Bo 105 with the section of this model, at both rotors."""
        aircraft = load_aircraft("bo105")
        rotor = aircraft.main_rotor
        if self.section == "NACA 0012":
            return aircraft.replaced(main_rotor=rotor.replaced(section=load_section("naca_0012")))
        if self.section == "largest lift -20 %":
            return aircraft.replaced(main_rotor=rotor.replaced(section=with_largest_lift(rotor.section, 0.8)))
        return aircraft

    @property
    def stalling_tail(self) -> bool:
        return self.tail_rotor == "stalling"

    def fidelity(self, base: Fidelity = COARSE) -> Fidelity:
        """Resolution ``base`` with the ingredients of this model."""
        recovery = float(self.section.split()[1]) if self.section.startswith("recovery") else None
        return replace(base, chord_recovery=recovery, blade_passage=self.inflow == "blade passage")

    def system(self, base: Fidelity = COARSE) -> ResidualSystem:
        return trim_system(self.aircraft, self.fidelity(base), stalling_tail=self.stalling_tail)

    def constants(self, base: Fidelity = COARSE) -> dict[str, float]:
        """All calibrated constants, the two of the split solved with this very model."""
        solved = calibrate(self.aircraft, self.split, fidelity=self.fidelity(base), stalling_tail=self.stalling_tail)
        return starting_constants(self.aircraft, self.split) | solved

    @property
    def largest_mach(self) -> float:
        """Largest Mach number of the advancing tip: the drag of NACA 0012 is known to 0.8 and runs away beyond 0.87."""
        return 0.87 if self.section == "NACA 0012" else 1.0


class Flight(NamedTuple):
    mass: float  # kg
    altitude: float  # m
    speed: float  # m/s


@dataclass(frozen=True)
class Curve:
    """Power of both rotors [W] and tail-rotor blade loading at rotor speeds over nominal, fastest first.

    ``end`` says what the walk ended at, one of ENDS.
    """

    ratio: np.ndarray
    power: np.ndarray
    tail_loading: np.ndarray
    end: str

    def between(self, values: np.ndarray, ratio: np.ndarray) -> np.ndarray:
        """``values`` of the nodes at other rotor speeds: modified Akima cubic, no ringing where stall begins."""
        return np.asarray(Akima1DInterpolator(self.ratio[::-1], values[::-1], method="makima")(ratio))


def slowest(limits: Limits, flight: Flight) -> float:
    """Least rotor speed over nominal that the blade loading allows, without a margin, not below SLOWEST."""
    nominal = limits.aircraft.main_rotor.nominal_rotor_speed
    density = standard_air(flight.altitude, 0.0).density

    def excess(ratio: float) -> float:
        usage = limits.blade_loading_usage(flight.mass, density, ratio * nominal, flight.speed, smooth_max=max)
        return float(usage) - 1.0

    return SLOWEST if excess(SLOWEST) <= 0 else float(brentq(excess, SLOWEST, 1.0 + 1e-9))


class Walk:
    """Trims of one physics model along rotor speed, each from its neighbour."""

    def __init__(self, physics: Physics, constants: Mapping[str, float], base: Fidelity = COARSE) -> None:
        self.physics, self.constants = physics, constants
        self.system = physics.system(base)
        self.limits = Limits(physics.aircraft, load_engine(physics.aircraft.engine), manoeuvre_margin=1.0)

    def fastest(self, flight: Flight) -> float:
        """Rotor speed over nominal that a walk begins with, not above FASTEST."""
        rotor = self.physics.aircraft.main_rotor
        largest = self.physics.largest_mach * standard_air(flight.altitude, 0.0).speed_of_sound - flight.speed
        return min(FASTEST, largest / (rotor.nominal_rotor_speed * rotor.radius))

    def parameters(self, flight: Flight, ratio: float) -> dict[str, float]:
        rotor = self.physics.aircraft.main_rotor
        level = {
            **flight._asdict(),
            "isa_offset": 0.0,
            "climb_angle": 0.0,
            "load_factor": 1.0,
            "rotor_speed": ratio * rotor.nominal_rotor_speed,
            "twist": rotor.twist,
        }
        return {**trim_parameters(self.physics.aircraft, level), **self.constants}

    def solve(self, flight: Flight, ratio: float, guess: Solution | None = None) -> Solution | None:
        """The trim, None if Newton does not find it with little effort."""
        solution = self.system.solve(
            self.parameters(flight, ratio), guess, method="newton", max_iterations=EFFORT if guess else 60
        )
        return solution if solution.success else None

    def step(self, flight: Flight, last: Solution, way: tuple[float, float]) -> tuple[Solution | None, float]:
        """The trim at the end of ``way`` (rotor speeds from, to) and its rotor speed.

        Where Newton fails the trims are followed through; if they turn back, the trim is that just before the fold.
        """
        start, end = way
        found = self.solve(flight, end, last)
        if found is not None:
            return found, end
        branch = self.system.follow(last, self.parameters(flight, end), max_jacobians=FOLLOWING)
        if not branch.folds:
            return (branch.solution, end) if branch.solution.success else (None, end)
        ratio = start + BEFORE_FOLD * branch.folds[0] * (end - start)
        for place in np.linspace(start, ratio, 4)[1:]:
            closer = self.solve(flight, float(place), last)
            if closer is None:
                break
            last, found, ratio = closer, closer, float(place)
        return found, ratio

    def curve(
        self, flight: Flight, ratios: np.ndarray, neighbour: Solution | None = None
    ) -> tuple[Curve, Solution | None]:
        """Power at falling ``ratios``, and the first trim; empty if there is none at the first."""
        first = self.solve(flight, float(ratios[0]), neighbour) if neighbour is not None else None
        first = last = first or self.solve(flight, float(ratios[0]))
        reached: list[tuple[float, Solution]] = []
        end, ratio = "no trim", float(ratios[0])
        for target in ratios:
            if reached and last is not None:
                last, ratio = self.step(flight, last, (reached[-1][0], float(target)))
            if last is None:
                break
            if reached and rotor_power(last) > DEEP_STALL * min(rotor_power(found) for _, found in reached):
                end = "deep stall"
                break
            reached.append((ratio, last))
            if ratio > target:
                end = "fold"
                break
        else:
            end = "lower bound" if ratios[-1] <= SLOWEST + 1e-9 else "blade loading"
        self._refine(flight, reached)
        return Curve(
            np.array([ratio for ratio, _ in reached]),
            np.array([rotor_power(found) for _, found in reached]),
            np.array([found.outputs["tail_blade_loading"] for _, found in reached]),
            end,
        ), first

    def _refine(self, flight: Flight, reached: list[tuple[float, Solution]]) -> None:
        """Trims half-way to both neighbours of the least power, twice: where stall begins the curve bends sharply."""
        for _ in range(REFINEMENTS):
            best = min(range(len(reached)), key=lambda k: rotor_power(reached[k][1]), default=0)
            if not 0 < best < len(reached) - 1:
                return
            for k in (best, best - 1):  # the later first, so that indices stay
                ratio = 0.5 * (reached[k][0] + reached[k + 1][0])
                found = self.solve(flight, ratio, reached[best][1])
                if found is not None:
                    reached.insert(k + 1, (ratio, found))

    def curves(
        self, masses: Sequence[float], altitudes: Sequence[float], speeds: Sequence[float]
    ) -> Iterator[tuple[Flight, Curve]]:
        """Curves of all flights, airspeed after airspeed."""
        for mass in masses:
            for altitude in altitudes:
                neighbour = None
                for speed in speeds:
                    flight = Flight(mass, altitude, speed)
                    ratios = np.linspace(self.fastest(flight), slowest(self.limits, flight), NODES)
                    found, first = self.curve(flight, ratios, neighbour)
                    neighbour = first or neighbour
                    yield flight, found
