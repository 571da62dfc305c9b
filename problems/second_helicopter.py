"""A second helicopter from public data: does a slower rotor save on a UH-60A what the literature says it saves?

    python problems/second_helicopter.py [--reuse]

The UH-60A and its T700 are data files (vrsopt/data/uh60a.toml, t700.toml); nothing here or there is fitted to a saving.
Trims are walked along rotor speed at every flight; from each walk come the least main-rotor power and the least fuel,
with trims as the only condition, as most published studies have it, and the least fuel within the limits of blade
loading, gearbox, engine and tail rotor. Checks against public power, fuel and trim go first, ingredients that the data
leave open last. Writes problems/second_helicopter.json, the tables of the page and the figure: seven minutes of CPU
time. With --reuse the walks and checks of the last results are taken, and only optima, page and figure are made again.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import degrees
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import Akima1DInterpolator
from second_helicopter_page import draw, write_page

import vrsopt
from vrsopt.aircraft import Aircraft, load_aircraft
from vrsopt.helicopter import Helicopter, helicopter
from vrsopt.limits import LIMIT_NAMES, Limits
from vrsopt.operating_point import OperatingPoint
from vrsopt.point_optimum import physics_optimum
from vrsopt.rotor.airfoil import load_section, with_largest_lift
from vrsopt.turboshaft.data import load_engine

AIRCRAFT = "uh60a"
RESULTS = Path(__file__).with_suffix(".json")
KNOT, POUND, HORSEPOWER = 1852 / 3600, 0.45359237, 745.69987
SPEEDS = (0.0, 10.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0, 69.4444, 75.0)  # m/s; 250 km/h is that of Han et al.
FLIGHTS = ((7257.0, 0.0), (8300.0, 0.0), (8300.0, 2000.0))  # kg, m: 16000 and 18300 lb
OPEN, OPEN_SPEEDS = FLIGHTS[1], (0.0, 40.0, 69.4444)  # where what the data leave open is tried
RATIOS = np.round(np.arange(1.15, 0.749, -0.025), 3)  # rotor speed over nominal
NARROW, WIDE = (0.85, 1.0), (0.75, 1.15)
DEEP_STALL = 1.35  # a walk ends where power has grown so much above its least
STEP = 0.001  # of the rotor speed, at which a walk is read

# Gen Hel's trims of the UH-60A at 16825 lb, sea level (NASA TM-100991, table B.1): hp of one engine, of the main rotor
# (its required torque at the hub times 27 rad/s), fuel flow of one engine in lb/h.
GEN_HEL = ((0.0, 911.1, 1613.4, 476.3), (80 * KNOT, 552.6, 1018.5, 349.3))
# Gen Hel's level trims at 16400 lb (NASA TM-85890, table 4): knots, pitch attitude [deg], collective stick [in]; the
# blade's pitch at 3/4 radius is 0.2286 rad + 0.02792 rad/in less three quarters of 0.3142 rad.
TRIMS = ((1, 5.052, 5.719), (20, 5.834, 5.361), (40, 4.340, 4.580), (60, 3.489, 4.194), (100, 2.469, 4.425))
TRIMS = (*TRIMS, (140, -0.2996, 5.718))
# GE's status-81 deck of the T700-GE-700 at sea level (TM-100991, figure 7): lb/h, shp.
STATUS_81 = ((201.5, 107.6), (285.7, 358.9), (412.1, 742.8), (481.5, 941.9), (567.4, 1185.0), (683.5, 1503.8))


@dataclass(frozen=True)
class Walk:
    """Trims along falling rotor speed at one flight: (n,) each, and why the walk ended."""

    mass: float
    altitude: float
    speed: float
    ratio: Sequence[float]
    main_rotor_power: Sequence[float]
    tail_rotor_power: Sequence[float]
    fuel_flow: Sequence[float]
    usages: Sequence[Sequence[float]]
    end: str

    def between(self, values: Sequence[float], ratio: np.ndarray) -> np.ndarray:
        return np.asarray(Akima1DInterpolator(self.ratio[::-1], values[::-1])(ratio))


def walk(machine: Helicopter, mass: float, altitude: float, speed: float) -> Walk:
    """Points from the fastest rotor down, each from its neighbour's trim."""
    rotor = machine.aircraft.main_rotor
    limits = Limits(machine.aircraft, machine.engine)  # the margin comes later: here the limit itself
    flight = {"mass": mass, "altitude": altitude, "isa_offset": 0.0, "speed": speed, "climb_angle": 0.0}
    flight |= {"load_factor": 1.0, "twist": rotor.twist}
    found: list[OperatingPoint] = []
    ratios, end, guess = [], "lower bound", None
    for ratio in RATIOS:
        speed_now = float(ratio) * rotor.nominal_rotor_speed
        point = machine.point({**flight, "rotor_speed": speed_now}, limits=limits, guess=guess)
        if not point.success:
            if found:
                end = "no trim"
                break
            continue  # the fastest rotor's advancing tip may have none
        power = point.main_rotor_power
        if found and power > DEEP_STALL * min(p.main_rotor_power for p in found):
            end = "deep stall"
            break
        found.append(point)
        ratios.append(float(ratio))
        guess = point.trim.solution
    return Walk(
        mass,
        altitude,
        speed,
        tuple(ratios),
        tuple(p.main_rotor_power for p in found),
        tuple(p.tail_rotor_power for p in found),
        tuple(p.fuel_flow for p in found),
        tuple(tuple(p.usages[name] for name in LIMIT_NAMES) for p in found),
        end,
    )


