"""Rotor speed and twist of least fuel in climb and descent, beside the table that the study prescribes.

Its surrogate knew level flight only. The path model that our missions fly on has the climb angle, so the table follows
from the model; the physics' own optimum, with no surrogate in it, stands beside.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.lines import Line2D

import vrsopt
from vrsopt.helicopter import helicopter
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.mission.conditions import Conditions
from vrsopt.point_optimum import physics_optimum
from vrsopt.report.style import BLACK, BLUE, GREY, NORMAL, SKY, SMALL, VERMILION, new_figure, tidy
from vrsopt.schedule.batched import batched_minimum
from vrsopt.schedule.prescribed import CLIMB, TWIST, descent_speed
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.surrogate_path import SurrogateAircraft

from .finding import Finding, Picture, Table

SPEED, ALTITUDE = 40.0, 300.0  # m/s, m: the study's climbs and descents are flown at 40 m/s
ANGLES = np.linspace(-9.0, 9.0, 37)  # deg
TABLED = (-7.12, 0.0, 7.12)  # deg: the study's descent, level flight, its climb
MASSES = (1800.0, 2000.0, 2200.0, 2400.0)  # kg: the last two in the study's heavier classes
LOOKS = ((SKY, "-", "o"), (BLUE, "--", "s"), (VERMILION, "-.", "D"), (BLACK, ":", "^"))  # colour, line, mark
BESIDE = 0.5  # deg between the marks of one angle, so that none hides another
ON = 1e-4  # as near to a limit an optimum rests on it
PRESCRIBED_RATIO = {-1: descent_speed, 1: lambda mass: CLIMB}


def best(mass: float, angles_deg: np.ndarray) -> dict[str, np.ndarray]:
    """Optimum in steady flight at SPEED and ALTITUDE: rotor speed [%], twist [deg], whether the limits are kept and the
    fuel that the study's table burns more than it [%]; the table has no entry for level flight (nan)."""
    machine = helicopter()
    margin = machine.aircraft.blade_loading_limit.manoeuvre_margin
    make = SurrogateAircraft(vrsopt.load_surrogate("level"), Limits(machine.aircraft, machine.engine, "manual", margin))
    angle = np.radians(angles_deg)
    level = Conditions.level(np.full(len(angle), SPEED), ALTITUDE)
    model = make(replace(level, climb_angle=angle, equivalent_climb_angle=angle))
    settings, weights = ScheduleSettings(), np.full(len(angle), mass)
    nominal = settings.nominal_rotor_speed
    found = batched_minimum(model, weights, box=settings.box(model.bounds))
    ratio = np.array([np.nan if a == 0 else PRESCRIBED_RATIO[int(np.sign(a))](mass) for a in angles_deg])
    table = model.evaluate(weights, np.nan_to_num(ratio, nan=1.0) * nominal, np.full(len(angle), TWIST))
    more = 100.0 * (table.fuel_flow / found.fuel_flow - 1.0)
    return {
        "rotor_speed": 100.0 * found.rotor_speed / nominal,
        "twist": np.degrees(found.twist),
        "kept": found.excess <= 1e-6,
        "rests_on": np.where(np.abs(found.excess) < ON, found.nearest_limit, -1),
        "prescribed": 100.0 * ratio,
        "more": np.where(np.isfinite(ratio), more, np.nan),
        "prescribed_excess": 100.0 * np.max(table.limits, axis=0),
    }


def physics(mass: float, angle_deg: float) -> list[float | None]:
    """Rotor speed [%] and twist [deg] of the physics' own optimum, None where it is not found."""
    found = physics_optimum(mass, SPEED, altitude=ALTITUDE, climb_angle=float(np.radians(angle_deg)))
    if not found.success:
        return [None, None]
    ratio = found.rotor_speed / ScheduleSettings().nominal_rotor_speed
    return [round(100.0 * ratio, 2), round(float(np.degrees(found.twist)), 2)]


def draw() -> Any:
    """Rotor speed and twist over the flight-path angle, a line for each mass, the study's table as marks."""
    figure = new_figure(10.0, 4.4)
    left, right = figure.subplots(1, 2)
    settings = ScheduleSettings()
    bounds = 100.0 * np.array(settings.rotor_speed_bounds) / settings.nominal_rotor_speed
    for k, (mass, (colour, line, mark)) in enumerate(zip(MASSES, LOOKS, strict=True)):
        found = best(mass, ANGLES)
        look = {"marker": mark, "color": colour, "markersize": 7, "markeredgecolor": "white", "ls": "none", "zorder": 3}
        for axes, name in ((left, "rotor_speed"), (right, "twist")):
            values = np.where(found["kept"], found[name], np.nan)
            axes.plot(ANGLES, values, color=colour, ls=line, lw=1.8)
        for angle in (TABLED[0], TABLED[-1]):
            ratio = PRESCRIBED_RATIO[int(np.sign(angle))](mass)
            place = angle + BESIDE * (k - 0.5 * (len(MASSES) - 1))
            left.plot(place, 100.0 * ratio, **look)
            right.plot(place, np.degrees(TWIST), **look)
    panels = (
        (left, bounds, "rotor speed, % of nominal"),
        (right, np.degrees(settings.twist_bounds), "blade twist, deg"),
    )
    for axes, ends, words in panels:
        for end in ends:
            axes.axhline(end, color=GREY, lw=3.0, zorder=1)
        axes.set_xticks(np.arange(-8, 9, 4))
        axes.set_xlabel("flight-path angle, deg", fontsize=NORMAL)
        axes.set_ylabel(words, fontsize=NORMAL)
        axes.set_title(f"{SPEED:.0f} m/s, {ALTITUDE:.0f} m", fontsize=NORMAL)
        tidy(axes)
    look = {"loc": "outside lower center", "fontsize": SMALL, "frameon": False, "handlelength": 3.4}
    figure.legend(handles=legend_handles(), ncols=len(MASSES) + 1, **look)
    return figure


