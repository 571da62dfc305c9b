"""NOx and CO of the engine along its operating line against FOCA, and what moves them; writes problems/emissions.md.

The line is that of a stationary engine at sea level on a standard dry day, free turbine at 100 %. Every slope is exact:
the combustor's derivatives at its inlet times the gas path's.

Run: python problems/emissions.py
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from calibrate_combustor import FITTED, REPORTED, burnt, calibrate, fits, humidity_slopes, operating_line, over_foca
from page_table import table, write_below
from sea_level import at_sea_level

from vrsopt import foca
from vrsopt.combustor.emissions import emission_sensitivities, emissions
from vrsopt.combustor.nitrogen import ETHYLENE
from vrsopt.report.plots import png
from vrsopt.report.style import BLACK, BLUE, NORMAL, SMALL, VERMILION, new_figure, tidy
from vrsopt.turboshaft.cycle import gas_path
from vrsopt.turboshaft.data import EngineData, load_engine

HERE = Path(__file__).parent
PAGE, FIGURE = HERE / "emissions.md", "emissions.png"
MARKER = "<!-- tables: everything below is written by problems/emissions.py -->"
LINE = tuple(np.linspace(0.05, 1.0, 39).tolist())
ICAO_HUMIDITY_SLOPE = -19.0  # d ln EINOx / d humidity: ICAO Annex 16, volume II, appendix 3
IDLE = 0.07  # of the take-off rating
RECIRCULATIONS = (0.0, 0.1, 0.2, 0.3, 0.4)
STYLES = {"shipped": (BLUE, "-"), "wide_mixing": (VERMILION, "--")}
NAMES = {"shipped": "shipped fit", "wide_mixing": "wide mixing"}


def slopes(engine: EngineData, powers: tuple[float, ...]) -> np.ndarray:
    """d ln(NOx flow) / d ln(fuel flow) along the operating line at shares of the take-off rating, exact (N,)."""
    system, found = gas_path(engine), []
    for share in powers:
        solution = at_sea_level(engine, share * engine.ratings.take_off_power)
        if not solution.success:
            raise RuntimeError(solution.message)
        nox = emission_sensitivities(engine, solution, system)["nox"]["demand"]
        fuel = system.sensitivities(solution)["fuel_flow"]["demand"]
        found.append(nox / fuel / emissions(engine, solution).nox_index)
    return np.array(found)


def foca_slopes(powers: np.ndarray) -> np.ndarray:
    """The same of FOCA's formulas, at shaft powers [W]."""
    step = np.exp([-1e-4, 1e-4])[:, None] * powers
    fuel = np.log(foca.fuel_flow(step))
    return np.diff(np.log(foca.nox_index(step)) + fuel, axis=0)[0] / np.diff(fuel, axis=0)[0]


def draw(engine: EngineData) -> Any:
    """NOx, CO and the two slopes over shaft power, both fits against FOCA."""
    figure = new_figure(9.0, 6.6)
    nox_axes, co_axes, slope_axes, humid_axes = figure.subplots(2, 2).ravel()
    power, *line_states = operating_line(engine, LINE)
    kilowatts = power / 1e3
    for axes, index in ((nox_axes, foca.nox_index), (co_axes, foca.co_index)):
        axes.fill_between(kilowatts, 500 * index(power), 2000 * index(power), color="#eeeeee", zorder=0)
        axes.plot(kilowatts, 1e3 * index(power), color=BLACK, lw=1.0, ls=":", label="FOCA, shaded: factor 2 either way")
    slope_axes.plot(kilowatts, foca_slopes(power), color=BLACK, lw=1.0, ls=":", label="FOCA")
    humid_axes.axhline(ICAO_HUMIDITY_SLOPE, color=BLACK, lw=1.0, ls=":", label="ICAO correction")
    marks, *mark_states = operating_line(engine, FITTED)
    for name, one in fits(engine).items():
        colour, style = STYLES[name]
        line: dict[str, Any] = {"color": colour, "ls": style, "lw": 1.6, "label": NAMES[name]}
        out, at = burnt(one, *line_states), burnt(one, *mark_states)
        nox_axes.plot(kilowatts, 1e3 * out["nox_index"], **line)
        nox_axes.plot(marks / 1e3, 1e3 * at["nox_index"], "o", color=colour, ms=4)
        co_axes.plot(kilowatts, 1e3 * out["co_index"], **line)
        co_axes.plot(marks[-1] / 1e3, 1e3 * at["co_index"][-1], "o", color=colour, ms=4)
        slope_axes.plot(kilowatts, slopes(one, LINE), **line)
        humid_axes.plot(kilowatts, humidity_slopes(one, *line_states), **line)
    titles = (
        (nox_axes, "NOx index, g/kg (dots: fitted)"),
        (co_axes, "CO index, g/kg (dot: fitted)"),
        (slope_axes, "d ln NOx / d ln fuel along the line"),
        (humid_axes, "d ln NOx index / d humidity, per kg water per kg dry air"),
    )
    for axes, title in titles:
        tidy(axes)
        axes.set_title(title, fontsize=NORMAL, loc="left")
        axes.set_xlabel("shaft power, kW", fontsize=SMALL)
        axes.set_xlim(0.0, 320.0)
        axes.legend(fontsize=SMALL, frameon=False)
    co_axes.set_yscale("log")
    co_axes.set_yticks([5, 10, 20, 50, 100, 200], labels=["5", "10", "20", "50", "100", "200"])
    nox_axes.set_ylim(0.0, None)
    slope_axes.set_ylim(0.0, None)
    humid_axes.set_ylim(-30.0, 0.0)
    return figure


