"""Level flight over speed: controls, attitude, where the power goes, margins; with flight test where there is any.

    python problems/level_flight.py [--mass 2200] [--altitude 0] [--rotor-speed-percent 100] [--out figure.png]

Prints a table and draws problems/figures/level_flight.png.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

import vrsopt
from vrsopt.console import check_file
from vrsopt.errors import InputError, NoSolutionError
from vrsopt.report.plots import png
from vrsopt.report.style import BLACK, BLUE, GREEN, NORMAL, ORANGE, PURPLE, SKY, SMALL, VERMILION, new_figure, tidy
from vrsopt.rotor_fields import retreating_angle, rotor_map

KNOT = 1852 / 3600  # m/s
SPEEDS = np.arange(0.0, 71.0, 5.0)
FIGURE = Path(__file__).with_name("figures") / "level_flight.png"
LOOKS = ((BLUE, "-"), (ORANGE, "--"), (GREEN, "-."), (PURPLE, ":"), (SKY, (0, (5, 1, 1, 1, 1, 1))), (VERMILION, "-"))

# Padfield, Helicopter Flight Dynamics, figures 4.6 and 4.10: DLR flight test, about 2200 kg at sea level; speed in kt.
# The source does not say whether the power is the engines' or the main rotor's.
TEST_POWER = (
    (4.02, 6.34, 8.19, 11.68, 20.42, 21.69, 26.5, 33.05, 45.87, 58.92, 68.74, 77.86, 99.22),
    (393.0, 379.6, 345.2, 333.3, 308.0, 282.7, 270.7, 246.8, 217.3, 229.8, 236.1, 264.8, 351.7),
)
TEST_PITCH = (
    (0.1, 4.94, 8.0, 15.7, 17.1, 26.6, 38.6, 48.1, 59.4, 67.1, 77.9, 95.8),
    (2.71, 2.86, 2.43, 2.58, 3.15, 3.23, -0.21, 0.12, -0.66, -1.88, -2.27, -4.34),
)


def sweep(mass: float, altitude: float, rotor_speed: float) -> list[vrsopt.OperatingPoint]:
    """Trimmed points over ``SPEEDS``; those without trim are left out and told on standard error.

    Raises :class:`NoSolutionError` when none has a trim.
    """
    points = [vrsopt.trim(mass, v, altitude=altitude, rotor_speed=rotor_speed, method="newton") for v in SPEEDS]
    lost = [f"{v:g}" for v, point in zip(SPEEDS, points, strict=True) if not point.success]
    if len(lost) == len(points):
        raise NoSolutionError(f"level flight: no trim from {SPEEDS[0]:g} to {SPEEDS[-1]:g} m/s: {points[0].message}")
    if lost:
        print(f"no trim, left out: {', '.join(lost)} m/s", file=sys.stderr)
    return [point for point in points if point.success]


def draw(axes: Axes, speed: list[float], curves: dict[str, list[float]], words: str) -> None:
    for (name, values), (colour, line) in zip(curves.items(), LOOKS, strict=False):
        axes.plot(speed, values, color=colour, ls=line, lw=1.7, label=name)
    axes.set_ylabel(words, fontsize=NORMAL)
    axes.set_xlabel("true airspeed, m/s", fontsize=SMALL)
    if len(curves) > 1:
        axes.legend(fontsize=SMALL, frameon=False, handlelength=3.0)
    tidy(axes)


def main() -> None:
    parser = argparse.ArgumentParser(description="Level flight over speed.")
    parser.add_argument("--mass", type=float, default=2200.0, help="kg")
    parser.add_argument("--altitude", type=float, default=0.0, help="m")
    parser.add_argument("--rotor-speed-percent", type=float, default=100.0)
    parser.add_argument("--out", type=Path, default=FIGURE)
    arguments = parser.parse_args()
    rotor = vrsopt.load_aircraft().main_rotor
    rotor_speed = arguments.rotor_speed_percent / 100.0 * rotor.nominal_rotor_speed
    try:
        check_file(arguments.out)
        points = sweep(arguments.mass, arguments.altitude, rotor_speed)
    except (InputError, NoSolutionError) as error:
        print(f"error: {error}", file=sys.stderr)
        raise SystemExit(2) from None
    speed = [point.solution.parameters["speed"] for point in points]
    angles = [math.degrees(retreating_angle(rotor_map(point))) for point in points]

    def degrees(name: str) -> list[float]:
        return [math.degrees(getattr(point, name)) for point in points]

    figure = new_figure(11.0, 13.0)
    axes = figure.subplots(4, 2)
    controls = ("collective", "lateral_cyclic", "longitudinal_cyclic", "tail_collective")
    draw(axes[0, 0], speed, {name.replace("_", " "): degrees(name) for name in controls}, "controls, deg")
    draw(axes[0, 1], speed, {"pitch": degrees("pitch"), "roll": degrees("roll")}, "attitude, deg")
    shaft = [1e-3 * (point.main_rotor_power + point.tail_rotor_power) for point in points]
    split = {name: [1e-3 * point.powers[name] for point in points] for name in points[0].powers if name != "climb"}
    draw(axes[1, 0], speed, {"both rotors": shaft} | split, "power, kW")
    axes[1, 0].set_ylim(0.0, 1.35 * max(shaft))  # room for the legend
    margins = {name: [100 * point.margins[name] for point in points] for name in points[0].margins}
    draw(axes[1, 1], speed, margins, "left to the limit, %")
    axes[1, 1].axhline(0.0, color=BLACK, linewidth=0.8)
    axes[1, 1].legend(fontsize=SMALL, frameon=False, ncols=2, loc="lower left", handlelength=3.0)
    axes[1, 1].set_ylim(bottom=-60.0)  # room for the legend
    mach, one = "Mach number of the advancing tip", "left to the rating of one engine,\nthe other out, kW"
    draw(axes[2, 0], speed, {mach: [point.advancing_tip_mach for point in points]}, mach)
    draw(axes[2, 1], speed, {"angle": angles}, "largest angle of attack\non the retreating side, deg")
    draw(axes[3, 0], speed, {one: [1e-3 * point.one_engine_inoperative_margin for point in points]}, one)
    axes[3, 0].axhline(0.0, color=BLACK, linewidth=0.8)
    moments = {
        "pitch": [1e-3 * point.hub_pitch_moment for point in points],
        "roll": [1e-3 * point.hub_roll_moment for point in points],
    }
    draw(axes[3, 1], speed, moments, "hub moment, kN m")
    if (arguments.mass, arguments.altitude, arguments.rotor_speed_percent) == (2200.0, 0.0, 100.0):
        axes[0, 1].plot(np.multiply(TEST_PITCH[0], KNOT), TEST_PITCH[1], "k.", label="pitch, flight test")
        axes[1, 0].plot(np.multiply(TEST_POWER[0], KNOT), TEST_POWER[1], "k.", label="flight test")
        for ax in (axes[0, 1], axes[1, 0]):
            ax.legend(fontsize=SMALL, frameon=False, ncols=2 if ax is axes[1, 0] else 1, handlelength=3.0)
    arguments.out.write_bytes(png(figure))
    print(
        f"{'speed m/s':>9}{'rotors kW':>11}{'fuel kg/h':>11}{'collective':>12}{'pitch deg':>11}{'retreating deg':>16}"
    )
    for point, v, angle in zip(points, speed, angles, strict=True):
        rotors = 1e-3 * (point.main_rotor_power + point.tail_rotor_power)
        print(
            f"{v:9.0f}{rotors:11.1f}{3600 * point.fuel_flow:11.1f}{math.degrees(point.collective):12.2f}"
            f"{math.degrees(point.pitch):11.2f}{angle:16.1f}"
        )


if __name__ == "__main__":
    main()
