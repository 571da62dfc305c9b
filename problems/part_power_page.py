"""Tables and figure of the study of the consumption at part power."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from page_table import table
from part_power import cases, consumption, ends, judged, point, span, steps, target
from part_power_cycle import GROUPS, cycle, shares, slopes

from vrsopt.report.style import BLACK, BLUE, GREY, NORMAL, ORANGE, SMALL, new_figure, tidy
from vrsopt.turboshaft.cycle import sized
from vrsopt.turboshaft.data import EngineData

NOTABLE = 0.0005  # of the ratio
WAYS = (("take_off", "rest"), ("rest", "flight"), ("take_off", "flight"))
FORMATS = {"turbine_inlet_temperature": "{:.0f} K", "inlet_temperature": "{:.3f}", "accessory_work": "{:.0f} J/kg"}
NEEDED = (
    "compressor_efficiency",
    "gas_generator_turbine_efficiency",
    "power_turbine_efficiency",
    "combustion_efficiency",
    "turbine_inlet_temperature",
    "pressure_ratio",
    "inlet_pressure",
)


def chain(engine: EngineData) -> Iterator[str]:
    """Table of the cycle at the three points and what each group contributes to the consumption."""
    found = steps(engine)
    parts = [shares(engine, found[first], found[second]) for first, second in WAYS]
    rows = []
    for group, names in GROUPS.items():
        values = [
            ", ".join(FORMATS.get(names[0], "{:.4f}").format(state[name]) for name in names) for state in found.values()
        ]
        rows.append([group, *values, *(f"{100 * part[group]:+.2f}" for part in parts)])
    whole = [f"{cycle(engine, state)['consumption']:.4f}" for state in found.values()]
    rows.append(["consumption kg/kWh", *whole, *(f"{100 * sum(part.values()):+.2f}" for part in parts)])
    header = ("", "313 kW", "257 kW at rest", "257 kW in flight", "313 to 257 kW %", "to flight %", "both %")
    yield from table(header, rows)


def needed(engine: EngineData) -> Iterator[str]:
    """Table: how far one step alone would have to be off at 257 kW to give the flight manual's consumption."""
    state = steps(engine)["flight"]
    missing = float(np.log(target(engine) / point(engine).flight))
    slope = slopes(engine, state)
    rows = []
    for name in NEEDED:
        change = missing / slope[name]
        form = FORMATS.get(name, "{:.4f}")
        rows.append(
            [
                name.replace("_", " "),
                f"{slope[name]:+.2f}",
                form.format(state[name]),
                form.format(state[name] * np.exp(change)),
            ]
        )
    yield from table(("step", "% of fuel for 1 %", "model at 257 kW", "needed"), rows)


def sensitivity(engine: EngineData) -> Iterator[str]:
    """Table of the numbers that move the ratio by NOTABLE or more, widest first."""
    rows, rest = [], 0
    for pair in ends(engine):
        known = [end for end in pair if end is not None]
        if span(pair) < NOTABLE and len(known) == 2:
            rest += 1
            continue
        cells = [
            " / ".join(f"{form(end):.4f}" if end else "not closed" for end in pair)
            for form in (lambda end: end.point.flight, lambda end: end.point.ratio)
        ]
        rows.append([known[0].name, " / ".join(f"{end.value:g}" if end else "-" for end in pair), *cells])
    base = point(engine)
    rows.append([f"{rest} others", "", f"{base.flight:.4f}", f"{base.ratio:.4f}, less than {NOTABLE:g} wide"])
    yield from table(("number", "range", "kg/kWh at 257 kW, 131.5 kt", "over that at 313 kW"), rows)


