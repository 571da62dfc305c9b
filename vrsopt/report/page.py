"""The report as one HTML page that needs nothing else: no network, no script, figures inside."""

from __future__ import annotations

import base64
import html
from collections.abc import Mapping
from typing import TYPE_CHECKING

from vrsopt.report.tables import HEADINGS, LEGEND, footer, remarks, summary_rows, title

if TYPE_CHECKING:
    from vrsopt.schedule.comparison import Comparison

CAPTIONS = {
    "flight_path": "Flight path and altitude.",
    "schedules": "Schedules over time. Grey: rotor speeds within 0.5 % of the least fuel flow at the nominal "
    "schedule's mass. Limits: 100 % is allowed; the blade loading keeps the manoeuvre margin.",
    "fuel": "Fuel burned with each schedule.",
}
STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff; max-width: 70rem; margin: 0 auto;
  padding: 0 1rem 3rem; }
h1, h2 { line-height: 1.2; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: 0.3rem 0.7rem; border-bottom: 1px solid #ccc; text-align: right; vertical-align: bottom; }
th:first-child, td:first-child, th:last-child, td:last-child { text-align: left; }
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
    result comes from, by name.
    """
    name = html.escape(comparison.mission.name)
    cases = {"": comparison, **comparison.variants}
    parts = [_section(case, pictures[key]) for key, case in cases.items()]
    notes = "".join(f"<li>{html.escape(line)}</li>" for line in footer(comparison))
    rows = "".join(
        f"<tr><th>{html.escape(key.replace('_', ' '))}</th><td>{html.escape(str(value))}</td></tr>"
        for key, value in record.items()
    )
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{name}: rotor speed and twist</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        f"<h1>{name}: rotor speed and twist for least fuel</h1>\n{''.join(parts)}"
        f"<h2>Notes</h2>\n<ul>{notes}</ul>\n"
        f'<h2>Where this comes from</h2>\n<div class="wide"><table>{rows}</table></div>\n'
        f"<h2>Mission</h2>\n<pre>{html.escape(mission_text)}</pre>\n</body>\n</html>\n"
    )


def _section(comparison: Comparison, pictures: Mapping[str, bytes]) -> str:
    """Table, remarks and figures of one comparison."""
    heading = f"<h2>{html.escape(title(comparison))}</h2>\n"
    notes = "".join(f"<p>{html.escape(line)}</p>\n" for line in remarks(comparison))
    images = "".join(_figure(name, content) for name, content in pictures.items())
    legend = f'<p class="note">{html.escape(LEGEND[:1].upper() + LEGEND[1:])}.</p>\n'
    return f"{heading}{_table(comparison)}{legend}{notes}{images}"


def _table(comparison: Comparison) -> str:
    head = "".join(f"<th>{html.escape(heading)}</th>" for heading in HEADINGS)
    body = ""
    for row in summary_rows(comparison):
        *cells, judged = row.cells
        mark = "" if judged == "flyable" else ' class="bad"'
        body += (
            f"<tr>{''.join(f'<td>{html.escape(cell)}</td>' for cell in cells)}<td{mark}>{html.escape(judged)}</td></tr>"
        )
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>\n'


def _figure(name: str, content: bytes) -> str:
    caption = html.escape(CAPTIONS[name])
    data = base64.b64encode(content).decode("ascii")
    return (
        f'<figure><img src="data:image/png;base64,{data}" alt="{caption}"><figcaption>{caption}</figcaption></figure>\n'
    )
