"""Design of experiments over the box of the study: Latin-hypercube blocks, in parallel, resumable."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import joblib
import numpy as np
from joblib.parallel import get_active_backend
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import Progress
from scipy.stats import qmc
from threadpoolctl import threadpool_limits

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.surrogate.database import FLYABLE, Database, DesignMeta, PointRecord, Row

NAMES = ("mass", "altitude", "speed", "rotor_speed", "twist")
NOMINAL_ROTOR_SPEED = 44.4  # rad/s
# The box of the study, its rotor speed from 70 instead of 75 %: a hot day is flown as the standard day of the same tip
# Mach number, on which 75 % are some 72 %.
BOUNDS = (
    np.array([1400.0, 0.0, 0.0, 0.70 * NOMINAL_ROTOR_SPEED, np.radians(6.0)]),
    np.array([2500.0, 2000.0, 70.0, 1.15 * NOMINAL_ROTOR_SPEED, np.radians(16.0)]),
)  # kg, m, m/s, rad/s, rad
BLOCKS = 20  # blocks after which a model is taken to have no flyable points to speak of

Evaluate = Callable[[dict[str, float]], PointRecord]

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Sampling:
    """What a design of experiments holds: points computed, how many are flyable, and points by status."""

    path: Path
    points: int
    flyable: int
    by_status: Mapping[str, int]

    def __str__(self) -> str:
        lines = [f"{self.path}: {self.points} points, {self.flyable} flyable"]
        return "\n".join(lines + [f"  {status:<24} {count:6d}" for status, count in sorted(self.by_status.items())])


def sample(
    path: Path | str,
    *,
    evaluate: Evaluate,
    outputs: tuple[str, ...],
    model_version: str,
    data_hash: str,
    samples: int = 1500,
    seed: int = 1,
    workers: int = 2,
    resume: bool = False,
    progress: bool = False,
) -> Sampling:
    """Sample ``evaluate`` until ``samples`` points are flyable, into the design of experiments at ``path``.

    ``evaluate`` is a function at the top level of a module: inputs by name (SI units) to :class:`PointRecord` with
    ``outputs``. Points come from Latin-hypercube blocks of ``samples`` points, seeded with ``seed`` + block number;
    the file holds the points in their order up to the one that completes the count, whatever the number of workers and
    however often the run was interrupted. Each result is committed as it arrives in order: a killed run loses the
    points in flight. With ``resume`` an existing file is continued, a missing one is begun.

    Points are computed in ``workers`` processes with one BLAS thread each, or on whatever backend the caller has set
    with ``joblib.parallel_config``.

    Raises :class:`InputError` for bad counts, a file that exists (without ``resume``), or one of another model, data,
    seed or design; :class:`NoSolutionError` if too few points are flyable after 20 blocks.
    """
    allowed = {"samples": (samples, 1, 10**6), "workers": (workers, 1, 1024), "seed": (seed, 0, 2**63)}
    for name, (count, least, most) in allowed.items():
        if not least <= count <= most:
            bound = f"at least {least}" if count < least else f"at most {most}"
            raise InputError(f"sample: {name} = {count}: {bound}")
    lower, upper = (tuple(bound.tolist()) for bound in BOUNDS)
    meta = DesignMeta(model_version, data_hash, seed, samples, NAMES, lower, upper, outputs)
    continued = resume and Path(path).exists()
    with Database.open(path, meta, write=True) if continued else Database.create(path, meta) as database:
        found = database.status()
        _check_inputs(database)
        counts = Counter(found)
        if counts[FLYABLE] < samples:
            logger.info("%s: %d points, %d of %d flyable", path, len(found), counts[FLYABLE], samples)
            _run(database, evaluate, counts, workers, progress)
    return Sampling(Path(path), sum(counts.values()), counts[FLYABLE], dict(counts))


@lru_cache(maxsize=2)
def block(seed: int, number: int, size: int) -> NDArray[np.float64]:
    """Latin-hypercube block ``number`` of a design: (size, 5) in the order of ``NAMES``, SI units."""
    sampler = qmc.LatinHypercube(len(NAMES), rng=np.random.default_rng(seed + number))
    return np.asarray(qmc.scale(sampler.random(size), *BOUNDS))


def _inputs(meta: DesignMeta, index: int) -> NDArray[np.float64]:
    number, row = divmod(index, meta.block_size)
    return block(meta.seed, number, meta.block_size)[row]


def _check_inputs(database: Database) -> None:
    """The stored points must be those of the design: another random generator would mix two designs."""
    inputs, _ = database.arrays(flyable=False)
    for index, stored in enumerate(inputs):
        if not np.array_equal(stored, _inputs(database.meta, index)):
            raise InputError(f"{database.path}: point {index}: not the point that seed {database.meta.seed} gives here")


def _run(database: Database, evaluate: Evaluate, counts: Counter[str], workers: int, progress: bool) -> None:
    """Compute and store points until the count is complete; ``counts`` is kept up to date."""
    meta = database.meta
    begin = sum(counts.values())
    finished = False

    def tasks() -> Iterator[Any]:
        for index in range(begin, BLOCKS * meta.block_size):
            if finished:
                return
            inputs = dict(zip(meta.names, _inputs(meta, index).tolist(), strict=True))
            yield joblib.delayed(_point)(evaluate, index, inputs)

    bar = Progress(console=Console(stderr=True)) if progress else None
    # One worker computes in this process: one BLAS thread there too, so that rounding is the same.
    with threadpool_limits(limits=1, user_api="blas"), _backend(workers), bar or nullcontext():
        task = bar.add_task("flyable points", total=meta.block_size, completed=counts[FLYABLE]) if bar else None
        parallel = joblib.Parallel(n_jobs=workers, return_as="generator", pre_dispatch="2*n_jobs", batch_size=1)
        # Closing the generator, on an interrupt too, stops the workers and leaves nothing behind.
        with closing(parallel(tasks())) as results:
            for row in results:
                if finished:
                    continue  # in flight when the count was completed
                database.append([row])
                counts[row.record.status] += 1
                finished = counts[FLYABLE] >= meta.block_size
                if bar is not None and task is not None:
                    bar.update(task, completed=counts[FLYABLE])
    if not finished:
        raise NoSolutionError(
            f"{database.path}: {counts[FLYABLE]} of {sum(counts.values())} points flyable: {meta.block_size} wanted"
        )


def _point(evaluate: Evaluate, index: int, inputs: dict[str, float]) -> Row:
    return Row(index, inputs, evaluate(inputs))


def _backend(workers: int) -> AbstractContextManager[Any]:
    """Processes with one BLAS thread each, unless the caller has chosen a backend himself."""
    active, _ = get_active_backend()
    if type(active).__name__ != "LokyBackend":
        return nullcontext()
    return joblib.parallel_config(backend="loky", inner_max_num_threads=1, n_jobs=workers)
