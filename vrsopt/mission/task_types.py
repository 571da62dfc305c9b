"""The types of task a mission file may name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, Union

from pydantic import Discriminator, Tag

from vrsopt.mission import leg_tasks, pattern_tasks, rest_tasks, tasks

# by kind, and where a kind has several patterns by the pattern too; of these the first is the default
TASK_TYPES: dict[str, type[tasks.Entry]] = {
    "idle": rest_tasks.Idle,
    "ground_idle": rest_tasks.GroundIdle,
    "hover": rest_tasks.Hover,
    "vertical_climb": rest_tasks.VerticalClimb,
    "climb": leg_tasks.Climb,
    "cruise": leg_tasks.Cruise,
    "descent": leg_tasks.Descent,
    "speed_change": leg_tasks.SpeedChange,
    "mass_change": tasks.MassEvent,
    "loiter/race_track": pattern_tasks.RaceTrack,
    "loiter/circle": pattern_tasks.Circle,
    "search/creeping_line": pattern_tasks.CreepingLine,
    "search/expanding_square": pattern_tasks.ExpandingSquare,
    "search/sector": pattern_tasks.SectorSearch,
}
KINDS = tuple(dict.fromkeys(name.partition("/")[0] for name in TASK_TYPES))
PATTERNS = {kind: tuple(n.partition("/")[2] for n in TASK_TYPES if n.startswith(f"{kind}/")) for kind in KINDS}


def _task_type(value: Any) -> str | None:
    """Name in TASK_TYPES of what a table of a task states, or of a task."""
    if not isinstance(value, dict):
        kind, pattern = getattr(value, "kind", None), getattr(value, "pattern", None)
    else:
        kind, pattern = value.get("kind"), value.get("pattern")
    if not isinstance(kind, str):
        return None
    several = PATTERNS.get(kind)
    return f"{kind}/{several[0] if pattern is None else pattern}" if several and several[0] else kind


if TYPE_CHECKING:
    AnyTask: TypeAlias = tasks.Entry
else:
    AnyTask = Annotated[
        Union[tuple(Annotated[kind, Tag(name)] for name, kind in TASK_TYPES.items())],  # noqa: UP007
        Discriminator(_task_type),
    ]
