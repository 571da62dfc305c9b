"""Optimum of the surrogate against optimum of the physics at 30 points; writes problems/point_optimum.md.

The surrogate's optimum comes from the batched search, the physics' from a problem of its own (vrsopt.point_optimum),
with no surrogate in it. Then the physics is evaluated at the surrogate's rotor speed and twist: the surrogate's price.

Run: python problems/point_optimum.py (about two minutes)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from page_table import table

from vrsopt.helicopter import Helicopter, helicopter
from vrsopt.limits import Limits
from vrsopt.mission.conditions import Conditions
from vrsopt.point_optimum import PointOptimum, physics_optimum
from vrsopt.schedule.batched import batched_minimum, rotor_speed_band
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.study_input import loaded
from vrsopt.schedule.surrogate_path import SurrogateAircraft

PAGE = Path(__file__).with_suffix(".md")
POINTS, SEED = 30, 7
LOWEST, HIGHEST = (1500.0, 0.0, 0.0), (2400.0, 60.0, 1800.0)  # mass [kg], speed [m/s], altitude [m]
CLIMBS = np.radians([6.0, -6.0])  # of every third point, where the speed is enough
CLIMBING = 20.0  # m/s
HOUR, PERCENT = 3600.0, 100.0


@dataclass(frozen=True)
class Compared:
    """One point: mass [kg], speed [m/s], altitude [m], climb angle [rad]; rotor speed (of nominal), twist [rad] and
    fuel flow [kg/s] of the surrogate's optimum, the band of rotor speeds within 0.5 % of it, the physics' fuel flow
    there, its largest usage of a limit and its name; and the physics' own optimum."""

    place: tuple[float, float, float, float]
    rotor_speed: float
    twist: float
    fuel_flow: float
    band: tuple[float, float]
    there: float
    usage: float
    limit: str
    physics: PointOptimum


def places(count: int = POINTS, seed: int = SEED) -> np.ndarray:
    """Points (n, 4) spread over mass, speed, altitude; every third climbs or descends."""
    from scipy.stats import qmc

    cube = qmc.LatinHypercube(3, rng=np.random.default_rng(seed), optimization="random-cd").random(count)
    found = np.column_stack([qmc.scale(cube, LOWEST, HIGHEST), np.zeros(count)])
    found[:2, 1] = 0.0  # two hovers
    climbing = (np.arange(count) % 3 == 2) & (found[:, 1] > CLIMBING)
    found[climbing, 3] = np.resize(CLIMBS, int(climbing.sum()))
    return found


def conditions(points: np.ndarray) -> Conditions:
    """Straight flight far from the ground at the points."""
    level = Conditions.level(points[:, 1], 0.0)
    return replace(
        level,
        altitude=points[:, 2],
        climb_angle=points[:, 3],
        equivalent_climb_angle=points[:, 3],
    )


def compared(points: np.ndarray) -> list[Compared]:
    """Both optima at the points, under the manual's limits with the aircraft's margin."""
    machine = helicopter()
    rotor = machine.aircraft.main_rotor
    limits = Limits(machine.aircraft, machine.engine, "manual", machine.aircraft.blade_loading_limit.manoeuvre_margin)
    model = SurrogateAircraft(loaded(None, machine.data_hash), limits)(conditions(points))
    settings = ScheduleSettings(nominal_rotor_speed=rotor.nominal_rotor_speed, nominal_twist=rotor.twist)
    box = settings.box(model.bounds)
    best = batched_minimum(model, points[:, 0], box=box)
    low, high = rotor_speed_band(model, points[:, 0], optima=best, box=box)
    found = []
    for k, (mass, speed, altitude, climb) in enumerate(points.tolist()):
        physics = physics_optimum(mass, speed, altitude=altitude, climb_angle=climb)
        there = flown(machine, limits, physics, float(best.rotor_speed[k]), float(best.twist[k]))
        found.append(
            Compared(
                (mass, speed, altitude, climb),
                float(best.rotor_speed[k]) / rotor.nominal_rotor_speed,
                float(best.twist[k]),
                float(best.fuel_flow[k]),
                (float(low[k]) / rotor.nominal_rotor_speed, float(high[k]) / rotor.nominal_rotor_speed),
                *there,
                physics,
            )
        )
    return found


def flown(
    machine: Helicopter, limits: Limits, at: PointOptimum, rotor_speed: float, twist: float
) -> tuple[float, float, str]:
    """Fuel flow [kg/s] of the physics at another rotor speed and twist, its largest usage and whose it is."""
    point = machine.point({**at.flight, "rotor_speed": rotor_speed, "twist": twist}, limits=limits)
    name = max(point.usages, key=lambda name: point.usages[name])
    return point.fuel_flow, point.usages[name], name


