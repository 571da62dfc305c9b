"""Leave-one-out of the fuel flow with the study's correlation and ours."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from leave_one_out import FIGURES, NAMES, cells, draw, flyable, study
from surrogate_data import DESIGNS, OURS, STUDY, WORDS, read

from .finding import Finding, Table

PUBLISHED = (99.64, 1.17)  # %: correlation, and the error that the study calls RMS once and mean once


def run(designs: Mapping[str, Path] = DESIGNS) -> Finding:
    """The figure of problems/leave_one_out.py and its numbers."""
    found = study({space: (read(path), read(path, flyable=False)) for space, path in designs.items()})
    rows = [
        [WORDS[space], NAMES[correlation], kind, len(one.computed), *(float(cell) for cell in cells(one.figures))]
        for (space, correlation, kind), one in found.items()
    ]
    rows.append(["five", "published by the study", None, None, PUBLISHED[0], None, None, PUBLISHED[1], None, None])
    sentences = []
    for space in designs:
        own, other = (found[space, correlation, "flyable"].figures for correlation in (OURS, STUDY))
        sentences.append(
            f"In {WORDS[space]} variables the study's exponential correlation has a mean error of "
            f"{other.mean_abs_error_percent:.3f} % and a Pearson correlation of {other.pearson_percent:.2f} %, the "
            f"squared exponential {own.mean_abs_error_percent:.3f} % and {own.pearson_percent:.3f} %."
        )
    sentences.append(
        f"The study reports {PUBLISHED[0]} % and {PUBLISHED[1]} %, over points from its own, closed codes; its error "
        "is put among the means here although it is called RMS in one place."
    )
    head = ("variables", "correlation", "points", "number", *FIGURES)
    return Finding("Leave-one-out", sentences, Table(head, rows), {"leave_one_out": draw(flyable(found))})
