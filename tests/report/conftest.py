"""One short mission, solved once for all tests of the reports."""

import math
from dataclasses import replace

import pytest

from vrsopt.schedule.compare import solve
from vrsopt.schedule.refly import Violation

MISSION = """
name = "Hop <über>"
aircraft = "bo105"
start = "base"

[places.base]
latitude_deg = 37.6
longitude_deg = -122.4
elevation_m = 0.0

[places.quay]
latitude_deg = 37.66
longitude_deg = -122.4
elevation_m = 0.0

[loading]
empty_kg = 1300.0
crew_kg = 400.0

[[tasks]]
kind = "hover"
duration_s = 40.0
height_m = 20.0

[[tasks]]
kind = "climb"
altitude_m = 100.0
speed_m_s = 40.0
climb_angle_deg = 7.12

[[tasks]]
kind = "cruise"
to = "quay"
speed_m_s = 48.0

[[tasks]]
kind = "descent"
speed_m_s = 40.0
climb_angle_deg = -7.12

[[tasks]]
kind = "hover"
duration_s = 40.0
height_m = 20.0
"""


@pytest.fixture(scope="session")
def mission_text():
    return MISSION


@pytest.fixture(scope="session")
def mission_path(tmp_path_factory):
    path = tmp_path_factory.mktemp("mission") / "hop.toml"
    path.write_text(MISSION, encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def comparison(mission_path):
    return solve(mission_path, workers=1)


@pytest.fixture(scope="session")
def broken(comparison):
    """The same comparison, had the pointwise schedule broken a limit and the trajectory not been flown at all."""
    pointwise, trajectory = comparison.results["pointwise"], comparison.results["trajectory"]
    violation = Violation("torque", "cruise to quay", 90.0, 0.042)
    breaking = replace(pointwise.flight, success=False, violations=(violation,), message=str(violation))
    lost = replace(trajectory.physics, success=False, fuel=math.nan, message="no physics at 3 s (hover): no trim")
    results = {
        **comparison.results,
        "pointwise": replace(pointwise, flight=breaking),
        "trajectory": replace(trajectory, physics=lost, fuel_physics_delta_percent=math.nan),
    }
    return replace(comparison, results=results)


@pytest.fixture(scope="session")
def with_variant(comparison, mission_path):
    """A comparison with one variant, that of twist alone."""
    twist = solve(mission_path, schedules=("nominal", "trajectory"), variables="twist", workers=1)
    return replace(comparison, variants={"twist_only": twist})


@pytest.fixture(scope="session")
def two_fits(comparison):
    """The same comparison, had the combustor just one other fit: a fifth more NOx, and 2 % less of it saved."""

    def with_other(emitted):
        return replace(
            emitted,
            flow=emitted.flow | {"nox_other": 1.2 * emitted.flow["nox"]},
            per_segment=emitted.per_segment | {"nox_other": 1.2 * emitted.per_segment["nox"]},
        )

    def only(emitted):
        """Without other fits that the engine's file may have."""
        kept = [name for name in emitted.per_segment if not name.startswith("nox_")]
        return replace(
            emitted,
            flow={name: emitted.flow[name] for name in kept},
            per_segment={name: emitted.per_segment[name] for name in kept},
        )

    results = {}
    for name, result in comparison.results.items():
        own = {key: value for key, value in result.changes.items() if not key.startswith("nox_")}
        changes = own | {"nox_other": result.changes["nox"] + (0.0 if name == "nominal" else 2.0)}
        results[name] = replace(result, emissions=with_other(only(result.emissions)), changes=changes)
    return replace(comparison, results=results)
