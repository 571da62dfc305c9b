"""A segment: the piece of a mission over which speed, flight-path angle and load factor are constant."""

from __future__ import annotations

from dataclasses import dataclass

from vrsopt.mission.route import Path


@dataclass(frozen=True)
class Segment:
    """One piece of a mission. The altitude is linear in time; the mass change happens at the start."""

    task: str  # label of the task it belongs to
    kind: str  # "idle" | "hover" | "climb" | "cruise" | "descent" | "loiter" | "search"
    start: float  # s
    duration: float  # s
    speed: float  # true airspeed, m/s; 0 in hover and idle
    climb_angle: float  # rad
    load_factor: float  # -
    altitude_start: float  # m, pressure altitude
    altitude_end: float  # m
    mass_change: float  # kg
    path: Path

    @property
    def end(self) -> float:
        """Time of its end [s]."""
        return self.start + self.duration
