"""Emissions of a comparison as variables of its data set: flows over time, totals, and each phase of the mission."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from vrsopt.schedule.emissions import PHASES, phases

if TYPE_CHECKING:
    from vrsopt.schedule.comparison import Comparison
    from vrsopt.schedule.emissions import Emitted

NAMES = {"co2": "carbon dioxide", "nox": "nitrogen oxides as NO2", "co": "carbon monoxide"}
FOCA = {"foca_nox": "nitrogen oxides by FOCA's indices", "foca_co": "carbon monoxide by FOCA's indices"}
RANGE = "least and largest over the fits of the combustor"


def emission_variables(comparison: Comparison) -> dict[str, tuple[Any, Any, dict[str, str]]]:
    """Variables by name: dimensions, values, attributes. Flows of all engines are those of the fine grid's ``node``."""
    results = list(comparison.results.values())
    own = [result.emissions for result in results]
    physics = [result.physics.emissions for result in results]
    fits = [name for name in own[0].flow if name.startswith("nox_")]
    variables: dict[str, tuple[Any, Any, dict[str, str]]] = {
        "phase": ("phase", np.array(PHASES), {"long_name": "phase of the mission; a search counts as loiter"}),
        "end": ("end", np.array(["least", "largest"]), {"long_name": "end of a range"}),
        "nox_range": (("schedule", "end"), np.array([one.nox_range for one in own]), _attrs("kg", RANGE)),
        "physics_nox_range": (
            ("schedule", "end"),
            np.array([one.nox_range if one else (math.nan, math.nan) for one in physics]),
            _attrs("kg", f"nitrogen oxides on the physics, {RANGE}"),
        ),
        "physics_nox_quadrature_error": (
            "schedule",
            np.array([one.quadrature_error["nox"] if one else math.nan for one in physics]),
            _attrs("kg", "error of the nitrogen oxides on the physics"),
        ),
    }
    others = {name: f"nitrogen oxides with the fit {name.removeprefix('nox_')}" for name in fits}
    for name, text in {**NAMES, **others, **FOCA}.items():
        flow = np.array([one.flow[name] for one in own])
        variables[f"{name}_flow"] = (("schedule", "node"), flow, _attrs("kg/s", f"{text}, all engines"))
        variables[name] = ("schedule", np.array([one.total(name) for one in own]), _attrs("kg", text))
    nothing = np.full(len(results[0].physics.time), math.nan)
    for name, text in {**NAMES, **others}.items():
        flow = np.array([one.flow[name] if one else nothing for one in physics])
        known = _attrs("kg/s", f"{text}, all engines, on the physics")
        variables[f"physics_{name}_flow"] = (("schedule", "physics_node"), flow, known)
        variables[f"physics_{name}"] = (
            "schedule",
            np.array([_total(one, name) for one in physics]),
            _attrs("kg", f"{text}, on the physics"),
        )
    return variables | _phases(comparison)


def _phases(comparison: Comparison) -> dict[str, tuple[Any, Any, dict[str, str]]]:
    """Duration, fuel and emissions of every phase."""
    flown = [
        phases(comparison.profile, result.flight.fuel_per_segment, result.emissions)
        for result in comparison.results.values()
    ]
    each = ("schedule", "phase")
    variables: dict[str, tuple[Any, Any, dict[str, str]]] = {
        "phase_duration": (
            "phase",
            np.array([phase.duration for phase in flown[0].values()]),
            _attrs("s", "time in the phase"),
        ),
        "phase_nox_range": (
            (*each, "end"),
            np.array([[phase.nox_range for phase in one.values()] for one in flown]),
            _attrs("kg", f"nitrogen oxides of the phase, {RANGE}"),
        ),
    }
    for name, text in {"fuel": "fuel burned", **NAMES}.items():
        values = np.array([[getattr(phase, name) for phase in one.values()] for one in flown])
        variables[f"phase_{name}"] = (each, values, _attrs("kg", f"{text} of the phase"))
    return variables


def _total(emitted: Emitted | None, name: str) -> float:
    return emitted.total(name) if emitted else math.nan


def _attrs(units: str, text: str) -> dict[str, str]:
    return {"units": units, "long_name": text}
