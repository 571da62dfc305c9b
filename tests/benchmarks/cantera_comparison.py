"""The combustor's chemistry against Cantera's, as one JSON object: python tests/benchmarks/cantera_comparison.py

Single reactors (48 cases) and the zone network of the shipped engine on its operating line, each with the whole of
GRI-Mech 3.0, without prompt NO, and with thermal NO and N2O only; ``broken`` is without prompt NO, its fuel as CO and
H2 like ours (no hydrocarbons that reduce NO). Ours has the prompt NO of the mechanism it stands
beside (``ours_full``: ethylene's; ``ours_no_prompt``) and, in the network, also that of the engine's data (``ours``).
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial

import numpy as np
from cantera_reactors import Burnt, Gas, Nitrogen
from cantera_zones import network
from made_with import made_with

from vrsopt.combustor.data import ReactorData
from vrsopt.combustor.network import combustor
from vrsopt.combustor.nitrogen import ETHYLENE
from vrsopt.combustor.reactor import MAJOR, Mode
from vrsopt.combustor.start import solve_reactors
from vrsopt.combustor.zones import air_stream, fuel_stream
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.cycle import gas_path
from vrsopt.turboshaft.data import EngineData, load_engine

MECHANISMS: tuple[Nitrogen, ...] = ("full", "no_prompt", "thermal")
STATES = ("compressor_exit_pressure", "compressor_exit_temperature", "combustor_air_flow", "burnt_fuel_flow")
METHYLENE = {"full": ETHYLENE, "no_prompt": 0.0, "thermal": 0.0, "inert": 0.0}  # our prompt NO by mechanism
POWERS = (0.07, 0.3, 0.6, 0.78, 1.0)  # of the take-off rating
SLOPES_AT = (0.6, 1.0)
HUMIDITY, FUEL = 0.005, 0.01  # half steps of the slopes: kg/kg, relative

State = tuple[float, float, float, float, float]
Case = dict[str, float]


def single_cases() -> list[Case]:
    """Pressure [Pa], inflow temperature [K], equivalence ratio, residence time [s] at the density of equilibrium."""
    return [
        {"pressure": 1e5 * bar, "temperature": temperature, "equivalence_ratio": phi, "residence_time": 1e-3 * tau}
        for bar, temperature in ((2.0, 420.0), (4.0, 500.0), (7.0, 570.0))
        for phi in (0.35, 0.45, 0.55, 0.7, 0.85, 1.0, 1.15, 1.35)
        for tau in (1.5, 4.0)
    ]


def single(gas: Gas, case: Case) -> dict[str, float]:
    """Cantera's reactor and, ``_ours``, ours of the same volume over flow: temperature [K], CO and NO [mol/kg].

    ``equilibrium_``: the same without end. ``out`` is 1 where Cantera's reactor does not burn, which is not compared.
    Ours starts from Cantera's state, so that both are on the same branch where a reactor may burn or be out.
    """
    pressure = case["pressure"]
    air = gas.air(case["temperature"], 0.0, pressure)
    fuel_fraction = gas.fuel_fraction(air, case["equivalence_ratio"])
    inflow = gas.fresh(air, fuel_fraction)
    balanced = gas.equilibrium(inflow, pressure)
    volume_per_flow = case["residence_time"] / balanced.density
    burnt = gas.reactor(inflow, pressure, volume_per_flow)
    found: dict[str, float] = {**case, "out": float(burnt.out)}
    modes: tuple[tuple[str, Burnt, Mode], ...] = (("equilibrium_", balanced, "equilibrium"), ("", burnt, "kinetic"))
    for prefix, reference, mode in modes:
        if reference.out:
            continue
        x = _ours(gas, case, fuel_fraction, volume_per_flow, reference, mode)
        found |= {
            f"{prefix}temperature": reference.temperature,
            f"{prefix}temperature_ours": x[5],
            f"{prefix}co": 1e3 * gas.moles(reference.stream, "CO"),
            f"{prefix}co_ours": float(np.exp(x[1])),
            f"{prefix}no": 1e3 * gas.nox(reference.stream),
            f"{prefix}no_ours": x[6],
        }
    return found


def _ours(gas: Gas, case: Case, fuel_fraction: float, volume_per_flow: float, start: Burnt, mode: Mode) -> np.ndarray:
    """Unknowns of our reactor, with the prompt NO of the mechanism of ``gas``."""
    air = air_stream(case["temperature"], 0.0)
    inflow = air.mixed(fuel_stream(gas.hydrogen_to_carbon, gas.heating_value), fuel_fraction)
    methylene = METHYLENE[gas.nitrogen] * inflow.carbon
    conditions = np.array([[case["pressure"], volume_per_flow, methylene, *map(float, inflow.parts())]]).T
    log = [np.log(1e3 * max(gas.moles(start.stream, name), 1e-15)) for name in MAJOR]
    no = 1e3 * gas.nox(start.stream)
    x, done = solve_reactors(np.array([[*log, start.temperature, no]]).T, conditions, mode, 1e-8)
    if not done.all():
        raise RuntimeError(f"our reactor did not converge: {case}")
    return x[:, 0]


def operating_line(engine: EngineData, powers: tuple[float, ...] = POWERS) -> list[State]:
    """States of the combustor in standard air at sea level: pressure, temperature, air, fuel, humidity."""
    names = [parameter.name for parameter in gas_path(engine, "power").parameters]
    points = np.zeros((len(powers), len(names)))
    points[:, names.index("demand")] = np.array(powers) * engine.ratings.take_off_power
    points[:, names.index("power_turbine_speed")] = 1.0
    solved = solve_many(points, engine_data=engine)
    if not solved.success.all():
        raise RuntimeError(f"gas path: {solved.failures}")
    columns = [solved.outputs[name].tolist() for name in STATES]
    return [(*state, 0.0) for state in zip(*columns, strict=True)]


def cantera_zones(gas: Gas, reactors: ReactorData, state: State) -> dict[str, float]:
    """Indices [kg/kg] and temperatures [K] of Cantera's network, and how many of its primary pockets are out."""
    found = network(gas, reactors, state)
    names = ("nox_index", "co_index", "exit_temperature", "primary_temperature")
    return {**{name: getattr(found, name) for name in names}, "out": sum(pocket.out for pocket in found.pockets)}


