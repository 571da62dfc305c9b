"""Engines at ground idle: a state of the gas generator, whatever the schedule says."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from vrsopt.errors import NoSolutionError
from vrsopt.residual import Solution
from vrsopt.surrogate.emission_table import flows_of_fits
from vrsopt.turboshaft.data import EngineData
from vrsopt.turboshaft.operating_range import maximum_power

RATING = "ground_idle"


def ground_idle(engine: EngineData, *, altitude: float, isa_offset: float = 0.0) -> Solution:
    """Gas path of one engine at its rating for ground idle, with the speeds of gas generator and power turbine that the
    rating gives, at rest at a pressure altitude [m].

    Raises :class:`InputError` for an engine without that rating and :class:`NoSolutionError` where it can not be run.
    """
    return _ground_idle(engine.model_dump_json(), altitude, isa_offset)


def ground_idle_emissions(engine: EngineData, *, altitude: float, isa_offset: float = 0.0) -> Mapping[str, float]:
    """Emission indices [kg/kg] at :func:`ground_idle` by name, from the combustor itself; raises what that raises, and
    :class:`NoSolutionError` where the combustor can not be solved."""
    return _indices(engine.model_dump_json(), altitude, isa_offset)


@lru_cache(maxsize=256)
def _ground_idle(text: str, altitude: float, isa_offset: float) -> Solution:
    data = EngineData.model_validate_json(text)
    idle = maximum_power(rating=RATING, engine_data=data, altitude=altitude, isa_offset=isa_offset)
    if not idle.success:
        raise NoSolutionError(f"ground idle at {altitude:g} m: {idle.message}")
    return idle.solution


@lru_cache(maxsize=256)
def _indices(text: str, altitude: float, isa_offset: float) -> Mapping[str, float]:
    data = EngineData.model_validate_json(text)
    outputs = _ground_idle(text, altitude, isa_offset).outputs
    flows = flows_of_fits(data, {name: np.array([value]) for name, value in outputs.items()})
    indices = {name: float(flow[0]) / outputs["fuel_flow"] for name, flow in flows.items()}
    if not np.all(np.isfinite(list(indices.values()))):
        raise NoSolutionError(f"ground idle at {altitude:g} m: combustor not solved")
    return indices
