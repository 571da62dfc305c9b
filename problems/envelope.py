"""Best rotor speed and twist over the flight envelope, written to problems/envelope.md with its figures.

    python problems/envelope.py

The maps of three strategies; what sets their features, a bound, a limit or extrapolation; what the manoeuvre margin
costs over the envelope and over the three missions. Some six minutes of CPU time.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from envelope_figures import bounds_figure, margin_figure
from envelope_margin import MARGINS, SCHEDULES, mission_savings
from page_table import table, write_below
from surrogate_data import DESIGNS, Points, read

import vrsopt
from vrsopt.aircraft import load_aircraft
from vrsopt.envelope_map import ACTIVE, Envelope
from vrsopt.helicopter import helicopter
from vrsopt.limits import Limits
from vrsopt.mission.conditions import Conditions
from vrsopt.report.envelope_plots import envelope_figures
from vrsopt.report.plots import png
from vrsopt.schedule.genetic import GeneticOptions, genetic_minimum
from vrsopt.schedule.rotor_tables import USED
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.surrogate_path import SurrogateAircraft
from vrsopt.surrogate.store import Surrogate

PAGE = Path(__file__).with_name("envelope.md")
MARKER = "<!-- tables: everything below is written by problems/envelope.py -->"
FIGURES = Path(__file__).with_name("figures")
STRATEGIES = {"both": "rotor speed and twist", "speed": "rotor speed only", "twist": "twist only"}
SHOWN = {
    "both": ("rotor_speed", "twist", "fuel_flow", "nox", "band", "active"),
    "speed": ("rotor_speed", "fuel_flow"),
    "twist": ("twist", "fuel_flow"),
}
FEWER = 12_000  # points of the repeated maps
CHECKED = 50  # points that NSGA-II searches too
NARROW = (0.80, 1.10)
NOMINAL = load_aircraft("bo105").main_rotor.nominal_rotor_speed
MEANS = ("rotor_speed_percent", "twist_deg", "fuel_flow_delta_percent", "nox_delta_percent")


def timed(action: Callable[[], Any]) -> tuple[Any, float]:
    begin = time.process_time()
    return action(), time.process_time() - begin


def draw(name: str, figure: Any) -> str:
    (FIGURES / f"{name}.png").write_bytes(png(figure))
    return f"![{name.replace('_', ' ')}](figures/{name}.png)"


def masses(found: Envelope) -> Mapping[str, Mapping[str, Any]]:
    return found.summary()["masses_kg"]


def means_table(cases: Mapping[str, Envelope]) -> Iterator[str]:
    """Means over the flyable points and shares of the time on nothing."""
    head = ("case", "mass kg", "flyable %", "nominal flyable %", "rotor speed %", "twist deg", "fuel %", "NOx %")
    rows = (
        (name, mass, f"{row['feasible_percent']:.1f}", f"{row['nominal_feasible_percent']:.1f}")
        + tuple(f"{row[f'mean_{mean}']:.2f}" for mean in MEANS)
        for name, found in cases.items()
        for mass, row in masses(found).items()
    )
    yield from table(head, rows)


def active_table(cases: Mapping[str, Envelope]) -> Iterator[str]:
    """Share of the flyable points whose optimum rests on each limit or bound; two of them may act at once."""
    rows = []
    for name, found in cases.items():
        for mass, row in masses(found).items():
            shares = row["active_percent"]
            rows.append((name, mass, *(f"{shares[one]:.1f}" for one in ACTIVE), f"{row['free_percent']:.1f}"))
    yield from table(("case", "mass kg", *ACTIVE, "free"), rows)


def genetic_check(found: Envelope) -> Iterator[str]:
    """NSGA-II at random flyable points of the maps."""
    maps = found.dataset.stack(point=("mass", "altitude", "speed"))
    flyable = np.flatnonzero(maps["feasible"].values == 1)
    maps = maps.isel(point=np.sort(np.random.default_rng(1).choice(flyable, CHECKED, replace=False)))
    machine = helicopter()
    limits = Limits(machine.aircraft, machine.engine, "manual", float(found.dataset.attrs["manoeuvre_margin"]))
    make = SurrogateAircraft(vrsopt.load_surrogate("level"), limits)
    model = make(Conditions.level(maps["speed"].values, maps["altitude"].values))
    variables = found.dataset.attrs["free_variables"]
    box = ScheduleSettings().restricted(variables).box(model.bounds)
    (best, generations), seconds = timed(lambda: genetic_minimum(model, maps["mass"].values, box=box))
    more = 100.0 * (best.fuel_flow / maps["fuel_flow_kg_s"].values - 1.0)
    turned = np.abs(100.0 * best.rotor_speed / NOMINAL - maps["rotor_speed_percent"].values)
    twisted = np.abs(np.degrees(best.twist) - maps["twist_deg"].values)
    capped = int(np.sum(generations >= GeneticOptions().most_generations))
    off = f"{more.max():+.5f} | {more.min():+.5f} | {turned.max():.2f} | {twisted.max():.2f}"
    yield f"| {STRATEGIES[variables]} | {off} | {generations.mean():.0f} | {capped} | {seconds / CHECKED:.2f} |"


def narrow_surrogate() -> Surrogate:
    """The shipped surrogate fitted again to those rows of its design whose rotor speed is in the narrow range."""
    points, shipped = read(DESIGNS["level"]), vrsopt.load_surrogate("level")
    ratio = points.column("rotor_speed") / NOMINAL
    kept = (ratio >= NARROW[0]) & (ratio <= NARROW[1])
    fewer = Points(points.meta, points.inputs[kept], points.outputs[kept], points.derivatives[kept], points.status)
    models = {name: fewer.kriging().fit(*fewer.known(name)) for name in USED}
    return replace(shipped, models={**shipped.models, **models}, samples=int(kept.sum()))


def extrapolated_table(wide: Envelope, outside: Envelope) -> Iterator[str]:
    """What the extrapolating surrogate promises against the one that knows, beyond its design and inside."""
    rows = []
    for mass in wide.dataset["mass"].values:
        own, other = (case.dataset.sel(mass=mass) for case in (outside, wide))
        beyond = own["rotor_speed_percent"] < 100.0 * NARROW[0]
        known = (own["feasible"] == 1) & (other["feasible"] == 1)
        for words, here in (("beyond the design", beyond & known), ("inside", ~beyond & known)):
            if not here.any():
                rows.append((f"{mass:g}", words, "0.0", "", ""))
                continue
            off = [
                np.abs((own[name] - other[name]).values[here.values])
                for name in ("rotor_speed_percent", "fuel_flow_delta_percent")
            ]
            rows.append(
                (
                    f"{mass:g}",
                    words,
                    f"{100.0 * float(here.mean()):.1f}",
                    f"{off[0].mean():.2f} / {off[0].max():.2f}",
                    f"{off[1].mean():.2f} / {off[1].max():.2f}",
                )
            )
    head = (
        "mass kg",
        "optimum",
        "share of points %",
        "rotor speed off by, % mean / max",
        "saving off by, % mean / max",
    )
    yield from table(head, rows)


def margins(saved: Mapping[str, Mapping[float, Mapping[str, float]]]) -> Iterator[str]:
    rows = (
        (mission, f"{margin:g}", *(f"{row[name]:+.2f}" for name in SCHEDULES), f"{row['on_margin_percent']:.0f}")
        for mission, by_margin in saved.items()
        for margin, row in by_margin.items()
    )
    names = (f"{name} %" for name in SCHEDULES)
    yield from table(("mission", "manoeuvre margin", *names, "trajectory on the blade loading, % of time"), rows)


def lines() -> Iterator[str]:
    """Everything below the marker; draws the figures."""
    yield "\n## Three strategies\n"
    cases: dict[str, Envelope] = {}
    seconds = 0.0
    for variables, words in STRATEGIES.items():
        cases[words], cpu = timed(partial(vrsopt.envelope, variables=variables))
        seconds += cpu
        for name, figure in envelope_figures(cases[words].dataset).items():
            if name in SHOWN[variables]:
                yield draw(f"envelope_{variables}_{name}", figure) + "\n"
    found = next(iter(cases.values()))
    yield f"{found.points} operating points each, {seconds:.0f} s of CPU time for all. Means over flyable points.\n"
    yield from means_table(cases)
    yield from active_table(cases)
    yield f"NSGA-II at {CHECKED} random flyable points, fuel flow against that of the map:\n"
    yield "| strategy | most % | least % | rotor speed off % | twist off deg | generations | at the cap | CPU s each |"
    yield "|" + "---|" * 8
    for found in cases.values():
        yield from genetic_check(found)
    yield "\n## Bound, limit or extrapolation\n"
    narrow = narrow_surrogate()
    bounds = (NARROW[0] * NOMINAL, NARROW[1] * NOMINAL)
    ranges = {
        "75 to 115 %": vrsopt.envelope(points=FEWER),
        "80 to 110 %": vrsopt.envelope(points=FEWER, rotor_speed_bounds=bounds),
        "75 to 115 %, design of 80 to 110 %": vrsopt.envelope(narrow, points=FEWER),
    }
    yield draw("envelope_bounds", bounds_figure(ranges)) + "\n"
    yield f"The narrow design has {narrow.samples} of the points. Maps of {ranges['75 to 115 %'].points} points.\n"
    yield from means_table(ranges)
    yield from active_table(ranges)
    yield from extrapolated_table(*(list(ranges.values())[k] for k in (0, 2)))
    yield "## What the manoeuvre margin costs\n"
    by_margin = {f"{margin:g}": vrsopt.envelope(points=FEWER, manoeuvre_margin=margin) for margin in MARGINS}
    yield from means_table(by_margin)
    yield from active_table(by_margin)
    saved = mission_savings()
    yield draw("margin_savings", margin_figure(by_margin, saved)) + "\n"
    yield from margins(saved)


def main(arguments: Sequence[str] | None = None) -> None:
    if arguments or sys.argv[1:]:
        raise SystemExit("usage: python problems/envelope.py")
    begin = time.process_time()
    text = "\n".join(lines()).rstrip()
    write_below(MARKER, PAGE, f"{text}\n", title="The flight envelope")
    print(text)
    print(f"{time.process_time() - begin:.0f} s of CPU time", file=sys.stderr)


if __name__ == "__main__":
    main()
