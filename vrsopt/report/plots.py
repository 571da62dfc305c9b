"""Figures of a comparison: the way over the ground, the schedules over time, what they burn and emit.

Figures are made with Matplotlib's objects alone, so that they need no display and leave the user's own plots alone.
"""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.mission.route import WGS84, Point
from vrsopt.report.emission_plots import emission_figure, phase_figure
from vrsopt.report.series import schedule_figure
from vrsopt.report.style import (
    BLUE,
    KIND_COLOURS,
    MINUTE,
    NORMAL,
    SKY,
    SMALL,
    draw_tasks,
    kind_handles,
    kinds_of,
    name_tasks,
    new_figure,
    renderer_of,
    tidy,
)
from vrsopt.report.tables import label, title, verdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation
    from matplotlib.transforms import Bbox

    from vrsopt.mission.profile import Profile
    from vrsopt.schedule.comparison import Comparison, ScheduleResult

__all__ = [
    "emission_figure",
    "figures",
    "flight_path_figure",
    "fuel_figure",
    "phase_figure",
    "png",
    "schedule_figure",
]

PATH_STEP = 2.0  # s
REST_SIZES = {"hover": 11, "idle": 7}  # of the marks where the aircraft stands, so that both are seen at one place
NEAR = 15  # points: a name farther from its place has a line to it
AROUND = [  # where a name may stand beside its place, in points, nearest first
    (across * far, up * far)
    for far in (9, 20, 35, 50, 70)
    for across, up in ((1, 1), (1, -1), (-1, 1), (-1, -1), (0, 1), (0, -1), (1, 0), (-1, 0))
]


def figures(comparison: Comparison) -> dict[str, Figure]:
    """All figures of ``comparison`` (without its variants) by the name of their file."""
    return {
        "flight_path": flight_path_figure(comparison),
        "schedules": schedule_figure(comparison),
        "fuel": fuel_figure(comparison),
        "emissions": emission_figure(comparison),
        "phases": phase_figure(comparison),
    }


