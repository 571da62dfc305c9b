"""How peaked is the efficiency of the power turbine? From velocity triangles, instead of an assumed number.

The map of the power turbine has one number, the curvature of its efficiency over U/C0. Here it is fitted to the mean
line of a two-stage turbine (vrsopt.turboshaft.velocity_triangles) over the speeds and expansions that missions use:
speeds of 60 to 120 % at the isentropic drops of gas-generator speeds of 80 to 100 %, which is U/C0 of 0.6 to 1.7 times
the design point's. Its range comes from the ranges of everything assumed about the blading, and from a second incidence
loss.

Run: python problems/engine_page.py (writes the page and its figures)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from page_table import table
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar
from scipy.stats import qmc

from vrsopt.report.style import BLACK, BLUE, NORMAL, ORANGE, SMALL, new_figure, tidy
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.data import EngineData
from vrsopt.turboshaft.maps import ANALYTIC, ComponentMaps, TurbineState, turbine_map, turbine_work
from vrsopt.turboshaft.velocity_triangles import (
    ASSUMPTIONS,
    SPEED,
    Assumption,
    Duty,
    Fit,
    Incidence,
    characteristics,
    fitted,
    work_over_design,
)

SPEEDS = np.linspace(0.6, 1.2, 13)
ROTOR_SPEEDS = np.linspace(0.75, 1.15, 13)  # bounds of the rotor speed
GENERATOR_SPEEDS = np.array([0.80, 0.85, 0.90, 0.95, 1.00])
CORRELATIONS: tuple[Incidence, ...] = ("cosine", "moustapha")
NAMES = {"cosine": "1 - cos^n", "moustapha": "Moustapha et al."}
SAMPLES = 400
PERCENTILES = (5.0, 50.0, 95.0)


@dataclass(frozen=True)
class Turbine:
    """One blading over the points of the study.

    ``work`` (drops, speeds) over the design point's; ``flow`` (speeds,) at the drop of the design point over the flow
    there; ``radius`` [m] that gives the blade speed at 100 % of the engine's power-turbine speed.
    """

    fit: Fit  # best U/C0 held at the design point's, as the engine's map has it
    free: Fit  # best U/C0 fitted as well
    fixed_drop: Fit  # only the drop of the design point
    work: np.ndarray
    flow: np.ndarray
    design_efficiency: float
    radius: float


def drops(engine: EngineData) -> np.ndarray:
    """Root of the isentropic drop over its design value at ``GENERATOR_SPEEDS``, sea level, 100 % turbine speed."""
    points = np.zeros((GENERATOR_SPEEDS.size, 8))
    points[:, 0], points[:, 1] = GENERATOR_SPEEDS, 1.0
    found = solve_many(points, mode="gas_generator_speed", engine_data=engine)
    return found.outputs["best_power_turbine_speed"] / engine.power_turbine.best_velocity_ratio


def turbines(
    engine: EngineData, bladings: list[dict[str, float]], incidence: Incidence = "cosine", speeds: np.ndarray = SPEEDS
) -> list[Turbine]:
    """Solve and fit every blading."""
    c, n = (grid.ravel() for grid in np.meshgrid(drops(engine), speeds, indexing="ij"))
    out = characteristics(Duty.of(engine), n, c, bladings, incidence=incidence)
    work = c**2 * out["efficiency"] / out["design_efficiency"]
    last = slice(-speeds.size, None)  # the drop of the design point
    found = []
    for k in range(len(bladings)):
        found.append(
            Turbine(
                fit=fitted(n, c, work[k]),
                free=fitted(n, c, work[k], best=None),
                fixed_drop=fitted(speeds, np.ones_like(speeds), work[k, last]),
                work=work[k].reshape(GENERATOR_SPEEDS.size, speeds.size),
                flow=out["flow_ratio"][k, last],
                design_efficiency=float(out["design_efficiency"][k, 0]),
                radius=float(out["blade_speed"][k, 0] / n[0] / SPEED),
            )
        )
    return found


def varied(assumption: Assumption) -> tuple[list[dict[str, float]], Incidence]:
    """Bladings with one assumption at the ends of its range, and the loss that it belongs to."""
    ends = [{assumption.name: assumption.low}, {assumption.name: assumption.high}]
    return ends, "moustapha" if assumption.name == "leading_edge_ratio" else "cosine"


@lru_cache(maxsize=2)
def sampled() -> list[dict[str, float]]:
    """All assumptions at once, a Latin hypercube over their ranges."""
    rows = qmc.LatinHypercube(len(ASSUMPTIONS), rng=1).random(SAMPLES)
    return [
        {a.name: a.low + share * (a.high - a.low) for a, share in zip(ASSUMPTIONS, row, strict=True)} for row in rows
    ]


@dataclass(frozen=True)
class Derived:
    """The engine file's curvature and its range, and the samples behind them by incidence loss."""

    value: float
    low: float
    high: float
    samples: dict[Incidence, list[Turbine]]


