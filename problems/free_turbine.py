"""Free-turbine speed and fuel: at constant gas-generator speed, as test beds show it, and at constant power, as a
mission meets it.

At constant gas-generator speed the fuel hardly changes with the speed of the free turbine, so the consumption is the
inverse of the turbine's efficiency, and best where U/C0 is that of the design point: at the root of the isentropic drop
over its design value. The optimum is found where the exact derivative of the fuel is zero.

Run: python problems/engine_page.py (writes the page and its figures)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from page_table import table
from power_turbine import peaked
from scipy.optimize import brentq
from sea_level import at_sea_level

from vrsopt.report.style import BLACK, BLUE, GREEN, GREY, NORMAL, ORANGE, PURPLE, SMALL, VERMILION, new_figure, tidy
from vrsopt.residual import Solution
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.cycle import Mode, gas_path
from vrsopt.turboshaft.data import EngineData
from vrsopt.turboshaft.maps import ANALYTIC, ComponentMaps

SPEEDS = np.linspace(0.6, 1.2, 25)
SHOWN = np.array([0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2])
GENERATOR_SPEEDS = (0.80, 0.85, 0.90, 0.95, 1.00)
POWERS = np.array([40.0, 60.0, 80.0, 120.0, 160.0, 200.0, 240.0, 280.0, 313.0]) * 1e3  # W
SLOWEST, FASTEST = 0.40, 1.30  # where an optimum is looked for
AVOIDED = (0.87, 0.95)  # steady speeds that Rolls-Royce CEB-1343 forbids with the un-enhanced third-stage wheel
COLOURS = (PURPLE, BLUE, GREEN, ORANGE, VERMILION)


@dataclass(frozen=True)
class Optimum:
    """Free-turbine speed of least fuel at a demand: ``speed``, the root of the drop over its design value there (times
    the map's best velocity ratio, 1 as shipped), power [W] at 100 % speed, and by how much the fuel per power is less
    than at 100 % (a share)."""

    demand: float
    speed: float
    drop_root: float
    power: float
    saving: float


def relative_consumption(engine: EngineData, mode: Mode, demands: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """Specific consumption over that at 100 % free-turbine speed, (demands, speeds), sea level, ISA, at rest."""
    rows = [[demand, speed, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0] for demand in demands for speed in (*speeds, 1.0)]
    out = solve_many(np.array(rows), mode=mode, engine_data=engine).outputs
    ratio = (out["fuel_flow"] / out["power"]).reshape(len(demands), len(speeds) + 1)
    return ratio[:, :-1] / ratio[:, -1:]


def solved(engine: EngineData, mode: Mode, demand: float, speed: float, maps: ComponentMaps = ANALYTIC) -> Solution:
    """Sea level, ISA, at rest; raises :class:`RuntimeError` when it is not solved."""
    solution = at_sea_level(engine, demand, mode=mode, speed=speed, maps=maps)
    if not solution.success:
        raise RuntimeError(f"gas path at {demand:g}, free turbine at {speed:g}: {solution.message}")
    return solution


def optimum(engine: EngineData, mode: Mode, demand: float, maps: ComponentMaps = ANALYTIC) -> Optimum:
    """Where the exact derivative of ln(fuel/power) with the speed of the free turbine is zero."""

    def slope(speed: float) -> float:
        solution = solved(engine, mode, demand, speed, maps)
        exact = gas_path(engine, mode, maps=maps).sensitivities(solution)
        fuel, power = (exact[name]["power_turbine_speed"] / solution.outputs[name] for name in ("fuel_flow", "power"))
        return fuel - power

    speed = float(brentq(slope, SLOWEST, FASTEST, xtol=1e-7))
    best, nominal = (solved(engine, mode, demand, at, maps).outputs for at in (speed, 1.0))
    saving = 1.0 - best["fuel_flow"] / best["power"] / (nominal["fuel_flow"] / nominal["power"])
    return Optimum(demand, speed, best["best_power_turbine_speed"], nominal["power"], saving)


def with_curvature(engine: EngineData) -> tuple[EngineData, EngineData]:
    """The engine with the ends of the range of its power turbine's curvature."""
    low, high = engine.power_turbine.provenance["speed_curvature"].range or (np.nan, np.nan)
    return tuple(engine.changed("power_turbine", speed_curvature=value) for value in (low, high))  # type: ignore[return-value]


def at_generator_speed(engine: EngineData) -> Iterator[str]:
    """Table of consumption and optimum at constant gas-generator speed."""
    ratios = relative_consumption(engine, "gas_generator_speed", np.array(GENERATOR_SPEEDS), SHOWN)
    ends = with_curvature(engine)
    rows = []
    for generator, ratio in zip(GENERATOR_SPEEDS, ratios, strict=True):
        best = optimum(engine, "gas_generator_speed", generator)
        band = [optimum(end, "gas_generator_speed", generator) for end in ends]
        rows.append(
            [
                f"{100 * generator:.0f} %",
                *(f"{value:.3f}" for value in ratio),
                f"{100 * best.speed:.1f} %",
                f"{100 * best.drop_root:.1f} %",
                f"{100 * best.saving:.1f} ({100 * band[0].saving:.1f} to {100 * band[1].saving:.1f})",
                f"{best.power / 1e3:.0f}",
            ]
        )
    header = (
        "gas generator",
        *(f"{100 * n:.0f} %" for n in SHOWN),
        "optimum",
        "root of the drop",
        "saved %",
        "kW at 100 %",
    )
    yield from table(header, rows)


def at_power(engine: EngineData) -> Iterator[str]:
    """Table of optimum speed and fuel saved at constant power."""
    ends, others = with_curvature(engine), peaked(engine)
    outside = relative_consumption(engine, "power", POWERS, np.array(AVOIDED))
    rows = []
    for power, (low, high) in zip(POWERS, outside, strict=True):
        best = optimum(engine, "power", power)
        band = [optimum(end, "power", power) for end in ends]
        own = [optimum(engine, "power", power, maps) for maps in others.values()]
        rows.append(
            [
                f"{power / 1e3:.0f}",
                f"{100 * best.speed:.1f}",
                f"{100 * best.saving:.2f} ({100 * band[0].saving:.2f} to {100 * band[1].saving:.2f})",
                f"{100 * (1 - low):.2f}",
                f"{100 * (1 - high):.2f}",
                *(f"{100 * other.speed:.0f}, {100 * other.saving:.2f}" for other in own),
            ]
        )
    header = ("power kW", "optimum speed %", "fuel saved %", *(f"saved at {100 * n:.0f} %" for n in AVOIDED))
    yield from table([*header, *(f"own best U/C0, {name}" for name in others)], rows)


def page(engine: EngineData) -> Iterator[str]:
    """Tables of the page."""
    low, high = (end.power_turbine.speed_curvature for end in with_curvature(engine))
    band = f"curvature {engine.power_turbine.speed_curvature:g} ({low:g} to {high:g})"
    yield f"Consumption over that at 100 % free-turbine speed at constant gas-generator speed; {band}:\n"
    yield from at_generator_speed(engine)
    yield f"Constant power; {band}. Last two columns: optimum speed and fuel saved, percent, with the map that has the"
    yield "triangles' own best U/C0.\n"
    yield from at_power(engine)


def draw_generator_speed(engine: EngineData) -> Any:
    """Consumption over free-turbine speed at constant gas-generator speed."""
    ratios = relative_consumption(engine, "gas_generator_speed", np.array(GENERATOR_SPEEDS), SPEEDS)
    figure = new_figure(7.5, 5.2)
    axes = figure.subplots()
    _avoided(axes.axvspan, axes)
    bests = [optimum(engine, "gas_generator_speed", generator) for generator in GENERATOR_SPEEDS]
    for generator, ratio, colour, best in zip(GENERATOR_SPEEDS, ratios, COLOURS, bests, strict=True):
        axes.plot(100 * SPEEDS, ratio, color=colour)
        words = "gas generator " if generator == GENERATOR_SPEEDS[-1] else ""
        axes.annotate(
            f"{words}{100 * generator:.0f} %, {best.power / 1e3:.0f} kW",
            (100 * SPEEDS[0], ratio[0]),
            xytext=(-5, 0),
            textcoords="offset points",
            color=colour,
            fontsize=SMALL,
            ha="right",
            va="center",
        )
    place = [100 * best.speed for best in bests], [1.0 - best.saving for best in bests]
    axes.plot(*place, "o--", color=BLACK, markersize=4, linewidth=0.9)
    axes.annotate(
        "optimum", (place[0][0], place[1][0]), xytext=(0, -13), textcoords="offset points", fontsize=SMALL, ha="center"
    )
    axes.set(xlim=(39, 121), ylim=(min(place[1]) - 0.04, 1.32), xticks=np.arange(60, 121, 10))
    axes.set_xlabel("free-turbine speed, %", fontsize=NORMAL)
    axes.set_ylabel("specific fuel consumption over that at 100 %", fontsize=NORMAL)
    tidy(axes)
    return figure


def _avoided(shade: Callable[..., Any], axes: Any, *, along: bool = False) -> None:
    """Shade the speeds that are not allowed for long."""
    shade(*(100 * end for end in AVOIDED), color=GREY, alpha=0.25, linewidth=0)
    place = (0.99, 91.0) if along else (91.0, 0.985)
    axes.text(
        *place,
        "no steady speed\n(CEB-1343)",
        transform=axes.get_yaxis_transform() if along else axes.get_xaxis_transform(),
        fontsize=SMALL,
        color="#555555",
        ha="right" if along else "center",
        va="center" if along else "top",
    )


def draw_power(engine: EngineData) -> Any:
    """Optimum speed and fuel saved over power: the shipped map with the band of its curvature, and the triangles."""
    powers = np.linspace(40e3, 313e3, 14)
    low, high = with_curvature(engine)
    bests = {e.power_turbine.speed_curvature: [optimum(e, "power", p) for p in powers] for e in (low, engine, high)}
    figure = new_figure(7.5, 6.6)
    upper, lower = figure.subplots(2, 1, sharex=True)
    _avoided(upper.axhspan, upper, along=True)
    saving = {curvature: np.array([100 * best.saving for best in found]) for curvature, found in bests.items()}
    kilowatt, shipped = powers / 1e3, engine.power_turbine.speed_curvature
    least, _, most = saving.values()
    lower.fill_between(kilowatt, least, most, color=BLUE, alpha=0.2, linewidth=0)
    for curvature, values in saving.items():
        lower.plot(kilowatt, values, color=BLUE, linewidth=1.6 if curvature == shipped else 0.5)
        _left(lower, values[0], f"map, curvature {curvature:g}", BLUE)
    speeds = [100 * best.speed for best in bests[shipped]]
    upper.plot(kilowatt, speeds, color=BLUE)
    _left(upper, speeds[0], "map", BLUE)
    for (name, maps), colour in zip(peaked(engine).items(), (VERMILION, ORANGE), strict=True):
        found = [optimum(engine, "power", p, maps) for p in powers]
        upper.plot(kilowatt, [100 * best.speed for best in found], color=colour)
        lower.plot(kilowatt, [100 * best.saving for best in found], color=colour)
        _left(upper, 100 * found[0].speed, f"triangles, {name}", colour)
        _left(lower, 100 * found[0].saving, f"triangles, {name}", colour, nudge=-4)
    for axes in (upper, lower):
        axes.set(xlim=(-42, 320), xticks=np.arange(50, 301, 50))
        tidy(axes)
    upper.set_ylabel("free-turbine speed of least fuel, %", fontsize=NORMAL)
    lower.set_ylabel("fuel saved against 100 % speed, %", fontsize=NORMAL)
    lower.set_xlabel("shaft power of one engine, kW (sea level, ISA, at rest)", fontsize=NORMAL)
    lower.set_ylim(bottom=0.0)
    return figure


def _left(axes: Any, value: float, words: str, colour: str, *, nudge: float = 0.0) -> None:
    """Name a curve at its left end, 40 kW."""
    axes.annotate(
        words,
        (40.0, value),
        xytext=(-5, nudge),
        textcoords="offset points",
        fontsize=SMALL,
        color=colour,
        ha="right",
        va="center",
    )
