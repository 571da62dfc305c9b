"""The engine and its emissions against what is published: numbers and tables for problems/validation.md.

Imported by validation.py, and by tests/test_validation_page.py, which holds the numbers to their bounds. Calibrated:
the design point (four numbers), and the combustor's zones on FOCA's formula; the tables say where a comparison is with
one of these.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import numpy as np
from calibrate_combustor import FITTED, burnt, fits, humidity_slopes, operating_line, over_foca
from emissions import slopes
from level_flight import KNOT
from page_table import Figure, figures, table

from vrsopt import foca
from vrsopt.atmosphere import standard_air
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.cycle import gas_path, sized
from vrsopt.turboshaft.data import EngineData, load_engine

BOX_LOW = (20e3, 0.7, 0.0, -15.0, 0.0, 0.0, 0.0, 0.0)
BOX_HIGH = (330e3, 1.2, 2000.0, 30.0, 0.22, 0.05, 10e3, 0.03)
POINTS = 2000
REFERRED = np.array([100e3, 200e3, 280e3])  # W, at which similarity is tested
BEST_SPEED_TOLERANCE = 2.0  # %
MISSION_LINE = (0.30, 0.38, 0.60, 0.78, 1.00)


def many(
    power: object, speed: object = 1.0, place: tuple[float, float, float] = (0.0, 0.0, 0.0), **how: object
) -> dict:
    """Outputs at powers [W] (or another demand) and free-turbine speeds, at (altitude, isa_offset, mach), dry."""
    columns = np.broadcast_arrays(power, speed, *place, 0.0, 0.0, 0.0)
    solved = solve_many(np.column_stack([np.ravel(column) for column in columns]), **how)  # type: ignore[arg-type]
    if not solved.success.all():
        raise RuntimeError(next(iter(solved.failures.values())))
    return solved.outputs


@cache
def consumption() -> list[Figure]:
    """Design point, part power and slopes against sources."""
    engine = load_engine()
    design, rated = sized(engine), engine.design_point.power
    line = many(np.array([1.0, 0.698, 0.8]) * rated)
    sfc = 3.6e6 * line["fuel_flow"] / line["power"]
    manual = many(257e3, 1.0, (0.0, 0.0, 131.5 * KNOT / standard_air(0.0).speed_of_sound))
    high, low = np.linspace(200e3, rated, 40), np.linspace(20e3, 200e3, 60)
    over, under = (100 * (many(power)["fuel_flow"] / foca.fuel_flow(power) - 1) for power in (high, low))
    speed, temperature = (
        math.log(line[name][0] / line[name][2]) / math.log(1.25)
        for name in ("gas_generator_speed", "power_turbine_inlet_temperature")
    )
    rr300 = "RR300 type certificate"
    circular = "FOCA; partly circular: the combustion efficiency follows its CO and HC"
    per_cent, kelvin, calibrated, balance = "{:+.1f}", "{:.0f}", "design point: calibration", "energy balance of these"
    return [
        Figure("SFC at 313 kW, sea level static, kg/kWh", sfc[0], 0.3949, 0.3951, "{:.4f}", calibrated, "0.395"),
        Figure("air flow there, kg/s", line["air_flow"][0], 1.559, 1.561, "{:.3f}", calibrated, "1.56"),
        Figure("pressure ratio there", line["pressure_ratio"][0], 7.099, 7.101, "{:.3f}", calibrated, "7.1"),
        Figure("T4 there, K", design.t4, 1336.0, 1366.0, kelvin, balance, "1351 ± 15"),
        Figure("T45 there, K", design.t45, 1095.0, 1125.0, kelvin, balance, "1110 ± 15"),
        Figure("power-turbine efficiency there", design.power_turbine_efficiency, 0.75, 0.82, "{:.3f}", balance),
        Figure(
            "fuel at 257 kW, 131.5 kt, kg/h",
            3600 * manual["fuel_flow"][0],
            101.0,
            103.0,
            "{:.1f}",
            "flight manual; see [the engine page](engine.md)",
            "102 ± 1",
        ),
        Figure(
            "SFC at 69.8 % over SFC at full power", sfc[1] / sfc[0], 1.065, 1.131, "{:.3f}", "250-B17F", "1.098 ± 3 %"
        ),
        Figure("fuel over FOCA, 200 to 313 kW, least, %", over.min(), -12.0, 5.0, per_cent, circular),
        Figure("the same, most, %", over.max(), -12.0, 5.0, per_cent, circular),
        Figure("fuel over FOCA, 20 to 200 kW, least, %", under.min(), -25.0, 25.0, per_cent, circular),
        Figure("the same, most, %", under.max(), -25.0, 25.0, per_cent, circular),
        Figure("exponent of N1 over power, 80 to 100 %", speed, 0.105, 0.205, "{:.3f}", rr300, "0.155 ± 0.05"),
        Figure("exponent of T45 over power", temperature, 0.195, 0.295, "{:.3f}", rr300, "0.245 ± 0.05"),
    ]


class BestSpeed(NamedTuple):
    """Free-turbine speed of least consumption at a gas-generator speed, and what the reference study has; per cent."""

    generator: float
    best: float
    root: float  # of the drop over its design value
    reference: float


@cache
def free_turbine() -> list[BestSpeed]:
    speeds, rows = np.linspace(0.55, 1.15, 1201), []
    for generator, reference in ((100, 100), (95, 91), (90, 83), (85, 76), (80, 69)):
        out = many(generator / 100, speeds, mode="gas_generator_speed")
        best = int(np.argmin(out["fuel_flow"] / out["power"]))
        root = out["best_power_turbine_speed"][best]
        rows.append(BestSpeed(generator, 100 * float(speeds[best]), 100 * float(root), reference))
    return rows


class Departure(NamedTuple):
    """Largest departure from equal referred values at a place, and that of the fuel at each of REFERRED; per cent."""

    place: str
    generator_speed: float
    pressure_ratio: float
    temperature: float
    fuel: tuple[float, ...]


@cache
def similarity() -> list[Departure]:
    """Referred parameters at equal referred power, speed and Mach number, 100, 200 and 280 kW."""
    rows, speed, mach = [], np.array([0.9, 1.0, 1.05]), 0.1
    base = many(REFERRED, speed, (0.0, 0.0, mach))
    ground = standard_air(0.0)
    for altitude, offset in ((2000.0, 0.0), (0.0, 30.0), (0.0, -15.0)):
        air = standard_air(altitude, offset)
        theta, delta = air.temperature / ground.temperature, air.pressure / ground.pressure
        away = many(REFERRED * delta * theta**0.5, speed * theta**0.5, (altitude, offset, mach))
        generator, pressure, temperature, fuel = (
            100 * (away[name] / base[name] / scale - 1)
            for name, scale in (
                ("gas_generator_speed", theta**0.5),
                ("pressure_ratio", 1.0),
                ("turbine_inlet_temperature", theta),
                ("fuel_flow", delta * theta**0.5),
            )
        )
        largest = (float(np.abs(part).max()) for part in (generator, pressure, temperature))
        rows.append(Departure(f"{altitude:.0f} m, ISA{offset:+.0f} K", *largest, tuple(fuel.tolist())))
    return rows


class Solved(NamedTuple):
    """Random points of the whole box: how many are solved, largest residual, and IPOPT's difference from Newton."""

    engine: str
    solved: int
    residual: float
    difference: float


