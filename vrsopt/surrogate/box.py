"""Points inside the box of a model: the check that both kinds of surrogate make before they evaluate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vrsopt.errors import InputError

Array = NDArray[np.float64]


def check_inside(
    points: Array, lower: Array, upper: Array, *, tolerance: float, names: Sequence[str], model: str, box: str
) -> None:
    """Raise :class:`InputError` for the first of ``points`` (..., d) outside [lower, upper], or not a number.

    ``lower`` and ``upper`` (d,) may be overstepped by ``tolerance`` times their difference. The message names the
    ``model``, the input of ``names`` (d,) and what the ``box`` is, "sampled" for one.
    """
    margin = tolerance * (upper - lower)
    inside = (points >= lower - margin) & (points <= upper + margin)
    if not np.all(inside):
        position = np.unravel_index(int(np.argmin(inside)), inside.shape)
        k = int(position[-1])
        raise InputError(
            f"{model}: {names[k]} = {points[position]:g}: outside the {box} box {lower[k]:g} to {upper[k]:g}"
        )
