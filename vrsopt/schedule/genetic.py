"""NSGA-II (Deb, Pratap, Agarwal, Meyarivan 2002; pymoo) on rotor speed and twist, node by node."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.core.termination import Termination
from pymoo.optimize import minimize
from rich.console import Console
from rich.progress import track

from vrsopt.errors import InputError
from vrsopt.schedule.bands import ForbiddenBand
from vrsopt.schedule.batched import PointOptima, point_optima
from vrsopt.schedule.path_model import PathModel

POPULATION_PER_VARIABLE = 25  # as in the reference study


@dataclass(frozen=True)
class GeneticOptions:
    """A node's search stops when the average change of its variables, each over its range, is at most ``tolerance``,
    at the latest after ``most_generations``.

    The reference study states the tolerance and not of what: here it is the best point's, on average over the variables
    and the last ``period`` generations, once the population has drawn together to ``spread`` of the ranges around it.
    At 1e-15 that is a best point which does not move any more.
    """

    seed: int = 1
    tolerance: float = 1e-15
    period: int = 15
    spread: float = 1e-4
    most_generations: int = 400


class _NodeProblem(Problem):
    """Least fuel flow at one node, of the variables that are free; inside a forbidden band is outside a limit."""

    def __init__(self, model: PathModel, mass: float, box: np.ndarray, bands: Sequence[ForbiddenBand]) -> None:
        self.model, self.mass, self.box, self.bands = model, mass, box, bands
        self.free = box[1] > box[0]
        super().__init__(
            n_var=int(self.free.sum()),
            n_obj=1,
            n_ieq_constr=len(model.limit_names) + len(bands),
            xl=box[0, self.free],
            xu=box[1, self.free],
        )

    def point(self, x: np.ndarray) -> np.ndarray:
        """Rotor speed and twist (k, 2) of candidates (k, n_var)."""
        both = np.broadcast_to(self.box[0], (len(x), 2)).copy()
        both[:, self.free] = x
        return both

    def _evaluate(self, x: np.ndarray, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        both = self.point(x)
        values = self.model.evaluate(np.array([[self.mass]]), both[None, :, 0], both[None, :, 1])
        out["F"] = values.fuel_flow[0][:, None]
        inside = [np.minimum(both[:, 0] - band.lower, band.upper - both[:, 0]) / band.upper for band in self.bands]
        out["G"] = np.stack([*values.limits[:, 0, :], *inside], axis=1)


class _Settled(Termination):
    """The criterion of :class:`GeneticOptions`."""

    def __init__(self, options: GeneticOptions) -> None:
        super().__init__()
        self.options = options
        self.best = (np.inf, np.inf)  # breach of the limits and fuel flow
        self.history: list[np.ndarray] = []  # best points so far, each variable over its range

    def _update(self, algorithm: Any) -> float:
        problem, width = algorithm.problem, algorithm.problem.xu - algorithm.problem.xl
        now = algorithm.opt[0]
        reached = (float(now.CV[0]), float(now.F[0]))
        better = reached < self.best  # one that is as good is no change: optima are flat
        self.history.append((now.X - problem.xl) / width if better else self.history[-1])
        self.best = min(reached, self.best)
        if len(self.history) >= self.options.most_generations:
            return 1.0
        if len(self.history) <= self.options.period:
            return 0.0
        change = np.mean(np.abs(np.diff(self.history[-1 - self.options.period :], axis=0)))
        apart = np.mean(np.abs((algorithm.pop.get("X") - problem.xl) / width - self.history[-1]))
        return 1.0 if change <= self.options.tolerance and apart <= self.options.spread else 0.0


def genetic_minimum(
    model: PathModel,
    mass: np.ndarray,
    *,
    box: np.ndarray,
    bands: Sequence[ForbiddenBand] = (),
    options: GeneticOptions | None = None,
    workers: int = 1,
    progress: bool = False,
) -> tuple[PointOptima, np.ndarray]:
    """NSGA-II at each node of ``model``: optima (N,) and the generations (N,) they took.

    ``mass`` (N,) [kg]; ``box`` (2, 2) lower and upper rotor speed [rad/s] and twist [rad], a variable with equal ends
    is held; ``bands`` of rotor speed are left out. Each node has its own seed, so the result does not depend on
    ``workers``, the number of processes.
    """
    options = options or GeneticOptions()
    if not np.any(box[1] > box[0]):
        raise InputError("pointwise schedule: variables: at least one of rotor speed and twist must be free")
    chunks = np.array_split(np.arange(len(mass)), max(1, min(8 * workers, len(mass))))
    jobs = (delayed(_search)(model.nodes(chunk), mass[chunk], box, bands, options, chunk) for chunk in chunks)
    parts: Iterable[np.ndarray] = Parallel(n_jobs=workers, return_as="generator")(jobs)
    if progress:
        parts = track(parts, total=len(chunks), description="pointwise", console=Console(stderr=True))
    found = np.concatenate(list(parts))
    return point_optima(model, mass, found[:, :2]), found[:, 2].astype(int)


def _search(
    model: PathModel,
    mass: np.ndarray,
    box: np.ndarray,
    bands: Sequence[ForbiddenBand],
    options: GeneticOptions,
    names: np.ndarray,
) -> np.ndarray:
    """Rotor speed, twist and generations (n, 3) at the nodes of a chunk; ``names`` (n,) are their seeds."""
    found = np.empty((len(mass), 3))
    for k, name in enumerate(names):
        problem = _NodeProblem(model.nodes(np.array([k])), float(mass[k]), box, bands)
        settled = _Settled(options)
        algorithm = NSGA2(pop_size=POPULATION_PER_VARIABLE * problem.n_var)
        minimize(
            problem, algorithm, settled, seed=options.seed + int(name), copy_algorithm=False, copy_termination=False
        )
        best = algorithm.opt[0]  # of least breach where nothing keeps the limits
        found[k, :2] = problem.point(np.atleast_2d(best.X))[0]
        found[k, 2] = len(settled.history)
    return found
