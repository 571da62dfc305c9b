"""Set the model against what is known, and write the comparison to problems/validation.md.

    python problems/validation.py deck.npz dynstall.npz

Everything is reported as it falls; only what the page calls calibrated was fitted. Numbers come from functions that
tests/test_validation_page.py and tests/schedule/test_rescue_mission.py call too, to hold them to their bounds and the
page to them. ``deck.npz`` is a NACA 23012 section deck (arrays c81_alpha_cl, c81_mach_cl, c81_cl and the same for cd);
``dynstall.npz`` holds measured loops of oscillating sections (problems/dynamic_stall.py). Without these files
their tables are left out, and the rest is printed and not written. Needs Cantera, which the tests need too.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import convergence
import validation_engine
import validation_gas
import validation_isolated
import validation_rotor
from page_table import table
from surrogate_data import DESIGNS, OURS, STUDY, fitted, read
from validation_summary import summary

from vrsopt.schedule.compare import solve
from vrsopt.schedule.comparison import Comparison
from vrsopt.surrogate.validation import Accuracy, leave_one_out

HERE = Path(__file__).parent
PAGE = HERE / "validation.md"
HEAD = """# Validation

Written by `python problems/validation.py deck.npz dynstall.npz`. `pytest tests/test_validation_page.py
tests/schedule/test_rescue_mission.py` computes the numbers again by the same functions, looks them up here and holds
those with a target to it, but for the misses, which are marked. Not computed again are convergence and derivatives,
whose bounds are checked on this page, leave-one-out over all converged points, and the benchmarks of the first table,
read from what they printed last (`tests/benchmarks/*.json`), with this model and its data.
"""
Part = Callable[[], Iterator[str]]

ENGINE: tuple[Part, ...] = (
    validation_engine.consumption_table,
    validation_engine.free_turbine_table,
    validation_engine.similarity_table,
    validation_engine.robustness_table,
    validation_gas.gas_table,
    validation_engine.emissions_table,
)
NUMBERS: tuple[Part, ...] = (
    convergence.resolution,
    convergence.inflow,
    convergence.modes,
    convergence.derivatives,
)


def rotor(deck: Path | None, loops: Path | None) -> Iterator[str]:
    for part in (
        validation_rotor.key_figures_table,
        validation_rotor.frequencies_table,
        validation_rotor.flight_test_tables,
    ):
        yield from part()
    if deck is not None:
        yield from validation_isolated.section_table(deck)
    if loops is not None:
        yield from validation_isolated.stall_table(loops)
    for part in (
        validation_isolated.isolated_tables,
        validation_rotor.near_ground_table,
        validation_rotor.power_balance_table,
    ):
        yield from part()


# -- surrogate, mission ------------------------------------------------------------------------------------------------


class LeftOut(NamedTuple):
    """Leave-one-out of the fuel flow with a correlation, over the flyable or all converged points."""

    correlation: str
    flyable: bool
    accuracy: Accuracy


def left_out(correlation: str, *, flyable: bool) -> LeftOut:
    points = read(DESIGNS["level"], flyable=flyable)
    return LeftOut(correlation, flyable, leave_one_out(fitted(points, "fuel_flow", correlation)[0]))


def left_out_rows(found: list[LeftOut]) -> Iterator[tuple[str, ...]]:
    for one in found:
        a = one.accuracy
        numbers = a.pearson_percent, a.slope_deg, a.mean_abs_error_percent, a.rms_error_percent
        yield one.correlation, "flyable" if one.flyable else "converged", *(f"{number:.3f}" for number in numbers)


def counts() -> str:
    """Points of the shipped design."""
    flyable, converged = (len(read(DESIGNS["level"], flyable=flyable)) for flyable in (True, False))
    points = sum(read(DESIGNS["level"]).status.values())
    return f"{points} points, {flyable} flyable, {converged} converged"


def surrogate() -> Iterator[str]:
    found = [left_out(correlation, flyable=flyable) for correlation in (OURS, STUDY) for flyable in (True, False)]
    yield f"Leave-one-out of the fuel flow; {counts()}:\n"
    header = ("correlation", "points", "Pearson %", "slope deg", "mean abs. error %", "rms error %")
    yield from table(header, left_out_rows(found))


def mission_rows(result: Comparison) -> Iterator[tuple[str, ...]]:
    """One row for each schedule of the rescue mission."""
    for name, figures in result.summary()["schedules"].items():
        rate = figures["max_rotor_speed_rate_percent_s"]
        yield (
            name,
            f"{figures['fuel_kg']:.2f}",
            f"{figures['fuel_delta_percent']:+.2f}",
            f"{figures['fuel_delta_closed_percent']:+.2f}",
            f"{figures['fuel_physics_kg']:.2f}",
            f"{figures['fuel_physics_delta_percent']:+.2f}",
            "jumps" if rate is None else f"{rate:.3f}",
            f"{figures['time_on_limits_percent']['blade loading']:.0f}",
        )


def mission() -> Iterator[str]:
    header = ("schedule", "fuel kg", "delta %", "delta, mass closed %", "physics kg", "delta %", "largest rate %/s")
    yield from table((*header, "time on blade loading %"), mission_rows(solve(HERE / "sarm.toml")))


def main() -> None:
    deck, loops = (Path(sys.argv[k]) if len(sys.argv) > k else None for k in (1, 2))
    lines = [
        HEAD,
        "## In short\n",
        *summary(loops),
        "## Rotor and trim\n",
        *rotor(deck, loops),
        "## Convergence and derivatives\n",
        *(line for part in NUMBERS for line in part()),
        "## Engine\n",
        *(line for part in ENGINE for line in part()),
        "## Surrogate\n",
        *surrogate(),
        "## Rescue mission\n",
        *mission(),
    ]
    print(*lines, sep="\n")
    if deck is None or loops is None:
        print(f"{PAGE.name} is not written: it takes deck.npz and dynstall.npz", file=sys.stderr)
    else:
        PAGE.write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
