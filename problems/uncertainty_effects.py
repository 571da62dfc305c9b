"""What the ends of a range do to saving and rotor speed, and what follows from many of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

WORDS = {
    "blade_loading_limit.manoeuvre_margin": "manoeuvre margin",
    "blade_loading_limit.thrust_over_solidity": "level of the blade-loading limit",
    "section.drag_growth": "section: growth of drag with lift",
    "section.drag_rise_mach": "section: Mach number of the drag rise",
    "flight.gross_mass": "gross mass",
}


GROUPS = {  # by the start of the path, the first that fits
    "blade_loading_limit.manoeuvre_margin": "manoeuvre margin",
    "blade_loading_limit": "blade-loading limit",
    "engine.power_turbine": "power turbine",
    "engine": "other parts of the engine",
    "section": "section: lift and drag",
    "main_rotor.section_drag_level": "section: lift and drag",
    "flight": "gross mass",
    "": "other parts of rotors and airframe",
}


@dataclass(frozen=True)
class Effect:
    """Change of a quantity against the reference at both ends of one number's range, by mission; nan unsolved."""

    path: str
    low: Mapping[str, float]
    high: Mapping[str, float]

    @property
    def size(self) -> float:
        """Mean over the missions of the larger change."""
        pairs = np.array([[self.low[name], self.high[name]] for name in self.low])
        return float(np.mean(np.nanmax(np.abs(pairs), axis=1)))

    @property
    def largest(self) -> float:
        """Largest change in any mission."""
        return float(np.nanmax(np.abs([*self.low.values(), *self.high.values()])))

    def deviation(self, mission: str) -> float:
        """Standard deviation of the change over the range, were it a straight line from end to end."""
        return abs(self.high[mission] - self.low[mission]) / np.sqrt(12.0)


def effects(content: Mapping[str, Any], quantity: str) -> list[Effect]:
    """Effects of all numbers on ``quantity``, the largest first."""
    reference = {name: one[quantity] for name, one in content["reference"].items()}

    def change(end: Mapping[str, Any]) -> dict[str, float]:
        return {name: end[name][quantity] - value if name in end else np.nan for name, value in reference.items()}

    found = [Effect(one["path"], change(one["at"]["low"]), change(one["at"]["high"])) for one in content["numbers"]]
    return sorted(found, key=lambda effect: effect.size, reverse=True)


def added(found: Sequence[Effect], mission: str) -> float:
    """Standard deviation of the sum of independent effects."""
    return float(np.sqrt(np.nansum([effect.deviation(mission) ** 2 for effect in found])))


def shares(found: Sequence[Effect], mission: str) -> dict[str, float]:
    """Share of each group of numbers in the variance of the sum of independent effects."""
    parts = dict.fromkeys(GROUPS.values(), 0.0)
    for effect in found:
        group = next(group for start, group in GROUPS.items() if effect.path.startswith(start))
        parts[group] += float(np.nan_to_num(effect.deviation(mission))) ** 2
    return {group: part / sum(parts.values()) for group, part in parts.items()}


def label(path: str) -> str:
    """A path in words."""
    return WORDS.get(path) or path.removeprefix("engine.").removeprefix("main_rotor.").replace(".", ": ").replace(
        "_", " "
    )
