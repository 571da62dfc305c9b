"""Tables and figure of the study of a second helicopter, written below the text of its page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from page_table import table, write_below

from vrsopt.report.plots import png
from vrsopt.report.style import BLACK, BLUE, GREEN, NORMAL, SMALL, VERMILION, new_figure, tidy

MARKER = "<!-- tables: everything below is written by problems/second_helicopter.py -->"
Results = Mapping[str, Any]
LOOKS = ((BLUE, "o"), (GREEN, "^"), (VERMILION, "D"))  # colour, mark
HORSEPOWER = 0.74569987  # kW
# Published, main-rotor power unless said: label, speeds [m/s], saving [%]
PUBLISHED = (
    ("Steiner: up to", (25.0, 60.0), (17.0, 17.0), "-"),
    ("Steiner: hover", (0.0,), (12.0,), "o"),
    ("Han et al., 250 km/h", (250 / 3.6,), (17.8,), "s"),
)
PUBLISHED_FUEL = (("Mistè et al.: 7 to 8 %", (7.0, 8.0)),)


def write_page(path: Path, results: Results) -> None:
    """The page with its tables made again; what is written by hand above the marker stays."""
    write_below(MARKER, path, "\n".join(lines(results)), title="A second helicopter")


def lines(results: Results) -> Iterator[str]:
    yield "\n## Tables\n"
    yield from _checks(results["checks"])
    yield "### Best rotor speed and saving within 85 to 100 %\n"
    yield "Rotor speed in percent of nominal, savings against 100 % in percent. Power: main rotor alone, trims the"
    yield "only condition. Fuel: the same for both engines. Within limits: least fuel with blade loading (margin 1.3),"
    yield "torque and power of the gearbox, turbine temperature and tail rotor; in parentheses where the nominal rotor"
    yield "is beyond one of the last four.\n"
    yield from _optima(results["optima"], "narrow")
    yield "### Best rotor speed and saving within 75 to 115 %\n"
    yield from _optima(results["optima"], "wide")
    yield "### What the data leave open\n"
    yield "8300 kg, sea level, 85 to 100 %: saving of main-rotor power / of fuel, trims only / of fuel within limits.\n"
    yield from _sensitivity(results["sensitivity"])
    yield "### The same optimum as one problem\n"
    yield "Least fuel within all limits, 8300 kg, sea level: `vrsopt.physics_optimum` beside the walks.\n"
    yield from _cross_check(results)


def _checks(checks: Results) -> Iterator[str]:
    yield "### Against public power, fuel and trim\n"
    yield "16825 lb, sea level, model / Gen Hel (NASA TM-100991, table B.1):\n"
    rows = []
    for one in checks["power"]:
        row = [f"{one['speed']:.0f}"]
        for name in ("rotor_hp", "shaft_hp", "fuel_lb_h"):
            own, public = one[name], one[f"{name}_public"]
            row.append(f"{own:.0f} / {public:.0f} ({100 * (own / public - 1):+.0f} %)")
        rows.append(row)
    yield from table(("speed m/s", "main rotor hp", "engine hp, each", "fuel lb/h, each"), rows)
    yield "16400 lb, sea level, model / Gen Hel (NASA TM-85890, table 4):\n"
    rows = [
        [
            one["knots"],
            f"{one['collective']:.1f} / {one['collective_public']:.1f}",
            f"{one['pitch']:.1f} / {one['pitch_public']:.1f}",
        ]
        for one in checks["trims"]
    ]
    yield from table(("speed kt", "pitch at 3/4 radius deg", "pitch attitude deg"), rows)
    yield "T700-GE-700, sea level, static, model / GE status-81 (NASA TM-100991, figure 7):\n"
    rows = [
        [
            f"{one['shp']:.0f}",
            f"{one['fuel_lb_h']:.1f} / {one['fuel_lb_h_public']:.1f}",
            f"{100 * (one['fuel_lb_h'] / one['fuel_lb_h_public'] - 1):+.1f} %",
        ]
        for one in checks["engine"]
    ]
    yield from table(("shp", "fuel lb/h", "difference"), rows)


def _optima(optima: list[Results], band: str) -> Iterator[str]:
    header = ("mass kg", "altitude m", "speed m/s", "power kW", "power: speed", "saving", "fuel: speed", "saving")
    header = (*header, "within limits: speed", "fuel", "power", "active limit", "walk ends")
    rows = []
    for one in optima:
        start = [f"{one['mass']:.0f}", f"{one['altitude']:.0f}", f"{one['speed']:.0f}"]
        if f"{band}_power_saving" not in one:
            rows.append([*start, *("-",) * 9, one["end"]])
            continue
        row = [f"{one['nominal_power_kw']:.0f}"]
        for name in ("power", "fuel"):
            row += [f"{one[f'{band}_{name}_rotor_speed']:.1f}", f"{one[f'{band}_{name}_saving']:.1f}"]
        limited = [f"{one[f'{band}_limited_{name}']:.1f}" for name in ("rotor_speed", "saving", "power")]
        limited = limited if one["within_limits"] else [f"({text})" for text in limited]
        rows.append([*start, *row, *limited, one[f"{band}_active"], one["end"]])
    yield from table(header, rows)


def _sensitivity(found: Mapping[str, list[Results]]) -> Iterator[str]:
    speeds = [f"{one['speed']:.0f} m/s" for one in found["as shipped"]]
    yield from table(("variant", *speeds), [[name, *map(_cell, walks)] for name, walks in found.items()])


def _cell(one: Results) -> str:
    if "narrow_power_saving" not in one:
        return "no trim at 100 %"
    return " / ".join(f"{one[f'narrow_{name}_saving']:.1f}" for name in ("power", "fuel", "limited"))


def _cross_check(results: Results) -> Iterator[str]:
    rows = []
    for one in results["cross_check"]:
        same = next(
            w for w in results["optima"] if (w["mass"], w["altitude"], w["speed"]) == (8300.0, 0.0, one["speed"])
        )
        rows.append(
            [
                f"{one['speed']:.0f}",
                f"{one['rotor_speed']:.2f} / {same['narrow_limited_rotor_speed']:.2f}",
                f"{one['saving']:.2f} / {same['narrow_limited_saving']:.2f}",
                one["active"],
            ]
        )
    yield from table(("speed m/s", "rotor speed %, one problem / walk", "fuel saved %", "active"), rows)


def draw(path: Path, results: Results) -> None:
    """Power with its public points, savings of power and of fuel, and the best rotor speeds, over airspeed."""
    figure = new_figure(11.0, 8.5)
    axes = figure.subplots(2, 2)
    titles = ("main-rotor power at 100 %, kW", "main-rotor power saved within 85 to 100 % speed, %")
    titles = (
        *titles,
        "fuel saved within 85 to 100 % speed, %",
        "rotor speed of least fuel within limits, % of nominal",
    )
    for ax, title in zip(axes.flat, titles, strict=True):
        ax.set_ylabel(title, fontsize=NORMAL)
        ax.set_xlabel("true airspeed, m/s", fontsize=SMALL)
    flights = list(dict.fromkeys((one["mass"], one["altitude"]) for one in results["optima"]))
    for (mass, altitude), look in zip(flights, LOOKS, strict=True):
        own = [one for one in results["optima"] if (one["mass"], one["altitude"]) == (mass, altitude)]
        own = [one for one in own if "narrow_power_saving" in one]
        label = f"{mass:.0f} kg, {altitude:.0f} m"
        _curve(axes[0, 0], own, "nominal_power_kw", look, label)
        _curve(axes[0, 1], own, "narrow_power_saving", look, label)
        _curve(axes[1, 0], own, "narrow_fuel_saving", look, f"{label}, trims only", style="--")
        _curve(axes[1, 0], own, "narrow_limited_saving", look, f"{label}, within limits")
        _curve(axes[1, 1], own, "narrow_limited_rotor_speed", look, f"{label}, 85 to 100 %")
        _curve(axes[1, 1], own, "wide_limited_rotor_speed", look, f"{label}, 75 to 115 %", style=":")
    public = [(one["speed"], one["rotor_hp_public"] * HORSEPOWER) for one in results["checks"]["power"]]
    axes[0, 0].plot(*zip(*public, strict=True), "k*", label="Gen Hel, 7632 kg, sea level")
    for name, speed, saving, style in PUBLISHED:
        axes[0, 1].plot(speed, saving, style, color=BLACK, linewidth=1.8, label=name)
    for name, band in PUBLISHED_FUEL:
        axes[1, 0].axhspan(*band, color=BLACK, alpha=0.12, lw=0, label=name)
    axes[0, 1].set_ylim(0.0, 24.0)
    axes[1, 0].set_ylim(0.0, 24.0)
    axes[1, 1].set_ylim(68.0, 101.0)
    for ax in axes.flat:
        ax.legend(fontsize=SMALL, frameon=False)
        tidy(ax)
    path.write_bytes(png(figure))


def _curve(axes: Axes, own: list[Results], name: str, look: tuple[str, str], label: str, style: str = "-") -> None:
    place = [one["speed"] for one in own], [one[name] for one in own]
    colour, mark = look
    axes.plot(*place, style, color=colour, marker=mark, markersize=4, label=label, linewidth=1.3)
