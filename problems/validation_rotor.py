"""The rotor and the trim against tests, closed forms and themselves: numbers and tables for problems/validation.md.

Imported by validation.py, and by tests/test_validation_page.py, which holds the numbers to their bounds; nothing here
is fitted to what it is compared with.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from math import radians
from typing import NamedTuple

import casadi as ca
import numpy as np
from level_flight import KNOT, TEST_PITCH, TEST_POWER
from page_table import Figure, figures, table
from scipy.optimize import brentq, minimize_scalar

import vrsopt
from vrsopt.aircraft import load_aircraft
from vrsopt.equilibrium import TrimEquations, trim_system
from vrsopt.flight import trim_parameters
from vrsopt.helicopter import helicopter
from vrsopt.rotor.blade import Beam, Family
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.solution import Solution

# Beam of the scaled HART II blade, per nominal revolution, by an independent finite-element model
FREQUENCIES: dict[tuple[float, Family], tuple[float, ...]] = {
    (1.0, "flap"): (1.1155, 2.8121, 4.9908),
    (1.0, "lag"): (0.6901, 4.3504),
    (1.0, "torsion"): (3.6,),
    (0.85, "flap"): (0.957, 2.444, 4.453),
    (0.85, "lag"): (0.646, 4.151),
    (0.85, "torsion"): (3.562,),
}
# I. C. Cheeseman, W. E. Bennett, ARC R&M 3021: height of the rotor over its radius, thrust ratio at constant power
CHEESEMAN_BENNETT = {0.5: 1.3333, 0.8: 1.1082, 1.0: 1.0667, 1.5: 1.0286, 2.0: 1.0159}


@cache
def point(speed: float, climb_angle: float = 0.0, load_factor: float = 1.0) -> vrsopt.OperatingPoint:
    """2200 kg at sea level, speed [m/s], climb angle [rad]."""
    found = vrsopt.trim(2200.0, speed, climb_angle=climb_angle, load_factor=load_factor, method="newton")
    if not found.success:
        raise RuntimeError(found.message)
    return found


def both_rotors(flown: vrsopt.OperatingPoint) -> float:
    """Power of main and tail rotor [W]."""
    return flown.main_rotor_power + flown.tail_rotor_power


# -- key figures, blade frequencies ------------------------------------------------------------------------------------


@cache
def key_figures() -> list[Figure]:
    least = minimize_scalar(
        lambda speed: both_rotors(point(float(speed))), bounds=(20.0, 45.0), method="bounded", options={"xatol": 0.02}
    )
    return [
        Figure("figure of merit, hover, 2200 kg, sea level", point(0.0).figure_of_merit, 0.60, 0.78),
        Figure("speed of least power, 2200 kg, m/s", float(least.x), 28.0, 36.0, "{:.1f}"),
    ]


class Frequency(NamedTuple):
    """A blade mode at a share of the nominal rotor speed, per nominal revolution."""

    rotor_speed: float
    mode: str
    model: float
    beam: float

    @property
    def difference_percent(self) -> float:
        return 100.0 * (self.model / self.beam - 1.0)


@cache
def frequencies() -> list[Frequency]:
    rotor = load_aircraft().main_rotor
    nominal = rotor.nominal_rotor_speed
    beam, found = Beam(rotor.blade), []
    for (ratio, family), references in FREQUENCIES.items():
        model = beam.modes(family, rotor_speed=nominal, count=3).frequencies(ratio * nominal) / nominal
        names = (f"{family} {i + 1}" for i in range(len(references)))
        found += [Frequency(ratio, *row) for row in zip(names, model.tolist(), references, strict=False)]
    return found


def key_figures_table() -> Iterator[str]:
    yield from figures(key_figures())


def frequencies_table() -> Iterator[str]:
    yield "Blade frequencies per nominal revolution, uncoupled, Ritz basis fixed at nominal speed:\n"
    rows = [
        (f"{100 * f.rotor_speed:.0f} %", f.mode, f"{f.model:.4f}", f.beam, f"{f.difference_percent:+.2f} %")
        for f in frequencies()
    ]
    yield from table(("rotor speed", "mode", "model", "beam", "difference"), rows)


# -- flight test -------------------------------------------------------------------------------------------------------


class FlownPower(NamedTuple):
    """Level flight: speed [kt], measured power, and power of main rotor, both rotors and engines [kW]."""

    knots: float
    measured: float
    main: float
    both: float
    engines: float

    def differences_percent(self) -> tuple[float, float, float]:
        """Of main rotor, both rotors and engines from the measured power."""
        main, both, engines = (100.0 * (power / self.measured - 1.0) for power in self[2:])
        return main, both, engines


class FlownPitch(NamedTuple):
    """Level flight: speed [kt], measured and computed pitch attitude [deg]."""

    knots: float
    measured: float
    model: float

    @property
    def difference(self) -> float:
        return self.model - self.measured


@cache
def flight_test_power() -> list[FlownPower]:
    rows = []
    for knots, measured in zip(*TEST_POWER, strict=True):
        flown = point(knots * KNOT)
        powers = flown.main_rotor_power, both_rotors(flown), 2.0 * flown.shaft_power_per_engine
        rows.append(FlownPower(knots, measured, *(power / 1e3 for power in powers)))
    return rows


@cache
def flight_test_pitch() -> list[FlownPitch]:
    return [
        FlownPitch(knots, measured, float(np.degrees(point(knots * KNOT).pitch)))
        for knots, measured in zip(*TEST_PITCH, strict=True)
    ]


def pitch_errors() -> np.ndarray:
    """Absolute differences of the pitch attitude from the flight test [deg]."""
    return np.abs([flown.difference for flown in flight_test_pitch()])


def flight_test_tables() -> Iterator[str]:
    yield "Level-flight power against flight test (not a target: the source does not say which power it is):\n"
    rows = [
        (p.knots, p.measured, *(f"{kw:.0f} | {d:+.0f} %" for kw, d in zip(p[2:], p.differences_percent(), strict=True)))
        for p in flight_test_power()
    ]
    header = ("speed kt", "flight test kW", "main rotor kW", "difference", "both rotors kW", "difference")
    yield from table((*header, "engines kW", "difference"), rows)
    errors = pitch_errors()
    yield (f"Pitch attitude against flight test: {errors.mean():.2f} deg on average, {errors.max():.2f} deg at most:\n")
    header = ("speed kt", "flight test deg", "model deg", "difference deg")
    yield from table(
        header, [(p.knots, p.measured, f"{p.model:.2f}", f"{p.difference:+.2f}") for p in flight_test_pitch()]
    )


# -- ground ------------------------------------------------------------------------------------------------------------


class NearGround(NamedTuple):
    """Trimmed hover: height over radius, thrust ratios at constant induced power, and power over that far away."""

    height: float
    published: float
    model: float
    power_ratio: float


@cache
def near_ground() -> list[NearGround]:
    """Mass that takes near the ground the induced power of 2200 kg far from it."""
    machine = helicopter()
    system, rotor = trim_system(machine.aircraft), machine.aircraft.main_rotor
    base = {"altitude": 0.0, "isa_offset": 0.0, "speed": 0.0, "climb_angle": 0.0, "load_factor": 1.0}
    base |= {"rotor_speed": rotor.nominal_rotor_speed, "twist": rotor.twist}

    def hover(mass: float, proximity: float = 0.0, guess: Solution | None = None) -> Solution:
        flight = {**base, "mass": mass, "ground_proximity": proximity}
        return system.solve(trim_parameters(machine.aircraft, flight), guess, method="newton")

    alone = hover(2200.0)
    far, rows = alone.outputs, []
    for height, published in CHEESEMAN_BENNETT.items():

        def excess(mass: float, near: float = 1 / height) -> float:
            return hover(mass, near, alone).outputs["induced_power"] / far["induced_power"] - 1

        mass = float(brentq(excess, 2150.0, 3200.0, xtol=0.01))
        ratio = hover(mass, 1 / height, alone).outputs["thrust"] / far["thrust"]
        power = hover(2200.0, 1 / height, alone).outputs["main_rotor_power"] / far["main_rotor_power"]
        rows.append(NearGround(height, published, ratio, power))
    return rows


def near_ground_table() -> Iterator[str]:
    yield "Ground effect in the trimmed hover: thrust ratio at constant induced power, and what it saves at 2200 kg:\n"
    rows = [
        (n.height, n.published, f"{n.model:.4f}", f"{100 * (n.model / n.published - 1):+.2f} %", f"{n.power_ratio:.3f}")
        for n in near_ground()
    ]
    header = ("height of rotor / radius", "Cheeseman and Bennett", "model", "difference", "power at equal mass")
    yield from table(header, rows)


# -- where the power goes ----------------------------------------------------------------------------------------------

BALANCES: Mapping[str, dict[str, float]] = {
    "hover": {"speed": 0.0},
    "15 m/s": {"speed": 15.0},
    "30 m/s": {"speed": 30.0},
    "30 m/s, climb 6 deg": {"speed": 30.0, "climb_angle": radians(6.0)},
    "30 m/s, descent 6 deg": {"speed": 30.0, "climb_angle": radians(-6.0)},
    "50 m/s": {"speed": 50.0},
    "65 m/s": {"speed": 65.0},
    "40 m/s, 1.5 g": {"speed": 40.0, "load_factor": 1.5},
}


class Balance(NamedTuple):
    """Power of both rotors, its terms, and what the structural damping of the blades takes [W]."""

    flight: str
    total: float
    terms: dict[str, float]
    damping: float

    @property
    def rest(self) -> float:
        return self.total - sum(self.terms.values())


@cache
def power_balance() -> list[Balance]:
    """Shaft power of both rotors against the terms, each its own integral."""
    equations = TrimEquations(load_aircraft(), Fidelity())
    blade, rate = equations.model.blade, equations.state.rotor_speed
    motion = rate * ca.mtimes(equations.state.blade, blade.harmonics.rates)
    work = ca.sum1(ca.sum2(motion * ca.mtimes(ca.DM(blade.equations.damping), motion)))
    blades = equations.aircraft.main_rotor.blades
    damping = ca.Function("damping", [equations.x, equations.p], [blades / blade.harmonics.count * work])
    rows = []
    for name, flight in BALANCES.items():
        flown = point(**flight)
        x = [flown.solution.values[unknown.name] for unknown in equations.unknowns]
        p = [flown.solution.parameters[parameter.name] for parameter in equations.parameters]
        rows.append(Balance(name, both_rotors(flown), flown.powers, float(damping(x, p))))
    return rows


def power_balance_table() -> Iterator[str]:
    yield (
        "Power of both rotors and where it goes, kW, each term its own integral (parasite with the tail rotor's drag); "
        "beside the rest that part of it which the structural damping of the blades takes:\n"
    )
    rows = [
        (
            b.flight,
            *(f"{power / 1e3:.2f}" for power in (b.total, *b.terms.values())),
            f"{b.rest / 1e3:+.2f}",
            f"{b.damping / 1e3:.2f}",
            f"{100 * b.rest / b.total:+.2f} %",
        )
        for b in power_balance()
    ]
    names = tuple(power_balance()[0].terms)
    yield from table(("flight", "both rotors", *names, "rest", "damping", "rest of all"), rows)
