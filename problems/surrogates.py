"""Everything measured about the surrogates, written to problems/surrogates.md with its figures.

    vrsopt sample --samples 500 --seed 2 --out test_level.db
    vrsopt sample --samples 500 --seed 2 --space flight --out test_flight.db
    python problems/surrogates.py --fresh-level test_level.db --fresh-flight test_flight.db

The first two commands make the fresh points, which no surrogate has seen; designs and surrogates are the shipped ones
(--level, --flight and --surrogate-level, --surrogate-flight name others). Less than five minutes of CPU time.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import design_space
import leave_one_out
import surrogate_errors as errors
from page_table import table, write_below
from surrogate_data import DESIGNS, SURROGATES, WORDS, read
from surrogate_errors import Learned, Space
from surrogate_fuel import Route, routes, routes_table

from vrsopt.errors import InputError
from vrsopt.report.plots import png
from vrsopt.surrogate import store

PAGE = Path(__file__).with_name("surrogates.md")
MARKER = "<!-- tables: everything below is written by problems/surrogates.py -->"
FIGURES = Path(__file__).with_name("figures")
LEARNING = FIGURES / "learning_curve.png"


def counts(spaces: Sequence[Space]) -> Iterator[str]:
    """How many points, and what became of them."""
    kinds = sorted({status for space in spaces for status in space.flyable.status} - {"ok"})
    yield from table(
        ("variables", "inputs", "seed", "points", "flyable", "converged", *kinds, "fresh flyable points, seed"),
        (
            (
                space.words,
                ", ".join(name.replace("_", " ") for name in space.flyable.meta.names),
                space.flyable.meta.seed,
                space.flyable.status.total(),
                len(space.flyable),
                len(space.converged),
                *(space.flyable.status[kind] for kind in kinds),
                f"{len(space.fresh)}, {space.fresh.meta.seed}",
            )
            for space in spaces
        ),
    )


def explained(space: Space) -> Iterator[str]:
    """R2 of the polynomials in airspeed and the shares of all inputs."""
    points = space.flyable
    found = design_space.regressions(points)
    shares = design_space.shares(points.scaled(), points.column(design_space.POWER))
    yield "R2 of the shaft power on polynomials in airspeed, five variables:\n"
    yield from table(
        ("order", *map(str, design_space.ORDERS)),
        [("R2", *(f"{score:.4f}" for _, score in found))],
    )
    yield "Shares of the inputs in its variance, %:\n"
    yield from table(
        (name.replace("_", " ") for name in points.meta.names), [[f"{100 * share:.2f}" for share in shares]]
    )


def lines(spaces: Sequence[Space]) -> Iterator[str]:
    """Everything below the marker; draws the figures."""
    level = spaces[0]
    yield "\n## Designs of experiments\n"
    yield from counts(spaces)
    yield "## Design space\n"
    drawn = design_space.draw(level.flyable, level.surrogate.models[design_space.POWER])
    design_space.FIGURE.write_bytes(png(drawn))
    yield "![Shaft power over airspeed](figures/design_space.png)\n"
    yield from explained(level)
    yield "## Leave-one-out of the fuel flow\n"
    found = leave_one_out.study({space.name: (space.flyable, space.converged) for space in spaces})
    leave_one_out.FIGURE.write_bytes(png(leave_one_out.draw(leave_one_out.flyable(found))))
    yield "![Predicted against computed fuel flow](figures/leave_one_out.png)\n"
    yield from leave_one_out.rows(found)
    yield "## Correlations and trends\n"
    yield "Fuel flow: leave-one-out on the flyable points, and the fresh points.\n"
    yield from errors.choices(spaces)
    yield "## Leave-one-out of every output\n"
    for space in spaces:
        yield f"{space.words.capitalize()} variables:\n"
        yield from errors.every_output(space)
    yield "## Learning curve\n"
    curves: dict[str, list[Learned]] = {space.name: errors.learning(space) for space in spaces}
    LEARNING.write_bytes(png(errors.draw_learning(curves)))
    yield "![Error against number of points](figures/learning_curve.png)\n"
    yield from errors.learning_table(curves)
    yield "## Fresh points\n"
    for space in spaces:
        yield f"{space.words.capitalize()} variables:\n"
        yield from errors.fresh_table(space)
    yield "Fuel flow of the points left out, by their share of the blade-loading limit:\n"
    yield from errors.by_limit(spaces)
    yield "## Two routes to fuel\n"
    ways: dict[str, list[Route]] = {WORDS[space.name]: routes(space) for space in spaces}
    yield from routes_table(ways)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="Everything measured about the surrogates.")
    for space in DESIGNS:
        parser.add_argument(f"--{space}", type=Path, default=DESIGNS[space], help="design of experiments")
        parser.add_argument(f"--fresh-{space}", type=Path, required=True, help="points that no surrogate has seen")
        parser.add_argument(f"--surrogate-{space}", type=Path, default=SURROGATES[space])
    options = vars(parser.parse_args(arguments))
    begin = time.process_time()
    try:
        spaces = [
            Space(
                name,
                read(options[name]),
                read(options[name], flyable=False),
                read(options[f"fresh_{name}"]),
                store.load(options[f"surrogate_{name}"]),
            )
            for name in DESIGNS
        ]
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        raise SystemExit(2) from None
    text = "\n".join(lines(spaces)).rstrip()
    write_below(MARKER, PAGE, f"{text}\n", title="Surrogates")
    print(text)
    print(f"{time.process_time() - begin:.0f} s of CPU time", file=sys.stderr)


if __name__ == "__main__":
    main()
