"""Calibrate rotor and airframe on the two power points of the flight manual, with the model itself.

    python problems/calibrate_rotor.py

Hover and cruise power give two constants. Two points cannot tell profile from induced power, so both splits are solved:
the induced-power factor and the parasite area with the section drag at its assumed level (the default), and the section
drag level and the parasite area with an induced-power factor of one. Transmission efficiency, accessory power and
download are assumed and fixed before. A solved constant outside its range is not used: the data file keeps the sourced
value, and this script prints both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vrsopt.aircraft import Aircraft, load_aircraft
from vrsopt.atmosphere import standard_air
from vrsopt.equilibrium import calibrated_constants, trim_system
from vrsopt.errors import NoSolutionError
from vrsopt.flight import trim_parameters
from vrsopt.residual import ResidualSystem
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.solution import Solution
from vrsopt.trimming import find_trim

FOOT, KNOT = 0.3048, 1852 / 3600  # m, m/s


@dataclass(frozen=True)
class PowerPoint:
    """Engine power read from a chart of the flight manual; power is the total of both engines."""

    name: str
    mass: float  # kg
    altitude: float  # m
    temperature: float  # deg C
    speed: float  # m/s
    engine_power: float  # W


# BO 105 CB/CBS flight manual, charts read by eye: hover out of ground effect, and level flight (+-1.5 kt)
HOVER = PowerPoint("hover", 2448.0, 4000 * FOOT, 10.0, 0.0, 514e3)
CRUISE = PowerPoint("cruise", 2400.0, 0.0, 15.0, 127 * KNOT, 514e3)

POINTS = (HOVER, CRUISE)
POWERS = ("main_rotor_power", "tail_rotor_power")

TOLERANCE = 1e-7  # of power: what is left of a trim's own residual stays below

SPLITS = {
    "induced factor": ("induced_power_factor", "parasite_area"),
    "section drag level": ("section_drag_level", "parasite_area"),
}


def trim_at(
    point: PowerPoint,
    aircraft: Aircraft,
    constants: Mapping[str, float],
    *,
    fidelity: Fidelity | None = None,
    stalling_tail: bool = True,
    guess: Solution | None = None,
) -> tuple[ResidualSystem, Solution]:
    """The trim system of ``aircraft`` and its solution at ``point``, with the calibrated ``constants``."""
    system = trim_system(aircraft, fidelity or Fidelity(), stalling_tail=stalling_tail)
    flight = {
        "mass": point.mass,
        "altitude": point.altitude,
        "isa_offset": point.temperature + 273.15 - standard_air(point.altitude).temperature,
        "speed": point.speed,
        "climb_angle": 0.0,
        "load_factor": 1.0,
        "rotor_speed": aircraft.main_rotor.nominal_rotor_speed,
        "twist": aircraft.main_rotor.twist,
    }
    easy = {"mass": 0.5 * aircraft.loading.largest_mass}
    trim = find_trim(system, {**trim_parameters(aircraft, flight), **constants}, easy=easy, guess=guess)
    if not trim.success:
        raise NoSolutionError(f"calibration: {point.name}: {trim.reason or trim.solution.message}")
    return system, trim.solution


def rotor_power(solution: Solution) -> float:
    """Power of main and tail rotor [W]."""
    return sum(solution.outputs[name] for name in POWERS)


def available_power(aircraft: Aircraft, point: PowerPoint) -> float:
    """Power [W] left for the rotors of the engine power at ``point``."""
    drive = aircraft.transmission
    return (point.engine_power - 1e3 * drive.accessory_power) * drive.efficiency


def calibrate(
    aircraft: Aircraft, split: str, *, fidelity: Fidelity | None = None, stalling_tail: bool = True
) -> dict[str, float]:
    """The two constants of ``split`` that meet hover and cruise power, by Newton's method with exact derivatives.

    The third constant is as in ``aircraft``; a section drag level is solved with an induced-power factor of one. Raises
    :class:`NoSolutionError` where a point has no trim on the way or the powers can not be met.
    """
    names = SPLITS[split]
    constants = starting_constants(aircraft, split)
    targets = np.array([available_power(aircraft, point) for point in POINTS])
    last: list[Solution | None] = [None, None]
    for _ in range(20):
        residual, jacobian = np.zeros(2), np.zeros((2, 2))
        for i, point in enumerate(POINTS):
            system, solution = trim_at(
                point, aircraft, constants, fidelity=fidelity, stalling_tail=stalling_tail, guess=last[i]
            )
            last[i], slopes = solution, system.sensitivities(solution)
            residual[i] = rotor_power(solution) / targets[i] - 1
            jacobian[i] = [sum(slopes[power][name] for power in POWERS) / targets[i] for name in names]
        if np.max(np.abs(residual)) < TOLERANCE:
            return {name: constants[name] for name in names}
        step = np.linalg.solve(jacobian, -residual)
        for name, change in zip(names, step, strict=True):
            constants[name] += float(np.clip(change, -0.3 * constants[name], 0.3 * constants[name]))
    raise NoSolutionError(f"calibration: {split}: residual {residual} after 20 iterations")


def starting_constants(aircraft: Aircraft, split: str) -> dict[str, float]:
    """All calibrated constants as ``split`` leaves them before it solves its two."""
    constants = calibrated_constants(aircraft)
    return constants | {"induced_power_factor": 1.0} if split == "section drag level" else constants


def allowed_range(aircraft: Aircraft, name: str) -> tuple[float, float] | None:
    """Sourced range of a calibrated constant, None where the data gives none."""
    origins = {**aircraft.main_rotor.provenance, **aircraft.fuselage.provenance}
    return origins[name].range


def main() -> None:
    aircraft = load_aircraft("bo105")
    for split in SPLITS:
        print(f"{split}:")
        for name, value in calibrate(aircraft, split).items():
            allowed = allowed_range(aircraft, name)
            inside = allowed is None or allowed[0] <= value <= allowed[1]
            print(f"  {name:22s} {value:.6g}   range {allowed}   {'inside' if inside else 'OUTSIDE'}")


if __name__ == "__main__":
    main()
