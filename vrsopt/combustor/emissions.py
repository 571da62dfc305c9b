"""NOx, CO and CO2 of one engine: a solved gas path feeds the combustor's network of stirred reactors.

The network breaks up all fuel that enters it at once and has no hydrocarbons. What leaves a real combustor unburnt is
therefore kept out of it: FOCA's hydrocarbons, through the combustion efficiency of the gas path (10 % of the fuel at
ground idle, 1 % at full power). They are a correlation, not a result of the network; where they are many, at idle, NOx
and CO are indicative only. CO2 is the carbon of the burnt fuel less that which leaves as CO.

The combustor's numbers are a fit, and other fits meet the same points. NOx is that of the engine's own ``reactors``;
the fits of the engine are these and the ``reactors`` of every variant in its file that has any, and the range over all
of them stands beside the value.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from vrsopt.combustor.bulk import solve_combustor_many
from vrsopt.combustor.data import ReactorData
from vrsopt.combustor.network import combustor
from vrsopt.residual import ResidualSystem
from vrsopt.solution import Solution
from vrsopt.solvers.status import Status
from vrsopt.turboshaft.data import EngineData

SPECIES = ("nox", "co", "co2")
INDICES = ("nox_index", "co_index", "co2_index")
SHIPPED = "shipped"  # the fit in the engine's own section [reactors]
INLET = {  # parameter of the combustor: output of the gas path
    "pressure": "compressor_exit_pressure",
    "temperature": "compressor_exit_temperature",
    "air_flow": "combustor_air_flow",
    "fuel_flow": "burnt_fuel_flow",
}


@dataclass(frozen=True)
class Emissions:
    """Emissions of one engine: flows [kg/s], and indices [kg per kg of fuel]; NOx counted as NO2.

    ``nox_of_fits`` [kg/s]: by the name of the fit, "shipped" and the engine's variants. Without ``success`` the gas
    path or the shipped fit was not solved and the numbers are nan; ``message`` says why. Another fit that was not
    solved is nan in ``nox_of_fits`` alone.
    """

    success: bool
    status: Status
    message: str
    residual_norm: float
    nox: float
    co: float
    co2: float
    nox_index: float
    co_index: float
    co2_index: float
    nox_of_fits: Mapping[str, float]

    @property
    def nox_range(self) -> tuple[float, float]:
        """Least and largest NOx [kg/s] over the fits of the combustor; nan if one of them was not solved."""
        return fit_range(self.nox_of_fits.values())


def fit_range(values: Iterable[float]) -> tuple[float, float]:
    """Least and largest of the fits' ``values``; nan if one of them is, or there are none."""
    known = np.array(list(values) or [math.nan])
    return float(known.min()), float(known.max())


def reactor_fits(engine: EngineData) -> dict[str, ReactorData]:
    """The fits of the combustor by name: the shipped one first, then every variant that has reactors of its own."""
    others = {name: engine.variant(name).reactors for name, parts in engine.variants.items() if "reactors" in parts}
    return {SHIPPED: engine.reactors, **others}


def emissions(engine: EngineData, gas_path: Solution) -> Emissions:
    """Emissions of one engine at a gas path (:func:`vrsopt.turboshaft.cycle.gas_path` of the same engine).

    Nothing is raised for a gas path or a combustor that was not solved: test ``success``.
    """
    fits = {SHIPPED: gas_path}  # a gas path that failed stands for the combustors behind it
    if gas_path.success:
        fits = {name: _burnt(system, gas_path) for name, system in _combustors(engine).items()}
    shipped, fuel = fits[SHIPPED], gas_path.outputs["fuel_flow"]
    burnt = 1.0 - gas_path.outputs["hydrocarbon_index"]  # the network's indices are per kg of fuel that enters it
    indices = {name: burnt * shipped.outputs[name] if shipped.success else math.nan for name in INDICES}
    others = [f"{name} fit: {other.message}" for name, other in fits.items() if shipped.success and not other.success]
    return Emissions(
        success=shipped.success,
        status=shipped.status,
        message="; ".join((shipped.message, *others)),
        residual_norm=shipped.residual_norm,
        **{name: indices[f"{name}_index"] * fuel for name in SPECIES},
        **indices,
        nox_of_fits={name: _nox(fit) * burnt * fuel for name, fit in fits.items()},
    )


def _nox(burnt: Solution) -> float:
    return burnt.outputs["nox_index"] if burnt.success else math.nan


