"""A solution of the whole-mission problem and the power of a flight on the physics, made by hand."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from vrsopt.mission.profile import Profile
from vrsopt.schedule.mesh import Mesh
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.shaft_power import PARTS, ShaftPower
from vrsopt.schedule.trajectory_solution import Arc
from vrsopt.solvers.status import Status

NOMINAL = ScheduleSettings().nominal_rotor_speed


def made_solution(profile: Profile, fuel: float) -> Any:
    """What a report asks of a trajectory: two intervals, in the first cruise with a limit active."""
    kinds = [segment.kind for segment in profile.segments]
    cruise = profile.segments[kinds.index("cruise")]
    start = cruise.start
    return SimpleNamespace(
        fuel=fuel,
        iterations=17,
        rounds=2,
        build_s=1.5,
        solve_s=2.5,
        max_residual=1e-9,
        mesh=Mesh(np.array([0, kinds.index("cruise")]), np.array([0.0, start]), np.array([20.0, 60.0])),
        mesh_error=np.array([1e-6, -3e-6]),
        transcription="hermite_simpson",
        regularisation=4e-6,
        arcs=(Arc(0.0, 20.0, "idle at base", ()), Arc(start, start + 60.0, cruise.task, ("blade loading",))),
        integral_multipliers={"mission NOx": -0.25},
        status=Status.CONVERGED,
        message="optimal to 1e-8",
    )


def made_shaft_power(flight: Any, fuel_flow: np.ndarray) -> ShaftPower:
    """Profile power by the cube of the rotor speed, and all the rest of the power as induced; ``fuel_flow`` (N, 2)."""
    ratio, total = flight.rotor_speed / NOMINAL, 2.0 * flight.power_per_engine
    profile = np.where(np.isfinite(flight.limits[0]), 95e3 * ratio**3, 0.0)
    parts = np.zeros((len(PARTS), len(total), 2))
    parts[PARTS.index("profile")] = profile[:, None]
    parts[PARTS.index("induced")] = (total - profile)[:, None]
    return ShaftPower(parts, fuel_flow, np.repeat(ratio[:, None], 2, axis=1))
