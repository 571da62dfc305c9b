"""Tasks that go somewhere: climb, cruise, descent, change of speed.

A cruise and the climbs and changes of speed before it, and the descents after a cruise to a place, share one way.
"""

from __future__ import annotations

from copy import copy
from math import ceil, radians
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import BeforeValidator, model_validator

from vrsopt.mission.field import Altitude, Bearing, Name, complaint, tenths_up, within
from vrsopt.mission.flyer import CLOSED, SWEEPS
from vrsopt.mission.ranges import FreeTask
from vrsopt.mission.rest_tasks import Hover
from vrsopt.mission.route import SHORTEST
from vrsopt.mission.speed_law import PEAK
from vrsopt.mission.tasks import Duration, Speed, Task

if TYPE_CHECKING:
    from vrsopt.mission.pilot import Pilot


class _Steep(Task):
    """A climb or a descent, along the way that is being flown or else that of the next cruise."""

    kind: Literal["climb", "descent"]
    speed_m_s: Speed = 40.0

    def _fly_to(self, pilot: Pilot, altitude: float, climb_angle_deg: float) -> None:
        cruise = _take_up(pilot)
        pilot.begin(f"{self.kind} to {cruise.to}" if pilot.goal else self.kind, self.kind)
        change = altitude - pilot.altitude
        if change * climb_angle_deg <= 0.0:
            side = "above" if climb_angle_deg > 0.0 else "below"
            allowed = f"allowed for a {self.kind}: {side} {pilot.altitude:g}, where it begins"
            pilot.refuse("altitude_m", altitude, allowed)
        pilot.steep(altitude, self.speed_m_s, radians(climb_angle_deg), then=_speed_after(pilot, self.speed_m_s))


class Climb(_Steep):
    """Up to ``altitude_m``, along the way of the next cruise.

    Begun at rest it gathers speed on the climb; it levels off at the altitude, at the speed of the task that follows.
    """

    kind: Literal["climb"]
    altitude_m: Altitude
    climb_angle_deg: Annotated[float, BeforeValidator(within(0.5, 30.0))] = 7.12

    def fly(self, pilot: Pilot) -> None:
        self._fly_to(pilot, self.altitude_m, self.climb_angle_deg)


class Descent(_Steep):
    """Down to ``altitude_m`` or, without it, to the height of the hover that follows.

    After a cruise to a place it ends over that place, before a hover with the speed running out on the descent;
    elsewhere it is flown along the way of the next cruise.
    """

    kind: Literal["descent"]
    altitude_m: Altitude | None = None
    climb_angle_deg: Annotated[float, BeforeValidator(within(-30.0, -0.5))] = -7.12

    def fly(self, pilot: Pilot) -> None:
        altitude = self.altitude_m
        if altitude is None:
            if not isinstance(pilot.next_task, Hover) or pilot.goal is None:
                pilot.refuse("altitude_m", None, "needed unless a hover at the place of the cruise follows")
            altitude = pilot.mission.places[pilot.goal].elevation_m + pilot.next_task.height_m
        self._fly_to(pilot, altitude, self.climb_angle_deg)
        cruise = _cruise_index(pilot)
        if cruise < pilot.index and pilot.goal is not None:
            pilot.check_above("to", pilot.goal, task=cruise)
            if not isinstance(pilot.next_task, Descent):
                _end_leg(pilot)


class Cruise(FreeTask):
    """Level flight: ``to`` a place, or for ``duration_s`` or ``distance_m`` on a course.

    To a place it takes what climbs before and descents after it leave of the way. By time or distance, counted with
    the change of speed at its start, it goes on straight, or on ``course_deg`` (true) after a turn. Speed and altitude
    may be free, see :mod:`vrsopt.mission.ranges`.
    """

    level_speed: ClassVar[bool] = True
    place_field: ClassVar[str | None] = "to"

    kind: Literal["cruise"]
    to: Name | None = None
    duration_s: Duration | None = None
    distance_m: Annotated[float, BeforeValidator(within(100.0, 500_000.0))] | None = None
    course_deg: Bearing | None = None

    @model_validator(mode="after")
    def _one_end(self) -> Cruise:
        stated = [name for name in ("to", "duration_s", "distance_m") if getattr(self, name) is not None]
        if len(stated) != 1:
            shown = " and ".join(stated) or "none"
            raise complaint("to", self.to, f"allowed: one of to, duration_s and distance_m, not {shown}")
        if self.to is not None and self.course_deg is not None:
            raise complaint("course_deg", self.course_deg, "allowed: with duration_s or distance_m, not with to")
        return self

    def fly(self, pilot: Pilot) -> None:
        pilot.check_airborne(self.kind)
        _take_up(pilot)
        pilot.begin(f"cruise to {self.to}" if self.to else "cruise", "cruise")
        began, start = pilot.time, pilot.distance
        if self.to is None:
            pilot.change_to(self.speed_m_s)
            took, flown = pilot.time - began, pilot.distance - start
            if self.duration_s is not None:
                if took > self.duration_s:
                    allowed = f"allowed: at least {tenths_up(took)}, the time of the change of speed"
                    pilot.refuse("duration_s", self.duration_s, allowed)
                pilot.hold(self.speed_m_s, duration=began + self.duration_s - pilot.time)
            elif self.distance_m is not None:
                if flown > self.distance_m:
                    allowed = f"allowed: at least {tenths_up(flown)}, the way flown while the speed changes"
                    pilot.refuse("distance_m", self.distance_m, allowed)
                pilot.hold(self.speed_m_s, until=start + self.distance_m)
            return
        pilot.check_above("to", self.to)
        assert pilot.chain is not None
        length = pilot.chain.length
        pilot.change_to(self.speed_m_s)
        end = length - _distance_after(pilot, self.speed_m_s, length=length)
        if end < pilot.distance - CLOSED:
            least = ceil(pilot.distance + length - end - CLOSED)  # from where the way and the climbs on it begin
            allowed = f"allowed: a place at least {least} m away, as far as the changes of height and speed go"
            pilot.refuse("to", self.to, f"{allowed}; it is {length:.0f} m away")
        pilot.hold(self.speed_m_s, until=end)
        if not isinstance(pilot.next_task, Descent):
            if pilot.next_task is not None and pilot.next_task.at_rest:
                pilot.change_to(0.0)
            _end_leg(pilot)


