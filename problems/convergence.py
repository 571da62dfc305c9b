"""How finely the rotor has to be resolved, and where the exact derivatives of the power hold.

    python problems/convergence.py

Power of both rotors against finer models, one ingredient at a time, with the CPU time of a trim; and the exact
derivatives of that power against differences of trims solved again, over a sample of the whole box. The tables go to
problems/validation.md with the rest of the validation.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from page_table import table
from scipy.stats import qmc

from vrsopt.aircraft import Aircraft, load_aircraft
from vrsopt.atmosphere import standard_air
from vrsopt.equilibrium import trim_system
from vrsopt.flight import trim_parameters
from vrsopt.helicopter import helicopter
from vrsopt.limits import Limits
from vrsopt.residual import ResidualSystem
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.solution import Solution

FINE = Fidelity(harmonics=8, azimuths=96, stations=24)
CONVERGED_INFLOW = Fidelity(highest_harmonic=8, highest_shape=9)
CASES = {
    "hover": (2200.0, 0.0, 0.0),
    "15 m/s": (2200.0, 15.0, 0.0),
    "30 m/s": (2200.0, 30.0, 0.0),
    "50 m/s": (2200.0, 50.0, 0.0),
    "65 m/s": (2200.0, 65.0, 0.0),
    "2450 kg, 2000 m, 45 m/s": (2450.0, 45.0, 2000.0),
    "40 m/s, 1.3 g": (2200.0, 40.0, 0.0, 1.3),
}
INFLOW_SETS = ((0, 1), (1, 2), (2, 3), (3, 4), (2, 5), (3, 5), (4, 5), (5, 6), (6, 7))
SUSPICIOUS = 0.03  # smallest singular value below which derivatives may differ: a fold is near
ACCURACY = 1e-5
STEPS = {  # of the differences, and how far the variable ranges
    "mass": (2.0, 1100.0),
    "altitude": (5.0, 2000.0),
    "speed": (0.04, 70.0),
    "rotor_speed": (0.02, 18.0),
    "twist": (5e-4, 0.17),
    "climb_angle": (4e-4, 0.28),
    "turn_rate": (5e-4, 0.3),
}
BOX = {  # of the study; rotor speed over nominal
    "mass": (1400.0, 2500.0),
    "altitude": (0.0, 2000.0),
    "speed": (0.0, 70.0),
    "rotor_speed": (0.75, 1.15),
    "twist": (np.radians(6.0), np.radians(16.0)),
    "climb_angle": (-0.14, 0.14),
    "load_factor": (1.0, 1.3),
}


def flight(
    aircraft: Aircraft, mass: float, speed: float, altitude: float, load_factor: float = 1.0, **changes: float
) -> dict[str, float]:
    rotor = aircraft.main_rotor
    return {
        "mass": mass,
        "altitude": altitude,
        "isa_offset": 0.0,
        "speed": speed,
        "climb_angle": 0.0,
        "load_factor": load_factor,
        "rotor_speed": rotor.nominal_rotor_speed,
        "twist": rotor.twist,
    } | changes


def power(solution: Solution) -> float:
    """Power of both rotors [W], nan for a failed trim."""
    if not solution.success:
        return float("nan")
    return solution.outputs["main_rotor_power"] + solution.outputs["tail_rotor_power"]


@dataclass(frozen=True)
class Study:
    """Powers of all cases [W] with one fidelity, and mean CPU time [s] of a trim from momentum theory."""

    powers: np.ndarray
    seconds: float
    unknowns: int


def study(fidelity: Fidelity, aircraft: Aircraft | None = None) -> Study:
    aircraft = aircraft or load_aircraft()
    system = trim_system(aircraft, fidelity)
    points = [trim_parameters(aircraft, flight(aircraft, *case)) for case in CASES.values()]
    system.solve(points[0], method="newton")  # builds the functions
    begin = time.process_time()
    powers = np.array([power(system.solve(point, method="newton")) for point in points])
    return Study(powers, (time.process_time() - begin) / len(points), len(system.unknowns))


def errors(reference: Fidelity, variants: Mapping[str, Fidelity]) -> Iterator[list[object]]:
    """Rows: name, relative error of the power of each case in per cent, CPU time of a trim."""
    known = study(reference).powers
    for name, variant in variants.items():
        result = study(variant)
        found = 100 * (result.powers / known - 1)
        yield [name, *(f"{error:+.3f}" for error in found), result.unknowns, f"{1e3 * result.seconds:.0f}"]


def resolution() -> Iterator[str]:
    """Harmonics, azimuths and stations, each alone against a fine model."""
    default = Fidelity()
    variants = {
        **{f"{n} harmonics": replace(FINE, harmonics=n) for n in (2, 3, 4, 5, 6)},
        **{f"{n} azimuths": replace(FINE, azimuths=n) for n in (24, 36, 48, 72)},
        **{f"{n} stations": replace(FINE, stations=n) for n in (6, 8, 10, 12, 16)},
        f"default: {default.harmonics}, {default.azimuths}, {default.stations}": default,
    }
    yield (
        f"Power of both rotors against {FINE.harmonics} harmonics, {FINE.azimuths} azimuths and {FINE.stations} "
        "stations, one changed at a time, error in per cent:\n"
    )
    yield from table(_header("resolution"), errors(FINE, variants))


def inflow() -> Iterator[str]:
    """Sets of mean inflow states, and states at the blade passage."""
    names = {(m, n): f"m <= {m}, n <= {n}" for m, n in INFLOW_SETS}
    variants = {name: Fidelity(highest_harmonic=m, highest_shape=n) for (m, n), name in names.items()}
    top = CONVERGED_INFLOW
    yield (
        f"Mean inflow states against m <= {top.highest_harmonic}, n <= {top.highest_shape}, the same induced-power "
        "factor in all, error of the power in per cent:\n"
    )
    yield from table(_header("inflow states"), errors(top, variants))
    rotor = load_aircraft().main_rotor
    bare = load_aircraft().replaced(main_rotor=rotor.replaced(induced_power_factor=1.0))
    mean, passage = study(Fidelity(), bare), study(Fidelity(blade_passage=True), bare)
    yield "What the states at the blade passage add to the power without any empirical factor, per cent:\n"
    added = 100 * (passage.powers / mean.powers - 1)
    row = ["with blade passage", *(f"{x:+.2f}" for x in added), passage.unknowns, f"{1e3 * passage.seconds:.0f}"]
    yield from table(_header("inflow states"), [row])


def modes() -> Iterator[str]:
    """Numbers of flap, lag and torsion modes, and the other ingredients."""
    rich = Fidelity(flap_modes=5, lag_modes=3, torsion_modes=2)
    counts = (
        (1, 0, 0),
        (1, 1, 0),
        (3, 0, 0),
        (3, 2, 0),
        (3, 0, 1),
        (2, 1, 1),
        (3, 1, 1),
        (3, 2, 1),
        (4, 2, 1),
        (3, 2, 2),
    )
    variants = {
        f"{a} flap, {b} lag, {c} torsion": Fidelity(flap_modes=a, lag_modes=b, torsion_modes=c) for a, b, c in counts
    }
    yield "Blade modes against 5 flap, 3 lag and 2 torsion, error of the power in per cent:\n"
    yield from table(_header("modes"), errors(rich, variants))
    variants = {"static section": Fidelity(dynamic_stall=False), "no wake curvature": Fidelity(wake_curvature=False)}
    yield "Leaving out, against the default model, change of the power in per cent:\n"
    yield from table(_header("left out"), errors(Fidelity(), variants))


def _header(first: str) -> list[str]:
    return [first, *CASES, "unknowns", "ms per trim"]


# -- derivatives -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Comparison:
    """Exact derivatives of the power against differences: largest relative error over the variables, and which."""

    flight: dict[str, float]
    smallest_singular_value: float
    error: float
    variable: str


def difference(system: ResidualSystem, solution: Solution, name: str, step: float) -> float:
    """Fourth-order central difference of the power by a parameter, the trims solved again."""
    p = {}
    for k in (-2, -1, 1, 2):
        parameters = {**solution.parameters, name: solution.parameters[name] + k * step}
        p[k] = power(system.solve(parameters, solution, method="newton"))
    return (8 * (p[1] - p[-1]) - (p[2] - p[-2])) / (12 * step)


def sensitivity_error(system: ResidualSystem, solution: Solution) -> tuple[float, str]:
    """Largest relative error of d(power)/d(variable) over the variables, and the name of that variable.

    At the best of three steps: a long one leaves curvature, a short one the residual's tolerance. Relative to the
    derivative, or to a hundredth of the power per range of the variable, since near an optimum the derivative itself
    vanishes. Straight flight has no slope in the turn rate but for the tail rotor and is left out there.
    """
    slopes = system.sensitivities(solution)
    worst = (0.0, "")
    for name, (step, width) in STEPS.items():
        if name == "turn_rate" and solution.parameters[name] == 0:
            continue
        exact = slopes["main_rotor_power"][name] + slopes["tail_rotor_power"][name]
        size = max(abs(exact), 1e-2 * power(solution) / width)
        error = min(abs(exact - difference(system, solution, name, h)) / size for h in (step, step / 2, step / 8))
        if not error <= worst[0]:
            worst = (error, name)
    return worst


def compared(count: int, seed: int = 5) -> list[Comparison]:
    """Points of the whole box, within its blade-loading limit, that have a trim."""
    machine = helicopter()
    system, limits = trim_system(machine.aircraft), Limits(machine.aircraft, machine.engine)
    found = []
    for where in scattered(machine.aircraft, limits, count=count, seed=seed):
        trim = machine.trim(where)
        if not trim.success:
            continue
        error, variable = sensitivity_error(system, trim.solution)
        value = system.smallest_singular_value(trim.solution)
        found.append(Comparison(where, value, error, variable))
    return found


def scattered(aircraft: Aircraft, limits: Limits, *, count: int, seed: int) -> Iterator[dict[str, float]]:
    """``count`` flights of a Latin hypercube of the box, those above the blade-loading limit left out.

    Turns and climbs begin at 10 m/s.
    """
    low, high = np.array(list(BOX.values())).T
    nominal = aircraft.main_rotor.nominal_rotor_speed
    for values in qmc.scale(qmc.LatinHypercube(len(BOX), seed=seed).random(count), low, high).tolist():
        where = {**dict(zip(BOX, values, strict=True)), "isa_offset": 0.0}
        where["rotor_speed"] *= nominal
        if where["speed"] < 10.0:
            where |= {"load_factor": 1.0, "climb_angle": 0.0}
        weight, density = where["load_factor"] * where["mass"], standard_air(where["altitude"]).density
        loading, largest = limits.blade_loading(weight, density, where["rotor_speed"], where["speed"])
        if loading <= largest:
            yield where


def derivatives(count: int = 60) -> Iterator[str]:
    """Exact derivatives against differences over the box; the points where they differ are listed."""
    points = compared(count)
    regular = [point for point in points if point.smallest_singular_value > SUSPICIOUS]
    good = [point for point in regular if point.error <= ACCURACY]
    yield (
        f"Exact derivatives of the power of both rotors by {', '.join(STEPS)} against differences of trims solved "
        f"again, {len(points)} points of the box below the blade-loading limit: of {len(regular)} with a smallest "
        f"singular value above {SUSPICIOUS:g}, {len(good)} agree within {ACCURACY:g} in every variable "
        f"(median {np.median([point.error for point in regular]):.1e}).\n"
    )
    if len(good) == len(points):
        return
    digits = {"mass": 0, "altitude": 0, "speed": 1, "rotor_speed": 2, "load_factor": 2}
    rows = [
        (
            *(f"{point.flight[name]:.{places}f}" for name, places in digits.items()),
            f"{point.smallest_singular_value:.4f}",
            f"{point.error:.1e}",
            point.variable,
        )
        for point in points
        if point not in good
    ]
    header = ("mass kg", "altitude m", "speed m/s", "rotor speed rad/s", "load factor", "smallest singular value")
    yield "The rest:\n"
    yield from table((*header, "largest error", "variable"), rows)


def main() -> None:
    for part in (resolution, inflow, modes, derivatives):
        for line in part():
            print(line, flush=True)


if __name__ == "__main__":
    main()