def optima(found: Walk, margin: float) -> dict[str, float | str] | None:
    """Best rotor speeds (percent) and savings (percent) of a walk; None where 100 % has no trim.

    With limits, the nominal rotor may be beyond one: then the optimum may use as much of it.
    """
    if len(found.ratio) < 4 or not found.ratio[-1] < 1.0 <= found.ratio[0]:
        return None
    ratio = np.minimum(np.arange(found.ratio[-1], found.ratio[0] + STEP / 2, STEP), found.ratio[0])
    curves = {n: found.between(getattr(found, n), ratio) for n in ("main_rotor_power", "tail_rotor_power", "fuel_flow")}
    curves["both_rotors"] = curves["main_rotor_power"] + curves["tail_rotor_power"]
    usage = np.array([found.between([u[k] for u in found.usages], ratio) for k in range(len(LIMIT_NAMES))])
    usage[0] *= margin  # blade loading
    nominal = int(np.argmin(np.abs(ratio - 1.0)))
    allowed = np.maximum(1.0, usage[:, nominal]) + 1e-6
    inside = np.all(usage <= allowed[:, None], axis=0)
    result: dict[str, float | str] = {}

    def best(label: str, quantity: str, where: np.ndarray) -> int:
        k = int(np.argmin(np.where(where, curves[quantity], np.inf)))
        result[f"{label}_rotor_speed"] = 100 * float(ratio[k])
        result[f"{label}_saving"] = 100 * (1 - float(curves[quantity][k] / curves[quantity][nominal]))
        return k

    for label, (low, high) in (("narrow", NARROW), ("wide", WIDE)):
        band = (ratio >= low - STEP / 2) & (ratio <= high + STEP / 2)
        best(f"{label}_power", "main_rotor_power", band)
        best(f"{label}_rotors", "both_rotors", band)
        best(f"{label}_fuel", "fuel_flow", band)
        k = best(f"{label}_limited", "fuel_flow", band & inside)
        result[f"{label}_limited_power"] = 100 * (
            1 - float(curves["main_rotor_power"][k] / curves["main_rotor_power"][nominal])
        )
        beyond = [i for i in (k - 1, k + 1) if 0 <= i < len(ratio) and band[i] and not inside[i]]
        over = np.argmax(usage[:, beyond[0]] / allowed) if beyond else None
        result[f"{label}_active"] = "none" if over is None else LIMIT_NAMES[int(over)]
    result["nominal_power_kw"] = 1e-3 * float(curves["main_rotor_power"][nominal])
    result["nominal_fuel_kg_h"] = 3600 * float(curves["fuel_flow"][nominal])
    result["within_limits"] = float(np.all(usage[1:, nominal] <= 1.0))
    return result


def checks() -> dict[str, list[dict[str, float]]]:
    """The model beside public power, fuel and trim."""
    power, trims, engine = [], [], []
    for speed, shaft, rotor, fuel in GEN_HEL:
        point = vrsopt.trim(16825 * POUND, speed, aircraft=AIRCRAFT, method="newton")
        own = point.shaft_power_per_engine / HORSEPOWER
        power.append(
            {
                "speed": speed,
                "shaft_hp": own,
                "shaft_hp_public": shaft,
                "rotor_hp": point.main_rotor_power / HORSEPOWER,
                "rotor_hp_public": rotor,
                "fuel_lb_h": 3600 * point.fuel_flow / 2 / POUND,
                "fuel_lb_h_public": fuel,
            }
        )
    for knots, pitch, stick in TRIMS:
        point = vrsopt.trim(16400 * POUND, knots * KNOT, aircraft=AIRCRAFT, method="newton")
        public = degrees(0.2286 + 0.02792 * stick - 0.75 * 0.3142)
        trims.append({"knots": knots, "pitch": degrees(point.pitch), "pitch_public": pitch})
        trims[-1] |= {"collective": degrees(point.collective), "collective_public": public}
    data = load_engine("t700")
    for fuel, shaft in STATUS_81:
        result = vrsopt.engine(shaft * HORSEPOWER, engine_data=data)
        own = 3600 * result.fuel_flow_kg_s / POUND
        engine.append({"shp": shaft, "fuel_lb_h": own, "fuel_lb_h_public": fuel})
    return {"power": power, "trims": trims, "engine": engine}


