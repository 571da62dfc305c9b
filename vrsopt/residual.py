"""One abstraction under rotor trim, engine and combustor: a named system of equations r(x, p) = 0 with outputs y(x, p).

The system is symbolic (CasADi), scaled and named, so that every solver sees the same scaled residual, every failure can
say which equation and which bound it is about, and every output has exact derivatives by the implicit-function theorem.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import casadi as ca
import numpy as np
from scipy.linalg import lu_factor, lu_solve, svdvals

from vrsopt.errors import InputError
from vrsopt.solution import Branch, Named, Solution, Unknown
from vrsopt.solvers.arclength import follow_curve
from vrsopt.solvers.ipopt import ipopt_options, ipopt_status
from vrsopt.solvers.newton import Factorisation, newton
from vrsopt.solvers.status import Status

TOLERANCE = 1e-8  # largest scaled residual of an accepted solution


@dataclass(frozen=True, eq=False)
class ResidualSystem:
    """A square system r(x, p) = 0 with outputs y(x, p).

    ``x``, ``p``, ``r``, ``y`` are CasADi column vectors in the order of ``unknowns``, ``parameters``, ``residuals`` and
    ``outputs``, in physical units; r is divided by the residuals' scales, x by the unknowns' scales before any solver
    sees them. ``guess(parameters)`` gives a start for a solve that has no neighbour.
    """

    name: str
    unknowns: tuple[Unknown, ...]
    parameters: tuple[Named, ...]
    residuals: tuple[Named, ...]
    outputs: tuple[Named, ...]
    x: Any
    p: Any
    r: Any
    y: Any
    guess: Callable[[Mapping[str, float]], Mapping[str, float]] | None = None

    def __post_init__(self) -> None:
        sizes = {
            "unknowns": (len(self.unknowns), self.x),
            "parameters": (len(self.parameters), self.p),
            "residuals": (len(self.residuals), self.r),
            "outputs": (len(self.outputs), self.y),
        }
        for kind, (names, vector) in sizes.items():
            if names != vector.numel():
                raise InputError(f"{self.name}: {kind}: {names} names for {vector.numel()} expressions")
        if len(self.unknowns) != len(self.residuals):
            raise InputError(
                f"{self.name}: {len(self.unknowns)} unknowns and {len(self.residuals)} residuals: not square"
            )

    # -- symbolic functions of the scaled unknowns ---------------------------------------------------------------

    @cached_property
    def _scale(self) -> np.ndarray:
        return np.array([unknown.scale for unknown in self.unknowns])

    @cached_property
    def _graph(self) -> tuple[Any, Any, Any, Any]:
        """Scaled unknowns z, parameters p, scaled residual and outputs as expressions of z and p."""
        z = type(self.x).sym("z", len(self.unknowns))
        weights = ca.DM([1.0 / residual.scale for residual in self.residuals])
        r, y = ca.substitute([weights * self.r, self.y], [self.x], [ca.DM(self._scale) * z])
        return z, self.p, r, y

    @cached_property
    def _residual(self) -> ca.Function:
        z, p, r, _ = self._graph
        return ca.Function("residual", [z, p], [r])

    @cached_property
    def _jacobian(self) -> ca.Function:
        z, p, r, _ = self._graph
        return ca.Function("jacobian", [z, p], [ca.densify(ca.jacobian(r, z))])

    @cached_property
    def _values(self) -> ca.Function:
        """Residual and outputs together: they share nearly all of their expressions."""
        z, p, r, y = self._graph
        return ca.Function("values", [z, p], [r, y])

    @cached_property
    def _slopes(self) -> dict[tuple[tuple[int, ...], tuple[int, ...]], ca.Function]:
        return {}

    def _derivatives(self, outputs: tuple[int, ...], parameters: tuple[int, ...]) -> ca.Function:
        """Jacobian of residual and ``outputs`` with respect to unknowns and ``parameters``, in one sweep."""
        if (outputs, parameters) not in self._slopes:
            z, p, r, y = self._graph
            inputs = type(p).sym("inputs", z.numel() + len(parameters))
            free = dict(zip(parameters, ca.vertsplit(inputs)[z.numel() :], strict=True))
            mixed = ca.vertcat(*(free.get(i, old) for i, old in enumerate(ca.vertsplit(p))))
            values = ca.substitute([ca.vertcat(r, y[list(outputs)])], [z, p], [inputs[: z.numel()], mixed])[0]
            slopes = ca.densify(ca.jacobian(values, inputs))
            self._slopes[outputs, parameters] = ca.Function("derivatives", [inputs, p], [slopes])
        return self._slopes[outputs, parameters]

    @cached_property
    def _widened(self) -> ca.Function:
        """Jacobian and, in one more column, the derivative in a direction of the parameters."""
        z, p, r, _ = self._graph
        way = type(p).sym("way", len(self.parameters))
        return ca.Function("widened", [z, p, way], [ca.horzcat(self._jacobian(z, p), ca.jtimes(r, p, way))])

    @cached_property
    def _ipopt(self) -> ca.Function:
        z, p, r, _ = self._graph
        # A square system leaves the Hessian nothing to do: the quasi-Newton one costs no second derivatives.
        options = ipopt_options(
            hessian_approximation="limited-memory",
            tol=TOLERANCE / 10,
            constr_viol_tol=TOLERANCE / 10,
            acceptable_iter=0,
            max_iter=200,
            nlp_scaling_method="none",
        )
        return ca.nlpsol(
            "ipopt", "ipopt", {"x": z, "p": p, "f": ca.MX(0) if isinstance(z, ca.MX) else 0, "g": r}, options
        )

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds (n,) of the scaled unknowns."""
        lower = np.array([unknown.lower for unknown in self.unknowns]) / self._scale
        upper = np.array([unknown.upper for unknown in self.unknowns]) / self._scale
        return lower, upper

    # -- solving ---------------------------------------------------------------------------------------------------

    def solve(
        self,
        parameters: Mapping[str, float],
        guess: Solution | Mapping[str, float] | None = None,
        *,
        method: Literal["ipopt", "newton"] = "ipopt",
        max_iterations: int = 60,
    ) -> Solution:
        """Solve the system at ``parameters`` (by name, SI units).

        ``guess`` is a neighbouring :class:`Solution` (Newton then re-uses its factorisation), or unknowns by name.
        The result is never raised away: test ``success``. Raises :class:`InputError` for a parameter that is missing,
        unknown or not finite.
        """
        p = self.vector(parameters)
        start = self._start(parameters, guess)
        if method == "newton":
            known = guess.factorisation if isinstance(guess, Solution) else None
            result = newton(
                lambda z: self._residual(z, p).full().ravel(),
                lambda z: self._jacobian(z, p).full(),
                start=start,
                tolerance=TOLERANCE,
                max_iterations=max_iterations,
                factorisation=known,
            )
            return self._solution(p, result.root, result.status, result.iterations, result.factorisation)
        if method == "ipopt":
            lower, upper = self.bounds
            answer = self._ipopt(x0=np.clip(start, lower, upper), p=p, lbx=lower, ubx=upper, lbg=0, ubg=0)
            stats = self._ipopt.stats()
            return self._solution(p, answer["x"].full().ravel(), ipopt_status(stats), stats["iter_count"], None)
        raise InputError(f"{self.name}: method = {method!r}: 'ipopt' or 'newton'")

    def follow(self, start: Solution, parameters: Mapping[str, float], *, max_jacobians: int = 150) -> Branch:
        """Follow the solution ``start`` on the straight way from its parameters to ``parameters``, through folds.

        Pseudo-arclength continuation (:mod:`vrsopt.solvers.arclength`): the first solution at ``parameters`` that the
        curve meets. It ends without success where the curve leaves the bounds of an unknown or returns to its start.
        """
        first, (lower, upper) = self.vector(start.parameters), self.bounds
        way = self.vector(parameters) - first
        curve = follow_curve(
            lambda z, s: self._residual(z, first + s * way).full().ravel(),
            lambda z, s: self._widened(z, first + s * way, way).full(),
            start=start.scaled,
            first=0.0,
            target=1.0,
            tolerance=TOLERANCE,
            max_jacobians=max_jacobians,
            admissible=lambda z: bool(np.all(z >= lower) and np.all(z <= upper)),
        )
        p, status, effort = first + curve.parameter * way, curve.status, curve.jacobians
        solution = self._solution(p, curve.root, status, effort, curve.factorisation)
        if status is not Status.CONVERGED:
            place = f"{status} at {100 * curve.parameter:.1f} % of the way{self._at_bounds(curve.root)}"
            solution = replace(solution, success=False, status=status, message=f"{self.name}: {place}")
        return Branch(solution, curve.folds, float(np.max(curve.parameters)), effort)

    def values(self, scaled: np.ndarray, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Scaled residual (n,) and outputs (n_y,) at scaled unknowns (n,) and parameters (n_p,), see :meth:`vector`."""
        r, y = self._values(scaled, parameters)
        return r.full().ravel(), y.full().ravel()

    def accepted(
        self, parameters: np.ndarray, scaled: np.ndarray, *, values: tuple[np.ndarray, np.ndarray], iterations: int
    ) -> Solution:
        """Scaled unknowns (n,) that another solver found at ``parameters`` (n_p,), with the ``values`` there, checked
        as those of :meth:`solve`: residual and bounds."""
        return self._checked(parameters, scaled, values, Status.CONVERGED, iterations, None)

    def smallest_singular_value(self, solution: Solution, *, exact: bool = True) -> float:
        """Smallest singular value of the scaled Jacobian: zero at a fold, where derivatives end.

        With ``exact=False`` that of the last Jacobian which Newton factorised on its way to the solution: free.
        """
        if exact or solution.factorisation is None:
            return float(svdvals(self._jacobian(solution.scaled, self.vector(solution.parameters)).full())[-1])
        lu = solution.factorisation[0]
        return float(svdvals((np.tril(lu, -1) + np.eye(len(lu))) @ np.triu(lu))[-1])

    def vector(self, parameters: Mapping[str, float]) -> np.ndarray:
        """Parameters by name as a vector (n_p,), each present and finite."""
        names = [parameter.name for parameter in self.parameters]
        for name in parameters:
            if name not in names:
                raise InputError(f"{self.name}: unknown parameter {name!r}: expected {', '.join(names)}")
        for name in names:
            if name not in parameters:
                raise InputError(f"{self.name}: {name}: missing")
            if not math.isfinite(parameters[name]):
                raise InputError(f"{self.name}: {name} = {parameters[name]}: a finite number")
        return np.array([float(parameters[name]) for name in names])

    def _start(self, parameters: Mapping[str, float], guess: Solution | Mapping[str, float] | None) -> np.ndarray:
        if isinstance(guess, Solution):
            return guess.scaled.copy()
        known = guess if guess is not None else self.guess(parameters) if self.guess else {}
        start = np.array([known.get(unknown.name, unknown.start) for unknown in self.unknowns])
        return start / self._scale

    def _solution(
        self, p: np.ndarray, z: np.ndarray, status: Status, iterations: int, factorisation: Factorisation | None
    ) -> Solution:
        return self._checked(p, z, self.values(z, p), status, iterations, factorisation)

    def _checked(
        self,
        p: np.ndarray,
        z: np.ndarray,
        values: tuple[np.ndarray, np.ndarray],
        status: Status,
        iterations: int,
        factorisation: Factorisation | None,
    ) -> Solution:
        r, y = values
        norm = float(np.max(np.abs(r))) if np.all(np.isfinite(r)) else math.inf
        if status is Status.CONVERGED and norm >= TOLERANCE:
            status = Status.NO_PROGRESS
        if status is not Status.CONVERGED and norm < TOLERANCE:
            status = Status.CONVERGED
        lower, upper = self.bounds
        if status is Status.CONVERGED and (np.any(z < lower - 1e-6) or np.any(z > upper + 1e-6)):
            status = Status.OUT_OF_BOUNDS
        return Solution(
            success=status is Status.CONVERGED,
            status=status,
            message=self._message(status, z, r, iterations),
            values={unknown.name: float(value) for unknown, value in zip(self.unknowns, z * self._scale, strict=True)},
            outputs=dict(zip((out.name for out in self.outputs), y.tolist(), strict=True)),
            parameters=dict(zip((par.name for par in self.parameters), p.tolist(), strict=True)),
            residual_norm=norm,
            iterations=int(iterations),
            scaled=z,
            factorisation=factorisation,
        )

    def _message(self, status: Status, z: np.ndarray, r: np.ndarray, iterations: int) -> str:
        if status is Status.CONVERGED:
            return f"{self.name}: converged in {iterations} iterations"
        worst = int(np.argmax(np.where(np.isfinite(r), np.abs(r), np.inf)))
        where = f"largest scaled residual {r[worst]:.2e} in {self.residuals[worst].name!r}{self._at_bounds(z)}"
        return f"{self.name}: {status} after {iterations} iterations; {where}"

    def _at_bounds(self, z: np.ndarray) -> str:
        lower, upper = self.bounds
        outside = (z <= lower + 1e-6) | (z >= upper - 1e-6)
        active = [unknown.name for unknown, out in zip(self.unknowns, outside, strict=True) if out]
        return f"; at or beyond its bound: {', '.join(active[:3])}" if active else ""

    # -- derivatives and embedding ---------------------------------------------------------------------------------

    def sensitivities(
        self, solution: Solution, *, outputs: Sequence[str] | None = None, parameters: Sequence[str] | None = None
    ) -> dict[str, dict[str, float]]:
        """Exact d(output)/d(parameter) at a converged solution: ``result[output][parameter]``.

        Of all outputs and parameters, or of those named, which takes less. Implicit-function theorem:
        dy/dp = y_p - y_x r_x^-1 r_p. Raises :class:`InputError` for a failed solution.
        """
        if not solution.success:
            raise InputError(f"{self.name}: no derivatives at a failed solution: {solution.message}")
        rows, columns = _places(self.outputs, outputs), _places(self.parameters, parameters)
        p, n = self.vector(solution.parameters), len(self.unknowns)
        inputs = np.concatenate([solution.scaled, p[list(columns)]])
        slopes = self._derivatives(rows, columns)(inputs, p).full()
        total = slopes[n:, n:] - slopes[n:, :n] @ lu_solve(lu_factor(slopes[:n, :n]), slopes[:n, n:])
        return {
            self.outputs[row].name: {
                self.parameters[column].name: float(total[i, j]) for j, column in enumerate(columns)
            }
            for i, row in enumerate(rows)
        }

    def function(self) -> ca.Function:
        """CasADi Function (p, z0) -> (y, z, largest scaled residual) with a Newton root finder inside.

        For embedding in other graphs; derivatives follow from the implicit-function theorem. The root finder does not
        raise: the caller tests the third output.
        """
        options = {"abstol": TOLERANCE / 100, "max_iter": 60, "error_on_fail": False, "show_eval_warnings": False}
        root = ca.rootfinder("root", "newton", self._residual, options)
        p, z0 = ca.MX.sym("p", len(self.parameters)), ca.MX.sym("z0", len(self.unknowns))
        z = root(z0, p)
        r, y = self._values(z, p)
        return ca.Function(
            self.name.replace(" ", "_"),
            [p, z0],
            [y, z, ca.mmax(ca.fabs(r))],
            ["p", "z0"],
            ["y", "z", "residual"],
        )

    def nlp_terms(self) -> tuple[Any, Any, Any, Any]:
        """Scaled unknowns z, parameters p, scaled residual and outputs as expressions, to lift into a larger NLP.

        The bounds of z are in ``bounds``.
        """
        return self._graph


def _places(known: tuple[Named, ...], wanted: Sequence[str] | None) -> tuple[int, ...]:
    """Places of the names ``wanted`` among the ``known``, of all without any."""
    names = [one.name for one in known]
    return tuple(range(len(names))) if wanted is None else tuple(names.index(name) for name in wanted)
