"""Free turbine: fuel per power over its speed at constant gas-generator speed."""

from __future__ import annotations

from collections.abc import Sequence

from free_turbine import GENERATOR_SPEEDS, draw_generator_speed, optimum, with_curvature

from vrsopt.helicopter import helicopter

from .finding import Finding, Picture, Table


def run(generators: Sequence[float] = GENERATOR_SPEEDS) -> Finding:
    """The figure of problems/engine.md and its optima."""
    engine = helicopter().engine
    bests = [optimum(engine, "gas_generator_speed", demand) for demand in generators]
    rows = [
        [100.0 * best.demand, round(1e-3 * best.power, 1), round(100 * best.speed, 1), round(100 * best.saving, 2)]
        for best in bests
    ]
    low, high = rows[0], rows[-1]
    ends = with_curvature(engine)
    first, last = (100.0 * optimum(end, "gas_generator_speed", generators[0]).saving for end in ends)
    curvatures = [end.power_turbine.speed_curvature for end in ends]
    sentences = [
        f"At {low[0]:.0f} % gas-generator speed the best free turbine turns at {low[2]:.0f} % and "
        f"saves {low[3]:.1f} %; "
        f"at {high[0]:.0f} % it turns at {high[2]:.0f} % and saves {high[3]:.1f} %.",
        f"How much depends on how peaked the turbine's efficiency is: over the range of that number, {curvatures[0]:g} "
        f"to {curvatures[1]:g} (shipped {engine.power_turbine.speed_curvature:g}), the saving at {low[0]:.0f} % goes "
        f"from {first:.1f} to {last:.1f} % (problems/engine.md).",
    ]
    said = "The same curves, which are not published as numbers; their sizes are not compared."
    caption = (
        "Fuel per power over that at 100 % free-turbine speed, sea level, at rest. Each curve is one speed of the gas "
        "generator, named at its left end with its power at 100 %; dots are the best speeds. In the grey band the "
        "engine's maker allows no steady speed."
    )
    head = ("gas generator %", "kW at 100 %", "best free-turbine speed %", "fuel per power saved %")
    figures = {"free_turbine": Picture(draw_generator_speed(engine), caption)}
    return Finding("Free turbine", said, sentences, Table(head, rows), figures)
