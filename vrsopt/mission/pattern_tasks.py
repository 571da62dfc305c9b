"""Tasks that fly a pattern around a place: loitering on race-tracks and circles, searching.

Each counts its time from where it begins: the way to the pattern, with the turns into it and the change of speed, is
part of it. A pattern may be cut anywhere; what follows rolls out of the turn first.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from copy import copy
from itertools import chain
from math import hypot, radians, tan
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import BeforeValidator, model_validator

from vrsopt.atmosphere import GRAVITY
from vrsopt.errors import InputError
from vrsopt.mission import pattern as patterns
from vrsopt.mission.field import Bearing, Name, complaint, tenths_up, within
from vrsopt.mission.join import join
from vrsopt.mission.pattern import CORNERS, Pattern
from vrsopt.mission.ranges import FreeTask
from vrsopt.mission.route import Leg, Point, Pose, length_of
from vrsopt.mission.segment import Kind
from vrsopt.mission.tasks import Duration, Speed, Task
from vrsopt.mission.turns import end_of

if TYPE_CHECKING:
    from vrsopt.mission.pilot import Pilot

MAX_BANK_DEG = 60.0  # load factor 2

LegLength = Annotated[float, BeforeValidator(within(100.0, 50_000.0))]
Radius = Annotated[float, BeforeValidator(within(20.0, 10_000.0))]
Side = Literal["right", "left"]


class PatternTask(Task):
    """Base of the patterns, flown ``around`` a place at the altitude the aircraft has."""

    level_speed: ClassVar[bool] = True
    place_field: ClassVar[str | None] = "around"
    segment_kind: ClassVar[Kind]

    around: Name
    turn_radius_m: Radius
    speed_m_s: Speed
    duration_s: Duration

    @model_validator(mode="after")
    def _turns_can_be_flown(self) -> PatternTask:
        if self.turn_radius_m < _tightest(self.speed_m_s):
            raise complaint("turn_radius_m", self.turn_radius_m, _no_tighter(self.speed_m_s))
        return self

    @abstractmethod
    def candidates(self, pilot: Pilot, centre: Point, roll_length: float, time: float) -> Iterable[Pattern]:
        """The pattern, or several that differ in where they begin: that with the shortest way to it is flown.

        ``time`` [s]: what is left for the way to it and the pattern. Raises :class:`InputError` for a pattern too small
        for its turns.
        """

    def fly(self, pilot: Pilot) -> None:
        pilot.check_airborne(self.kind)
        pilot.check_above("around", self.around)
        fastest = self.speed_m_s + hypot(*map(float, pilot.wind.at(pilot.altitude)))
        if self.turn_radius_m < _tightest(fastest):
            pilot.refuse("turn_radius_m", self.turn_radius_m, f"{_no_tighter(fastest)} over the ground, down the wind")
        began = pilot.time
        pilot.begin(f"{self.segment_kind} around {self.around}", self.segment_kind)
        if pilot.chain is not None:  # its turns are made for its speed
            pilot.straight_on(None, self.speed_m_s)
            pilot.change_to(self.speed_m_s)
        left = self.duration_s - (pilot.time - began)
        centre = pilot.mission.places[self.around].point
        roll_length = self.speed_m_s * pilot.handling.roll_in_s
        entry = pilot.turn_size(self.speed_m_s, least=self.turn_radius_m)
        try:
            found = self.candidates(pilot, centre, roll_length, left)
            ways = [(self._entry(pilot, pattern.entry, entry), pattern) for pattern in found]
        except InputError as error:
            raise InputError(f"tasks[{pilot.numbers[pilot.index]}]: {error}") from None
        way, best = min(ways, key=lambda pair: length_of(pair[0]))
        needed = self._arrival(pilot, way) - began
        if needed >= self.duration_s:
            allowed = f"allowed: more than {tenths_up(needed)}, the time to the pattern"
            pilot.refuse("duration_s", self.duration_s, allowed)
        pilot.follow(chain(way, best.pieces))
        pilot.change_to(self.speed_m_s)
        pilot.hold(self.speed_m_s, duration=began + self.duration_s - pilot.time)

    def _arrival(self, pilot: Pilot, way: patterns.Way) -> float:
        """Time [s] at which the pattern is reached, in the wind there is."""
        if not way:
            return pilot.time
        trial = copy(pilot)
        trial.segments = []
        trial.follow(way)
        trial.change_to(self.speed_m_s)
        trial.hold(self.speed_m_s, until=length_of(way))
        return trial.time

    def _entry(self, pilot: Pilot, goal: Pose, size: dict[str, float]) -> patterns.Way:
        if pilot.chain is None:  # from rest on whatever course
            direct = Leg.between(pilot.point, goal.point)
            start = Pose(pilot.point, direct.heading_deg)
            return join(start, goal, **size)
        level = pilot.levelled(size["roll_length"])
        return [*level, *join(end_of(level, pilot.pose), goal, **size)]


def _tightest(speed: float) -> float:
    """Radius [m] of the turn that takes the largest bank at ``speed`` [m/s]."""
    return speed**2 / (GRAVITY * tan(radians(MAX_BANK_DEG)))


def _no_tighter(speed: float) -> str:
    return f"allowed: at least {tenths_up(_tightest(speed))}, a bank of {MAX_BANK_DEG:g} deg at {speed:g} m/s"


class LoiterTask(FreeTask, PatternTask):
    """Base of loitering, at a free speed or altitude if that is stated; the turns keep their radius."""

    @model_validator(mode="after")
    def _fastest_turns_can_be_flown(self) -> LoiterTask:
        speeds = self.speed_range_m_s
        if speeds is not None and self.turn_radius_m < _tightest(speeds[1]):
            raise complaint("turn_radius_m", self.turn_radius_m, _no_tighter(speeds[1]))
        return self


class RaceTrack(LoiterTask):
    """Loiter on two legs of ``leg_m`` along ``bearing_deg`` (true), joined by half circles."""

    segment_kind: ClassVar[Kind] = "loiter"

    kind: Literal["loiter"]
    pattern: Literal["race_track"] = "race_track"
    leg_m: LegLength
    bearing_deg: Bearing = 0.0
    turns: Side = "right"

    def candidates(self, pilot: Pilot, centre: Point, roll_length: float, time: float) -> Iterable[Pattern]:
        for bearing in (self.bearing_deg, self.bearing_deg + 180.0):
            yield patterns.race_track(
                centre,
                bearing,
                leg=self.leg_m,
                radius=self.turn_radius_m,
                roll_length=roll_length,
                right=self.turns == "right",
            )


class Circle(LoiterTask):
    """Loiter on a circle of ``turn_radius_m``."""

    segment_kind: ClassVar[Kind] = "loiter"

    kind: Literal["loiter"]
    pattern: Literal["circle"]
    turns: Side = "right"

    def candidates(self, pilot: Pilot, centre: Point, roll_length: float, time: float) -> Iterable[Pattern]:
        for bearing in range(0, 360, 45):
            yield patterns.circle(
                centre, bearing, radius=self.turn_radius_m, roll_length=roll_length, right=self.turns == "right"
            )


class CreepingLine(PatternTask):
    """Parallel-track search, centred on the place: legs of ``leg_m`` along ``leg_bearing_deg``, ``spacing_m`` apart.

    The pattern has as many legs as there is time for. They are joined by turns of ``turn_radius_m``, or by half circles
    where ``spacing_m`` leaves no room for two of them.
    """

    segment_kind: ClassVar[Kind] = "search"

    kind: Literal["search"]
    pattern: Literal["creeping_line"] = "creeping_line"
    leg_m: LegLength
    spacing_m: Annotated[float, BeforeValidator(within(50.0, 20_000.0))]
    leg_bearing_deg: Bearing = 0.0

    @model_validator(mode="after")
    def _turns_fit(self) -> CreepingLine:
        if self.spacing_m < 2.0 * self.turn_radius_m:
            allowed = f"allowed: at least twice turn_radius_m, {2.0 * self.turn_radius_m:g}"
            raise complaint("spacing_m", self.spacing_m, allowed)
        return self

    def candidates(self, pilot: Pilot, centre: Point, roll_length: float, time: float) -> Iterable[Pattern]:
        size = {"radius": self.turn_radius_m, "roll_length": roll_length}
        pitch = patterns.track_pitch(self.leg_m, self.spacing_m, **size)
        entry = pilot.turn_size(self.speed_m_s, least=self.turn_radius_m)
        for corner in CORNERS:
            tracks = 1
            for _ in range(20):  # the way to the corner depends on the number of tracks, and it on the way
                found = patterns.parallel_tracks(
                    centre,
                    self.leg_bearing_deg,
                    leg=self.leg_m,
                    spacing=self.spacing_m,
                    tracks=tracks,
                    corner=corner,
                    **size,
                )
                left = self.speed_m_s * time - length_of(self._entry(pilot, found.entry, entry))
                wanted = max(1, 1 + int(max(left, 0.0) // pitch))
                if wanted == tracks:
                    break
                tracks = wanted
            yield found


class ExpandingSquare(PatternTask):
    """Search in a square spiral from the place outwards: legs of 1, 1, 2, 2, 3 ... times ``spacing_m``."""

    segment_kind: ClassVar[Kind] = "search"

    kind: Literal["search"]
    pattern: Literal["expanding_square"]
    spacing_m: Annotated[float, BeforeValidator(within(50.0, 20_000.0))]
    bearing_deg: Bearing = 0.0
    turns: Side = "right"

    def candidates(self, pilot: Pilot, centre: Point, roll_length: float, time: float) -> Iterable[Pattern]:
        yield patterns.expanding_square(
            centre,
            self.bearing_deg,
            spacing=self.spacing_m,
            radius=self.turn_radius_m,
            roll_length=roll_length,
            right=self.turns == "right",
        )


class SectorSearch(PatternTask):
    """Search in sectors of ``sector_m`` around the place: legs through it, turns by 120 deg to the right between."""

    segment_kind: ClassVar[Kind] = "search"

    kind: Literal["search"]
    pattern: Literal["sector"]
    sector_m: LegLength
    bearing_deg: Bearing = 0.0

    def candidates(self, pilot: Pilot, centre: Point, roll_length: float, time: float) -> Iterable[Pattern]:
        yield patterns.sector_search(
            centre, self.bearing_deg, reach=self.sector_m, radius=self.turn_radius_m, roll_length=roll_length
        )
