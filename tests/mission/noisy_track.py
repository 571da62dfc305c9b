"""Flights to be recorded, and what a receiver makes of them: noise, gaps, duplicates, outliers, jumps in altitude."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from vrsopt.mission.conditions import Kinematics
from vrsopt.mission.profile import Profile
from vrsopt.mission.route import WGS84, Point
from vrsopt.mission.segment import Segment
from vrsopt.mission.track_data import Track

ORIGIN = Point(45.0865, 7.6033)
GROUND = 287.0  # m
STEP = 0.05  # s, of the flight's integration


@dataclass(frozen=True)
class Steered:
    """A motion integrated from commands: speed, climb rate and turn rate change smoothly from one value to the next."""

    start: float
    speed: CubicSpline
    climb_rate: CubicSpline
    turn_rate: CubicSpline
    course: CubicSpline  # rad, clockwise from north
    east: CubicSpline
    north: CubicSpline
    altitude: CubicSpline

    def kinematics(self, time):
        t = np.asarray(time) + self.start
        return Kinematics(
            ground_speed=self.speed(t),
            acceleration=self.speed(t, 1),
            lateral_acceleration=self.speed(t) * self.turn_rate(t),
            altitude=self.altitude(t),
            climb_rate=self.climb_rate(t),
            vertical_acceleration=self.climb_rate(t, 1),
        )

    def track(self, time):
        t = np.asarray(time) + self.start
        rows = []
        for x, y, course in zip(self.east(t), self.north(t), self.course(t), strict=True):
            end = WGS84.Direct(*ORIGIN, np.degrees(np.arctan2(x, y)), np.hypot(x, y))
            rows.append((end["lat2"], end["lon2"], np.degrees(course) + end["azi2"] - end["azi1"]))
        return tuple(np.array(rows).reshape(-1, 3).T)


class Pilot:
    """Writes down what is flown: each piece lasts ``duration`` [s] and ends at the given speeds and turn rate."""

    def __init__(self, altitude: float = GROUND) -> None:
        self.altitude = altitude
        self.times, self.states, self.pieces = [0.0], [(0.0, 0.0, 0.0)], []

    def fly(self, kind: str, duration: float, speed=None, climb_rate=None, turn_rate=None, over: float = 0.0) -> Pilot:
        """Change to the given state smoothly over the first ``over`` seconds (0: a tenth of a second), then keep it."""
        begin, old = self.times[-1], self.states[-1]
        new = tuple(o if n is None else n for o, n in zip(old, (speed, climb_rate, turn_rate), strict=True))
        self.pieces.append((kind, begin, begin + duration, min(max(over, 0.1), duration), old, new))
        self.times.append(begin + duration)
        self.states.append(new)
        return self

    def circuit(self, leg: float, radius: float, laps: int, side: float = 1.0, kind: str = "loiter") -> Pilot:
        """Race tracks at the present speed, with half circles after each leg and three seconds to roll in and out."""
        speed = self.states[-1][0]
        rate = side * speed / radius
        for _ in range(2 * laps):
            self.fly(kind, leg / speed)
            self.fly(kind, np.pi * radius / speed, turn_rate=rate, over=3.0)
            self.fly(kind, 3.0, turn_rate=0.0, over=3.0)
        return self

    def profile(self, ground: float | None = GROUND) -> Profile:
        """What was flown, one segment a piece."""
        t = np.arange(0.0, self.times[-1] + STEP, STEP)
        state = np.zeros((3, len(t)))
        for _, begin, end, over, old, new in self.pieces:
            here = (t >= begin - 1e-9) & (t <= end + STEP)
            x = np.clip((t[here] - begin) / over, 0.0, 1.0)
            blend = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
            state[:, here] = np.outer(old, 1.0 - blend) + np.outer(new, blend)
        speed, climb, turn = (CubicSpline(t, row) for row in state)
        course = turn.antiderivative()
        east = CubicSpline(t, speed(t) * np.sin(course(t))).antiderivative()
        north = CubicSpline(t, speed(t) * np.cos(course(t))).antiderivative()
        altitude = climb.antiderivative()
        altitude.c[-1] += self.altitude
        motion = Steered(0.0, speed, climb, turn, course, east, north, altitude)
        return Profile(
            tuple(
                Segment(kind, kind, begin, end - begin, 0.0, replace(motion, start=begin), ground)
                for kind, begin, end, *_ in self.pieces
            )
        )


def surveillance(circuits: int = 11, sides: bool = True) -> Profile:
    """A law-enforcement flight: to one area, race tracks, to the next, race tracks, back."""
    pilot = (
        Pilot()
        .fly("idle", 120.0)
        .fly("hover", 4.0, climb_rate=1.0, over=2.0)
        .fly("hover", 56.0, climb_rate=0.0, over=2.0)
    )
    pilot.fly("climb", 45.0, speed=39.7, climb_rate=5.0, over=45.0).fly("climb", 40.0)
    pilot.fly("cruise", 10.0, speed=40.0, climb_rate=0.0, over=10.0).fly("cruise", 100.0)
    pilot.circuit(1500.0, 350.0, circuits)
    pilot.fly("cruise", 90.0).circuit(1500.0, 350.0, circuits, side=-1.0 if sides else 1.0)
    pilot.fly("cruise", 120.0)
    height = pilot_height(pilot) - GROUND - 2.0
    pilot.fly("descent", 10.0, climb_rate=-5.0, over=10.0)
    pilot.fly("descent", (height - 5.0 * (5.0 + 20.0)) / 5.0)
    pilot.fly("descent", 40.0, speed=0.0, climb_rate=0.0, over=40.0)
    pilot.fly("hover", 57.0)
    pilot.fly("hover", 4.0, climb_rate=(GROUND - pilot_height(pilot)) / 4.0, over=2.0)
    pilot.fly("idle", 2.0, climb_rate=0.0, over=2.0).fly("idle", 60.0)
    return pilot.profile()


def pilot_height(pilot: Pilot) -> float:
    """Altitude [m] at the end of what was flown: the changes are symmetrical, their mean is half way."""
    height = pilot.altitude
    for _, begin, end, over, old, new in pilot.pieces:
        height += 0.5 * over * (old[1] + new[1]) + (end - begin - over) * new[1]
    return height


@dataclass(frozen=True)
class Noise:
    """What is wrong with a record; standard deviations [m] are per axis."""

    interval: float = 1.0  # s
    correlated: float = 4.0  # m, horizontal, over ``correlation_time``
    white: float = 1.5  # m, horizontal
    correlated_vertical: float = 6.0
    white_vertical: float = 2.0
    correlation_time: float = 45.0  # s
    gaps: tuple[tuple[float, float], ...] = ()  # begin and end [s]
    duplicates: int = 0  # fixes written twice, half of them with another position
    outliers: int = 0  # fixes some kilometres off
    jumps: int = 0  # altitudes some hundred metres off, for one to four fixes
    shuffled: int = 0  # fixes written later than the next one


@dataclass(frozen=True)
class Fixes:
    """A record: times [s], degrees, metres, in the order of the file."""

    time: np.ndarray
    latitude: np.ndarray
    longitude: np.ndarray
    altitude: np.ndarray


QUIET = Noise(correlated=0.0, white=0.0, correlated_vertical=0.0, white_vertical=0.0)
TYPICAL = Noise(gaps=((700.0, 720.0), (1500.0, 1530.0)), duplicates=12, outliers=8, jumps=6, shuffled=5)


def record(profile: Profile, noise: Noise = TYPICAL, *, seed: int = 1) -> Fixes:
    """What a receiver writes down of a flight."""
    random = np.random.default_rng(seed)
    time = np.arange(0.0, profile.duration, noise.interval)
    segment = np.clip(np.searchsorted(profile.edges, time, side="right") - 1, 0, len(profile.segments) - 1)
    latitude, longitude = profile.positions(segment, time)
    altitude = np.array(profile.conditions(segment, time).altitude)

    def wander(sigma: float, white: float) -> np.ndarray:
        keep = np.exp(-noise.interval / noise.correlation_time)
        steps = random.normal(size=len(time)) * sigma
        slow = np.empty(len(time))
        slow[0] = steps[0]
        for k in range(1, len(time)):
            slow[k] = keep * slow[k - 1] + np.sqrt(1.0 - keep**2) * steps[k]
        return slow + white * random.normal(size=len(time))

    degree = 111_200.0
    latitude = latitude + wander(noise.correlated, noise.white) / degree
    longitude = longitude + wander(noise.correlated, noise.white) / degree / np.cos(np.radians(latitude))
    altitude = altitude + wander(noise.correlated_vertical, noise.white_vertical)
    places = random.permutation(np.arange(10, len(time) - 10))
    for k in places[: noise.outliers]:
        latitude[k] += random.uniform(0.01, 0.05) * random.choice([-1, 1])
    for k in places[noise.outliers : noise.outliers + noise.jumps]:
        altitude[k : k + random.integers(1, 5)] += random.uniform(200.0, 600.0)
    order = np.sort(np.concatenate([np.arange(len(time)), places[: noise.duplicates]]))
    fixes = [array[order] for array in (time, latitude, longitude, altitude)]
    again = np.flatnonzero(np.diff(order) == 0)[::2]
    fixes[1][again] += 2.0 / degree
    keep = np.ones(len(order), dtype=bool)
    for begin, end in noise.gaps:
        keep &= ~((fixes[0] > begin) & (fixes[0] < end))
    fixes = [array[keep] for array in fixes]
    for k in random.choice(np.arange(1, len(fixes[0]) - 1), noise.shuffled, replace=False):
        for array in fixes:
            array[[k, k + 1]] = array[[k + 1, k]]
    return Fixes(*fixes)


def write_csv(path: Path, fixes: Fixes) -> Path:
    """Seconds, degrees and metres."""
    rows = zip(fixes.time, fixes.latitude, fixes.longitude, fixes.altitude, strict=True)
    lines = [f"{t:.3f},{lat:.8f},{lon:.8f},{h:.3f}" for t, lat, lon, h in rows]
    path.write_text("\n".join(["time_s,latitude,longitude,altitude_m", *lines]) + "\n")
    return path


def write_gpx(path: Path, fixes: Fixes) -> Path:
    """GPX 1.1, one track of one segment."""
    begin = datetime(2024, 5, 17, 8, 0, tzinfo=UTC)
    points = []
    for t, lat, lon, h in zip(fixes.time, fixes.latitude, fixes.longitude, fixes.altitude, strict=True):
        when = (begin + timedelta(seconds=float(t))).isoformat(timespec="milliseconds").replace("+00:00", "Z")
        points.append(f'<trkpt lat="{lat:.8f}" lon="{lon:.8f}"><ele>{h:.3f}</ele><time>{when}</time></trkpt>')
    head = '<?xml version="1.0" encoding="UTF-8"?>\n<gpx version="1.1" creator="test" xmlns="http://www.topografix.com/GPX/1/1">'
    path.write_text("\n".join([head, "<trk><name>flight</name><trkseg>", *points, "</trkseg></trk></gpx>"]) + "\n")
    return path


def track_of(fixes: Fixes, **more) -> Track:
    """The record as a track."""
    return Track(fixes.time, fixes.latitude, fixes.longitude, fixes.altitude, **more)


def at(profile: Profile, time: np.ndarray):
    """Conditions and positions (2, N) of a profile at times."""
    segment = np.clip(np.searchsorted(profile.edges, time, side="right") - 1, 0, len(profile.segments) - 1)
    return profile.conditions(segment, time), np.array(profile.positions(segment, time))


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))
