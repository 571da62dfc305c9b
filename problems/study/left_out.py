"""Leave-one-out of the fuel flow with the study's correlation and ours."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from leave_one_out import FIGURES, NAMES, cells, draw, flyable, study
from surrogate_data import DESIGNS, OURS, STUDY, WORDS, read

from .finding import Finding, Picture, Table

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
            f"{other.mean_abs_error_percent:.3f} % and a Pearson correlation of {other.pearson_percent:.4f} %, the "
            f"squared exponential {own.mean_abs_error_percent:.3f} % and {own.pearson_percent:.4f} %."
        )
    said = (
        f"A correlation of {PUBLISHED[0]} % and an error of {PUBLISHED[1]} %, which it calls RMS in one place and mean "
        "in another, over points from its own, closed codes."
    )
    caption = (
        "Fuel flow of both engines at every flyable point as computed, and as predicted by a surrogate that has not "
        "seen the point; below, the error. The study's correlation is the exponential one, ours the squared one."
    )
    head = ("variables", "correlation", "points", "number", *FIGURES)
    figures = {"leave_one_out": Picture(draw(flyable(found)), caption)}
    sentences.append("The last row of the table has the published numbers, the error among the means.")
    return Finding("Leave-one-out", said, sentences, Table(head, rows), figures)
