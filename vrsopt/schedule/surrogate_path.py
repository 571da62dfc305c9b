"""The aircraft along a mission from its surrogate: Kriging of the rotor power, then the engine's own equations.

Along given nodes the flight condition is fixed, so each Kriging shrinks to a Chebyshev polynomial in mass, rotor speed
and twist, and the engine's table to one in power and speed. The optimal-control problem, the pointwise search and the
re-flight all use these same polynomials; a test holds them to the Kriging itself.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from vrsopt.atmosphere import density_altitude, standard_air
from vrsopt.errors import InputError
from vrsopt.flat_pitch import flat_pitch_power
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.schedule.path_model import PathValues
from vrsopt.schedule.plant import Plant
from vrsopt.surrogate import chebyshev
from vrsopt.surrogate.design import reference_climb_sine
from vrsopt.surrogate.engine_table import EngineTable, engine_table
from vrsopt.surrogate.export import FREE, path_coefficients
from vrsopt.surrogate.kriging import KrigingState
from vrsopt.surrogate.store import Surrogate

if TYPE_CHECKING:
    from vrsopt.mission.profile import Conditions

# (mass, rotor speed, twist), by measurement: rms error of the rotor power against the Kriging itself 0.005 %
POWER_DEGREES = (5, 9, 6)
TAIL_DEGREES = (2, 6, 3)
POWER_KEPT = chebyshev.low_total_degree(POWER_DEGREES, 1.3)  # half of the tensor, for speed
USED = ("main_rotor_power", "tail_rotor_power", "climb_rotor_power", "descent_rotor_power", "tail_blade_loading")
LEAST_CORRELATION = 98.0  # per cent, leave-one-out: below it a surrogate is not fit to be optimised on


class SurrogateAircraft:
    """Makes the path models of one mission from a surrogate: call it with the conditions at the nodes."""

    def __init__(
        self,
        surrogate: Surrogate,
        limits: Limits,
        *,
        isa_offset: float = 0.0,
        kinetic_energy: bool = True,
        force: bool = False,
    ) -> None:
        """``kinetic_energy``: charge the power that speeds up the rotor to the engines, and credit it back.

        Raises :class:`InputError` for a surrogate without the outputs needed, or whose leave-one-out correlation is too
        low to be optimised on (unless ``force``).
        """
        for name in USED:
            if name not in surrogate.models:
                raise InputError(f"surrogate: {name}: missing")
            correlation = surrogate.accuracy[name].pearson_percent
            if correlation < LEAST_CORRELATION and not force:
                allowed = f"at least {LEAST_CORRELATION:g} % to be optimised on"
                raise InputError(f"surrogate: {name}: leave-one-out correlation {correlation:.2f} %: {allowed}")
        self.models = surrogate.models
        state: KrigingState = self.models["main_rotor_power"].state_
        columns = [state.names.index(name) for name in FREE]
        rotor = limits.aircraft.main_rotor
        self.plant = Plant(
            limits,
            engine_table(isa_offset=isa_offset, engine_data=limits.engine),
            isa_offset,
            rotor.polar_inertia if kinetic_energy else 0.0,
            float(state.upper[state.names.index("altitude")]),
            state.lower[columns],
            state.upper[columns],
        )

    def __call__(self, conditions: Conditions) -> SurrogatePath:
        """The aircraft at the nodes of ``conditions``; raises :class:`InputError` where they leave the sampled box."""
        keys = np.stack(
            [conditions.speed, conditions.altitude, conditions.climb_angle, np.asarray(conditions.idle, dtype=float)]
        )
        flight, index = np.unique(keys, axis=1, return_inverse=True)
        speed, altitude, climb_angle, idle = flight
        power, tail = self._rotor_tables(speed, altitude, climb_angle, idle == 0)
        engine = self.plant.table.contract(altitude, self.plant.mach(speed, altitude))
        load_factor = np.asarray(conditions.load_factor, dtype=float)
        return SurrogatePath(self.plant, index.ravel(), load_factor, flight, power, tail, engine)

    def _rotor_tables(
        self, speed: np.ndarray, altitude: np.ndarray, climb_angle: np.ndarray, flying: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Coefficients of the rotor power (n, ...) [W] and the tail-rotor loading (n, ...) at n flight conditions.

        The climb angle enters as a parabola through descent, level flight and climb.
        """
        plant = self.plant
        rotor_altitude = density_altitude(altitude, plant.isa_offset)
        for extreme in (np.min(rotor_altitude[flying], initial=0.0), np.max(rotor_altitude[flying], initial=0.0)):
            if not -1.0 <= extreme <= plant.highest_altitude + 1.0:
                allowed = f"sampled from 0 to {plant.highest_altitude:g} m"
                raise InputError(f"surrogate: density altitude = {extreme:.0f} m: {allowed}")
        rotor_altitude = np.clip(rotor_altitude, 0.0, plant.highest_altitude)  # a metre is less than the weather
        slope = np.sin(climb_angle) / reference_climb_sine(speed)
        level, climb, descent = 1 - slope**2, (slope**2 + slope) / 2, (slope**2 - slope) / 2
        weights = dict(zip(USED, (level, level, climb, descent, np.ones_like(slope)), strict=True))
        tables = {
            degrees: np.zeros((len(speed), *(degree + 1 for degree in degrees)))
            for degrees in (POWER_DEGREES, TAIL_DEGREES)
        }
        for name, weight in weights.items():
            some = flying & (weight != 0)
            if np.any(some):
                degrees = TAIL_DEGREES if name == "tail_blade_loading" else POWER_DEGREES
                fixed = {"altitude": rotor_altitude[some], "speed": speed[some]}
                series = path_coefficients(self.models[name], fixed, plant.lower, plant.upper, degrees)
                tables[degrees][some] += weight[some, None, None, None] * series
        tables[POWER_DEGREES] *= POWER_KEPT
        for k in np.flatnonzero(~flying):
            place = {"altitude": float(altitude[k]), "isa_offset": plant.isa_offset}
            tables[POWER_DEGREES][k, 0, 0, 0] = flat_pitch_power(plant.limits.aircraft, **place)
        return tables[POWER_DEGREES], tables[TAIL_DEGREES]


