"""Fuel against NOx of the three missions; writes problems/tradeoff.md and its figure.

Run: python problems/tradeoff.py (about ten minutes on one core)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from page_table import table

from vrsopt.mission.file import read_mission
from vrsopt.report.plots import png
from vrsopt.report.style import GREY, NORMAL, SKY, SMALL, VERMILION, new_figure, tidy
from vrsopt.schedule.mission_setup import MissionSetup
from vrsopt.schedule.tradeoff import FrontPoint, StepFronts, step_front, step_fronts, trajectory_front

HERE = Path(__file__).parent
PAGE, PICTURE = HERE / "tradeoff.md", HERE / "figures" / "tradeoff.png"
NAMES = ("patm", "lem", "sarm")
GENERATIONS = 20
PERCENTILES = (50, 90, 99)
CONSTANTS = (80.0, 85.0, 90.0, 95.0, 100.0, 105.0, 110.0)  # % of nominal rotor speed
CANDIDATES = 3000
INTRODUCTION = """# Fuel against NOx

This page is written by `python problems/tradeoff.py`.

Which schedules are such that less NOx costs more fuel? Two ways to a front of each shipped mission: NSGA-II with two
objectives at every decision step, the steps combined at equal price of NOx (kg of fuel per kg of NOx); and the
trajectory with the NOx of the mission bounded (epsilon-constraint), between the schedules of least fuel and least NOx.
All are flown on the 1 s grid. The pointwise ones ignore the rates of the actuators, the trajectories keep them.
"""


@dataclass(frozen=True)
class Fronts:
    """Both fronts of a mission, and its nominal schedule: fuel and NOx [kg]."""

    name: str
    nominal: tuple[float, float]
    steps: StepFronts
    pointwise: list[FrontPoint]
    trajectory: list[FrontPoint]

    @property
    def reductions(self) -> np.ndarray:
        """By how much (m,) per cent NOx of a step can fall from where the step burns least fuel."""
        return np.array([100.0 * (1.0 - f[:, 3].min() / f[np.argmin(f[:, 2]), 3]) for f in self.steps.points])

    @property
    def costs(self) -> np.ndarray:
        """By how much (m,) per cent fuel flow of a step then rises."""
        return np.array([100.0 * (f[np.argmin(f[:, 3]), 2] / f[:, 2].min() - 1.0) for f in self.steps.points])


def fronts(name: str, workers: int = 1) -> Fronts:
    """Both fronts of a shipped mission."""
    setup = MissionSetup(read_mission(HERE / f"{name}.toml"))
    own: dict[str, Any] = {"takeoff_mass": setup.loading.takeoff_mass, "settings": setup.settings}
    flight = setup.grid.fly(setup.nominal, takeoff_mass=own["takeoff_mass"])
    trajectories = trajectory_front(setup.grid, setup.make, **own)
    steps = step_fronts(setup.grid, setup.make, generations=GENERATIONS, workers=workers, **own)
    nominal = flight.fuel, setup.grid.emissions(flight).total("nox")
    return Fronts(setup.mission.name, nominal, steps, step_front(steps, setup.grid, **own), trajectories)


def relative(points: list[FrontPoint]) -> np.ndarray:
    """Fuel and NOx (n, 2) over those of the first point, the one of least fuel, in per cent."""
    values = np.array([(point.fuel, point.nox) for point in points])
    return 100.0 * (values / values[0] - 1.0)


def front_table(results: list[Fronts]) -> Iterator[str]:
    """Ends of both fronts, and how long they are."""
    rows = []
    for result in results:
        for way, points in (("pointwise", result.pointwise), ("trajectory", result.trajectory)):
            first, last = points[0], points[-1]
            fuel, nox = relative(points)[-1]
            rows.append(
                (
                    result.name,
                    way,
                    f"{first.fuel:.3f}",
                    f"{1e3 * first.nox:.2f}",
                    f"{100 * (first.fuel / result.nominal[0] - 1):+.2f}",
                    f"{100 * (first.nox / result.nominal[1] - 1):+.2f}",
                    f"{last.fuel:.3f}",
                    f"{1e3 * last.nox:.2f}",
                    f"{fuel:+.4f}",
                    f"{nox:+.4f}",
                )
            )
    header = ("mission", "front", "least fuel: kg", "NOx g", "fuel %", "NOx %")
    yield from table((*header, "least NOx: kg", "NOx g", "fuel over least %", "NOx over that %"), rows)


def step_table(results: list[Fronts]) -> Iterator[str]:
    """How long the fronts of the steps by themselves are."""
    rows = [
        (
            result.name,
            len(result.reductions),
            *(f"{np.percentile(result.reductions, percentile):.3f}" for percentile in PERCENTILES),
            f"{result.reductions.max():.2f}",
            f"{result.costs[np.argmax(result.reductions)]:.3f}",
            f"{100 * np.mean(result.reductions > 1.0):.1f}",
        )
        for result in results
    ]
    shares = (f"NOx to be had %: {p}th percentile" if p != 50 else "NOx to be had %: median" for p in PERCENTILES)
    yield from table(("mission", "steps", *shares, "most", "fuel it costs there %", "steps with 1 % or more, %"), rows)


@dataclass(frozen=True)
class Around:
    """What is not on the front: constant rotor speeds (k, 4) in % with fuel, NOx [kg] and whether the limits hold, and
    candidates (n, 3) of one step: rotor speed [%], fuel flow and NOx [kg/s]."""

    constants: np.ndarray
    candidates: np.ndarray
    time: float  # s, of that step
    step: int  # among the searches


def around(name: str, result: Fronts) -> Around:
    """Schedules and candidates beside the front of a shipped mission; the step is the one in the middle of it."""
    setup = MissionSetup(read_mission(HERE / f"{name}.toml"))
    mass, nominal, rows = setup.loading.takeoff_mass, setup.settings.nominal_rotor_speed, []
    for percent in CONSTANTS:
        speed = np.full_like(setup.nominal.rotor_speed, percent / 100 * nominal)
        flight = setup.grid.fly(replace(setup.nominal, rotor_speed=speed), takeoff_mass=mass)
        rows.append((percent, flight.fuel, setup.grid.emissions(flight).total("nox"), flight.success))
    nodes = result.steps.nodes
    step = int(np.argmin(np.abs(nodes.time[nodes.first] - 0.5 * setup.profile.duration)))
    model = setup.make(nodes.conditions()).nodes(np.array([step]))
    box = setup.settings.box(model.bounds)
    points = np.random.default_rng(1).uniform(box[0], box[1], (CANDIDATES, 2))
    there = nodes.interpolated(setup.grid, setup.grid.burned(setup.nominal, takeoff_mass=mass)[0])[step]
    values = model.evaluate(np.array([[there]]), points[None, :, 0], points[None, :, 1])
    nox = model.emissions(values.fuel_flow, values.power_per_engine, points[None, :, 0])["nox"]
    allowed = np.max(values.limits, axis=0)[0] <= 0.0
    found = np.column_stack([100 * points[:, 0] / nominal, values.fuel_flow[0], nox[0]])[allowed]
    return Around(np.array(rows), found, float(nodes.time[nodes.first[step]]), step)


def draw(results: list[Fronts], beside: list[Around]) -> bytes:
    """Missions and one step of each: constant rotor speeds or all candidates, and the front in their corner."""
    figure = new_figure(10.0, 6.4)
    upper, lower = figure.subplots(2, len(results), squeeze=False)
    for axes, result, other in zip(upper, results, beside, strict=True):
        percent, fuel, nox, flyable = other.constants.T
        axes.plot(fuel, 1e3 * nox, "-", color=GREY, lw=0.8)
        for kind, face, label in ((1.0, GREY, "constant rotor speed, %"), (0.0, "white", "outside a limit")):
            here = flyable == kind
            axes.plot(fuel[here], 1e3 * nox[here], "o", color=GREY, markerfacecolor=face, ms=4, label=label)
        for x, y, text in zip(fuel, 1e3 * nox, percent, strict=True):
            axes.annotate(f"{text:.0f}", (x, y), xytext=(4, -8), textcoords="offset points", fontsize=7)
        for points, colour, mark, label in (
            (result.pointwise, SKY, "D", "pointwise"),
            (result.trajectory, VERMILION, "o", "trajectory"),
        ):
            x, y = np.array([(point.fuel, 1e3 * point.nox) for point in points]).T
            axes.plot(x, y, mark, color=colour, ms=5, label=f"front, {label}")
        axes.set(title=result.name, xlabel="fuel of the mission, kg")
        tidy(axes)
    for axes, result, other in zip(lower, results, beside, strict=True):
        percent, fuel, nox = other.candidates.T
        drawn = axes.scatter(3600 * fuel, 3.6e6 * nox, c=percent, s=3, cmap="cividis")
        front = result.steps.points[other.step]
        axes.plot(3600 * front[:, 2], 3.6e6 * front[:, 3], "o", color=VERMILION, ms=5, label="front")
        axes.set(title=f"the step at {other.time / 60:.0f} min", xlabel="fuel flow, kg/h")
        tidy(axes)
        bar = figure.colorbar(drawn, ax=axes)
        bar.set_label("rotor speed, % of nominal", fontsize=SMALL)
        bar.ax.tick_params(labelsize=SMALL)
    upper[0].set_ylabel("NOx of the mission, g")
    lower[0].set_ylabel("NOx, g/h")
    for axes in (*upper, *lower):
        for words in (axes.title, axes.xaxis.label, axes.yaxis.label):
            words.set_size(NORMAL)
    lower[0].legend(fontsize=SMALL, frameon=False, loc="lower right")
    handles = upper[0].get_legend_handles_labels()[0]
    figure.legend(
        handles=handles, loc="outside upper center", ncols=4, fontsize=SMALL, frameon=False, title="upper row"
    )
    return png(figure)


def verdict(results: list[Fronts]) -> Iterator[str]:
    """What a per cent of NOx costs, in words and numbers."""
    span = [abs(relative(result.trajectory)[-1, 1]) for result in results]
    saved = [100.0 * (1.0 - r.trajectory[0].nox / r.nominal[1]) for r in results]
    yield (
        f"In this model NOx falls with fuel: from the nominal schedule to that of least fuel it falls by "
        f"{min(saved):.1f} to {max(saved):.1f} %, and from there to least NOx by {min(span):.4f} to {max(span):.4f} % "
        "more. At one flight condition NOx is very nearly a function of the fuel flow alone, whatever rotor speed and "
        "twist: the lower row of the figure. Least fuel is least NOx, and the front of every step is a point."
    )
    yield ""
    for result in results:
        fuel, nox = relative(result.trajectory).T
        if nox.min() > -1.0:
            yield (
                f"- {result.name}: NOx -1 % below that of least fuel can not be had by rotor speed and twist; all "
                f"there is, {nox.min():+.4f} %, changes the fuel by {fuel[np.argmin(nox)]:+.4f} %."
            )
        else:
            yield f"- {result.name}: NOx -1 % costs {np.interp(1.0, -nox, fuel):+.3f} % fuel."
    yield ""


def page(results: list[Fronts]) -> str:
    """The page."""
    lines = [INTRODUCTION, *verdict(results), "![Fronts of fuel and NOx](figures/tradeoff.png)", ""]
    lines += ["## Missions", "", *front_table(results), "## Steps by themselves", "", *step_table(results)]
    lines.append(
        "Upper row of the figure: constant rotor speeds with the nominal twist, and both fronts, which are a point at "
        "this scale. Lower row: all that one decision step may do within the limits, and its front."
    )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the page and its figure."""
    results = [fronts(name) for name in NAMES]
    PICTURE.write_bytes(draw(results, [around(name, result) for name, result in zip(NAMES, results, strict=True)]))
    PAGE.write_text(page(results), encoding="utf-8")


if __name__ == "__main__":
    main()
