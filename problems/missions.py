"""The three missions with all schedules, on other days and in wind; writes problems/missions.md and its figures.

Run: python problems/missions.py (about twenty minutes on two cores)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from mission_tables import (
    consistency_table,
    contribution_table,
    gap_table,
    number,
    schedule_table,
    step_table,
)
from page_table import table, write_below

import vrsopt
from vrsopt.mission.file import Mission, mission_from, read_mission
from vrsopt.mission.flight_path import ground_distances
from vrsopt.mission.route import WGS84
from vrsopt.report.plots import figures, png
from vrsopt.schedule.comparison import Comparison
from vrsopt.schedule.refly import FlightGrid
from vrsopt.schedule.surrogate_path import SurrogateAircraft
from vrsopt.schedule.task_summary import kind_shares
from vrsopt.surrogate.store import Surrogate

HERE = Path(__file__).parent
PAGE = HERE / "missions.md"
MARKER = "<!-- tables: everything below is written by problems/missions.py -->"
NAMES = ("patm", "lem", "sarm")
PICTURES = ("flight_path", "mission_profile", "schedules")
ALL = ("nominal", "constant", "pointwise", "prescribed", "trajectory", "consistent", "variable_transmission")
SHOWN = ("nominal", "constant", "pointwise", "pointwise_rate_limited", "trajectory")  # in the figures
STEPS = (0.5, 2.0)  # s, beside the 1 s of the comparison
WEATHERS = {
    "ISA +20 K": {"isa_offset_k": 20.0},
    "5 m/s from west": {"wind": {"from_deg": 270.0, "speed_m_s": 5.0}},
}
TURNING = 1.005  # load factor from which a steady turn counts


def in_weather(mission: Mission, weather: dict[str, object]) -> Mission:
    """The same mission on another day."""
    return mission_from(mission.model_dump(mode="json", exclude_none=True) | weather, where=mission.name)


def overview(results: dict[str, Comparison]) -> Iterator[str]:
    """Length, masses, and what the prescribed climb and descent cost."""
    rows = []
    for comparison in results.values():
        summary, profile = comparison.summary(), comparison.profile
        nodes = profile.grid(1.0)
        steady = np.asarray(nodes.turn_load_factor) > TURNING
        begins = np.flatnonzero(np.diff(steady.astype(int)) > 0)
        difference = summary["prescribed_difference_percent"]
        rows.append(
            (
                summary["mission"],
                f"{profile.duration:.0f}",
                f"{np.sum(ground_distances(profile)) / 1e3:.2f}",
                len(profile.segments),
                len(begins),
                f"{summary['takeoff_mass_kg']:.1f}",
                f"{comparison.loading.fuel_loaded:.1f}",
                f"{summary['reserve_kg']:.1f}",
                f"{difference['surrogate']:+.2f} ({number(difference['physics'], '+.2f')})",
            )
        )
    yield from table(
        (
            "mission",
            "s",
            "km",
            "segments",
            "turns",
            "take-off kg",
            "fuel kg",
            "reserve kg",
            "prescribed against modelled %",
        ),
        rows,
    )


def share_table(results: dict[str, Comparison]) -> Iterator[str]:
    """Time, distance and fuel by kind of task."""
    yield from table(
        ("mission", "task", "min", "% of time", "km", "nominal kg", "trajectory kg", "change %"),
        (
            (
                comparison.mission.name,
                share.kind,
                f"{share.duration / 60:.1f}",
                f"{100 * share.share:.1f}",
                f"{share.distance / 1e3:.2f}",
                f"{share.fuel['nominal']:.2f}",
                f"{share.fuel['trajectory']:.2f}",
                f"{100 * (share.fuel['trajectory'] / share.fuel['nominal'] - 1):+.1f}",
            )
            for comparison in results.values()
            for share in kind_shares(comparison.profile, comparison.results)
        ),
    )


def closing_table(results: dict[str, Comparison], surrogate: Surrogate) -> Iterator[str]:
    """How well the books close: mass, place, height, resolution in time."""
    rows = []
    for comparison in results.values():
        profile, loading = comparison.profile, comparison.loading
        last = len(profile.segments) - 1
        latitude, longitude = profile.positions([0, last], [0.0, profile.duration])
        apart = WGS84.Inverse(latitude[0], longitude[0], latitude[1], longitude[1])["s12"]
        height = profile.conditions([0, last], [0.0, profile.duration]).altitude
        left = loading.takeoff_mass - comparison.mission.loading.zero_fuel_mass - loading.fuel_burned
        changes = []
        for step in STEPS:
            make = SurrogateAircraft(surrogate, comparison.limits, isa_offset=profile.isa_offset)
            grid = FlightGrid(profile, make, step=step, settings=comparison.settings)
            for name in ("nominal", "trajectory"):
                own = comparison.results[name]
                fuel = grid.fly(own.schedule, takeoff_mass=loading.takeoff_mass).fuel
                changes.append(f"{100 * (fuel / own.flight.fuel - 1):+.4f}")
        rows.append(
            (
                comparison.mission.name,
                f"{left - loading.reserve_fuel:.1e}",
                f"{apart:.1e}",
                f"{height[1] - height[0]:.1e}",
                *changes,
                f"{comparison.trajectory.iterations}, {comparison.trajectory.solve_s:.1f}",
            )
        )
    resolution = [f"{name}, {step:g} s, %" for step in STEPS for name in ("nominal", "trajectory")]
    yield from table(
        ("mission", "fuel left - reserve kg", "end from start m", "height m", *resolution, "iterations, s"), rows
    )


def weather_table(missions: dict[str, Mission]) -> Iterator[str]:
    """Nominal and trajectory on other days."""
    rows = []
    for mission in missions.values():
        for text, weather in WEATHERS.items():
            try:
                comparison = vrsopt.solve(in_weather(mission, weather), schedules=("nominal", "trajectory"))
            except (vrsopt.InputError, vrsopt.NoSolutionError) as refusal:
                rows.append((mission.name, text, *5 * ("-",), str(refusal)))
                continue
            summary = comparison.summary()
            nominal, best = (summary["schedules"][name] for name in ("nominal", "trajectory"))
            rows.append(
                (
                    mission.name,
                    text,
                    f"{summary['duration_s']:.0f}",
                    f"{nominal['fuel_kg']:.2f}",
                    f"{100 * (nominal['fuel_kg'] / nominal['fuel_physics_kg'] - 1):+.3f}",
                    f"{best['fuel_delta_percent']:+.2f}",
                    number(best["fuel_physics_delta_percent"], "+.2f"),
                    "flyable" if comparison.success else f"{nominal['message']}; {best['message']}",
                )
            )
            print(rows[-1], flush=True)
    yield from table(
        (
            "mission",
            "weather",
            "s",
            "nominal kg",
            "surrogate against physics %",
            "trajectory %",
            "physics %",
            "verdict",
        ),
        rows,
    )


def draw(name: str, comparison: Comparison) -> None:
    """Figures of a mission, with so many of the schedules as can be told apart."""
    shown = replace(comparison, results={one: comparison.results[one] for one in SHOWN})
    drawn = figures(shown)
    for picture in PICTURES:
        (HERE / "figures" / f"{name}_{picture}.png").write_bytes(png(drawn[picture]))


def main() -> None:
    """Solve, draw, write."""
    missions = {name: read_mission(HERE / f"{name}.toml") for name in NAMES}
    results = {}
    for name, mission in missions.items():
        results[name] = vrsopt.solve(mission, schedules=ALL)
        draw(name, results[name])
        print(results[name].summary()["schedules"]["trajectory"]["fuel_delta_percent"], flush=True)
    lines = ["", "## Missions", "", *overview(results), "## Schedules", "", *schedule_table(results)]
    lines += ["## What saves what", "", *contribution_table(results)]
    lines += ["## Surrogate and physics, energy of the rotor, what is active", "", *gap_table(results)]
    lines += ["## Trajectories on the physics", "", *consistency_table(results)]
    lines += ["## Time of the steps", "", *step_table(results)]
    lines += ["## Share of time", "", *share_table(results)]
    lines += ["## How well the books close", "", *closing_table(results, vrsopt.load_surrogate(SHIPPED))]
    lines += ["## Other days", "", *weather_table(missions)]
    write_below(MARKER, PAGE, "\n".join(lines).rstrip() + "\n", title="Missions")


SHIPPED = Path(vrsopt.__file__).parent / "data" / "surrogate.nc"

if __name__ == "__main__":
    main()
