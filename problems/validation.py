"""Set the model against what is known, and write the comparison to problems/validation.md.

    python problems/validation.py [deck.npz]

Everything is reported as it falls; only what the page calls calibrated was fitted. ``deck.npz`` is a NACA 23012 section
deck (arrays c81_alpha_cl, c81_mach_cl, c81_cl and the same for cd); without it the section's fit error is left out.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

import vrsopt
from vrsopt.aircraft import load_aircraft
from vrsopt.rotor.blade import flap_modes
from vrsopt.schedule.compare import solve
from vrsopt.surrogate.training import fit

HERE = Path(__file__).parent
KNOT = 1852 / 3600  # m/s

# DLR Bo 105 S123, about 2200 kg, sea level; G. D. Padfield, Helicopter Flight Dynamics, figures 4.6 to 4.11, digitised.
# Whether the power is the engines' or the rotor's is not resolved: both readings are tabulated.
FLIGHT_POWER = {
    4.02: 393.0,
    11.68: 333.3,
    20.42: 308.0,
    33.05: 246.8,
    45.87: 217.3,
    58.92: 229.8,
    77.86: 264.8,
    99.22: 351.7,
}
FLIGHT_PITCH = {0.1: 2.71, 15.7: 2.58, 26.6: 3.23, 48.1: 0.12, 59.4: -0.66, 77.9: -2.27, 95.8: -4.34}
# Beam of the scaled HART II blade, per nominal revolution, at 100 and 85 % rotor speed
FLAP_FREQUENCIES = {1.0: (1.1155, 2.8121, 4.9908), 0.85: (0.957, 2.444, 4.453)}


def table(header: Iterable[str], rows: Iterable[Iterable[object]]) -> Iterator[str]:
    names = list(header)
    yield "| " + " | ".join(names) + " |"
    yield "|" + "---|" * len(names)
    for row in rows:
        yield "| " + " | ".join(str(cell) for cell in row) + " |"
    yield ""


def trim_power(speed: float) -> vrsopt.OperatingPoint:
    return vrsopt.trim(2200.0, speed, method="newton")


def rotor() -> Iterator[str]:
    yield "## Rotor and trim\n"
    hover = trim_power(0.0)
    speeds = np.arange(20.0, 45.0, 0.5)
    power = [p.main_rotor_power + p.tail_rotor_power for p in map(trim_power, speeds)]
    yield from table(
        ("quantity", "model", "reference"),
        [
            ("figure of merit, hover, 2200 kg, sea level", f"{hover.figure_of_merit:.3f}", "0.60 to 0.78"),
            ("speed of least power, 2200 kg", f"{speeds[int(np.argmin(power))]:.1f} m/s", "28 to 36 m/s"),
        ],
    )
    blade = load_aircraft().main_rotor.blade
    modes = flap_modes(blade, rotor_speed=44.4)
    rows = []
    for ratio, reference in FLAP_FREQUENCIES.items():
        found = modes.frequencies(ratio * 44.4) / 44.4
        rows += [
            (f"{100 * ratio:.0f} %", i + 1, f"{f:.4f}", r, f"{100 * (f / r - 1):+.2f} %")
            for i, (f, r) in enumerate(zip(found, reference, strict=True))
        ]
    yield "Flap frequencies per nominal revolution, fixed Ritz basis:\n"
    yield from table(("rotor speed", "mode", "model", "beam", "difference"), rows)
    yield "Level-flight power against flight test (not a target: the source does not say which power it is):\n"
    rows = []
    for knots, measured in FLIGHT_POWER.items():
        point = trim_power(knots * KNOT)
        main, engines = point.main_rotor_power / 1e3, 2 * point.shaft_power_per_engine / 1e3
        rows.append(
            (
                knots,
                measured,
                f"{main:.0f}",
                f"{100 * (main / measured - 1):+.0f} %",
                f"{engines:.0f}",
                f"{100 * (engines / measured - 1):+.0f} %",
            )
        )
    yield from table(("speed kt", "flight test kW", "main rotor kW", "difference", "engines kW", "difference"), rows)
    yield "Pitch attitude against flight test:\n"
    rows = []
    for knots, measured in FLIGHT_PITCH.items():
        model = np.degrees(trim_power(knots * KNOT).pitch)
        rows.append((knots, measured, f"{model:.2f}", f"{model - measured:+.2f}"))
    yield from table(("speed kt", "flight test deg", "model deg", "difference deg"), rows)


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
    rated, manual = vrsopt.engine(313e3), vrsopt.engine(257e3, mach=131.5 * KNOT / 340.3)
    part = vrsopt.engine(0.698 * 313e3)
    rows = [
        ("SFC at 313 kW, sea level static", f"{rated.sfc_kg_kwh:.4f} kg/kWh", "0.395 (calibration: design point)"),
        (
            "fuel at 257 kW, 131.5 kt",
            f"{3600 * manual.fuel_flow_kg_s:.1f} kg/h",
            "102 ± 1 (flight manual); see problems/calibrate_engine.py",
        ),
        ("SFC at 69.8 % over SFC at full power", f"{part.sfc_kg_kwh / rated.sfc_kg_kwh:.3f}", "1.098 (250-B17F)"),
    ]
    yield from table(("quantity", "model", "reference"), rows)


def surrogate() -> Iterator[str]:
    yield "## Surrogate\n"
    design = Path(vrsopt.__file__).parent / "data" / "design.db"
    rows = []
    for correlation in ("squared_exponential", "exponential"):
        result = fit(design, correlation=correlation)
        for points, figures in (("flyable", result.flyable_accuracy), ("converged", result.converged_accuracy)):
            a = figures["fuel_flow"]
            rows.append(
                (
                    correlation,
                    points,
                    f"{a.pearson_percent:.3f}",
                    f"{a.slope_deg:.3f}",
                    f"{a.mean_abs_error_percent:.3f}",
                    f"{a.rms_error_percent:.3f}",
                )
            )
    counts = f"{result.samples} points, {result.flyable} flyable, {result.converged} converged"
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


def main() -> None:
    deck = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    lines = [
        "# Validation\n",
        "Written by `python problems/validation.py deck.npz`: every number below comes from a run of it.\n",
    ]
    lines += rotor()
    if deck is not None:
        lines += section(deck)
    for part in (engine, surrogate, mission):
        lines += part()
    (HERE / "validation.md").write_text("\n".join(lines))
    print(*lines, sep="\n")


if __name__ == "__main__":
    main()
