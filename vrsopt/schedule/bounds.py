"""Bounds of the unknowns and rows of the whole-mission problem: all that a re-solve may change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, TypeAlias

import numpy as np

from vrsopt.errors import InputError
from vrsopt.quantity import is_number
from vrsopt.schedule.additions import Additions
from vrsopt.schedule.labels import Labels
from vrsopt.schedule.layout import FUEL_SCALE
from vrsopt.schedule.rows import Discretisation
from vrsopt.schedule.schedule import ScheduleSettings

# name -> upper usage of a limit of the aircraft, or (lower, upper) of a constraint of one's own in its unit
LimitBounds: TypeAlias = "Mapping[str, float | tuple[float | None, float | None]]"
STRUCTURE = ("rotor_speed_rate", "twist_rate", "rotor_speed_acceleration", "twist_acceleration")


@dataclass(frozen=True)
class Corridor:
    """Lower and upper rotor speed [rad/s] and twist [rad], each (n,) at the mesh nodes; None where not narrowed."""

    rotor_speed: tuple[np.ndarray, np.ndarray] | None = None
    twist: tuple[np.ndarray, np.ndarray] | None = None


@dataclass(frozen=True)
class Bounds:
    """Bounds of x and g, by the names ``nlpsol`` takes them by."""

    lbx: np.ndarray
    ubx: np.ndarray
    lbg: np.ndarray
    ubg: np.ndarray

    def arguments(self) -> dict[str, np.ndarray]:
        """The bounds by name."""
        return {one.name: getattr(self, one.name) for one in fields(self)}


def check_structure(built: ScheduleSettings, asked: ScheduleSettings) -> None:
    """Raises InputError where ``asked`` needs another problem than the one made with the settings ``built``."""
    for name in STRUCTURE:
        old, new = getattr(built, name), getattr(asked, name)
        if (old is None) != (new is None):
            raise InputError(
                f"trajectory: {name} = {new}: the problem was built with {old}; limited and unlimited differ"
            )
    if built.spin_down_credit != asked.spin_down_credit:
        raise InputError(
            f"trajectory: spin_down_credit = {asked.spin_down_credit}: the problem was built with the other"
        )
    if built.ends != asked.ends and "periodic" in (built.ends, asked.ends):
        raise InputError(f"trajectory: ends = {asked.ends}: the problem was built with {built.ends}")


@dataclass(frozen=True)
class Box:
    """What bounds the unknowns whatever is solved: bounds (2, 2) of rotor speed and twist, the end points of fuel.

    ``fuel_place`` (P,): place in x of the fuel at each point where the aircraft is evaluated, ``mass_added`` (P,) [kg]
    by events until there, ``lightest`` and ``heaviest`` (P,) [kg] for which its model holds.
    """

    fuel_place: np.ndarray
    mass_added: np.ndarray
    lightest: np.ndarray
    heaviest: np.ndarray


def unknown_bounds(
    of: Discretisation,
    box: Box,
    takeoff_mass: float,
    *,
    settings: ScheduleSettings,
    allowed: np.ndarray,
    nodes: np.ndarray,
    corridor: Corridor,
) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of x. ``allowed`` (2, 2) bounds of rotor speed and twist, ``nodes`` (N, 2) at the ends of intervals."""
    layout = of.layout
    lower, upper = np.full(layout.size, -np.inf), np.full(layout.size, np.inf)
    unburned = takeoff_mass + box.mass_added
    np.maximum.at(lower, box.fuel_place, (unburned - box.heaviest) / FUEL_SCALE)
    np.minimum.at(upper, box.fuel_place, (unburned - box.lightest) / FUEL_SCALE)
    start = layout.fuel[0, 0]
    if lower[start] > 0.0 or upper[start] < 0.0:
        held = f"{box.lightest[0]:g} to {box.heaviest[0]:g} kg"
        raise InputError(f"trajectory: takeoff_mass = {takeoff_mass:g} kg: must be {held}")
    lower[start] = upper[start] = 0.0
    ranges = corridor.rotor_speed, corridor.twist
    targets = settings.nominal_rotor_speed, settings.nominal_twist
    rates = settings.rotor_speed_rate, settings.twist_rate
    for k, control in enumerate(layout.controls):
        ends = np.column_stack([control.start, control.end])
        lower[ends], upper[ends] = allowed[:, k, None, None] / control.scale
        own = ranges[k]
        if own is not None:
            low, high = (np.asarray(bound, dtype=float)[nodes] / control.scale for bound in own)
            np.maximum.at(lower, ends, low)
            np.minimum.at(upper, ends, high)
        fixed = ends[of.idle].ravel()
        if settings.ends == "pinned":
            fixed = np.append(fixed, [ends[0, 0], ends[-1, 1]])
        lower[fixed] = upper[fixed] = targets[k] / control.scale
        _check_open(of, lower[ends] - upper[ends], control.name)
        rate = rates[k]
        if rate is not None:
            lower[control.rate], upper[control.rate] = -rate / control.rate_scale, rate / control.rate_scale
    if layout.charged is not None:
        lower[layout.charged] = 0.0
    return lower, upper


