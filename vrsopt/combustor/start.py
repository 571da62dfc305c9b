"""A start for the reactor network: reactor by reactor, many at once, so that the whole network converges from it.

The equations of one reactor are compiled once. Every reactor is first brought to chemical equilibrium, then released to
its finite rates; the means of the primary zone, which its pockets share, follow by substitution. The result need not be
exact: the network's own Newton iteration finishes it.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from vrsopt.combustor.data import ReactorData
from vrsopt.combustor.reactor import UNKNOWNS, Mode, equations, gas
from vrsopt.combustor.zones import PRIMARY, Stream, Zones, air_stream, leaving

COUNT = len(UNKNOWNS)
LOG_STEP, TEMPERATURE_STEP = 2.0, 200.0  # largest changes of ln n and of the temperature [K] in one iteration
COLDEST, HOTTEST = 250.0, 3000.0  # K
EQUILIBRIUM_TOLERANCE, TOLERANCE = 1e-2, 1e-4
SWEEPS = 3
LONGER_STAYS = (1000.0, 100.0, 10.0, 3.0, 1.0)  # times its volume: the way from equilibrium for a reactor that fails


def network_start(data: ReactorData, fuel: Stream, points: np.ndarray, pockets: int = PRIMARY) -> np.ndarray:
    """Starts (N, n) for the network's unknowns at parameters ``points`` (N, 5); not finite where nothing can burn."""
    with np.errstate(all="ignore"):
        return _network_start(data, fuel, points, pockets)


def _network_start(data: ReactorData, fuel: Stream, points: np.ndarray, pockets: int) -> np.ndarray:
    pressure, temperature, air_flow, fuel_flow, humidity = np.asarray(points, dtype=float).T
    air = Stream(*_air()(temperature[None], humidity[None]).full())
    zones, r = Zones.of(data, air, fuel, air_flow, fuel_flow, pockets), data.recirculation
    fresh, mean = zones.fresh(), zones.primary_mean()
    methylene, none = zones.methylene(), 0.0 * pressure

    def conditions(inflows: list[Stream], volume: np.ndarray, carbon: list[np.ndarray]) -> np.ndarray:
        columns = [np.array([pressure, volume, c, *one.parts()]) for one, c in zip(inflows, carbon, strict=True)]
        return np.concatenate(columns, axis=1)

    c = conditions([one.mixed(mean, r) for one in fresh], zones.volumes[0], methylene)
    primary = _balanced(c)
    for sweep in range(SWEEPS if r else 1):
        left = leaving(fresh, zones.primary_weights, _slow(primary, c, len(fresh)))
        mean = replace(left, no=left.no if sweep else none)  # the NO of equilibrium is far too much
        inflows = [one.mixed(mean, r) for one in fresh]
        c = conditions(inflows, zones.volumes[0], methylene)
        primary = _burnt(primary, c)
    mean = leaving(fresh, zones.primary_weights, _slow(primary, c, len(fresh)))
    inflows = zones.intermediate(mean)
    c = conditions(inflows, zones.volumes[1], [none] * len(inflows))
    middle = _burnt(_balanced(c), c)
    inflow = zones.dilution(leaving(inflows, zones.intermediate_weights, _slow(middle, c, len(inflows))))
    c = conditions([inflow], zones.volumes[2], [none])
    last = _burnt(_balanced(c), c)
    states = np.concatenate([part.reshape(COUNT, -1, len(pressure)) for part in (primary, middle, last)], axis=1)
    return np.vstack([states.transpose(1, 0, 2).reshape(-1, len(pressure)), mean.moles, mean.co, mean.no]).T


def _balanced(conditions: np.ndarray) -> np.ndarray:
    """Chemical equilibrium in every column."""
    return solve_reactors(_complete(conditions), conditions, "equilibrium", EQUILIBRIUM_TOLERANCE)[0]


def _burnt(start: np.ndarray, conditions: np.ndarray) -> np.ndarray:
    """Finite rates in every column, from ``start``; what fails comes from equilibrium by way of larger volumes."""
    x, done = solve_reactors(start, conditions)
    if not done.all():
        left = conditions[:, ~done]
        retried = _balanced(left)
        for factor in LONGER_STAYS:
            larger = left.copy()
            larger[1] *= factor
            retried, _ = solve_reactors(retried, larger)
        x[:, ~done] = retried
    return x


