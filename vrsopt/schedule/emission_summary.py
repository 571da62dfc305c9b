"""Emissions as figures of ``summary.json``: by schedule, by phase, and FOCA's independent estimate beside them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from vrsopt import foca
from vrsopt.aircraft import Aircraft
from vrsopt.combustor.emissions import fit_range
from vrsopt.mission.profile import Profile
from vrsopt.mission.segment import ON_THE_GROUND
from vrsopt.schedule.emissions import nox_fits, phases
from vrsopt.turboshaft.data import EngineData

if TYPE_CHECKING:
    from vrsopt.schedule.comparison import ScheduleResult


def emission_figures(profile: Profile, result: ScheduleResult) -> dict[str, Any]:
    """Emissions of one schedule, on the surrogate and on the physics, with changes against the nominal schedule.

    NOx comes with its range over the fits of the combustor; a range of changes is that of each fit's own change.
    """
    own, physics = result.emissions, result.physics.emissions
    figures: dict[str, Any] = {
        "co2_kg": own.total("co2"),
        "nox_kg": own.total("nox"),
        "nox_range_kg": own.nox_range,
        "co_kg": own.total("co"),
        **_changes("", result.changes),
        "nox_quadrature_error_kg": own.quadrature_error["nox"],
        "foca_nox_kg": own.total("foca_nox"),
        "foca_co_kg": own.total("foca_co"),
    }
    for name in ("co2", "nox", "co"):
        figures[f"{name}_physics_kg"] = physics.total(name) if physics else math.nan
    figures["nox_physics_range_kg"] = physics.nox_range if physics else (math.nan, math.nan)
    figures["nox_physics_quadrature_error_kg"] = physics.quadrature_error["nox"] if physics else math.nan
    figures |= _changes("physics_", result.physics_changes)
    figures["phases"] = {
        name: {
            "duration_s": phase.duration,
            "fuel_kg": phase.fuel,
            "co2_kg": phase.co2,
            "nox_kg": phase.nox,
            "nox_range_kg": phase.nox_range,
            "co_kg": phase.co,
        }
        for name, phase in phases(profile, result.flight.fuel_per_segment, own).items()
    }
    return {name: _finite(value) for name, value in figures.items()}


def foca_summary(profile: Profile, aircraft: Aircraft, engine: EngineData) -> dict[str, Any]:
    """FOCA's estimates for this aircraft and a mission of this length, whatever is flown in it."""
    cycle, whole, landings = foca_estimates(profile, aircraft, engine)
    return {
        "note": foca.NOTE,
        "landings": landings,
        "landing_take_off": _estimate(cycle),
        "mission": _estimate(whole),
    }


def foca_estimates(
    profile: Profile, aircraft: Aircraft, engine: EngineData
) -> tuple[foca.Estimate, foca.Estimate, int]:
    """One landing and take-off cycle, the mission, and its number of landings: flights between stops on the ground."""
    flying = np.array([segment.kind not in ON_THE_GROUND for segment in profile.segments])
    landings = int(np.sum(flying[1:] & ~flying[:-1]) + flying[0])
    rating, engines = engine.ratings.take_off_power, aircraft.transmission.engines
    mass = aircraft.loading.largest_mass
    return (
        foca.landing_take_off(rating, engines, takeoff_mass=mass),
        foca.mission(profile.duration, rating, engines, takeoff_mass=mass, landings=landings),
        landings,
    )


def _changes(prefix: str, changes: Any) -> dict[str, Any]:
    """Changes of one column: of CO2, NOx with its range over the fits, and CO."""
    if not changes:
        unknown = {f"{name}_{prefix}delta_percent": math.nan for name in ("co2", "nox", "co")}
        return unknown | {f"nox_{prefix}delta_range_percent": (math.nan, math.nan)}
    return {
        **{f"{name}_{prefix}delta_percent": changes[name] for name in ("co2", "nox", "co")},
        f"nox_{prefix}delta_range_percent": fit_range(changes[name] for name in nox_fits(changes)),
    }


def _estimate(estimate: foca.Estimate) -> dict[str, dict[str, float]]:
    return {
        mode.name.replace(" ", "_").replace("-", "_"): {
            "duration_s": mode.duration,
            "power_per_engine_w": mode.power,
            **{f"{name}_kg": getattr(mode, name) for name in foca.MASSES},
        }
        for mode in (*estimate.modes, estimate.total)
    }


def _finite(value: Any) -> Any:
    """The value for JSON, which knows no nan; a range as a list."""
    if isinstance(value, Iterable) and not isinstance(value, dict):
        return [_finite(part) for part in value]
    if isinstance(value, dict):
        return {name: _finite(part) for name, part in value.items()}
    return value if math.isfinite(value) else None
