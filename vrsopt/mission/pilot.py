"""Flies the tasks of a mission one after the other: what a task asks of the places and of the tasks around it.

Elevations of places count as pressure altitudes. How the aircraft moves is in :mod:`vrsopt.mission.flyer`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NoReturn

from vrsopt.errors import InputError
from vrsopt.mission.flyer import Flyer
from vrsopt.mission.join import direct_to
from vrsopt.mission.route import Leg, Path
from vrsopt.mission.segment import ON_THE_GROUND, Kind
from vrsopt.mission.tasks import MassEvent
from vrsopt.mission.turns import end_of, turn

if TYPE_CHECKING:
    from vrsopt.mission.file import Mission, Place

SAME_HEIGHT = 1e-6  # m
STRAIGHT_ON = 1e6  # m, longer than any leg flown by time or distance


class Pilot(Flyer):
    """Knows which task is flown, at which place the aircraft is and to which it goes."""

    def __init__(self, mission: Mission) -> None:
        start = mission.places[mission.start]
        super().__init__(mission.handling, mission.wind.field, point=start.point, elevation=start.elevation_m)
        self.mission = mission
        # what happens between tasks is told to the task after it
        self.numbers = [number for number, task in enumerate(mission.tasks) if not isinstance(task, MassEvent)]
        self.tasks: list[Any] = [mission.tasks[number] for number in self.numbers]
        self.index = 0  # of the task being flown, among these
        self.place: str | None = mission.start  # None away from any place
        self.goal: str | None = None  # place at the end of the way
        self.leg: int | None = None  # index of the cruise whose way it is
        self.trial = False  # a copy that only finds out how far it gets

    def refuse(self, field: str, value: Any, allowed: str, *, task: int | None = None) -> NoReturn:
        """Raises :class:`InputError` about a field of a task, by default the one being flown."""
        shown = ": missing," if value is None else f" = {value!r}:"
        raise InputError(f"tasks[{self.numbers[self.index if task is None else task]}].{field}{shown} {allowed}")

    @property
    def next_task(self) -> Any:
        """The task after this one, None after the last."""
        return self.tasks[self.index + 1] if self.index + 1 < len(self.tasks) else None

    @property
    def before(self) -> str:
        """Kind of the segment flown last, empty at the start."""
        return self.segments[-1].kind if self.segments else ""

    def begin(self, label: str, kind: Kind, *, mass_change: float = 0.0) -> None:
        """Name what is flown from here on."""
        number = self.numbers[self.index]
        before = self.numbers[self.index - 1] if self.index else -1
        events = sum(
            task.mass_change_kg for task in self.mission.tasks[before + 1 : number] if isinstance(task, MassEvent)
        )
        self.label, self.kind, self.number = label, kind, number
        self.mass_change += mass_change + events  # a task so brief that it has no segments leaves its own to the next

    def here(self, kind: str) -> Place:
        """The place where the aircraft is, which it has to be at."""
        if self.place is None:
            self.refuse("kind", kind, "allowed: at a place; a cruise to one has to come first")
        return self.mission.places[self.place]

    def check_airborne(self, kind: str) -> None:
        """Refuse a task in flight of an aircraft that is on the ground."""
        if not self.segments or self.before in ON_THE_GROUND:
            self.refuse("kind", kind, "allowed: after a hover, not from the ground")

    def check_above(self, field: str, place: str, *, task: int | None = None) -> None:
        """Refuse to fly below the ground of the place that ``field`` names."""
        elevation = self.mission.places[place].elevation_m
        if self.altitude < elevation - SAME_HEIGHT:
            allowed = f"allowed: a place no higher than {self.altitude:g} m, the altitude flown there"
            self.refuse(field, place, f"{allowed}; its elevation is {elevation:g} m", task=task)

    def toward(self, place: str, speed: float) -> None:
        """Take up the way to a place: a turn toward it, then straight."""
        target = self.mission.places[place].point
        if self.chain is None:
            self.follow([Leg.between(self.point, target)], goal=place)
        else:
            size = self.turn_size(speed)
            level = self.levelled(size["roll_length"])
            self.follow([*level, *direct_to(end_of(level, self.pose), target, **size)], goal=place)

    def straight_on(self, course_deg: float | None, speed: float) -> None:
        """Take up a straight way that leads nowhere, after a turn to the course, which from rest has to be given."""
        if self.chain is None:
            assert course_deg is not None
            self.follow([Leg(self.point, course_deg, STRAIGHT_ON)])
            return
        size = self.turn_size(speed)
        pieces = self.levelled(size["roll_length"])
        if course_deg is not None:
            pose = end_of(pieces, self.pose)
            pieces = [*pieces, *turn(pose, (course_deg - pose.heading_deg + 180.0) % 360.0 - 180.0, **size)]
        self.follow([*pieces, Leg(*end_of(pieces, self.pose), STRAIGHT_ON)])

    def follow(self, pieces: Iterable[Path], *, goal: str | None = None) -> None:
        """Take up a way from where the aircraft is, to a place or to nowhere."""
        self.take(pieces, ground_ahead=None if goal is None else self.mission.places[goal].elevation_m)
        self.goal, self.leg, self.place = goal, None, None

    def arrive(self) -> None:
        """End the way over its place."""
        assert self.goal is not None
        place = self.mission.places[self.goal]
        self.place, self.point, self.ground = self.goal, place.point, place.elevation_m

    def rest(self) -> None:
        """Stand over the place, at the end of the way to it."""
        self.chain, self.leg, self.ground_speed, self.climb_rate = None, None, 0.0, 0.0
