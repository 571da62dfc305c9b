"""The combustor's zone network (primary, intermediate, dilution) in Cantera, reactor by reactor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from cantera_reactors import Burnt, Gas, Stream

from vrsopt.combustor.data import ReactorData

PASSES = 200
FIXED_POINT = 1e-7  # largest change of a mass fraction of the recirculated gas between passes


def mixture(cutoff: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre points on a normal distribution cut off at ``cutoff`` standard deviations, and their weights."""
    points, weights = np.polynomial.legendre.leggauss(count)
    deviation = cutoff * points
    weights = weights * np.exp(-(deviation**2) / 2)
    return deviation, weights / weights.sum()


@dataclass(frozen=True)
class Network:
    """The combustor at one state: indices in kg per kg of fuel, temperatures in K, reactors of the primary zone."""

    nox_index: float
    co_index: float
    exit_temperature: float
    primary_temperature: float
    pockets: tuple[Burnt, ...]
    passes: int


def _mean(parts: list[Burnt], weights: np.ndarray) -> Stream:
    enthalpy = sum(w * part.stream.enthalpy for w, part in zip(weights, parts, strict=True))
    fractions = sum(w * part.stream.fractions for w, part in zip(weights, parts, strict=True))
    return Stream(float(enthalpy), np.asarray(fractions))


def network(
    gas: Gas,
    reactors: ReactorData,
    state: tuple[float, float, float, float, float],
    *,
    pockets: int = 9,
    intermediate: int = 3,
) -> Network:
    """The zone network at a state: pressure [Pa], temperature [K], moist air and fuel [kg/s], humidity.

    Recirculated gas passes through the primary reactors again, so that their flow is 1/(1 - r) of the fresh one.
    Raises what :meth:`Gas.reactor` raises.
    """
    pressure, temperature, air_flow, fuel_flow, humidity = state
    air, keep = gas.air(temperature, humidity, pressure), 1 - reactors.recirculation
    first = reactors.primary_air_fraction
    flows = [fuel_flow + share * air_flow for share in (first, first + reactors.intermediate_air_fraction, 1.0)]
    rich, middle, lean = (fuel_flow / flow for flow in flows)
    deviation, weights = mixture(reactors.mixture_cutoff, pockets)
    fresh = [gas.fresh(air, rich * (1 + reactors.primary_unmixedness * z)) for z in deviation]
    stay = keep * reactors.primary_volume / flows[0]
    primary, passes = _primary(gas, fresh, weights, pressure, reactors.recirculation, stay)
    burnt = _mean(primary, weights)
    deviation, shares = mixture(reactors.mixture_cutoff, intermediate)
    stay = reactors.intermediate_volume / flows[1]
    diluted = [air.mixed(burnt, middle / rich * (1 + reactors.intermediate_unmixedness * z)) for z in deviation]
    inflow = air.mixed(_mean([gas.reactor(one, pressure, stay) for one in diluted], shares), lean / middle)
    last = gas.reactor(inflow, pressure, reactors.dilution_volume / flows[2])
    return Network(
        nox_index=gas.nox_index(last.stream, lean),
        co_index=gas.co_index(last.stream, lean),
        exit_temperature=last.temperature,
        primary_temperature=float(sum(w * part.temperature for w, part in zip(weights, primary, strict=True))),
        pockets=tuple(primary),
        passes=passes,
    )


def _primary(
    gas: Gas, fresh: list[Stream], weights: np.ndarray, pressure: float, recirculation: float, stay: float
) -> tuple[list[Burnt], int]:
    """Reactors of the primary zone, each fed with its fresh gas and with the zone's mean; and the passes it took."""
    if recirculation == 0.0:
        return [gas.reactor(inflow, pressure, stay) for inflow in fresh], 1
    mean = _mean([gas.equilibrium(inflow, pressure) for inflow in fresh], weights)
    starts: list[Burnt | None] = [None] * len(fresh)
    for count in range(1, PASSES + 1):
        inflows = [inflow.mixed(mean, recirculation) for inflow in fresh]
        parts = [gas.reactor(inflow, pressure, stay, start) for inflow, start in zip(inflows, starts, strict=True)]
        new = _mean(parts, weights)
        # The NO is little and counts: relative, one part in 10^5
        nitric = gas.nox_index(new, 1.0) / gas.nox_index(mean, 1.0) - 1
        change = max(float(np.abs(new.fractions - mean.fractions).max()), abs(nitric) * 1e-2)
        mean, starts = new, list(parts)
        if change < FIXED_POINT:
            return parts, count
    raise RuntimeError(f"recirculation {recirculation}: no fixed point, last change {change:.1e}")
