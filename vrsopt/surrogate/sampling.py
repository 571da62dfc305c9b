"""Sampling into a design of experiments: in parallel, resumable at any moment, the same rows in every case."""

from __future__ import annotations

import logging
import time
from bisect import insort
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import joblib
import numpy as np
from joblib.parallel import get_active_backend
from numpy.typing import ArrayLike, NDArray
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text
from threadpoolctl import threadpool_limits

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.surrogate import cluster
from vrsopt.surrogate.database import FLYABLE, Database, DesignMeta, PointRecord, Row, is_empty
from vrsopt.surrogate.sequence import Sequence
from vrsopt.surrogate.space import Space

WORKERS = (1, 1024)  # processes; more do not fit into one machine
MOST_POINTS = 20  # points per flyable one wanted, after which a model is taken to have no flyable ones to speak of

Evaluate = Callable[[dict[str, float]], PointRecord]
Tasks = Iterator[tuple[int, tuple[float, ...]]]  # point and inputs

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Sampling:
    """What a design of experiments holds: ``points`` computed, how many are ``flyable``, and ``by_status`` how many.

    ``path``: its file; ``added``: how many of the points were added by hand.
    """

    path: Path
    points: int
    flyable: int
    by_status: Mapping[str, int]
    added: int = 0

    def __str__(self) -> str:
        by_hand = f", {self.added} added by hand" if self.added else ""
        lines = [f"{self.path}: {self.points} points, {self.flyable} flyable{by_hand}"]
        return "\n".join(lines + [f"  {status:<24} {count:6d}" for status, count in sorted(self.by_status.items())])


def sample(
    path: Path | str,
    *,
    evaluate: Evaluate,
    space: Space,
    outputs: tuple[str, ...],
    model_version: str,
    data_hash: str,
    method: str = "latin_hypercube",
    derivatives: tuple[str, ...] = (),
    samples: int = 1500,
    seed: int = 1,
    workers: int = 2,
    resume: bool = False,
    dask: str | None = None,
    progress: bool = False,
) -> Sampling:
    """Sample ``evaluate`` over ``space`` until ``samples`` points are flyable, into the design of experiments ``path``.

    ``evaluate`` is a function at the top level of a module: inputs by name (SI units) to :class:`PointRecord` with
    ``outputs``, and derivatives of those in ``derivatives``. Points come from the sequence of ``method`` (see
    :class:`~vrsopt.surrogate.sequence.Sequence`), whose first block has ``samples`` points, seeded with ``seed``; the
    file ends at the point that completes the count, whatever the number of workers and however often the run was
    interrupted. Every result is committed as it arrives: a killed run loses the points in flight. With ``resume`` an
    existing file is continued, by more ``samples`` than before too, and a missing one is begun.

    Points are computed in ``workers`` processes, or on whatever backend the caller has set with
    ``joblib.parallel_config``; with ``dask`` by the workers of the Dask scheduler at that address, who need the same
    version of this package. One BLAS thread each.

    ``model_version`` and ``data_hash``: of the physics and its data, kept in the file. Raises :class:`InputError` for
    bad counts, an unknown method, a file that exists (without ``resume``), or one of another model, data, space,
    method, seed or of more samples, and a cluster that can not be used; :class:`NoSolutionError` if too few points are
    flyable after 20 times as many.
    """
    check_counts("sample", samples=(samples, 1, 10**6), workers=(workers, *WORKERS), seed=(seed, 0, 2**63 - 1))
    meta = DesignMeta(
        model_version,
        data_hash,
        space.name,
        method,
        seed,
        samples,
        space.names,
        tuple(map(float, space.lower)),
        tuple(map(float, space.upper)),
        outputs,
        derivatives,
    )
    _sequence(meta)
    continued = resume and Path(path).exists() and not is_empty(Path(path))
    with (
        cluster.connect(dask) if dask is not None else nullcontext() as client,  # first: it may fail
        Database.open(path, meta, write=True) if continued else Database.create(path, meta) as database,
    ):
        _check_points(database)
        database.extend(samples)
        _fill(database, evaluate, workers, client, progress)
        return _summary(database)