def png(figure: Figure, *, dpi: float = 110) -> bytes:
    """The figure as a PNG; the same figure gives the same bytes."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=dpi, metadata={"Software": None})
    return stream.getvalue()


def flight_path_figure(comparison: Comparison) -> Figure:
    """The way over the ground in kilometres east and north of the start, and the altitude over time."""
    profile, places = comparison.profile, comparison.mission.places
    figure = new_figure(8.5, 9.0)
    ground, strip, height = figure.subplots(3, 1, gridspec_kw={"height_ratios": [5.0, 0.3, 1.2]})
    height.sharex(strip)
    _draw_path(ground, profile)
    origin = _position(profile, 0, 0.0)
    named = {name: _local(origin, place.point) for name, place in places.items()}
    ground.plot(*zip(*named.values(), strict=True), "o", color="black", markersize=4, zorder=4)
    ground.set_aspect("equal", adjustable="datalim")
    ground.margins(0.12)
    ground.set_xlabel("east, km", fontsize=NORMAL)
    ground.set_ylabel("north, km", fontsize=NORMAL)
    ground.set_title(f"{title(comparison)}: flight path", loc="left", fontsize=NORMAL + 2)
    ground.legend(
        handles=kind_handles(kinds_of(profile)),
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        fontsize=SMALL,
        frameon=False,
    )
    draw_tasks(strip, profile)
    nodes = profile.grid(PATH_STEP)
    height.plot(nodes.time / MINUTE, nodes.altitude, color="black", linewidth=1.2)
    height.set_xlabel("time, min", fontsize=NORMAL)
    height.set_ylabel("altitude, m", fontsize=NORMAL)
    height.set_ylim(bottom=0.0)
    height.set_xlim(0.0, profile.duration / MINUTE)
    for axes in (ground, height):
        tidy(axes)
    figure.draw_without_rendering()
    name_tasks(strip, profile)
    _name_places(ground, named)
    return figure


def fuel_figure(comparison: Comparison) -> Figure:
    """Fuel of every schedule, on the surrogate and on the physics."""
    results = comparison.results
    figure = new_figure(max(6.0, 2.0 + 1.7 * len(results)), 4.5)
    axes = figure.subplots()
    place = np.arange(len(results))
    both = (
        ("surrogate", BLUE, [result.flight.fuel for result in results.values()]),
        ("physics", SKY, [result.physics.fuel for result in results.values()]),
    )
    for side, (text, colour, fuel) in zip((-0.2, 0.2), both, strict=True):
        bars = axes.bar(place + side, np.nan_to_num(fuel), width=0.38, color=colour, label=text)
        values = [f"{value:.2f}" if math.isfinite(value) else "none" for value in fuel]
        axes.bar_label(bars, values, fontsize=SMALL, padding=2)
    axes.set_xticks(place, [_bar_name(name, result) for name, result in results.items()])
    axes.set_ylabel("fuel burned, kg", fontsize=NORMAL)
    axes.set_title(f"{title(comparison)}: fuel", loc="left", fontsize=NORMAL + 2)
    tidy(axes)
    axes.grid(False, axis="x")
    axes.margins(y=0.12)
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=SMALL, frameon=False)
    return figure


def _bar_name(name: str, result: ScheduleResult) -> str:
    """Name of a schedule with its changes of fuel, or why it has none."""
    if not result.success:
        return f"{label(name)}\n{verdict(result).partition(':')[0]}"
    lines = [label(name)]
    if name != "nominal":
        lines += [f"{result.fuel_delta_percent:+.2f} %", f"physics {result.fuel_physics_delta_percent:+.2f} %"]
    return "\n".join(lines)


def _draw_path(axes: Axes, profile: Profile) -> None:
    """The way over the ground in the colours of its tasks, segment by segment."""
    nodes = profile.grid(PATH_STEP)
    latitude, longitude = profile.positions(nodes.segment, nodes.time)
    origin = Point(float(latitude[0]), float(longitude[0]))
    way = np.array([_local(origin, Point(*point)) for point in zip(latitude, longitude, strict=True)])
    for index, segment in enumerate(profile.segments):
        here = nodes.segment == index
        if segment.speed > 0.0:
            axes.plot(*way[here].T, color=KIND_COLOURS[segment.kind], linewidth=1.8, solid_capstyle="round")
        else:
            size = REST_SIZES[segment.kind]
            axes.plot(*way[here][0], "s", color=KIND_COLOURS[segment.kind], markersize=size, zorder=4 - size / 20)


def _position(profile: Profile, segment: int, time: float) -> Point:
    latitude, longitude = profile.positions(segment, time)
    return Point(float(latitude), float(longitude))


def _local(origin: Point, point: Point) -> tuple[float, float]:
    """East and north of ``origin`` [km], azimuthal equidistant."""
    line = WGS84.Inverse(*origin, *point)
    azimuth, distance = math.radians(line["azi1"]), line["s12"] / 1e3
    return distance * math.sin(azimuth), distance * math.cos(azimuth)


def _name_places(axes: Axes, places: dict[str, tuple[float, float]]) -> None:
    """Names beside their places, each where it covers least of the path and of other names, and as near as can be."""
    path = np.concatenate([axes.transData.transform(line.get_xydata()) for line in axes.lines])
    taken: list[Bbox] = []
    for name, position in places.items():
        boxes = []
        for offset in AROUND:
            trial = _name(axes, name, position, offset)
            boxes.append(trial.get_window_extent(renderer_of(axes)).padded(2.0))
            trial.remove()
        costs = []
        for number, box in enumerate(boxes):
            outside = not axes.bbox.contains(box.x0, box.y0) or not axes.bbox.contains(box.x1, box.y1)
            costs.append(10 * box.count_contains(path) + 1000 * box.count_overlaps(taken) + 10_000 * outside + number)
        best = int(np.argmin(costs))
        taken.append(boxes[best])
        _name(axes, name, position, AROUND[best], line=max(map(abs, AROUND[best])) > NEAR)


def _name(
    axes: Axes, name: str, position: tuple[float, float], offset: tuple[int, int], *, line: bool = False
) -> Annotation:
    """``name`` at ``offset`` [points] from its place, on request with a thin line to it."""
    return axes.annotate(
        name,
        position,
        xytext=offset,
        textcoords="offset points",
        ha={-1: "right", 0: "center", 1: "left"}[int(np.sign(offset[0]))],
        va={-1: "top", 0: "center", 1: "bottom"}[int(np.sign(offset[1]))],
        fontsize=NORMAL,
        arrowprops={"arrowstyle": "-", "color": "black", "linewidth": 0.7, "shrinkB": 0} if line else None,
        zorder=5,
    )
