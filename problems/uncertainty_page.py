"""The page of the study of uncertainty, made from its result file alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from calibrate_rotor import allowed_range
from page_table import table
from uncertainty_effects import Effect, added, effects, label, shares
from uncertainty_figures import draw
from uncertainty_method import method

from vrsopt.aircraft import load_aircraft

NOTABLE = 0.1  # points: numbers of less effect on every saving are not in the table
SOLVED = ("induced_power_factor", "section_drag_level", "parasite_area")
INTRODUCTION = """# How sure is the saving?

The model rests on numbers that no source gives exactly: they stand in the data files with a range, and 1.3 times the
thrust flown is a rule that could be another. Here every one of them is set to both ends of its range, and all of them
are drawn together. Each time the rotor is calibrated again on the hover and the cruise power of the flight manual, as
it would have been had the number been that from the start (induced-power factor and parasite area are solved), and
rotor speed and twist are optimised on the physics itself, with trim, engine and all limits: no surrogate is involved.
"""


def write_page(content: Mapping[str, Any], folder: Path) -> None:
    """Figures and page of a result."""
    found = {quantity: effects(content, quantity) for quantity in ("saving", "rotor_speed")}
    draw(content, found, folder / "figures")
    parts = [INTRODUCTION, *answer(content), *tornado(content, found), *others(content), *method(content)]
    text = "\n".join(parts).rstrip() + "\n"
    (folder / "uncertainty.md").write_text(text, encoding="utf-8")


def shifted(content: Mapping[str, Any], kind: str, mission: str) -> list[float]:
    """Band of the saving of the trajectory [%]: that of the optimum, less what the trajectory's rates cost."""
    cost = content["reference"][mission]["saving"] - content["schedules"][mission]["trajectory"]
    return [value - cost for value in content[kind]["bands"]["saving"][mission]]


def answer(content: Mapping[str, Any]) -> Iterator[str]:
    """The bands."""
    samples, held = content["samples"], content["margin_held"]
    count = len(next(iter(samples["values"]["saving"].values())))
    yield "## The answer"
    yield ""
    yield (
        f"Saving of fuel of each mission's trajectory on the physics, and what 90 % of {count} samples lie within "
        "(5th, 50th and 95th percentile): with all numbers drawn, and with the manoeuvre margin held at 1.3, which is "
        "a rule of operation rather than a property of the aircraft."
    )
    yield ""
    rows = []
    for name, reference in content["reference"].items():
        rows.append(
            [
                name.upper(),
                f"**{content['schedules'][name]['trajectory']:.1f}**",
                _triple(shifted(content, "samples", name)),
                _triple(shifted(content, "margin_held", name)),
                f"{reference['rotor_speed']:.1f}",
                _triple(samples["bands"]["rotor_speed"][name]),
                _triple(held["bands"]["rotor_speed"][name]),
            ]
        )
    yield from table(
        ("mission", "saving %", "all drawn", "margin held", "mean rotor speed %", "all drawn", "margin held"), rows
    )
    below = {name: sum(value <= 0.0 for value in row) for name, row in samples["values"]["saving"].items()}
    least = min(min(row) for row in samples["values"]["saving"].values())
    most = max(max(row) for row in samples["values"]["saving"].values())
    if not any(below.values()):
        yield f"Every sample saves fuel on every mission: between {least:.1f} and {most:.1f} %."
    else:
        yield f"Samples that save nothing: {', '.join(f'{name.upper()} {k}' for name, k in below.items())}."
    middle = [samples["bands"]["saving"][name][1] - content["reference"][name]["saving"] for name in below]
    side = "below" if np.mean(middle) < 0 else "above"
    yield (
        f"The median lies {min(map(abs, middle)):.1f} to {max(map(abs, middle)):.1f} points {side} what the shipped "
        "numbers give, where ranges reach further to one side of the shipped value than to the other."
    )
    yield ""
    yield "![Samples](figures/uncertainty_band.png)"
    yield ""


