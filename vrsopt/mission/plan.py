"""From the tasks of a mission to its segments.

Each task flies the aircraft on from where the task before left it, see :class:`vrsopt.mission.pilot.Pilot`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vrsopt.mission.pilot import Pilot
from vrsopt.mission.segment import Segment

if TYPE_CHECKING:
    from vrsopt.mission.file import Mission


def segments_of(mission: Mission) -> tuple[Segment, ...]:
    """The segments of a mission, contiguous in time, with continuous positions, heights and speeds.

    Raises :class:`InputError` (``tasks[i].field = value: what is allowed``) for tasks that can not follow each other:
    a leg too short for its changes of height and speed, a hover at a height the aircraft does not have, a task at a
    place where the aircraft is not.
    """
    pilot = Pilot(mission)
    for index, task in enumerate(pilot.tasks):
        pilot.index = index
        task.fly(pilot)
    return tuple(pilot.segments)