def variants(base: Aircraft) -> dict[str, Aircraft]:
    """What the data leave open, one at a time."""
    rotor = base.main_rotor
    level = rotor.section.moment_level
    sections = {
        "largest lift +15 %": with_largest_lift(rotor.section, 1.15),
        "section moment 0.015 more nose-down": rotor.section.replaced(moment_level=(level[0] - 0.015, *level[1:])),
        "NACA 0012, no drag rise with Mach number": load_section("naca_0012"),
        "NACA 23012 of the Bo 105": load_aircraft("bo105").main_rotor.section,
    }
    return {
        **{name: base.replaced(main_rotor=rotor.replaced(section=section)) for name, section in sections.items()},
        "section drag level 0.0080": base.replaced(main_rotor=rotor.replaced(section_drag_level=0.008)),
        "induced-power factor 1.15": base.replaced(main_rotor=rotor.replaced(induced_power_factor=1.15)),
        "parasite area 2.4 m²": base.replaced(fuselage=base.fuselage.replaced(parasite_area=2.4)),
        "twist 10 deg": base.replaced(main_rotor=rotor.replaced(built_in_twist=-10.0)),
    }


def cross_check(mass: float, altitude: float) -> list[dict[str, float | str]]:
    """Optimum of the lifted problem, with all limits and twist fixed, beside that of the walks."""
    rotor = load_aircraft(AIRCRAFT).main_rotor
    bounds = (NARROW[0] * rotor.nominal_rotor_speed, NARROW[1] * rotor.nominal_rotor_speed)
    rows: list[dict[str, float | str]] = []
    for speed in (0.0, 40.0, 60.0):
        best = physics_optimum(
            mass,
            speed,
            altitude=altitude,
            aircraft=AIRCRAFT,
            variables="speed",
            rotor_speed_bounds=bounds,
        )
        saving = 100 * (1 - best.fuel_flow / best.nominal_fuel_flow)
        rows.append(
            {"speed": speed, "rotor_speed": 100 * best.rotor_speed / rotor.nominal_rotor_speed, "saving": saving}
        )
        rows[-1] |= {"active": ", ".join(best.multipliers) or "none", "status": str(best.status)}
    return rows


def rounded(value: Any) -> Any:
    """Numbers to six digits, as the results keep them."""
    if isinstance(value, Mapping):
        return {key: rounded(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(part) for part in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def solved(earlier: Mapping[str, Any]) -> dict[str, Any]:
    """Walks and checks: those of ``earlier`` results, and what they lack."""
    machine = helicopter(AIRCRAFT)

    def walks() -> list[dict[str, Any]]:
        return [asdict(walk(machine, *flight, speed)) for flight in FLIGHTS for speed in SPEEDS]

    def others() -> dict[str, list[dict[str, Any]]]:
        machines = {name: Helicopter(aircraft) for name, aircraft in variants(machine.aircraft).items()}
        return {name: [asdict(walk(m, *OPEN, speed)) for speed in OPEN_SPEEDS] for name, m in machines.items()}

    makers = {"checks": checks, "cross_check": lambda: cross_check(*OPEN), "walks": walks, "variant_walks": others}
    return {name: earlier[name] if name in earlier else rounded(make()) for name, make in makers.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description="A second helicopter from public data.")
    parser.add_argument("--reuse", action="store_true", help="take walks and checks of the last results")
    results = solved(json.loads(RESULTS.read_text(encoding="utf-8")) if parser.parse_args().reuse else {})
    margin = load_aircraft(AIRCRAFT).blade_loading_limit.manoeuvre_margin

    def best(found: Mapping[str, Any]) -> dict[str, Any]:
        place = {name: found[name] for name in ("mass", "altitude", "speed", "end")}
        return rounded(place | (optima(Walk(**found), margin) or {}))

    results["optima"] = [best(found) for found in results["walks"]]
    shipped = [o for o in results["optima"] if (o["mass"], o["altitude"]) == OPEN and o["speed"] in OPEN_SPEEDS]
    results["sensitivity"] = {"as shipped": shipped}
    results["sensitivity"] |= {name: list(map(best, found)) for name, found in results["variant_walks"].items()}
    RESULTS.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    write_page(Path(__file__).with_suffix(".md"), results)
    draw(Path(__file__).parent / "figures" / "second_helicopter.png", results)


if __name__ == "__main__":
    main()