def legend_handles() -> list[Line2D]:
    """Line and mark of each mass, one above the other in the legend, then the bounds."""
    handles = []
    for mass, (colour, line, mark) in zip(MASSES, LOOKS, strict=True):
        look = {"markersize": 7, "markeredgecolor": "white", "ls": "none"}
        handles.append(Line2D([], [], color=colour, ls=line, lw=1.8, label=f"{mass:.0f} kg"))
        handles.append(Line2D([], [], color=colour, marker=mark, label=f"{mass:.0f} kg, the study's table", **look))
    return [*handles, Line2D([], [], color=GREY, lw=3.0, label="bounds")]


def compared() -> tuple[list[list[Any]], list[str]]:
    """A row of the table for each mass and angle, and the limit that each optimum rests on."""
    rows, limits = [], []
    for mass in MASSES:
        found = best(mass, np.array(TABLED))
        limits += [LIMIT_NAMES[k] if k >= 0 else "none" for k in found["rests_on"]]
        for k, angle in enumerate(TABLED):
            cells = [found[name][k] for name in ("rotor_speed", "twist", "prescribed", "more", "prescribed_excess")]
            own = [round(float(c), 2) if np.isfinite(c) else None for c in cells]
            if angle == 0.0:
                own[4] = None
            rows.append([round(mass), angle, *own, *physics(mass, angle), "kept" if found["kept"][k] else "broken"])
    return rows, limits


def beside_the_table(words: str, rows: list[list[Any]]) -> str:
    """The rows of one direction, in ``words``, against the study's entries."""
    speeds, twists, more = ([row[k] for row in rows] for k in (2, 3, 5))
    *first, last = (f"{x:.0f}" for x in sorted({row[4] for row in rows}))
    table = f"{', '.join(first)} or {last}" if first else last
    return (
        f"In {words} at {SPEED:.0f} m/s the best rotor speed is {min(speeds):.0f} to {max(speeds):.0f} % by mass "
        f"(the study prescribes {table} %) with {min(twists):.1f} to {max(twists):.1f} deg of twist (8 deg); the table "
        f"changes the fuel flow by {min(more):+.1f} to {max(more):+.1f} % against the optimum."
    )


def resting(limits: list[str]) -> str:
    """What the optima rest on, each limit with its count."""
    if len(set(limits)) == 1:
        return f"{limits[0]}, in all {len(limits)}"
    return ", ".join(f"{name} in {limits.count(name)}" for name in dict.fromkeys(limits))


def at_most(value: float, unit: str) -> str:
    """A difference of the table's numbers, which have two decimals."""
    return f"at most {value:.2f} {unit}" if value >= 0.005 else f"less than 0.01 {unit}"


def sentences(rows: list[list[Any]], limits: list[str]) -> list[str]:
    """What the rows say."""
    climbs, falls = ([row for row in rows if row[1] * sign > 0] for sign in (1, -1))
    broken = [row for row in rows if row[6] is not None and row[6] > 0.1]
    both = [row for row in rows if row[7] is not None]
    speed, twist = (max(abs(row[k] - row[k + 5]) for row in both) for k in (2, 3))
    return [
        beside_the_table("climb", climbs),
        beside_the_table("descent", falls),
        f"The study's table breaks a limit of ours in {len(broken)} of its {len(climbs + falls)} entries.",
        f"What keeps the best rotor speed from being lower, over the {len(rows)} rows: {resting(limits)}.",
        f"The physics' own optimum, with no surrogate in it, is found in {len(both)} of {len(rows)} rows and differs "
        f"by {at_most(speed, '% of rotor speed')} and by {at_most(twist, 'deg of twist')}.",
        "Nothing here is prescribed: the optimum follows from the model, which has the flight-path angle.",
    ]


def run() -> Finding:
    """Optima at the study's angles beside its table."""
    rows, limits = compared()
    said = (
        "A prescribed table, as its surrogate knew level flight only: climbs at 100 %, descents at 85, 90 or 95 % by "
        "gross mass (from 2100 and from 2300 kg), both with 8 deg of twist."
    )
    head = (
        "mass kg",
        "angle deg",
        "best speed %",
        "best twist deg",
        "prescribed speed %",
        "prescribed fuel more %",
        "prescribed: over the nearest limit %",
        "physics best speed %",
        "physics best twist deg",
        "limits at the best",
    )
    caption = (
        "Lines: our optimum over the flight-path angle, by gross mass. Marks: the study's table for the same masses, "
        f"side by side, all at {TABLED[0]:g} and {TABLED[-1]:g} deg."
    )
    figures = {"climb": Picture(draw(), caption)}
    return Finding("Climb and descent", said, sentences(rows, limits), Table(head, rows), figures)
