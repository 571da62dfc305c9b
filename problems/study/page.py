"""One HTML page with every figure and table of the study, self-contained."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

from .finding import FIGURES

STYLE = """body{font:16px/1.5 sans-serif;max-width:72rem;margin:2rem auto;padding:0 1rem}img{max-width:100%}
table{border-collapse:collapse;font-size:.85rem;margin:1rem 0;display:block;overflow-x:auto}
td,th{padding:.2rem .6rem;
border-bottom:1px solid #ddd;text-align:right}td:first-child,th:first-child{text-align:left}"""
HEAD = """The reference study used closed codes and does not publish its missions. What is set beside its numbers is
comparable in kind; where a number is known it is stated."""


def page(kept: Mapping[str, Mapping[str, Any]], *, figures: Path = FIGURES) -> str:
    """HTML of the findings ``kept``, as in their JSON, by name."""
    links = "".join(f'<li><a href="#{name}">{escape(one["title"])}</a></li>' for name, one in kept.items())
    parts = "".join(_part(name, one, figures) for name, one in kept.items())
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>The reference study</title>'
        f"<style>{STYLE}</style></head><body><h1>The reference study, reproduced</h1><p>{HEAD}</p><ul>{links}</ul>"
        f"{parts}</body></html>\n"
    )


def _part(name: str, one: Mapping[str, Any], figures: Path) -> str:
    words = "".join(f"<p>{escape(sentence)}</p>" for sentence in one["sentences"])
    pictures = "".join(_picture(figures / file) for file in one["figures"])
    head = "".join(f"<th>{escape(str(cell))}</th>" for cell in one["header"])
    rows = "".join(
        "<tr>" + "".join(f"<td>{'' if cell is None else escape(str(cell))}</td>" for cell in row) + "</tr>"
        for row in one["rows"]
    )
    title = f'<h2 id="{name}">{escape(one["title"])}</h2>'
    return f"{title}{words}{pictures}<table><tr>{head}</tr>{rows}</table><p><code>{escape(one['command'])}</code></p>"


def _picture(file: Path) -> str:
    data = base64.b64encode(file.read_bytes()).decode()
    return f'<p><img alt="{escape(file.stem.replace("_", " "))}" src="data:image/png;base64,{data}"></p>'
