"""What came out, in words and numbers: the table of schedules and the lines below it."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rich import box
from rich.console import Console, Group
from rich.table import Table
from rich.text import Text

from vrsopt.report.account_tables import ACCOUNT_HEADINGS, ACCOUNT_LEGEND, account_rows, steps_line
from vrsopt.report.emission_tables import (
    EMISSION_HEADINGS,
    EMISSION_LEGEND,
    PHASE_HEADINGS,
    PHASE_LEGEND,
    emission_rows,
    foca_line,
    foremost,
    label,
    number,
    phase_rows,
)
from vrsopt.report.saving_band import band_sentence
from vrsopt.report.saving_tables import SAVING_HEADINGS, SAVING_LEGEND, foremost_saving, saving_rows
from vrsopt.schedule.advantage import advantage
from vrsopt.schedule.comparison import SIMPLIFICATIONS
from vrsopt.schedule.task_summary import KindShare, kind_shares

if TYPE_CHECKING:
    from vrsopt.schedule.comparison import Comparison, ScheduleResult

HEADINGS = (
    "schedule",
    "fuel kg",
    "change %",
    "closed %",
    "physics kg",
    "change %",
    "CO2 kg",
    "rate %/s",
    "on limit %",
    "verdict",
)
TASK_HEADINGS = ("kind of task", "min", "share %", "km", "nominal kg", "fuel kg", "change %")
TASK_LEGEND = "change: fuel against the nominal schedule, both from the same take-off mass; km: over the ground"
TEXTS = {
    "schedule": 12,
    "phase": 8,
    "kind of task": 14,
    "verdict": 10,
    "active, % of the time": 24,
}  # columns of text, and the width of their longest word
LEGEND = (
    "change: fuel against the nominal schedule from the same take-off mass, on the surrogate and on the physics; "
    "closed: with the take-off mass closed again, so that fuel saved need not be carried; "
    "rate: the largest of the rotor speed; on limit: share of the time on the limit that is active longest"
)
MEANING = {  # of the schedules' names
    "nominal": "constant rotor speed, twist as built",
    "constant": "the best constant rotor speed and twist",
    "pointwise": "the best at every moment by itself, which may jump",
    "pointwise_rate_limited": "the same as fast as the rates allow",
    "prescribed": "pointwise, with climb and descent of the study's table",
    "prescribed_rate_limited": "the same as fast as the rates allow",
    "trajectory": "the best over the whole mission, within the rates",
    "consistent": "the trajectory, corrected until it is the physics' best",
    "nominal_variable_transmission": "nominal, with the engines at their own best speed",
    "trajectory_variable_transmission": "trajectory, with the engines at their own best speed",
}
# schedules with the climb and descent of the study's table, and those whose climb and descent the model chose
PRESCRIBED = {"prescribed": "pointwise", "prescribed_rate_limited": "pointwise_rate_limited"}
SHOWN_SHARE = 0.05  # per cent of the time: a limit that is active for less is not listed


@dataclass(frozen=True)
class Row:
    """One schedule as texts in the order of HEADINGS; ``message`` is what there is to say about it, maybe nothing."""

    name: str
    cells: tuple[str, ...]
    verdict: str
    message: str


def title(comparison: Comparison) -> str:
    """The mission's name, and which variable was free if it was one alone."""
    free = comparison.provenance["variables"]
    return comparison.mission.name if free == "both" else f"{comparison.mission.name}, {free} only"


def verdict(result: ScheduleResult) -> str:
    """ "flyable", "infeasible: which limit, where, by how much" or "failed: why"."""
    if result.success:
        return "flyable"
    # only of the flight that failed: the other one may have something cheerful to say
    failed = [flight.message for flight in result.failed]
    message = "; ".join(dict.fromkeys(filter(None, failed)))
    if message.startswith("infeasible"):
        return message
    broken = result.flight.violations or (not result.physics.success and math.isfinite(result.physics.fuel))
    return f"{'infeasible' if broken else 'failed'}: {message}"


