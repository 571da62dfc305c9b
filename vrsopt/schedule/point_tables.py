"""Nodes of a surrogate aircraft at given masses: fuel flow and limits over rotor speed and twist, with derivatives.

The polynomials of :class:`vrsopt.schedule.surrogate_nodes.SurrogatePath` with the mass folded in and the rotor speed
steady: what is left has two variables, which makes a search over them cheap.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from vrsopt.atmosphere import standard_air
from vrsopt.schedule.jets import Jet, chain2
from vrsopt.surrogate import chebyshev
from vrsopt.surrogate.engine_table import SPEEDS

if TYPE_CHECKING:
    from vrsopt.schedule.surrogate_nodes import SurrogatePath

ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))  # of the derivatives, as the parts of a jet


@dataclass(frozen=True)
class PointTables:
    """N nodes in flight, the mass of each given.

    ``power`` (N, n_speed, n_twist) [W] and ``tail``: coefficients over rotor speed and twist; ``engine``
    (N, 2, n_power, n_ratio). ``speed`` [m/s], ``density`` [kg/m3], ``weight`` [kg] and ``faster``, by what the rotor
    speed is multiplied on the standard day of the rotors: (N,).
    """

    path: SurrogatePath
    power: np.ndarray
    tail: np.ndarray
    engine: np.ndarray
    weight: np.ndarray
    speed: np.ndarray
    density: np.ndarray
    faster: np.ndarray

    def values(self, rotor_speed: np.ndarray, twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Fuel flow (N, p, q) [kg/s] and limits (m, N, p, q) on the grid of rotor speeds (p,) and twists (q,) or, each
        node its own, (N, q)."""
        lower, upper = self.path.plant.lower, self.path.plant.upper
        turning = self.faster[:, None] * rotor_speed
        rotor_power, tail_loading = (
            _basis(turning, lower[1], upper[1], table.shape[1])
            @ table
            @ np.swapaxes(_basis(twist, lower[2], upper[2], table.shape[2]), -1, -2)
            for table in (self.power, self.tail)
        )
        plant, Omega = self.path.plant, rotor_speed[:, None]
        power = plant.engine_power(rotor_power, Omega, 0.0)
        low, high = plant.table.power_range
        by_speed = self.engine @ _basis(rotor_speed / self._nominal, *SPEEDS, self.engine.shape[3]).T
        inside = np.log(np.clip(power, low, high) + plant.table.power_shift)
        stretched = _basis(inside, *self._stretch, self.engine.shape[2])
        fuel, temperature = np.moveaxis(
            stretched @ np.moveaxis(by_speed, (1, 3), (3, 1)), -1, 0
        )  # beyond the engine's table its end: no aircraft is allowed there
        return self._engines * fuel, self._limits(Omega, power, temperature, tail_loading, (slice(None), None, None))

    def jets(self, node: np.ndarray, x: np.ndarray) -> tuple[Jet, Jet]:
        """Fuel flow (n,) [kg/s] and limits (m, n) at points ``x`` (n, 2) of the nodes ``node`` (n,)."""
        here, plant = self._at(node), self.path.plant
        Omega, twist = (Jet.variable(x[:, k], k) for k in (0, 1))
        turning = here.faster * x[:, 0]
        rotor_power, tail_loading = (here._polynomial(table, turning, x[:, 1]) for table in (here.power, here.tail))
        power = plant.engine_power(rotor_power, Omega, 0.0)
        ratio = Omega * (1.0 / self._nominal)
        both = chain2(here._engine_jet(power.value, ratio.value), power, ratio)
        fuel, temperature = (Jet(both.parts[:, k]) for k in (0, 1))
        return fuel * self._engines, here._limits(Omega, power, temperature, tail_loading, slice(None))

    def _at(self, node: np.ndarray) -> PointTables:
        arrays = (self.power, self.tail, self.engine, self.weight, self.speed, self.density, self.faster)
        return PointTables(self.path, *(array[node] for array in arrays))

    def _limits(self, Omega: Any, power: Any, temperature: Any, tail_loading: Any, spread: Any) -> Any:
        usages = self.path.plant.usages(
            self.weight[spread],
            Omega,
            speed=self.speed[spread],
            density=self.density[spread],
            power=power,
            temperature=temperature,
            tail_loading=tail_loading,
        )
        if isinstance(power, Jet):
            return Jet(np.stack([(usage - 1.0).parts for usage in usages], axis=1))
        return np.stack([np.broadcast_to(usage - 1.0, power.shape) for usage in usages])

    def _polynomial(self, table: np.ndarray, turning: np.ndarray, twist: np.ndarray) -> Jet:
        lower, upper = self.path.plant.lower, self.path.plant.upper
        by_speed = _basis_jet(turning, lower[1], upper[1], table.shape[1], self.faster)
        by_twist = _basis_jet(twist, lower[2], upper[2], table.shape[2])
        rows = [np.einsum("nab,nb->na", table, row) for row in by_twist]
        return Jet(np.stack([np.einsum("na,na->n", by_speed[i], rows[j]) for i, j in ORDERS]))

    def _engine_jet(self, power: np.ndarray, ratio: np.ndarray) -> Jet:
        """Fuel flow and temperature (2, n) of one engine as a jet in power and speed ratio; beyond the engine's table
        on a straight line."""
        table = self.path.plant.table
        inside = np.clip(power, *table.power_range)
        rate = 1.0 / (inside + table.power_shift)
        by_power = _basis_jet(-np.log(rate), *self._stretch, self.engine.shape[2])
        rows = [np.einsum("noab,nb->noa", self.engine, row) for row in _basis_jet(ratio, *SPEEDS, self.engine.shape[3])]
        parts = np.stack([np.einsum("na,noa->on", by_power[i], rows[j]) for i, j in ORDERS])
        parts[3] = (parts[3] - parts[1]) * rate**2
        parts[[1, 4]] *= rate
        outside = power - inside
        parts[3, :, outside != 0.0] = 0.0
        parts[0] += outside * parts[1]
        parts[2] += outside * parts[4]
        return Jet(parts)

    @property
    def _stretch(self) -> tuple[float, float]:
        table = self.path.plant.table
        low, high = (float(np.log(power + table.power_shift)) for power in table.power_range)
        return low, high

    @property
    def _nominal(self) -> float:
        return self.path.plant.limits.aircraft.main_rotor.nominal_rotor_speed

    @property
    def _engines(self) -> int:
        return self.path.plant.limits.aircraft.transmission.engines


