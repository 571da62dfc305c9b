"""Set the model against what is known, and write the comparison to problems/validation.md.

    python problems/validation.py [deck.npz [dynstall.npz]]

Everything is reported as it falls; only what the page calls calibrated was fitted. ``deck.npz`` is a NACA 23012 section
deck (arrays c81_alpha_cl, c81_mach_cl, c81_cl and the same for cd); without it the section's fit error is left out.
``dynstall.npz`` holds measured loops of oscillating sections (problems/dynamic_stall.py); if it is not given, a file of
that name beside the deck is taken, and without one that table is left out.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import convergence
import numpy as np
import validation_engine
import validation_rotor
from page_table import table
from surrogate_data import DESIGNS, OURS, STUDY, fitted, read

from vrsopt.aircraft import load_aircraft
from vrsopt.schedule.compare import solve
from vrsopt.surrogate.validation import leave_one_out

HERE = Path(__file__).parent


def section(deck: Path) -> Iterator[str]:
    yield "Section against the deck it was fitted to, rms error (attached: -4 to 10 deg):\n"
    airfoil = load_aircraft().main_rotor.section
    with np.load(deck) as data:
        content = {name: data[name] for name in data.files if name.startswith("c81_")}
    rows = []
    for mach in (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8):
        row: list[object] = [mach]
        for k, name in enumerate(("cl", "cd")):
            alpha = content[f"c81_alpha_{name}"]
            column = int(np.argmin(np.abs(content[f"c81_mach_{name}"] - mach)))
            low, high = (-15.0, 19.0) if name == "cl" else (-8.0, 19.0)
            for first, last in ((-4.0, 10.0), (low, high)):
                chosen = (alpha >= first) & (alpha <= last)
                a = np.radians(alpha[chosen])
                level = airfoil.drag_reference
                model = [float(airfoil.coefficients(np.sin(x), np.cos(x), mach, level)[k]) for x in a]
                error = np.array(model) - content[f"c81_{name}"][chosen, column]
                row.append(f"{np.sqrt(np.mean(error**2)):.4f}")
        rows.append(row)
    yield from table(("Mach", "lift, attached", "lift, -15 to 19 deg", "drag, attached", "drag, -8 to 19 deg"), rows)


def engine() -> Iterator[str]:
    yield "## Engine\n"
    for part in (
        validation_engine.consumption,
        validation_engine.free_turbine,
        validation_engine.similarity,
        validation_engine.robustness,
        validation_engine.emissions,
    ):
        yield from part()


def surrogate() -> Iterator[str]:
    yield "## Surrogate\n"
    sets = {"flyable": read(DESIGNS["level"]), "converged": read(DESIGNS["level"], flyable=False)}
    rows = []
    for correlation in (OURS, STUDY):
        for label, points in sets.items():
            a = leave_one_out(fitted(points, "fuel_flow", correlation)[0])
            rows.append(
                (
                    correlation,
                    label,
                    f"{a.pearson_percent:.3f}",
                    f"{a.slope_deg:.3f}",
                    f"{a.mean_abs_error_percent:.3f}",
                    f"{a.rms_error_percent:.3f}",
                )
            )
    points = sum(sets["flyable"].status.values())
    counts = f"{points} points, {len(sets['flyable'])} flyable, {len(sets['converged'])} converged"
    yield f"Leave-one-out of the fuel flow; {counts}:\n"
    yield from table(("correlation", "points", "Pearson %", "slope deg", "mean abs. error %", "rms error %"), rows)


def mission() -> Iterator[str]:
    yield "## Rescue mission\n"
    result = solve(HERE / "sarm.toml")
    rows = []
    for name, figures in result.summary()["schedules"].items():
        rate = figures["max_rotor_speed_rate_percent_s"]
        rows.append(
            (
                name,
                f"{figures['fuel_kg']:.2f}",
                f"{figures['fuel_delta_percent']:+.2f}",
                f"{figures['fuel_delta_closed_percent']:+.2f}",
                f"{figures['fuel_physics_kg']:.2f}",
                f"{figures['fuel_physics_delta_percent']:+.2f}",
                "jumps" if rate is None else f"{rate:.3f}",
                f"{figures['time_on_limits_percent']['blade loading']:.0f}",
            )
        )
    header = (
        "schedule",
        "fuel kg",
        "delta %",
        "delta, mass closed %",
        "physics kg",
        "delta %",
        "largest rate %/s",
        "time on blade loading %",
    )
    yield from table(header, rows)


def rotor(deck: Path | None, loops: Path | None) -> Iterator[str]:
    yield "## Rotor and trim\n"
    for part in (validation_rotor.key_figures, validation_rotor.frequencies, validation_rotor.flight_test):
        yield from part()
    if deck is not None:
        yield from section(deck)
    if loops is not None:
        yield from validation_rotor.stall(loops)
    for part in (validation_rotor.isolated, validation_rotor.ground, validation_rotor.power_balance):
        yield from part()


def numbers() -> Iterator[str]:
    yield "## Convergence and derivatives\n"
    for part in (convergence.resolution, convergence.inflow, convergence.modes, convergence.derivatives):
        yield from part()


def main() -> None:
    files = [Path(argument) for argument in sys.argv[1:3]]
    deck = files[0] if files else None
    beside = deck.with_name("dynstall.npz") if deck else None
    loops = files[1] if len(files) > 1 else beside if beside and beside.exists() else None
    lines = [
        "# Validation\n",
        "Written by `python problems/validation.py deck.npz`: every number below comes from a run of it.\n",
        *rotor(deck, loops),
        *numbers(),
    ]
    for part in (engine, surrogate, mission):
        lines += part()
    (HERE / "validation.md").write_text("\n".join(lines))
    print(*lines, sep="\n")


if __name__ == "__main__":
    main()
