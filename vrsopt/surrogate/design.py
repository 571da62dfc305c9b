"""The sampled physics: what is computed at each point of the design of experiments.

A point is level flight at load factor one on a standard day. Powers in climb and descent are sampled beside it at a
reference climb angle of either sign: flight-path angle then enters the surrogate as a parabola through three points,
which holds to a few hundred watts per engine, without a sixth variable. So are three powers at rest that depend on
mass, altitude, rotor speed and twist only: hover far from the ground, hover close to it, and a vertical climb.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from vrsopt.equilibrium import trim_system
from vrsopt.flight import trim_parameters
from vrsopt.helicopter import MODEL_VERSION, Helicopter, helicopter
from vrsopt.limits import Limits
from vrsopt.residual import Solution
from vrsopt.surrogate.database import PointRecord
from vrsopt.surrogate.sampling import Sampling
from vrsopt.surrogate.sampling import sample as sample_points
from vrsopt.trimming import Trim

OUTPUTS = (
    "main_rotor_power",  # W
    "tail_rotor_power",  # W
    "fuel_flow",  # kg/s, all engines
    "tail_blade_loading",  # -
    "climb_rotor_power",  # W, main and tail rotor, at the reference climb angle
    "descent_rotor_power",  # W, the same in descent
    "nox_flow",  # kg/s, all engines, as are the flows below
    "nox_flow_wide_mixing",  # NOx by the other fit of the combustor: each is smooth, their range has a corner
    "co_flow",
    "co2_flow",
    "hover_rotor_power",  # W, main and tail rotor, at no airspeed whatever that of the point
    "ground_rotor_power",  # W, the same with the hub one rotor radius above the ground
    "vertical_rotor_power",  # W, the same far from the ground, in a vertical climb at VERTICAL_SPEED
)
OF_THE_POINT = OUTPUTS[:4]
OTHER_FIT = "wide_mixing"
AIRCRAFT = "bo105"
VERTICAL_SPEED = 4.0  # m/s
GROUND_PROXIMITY = 1.0  # rotor radius over the height of the hub
AT_REST: dict[str, dict[str, float]] = {
    "hover_rotor_power": {},
    "ground_rotor_power": {"ground_proximity": GROUND_PROXIMITY},
    "vertical_rotor_power": {"vertical_speed": VERTICAL_SPEED},
}


def model_data_hash() -> str:
    """Hash of the aircraft and engine numbers behind :func:`evaluate`."""
    return helicopter(AIRCRAFT).data_hash


def sample(
    path: Path | str,
    *,
    samples: int = 1500,
    seed: int = 1,
    workers: int = 2,
    resume: bool = False,
    progress: bool = False,
) -> Sampling:
    """Sample the physics into the design of experiments ``path`` until ``samples`` points are flyable.

    Latin-hypercube blocks over the box of the study in mass, altitude, airspeed, rotor speed and twist, its rotor speed
    from 70 % (the slowest rotor on a hot day is that of 72 % on the standard day), seeded by ``seed``; the rows do not
    depend on ``workers``. With ``resume`` an interrupted file is continued. ``progress`` shows a bar on standard error.
    Raises :class:`InputError` for a file that exists (without ``resume``) or belongs to
    another model, data, seed or design.
    """
    return sample_points(
        path,
        evaluate=evaluate,
        outputs=OUTPUTS,
        model_version=MODEL_VERSION,
        data_hash=model_data_hash(),
        samples=samples,
        seed=seed,
        workers=workers,
        resume=resume,
        progress=progress,
    )


def reference_climb_sine(speed: Any) -> Any:
    """Sine of the reference climb angle at an airspeed [m/s]: 10 deg at rest, 6.6 deg at 40 m/s, 1.8 deg at 70 m/s.

    Steep where the missions climb and descend, gentle where a climb would need more power than there is.
    """
    return 0.17 / (1 + (speed / 48.0) ** 4)


def evaluate(inputs: Mapping[str, float]) -> PointRecord:
    """Physics at mass [kg], altitude [m], speed [m/s], rotor_speed [rad/s] and twist [rad] of level flight.

    Flyable ("ok") means inside the engine's own ratings and the blade-loading limits without manoeuvre margin. Powers
    in climb, in descent and at rest are given beside a flyable point where those are flyable too, emissions where the
    combustor was solved.
    """
    machine = helicopter(AIRCRAFT)
    limits = Limits(machine.aircraft, machine.engine, "study", 1.0)
    level = {**inputs, "isa_offset": 0.0, "climb_angle": 0.0, "load_factor": 1.0}
    point = machine.point(level, limits=limits)
    if not point.success:
        return PointRecord({}, point.classification, point.reason, point.iterations, point.residual_norm)
    outputs = {name: getattr(point, name) for name in OF_THE_POINT}
    flows = {f"{name}_flow": getattr(point, name) for name in ("nox", "co", "co2")}
    flows[f"nox_flow_{OTHER_FIT}"] = point.nox_of_fits[OTHER_FIT]
    outputs |= {name: flow for name, flow in flows.items() if math.isfinite(flow)}
    residual, iterations = point.residual_norm, point.iterations
    if point.feasible:
        for name, trim in _beside(machine, level, limits, point.solution):
            iterations += trim.solution.iterations
            power = limits.power_usage(machine.aircraft.transmission.power_per_engine(trim.power))
            if trim.success and power <= 1.0 and _tail_usage(limits, trim.solution) <= 1.0:
                outputs[name] = trim.power
                residual = max(residual, trim.solution.residual_norm)
    return PointRecord(outputs, point.classification, point.reason, iterations, residual)


def _beside(
    machine: Helicopter, level: Mapping[str, float], limits: Limits, near: Solution
) -> Iterator[tuple[str, Trim]]:
    """Trims in climb, in descent and at rest, started from ``near``, the trim of the ``level`` flight.

    At rest a tail rotor that never stalls comes first: it tells, in little time, where the real one can not do it.
    """
    slope = math.asin(reference_climb_sine(level["speed"]))
    for name, sign in (("climb_rotor_power", 1.0), ("descent_rotor_power", -1.0)):
        yield name, machine.trim({**level, "climb_angle": sign * slope}, guess=near)
    hover = trim_parameters(machine.aircraft, {**level, "speed": 0.0})
    attached = trim_system(machine.aircraft, stalling_tail=False).solve(hover, near.values, method="newton")
    if attached.success and _tail_usage(limits, attached) <= 1.0:
        near = replace(attached, factorisation=None)
        for name, change in AT_REST.items():
            trim = machine.trim({**level, "speed": 0.0, **change}, guess=near)
            near = trim.solution if trim.success else near
            yield name, trim


def _tail_usage(limits: Limits, trim: Solution) -> float:
    flight = trim.parameters
    return float(limits.tail_usage(trim.outputs["tail_blade_loading"], flight["rotor_speed"], flight["speed"]))