@dataclass(frozen=True)
class SurrogatePath:
    """:class:`vrsopt.schedule.path_model.PathModel` at N nodes that share n different flight conditions.

    ``condition`` (N,) says which; ``load_factor`` (N,). ``flight`` (4, n): speed [m/s], altitude [m], climb angle
    [rad], idle. A turn counts as the mass times its load factor.
    """

    plant: Plant
    condition: np.ndarray
    load_factor: np.ndarray
    flight: np.ndarray
    power_series: np.ndarray = field(repr=False)
    tail_series: np.ndarray = field(repr=False)
    engine_series: np.ndarray = field(repr=False)

    limit_names = LIMIT_NAMES

    @property
    def bounds(self) -> dict[str, tuple[Any, Any]]:
        """Mass (N,) [kg], by its load factor, rotor speed [rad/s] and twist [rad] inside the sampled box."""
        lower, upper = self.plant.lower, self.plant.upper
        idle = self.flight[3][self.condition] > 0
        return {
            "mass": (
                np.where(idle, 0.0, lower[0] / self.load_factor),
                np.where(idle, np.inf, upper[0] / self.load_factor),
            ),
            "rotor_speed": (float(lower[1]), float(upper[1])),
            "twist": (float(lower[2]), float(upper[2])),
        }

    def nodes(self, index: np.ndarray) -> SurrogatePath:
        """The same aircraft at some of the nodes."""
        kept, condition = np.unique(self.condition[index], return_inverse=True)
        return replace(
            self,
            condition=condition.ravel(),
            load_factor=self.load_factor[index],
            flight=self.flight[:, kept],
            power_series=self.power_series[kept],
            tail_series=self.tail_series[kept],
            engine_series=self.engine_series[kept],
        )

    def evaluate(self, mass: Any, rotor_speed: Any, twist: Any, rotor_speed_rate: Any = 0.0) -> PathValues:
        """Fuel flow, power and limits; arguments broadcast to (N,) or (N, k). Outside the sampled box: InputError."""
        values = [np.asarray(value, dtype=float) for value in (mass, rotor_speed, twist, rotor_speed_rate)]
        shape = np.broadcast_shapes(*(value.shape for value in values), (len(self.condition),) if _flat(values) else ())
        W, Omega, tw, rate = (value[:, None] if value.ndim == 1 else value for value in values)
        speed, altitude, _, idle = self.flight[:, self.condition][:, :, None]
        weight = W * self.load_factor[:, None]
        lower, upper = self.plant.lower, self.plant.upper
        point = np.broadcast_arrays(np.where(idle > 0, 0.5 * (lower[0] + upper[0]), weight), Omega, tw)
        points = np.stack(point, axis=-1)
        _check_inside(points, lower, upper)
        rotor_power = chebyshev.evaluate(
            self.power_series[self.condition], points, lower=lower, upper=upper, extrapolate=True
        )
        tail_loading = chebyshev.evaluate(
            self.tail_series[self.condition], points, lower=lower, upper=upper, extrapolate=True
        )
        power = self.plant.engine_power(rotor_power, Omega, rate)
        ratio = np.broadcast_to(Omega / self._nominal, power.shape)
        fuel, temperature = self.plant.table.evaluate(self.engine_series[self.condition], power, ratio)
        usages = self.plant.usages(
            weight,
            Omega,
            speed=speed,
            density=standard_air(altitude, self.plant.isa_offset).density,
            power=power,
            temperature=temperature,
            tail_loading=tail_loading,
        )
        limits = np.stack([np.broadcast_to(np.where(idle > 0, -1.0, usage - 1.0), power.shape) for usage in usages])
        return PathValues(
            (self._engines * fuel).reshape(shape), power.reshape(shape), limits.reshape(len(LIMIT_NAMES), *shape)
        )

    def emissions(self, fuel_flow: np.ndarray, power_per_engine: np.ndarray, rotor_speed: Any) -> dict[str, np.ndarray]:
        """Emissions of all engines [kg/s] by name, each (N, k); see the protocol."""
        speed, altitude = self.flight[:2]
        return self.plant.emissions(
            altitude,
            self.plant.mach(speed, altitude),
            self.condition,
            fuel_flow=fuel_flow,
            power=power_per_engine,
            rotor_speed=rotor_speed,
        )

    def function(self) -> tuple[ca.Function, np.ndarray]:
        """One node as an SX function, exact to second order about its last input, and the coefficients (n_c, N)."""
        W, Omega, tw, rate = (ca.SX.sym(name) for name in ("mass", "rotor_speed", "twist", "rotor_speed_rate"))
        centre = ca.SX.sym("centre", 4)
        blocks = self._blocks()
        c = ca.SX.sym("c", sum(len(block) for block in blocks))
        power_c, tail_c, engine_c, node = ca.vertsplit(c, np.cumsum([0, *map(len, blocks)]).tolist())
        load_factor, speed, density, flying = ca.vertsplit(node)
        lower, upper = self.plant.lower.tolist(), self.plant.upper.tolist()
        middle = 0.5 * (lower[0] + upper[0])  # on the ground the power is a constant: any mass will do
        point, about = (
            [flying * mass * load_factor + (1 - flying) * middle, speed_, twist]
            for mass, speed_, twist in ((W, Omega, tw), ca.vertsplit(centre[:3]))
        )
        rotor_power = chebyshev.quadratic(
            power_c, point, about, POWER_DEGREES, lower=lower, upper=upper, kept=POWER_KEPT
        )
        tail_loading = chebyshev.quadratic(tail_c, point, about, TAIL_DEGREES, lower=lower, upper=upper)
        power = self.plant.engine_power(rotor_power, Omega, rate)
        power_about = ca.substitute(power, ca.vertcat(W, Omega, tw, rate), centre)
        fuel, temperature = _engine_about(
            self.plant.table, engine_c, (power, Omega / self._nominal), (power_about, centre[1] / self._nominal)
        )
        usages = self.plant.usages(
            W * load_factor,
            Omega,
            speed=speed,
            density=density,
            power=power,
            temperature=temperature,
            tail_loading=tail_loading,
        )
        limits = flying * ca.vertcat(*usages) - 1.0
        outputs = [self._engines * fuel, limits]
        return ca.Function("node", [W, Omega, tw, rate, c, centre], outputs), np.concatenate(blocks)

    def _blocks(self) -> tuple[np.ndarray, ...]:
        """Coefficients of the nodes, each (n, N): rotor power, tail loading, engine, flight condition."""
        speed, altitude, _, idle = self.flight[:, self.condition]
        density = standard_air(altitude, self.plant.isa_offset).density
        tables = (self.power_series, self.tail_series, self.engine_series)
        columns = [table.reshape(len(table), -1)[self.condition].T for table in tables]
        return (*columns, np.stack([self.load_factor, speed, density, 1.0 - idle]))

    @property
    def _nominal(self) -> float:
        return self.plant.limits.aircraft.main_rotor.nominal_rotor_speed

    @property
    def _engines(self) -> int:
        return self.plant.limits.aircraft.transmission.engines


