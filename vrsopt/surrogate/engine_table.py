"""One engine as a table: fuel flow and inter-turbine temperature over power, power-turbine speed, altitude and Mach.

A 4-D tensor of Chebyshev polynomials through the engine's own residual system, for one ISA offset: exact to 5e-7 of the
fuel flow, built in about a second, twice differentiable. Two axes are stretched: power as log(power + 0.096 of the
take-off rating), because fuel bends most at low power, and Mach squared, because the ram effect is even in Mach.

A mission knows altitude and Mach at its nodes: :meth:`EngineTable.contract` folds them in and leaves, for each node, a
polynomial in power and speed. Temperatures above the limit are tabulated like any other: the limit is the user's.
The gas generator's speed comes with them at no cost; :mod:`vrsopt.surrogate.emission_table` is built on it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca
import numpy as np

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.surrogate import chebyshev
from vrsopt.turboshaft.bulk import ManySolutions, solve_many
from vrsopt.turboshaft.data import EngineData, load_engine

Array = chebyshev.Array

POWER_RATIOS = (0.0479, 1.0544)  # of the take-off rating: 15 to 330 kW for the Allison 250-C20B
POWER_SHIFT = 0.096  # of the take-off rating, in the logarithm
SPEEDS = (0.70, 1.20)  # power-turbine speed, ratio
ALTITUDES = (-50.0, 2100.0)  # m
MACHS = (0.0, 0.24)
DEGREES = (20, 10, 6, 2)  # by measurement: one more in any of them changes the largest error by less than a half
# Of the power and speed axes: what fuel flow and temperature need of the tensor for 1e-6
KEPT = tuple(chebyshev.low_total_degree(DEGREES[:2], total) for total in (1.3, 0.9))
TABULATED = ("fuel_flow", "power_turbine_inlet_temperature", "gas_generator_speed")
CHECKS = 200  # random points on which the table states its own error


@dataclass(frozen=True, eq=False)
class EngineTable:
    """Table of one engine at one ISA offset [K]; build it with :func:`engine_table`.

    ``coefficients`` (2, n_power, n_speed, n_altitude, n_mach), first fuel flow [kg/s], then inter-turbine temperature
    [K]; ``generator_speed``: those of the gas generator's speed (ratio), of the shape of one of them. ``power_range``
    [W]. ``error`` is the largest relative error of the three at random check points.
    """

    isa_offset: float
    power_range: tuple[float, float]
    power_shift: float
    coefficients: Array = field(repr=False)
    generator_speed: Array = field(repr=False)
    error: tuple[float, float, float]

    @property
    def sizes(self) -> tuple[int, int]:
        """Numbers of coefficients (n_power, n_speed) of a node."""
        return self.coefficients.shape[1], self.coefficients.shape[2]

    @property
    def kept(self) -> tuple[Array | None, Array | None]:
        """Which coefficients of fuel flow and temperature at a node are not zero (None: all)."""
        return KEPT[0], KEPT[1]

    def contract(self, altitude: Array, mach: Array) -> Array:
        """Coefficients (N, 2, n_power, n_speed) of the nodes at pressure altitudes [m] and Mach numbers, both (N,).

        Raises :class:`InputError` for an altitude or Mach number outside the table.
        """
        return at_altitude_and_mach(self.coefficients, altitude, mach)

    def contract_generator(self, altitude: Array, mach: Array) -> Array:
        """Coefficients (N, n_power, n_speed) of the gas generator's speed at the nodes, as :meth:`contract`."""
        return at_altitude_and_mach(self.generator_speed, altitude, mach)

    def evaluate(self, nodes: Array, power: Array, speed: Array) -> tuple[Array, Array]:
        """Fuel flow [kg/s] and inter-turbine temperature [K] of one engine, of the shape of ``power``.

        ``nodes`` (N, 2, n_power, n_speed) from :meth:`contract`; ``power`` [W] and ``speed`` (ratio) broadcast to (N,)
        or (N, k). Power outside ``power_range`` continues as a parabola; speed outside the table is an error.
        """
        fuel, temperature = self.values(nodes, power, speed)
        return fuel, temperature

    def values(self, nodes: Array, power: Array, speed: Array) -> Array:
        """The m quantities whose coefficients ``nodes`` (N, m, n_power, n_speed) are, (m, N) or (m, N, k).

        Arguments as of :meth:`evaluate`.
        """
        power, speed = np.broadcast_arrays(np.asarray(power, dtype=float), np.asarray(speed, dtype=float))
        if power.ndim not in (1, 2) or power.shape[0] != len(nodes):
            raise InputError(f"engine table: power: shape {power.shape}: ({len(nodes)},) or ({len(nodes)}, k)")
        if np.any((speed < SPEEDS[0] - 1e-6) | (speed > SPEEDS[1] + 1e-6)):
            raise InputError(f"engine table: power-turbine speed: outside {SPEEDS[0]:g} to {SPEEDS[1]:g}")
        shape = power.shape
        power, speed = power.reshape(len(nodes), -1), speed.reshape(len(nodes), -1)
        inside: Array = np.asarray(np.clip(power, *self.power_range), dtype=np.float64)
        outside = power - inside
        # speed first: (N, m, n_power, k), then power, as in the CasADi form
        by_speed = np.einsum("noab,nkb->noak", nodes, chebyshev.basis(speed, *SPEEDS, self.sizes[1] - 1))
        value = self._by_power(by_speed, inside)
        if np.any(outside):
            slope, bend = self._derivatives(by_speed, inside)
            value = value + outside[:, None] * (slope + 0.5 * outside[:, None] * bend)
        return np.moveaxis(value, 1, 0).reshape(-1, *shape)

    def _by_power(self, table: Array, power: Array) -> Array:
        """(N, 2, k) from coefficients (N, 2, n, k) of the power axis."""
        stretched = np.log(power + self.power_shift)
        return np.einsum("noak,nka->nok", table, chebyshev.basis(stretched, *self._stretch, table.shape[2] - 1))

    def _derivatives(self, table: Array, power: Array) -> tuple[Array, Array]:
        """First and second derivative (N, 2, k) with respect to power."""
        scale = 2.0 / (self._stretch[1] - self._stretch[0])
        first, second = (
            np.asarray(np.polynomial.chebyshev.chebder(table, order, scl=scale, axis=2), dtype=np.float64)
            for order in (1, 2)
        )
        rate = 1.0 / (power + self.power_shift)[:, None]
        by_log, bend = self._by_power(first, power), self._by_power(second, power)
        return by_log * rate, (bend - by_log) * rate**2

    @property
    def _stretch(self) -> tuple[float, float]:
        low, high = (float(np.log(power + self.power_shift)) for power in self.power_range)
        return low, high

    @cached_property
    def function(self) -> ca.Function:
        """SX Function (power, speed, c) -> (fuel_flow, temperature) of one node, twice differentiable everywhere.

        ``c`` is a column of ``contract(...).reshape(N, -1).T``. Outside ``power_range`` it continues as a parabola in
        power, so that the iterates of an NLP stay finite.
        """
        power, speed = ca.SX.sym("power"), ca.SX.sym("speed")
        size = self.sizes[0] * self.sizes[1]
        c = ca.SX.sym("c", 2 * size)
        results = [
            self.expression(power, speed, table, kept)
            for table, kept in zip(ca.vertsplit(c, size), self.kept, strict=True)
        ]
        return ca.Function("engine_node", [power, speed, c], results, ["power", "speed", "c"], ["fuel", "temperature"])

    def expression(self, power: Any, speed: Any, table: Any, kept: Array | None = None) -> Any:
        """One quantity at power [W] and speed (ratio) from its coefficients (SX column, C order) at a node.

        ``kept`` (n_power, n_speed): those that are not zero.
        """
        lower, upper = zip(self._stretch, SPEEDS, strict=True)
        inside = ca.fmax(ca.fmin(power, self.power_range[1]), self.power_range[0])
        outside, rate, log_power = power - inside, 1.0 / (inside + self.power_shift), ca.SX.sym("log_power")
        degrees = tuple(size - 1 for size in self.sizes)
        value = chebyshev.expression(table, [log_power, speed], degrees, lower=lower, upper=upper, kept=kept)
        first = ca.jacobian(value, log_power)
        second = ca.jacobian(first, log_power)
        value, first, second = ca.substitute([value, first, second], [log_power], [ca.log(inside + self.power_shift)])
        slope, bend = first * rate, (second - first) * rate**2
        return value + outside * (slope + 0.5 * outside * bend)


