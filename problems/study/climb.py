"""Rotor speed and twist of least fuel in climb and descent, beside the table that the study prescribes.

Its surrogate knew level flight only. The path model that our missions fly on has the climb angle, so the table follows
from the model; the physics' own optimum, with no surrogate in it, stands beside.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import vrsopt
from vrsopt.helicopter import helicopter
from vrsopt.limits import Limits
from vrsopt.mission.conditions import Conditions
from vrsopt.point_optimum import physics_optimum
from vrsopt.report.style import BLUE, GREY, NORMAL, SKY, SMALL, VERMILION, new_figure, tidy
from vrsopt.schedule.batched import batched_minimum
from vrsopt.schedule.prescribed import CLIMB, TWIST, descent_speed
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.surrogate_path import SurrogateAircraft

from .finding import Finding, Table

SPEED, ALTITUDE = 40.0, 300.0  # m/s, m: the study's climbs and descents are flown at 40 m/s
ANGLES = np.linspace(-9.0, 9.0, 37)  # deg
TABLED = (-7.12, 0.0, 7.12)  # deg: the study's descent, level flight, its climb
MASSES = (1800.0, 2000.0, 2200.0, 2400.0)  # kg: the last two in the study's heavier classes
COLOURS = (SKY, BLUE, VERMILION, GREY)
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
    """Rotor speed and twist over the flight-path angle, a line for each mass, the study's table as crosses."""
    figure = new_figure(10.0, 4.4)
    left, right = figure.subplots(1, 2)
    for mass, colour, mark in zip(MASSES, COLOURS, "osD^", strict=True):
        found = best(mass, ANGLES)
        for axes, name in ((left, "rotor_speed"), (right, "twist")):
            axes.plot(
                ANGLES, np.where(found["kept"], found[name], np.nan), color=colour, lw=1.5, label=f"{mass:.0f} kg"
            )
        for angle in (TABLED[0], TABLED[-1]):
            ratio = PRESCRIBED_RATIO[int(np.sign(angle))](mass)
            left.plot(angle, 100.0 * ratio, mark, color=colour, markersize=7, markeredgecolor="black")
            right.plot(angle, np.degrees(TWIST), mark, color=colour, markersize=7, markeredgecolor="black")
    for axes, bounds, words in ((left, (75, 115), "rotor speed, % of nominal"), (right, (6, 16), "blade twist, deg")):
        for bound in bounds:
            axes.axhline(bound, color="black", ls="--", lw=0.9)
        axes.set_xlabel("flight-path angle, deg", fontsize=NORMAL)
        axes.set_ylabel(words, fontsize=NORMAL)
        axes.set_title(f"{SPEED:.0f} m/s, {ALTITUDE:.0f} m", fontsize=NORMAL)
        tidy(axes)
    handles, labels = left.get_legend_handles_labels()
    handles.append(left.plot([], [], "o", color="white", markeredgecolor="black")[0])
    handles.append(left.plot([], [], color="black", ls="--", lw=0.9)[0])
    labels += ["marks: the study's table", "bounds"]
    figure.legend(handles, labels, loc="outside lower center", ncols=6, fontsize=SMALL, frameon=False)
    return figure


def run() -> Finding:
    """Optima at the study's angles beside its table."""
    rows = []
    for mass in MASSES:
        found = best(mass, np.array(TABLED))
        for k, angle in enumerate(TABLED):
            cells = [found[name][k] for name in ("rotor_speed", "twist", "prescribed", "more", "prescribed_excess")]
            own = [round(float(c), 2) if np.isfinite(c) else None for c in cells]
            if angle == 0.0:
                own[4] = None
            rows.append([mass, angle, *own, *physics(mass, angle), "kept" if found["kept"][k] else "broken"])
    climbs, falls = ([row for row in rows if row[1] * sign > 0] for sign in (1, -1))
    sentences = []
    for words, some in (("climb", climbs), ("descent", falls)):
        speeds, twists, more = ([row[k] for row in some] for k in (2, 3, 5))
        table = sorted({row[4] for row in some})
        sentences.append(
            f"In {words} at {SPEED:.0f} m/s the best rotor speed is {min(speeds):.0f} to {max(speeds):.0f} % by mass "
            f"(the study prescribes {' or '.join(f'{x:.0f}' for x in table)} %) with {min(twists):.1f} to "
            f"{max(twists):.1f} deg of twist (8 deg); the table changes the fuel flow by {min(more):+.1f} to "
            f"{max(more):+.1f} % against the optimum."
        )
    broken = [row for row in rows if row[6] is not None and row[6] > 0.1]
    sentences.append(
        f"The table breaks a limit of ours in {len(broken)} "
        f"of the {len(climbs + falls)} entries (nearest limit above 0 %)."
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
    return Finding("Climb and descent", sentences, Table(head, rows), {"climb": draw()})