class SpeedChange(Task):
    """Level change to ``speed_m_s`` with a peak acceleration of its own, along the way of the next cruise.

    Between tasks of different speeds the speed changes by itself, with the acceleration of [handling].
    """

    kind: Literal["speed_change"]
    speed_m_s: Speed
    acceleration_m_s2: Annotated[float, BeforeValidator(within(0.05, 3.0))]

    def fly(self, pilot: Pilot) -> None:
        cruise = _take_up(pilot)
        pilot.begin(f"cruise to {cruise.to}" if pilot.goal else "cruise", "cruise")
        difference = pilot.over_ground(self.speed_m_s, at=pilot.distance, altitude=pilot.altitude) - pilot.ground_speed
        pilot.change_to(self.speed_m_s, duration=PEAK * abs(difference) / self.acceleration_m_s2)


def _take_up(pilot: Pilot) -> Cruise:
    """The cruise whose way is flown: that of the way being flown to a place, or the next; its way is begun."""
    index = _cruise_index(pilot)
    cruise = pilot.tasks[index]
    assert isinstance(cruise, Cruise)
    if pilot.leg != index:
        pilot.check_airborne(pilot.tasks[pilot.index].kind)
        fastest = max(task.speed_m_s for task in pilot.tasks[pilot.index : index + 1])
        if cruise.to is not None:
            pilot.toward(cruise.to, fastest)
            if pilot.chain is None or pilot.chain.length < SHORTEST:
                pilot.refuse("to", cruise.to, "allowed: a place where the aircraft is not already", task=index)
        else:
            if pilot.chain is None and cruise.course_deg is None:
                allowed = "needed where a cruise by time or distance begins at rest"
                pilot.refuse("course_deg", None, allowed, task=index)
            pilot.straight_on(cruise.course_deg, fastest)
        pilot.leg = index
    return cruise


def _cruise_index(pilot: Pilot) -> int:
    """Index of the cruise to which the task being flown belongs: the one it follows, or the next."""
    tasks, index = pilot.tasks, pilot.index
    if isinstance(tasks[index], Descent):
        back = index
        while isinstance(tasks[back], Descent):
            back -= 1
        if isinstance(tasks[back], Cruise):
            return back
    while index < len(tasks) and isinstance(tasks[index], _Steep | SpeedChange):
        index += 1
    if index == len(tasks) or not isinstance(tasks[index], Cruise):
        pilot.refuse("kind", tasks[pilot.index].kind, "allowed: only with a cruise that says where to")
    return index


def _distance_after(pilot: Pilot, speed: float, *, length: float) -> float:
    """Distance [m] that the descents after a cruise at ``speed`` [m/s] take, or the stop, to end at ``length`` [m]."""
    distance = 0.0
    for _ in range(SWEEPS):
        trial = copy(pilot)
        trial.segments, trial.distance = list(pilot.segments), length - distance
        trial.trial = True
        trial.ground_speed = trial.over_ground(speed, at=trial.distance, altitude=trial.altitude)
        while isinstance(trial.next_task, Descent):
            trial.index += 1
            trial.tasks[trial.index].fly(trial)
        if trial.index == pilot.index and trial.next_task is not None and trial.next_task.at_rest:
            trial.change_to(0.0)
        previous, distance = distance, trial.distance - (length - distance)
        if abs(distance - previous) <= 0.1 * CLOSED:
            break
    return distance


def _end_leg(pilot: Pilot) -> None:
    """At the end of the way to a place: over it, and at rest if a task at rest follows."""
    if pilot.goal is None or pilot.trial:
        return
    pilot.arrive()
    if pilot.next_task is not None and pilot.next_task.at_rest:
        pilot.rest()


def _speed_after(pilot: Pilot, own: float) -> float:
    """Horizontal airspeed [m/s] at which a climb or descent levels off: that of the level task that follows."""
    follower = pilot.next_task
    if follower is None or (follower.at_rest and pilot.goal is not None):
        return 0.0
    return follower.speed_m_s if follower.level_speed else own