def derive(engine: EngineData) -> Derived:
    """Curvature of the default blading, and the 5th to 95th percentile of all samples with both incidence losses."""
    samples = {name: turbines(engine, sampled(), name) for name in CORRELATIONS}
    curvature = [turbine.fit.curvature for found in samples.values() for turbine in found]
    low, _, high = np.percentile(curvature, PERCENTILES)
    return Derived(turbines(engine, [{}])[0].fit.curvature, float(low), float(high), samples)


@lru_cache(maxsize=4)
def triangle_maps(fit: Fit) -> ComponentMaps:
    """The engine's maps with a power turbine whose best U/C0 is that of the triangles, not that of the design point."""

    def power_turbine(data: Any, state: TurbineState) -> tuple[Any, Any]:
        return turbine_map(data, state)[0], work_over_design(fit, state.speed, state.spouting)

    return replace(ANALYTIC, power_turbine=power_turbine)


def peaked(engine: EngineData) -> dict[str, ComponentMaps]:
    """Maps with the default blading's own best U/C0, by incidence loss."""
    return {NAMES[loss]: triangle_maps(turbines(engine, [{}], loss)[0].free) for loss in CORRELATIONS}


def saved(turbine: Turbine, speeds: np.ndarray = SPEEDS) -> list[tuple[float, float]]:
    """Speed of the most work and share of fuel saved there against 100 %, at each of ``GENERATOR_SPEEDS``.

    There the fuel does not depend on the free turbine, so that the consumption is the inverse of the work.
    """
    found = []
    for row in turbine.work:
        curve = CubicSpline(speeds, row)
        best = minimize_scalar(lambda n, curve=curve: -curve(n), bounds=(speeds[0], speeds[-1]), method="bounded").x
        found.append((float(best), float(1.0 - curve(1.0) / curve(best))))
    return found


def page(engine: EngineData) -> Iterator[str]:
    """Tables of the page."""
    found = derive(engine)
    yield f"Curvature {found.value:.3f}; 5th to 95th percentile of all samples {found.low:.2f} to {found.high:.2f}.\n"
    yield from fits(engine)
    yield "All assumptions at once, 5th, 50th and 95th percentile:\n"
    yield from percentiles(found)
    yield "One assumption at a time:\n"
    yield from assumptions(engine)
    yield "Optimum speed, and fuel saved against 100 %, at constant gas-generator speed:\n"
    yield from savings(engine)


def fits(engine: EngineData) -> Iterator[str]:
    """Default blading: what the fit depends on."""
    (default,), (second,) = turbines(engine, [{}]), turbines(engine, [{}], "moustapha")
    (rotor,) = turbines(engine, [{}], speeds=ROTOR_SPEEDS)
    cases = {
        "60 to 120 %, drops of 80 to 100 % gas-generator speed (taken)": default.fit,
        "the same, best U/C0 fitted as well": default.free,
        "75 to 115 %, the rotor's own bounds, same drops": rotor.fit,
        "60 to 120 %, drop of the design point": default.fixed_drop,
        "60 to 120 %, same drops, Moustapha's incidence loss": second.fit,
        "Moustapha's, best U/C0 fitted as well": second.free,
    }
    header = ("speeds and drops", "curvature", "best U/C0 over design", "rms error %", "largest error %")
    yield from table(header, ([name, *_numbers(fit)] for name, fit in cases.items()))


