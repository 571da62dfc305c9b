"""Calibrate rotor and airframe on the two power points of the flight manual, with the model itself.

    python problems/calibrate_rotor.py

Hover and cruise power give two constants. Two points cannot tell profile from induced power, so both splits are solved:
the induced-power factor and the parasite area with the section drag at its assumed level (the default), and the section
drag level and the parasite area with an induced-power factor of one. Transmission efficiency, accessory power and
download are assumed and fixed before. A solved constant outside its range is not used: the data file keeps the sourced
value, and this script prints both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vrsopt.aircraft import Aircraft, load_aircraft
from vrsopt.atmosphere import standard_air
from vrsopt.equilibrium import calibrated_constants, trim_system
from vrsopt.errors import NoSolutionError

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

SPLITS = {
    "induced factor": ("induced_power_factor", "parasite_area"),
    "section drag level": ("section_drag_level", "parasite_area"),
}


def rotor_power(aircraft: Aircraft, point: PowerPoint, constants: dict[str, float]) -> tuple[float, dict[str, float]]:
    """Main and tail rotor power [W] of a trim at ``point``, and its exact derivatives by the constants."""
    system = trim_system(aircraft)
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
    solution = system.solve({**flight, **constants}, method="newton")
    if not solution.success:
        raise NoSolutionError(f"calibration: {point.name}: {solution.message}")
    slopes = system.sensitivities(solution)
    names = ("main_rotor_power", "tail_rotor_power")
    return sum(solution.outputs[n] for n in names), {c: sum(slopes[n][c] for n in names) for c in constants}


def available_power(aircraft: Aircraft, point: PowerPoint) -> float:
    """Power [W] left for the rotors of the engine power at ``point``."""
    drive = aircraft.transmission
    return (point.engine_power - 1e3 * drive.accessory_power) * drive.efficiency


def calibrate(aircraft: Aircraft, split: str) -> dict[str, float]:
    """The two constants of ``split`` that meet hover and cruise power, by Newton's method with exact derivatives."""
    names = SPLITS[split]
    constants = calibrated_constants(aircraft)
    if split == "section drag level":
        constants["induced_power_factor"] = 1.0
    for _ in range(20):
        residual, jacobian = np.zeros(2), np.zeros((2, 2))
        for i, point in enumerate((HOVER, CRUISE)):
            power, slopes = rotor_power(aircraft, point, constants)
            target = available_power(aircraft, point)
            residual[i] = power / target - 1
            jacobian[i] = [slopes[name] / target for name in names]
        if np.max(np.abs(residual)) < 1e-9:
            return {name: constants[name] for name in names}
        step = np.linalg.solve(jacobian, -residual)
        for name, change in zip(names, step, strict=True):
            constants[name] += float(np.clip(change, -0.3 * constants[name], 0.3 * constants[name]))
    raise NoSolutionError(f"calibration: {split}: residual {residual} after 20 iterations")


def main() -> None:
    aircraft = load_aircraft("bo105")
    origins = {**aircraft.main_rotor.provenance, **aircraft.fuselage.provenance}
    for split in SPLITS:
        print(f"{split}:")
        for name, value in calibrate(aircraft, split).items():
            allowed = origins[name].range
            inside = allowed is None or allowed[0] <= value <= allowed[1]
            print(f"  {name:22s} {value:.6g}   range {allowed}   {'inside' if inside else 'OUTSIDE'}")


if __name__ == "__main__":
    main()