def point_tables(path: SurrogatePath, mass: np.ndarray) -> PointTables:
    """The nodes of ``path``, all of them in flight, at masses (N,) [kg]."""
    speed, altitude, _, faster, heavier = path.flight[:, path.condition]
    weight = mass * path.load_factor
    lower, upper = path.plant.lower, path.plant.upper
    power, tail = (
        np.einsum("nm,nmab->nab", _basis(weight * heavier, lower[0], upper[0], series.shape[1]), series[path.condition])
        for series in (path.power_series, path.tail_series)
    )
    density = standard_air(altitude, path.plant.isa_offset).density
    return PointTables(path, power, tail, path.engine_series[path.condition], weight, speed, density, faster)


def _basis(points: np.ndarray, lower: float, upper: float, size: int) -> np.ndarray:
    return chebyshev.basis(points, lower, upper, size - 1)


def _basis_jet(
    points: np.ndarray, lower: float, upper: float, size: int, scale: np.ndarray | float = 1.0
) -> list[np.ndarray]:
    """T_0, ... of points (n,) and their first two derivatives, (n, size) each, by a variable of which the points are
    ``scale`` times."""
    value = _basis(points, lower, upper, size)
    rate = np.broadcast_to(2.0 / (upper - lower) * scale, points.shape)[:, None]
    slope = rate * (value @ _differentiation(size))
    return [value, slope, rate * (slope @ _differentiation(size))]


@lru_cache(maxsize=8)
def _differentiation(size: int) -> np.ndarray:
    """Matrix (size, size): T' = T @ matrix."""
    matrix = np.zeros((size, size))
    for n in range(1, size):
        matrix[:n, n] = np.polynomial.chebyshev.chebder(np.eye(size)[n])[:n]
    return matrix
