"""Rotor speed and twist over a mission, and the settings every way of scheduling them shares."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np

from vrsopt.errors import InputError
from vrsopt.quantity import is_number
from vrsopt.schedule.bands import ForbiddenBand, check_bands
from vrsopt.solvers.status import Status

NOMINAL_ROTOR_SPEED = 44.4  # rad/s
NOMINAL_TWIST = math.radians(8.0)
ON_LIMIT = 1e-3  # a normalised limit within this of zero counts as active, above it as broken
SAME_TIME, SAME_SPEED = 1e-6, 1e-7  # s, rad/s

Variables = Literal["both", "speed", "twist"]
Ends = Literal["pinned", "free", "periodic"]


@dataclass(frozen=True)
class ScheduleSettings:
    """What a schedule may do. Rates and accelerations of ``None`` are unlimited.

    ``nominal_rotor_speed`` [rad/s] and ``nominal_twist`` [rad] are flown at pinned ends and by the nominal schedule;
    ``rotor_speed_bounds`` [rad/s] and ``twist_bounds`` [rad] are (lower, upper); ``rotor_speed_rate`` [rad/s2] and
    ``twist_rate`` [rad/s] bound the size of the rates, ``rotor_speed_acceleration`` [rad/s3] and ``twist_acceleration``
    [rad/s2] how fast the rates change; ``forbidden_bands`` are rotor speeds that may only be crossed.
    ``spin_down_credit``: a rotor that slows down drives, down to the engines' idle; without it what speeds the rotor up
    is charged and nothing is given back. ``ends``: rotor speed and twist nominal at both ends of the mission, free, or
    at the end what they are at the start.
    """

    nominal_rotor_speed: float = NOMINAL_ROTOR_SPEED  # rad/s
    nominal_twist: float = NOMINAL_TWIST  # rad
    rotor_speed_bounds: tuple[float, float] = (0.75 * NOMINAL_ROTOR_SPEED, 1.15 * NOMINAL_ROTOR_SPEED)  # rad/s
    twist_bounds: tuple[float, float] = (math.radians(6.0), math.radians(16.0))  # rad
    rotor_speed_rate: float | None = 0.01 * NOMINAL_ROTOR_SPEED  # rad/s2
    twist_rate: float | None = math.radians(1.0)  # rad/s
    rotor_speed_acceleration: float | None = None  # rad/s3, of the rate of the rotor speed
    twist_acceleration: float | None = None  # rad/s2
    spin_down_credit: bool = True
    forbidden_bands: tuple[ForbiddenBand, ...] = ()
    ends: Ends = "pinned"

    def __post_init__(self) -> None:
        self._check_kinds()
        for name, nominal, (low, high) in (
            ("rotor_speed_bounds", self.nominal_rotor_speed, self.rotor_speed_bounds),
            ("twist_bounds", self.nominal_twist, self.twist_bounds),
        ):
            if not low <= nominal <= high:
                raise InputError(
                    f"schedule settings: {name} = ({low:g}, {high:g}): must contain the nominal {nominal:g}"
                )
        for name in ("rotor_speed_rate", "twist_rate"):
            rate = getattr(self, name)
            if rate is not None and not rate >= 0.0:
                raise InputError(f"schedule settings: {name} = {rate:g}: must not be negative")
        for name in ("rotor_speed_acceleration", "twist_acceleration"):
            acceleration = getattr(self, name)
            if acceleration is not None and not acceleration > 0.0:
                raise InputError(f"schedule settings: {name} = {acceleration:g}: must be above 0")
        if self.ends not in get_args(Ends):
            raise InputError(f"schedule settings: ends = {self.ends!r}: one of {', '.join(get_args(Ends))}")
        held = self.nominal_rotor_speed if self.ends == "pinned" else None
        check_bands(self.forbidden_bands, bounds=self.rotor_speed_bounds, rate=self.rotor_speed_rate, held=held)

    def _check_kinds(self) -> None:
        """Raises :class:`InputError` for a value that is not of the kind of its field."""
        allowed: dict[str, str] = {}
        for name in ("nominal_rotor_speed", "nominal_twist"):
            if not is_number(getattr(self, name)):
                allowed[name] = "must be a number"
        for name in ("rotor_speed_bounds", "twist_bounds"):
            pair = getattr(self, name)
            if not (isinstance(pair, tuple | list) and len(pair) == 2 and all(map(is_number, pair))):
                allowed[name] = "must be (lower, upper), two numbers"
        for name in ("rotor_speed_rate", "twist_rate", "rotor_speed_acceleration", "twist_acceleration"):
            if getattr(self, name) is not None and not is_number(getattr(self, name)):
                allowed[name] = "must be a number, or None if unlimited"
        if not isinstance(self.spin_down_credit, bool):
            allowed["spin_down_credit"] = "must be True or False"
        bands = self.forbidden_bands
        if not (isinstance(bands, tuple) and all(isinstance(band, ForbiddenBand) for band in bands)):
            allowed["forbidden_bands"] = "must be a tuple of ForbiddenBand"
        for name, text in allowed.items():
            raise InputError(f"schedule settings: {name} = {getattr(self, name)!r}: {text}")

    def restricted(self, variables: Variables) -> ScheduleSettings:
        """The same settings with only ``variables`` free; the other one is held at its nominal value."""
        if variables == "speed":
            return replace(self, twist_bounds=(self.nominal_twist, self.nominal_twist))
        if variables == "twist":
            return replace(self, rotor_speed_bounds=(self.nominal_rotor_speed, self.nominal_rotor_speed))
        if variables != "both":
            raise InputError(f"schedule settings: variables = {variables}: must be both, speed or twist")
        return self

    def box(self, bounds: Mapping[str, tuple[float, float]]) -> np.ndarray:
        """Lower and upper (2, 2) rotor speed [rad/s] and twist [rad]: these within ``bounds`` [the same units] of a
        path model.
        """
        box = np.array([self.rotor_speed_bounds, self.twist_bounds]).T
        for column, name in enumerate(("rotor_speed", "twist")):
            low, high = bounds[name]
            box[:, column] = max(box[0, column], low), min(box[1, column], high)
            if box[0, column] > box[1, column]:
                raise InputError(f"schedule settings: {name}_bounds: outside the range {low:g}..{high:g} of the model")
        return box


@dataclass(frozen=True)
class Schedule:
    """Rotor speed [rad/s] and twist [rad] at nodes (n,) ordered by segment and time [s].

    Linear in time between the nodes of a segment; every segment has nodes at both its ends, so values may jump between
    segments. A schedule without success is still the best that was found; ``message`` says what is wrong with it.
    """

    name: str
    segment: np.ndarray
    time: np.ndarray
    rotor_speed: np.ndarray
    twist: np.ndarray
    success: bool = True
    status: Status = Status.CONVERGED
    message: str = ""
    details: Mapping[str, float] = field(default_factory=dict)  # effort and settings of the method, for the record

    def __post_init__(self) -> None:
        order = np.lexsort((self.time, self.segment))
        if not np.array_equal(order, np.arange(len(order))):
            raise InputError(f"schedule {self.name}: time: nodes must be ordered by segment and time")
        for name in ("segment", "rotor_speed", "twist"):
            if getattr(self, name).shape != self.time.shape:
                raise InputError(f"schedule {self.name}: {name}: must have the shape of time {self.time.shape}")

    @property
    def rotor_speed_acceleration(self) -> float:
        """Largest change of the rate per time [rad/s3] from the middle of one piece to that of the next; inf where the
        rotor speed jumps."""
        step, change = np.diff(self.time), np.diff(self.rotor_speed)
        pieces = step > SAME_TIME
        if np.any(np.abs(change[~pieces]) > SAME_SPEED):
            return math.inf
        rate, apart = change[pieces] / step[pieces], 0.5 * (step[pieces][1:] + step[pieces][:-1])
        return float(np.max(np.abs(np.diff(rate)) / apart, initial=0.0))

    def at(self, segment: np.ndarray, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rotor speed and twist at pairs of segment index and time [s], arrays of one shape.

        Raises InputError for a segment without nodes.
        """
        segment, time = np.broadcast_arrays(segment, time)
        rotor_speed, twist = np.empty(time.shape), np.empty(time.shape)
        for s in np.unique(segment):
            here, known = segment == s, self.segment == s
            if not known.any():
                raise InputError(f"schedule {self.name}: segment = {s}: has no nodes")
            rotor_speed[here] = np.interp(time[here], self.time[known], self.rotor_speed[known])
            twist[here] = np.interp(time[here], self.time[known], self.twist[known])
        return rotor_speed, twist
