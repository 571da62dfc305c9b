"""The report as one HTML page that needs nothing else: no network, no script, figures inside."""

from __future__ import annotations

import base64
import html
from collections.abc import Callable, Mapping, Sequence
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
from vrsopt.report.tables import (
    HEADINGS,
    LEGEND,
    TASK_HEADINGS,
    TASK_LEGEND,
    footer,
    remarks,
    summary_rows,
    task_rows,
    title,
)

if TYPE_CHECKING:
    from vrsopt.schedule.comparison import Comparison

CAPTIONS = {
    "flight_path": "Flight path over the ground in the colours of the tasks; squares: where the aircraft stands; small "
    "maps: patterns that are too small to be seen on the large one.",
    "mission_profile": "The mission over time. Speed is true airspeed; the load factor is that of turns and of the "
    "vertical plane together. Vertical flight, at 90 deg, leaves the scale of the climb angle.",
    "schedules": "Schedules over time. Grey: rotor speeds within 0.5 % of the least fuel flow at the nominal "
    "schedule's mass. Hatched: forbidden bands, to be crossed only. Limits: 100 % is allowed; the blade loading keeps "
    "the manoeuvre margin.",
    "fuel": "Fuel burned with each schedule.",
    "emissions": "NOx and CO flow over time with the shipped fit of the combustor; band: NOx of the schedule over all "
    "fits. At idle both are indicative only.",
    "phases": "NOx by phase of the mission; whiskers: range over the fits of the combustor. At idle it is indicative "
    "only.",
}
STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff; max-width: 70rem; margin: 0 auto;
  padding: 0 1rem 3rem; }
h1, h2 { line-height: 1.2; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: 0.3rem 0.7rem; border-bottom: 1px solid #ccc; text-align: right; vertical-align: bottom; }
th:first-child, td:first-child, td.words { text-align: left; }
td:not(:first-child) { white-space: nowrap; }
summary { cursor: pointer; margin: 0.5rem 0; }
.bad { color: #a03000; font-weight: 600; }
figure { margin: 1.5rem 0; }
img { max-width: 100%; height: auto; }
figcaption, .note { color: #555; font-size: 0.9rem; }
pre { overflow-x: auto; background: #f4f4f4; padding: 1rem; font-size: 0.85rem; }
"""


def report_page(
    comparison: Comparison,
    *,
    pictures: Mapping[str, Mapping[str, bytes]],
    mission_text: str,
    record: Mapping[str, object],
) -> str:
    """The page.

    ``pictures``: PNGs by name of the variant ("" for the comparison itself) and of the figure; ``record``: where the
    result comes from, by name. ``mission_text``: the input as the user gave it.
    """
    name = html.escape(comparison.mission.name)
    cases = {"": comparison, **comparison.variants}
    parts = [_section(case, pictures[key]) for key, case in cases.items()]
    told = "".join(f"<li>{html.escape(line)}</li>" for line in (*comparison.notes, *footer(comparison)))
    rows = "".join(
        f'<tr><th>{html.escape(key.replace("_", " "))}</th><td class="words">{html.escape(str(value))}</td></tr>'
        for key, value in record.items()
    )
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{name}: rotor speed and twist</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        f"<h1>{name}: rotor speed and twist for least fuel</h1>\n{''.join(parts)}"
        f"<h2>Notes</h2>\n<ul>{told}</ul>\n"
        f'<h2>Where this comes from</h2>\n<div class="wide"><table>{rows}</table></div>\n'
        f"<h2>Mission</h2>\n<pre>{html.escape(mission_text)}</pre>\n</body>\n</html>\n"
    )


def _section(comparison: Comparison, pictures: Mapping[str, bytes]) -> str:
    """Tables, remarks and figures of one comparison."""
    notes = "".join(f"<p>{html.escape(line)}</p>\n" for line in remarks(comparison))
    images = "".join(_figure(name, content) for name, content in pictures.items())
    fuel = [row.cells for row in summary_rows(comparison)]
    return (
        f"<h2>{html.escape(title(comparison))}</h2>\n{_table(HEADINGS, fuel)}{_legend(LEGEND)}{notes}"
        f"<h3>Emissions</h3>\n{_table(EMISSION_HEADINGS, emission_rows(comparison))}{_legend(EMISSION_LEGEND)}"
        f"<h3>Rotor energy and what is active</h3>\n{_table(ACCOUNT_HEADINGS, account_rows(comparison))}"
        f"{_legend(ACCOUNT_LEGEND)}{images}"
        f"<h3>Tasks</h3>\n{_by_schedule(comparison, TASK_HEADINGS, task_rows)}{_legend(TASK_LEGEND)}"
        f"<h3>Phases</h3>\n{_by_schedule(comparison, PHASE_HEADINGS, phase_rows)}{_legend(PHASE_LEGEND)}"
    )


def _by_schedule(
    comparison: Comparison,
    headings: Sequence[str],
    rows: Callable[[Comparison, str], Sequence[Sequence[str]]],
) -> str:
    """One table per schedule, folded away but for those of the nominal schedule and the last."""
    names = list(comparison.results)
    return "".join(
        f"<details{' open' if name in (names[0], names[-1]) else ''}><summary>{html.escape(label(name))}</summary>\n"
        f"{_table(headings, rows(comparison, name))}</details>\n"
        for name in names
    )


def _legend(text: str) -> str:
    return f'<p class="note">{html.escape(text[:1].upper() + text[1:])}.</p>\n'


def _table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = "".join(f"<th>{html.escape(heading)}</th>" for heading in headings)
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>\n'


def _cell(text: str) -> str:
    mark = {"flyable": ' class="words"', "infeasible": ' class="words bad"', "failed": ' class="words bad"'}
    return f"<td{mark.get(text, '')}>{html.escape(text)}</td>"


def _figure(name: str, content: bytes) -> str:
    caption = html.escape(CAPTIONS[name])
    data = base64.b64encode(content).decode("ascii")
    return (
        f'<figure><img src="data:image/png;base64,{data}" alt="{caption}"><figcaption>{caption}</figcaption></figure>\n'
    )
