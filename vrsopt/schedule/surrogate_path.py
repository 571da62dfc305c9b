"""The aircraft along a mission from its surrogate: Kriging of the rotor power, then the engine's own equations.

Along given nodes the flight condition is fixed, so each Kriging shrinks to a Chebyshev polynomial in mass, rotor speed
and twist, and the engine's table to one in power and speed. The optimal-control problem, the pointwise search and the
re-flight all use these same polynomials; a test holds them to the Kriging itself.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from vrsopt.atmosphere import density_altitude, standard_air
from vrsopt.errors import InputError
from vrsopt.flat_pitch import flat_pitch_system
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.operating_point import Helicopter
from vrsopt.schedule.path_model import PathValues
from vrsopt.surrogate import chebyshev
from vrsopt.surrogate.design import reference_climb_sine
from vrsopt.surrogate.engine_table import EngineTable, engine_table
from vrsopt.surrogate.export import path_coefficients
from vrsopt.surrogate.kriging import KrigingState
from vrsopt.surrogate.store import Surrogate

if TYPE_CHECKING:
    from vrsopt.mission.profile import Conditions

# (mass, rotor speed, twist), by measurement: rms error of the fuel flow against the Kriging itself below 0.005 %
POWER_DEGREES = (4, 12, 8)
TAIL_DEGREES = (2, 8, 4)
LEAST_CORRELATION = 99.0  # per cent, leave-one-out: below it a surrogate is not fit to be optimised on


@dataclass(frozen=True)
class Plant:
    """What does not change along a mission: aircraft, limits, surrogate and engine table, for one ISA offset [K].

    ``kinetic_energy``: whether the power that speeds up the rotor is charged to the engines (and credited back).
    """

    helicopter: Helicopter
    limits: Limits
    surrogate: Surrogate
    isa_offset: float = 0.0
    kinetic_energy: bool = True
    force: bool = False

    def __post_init__(self) -> None:
        for name, accuracy in self.surrogate.accuracy.items():
            used = name in ("main_rotor_power", "climb_rotor_power", "descent_rotor_power", "tail_blade_loading")
            if used and accuracy.pearson_percent < LEAST_CORRELATION and not self.force:
                raise InputError(
                    f"surrogate: {name}: leave-one-out correlation {accuracy.pearson_percent:.2f} %: "
                    f"at least {LEAST_CORRELATION:g} % to optimise on it"
                )

    @property
    def table(self) -> EngineTable:
        """The engine's table on this day, built once per process."""
        return _table(self.helicopter, self.isa_offset)

    @property
    def idle_power(self) -> float:
        """Least power of an engine [W]: spin-down of the rotor is credited down to it, not below."""
        ratings = self.limits.engine.ratings
        return ratings.idle_power_ratio * ratings.take_off_power

    def path(self, conditions: Conditions) -> SurrogatePath:
        """The aircraft at the nodes of ``conditions``; raises :class:`InputError` where they leave the sampled box."""
        keys = np.stack(
            [conditions.speed, conditions.altitude, conditions.climb_angle, np.asarray(conditions.idle, dtype=float)]
        )
        unique, index = np.unique(keys, axis=1, return_inverse=True)
        tables = self._tables(*unique)
        return SurrogatePath(self, index.ravel(), np.asarray(conditions.load_factor, dtype=float), unique, *tables)

    def _tables(
        self, speed: np.ndarray, altitude: np.ndarray, climb_angle: np.ndarray, idle: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coefficients of rotor power (n, ...), tail-rotor loading (n, ...) and engine (n, 2, ...) at n conditions."""
        lower, upper = self._free_box()
        rotor_altitude = np.maximum(density_altitude(altitude, self.isa_offset), 0.0)
        power = np.zeros((len(speed), *(d + 1 for d in POWER_DEGREES)))
        tail = np.zeros((len(speed), *(d + 1 for d in TAIL_DEGREES)))
        flying = idle == 0
        slope = np.sin(climb_angle) / reference_climb_sine(speed)
        weights = {  # parabola through descent, level and climb
            "main_rotor_power": 1 - slope**2,
            "tail_rotor_power": 1 - slope**2,
            "climb_rotor_power": (slope**2 + slope) / 2,
            "descent_rotor_power": (slope**2 - slope) / 2,
        }
        for name, weight in weights.items():
            some = flying & (weight != 0)
            fixed = {"altitude": rotor_altitude[some], "speed": speed[some]}
            if np.any(some):
                series = path_coefficients(self.surrogate.models[name], fixed, lower, upper, POWER_DEGREES)
                power[some] += weight[some, None, None, None] * series
        if np.any(flying):
            fixed = {"altitude": rotor_altitude[flying], "speed": speed[flying]}
            model = self.surrogate.models["tail_blade_loading"]
            tail[flying] = path_coefficients(model, fixed, lower, upper, TAIL_DEGREES)
        for k in np.flatnonzero(~flying):
            power[k, 0, 0, 0] = self._idle_rotor_power(float(altitude[k]))
        mach = speed / standard_air(altitude, self.isa_offset).speed_of_sound
        return power, tail, self.table.contract(altitude, mach)

    def _idle_rotor_power(self, altitude: float) -> float:
        """Power of both rotors at flat pitch [W], nominal speed and twist."""
        rotor = self.helicopter.aircraft.main_rotor
        place = {"altitude": altitude, "isa_offset": self.isa_offset}
        solution = flat_pitch_system(self.helicopter.aircraft).solve(
            {**place, "rotor_speed": rotor.nominal_rotor_speed, "twist": rotor.twist}, method="newton"
        )
        if not solution.success:
            raise InputError(f"idle at {altitude:g} m: {solution.message}")
        return solution.outputs["main_rotor_power"] + solution.outputs["tail_rotor_power"]

    def _free_box(self) -> tuple[np.ndarray, np.ndarray]:
        """Sampled box of mass, rotor speed and twist."""
        state: KrigingState = self.surrogate.models["main_rotor_power"].state_
        columns = [state.names.index(name) for name in ("mass", "rotor_speed", "twist")]
        return state.lower[columns], state.upper[columns]


@lru_cache(maxsize=4)
def _table(machine: Helicopter, isa_offset: float) -> EngineTable:
    return engine_table(isa_offset=isa_offset, engine_data=machine.engine)


@dataclass(frozen=True)
class SurrogatePath:
    """:class:`vrsopt.schedule.path_model.PathModel` at N nodes that share n different flight conditions.

    ``condition`` (N,) says which; ``load_factor`` (N,). ``flight`` (4, n): speed [m/s], altitude [m], climb angle [rad],
    idle. A turn counts as the mass times its load factor.
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
    def bounds(self) -> dict[str, tuple[float, float]]:
        """Mass [kg], rotor speed [rad/s] and twist [rad] inside the sampled box at every node."""
        lower, upper = self.plant._free_box()
        flying = self.flight[3][self.condition] == 0
        factors = self.load_factor[flying] if np.any(flying) else np.ones(1)
        return {
            "mass": (float(lower[0] / np.min(factors)), float(upper[0] / np.max(factors))),
            "rotor_speed": (float(lower[1]), float(upper[1])),
            "twist": (float(lower[2]), float(upper[2])),
        }

    def nodes(self, index: np.ndarray) -> SurrogatePath:
        """The same aircraft at some of the nodes."""
        kept, condition = np.unique(self.condition[index], return_inverse=True)
        series = (self.power_series[kept], self.tail_series[kept], self.engine_series[kept])
        return SurrogatePath(self.plant, condition.ravel(), self.load_factor[index], self.flight[:, kept], *series)

    def evaluate(self, mass: Any, rotor_speed: Any, twist: Any, rotor_speed_rate: Any = 0.0) -> PathValues:
        """Fuel flow, power and limits; arguments broadcast to (N,) or (N, k)."""
        arrays = np.broadcast_arrays(
            *(np.asarray(value, dtype=float) for value in (mass, rotor_speed, twist, rotor_speed_rate))
        )
        shape = arrays[0].shape
        W, Omega, tw, rate = (np.broadcast_to(a.reshape(len(a), -1), (len(a), a[0].size)) for a in arrays)
        speed, altitude, _, idle = self.flight[:, self.condition][:, :, None]
        weight = W * self.load_factor[:, None]
        points = np.stack([np.where(idle > 0, self._middle_mass, weight), Omega, tw], axis=-1)
        rotor_power = self._series(self.power_series, points)
        tail_loading = self._series(self.tail_series, points)
        power = self._engine_power(rotor_power, Omega, rate)
        ratio = Omega / self._nominal
        fuel, temperature = self.plant.table.evaluate(self.engine_series[self.condition], power, ratio)
        density = standard_air(altitude, self.plant.isa_offset).density
        usages = self._usages(weight, Omega, speed, density, power, temperature, tail_loading)
        limits = np.stack([np.where(idle > 0, -1.0, usage - 1.0) for usage in usages])
        engines = self.plant.helicopter.aircraft.transmission.engines
        return PathValues(
            (engines * fuel).reshape(shape), np.asarray(power).reshape(shape), limits.reshape(len(LIMIT_NAMES), *shape)
        )

    def function(self) -> tuple[ca.Function, np.ndarray]:
        """One node as an SX function, and the coefficients (n_c, N) of the nodes."""
        W, Omega, tw, rate = (ca.SX.sym(name) for name in ("mass", "rotor_speed", "twist", "rotor_speed_rate"))
        blocks = self._blocks()
        c = ca.SX.sym("c", sum(len(block) for block in blocks))
        power_c, tail_c, engine_c, node = ca.vertsplit(c, np.cumsum([0, *map(len, blocks)]).tolist())
        load_factor, speed, density, flying = ca.vertsplit(node)
        lower, upper = (bound.tolist() for bound in self.plant._free_box())
        # in idle the surrogate is a constant: any mass will do
        point = [flying * W * load_factor + (1 - flying) * self._middle_mass, Omega, tw]
        rotor_power = chebyshev.expression(power_c, point, POWER_DEGREES, lower=lower, upper=upper)
        tail_loading = chebyshev.expression(tail_c, point, TAIL_DEGREES, lower=lower, upper=upper)
        power = self._engine_power(rotor_power, Omega, rate)
        fuel, temperature = self.plant.table.function(power, Omega / self._nominal, engine_c)
        usages = self._usages(W * load_factor, Omega, speed, density, power, temperature, tail_loading)
        limits = flying * ca.vertcat(*usages) - 1.0
        engines = self.plant.helicopter.aircraft.transmission.engines
        function = ca.Function("node", [W, Omega, tw, rate, c], [engines * fuel, limits])
        return function, np.concatenate(blocks)

    def _blocks(self) -> tuple[np.ndarray, ...]:
        """Coefficients of the nodes, each (n, N): rotor power, tail loading, engine, flight condition."""
        speed, altitude, _, idle = self.flight[:, self.condition]
        density = standard_air(altitude, self.plant.isa_offset).density
        tables = (self.power_series, self.tail_series, self.engine_series)
        columns = [table.reshape(len(table), -1)[self.condition].T for table in tables]
        return (*columns, np.stack([self.load_factor, speed, density, 1.0 - idle]))

    @property
    def _nominal(self) -> float:
        return self.plant.helicopter.aircraft.main_rotor.nominal_rotor_speed

    @property
    def _middle_mass(self) -> float:
        lower, upper = self.plant._free_box()
        return float((lower[0] + upper[0]) / 2)

    def _series(self, table: np.ndarray, points: np.ndarray) -> np.ndarray:
        lower, upper = self.plant._free_box()
        return chebyshev.evaluate(table[self.condition], points, lower=lower, upper=upper)

    def _engine_power(self, rotor_power: Any, Omega: Any, rate: Any) -> Any:
        """Power of one engine [W], with J Omega dOmega/dt, not below idle (rounded over about a kilowatt)."""
        inertia = self.plant.helicopter.aircraft.main_rotor.polar_inertia if self.plant.kinetic_energy else 0.0
        power = self.plant.helicopter.power_per_engine(rotor_power + inertia * Omega * rate)
        return smooth_max(power, self.plant.idle_power, 1e3)

    def _usages(
        self, weight: Any, Omega: Any, speed: Any, density: Any, power: Any, temperature: Any, tail: Any
    ) -> tuple[Any, ...]:
        """Usage of each limit, in the order of LIMIT_NAMES."""
        limits = self.plant.limits
        return (
            limits.blade_loading_usage(weight, density, Omega, speed, smooth_max=lambda a, b: smooth_max(a, b, 4e-4)),
            limits.power_usage(power),
            limits.torque_usage(power, Omega),
            limits.temperature_usage(temperature),
            limits.tail_usage(tail, Omega, speed),
        )


def smooth_max(a: Any, b: Any, width: float) -> Any:
    """The larger of two, rounded over about ``width``; at most width / 2 above it. Arrays and CasADi expressions."""
    return 0.5 * (a + b + ((a - b) ** 2 + width**2) ** 0.5)
