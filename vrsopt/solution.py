"""What goes into a residual system by name and what comes out of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from vrsopt.solvers.newton import Factorisation
from vrsopt.solvers.status import Status


@dataclass(frozen=True)
class Unknown:
    """An unknown of the system: unit, scale (its typical size), bounds and the start of a solve without a guess."""

    name: str
    unit: str
    scale: float = 1.0
    lower: float = -math.inf
    upper: float = math.inf
    start: float = 0.0


@dataclass(frozen=True)
class Named:
    """Name and unit of a parameter or an output; name and scale of a residual."""

    name: str
    unit: str = "-"
    scale: float = 1.0


@dataclass(frozen=True)
class Solution:
    """A solved (or failed) system: ``values`` of the unknowns, ``outputs`` and ``parameters`` by name, in SI units."""

    success: bool
    status: Status
    message: str
    values: dict[str, float]
    outputs: dict[str, float]
    parameters: dict[str, float]
    residual_norm: float
    iterations: int
    scaled: np.ndarray = field(repr=False)
    factorisation: Factorisation | None = field(repr=False, default=None)


@dataclass(frozen=True)
class Branch:
    """A solution reached by continuation, with what was met on the way.

    ``folds``: where on the way the curve of solutions turned back, as fractions of the way from the start (0) to the
    target (1), in their order. ``furthest``: the largest fraction that was reached. ``jacobians``: the effort.
    """

    solution: Solution
    folds: tuple[float, ...]
    furthest: float
    jacobians: int
