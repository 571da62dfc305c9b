"""The flight path as a map: tasks in their colours, places, scale, north and wind, and patterns larger beside it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.mission.flight_path import flight_path
from vrsopt.mission.route import WGS84, Point
from vrsopt.report.map_names import name_places
from vrsopt.report.style import (
    BLUE,
    KIND_COLOURS,
    NORMAL,
    SMALL,
    TaskSpan,
    kind_handles,
    kinds_of,
    new_figure,
    task_spans,
    tidy,
)
from vrsopt.report.tables import title

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

    from vrsopt.mission.profile import Profile
    from vrsopt.schedule.comparison import Comparison

PATH_STEP = 1.0  # s
REST_SIZES = {"hover": 11, "vertical_climb": 9, "idle": 7, "ground_idle": 4}  # so that all are seen at one place
PATTERNS = ("search", "loiter")
SMALL_PATTERN = 0.5  # of the size of the whole map: a pattern smaller than that has a map of its own
LETTERS = "abc"  # of the maps of patterns: at most so many
ROOM = 0.12  # around what is drawn, of its size
SHORTEST_ARROW = 0.12  # of the size of the map: a task shorter than that has no arrow
BAR_SHARE = 0.3  # largest length of the scale bar, of the width of the map


@dataclass(frozen=True)
class Ground:
    """What is drawn: the tasks with their way in km east and north of the start, and the places."""

    tasks: list[tuple[TaskSpan, np.ndarray]]
    places: dict[str, tuple[float, float]]

    @property
    def extent(self) -> np.ndarray:
        """Everything that has to be on the map (N, 2)."""
        return np.concatenate([*(way for _, way in self.tasks), np.reshape(list(self.places.values()), (-1, 2))])


def flight_path_figure(comparison: Comparison) -> Figure:
    """The way over the ground in kilometres east and north of the start; small patterns again, larger."""
    profile = comparison.profile
    ground = _ground(comparison)
    patterns = _patterns(ground)
    figure = new_figure(8.5, 10.5 if patterns else 7.0)
    grid = figure.add_gridspec(
        2 if patterns else 1, max(1, len(patterns)), height_ratios=[2.0, 1.1][: 1 + bool(patterns)]
    )
    whole = figure.add_subplot(grid[0, :])
    _draw(whole, ground, ground.extent, without_arrows=[span for span, _ in patterns])
    whole.set_title(f"{title(comparison)}: flight path", loc="left", fontsize=NORMAL + 2)
    whole.legend(
        handles=kind_handles(kinds_of(profile)),
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        fontsize=SMALL,
        frameon=False,
    )
    _compass(whole, profile)
    maps, frames = [(whole, ground.extent)], {}
    for number, (letter, (span, way)) in enumerate(zip(LETTERS, patterns, strict=False)):
        axes = figure.add_subplot(grid[1, number])
        _draw(axes, ground, way)
        axes.set_title(f"{letter}: {span.task}", loc="left", fontsize=NORMAL)
        maps.append((axes, way))
        frames[letter] = _frame(whole, way)
    figure.draw_without_rendering()
    for axes, shown in maps:
        _to_scale(axes, shown)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # the scale bar and the names fit this layout
    for axes, _ in maps:
        bar = _scale_bar(axes)
        name_places(axes, ground.places | (frames if axes is whole else {}), taken=[bar])
    return figure


def _ground(comparison: Comparison) -> Ground:
    path = flight_path(comparison.profile, PATH_STEP)
    segment = path["segment"].to_numpy()
    points = [Point(*point) for point in zip(path["latitude_deg"].values, path["longitude_deg"].values, strict=True)]
    way = np.array([_local(points[0], point) for point in points])
    tasks = [
        (span, way[(segment >= span.segments.start) & (segment < span.segments.stop)])
        for span in task_spans(comparison.profile)
    ]
    return Ground(tasks, {name: _local(points[0], place.point) for name, place in comparison.mission.places.items()})


def _local(origin: Point, point: Point) -> tuple[float, float]:
    """East and north of ``origin`` [km], azimuthal equidistant."""
    line = WGS84.Inverse(*origin, *point)
    azimuth, distance = math.radians(line["azi1"]), line["s12"] / 1e3
    return distance * math.sin(azimuth), distance * math.cos(azimuth)


def _patterns(ground: Ground) -> list[tuple[TaskSpan, np.ndarray]]:
    """The tasks that need a map of their own, one of those at the same place, the longest first come."""
    size = np.ptp(ground.extent, axis=0).max()
    found: list[tuple[TaskSpan, np.ndarray]] = []
    for span, way in ground.tasks:
        if span.kind in PATTERNS and 0.0 < np.ptp(way, axis=0).max() < SMALL_PATTERN * size:
            middle = 0.5 * (way.max(axis=0) + way.min(axis=0))
            known = any(np.all((middle > other.min(axis=0)) & (middle < other.max(axis=0))) for _, other in found)
            if not known:
                found.append((span, way))
    return found[: len(LETTERS)]


def _draw(axes: Axes, ground: Ground, shown: np.ndarray, *, without_arrows: Sequence[TaskSpan] = ()) -> None:
    """The ground, on a map of the points ``shown`` (N, 2)."""
    size = _size(shown)
    for span, way in ground.tasks:
        colour = KIND_COLOURS[span.kind]
        if np.ptp(way, axis=0).any():
            axes.plot(*way.T, color=colour, linewidth=1.8, solid_capstyle="round")
            if span not in without_arrows:
                _arrow(axes, way, colour, SHORTEST_ARROW * size)
        else:
            mark = REST_SIZES.get(span.kind, REST_SIZES["hover"])
            axes.plot(*way[0], "s", color=colour, markersize=mark, zorder=4 - mark / 20)
    for place in ground.places.values():
        axes.plot(*place, "o", color="black", markersize=4, zorder=4)
    axes.set_xlabel("east, km", fontsize=NORMAL)
    axes.set_ylabel("north, km", fontsize=NORMAL)
    tidy(axes)


def _size(shown: np.ndarray) -> float:
    """Size of a map [km]; a mission that stays where it is has one too."""
    return max(float(np.ptp(shown, axis=0).max()), 0.1)


def _to_scale(axes: Axes, shown: np.ndarray) -> None:
    """Limits of a map of the points ``shown`` (N, 2) that fill the axes as they are laid out, to scale."""
    width, height = axes.bbox.size
    middle = 0.5 * (shown.max(axis=0) + shown.min(axis=0))
    room = np.ptp(shown, axis=0) + 2.0 * ROOM * _size(shown)
    half = 0.5 * max(room[0] / width, room[1] / height)
    axes.set_xlim(middle[0] - half * width, middle[0] + half * width)
    axes.set_ylim(middle[1] - half * height, middle[1] + half * height)
    axes.set_aspect("equal", adjustable="box")


def _arrow(axes: Axes, way: np.ndarray, colour: str, shortest: float) -> None:
    """An arrow head in the middle of a way that is long enough, in the direction of flight."""
    steps = np.hypot(*np.diff(way, axis=0).T)
    done = np.cumsum(steps)
    if done[-1] < shortest:
        return
    at = int(np.searchsorted(done, 0.5 * done[-1]))
    axes.annotate(
        "",
        xy=tuple(way[at + 1]),
        xytext=tuple(way[at]),
        arrowprops={"arrowstyle": "-|>", "color": colour, "mutation_scale": 14, "shrinkA": 0, "shrinkB": 0},
        annotation_clip=True,
    )


def _frame(axes: Axes, way: np.ndarray) -> tuple[float, float]:
    """The frame of a pattern on the large map; returns its upper left corner."""
    room = 0.5 * ROOM * _size(way)
    (left, bottom), (right, top) = way.min(axis=0) - room, way.max(axis=0) + room
    around = [(left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)]
    axes.plot(*zip(*around, strict=True), color="black", linewidth=0.8, linestyle="--", zorder=3)
    return float(left), float(top)


def _compass(axes: Axes, profile: Profile) -> None:
    """North, and the wind at the altitude where most of the time is spent, beside the map."""
    compass = axes.inset_axes((1.03, 0.0, 0.16, 0.22))
    compass.set(xlim=(-1.2, 1.2), ylim=(-2.2, 1.5), aspect="equal")
    compass.axis("off")
    arrow = {"arrowstyle": "-|>", "color": "black", "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0}
    compass.annotate("", xy=(0.0, 1.0), xytext=(0.0, -1.0), arrowprops=arrow)
    compass.text(0.0, 1.1, "N", ha="center", va="bottom", fontsize=NORMAL)
    if profile.wind.calm:
        return
    nodes = profile.grid(PATH_STEP)
    altitude = float(np.median(nodes.altitude))
    east, north = (float(part) for part in profile.wind.at(altitude))
    speed = math.hypot(east, north)
    direction = np.array([east, north]) / max(speed, 1e-9)
    compass.annotate("", xy=tuple(direction), xytext=tuple(-direction), arrowprops=arrow | {"color": BLUE})
    where = "" if len(profile.wind.altitude) == 1 else f"\nat {altitude:.0f} m"
    words = f"wind {speed:.1f} m/s\nfrom {math.degrees(math.atan2(-east, -north)) % 360.0:.0f}°{where}"
    compass.text(0.0, -1.2, words, ha="center", va="top", fontsize=SMALL, color=BLUE)


def _scale_bar(axes: Axes) -> Text:
    """A bar of a round length in the lower corner where less of the way is; call it when the layout is final."""
    low, high = axes.get_xlim()
    bottom, top = axes.get_ylim()
    width, height = high - low, top - bottom
    length = _round_length(BAR_SHARE * width)
    way = np.concatenate([line.get_xydata() for line in axes.lines])
    starts = (low + 0.03 * width, high - 0.03 * width - length)
    margin = np.array([0.05 * width, 0.12 * height])
    crowd = [
        np.sum(
            np.all((way > [start - margin[0], bottom]) & (way < [start + length + margin[0], bottom + margin[1]]), 1)
        )
        for start in starts
    ]
    start, y = starts[int(np.argmin(crowd))], bottom + 0.03 * height
    axes.plot([start, start + length], [y, y], color="black", linewidth=2.5, solid_capstyle="butt", zorder=6)
    words = f"{length:g} km" if length >= 1.0 else f"{1e3 * length:g} m"
    return axes.annotate(
        words,
        (start + 0.5 * length, y),
        xytext=(0, 3),
        textcoords="offset points",
        ha="center",
        va="bottom",
        fontsize=SMALL,
        zorder=6,
    )


def _round_length(most: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above ``most``."""
    decade = 10.0 ** math.floor(math.log10(most))
    return max(step * decade for step in (1.0, 2.0, 5.0) if step * decade <= most * (1.0 + 1e-9))
