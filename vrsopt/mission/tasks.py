"""What all tasks of a mission have in common.

Each ``[[tasks]]`` table of a mission file has a ``kind``, and where there are several of that kind a ``pattern``; they
decide which other keys it takes, in engineering units with the unit in the name. A task is one class: its fields, their
checks, and how a :class:`vrsopt.mission.pilot.Pilot` flies it; :mod:`vrsopt.mission.task_types` lists them.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import BeforeValidator

from vrsopt.mission.field import Table, within

if TYPE_CHECKING:
    from vrsopt.mission.pilot import Pilot

Speed = Annotated[float, BeforeValidator(within(1.0, 70.0))]
Duration = Annotated[float, BeforeValidator(within(1.0, 20_000.0))]
MassChange = Annotated[float, BeforeValidator(within(-1000.0, 1000.0))]


class Entry(Table):
    """Base of what the table of a task may state."""

    at_rest: ClassVar[bool] = False  # stands over a place while it lasts
    level_speed: ClassVar[bool] = False  # has a ``speed_m_s`` flown level
    place_field: ClassVar[str | None] = None  # the field that names a place

    kind: str


class Task(Entry):
    """Base of the tasks that are flown."""

    @abstractmethod
    def fly(self, pilot: Pilot) -> None:
        """Add the segments of the task; raises :class:`vrsopt.errors.InputError` if it can not follow the last one."""


class MassEvent(Entry):
    """What is picked up (+) or dropped (-) at once where the next task begins, in flight or at rest."""

    kind: Literal["mass_change"]
    mass_change_kg: MassChange
