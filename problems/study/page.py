"""One HTML page with every figure and table of the study, self-contained."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

from .finding import FIGURES

STYLE = """body{font:16px/1.5 sans-serif;max-width:72rem;margin:2rem auto;padding:0 1rem}figure{margin:1rem 0}
.wide{overflow-x:auto}img{max-width:100%;min-width:44rem}figcaption{font-size:.9rem;color:#444}
.study{border-left:.25rem solid #E69F00;padding-left:.8rem}
table{border-collapse:collapse;font-size:.85rem;margin:1rem 0;display:block;overflow-x:auto}
td,th{padding:.2rem .6rem;border-bottom:1px solid #ddd;text-align:right}
td:first-child,th:first-child{text-align:left}"""
HEAD = """<p>A Bo 105 helicopter turns its rotor at one speed with one blade twist. The reference study let both follow
the flight condition, to burn less fuel. Here each of its figures and tables is made again with <code>vrsopt</code>.</p>
<p class="study">Paragraphs with this mark say what the reference study has. It used closed codes and does not publish
its missions in full: what is set beside its numbers is comparable in kind.</p>
<p>Everything else, every figure and every number of a table that is not called prescribed or published, is ours.</p>
<p>100 % of rotor speed is the nominal 44.4 rad/s; the nominal twist is 8 deg. PATM is an air taxi, LEM a police flight,
SARM a search and rescue. Savings are against the nominal rotor.</p>"""


def page(kept: Mapping[str, Mapping[str, Any]], *, figures: Path = FIGURES) -> str:
    """HTML of the findings ``kept``, as in their JSON, by name."""
    links = "".join(f'<li><a href="#{name}">{escape(one["title"])}</a></li>' for name, one in kept.items())
    parts = "".join(_part(name, one, figures) for name, one in kept.items())
    return (
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width,initial-scale=1"><title>The reference study</title>'
        f"<style>{STYLE}</style></head><body><h1>The reference study, reproduced</h1>{HEAD}<ul>{links}</ul>"
        f"{parts}</body></html>\n"
    )


def _part(name: str, one: Mapping[str, Any], figures: Path) -> str:
    said = f'<p class="study">The study: {escape(one["study"])}</p>'
    words = "".join(f"<p>{escape(sentence)}</p>" for sentence in one["sentences"])
    pictures = "".join(_picture(figures / picture["file"], picture["caption"]) for picture in one["figures"])
    head = "".join(f"<th>{escape(str(cell))}</th>" for cell in one["header"])
    rows = "".join(
        "<tr>" + "".join(f"<td>{'' if cell is None else escape(str(cell))}</td>" for cell in row) + "</tr>"
        for row in one["rows"]
    )
    title = f'<h2 id="{name}">{escape(one["title"])}</h2>'
    command = f"<p><code>{escape(one['command'])}</code></p>"
    return f"{title}{said}{words}{pictures}<table><tr>{head}</tr>{rows}</table>{command}"


def _picture(file: Path, caption: str) -> str:
    data = base64.b64encode(file.read_bytes()).decode()
    image = f'<img alt="{escape(file.stem.replace("_", " "))}" src="data:image/png;base64,{data}">'
    return f'<figure><div class="wide">{image}</div><figcaption>{escape(caption)}</figcaption></figure>'
