"""NOx and CO of one engine as a table, built on the engine's own: over gas-generator speed, altitude and Mach.

What the combustor sees (pressure, temperature, air and fuel at its inlet) is set by the gas generator: at one speed of
it the power turbine changes these by less than 0.1 %. So the logarithm of each emission index is a polynomial in three
variables, and the exact fuel flow makes it a flow. The gas generator's speed comes from the engine's table.

NOx is tabulated for every fit of the combustor (:func:`vrsopt.combustor.emissions.reactor_fits`), CO and CO2 for the
shipped one. The air is dry, as the standard atmosphere's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np

from vrsopt.combustor.emissions import SHIPPED, emissions_many
from vrsopt.errors import NoSolutionError
from vrsopt.surrogate import chebyshev
from vrsopt.surrogate.engine_table import (
    ALTITUDES,
    MACHS,
    SPEEDS,
    EngineTable,
    at_altitude_and_mach,
    engine_table,
)
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.cycle import Mode
from vrsopt.turboshaft.data import EngineData

Array = chebyshev.Array

DEGREES = (20, 3, 2)  # gas-generator speed, altitude, Mach squared; by measurement: NOx to 0.1 % above 30 kW
SPEED = 0.95  # of the power turbine (ratio), at which the table is made: the middle of its range
BEYOND = 0.002  # of the gas generator's speed: by which the table reaches past the largest and smallest of the engine's
CHECKS = 60  # random points of the engine table's box on which the table states its own error


@dataclass(frozen=True, eq=False)
class EmissionTable:
    """Table of one engine at one ISA offset; build it with :func:`emission_table`.

    ``coefficients`` (m, n_speed, n_altitude, n_mach) of the logarithm of the indices [kg/kg] ``names``: "nox", "co" and
    "co2" of the shipped fit of the combustor, then "nox_NAME" of every other. ``speed_range``: of the gas generator.
    ``error``: largest relative error of each at random check points.
    """

    engine: EngineTable
    names: tuple[str, ...]
    speed_range: tuple[float, float]
    coefficients: Array = field(repr=False)
    error: Mapping[str, float]

    def only(self, names: Sequence[str]) -> EmissionTable:
        """The same table of some of its ``names``, in the order given."""
        rows = [self.names.index(name) for name in names]
        error = {name: self.error[name] for name in names}
        return replace(self, names=tuple(names), coefficients=self.coefficients[rows], error=error)

    def contract(self, altitude: Array, mach: Array) -> tuple[Array, Array]:
        """Coefficients at the nodes, altitude [m] and Mach number (N,): those of the gas generator's speed
        (N, n_power, n_speed), and those of the indices (N, m, n).

        Raises :class:`InputError` for an altitude or Mach number outside the table.
        """
        indices = at_altitude_and_mach(self.coefficients, altitude, mach)
        return self.engine.contract_generator(altitude, mach), indices

    def evaluate(self, nodes: tuple[Array, Array], fuel_flow: Array, power: Array, speed: Array) -> dict[str, Array]:
        """Flows of one engine [kg/s] by name, each of the shape of ``power``.

        ``nodes`` from :meth:`contract`; fuel flow [kg/s], power [W] and power-turbine speed (ratio) of one engine
        broadcast to (N,) or (N, k). Past the ends of the engine's table they go on smoothly, as it does.
        """
        generator, indices = nodes
        turning = self.engine.values(generator[:, None], power, speed)[0]
        flat = turning.reshape(len(generator), -1)
        inside = np.clip(flat, *self.speed_range)
        outside, scale = (flat - inside)[:, None], 2.0 / (self.speed_range[1] - self.speed_range[0])
        value, slope, bend = (
            np.einsum(
                "nma,nka->nmk",
                np.polynomial.chebyshev.chebder(indices, order, scl=scale, axis=2),
                chebyshev.basis(inside, *self.speed_range, DEGREES[0] - order),
            )
            for order in range(3)
        )
        index = np.exp(value + outside * (slope + 0.5 * outside * bend))
        flows = fuel_flow * np.moveaxis(index, 1, 0).reshape(-1, *turning.shape)
        return dict(zip(self.names, flows, strict=True))

    @cached_property
    def function(self) -> ca.Function:
        """SX Function (fuel_flow, power, speed, c) -> flows [kg/s] (m,) of one engine at one node, in the order of
        ``names``, twice differentiable everywhere.

        ``c``: a column of both results of :meth:`contract`, each reshaped to (N, -1) and transposed, one over the
        other. It continues past the ends of the engine's table as that does.
        """
        fuel_flow, power, speed = ca.SX.sym("fuel_flow"), ca.SX.sym("power"), ca.SX.sym("speed")
        size, each = self.engine.sizes[0] * self.engine.sizes[1], DEGREES[0] + 1
        c = ca.SX.sym("c", size + len(self.names) * each)
        turning = self.engine.expression(power, speed, c[:size])
        low, high = self.speed_range
        at, inside = ca.SX.sym("at"), ca.fmax(ca.fmin(turning, high), low)
        outside = turning - inside
        flows = []
        for table in ca.vertsplit(c[size:], each):
            value = chebyshev.expression(table, [at], DEGREES[:1], lower=(low,), upper=(high,))
            first = ca.jacobian(value, at)
            parts = ca.substitute([value, first, ca.jacobian(first, at)], [at], [inside])
            flows.append(fuel_flow * ca.exp(parts[0] + outside * (parts[1] + 0.5 * outside * parts[2])))
        return ca.Function("emission_node", [fuel_flow, power, speed, c], [ca.vertcat(*flows)])


def emission_table(*, engine_data: EngineData, isa_offset: float = 0.0) -> EmissionTable:
    """The table of an engine at one ISA offset [K], made once in a process, in a second or two.

    Raises :class:`NoSolutionError` where gas path or combustor can not be solved.
    """
    return _tabulated(engine_data.model_dump_json(), isa_offset)


@lru_cache(maxsize=8)
def _tabulated(text: str, isa_offset: float) -> EmissionTable:
    data = EngineData.model_validate_json(text)
    table = engine_table(isa_offset=isa_offset, engine_data=data)
    low, high = _speed_range(table)
    lower, upper = zip((low, high), ALTITUDES, (MACHS[0] ** 2, MACHS[1] ** 2), strict=True)
    grid = chebyshev.grid(lower, upper, DEGREES)
    flat = grid.reshape(-1, 3)
    rows = (flat[:, 0], np.full(len(flat), SPEED), flat[:, 1], np.sqrt(flat[:, 2]))
    solved = _indices(data, isa_offset, "gas_generator_speed", rows)
    _all_known(solved, rows, f"{data.name}: table of emissions at ISA{isa_offset:+g} K")
    values = np.log(np.stack(list(solved.values()))).reshape(len(solved), *grid.shape[:-1])
    made = EmissionTable(table, tuple(solved), (low, high), chebyshev.coefficients(values, 3), {})
    return replace(made, error=_errors(made, data))


def _speed_range(table: EngineTable) -> tuple[float, float]:
    """Least and largest speed of the gas generator (ratio) in the engine's table."""
    ends = np.linspace(0.0, 1.0, 9)
    places = np.stack(np.meshgrid(*(low + ends * (high - low) for low, high in (ALTITUDES, MACHS))), axis=-1)
    nodes = at_altitude_and_mach(table.generator_speed, *places.reshape(-1, 2).T)[:, None]
    turning = [
        table.values(nodes, np.full(len(nodes), power), np.full(len(nodes), speed))
        for power in table.power_range
        for speed in SPEEDS[0] + ends * (SPEEDS[1] - SPEEDS[0])
    ]
    return float(np.min(turning)) * (1.0 - BEYOND), float(np.max(turning)) * (1.0 + BEYOND)


