"""The endless sequence of points of a design of experiments: any number of points, a longer design keeps the shorter.

Nested Latin hypercubes (P. Z. G. Qian, Nested Latin hypercube designs, Biometrika 96, 2009, in its simplest form): the
first n points are a Latin hypercube; each later block doubles the design, and every doubled design is one again. Or
scrambled Sobol points (A. B. Owen, 1998) as SciPy makes them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from vrsopt.errors import InputError

METHODS = ("latin_hypercube", "sobol")
SOBOL_BITS = 30  # 2**30 points


@dataclass(frozen=True)
class Sequence:
    """Points of a box, each given by its index alone.

    ``block_size`` [points] is the size of the first Latin hypercube; Sobol points do not depend on it. Raises
    :class:`InputError` for an unknown method.
    """

    method: str
    seed: int
    block_size: int
    lower: tuple[float, ...]
    upper: tuple[float, ...]

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise InputError(f"sample: method = {self.method!r}: one of {', '.join(METHODS)}")

    def points(self, count: int) -> NDArray[np.float64]:
        """The first ``count`` points, (count, d), in the units of the box."""
        dimension = len(self.lower)
        if self.method == "sobol":
            unit = _sobol(dimension, self.seed, max(count - 1, 0).bit_length())
        else:
            blocks = (max(count - 1, 0) // self.block_size).bit_length()
            unit = nested_latin_hypercubes(dimension, self.seed, self.block_size, blocks)
        lower, upper = np.array(self.lower), np.array(self.upper)
        return lower + (upper - lower) * unit[:count]


@lru_cache(maxsize=2)
def nested_latin_hypercubes(dimension: int, seed: int, size: int, doublings: int) -> NDArray[np.float64]:
    """(size 2**doublings, dimension) points of the unit box; the first size 2**k of them are a Latin hypercube each.

    To double n points, each axis is cut into 2 n cells: the points fill one half of each of the n former cells, n new
    points fill the other halves, in random order.
    """
    points = np.empty((0, dimension))
    cells = np.empty((0, dimension), dtype=np.int64)  # of the points there are, on the current axis
    within = np.empty((0, dimension))  # place in the cell, 0 to 1: exact when halved, unlike the point itself
    for number in range(doublings + 1):
        count = size << number
        random = np.random.default_rng([seed, number])
        cells, within = 2 * cells + (within >= 0.5), 2 * within % 1.0
        free = np.ones((count, dimension), dtype=bool)
        np.put_along_axis(free, cells, False, axis=0)
        new = np.stack([random.permutation(np.flatnonzero(column)) for column in free.T], axis=1)
        place = random.random(new.shape)
        points = np.concatenate([points, (new + place) / count])
        cells, within = np.concatenate([cells, new]), np.concatenate([within, place])
    points.flags.writeable = False
    return points


@lru_cache(maxsize=2)
def _sobol(dimension: int, seed: int, exponent: int) -> NDArray[np.float64]:
    """The first 2**exponent points: always a power of two, so that any number of them can be taken without a word."""
    if exponent > SOBOL_BITS:
        raise InputError(f"sample: method = 'sobol': at most {2**SOBOL_BITS} points")
    points = qmc.Sobol(dimension, bits=SOBOL_BITS, rng=np.random.default_rng(seed)).random_base2(exponent)
    points.flags.writeable = False
    return np.asarray(points)