def emission_sensitivities(
    engine: EngineData, gas_path: Solution, gas_path_system: ResidualSystem
) -> dict[str, dict[str, float]]:
    """Exact d(nox, co, co2 [kg/s], nox_index, co_index, co2_index [kg/kg]) / d(parameter of the gas path).

    ``result[name][parameter]`` for one engine and the shipped fit: the sensitivities of gas path and combustor, each by
    the implicit-function theorem, chained. Raises :class:`InputError` where either was not solved.
    """
    outer = gas_path_system.sensitivities(gas_path)
    system = _combustors(engine)[SHIPPED]
    burnt = _burnt(system, gas_path)
    inner = system.sensitivities(burnt)
    names = tuple(gas_path.parameters)
    reached = {source: np.array([outer[source][name] for name in names]) for source in (*INLET.values(), "fuel_flow")}
    moist = np.array([float(name == "humidity") for name in names])

    def along(output: str) -> np.ndarray:
        flow = sum((inner[output][here] * reached[there] for here, there in INLET.items()), np.zeros(len(names)))
        return flow + inner[output]["humidity"] * moist

    fuel, entering, slopes = gas_path.outputs["fuel_flow"], gas_path.outputs["burnt_fuel_flow"], {}
    for name, index in zip(SPECIES, INDICES, strict=True):
        slopes[name] = entering * along(index) + burnt.outputs[index] * reached["burnt_fuel_flow"]
        slopes[index] = (slopes[name] - burnt.outputs[index] * entering / fuel * reached["fuel_flow"]) / fuel
    return {name: dict(zip(names, slopes[name].tolist(), strict=True)) for name in (*SPECIES, *INDICES)}


def emissions_many(
    engine: EngineData, states: Mapping[str, np.ndarray], humidity: np.ndarray | float
) -> dict[str, np.ndarray]:
    """Emissions of one engine at N solved gas paths: "nox", "co", "co2", "nox_low", "nox_high" (N,) [kg/s].

    ``states``: outputs of the gas path by name, (N,) each, those of ``INLET`` at least (as ``solve_many`` gives them);
    humidity [kg water per kg dry air], (N,) or one for all. nox_low and nox_high are the range over the fits, which has
    a corner where fits cross; each fit alone is smooth: "nox_shipped" and so on. Where a gas path is nan or a combustor
    was not solved, what depends on it is nan.
    """
    columns = [np.asarray(states[source], dtype=float) for source in INLET.values()]
    points = np.column_stack([*columns, np.broadcast_to(np.asarray(humidity, dtype=float), columns[0].shape)])
    known = np.isfinite(points).all(axis=1)
    burner, flows = engine.combustor, {}
    for fit, reactors in reactor_fits(engine).items():
        solved = solve_combustor_many(points[known], reactors, burner.hydrogen_to_carbon, burner.heating_value)
        flows[fit] = np.full((len(INDICES), len(points)), math.nan)
        flows[fit][:, known] = np.where(solved.success, [solved.outputs[index] for index in INDICES], math.nan)
        flows[fit] *= points[:, -2]  # the fuel that enters the network
    each = {f"nox_{fit}": flow[0] for fit, flow in flows.items()}
    low, high = (pick(list(each.values()), axis=0) for pick in (np.min, np.max))
    return dict(zip(SPECIES, flows[SHIPPED], strict=True)) | each | {"nox_low": low, "nox_high": high}


def _burnt(system: ResidualSystem, gas_path: Solution) -> Solution:
    """The combustor behind a solved gas path."""
    return system.solve(_inlet(gas_path), method="newton")


def _inlet(gas_path: Solution) -> dict[str, float]:
    """Parameters of the combustor at a solved gas path."""
    inlet = {name: gas_path.outputs[source] for name, source in INLET.items()}
    return inlet | {"humidity": gas_path.parameters["humidity"]}


def _combustors(engine: EngineData) -> dict[str, ResidualSystem]:
    return _built(engine.model_dump_json())


@lru_cache(maxsize=16)
def _built(text: str) -> dict[str, ResidualSystem]:
    """The combustor of each fit; kept by the engine's text, as reading its variants takes longer than one solve."""
    engine = EngineData.model_validate_json(text)
    burner = engine.combustor
    return {
        name: combustor(reactors, burner.hydrogen_to_carbon, burner.heating_value)
        for name, reactors in reactor_fits(engine).items()
    }
