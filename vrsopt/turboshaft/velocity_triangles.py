"""Mean line of an axial power turbine: velocity triangles at the design point, and what its blades do away from it.

Blades are sized once, for repeated stages: stage loading, flow coefficient and reaction give every angle. Away from the
design point the flow still leaves each row along its blades, the annulus areas stay, and what changes is where the flow
comes from: incidence. Losses of kinetic energy: profile and secondary loss of each row (Soderberg), incidence, and the
swirl that leaves the last stage. The result is the turbine's efficiency over speed and isentropic drop, from which the
one number of the turbine map (:func:`vrsopt.turboshaft.maps.turbine_work`) is fitted instead of assumed.

Sources: triangles and Soderberg's correlation, Dixon and Hall, Fluid Mechanics and Thermodynamics of Turbomachinery,
chapter 4; incidence loss 1 - cos^n as in NASA's mean-line programs (Wasserbauer and Glassman, TN D-8063, 1975), and for
comparison Moustapha, Kacker and Tremblay, J. Turbomachinery 112 (1990), profile and secondary loss.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Literal

import casadi as ca
import numpy as np

from vrsopt.bulk import BulkSolver
from vrsopt.errors import InputError, NoSolutionError
from vrsopt.residual import Named, ResidualSystem, Unknown
from vrsopt.turboshaft.cycle import sized
from vrsopt.turboshaft.data import EngineData
from vrsopt.turboshaft.gas import enthalpy, gas_constant
from vrsopt.turboshaft.maps import turbine_work

Incidence = Literal["cosine", "moustapha"]
SPEED = 33290.0 * math.pi / 30.0  # rad/s, 100 % power-turbine speed of the 250 series
DEGREE = math.pi / 180.0
PITCH_TO_CHORD = 0.75


@dataclass(frozen=True)
class Assumption:
    """A number of the blading that no source gives: what is taken, and how far it may be off."""

    name: str
    value: float
    low: float
    high: float
    words: str


ASSUMPTIONS = (
    Assumption("loading", 1.3, 1.0, 1.7, "stage work over blade speed squared"),
    Assumption("flow_coefficient", 0.75, 0.55, 0.95, "axial velocity over blade speed"),
    Assumption("reaction", 0.5, 0.35, 0.6, "share of the stage's enthalpy drop in the rotor"),
    Assumption("aspect_ratio", 2.0, 1.0, 3.0, "blade height over axial chord"),
    Assumption(
        "loss_factor", 1.0, 0.7, 2.5, "on Soderberg's loss; 2.5 would alone give the efficiency of the gas path"
    ),
    Assumption("positive_incidence_exponent", 3.0, 1.0, 5.0, "n of the incidence loss below design speed"),
    Assumption("negative_incidence_exponent", 2.0, 1.0, 4.0, "n of the incidence loss above design speed"),
    Assumption("axial_head_lost", 0.0, 0.0, 1.0, "of the leaving axial energy; 0 leaves it to the exhaust's own loss"),
    Assumption("leading_edge_ratio", 0.1, 0.05, 0.2, "leading edge diameter over pitch (second incidence loss only)"),
)
DEFAULT: Mapping[str, float] = {assumption.name: assumption.value for assumption in ASSUMPTIONS}


@dataclass(frozen=True)
class Duty:
    """What the turbine is sized for: work [J/kg], inlet total temperature [K], cp and R [J/(kg K)] of its gas."""

    work: float
    inlet_temperature: float
    heat_capacity: float
    gas_constant: float

    @classmethod
    def of(cls, engine: EngineData) -> Duty:
        """The power turbine of an engine at its design point; cp is the mean over the expansion."""
        point = sized(engine)
        ratio = point.fuel_flow / point.air_flow
        work = enthalpy(point.t45, ratio) - enthalpy(point.t5, ratio)
        return cls(work, point.t45, work / (point.t45 - point.t5), float(gas_constant(ratio)))


@dataclass(frozen=True)
class Fit:
    """The map form fitted to a turbine: curvature, where its best U/C0 lies (1 is the design point's), and how well.

    ``rms`` and ``largest``: error of the efficiency over the design point's.
    """

    curvature: float
    best: float
    rms: float
    largest: float


@dataclass
class _March:
    """What one walk through the stages finds, row by row."""

    flux: list[Any] = field(default_factory=list)  # density times axial velocity behind each row
    incidence: list[Any] = field(default_factory=list)  # rad, of the rotors and of the nozzles behind a stage
    work: Any = 0.0
    drop: Any = 0.0
    swirl: Any = 0.0
    total_temperature: Any = 0.0


def triangles(duty: Duty, *, stages: int = 2, incidence: Incidence = "cosine") -> ResidualSystem:
    """The turbine as a residual system: axial velocity behind each row over its design value, and the flow over it.

    Parameters: ``speed`` (over the design speed), ``spouting_velocity`` (root of the isentropic drop over its design
    value), then the ``ASSUMPTIONS`` by name. Outputs: ``efficiency`` and the efficiency of the design point
    (total pressure to the exit pressure with the axial head, less ``axial_head_lost`` of it), ``work`` and
    ``isentropic_drop`` [J/kg], ``flow_ratio`` at unchanged inlet, ``exit_swirl`` [rad], ``rotor_incidence`` [rad],
    ``blade_speed`` [m/s], ``total_enthalpy_drop`` [J/kg]. Raises :class:`InputError` for less than one stage.
    """
    if stages < 1:
        raise InputError(f"velocity triangles: stages = {stages}: one or more")
    return _built(duty, stages, incidence)


@lru_cache(maxsize=16)
def _built(duty: Duty, stages: int, incidence: Incidence) -> ResidualSystem:
    rows = 2 * stages
    x, p = ca.SX.sym("x", rows + 1), ca.SX.sym("p", 2 + len(ASSUMPTIONS))
    speed, spouting, *rest = ca.vertsplit(p)
    blading = dict(zip(DEFAULT, rest, strict=True))
    blade_speed = ca.sqrt(duty.work / stages / blading["loading"])
    design = _march(duty, blading, blade_speed, 1.0, [1.0] * rows, incidence)
    away = _march(duty, blading, blade_speed, speed, ca.vertsplit(x)[:rows], incidence)
    continuity = [now / then - x[rows] for now, then in zip(away.flux, design.flux, strict=True)]
    names = [f"{kind} {stage + 1}" for stage in range(stages) for kind in ("nozzle", "rotor")]
    outputs = {
        Named("efficiency"): away.work / away.drop,
        Named("design_efficiency"): design.work / design.drop,
        Named("work", "J/kg"): away.work,
        Named("isentropic_drop", "J/kg"): away.drop,
        Named("flow_ratio"): x[rows],
        Named("exit_swirl", "rad"): away.swirl,
        Named("rotor_incidence", "rad"): away.incidence[0],
        Named("blade_speed", "m/s"): speed * blade_speed,
        Named("total_enthalpy_drop", "J/kg"): duty.heat_capacity * (duty.inlet_temperature - away.total_temperature),
    }
    return ResidualSystem(
        name=f"velocity triangles of {stages} stages",
        unknowns=tuple(Unknown(name, "-", lower=0.05, upper=3.0, start=1.0) for name in (*names, "flow")),
        parameters=(Named("speed"), Named("spouting_velocity"), *(Named(name) for name in DEFAULT)),
        residuals=tuple(Named(name) for name in (*names, "isentropic drop")),
        outputs=tuple(outputs),
        x=x,
        p=p,
        r=ca.vertcat(*continuity, away.drop / design.drop - spouting**2),
        y=ca.vertcat(*outputs.values()),
    )


def _angles(blading: Mapping[str, Any]) -> tuple[Any, Any, Any, Any]:
    """Flow angles [rad] of the design point: nozzle inlet and exit, rotor inlet and exit (against the rotation)."""
    half, phi, reaction = 0.5 * blading["loading"], blading["flow_coefficient"], blading["reaction"]
    nozzle_in, nozzle_out = ca.atan((1.0 - reaction - half) / phi), ca.atan((half + 1.0 - reaction) / phi)
    return nozzle_in, nozzle_out, ca.atan((half - reaction) / phi), ca.atan((half + reaction) / phi)


def _march(
    duty: Duty, blading: Mapping[str, Any], design_speed: Any, speed: Any, axial: list[Any], incidence: Incidence
) -> _March:
    """Walk through the stages at given axial velocities (over the design value), pressures over the inlet's."""
    cp, exponent = duty.heat_capacity, duty.heat_capacity / duty.gas_constant
    nozzle_in, nozzle_out, rotor_in, rotor_out = _angles(blading)
    blade = speed * design_speed
    found = _March()
    total, pressure = duty.inlet_temperature, 1.0
    before: tuple[Any, Any] | None = None  # axial and tangential velocity ahead of a nozzle; the first follows its flow
    for stage in range(len(axial) // 2):
        v2, v3 = (blading["flow_coefficient"] * design_speed * axial[2 * stage + k] for k in (0, 1))

        out = v2 / ca.cos(nozzle_out)
        loss = soderberg(blading, nozzle_out - nozzle_in, nozzle=True) * 0.5 * out**2
        if before is not None:
            turned = nozzle_in - ca.atan2(before[1], before[0])
            found.incidence.append(turned)
            loss += _incidence_loss(blading, turned, ca.hypot(*before), out, (-nozzle_in, nozzle_out), incidence)
        t2 = total - 0.5 * out**2 / cp
        p2 = pressure * ((t2 - loss / cp) / total) ** exponent
        swirl = v2 * ca.tan(nozzle_out)
        found.flux.append(p2 / t2 * v2)

        along = swirl - blade
        relative = t2 + 0.5 * (v2**2 + along**2) / cp
        turned, out = ca.atan2(along, v2) - rotor_in, v3 / ca.cos(rotor_out)
        found.incidence.append(turned)
        loss = soderberg(blading, rotor_in + rotor_out, nozzle=False) * 0.5 * out**2
        loss += _incidence_loss(blading, turned, ca.hypot(v2, along), out, (rotor_in, rotor_out), incidence)
        t3 = relative - 0.5 * out**2 / cp
        p3 = p2 * (relative / t2) ** exponent * ((t3 - loss / cp) / relative) ** exponent
        found.flux.append(p3 / t3 * v3)
        found.swirl = blade - v3 * ca.tan(rotor_out)

        found.work += blade * (swirl - found.swirl)
        total = t3 + 0.5 * (v3**2 + found.swirl**2) / cp
        pressure = p3 * (total / t3) ** exponent
        before = (v3, found.swirl)
    useful = t3 + 0.5 * (1.0 - blading["axial_head_lost"]) * v3**2 / cp
    found.drop = cp * duty.inlet_temperature * (1.0 - p3 ** (1.0 / exponent) * useful / t3)
    found.total_temperature, found.swirl = total, ca.atan2(found.swirl, v3)
    return found


def soderberg(blading: Mapping[str, Any], deflection: Any, *, nozzle: bool) -> Any:
    """Loss of a row over its exit kinetic energy; ``deflection`` [rad] at the design point. No Reynolds correction.

    ``blading``: assumptions by name; ``nozzle``: else a rotor.
    """
    profile = 0.04 + 0.06 * (deflection / (100.0 * DEGREE)) ** 2
    ends = 0.993 + 0.021 / blading["aspect_ratio"] if nozzle else 0.975 + 0.075 / blading["aspect_ratio"]
    return blading["loss_factor"] * ((1.0 + profile) * ends - 1.0)


def _incidence_loss(
    blading: Mapping[str, Any], angle: Any, velocity: Any, exit_velocity: Any, row: tuple[Any, Any], model: Incidence
) -> Any:
    """Enthalpy [J/kg] lost to incidence [rad], positive where the row has more to turn; velocities in and out."""
    if model == "cosine":
        exponent = ca.if_else(angle > 0, blading["positive_incidence_exponent"], blading["negative_incidence_exponent"])
        return 0.5 * velocity**2 * (1.0 - ca.cos(angle) ** exponent)
    return 0.5 * exit_velocity**2 * _moustapha(blading, angle, *row)


def _moustapha(blading: Mapping[str, Any], angle: Any, inlet: Any, outlet: Any) -> Any:
    """Change of a row's loss with incidence, over its exit kinetic energy; angles [rad] of its blades."""
    edge, narrowing = blading["leading_edge_ratio"], ca.cos(inlet) / ca.cos(outlet)
    chi = ca.fmin(ca.fmax(edge**-1.6 * narrowing**-2 * angle / DEGREE, -800.0), 800.0)
    above = 0.778e-5 * chi + 0.56e-7 * chi**2 + 0.4e-10 * chi**3 + 2.054e-19 * chi**6
    profile = ca.if_else(chi > 0, above, -5.1734e-6 * chi + 7.6902e-9 * chi**2)

    turning, mean = ca.tan(inlet) + ca.tan(outlet), ca.atan(0.5 * (ca.tan(outlet) - ca.tan(inlet)))
    ends = 0.0334 * 4.0 * turning**2 * ca.cos(outlet) ** 2 / ca.cos(mean) / narrowing / blading["aspect_ratio"]
    chi = angle / (math.pi - inlet - outlet) * narrowing**-1.5 * (edge * PITCH_TO_CHORD) ** -0.3
    growth = ca.exp(0.9 * chi) + ca.if_else(chi > 0, 13.0 * chi**2 + 400.0 * chi**4, 0.0)
    return profile + ends * (growth - 1.0)


def characteristics(
    duty: Duty,
    speed: np.ndarray,
    spouting_velocity: np.ndarray,
    bladings: list[Mapping[str, float]],
    *,
    incidence: Incidence = "cosine",
) -> dict[str, np.ndarray]:
    """Outputs of :func:`triangles` by name, (bladings, N), at N speeds and spouting velocities.

    A blading gives the assumptions that differ from ``DEFAULT``. ``speed`` and ``spouting_velocity`` (N,) over their
    values at the design point; ``incidence``: model of its loss. Raises :class:`NoSolutionError` when a point is not
    solved, which happens far outside the range of the assumptions (a row that chokes).
    """
    n, c = np.broadcast_arrays(np.asarray(speed, dtype=float), np.asarray(spouting_velocity, dtype=float))
    blocks = [np.column_stack([n, c, *(np.full(n.size, v) for v in {**DEFAULT, **b}.values())]) for b in bladings]
    found = _bulk_solver(duty, incidence).solve(np.vstack(blocks))
    if not found.success.all():
        row, message = next(iter(found.failures.items()))
        raise NoSolutionError(f"velocity triangles: blading {bladings[row // n.size]}: {message}")
    return {name: values.reshape(len(bladings), n.size) for name, values in found.outputs.items()}


@lru_cache(maxsize=4)
def _bulk_solver(duty: Duty, incidence: Incidence) -> BulkSolver:
    return BulkSolver(triangles(duty, incidence=incidence))


def work_over_design(fit: Fit, speed: Any, spouting_velocity: Any) -> Any:
    """Work of the fitted map over the design point's; floats, arrays or CasADi expressions.

    ``speed`` and ``spouting_velocity`` over their values at the design point.
    """
    return turbine_work(fit.curvature, speed, spouting_velocity, best=fit.best)


def fitted(speed: np.ndarray, spouting_velocity: np.ndarray, work: np.ndarray, *, best: float | None = 1.0) -> Fit:
    """The form of :func:`work_over_design` in least squares over N points of the work over the design's.

    ``best`` is b, the best U/C0 over the design point's: 1 is the engine's map, None fits it as well. ``speed`` and
    ``spouting_velocity`` (N,) over their values at the design point.
    """
    n, c, w = (np.asarray(values, dtype=float) for values in (speed, spouting_velocity, work))
    columns = np.stack([n**2 - c**2, -2.0 * (n - c) * c], axis=1)  # factors of a and of a b
    if best is None:
        a, product = np.linalg.lstsq(columns, c**2 - w, rcond=None)[0]
    else:
        column = columns @ [1.0, best]
        a = column @ (c**2 - w) / (column @ column)
        product = a * best
    error = (c**2 - columns @ [a, product] - w) / c**2
    return Fit(float(a), float(product / a), float(np.sqrt(np.mean(error**2))), float(np.abs(error).max()))