def our_zones(engine: EngineData, reactors: ReactorData, state: State) -> dict[str, float]:
    """The same of ours."""
    data = engine.combustor
    system = combustor(reactors, data.hydrogen_to_carbon, data.heating_value)
    named = {parameter.name: value for parameter, value in zip(system.parameters, state, strict=True)}
    solution = system.solve(named, method="newton")
    if not solution.success:
        raise RuntimeError(f"our network: {solution.message} at {named}")
    names = ("nox_index", "co_index", "exit_temperature", "primary_temperature")
    return {name: float(solution.outputs[name]) for name in names}


def slopes(solve: Callable[[State], dict[str, float]], state: State) -> dict[str, float]:
    """d ln EINOx/d humidity [kg/kg] and d ln EINOx/d ln(fuel flow), all else of the state fixed, by differences."""
    return {"humidity": humidity_slope(solve, state), "fuel": fuel_slope(solve, state)}


def humidity_slope(solve: Callable[[State], dict[str, float]], state: State) -> float:
    return (_log(solve, state, 2 * HUMIDITY, 1.0) - _log(solve, state, 0.0, 1.0)) / (2 * HUMIDITY)


def fuel_slope(solve: Callable[[State], dict[str, float]], state: State) -> float:
    step = np.log((1 + FUEL) / (1 - FUEL))
    return float((_log(solve, state, 0.0, 1 + FUEL) - _log(solve, state, 0.0, 1 - FUEL)) / step)


def _log(solve: Callable[[State], dict[str, float]], state: State, humidity: float, fuel: float) -> float:
    return float(np.log(solve((*state[:3], state[3] * fuel, humidity))["nox_index"]))


def compared_networks(engine: EngineData, reactors: ReactorData) -> list[dict[str, object]]:
    """The operating line: every mechanism's network and ours, with slopes at two powers."""
    data = engine.combustor
    theirs: dict[str, Gas] = {
        name: Gas(name, hydrogen_to_carbon=data.hydrogen_to_carbon, heating_value=data.heating_value)
        for name in MECHANISMS
    }
    theirs["broken"] = Gas(
        "no_prompt", fuel="broken", hydrogen_to_carbon=data.hydrogen_to_carbon, heating_value=data.heating_value
    )
    ours = {"ours": reactors} | {
        f"ours_{name}": reactors.replaced(methylene_fraction=METHYLENE[name]) for name in ("full", "no_prompt")
    }
    solvers: dict[str, Callable[[State], dict[str, float]]] = {
        **{name: partial(our_zones, engine, mine) for name, mine in ours.items()},
        **{name: partial(cantera_zones, gas, reactors) for name, gas in theirs.items()},
    }
    points: list[dict[str, object]] = []
    for power, state in zip(POWERS, operating_line(engine), strict=True):
        point: dict[str, object] = {"power": power, "state": state}
        point |= {name: solve(state) for name, solve in solvers.items()}
        if power in SLOPES_AT:
            point["slopes"] = {name: slopes(solve, state) for name, solve in solvers.items()}
        points.append(point)
    return points


def _rounded(value: object) -> object:
    if isinstance(value, dict):
        return {name: _rounded(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(entry) for entry in value]
    return float(f"{value:.5g}") if isinstance(value, float) else value


if __name__ == "__main__":
    engine = load_engine()
    figures = {
        "versions": made_with("cantera"),
        "single": {name: [single(Gas(name), case) for case in single_cases()] for name in MECHANISMS},
        "network": compared_networks(engine, engine.reactors),
    }
    print(json.dumps(_rounded(figures), indent=1))
