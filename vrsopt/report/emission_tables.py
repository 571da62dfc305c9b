"""Emissions in words and numbers: by schedule with the range of NOx, by phase of the mission, and FOCA's estimate."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from vrsopt.combustor.emissions import fit_range
from vrsopt.schedule.emission_summary import foca_estimates
from vrsopt.schedule.emissions import NOTE, nox_fits, phases

if TYPE_CHECKING:
    from vrsopt.schedule.comparison import Comparison, ScheduleResult

EMISSION_HEADINGS = (
    "schedule",
    "NOx g",
    "range g",
    "change %",
    "range %",
    "physics g",
    "change %",
    "CO g",
    "FOCA NOx g",
)
PHASE_HEADINGS = ("phase", "min", "fuel kg", "change %", "CO2 kg", "NOx g", "range g", "change %", "CO g")
FOREMOST = (  # the one that matters most first
    "trajectory",
    "consistent",
    "pointwise_rate_limited",
    "pointwise",
    "prescribed_rate_limited",
    "prescribed",
    "constant",
    "trajectory_variable_transmission",
    "nominal",
)
LABELS = {
    "pointwise_rate_limited": "pointwise, rate limited",
    "prescribed": "prescribed climb and descent",
    "prescribed_rate_limited": "prescribed, rate limited",
    "constant": "best constant",
    "consistent": "trajectory on the physics",
    "nominal_variable_transmission": "nominal, variable transmission",
    "trajectory_variable_transmission": "trajectory, variable transmission",
}
INDICATIVE = " *"  # after the name of a phase
EMISSION_LEGEND = (
    "NOx as NO2; range: over the fits of the combustor, and of the changes with each fit; "
    f"FOCA: its indices on the same fuel; {NOTE}"
)
PHASE_LEGEND = (
    "change: against the same phase of the nominal schedule; search counts as loiter, vertical climb as climb, ground "
    "idle as idle; *: NOx and CO at idle are indicative only"
)
NOTHING = "-"


def label(name: str) -> str:
    """A schedule's or variant's name for people."""
    return LABELS.get(name, name.replace("_", " "))


def emission_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    """One row per schedule, in the order of EMISSION_HEADINGS; no changes for one that is not flyable."""
    rows: list[tuple[str, ...]] = []
    for name, result in comparison.results.items():
        own, physics = result.emissions, result.physics.emissions
        rows.append(
            (
                label(name),
                number(1e3 * own.total("nox"), ".1f"),
                between((1e3 * value for value in own.nox_range), ".1f"),
                *_changes(result),
                number(1e3 * physics.total("nox") if physics else math.nan, ".1f"),
                number(result.physics_changes.get("nox", math.nan) if result.success else math.nan, "+.2f"),
                number(1e3 * own.total("co"), ".0f"),
                number(1e3 * own.total("foca_nox"), ".1f"),
            )
        )
    return rows


def _changes(result: ScheduleResult) -> tuple[str, str]:
    """Change of NOx, and its range over the fits of the combustor."""
    if not result.success:
        return NOTHING, NOTHING
    changes = [result.changes[name] for name in nox_fits(result.changes)]
    return number(changes[0], "+.2f"), between(changes, "+.1f")


def foremost(comparison: Comparison) -> str:
    """Name of the schedule that matters most."""
    return next(name for name in FOREMOST if name in comparison.results)


def phase_rows(comparison: Comparison, name: str) -> list[tuple[str, ...]]:
    """One row per phase of the schedule ``name``, and their sum, in the order of PHASE_HEADINGS."""
    result, nominal = comparison.results[name], comparison.results["nominal"]
    own, base = (phases(comparison.profile, one.flight.fuel_per_segment, one.emissions) for one in (result, nominal))
    compared = result.success and name != "nominal"
    rows: list[tuple[str, ...]] = []
    for key, phase in own.items():
        if phase.duration > 0.0:
            rows.append(
                (
                    key + (INDICATIVE if key == "idle" else ""),
                    number(phase.duration / 60, ".1f"),
                    number(phase.fuel, ".2f"),
                    _change(phase.fuel, base[key].fuel, compared),
                    number(phase.co2, ".1f"),
                    number(1e3 * phase.nox, ".1f"),
                    between((1e3 * value for value in phase.nox_range), ".1f"),
                    _change(phase.nox, base[key].nox, compared),
                    number(1e3 * phase.co, ".0f"),
                )
            )
    emitted = result.emissions
    total = (
        "mission",
        number(comparison.profile.duration / 60, ".1f"),
        number(result.flight.fuel, ".2f"),
        _change(result.flight.fuel, nominal.flight.fuel, compared),
        number(emitted.total("co2"), ".1f"),
        number(1e3 * emitted.total("nox"), ".1f"),
        between((1e3 * value for value in emitted.nox_range), ".1f"),
        _change(emitted.total("nox"), nominal.emissions.total("nox"), compared),
        number(1e3 * emitted.total("co"), ".0f"),
    )
    return [*rows, total]


def foca_line(comparison: Comparison) -> str:
    """FOCA's independent estimate of such a mission, in one sentence."""
    limits = comparison.limits
    cycle, mission, landings = foca_estimates(comparison.profile, limits.aircraft, limits.engine)
    texts = [
        f"{what} {one.total.fuel:.1f} kg of fuel, {1e3 * one.total.nox:.0f} g NOx, {1e3 * one.total.co:.0f} g CO"
        for what, one in (
            ("one landing and take-off cycle", cycle),
            (f"such a mission ({landings} of them and the rest of the time at mean power)", mission),
        )
    ]
    return f"FOCA's guidance (a fleet average; factor 2 for one engine): {'; '.join(texts)}"


def between(values: Iterable[float], form: str) -> str:
    """A range as text; one number if both ends look the same.

    ``values``: its ends; ``form``: format of a number.
    """
    low, high = (number(value, form) for value in fit_range(values))
    return low if low == high else f"{low} to {high}"


def number(value: float, form: str) -> str:
    """A number as text, zero without a minus, or that there is none.

    ``value``: nan where there is none; ``form``: its format.
    """
    if not math.isfinite(value):
        return NOTHING
    text = format(value, form)
    return text if float(text) else format(0.0, form)


def _change(value: float, base: float, compared: bool) -> str:
    return number(100 * (value / base - 1) if compared and base > 0.0 else math.nan, "+.2f")
