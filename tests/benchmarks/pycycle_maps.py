"""Tabulated component maps in the product's gas path: bilinear tables as CasADi expressions, scaled as pyCycle does.

The scaling (pyCycle's ``MapScalars``): speed, flow and efficiency by a factor, the pressure ratio less one by another,
so that one point of the table becomes the design point. Outside a table its last cells go on as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from vrsopt.turboshaft.data import CompressorData
from vrsopt.turboshaft.maps import ComponentMaps, TurbineState


@dataclass(frozen=True, eq=False)
class Table:
    """Bilinear interpolation of ``values`` (n, m) over the increasing ``x`` (n,) and ``y`` (m,).

    Written in hinges: a piecewise linear function is a line plus one max(x - x_i, 0) for each inner point, a bilinear
    one the product of two such. No look-up, so that it can be an SX expression; linear beyond the table.
    """

    x: Sequence[float]
    y: Sequence[float]
    values: Any

    def __call__(self, x: Any, y: Any) -> Any:
        at_x, at_y = np.array(self.x, dtype=float), np.array(self.y, dtype=float)
        weights = np.linalg.solve(_hinges(at_x, at_x), np.asarray(self.values, dtype=float))
        weights = np.linalg.solve(_hinges(at_y, at_y), weights.T).T
        return ca.bilin(ca.DM(weights), ca.vertcat(*_row(at_x, x)), ca.vertcat(*_row(at_y, y)))


def _row(grid: np.ndarray, at: Any) -> list[Any]:
    """The hinge functions of ``grid`` at one value."""
    return [1.0, at - grid[0], *(ca.fmax(at - corner, 0.0) for corner in grid[1:-1].tolist())]


def _hinges(grid: np.ndarray, at: np.ndarray) -> np.ndarray:
    """The hinge functions of ``grid`` (columns) at many values (rows)."""
    return np.array([[float(entry) for entry in _row(grid, value)] for value in at.tolist()])


@dataclass(frozen=True, eq=False)
class CompressorTables:
    """A compressor map (speed, line), the ``design`` point of which is scaled to a design point."""

    speed: Sequence[float]
    line: Sequence[float]
    design: tuple[float, float]
    flow: Any
    pressure_ratio: Any
    efficiency: Any

    def at(self, speed: Any, beta: Any, *, pressure_ratio: float, efficiency: float) -> tuple[Any, Any, Any]:
        """Corrected flow over the design point's, pressure ratio and efficiency, at the corrected speed over the design
        point's and ``beta`` lines from the design point's, for a compressor of that design ``pressure_ratio`` and
        ``efficiency``."""
        place, design = (speed * self.design[0], self.design[1] + beta), self.design
        flow, ratio, quality = (
            Table(self.speed, self.line, values) for values in (self.flow, self.pressure_ratio, self.efficiency)
        )
        rise = (pressure_ratio - 1.0) / (ratio(*design) - 1.0)
        return (
            flow(*place) / flow(*design),
            1.0 + rise * (ratio(*place) - 1.0),
            efficiency * quality(*place) / quality(*design),
        )


@dataclass(frozen=True, eq=False)
class TurbineTables:
    """A turbine map (speed, pressure ratio), the ``design`` point of which is scaled to a design point."""

    speed: Sequence[float]
    pressure_ratio: Sequence[float]
    design: tuple[float, float]
    flow: Any
    efficiency: Any

    def at(self, speed: Any, expansion_ratio: Any, *, design_ratio: float) -> tuple[Any, Any]:
        """Flow function W sqrt(T)/P and efficiency over the design point's, at the referred speed N/sqrt(T) over the
        design point's and an expansion ratio, for a turbine of that ``design_ratio``."""
        scaled = 1.0 + (self.design[1] - 1.0) * (expansion_ratio - 1.0) / (design_ratio - 1.0)
        place, design = (speed * self.design[0], scaled), self.design
        flow, quality = (Table(self.speed, self.pressure_ratio, values) for values in (self.flow, self.efficiency))
        return flow(*place) / flow(*design), quality(*place) / quality(*design)


def component_maps(
    compressor: CompressorTables, gas_generator_turbine: TurbineTables, power_turbine: TurbineTables
) -> ComponentMaps:
    """The tables as maps of the product's gas path."""

    def compress(data: CompressorData, speed: Any, beta: Any, *, pressure_ratio: float) -> tuple[Any, Any, Any]:
        return compressor.at(speed, beta, pressure_ratio=pressure_ratio, efficiency=data.efficiency)

    def expand(tables: TurbineTables) -> Callable[[object, TurbineState], tuple[Any, Any]]:
        def flow_and_work(data: object, state: TurbineState) -> tuple[Any, Any]:
            place = state.corrected_speed, state.expansion_ratio
            flow, efficiency = tables.at(*place, design_ratio=state.design_expansion_ratio)
            return flow**2, efficiency * state.spouting**2

        return flow_and_work

    return ComponentMaps(compress, expand(gas_generator_turbine), expand(power_turbine))