def engine_table(*, isa_offset: float = 0.0, engine_data: EngineData | None = None) -> EngineTable:
    """The table of an engine (default the shipped one) at one ISA offset [K], made once in a process.

    Raises :class:`NoSolutionError` when the engine can not be solved somewhere in the table's box.
    """
    data = engine_data if engine_data is not None else load_engine()
    return _tabulated(data.model_dump_json(), isa_offset)


@lru_cache(maxsize=8)
def _tabulated(text: str, isa_offset: float) -> EngineTable:
    data = EngineData.model_validate_json(text)
    rating = data.ratings.take_off_power
    power_range = (POWER_RATIOS[0] * rating, POWER_RATIOS[1] * rating)
    shift = POWER_SHIFT * rating
    low, high = (float(np.log(power + shift)) for power in power_range)
    lower, upper = zip((low, high), SPEEDS, ALTITUDES, _squared(MACHS), strict=True)

    def solved(points: Array) -> Array:
        flat = points.reshape(-1, 4)
        zero = np.zeros(len(flat))
        columns = (
            np.exp(flat[:, 0]) - shift,
            flat[:, 1],
            flat[:, 2],
            zero + isa_offset,
            np.sqrt(flat[:, 3]),
            zero,
            zero,
            zero,
        )
        answer = solve_many(np.column_stack(columns), engine_data=data)
        _all_solved(answer, data.name, isa_offset)
        return np.stack([answer.outputs[name] for name in TABULATED]).reshape(-1, *points.shape[:-1])

    table = chebyshev.coefficients(solved(chebyshev.grid(lower, upper, DEGREES)), 4)
    table[:2] *= np.array(KEPT)[..., None, None]
    checks = np.random.default_rng(0).uniform(lower, upper, (CHECKS, 4))
    error = np.abs(chebyshev.evaluate(table, checks, lower=lower, upper=upper) / solved(checks) - 1.0).max(axis=1)
    return EngineTable(isa_offset, power_range, shift, table[:2], table[2], (error[0], error[1], error[2]))


