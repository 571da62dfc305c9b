"""The page of the study of uncertainty, made from its result file alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from calibrate_rotor import allowed_range
from page_table import table
from uncertainty_effects import Effect, added, effects, label
from uncertainty_figures import draw
from uncertainty_numbers import LEFT_OUT, OWN_RANGES

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
    yield "## The answer"
    yield ""
    yield (
        f"Saving of fuel of each mission's trajectory on the physics, and what 90 % of {len(samples['keys'])} samples "
        "lie within (5th, 50th and 95th percentile): with all numbers drawn, and with the manoeuvre margin held at "
        "1.3, which is a rule of operation rather than a property of the aircraft."
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
    constants = np.array(content["samples"]["constants"])
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


def method(content: Mapping[str, Any]) -> Iterator[str]:
    """How it was computed and how far that can be trusted."""
    representation, schedules = content["representation"], content["schedules"]
    flights = representation["flights"]
    yield "## How"
    yield ""
    yield (
        f"{len(flights)} flights out of the missions stand for all three, each mission with weights of its own: a "
        "quadrature that integrates nominal fuel, least fuel and rotor speed of least fuel, on the surrogate, for five "
        "masses and margins, time on the limits and speed (`uncertainty_points.py`). Idle on the ground is added, and "
        "the optimum carries the fuel that it has not burned. Rates of the actuators are not part of it: the band of "
        "the trajectory is that of the optimum shifted by the difference of the two on the shipped numbers."
    )
    yield ""
    rows = []
    for name, reference in content["reference"].items():
        error = 100.0 * representation["largest_fuel_error"][name]
        pairs = np.array(content["check"][name])
        rows.append(
            [
                name.upper(),
                f"{reference['saving']:.2f}",
                f"{schedules[name]['pointwise']:.2f}",
                f"{schedules[name]['trajectory']:.2f}",
                f"{error:.3f}",
                ", ".join(f"{few:+.2f} ({many:+.2f})" for many, few in pairs),
                f"{np.max(np.abs(pairs[:, 0] - pairs[:, 1])):.2f}",
            ]
        )
    yield from table(
        (
            "mission",
            "saving of the few flights %",
            "pointwise schedule on the physics %",
            "trajectory %",
            "largest error of a fuel integral %",
            "change of the saving in samples (in 24 flights)",
            "largest difference",
        ),
        rows,
    )
    yield from _response(content["margin_held"])
    yield "The flights, and for how many seconds each stands:"
    yield ""
    weights = representation["weights_s"]
    yield from table(
        ("mass kg", "altitude m", "speed m/s", "climb deg", "vertical m/s", "load factor", "skids over ground m")
        + tuple(name.upper() for name in weights),
        (
            [
                f"{one['mass']:.0f}",
                f"{one['altitude']:.0f}",
                f"{one['speed']:.1f}",
                f"{np.degrees(one['climb_angle']):+.1f}",
                f"{one['vertical_speed']:+.1f}",
                f"{one['load_factor']:.2f}",
                "-" if one["height"] < 0 else f"{one['height']:.0f}",
                *(f"{row[k]:.0f}" for row in weights.values()),
            ]
            for k, one in enumerate(flights)
        ),
    )
    yield (
        "Optima are found by a few trims where the rotor turns as slowly as the limits allow, and else by IPOPT with "
        "trim and engine as constraints (`uncertainty_optimum.py`, `vrsopt.point_optimum`). On the shipped aircraft "
        f"and {len(next(iter(content['check'].values())))} samples both ways were taken: least fuel flows differ by at "
        f"most {100.0 * content['disagreement']:.4f} %."
    )
    yield ""
    samples = content["samples"]
    unsolved = samples["unsolved"]
    yield (
        f"{len(content['numbers'])} numbers, independent and uniform over their ranges, Latin hypercube, seed "
        f"{content['seed']}. {len(samples['keys'])} samples solved, {len(unsolved)} not"
        + (f": {'; '.join(sorted({one['message'] for one in unsolved}))}." if unsolved else ".")
    )
    own = ", ".join(f"{label(path)} {low:g} to {high:g}" for path, (low, high) in OWN_RANGES.items())
    yield (
        f"Ranges that no data file has, as factors: {own}. The section's are set beside the constants of NACA 0012, "
        "which have 3 to 17 % less largest lift at Mach 0.3 to 0.5 and 1.4 times the growth of drag with lift; the "
        "masses are those of the missions, which are assumptions."
    )
    yield "Left out:"
    yield ""
    for path, reason in LEFT_OUT.items():
        yield f"- {label(path).rstrip(': ')}: {reason}"
    yield ""
    versions = ", ".join(f"{name} {value}" for name, value in content["versions"].items())
    yield f"Written by `python problems/uncertainty.py`; all figures are in `uncertainty.json`. {versions}."


def _response(held: Mapping[str, Any]) -> Iterator[str]:
    """How good the samples with the margin held are."""
    left = [value for value in held["left_out"]["saving"].values()]
    pairs = np.array([pair for row in held["flown_again"]["saving"].values() for pair in row])
    speeds = np.array([pair for row in held["flown_again"]["rotor_speed"].values() for pair in row])
    count = len(next(iter(held["flown_again"]["saving"].values())))
    yield (
        "With the margin held the samples were not all flown again: each is changed by what a response says, the "
        "parabolas of the tornado and products of the numbers that matter most, fitted to the samples "
        f"(`uncertainty_response.py`). Left out of the fit, a sample's saving is missed by {min(left):.2f} to "
        f"{max(left):.2f} points (root mean square, by mission). {count} samples were flown again with the margin "
        f"held: the saving is met within {_rms(pairs):.2f} points and the rotor speed within {_rms(speeds):.2f} (root "
        f"mean square), at worst {np.max(np.abs(pairs[:, 0] - pairs[:, 1])):.2f} and "
        f"{np.max(np.abs(speeds[:, 0] - speeds[:, 1])):.2f}."
    )
    yield ""


def _rms(pairs: np.ndarray) -> float:
    return float(np.sqrt(np.mean((pairs[:, 0] - pairs[:, 1]) ** 2)))


def _signed(value: float) -> str:
    text = f"{value:+.2f}"
    return "0" if float(text) == 0.0 else text


def _triple(values: Sequence[float]) -> str:
    return " / ".join(f"{value:.1f}" for value in values)
