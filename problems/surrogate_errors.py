"""How well the surrogates predict: every output left out, correlations and trends, learning curve, fresh points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Any

import numpy as np
from leave_one_out import FUEL, cells
from numpy.typing import NDArray
from page_table import table
from sklearn.cluster import KMeans
from surrogate_data import OURS, STUDY, WORDS, Array, Points, cpu, fitted

from vrsopt.atmosphere import standard_air
from vrsopt.helicopter import helicopter
from vrsopt.limits import Limits
from vrsopt.report.style import BLACK, BLUE, NORMAL, SMALL, VERMILION, new_figure, tidy
from vrsopt.surrogate.design import AIRCRAFT
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.store import Surrogate
from vrsopt.surrogate.validation import accuracy, coverage, held_out_coverage, leave_one_out_coverage

CORRELATIONS = (STUDY, "matern52", OURS)
TRENDS = ("constant", "linear", "quadratic")
PLAIN = (100, 200, 300, 500, 700, 1000, 1500)
ENHANCED = (50, 100, 200, 300)
NAMES = {"rms": "RMS", "mean_absolute": "mean absolute"}
TICKS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0)
SHARES = (0.0, 0.5, 0.7, 0.85, 1.0)  # of the blade-loading limit


@dataclass(frozen=True)
class Space:
    """One space of designs: its flyable and its converged points, fresh flyable points and the shipped surrogate."""

    name: str
    flyable: Points
    converged: Points
    fresh: Points
    surrogate: Surrogate

    @property
    def words(self) -> str:
        return WORDS[self.name]


@dataclass(frozen=True)
class Learned:
    """A Kriging on ``count`` points, the first or well spread ones: errors [%] at the fresh points, CPU time [s]."""

    count: int
    enhanced: bool
    spread: bool
    mean_absolute: float
    rms: float
    seconds: float


def normalised(computed: Array, predicted: Array) -> float:
    """RMS error over the standard deviation of the output, %: a measure for outputs that come near zero."""
    return float(100.0 * np.sqrt(np.mean((predicted - computed) ** 2)) / np.std(computed))


def every_output(space: Space) -> Iterator[str]:
    """Leave-one-out table of every output of the shipped surrogate, beside it a fit on all converged points."""
    rows = []
    for name, model in space.surrogate.models.items():
        state = model.state_
        computed, predicted = model.leave_one_out()
        _, outputs = space.converged.known(name)
        beside = ["", "", "", ""]
        if len(outputs) > len(computed):
            one = fitted(space.converged, name, state.correlation, state.trend)[0].leave_one_out()
            figures = accuracy(*one)
            errors = (figures.mean_abs_error_percent, figures.rms_error_percent, normalised(*one))
            beside = [str(len(outputs)), *(f"{error:.3f}" for error in errors)]
        own = [f"{normalised(computed, predicted):.4f}", *beside]
        kind = f"{state.correlation}, {state.trend}".replace("_", " ")
        rows.append([name.replace("_", " "), kind, len(computed), *cells(accuracy(computed, predicted)), *own])
    header = ("output", "correlation, trend", "points", "Pearson %", "slope deg", "bias %", "mean abs. %", "RMS %")
    more = ("std. dev. %", "RMS / spread %", "all converged", "mean abs. %", "RMS %", "RMS / spread %")
    yield from table((*header, *more), rows)


def choices(spaces: Sequence[Space]) -> Iterator[str]:
    """Correlations and trends: leave-one-out and fresh points of the fuel flow."""
    rows = []
    for space, correlation, trend in product(spaces, CORRELATIONS, TRENDS):
        model, fitting = fitted(space.flyable, FUEL, correlation, trend)
        left, leaving = cpu(model.leave_one_out)
        fresh = at_fresh(space, model)
        rows.append(
            (
                space.words,
                correlation.replace("_", " "),
                trend,
                *cells(accuracy(*left)),
                f"{fresh.mean_abs_error_percent:.4f}",
                f"{fresh.rms_error_percent:.4f}",
                f"{fitting:.1f}",
                f"{leaving:.2f}",
            )
        )
    header = ("variables", "correlation", "trend", "Pearson %", "slope deg", "bias %", "mean abs. %", "RMS %")
    yield from table((*header, "std. dev. %", "fresh, mean abs. %", "fresh, RMS %", "fit s", "leave-one-out s"), rows)


def at_fresh(space: Space, model: Kriging, name: str = FUEL) -> Any:
    """Figures of a Kriging at the fresh points."""
    inputs, computed = space.fresh.known(name)
    return accuracy(computed, model.predict(inputs))


def spread(scaled: Array, count: int) -> NDArray[np.intp]:
    """Rows of well spread points of ``scaled`` (n, d): those nearest to the centres of ``count`` clusters (k-means).

    Points that are far from each other would lie on the border, in seven variables nearly all.
    """
    centres = KMeans(count, n_init=1, random_state=0).fit(scaled).cluster_centers_
    return np.unique([np.argmin(np.sum((scaled - centre) ** 2, axis=1)) for centre in centres])


def learn(space: Space, rows: NDArray[np.intp], *, enhanced: bool) -> tuple[Kriging, float]:
    """Kriging of the fuel flow on some flyable points, with exact derivatives or without; CPU time of the fit [s]."""
    inputs, fuel = space.flyable.known(FUEL)
    slopes = space.flyable.gradients(FUEL)[rows] if enhanced else None
    model, seconds = cpu(lambda: space.flyable.kriging().fit(inputs[rows], fuel[rows], gradients=slopes))
    return model, seconds


def learning(space: Space) -> list[Learned]:
    """The learning curve of the first points, plain and gradient-enhanced, and the largest of the latter spread."""
    have = np.flatnonzero(np.isfinite(space.flyable.gradients(FUEL)).all(axis=1))
    cases = [(np.arange(count), False, False) for count in PLAIN]
    cases += [(have[:count], True, False) for count in ENHANCED]
    cases.append((have[spread(space.flyable.scaled()[have], ENHANCED[-1])], True, True))
    found = []
    for rows, enhanced, chosen in cases:
        model, seconds = learn(space, rows, enhanced=enhanced)
        figures = at_fresh(space, model)
        errors = (figures.mean_abs_error_percent, figures.rms_error_percent)
        found.append(Learned(len(rows), enhanced, chosen, *errors, seconds))
    return found


def learning_table(curves: Mapping[str, list[Learned]]) -> Iterator[str]:
    yield from table(
        ("variables", "points", "derivatives", "mean abs. error %", "RMS error %", "fit, CPU s"),
        (
            (
                WORDS[space],
                f"{one.count}, spread" if one.spread else f"first {one.count}",
                "with" if one.enhanced else "without",
                f"{one.mean_absolute:.4f}",
                f"{one.rms:.4f}",
                f"{one.seconds:.1f}",
            )
            for space, curve in curves.items()
            for one in curve
        ),
    )


def draw_learning(curves: Mapping[str, list[Learned]]) -> Any:
    """Error at the fresh points against the number of points, one panel for each space."""
    figure = new_figure(8.5, 4.3)
    panels = figure.subplots(1, len(curves), sharey=True, squeeze=False)[0]
    everything = [getattr(one, name) for curve in curves.values() for one in curve for name in NAMES]
    panels[0].set_ylim(0.8 * min(everything), 1.25 * max(everything))
    for axes, (space, curve) in zip(panels, curves.items(), strict=True):
        for enhanced, colour, mark, words in (
            (False, VERMILION, "o", "values"),
            (True, BLUE, "s", "values and derivatives"),
        ):
            own = [one for one in curve if one.enhanced is enhanced and not one.spread]
            for name, line in (("rms", "-"), ("mean_absolute", "--")):
                label = f"{words}, {NAMES[name]}"
                errors = [getattr(one, name) for one in own]
                axes.loglog([one.count for one in own], errors, mark, ls=line, color=colour, label=label, markersize=5)
        for one in (one for one in curve if one.spread):
            pair = [getattr(one, name) for name in NAMES]
            axes.loglog(
                [one.count] * 2, pair, "D", color=BLACK, mfc="none", label="values and derivatives, spread points"
            )
        last = [one for one in curve if not one.enhanced][-1]
        axes.axhline(last.rms, color=BLACK, lw=0.8, ls=":", label=f"{NAMES['rms']} of values at {last.count} points")
        axes.set_xticks([50, 100, 200, 300, 500, 1000, 1500], labels=["50", "100", "200", "300", "500", "1000", "1500"])
        axes.set_yticks(TICKS, labels=[f"{tick:g}" for tick in TICKS])
        axes.minorticks_off()
        axes.set_title(f"{WORDS[space]} variables", fontsize=NORMAL)
        axes.set_xlabel("flyable points fitted", fontsize=SMALL)
        tidy(axes)
    panels[0].set_ylabel("error of the fuel flow at fresh points, %", fontsize=SMALL)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=SMALL, frameon=False)
    return figure


def limit_usage(points: Points) -> Array:
    """Share of the blade-loading limit (n,), no margin."""
    machine = helicopter(AIRCRAFT)
    weight, rotor_speed, speed = (points.column(name) for name in ("mass", "rotor_speed", "speed"))
    if "load_factor" in points.meta.names:
        weight = weight * points.column("load_factor")
    density = standard_air(points.column("altitude")).density
    loading, largest = Limits(machine.aircraft, machine.engine).blade_loading(weight, density, rotor_speed, speed)
    return np.asarray(loading / largest)


def by_limit(spaces: Sequence[Space]) -> Iterator[str]:
    """Leave-one-out of the fuel flow by how near the points are to the blade-loading limit."""
    rows = []
    for space in spaces:
        usage = limit_usage(space.flyable)[np.isfinite(space.flyable.column(FUEL))]
        model = space.surrogate.models[FUEL]
        computed, predicted, deviation = model.leave_one_out(return_std=True)
        deviation = np.hypot(deviation, model.state_.output_error)
        for low, high in pairwise(SHARES):
            own = (usage > low) & (usage <= high)
            error = predicted[own] - computed[own]
            rows.append(
                (
                    space.words,
                    f"{low:g} to {high:g}",
                    int(own.sum()),
                    f"{100.0 * np.sqrt(np.mean((error / computed[own]) ** 2)):.4f}",
                    f"{coverage(computed[own], predicted[own], deviation[own]):.1f}",
                    f"{np.sqrt(np.mean((error / deviation[own]) ** 2)):.2f}",
                )
            )
    header = ("variables", "share of the limit", "points", "RMS error %", "within 2 sigma %", "RMS of error / sigma")
    yield from table(header, rows)


def fresh_table(space: Space) -> Iterator[str]:
    """Every output of the shipped surrogate at points that it has not seen; beside it the points left out."""
    rows = []
    for name, model in space.surrogate.models.items():
        inputs, computed = space.fresh.known(name)
        predicted = model.predict(inputs)
        deviation = np.hypot(model.standard_deviation(inputs), model.state_.output_error)
        figures = accuracy(computed, predicted)
        rows.append(
            (
                name.replace("_", " "),
                len(computed),
                f"{figures.pearson_percent:.4f}",
                f"{figures.mean_abs_error_percent:.4f}",
                f"{figures.rms_error_percent:.4f}",
                f"{normalised(computed, predicted):.4f}",
                f"{100.0 * np.max(np.abs(predicted / computed - 1.0)):.2f}",
                f"{held_out_coverage(model, inputs, computed):.1f}",
                f"{np.sqrt(np.mean(((predicted - computed) / deviation) ** 2)):.2f}",
                f"{leave_one_out_coverage(model):.1f}",
            )
        )
    header = ("output", "points", "Pearson %", "mean abs. error %", "RMS error %", "RMS / spread %", "largest error %")
    yield from table((*header, "within 2 sigma %", "RMS of error / sigma", "left out, within 2 sigma %"), rows)
