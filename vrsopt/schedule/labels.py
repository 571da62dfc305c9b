"""What the rows and columns of the whole-mission problem are, by name, place and unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vrsopt.schedule.layout import FUEL_SCALE, Layout
from vrsopt.schedule.mesh import Mesh


@dataclass(frozen=True)
class Kind:
    """One sort of rows or columns: its value in ``unit`` is ``offset`` + ``scale`` times what the NLP has."""

    family: str
    name: str
    unit: str
    scale: float
    offset: float = 0.0


@dataclass(frozen=True)
class Label:
    """One row or column. An integral over the mission has interval and segment -1 and no time."""

    kind: Kind
    interval: int
    segment: int
    time: float  # s


@dataclass(frozen=True)
class Labels:
    """Labels of R rows or columns."""

    kinds: tuple[Kind, ...]
    kind: np.ndarray  # (R,) index
    interval: np.ndarray  # (R,)
    segment: np.ndarray  # (R,)
    time: np.ndarray  # (R,) s

    def __len__(self) -> int:
        return len(self.kind)

    def __getitem__(self, index: int) -> Label:
        place = int(self.interval[index]), int(self.segment[index]), float(self.time[index])
        return Label(self.kinds[self.kind[index]], *place)

    def where(self, family: str | None = None, name: str | None = None) -> np.ndarray:
        """Indices of a family, or of all of a name, or both."""
        fits = [family in (None, kind.family) and name in (None, kind.name) for kind in self.kinds]
        return np.flatnonzero(np.array(fits, dtype=bool)[self.kind])

    @staticmethod
    def joined(parts: Sequence[Labels]) -> Labels:
        """Labels of ``parts`` one after the other."""
        first = np.cumsum([0, *(len(part.kinds) for part in parts)])
        return Labels(
            tuple(kind for part in parts for kind in part.kinds),
            np.concatenate([part.kind + begin for part, begin in zip(parts, first, strict=False)]),
            np.concatenate([part.interval for part in parts]),
            np.concatenate([part.segment for part in parts]),
            np.concatenate([part.time for part in parts]),
        )


def labels_at(mesh: Mesh, kinds: Sequence[Kind], kind: np.ndarray, interval: np.ndarray, share: np.ndarray) -> Labels:
    """Labels at ``share`` (R,) of the intervals ``interval`` (R,).

    ``kind`` (R,): index into ``kinds``.
    """
    time = mesh.start[interval] + share * mesh.step[interval]
    return Labels(tuple(kinds), kind, interval, mesh.segment[interval], time)


def column_labels(mesh: Mesh, layout: Layout) -> Labels:
    """Labels of the unknowns."""
    count, size = len(mesh), layout.size
    kinds: list[Kind] = []
    kind, interval, share = np.zeros(size, dtype=int), np.zeros(size, dtype=int), np.zeros(size)

    def put(new: Kind, *places: tuple[np.ndarray, float]) -> None:
        for place, at in places:
            kind[place], interval[place], share[place] = len(kinds), np.arange(count), at
        kinds.append(new)

    put(Kind("fuel", "fuel burned", "kg", FUEL_SCALE), *zip(layout.fuel.T[::-1], layout.shares[::-1], strict=True))
    for control in layout.controls:
        put(Kind(control.name, control.name, control.unit, control.scale), (control.end, 1.0), (control.start, 0.0))
        rate = f"{control.name} rate"
        put(Kind(rate, rate, per_second(control.unit), control.rate_scale), (control.rate, 0.5))
    if layout.charged is not None:
        scale = layout.controls[0].rate_scale
        put(Kind("charged rate", "charged rotor speed rate", "rad/s2", scale), (layout.charged, 0.5))
    return labels_at(mesh, kinds, kind, interval, share)


def per_second(unit: str) -> str:
    """Unit of the rate of what has ``unit``."""
    head, _, power = unit.partition("/s")
    return f"{head}/s{int(power or 1) + 1}" if "/s" in unit else f"{unit}/s"