def at_altitude_and_mach(coefficients: Array, altitude: Array, mach: Array) -> Array:
    """Coefficients (N, ...) at pressure altitudes [m] and Mach numbers (N,), of a table whose last two axes they are.

    Raises :class:`InputError` for an altitude or Mach number outside the table.
    """
    points = np.column_stack([np.atleast_1d(altitude), np.atleast_1d(mach)]).astype(float)
    for name, column, (low, high) in (("altitude", points[:, 0], ALTITUDES), ("mach", points[:, 1], MACHS)):
        bad = np.flatnonzero(~((column >= low) & (column <= high)))
        if bad.size:
            raise InputError(f"engine table: {name} = {column[bad[0]]:g}: {low:g} to {high:g}")
    points[:, 1] **= 2
    lower, upper = zip(ALTITUDES, _squared(MACHS), strict=True)
    axes = (coefficients.ndim - 2, coefficients.ndim - 1)
    return chebyshev.contract(coefficients, axes, points, lower=lower, upper=upper)


def _squared(bounds: tuple[float, float]) -> tuple[float, float]:
    return bounds[0] ** 2, bounds[1] ** 2


def _all_solved(answer: ManySolutions, name: str, isa_offset: float) -> None:
    if answer.failures:
        count, message = len(answer.failures), next(iter(answer.failures.values()))
        raise NoSolutionError(f"{name}: table at ISA{isa_offset:+g} K: {count} points not solved; first: {message}")
