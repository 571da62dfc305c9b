"""The combustor as a network of stirred reactors: NOx and CO from what the compressor and the fuel pump deliver.

Primary zone: parallel reactors, rich and lean pockets side by side (unmixedness as a Gaussian spread of the fuel mass
fraction, cut off, integrated by Gauss-Legendre), into which burnt gas of the zone is mixed back. Intermediate zone:
three pockets. Dilution zone: one reactor. Burnt gas and air mix linearly between the zones.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np

from vrsopt.combustor import reactor
from vrsopt.combustor.data import ReactorData
from vrsopt.combustor.reactor import Gas, equations, gas
from vrsopt.combustor.species import all_species
from vrsopt.combustor.start import network_start
from vrsopt.combustor.zones import INTERMEDIATE, PRIMARY, Stream, Zones, air_stream, fuel_stream, leaving
from vrsopt.residual import Named, ResidualSystem, Unknown

MEAN_SCALE = 36.0  # mol/kg: moles of burnt gas
NO2_MASS = 46.005e-3  # kg/mol: nitrogen oxides count as NO2

PARAMETERS = (
    Named("pressure", "Pa"),
    Named("temperature", "K"),
    Named("air_flow", "kg/s"),
    Named("fuel_flow", "kg/s"),
    Named("humidity", "kg/kg"),
)
OUTPUTS = (
    Named("nox_index", "kg/kg"),
    Named("co_index", "kg/kg"),
    Named("co2_index", "kg/kg"),
    Named("exit_temperature", "K"),
    Named("primary_temperature", "K"),
    Named("intermediate_temperature", "K"),
    Named("primary_equivalence_ratio", "-"),
    Named("intermediate_equivalence_ratio", "-"),
    Named("equivalence_ratio", "-"),
    Named("leanest_pocket_temperature", "K"),
    Named("leanest_pocket_unburnt_co", "-"),
)


def combustor(
    reactors: ReactorData,
    hydrogen_to_carbon: float,
    heating_value: float,
    *,
    free: tuple[str, ...] = (),
    pockets: int = PRIMARY,
) -> ResidualSystem:
    """The combustor's reactor network as a residual system (SX).

    Parameters: ``pressure`` [Pa], ``temperature`` [K] and ``air_flow`` [kg/s, moist] of the air that enters,
    ``fuel_flow`` [kg/s], ``humidity`` [kg of vapour per kg of dry air], then the numbers of ``reactors`` that are named
    in ``free`` (to calibrate them). The fuel is CHx with ``heating_value`` [J/kg]. Emission indices are per kg of fuel,
    NOx as NO2. ``pockets`` of the primary zone: 9 are within 2 % of 21. Built once per data. ``hydrogen_to_carbon``: x
    of the fuel.
    """
    return _built(reactors.model_dump_json(), hydrogen_to_carbon, heating_value, free, pockets)


@lru_cache(maxsize=16)
def _built(
    text: str, hydrogen_to_carbon: float, heating_value: float, free: tuple[str, ...], pockets: int
) -> ResidualSystem:
    data, fuel = ReactorData.model_validate_json(text), fuel_stream(hydrogen_to_carbon, heating_value)
    unknowns = _unknowns(pockets)
    parameters = PARAMETERS + tuple(Named(name, data.provenance[name].unit) for name in free)
    x, p = ca.SX.sym("x", len(unknowns)), ca.SX.sym("p", len(parameters))
    numbers = dict(data) | dict(zip(free, ca.vertsplit(p)[len(PARAMETERS) :], strict=True))
    residuals, outputs = _equations(SimpleNamespace(**numbers), fuel, x, p, pockets)

    def guess(values: Mapping[str, float]) -> dict[str, float]:
        here = data.replaced(**{name: values[name] for name in free})
        point = np.array([[values[parameter.name] for parameter in PARAMETERS]])
        start = network_start(here, fuel, point, pockets)[0]
        return {unknown.name: float(value) for unknown, value in zip(unknowns, start, strict=True)}

    return ResidualSystem(
        name="combustor",
        unknowns=unknowns,
        parameters=parameters,
        residuals=tuple(Named(name) for name in _residual_names(pockets)),
        outputs=OUTPUTS,
        x=x,
        p=p,
        r=ca.vertcat(*residuals),
        y=ca.vertcat(*(outputs[output.name] for output in OUTPUTS)),
        guess=guess,
    )


def _equations(data: Any, fuel: Stream, x: Any, p: Any, pockets: int) -> tuple[list[Any], dict[str, Any]]:
    """Scaled residuals and outputs by name, zone by zone."""
    pressure, temperature, air_flow, fuel_flow, humidity = ca.vertsplit(p)[: len(PARAMETERS)]
    zones = Zones.of(data, air_stream(temperature, humidity), fuel, air_flow, fuel_flow, pockets)
    count = len(reactor.UNKNOWNS)
    states = iter([x[i * count : (i + 1) * count] for i in range(pockets + INTERMEDIATE + 1)])
    residuals: list[Any] = []

    def burn(inflows: list[Stream], volume: Any, methylene: list[Any], renewed: Any = 1.0) -> list[Gas]:
        gases = []
        for inflow, carbon in zip(inflows, methylene, strict=True):
            state = next(states)
            residuals.append(equations(state, pressure, inflow, volume, methylene=carbon, renewed=renewed))
            gases.append(gas(state, pressure, inflow))
        return gases

    moles, co, no = x[-3], x[-2], x[-1]
    mean, r = replace(zones.primary_mean(), moles=moles, co=co, no=no), data.recirculation
    fresh = zones.fresh()
    primary = burn([one.mixed(mean, r) for one in fresh], zones.volumes[0], zones.methylene(), 1.0 - r)
    burnt = leaving(fresh, zones.primary_weights, [one.slow for one in primary])
    closing = [(burnt.moles - moles) / MEAN_SCALE, (burnt.co - co) / MEAN_SCALE, (burnt.no - no) / reactor.NO_SCALE]
    inflows = zones.intermediate(burnt)
    intermediate = burn(inflows, zones.volumes[1], [0.0] * INTERMEDIATE)
    burnt = leaving(inflows, zones.intermediate_weights, [one.slow for one in intermediate])
    (last,) = burn([zones.dilution(burnt)], zones.volumes[2], [0.0])
    return residuals + closing, _outputs(zones, primary, intermediate, last)


def _outputs(zones: Zones, primary: list[Gas], intermediate: list[Gas], last: Gas) -> dict[str, Any]:
    """Outputs by name; the leanest pocket is the first of the primary zone."""
    known, (rich, middle, lean) = all_species(), zones.fuel_fractions
    leanest = primary[0]
    return {
        "nox_index": last.no * NO2_MASS / lean,
        "co_index": last.amount["CO"] * known["CO"].molar_mass / lean,
        "co2_index": (zones.fuel.carbon - last.amount["CO"] / lean) * known["CO2"].molar_mass,
        "exit_temperature": last.temperature,
        "primary_temperature": _mean_temperature(primary, zones.primary_weights),
        "intermediate_temperature": _mean_temperature(intermediate, zones.intermediate_weights),
        "primary_equivalence_ratio": _equivalence_ratio(zones, rich),
        "intermediate_equivalence_ratio": _equivalence_ratio(zones, middle),
        "equivalence_ratio": _equivalence_ratio(zones, lean),
        "leanest_pocket_temperature": leanest.temperature,
        "leanest_pocket_unburnt_co": leanest.amount["CO"] / (leanest.amount["CO"] + leanest.amount["CO2"]),
    }


def _mean_temperature(gases: list[Gas], weights: np.ndarray) -> Any:
    return sum(float(w) * one.temperature for w, one in zip(weights, gases, strict=True))


def _equivalence_ratio(zones: Zones, fuel_fraction: Any) -> Any:
    """Fuel-air ratio over the one that needs all oxygen of the dry air."""
    needed = 2.0 * zones.fuel.carbon + 0.5 * zones.fuel.hydrogen
    available = zones.air.oxygen - 0.5 * zones.air.hydrogen
    return fuel_fraction / (1.0 - fuel_fraction) * needed / available


def _places(pockets: int) -> list[str]:
    primary = [f"primary pocket {i}" for i in range(1, pockets + 1)]
    return primary + [f"intermediate pocket {i}" for i in range(1, INTERMEDIATE + 1)] + ["dilution zone"]


def _unknowns(pockets: int) -> tuple[Unknown, ...]:
    """Seven unknowns per reactor, in the order of the zones, then the primary zone's means of what changes slowly."""
    each = []
    for place in _places(pockets):
        for name in reactor.UNKNOWNS[:5]:
            each.append(Unknown(f"{place}: {name}", "ln(mol/kg)", lower=-60.0, upper=4.0))
        each.append(Unknown(f"{place}: temperature", "K", scale=1e3, lower=250.0, upper=3200.0, start=1500.0))
        each.append(_nitric_oxide(place))
    return (
        *each,
        Unknown("primary zone: moles", "mol/kg", scale=MEAN_SCALE, lower=20.0, upper=60.0, start=36.0),
        Unknown("primary zone: CO", "mol/kg", scale=MEAN_SCALE, lower=-4.0, upper=36.0, start=0.7),
        _nitric_oxide("primary zone"),
    )


def _nitric_oxide(place: str) -> Unknown:
    return Unknown(f"{place}: NO", "mol/kg", scale=reactor.NO_SCALE, lower=-1e-4, upper=0.5, start=1e-4)


def _residual_names(pockets: int) -> list[str]:
    each = [f"{place}: {name}" for place in _places(pockets) for name in reactor.RESIDUALS]
    return each + [f"primary zone: mean {name}" for name in ("moles", "CO", "NO")]
