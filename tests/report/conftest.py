"""One short mission, made by hand, for all tests of the reports."""

import math
from dataclasses import replace

import pytest

from tests.report.synthetic import BREEZE, HOP_PLACES, compare, hop
from vrsopt.schedule.refly import Violation

NAME = "Hop <über>"


@pytest.fixture(scope="session")
def mission_text():
    return 'name = "Hop <über>"\nstart = "base"  # & so on\n'


@pytest.fixture(scope="session")
def comparison():
    return compare(hop(), NAME, HOP_PLACES)


@pytest.fixture(scope="session")
def windy():
    """The same mission over the ground in a wind from the west-south-west, with the schedules that matter most."""
    return compare(hop(BREEZE), NAME, HOP_PLACES, schedules=["nominal", "trajectory"])


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
def with_variant(comparison):
    """A comparison with one variant, that of twist alone."""
    twist = compare(hop(), NAME, HOP_PLACES, schedules=["nominal", "trajectory"], variables="twist")
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