def _check_open(of: Discretisation, gap: np.ndarray, name: str) -> None:
    """Raises InputError where the lower bound is above the upper by ``gap`` (N, 2)."""
    interval, end = np.unravel_index(int(np.argmax(gap)), gap.shape)
    if gap[interval, end] > 0.0:
        time = of.mesh.start[interval] + end * of.mesh.step[interval]
        where = f"at {time:.0f} s ({of.tasks[of.mesh.segment[interval]]})"
        raise InputError(f"trajectory: corridor of the {name} {where}: lower is above upper")


def row_bounds(
    labels: Labels, settings: ScheduleSettings, additions: Additions, limits: LimitBounds | None
) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of g; ``limits`` replace those the problem was built with."""
    asked = dict(limits or {})
    own = {constraint.name: constraint for constraint in (*additions.constraints, *additions.integrals)}
    accelerations = {
        "rotor speed acceleration": settings.rotor_speed_acceleration,
        "twist acceleration": settings.twist_acceleration,
    }
    lower, upper = np.zeros(len(labels.kinds)), np.zeros(len(labels.kinds))
    for k, kind in enumerate(labels.kinds):
        low: float | None = 0.0
        high: float | None = 0.0
        if kind.family == "limit":
            low, high = None, _usage(kind.name, asked.pop(kind.name, 1.0))
        elif kind.family in ("own", "integral"):
            low, high = _pair(kind.name, asked.pop(kind.name, (own[kind.name].lower, own[kind.name].upper)))
        elif kind.family == "acceleration":
            high = accelerations[kind.name]
            low = None if high is None else -high
        elif kind.family == "charged":
            high = None
        lower[k] = -np.inf if low is None else (low - kind.offset) / kind.scale
        upper[k] = np.inf if high is None else (high - kind.offset) / kind.scale
    if asked:
        known = [kind.name for kind in labels.kinds if kind.family in ("limit", "own", "integral")]
        raise InputError(f"trajectory: limits = {', '.join(asked)}: must be of {', '.join(known)}")
    low_rows, high_rows = lower[labels.kind], upper[labels.kind]
    if settings.ends == "free":  # the rates at the ends are free too: their first and last changes are no changes
        for name in accelerations:
            places = labels.where("acceleration", name)
            low_rows[places[:1]], high_rows[places[:1]] = -np.inf, np.inf
            low_rows[places[-1:]], high_rows[places[-1:]] = -np.inf, np.inf
    return low_rows, high_rows


def _usage(name: str, value: Any) -> float:
    if not is_number(value) or not value > 0.0:
        raise InputError(f"trajectory: limits {name} = {value!r}: must be a number above 0, the largest usage")
    return float(value)


def _pair(name: str, value: Any) -> tuple[float | None, float | None]:
    pair = value if isinstance(value, tuple) and len(value) == 2 else (value, value)
    ends = [end for end in pair if end is not None]
    if pair is not value or not all(map(is_number, ends)) or sorted(ends) != ends:
        raise InputError(f"trajectory: limits {name} = {value!r}: must be (lower, upper), numbers in order or None")
    return pair