@cache
def robustness() -> list[Solved]:
    """Convergence over the whole box, of the shipped engines."""
    rows = []
    for name in ("allison_250_c20b", "generic_500kw"):
        engine = load_engine(name)
        scale = engine.design_point.power / 313e3
        low, high = np.array(BOX_LOW), np.array(BOX_HIGH)
        low[[0, 6]], high[[0, 6]] = low[[0, 6]] * scale, high[[0, 6]] * scale
        points = np.random.default_rng(11).uniform(low, high, (POINTS, len(low)))
        found = solve_many(points, engine_data=engine)
        difference = _difference(engine, points[:20])
        rows.append(Solved(engine.name, int(found.success.sum()), float(found.residual_norm.max()), difference))
    return rows


def _difference(engine: EngineData, points: np.ndarray) -> float:
    """Largest difference of the scaled unknowns between the two solvers."""
    system, worst = gas_path(engine), 0.0
    for row in points:
        values = dict(zip((item.name for item in system.parameters), row.tolist(), strict=True))
        first, second = system.solve(values, method="ipopt"), system.solve(values, method="newton")
        if not (first.success and second.success):
            raise RuntimeError(f"{first.message}; {second.message}")
        worst = max(worst, float(np.abs(first.scaled - second.scaled).max()))
    return worst


