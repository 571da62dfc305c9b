"""What a flown schedule emits: flows on both sides of every node, integrated as the fuel is.

Emissions go by name: "co2", "nox" (as NO2) and "co" with the shipped fit of the combustor, "nox_NAME" with every other
fit of it, and "foca_nox" and "foca_co" with the indices of :mod:`vrsopt.foca` on the same fuel. Ground idle counts.
NOx and CO at idle are indicative: there the model is fitted to nothing, and CO may be wrong by a factor of 2 to 3.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vrsopt.combustor.emissions import fit_range
from vrsopt.schedule.quadrature import mean_of_sides, per_segment, thinned

if TYPE_CHECKING:
    from vrsopt.mission.profile import Profile

PHASES = ("idle", "hover", "climb", "cruise", "loiter", "descent")
# kinds of task that are no phase of their own
COUNTED_AS = {"search": "loiter", "vertical_climb": "climb", "ground_idle": "idle"}
POLLUTANTS = ("co2", "nox", "co")
NOTE = (
    "NOx is a model fitted to a fleet average, given with its range over the fits of the combustor; NOx and CO at idle "
    "are indicative only; the air is dry; unburnt hydrocarbons are in FOCA's estimate only"
)


def nox_fits(names: Iterable[str]) -> list[str]:
    """Which of the names of emissions are NOx with some fit of the combustor; the shipped one's is "nox"."""
    return [name for name in names if name == "nox" or name.startswith("nox_")]


@dataclass(frozen=True)
class Emitted:
    """Emissions of all engines along a flight, by name.

    ``flow`` (N,) [kg/s], mean of the two sides of a node; ``per_segment`` (n_segments,) [kg]; ``quadrature_error``
    [kg], estimated from every second node.
    """

    flow: Mapping[str, np.ndarray]
    per_segment: Mapping[str, np.ndarray]
    quadrature_error: Mapping[str, float]

    def total(self, name: str) -> float:
        """Emitted over the mission [kg]."""
        return float(np.sum(self.per_segment[name]))

    @property
    def nox_of_fits(self) -> dict[str, float]:
        """NOx of the mission [kg] with each fit of the combustor, the shipped one first."""
        return {name: self.total(name) for name in nox_fits(self.per_segment)}

    @property
    def nox_range(self) -> tuple[float, float]:
        """Least and largest NOx of the mission [kg] over the fits of the combustor."""
        return fit_range(self.nox_of_fits.values())


def changes(own: Emitted | None, base: Emitted | None) -> dict[str, float]:
    """Change of every emission against ``base`` [per cent]; a fit of the combustor is compared with itself.

    Empty where one of the two is unknown.
    """
    if own is None or base is None:
        return {}
    return {name: 100 * (own.total(name) / base.total(name) - 1) for name in own.per_segment}


def emitted(segment: np.ndarray, time: np.ndarray, sides: Mapping[str, np.ndarray], count: int) -> Emitted:
    """Emissions from the flows before and after each node, by name (N, 2) [kg/s], over ``count`` segments.

    ``segment`` and ``time`` [s] (N,) of the nodes, both ends of every segment among them.
    """
    every, coarse = np.arange(len(time)), thinned(segment, 2)
    exact = {name: per_segment(segment, time, flow, every, count) for name, flow in sides.items()}
    rough = {name: per_segment(segment, time, flow, coarse, count) for name, flow in sides.items()}
    return Emitted(
        flow={name: mean_of_sides(flow, segment) for name, flow in sides.items()},
        per_segment=exact,
        quadrature_error={name: abs(float(np.sum(rough[name] - exact[name]))) / 3.0 for name in sides},
    )


@dataclass(frozen=True)
class Phase:
    """One phase of a mission: time in it [s], fuel and emissions [kg], NOx with its range over the combustor's fits."""

    duration: float
    fuel: float
    co2: float
    nox: float
    nox_range: tuple[float, float]
    co: float


def phases(profile: Profile, fuel_per_segment: np.ndarray, emissions: Emitted) -> dict[str, Phase]:
    """The phases of a mission by name, in the order of PHASES; kinds of task that are none count as COUNTED_AS says.

    The sums over the phases are the totals, but for the range of NOx where the fits cross between phases.
    ``fuel_per_segment`` (segments,) [kg].
    """
    kinds = np.array([COUNTED_AS.get(segment.kind, segment.kind) for segment in profile.segments])
    durations = np.array([segment.duration for segment in profile.segments])
    result = {}
    for name in PHASES:
        here = kinds == name
        mass = {key: float(np.sum(values[here])) for key, values in emissions.per_segment.items()}
        result[name] = Phase(
            duration=float(np.sum(durations[here])),
            fuel=float(np.sum(fuel_per_segment[here])),
            nox_range=fit_range(mass[key] for key in nox_fits(mass)),
            **{key: mass[key] for key in POLLUTANTS},
        )
    return result
