"""Names beside points of a map, where they cover least of what is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.report.style import NORMAL, renderer_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Annotation, Text
    from matplotlib.transforms import Bbox

NEAR = 15  # points: a name farther from its place has a line to it
AROUND = [  # where a name may stand beside its place, in points, nearest first
    (across * far, up * far)
    for far in (9, 20, 35, 50, 70)
    for across, up in ((1, 1), (1, -1), (-1, 1), (-1, -1), (0, 1), (0, -1), (1, 0), (-1, 0))
]
CLOSE = 4.0  # pixels between points that count as what a name covers


def name_places(axes: Axes, places: dict[str, tuple[float, float]], *, taken: Sequence[Text]) -> None:
    """Names beside their places, each where it covers least of the lines and of other texts, and as near as can be.

    ``taken``: texts that are there already. Call it when the layout is final. Places outside the axes have no name.
    """
    renderer = renderer_of(axes)
    path = np.concatenate([_dense(axes.transData.transform(line.get_xydata())) for line in axes.lines])
    boxes_taken = [text.get_window_extent(renderer).padded(2.0) for text in taken]
    for name, position in places.items():
        if not axes.viewLim.contains(*position):
            continue
        boxes = []
        for offset in AROUND:
            trial = _name(axes, name, position, offset)
            boxes.append(trial.get_window_extent(renderer).padded(2.0))
            trial.remove()
        costs = []
        for number, box in enumerate(boxes):
            outside = not axes.bbox.contains(box.x0, box.y0) or not axes.bbox.contains(box.x1, box.y1)
            covered = 3 * box.count_contains(path) + 1000 * box.count_overlaps(boxes_taken)
            covered += _crossed(axes.transData.transform(position), box, path, boxes_taken)
            costs.append(covered + 10_000 * outside + 4 * number)
        best = int(np.argmin(costs))
        boxes_taken.append(boxes[best])
        _name(axes, name, position, AROUND[best], line=max(map(abs, AROUND[best])) > NEAR)


def _crossed(point: np.ndarray, box: Bbox, path: np.ndarray, others: Sequence[Bbox]) -> int:
    """Cost of the line from a point to the middle of a box [pixels]: what it crosses of other boxes and of the path."""
    middle = np.array([0.5 * (box.x0 + box.x1), 0.5 * (box.y0 + box.y1)])
    line = point + np.linspace(0.2, 1.0, 40)[:, None] * (middle - point)
    near = np.hypot(*(line[:, None] - path).T).min(axis=0) < CLOSE
    return 100 * sum(other.count_contains(line) > 0 for other in others) + 2 * int(np.sum(near))


def _dense(line: np.ndarray) -> np.ndarray:
    """Points (N, 2) along a line in pixels, close enough that none slips through a name."""
    steps = np.hypot(*np.diff(line, axis=0).T)
    done = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.linspace(0.0, done[-1], 1 + int(np.ceil(done[-1] / CLOSE)))
    return np.column_stack([np.interp(at, done, line[:, 0]), np.interp(at, done, line[:, 1])])


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
        bbox={"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 0.8},
        arrowprops={"arrowstyle": "-", "color": "black", "linewidth": 0.7, "shrinkB": 0} if line else None,
        zorder=5,
    )