def summary_rows(comparison: Comparison) -> list[Row]:
    """One row per schedule. A schedule that is not flyable has no percentages: they would compare nothing."""
    nominal = comparison.settings.nominal_rotor_speed
    rows = []
    for name, result in comparison.results.items():
        judged = verdict(result)
        deltas = (result.fuel_delta_percent, result.fuel_delta_closed_percent, result.fuel_physics_delta_percent)
        delta, closed, physics = (number(value if result.success else math.nan, "+.2f") for value in deltas)
        rate = 100 * result.flight.max_rotor_speed_rate / nominal
        cells = (
            label(name),
            number(result.flight.fuel, ".2f"),
            delta,
            closed,
            number(result.physics.fuel, ".2f"),
            physics,
            number(result.emissions.total("co2"), ".1f"),
            "jumps" if math.isinf(rate) else number(rate, ".2f"),
            _largest_share(result),
            judged.partition(":")[0],
        )
        rows.append(Row(name, cells, judged, result.message))
    return rows


def remarks(comparison: Comparison) -> list[str]:
    """A line on every schedule that is not flyable or about which there is something to say."""
    lines = []
    for row in summary_rows(comparison):
        text = row.message if row.verdict == "flyable" else row.verdict
        if text:
            lines.append(f"{row.cells[0]}: {text}")
    lines += _prescribed_against_modelled(comparison)
    gained = advantage(comparison.results)
    if gained is not None:
        lines.append(f"{str(gained)[:1].upper()}{str(gained)[1:]}.")
    if not comparison.results["nominal"].success:
        lines.append("The nominal schedule itself is not flyable: the changes compare with it all the same.")
    return lines


def task_rows(comparison: Comparison, name: str) -> list[tuple[str, ...]]:
    """One row per kind of task with the fuel of the nominal schedule and of ``name``, and their sum."""
    shares = kind_shares(comparison.profile, comparison.results)
    compared = comparison.results[name].success and name != "nominal"

    def row(words: str, those: list[KindShare]) -> tuple[str, ...]:
        base, own = (sum(one.fuel[key] for one in those) for key in ("nominal", name))
        return (
            words,
            number(sum(one.duration for one in those) / 60, ".1f"),
            number(100 * sum(one.share for one in those), ".1f"),
            number(sum(one.distance for one in those) / 1e3, ".1f"),
            number(base, ".2f"),
            number(own, ".2f"),
            number(100 * (own / base - 1) if compared and base > 0.0 else math.nan, "+.2f"),
        )

    return [*(row(one.kind.replace("_", " "), [one]) for one in shares), row("mission", shares)]


def footer(comparison: Comparison) -> list[str]:
    """Masses, effort, accuracy and what the model leaves out."""
    loading = comparison.loading
    fuel = "as given"
    if math.isfinite(loading.fuel_loaded):
        fuel = f"with {loading.fuel_loaded:.1f} kg of fuel, reserve {loading.reserve_fuel:.1f} kg"
    lines = [f"Take-off mass {loading.takeoff_mass:.1f} kg {fuel}; duration {comparison.profile.duration:.0f} s"]
    lines.append(f"Day: ISA {comparison.profile.isa_offset:+g} K, {comparison.profile.wind}")
    solver = comparison.summary().get("solver")
    if solver:
        lines.append(
            f"Trajectory: {solver['iterations']} iterations, built in {solver['build_s']:.1f} s, solved in "
            f"{solver['solve_s']:.1f} s; re-flown fuel differs by {100 * abs(solver['resimulation_error']):.4f} %"
        )
    lines += [_difference(comparison), _limits_reached(comparison), foca_line(comparison)]
    lines += filter(None, [steps_line(comparison)])
    lines.append(f"{SIMPLIFICATIONS[0].upper()}{SIMPLIFICATIONS[1:]}.")
    return lines