def _indices(data: EngineData, isa_offset: float, mode: Mode, rows: tuple[Array, ...]) -> dict[str, Array]:
    """Emission indices [kg/kg] by name of the table, each (N,), at rows (N,) of demand, power-turbine speed, altitude
    and Mach; nan where gas path or combustor was not solved."""
    demand, speed, altitude, mach = rows
    zero = np.zeros(len(demand))
    columns = (demand, speed, altitude, zero + isa_offset, mach, zero, zero, zero)
    answer = solve_many(np.column_stack(columns), mode=mode, engine_data=data)
    return {name: flow / answer.outputs["fuel_flow"] for name, flow in flows_of_fits(data, answer.outputs).items()}


def _all_known(indices: Mapping[str, Array], rows: tuple[Array, ...], where: str) -> None:
    for name, values in indices.items():
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            speed, _, altitude, _ = (column[bad[0]] for column in rows)
            place = f"gas generator at {100 * speed:.1f} %, {altitude:.0f} m"
            raise NoSolutionError(f"{where}: {name}: {len(bad)} points not solved, first with the {place}")


def flows_of_fits(data: EngineData, states: Mapping[str, Array]) -> dict[str, Array]:
    """Flows of one engine in dry air [kg/s], (N,): "nox", "co" and "co2" of the shipped fit of its combustor, and
    "nox_NAME" of every other fit.

    ``states``: outputs of the gas path by name, (N,) each. Where a combustor was not solved its flows are nan.
    """
    flows = emissions_many(data, states, 0.0)
    return {name: flow for name, flow in flows.items() if name not in ("nox_low", "nox_high", f"nox_{SHIPPED}")}


def _errors(table: EmissionTable, data: EngineData) -> dict[str, float]:
    """Largest relative error of each index at those of some random points of the engine table's box that are solved."""
    low, high = np.array([table.engine.power_range, SPEEDS, ALTITUDES, MACHS]).T
    rows = tuple(np.random.default_rng(0).uniform(low, high, (CHECKS, 4)).T)
    exact = _indices(data, table.engine.isa_offset, "power", rows)
    power, speed, altitude, mach = rows
    found = table.evaluate(table.contract(altitude, mach), np.ones(CHECKS), power, speed)
    return {name: float(np.nanmax(np.abs(found[name] / exact[name] - 1.0))) for name in table.names}