def tornado(content: Mapping[str, Any], found: Mapping[str, Sequence[Effect]]) -> Iterator[str]:
    """What each number does on its own."""
    saving, speed = found["saving"], {effect.path: effect for effect in found["rotor_speed"]}
    entries = {one["path"]: one for one in content["numbers"]}
    missions = list(content["reference"])
    shown = [effect for effect in saving if effect.largest >= NOTABLE]
    yield "## What matters"
    yield ""
    rest = [effect for effect in saving if effect.largest < NOTABLE]
    first, second, third = (label(effect.path) for effect in saving[:3])
    yield (
        f"Most of the saving's uncertainty comes from {first}, {second} and {third}. Of {len(saving)} numbers "
        f"{len(shown)} change some saving by {NOTABLE:g} points or more at an end of their range, each of the other "
        f"{len(rest)} by at most {max((effect.largest for effect in rest), default=0.0):.2f}."
    )
    moved = [label(effect.path) for effect in found["rotor_speed"] if effect.largest >= NOTABLE]
    yield (
        f"Mean rotor speed is moved by {NOTABLE:g} % of nominal or more by {len(moved)} alone: {', '.join(moved)}. It "
        "rests on limits, which the other numbers hardly enter."
    )
    yield ""
    lift = next((effect for effect in saving if effect.path == "section.largest_lift"), None)
    if lift and min(lift.low.values()) > 0.0 > max(lift.high.values()):
        yield (
            "Less largest lift saves more, not less: its stall takes power at the cruise point that calibration takes "
            "off the parasite area, and the blade-loading limit is left as it is."
        )
    yield ""
    yield "Shares of the variance of the saving, were the effects to add up, %:"
    yield ""
    by_mission = {name: shares(saving, name) for name in missions}
    groups = sorted(by_mission[missions[0]], key=lambda group: -sum(one[group] for one in by_mission.values()))
    yield from table(
        ("", *(name.upper() for name in missions)),
        ([group, *(f"{100.0 * by_mission[name][group]:.0f}" for name in missions)] for group in groups),
    )
    for quantity in found:
        yield f"![Tornado](figures/uncertainty_{quantity}.png)"
    yield ""
    yield "Changes at the low and at the high end, in points of saving and of nominal rotor speed:"
    yield ""
    header = ["number", "shipped", "range", *(f"saving {name.upper()}" for name in missions)]
    header += [f"rotor speed {name.upper()}" for name in missions]
    rows = []
    for effect in shown:
        entry, other = entries[effect.path], speed[effect.path]
        cells = [f"{_signed(one.low[name])}, {_signed(one.high[name])}" for one in (effect, other) for name in missions]
        rows.append([label(effect.path), f"{entry['value']:.4g}", f"{entry['low']:.4g} to {entry['high']:.4g}", *cells])
    yield from table(header, rows)
    pairs = []
    for name in missions:
        spread = float(np.std(content["samples"]["values"]["saving"][name], ddof=1))
        pairs.append(f"{name.upper()} {added(saving, name):.2f} against {spread:.2f}")
    yield (
        "Were all effects straight lines that add up, the standard deviation of the saving would be that of the "
        f"tornado; against that of the samples, in points: {', '.join(pairs)}."
    )
    yield ""


def others(content: Mapping[str, Any]) -> Iterator[str]:
    """Variants of the data files, and the calibrated constants."""
    yield "## Readings beyond the ranges"
    yield ""
    yield (
        "Variants of the data files: other ways to meet the same calibration points, whose constants leave their "
        "ranges, and other assumptions as a whole. They are ends of their own, and not part of the band. Change of the "
        "saving and of the mean rotor speed in points:"
    )
    yield ""
    reference = content["reference"]
    rows = []
    for name, row in content["variants"].items():
        if row["message"]:
            rows.append([name.replace("_", " "), row["message"], *(2 * len(reference) - 1) * [""]])
            continue
        cells = [
            _signed(row[mission][quantity] - reference[mission][quantity])
            for quantity in ("saving", "rotor_speed")
            for mission in reference
        ]
        rows.append([name.replace("_", " "), *cells])
    header = [f"{what} {mission.upper()}" for what in ("saving", "rotor speed") for mission in reference]
    yield from table(("variant", *header), rows)
    constants = np.array(content["constants"])
    aircraft = load_aircraft()
    text = []
    for k, name in enumerate(SOLVED):
        allowed = allowed_range(aircraft, name)
        if name == "section_drag_level" or allowed is None:
            continue
        outside = int(np.sum((constants[:, k] < allowed[0]) | (constants[:, k] > allowed[1])))
        text.append(
            f"{name.replace('_', ' ')} {constants[:, k].min():.3f} to {constants[:, k].max():.3f}, in {outside} of "
            f"{len(constants)} outside its own range of {allowed[0]:g} to {allowed[1]:g}"
        )
    yield f"What calibration gives in the samples: {'; '.join(text)}. Samples outside are kept."
    yield ""


def _signed(value: float) -> str:
    text = f"{value:+.2f}"
    return "0" if float(text) == 0.0 else text


def _triple(values: Sequence[float]) -> str:
    return " / ".join(f"{value:.1f}" for value in values)
