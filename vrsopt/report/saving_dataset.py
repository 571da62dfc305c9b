"""Where power goes and what saves fuel as variables of a data set: on the physics, over time and by segment."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from vrsopt.schedule.saving import CAUSES, savings
from vrsopt.schedule.shaft_power import PARTS

if TYPE_CHECKING:
    from vrsopt.schedule.comparison import Comparison


def saving_variables(comparison: Comparison) -> dict[str, tuple[Any, Any, dict[str, str]]]:
    """Variables by name: dimensions, values, attributes. Not a number where a schedule was not solved on the physics;
    the nominal schedule saves nothing against itself."""
    powers = [result.physics.shaft_power for result in comparison.results.values()]
    nodes = len(next(iter(comparison.results.values())).physics.time)
    nothing = np.full((len(PARTS), nodes), math.nan)
    saved = savings(comparison.profile, comparison.limits, comparison.results)
    unknown = np.full((len(CAUSES), len(comparison.profile.segments)), math.nan)
    causes = {name: saved[name].causes if name in saved else unknown for name in comparison.results}
    causes["nominal"] = 0.0 * unknown if powers[0] is None else np.zeros_like(unknown)
    return {
        "part": ("part", np.array(PARTS), {"long_name": "where the engines' power goes"}),
        "cause": ("cause", np.array(CAUSES), {"long_name": "what saves fuel"}),
        "physics_shaft_power": (
            ("schedule", "part", "physics_node"),
            np.array([nothing if power is None else power.parts.mean(axis=2) for power in powers]),
            {"units": "W", "long_name": "shaft power of all engines by where it goes, on the physics"},
        ),
        "saving": (
            ("schedule", "cause", "segment"),
            np.array(list(causes.values())),
            {"units": "kg", "long_name": "fuel saved against the nominal schedule by cause, on the physics"},
        ),
    }