def lines(engine: EngineData) -> Iterator[str]:
    """Everything below the marker."""
    yield f"\n![NOx, CO and their slopes along the operating line](figures/{FIGURE})\n"
    for name, one in fits(engine).items():
        yield f"## Operating line, {NAMES[name]}\n"
        yield from _line_table(one)
    yield "## Recirculation and extinction\n"
    yield (
        "NOx index [g/kg], and of the leanest pocket of the primary zone the temperature and the part of its carbon\n"
        "that leaves it as CO; the other numbers as shipped:\n"
    )
    yield from _recirculation_table(engine)
    yield "## Tried and not taken\n"
    yield from _tried_table(engine)


def _line_table(engine: EngineData) -> Iterator[str]:
    power, *states = operating_line(engine, REPORTED)
    out, steep, humid = burnt(engine, *states), slopes(engine, REPORTED), humidity_slopes(engine, *states)
    more_nox, more_co = over_foca(out, power)
    rows = []
    for k, share in enumerate(REPORTED):
        nox, co = 1e3 * foca.nox_index(power[k]), 1e3 * foca.co_index(power[k])
        rows.append(
            (
                f"{100 * share:.0f} %" + (" (fitted)" if share in FITTED else ""),
                f"{1e3 * out['nox_index'][k]:.2f}",
                f"{nox:.2f}",
                f"{more_nox[k]:+.0f} %",
                f"{1e3 * out['co_index'][k]:.1f}",
                f"{co:.1f}",
                f"{more_co[k]:+.0f} %",
                f"{steep[k]:.2f}",
                f"{foca_slopes(power[k : k + 1])[0]:.2f}",
                f"{humid[k]:.1f}",
                f"{out['primary_equivalence_ratio'][k]:.2f}",
            )
        )
    header = ("power", "NOx g/kg", "FOCA", "difference", "CO g/kg", "FOCA", "difference")
    yield from table((*header, "d ln NOx/d ln fuel", "FOCA", "d ln NOx/d humidity", "primary phi"), rows)


def _recirculation_table(engine: EngineData) -> Iterator[str]:
    shares, rows = (0.07, 0.30, 0.60, 1.00), []
    _, *states = operating_line(engine, shares)
    for value in RECIRCULATIONS:
        out = burnt(engine.changed("reactors", recirculation=value), *states)
        pocket = out["leanest_pocket_temperature"], out["leanest_pocket_unburnt_co"]
        cells = zip(1e3 * out["nox_index"], *pocket, strict=True)
        rows.append((f"{value:.1f}", *(f"{nox:.2f}, {kelvin:.0f} K, {co:.2f}" for nox, kelvin, co in cells)))
    yield from table(("recirculation", *(f"{100 * share:.0f} % power" for share in shares)), rows)


def _tried_table(engine: EngineData) -> Iterator[str]:
    """The fit with ethylene's prompt NO, and a network that burns all of the fuel at idle."""
    sooner = engine.changed("reactors", methylene_fraction=ETHYLENE)
    fitted = sooner.changed("reactors", **calibrate(sooner).values)
    power, *states = operating_line(engine, FITTED)
    nox, _ = over_foca(burnt(fitted, *states), power)
    where = ", ".join(f"{100 * share:.0f}" for share in FITTED)
    at_powers = ", ".join(f"{value:+.0f} %" for value in nox)
    idle, *(state, share) = operating_line(engine, (IDLE,))
    whole = state.copy()
    whole[:, 3] /= share
    part, full = burnt(engine, state, share), burnt(engine, whole, np.ones(1))
    hotter = float((full["exit_temperature"] - part["exit_temperature"])[0])
    grams = [1e3 * float(index[0]) for index in (full["nox_index"], part["nox_index"], foca.nox_index(idle))]
    rows = [
        (
            f"methylene fraction {ETHYLENE:g}, ethylene's, fitted again",
            f"NOx to FOCA at {where} % power: {at_powers}",
        ),
        (
            f"all of the fuel in the network at {100 * IDLE:.0f} % power, not {float(share[0]):.2f} of it",
            "{:.0f} K hotter, NOx {:.1f} g/kg instead of {:.1f}; FOCA {:.1f}".format(hotter, *grams),
        ),
    ]
    yield from table(("what", "result"), rows)


def main() -> None:
    engine = load_engine()
    (HERE / "figures" / FIGURE).write_bytes(png(draw(engine)))
    write_below(MARKER, PAGE, "\n".join(lines(engine)), title="Emissions")


if __name__ == "__main__":
    main()
