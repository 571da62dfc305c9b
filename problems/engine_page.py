"""Write the tables and figures of the page on the engine away from its design point.

Run: python problems/engine_page.py
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import free_turbine
import part_power_page
import power_turbine
from page_table import write_below

from vrsopt.report.plots import png
from vrsopt.turboshaft.data import EngineData, load_engine

PAGE = Path(__file__).with_name("engine.md")
MARKER = "<!-- tables: everything below is written by problems/engine_page.py -->"
FIGURES = {
    "power_turbine.png": ("Efficiency and flow of the power turbine", power_turbine.draw),
    "free_turbine.png": ("Consumption at constant gas-generator speed", free_turbine.draw_generator_speed),
    "free_turbine_power.png": ("Optimum speed and fuel saved at constant power", free_turbine.draw_power),
    "part_power.png": ("Consumption at 257 kW over that at 313 kW", part_power_page.draw),
}


def lines(engine: EngineData) -> Iterator[str]:
    """Everything below the marker."""
    yield "\n## Power turbine\n"
    yield from _figures("power_turbine.png")
    yield from power_turbine.page(engine)
    yield "## Free-turbine speed\n"
    yield from _figures("free_turbine.png", "free_turbine_power.png")
    yield from free_turbine.page(engine)
    yield "## Part power\n"
    yield from _figures("part_power.png")
    yield from part_power_page.page(engine)


def _figures(*names: str) -> Iterator[str]:
    yield from (f"![{FIGURES[name][0]}](figures/{name})\n" for name in names)


def main() -> None:
    engine = load_engine()
    for name, (_, draw) in FIGURES.items():
        PAGE.with_name("figures").joinpath(name).write_bytes(png(draw(engine)))
    write_below(MARKER, PAGE, "\n".join(lines(engine)), title="The engine away from its design point")


if __name__ == "__main__":
    main()
