"""Free turbine: fuel per power over its speed at constant gas-generator speed."""

from __future__ import annotations

from collections.abc import Sequence

from free_turbine import GENERATOR_SPEEDS, draw_generator_speed, optimum

from vrsopt.helicopter import helicopter

from .finding import Finding, Table


def run(generators: Sequence[float] = GENERATOR_SPEEDS) -> Finding:
    """The figure of problems/engine.md and its optima."""
    engine = helicopter().engine
    bests = [optimum(engine, "gas_generator_speed", demand) for demand in generators]
    rows = [
        [100.0 * best.demand, round(1e-3 * best.power, 1), round(100 * best.speed, 1), round(100 * best.saving, 2)]
        for best in bests
    ]
    low, high = rows[0], rows[-1]
    sentences = [
        f"At {low[0]:.0f} % gas-generator speed the best free turbine turns at {low[2]:.0f} % and "
        f"saves {low[3]:.1f} %; "
        f"at {high[0]:.0f} % it turns at {high[2]:.0f} % and saves {high[3]:.1f} %.",
        "The study's curves were not at hand as numbers, so sizes are not compared; ours are proportional to the "
        "curvature of the turbine's efficiency (problems/engine.md).",
    ]
    head = ("gas generator %", "kW at 100 %", "best free-turbine speed %", "fuel per power saved %")
    return Finding("Free turbine", sentences, Table(head, rows), {"free_turbine": draw_generator_speed(engine)})
