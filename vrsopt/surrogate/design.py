"""The sampled physics: what is computed at each point of a design of experiments, in its two spaces.

"level": level flight at load factor one on a standard day. Powers in climb and descent are sampled beside it at a
reference climb angle of either sign: flight-path angle then enters the surrogate as a parabola through three points,
which holds to a few hundred watts per engine, without a sixth variable. So are three powers at rest that depend on
mass, altitude, rotor speed and twist only: hover far from the ground, hover close to it, and a vertical climb.

"flight": climb angle and load factor are variables like the others, and nothing is computed beside the point. A turn
too tight for its airspeed can not be flown and has no numbers.

Points that were solved come with the exact derivatives of their outputs. Where momentum theory does not lead to the
trim of a point whose blade loading, or the thrust demanded of its tail rotor, is beyond the limit, the trim is not
looked for: it would cost some twenty times as much as that of a flyable point, to be classified as it is now.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from vrsopt.atmosphere import standard_air
from vrsopt.equilibrium import trim_system
from vrsopt.errors import InputError
from vrsopt.flight import trim_parameters, turn_rate
from vrsopt.helicopter import MODEL_VERSION, Helicopter, helicopter
from vrsopt.limits import Limits
from vrsopt.operating_point import OperatingPoint
from vrsopt.solution import Solution
from vrsopt.surrogate.database import Database, PointRecord
from vrsopt.surrogate.sampling import Sampling
from vrsopt.surrogate.sampling import add_points as add_sampled_points
from vrsopt.surrogate.sampling import sample as sample_points
from vrsopt.surrogate.space import FLIGHT, LEVEL, Space
from vrsopt.trimming import Trim

OF_THE_POINT = {  # output: its name on the operating point
    "main_rotor_power": "main_rotor_power",  # W
    "tail_rotor_power": "tail_rotor_power",  # W
    "fuel_flow": "fuel_flow",  # kg/s, all engines, as are the flows below
    "nox_flow": "nox",
    "co_flow": "co",
    "co2_flow": "co2",
    "shaft_power_per_engine": "shaft_power_per_engine",  # W
    "turbine_inlet_temperature": "turbine_inlet_temperature",  # K
    "power_turbine_inlet_temperature": "power_turbine_inlet_temperature",  # K
    "tail_blade_loading": "tail_blade_loading",  # -
}
CONSUMPTION = "specific_fuel_consumption"  # kg/J
OUTPUTS = (*OF_THE_POINT, CONSUMPTION)
WITH_DERIVATIVES = tuple(name for name in OUTPUTS if name != "tail_blade_loading")
BESIDE = (
    "climb_rotor_power",  # W, main and tail rotor, at the reference climb angle
    "descent_rotor_power",  # W, the same in descent
    "nox_flow_wide_mixing",  # NOx by the other fit of the combustor: each is smooth, their range has a corner
    "hover_rotor_power",  # W, main and tail rotor, at no airspeed whatever that of the point
    "ground_rotor_power",  # W, the same with the hub one rotor radius above the ground
    "vertical_rotor_power",  # W, the same far from the ground, in a vertical climb at VERTICAL_SPEED
)
OTHER_FIT = "wide_mixing"
AIRCRAFT = "bo105"
VERTICAL_SPEED = 4.0  # m/s
GROUND_PROXIMITY = 1.0  # rotor radius over the height of the hub
AT_REST: dict[str, dict[str, float]] = {
    "hover_rotor_power": {},
    "ground_rotor_power": {"ground_proximity": GROUND_PROXIMITY},
    "vertical_rotor_power": {"vertical_speed": VERTICAL_SPEED},
}
NOT_SEARCHED = "; its trim was not looked for"


@dataclass(frozen=True)
class Physics:
    """What is sampled in a space: the function of one point and the outputs that it gives."""

    space: Space
    evaluate: Callable[[Mapping[str, float]], PointRecord]
    outputs: tuple[str, ...]


def model_data_hash() -> str:
    """Hash of the aircraft and engine numbers behind a point."""
    return helicopter(AIRCRAFT).data_hash


def sample(
    path: Path | str,
    *,
    space: str = "level",
    method: str = "latin_hypercube",
    samples: int = 1500,
    seed: int = 1,
    workers: int = 2,
    resume: bool = False,
    dask: str | None = None,
    progress: bool = False,
) -> Sampling:
    """Sample the physics into the design of experiments ``path`` until ``samples`` points are flyable.

    ``space``: "level" (mass, altitude, airspeed, rotor speed and twist of level flight) or "flight" (those, climb angle
    and load factor), see :mod:`vrsopt.surrogate.space`. ``method``: "latin_hypercube" or "sobol". The rows depend on
    space, method and ``seed`` alone, not on the number of ``workers``, the processes that compute them, nor on
    ``dask``, the address of a scheduler whose workers do. ``resume``: continue an interrupted file, or extend a
    complete one by more ``samples``. ``progress``: a bar on standard error.

    Raises :class:`InputError` for another space or method, a file that exists (without ``resume``) or belongs to
    another model, data, seed or design, and a cluster that can not be used.
    """
    physics = _physics(space)
    return sample_points(
        path,
        evaluate=physics.evaluate,
        space=physics.space,
        method=method,
        outputs=physics.outputs,
        derivatives=WITH_DERIVATIVES,
        model_version=MODEL_VERSION,
        data_hash=model_data_hash(),
        samples=samples,
        seed=seed,
        workers=workers,
        resume=resume,
        dask=dask,
        progress=progress,
    )


def add_points(path: Path | str, inputs: ArrayLike, *, workers: int = 2, progress: bool = False) -> Sampling:
    """Compute the points ``inputs`` (k, d) [SI units], in the order of the file's inputs, and add them to a design.

    ``path``: the design; ``workers``: processes; ``progress``: a bar on standard error. Points that it has already are
    skipped. Raises :class:`InputError` for points outside the box, or a file of another model or data.
    """
    with Database.open(path) as database:
        space = database.meta.space
    return add_sampled_points(
        path,
        inputs,
        evaluate=_physics(space).evaluate,
        model_version=MODEL_VERSION,
        data_hash=model_data_hash(),
        workers=workers,
        progress=progress,
    )


def reference_climb_sine(speed: Any) -> Any:
    """Sine of the reference climb angle at an airspeed [m/s]: 10 deg at rest, 6.6 deg at 40 m/s, 1.8 deg at 70 m/s.

    Steep where the missions climb and descend, gentle where a climb would need more power than there is.
    """
    return 0.17 / (1 + (speed / 48.0) ** 4)


def evaluate_level(inputs: Mapping[str, float]) -> PointRecord:
    """Physics at mass [kg], altitude [m], speed [m/s], rotor_speed [rad/s] and twist [rad] of level flight.

    Flyable ("ok") means inside the engine's own ratings and the blade-loading limits without manoeuvre margin. Powers
    in climb, in descent and at rest are given beside a flyable point where those are flyable too, emissions where the
    combustor was solved, and derivatives by the five inputs.
    """
    machine, limits = _sampled_helicopter()
    flight = {**inputs, "isa_offset": 0.0, "climb_angle": 0.0, "load_factor": 1.0}
    point = _point(machine, flight, limits)
    if isinstance(point, PointRecord):
        return point
    record = _record(point, tuple(inputs))
    if not point.success:
        return record
    outputs, iterations, residual = dict(record.outputs), record.iterations, record.residual_norm
    if math.isfinite(point.nox_of_fits[OTHER_FIT]):
        outputs[f"nox_flow_{OTHER_FIT}"] = point.nox_of_fits[OTHER_FIT]
    if point.feasible:
        for name, trim in _beside(machine, flight, limits, point.solution):
            iterations += trim.solution.iterations
            power = limits.power_usage(machine.aircraft.transmission.power_per_engine(trim.power))
            if trim.success and power <= 1.0 and _tail_usage(limits, trim.solution) <= 1.0:
                outputs[name] = trim.power
                residual = max(residual, trim.solution.residual_norm)
    return replace(record, outputs=outputs, iterations=iterations, residual_norm=residual)


def evaluate_flight(inputs: Mapping[str, float]) -> PointRecord:
    """Physics at the inputs of :func:`evaluate_level`, climb_angle [rad] and load_factor of a steady turn to the right.

    A turn tighter than :data:`vrsopt.flight.LARGEST_TURN_RATE` has the status "turn rate". Derivatives are by the seven
    inputs; those by the load factor grow without bound towards straight flight, where there are none at all.
    """
    machine, limits = _sampled_helicopter()
    try:
        turn_rate(inputs["load_factor"], inputs["speed"], inputs["climb_angle"])
    except InputError as error:
        return PointRecord({}, "turn rate", str(error).removeprefix("trim: "), 0, math.nan)
    point = _point(machine, {**inputs, "isa_offset": 0.0}, limits)
    return point if isinstance(point, PointRecord) else _record(point, tuple(inputs))


def _physics(space: str) -> Physics:
    if space not in PHYSICS:
        raise InputError(f"sample: space = {space!r}: one of {', '.join(PHYSICS)}")
    return PHYSICS[space]


PHYSICS = {
    "level": Physics(LEVEL, evaluate_level, (*OUTPUTS, *BESIDE)),
    "flight": Physics(FLIGHT, evaluate_flight, OUTPUTS),
}


def _sampled_helicopter() -> tuple[Helicopter, Limits]:
    machine = helicopter(AIRCRAFT)
    return machine, Limits(machine.aircraft, machine.engine, "study", 1.0)


def _point(machine: Helicopter, flight: Mapping[str, float], limits: Limits) -> OperatingPoint | PointRecord:
    """The point ``flight``, or the record of one that can not be flown and was not looked for."""
    parameters = trim_parameters(machine.aircraft, flight)
    start = trim_system(machine.aircraft).solve(parameters, method="newton")
    if start.success:
        point = machine.point(flight, limits=limits, guess=start)
        return replace(point, iterations=point.iterations + start.iterations)
    density = standard_air(flight["altitude"], flight["isa_offset"]).density
    weight = flight["load_factor"] * flight["mass"]
    loading, largest = limits.blade_loading(weight, density, flight["rotor_speed"], flight["speed"])
    if loading > largest:
        reason = f"blade loading {loading:.4f} above {largest:.4f}{NOT_SEARCHED}"
        return PointRecord({}, "stalled", reason, start.iterations, start.residual_norm)
    # A tail rotor that never stalls tells what thrust is demanded of the real one.
    attached = trim_system(machine.aircraft, stalling_tail=False).solve(parameters, method="newton")
    if attached.success and (usage := _tail_usage(limits, attached)) > 1.0:
        needed = f"tail-rotor blade loading {attached.outputs['tail_blade_loading']:.4f} needed"
        reason = f"{needed}, {usage:.3f} times the largest allowed{NOT_SEARCHED}"
        return PointRecord({}, "tail rotor", reason, start.iterations + attached.iterations, start.residual_norm)
    return machine.point(flight, limits=limits)


def _record(point: OperatingPoint, names: tuple[str, ...]) -> PointRecord:
    """Outputs of the point itself and their derivatives by the inputs ``names``, where it was solved."""
    outputs: dict[str, float] = {}
    slopes: dict[str, dict[str, float]] = {}
    if point.success:
        outputs = {name: float(getattr(point, attribute)) for name, attribute in OF_THE_POINT.items()}
        outputs = {name: value for name, value in outputs.items() if math.isfinite(value)}
        outputs[CONSUMPTION] = point.fuel_flow / (point.engines_operating * point.shaft_power_per_engine)
        exact = point.derivatives()
        rows = {name: exact[OF_THE_POINT[name]] for name in WITH_DERIVATIVES if name != CONSUMPTION}
        fuel, power = rows["fuel_flow"], rows["shaft_power_per_engine"]
        rows[CONSUMPTION] = {
            name: outputs[CONSUMPTION] * (fuel[name] / point.fuel_flow - power[name] / point.shaft_power_per_engine)
            for name in names
        }
        slopes = {output: {name: row[name] for name in names} for output, row in rows.items()}
        slopes = {output: row for output, row in slopes.items() if all(map(math.isfinite, row.values()))}
    return PointRecord(outputs, point.classification, point.reason, point.iterations, point.residual_norm, slopes)


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
