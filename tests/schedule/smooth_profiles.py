"""Profiles for the tests of schedules, made by hand: pieces held, changed smoothly or turned, one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from vrsopt.mission.conditions import Kinematics
from vrsopt.mission.profile import Profile, Segment

GRAVITY = 9.80665
CLIMB = np.radians(7.12)


@dataclass(frozen=True)
class Ramp:
    """Ground speed, climb rate [m/s] and acceleration to the right [m/s2] that go smoothly from one value to another.

    Over the own time of the segment by the smoothstep 3 s^2 - 2 s^3; the altitude is the exact integral.
    """

    duration: float
    altitude: float  # m, at the start
    speed: tuple[float, float]
    climb_rate: tuple[float, float] = (0.0, 0.0)
    lateral: tuple[float, float] = (0.0, 0.0)

    def kinematics(self, time: np.ndarray) -> Kinematics:
        """See :class:`vrsopt.mission.motion.Motion`."""
        s = time / self.duration
        share, rate = s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s) / self.duration
        speed, climb, lateral = (a + (b - a) * share for a, b in (self.speed, self.climb_rate, self.lateral))
        low, high = self.climb_rate
        return Kinematics(
            ground_speed=speed,
            acceleration=(self.speed[1] - self.speed[0]) * rate,
            lateral_acceleration=lateral,
            altitude=self.altitude + low * time + (high - low) * self.duration * (s**3 - 0.5 * s**4),
            climb_rate=climb,
            vertical_acceleration=(high - low) * rate,
        )

    def track(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Nowhere: the tests of schedules need no positions."""
        zero = np.zeros_like(time)
        return zero, zero, zero


def lateral_acceleration(load_factor: float) -> float:
    """To the right [m/s2] in a level turn of this load factor."""
    return GRAVITY * float(np.sqrt(load_factor**2 - 1.0))


def jumping_profile(*tasks: dict[str, Any]) -> Profile:
    """Profile of tasks held constant, whose conditions jump from one to the next.

    Each is given by ``task`` and ``duration``, and what differs from a hover at sea level.
    """
    time, altitude, segments = 0.0, tasks[0].get("altitude", 0.0), []
    for task in tasks:
        speed, climb, turn = task.get("speed", 0.0), task.get("climb", 0.0), lateral_acceleration(task.get("load", 1.0))
        forward, up = speed * np.cos(climb), speed * np.sin(climb)
        motion = Ramp(task["duration"], altitude, (forward, forward), (up, up), (turn, turn))
        kind, change = task.get("kind", task["task"]), task.get("mass_change", 0.0)
        segments.append(Segment(task["task"], kind, time, task["duration"], change, motion))
        time, altitude = time + task["duration"], altitude + task["duration"] * up
    return Profile(tuple(segments))


class SmoothFlight:
    """A mission written down piece by piece; what a piece does not name goes on as it was."""

    def __init__(self, altitude: float = 0.0) -> None:
        self.segments: list[Segment] = []
        self.time, self.altitude, self.speed, self.climb_rate = 0.0, altitude, 0.0, 0.0

    def hold(self, task: str, duration: float, *, kind: str = "", mass_change: float = 0.0) -> SmoothFlight:
        """Everything constant."""
        return self.change(task, duration, kind=kind, mass_change=mass_change)

    def change(
        self,
        task: str,
        duration: float,
        *,
        speed: float | None = None,
        climb_rate: float | None = None,
        kind: str = "",
        mass_change: float = 0.0,
    ) -> SmoothFlight:
        """Smoothly to another horizontal speed and climb rate [m/s]."""
        speed = self.speed if speed is None else speed
        climb_rate = self.climb_rate if climb_rate is None else climb_rate
        motion = Ramp(duration, self.altitude, (self.speed, speed), (self.climb_rate, climb_rate))
        self._add(task, kind, motion, mass_change)
        self.altitude += duration * (self.climb_rate + climb_rate) / 2
        self.speed, self.climb_rate = speed, climb_rate
        return self

    def turn(self, task: str, steady: float, *, load_factor: float = 1.1, roll: float = 3.0) -> SmoothFlight:
        """Roll-in, steady turn, roll-out."""
        lateral = lateral_acceleration(load_factor)
        for duration, ends in ((roll, (0.0, lateral)), (steady, (lateral, lateral)), (roll, (lateral, 0.0))):
            flown = (self.speed, self.speed), (self.climb_rate, self.climb_rate), ends
            self._add(task, "", Ramp(duration, self.altitude, *flown))
        return self

    def _add(self, task: str, kind: str, motion: Ramp, mass_change: float = 0.0) -> None:
        self.segments.append(Segment(task, kind or task, self.time, motion.duration, mass_change, motion))
        self.time += motion.duration

    def take_off(self, altitude: float, speed: float) -> SmoothFlight:
        """From the hover into a climb at 40 m/s and 7.12 deg up to ``altitude`` [m], and level at ``speed``."""
        forward, up = 40.0 * np.cos(CLIMB), 40.0 * np.sin(CLIMB)
        left = altitude - self.altitude - (20.0 + 10.0) * up / 2
        self.change("climb", 20.0, speed=forward, climb_rate=up)
        self.hold("climb", left / up)
        return self.change("climb", 10.0, speed=speed, climb_rate=0.0)

    def land(self, altitude: float = 0.0) -> SmoothFlight:
        """Down from level flight into the hover at ``altitude`` [m]."""
        forward, down = 40.0 * np.cos(CLIMB), -40.0 * np.sin(CLIMB)
        left = altitude - self.altitude - (10.0 + 25.0) * down / 2
        self.change("descent", 10.0, speed=forward, climb_rate=down)
        self.hold("descent", left / down)
        return self.change("descent", 25.0, speed=0.0, climb_rate=0.0)

    def profile(self) -> Profile:
        """What has been flown so far."""
        return Profile(tuple(self.segments))


def surveillance(turns: int) -> Profile:
    """Out to an area, ``turns`` turns there between legs of 1500 m, and back."""
    flight = SmoothFlight().hold("idle", 120.0).hold("hover", 60.0).take_off(600.0, 40.0).hold("cruise", 300.0)
    for _ in range(turns):
        flight.turn("loiter", 24.0).hold("loiter", 37.0)
    return flight.hold("cruise", 300.0).land().hold("hover", 60.0).hold("idle", 60.0).profile()


def rescue(legs: int = 18) -> Profile:
    """A search of ``legs`` legs at 50 m, a pick-up in the hover and a stop on the ground on the way home."""
    flight = SmoothFlight().hold("idle", 120.0).hold("hover", 60.0).take_off(300.0, 48.0).hold("cruise", 500.0)
    flight.change("descent", 10.0, climb_rate=-5.0).hold("descent", 40.0)
    flight.change("descent", 15.0, speed=35.0, climb_rate=0.0)
    for leg in range(legs):
        flight.hold("search", 114.0)
        if leg < legs - 1:
            flight.turn("search", 15.0, load_factor=1.18)
    flight.change("descent", 25.0, speed=0.0).hold("pick-up", 180.0, kind="hover", mass_change=240.0)
    flight.take_off(300.0, 48.0).hold("cruise", 700.0).land().hold("hover", 60.0)
    flight.hold("idle", 180.0, mass_change=-240.0).hold("hover", 45.0)
    return flight.take_off(300.0, 48.0).hold("cruise", 400.0).land().hold("hover", 60.0).hold("idle", 60.0).profile()