def solve_reactors(
    start: np.ndarray, conditions: np.ndarray, mode: Mode = "kinetic", tolerance: float = TOLERANCE
) -> tuple[np.ndarray, np.ndarray]:
    """Damped Newton in every column: states (7, N) from ``start`` (7, N), and which of them converged (N,).

    ``conditions`` (12, N): pressure, volume over flow, carbon by way of CH2 and the nine parts of the inflow.
    ``tolerance``: largest scaled residual.
    """
    x, done = start.copy(), np.zeros(start.shape[1], dtype=bool)
    most = np.array([LOG_STEP] * 5 + [TEMPERATURE_STEP])
    todo = np.arange(start.shape[1])
    for _ in range(40):
        r, jacobian = (part.full() for part in _compiled(mode)(x[:, todo], conditions[:, todo]))
        matrices = jacobian.reshape(COUNT, todo.size, COUNT).transpose(1, 0, 2)
        fine = np.isfinite(r).all(axis=0) & np.isfinite(matrices).all(axis=(1, 2))
        fine[fine] = np.isfinite(np.linalg.slogdet(matrices[fine])[1])  # singular where everything underflows
        near = fine & (np.max(np.abs(r), axis=0) < tolerance)
        keep = fine & ~near
        done[todo[near]] = True
        todo, matrices, r = todo[keep], matrices[keep], r[:, keep]
        if not todo.size:
            break
        step = -np.linalg.solve(matrices, r.T[:, :, None])[:, :, 0].T
        no = x[6, todo]
        x[:, todo] += step / np.maximum(np.max(np.abs(step[:6]) / most[:, None], axis=0), 1.0)
        x[6, todo] = np.maximum(x[6, todo], 0.1 * no)  # a second root, of no meaning, is negative
        x[5, todo] = np.clip(x[5, todo], COLDEST, HOTTEST)
    return x, done


def _complete(conditions: np.ndarray) -> np.ndarray:
    """A guess of the equilibrium: complete combustion when lean, CO and H2 in proportion when rich."""
    carbon, hydrogen, oxygen = conditions[3:6]
    ratio = (2.0 * carbon + 0.5 * hydrogen) / oxygen
    missing = np.maximum(2.0 * carbon + 0.5 * hydrogen - oxygen, 0.0)
    co = np.minimum(0.6 * missing, 0.95 * carbon) + 1e-3 * carbon
    water = 0.5 * hydrogen - np.minimum(0.4 * missing, 0.45 * hydrogen)
    temperature = np.clip(350.0 + 1950.0 * np.minimum(ratio, 1.9 - 0.8 * ratio), 500.0, 2400.0)
    oxygen_left = np.maximum(0.5 * oxygen - carbon - 0.25 * hydrogen, 5e-4 * oxygen)
    hydroxyl = -1.0 - 16200.0 * (1.0 / temperature - 1.0 / 2400.0)
    no = 5.0 * np.exp(-10900.0 / temperature) * np.sqrt(conditions[6] * oxygen_left)  # in equilibrium with N2 and O2
    return np.array([np.log(carbon - co), np.log(co), np.log(water), np.log(oxygen_left), hydroxyl, temperature, no])


def _slow(states: np.ndarray, conditions: np.ndarray, pockets: int) -> list[tuple[Any, Any, Any]]:
    """Moles in all, CO and NO [mol/kg] of every pocket, N values each."""
    values = _slow_values()(states, conditions).full().reshape(3, pockets, -1)
    return [(values[0, k], values[1, k], values[2, k]) for k in range(pockets)]


def _symbols() -> tuple[ca.SX, ca.SX]:
    return ca.SX.sym("x", COUNT), ca.SX.sym("c", 12)


@lru_cache(maxsize=1)
def _air() -> ca.Function:
    """Temperature and humidity -> the nine parts of the stream of air."""
    temperature, humidity = ca.SX.sym("T"), ca.SX.sym("h")
    return ca.Function("air", [temperature, humidity], [ca.vertcat(*air_stream(temperature, humidity).parts())])


@lru_cache(maxsize=2)
def _compiled(mode: Mode) -> ca.Function:
    """State (7) and conditions (12) of a reactor -> residual (7) and its Jacobian by columns (7, 7)."""
    x, c = _symbols()
    pressure, volume, methylene, *parts = ca.vertsplit(c)
    r = equations(x, pressure, Stream(*parts), volume, methylene=methylene, mode=mode)
    return ca.Function("reactor", [x, c], [r, ca.densify(ca.jacobian(r, x))])


@lru_cache(maxsize=1)
def _slow_values() -> ca.Function:
    x, c = _symbols()
    return ca.Function("slow", [x, c], [ca.vertcat(*gas(x, c[0], Stream(*ca.vertsplit(c)[3:])).slow)])
