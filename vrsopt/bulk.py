"""A residual system solved at many points at once, in compiled CasADi calls."""

from __future__ import annotations

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


@dataclass(frozen=True, eq=False)
class BulkSolver:
    """A residual system compiled for many points: Newton from the system's one start, every point checked."""

    system: ResidualSystem

    @cached_property
    def _function(self) -> ca.Function:
        z, p, r, y = self.system.nlp_terms()
        residual = ca.Function("residual", [z, p], [r])
        options = {"abstol": TOLERANCE / 100, "max_iter": 60, "error_on_fail": False, "show_eval_warnings": False}
        root = ca.rootfinder("root", "fast_newton", residual, options)
        check = ca.Function("check", [z, p], [y, z, ca.mmax(ca.fabs(r))])
        point = ca.MX.sym("p", len(self.system.parameters))
        start = ca.DM([unknown.start / unknown.scale for unknown in self.system.unknowns])
        return ca.Function("point", [point], list(check(root(start, point), point))).map(CHUNK)

    def solve(self, parameters: np.ndarray) -> ManySolutions:
        """Solve at every row of ``parameters`` (N, n_p); a point that Newton misses is tried once more by IPOPT.

        Raises :class:`InputError` for a wrong shape or a value that is not finite.
        """
        system, count = self.system, len(self.system.parameters)
        points = np.asarray(parameters, dtype=float)
        if points.ndim != 2 or points.shape[1] != count:
            raise InputError(f"{system.name}: parameters: shape {points.shape}: expected (N, {count})")
        bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
        if bad.size:
            raise InputError(f"{system.name}: parameters: row {bad[0]}: not finite")
        outputs, scaled, norm = self._newton(points)
        lower, upper = system.bounds
        success = (norm < TOLERANCE) & np.all((scaled >= lower - 1e-6) & (scaled <= upper + 1e-6), axis=1)
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

    def _newton(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Outputs (N, n_y), scaled unknowns (N, n) and largest scaled residual (N,), chunk by chunk."""
        outputs = np.empty((len(points), len(self.system.outputs)))
        scaled = np.empty((len(points), len(self.system.unknowns)))
        norm = np.empty(len(points))
        for first in range(0, len(points), CHUNK):
            block = points[first : first + CHUNK]
            rows = slice(first, first + len(block))
            padded = np.vstack([block, np.repeat(block[-1:], CHUNK - len(block), axis=0)])
            y, z, r = (part.full()[:, : len(block)].T for part in self._function(padded.T))
            outputs[rows], scaled[rows], norm[rows] = y, z, np.where(np.isfinite(r[:, 0]), r[:, 0], np.inf)
        return outputs, scaled, norm
