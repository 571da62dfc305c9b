"""From a design of experiments to a surrogate: one Kriging per output, with its leave-one-out figures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import joblib
import numpy as np
from rich.console import Console
from rich.progress import Progress

from vrsopt.errors import InputError
from vrsopt.surrogate.correlation import CORRELATIONS
from vrsopt.surrogate.database import FLYABLE, Database, DesignMeta
from vrsopt.surrogate.design_table import check_target
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.sampling import WORKERS, check_counts
from vrsopt.surrogate.selection import select
from vrsopt.surrogate.store import Surrogate, save
from vrsopt.surrogate.validation import Accuracy, leave_one_out, leave_one_out_coverage

BEST = "best"
LEAST_FLYABLE = 100
LARGEST_SYSTEM = 6000  # equations of a gradient-enhanced fit: its time grows with the cube
SETS = ("flyable", "converged")


@dataclass(frozen=True)
class OutputFit:
    """Leave-one-out figures of one fitted output.

    ``coverage_percent``: points within two predicted standard deviations; 95.4 with normal errors. ``condition_number``
    of the covariance of the data. ``points``: how many were fitted.
    """

    accuracy: Accuracy
    coverage_percent: float
    correlation: str
    nugget: float
    condition_number: float
    points: int

    def as_dict(self) -> dict[str, Any]:
        """The figures for one JSON object."""
        others = {item.name: getattr(self, item.name) for item in fields(self) if item.name != "accuracy"}
        return self.accuracy.as_dict() | others


@dataclass(frozen=True)
class Fit:
    """A surrogate fitted on the flyable points, and its figures beside those of fits on all converged points.

    ``correlation`` and ``gradient_enhanced`` as they were asked for; ``samples`` points in the design, ``flyable`` and
    ``converged`` of them; ``figures[set][output]`` for the sets "flyable" and "converged".
    """

    surrogate: Surrogate
    correlation: str
    gradient_enhanced: bool
    samples: int
    flyable: int
    converged: int
    figures: Mapping[str, Mapping[str, OutputFit]]

    def as_dict(self) -> dict[str, object]:
        """The figures for one JSON object: per output and set, and the counts."""
        outputs = {
            name: {label: self.figures[label][name].as_dict() for label in SETS} for name in self.surrogate.models
        }
        return {
            "correlation": self.correlation,
            "gradient_enhanced": self.gradient_enhanced,
            "samples": self.samples,
            "flyable": self.flyable,
            "converged": self.converged,
            "outputs": outputs,
        }

    def __str__(self) -> str:
        columns = ("Pearson %", "slope deg", "bias %", "mean |e| %", "rms %", "std %", "in 2 std %", "condition")
        head = f"{'leave-one-out':<32}{'points':<10}{'fitted':>7}" + "".join(f"{column:>12}" for column in columns)
        lines = [f"{self.samples} points, {self.flyable} flyable, {self.converged} converged", head]
        for name in self.surrogate.models:
            for label in SETS:
                fitted = self.figures[label][name]
                numbers = (*fitted.accuracy.as_dict().values(), fitted.coverage_percent)
                row = "".join(f"{number:12.4f}" for number in numbers) + f"{fitted.condition_number:12.1e}"
                chosen = f"  {fitted.correlation}" if self.correlation == BEST else ""
                lines.append(f"{name:<32}{label:<10}{fitted.points:7d}{row}{chosen}")
        return "\n".join(lines)


@dataclass(frozen=True)
class _Job:
    """One Kriging to fit: inputs (n, d), output (n,) and its gradients (n, d) or None."""

    inputs: np.ndarray
    output: np.ndarray
    gradients: np.ndarray | None


def fit(
    design: Path | str,
    out: Path | str | None = None,
    *,
    correlation: str = "squared_exponential",
    gradient_enhanced: bool = False,
    samples: int | None = None,
    workers: int = 2,
    progress: bool = False,
) -> Fit:
    """Fit a Kriging to every output of the design of experiments ``design`` and write them to ``out`` (NetCDF).

    The surrogate is fitted on the flyable points; every output is also fitted on all converged points, so that the two
    sets can be compared. ``correlation``: one of those of :class:`Kriging`, or "best" for the one with the least
    leave-one-out error, for each output apart. ``gradient_enhanced``: the stored derivatives are fitted too; outputs
    without derivatives are fitted without them. ``samples``: only the first rows are fitted, as far as that many
    flyable points; by default all. Fits run in ``workers`` processes; ``progress`` shows a bar.

    Raises :class:`InputError` for a file that is no design, an unknown correlation, fewer than 100 flyable points or
    than ``samples``, an output that can not be fitted, and a gradient-enhanced fit without stored derivatives or with
    more than 6000 equations, converged points times 1 + inputs.
    """
    if correlation not in (*CORRELATIONS, BEST):
        raise InputError(f"fit: correlation = {correlation!r}: one of {', '.join(CORRELATIONS)}, {BEST}")
    check_counts("fit", workers=(workers, *WORKERS))
    if out is not None:
        check_target(Path(design), Path(out))
    table = _Table.read(design, samples)
    if gradient_enhanced and not table.meta.derivatives:
        raise InputError(f"fit: {design}: no derivatives are stored in it: a fit without them")
    meta = table.meta
    jobs = {
        (label, name): table.job(name, label, gradient_enhanced and name in meta.derivatives)
        for label in SETS
        for name in meta.outputs
    }
    _check_size(jobs.values(), int(table.flyable.sum()))
    fitted = _fit_all(jobs, meta, correlation, workers, progress)
    figures = {label: {name: fitted[label, name][1] for name in meta.outputs} for label in SETS}
    surrogate = Surrogate(
        {name: fitted[SETS[0], name][0] for name in meta.outputs},
        {name: figures[SETS[0]][name].accuracy for name in meta.outputs},
        model_version=meta.model_version,
        data_hash=meta.data_hash,
        space=meta.space,
        method=meta.method,
        samples=int(table.flyable.sum()),
        seed=meta.seed,
    )
    if out is not None:
        save(out, surrogate)
    counts = (len(table.inputs), int(table.flyable.sum()), int(np.isfinite(table.outputs[:, 0]).sum()))
    return Fit(surrogate, correlation, gradient_enhanced, *counts, figures)


@dataclass(frozen=True)
class _Table:
    """The rows of a design that are fitted: inputs (n, d), outputs (n, m), derivatives (n, m, d), flyable (n,)."""

    meta: DesignMeta
    inputs: np.ndarray
    outputs: np.ndarray
    derivatives: np.ndarray
    flyable: np.ndarray

    @classmethod
    def read(cls, design: Path | str, samples: int | None) -> _Table:
        """All rows, or those up to the one that completes ``samples`` flyable ones."""
        with Database.open(design) as database:
            meta = database.meta
            inputs, outputs = database.arrays(flyable=False)
            derivatives = database.derivatives(flyable=False)
            flyable = np.array([status == FLYABLE for status in database.status()])
        found = int(flyable.sum())
        if found < LEAST_FLYABLE:
            raise InputError(f"{design}: {found} flyable points: at least {LEAST_FLYABLE}")
        if samples is not None and not LEAST_FLYABLE <= samples <= found:
            raise InputError(
                f"fit: samples = {samples}: from {LEAST_FLYABLE} to {found}, the flyable points of {design}"
            )
        end = len(flyable) if samples is None else int(np.flatnonzero(flyable)[samples - 1]) + 1
        return cls(meta, inputs[:end], outputs[:end], derivatives[:end], flyable[:end])

    def job(self, name: str, label: str, enhanced: bool) -> _Job:
        """The points of a set that have the output."""
        column = self.meta.outputs.index(name)
        values, gradients = self.outputs[:, column], self.derivatives[:, column]
        known = np.isfinite(values) & (self.flyable | (label == "converged"))
        if enhanced:
            known &= np.isfinite(gradients).all(axis=1)
        return _Job(self.inputs[known], values[known], gradients[known] if enhanced else None)


def _check_size(jobs: Iterable[_Job], flyable: int) -> None:
    """Raise :class:`InputError` where points and gradients are too many equations, in the larger of the two sets."""
    largest = max((job.gradients.size + job.output.size for job in jobs if job.gradients is not None), default=0)
    if largest > LARGEST_SYSTEM:
        allowed = f"at most {LARGEST_SYSTEM}, which is about {flyable * LARGEST_SYSTEM // largest} samples"
        raise InputError(f"fit: samples = {flyable}: {largest} equations with gradients: {allowed}")


def _fit_all(
    jobs: Mapping[tuple[str, str], _Job], meta: DesignMeta, correlation: str, workers: int, progress: bool
) -> dict[tuple[str, str], tuple[Kriging, OutputFit]]:
    """Fit every job; where both sets hold the same points of an output, once."""
    first, second = SETS
    same = {name for name in meta.outputs if len(jobs[first, name].output) == len(jobs[second, name].output)}
    keys = [key for key in jobs if key[0] == first or key[1] not in same]
    tasks = (joblib.delayed(_fit_one)(key[1], jobs[key], meta, correlation) for key in keys)
    bar = Progress(console=Console(stderr=True)) if progress else None
    with joblib.parallel_config(backend="loky", inner_max_num_threads=1), bar or nullcontext():
        results = joblib.Parallel(n_jobs=workers, return_as="generator")(tasks)
        fitted = list(results if bar is None else bar.track(results, total=len(keys), description="fits"))
    found = dict(zip(keys, fitted, strict=True))
    return found | {(second, name): found[first, name] for name in same}


def _fit_one(name: str, job: _Job, meta: DesignMeta, correlation: str) -> tuple[Kriging, OutputFit]:
    box: dict[str, Any] = {"names": meta.names, "lower": meta.lower, "upper": meta.upper}
    try:
        if correlation == BEST:
            model = select(job.inputs, job.output, job.gradients, **box).model
        else:
            model = Kriging(correlation, **box).fit(job.inputs, job.output, job.gradients)
        errors = leave_one_out(model)
    except InputError as error:
        raise InputError(f"fit: {name}: {error}") from None
    state = model.state_
    figures = OutputFit(
        errors,
        leave_one_out_coverage(model),
        state.correlation,
        state.nugget,
        state.condition_number,
        len(job.output),
    )
    return model, figures
