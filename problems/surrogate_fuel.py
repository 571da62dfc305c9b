"""Two routes to the fuel flow: a Kriging of the fuel flow itself, or Krigings of power and then the engine's equations.

The first is the reference study's. The second needs the engine's table (:mod:`vrsopt.surrogate.engine_table`), exact to
5e-7, and lets hot days, engine settings and the power that speeds up the rotor enter exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from leave_one_out import FUEL
from page_table import table
from surrogate_data import Array, Points, cpu, fitted
from surrogate_errors import Space

from vrsopt.atmosphere import standard_air
from vrsopt.helicopter import Helicopter, helicopter
from vrsopt.surrogate.design import AIRCRAFT
from vrsopt.surrogate.engine_table import EngineTable, engine_table
from vrsopt.surrogate.validation import Accuracy, accuracy

ROTORS = ("main_rotor_power", "tail_rotor_power")
SHAFT = "shaft_power_per_engine"
TIMED = 4000  # points predicted for the cost


@dataclass(frozen=True)
class Route:
    """Errors at the fresh points, CPU time to build [s] and to predict one of many points [us]."""

    name: str
    figures: Accuracy
    build: float
    cost: float


def engine_fuel(points: Points, inputs: Array, power: Array, table: EngineTable, machine: Helicopter) -> Array:
    """Fuel flow [kg/s] of all engines at ``inputs`` (k, d) and the ``power`` (k,) [W] of one."""
    altitude, speed, rotor_speed = (
        inputs[:, points.meta.names.index(name)] for name in ("altitude", "speed", "rotor_speed")
    )
    nodes = table.contract(altitude, speed / standard_air(altitude, table.isa_offset).speed_of_sound)
    ratio = rotor_speed / machine.aircraft.main_rotor.nominal_rotor_speed
    fuel, _ = table.evaluate(nodes, power, ratio)
    return np.asarray(machine.aircraft.transmission.engines * fuel)


def routes(space: Space) -> list[Route]:
    """The routes of one space, the last with the computed power instead of a Kriging: what the table alone adds."""
    points, fresh, machine = space.flyable, space.fresh, helicopter(AIRCRAFT)
    built, building = cpu(lambda: engine_table(engine_data=machine.engine))
    fits = {name: fitted(points, name) for name in (FUEL, *ROTORS, SHAFT)}
    models, fitting = ({name: fit[k] for name, fit in fits.items()} for k in (0, 1))

    def through(inputs: Array, power: Array) -> Array:
        return engine_fuel(points, inputs, power, built, machine)

    def by_rotors(inputs: Array) -> Array:
        rotors = sum(models[name].predict(inputs) for name in ROTORS)
        return through(inputs, machine.aircraft.transmission.power_per_engine(rotors))

    inputs, computed = fresh.known(FUEL)
    many = inputs[np.arange(TIMED) % len(inputs)]
    exact = fresh.column(SHAFT)[np.isfinite(fresh.column(FUEL))]
    ways: list[tuple[str, Callable[[Array], Array], float]] = [
        ("Kriging of the fuel flow (the study's)", models[FUEL].predict, fitting[FUEL]),
        ("Krigings of both rotors' power, engine", by_rotors, sum(fitting[name] for name in ROTORS) + building),
        (
            "Kriging of the shaft power, engine",
            lambda x: through(x, models[SHAFT].predict(x)),
            fitting[SHAFT] + building,
        ),
    ]
    found = []
    for name, way, build in ways:
        _, seconds = cpu(lambda way=way: way(many))
        found.append(Route(name, accuracy(computed, way(inputs)), build, 1e6 * seconds / TIMED))
    _, seconds = cpu(lambda: through(many, exact[np.arange(TIMED) % len(inputs)]))
    found.append(
        Route(
            "computed shaft power, engine", accuracy(computed, through(inputs, exact)), building, 1e6 * seconds / TIMED
        )
    )
    return found


def routes_table(found: dict[str, list[Route]]) -> Iterator[str]:
    """Errors and costs."""
    header = ("variables", "route", "mean abs. error %", "RMS error %", "bias %", "build, CPU s", "CPU us per point")
    yield from table(
        header,
        (
            (
                words,
                route.name,
                f"{route.figures.mean_abs_error_percent:.5f}",
                f"{route.figures.rms_error_percent:.5f}",
                f"{route.figures.bias_percent:+.5f}",
                f"{route.build:.1f}",
                f"{route.cost:.1f}",
            )
            for words, own in found.items()
            for route in own
        ),
    )