def explanations(engine: EngineData) -> Iterator[str]:
    """Table of the engines that were tried, and the take-off consumption with which each meets the flight manual."""
    rows = []
    for name, (changed, maps) in cases(engine).items():
        flight, rest, take_off, sister = (consumption(changed, *place, maps) for place in judged(engine))
        rows.append(
            [
                name,
                f"{flight:.4f}",
                f"{flight * engine.calibration.power / 1e3:.1f}",
                f"{flight / take_off:.4f}",
                f"{rest / take_off:.4f}",
                f"{sister / take_off:.4f}",
                f"{target(engine) / flight * take_off:.4f}",
                f"{sized(changed).power_turbine_efficiency:.3f}",
            ]
        )
    rows.append(["measured", f"{target(engine):.4f}", "102 +-1 (flight manual)", "", "", "1.098 (250-B17F)", "", ""])
    header = (
        "engine",
        "kg/kWh at 257 kW, 131.5 kt",
        "kg/h",
        "over that at 313 kW",
        "257 kW at rest over 313 kW",
        "69.8 % power over 313 kW",
        "take-off consumption needed kg/kWh",
        "power turbine's efficiency",
    )
    yield from table(header, rows)


def page(engine: EngineData) -> Iterator[str]:
    """Tables of the page."""
    yield "What each step of the cycle contributes to the consumption:\n"
    yield from chain(engine)
    yield "What one step alone would have to be at 257 kW in flight, exact derivatives at the model's state:\n"
    yield from needed(engine)
    yield "Every number with a range at both its ends, design point kept:\n"
    yield from sensitivity(engine)
    yield "Explanations tried:\n"
    yield from explanations(engine)


def draw(engine: EngineData) -> Any:
    """Contributions of the cycle's steps, and the numbers with the widest effect."""
    found = steps(engine)
    figure = new_figure(10.5, 4.4)
    left, right = figure.subplots(1, 2, gridspec_kw={"width_ratios": [1.0, 1.1]})
    parts = shares(engine, found["take_off"], found["flight"])
    parts = {name: 100 * value for name, value in parts.items() if abs(value) > 5e-4}
    parts |= {"model": sum(parts.values()), "flight manual": 100 * np.log(target(engine) / point(engine).take_off)}
    colours = [ORANGE if value > 0 else BLUE for value in parts.values()]
    left.barh(list(parts)[::-1], list(parts.values())[::-1], color=[BLACK, GREY, *colours[-3::-1]])
    for row, value in enumerate(list(parts.values())[::-1]):
        left.text(
            value + (0.08 if value > 0 else -0.08),
            row,
            f"{value:+.1f}",
            va="center",
            ha="left" if value > 0 else "right",
            fontsize=SMALL,
        )
    left.set_title("by step of the cycle", fontsize=NORMAL, pad=14)
    left.set_xlabel("100 ln of consumption at 257 kW, 131.5 kt over that at 313 kW", fontsize=SMALL)
    left.axvline(0.0, color=BLACK, linewidth=0.8)
    left.set_xlim(-3.4, 5.2)
    pairs = [pair for pair in ends(engine) if None not in pair][:10][::-1]
    names = [pair[0].name.replace("_", " ").replace(".", ": ") for pair in pairs if pair[0]]
    low, high = (np.array([pair[k].point.ratio for pair in pairs]) for k in (0, 1))  # type: ignore[union-attr]
    base, aim = point(engine).ratio, target(engine) / point(engine).take_off
    right.barh(names, low - base, left=base, color=BLUE, label="low end of the range")
    right.barh(names, high - base, left=base, color=ORANGE, label="high end")
    right.axvline(base, color=BLACK, linewidth=0.8)
    right.axvline(aim, color=BLACK, linestyle="--", linewidth=1.0)
    right.text(aim, 9.7, " flight manual", fontsize=SMALL, va="bottom")
    right.text(base, 9.7, " model", fontsize=SMALL, va="bottom")
    right.set_title("one number at a time, at the ends of its range", fontsize=NORMAL, pad=14)
    right.set_xlabel("consumption at 257 kW, 131.5 kt over that at 313 kW", fontsize=SMALL)
    right.legend(fontsize=SMALL, frameon=False, loc="lower left", bbox_to_anchor=(0.12, 0.0))
    right.set_xlim(1.0, 1.055)
    for axes in (left, right):
        tidy(axes)
    return figure
