"""One engine whose power turbine runs at its own best speed: a continuously variable transmission to the rotor.

At every power the speed of least fuel within the engine table's range of speeds. Below about a third of the take-off
power the best speed is below that range: there its lower end is used, which the fuel feels by less than 1 % down to a
fifth. At a flight condition fuel flow, temperature and gas-generator speed are then polynomials in power alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vrsopt.surrogate import chebyshev
from vrsopt.surrogate.chebyshev import Array
from vrsopt.surrogate.engine_table import SPEEDS, EngineTable

DEGREE = 40  # in power: 2e-5 of the fuel flow, where the best speed leaves the range
SEARCHED = 41  # speeds among which the best one is found first
SWEEPS = 4  # of Newton's method from there
CHUNK = 200  # conditions at a time


class BestSpeedTable(EngineTable):
    """An :class:`EngineTable` that takes the speed of least fuel in place of the one that it is given."""

    @classmethod
    def of(cls, table: EngineTable) -> BestSpeedTable:
        """The same engine with the other transmission."""
        return cls(
            table.isa_offset,
            table.power_range,
            table.power_shift,
            table.coefficients,
            table.generator_speed,
            table.error,
        )

    @property
    def sizes(self) -> tuple[int, int]:
        """Numbers of coefficients (n_power, n_speed) of a node: none for the speed."""
        return DEGREE + 1, 1

    @property
    def kept(self) -> tuple[None, None]:
        """Which coefficients of fuel flow and temperature are not zero: all."""
        return None, None

    def contract(self, altitude: Array, mach: Array) -> Array:
        """Coefficients (N, 2, n_power, 1) of fuel flow and temperature; see :meth:`EngineTable.contract`."""
        return self._at_best(altitude, mach)[:, :2]

    def contract_generator(self, altitude: Array, mach: Array) -> Array:
        """Coefficients (N, n_power, 1) of the gas generator's speed."""
        return self._at_best(altitude, mach)[:, 2]

    def best_speed(self, altitude: Array, mach: Array, power: Array) -> Array:
        """The speed of least fuel (N, k), ratio, at ``power`` (k,) [W] of one engine at nodes (N,)."""
        return self._best(super().contract(altitude, mach)[:, 0], np.asarray(power, dtype=float))

    def _at_best(self, altitude: Array, mach: Array) -> Array:
        """Coefficients (N, 3, n_power, 1)."""
        generator = super().contract_generator(altitude, mach)
        series = np.concatenate([super().contract(altitude, mach), generator[:, None]], axis=1)
        angle = np.pi * (np.arange(2 * DEGREE + 1) + 0.5) / (2 * DEGREE + 1)
        low, high = self._stretch
        power = np.exp(low + 0.5 * (high - low) * (np.cos(angle) + 1.0)) - self.power_shift
        fitted = [self._fitted(part, np.cos(angle), power) for part in np.array_split(series, -(-len(series) // CHUNK))]
        return np.concatenate(fitted)[..., None]

    def _fitted(self, series: Array, x: Array, power: Array) -> Array:
        """Least squares at Chebyshev points ``x`` (k,), the powers [W]: close to the best of all polynomials."""
        speed = self._best(series[:, 0], power)
        by_power = np.einsum("noab,ka->nokb", series, self._power_basis(power))
        values = np.einsum("nokb,nkb->nok", by_power, chebyshev.basis(speed, *SPEEDS, series.shape[3] - 1))
        fit = np.polynomial.chebyshev.chebfit(x, values.reshape(-1, len(x)).T, DEGREE)
        return np.asarray(fit.T.reshape(*values.shape[:2], -1), dtype=np.float64)

    def _best(self, fuel: Array, power: Array) -> Array:
        """Speed of least fuel (n, k) from the coefficients of the fuel flow (n, n_power, n_speed)."""
        by_power = np.einsum("nab,ka->nkb", fuel, self._power_basis(power))
        tried = np.linspace(*SPEEDS, SEARCHED)
        speed = tried[np.argmin(by_power @ chebyshev.basis(tried, *SPEEDS, fuel.shape[2] - 1).T, axis=2)]
        scale = 2.0 / (SPEEDS[1] - SPEEDS[0])
        slopes = [np.polynomial.chebyshev.chebder(by_power, order, scl=scale, axis=2) for order in (1, 2)]
        for _ in range(SWEEPS):
            slope, bend = (
                np.einsum("nkb,nkb->nk", table, chebyshev.basis(speed, *SPEEDS, table.shape[2] - 1)) for table in slopes
            )
            step = slope / np.where(bend > 0.0, bend, np.inf)
            speed = np.clip(speed - np.clip(step, -0.02, 0.02), *SPEEDS)
        return speed

    def _power_basis(self, power: Any) -> Array:
        return chebyshev.basis(np.log(power + self.power_shift), *self._stretch, self.coefficients.shape[1] - 1)
