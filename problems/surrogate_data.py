"""Points of the designs of experiments as the studies of the surrogates use them: columns by name, one space or two."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import vrsopt
from vrsopt.surrogate.database import Database, DesignMeta
from vrsopt.surrogate.kriging import Kriging

Array = NDArray[np.float64]

DATA = Path(vrsopt.__file__).parent / "data"
DESIGNS: Mapping[str, Path] = {"level": DATA / "design.db", "flight": DATA / "flight_design.db"}
SURROGATES: Mapping[str, Path] = {"level": DATA / "surrogate.nc", "flight": DATA / "flight_surrogate.nc"}
WORDS = {"level": "five", "flight": "seven"}  # variables of a space
STUDY, OURS = "exponential", "squared_exponential"  # correlations


@dataclass(frozen=True, eq=False)
class Points:
    """Points of one design, SI units: ``inputs`` (n, d), ``outputs`` (n, m) and ``derivatives`` (n, m, d), NaN where a
    point has none; ``status`` of every point of the design, chosen or not."""

    meta: DesignMeta
    inputs: Array
    outputs: Array
    derivatives: Array
    status: Counter[str]

    def __len__(self) -> int:
        return len(self.inputs)

    def column(self, name: str) -> Array:
        """One input or output (n,)."""
        if name in self.meta.names:
            return self.inputs[:, self.meta.names.index(name)]
        return self.outputs[:, self.meta.outputs.index(name)]

    def known(self, name: str) -> tuple[Array, Array]:
        """Inputs and one output at the points that have it."""
        values = self.column(name)
        have = np.isfinite(values)
        return self.inputs[have], values[have]

    def gradients(self, name: str) -> Array:
        """Derivatives (k, d) of one output at the points of :meth:`known`."""
        return self.derivatives[np.isfinite(self.column(name)), self.meta.outputs.index(name)]

    def scaled(self) -> Array:
        """Inputs in the box scaled to [0, 1]."""
        lower, upper = np.array(self.meta.lower), np.array(self.meta.upper)
        return (self.inputs - lower) / (upper - lower)

    def kriging(self, correlation: str = OURS, trend: str = "quadratic") -> Kriging:
        """A Kriging in the box of the design, not yet fitted."""
        meta = self.meta
        return Kriging(correlation, trend=trend, names=meta.names, lower=meta.lower, upper=meta.upper)


def read(path: Path | str, *, flyable: bool = True) -> Points:
    """The flyable points of the design at ``path``, or all converged ones, in the order of the file."""
    with Database.open(path) as database:
        inputs, outputs = database.arrays(flyable=flyable)
        derivatives = database.derivatives(flyable=flyable)
        converged = np.isfinite(outputs[:, 0])
        status = Counter(database.dataset().status.values.tolist())
        return Points(database.meta, inputs[converged], outputs[converged], derivatives[converged], status)


def cpu(action: Callable[[], Any]) -> tuple[Any, float]:
    """Result and CPU time [s]."""
    begin = time.process_time()
    result = action()
    return result, time.process_time() - begin


@cache
def fitted(points: Points, name: str, correlation: str = OURS, trend: str = "quadratic") -> tuple[Kriging, float]:
    """Kriging of one output at ``points`` and the CPU time [s] of its fit, made once in a run."""
    model, seconds = cpu(lambda: points.kriging(correlation, trend).fit(*points.known(name)))
    return model, seconds
