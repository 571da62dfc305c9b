"""What comes out of a comparison of schedules: each schedule flown twice, and the figures of the summary."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.mission.file import Mission
from vrsopt.mission.loading import TakeoffLoading
from vrsopt.mission.profile import Profile
from vrsopt.mission.track import FlownMission
from vrsopt.schedule.advantage import advantage
from vrsopt.schedule.consistent import Consistent
from vrsopt.schedule.emission_summary import emission_figures, foca_summary
from vrsopt.schedule.emissions import NOTE, Emitted
from vrsopt.schedule.free_flight import FreeFlight
from vrsopt.schedule.refly import Flight
from vrsopt.schedule.resimulation import resimulation_error
from vrsopt.schedule.rotor_energy import RotorEnergy
from vrsopt.schedule.saving import savings
from vrsopt.schedule.schedule import Schedule, ScheduleSettings
from vrsopt.schedule.task_summary import task_figures
from vrsopt.schedule.trajectory import Trajectory
from vrsopt.schedule.verify import PhysicsFlight

SIMPLIFICATIONS = (
    "flight is quasi-steady: what speeds up or turns flies as the steady flight with the same forces; turns are load "
    "factors on the surrogate, turns in the physics; the wind is steady"
)


@dataclass(frozen=True)
class Band:
    """Rotor speeds [rad/s] within 0.5 % of the least fuel flow, lower and upper (N,), at the decision nodes."""

    segment: np.ndarray
    time: np.ndarray  # s
    lower: np.ndarray
    upper: np.ndarray


@dataclass(frozen=True)
class ScheduleResult:
    """One schedule, flown on the surrogate and on the physics; deltas in per cent against the nominal schedule.

    ``fuel_delta_closed``: with the take-off mass closed again, so that the fuel saved need not be carried.
    ``emissions``: of ``flight``; ``changes`` of them by name, and those on the physics, empty if that was not solved.
    ``energy``: of the rotor; ``active``: what holds the schedule, by name the share of the mission's time.
    ``reliance``: what the flight relies on in the surrogate's design (see :mod:`vrsopt.schedule.reliance`), None if it
    was not asked for. ``corrected``: the schedule was found with the physics' own values of limits and fuel.
    """

    schedule: Schedule
    flight: Flight
    physics: PhysicsFlight
    emissions: Emitted
    fuel_delta_percent: float
    fuel_delta_closed_percent: float
    fuel_physics_delta_percent: float
    changes: Mapping[str, float]
    physics_changes: Mapping[str, float]
    energy: RotorEnergy
    active: Mapping[str, float]
    reliance: xr.Dataset | None = field(default=None, repr=False)
    corrected: bool = False

    @property
    def failed(self) -> tuple[Flight | PhysicsFlight, ...]:
        """The flights that failed. Of a corrected schedule, limits of the aircraft count on the physics alone."""
        breaks = {violation.limit for violation in self.flight.violations}
        excused = self.corrected and self.schedule.success and breaks <= set(LIMIT_NAMES)
        judged = (self.physics,) if excused else (self.flight, self.physics)
        return tuple(flight for flight in judged if not flight.success)

    @property
    def success(self) -> bool:
        """Within all limits on the surrogate, solved and within the limits on the physics."""
        return not self.failed

    @property
    def message(self) -> str:
        """What is wrong; without anything wrong, what is worth knowing."""
        wrong = [flight.message for flight in self.failed]
        known = self.flight.message if self.flight.success else f"on the surrogate alone: {self.flight.message}"
        poor_data = self.reliance.attrs["poor_data"] if self.reliance is not None else ""
        return "; ".join(filter(None, [*dict.fromkeys(wrong or [known]), poor_data]))

    @property
    def surrogate_std_percent(self) -> float:
        """Largest predicted standard deviation of the rotors' power along the flight, per cent; nan if not asked."""
        return math.nan if self.reliance is None else float(self.reliance.attrs["largest_std_percent"])


