"""Fit the combustor's zones to FOCA's NOx and CO, and judge the result.

Four numbers nobody published (air and unmixedness of the primary zone, volumes of the primary and the dilution zone)
are solved by least squares on four residuals: ln NOx at 30, 60 and 100 % of the take-off rating and, with weight 0.3,
ln CO at 100 %. The states of the combustor are the gas path's: sea level, standard dry day, at rest, free turbine at
100 %. Every number stays inside the range that the data file states for it; two of the four end at a bound.
FOCA's formula is an average of a fleet and good to a factor of two for one engine: agreement at the fitted powers is no
validation, and the powers between them share the formula. One more number is chosen by hand, the methylene fraction: it
meets ICAO's effect of humidity. What neither has seen: idle, CO below 100 %, the effects of pressure and temperature.

The two fits of the data file differ in where the spread of the mixture is cut off.

Run: python problems/calibrate_combustor.py
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from vrsopt import foca
from vrsopt.bulk import ManySolutions
from vrsopt.combustor.bulk import solve_combustor_many
from vrsopt.combustor.data import ReactorData
from vrsopt.combustor.emissions import INDICES, INLET, SHIPPED, reactor_fits
from vrsopt.combustor.network import PARAMETERS, combustor
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.cycle import gas_path
from vrsopt.turboshaft.data import EngineData, load_engine

FREE = ("primary_air_fraction", "primary_unmixedness", "primary_volume", "dilution_volume")
FITTED = (0.30, 0.60, 1.00)  # of the take-off rating
REPORTED = (0.05, 0.07, 0.13, 0.30, 0.38, 0.46, 0.60, 0.65, 0.78, 0.87, 1.00)
CO_WEIGHT = 0.3
HUMID = 0.01  # kg/kg, over which the effect of humidity is measured
LEANEST = 0.05  # of the mean fuel fraction: what the leanest pocket keeps at least


def operating_line(engine: EngineData, powers: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shaft power [W] (N,), state of the combustor (N, 5) and burnt part of the fuel (N,) at shares of the rating."""
    names = [parameter.name for parameter in gas_path(engine, "power").parameters]
    points = np.zeros((len(powers), len(names)))
    points[:, names.index("demand")] = engine.ratings.take_off_power * np.array(powers)
    points[:, names.index("power_turbine_speed")] = 1.0
    outputs = solve_many(points, engine_data=engine).outputs
    states = np.column_stack([*(outputs[name] for name in INLET.values()), np.zeros(len(powers))])
    return points[:, names.index("demand")], states, 1.0 - outputs["hydrocarbon_index"]


