"""The aircraft under way: position, height and speed as time goes on, written down as segments.

Heights are pressure altitudes. Speeds are through the air, ways over the ground. Every change of horizontal or vertical
speed takes its time, see :mod:`vrsopt.mission.speed_law`.
"""

from __future__ import annotations

from collections.abc import Iterable
from copy import copy
from math import inf, radians, sin, sqrt, tan
from typing import TYPE_CHECKING

from numpy.polynomial import Chebyshev
from scipy.optimize import brentq

from vrsopt.atmosphere import GRAVITY
from vrsopt.mission.chain import Chain
from vrsopt.mission.motion import PathMotion
from vrsopt.mission.route import Path, Point, Pose, Spiral, Stay, Way
from vrsopt.mission.segment import Kind, Segment
from vrsopt.mission.speed_law import PEAK, SpeedLaw, change, change_duration, course_along, ground_speed, hold
from vrsopt.mission.wind import Wind

if TYPE_CHECKING:
    from vrsopt.mission.file import Handling

BRIEFEST = 1e-9  # s, a shorter segment is left out
CLOSED = 1e-9  # m, how exactly a leg ends at its place
SWEEPS = 50
EXACT = 1e-11  # m/s, over the ground
HEADING = 1e-9  # rad, a turn by less is none


class Flyer:
    """Where the aircraft is and how it moves; begins at rest over ``point`` on ground of ``elevation`` [m]."""

    def __init__(self, handling: Handling, wind: Wind, *, point: Point, elevation: float) -> None:
        self.handling, self.wind = handling, wind
        self.segments: list[Segment] = []
        self.label = ""
        self.number = 0  # of the task
        self.kind: Kind = "idle"
        self.mass_change = 0.0  # kg, for the next segment
        self.time = 0.0
        self.point = point  # where it last stood
        self.ground = elevation  # m, there
        self.ground_ahead: float | None = None  # m, at the end of the way; None for a way that leads nowhere
        self.altitude = elevation
        self.ground_speed = self.climb_rate = 0.0
        self.chain: Chain | None = None  # the way being flown; None at rest
        self.distance = 0.0  # along the way

    # at rest

    def stay(self, duration: float) -> None:
        """Remain where it is for ``duration`` [s]."""
        still = Chebyshev([0.0], domain=[0.0, duration])
        self._add(Stay(self.point), SpeedLaw(duration, still, still + self.altitude), self.ground)

    def lift(self, altitude: float, rate: float) -> None:
        """Go vertically to ``altitude`` [m] at up to ``rate`` [m/s]."""
        rise = altitude - self.altitude
        if rise == 0.0:
            return
        rate, changing, steady = self._lift_parts(rise, rate)
        upward = rate if rise > 0.0 else -rate
        for rates, duration in (((0.0, upward), changing), ((upward, upward), steady), ((upward, 0.0), changing)):
            if duration > BRIEFEST:
                law = change((0.0, self.altitude), ((0.0, 0.0), rates), duration)
                self._add(Stay(self.point), law, self.ground)
                self.altitude = float(law.altitude(duration))
        self.altitude = altitude

    def lift_time(self, rise: float, rate: float) -> float:
        """Time [s] that :meth:`lift` takes for ``rise`` [m]."""
        if rise == 0.0:
            return 0.0
        _, changing, steady = self._lift_parts(rise, rate)
        return 2.0 * changing + steady

    def _lift_parts(self, rise: float, rate: float) -> tuple[float, float, float]:
        """Rate [m/s] of a lift, lower if it is short, and times [s] of each of its two changes and in between."""
        largest = self.handling.vertical_acceleration_m_s2
        rate = min(rate, sqrt(abs(rise) * largest / PEAK))
        changing = PEAK * rate / largest
        return rate, changing, abs(rise) / rate - changing

    # ways

    def take(self, pieces: Iterable[Path], *, ground_ahead: float | None = None) -> None:
        """Take up a way from where the aircraft is, to a place of that elevation [m] or to nowhere."""
        self.chain, self.ground_ahead, self.distance = Chain(pieces), ground_ahead, 0.0

    @property
    def pose(self) -> Pose:
        """Position and course; at rest the course is north."""
        return Pose(self.point, 0.0) if self.chain is None else self.chain.pose(self.distance)

    def levelled(self, roll_length: float) -> Way:
        """The roll-out of a turn in which the aircraft is; nothing in straight flight."""
        if self.chain is None:
            return []
        piece, start, _ = self.chain.piece_at(self.distance)
        curvature = float(piece.curvature(self.distance - start))
        if abs(curvature) * roll_length < HEADING:
            return []
        return [Spiral.from_pose(self.pose, roll_length, curvatures=(curvature, 0.0))]

    def turn_size(self, speed: float, *, least: float = 0.0) -> dict[str, float]:
        """Radius, at ``least`` this [m], and roll length of a turn with the bank of [handling].

        Of the faster of now and ``speed``, with the wind from behind.
        """
        fastest = max(speed, self.ground_speed) + self.wind.strongest
        radius = fastest**2 / (GRAVITY * tan(radians(self.handling.bank_deg)))
        return {"radius": max(radius, least), "roll_length": fastest * self.handling.roll_in_s}

    # speeds

    def over_ground(self, airspeed: float, *, at: float, altitude: float) -> float:
        """Ground speed [m/s] at horizontal airspeed [m/s], ``at`` a distance along the way; 0 is rest."""
        assert self.chain is not None
        if airspeed == 0.0 or self.wind.calm:
            return airspeed
        return float(ground_speed(airspeed, self.chain.pose(at).heading_deg, altitude, self.wind))

    def change_time(self, airspeed: float, climb_rate: float) -> float:
        """Time [s] of a change to horizontal airspeed and climb rate [m/s], as fast as [handling] allows."""
        goal = self.over_ground(airspeed, at=self.distance, altitude=self.altitude)
        handling, rests = self.handling, 0.0 in (self.ground_speed, airspeed)
        horizontal = handling.acceleration_m_s2 if rests else handling.cruise_acceleration_m_s2
        largest = (horizontal, handling.vertical_acceleration_m_s2)
        return change_duration((goal - self.ground_speed, climb_rate - self.climb_rate), largest)

    def change_to(self, airspeed: float, climb_rate: float = 0.0, *, duration: float | None = None) -> None:
        """Change smoothly to horizontal airspeed and climb rate [m/s]; airspeed 0 is rest over the ground.

        In ``duration`` [s]; by default as fast as [handling] allows.
        """
        took = self.change_time(airspeed, climb_rate) if duration is None else duration
        altitude = self.altitude + 0.5 * took * (self.climb_rate + climb_rate)
        goal = self._changed(airspeed, took, altitude)
        rates = ((self.ground_speed, goal), (self.climb_rate, climb_rate))
        ground = None
        if self.ground_speed == 0.0:  # over a place from which it descends, the ground falls away
            ground = self.ground if altitude >= self.ground else None
        elif airspeed == 0.0:
            ground = self.ground_ahead
        if took > BRIEFEST:
            self._fly(change((self.distance, self.altitude), rates, took), ground)
        self.ground_speed, self.climb_rate = goal, climb_rate

    def _changed(self, airspeed: float, took: float, altitude: float) -> float:
        """Ground speed [m/s] with which a change to an airspeed ends at ``altitude``, on the course there."""

        def on_course(goal: float) -> float:  # which depends on how far it is
            end = self.distance + 0.5 * took * (self.ground_speed + goal)
            return self.over_ground(airspeed, at=end, altitude=altitude)

        goal = self.over_ground(airspeed, at=self.distance, altitude=self.altitude)
        for _ in range(SWEEPS):
            previous, goal = goal, on_course(goal)
            if abs(goal - previous) <= EXACT:
                return goal
        # A long change in a turn may end on many a course: in between there is one that fits
        fits = brentq(
            lambda speed: speed - on_course(speed),
            airspeed - self.wind.strongest,
            airspeed + self.wind.strongest,
            xtol=EXACT,
        )
        return float(fits)

    def hold(self, airspeed: float, climb_rate: float = 0.0, *, until: float = inf, duration: float = inf) -> None:
        """Hold horizontal airspeed and climb rate [m/s] up to a distance [m] along the way or for a time [s]."""
        assert self.chain is not None
        end = self.time + duration
        while until - self.distance > CLOSED and end - self.time > BRIEFEST:
            piece, start, corner = self.chain.piece_at(self.distance)
            goal = min(until, corner)
            longest = min(end - self.time, self._time_to_wind_level(climb_rate))
            farthest = min(goal, self.distance + (airspeed + self.wind.strongest) * longest)
            course = None if self.wind.calm else course_along(piece, start, self.distance, farthest)
            law, arrived = self._hold_to(goal, (airspeed, climb_rate), course, longest=longest)
            self._add(piece, SpeedLaw(law.duration, law.distance - start, law.altitude))
            self.ground_speed = float(law.distance.deriv()(law.duration))
            self.distance = goal if arrived else float(law.distance(law.duration))
            self.altitude = float(law.altitude(law.duration))
        self.climb_rate = climb_rate

    def _time_to_wind_level(self, climb_rate: float) -> float:
        """Time [s] at ``climb_rate`` [m/s] to the next altitude at which the wind has a corner."""
        if self.wind.calm or climb_rate == 0.0:
            return inf
        times = ((level - self.altitude) / climb_rate for level in self.wind.altitude)
        return min((time for time in times if time > BRIEFEST), default=inf)

    def _hold_to(
        self, goal: float, speeds: tuple[float, float], course: Chebyshev | None, *, longest: float
    ) -> tuple[SpeedLaw, bool]:
        """The law up to the distance ``goal`` [m], or for at most ``longest`` [s], and whether it gets there."""
        begin = (self.distance, self.altitude)
        took = (goal - self.distance) / self.over_ground(speeds[0], at=self.distance, altitude=self.altitude)
        for _ in range(SWEEPS):
            law = hold(course, begin, speeds, min(took, longest), self.wind)
            missing = goal - float(law.distance(law.duration))
            if took >= longest and missing > CLOSED:
                return law, False
            if abs(missing) <= 0.1 * CLOSED:
                break
            took = law.duration + missing / float(law.distance.deriv()(law.duration))
        return law, True

    def steep(self, altitude: float, speed: float, climb_angle: float, *, then: float) -> None:
        """Climb or descend to ``altitude`` [m] at airspeed [m/s] and angle [rad], and level off at horizontal ``then``.

        A change of height too small for that angle is flown at a flatter one.
        """
        rise = altitude - self.altitude

        def rates(size: float) -> tuple[float, float]:
            return sqrt(speed**2 - size**2), size if climb_angle > 0.0 else -size

        def taken(size: float) -> tuple[float, float]:
            horizontal, vertical = rates(size)
            after = copy(self)
            after.ground_speed = self.over_ground(horizontal, at=self.distance, altitude=self.altitude)
            after.climb_rate = vertical
            return self.change_time(horizontal, vertical), after.change_time(then, 0.0)

        def excess(size: float) -> float:
            return 0.5 * size * sum(taken(size)) - abs(rise)

        size = speed * abs(sin(climb_angle))
        flatter = excess(size) > 0.0
        if flatter:
            size = float(brentq(excess, 0.0, size, xtol=1e-14, rtol=1e-14))
        (horizontal, vertical), (_, levelling) = rates(size), taken(size)
        self.change_to(horizontal, vertical)
        left = altitude - self.altitude - 0.5 * levelling * vertical
        if not flatter and left / vertical > BRIEFEST:
            self.hold(horizontal, vertical, duration=left / vertical)
        self.change_to(then, 0.0, duration=levelling)
        self.altitude = altitude

    # segments

    def _fly(self, law: SpeedLaw, ground: float | None) -> None:
        """A law along the way, as one segment on each piece of it."""
        assert self.chain is not None
        begin, distance = 0.0, self.distance
        while law.duration - begin > BRIEFEST:
            piece, start, corner = self.chain.piece_at(distance)
            end = law.time_at(corner)
            part = law.part(begin, end)
            self._add(piece, SpeedLaw(part.duration, part.distance - start, part.altitude), ground)
            begin, distance = end, corner
        self.distance = float(law.distance(law.duration))
        self.altitude = float(law.altitude(law.duration))

    def _add(self, piece: Path, law: SpeedLaw, ground: float | None = None) -> None:
        """A segment over ground of that elevation [m], None where it does not matter."""
        motion = PathMotion(piece, law.distance, law.altitude)
        own = (self.label, self.kind, self.time, law.duration, self.mass_change)
        self.segments.append(Segment(*own, motion, ground, self.number))
        self.time += law.duration
        self.mass_change = 0.0