def add_points(
    path: Path | str,
    inputs: ArrayLike,
    *,
    evaluate: Evaluate,
    model_version: str,
    data_hash: str,
    workers: int = 2,
    dask: str | None = None,
    progress: bool = False,
) -> Sampling:
    """Compute hand-chosen points and add them to the design of experiments ``path``.

    ``inputs`` (k, d): in the order of the design's inputs, SI units. Points that the file has already are skipped, so a
    run that was killed is continued by the same call. They are rows like others, after those of the design's sequence.
    ``evaluate``, ``workers`` and ``dask`` as of :func:`sample`; ``model_version`` and ``data_hash`` must be those of
    the file. Raises :class:`InputError` for points outside the box, and a design of another model or data.
    """
    check_counts("add_points", workers=(workers, *WORKERS))
    expected = {"model_version": model_version, "data_hash": data_hash}
    with (
        cluster.connect(dask) if dask is not None else nullcontext() as client,
        Database.open(path, expected, write=True) as database,
    ):
        database.register(_checked(inputs, database.meta))
        pending = database.pending()
        with _bar(progress, "added points", len(pending), 0) as show:
            for rows in _computed(evaluate, database.meta.names, iter(pending.items()), workers, client):
                database.append(rows)
                show(len(rows), len(rows))
        return _summary(database)


def check_counts(verb: str, **counts: tuple[int, int, int]) -> None:
    """Raise :class:`InputError` for the first of ``counts``, (count, least, most), out of its range.

    ``verb``: how the message begins.
    """
    for name, (count, least, most) in counts.items():
        if not least <= count <= most:
            bound = f"at least {least}" if count < least else f"at most {most}"
            raise InputError(f"{verb}: {name} = {count}: {bound}")


def _checked(inputs: ArrayLike, meta: DesignMeta) -> NDArray[np.float64]:
    """``inputs`` as an array; raises :class:`InputError` for another shape and points outside the box."""
    points = np.asarray(inputs, dtype=float)
    if points.ndim != 2 or points.shape[1] != len(meta.names):
        raise InputError(f"add_points: inputs of shape {points.shape}: (points, {len(meta.names)})")
    bad = np.argwhere(~((points >= meta.lower) & (points <= meta.upper)))
    if len(bad):
        k, j = bad[0]
        box = f"from {meta.lower[j]:g} to {meta.upper[j]:g}"
        raise InputError(f"add_points: point {k + 1}: {meta.names[j]} = {points[k, j]:g}: {box} (SI units)")
    return points


def _sequence(meta: DesignMeta) -> Sequence:
    return Sequence(meta.method, meta.seed, meta.block_size, meta.lower, meta.upper)


def _check_points(database: Database) -> None:
    """The stored points must be those of the sequence: another random generator would mix two designs."""
    stored = {point: k for k, point in enumerate(database.found()) if point >= 0}
    if stored:
        inputs, _ = database.arrays(flyable=False)
        points = _sequence(database.meta).points(max(stored) + 1)
        for point, k in stored.items():
            if not np.array_equal(inputs[k], points[point]):
                raise InputError(
                    f"{database.path}: point {point}: not the point that seed {database.meta.seed} gives here"
                )


