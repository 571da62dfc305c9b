"""The report as one HTML page that needs nothing else: no network, no script, figures inside."""

from __future__ import annotations

import html
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import TYPE_CHECKING

from vrsopt.report.account_tables import ACCOUNT_HEADINGS, ACCOUNT_LEGEND, account_rows
from vrsopt.report.emission_tables import (
    EMISSION_HEADINGS,
    EMISSION_LEGEND,
    PHASE_HEADINGS,
    PHASE_LEGEND,
    emission_rows,
    label,
    phase_rows,
)
from vrsopt.report.markup import Section, document, folded, listed, note, paragraph, picture, table, verbatim
from vrsopt.report.physics_tables import (
    PHYSICS_HEADINGS,
    PHYSICS_LEGEND,
    USAGE_HEADINGS,
    USAGE_LEGEND,
    physics_rows,
    usage_rows,
)
from vrsopt.report.saving_tables import (
    CAUSE_HEADINGS,
    CAUSE_LEGEND,
    SAVING_HEADINGS,
    SAVING_LEGEND,
    TASK_SAVING_HEADINGS,
    TASK_SAVING_LEGEND,
    cause_rows,
    flyable_savings,
    saving_rows,
    task_saving_rows,
)
from vrsopt.report.solver_tables import (
    ARC_HEADINGS,
    ARC_LEGEND,
    SOLVER_HEADINGS,
    STEP_HEADINGS,
    arc_rows,
    solver_rows,
    step_rows,
)
from vrsopt.report.sources import INPUT_HEADINGS, SETTING_HEADINGS, numbers, setting_rows
from vrsopt.report.tables import (
    HEADINGS,
    LEGEND,
    MEANING,
    TASK_HEADINGS,
    TASK_LEGEND,
    footer,
    remarks,
    summary_rows,
    task_rows,
    title,
)
from vrsopt.report.words import foremost_flyable, summary_sentences

if TYPE_CHECKING:
    from vrsopt.aircraft import Aircraft
    from vrsopt.schedule.comparison import Comparison
    from vrsopt.turboshaft.data import EngineData

CAPTIONS = {
    "flight_path": "Flight path over the ground in the colours of the tasks; squares: where the aircraft stands; small "
    "maps: patterns that are too small to be seen on the large one.",
    "mission_profile": "The mission over time. Speed is true airspeed; the load factor is that of turns and of the "
    "vertical plane together. Vertical flight, at 90 deg, leaves the scale of the climb angle.",
    "schedules": "Schedules over time. Grey: rotor speeds within 0.5 % of the least fuel flow at the nominal "
    "schedule's mass. Hatched: forbidden bands, to be crossed only. Limits: 100 % is allowed; the blade loading keeps "
    "the manoeuvre margin.",
    "saving": "Fuel saved on the physics. Above, every cause begins where the one before it ends; causes to the left "
    "give back. Below, the same in every task, with a mark at what is saved in all.",
    "fuel": "Fuel burned with each schedule.",
    "emissions": "NOx and CO flow over time with the shipped fit of the combustor; band: NOx of the schedule over all "
    "fits. At idle both are indicative only.",
    "phases": "NOx by phase of the mission; whiskers: range over the fits of the combustor. At idle it is indicative "
    "only.",
}
Pictures = Mapping[str, bytes]


def report_page(
    comparison: Comparison,
    *,
    pictures: Mapping[str, Pictures],
    mission_text: str,
    record: Mapping[str, object],
) -> str:
    """The page.

    ``pictures``: PNGs by name of the variant ("" for the comparison itself) and of the figure; ``record``: where the
    result comes from, by name. ``mission_text``: the input as the user gave it.
    """
    sections = _results("", comparison, pictures[""])
    for key, case in comparison.variants.items():
        inner = "".join(one.markup(3) for one in _results(f"{key}-", case, pictures[key]))
        sections.append(Section(key, title(case), inner))
    # not known may be the fuel aboard: of a flown track only the mass is
    rows = [(key.replace("_", " "), "-" if str(value) == "nan" else str(value)) for key, value in record.items()]
    sections += [
        Section("inputs", "Inputs and their sources", _inputs(comparison)),
        Section("mission", "Mission", verbatim(mission_text)),
        Section("notes", "Notes", listed(footer(comparison))),
        Section("versions", "Versions, hashes and settings of this result", table(("name", "value"), rows, words=(1,))),
    ]
    name = f"{comparison.mission.name}: rotor speed and twist for least fuel"
    return document(name, listed(summary_sentences(comparison), lead=True), sections)


def _results(prefix: str, comparison: Comparison, pictures: Pictures) -> list[Section]:
    """The sections of one comparison."""
    parts = {
        "results": ("Results", _summary(comparison) + _figures(pictures, "fuel")),
        "saving": ("Where the saving comes from", _saving(comparison, pictures)),
        "flight": ("Map and mission", _flight(comparison, pictures)),
        "schedules": ("Schedules, limits and tasks", _figures(pictures, "schedules") + _accounts(comparison)),
        "emissions": ("Emissions", _emissions(comparison, pictures)),
        "solver": ("How the schedules were found", _solver(comparison)),
        "physics": ("Check on the physics", _physics(comparison)),
    }
    return [Section(f"{prefix}{key}", words, content) for key, (words, content) in parts.items() if content]


