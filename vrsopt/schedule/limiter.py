"""What an aircraft could fly of a schedule that ignores rates: a causal rate limiter, with look-ahead only if it must.

The limiter follows its target as fast as the rates allow and knows of the future only where it has to be nominal again:
in idle and at the end of the mission. Arriving late can break a limit (too slow a rotor when the climb begins); then
the limiter is told the target of the next seconds, and the fewest seconds that break no limit are used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from vrsopt.schedule.refly import FlightGrid, Violation
from vrsopt.schedule.schedule import ON_LIMIT, Schedule, ScheduleSettings
from vrsopt.solvers.status import Status

LOOK_AHEADS = (1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 18.0, 27.0, 40.0, 60.0)  # s, tried in this order
CHECKED_LIMIT = 0.9 * ON_LIMIT  # the checks use the target's mass history; the flight's own differs by grams


def rate_limited_schedule(
    target: Schedule, grid: FlightGrid, *, takeoff_mass: float, settings: ScheduleSettings | None = None
) -> Schedule:
    """``target`` as it can be flown within the rates of ``settings``, at the nodes of ``grid``.

    Nominal in idle, and at both ends of the mission unless these are free. Starts without look-ahead; if a limit breaks
    that, the shortest look-ahead of LOOK_AHEADS that keeps all limits is used, with the highest, the shifted or the
    lowest rotor speed of the time ahead. ``details["look_ahead"]`` [s] and the message report it. If none helps, the
    schedule without look-ahead is returned with ``success`` false.
    """
    settings = settings or ScheduleSettings()
    mass = grid.fly(target, takeoff_mass=takeoff_mass).mass
    rotor_speed, twist = target.at(grid.segment, grid.time)

    def broken(flown: tuple[np.ndarray, np.ndarray]) -> tuple[Violation, ...]:
        limits = grid.flyable_limits(grid.evaluate(mass, *flown))
        return grid.worst(limits, above=CHECKED_LIMIT)

    causal = followed(grid, settings, rotor_speed, twist)
    result = Schedule(f"{target.name}_rate_limited", grid.segment, grid.time, *causal, details={"look_ahead": 0.0})
    violations = broken(causal)
    if not violations:
        return _judged(result, target, "")
    for look_ahead, how, ahead in _ahead(grid.time, rotor_speed, twist):
        flown = followed(grid, settings, *ahead)
        if not broken(flown):
            message = f"look-ahead of {look_ahead:g} s ({how}), because without it: {violations[0]}"
            details = {"look_ahead": look_ahead}
            result = replace(result, rotor_speed=flown[0], twist=flown[1], details=details)
            return _judged(result, target, message)
    message = f"no look-ahead up to {LOOK_AHEADS[-1]:g} s keeps the limits within the rates; without: {violations[0]}"
    return replace(result, success=False, status=Status.INFEASIBLE, message=message)


def followed(
    grid: FlightGrid, settings: ScheduleSettings, rotor_speed: np.ndarray, twist: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What a rotor can follow of a target ``rotor_speed`` [rad/s] and ``twist`` [rad] at the nodes of ``grid``, (N,)
    each, without look-ahead: nominal in idle, and at both ends of the mission unless these are free."""
    pinned = np.asarray(grid.conditions.idle).copy()
    pinned[[0, -1]] |= settings.ends != "free"
    speed_limits = settings.rotor_speed_rate, settings.rotor_speed_acceleration
    twist_limits = settings.twist_rate, settings.twist_acceleration
    return (
        _smoothly(grid.time, rotor_speed, pinned, settings.nominal_rotor_speed, *speed_limits),
        _smoothly(grid.time, twist, pinned, settings.nominal_twist, *twist_limits),
    )


def _smoothly(
    time: np.ndarray,
    target: np.ndarray,
    pinned: np.ndarray,
    nominal: float,
    rate: float | None,
    acceleration: float | None,
) -> np.ndarray:
    """Causal limiter (N,) of rate and acceleration that is nominal where ``pinned``: what the rate allows, averaged
    over the time just past that makes the acceleration of a full reversal the allowed one."""
    if rate is None or acceleration is None or rate == 0.0:
        return _follow(time, target, pinned, nominal, rate)
    width = 2.0 * rate / acceleration
    pins = np.append(time[pinned], np.inf)
    next_pin = pins[np.searchsorted(time[pinned], time)]
    ahead = next_pin - time <= width + np.max(np.diff(time))  # nominal all that time before
    value = _follow(time, target, pinned | ahead, nominal, rate)
    total = np.append(0.0, np.cumsum(0.5 * np.diff(time) * (value[1:] + value[:-1])))

    def integral(until: np.ndarray) -> np.ndarray:
        """From the start, before which nothing changes."""
        node = np.clip(np.searchsorted(time, until, side="right") - 1, 0, len(time) - 1)
        past = np.interp(until, time, value)
        return total[node] + 0.5 * (value[node] + past) * (until - time[node])

    return np.asarray((integral(time) - integral(time - width)) / width)


def _judged(result: Schedule, target: Schedule, message: str) -> Schedule:
    """A limited schedule that keeps the limits succeeds even where its target, between its nodes, does not."""
    if target.status is Status.CONVERGED or target.status is Status.INFEASIBLE:
        return replace(result, message=message)
    return replace(result, success=target.success, status=target.status, message=target.message)


def _follow(time: np.ndarray, target: np.ndarray, pinned: np.ndarray, nominal: float, rate: float | None) -> np.ndarray:
    """Causal rate limiter (N,) that is nominal where ``pinned``."""
    target = np.where(pinned, nominal, target)
    if rate is None:
        return target
    pins = np.append(time[pinned], np.inf)
    next_pin = pins[np.searchsorted(np.flatnonzero(pinned), np.arange(len(time)))]
    reach = rate * (next_pin - time) if rate > 0.0 else np.zeros(len(time))  # how far from nominal it may still be
    step = (rate * np.diff(time)).tolist()
    wanted = np.clip(target, nominal - reach, nominal + reach).tolist()
    value = wanted[:1]
    for goal, most in zip(wanted[1:], step, strict=True):
        value.append(min(max(goal, value[-1] - most), value[-1] + most))
    return np.array(value)


def _ahead(
    time: np.ndarray, rotor_speed: np.ndarray, twist: np.ndarray
) -> Iterator[tuple[float, str, tuple[np.ndarray, np.ndarray]]]:
    """Targets that anticipate: look-ahead [s], how, and rotor speed and twist (N,)."""
    for look_ahead in LOOK_AHEADS:
        end = np.searchsorted(time, time + look_ahead, side="right") - 1
        shifted = twist[end]
        yield look_ahead, "highest rotor speed ahead", (_window(rotor_speed, end, np.max), shifted)
        yield look_ahead, "highest rotor speed ahead, twist as it comes", (_window(rotor_speed, end, np.max), twist)
        yield look_ahead, "everything earlier", (rotor_speed[end], shifted)
        yield look_ahead, "lowest rotor speed ahead", (_window(rotor_speed, end, np.min), shifted)


def _window(values: np.ndarray, end: np.ndarray, choose: Callable[[np.ndarray], float]) -> np.ndarray:
    """The chosen value (N,) of ``values`` between each node and its ``end`` node."""
    return np.array([choose(values[i : stop + 1]) for i, stop in enumerate(end)])
