"""A residual system solved at many points at once, in compiled CasADi calls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from vrsopt.errors import InputError
from vrsopt.residual import TOLERANCE, ResidualSystem

CHUNK = 500  # points per compiled call: large enough to hide the call, small enough to stay in the cache


@dataclass(frozen=True)
class ManySolutions:
    """Solutions at N points: ``outputs`` by name (N,), scaled unknowns (N, n), largest scaled residual (N,).

    Outputs of a point that failed are nan; ``failures`` says by index why.
    """

    success: np.ndarray
    outputs: dict[str, np.ndarray] = field(repr=False)
    scaled: np.ndarray = field(repr=False)
    residual_norm: np.ndarray = field(repr=False)
    failures: dict[int, str]


Start = Callable[[np.ndarray], np.ndarray]  # parameters (N, n_p) -> scaled unknowns (N, n) to begin with


@dataclass(frozen=True, eq=False)
class BulkSolver:
    """A residual system compiled for many points, every point checked: Newton, then IPOPT for what is left.

    ``chunk``: points per compiled call.
    """

    system: ResidualSystem
    chunk: int = CHUNK

    @cached_property
    def _function(self) -> ca.Function:
        z, p, r, y = self.system.nlp_terms()
        residual = ca.Function("residual", [z, p], [r])
        options = {"abstol": TOLERANCE / 100, "max_iter": 60, "error_on_fail": False, "show_eval_warnings": False}
        root = ca.rootfinder("root", "fast_newton", residual, options)
        check = ca.Function("check", [z, p], [y, z, ca.mmax(ca.fabs(r))])
        start, point = ca.MX.sym("z0", z.numel()), ca.MX.sym("p", p.numel())
        solved = check(root(start, point), point)
        return ca.Function("point", [start, point], list(solved)).map(self.chunk)

    def solve(self, parameters: np.ndarray, starts: tuple[Start, ...] = ()) -> ManySolutions:
        """Solve at every row of ``parameters`` (N, n_p).

        Newton begins at each of ``starts`` in turn, for the points that are not solved yet; by default once, at the
        system's one start. A point that it misses is tried once more by IPOPT, from the system's guess. Raises
        :class:`InputError` for a wrong shape or a value that is not finite.
        """
        system, points = self.system, self.checked(parameters)
        outputs = np.full((len(points), len(system.outputs)), np.nan)
        scaled = np.full((len(points), len(system.unknowns)), np.nan)
        norm, success = np.full(len(points), np.inf), np.zeros(len(points), dtype=bool)
        for start in starts or (self._one_start,):
            left = np.flatnonzero(~success)
            if left.size:
                outputs[left], scaled[left], norm[left] = self._newton(points[left], start(points[left]))
                success[left] = self._accepted(scaled[left], norm[left])
        failures = {}
        for row in np.flatnonzero(~success):
            names = (parameter.name for parameter in system.parameters)
            solution = system.solve(dict(zip(names, points[row].tolist(), strict=True)))
            success[row], norm[row], scaled[row] = solution.success, solution.residual_norm, solution.scaled
            outputs[row] = list(solution.outputs.values()) if solution.success else np.nan
            if not solution.success:
                failures[int(row)] = solution.message
        named = {output.name: outputs[:, i] for i, output in enumerate(system.outputs)}
        return ManySolutions(success, named, scaled, norm, failures)

    def checked(self, parameters: np.ndarray) -> np.ndarray:
        """``parameters`` as an array; raises :class:`InputError` for a wrong shape or a value that is not finite."""
        system, count = self.system, len(self.system.parameters)
        points = np.asarray(parameters, dtype=float)
        if points.ndim != 2 or points.shape[1] != count:
            raise InputError(f"{system.name}: parameters: shape {points.shape}: expected (N, {count})")
        bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
        if bad.size:
            raise InputError(f"{system.name}: parameters: row {bad[0]}: not finite")
        return points

    def _one_start(self, points: np.ndarray) -> np.ndarray:
        start = [unknown.start / unknown.scale for unknown in self.system.unknowns]
        return np.broadcast_to(start, (len(points), len(start)))

    def _accepted(self, scaled: np.ndarray, norm: np.ndarray) -> np.ndarray:
        lower, upper = self.system.bounds
        return (norm < TOLERANCE) & np.all((scaled >= lower - 1e-6) & (scaled <= upper + 1e-6), axis=1)

    def _newton(self, points: np.ndarray, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Outputs (N, n_y), scaled unknowns (N, n) and largest scaled residual (N,), chunk by chunk."""
        outputs = np.empty((len(points), len(self.system.outputs)))
        scaled = np.empty((len(points), len(self.system.unknowns)))
        norm = np.empty(len(points))
        for first in range(0, len(points), self.chunk):
            rows = slice(first, min(first + self.chunk, len(points)))
            count = rows.stop - first
            padded = [
                np.vstack([block[rows], np.repeat(block[rows][-1:], self.chunk - count, axis=0)]).T
                for block in (starts, points)
            ]
            y, z, r = (part.full()[:, :count].T for part in self._function(*padded))
            outputs[rows], scaled[rows], norm[rows] = y, z, np.where(np.isfinite(r[:, 0]), r[:, 0], np.inf)
        return outputs, scaled, norm
