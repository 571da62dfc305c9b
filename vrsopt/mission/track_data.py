"""A flown track as it was recorded: fixes in the order of the file, nothing smoothed or left out."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vrsopt.errors import InputError

Array = NDArray[Any]
ALTITUDES = (-1000.0, 20_000.0)  # m, what a receiver can mean


@dataclass(frozen=True)
class Track:
    """Fixes (N,) of one aircraft.

    ``altitude`` is taken as pressure altitude; it is nan where a fix has none. ``ground_speed``, ``course_deg`` and
    ``on_ground`` are there only where the file says them; speed and course may be nan. ``notes`` say in sentences what
    was assumed and left out in reading.
    """

    time: Array  # s, from the earliest fix
    latitude_deg: Array
    longitude_deg: Array
    altitude: Array  # m
    ground_speed: Array | None = None  # m/s
    course_deg: Array | None = None  # over the ground, clockwise from true north
    on_ground: Array | None = None  # bool
    name: str = "track"
    begin: str = ""  # date and time of the earliest fix, if known
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        count = np.shape(self.time)
        for name, low, high in (
            ("time", 0.0, np.inf),
            ("latitude_deg", -90.0, 90.0),
            ("longitude_deg", -180.0, 180.0),
            ("altitude", *ALTITUDES),
            ("ground_speed", 0.0, np.inf),
            ("course_deg", -360.0, 360.0),
        ):
            values = getattr(self, name)
            if values is None:
                continue
            if np.shape(values) != count or len(count) != 1:
                raise InputError(f"{self.name}: {name}: {np.shape(values)} values: allowed: as many as times, {count}")
            known = np.asarray(values, dtype=float)
            if name in ("altitude", "ground_speed", "course_deg"):
                known = known[~np.isnan(known)]
            wrong = ~((known >= low) & (known <= high) & np.isfinite(known))
            if wrong.any():
                raise InputError(f"{self.name}: {name} = {known[wrong][0]:g}: allowed: {low:g} to {high:g}")
        if self.on_ground is not None and np.shape(self.on_ground) != count:
            raise InputError(f"{self.name}: on_ground: {np.shape(self.on_ground)} values: allowed: {count}")

    def __len__(self) -> int:
        return len(self.time)
