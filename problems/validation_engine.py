"""The engine and its emissions against what is published: tables for problems/validation.md.

Imported by validation.py. Calibrated: the design point (four numbers), and the combustor's zones on FOCA's formula; the
tables say where a comparison is with one of these.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from calibrate_combustor import FITTED, burnt, fits, humidity_slopes, operating_line
from emissions import slopes
from level_flight import KNOT
from page_table import table

from vrsopt import foca
from vrsopt.atmosphere import standard_air
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.cycle import gas_path, sized
from vrsopt.turboshaft.data import EngineData, load_engine

BOX_LOW = (20e3, 0.7, 0.0, -15.0, 0.0, 0.0, 0.0, 0.0)
BOX_HIGH = (330e3, 1.2, 2000.0, 30.0, 0.22, 0.05, 10e3, 0.03)
POINTS = 2000
REFERRED = np.array([100e3, 200e3, 280e3])  # W, at which similarity is tested
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


def consumption() -> Iterator[str]:
    """Design point, part power and slopes against sources."""
    engine = load_engine()
    design, rated = sized(engine), engine.design_point.power
    line = many(np.array([1.0, 0.698, 0.8]) * rated)
    sfc = 3.6e6 * line["fuel_flow"] / line["power"]
    manual = many(257e3, 1.0, (0.0, 0.0, 131.5 * KNOT / standard_air(0.0).speed_of_sound))
    high, low = np.linspace(200e3, rated, 40), np.linspace(20e3, 200e3, 60)
    over, under = (100 * (many(power)["fuel_flow"] / foca.fuel_flow(power) - 1) for power in (high, low))
    exponents = [
        math.log(line[name][0] / line[name][2]) / math.log(1.25)
        for name in ("gas_generator_speed", "power_turbine_inlet_temperature")
    ]
    rows = [
        ("SFC at 313 kW, sea level static", f"{sfc[0]:.6f} kg/kWh", "0.395 (calibration: design point)"),
        (
            "air flow, pressure ratio there",
            f"{line['air_flow'][0]:.5f} kg/s, {line['pressure_ratio'][0]:.5f}",
            "1.56, 7.1 (calibration)",
        ),
        ("T4, T45 there", f"{design.t4:.0f} K, {design.t45:.0f} K", "1351, 1110 ± 15 (energy balance of these four)"),
        (
            "fuel at 257 kW, 131.5 kt",
            f"{3600 * manual['fuel_flow'][0]:.1f} kg/h",
            "102 ± 1 (flight manual): missed, see [the engine page](engine.md)",
        ),
        ("SFC at 69.8 % over SFC at full power", f"{sfc[1] / sfc[0]:.3f}", "1.098 ± 3 % (250-B17F)"),
        (
            "fuel over FOCA, 200 to 313 kW",
            f"{over.min():+.1f} to {over.max():+.1f} %",
            "-12 to +5 % (partly circular: the combustion efficiency follows FOCA's CO and HC)",
        ),
        ("fuel over FOCA, 20 to 200 kW", f"{under.min():+.1f} to {under.max():+.1f} %", "± 25 % (partly circular)"),
        ("exponent of N1 over power, 80 to 100 %", f"{exponents[0]:.3f}", "0.155 ± 0.05 (RR300 type certificate)"),
        ("exponent of T45 over power", f"{exponents[1]:.3f}", "0.245 ± 0.05 (RR300 type certificate)"),
    ]
    yield from table(("quantity", "model", "reference"), rows)


def free_turbine() -> Iterator[str]:
    """Best free-turbine speed at constant gas-generator speed."""
    speeds, rows = np.linspace(0.55, 1.15, 1201), []
    for generator, reference in ((1.00, 100), (0.95, 91), (0.90, 83), (0.85, 76), (0.80, 69)):
        out = many(generator, speeds, mode="gas_generator_speed")
        best = int(np.argmin(out["fuel_flow"] / out["power"]))
        root = out["best_power_turbine_speed"][best]
        rows.append(
            (f"{100 * generator:.0f} %", f"{100 * speeds[best]:.1f} %", f"{100 * root:.1f} %", f"{reference} ± 2 %")
        )
    yield "Free-turbine speed of least consumption at constant gas-generator speed:\n"
    yield from table(
        ("gas generator", "best free-turbine speed", "root of the drop over its design value", "reference"), rows
    )


def similarity() -> Iterator[str]:
    """Referred parameters at equal referred power, speed and Mach number, 100, 200 and 280 kW; largest departure."""
    rows, speed, mach = [], np.array([0.9, 1.0, 1.05]), 0.1
    base = many(REFERRED, speed, (0.0, 0.0, mach))
    ground = standard_air(0.0)
    for altitude, offset in ((2000.0, 0.0), (0.0, 30.0), (0.0, -15.0)):
        air = standard_air(altitude, offset)
        theta, delta = air.temperature / ground.temperature, air.pressure / ground.pressure
        away = many(REFERRED * delta * theta**0.5, speed * theta**0.5, (altitude, offset, mach))
        departures = [
            100 * (away[name] / base[name] / scale - 1)
            for name, scale in (
                ("gas_generator_speed", theta**0.5),
                ("pressure_ratio", 1.0),
                ("turbine_inlet_temperature", theta),
                ("fuel_flow", delta * theta**0.5),
            )
        ]
        cells = [f"{np.abs(part).max():.2f} %" for part in departures[:3]]
        rows.append((f"{altitude:.0f} m, ISA{offset:+.0f} K", *cells, *(f"{value:+.1f} %" for value in departures[3])))
    yield "Similarity, departure from equal referred values (targets 0.4, 0.4, 1 and 2 %):\n"
    header = ("place", "N1", "pressure ratio", "T4", "fuel at 100 kW", "fuel at 200 kW", "fuel at 280 kW")
    yield from table(header, rows)
    yield (
        "Where the fuel misses 2 % it is the combustion efficiency, which depends on the absolute pressure and not on\n"
        "referred parameters.\n"
    )


def robustness() -> Iterator[str]:
    """Convergence over the whole box, of the shipped engines."""
    rows = []
    for name in ("allison_250_c20b", "generic_500kw"):
        engine = load_engine(name)
        scale = engine.design_point.power / 313e3
        low, high = np.array(BOX_LOW), np.array(BOX_HIGH)
        low[[0, 6]], high[[0, 6]] = low[[0, 6]] * scale, high[[0, 6]] * scale
        points = np.random.default_rng(11).uniform(low, high, (POINTS, len(low)))
        solved = solve_many(points, engine_data=engine)
        rows.append(
            (
                engine.name,
                f"{int(solved.success.sum())} of {POINTS}",
                f"{solved.residual_norm.max():.1e}",
                _agreement(engine, points[:20]),
            )
        )
    yield "Random points of the whole box, humidity and bleed and offtake too, from one start:\n"
    yield from table(("engine", "converged", "largest scaled residual", "IPOPT against Newton"), rows)


def _agreement(engine: EngineData, points: np.ndarray) -> str:
    """Largest difference of the scaled unknowns between the two solvers."""
    system, worst = gas_path(engine), 0.0
    for row in points:
        values = dict(zip((item.name for item in system.parameters), row.tolist(), strict=True))
        first, second = system.solve(values, method="ipopt"), system.solve(values, method="newton")
        if not (first.success and second.success):
            return f"{first.message}; {second.message}"
        worst = max(worst, float(np.abs(first.scaled - second.scaled).max()))
    return f"{worst:.1e}"


def emissions() -> Iterator[str]:
    """NOx and CO of both fits along the operating line."""
    engine = load_engine()
    power, *states = operating_line(engine, MISSION_LINE)
    rows = []
    for name, one in fits(engine).items():
        out, steep, humid = burnt(one, *states), slopes(one, MISSION_LINE), humidity_slopes(one, *states)
        for k, share in enumerate(MISSION_LINE):
            nox, co = foca.nox_index(power[k]), foca.co_index(power[k])
            rows.append(
                (
                    name.replace("_", " "),
                    f"{100 * share:.0f} %" + (" (fitted)" if share in FITTED else ""),
                    f"{1e3 * out['nox_index'][k]:.2f}",
                    f"{100 * (out['nox_index'][k] / nox - 1):+.0f} %",
                    f"{1e3 * out['co_index'][k]:.1f}",
                    f"{100 * (out['co_index'][k] / co - 1):+.0f} %",
                    f"{steep[k]:.2f}",
                    f"{humid[k]:.1f}",
                )
            )
    yield "## Emissions\n"
    yield (
        "Indices along the operating line, sea level static, against FOCA's fleet average. The zones are fitted to it\n"
        "where marked: agreement there is no validation. More, idle too, on [the emissions page](emissions.md).\n"
    )
    header = ("fit", "power", "NOx g/kg", "to FOCA", "CO g/kg", "to FOCA", "d ln NOx/d ln fuel")
    yield from table((*header, "d ln NOx/d humidity (prompt NO chosen for ICAO's -19)"), rows)
