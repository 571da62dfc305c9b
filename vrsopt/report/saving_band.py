"""How sure a saving is: what the study of uncertainty found for a mission, all assumed numbers drawn."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vrsopt.mission.file import Mission
    from vrsopt.schedule.comparison import Comparison

BANDS = "saving_bands.json"  # in vrsopt/data, written by problems/uncertainty.py
SAME_SAVING = 0.05  # points between the saving that was studied and one for which the band is quoted


def mission_hash(mission: Mission) -> str:
    """SHA-256 of all that a mission file says, whatever its layout; defaults included."""
    text = json.dumps(mission.model_dump(mode="json"), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


@cache
def known_bands() -> dict[str, Any]:
    """Bands of the missions studied, with the model and the data that they hold for."""
    return dict(json.loads((resources.files("vrsopt") / "data" / BANDS).read_text(encoding="utf-8")))


def saving_band(comparison: Comparison, name: str) -> list[float] | None:
    """5th, 50th and 95th percentile of the fuel [%] that the schedule ``name`` saves on the physics.

    None where nobody studied it: bands are known of the trajectories of least fuel of three missions, for one model and
    one set of data. One that saves another share, by another surrogate for instance, is not the one that was studied.
    """
    from vrsopt.mission.file import Mission

    known, record = known_bands(), comparison.provenance
    wanted = {"variables": "both", "objective": "fuel", **{key: known[key] for key in ("model_version", "data_hash")}}
    same = name == "trajectory" and all(record.get(key) == value for key, value in wanted.items())
    if not same or not isinstance(comparison.mission, Mission):
        return None
    found = known["missions"].get(mission_hash(comparison.mission))
    saved = -comparison.results[name].fuel_physics_delta_percent
    if found is None or not abs(saved - found["shipped_percent"]) <= SAME_SAVING:
        return None
    return list(found["saving_percent"])


def band_sentence(comparison: Comparison, name: str) -> str:
    """How sure the saving of the schedule ``name`` is, or what is known of others where nobody studied this one."""
    known = known_bands()
    how = f"every assumed number drawn over its range, {known['samples']} samples, {known['command']}"
    band = saving_band(comparison, name)
    if band is not None:
        low, middle, high = band
        share = f"90 % of the samples save {low:.1f} to {high:.1f} %, half less than {middle:.1f} %"
        return f"How sure that is: {share} ({how})."
    missions = known["missions"].values()
    below = max(one["shipped_percent"] - one["saving_percent"][0] for one in missions)
    above = max(one["saving_percent"][-1] - one["shipped_percent"] for one in missions)
    names = ", ".join(one["name"] for one in missions)
    return (
        f"How sure that is was not studied for this schedule. For {names}, 90 % of the samples lie between {below:.1f} "
        f"points below and {above:.1f} above the stated saving ({how})."
    )