def bounds(reactors: ReactorData) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest value (4,) of each free number: its range, and no pocket without fuel."""
    ranges = [reactors.provenance[name].range for name in FREE]
    lower, upper = np.array(ranges, dtype=float).T
    unmixed = FREE.index("primary_unmixedness")
    upper[unmixed] = min(upper[unmixed], (1.0 - LEANEST) / reactors.mixture_cutoff)
    return lower, upper


@dataclass(frozen=True)
class Fit:
    """Four numbers solved: values, residuals (ln NOx three times, 0.3 ln CO), and which numbers ended at a bound."""

    values: dict[str, float]
    residuals: np.ndarray
    at_bound: tuple[str, ...]


def calibrate(engine: EngineData) -> Fit:
    """Solve the four numbers of the engine's reactors, with exact derivatives."""
    burner, reactors = engine.combustor, engine.reactors
    system = combustor(reactors, burner.hydrogen_to_carbon, burner.heating_value, free=FREE)
    power, states, share = operating_line(engine, FITTED)
    goals = [[("nox_index", goal, 1.0)] for goal in foca.nox_index(power) / share]  # per kg of burnt fuel
    goals[-1].append(("co_index", foca.co_index(power[-1]) / share[-1], CO_WEIGHT))

    def evaluate(logarithms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        free = dict(zip(FREE, np.exp(logarithms).tolist(), strict=True))
        residuals, slopes = [], []
        for state, wanted in zip(states, goals, strict=True):
            point = dict(zip((parameter.name for parameter in PARAMETERS), state.tolist(), strict=True))
            solution = system.solve({**point, **free}, method="newton")
            if not solution.success:
                raise RuntimeError(f"{solution.message} at {free}")
            slope = system.sensitivities(solution)
            for name, goal, weight in wanted:
                value = solution.outputs[name]
                residuals.append(weight * np.log(value / goal))
                slopes.append([weight * slope[name][one] * free[one] / value for one in FREE])
        return np.array(residuals), np.array(slopes)

    lower, upper = (np.log(bound) for bound in bounds(reactors))
    solved = least_squares(
        lambda x: evaluate(x)[0], (lower + upper) / 2.0, lambda x: evaluate(x)[1], bounds=(lower, upper), xtol=1e-12
    )
    at_bound = tuple(name for name, active in zip(FREE, solved.active_mask, strict=True) if active)
    return Fit(dict(zip(FREE, np.exp(solved.x).tolist(), strict=True)), solved.fun, at_bound)


def burnt(engine: EngineData, states: np.ndarray, share: np.ndarray) -> dict[str, np.ndarray]:
    """Outputs of the engine's combustor at states (N, 5); indices per kg of all fuel, of which a share (N,) burns."""
    burner = engine.combustor
    solved: ManySolutions = solve_combustor_many(
        states, engine.reactors, burner.hydrogen_to_carbon, burner.heating_value
    )
    if not solved.success.all():
        raise RuntimeError(str(solved.failures))
    return solved.outputs | {name: share * solved.outputs[name] for name in INDICES}


def fits(engine: EngineData) -> dict[str, EngineData]:
    """The engine with each fit of its combustor, by the name of the fit."""
    return {name: engine if name == SHIPPED else engine.variant(name) for name in reactor_fits(engine)}


def humidity_slopes(engine: EngineData, states: np.ndarray, share: np.ndarray) -> np.ndarray:
    """d ln EINOx / d humidity at fixed pressure, temperature, air and fuel at the combustor (N,)."""
    humid = states.copy()
    humid[:, 4] = HUMID
    return np.log(burnt(engine, humid, share)["nox_index"] / burnt(engine, states, share)["nox_index"]) / HUMID


def over_foca(out: Mapping[str, np.ndarray], power: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What is burnt (``out``) at ``power`` (N,) [W]: NOx and CO indices (N,) over FOCA's, less one [%]."""
    return (
        100.0 * (out["nox_index"] / foca.nox_index(power) - 1.0),
        100.0 * (out["co_index"] / foca.co_index(power) - 1.0),
    )


def table(engine: EngineData) -> list[str]:
    """NOx and CO against FOCA on the operating line, slopes, equivalence ratios and temperatures, as lines of text."""
    power, states, share = operating_line(engine, REPORTED)
    out = burnt(engine, states, share)
    nox, fuel = out["nox_index"], states[:, 3] / share
    more_nox, more_co = over_foca(out, power)
    wet, leaner = humidity_slopes(engine, states, share), states.copy()
    leaner[:, 3] *= 0.95
    less = 100.0 * (burnt(engine, leaner, share)["nox_index"] * 0.95 / nox - 1.0)
    slope = np.gradient(np.log(nox * fuel), np.log(fuel))
    lines = [
        "power   EINOx  FOCA    diff   EICO   FOCA   diff   dlnNOx/  dlnEI/  NOx at   phi      phi      T prim. T exit",
        "  %     g/kg   g/kg     %     g/kg   g/kg    %     dlnWf    dhum    -5% fuel primary  intermed.  K       K",
    ]
    for i, part in enumerate(REPORTED):
        foca_nox, foca_co = foca.nox_index(float(power[i])), foca.co_index(float(power[i]))
        lines.append(
            f"{100 * part:4.0f}  {1e3 * nox[i]:6.3f} {1e3 * foca_nox:6.3f} {more_nox[i]:+7.1f} "
            f"{1e3 * out['co_index'][i]:6.1f} {1e3 * foca_co:6.1f} {more_co[i]:+6.0f}"
            f"   {slope[i]:6.2f}  {wet[i]:6.1f}  {less[i]:+6.1f}   {out['primary_equivalence_ratio'][i]:6.3f}"
            f"   {out['intermediate_equivalence_ratio'][i]:6.3f}   {out['primary_temperature'][i]:6.0f}"
            f"  {out['exit_temperature'][i]:6.0f}"
        )
    return lines


def report(engine: EngineData) -> list[str]:
    """What the calibration of both fits gives, as lines of text."""
    lines = []
    for name, one in fits(engine).items():
        fit = calibrate(one)
        lines += [f"{name}: residuals " + " ".join(f"{value:+.4f}" for value in fit.residuals)]
        for key, low, high in zip(FREE, *bounds(one.reactors), strict=True):
            mark = "  at its bound" if key in fit.at_bound else ""
            shipped = getattr(one.reactors, key)
            lines.append(
                f"  {key:<22} shipped {shipped:.6g}  solved {fit.values[key]:.6g}  [{low:.4g}, {high:.4g}]{mark}"
            )
        lines += [*table(one), ""]
    return lines


if __name__ == "__main__":
    print("\n".join(report(load_engine())))
