"""Blade frequencies against rotor speed, and where they meet harmonics of the rotation.

    python problems/fan_plot.py [aircraft]

Draws problems/figures/fan_plot.png and prints the crossings between 75 and 115 % rotor speed. A rotor of N blades
passes to the airframe only what its blades do at multiples of N and one beside them: a schedule should not dwell where
a mode meets one of those. Frequencies are those of the pitched and twisted blade in vacuum.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from vrsopt.aircraft import MainRotor, load_aircraft
from vrsopt.report.plots import png
from vrsopt.report.style import BLACK, BLUE, GREEN, GREY, NORMAL, ORANGE, SMALL, VERMILION, new_figure, tidy
from vrsopt.rotor.blade_equations import BladeEquations
from vrsopt.rotor.blade_frequencies import Crossing, coupled_frequencies, crossings
from vrsopt.rotor.fidelity import Fidelity

FIGURE = Path(__file__).parent / "figures" / "fan_plot.png"
PITCH = np.radians(8.0)  # at 3/4 radius
RANGE = (75.0, 115.0)  # per cent rotor speed that schedules use
HIGHEST_ORDER = 9
HIGHEST = 6.6  # per nominal revolution, of the figure
CLOSE = 0.15  # per revolution: near enough to a harmonic to be told
SHOWN = ("flap1", "flap2", "flap3", "lag1", "lag2", "torsion1")
COLOURS = {"flap": BLUE, "lag": GREEN, "torsion": ORANGE}
# more modes than a trim has, for frequencies converged to 0.2 %
MODES = Fidelity(flap_modes=6, lag_modes=5, torsion_modes=2)


def frequencies(rotor: MainRotor, percent: np.ndarray, pitch: float, twist: float | None) -> np.ndarray:
    """Per nominal revolution, of the shown modes (n_speeds, n_modes), named after what they are at nominal speed.

    Coupled modes veer away from each other where uncoupled ones would cross, so a mode keeps its place in the order.
    """
    nominal = rotor.nominal_rotor_speed
    order = np.argsort(coupled_frequencies(rotor, MODES, nominal, pitch, twist))
    names = BladeEquations(rotor, MODES).names
    columns = [int(np.flatnonzero(order == names.index(name))[0]) for name in SHOWN]
    found = coupled_frequencies(rotor, MODES, percent / 100 * nominal, pitch, twist)
    return np.sort(found, axis=1)[:, columns] / nominal


def passed_on(order: int, blades: int) -> bool:
    """Whether blade loads of that harmonic reach the airframe."""
    return order > 1 and (order + 1) % blades <= 2


def draw(percent: np.ndarray, coupled: np.ndarray, flat: np.ndarray, found: list[Crossing], blades: int) -> Figure:
    figure = new_figure(7.0, 7.8)
    axes = figure.subplots()
    axes.axvspan(*RANGE, color=GREY, alpha=0.15, lw=0)
    for order in range(1, HIGHEST_ORDER + 1):
        important = passed_on(order, blades)
        axes.plot(percent, order * percent / 100, color=BLACK if important else GREY, lw=0.9 if important else 0.6)
        inside = order * percent[-1] / 100 < HIGHEST
        end = percent[-1] if inside else 100 * HIGHEST / order
        place = {"xytext": (3, -3)} if inside else {"xytext": (0, 3), "ha": "center"}
        axes.annotate(f"{order}/rev", (end, order * end / 100), textcoords="offset points", fontsize=SMALL, **place)
    for k, name in enumerate(SHOWN):
        colour = COLOURS[name.rstrip("0123456789")]
        axes.plot(percent, coupled[:, k], color=colour, lw=2)
        axes.plot(percent, flat[:, k], color=colour, lw=1, ls="--")
        axes.annotate(
            f"{name[:-1]} {name[-1]}",
            (percent[0], coupled[0, k]),
            (-3, 0),
            textcoords="offset points",
            fontsize=SMALL,
            ha="right",
            va="center",
            color=colour,
        )
    for crossing in found:
        place = crossing.rotor_speed
        axes.plot(
            place,
            crossing.order * place / 100,
            "o",
            ms=7,
            mfc="none",
            mec=VERMILION if passed_on(crossing.order, blades) else GREY,
            mew=1.5,
        )
    axes.set(xlim=(percent[0] - 5, percent[-1] + 4), ylim=(0, HIGHEST))
    axes.set_xlabel("rotor speed, % of nominal", fontsize=NORMAL)
    axes.set_ylabel("frequency per nominal revolution", fontsize=NORMAL)
    tidy(axes)
    axes.set_title(
        f"Blade frequencies: pitch {np.degrees(PITCH):.0f} deg at 3/4 radius, built-in twist; dashed: flat blade.\n"
        f"Shaded: rotor speeds of schedules, {RANGE[0]:.0f} to {RANGE[1]:.0f} %, with their crossings.\n"
        "Black lines, red circles: harmonics whose loads reach the airframe",
        fontsize=NORMAL,
        pad=16,
    )
    return figure


def main(aircraft: str) -> None:
    rotor = load_aircraft(aircraft).main_rotor
    percent = np.arange(70.0, 120.1, 1.0)
    coupled = frequencies(rotor, percent, PITCH, None)
    flat = frequencies(rotor.replaced(precone=0.0), percent, 0.0, 0.0)
    every = crossings(SHOWN, percent, 100 * coupled)
    found = [c for c in every if RANGE[0] <= c.rotor_speed <= RANGE[1] and c.order <= HIGHEST_ORDER]
    FIGURE.parent.mkdir(exist_ok=True)
    FIGURE.write_bytes(png(draw(percent, coupled, flat, found, rotor.blades)))
    print("mode      per rev  rotor speed %  reaches the airframe")
    for c in found:
        print(f"{c.mode:9s} {c.order:7d}  {c.rotor_speed:13.1f}  {'yes' if passed_on(c.order, rotor.blades) else 'no'}")
    print("\nclose without crossing, frequency over rotor speed:")
    inside = (percent >= RANGE[0]) & (percent <= RANGE[1])
    ratio = 100 * coupled[inside] / percent[inside, None]
    for k, name in enumerate(SHOWN):
        for order in range(1, HIGHEST_ORDER + 1):
            nearest = int(np.argmin(np.abs(ratio[:, k] - order)))
            crosses = any(c.mode == name and c.order == order for c in found)
            if abs(ratio[nearest, k] - order) < CLOSE and not crosses:
                print(f"{name:9s} {order:7d}  {percent[inside][nearest]:13.1f}  {ratio[nearest, k]:.3f}")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "bo105")