@dataclass(frozen=True)
class Comparison:
    """A mission flown with several schedules.

    ``profile``: the flight on its time grid; ``settings`` and ``limits``: what schedules may do, and the aircraft's
    limits; ``loading``: masses; ``results``: flights and accounts by the name of the schedule; ``band``: rotor speeds
    within 0.5 % of the least fuel; ``variants``: comparisons with fewer variables free, by name; ``provenance``:
    versions, hashes, seeds and what was asked for.
    ``trajectory`` and ``consistent``: the solutions of the schedules of these names; ``free``: how speeds and altitudes
    that the mission leaves free were chosen; ``steps``: how long each step took [s].
    """

    mission: Mission | FlownMission
    profile: Profile
    settings: ScheduleSettings
    limits: Limits
    loading: TakeoffLoading
    results: Mapping[str, ScheduleResult]
    band: Band
    trajectory: Trajectory | None
    provenance: Mapping[str, Any]
    consistent: Consistent | None = None
    free: FreeFlight | None = None
    steps: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    variants: Mapping[str, Comparison] = field(default_factory=dict)

    @property
    def success(self) -> bool:
        """Whether every schedule succeeded."""
        own = all(result.success for result in self.results.values())
        return own and all(variant.success for variant in self.variants.values())

    @property
    def notes(self) -> tuple[str, ...]:
        """What was changed or chosen to make the mission what was flown."""
        return (*self.mission.notes, *(self.free.notes if self.free else ()))

    def summary(self) -> dict[str, Any]:
        """The figures of ``summary.json``."""
        schedules = {name: self._figures(result) for name, result in self.results.items()}
        for name, saved in savings(self.profile, self.limits, self.results).items():
            schedules[name]["saving_physics"] = saved.as_dict()
        content: dict[str, Any] = {
            "mission": self.mission.name,
            "takeoff_mass_kg": self.loading.takeoff_mass,
            "reserve_kg": _number(self.loading.reserve_fuel),
            "duration_s": self.profile.duration,
            "isa_offset_k": self.profile.isa_offset,
            "wind": self.profile.wind.as_dict(),
            "success": self.success,
            "simplifications": SIMPLIFICATIONS,
            "emissions_note": NOTE,
            "schedules": schedules,
            "tasks": task_figures(self.profile, self.results),
            "foca": foca_summary(self.profile, self.limits.aircraft, self.limits.engine),
        }
        if self.notes:
            content["notes"] = list(self.notes)
        if self.free is not None:
            content["free_flight"] = self.free.summary()
        gained = advantage(self.results)
        if gained is not None:
            content["advantage"] = gained.as_dict()
        if "prescribed" in self.results:
            content["prescribed_difference_percent"] = self._prescribed_difference()
        if self.trajectory is not None:
            error = resimulation_error(self.trajectory, self.results["trajectory"].flight)
            content["solver"] = {
                "iterations": self.trajectory.iterations,
                "build_s": self.trajectory.build_s,
                "solve_s": self.trajectory.solve_s,
                "resimulation_error": error,
            }
        if self.consistent is not None:
            content["consistent"] = self._consistency(self.consistent)
        if self.steps:
            content["steps"] = {name: dict(times) for name, times in self.steps.items()}
        return content | {name: variant.summary() for name, variant in self.variants.items()}

    def _figures(self, result: ScheduleResult) -> dict[str, Any]:
        nominal = self.settings.nominal_rotor_speed
        rate = 100 * result.flight.max_rotor_speed_rate / nominal
        twist_rate = math.degrees(result.flight.max_twist_rate)
        return {
            "fuel_kg": result.flight.fuel,
            "fuel_delta_percent": result.fuel_delta_percent,
            "fuel_delta_closed_percent": _number(result.fuel_delta_closed_percent),
            "fuel_physics_kg": _number(result.physics.fuel),
            "fuel_physics_delta_percent": _number(result.fuel_physics_delta_percent),
            "fuel_physics_quadrature_error_kg": _number(result.physics.quadrature_error),
            "max_rotor_speed_rate_percent_s": _number(rate),
            "max_twist_rate_deg_s": _number(twist_rate),
            "surrogate_std_percent": _number(result.surrogate_std_percent),
            "physics_largest_usage_percent": self._usage(result.physics),
            "max_rotor_speed_acceleration_percent_s2": _number(
                100 * result.flight.max_rotor_speed_acceleration / nominal
            ),
            "time_on_limits_percent": {name: 100 * share for name, share in result.flight.time_on_limits.items()},
            "active_limits_percent": {name: 100 * share for name, share in result.active.items()},
            "rotor_energy_kj": {
                "charged": 1e-3 * result.energy.charged,
                "credited": 1e-3 * result.energy.credited,
                "jumped": 1e-3 * result.energy.jumped,
                "end_minus_start": 1e-3 * result.energy.end_minus_start,
            },
            "rotor_energy_fuel_kg": result.energy.fuel,
            **emission_figures(self.profile, result),
            "success": result.success,
            "message": result.message,
        }

    def _prescribed_difference(self) -> dict[str, float | None]:
        """Fuel with the prescribed climb and descent over that with the modelled ones, per cent more."""
        own, base = self.results["prescribed"], self.results["pointwise"]
        return {
            "surrogate": 100 * (own.flight.fuel / base.flight.fuel - 1),
            "physics": _number(100 * (own.physics.fuel / base.physics.fuel - 1)),
        }

    @staticmethod
    def _consistency(found: Consistent) -> dict[str, Any]:
        """How well the consistent trajectory is one of the physics."""
        last = found.optimality
        return {
            "solves": len(found.history),
            "trims": found.trims,
            "derivatives": found.derivatives,
            "fuel_physics_kg": found.fuel_physics,
            "problem_against_physics_percent": 100 * (found.trajectory.fuel / found.fuel_physics - 1),
            "stationarity_kg": last.stationarity,
            "at_stake_kg": last.at_stake,
            "largest_excess_percent": 100 * last.excess,
            "message": found.message,
        }

    @staticmethod
    def _usage(physics: PhysicsFlight) -> dict[str, float | None]:
        """Largest use of each limit on the physics, per cent; 100 is on the limit."""
        usages = np.nan_to_num(physics.usages, nan=0.0).max(axis=1)
        return {name: _number(100 * float(usage)) for name, usage in zip(LIMIT_NAMES, usages, strict=True)}


def _number(value: float) -> float | None:
    """The value for JSON, which knows no infinity and no nan."""
    return value if math.isfinite(value) else None
