"""From the tasks of a mission to its segments: where each task begins, how far and how long it goes.

Heights are pressure altitudes; the elevations of places count as such. The air is still. Turns at places (from one leg
to the next) take no time; speeds jump at the edges of tasks, and so does the height by the few metres between the
ground and the hover: acceleration, lift-off and touch-down are not modelled.
"""

from __future__ import annotations

from math import cos, radians, tan
from typing import TYPE_CHECKING

from numpy.polynomial import Chebyshev

from vrsopt.errors import InputError
from vrsopt.mission.pattern import creeping_line
from vrsopt.mission.route import SHORTEST, Arc, Leg, Path, Stay
from vrsopt.mission.motion import PathMotion
from vrsopt.mission.segment import Segment
from vrsopt.mission.tasks import MAX_ALTITUDE, Climb, Cruise, Descent, Hover, Idle, Search, Task, turn_load_factor

if TYPE_CHECKING:
    from vrsopt.mission.file import Mission

LIFT_OFF_HEIGHT = 5.0  # m, the most a hover may be above the ground when an idle task comes before or after it
SAME_HEIGHT = 1e-6  # m


def segments_of(mission: Mission) -> tuple[Segment, ...]:
    """The segments of a mission, contiguous in time, with continuous positions.

    Raises :class:`InputError` (``tasks[i].field = value: what is allowed``) for tasks that can not follow each other:
    a leg too short for its climb and descent, a hover at a height the aircraft does not have, a task at a place
    where the aircraft is not.
    """
    flight = _Flight(mission)
    index = 0
    while index < len(mission.tasks):
        task = mission.tasks[index]
        if isinstance(task, Idle):
            flight.idle(index, task)
        elif isinstance(task, Hover):
            flight.hover(index, task)
        elif isinstance(task, Search):
            flight.search(index, task)
        else:
            index = flight.leg(index)
            continue
        index += 1
    return tuple(flight.segments)


