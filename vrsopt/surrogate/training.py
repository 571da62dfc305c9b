"""From a design of experiments to a surrogate: one Kriging per output, with its leave-one-out figures."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

import joblib
import numpy as np
from rich.console import Console
from rich.progress import Progress

from vrsopt.errors import InputError
from vrsopt.surrogate.database import Database, DesignMeta
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.likelihood import CORRELATIONS
from vrsopt.surrogate.store import Surrogate, save
from vrsopt.surrogate.validation import Accuracy, leave_one_out

COMPARED = ("main_rotor_power", "tail_rotor_power", "fuel_flow")  # also fitted on all converged points, for comparison
LEAST_FLYABLE = 100


@dataclass(frozen=True)
class Fit:
    """A surrogate fitted on the flyable points, and its accuracy beside that of fits on all converged points."""

    surrogate: Surrogate
    samples: int
    flyable: int
    converged: int
    flyable_accuracy: Mapping[str, Accuracy]
    converged_accuracy: Mapping[str, Accuracy]

    def as_dict(self) -> dict[str, object]:
        """The figures for one JSON object: per output and set, and the counts."""
        outputs: dict[str, dict[str, dict[str, float]]] = {}
        for label, figures in (("flyable", self.flyable_accuracy), ("converged", self.converged_accuracy)):
            for name, accuracy in figures.items():
                outputs.setdefault(name, {})[label] = accuracy.as_dict()
        counts = {"samples": self.samples, "flyable": self.flyable, "converged": self.converged}
        correlation = next(iter(self.surrogate.models.values())).state_.correlation
        return {"correlation": correlation, **counts, "outputs": outputs}

    def __str__(self) -> str:
        head = f"{'leave-one-out':<22}{'points':<11}{'Pearson %':>10}{'slope deg':>11}{'bias %':>9}{'mean |e| %':>12}"
        lines = [f"{self.samples} points, {self.flyable} flyable, {self.converged} converged", head + f"{'rms %':>8}"]
        for label, figures in (("flyable", self.flyable_accuracy), ("converged", self.converged_accuracy)):
            lines += [
                f"{name:<22}{label:<11}{a.pearson_percent:10.3f}{a.slope_deg:11.3f}{a.bias_percent:9.3f}"
                f"{a.mean_abs_error_percent:12.3f}{a.rms_error_percent:8.3f}"
                for name, a in figures.items()
            ]
        return "\n".join(lines)


def fit(
    design: Path | str,
    out: Path | str | None = None,
    *,
    correlation: str = "squared_exponential",
    workers: int = 2,
    progress: bool = False,
) -> Fit:
    """Fit a Kriging to every output of the design of experiments ``design`` and write them to ``out`` (NetCDF).

    The surrogate is fitted on the flyable points; the powers and the fuel flow are also fitted on all converged points,
    so that the two sets can be compared. Fits run in ``workers`` processes; ``progress`` shows a bar. Raises
    :class:`InputError` for a file that is no design, an unknown correlation, or fewer than 100 flyable points.
    """
    if correlation not in CORRELATIONS:
        raise InputError(f"fit: correlation = {correlation!r}: one of {', '.join(CORRELATIONS)}")
    if workers < 1:
        raise InputError(f"fit: workers = {workers}: at least 1")
    if out is not None and Path(out).resolve() == Path(design).resolve():
        raise InputError(f"{out}: can not be written: it is the design of experiments itself")
    with Database.open(design) as database:
        meta = database.meta
        flyable, everything = database.arrays(), database.arrays(flyable=False)
    if len(flyable[0]) < LEAST_FLYABLE:
        raise InputError(f"{design}: {len(flyable[0])} flyable points: at least {LEAST_FLYABLE}")
    jobs = [(name, *_column(meta, flyable, name)) for name in meta.outputs]
    jobs += [(name, *_column(meta, everything, name)) for name in COMPARED if name in meta.outputs]
    fitted = _fit_all(jobs, meta, correlation, workers, progress)
    count = len(meta.outputs)
    accuracy = dict(zip(meta.outputs, (figures for _, figures in fitted[:count]), strict=True))
    models = dict(zip(meta.outputs, (model for model, _ in fitted[:count]), strict=True))
    surrogate = Surrogate(models, meta.model_version, meta.data_hash, meta.seed, accuracy)
    if out is not None:
        save(out, surrogate)
    converged = int(np.sum(np.isfinite(everything[1][:, 0])))
    compared = {job[0]: figures for job, (_, figures) in zip(jobs[count:], fitted[count:], strict=True)}
    return Fit(surrogate, len(everything[0]), len(flyable[0]), converged, accuracy, compared)


def _column(meta: DesignMeta, table: tuple[np.ndarray, np.ndarray], name: str) -> tuple[np.ndarray, np.ndarray]:
    """Inputs and one output at the points that have it."""
    values = table[1][:, meta.outputs.index(name)]
    known = np.isfinite(values)
    return table[0][known], values[known]


def _fit_all(
    jobs: list[tuple[str, np.ndarray, np.ndarray]], meta: DesignMeta, correlation: str, workers: int, progress: bool
) -> list[tuple[Kriging, Accuracy]]:
    tasks = (joblib.delayed(_fit_one)(X, y, meta, correlation) for _, X, y in jobs)
    bar = Progress(console=Console(stderr=True)) if progress else None
    with joblib.parallel_config(backend="loky", inner_max_num_threads=1), bar or nullcontext():
        results = joblib.Parallel(n_jobs=workers, return_as="generator")(tasks)
        if bar is None:
            return list(results)
        return list(bar.track(results, total=len(jobs), description="fits"))


def _fit_one(X: np.ndarray, y: np.ndarray, meta: DesignMeta, correlation: str) -> tuple[Kriging, Accuracy]:
    model = Kriging(correlation, names=meta.names, lower=meta.lower, upper=meta.upper).fit(X, y)
    return model, leave_one_out(model)
