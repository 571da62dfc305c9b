"""The design space: shaft power against airspeed over the flyable points, and what the scatter is made of.

    python problems/design_space.py [--design design.db] [--out figure.png]

The reference study draws shaft power against airspeed with polynomial regressions of order 1 to 5. They answer how
much of the power airspeed explains. Beside it what the rest is made of: the same points by rotor speed, with the
Kriging at three of them, and the shares of all inputs in the variance of the power (Shapley values of the R2 of quartic
regressions).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from itertools import combinations
from math import factorial
from pathlib import Path
from typing import Any

import numpy as np
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures
from surrogate_data import DESIGNS, Array, Points, fitted, read

from vrsopt.console import check_file
from vrsopt.errors import InputError
from vrsopt.report.plots import png
from vrsopt.report.style import BLACK, BLUE, GREEN, GREY, NORMAL, ORANGE, PURPLE, SMALL, VERMILION, new_figure, tidy
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.space import NOMINAL_ROTOR_SPEED

FIGURE = Path(__file__).with_name("figures") / "design_space.png"
POWER = "shaft_power_per_engine"
ORDERS = (1, 2, 3, 4, 5)
LINES = ((BLACK, ":"), (ORANGE, "-"), (GREEN, "--"), (PURPLE, "-."), (VERMILION, "--"))
QUARTIC = 4
RATIOS = (80.0, 95.0, 110.0)  # rotor speeds of the lines, %
NEAR = 0.03  # of the ranges of airspeed and rotor speed: as far from a flyable point a line is drawn


def regression(inputs: Array, output: Array, order: int) -> tuple[Any, float]:
    """Least-squares polynomial of total degree ``order`` in ``inputs`` (n, k), and its R2."""
    model = make_pipeline(PolynomialFeatures(order), LinearRegression()).fit(inputs, output)
    return model, float(model.score(inputs, output))


def shares(inputs: Array, output: Array, order: int = QUARTIC) -> Array:
    """Shapley values (k,) of the R2: what each input adds, on average over the orders in which they can be added.

    They sum to the R2 of the regression in all inputs, also where inputs depend on each other, as flyable points do.
    """
    count = inputs.shape[1]
    explained = {(): 0.0}
    for size in range(1, count + 1):
        for chosen in combinations(range(count), size):
            explained[chosen] = regression(inputs[:, chosen], output, order)[1]
    values = np.zeros(count)
    for chosen, score in explained.items():
        size = len(chosen)
        for k in range(count):
            if k in chosen:
                weight = factorial(size - 1) * factorial(count - size) / factorial(count)
                values[k] += weight * (score - explained[tuple(i for i in chosen if i != k)])
    return values


def regressions(points: Points) -> list[tuple[Any, float]]:
    """Polynomials of ``ORDERS`` in the airspeed (scaled to [0, 1]) for the power [W], with their R2."""
    column = [points.meta.names.index("speed")]
    return [regression(points.scaled()[:, column], points.column(POWER), order) for order in ORDERS]


def lines(points: Points, model: Kriging, speed: Array) -> Array:
    """The Kriging [W] over ``speed`` (k,) [m/s] at ``RATIOS`` (3, k), the other inputs at the mean of the points.

    NaN where no flyable point is near in rotor speed and airspeed.
    """
    lower, upper = np.array(points.meta.lower), np.array(points.meta.upper)
    columns = [points.meta.names.index(name) for name in ("speed", "rotor_speed")]
    found = np.full((len(RATIOS), len(speed)), np.nan)
    for row, ratio in zip(found, RATIOS, strict=True):
        place = np.tile(points.inputs.mean(axis=0), (len(speed), 1))
        place[:, columns] = np.column_stack([speed, np.full(len(speed), 0.01 * ratio * NOMINAL_ROTOR_SPEED)])
        near = np.min(
            np.linalg.norm(((place - lower) / (upper - lower))[:, None, columns] - points.scaled()[:, columns], axis=2),
            axis=1,
        )
        row[near < NEAR] = model.predict(place[near < NEAR])
    return found


def draw(points: Points, model: Kriging) -> Any:
    """Three panels: regressions in airspeed, the same points by rotor speed with the Kriging, shares of the inputs."""
    figure = new_figure(11.5, 4.6)
    left, middle, right = figure.subplots(1, 3, gridspec_kw={"width_ratios": [1.15, 1.35, 0.7]})
    middle.sharey(left)
    speed, power = points.column("speed"), 1e-3 * points.column(POWER)
    lower, upper = (bounds[points.meta.names.index("speed")] for bounds in (points.meta.lower, points.meta.upper))
    u = np.linspace(0.0, 1.0, 141)
    left.plot(speed, power, ".", color=GREY, markersize=3, alpha=0.6)
    for order, (colour, line), (curve, score) in zip(ORDERS, LINES, regressions(points), strict=True):
        label = f"order {order}, $R^2$ = {score:.3f}"
        left.plot(lower + (upper - lower) * u, 1e-3 * curve.predict(u[:, None]), line, color=colour, lw=2, label=label)
    left.set_title(f"polynomials in airspeed, {len(points)} flyable points", fontsize=NORMAL)
    ratio = 100.0 * points.column("rotor_speed") / NOMINAL_ROTOR_SPEED
    marks = middle.scatter(speed, power, c=ratio, s=7, cmap="cividis", linewidths=0)
    bar = figure.colorbar(marks, ax=middle)
    bar.set_label("rotor speed, % of nominal", fontsize=SMALL)
    bar.ax.tick_params(labelsize=SMALL)
    at = lower + (upper - lower) * u
    for values, percent, line in zip(lines(points, model, at), RATIOS, ("-", "--", ":"), strict=True):
        middle.plot(at, 1e-3 * values, color=VERMILION, ls=line, lw=2.2, label=f"Kriging at {percent:.0f} %")
    middle.set_title("the same points by rotor speed", fontsize=NORMAL)
    for axes in (left, middle):
        axes.set_xlabel("true airspeed, m/s", fontsize=SMALL)
        axes.set_ylim(0.0, 1.12 * power.max())
        axes.legend(fontsize=SMALL, loc="upper center", ncols=1, framealpha=0.9, edgecolor="none")
        tidy(axes)
    left.set_ylabel("shaft power of one engine, kW", fontsize=SMALL)
    draw_shares(right, points)
    return figure


def draw_shares(axes: Any, points: Points) -> None:
    """Bars of the inputs' shares in the variance of the power."""
    values = 100.0 * shares(points.scaled(), points.column(POWER))
    order = np.argsort(values)
    names = [points.meta.names[k].replace("_", " ") for k in order]
    axes.barh(names, values[order], color=BLUE)
    for row, value in enumerate(values[order]):
        axes.text(value + 1.0, row, f"{value:.1f}", va="center", fontsize=SMALL)
    axes.set_xlim(0.0, 1.25 * values.max())
    axes.set_xlabel("share of the variance, %", fontsize=SMALL)
    axes.set_title(f"what explains it: {values.sum():.1f} %", fontsize=NORMAL)
    tidy(axes)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="Shaft power over the design space.")
    parser.add_argument("--design", type=Path, default=DESIGNS["level"])
    parser.add_argument("--out", type=Path, default=FIGURE)
    options = parser.parse_args(arguments)
    try:
        check_file(options.out)
        points = read(options.design)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        raise SystemExit(2) from None
    options.out.write_bytes(png(draw(points, fitted(points, POWER)[0])))
    for order, (_, score) in zip(ORDERS, regressions(points), strict=True):
        print(f"order {order} in airspeed   R2 = {score:.4f}")
    for name, share in zip(points.meta.names, shares(points.scaled(), points.column(POWER)), strict=True):
        print(f"{name:<20}{100 * share:6.2f} % of the variance")


if __name__ == "__main__":
    main()
