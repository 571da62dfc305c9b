"""The correlation that predicts best what it has not seen: candidates compared by their leave-one-out errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vrsopt.errors import InputError
from vrsopt.surrogate.correlation import CORRELATIONS, DIFFERENTIABLE
from vrsopt.surrogate.kriging import Kriging


@dataclass(frozen=True)
class Candidate:
    """A fitted Kriging and the RMS of its leave-one-out errors, in units of the output."""

    model: Kriging
    rms_error: float


@dataclass(frozen=True)
class Selection:
    """All candidates by correlation, in the order they were given."""

    candidates: dict[str, Candidate]

    @property
    def correlation(self) -> str:
        """The candidate of least leave-one-out RMS."""
        return min(self.candidates, key=lambda name: self.candidates[name].rms_error)

    @property
    def model(self) -> Kriging:
        """Its fitted Kriging."""
        return self.candidates[self.correlation].model

    def __str__(self) -> str:
        lines = (f"{name:<20} {found.rms_error:12.5g}" for name, found in self.candidates.items())
        return "\n".join([f"{'correlation':<20} {'RMS error':>12}", *lines])


def select(
    X: ArrayLike,
    y: ArrayLike,
    gradients: ArrayLike | None = None,
    candidates: Sequence[str] | None = None,
    **settings: Any,
) -> Selection:
    """Fit ``X`` (n, d), ``y`` (n,) and maybe ``gradients`` (n, d) with each correlation of ``candidates``.

    Default: all correlations, with gradients those that are differentiable. ``settings`` are those of
    :class:`Kriging`. Raises :class:`InputError` as :meth:`Kriging.fit` does, and without candidates.
    """
    names = (CORRELATIONS if gradients is None else DIFFERENTIABLE) if candidates is None else candidates
    if not names:
        raise InputError("select: candidates: one or more correlations")
    found = {}
    for name in names:
        model = Kriging(name, **settings).fit(X, y, gradients)
        computed, predicted = model.leave_one_out()
        found[name] = Candidate(model, float(np.sqrt(np.mean((predicted - computed) ** 2))))
    return Selection(found)
