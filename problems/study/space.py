"""Design space: shaft power against airspeed, polynomials of order 1 to 5, and what explains the rest."""

from __future__ import annotations

from pathlib import Path

from design_space import ORDERS, POWER, draw, regressions, shares
from surrogate_data import DESIGNS, fitted, read

from .finding import Finding, Picture, Table


def run(design: Path = DESIGNS["level"]) -> Finding:
    """The figure of problems/design_space.py and its numbers."""
    points = read(design)
    scores = [score for _, score in regressions(points)]
    share = dict(zip(points.meta.names, shares(points.scaled(), points.column(POWER)), strict=True))
    rows = [[f"order {order} in airspeed", round(score, 4), None] for order, score in zip(ORDERS, scores, strict=True)]
    rows += [[name.replace("_", " "), None, round(100.0 * value, 2)] for name, value in share.items()]
    first = max(share, key=lambda name: share[name])
    sentences = [
        f"Airspeed alone explains {100 * scores[0]:.0f} % (order 1) to {100 * scores[-1]:.0f} % (order 5) of the "
        f"variance of the power over {len(points)} flyable points. The largest share of all inputs is that of "
        f"{first.replace('_', ' ')}, {100 * share[first]:.0f} %; all together explain {100 * sum(share.values()):.1f} "
        "%.",
    ]
    said = (
        "Shaft power against airspeed with polynomials of order 1 to 5; what the scatter around them is made of, it "
        "does not say."
    )
    caption = (
        "Every point is one trim of the design of experiments. Left: polynomials in airspeed alone, as the study's. "
        "Middle: the same points by rotor speed, with our surrogate at three of them. Right: shares of the inputs in "
        "the variance of the power."
    )
    figure = draw(points, fitted(points, POWER)[0])
    head = ("", "R2", "share of variance %")
    return Finding("Design space", said, sentences, Table(head, rows), {"design_space": Picture(figure, caption)})