def summary_table(comparison: Comparison) -> Group:
    """The table of ``comparison`` and of its variants with what has to be said, for a rich console."""
    parts: list[Table | Text] = []
    for case in (comparison, *comparison.variants.values()):
        fuel = [row.cells for row in summary_rows(case)]
        shown = foremost(case)
        parts += [_table(title(case), HEADINGS, fuel), Text(""), *(Text(line) for line in remarks(case)), Text("")]
        if saved := saving_rows(case):
            parts += [_table("Where the saving comes from, on the physics", SAVING_HEADINGS, saved), Text("")]
            best = foremost_saving(case)
            parts += [] if best is None else [Text(band_sentence(case, best[0])), Text("")]
        parts += [_table("Emissions", EMISSION_HEADINGS, emission_rows(case)), Text("")]
        parts += [_table("Rotor energy and what is active", ACCOUNT_HEADINGS, account_rows(case)), Text("")]
        parts += [_table(f"Tasks, {label(shown)}", TASK_HEADINGS, task_rows(case, shown)), Text("")]
        parts += [_table(f"Phases, {label(shown)}", PHASE_HEADINGS, phase_rows(case, shown)), Text("")]
    legends = (LEGEND, SAVING_LEGEND, EMISSION_LEGEND, ACCOUNT_LEGEND, TASK_LEGEND, PHASE_LEGEND)
    parts += [Text(line) for line in (*(f"{text[0].upper()}{text[1:]}." for text in legends), *footer(comparison))]
    return Group(*parts)


def summary_text(comparison: Comparison, *, width: int = 110) -> str:
    """:func:`summary_table` as plain text, ``width`` characters wide."""
    console = Console(file=io.StringIO(), width=width, color_system=None)
    with console.capture() as capture:
        console.print(summary_table(comparison))
    return "\n".join(line.rstrip() for line in capture.get().splitlines()) + "\n"


def _table(name: str, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    table = Table(title=name, box=box.SIMPLE_HEAD, title_justify="left", padding=0, show_edge=False)
    for heading in headings:
        text = heading in TEXTS
        widest = max(len(word) for word in heading.split())
        lines = heading if text else "\n".join(heading.rsplit(" ", 1))
        table.add_column(lines, justify="left" if text else "right", min_width=TEXTS.get(heading, widest))
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    return table


def _prescribed_against_modelled(comparison: Comparison) -> list[str]:
    """How much more the climb and descent of the study's table burn than those that the model chose."""
    lines = []
    for name, modelled in PRESCRIBED.items():
        if name not in comparison.results or modelled not in comparison.results:
            continue
        pair = comparison.results[name], comparison.results[modelled]
        what = f"{label(name)[:1].upper()}{label(name)[1:]} against {label(modelled)}"
        if not all(result.success for result in pair):
            lines.append(f"{what}: not compared, one of them is not flyable")
            continue
        flown = zip(("surrogate", "physics"), *((one.flight.fuel, one.physics.fuel) for one in pair), strict=True)
        texts = [
            f"{number(own - base, '+.3f')} kg ({number(100 * (own / base - 1), '+.2f')} %) on the {where}"
            for where, own, base in flown
        ]
        lines.append(f"{what}: fuel {', '.join(texts)}")
    return lines


def _largest_share(result: ScheduleResult) -> str:
    """Share of the mission time [%] on the limit that is active longest."""
    return number(100 * max(result.flight.time_on_limits.values(), default=math.nan), ".1f")


def _limits_reached(comparison: Comparison) -> str:
    """Which limits are active at all, and with which schedules."""
    reached: dict[str, list[str]] = {}
    for name, result in comparison.results.items():
        for limit, share in result.flight.time_on_limits.items():
            if 100 * share >= SHOWN_SHARE:
                reached.setdefault(limit, []).append(f"{label(name)} {100 * share:.1f} %")
    texts = [f"{limit} ({'; '.join(schedules)})" for limit, schedules in reached.items()]
    return f"Time on limits: {'; '.join(texts) or 'none'}"


def _difference(comparison: Comparison) -> str:
    """How far the surrogate is from the physics, at worst."""
    differences = {
        name: 100 * (result.flight.fuel / result.physics.fuel - 1)
        for name, result in comparison.results.items()
        if math.isfinite(result.flight.fuel) and math.isfinite(result.physics.fuel)
    }
    if not differences:
        return "Surrogate against physics: no schedule could be flown on both"
    worst = max(differences, key=lambda name: abs(differences[name]))
    return f"Fuel on the surrogate against the physics: at worst {differences[worst]:+.3f} % ({label(worst)})"
