"""Speeds and altitudes that a mission leaves free, chosen for the least fuel of the whole mission.

They are few numbers, and all of the mission depends on them: its profile, its length, its mass. So a search without
derivatives (COBYQA: quadratic models in a trust region; Ragonneau and Zhang 2023) moves them, with the mission's fuel
inside: once flown with the nominal rotor, once with the rotor at its pointwise optimum. The latter is polished with the
fuel of the trajectory, by one step of Newton's method for each number. All missions take off with the same mass, that
of the mission as stated; distances and durations are those of the mission file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, minimize

from vrsopt.errors import InputError
from vrsopt.mission.file import Mission
from vrsopt.mission.profile import Profile
from vrsopt.mission.ranges import FreeValue, free_values, with_values
from vrsopt.schedule.mission_setup import MissionSetup
from vrsopt.schedule.nominal import nominal_schedule
from vrsopt.schedule.pointwise import pointwise_schedule
from vrsopt.schedule.refinement import refined_trajectory
from vrsopt.schedule.refly import Flight, FlightGrid
from vrsopt.schedule.schedule import ON_LIMIT, Schedule, ScheduleSettings

SEARCH_STEP = 4.0  # s, of the flights during the search; reported fuels are flown at 1 s
SCANNED = 9  # values of each number
START_RADIUS, END_RADIUS = 0.06, 2e-3  # of the ranges
POLISH_STEP = 0.04  # of the ranges
DIGITS = {"speed_m_s": 2, "altitude_m": 1}  # to which a number is chosen
UNFLYABLE = 1.0  # breach of the limits of what can not be flown, with twice the fuel of the mission as stated

Values = Mapping[FreeValue, float]
MakeSchedule = Callable[[FlightGrid], Schedule]


@dataclass(frozen=True)
class FreeFlight:
    """What was chosen. Fuels [kg] by name: ``nominal`` or ``scheduled`` rotor, ``stated`` values or its ``best`` ones.

    ``scheduled`` is the trajectory's fuel. ``mission`` is flown at ``scheduled`` values and leaves nothing free.
    """

    mission: Mission
    nominal: Values
    scheduled: Values
    fuels: Mapping[str, float]
    evaluations: int

    @property
    def notes(self) -> tuple[str, ...]:
        """What was chosen, for a report: one line for each number and one for the fuels."""
        lines = [
            f"{value} = {number:g}, free from {value.lower:g} to {value.upper:g} (stated {value.stated:g}; best with "
            f"the nominal rotor {self.nominal[value]:g})"
            for value, number in self.scheduled.items()
        ]
        fuel = {name: f"{kg:.3f} kg" for name, kg in self.fuels.items()}
        lines.append(
            f"fuel with the nominal rotor {fuel['nominal_stated']} as stated, {fuel['nominal_best']} at its best; with "
            f"the trajectory {fuel['scheduled_stated']} as stated, {fuel['scheduled_nominal']} at the nominal rotor's "
            f"best, {fuel['scheduled_best']} at its own"
        )
        return tuple(lines)

    def summary(self) -> dict[str, Any]:
        """The same figures for ``summary.json``."""
        chosen = {
            str(value): {
                "range": [value.lower, value.upper],
                "stated": value.stated,
                "nominal_rotor": self.nominal[value],
                "scheduled_rotor": number,
            }
            for value, number in self.scheduled.items()
        }
        return {"values": chosen, "fuel_kg": dict(self.fuels), "missions_flown": self.evaluations}


def free_flight(setup: MissionSetup, settings: ScheduleSettings | None = None) -> FreeFlight | None:
    """The best free speeds and altitudes of the mission of ``setup``; None if it leaves nothing free.

    Raises :class:`InputError` that names the range with an end at which the mission can not be flown.
    """
    mission = setup.mission
    free = free_values(mission.tasks) if isinstance(mission, Mission) else ()
    if not isinstance(mission, Mission) or not free:
        return None
    search = _Search(setup, mission, free, settings or setup.settings)
    nominal = search.best(search.nominal, search.scanned(search.nominal, search.stated))
    pointwise = search.best(search.pointwise, search.scanned(search.pointwise, nominal))
    scheduled = search.polished(pointwise)
    fuels = {
        "nominal_stated": search.fuel(search.nominal, search.stated),
        "nominal_best": search.fuel(search.nominal, nominal),
        "scheduled_stated": search.fuel(search.trajectory, search.stated),
        "scheduled_nominal": search.fuel(search.trajectory, nominal),
        "scheduled_best": search.fuel(search.trajectory, scheduled),
    }
    chosen, alone = (dict(zip(free, x.tolist(), strict=True)) for x in (scheduled, nominal))
    return FreeFlight(search.mission(scheduled), alone, chosen, fuels, search.flown)


class _Search:
    """Flies the mission at any of its free values, from one take-off mass."""

    def __init__(
        self, setup: MissionSetup, mission: Mission, free: tuple[FreeValue, ...], settings: ScheduleSettings
    ) -> None:
        self.setup, self.stated_mission, self.free, self.settings = setup, mission, free, settings
        self.mass, self._known = setup.loading.takeoff_mass, dict[tuple[MakeSchedule, bytes, float], Flight]()
        self.lower, self.upper = (np.array([getattr(value, end) for value in free]) for end in ("lower", "upper"))
        self.stated = np.array([value.stated for value in free])
        self._check_ends()

    def mission(self, x: np.ndarray) -> Mission:
        """The mission at values ``x`` (n,), with nothing left free."""
        values = dict(zip(self.free, x.tolist(), strict=True))
        return self.stated_mission.model_copy(update={"tasks": with_values(self.stated_mission.tasks, values)})

    def _check_ends(self) -> None:
        for k, value in enumerate(self.free):
            for end in (value.lower, value.upper):
                x = self.stated.copy()
                x[k] = end
                try:
                    self._grid(x, 60.0)
                except InputError as error:
                    reason = str(error).removeprefix(f"{self.stated_mission.name}: ")
                    raise InputError(f"{value} = {end:g}, an end of its range: {reason}") from None

    def _grid(self, x: np.ndarray, step: float) -> FlightGrid:
        return FlightGrid(Profile.of(self.mission(x)), self.setup.make, step=step, settings=self.settings)

    def nominal(self, grid: FlightGrid) -> Schedule:
        """Rotor speed and twist held."""
        return nominal_schedule(grid.profile, self.settings)

    def pointwise(self, grid: FlightGrid) -> Schedule:
        """The optimum of every step by itself."""
        own: dict[str, Any] = {"takeoff_mass": self.mass, "settings": self.settings}
        return pointwise_schedule(grid.profile, self.setup.make, method="batched", grid=grid, **own)

    def trajectory(self, grid: FlightGrid) -> Schedule:
        """The optimum of the whole mission."""
        return refined_trajectory(grid, self.setup.make, takeoff_mass=self.mass, settings=self.settings).schedule

    def flight(self, make: MakeSchedule, x: np.ndarray, step: float) -> Flight:
        """The mission at values ``x`` (n,), flown from the take-off mass with the schedule that ``make`` makes."""
        key = make, x.tobytes(), step
        if key not in self._known:
            grid = self._grid(x, step)
            self._known[key] = grid.fly(make(grid), takeoff_mass=self.mass)
        return self._known[key]

    @property
    def flown(self) -> int:
        """How many missions were flown."""
        return len(self._known)

    def fuel(self, make: MakeSchedule, x: np.ndarray) -> float:
        """Fuel [kg] of the mission flown at values ``x`` (n,) on the grid of all comparisons."""
        return self.flight(make, x, 1.0).fuel

    def scanned(self, make: MakeSchedule, start: np.ndarray) -> np.ndarray:
        """Values (n,) moved one after the other from ``start`` to the best of SCANNED.

        A pattern ends wherever its time is over, so the way home, and with it the fuel, goes up and down with speed:
        a search without a scan stays in the nearest hollow.
        """
        best = start
        for k, (low, high) in enumerate(zip(self.lower, self.upper, strict=True)):
            there = np.arange(len(best)) == k
            tried = [best, *(np.where(there, value, best) for value in np.linspace(low, high, SCANNED))]
            best = min(tried, key=lambda x: self._merit(make, x))
        return best

    def _merit(self, make: MakeSchedule, x: np.ndarray) -> float:
        """Fuel [kg] where no limit is broken further than by the mission as stated, else infinite."""
        figures, stated = self._figures(make, x), self._figures(make, self.stated)
        allowed = np.all(figures[1:] <= np.maximum(stated[1:], 0.0) + ON_LIMIT)
        return float(figures[0]) if allowed else np.inf

    def best(self, make: MakeSchedule, start: np.ndarray) -> np.ndarray:
        """Values (n,) of least fuel near ``start`` that break no limit by more than the mission does as stated.

        ``start`` itself, or the mission as stated, if these are better.
        """
        stated = self._figures(make, self.stated)

        def figures(z: np.ndarray) -> np.ndarray:
            return self._figures(make, self._values(z))

        found = minimize(
            lambda z: figures(z)[0] / stated[0],
            (start - self.lower) / (self.upper - self.lower),
            method="COBYQA",
            bounds=Bounds(0.0, 1.0, keep_feasible=True),
            constraints=NonlinearConstraint(lambda z: figures(z)[1:] - np.maximum(stated[1:], 0.0), -np.inf, 0.0),
            options={"initial_tr_radius": START_RADIUS, "final_tr_radius": END_RADIUS, "feasibility_tol": ON_LIMIT},
        )
        ends = [self.stated, start, self._rounded(self._values(found.x))]
        return min(ends, key=lambda x: self._merit(make, x))

    def _values(self, z: np.ndarray) -> np.ndarray:
        return self.lower + np.clip(z, 0.0, 1.0) * (self.upper - self.lower)

    def _figures(self, make: MakeSchedule, x: np.ndarray) -> np.ndarray:
        """Fuel [kg] and the largest breach of each limit (1 + m,); far too much where the mission can not be flown."""
        try:
            flight = self.flight(make, x, SEARCH_STEP)
        except InputError:
            names = self.setup.grid.model.limit_names
            return np.append(2.0 * self.setup.loading.fuel_burned, np.full(len(names), UNFLYABLE))
        return np.append(flight.fuel, np.max(flight.limits, axis=1))

    def _rounded(self, x: np.ndarray) -> np.ndarray:
        """To the digits a number is chosen to, within its range."""
        digits = [DIGITS[value.field] for value in self.free]
        near = np.array([round(number, n) for number, n in zip(x.tolist(), digits, strict=True)])
        return np.clip(near, self.lower, self.upper)

    def polished(self, x: np.ndarray) -> np.ndarray:
        """Values (n,) near ``x`` of less trajectory fuel, if there are: the minimum of a parabola in each of them.

        A value next to an end of its range or to what can not be flown stays as it is, and so do all if the fuel does
        not fall or a limit breaks.
        """
        centre = self._trajectory_fuel(x)
        step = POLISH_STEP * (self.upper - self.lower)
        inside = (x - step >= self.lower) & (x + step <= self.upper)
        better = x.copy()
        for k in np.flatnonzero(inside):
            offset = np.where(np.arange(len(x)) == k, step, 0.0)
            below, above = (self._trajectory_fuel(x + sign * offset) for sign in (-1.0, 1.0))
            curvature = below - 2.0 * centre + above
            if np.isfinite(curvature) and curvature > 0.0:
                better[k] += step[k] * np.clip(0.5 * (below - above) / curvature, -1.0, 1.0)
        better = self._rounded(better)
        return better if self._trajectory_fuel(better) < centre else x

    def _trajectory_fuel(self, x: np.ndarray) -> float:
        """Fuel [kg] of the trajectory at values ``x`` (n,), infinite where it breaks a limit or can not be flown."""
        try:
            flight = self.flight(self.trajectory, x, 1.0)
        except InputError:
            return np.inf
        return flight.fuel if flight.success else np.inf
