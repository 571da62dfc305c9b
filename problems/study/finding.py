"""What every part of the study hands over: sentences, tables and figures, kept as JSON and PNG."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from vrsopt.report.plots import png

RESULTS = Path(__file__).with_name("results")
FIGURES = Path(__file__).parents[1] / "figures"


@dataclass(frozen=True)
class Table:
    """A table with its unit-carrying ``header`` and ``rows`` of numbers and words."""

    header: Sequence[str]
    rows: Sequence[Sequence[Any]]


@dataclass(frozen=True)
class Picture:
    """A drawn ``figure`` with the ``caption`` that says how to read it."""

    figure: Any
    caption: str


@dataclass(frozen=True)
class Finding:
    """One figure or table of the study: ``title``; ``study``, what the study has there and what it publishes of it;
    ``sentences`` made from our numbers, ``table``, and ``figures`` by name."""

    title: str
    study: str
    sentences: Sequence[str]
    table: Table
    figures: Mapping[str, Picture] = field(default_factory=dict)


def save(name: str, found: Finding, *, results: Path = RESULTS, figures: Path = FIGURES) -> dict[str, Any]:
    """Write the figures as ``study_*.png`` and the rest as ``name``.json; returns what the JSON says."""
    pictures = {f"study_{key}.png": png(picture.figure) for key, picture in found.figures.items()}
    for file, content in pictures.items():
        (figures / file).write_bytes(content)
    kept = {
        "title": found.title,
        "command": f"python -m problems.study {name}",
        "study": found.study,
        "sentences": list(found.sentences),
        "header": list(found.table.header),
        "rows": [list(row) for row in found.table.rows],
        "figures": [
            {"file": file, "caption": picture.caption}
            for file, picture in zip(pictures, found.figures.values(), strict=True)
        ],
    }
    results.mkdir(exist_ok=True)
    text = json.dumps(kept, indent=1, allow_nan=False, ensure_ascii=False)
    (results / f"{name}.json").write_text(text + "\n", encoding="utf-8")
    return kept
