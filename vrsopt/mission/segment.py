"""A segment: a piece of a mission over which the aircraft moves smoothly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from vrsopt.mission.motion import Motion

KINDS = ("idle", "ground_idle", "hover", "vertical_climb", "climb", "cruise", "descent", "loiter", "search")
Kind = Literal["idle", "ground_idle", "hover", "vertical_climb", "climb", "cruise", "descent", "loiter", "search"]
ON_THE_GROUND = ("idle", "ground_idle")


@dataclass(frozen=True)
class Segment:
    """One piece of a mission. The mass change happens at its start."""

    task: str  # label of the task it belongs to
    kind: Kind
    start: float  # s
    duration: float  # s
    mass_change: float  # kg
    motion: Motion
    ground_elevation: float | None = None  # m, of the ground below; None where the ground does not matter
    number: int = 0  # of the task, to tell tasks of one label apart

    @property
    def end(self) -> float:
        """Time of its end [s]."""
        return self.start + self.duration


def same_task(one: Segment, other: Segment) -> bool:
    """Whether two neighbouring segments belong to one task, and one kind of flight within it."""
    return (one.task, one.kind, one.number) == (other.task, other.kind, other.number)
