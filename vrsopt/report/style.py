"""What the figures share: colours that the colour-blind can tell apart, fonts, tasks and their names along an axis."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from vrsopt.mission.segment import same_task

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vrsopt.mission.profile import Profile

# Okabe and Ito's palette
BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, VERMILION, PURPLE, GREY = (
    "#000000",
    "#E69F00",
    "#56B4E9",
    "#009E73",
    "#F0E442",
    "#0072B2",
    "#D55E00",
    "#CC79A7",
    "#999999",
)
DARK = "#555555"
KIND_COLOURS: Mapping[str, str] = {
    "idle": GREY,
    "ground_idle": DARK,
    "hover": YELLOW,
    "vertical_climb": VERMILION,
    "climb": ORANGE,
    "cruise": SKY,
    "descent": PURPLE,
    "loiter": GREEN,
    "search": BLUE,
}
DARK_KINDS = ("ground_idle", "search")  # whose names are white
# colour, line style, line width: later ones are drawn over earlier ones
SCHEDULE_STYLES: Mapping[str, tuple[str, str, float]] = {
    "nominal": (BLACK, "-", 1.1),
    "nominal_variable_transmission": (GREY, "--", 1.1),
    "constant": (YELLOW, "-", 1.8),
    "pointwise": (SKY, "-", 3.4),
    "pointwise_rate_limited": (GREEN, "-", 1.4),
    "prescribed": (PURPLE, "-", 1.4),
    "prescribed_rate_limited": (BLUE, "-", 1.1),
    "trajectory": (VERMILION, "-", 1.4),
    "consistent": (BLACK, ":", 1.3),
    "trajectory_variable_transmission": (BLUE, "--", 1.1),
}
# colour and line width by limit; the torque is wide because at nominal rotor speed it equals the engine power
LIMIT_STYLES = ((VERMILION, 1.1), (BLUE, 1.1), (SKY, 2.6), (ORANGE, 1.1), (PURPLE, 1.1))
SMALL, NORMAL = 8, 9  # font sizes
MINUTE = 60.0
SAME_TIME = 1e-6  # s
MANY_SEGMENTS, NARROW = 100, 0.75  # a mission with more segments is drawn over time with lines narrower by this factor


@dataclass(frozen=True)
class TaskSpan:
    """A task as one piece of the time line [s]: neighbouring segments, by their index."""

    task: str
    kind: str
    start: float
    end: float
    segments: range


def task_spans(profile: Profile) -> list[TaskSpan]:
    """The tasks in their order: neighbouring segments of one task are one span."""
    spans: list[TaskSpan] = []
    for index, segment in enumerate(profile.segments):
        start, first = segment.start, index
        if index and same_task(profile.segments[index - 1], segment):
            before = spans.pop()
            start, first = before.start, before.segments.start
        spans.append(TaskSpan(segment.task, segment.kind, start, segment.end, range(first, index + 1)))
    return spans


def kind_name(kind: str) -> str:
    """A kind of task for people."""
    return kind.replace("_", " ")


def line_scale(profile: Profile) -> float:
    """Factor of the widths of lines over time: narrow where there are so many turns that they would run together."""
    return NARROW if len(profile.segments) > MANY_SEGMENTS else 1.0


def kinds_of(profile: Profile) -> list[str]:
    """The kinds of task that occur, in the order of the legend."""
    present = {segment.kind for segment in profile.segments}
    return [kind for kind in KIND_COLOURS if kind in present]


def new_figure(width: float, height: float) -> Figure:
    """An empty figure [inches] that draws without a display and shares no state with the user's own plots.

    ``width`` and ``height`` [inches].
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def renderer_of(axes: Axes) -> Any:
    """What measures texts in pixels, of a figure of :func:`new_figure`."""
    canvas: Any = axes.figure.canvas
    return canvas.get_renderer()


def tidy(axes: Axes) -> None:
    """Grid, small ticks, no box."""
    axes.grid(True, color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=SMALL)
    axes.spines[["top", "right"]].set_visible(False)


def draw_tasks(axes: Axes, profile: Profile) -> None:
    """A strip of coloured bands over the time axis [min], one per task."""
    for span in task_spans(profile):
        width = (span.end - span.start) / MINUTE
        axes.broken_barh(
            [(span.start / MINUTE, width)], (0.0, 1.0), facecolor=KIND_COLOURS[span.kind], edgecolor="white", lw=0.4
        )
    axes.set(ylim=(0.0, 1.0), yticks=[])
    axes.spines[["top", "right", "left", "bottom"]].set_visible(False)
    axes.tick_params(bottom=False, labelbottom=False)


def name_tasks(axes: Axes, profile: Profile) -> None:
    """Write the names into the bands of :func:`draw_tasks` that are wide enough; call it when the layout is final."""
    renderer = renderer_of(axes)
    for span in task_spans(profile):
        left, right = (axes.transData.transform((at / MINUTE, 0.0))[0] for at in (span.start, span.end))
        for words in (span.task, two_lines(span.task), kind_name(span.kind)):
            text = axes.text(
                0.5 * (span.start + span.end) / MINUTE,
                0.5,
                words,
                ha="center",
                va="center",
                fontsize=SMALL - 1,
                color="white" if span.kind in DARK_KINDS else "black",
                clip_on=True,
            )
            if text.get_window_extent(renderer).width < 0.96 * (right - left):
                break
            text.remove()


def kind_handles(kinds: Iterable[str]) -> list[Any]:
    """Legend entries for the kinds of task."""
    from matplotlib.patches import Patch

    return [Patch(facecolor=KIND_COLOURS[kind], label=kind_name(kind)) for kind in kinds]


def at_gaps(segment: np.ndarray, time: np.ndarray, values: np.ndarray) -> list[np.ndarray]:
    """``values`` cut where a new segment begins later than the one before it ended.

    ``segment`` and ``time`` [s] (N,) of the nodes.
    """
    return np.split(values, np.flatnonzero((np.diff(segment) != 0) & (np.diff(time) > SAME_TIME)) + 1)


def two_lines(words: str) -> str:
    """The words on two lines, broken at the space nearest to the middle."""
    spaces = [place for place, letter in enumerate(words) if letter == " "]
    if not spaces:
        return words
    best = min(spaces, key=lambda place: abs(place - len(words) / 2))
    return f"{words[:best]}\n{words[best + 1 :]}"
