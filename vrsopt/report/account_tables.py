"""The energy of the rotor, what holds each schedule, and how long its making took, in words and numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vrsopt.report.emission_tables import label

if TYPE_CHECKING:
    from vrsopt.schedule.comparison import Comparison

ACCOUNT_HEADINGS = ("schedule", "charged kJ", "credited kJ", "jumps kJ", "end-start kJ", "active, % of the time")
ACCOUNT_LEGEND = (
    "kinetic energy of the rotor: charged to the engines, credited to them down to their idle, from nowhere where a "
    "schedule jumps, and at the end against the start; active: limits, bounds and rates that hold the schedule"
)
SHOWN = 3  # of what is active, the longest first
NAMES = {"rotor speed rate": "speed rate", "rotor speed at its lower bound": "least speed"} | {
    "rotor speed at its upper bound": "largest speed",
    "twist at its lower bound": "least twist",
    "twist at its upper bound": "largest twist",
}


def account_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    """One row per schedule, in the order of ACCOUNT_HEADINGS."""
    return [
        (
            label(name),
            *(f"{1e-3 * value:.1f}".replace("-0.0", "0.0") for value in _energies(comparison, name)),
            active_words(comparison, name),
        )
        for name in comparison.results
    ]


def active_words(comparison: Comparison, name: str) -> str:
    """What holds the schedule ``name``, the longest first, with the share of the time in per cent."""
    active = list(comparison.results[name].active.items())[:SHOWN]
    return ", ".join(f"{NAMES.get(what, what)} {100 * share:.1f}" for what, share in active) or "nothing"


def steps_line(comparison: Comparison) -> str:
    """How long the steps took, on the clock and of the processor; nothing if that is not known."""
    if not comparison.steps:
        return ""
    steps = [f"{name} {one['wall_s']:.1f} ({one['cpu_s']:.1f})" for name, one in comparison.steps.items()]
    return f"Seconds on the clock (of the processor): {', '.join(steps)}"


def _energies(comparison: Comparison, name: str) -> tuple[float, float, float, float]:
    energy = comparison.results[name].energy
    return energy.charged, energy.credited, energy.jumped, energy.end_minus_start
