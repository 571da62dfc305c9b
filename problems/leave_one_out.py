"""Leave-one-out of the fuel flow: predicted against computed, for the reference study's correlation and ours.

    python problems/leave_one_out.py [--level design.db] [--flight flight.db] [--out figure.png]

Every point is predicted by the Kriging without it (closed form, trend estimated anew). The figure has the flyable
points in five and in seven variables; the printed table has all converged points beside them. Errors are related to
the computed value. The study gives 1.17 % once as an RMS and once as a mean: both are there.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from page_table import table
from surrogate_data import DESIGNS, OURS, STUDY, WORDS, Array, Points, fitted, read

from vrsopt.console import check_file
from vrsopt.errors import InputError
from vrsopt.report.plots import png
from vrsopt.report.style import BLACK, BLUE, NORMAL, SMALL, VERMILION, new_figure, tidy
from vrsopt.surrogate.validation import Accuracy, accuracy

FIGURE = Path(__file__).with_name("figures") / "leave_one_out.png"
FUEL = "fuel_flow"
HOUR = 3600.0  # s
NAMES = {STUDY: "exponential (the study's)", OURS: "squared exponential (ours)"}
COLOURS = {STUDY: VERMILION, OURS: BLUE}
FIGURES = ("Pearson %", "slope deg", "bias %", "mean abs. error %", "RMS error %", "standard deviation %")


@dataclass(frozen=True)
class LeftOut:
    """Fuel flow [kg/s] of the points (n,), predicted without each, with its figures."""

    computed: Array
    predicted: Array
    figures: Accuracy


def left_out(points: Points, correlation: str, name: str = FUEL) -> LeftOut:
    """Leave-one-out of one output with a Kriging of the ``points``."""
    computed, predicted = fitted(points, name, correlation)[0].leave_one_out()
    return LeftOut(computed, predicted, accuracy(computed, predicted))


def cells(figures: Accuracy) -> list[str]:
    """The figures in the order of ``FIGURES``."""
    return [
        f"{figures.pearson_percent:.4f}",
        f"{figures.slope_deg:.3f}",
        f"{figures.bias_percent:+.4f}",
        f"{figures.mean_abs_error_percent:.4f}",
        f"{figures.rms_error_percent:.4f}",
        f"{figures.std_error_percent:.4f}",
    ]


def draw(found: Mapping[tuple[str, str], LeftOut]) -> Any:
    """One column for each space and correlation: predicted against computed fuel flow, and the error below."""
    figure = new_figure(3.0 * len(found) + 0.6, 4.9)
    rows = figure.subplots(2, len(found), sharex=True, sharey="row", gridspec_kw={"height_ratios": [2.6, 1.0]})
    for (upper, lower), ((space, correlation), one) in zip(rows.T, found.items(), strict=True):
        x, y = HOUR * one.computed, HOUR * one.predicted
        ends = np.array([x.min(), x.max()])
        upper.plot(ends, ends, color=BLACK, lw=0.8)
        upper.plot(x, y, ".", color=COLOURS[correlation], markersize=3)
        lower.axhline(0.0, color=BLACK, lw=0.8)
        lower.plot(x, 100.0 * (y / x - 1.0), ".", color=COLOURS[correlation], markersize=3)
        words = zip(FIGURES, cells(one.figures), strict=True)
        text = "\n".join(f"{name.replace('standard deviation', 'std. deviation')}  {value}" for name, value in words)
        upper.text(0.97, 0.04, text, transform=upper.transAxes, ha="right", va="bottom", fontsize=SMALL - 1)
        upper.set_title(f"{WORDS[space]} variables, {NAMES[correlation].split(' (')[0]}", fontsize=NORMAL)
        lower.set_xlabel("computed, kg/h", fontsize=SMALL)
        for axes in (upper, lower):
            tidy(axes)
    rows[0, 0].set_ylabel("fuel flow predicted without the point, kg/h", fontsize=SMALL)
    rows[1, 0].set_ylabel("error, %", fontsize=SMALL)
    return figure


def rows(found: Mapping[tuple[str, str, str], LeftOut]) -> Iterator[str]:
    """Lines of the table: space, correlation, flyable or all converged points."""
    yield from table(
        ("variables", "correlation", "points", "", *FIGURES),
        (
            (WORDS[space], NAMES[correlation], kind, len(one.computed), *cells(one.figures))
            for (space, correlation, kind), one in found.items()
        ),
    )


def study(spaces: Mapping[str, tuple[Points, Points]]) -> dict[tuple[str, str, str], LeftOut]:
    """Leave-one-out of the fuel flow for the (flyable, all converged) points of every space, with both correlations."""
    return {
        (space, correlation, kind): left_out(points, correlation)
        for space, both in spaces.items()
        for kind, points in zip(("flyable", "all converged"), both, strict=True)
        for correlation in (STUDY, OURS)
    }


def flyable(found: Mapping[tuple[str, str, str], LeftOut]) -> dict[tuple[str, str], LeftOut]:
    """What the figure shows."""
    return {(space, correlation): one for (space, correlation, kind), one in found.items() if kind == "flyable"}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="Leave-one-out of the fuel flow.")
    for space in DESIGNS:
        parser.add_argument(f"--{space}", type=Path, default=DESIGNS[space])
    parser.add_argument("--out", type=Path, default=FIGURE)
    options = parser.parse_args(arguments)
    try:
        check_file(options.out)
        paths = {space: getattr(options, space) for space in DESIGNS}
        found = study({space: (read(path), read(path, flyable=False)) for space, path in paths.items()})
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        raise SystemExit(2) from None
    options.out.write_bytes(png(draw(flyable(found))))
    print(*rows(found), sep="\n")


if __name__ == "__main__":
    main()
