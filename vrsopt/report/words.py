"""What came out, in a few plain sentences: failures first, then what is saved, by what, held by what, checked how."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from vrsopt.report.account_tables import active_words
from vrsopt.report.emission_tables import between, foremost, label, number
from vrsopt.report.markup import Bad
from vrsopt.report.physics_tables import largest_usage
from vrsopt.report.saving_band import band_sentence
from vrsopt.report.saving_tables import foremost_saving, grouped
from vrsopt.report.style import task_spans
from vrsopt.report.tables import title, verdict
from vrsopt.schedule.emissions import nox_fits

if TYPE_CHECKING:
    from vrsopt.schedule.comparison import Comparison, ScheduleResult
    from vrsopt.schedule.saving import Saving

WORTH = 0.1  # of the saving, below which a cause is not told
TOLD = 3  # tasks
# what saves, and what costs
CAUSE_WORDS = {
    "rotor profile": ("less drag of the main rotor's blades", "more drag of the main rotor's blades"),
    "rotor induced": ("less power for the main rotor's lift", "more power for the main rotor's lift"),
    "tail rotor": ("the tail rotor", "the tail rotor"),
    "other power": ("less power elsewhere", "more power elsewhere"),
    "rotor energy": ("the energy of the rotor", "the energy of the rotor"),
    "engine load": ("engines at a better load", "engines at a load that suits them less"),
    "turbine speed": ("power turbines at a better speed", "power turbines off their best speed"),
}


def summary_sentences(comparison: Comparison) -> list[str]:
    """What a reader should know first, failures before anything else and marked as bad."""
    found = [*map(Bad, failures(comparison))]
    best = foremost_saving(comparison)
    if best is None:
        return [*found, _nothing(comparison)]
    name, saved = best
    result = comparison.results[name]
    texts = [_what(comparison, name, saved), band_sentence(comparison, name), _why(saved), _where(comparison, saved)]
    texts += [_held(comparison, name), _checked(result), _nox(result), *map(_alone, comparison.variants.values())]
    return [*found, *filter(None, texts)]


def _nothing(comparison: Comparison) -> str:
    """Why there is no saving to tell."""
    fuel = comparison.results["nominal"].physics.fuel
    if not math.isfinite(fuel):
        return Bad("Nothing to compare with: the nominal schedule was not solved on the physics.")
    burned = f"nominal burns {fuel:.2f} kg on the physics."
    if len(comparison.results) == 1:
        return f"Only the nominal schedule was flown: {burned}"
    return Bad(f"No schedule but the nominal one is flyable, nothing is saved: {burned}")


def failures(comparison: Comparison) -> list[str]:
    """One sentence for every schedule that is not flyable, those of the variants too."""
    found = []
    for case in (comparison, *comparison.variants.values()):
        for name, result in case.results.items():
            if not result.success:
                found.append(f"{title(case)}, {label(name)}: {verdict(result).rstrip('.')}.")
    return found


def _what(comparison: Comparison, name: str, saved: Saving) -> str:
    result = comparison.results[name]
    total = float(saved.base.sum())
    percent, other = 100.0 * saved.fuel / total, -result.fuel_delta_percent
    words = "less" if saved.fuel >= 0.0 else "more"
    return (
        f'With the schedule "{label(name)}" the mission burns {abs(percent):.1f} % {words} fuel than with the nominal '
        f"one: {total - saved.fuel:.2f} kg against {total:.2f} kg, flown on the full physics from the same take-off "
        f"mass (on the surrogate {abs(other):.1f} % {'less' if other >= 0.0 else 'more'})."
    )


def _why(saved: Saving) -> str:
    """Causes that matter, what saves and what costs."""
    causes = {name: float(kg.sum()) for name, kg in grouped(saved).items()}
    told = sorted((one for one in causes if abs(causes[one]) >= WORTH * abs(saved.fuel)), key=lambda n: -causes[n])
    gains = [f"{causes[one]:.2f} kg by {CAUSE_WORDS[one][0]}" for one in told if causes[one] > 0.0]
    costs = [f"{-causes[one]:.2f} kg by {CAUSE_WORDS[one][1]}" for one in reversed(told) if causes[one] < 0.0]
    parts = [f"{word} {', '.join(them)}" for word, them in (("saved", gains), ("given back", costs)) if them]
    return f"Where that comes from: {'; '.join(parts)}." if parts else ""


def _where(comparison: Comparison, saved: Saving) -> str:
    """Tasks that save most."""
    if saved.fuel <= 0.0:
        return ""
    kg: dict[str, float] = {}
    for span in task_spans(comparison.profile):
        kg[span.task] = kg.get(span.task, 0.0) + float(saved.per_segment[list(span.segments)].sum())
    first = sorted(kg, key=lambda task: -kg[task])[:TOLD]
    return f"Most of it is saved in {', '.join(f'{task} ({100.0 * kg[task] / saved.fuel:.0f} %)' for task in first)}."


def _held(comparison: Comparison, name: str) -> str:
    return f"Active limits, in per cent of the time: {active_words(comparison, name)}."


def _checked(result: ScheduleResult) -> str:
    limit, most = largest_usage(result)
    apart = 100.0 * abs(result.flight.fuel / result.physics.fuel - 1.0)
    words = f"Checked on the physics, node by node: its fuel is within {max(apart, 0.001):.3f} % of the surrogate's"
    return f"{words}, and the largest use of a limit is {most:.1f} % ({limit})." if math.isfinite(most) else f"{words}."


def _nox(result: ScheduleResult) -> str:
    """Change of NOx with its range over the fits of the combustor."""
    changes = [result.changes[name] for name in nox_fits(result.changes)]
    over = between(changes, "+.1f")
    spread = f" ({over} % over the fits of the combustor)" if " to " in over else ""
    return f"NOx changes by {changes[0]:+.1f} %{spread}; its level is indicative."


def _alone(variant: Comparison) -> str:
    """What a variable saves without the other one."""
    best = foremost_saving(variant)
    if best is None:
        return ""
    name, saved = best
    percent = number(100.0 * saved.fuel / float(saved.base.sum()), ".1f")
    what = {"speed": "rotor speed"}.get(variant.provenance["variables"], variant.provenance["variables"])
    return f"By itself, {what} saves {percent} % ({label(name)})."


def foremost_flyable(comparison: Comparison) -> str:
    """Name of the schedule that the details are shown of: the flyable one that matters most, else the foremost."""
    best = foremost_saving(comparison)
    return best[0] if best is not None else foremost(comparison)
