"""Why does the model take more fuel at 257 kW than the flight manual says, 106 kg/h instead of 102?

Two answers are computed. Every number of the engine file that has a range goes to both ends of it, the design point
kept, to see which of them could be to blame. And the consumption at 257 kW over that at 313 kW is split, exactly, into
what each step of the cycle contributes: the cycle is a closed formula of its pressure ratio, temperature, efficiencies
and losses, and the logarithm of the consumption is integrated along the straight line between the two states of the
engine (Aumann and Shapley's way to share a total: the parts add up whatever the order).

Run: python problems/engine_page.py (writes the page and its figures)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

from part_power_cycle import Steps, steps_of
from power_turbine import peaked
from sea_level import at_sea_level

from vrsopt.atmosphere import standard_air
from vrsopt.errors import InputError
from vrsopt.turboshaft.data import EngineData
from vrsopt.turboshaft.design_point import KILOWATT_HOUR
from vrsopt.turboshaft.maps import ANALYTIC, ComponentMaps

SISTER_POWER = 0.698  # of take-off power, where the 250-B17F's consumption is known
SOLVED = ("flight_manual_slope", "flight_manual_level")
SKIPPED = ("ratings", "calibration", "reactors")  # limits and targets: no part of the gas path


@dataclass(frozen=True)
class Point:
    """Specific consumption [kg/kWh] at the calibration point in flight and at rest, and at take-off power at rest."""

    flight: float
    rest: float
    take_off: float

    @property
    def ratio(self) -> float:
        """Consumption in flight at part power over that of the design point."""
        return self.flight / self.take_off


@dataclass(frozen=True)
class End:
    """One number of the engine file at one end of its range."""

    component: str
    parameter: str
    value: float
    point: Point

    @property
    def name(self) -> str:
        return f"{self.component}.{self.parameter}"


def target(engine: EngineData) -> float:
    """The flight manual's specific consumption at the calibration point [kg/kWh]."""
    assert engine.calibration is not None
    return engine.calibration.fuel_flow / (engine.calibration.power / 1e3)


def places(engine: EngineData) -> dict[str, dict[str, float]]:
    """The three operating points: take-off power at rest, the calibration point at rest and in flight."""
    assert engine.calibration is not None
    part = engine.calibration.power
    mach = engine.calibration.true_airspeed / standard_air(0.0).speed_of_sound
    return {
        "take_off": {"demand": engine.design_point.power, "mach": 0.0},
        "rest": {"demand": part, "mach": 0.0},
        "flight": {"demand": part, "mach": mach},
    }


def consumption(engine: EngineData, demand: float, mach: float, maps: ComponentMaps = ANALYTIC) -> float:
    """Specific consumption [kg/kWh] at shaft power [W]; nan where the gas path is not solved."""
    solution = at_sea_level(engine, demand, mach=mach, maps=maps)
    return solution.outputs["fuel_flow"] / demand * KILOWATT_HOUR if solution.success else math.nan


@lru_cache(maxsize=256)
def _point(text: str) -> Point:
    engine = EngineData.model_validate_json(text)
    take_off, rest, flight = (consumption(engine, **place) for place in places(engine).values())
    return Point(flight, rest, take_off)


def point(engine: EngineData) -> Point:
    """Consumption at the three points; nan where the gas path is not solved."""
    return _point(engine.model_dump_json())


def numbers(engine: EngineData) -> list[tuple[str, str, tuple[float, float]]]:
    """Every number of the gas path with a range: component, name, range."""
    found = []
    for component in type(engine).model_fields:
        if component in SKIPPED:
            continue
        for name, origin in getattr(getattr(engine, component), "provenance", {}).items():
            if origin.range is not None:
                found.append((component, name, origin.range))
    return found


def ends(engine: EngineData) -> list[tuple[End | None, End | None]]:
    """Both ends of every number, None where the design point can not be closed; widest effect on the ratio first."""
    found = [tuple(_end(engine, component, name, value) for value in span) for component, name, span in numbers(engine)]
    return sorted(found, key=lambda pair: -span(pair))  # type: ignore[arg-type, return-value]


def _end(engine: EngineData, component: str, name: str, value: float) -> End | None:
    try:
        return End(component, name, value, point(engine.changed(component, **{name: value})))
    except InputError:
        return None


def span(pair: tuple[End | None, End | None]) -> float:
    """How far the ratio moves over the range of a number."""
    known = [end.point.ratio for end in pair if end is not None]
    return max(known) - min(known) if len(known) == 2 else 0.0


def favourable(engine: EngineData, *, without: tuple[str, ...] = ()) -> tuple[EngineData, list[End]]:
    """The engine with every number, but those ``without`` (components), at its end of less fuel at part power.

    An end that the design point can not be closed with, once the others are there, is left out.
    """
    base, chosen = point(engine).flight, []
    changed = engine
    for pair in ends(engine):
        known = [end for end in pair if end is not None and end.component not in without]
        best = min(known, key=lambda end: end.point.flight, default=None)
        if best is None or best.point.flight > base - 1e-9:
            continue
        tried = changed.changed(best.component, **{best.parameter: best.value})
        try:
            reached = point(tried).flight
        except InputError:
            continue
        if math.isfinite(reached):
            changed = tried
            chosen.append(best)
    return changed, chosen


def steps(engine: EngineData) -> dict[str, Steps]:
    """The cycle at the three points."""
    found = {name: at_sea_level(engine, **place) for name, place in places(engine).items()}
    return {name: steps_of(engine, solution, found["take_off"]) for name, solution in found.items()}


def cases(engine: EngineData) -> dict[str, tuple[EngineData, ComponentMaps]]:
    """Engines that could explain the flight manual's consumption."""
    shape, _ = favourable(engine, without=("design_point",))
    every, _ = favourable(engine)
    found = {
        "shipped": (engine, ANALYTIC),
        "every favourable end, design point kept": (shape, ANALYTIC),
        "every favourable end, design point too": (every, ANALYTIC),
    }
    found |= {f"best U/C0 of the triangles, {name}": (engine, maps) for name, maps in peaked(engine).items()}
    return found | {name.replace("_", " "): (engine.variant(name), ANALYTIC) for name in SOLVED}


def judged(engine: EngineData) -> list[tuple[float, float]]:
    """Power [W] and Mach number: the three points, and the sister engine's part power."""
    known = [(place["demand"], place["mach"]) for place in places(engine).values()]
    return [known[2], known[1], known[0], (SISTER_POWER * engine.design_point.power, 0.0)]