def _numbers(fit: Fit) -> Iterator[str]:
    yield from (f"{fit.curvature:.2f}", f"{fit.best:.2f}", f"{100 * fit.rms:.1f}", f"{100 * fit.largest:.1f}")


def percentiles(found: Derived) -> Iterator[str]:
    rows = []
    for name, samples in found.samples.items():
        columns = (
            [turbine.fit.curvature for turbine in samples],
            [turbine.free.best for turbine in samples],
            [turbine.flow[0] for turbine in samples],
            [turbine.flow[-1] for turbine in samples],
            [turbine.design_efficiency for turbine in samples],
        )
        rows.append(
            [NAMES[name], *(", ".join(f"{v:.2f}" for v in np.percentile(column, PERCENTILES)) for column in columns)]
        )
    header = ("incidence loss", "curvature", "best U/C0", "flow at 60 %", "flow at 120 %", "efficiency at design")
    yield from table(header, rows)


def assumptions(engine: EngineData) -> Iterator[str]:
    rows = []
    for assumption in ASSUMPTIONS:
        bladings, incidence = varied(assumption)
        pair = turbines(engine, bladings, incidence)
        rows.append(
            [
                assumption.name.replace("_", " "),
                assumption.words,
                f"{assumption.value:g} ({assumption.low:g} to {assumption.high:g})",
                " / ".join(f"{turbine.fit.curvature:.2f}" for turbine in pair),
                " / ".join(f"{turbine.free.best:.2f}" for turbine in pair),
                " / ".join(f"{turbine.design_efficiency:.3f}" for turbine in pair),
                " / ".join(f"{1e3 * turbine.radius:.0f}" for turbine in pair),
            ]
        )
    header = ("assumption", "", "value (range)", "curvature", "best U/C0", "efficiency", "mean radius mm")
    yield from table(header, rows)


def savings(engine: EngineData) -> Iterator[str]:
    columns = []
    c = drops(engine)
    mapped = [1.0 - turbine_work(engine.power_turbine.speed_curvature, 1.0, root) / root**2 for root in c]
    columns.append([f"{100 * root:.0f} %, {100 * share:.1f} %" for root, share in zip(c, mapped, strict=True)])
    for name in CORRELATIONS:
        (turbine,) = turbines(engine, [{}], name)
        columns.append([f"{100 * n:.0f} %, {100 * share:.1f} %" for n, share in saved(turbine)])
    header = ("gas generator", "map", *(f"triangles, {NAMES[name]}" for name in CORRELATIONS))
    yield from table(header, zip((f"{100 * n:.0f} %" for n in GENERATOR_SPEEDS), *columns, strict=True))


def draw(engine: EngineData) -> Any:
    """Efficiency and flow over U/C0 at the drop of the design point: default bladings, all samples, the map."""
    speeds = np.linspace(0.6, 1.45, 18)
    figure = new_figure(9.5, 4.4)
    axes = figure.subplots(1, 2)
    for name, colour in zip(CORRELATIONS, (BLUE, ORANGE), strict=True):
        out = characteristics(Duty.of(engine), speeds, np.ones(1), [{}, *sampled()], incidence=name)
        for ax, values in zip(axes, (out["efficiency"] / out["design_efficiency"], out["flow_ratio"]), strict=True):
            low, _, high = np.percentile(values[1:], PERCENTILES, axis=0)
            ax.fill_between(100 * speeds, low, high, color=colour, alpha=0.2, linewidth=0)
            ax.plot(100 * speeds, values[0], color=colour, label=f"triangles, incidence loss {NAMES[name]}")
    curvature = engine.power_turbine.speed_curvature
    axes[0].plot(
        100 * speeds, 1.0 - curvature * (speeds - 1.0) ** 2, "--", color=BLACK, label=f"map, curvature {curvature:g}"
    )
    axes[1].axhline(1.0, linestyle="--", color=BLACK, label="map: no change")
    words = ("efficiency over that at the design point", "flow over that at the design point")
    for ax, title in zip(axes, words, strict=True):
        ax.set_xlabel("U/C0 over that at the design point, %", fontsize=NORMAL)
        ax.set_title(title, fontsize=NORMAL)
        ax.legend(fontsize=SMALL, frameon=False, loc="lower center")
        tidy(ax)
    axes[1].set_ylim(0.9, 1.1)
    return figure