def _fill(database: Database, evaluate: Evaluate, workers: int, client: Any, progress: bool) -> None:
    """Compute and store what is missing of the sequence up to the point that completes the flyable count."""
    wanted, found = database.samples, {point: status for point, status in database.found().items() if point >= 0}
    flyable = sorted(point for point, status in found.items() if status == FLYABLE)
    limit = MOST_POINTS * wanted

    def end() -> int:
        """Index behind the last point wanted, as far as is known: points not computed yet can but bring it forward."""
        return flyable[wanted - 1] + 1 if len(flyable) >= wanted else limit

    def tasks() -> Tasks:
        sequence = _sequence(database.meta)
        points: list[tuple[float, ...]] = []
        for index in range(limit):
            if index >= end():
                return
            if index >= len(points):
                points = [tuple(point) for point in sequence.points(max(2 * index, wanted)).tolist()]
            if index not in found:
                yield index, points[index]

    if next(tasks(), None) is not None:
        logger.info("%s: %d points, %d of %d flyable", database.path, len(found), len(flyable), wanted)
        with _bar(progress, "flyable points", wanted, len(flyable)) as show:
            for rows in _computed(evaluate, database.meta.names, tasks(), workers, client):
                database.append(rows)
                new = [row.point for row in rows if row.record.status == FLYABLE]
                for point in new:
                    insort(flyable, point)
                show(len(rows), len(new))
    if len(flyable) < wanted:
        raise NoSolutionError(f"{database.path}: {len(flyable)} of {limit} points flyable: {wanted} wanted")
    database.cut(end())  # what was in flight when the count was completed


def _computed(
    evaluate: Evaluate, names: tuple[str, ...], tasks: Tasks, workers: int, client: Any
) -> Iterator[list[Row]]:
    """Rows of the tasks in the order of arrival, in lists of what comes at once; ``client``: of a Dask cluster."""
    calls = ((evaluate, names, *task) for task in tasks)
    # One worker computes in this process: one BLAS thread there too, so that rounding is the same.
    with threadpool_limits(limits=1, user_api="blas"), _backend(workers):
        if client is not None:
            yield from cluster.results(client, _point_alone, calls)
            return
        parallel = joblib.Parallel(
            n_jobs=workers, return_as="generator_unordered", pre_dispatch="2*n_jobs", batch_size=1
        )
        # Closing the generator, on an interrupt too, stops the workers and leaves nothing behind.
        with closing(parallel(joblib.delayed(_point)(*call) for call in calls)) as rows:
            yield from ([row] for row in rows)


def _point(evaluate: Evaluate, names: tuple[str, ...], point: int, inputs: tuple[float, ...]) -> Row:
    named = dict(zip(names, inputs, strict=True))
    begin = time.thread_time()
    record = evaluate(named)
    return Row(point, named, record, time.thread_time() - begin)


def _point_alone(*call: Any) -> Row:
    """As :func:`_point`, where nobody has limited the threads."""
    with threadpool_limits(limits=1, user_api="blas"):
        return _point(*call)


def _backend(workers: int) -> AbstractContextManager[Any]:
    """Processes with one BLAS thread each, unless the caller has chosen a backend himself."""
    active, _ = get_active_backend()
    if type(active).__name__ != "LokyBackend":
        return nullcontext()
    return joblib.parallel_config(backend="loky", inner_max_num_threads=1, n_jobs=workers)


class _Rate(ProgressColumn):
    """Points computed per second, flyable or not."""

    def render(self, task: Task) -> Text:
        rate = task.fields["computed"] / task.elapsed if task.elapsed else 0.0
        return Text(f"{rate:.2f} points/s" if rate < 100.0 else f"{rate:.0f} points/s")


@contextmanager
def _bar(wanted: bool, what: str, total: int, completed: int) -> Iterator[Callable[[int, int], None]]:
    """A bar on standard error, if ``wanted``: to be called with how many points came, and how many of them count."""
    if not wanted:
        yield lambda points, counting: None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), _Rate(), TimeRemainingColumn())
    with Progress(*columns, TextColumn("left"), console=Console(stderr=True)) as bar:
        task = bar.add_task(what, total=total, completed=completed, computed=0)

        def show(points: int, counting: int) -> None:
            done = bar.tasks[0]
            left = done.remaining or 0  # points in flight when the count is completed are no news
            bar.update(task, advance=min(counting, left), computed=done.fields["computed"] + points)

        yield show


def _summary(database: Database) -> Sampling:
    found = database.found()
    counts = Counter(found.values())
    return Sampling(database.path, len(found), counts[FLYABLE], dict(counts), sum(point < 0 for point in found))