class Indices(NamedTuple):
    """One fit of the combustor at a share of the rating: NOx and CO [g/kg], what is more than FOCA's [%], slopes."""

    fit: str
    power: float
    nox: float
    nox_percent: float
    co: float
    co_percent: float
    fuel_slope: float
    humidity_slope: float


@cache
def emissions() -> list[Indices]:
    """NOx and CO of both fits along the operating line."""
    engine = load_engine()
    power, *states = operating_line(engine, MISSION_LINE)
    rows = []
    for name, one in fits(engine).items():
        out = burnt(one, *states)
        more_nox, more_co = over_foca(out, power)
        columns = (
            1e3 * out["nox_index"],
            more_nox,
            1e3 * out["co_index"],
            more_co,
            slopes(one, MISSION_LINE),
            humidity_slopes(one, *states),
        )
        rows += [Indices(name, *row) for row in zip(MISSION_LINE, *(c.tolist() for c in columns), strict=True)]
    return rows


# -- tables ------------------------------------------------------------------------------------------------------------


def consumption_table() -> Iterator[str]:
    yield from figures(consumption())


def free_turbine_table() -> Iterator[str]:
    yield "Free-turbine speed of least consumption at constant gas-generator speed:\n"
    rows = [
        (f"{b.generator} %", f"{b.best:.1f} %", f"{b.root:.1f} %", f"{b.reference} ± {BEST_SPEED_TOLERANCE:.0f} %")
        for b in free_turbine()
    ]
    yield from table(
        ("gas generator", "best free-turbine speed", "root of the drop over its design value", "reference"), rows
    )


def similarity_table() -> Iterator[str]:
    yield "Similarity, departure from equal referred values (targets 0.4, 0.4, 1 and 2 %):\n"
    rows = [(d.place, *(f"{x:.2f} %" for x in d[1:4]), *(f"{x:+.1f} %" for x in d.fuel)) for d in similarity()]
    header = ("place", "N1", "pressure ratio", "T4", "fuel at 100 kW", "fuel at 200 kW", "fuel at 280 kW")
    yield from table(header, rows)
    yield (
        "Where the fuel misses 2 % it is the combustion efficiency, which depends on the absolute pressure and not on\n"
        "referred parameters.\n"
    )


def robustness_table() -> Iterator[str]:
    yield "Random points of the whole box, humidity and bleed and offtake too, from one start:\n"
    rows = [(s.engine, f"{s.solved} of {POINTS}", f"{s.residual:.1e}", f"{s.difference:.1e}") for s in robustness()]
    yield from table(("engine", "converged", "largest scaled residual", "IPOPT against Newton"), rows)


def emissions_table() -> Iterator[str]:
    yield "## Emissions\n"
    yield (
        "Indices along the operating line, sea level static, against FOCA's fleet average. The zones are fitted to it\n"
        "where marked: agreement there is no validation. More, idle too, on [the emissions page](emissions.md).\n"
    )
    rows = [
        (
            e.fit.replace("_", " "),
            f"{100 * e.power:.0f} %" + (" (fitted)" if e.power in FITTED else ""),
            f"{e.nox:.2f}",
            f"{e.nox_percent:+.0f} %",
            f"{e.co:.1f}",
            f"{e.co_percent:+.0f} %",
            f"{e.fuel_slope:.2f}",
            f"{e.humidity_slope:.1f}",
        )
        for e in emissions()
    ]
    header = ("fit", "power", "NOx g/kg", "to FOCA", "CO g/kg", "to FOCA", "d ln NOx/d ln fuel")
    yield from table((*header, "d ln NOx/d humidity (prompt NO chosen for ICAO's -19)"), rows)
