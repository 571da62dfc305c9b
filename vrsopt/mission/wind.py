"""Wind: horizontal, steady, the same everywhere or by altitude."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[Any]


@dataclass(frozen=True)
class Wind:
    """Wind components toward east and north [m/s] at increasing pressure altitudes [m].

    Linear in between, constant below the first altitude and above the last.
    """

    altitude: tuple[float, ...] = (0.0,)
    east: tuple[float, ...] = (0.0,)
    north: tuple[float, ...] = (0.0,)

    @classmethod
    def from_directions(cls, altitude: Sequence[float], from_deg: ArrayLike, speed: ArrayLike) -> Wind:
        """Wind as weather reports give it: where it comes from [deg clockwise from true north] and speed [m/s]."""
        direction, strength = np.radians(np.asarray(from_deg, dtype=float)), np.asarray(speed, dtype=float)
        east, north = -strength * np.sin(direction), -strength * np.cos(direction)
        return cls(
            tuple(map(float, altitude)), tuple(np.atleast_1d(east).tolist()), tuple(np.atleast_1d(north).tolist())
        )

    @property
    def calm(self) -> bool:
        """No wind at any altitude."""
        return not any(self.east) and not any(self.north)

    def __str__(self) -> str:
        if self.calm:
            return "still air"
        parts = []
        for altitude, east, north in zip(self.altitude, self.east, self.north, strict=True):
            where = f" at {altitude:g} m" if len(self.altitude) > 1 else ""
            direction = np.degrees(np.arctan2(-east, -north)) % 360
            parts.append(f"{np.hypot(east, north):.1f} m/s from {direction:.0f} deg{where}")
        return f"wind {', '.join(parts)}"

    def as_dict(self) -> dict[str, list[float]]:
        """Altitudes, and the components there, for a record."""
        return {"altitude_m": list(self.altitude), "east_m_s": list(self.east), "north_m_s": list(self.north)}

    @property
    def strongest(self) -> float:
        """Largest wind speed at any altitude [m/s]."""
        return float(np.max(np.hypot(self.east, self.north)))

    def at(self, altitude: ArrayLike) -> tuple[Array, Array]:
        """Components toward east and north [m/s] at pressure altitudes [m], each of their shape."""
        where = np.asarray(altitude, dtype=float)
        return np.interp(where, self.altitude, self.east), np.interp(where, self.altitude, self.north)

    def along_and_across(self, course_deg: ArrayLike, altitude: ArrayLike) -> tuple[Array, Array]:
        """Components along a course [deg] and to its right [m/s]."""
        east, north = self.at(altitude)
        course = np.radians(np.asarray(course_deg, dtype=float))
        return east * np.sin(course) + north * np.cos(course), east * np.cos(course) - north * np.sin(course)


CALM = Wind()
