"""Speeds and altitudes that a mission leaves free: level tasks may state ranges in place of one number.

A cruise or a loiter keeps its distance or its duration whatever it is flown at. An altitude is that of a whole stretch
of level tasks, from the climb or descent that ends there to the next.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import model_validator

from vrsopt.mission.field import Altitude, complaint
from vrsopt.mission.tasks import Entry, Speed, Task

Range = tuple[float, float]


class FreeTask(Task):
    """Base of the tasks that may be flown at a free speed, or at a free altitude.

    ``speed_m_s`` and the altitude of the climb or descent before it remain those of the mission as stated; the ranges
    [lower, upper] hold them.
    """

    speed_m_s: Speed
    speed_range_m_s: tuple[Speed, Speed] | None = None
    altitude_range_m: tuple[Altitude, Altitude] | None = None

    @model_validator(mode="after")
    def _ranges_in_order(self) -> FreeTask:
        for field in ("speed_range_m_s", "altitude_range_m"):
            stated = getattr(self, field)
            if stated is not None and not stated[0] < stated[1]:
                raise complaint(field, list(stated), "allowed: [lower, upper]")
        speeds = self.speed_range_m_s
        if speeds is not None and not speeds[0] <= self.speed_m_s <= speeds[1]:
            raise complaint("speed_range_m_s", list(speeds), f"allowed: around speed_m_s, {self.speed_m_s:g}")
        return self


@dataclass(frozen=True)
class FreeValue:
    """One number of a mission that is free: ``field`` of the task with index ``task``, from ``lower`` to ``upper``.

    ``stated``: its value in the mission file.
    """

    task: int
    field: str
    stated: float
    lower: float
    upper: float

    def __str__(self) -> str:
        return f"tasks[{self.task}].{self.field}"


def free_values(tasks: Sequence[Entry]) -> tuple[FreeValue, ...]:
    """Speeds and altitudes that ``tasks`` leave free, in the order of the tasks.

    Raises pydantic's complaint for a range of altitudes that can not be: without a climb or descent to the altitude,
    not around it, or while another task flies level at it without such a range.
    """
    found = [value for stretch in _stretches(tasks) for value in _altitude(tasks, *stretch)]
    for index, task in enumerate(tasks):
        speeds = task.speed_range_m_s if isinstance(task, FreeTask) else None
        if isinstance(task, FreeTask) and speeds is not None:
            found.append(FreeValue(index, "speed_m_s", task.speed_m_s, *speeds))
    return tuple(sorted(found, key=lambda value: value.task))


def with_values(tasks: Sequence[Entry], values: dict[FreeValue, float]) -> tuple[Entry, ...]:
    """The same tasks flown at ``values``, with nothing left free."""
    changed: dict[int, dict[str, Any]] = {k: {} for k in range(len(tasks))}
    for k, task in enumerate(tasks):
        if isinstance(task, FreeTask):
            changed[k] = {"speed_range_m_s": None, "altitude_range_m": None}
    for value, number in values.items():
        changed[value.task][value.field] = number
    return tuple(task.model_copy(update=changed[k]) for k, task in enumerate(tasks))


def _stretches(tasks: Sequence[Entry]) -> Iterator[tuple[int | None, list[int]]]:
    """Level tasks of one altitude, by index, each with the climb or descent to it: None where there is none."""
    before, level = None, list[int]()
    for index, task in enumerate(tasks):
        if task.level_speed:
            level.append(index)
        elif task.at_rest or "altitude_m" in type(task).model_fields:
            yield before, level
            before, level = (index if getattr(task, "altitude_m", None) is not None else None), []
    yield before, level


def _altitude(tasks: Sequence[Entry], before: int | None, level: list[int]) -> Iterator[FreeValue]:
    """The altitude of a stretch, if its tasks leave that free: where all their ranges meet."""
    ranges = {k: getattr(tasks[k], "altitude_range_m", None) for k in level}
    stated = {k: limits for k, limits in ranges.items() if limits is not None}
    if not stated:
        return
    first = next(iter(stated))
    field, shown = f"tasks[{first}].altitude_range_m", list(stated[first])
    if before is None:
        raise complaint(field, shown, "allowed: after a climb or descent that states altitude_m")
    altitude = getattr(tasks[before], "altitude_m")  # noqa: B009
    for k in level:
        if k not in stated:
            allowed = f"allowed where all level tasks of that altitude state one; tasks[{k}] ({tasks[k].kind}) does not"
            raise complaint(field, shown, allowed)
        low, high = stated[k]
        if not low <= altitude <= high:
            allowed = f"allowed: around altitude_m of tasks[{before}], {altitude:g}"
            raise complaint(f"tasks[{k}].altitude_range_m", [low, high], allowed)
    lower, upper = max(low for low, _ in stated.values()), min(high for _, high in stated.values())
    yield FreeValue(before, "altitude_m", altitude, lower, upper)
