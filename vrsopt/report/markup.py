"""The few kinds of HTML that a report is made of, and how they look on a screen, on a phone and on paper."""

from __future__ import annotations

import base64
import html
import struct
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

# Whatever is asked for beyond the page itself, a browser refuses.
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff; max-width: 70rem; margin: 0 auto;
  padding: 0 1rem 3rem; overflow-wrap: break-word; }
h1, h2, h3 { line-height: 1.2; }
h2 { border-top: 2px solid #0072b2; padding-top: 0.6rem; margin-top: 2.5rem; }
a { color: #0072b2; }
nav ul { columns: 16rem; padding-left: 1.2rem; }
.wide { overflow-x: auto; background: linear-gradient(to right, #fff 30%, #fff0) left / 2rem 100%,
    linear-gradient(to left, #fff 30%, #fff0) right / 2rem 100%,
    linear-gradient(to right, #0004, #0000) left / 0.8rem 100%,
    linear-gradient(to left, #0004, #0000) right / 0.8rem 100%;
  background-attachment: local, local, scroll, scroll; background-repeat: no-repeat; }  /* a shade: it goes on there */
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 0.9rem; }
th, td { padding: 0.3rem 0.5rem; border-bottom: 1px solid #ccc; text-align: right; vertical-align: top;
  white-space: nowrap; }
th { vertical-align: bottom; white-space: normal; }
th:first-child, td:first-child { text-align: left; white-space: normal; min-width: 7rem; }
th.words, td.words { text-align: left; white-space: normal; min-width: 10rem; overflow-wrap: anywhere; }
td.verdict { text-align: left; }
tr.sum td { border-top: 2px solid #1a1a1a; font-weight: 600; }
summary { cursor: pointer; margin: 0.5rem 0; }
.lead { font-size: 1.1rem; padding-left: 1.2rem; }
.bad { color: #a03000; font-weight: 600; }
figure { margin: 1.5rem 0; }
img { display: block; max-width: 100%; height: auto; }
figcaption, .note { color: #555; font-size: 0.9rem; }
pre { overflow-x: auto; background: #f4f4f4; padding: 1rem; font-size: 0.85rem; }
@media (max-width: 45rem) {
  body { font-size: 15px; padding: 0 0.7rem 2rem; }
  table { font-size: 0.85rem; }
  th, td { padding: 0.25rem 0.45rem; }
  .lead { font-size: 1rem; }
  .wide img { max-width: none; width: max(100%, 0.6 * var(--wide)); }
}
@media print {
  @page { size: A4; margin: 12mm; }
  html { font-size: 9pt; }
  body { font-size: 9pt; max-width: none; padding: 0; }
  h2 { margin-top: 1.5rem; }
  figure { margin: 0.7rem 0; }
  .wide, pre { overflow: visible; }
  .wide { background: none; }
  table { font-size: 7.5pt; width: 100%; }
  th, td { padding: 0.12rem 0.3rem; white-space: normal; }
  th:first-child, td:first-child { min-width: 0; }
  th.words, td.words { min-width: 5.5rem; }
  pre { white-space: pre-wrap; font-size: 7.5pt; }
  tr, figure, table.short { break-inside: avoid; }
  h2, h3, summary { break-after: avoid; }
  thead { display: table-header-group; }
  .wide img { width: auto; max-width: min(100%, 0.62 * var(--wide)); max-height: 220mm; }
  details::details-content { content-visibility: visible; block-size: auto; }
  a { color: inherit; text-decoration: none; }
}
"""
LONG, HEAD, TAIL = 300, 20, 5  # lines: a longer text shows its first and its last ones
SHORT = 12  # rows: no longer table is kept on one sheet of paper
MARKS = {"flyable": "verdict", "infeasible": "verdict bad", "failed": "verdict bad"}


class Bad(str):
    """A text that tells a failure."""


@dataclass(frozen=True)
class Section:
    """A part of the page with an anchor that its table of contents leads to."""

    anchor: str
    title: str
    content: str

    def markup(self, level: int) -> str:
        """The section with a heading of that level."""
        return f'<h{level} id="{self.anchor}">{html.escape(self.title)}</h{level}>\n{self.content}'


def document(title: str, lead: str, sections: Sequence[Section]) -> str:
    """The whole page: what to know first, where to find what, and the sections.

    ``title``; ``lead``: what comes first, markup; ``sections`` in their order.
    """
    contents = "".join(f'<li><a href="#{one.anchor}">{html.escape(one.title)}</a></li>' for one in sections)
    name = html.escape(title)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{name}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{name}</h1>\n{lead}"
        f"<nav>\n<ul>{contents}</ul>\n</nav>\n{''.join(one.markup(2) for one in sections)}</body>\n</html>\n"
    )


def table(
    headings: Sequence[str], rows: Iterable[Sequence[str]], *, words: Collection[int] = (), total: bool = False
) -> str:
    """A table that scrolls in its own box; columns ``words`` hold text that may wrap; ``total``: the last row sums.

    ``headings`` and ``rows``: texts, which are escaped.
    """
    head = "".join(f"<th{_class(words, column)}>{html.escape(text)}</th>" for column, text in enumerate(headings))
    lines = ["".join(_cell(text, words, column) for column, text in enumerate(row)) for row in rows]
    body = [f"<tr>{line}</tr>" for line in lines]
    if total and body:
        body[-1] = f'<tr class="sum">{lines[-1]}</tr>'
    kind = ' class="short"' if len(lines) <= SHORT else ""
    return (
        f'<div class="wide"><table{kind}><thead><tr>{head}</tr></thead><tbody>{"".join(body)}</tbody></table></div>\n'
    )


def _class(words: Collection[int], column: int) -> str:
    return ' class="words"' if column in words else ""


def _cell(text: str, words: Collection[int], column: int) -> str:
    mark = f' class="{MARKS[text]}"' if text in MARKS else _class(words, column)
    return f"<td{mark}>{html.escape(text)}</td>"


def folded(summary: str, content: str, *, opened: bool = False) -> str:
    """What is shown when asked for, and on paper.

    ``summary``: text that always shows; ``content``: markup; ``opened``: shown from the start.
    """
    state = " open" if opened else ""
    return f"<details{state}><summary>{html.escape(summary)}</summary>\n{content}</details>\n"


def note(text: str) -> str:
    """A remark below a table.

    ``text``: escaped here.
    """
    return f'<p class="note">{html.escape(text[:1].upper() + text[1:])}.</p>\n'


def paragraph(text: str) -> str:
    """A paragraph of plain text."""
    return f"<p>{html.escape(text)}</p>\n"


def verbatim(text: str) -> str:
    """The ``text`` of a file, letter by letter; of more than LONG lines, as of a record of fixes, the two ends."""
    lines = text.splitlines()
    if len(lines) > LONG:
        left_out = f"... {len(lines) - HEAD - TAIL} of {len(lines)} lines, which result.nc has (mission_text) ..."
        text = "\n".join([*lines[:HEAD], left_out, *lines[-TAIL:]])
    return f"<pre>{html.escape(text)}</pre>\n"


def listed(items: Iterable[str | Bad], *, lead: bool = False) -> str:
    """A list of plain texts; ``lead``: what to know first, in larger letters."""
    inner = "".join(
        f'<li class="bad">{html.escape(item)}</li>' if isinstance(item, Bad) else f"<li>{html.escape(item)}</li>"
        for item in items
    )
    return f'<ul class="lead">{inner}</ul>\n' if lead else f"<ul>{inner}</ul>\n"


def picture(caption: str, content: bytes) -> str:
    """A PNG inside the page, with its caption.

    ``content``: of the PNG file.
    """
    words, data = html.escape(caption), base64.b64encode(content).decode("ascii")
    width, height = struct.unpack(">II", content[16:24])  # of a PNG's first chunk
    size = f'width="{width}" height="{height}" style="--wide: {width}px"'  # known before it is drawn: nothing moves
    image = f'<img src="data:image/png;base64,{data}" {size} alt="{words}">'
    return f'<figure><div class="wide">{image}</div><figcaption>{words}</figcaption></figure>\n'
