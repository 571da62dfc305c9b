"""The product's periodic rotor against a conventional time march of the same rotor, as one JSON object.

    python tests/benchmarks/time_march.py

The march (``marched_*.py``) shares no code with the product: it reads the same data file, and takes the flow at the
hub and the loads to reach from the product's trim. Both start from momentum theory. Times are process times of this one
run. Section evaluations: one for every station of every blade at every instant. The product's are counted as if its
Jacobian were residuals: as many as fit into the time of a Jacobian, which counts all of its algebra against it.
"""

from __future__ import annotations

import json
import time
import tomllib
from collections.abc import Callable
from math import degrees
from typing import Any

import casadi as ca
import numpy as np
from made_with import made_with
from marched_rotor import Condition, Numerics
from marched_trim import MarchedTrim, Trim
from process_time import process_time

from vrsopt.aircraft import DATA, load_aircraft
from vrsopt.equilibrium import TrimEquations, trim_system
from vrsopt.flight import trim_parameters
from vrsopt.residual import ResidualSystem
from vrsopt.rotor.fidelity import Fidelity
from vrsopt.solution import Solution
from vrsopt.solvers.newton import newton

CONTROLS = ("collective", "lateral_cyclic", "longitudinal_cyclic")
FLIGHT = {
    "mass": 2200.0,
    "altitude": 0.0,
    "isa_offset": 0.0,
    "speed": 30.0,
    "climb_angle": 0.0,
    "load_factor": 1.0,
    "rotor_speed": 44.4,
    "twist": 0.13963,
}
CASES: dict[str, tuple[Fidelity, dict[str, float]]] = {
    "static section": (Fidelity(dynamic_stall=False), {}),
    "dynamic stall": (Fidelity(), {}),
    "dynamic stall, heavy and fast": (Fidelity(), {"mass": 2400.0, "speed": 55.0}),
    "dynamic stall, blade-passage inflow": (Fidelity(blade_passage=True), {}),
    "dynamic stall, hover": (Fidelity(), {"speed": 0.0}),
}


def rotor_data() -> dict[str, Any]:
    """The main rotor's numbers without units and sources."""

    def plain(table: dict[str, Any]) -> Any:
        return table["value"] if "value" in table else {name: plain(entry) for name, entry in table.items()}

    return plain(tomllib.loads((DATA / "bo105.toml").read_text(encoding="utf-8"))["main_rotor"])


def trimmed(fidelity: Fidelity, changes: dict[str, float]) -> tuple[ResidualSystem, Solution]:
    """The product's trim at ``FLIGHT`` with changes."""
    aircraft = load_aircraft("bo105")
    system = trim_system(aircraft, fidelity)
    solution = system.solve(trim_parameters(aircraft, {**FLIGHT, **changes}), method="newton")
    if not solution.success:
        raise RuntimeError(solution.message)
    return system, solution


def condition(fidelity: Fidelity, solution: Solution) -> Condition:
    """What the rotor of a trim feels, and the loads it gives."""
    equations = TrimEquations(load_aircraft("bo105"), fidelity)
    state = equations.state
    felt = ca.Function(
        "felt",
        [equations.x, equations.p],
        [state.wind, state.specific_force, state.hub_rate, state.air.density, state.air.speed_of_sound],
    )
    wind, force, rate, density, sound = (
        value.full().ravel().tolist()
        for value in felt(list(solution.values.values()), list(solution.parameters.values()))
    )
    if any(rate):
        raise ValueError("the march is of a hub that does not turn")
    given, reached = solution.parameters, solution.outputs
    return Condition(
        wind=tuple(wind),
        specific_force=tuple(force),
        rotor_speed=given["rotor_speed"],
        twist=given["twist"],
        density=density[0],
        speed_of_sound=sound[0],
        induced_power_factor=given["induced_power_factor"],
        section_drag_level=given["section_drag_level"],
        targets=(reached["thrust"], -reached["hub_roll_moment"], reached["hub_pitch_moment"]),
    )


def numerics(fidelity: Fidelity) -> Numerics:
    """A march as fine as the product's rotor."""
    states = TrimEquations(load_aircraft("bo105"), fidelity).model.inflow.cosine
    return Numerics(
        stations=fidelity.stations,
        harmonic=max(m for m, _ in states),
        shape=max(n for _, n in states),
        passage=fidelity.blade_passage,
        dynamic_stall=fidelity.dynamic_stall,
    )


def march(condition: Condition, numerics: Numerics) -> tuple[Trim, float]:
    """The baseline's trim and its process time [s]."""
    begin = time.process_time()
    rotor = MarchedTrim(rotor_data(), condition, numerics)
    trim = rotor.trim(rotor.first_controls())
    return trim, time.process_time() - begin


def product_effort(system: ResidualSystem, solution: Solution) -> dict[str, float]:
    """Process time [s] of a cold trim, and what it consists of."""
    p = system.vector(solution.parameters)
    calls = {"residuals": 0, "jacobians": 0}

    def counted(name: str, function: Callable[..., Any]) -> Callable[[np.ndarray], np.ndarray]:
        def call(z: np.ndarray) -> np.ndarray:
            calls[name] += 1
            return function(z, p).full()

        return call

    residual, jacobian = counted("residuals", system._residual), counted("jacobians", system._jacobian)
    newton(lambda z: residual(z).ravel(), jacobian, start=system._start(solution.parameters, None))
    effort = dict(calls)
    seconds = {
        "trim": lambda: system.solve(solution.parameters, method="newton"),
        "residual": lambda: residual(solution.scaled),
        "jacobian": lambda: jacobian(solution.scaled),
    }
    return {**effort, **{f"{name}_s": process_time(action) for name, action in seconds.items()}}


def compare(fidelity: Fidelity, changes: dict[str, float]) -> dict[str, Any]:
    """Product and baseline at one condition."""
    system, solution = trimmed(fidelity, changes)
    effort = product_effort(system, solution)
    trim, seconds = march(condition(fidelity, solution), numerics(fidelity))
    power = solution.outputs["main_rotor_power"]
    residuals = effort["residuals"] + effort["jacobians"] * effort["jacobian_s"] / effort["residual_s"]
    sections = residuals * fidelity.stations * fidelity.azimuths
    return {
        "product": {
            "power_w": power,
            "controls_deg": [degrees(solution.values[name]) for name in CONTROLS],
            "unknowns": len(solution.values),
            **effort,
            "section_evaluations": sections,
        },
        "march": {
            "power_w": trim.power,
            "controls_deg": np.degrees(trim.controls).tolist(),
            "miss": trim.miss,
            "trim_s": seconds,
            "marches": trim.work.marches,
            "revolutions": trim.work.revolutions,
            "section_evaluations": trim.work.sections,
        },
        "power_difference_percent": 100 * (trim.power / power - 1),
        "control_differences_deg": [
            degrees(there - solution.values[name]) for name, there in zip(CONTROLS, trim.controls, strict=True)
        ],
        "time_ratio": seconds / effort["trim_s"],
        "section_evaluation_ratio": trim.work.sections / sections,
    }


if __name__ == "__main__":
    cases = {name: {"flight": {**FLIGHT, **case[1]}, **compare(*case)} for name, case in CASES.items()}
    print(json.dumps({"versions": made_with("scipy"), "cases": cases}, indent=2))
