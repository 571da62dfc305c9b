"""The nodes of a surrogate aircraft: fuel flow, power and limits of free mass, rotor speed and twist, as arrays and as
CasADi expressions of the same polynomials."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca
import numpy as np

from vrsopt.atmosphere import standard_air
from vrsopt.errors import InputError
from vrsopt.limits import LIMIT_NAMES
from vrsopt.schedule.ground_idle import ground_idle_emissions
from vrsopt.schedule.path_model import PathValues
from vrsopt.schedule.path_quantities import EMITTED, QUANTITY_NAMES, checked_quantities, second_order
from vrsopt.schedule.plant import Plant
from vrsopt.schedule.point_tables import PointTables, point_tables
from vrsopt.schedule.rotor_tables import POWER_DEGREES, POWER_KEPT, TAIL_DEGREES
from vrsopt.surrogate import chebyshev
from vrsopt.surrogate.emission_table import EmissionTable
from vrsopt.surrogate.engine_table import SPEEDS

GROUND_IDLE, FLAT_PITCH, FLYING = 0.0, 1.0, 2.0  # kinds of condition


@dataclass(frozen=True)
class SurrogatePath:
    """:class:`vrsopt.schedule.path_model.PathModel` at N nodes that share n different flight conditions.

    ``condition`` (N,) says which; ``load_factor`` (N,). ``flight`` (5, n): speed [m/s], altitude [m], kind, and what
    speeds and masses are multiplied by on the standard day of the rotors. A turn counts as the mass times its load
    factor. ``burned`` (2, n): power [W] and fuel flow [kg/s] of one engine at ground idle.
    """

    plant: Plant
    condition: np.ndarray
    load_factor: np.ndarray
    flight: np.ndarray
    power_series: np.ndarray = field(repr=False)
    tail_series: np.ndarray = field(repr=False)
    engine_series: np.ndarray = field(repr=False)
    burned: np.ndarray = field(repr=False)

    limit_names = LIMIT_NAMES
    quantity_names = QUANTITY_NAMES

    @property
    def polar_inertia(self) -> float:
        """Of the rotor and all that turns with it [kg m2]; zero without kinetic energy."""
        return self.plant.polar_inertia

    @property
    def engine_share(self) -> float:
        """Power of one engine per power at the main rotor's shaft."""
        drive = self.plant.limits.aircraft.transmission
        return drive.power_per_engine(1.0) - drive.power_per_engine(0.0)

    @property
    def bounds(self) -> dict[str, tuple[Any, Any]]:
        """Mass (N,) [kg], by its load factor, rotor speed [rad/s] and twist [rad] inside the sampled box, as the day of
        the mission sees it."""
        lower, upper = self.plant.lower, self.plant.upper
        _, _, kind, faster, heavier = self.flight
        flying, scale = (kind == FLYING)[self.condition], heavier[self.condition] * self.load_factor
        slowest, fastest = (ratio * self._nominal for ratio in SPEEDS)  # of the engine's table
        return {
            "mass": (np.where(flying, lower[0] / scale, 0.0), np.where(flying, upper[0] / scale, np.inf)),
            "rotor_speed": (max(slowest, float(lower[1] / faster.min())), min(fastest, float(upper[1] / faster.max()))),
            "twist": (float(lower[2]), float(upper[2])),
        }

    @property
    def stated_limits(self) -> dict[str, tuple[float, str]]:
        """What a usage of 1 stands for, by the name of the limit: a number and its unit, for people."""
        return self.plant.limits.stated

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
            burned=self.burned[:, kept],
        )

    def at_mass(self, mass: np.ndarray) -> PointTables | None:
        """The nodes at masses (N,) [kg], to be searched; None where one of them stands on the ground."""
        return point_tables(self, mass) if np.all(self.flight[2] == FLYING) else None

    def evaluate(self, mass: Any, rotor_speed: Any, twist: Any, rotor_speed_rate: Any = 0.0) -> PathValues:
        """Fuel flow, power and limits; arguments broadcast to (N,) or (N, k). Outside the sampled box: InputError."""
        values = [np.asarray(value, dtype=float) for value in (mass, rotor_speed, twist, rotor_speed_rate)]
        shape = np.broadcast_shapes(*(value.shape for value in values), (len(self.condition),) if _flat(values) else ())
        W, Omega, tw, rate = (value[:, None] if value.ndim == 1 else value for value in values)
        speed, altitude, kind, faster, heavier = self.flight[:, self.condition][:, :, None]
        weight, flying = W * self.load_factor[:, None], kind == FLYING
        lower, upper = self.plant.lower, self.plant.upper
        point = np.broadcast_arrays(np.where(flying, weight * heavier, 0.5 * (lower[0] + upper[0])), Omega * faster, tw)
        points = np.stack(point, axis=-1)
        scales = np.broadcast_arrays(heavier, faster, 1.0)
        _check_inside(points, lower, upper, np.stack(scales, axis=-1))
        rotor_power = chebyshev.evaluate(
            self.power_series[self.condition], points, lower=lower, upper=upper, extrapolate=True
        )
        tail_loading = chebyshev.evaluate(
            self.tail_series[self.condition], points, lower=lower, upper=upper, extrapolate=True
        )
        power = self.plant.engine_power(rotor_power, Omega, rate)
        ratio = np.broadcast_to(Omega / self._nominal, power.shape)
        fuel, temperature = self.plant.table.evaluate(self.engine_series[self.condition], power, ratio)
        power, fuel = (
            np.where(kind == GROUND_IDLE, own[self.condition][:, None], value)
            for own, value in zip(self.burned, (power, fuel), strict=True)
        )
        usages = self.plant.usages(
            weight,
            Omega,
            speed=speed,
            density=standard_air(altitude, self.plant.isa_offset).density,
            power=power,
            temperature=temperature,
            tail_loading=tail_loading,
        )
        limits = np.stack([np.broadcast_to(np.where(flying, usage - 1.0, -1.0), power.shape) for usage in usages])
        return PathValues(
            (self._engines * fuel).reshape(shape), power.reshape(shape), limits.reshape(len(LIMIT_NAMES), *shape)
        )

    def emissions(self, fuel_flow: np.ndarray, power_per_engine: np.ndarray, rotor_speed: Any) -> dict[str, np.ndarray]:
        """Emissions of all engines [kg/s] by name, each (N, k); see the protocol."""
        speed, altitude = self.flight[:2]
        flows = self.plant.emissions(
            altitude,
            self.plant.mach(speed, altitude),
            self.condition,
            fuel_flow=fuel_flow,
            power=power_per_engine,
            rotor_speed=rotor_speed,
        )
        for k, indices in self._ground_idle_indices():
            here = self.condition == k
            for name, index in indices.items():
                flows[name][here] = index * fuel_flow[here]
        return flows

    def function(self, quantities: Sequence[str] = ()) -> tuple[ca.Function, np.ndarray]:
        """One node as an SX function, exact to second order about its last input, and the coefficients (n_c, N).

        With ``quantities``, some of ``quantity_names``, these follow as a third output. Emissions need the emission
        table, and raise what making that raises.
        """
        wanted = checked_quantities(quantities, self.quantity_names)
        W, Omega, tw, rate = (ca.SX.sym(name) for name in ("mass", "rotor_speed", "twist", "rotor_speed_rate"))
        centre = ca.SX.sym("centre", 4)
        table, burned = self._emission_blocks(wanted)
        blocks = (*self._blocks(), *burned)
        c = ca.SX.sym("c", sum(len(block) for block in blocks))
        power_c, tail_c, engine_c, node, *emission_c = ca.vertsplit(c, np.cumsum([0, *map(len, blocks)]).tolist())
        load_factor, speed, density, flying, faster, heavier, running, idle_power, idle_fuel = ca.vertsplit(node)
        lower, upper = self.plant.lower.tolist(), self.plant.upper.tolist()
        middle = 0.5 * (lower[0] + upper[0])  # on the ground the power is a constant: any mass will do
        point, about = (
            [flying * mass * load_factor * heavier + (1 - flying) * middle, speed_ * faster, twist]
            for mass, speed_, twist in ((W, Omega, tw), ca.vertsplit(centre[:3]))
        )
        rotor_power = chebyshev.quadratic(
            power_c, point, about, POWER_DEGREES, lower=lower, upper=upper, kept=POWER_KEPT
        )
        tail_loading = chebyshev.quadratic(tail_c, point, about, TAIL_DEGREES, lower=lower, upper=upper)
        power = self.plant.engine_power(rotor_power, Omega, rate)
        power_about = ca.substitute(power, ca.vertcat(W, Omega, tw, rate), centre)
        x = ca.SX.sym("x", 2)  # power and speed of the power turbine
        at = (power, Omega / self._nominal), (power_about, centre[1] / self._nominal)
        fuel, temperature = second_order(self.plant.table.function.call([x[0], x[1], engine_c]), x, *at)
        flown = {"speed": speed, "density": density, "power": power, "temperature": temperature}
        usages = self.plant.usages(W * load_factor, Omega, tail_loading=tail_loading, **flown)
        limits = flying * ca.vertcat(*usages) - 1.0
        outputs = [self._engines * (running * fuel + idle_fuel), limits]
        if wanted:
            shaft = running * power + idle_power
            values = {
                "power_per_engine": shaft,
                "rotor_power": rotor_power,
                "torque": self._engines * shaft / Omega,
                "turbine_temperature": temperature,
                "blade_loading": flying * self.plant.limits.blade_loading(W * load_factor, density, Omega, speed)[0],
            }
            if table:
                index = ca.vertsplit(table.function(1.0, x[0], x[1], emission_c[0]))
                flows = running * fuel * ca.vertcat(*second_order(index, x, *at)) + idle_fuel * emission_c[1]
                values |= dict(zip(table.names, ca.vertsplit(self._engines * flows), strict=True))
            outputs.append(ca.vertcat(*(values[name] for name in wanted)))
        return ca.Function("node", [W, Omega, tw, rate, c, centre], outputs), np.concatenate(blocks)

    def _emission_blocks(self, wanted: Sequence[str]) -> tuple[EmissionTable | None, tuple[np.ndarray, ...]]:
        """The table of the emissions among ``wanted``, and coefficients of the nodes, each (n, N): those of the table,
        and the indices [kg/kg] at ground idle; nothing if none of them is wanted."""
        names = tuple(name for name in EMITTED if name in wanted)
        if not names:
            return None, ()
        table = self.plant.emission_table.only(names)
        speed, altitude, kind = self.flight[:3]
        series = table.contract(altitude, self.plant.mach(speed, altitude))
        indices = np.zeros((len(names), len(kind)))
        for k, known in self._ground_idle_indices():
            indices[:, k] = [known[name] for name in names]
        both = np.concatenate([part.reshape(len(kind), -1) for part in series], axis=1)
        return table, (both[self.condition].T, indices[:, self.condition])

    def _ground_idle_indices(self) -> Iterator[tuple[int, Mapping[str, float]]]:
        """Each condition at ground idle, and its emission indices [kg/kg] by name."""
        for k in np.flatnonzero(self.flight[2] == GROUND_IDLE):
            place = {"altitude": float(self.flight[1, k]), "isa_offset": self.plant.isa_offset}
            yield int(k), ground_idle_emissions(self.plant.limits.engine, **place)

    def _blocks(self) -> tuple[np.ndarray, ...]:
        """Coefficients of the nodes, each (n, N): rotor power, tail loading, engine, flight condition."""
        speed, altitude, kind, faster, heavier = self.flight[:, self.condition]
        density = standard_air(altitude, self.plant.isa_offset).density
        tables = (self.power_series, self.tail_series, self.engine_series)
        columns = [table.reshape(len(table), -1)[self.condition].T for table in tables]
        flying, running = (kind == FLYING).astype(float), (kind != GROUND_IDLE).astype(float)
        idle = self.burned[:, self.condition]
        return (*columns, np.stack([self.load_factor, speed, density, flying, faster, heavier, running, *idle]))

    @property
    def _nominal(self) -> float:
        return self.plant.limits.aircraft.main_rotor.nominal_rotor_speed

    @property
    def _engines(self) -> int:
        return self.plant.limits.aircraft.transmission.engines


def _check_inside(points: np.ndarray, lower: np.ndarray, upper: np.ndarray, scales: np.ndarray) -> None:
    """Raises :class:`InputError` that names the first variable outside the sampled box; nan passes, and shows.

    ``scales`` (..., 3): by which the points were multiplied to be those of the standard day.
    """
    allowance = 1e-6 * (upper - lower)
    names = ("load factor times mass", "rotor speed", "twist")
    for k, (name, unit) in enumerate(zip(names, ("kg", "rad/s", "rad"), strict=True)):
        outside = (points[..., k] < lower[k] - allowance[k]) | (points[..., k] > upper[k] + allowance[k])
        if np.any(outside):
            scale = np.broadcast_to(scales[..., k], outside.shape)[outside][0]
            value, low, high = (number / scale for number in (points[..., k][outside][0], lower[k], upper[k]))
            raise InputError(f"surrogate: {name} = {value:.6g} {unit}: sampled from {low:g} to {high:g}")


def _flat(values: list[np.ndarray]) -> bool:
    return all(value.ndim <= 1 for value in values)
