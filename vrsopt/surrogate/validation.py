"""Figures of a fitted Kriging, left out or held out: correlation, slope, mean and spread of the error, coverage."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import ArrayLike

from vrsopt.errors import InputError
from vrsopt.surrogate.kriging import Kriging


@dataclass(frozen=True)
class Accuracy:
    """Predicted against computed values. Errors are (predicted - computed) / |computed| in per cent.

    ``slope_deg``: angle of the regression line of predicted (ordinate) on computed (abscissa); 45 is ideal.
    rms^2 = bias^2 + std^2.
    """

    pearson_percent: float
    slope_deg: float
    bias_percent: float
    mean_abs_error_percent: float
    rms_error_percent: float
    std_error_percent: float

    def as_dict(self) -> dict[str, float]:
        """The figures by name."""
        return asdict(self)

    def __str__(self) -> str:
        return "\n".join(f"{name:<24} {value:10.4f}" for name, value in self.as_dict().items())


def accuracy(computed: ArrayLike, predicted: ArrayLike) -> Accuracy:
    """The figures for ``computed`` and ``predicted`` (n,), n >= 2.

    Raises :class:`InputError` for shapes that differ, for values that do not vary or are not finite, and for a computed
    value of zero, to which no error can be related.
    """
    truth, estimate = np.asarray(computed, dtype=float), np.asarray(predicted, dtype=float)
    if truth.ndim != 1 or truth.shape != estimate.shape or truth.size < 2:
        raise InputError(f"accuracy: shapes {truth.shape} and {estimate.shape}: one shape (n,) with n >= 2")
    if not (np.all(np.isfinite(truth)) and np.all(np.isfinite(estimate))):
        raise InputError("accuracy: computed, predicted: finite numbers only")
    if np.any(truth == 0.0):
        raise InputError(f"accuracy: computed[{int(np.argmin(np.abs(truth)))}] = 0: errors are relative to it")
    x, y = truth - truth.mean(), estimate - estimate.mean()
    if not (x @ x > 0.0 and y @ y > 0.0):
        raise InputError("accuracy: computed, predicted: values that vary")
    errors = 100.0 * (estimate - truth) / np.abs(truth)
    return Accuracy(
        pearson_percent=float(100.0 * (x @ y) / np.sqrt((x @ x) * (y @ y))),
        slope_deg=float(np.degrees(np.arctan((x @ y) / (x @ x)))),
        bias_percent=float(np.mean(errors)),
        mean_abs_error_percent=float(np.mean(np.abs(errors))),
        rms_error_percent=float(np.sqrt(np.mean(errors**2))),
        std_error_percent=float(np.std(errors)),
    )


def leave_one_out(kriging: Kriging) -> Accuracy:
    """Figures of the fitted ``kriging``, each point predicted by the model without it (trend re-estimated)."""
    computed, predicted = kriging.leave_one_out()
    return accuracy(computed, predicted)


def coverage(computed: ArrayLike, predicted: ArrayLike, deviation: ArrayLike, *, sigmas: float = 2.0) -> float:
    """Share [%] of ``computed`` values (n,) within ``sigmas`` predicted deviations of ``predicted``.

    95.45 % for two deviations if errors are normal and the deviations right.
    """
    error = np.abs(np.asarray(predicted, dtype=float) - np.asarray(computed, dtype=float))
    return float(100.0 * np.mean(error <= sigmas * np.asarray(deviation, dtype=float)))


def leave_one_out_coverage(kriging: Kriging, *, sigmas: float = 2.0) -> float:
    """:func:`coverage` [%] of the sampled outputs, each predicted without its point. They carry the nugget's error.

    ``sigmas``: half the width of the interval, in standard deviations.
    """
    computed, predicted, deviation = kriging.leave_one_out(return_std=True)
    return coverage(computed, predicted, np.hypot(deviation, kriging.state_.output_error), sigmas=sigmas)


def held_out_coverage(kriging: Kriging, X: ArrayLike, y: ArrayLike, *, sigmas: float = 2.0) -> float:
    """:func:`coverage` [%] of outputs ``y`` (k,) at ``X`` (k, d) not fitted. They carry the nugget's error.

    ``sigmas``: half the width of the interval, in standard deviations.
    """
    predicted, deviation = kriging.predict(X, return_std=True)
    return coverage(y, predicted, np.hypot(deviation, kriging.state_.output_error), sigmas=sigmas)