def _engine_about(table: EngineTable, c: Any, point: tuple[Any, Any], centre: tuple[Any, Any]) -> list[Any]:
    """Fuel flow and temperature of one engine at power and speed ``point``, to second order about ``centre``."""
    x = ca.SX.sym("x", 2)
    about, away = ca.vertcat(*centre), ca.vertcat(*point) - ca.vertcat(*centre)
    results = []
    for value in table.function(x[0], x[1], c):
        hessian, gradient = ca.hessian(value, x)
        value, gradient, hessian = ca.substitute([value, gradient, hessian], [x], [about])
        results.append(value + ca.dot(gradient, away) + 0.5 * ca.bilin(hessian, away, away))
    return results


def _check_inside(points: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> None:
    """Raises :class:`InputError` that names the first variable outside the sampled box; nan passes, and shows."""
    allowance = 1e-6 * (upper - lower)
    names = ("load factor times mass", "rotor speed", "twist")
    for k, (name, unit) in enumerate(zip(names, ("kg", "rad/s", "rad"), strict=True)):
        outside = (points[..., k] < lower[k] - allowance[k]) | (points[..., k] > upper[k] + allowance[k])
        if np.any(outside):
            value = points[..., k][outside][0]
            raise InputError(f"surrogate: {name} = {value:.6g} {unit}: sampled from {lower[k]:g} to {upper[k]:g}")


def _flat(values: list[np.ndarray]) -> bool:
    return all(value.ndim <= 1 for value in values)