def rows(found: list[Compared]) -> Iterator[tuple[str, ...]]:
    """Of the table."""
    nominal = helicopter().aircraft.main_rotor.nominal_rotor_speed
    for one in found:
        mass, speed, altitude, climb = one.place
        own = one.physics
        yield (
            f"{mass:.0f}",
            f"{speed:.0f}",
            f"{altitude:.0f}",
            f"{np.degrees(climb):+.0f}" if climb else "0",
            f"{PERCENT * one.rotor_speed:.2f}",
            f"{PERCENT * own.rotor_speed / nominal:.2f}",
            f"{PERCENT * one.band[0]:.1f} to {PERCENT * one.band[1]:.1f}",
            f"{np.degrees(one.twist):.2f}",
            f"{np.degrees(own.twist):.2f}",
            f"{HOUR * one.fuel_flow:.2f}",
            f"{HOUR * own.fuel_flow:.2f}",
            f"{PERCENT * (one.fuel_flow / own.fuel_flow - 1):+.3f}",
            f"{PERCENT * (one.there / own.fuel_flow - 1):+.3f}",
            f"{PERCENT * (one.usage - 1):+.2f}",
            ", ".join(own.multipliers) or "none",
            f"{own.cpu_s:.2f}",
        )


HEADER = (
    *("mass kg", "speed m/s", "altitude m", "climb deg"),
    *("rotor speed %, surrogate", "physics", "band of 0.5 %", "twist deg, surrogate", "physics"),
    *("fuel kg/h, surrogate", "physics", "difference %", "physics at the surrogate's optimum %"),
    *("largest usage there, % over", "active in the physics", "CPU s"),
)


def page(found: list[Compared]) -> Iterator[str]:
    """The page."""
    fuel = PERCENT * np.array([one.fuel_flow / one.physics.fuel_flow - 1 for one in found])
    there = PERCENT * np.array([one.there / one.physics.fuel_flow - 1 for one in found])
    nominal = helicopter().aircraft.main_rotor.nominal_rotor_speed
    speed = PERCENT * np.array([one.rotor_speed - one.physics.rotor_speed / nominal for one in found])
    twist = np.degrees([one.twist - one.physics.twist for one in found])
    seconds = np.array([one.physics.cpu_s for one in found])
    again = max(abs(one.physics.solved_again) for one in found)
    residual = max(one.physics.residual_norm for one in found)
    unsolved = [one for one in found if not one.physics.success]
    yield "# Optimum of the surrogate, optimum of the physics"
    yield ""
    yield (
        "Rotor speed and twist of least fuel at points spread over mass, speed and altitude, some climbing or "
        "descending, with the manual's limits and a manoeuvre margin of 1.3. The surrogate's optimum is that of the "
        "batched search; the physics' is found by IPOPT with the equations of trim and gas path as constraints "
        "(`vrsopt.point_optimum`), with no surrogate in it. Written by `python problems/point_optimum.py`."
    )
    yield ""
    yield (
        f"- {len(found) - len(unsolved)} of {len(found)} points solved; {seconds.mean():.2f} CPU s each, at most "
        f"{seconds.max():.2f}."
    )
    yield (
        f"- Largest residual {residual:.0e}; the points solved again from a fresh start have the same fuel flow to "
        f"{again:.0e}."
    )
    yield (
        f"- Fuel flow of the surrogate at its optimum against that of the physics at its own: mean "
        f"{fuel.mean():+.3f} %, between {fuel.min():+.3f} and {fuel.max():+.3f} %."
    )
    yield (
        f"- The physics flown at the surrogate's rotor speed and twist burns {there.mean():+.3f} % on average, between "
        f"{there.min():+.3f} and {there.max():+.3f} %."
    )
    yield (
        f"- Rotor speeds differ by {np.abs(speed).mean():.2f} % of nominal on average, at most "
        f"{np.abs(speed).max():.2f} %; twists by {np.abs(twist).mean():.2f} deg, at most "
        f"{np.abs(twist).max():.2f} deg, where the fuel is flat in them. The band of rotor speeds within 0.5 % of the "
        "least fuel, with the twist held, begins at the optimum wherever that lies on the blade loading."
    )
    yield ""
    yield from table(HEADER, rows(found))


if __name__ == "__main__":
    PAGE.write_text("\n".join(page(compared(places()))), encoding="utf-8")