def _figures(pictures: Pictures, *names: str) -> str:
    return "".join(picture(CAPTIONS[name], pictures[name]) for name in names if name in pictures)


def _summary(comparison: Comparison) -> str:
    rows = [row.cells for row in summary_rows(comparison)]
    meaning = "; ".join(f"{label(name)}: {MEANING[name]}" for name in comparison.results)
    return table(HEADINGS, rows) + note(LEGEND) + note(meaning) + "".join(map(paragraph, remarks(comparison)))


def _flight(comparison: Comparison, pictures: Pictures) -> str:
    """Where it flies, and what was changed or chosen to make the input that."""
    return _figures(pictures, "flight_path", "mission_profile") + (listed(comparison.notes) if comparison.notes else "")


def _saving(comparison: Comparison, pictures: Pictures) -> str:
    """Nothing unless there is a schedule but the nominal one."""
    rows = saving_rows(comparison)
    if not rows:
        return ""
    names = list(flyable_savings(comparison))
    causes = _by_schedule(comparison, CAUSE_HEADINGS, cause_rows, names=names, words=(3,))
    tasks = _by_schedule(comparison, TASK_SAVING_HEADINGS, task_saving_rows, names=names)
    return (
        f"{_figures(pictures, 'saving')}{table(SAVING_HEADINGS, rows)}{note(SAVING_LEGEND)}"
        f"<h3>By cause</h3>\n{causes}{note(CAUSE_LEGEND)}<h3>By task</h3>\n{tasks}{note(TASK_SAVING_LEGEND)}"
    )


def _accounts(comparison: Comparison) -> str:
    return (
        f"<h3>Rotor energy and what is active</h3>\n"
        f"{table(ACCOUNT_HEADINGS, account_rows(comparison), words=(5,))}{note(ACCOUNT_LEGEND)}"
        f"<h3>Kinds of task</h3>\n{_by_schedule(comparison, TASK_HEADINGS, task_rows)}{note(TASK_LEGEND)}"
    )


def _emissions(comparison: Comparison, pictures: Pictures) -> str:
    return (
        f"{table(EMISSION_HEADINGS, emission_rows(comparison))}{note(EMISSION_LEGEND)}"
        f"{_figures(pictures, 'emissions', 'phases')}"
        f"<h3>Phases</h3>\n{_by_schedule(comparison, PHASE_HEADINGS, phase_rows)}{note(PHASE_LEGEND)}"
    )


def _by_schedule(
    comparison: Comparison,
    headings: Sequence[str],
    rows: Callable[[Comparison, str], Sequence[Sequence[str]]],
    *,
    names: Collection[str] | None = None,
    words: Collection[int] = (),
) -> str:
    """One table per schedule of ``names``, all by default, folded away but for the one that matters most."""
    first = foremost_flyable(comparison)
    return "".join(
        folded(label(name), table(headings, rows(comparison, name), words=words, total=True), opened=name == first)
        for name in (comparison.results if names is None else names)
    )


def _solver(comparison: Comparison) -> str:
    content = ""
    if solved := solver_rows(comparison):
        arcs = table(ARC_HEADINGS, arc_rows(comparison), words=(2, 3)) + note(ARC_LEGEND)
        content += table(SOLVER_HEADINGS, solved, words=(1,)) + folded("Switching structure of the trajectory", arcs)
    if steps := step_rows(comparison):
        content += table(STEP_HEADINGS, steps, total=True)
    return content


def _physics(comparison: Comparison) -> str:
    name = foremost_flyable(comparison)
    return (
        f"{table(PHYSICS_HEADINGS, physics_rows(comparison), words=(4,))}{note(PHYSICS_LEGEND)}"
        f"<h3>Use of limits: {html.escape(label(name))}</h3>\n"
        f"{table(USAGE_HEADINGS, usage_rows(comparison, name), words=(4,))}{note(USAGE_LEGEND)}"
    )


def _inputs(comparison: Comparison) -> str:
    limits = comparison.limits
    settings = table(SETTING_HEADINGS, setting_rows(comparison), words=(1,))
    return settings + _sources(limits.aircraft) + _sources(limits.engine)


def _sources(record: Aircraft | EngineData) -> str:
    """Numbers of an aircraft or engine: those that nobody has measured in the open, the others folded away."""
    found = list(numbers(record, record.sources))
    unsure, sure = ([one.cells for one in found if one.unsure is wanted] for wanted in (True, False))
    return (
        f"<h3>{html.escape(record.name)}</h3>\n"
        f"{paragraph(f'{len(unsure)} of its {len(found)} numbers are assumed, solved or have a range.')}"
        f"{folded('These', table(INPUT_HEADINGS, unsure, words=(4, 5)))}"
        f"{folded('All others', table(INPUT_HEADINGS, sure, words=(4, 5)))}"
        f"{folded('Sources', table(('key', 'source'), record.sources.items(), words=(1,)))}"
    )