class _Flight:
    """Where the aircraft is while the tasks are gone through."""

    def __init__(self, mission: Mission) -> None:
        self.mission = mission
        self.segments: list[Segment] = []
        self.time = 0.0
        self.place: str | None = mission.start  # None away from any place
        self.point = mission.places[mission.start].point
        self.altitude: float | None = None  # None before the first task

    def add(
        self,
        task: str,
        kind: str,
        path: Path,
        *,
        duration: float,
        altitude: float,
        speed: float = 0.0,
        climb_angle: float = 0.0,
        load_factor: float = 1.0,
        mass_change: float = 0.0,
    ) -> None:
        """Append a segment that ends at ``altitude``; one at rest is at that altitude from its start."""
        begin = altitude if self.altitude is None or speed == 0.0 else self.altitude
        motion = PathMotion(
            path,
            Chebyshev([path.length / 2, path.length / 2], domain=[0.0, duration]),
            Chebyshev([(begin + altitude) / 2, (altitude - begin) / 2], domain=[0.0, duration]),
        )
        segment = Segment(task, kind, self.time, duration, mass_change, motion)
        self.segments.append(segment)
        self.time = segment.end
        self.altitude = altitude

    def idle(self, index: int, task: Idle) -> None:
        place = self._at_place(index, "idle")
        elevation = self.mission.places[place].elevation_m
        before = self.segments[-1].kind if self.segments else "idle"
        if before not in ("idle", "hover"):
            raise InputError(f"tasks[{index}].kind = 'idle': allowed: as the first task or after a hover")
        if self.altitude is not None and self.altitude > elevation + LIFT_OFF_HEIGHT:
            raise InputError(
                f"tasks[{index}].kind = 'idle': allowed: after a hover at most {LIFT_OFF_HEIGHT:g} m above the ground, "
                f"not at {self.altitude - elevation:g} m"
            )
        self.add(
            f"idle at {place}",
            "idle",
            Stay(self.point),
            duration=task.duration_s,
            altitude=elevation,
            mass_change=task.mass_change_kg,
        )

    def hover(self, index: int, task: Hover) -> None:
        place = self._at_place(index, "hover")
        elevation = self.mission.places[place].elevation_m
        altitude = elevation + task.height_m
        field = f"tasks[{index}].height_m = {task.height_m!r}"
        if altitude > MAX_ALTITUDE:
            raise InputError(f"{field}: allowed: an altitude of at most {MAX_ALTITUDE:g} m, not {altitude:g} m")
        if self.segments and self.segments[-1].kind == "idle":
            if task.height_m > LIFT_OFF_HEIGHT:
                raise InputError(f"{field}: allowed after an idle task: at most {LIFT_OFF_HEIGHT:g}")
        elif self.altitude is not None and abs(altitude - self.altitude) > SAME_HEIGHT:
            raise InputError(f"{field}: allowed here: {self.altitude - elevation:g}, the height the aircraft has")
        self.add(
            f"hover at {place}",
            "hover",
            Stay(self.point),
            duration=task.duration_s,
            altitude=altitude,
            mass_change=task.mass_change_kg,
        )

    def search(self, index: int, task: Search) -> None:
        altitude = self._airborne(index, "search")
        self._above(f"tasks[{index}].around", task.around, altitude)
        pieces = creeping_line(self.point, self.mission.places[task.around].point, task)
        entry = pieces[0].length
        if entry >= task.speed_m_s * task.duration_s:
            raise InputError(
                f"tasks[{index}].duration_s = {task.duration_s!r}: allowed: more than {entry / task.speed_m_s:.1f}, "
                f"the time to the pattern"
            )
        for piece in pieces if entry >= SHORTEST else pieces[1:]:
            turning = isinstance(piece, Arc)
            self.add(
                f"search around {task.around}",
                "search",
                piece,
                duration=piece.length / task.speed_m_s,
                altitude=altitude,
                speed=task.speed_m_s,
                load_factor=turn_load_factor(task.speed_m_s, task.turn_radius_m) if turning else 1.0,
            )
        self.point = piece.position(piece.length)
        self.place = None

    def leg(self, first: int) -> int:
        """Fly one geodesic: climbs and descents before a cruise, the cruise, descents after it; the next task's index.

        The cruise takes what the ground distances of the climbs and descents leave of the geodesic.
        """
        tasks = self.mission.tasks
        altitude = self._airborne(first, tasks[first].kind)
        index, last = self._extent(first)
        cruise = tasks[index]
        assert isinstance(cruise, Cruise)
        goal = self.mission.places[cruise.to].point
        leg = Leg.between(self.point, goal)
        ends = []  # of each task: altitude, ground distance
        for i in range(first, last + 1):
            altitude, ground = self._steep(i, altitude, to=cruise.to) if i != index else (altitude, 0.0)
            if i >= index:
                self._above(f"tasks[{index}].to", cruise.to, altitude)
            ends.append((altitude, ground))
        steep = sum(ground for _, ground in ends)
        level = leg.length - steep
        if level < -SHORTEST:
            raise InputError(
                f"tasks[{index}].to = {cruise.to!r}: allowed: a place at least {steep:.0f} m away, as far as the "
                f"climbs and descents of the leg go; it is {leg.length:.0f} m away"
            )
        ends[index - first] = (ends[index - first][0], level)
        flown = 0.0
        for task, (altitude, ground) in zip(tasks[first : last + 1], ends, strict=True):
            if ground >= SHORTEST:
                self._fly(task, cruise.to, leg.section(flown, flown + ground), altitude=altitude)
                flown += ground
        self.point, self.place = goal, cruise.to
        return last + 1

    def _fly(self, task: Task, to: str, path: Leg, *, altitude: float) -> None:
        """One task of a leg, over its part of the geodesic."""
        assert isinstance(task, Climb | Cruise | Descent)
        angle = 0.0 if isinstance(task, Cruise) else radians(task.climb_angle_deg)
        self.add(
            f"{task.kind} to {to}",
            task.kind,
            path,
            duration=path.length / (task.speed_m_s * cos(angle)),
            altitude=altitude,
            speed=task.speed_m_s,
            climb_angle=angle,
        )

    def _extent(self, first: int) -> tuple[int, int]:
        """Index of the cruise of the leg that begins with task ``first``, and of the leg's last task."""
        tasks = self.mission.tasks
        cruise = first
        while isinstance(tasks[cruise], Climb | Descent):  # ends: the last task of a mission is idle or hover
            cruise += 1
        if not isinstance(tasks[cruise], Cruise):
            kind = tasks[first].kind
            raise InputError(f"tasks[{first}].kind = {kind!r}: allowed: only with a cruise that says where to")
        last = cruise
        while isinstance(tasks[last + 1], Descent):
            last += 1
        return cruise, last

    def _steep(self, index: int, altitude: float, *, to: str) -> tuple[float, float]:
        """Altitude at the end of a climb or descent that begins at ``altitude``, and the ground distance it takes."""
        task = self.mission.tasks[index]
        assert isinstance(task, Climb | Descent)
        end, follower = task.altitude_m, self.mission.tasks[index + 1]
        if end is None and isinstance(follower, Hover):
            end = self.mission.places[to].elevation_m + follower.height_m
        field = f"tasks[{index}].altitude_m"
        if end is None:
            raise InputError(f"{field}: missing: needed unless a hover follows")
        change, angle = end - altitude, radians(task.climb_angle_deg)
        if change * angle <= 0.0:
            side = "above" if angle > 0.0 else "below"
            raise InputError(f"{field} = {end!r}: allowed for a {task.kind}: {side} {altitude:g}, where it begins")
        return end, change / tan(angle)

    def _airborne(self, index: int, kind: str) -> float:
        """The altitude of the aircraft, which has to be flying."""
        if self.altitude is None or self.segments[-1].kind == "idle":
            raise InputError(f"tasks[{index}].kind = {kind!r}: allowed: after a hover, not from the ground")
        return self.altitude

    def _above(self, field: str, place: str, altitude: float) -> None:
        """Refuse to fly below the ground of the place that ``field`` names."""
        elevation = self.mission.places[place].elevation_m
        if altitude < elevation:
            raise InputError(
                f"{field} = {place!r}: allowed: a place no higher than {altitude:g} m, the altitude flown there; "
                f"its elevation is {elevation:g} m"
            )

    def _at_place(self, index: int, kind: str) -> str:
        """The place where the aircraft is, which it has to be at."""
        if self.place is None:
            raise InputError(f"tasks[{index}].kind = {kind!r}: allowed: at a place; a cruise to one has to come first")
        return self.place
