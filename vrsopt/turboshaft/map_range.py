"""Whether the maps and the gas properties are used where they are meant to hold, in words."""

from __future__ import annotations

from collections.abc import Mapping

from vrsopt.turboshaft.data import EngineData
from vrsopt.turboshaft.gas import COLDEST, HOTTEST


def outside_map(engine: EngineData, outputs: Mapping[str, float]) -> str:
    """What leaves its range at a solution of the gas path (``outputs`` by name), in words; empty where nothing does.

    Ranges: speed lines and coordinate of the compressor map (data file), temperatures of the gas properties. The model
    goes on smoothly outside, but nothing says that an engine would.
    """
    data = engine.compressor
    ranges = (
        ("compressor_speed", "corrected speed", 100.0, "%", data.slowest_line, data.fastest_line),
        ("map_coordinate", "map coordinate", 1.0, "", data.surge_coordinate, data.choke_coordinate),
        ("inlet_temperature", "inlet temperature", 1.0, "K", COLDEST, HOTTEST),
        ("turbine_inlet_temperature", "turbine inlet temperature", 1.0, "K", COLDEST, HOTTEST),
    )
    words = []
    for name, label, per, unit, low, high in ranges:
        if not low <= outputs[name] <= high:
            value, lower, upper = (f"{per * number:.4g}" for number in (outputs[name], low, high))
            words.append(f"{label} {value} {unit}".rstrip() + f" outside {lower} to {upper}")
    return "; ".join(words)
