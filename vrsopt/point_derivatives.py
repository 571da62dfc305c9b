"""Exact derivatives of a solved operating point: trim, drive train, gas path and combustor chained.

Each of the three systems is differentiated by the implicit-function theorem; the expressions between them (drive train,
flight Mach number, speed ratio, rate of turn) by CasADi or by hand.
"""

from __future__ import annotations

from math import cos, tan
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from vrsopt.aircraft import Aircraft
from vrsopt.atmosphere import GRAVITY
from vrsopt.combustor.emissions import INDICES, SPECIES, emission_sensitivities
from vrsopt.drive_train import engine_parameters, engine_power
from vrsopt.equilibrium import trim_system
from vrsopt.errors import InputError
from vrsopt.turboshaft.cycle import gas_path
from vrsopt.turboshaft.data import EngineData

if TYPE_CHECKING:
    from vrsopt.operating_point import OperatingPoint

TRIM_VARIABLES = ("mass", "altitude", "speed", "rotor_speed", "twist", "climb_angle", "turn_rate", "isa_offset")
COUPLED = ("rotor_power", "altitude", "isa_offset", "speed", "rotor_speed")  # what the engine hears of the flight
ROTOR_POWERS = ("main_rotor_power", "tail_rotor_power")
GAS_PATH_OUTPUTS = ("gas_generator_speed", "turbine_inlet_temperature", "power_turbine_inlet_temperature")


def derivatives(point: OperatingPoint) -> dict[str, dict[str, float]]:
    """Derivatives ``result[output][variable]`` of a solved point, SI units.

    Outputs, named as on the point: the powers, fuel_flow, nox, co, co2, their indices, gas-generator speed and turbine
    temperatures. Variables: mass, altitude, speed, rotor_speed, twist, climb_angle, load_factor, isa_offset, each with
    the others held, and turn_rate with the others but load_factor held. In straight flight the derivative by
    load_factor does not exist (a turn begins with the square root of the extra load) and is nan: use turn_rate.

    Those of emissions are nan where the combustor was not solved. Close to a fold of the trim (small
    ``trim.smallest_singular_value``) derivatives grow without bound. Raises
    :class:`InputError` for a point that was not solved.
    """
    if not point.success or point.gas_path is None:
        raise InputError(f"derivatives: no derivatives of a point that was not solved: {point.message}")
    trim = trim_system(point.aircraft).sensitivities(point.solution)
    rotors = {name: _row(trim[name]) for name in ROTOR_POWERS}
    system = gas_path(point.engine, "power")
    inner = system.sensitivities(point.gas_path)
    if np.isfinite(point.nox):
        inner |= emission_sensitivities(point.engine, point.gas_path, system)
    else:  # the combustor was not solved, which costs the emissions alone
        inner |= {name: dict.fromkeys(point.gas_path.parameters, np.nan) for name in (*SPECIES, *INDICES)}
    parameters = _coupling(point, sum(rotors.values(), np.zeros(len(TRIM_VARIABLES))))
    engine = {name: _row(inner[name], point.gas_path.parameters) @ parameters for name in inner}
    count = point.engines_operating
    flows = {name: count * engine[name] for name in ("fuel_flow", *SPECIES)}
    others = {name: engine[name] for name in (*INDICES, *GAS_PATH_OUTPUTS)}
    rows = {**rotors, "shaft_power_per_engine": parameters[0], **flows, **others}
    return {name: _by_load_factor(point, row) for name, row in rows.items()}


def _row(slopes: dict[str, float], names: Any = TRIM_VARIABLES) -> np.ndarray:
    return np.array([slopes[name] for name in names])


def _coupling(point: OperatingPoint, rotor_power: np.ndarray) -> np.ndarray:
    """d(parameters of the gas path) / d(TRIM_VARIABLES), given that of the power of both rotors."""
    flight = point.solution.parameters
    place = [point.main_rotor_power + point.tail_rotor_power, *(flight[name] for name in COUPLED[1:])]
    slopes = _coupling_jacobian(point.aircraft, point.engine, point.engines_operating)(place).full()
    reached = [rotor_power, *(np.array([float(name == other) for other in TRIM_VARIABLES]) for name in COUPLED[1:])]
    return slopes @ np.array(reached)


def _coupling_jacobian(aircraft: Aircraft, engine: EngineData, operating: int) -> ca.Function:
    """CasADi Function: d(parameters of the gas path) / d(COUPLED)."""
    q = ca.SX.sym("q", len(COUPLED))
    rotor_power, *rest = ca.vertsplit(q)
    power = engine_power(aircraft, engine, rotor_power, engines_operating=operating)
    parameters = engine_parameters(aircraft, power, dict(zip(COUPLED[1:], rest, strict=True)))
    return ca.Function("coupling", [q], [ca.jacobian(ca.vertcat(*parameters.values()), q)])


def _by_load_factor(point: OperatingPoint, row: np.ndarray) -> dict[str, float]:
    """A row by TRIM_VARIABLES, with speed and climb angle at constant load factor instead of constant rate of turn.

    From tan(bank) = rate V cos(climb) / g and load factor n = 1 / cos(bank).
    """
    slopes = dict(zip(TRIM_VARIABLES, row.tolist(), strict=True))
    flight, by_rate = point.solution.parameters, slopes["turn_rate"]
    rate, speed, climb = flight["turn_rate"], flight["speed"], flight["climb_angle"]
    if rate == 0.0:
        return slopes | {"load_factor": np.nan}
    along = speed * cos(climb)
    load_factor = np.sqrt(1.0 + (rate * along / GRAVITY) ** 2)
    return slopes | {
        "speed": slopes["speed"] - by_rate * rate / speed,
        "climb_angle": slopes["climb_angle"] + by_rate * rate * tan(climb),
        "load_factor": by_rate * load_factor * GRAVITY**2 / (rate * along**2),
    }
