"""IPOPT for OpenMDAO without pyOptSparse: CasADi's, given OpenMDAO's values and first derivatives."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import openmdao.api as om

ROUNDING = 1e-12  # of a derivative of order one


class IpoptDriver(om.ScipyOptimizeDriver):
    """The SciPy driver with another ``run``. There are no second derivatives: IPOPT builds its own approximation."""

    def run(self) -> bool:
        """Optimise; whether that failed."""
        self.result.reset()
        self.iter_count, self._total_jac, self._total_jac_linear = 0, None, None
        self._run_solve_nonlinear()
        self._dvlist = list(self._designvars)
        start = np.concatenate([np.ravel(value) for value in self.get_design_var_values().values()])
        sizes = [len(np.ravel(value)) for value in self.get_constraint_values().values()]
        lower, upper = self._sides("design_var", self._designvars, [meta["size"] for meta in self._designvars.values()])
        least, most = self._sides("constraint", self._cons, sizes)
        values = _Values(self, len(start), sum(sizes), self._pattern(start))
        x = ca.MX.sym("x", len(start))
        f, g = values(x)
        options = {"ipopt.hessian_approximation": "limited-memory", "ipopt.max_iter": self.options["maxiter"]}
        options |= {"ipopt.print_level": 0, "print_time": False, "ipopt.tol": self.options["tol"], "ipopt.sb": "yes"}
        solver = ca.nlpsol("solver", "ipopt", {"x": x, "f": f, "g": g}, options)
        found = solver(x0=start, lbx=lower, ubx=upper, lbg=least, ubg=most)
        self.place(np.array(found["x"]).ravel())
        self.iter_count = int(solver.stats()["iter_count"])
        self.result.success = bool(solver.stats()["success"])
        self.result.exit_status = solver.stats()["return_status"]
        self.fail = not self.result.success
        return self.fail

    def slopes(self) -> np.ndarray:
        """Derivatives (1 + constraints, variables) where the model is, as the optimiser sees them."""
        rows = [*self._objs, *self._cons]
        return np.asarray(self._compute_totals(of=rows, wrt=self._dvlist, return_format="array"))

    def _pattern(self, start: np.ndarray) -> np.ndarray:
        """Which derivatives are not zero near ``start``."""
        random, found = np.random.default_rng(1), np.zeros(0)
        for _ in range(3):
            self.place(start + 1e-3 * random.standard_normal(len(start)))
            slopes = np.abs(self.slopes()) > ROUNDING
            found = slopes if not found.size else found | slopes
        return found

    def _sides(self, kind: str, variables: Any, sizes: list[int]) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds of variables or constraints, as the optimiser sees them."""
        bounds, low, high = self._autoscaler.get_bounds_scaling(kind), [], []
        for name, size in zip(variables, sizes, strict=True):
            one = bounds[name]
            pair = (one.lower, one.upper) if one.equals is None else (one.equals, one.equals)
            for side, value, none in zip((low, high), pair, (-np.inf, np.inf), strict=True):
                side.append(np.full(size, none) if value is None else np.broadcast_to(np.ravel(value), size))
        return np.concatenate(low), np.concatenate(high)

    def place(self, x: np.ndarray) -> None:
        """Run the model at ``x``."""
        self._vectors["design_var"].set_data(x, driver_scaling=True)
        self._set_design_vars(driver_scaling=True)
        self._run_solve_nonlinear()


class _Values(ca.Callback):
    """Objective and constraints of the model of a driver, with their derivatives."""

    def __init__(self, driver: IpoptDriver, inputs: int, outputs: int, pattern: np.ndarray) -> None:
        super().__init__()
        self.driver, self.inputs, self.outputs, self.pattern = driver, inputs, outputs, pattern
        self.at: np.ndarray | None = None
        self.slopes: np.ndarray | None = None  # there, once they were asked for: CasADi asks several times
        self.kept: list[Any] = []
        self.construct("values", {})

    def get_n_in(self) -> int:
        return 1

    def get_n_out(self) -> int:
        return 2

    def get_sparsity_in(self, index: int) -> Any:
        return ca.Sparsity.dense(self.inputs, 1)

    def get_sparsity_out(self, index: int) -> Any:
        return ca.Sparsity.dense((1, self.outputs)[index], 1)

    def move(self, x: Any) -> None:
        """Run the model at ``x`` unless it is there."""
        x = np.array(x).ravel()
        if self.at is None or not np.array_equal(x, self.at):
            self.driver.place(x)
            self.at, self.slopes = x, None

    def eval(self, arguments: Any) -> list[Any]:
        self.move(arguments[0])
        objective = next(iter(self.driver.get_objective_values().values()))
        constraints = np.concatenate([np.ravel(value) for value in self.driver.get_constraint_values().values()])
        return [float(np.ravel(objective)[0]), constraints]

    def has_jac_sparsity(self, output: int, argument: int) -> bool:
        return True

    def get_jac_sparsity(self, output: int, argument: int, symmetric: bool) -> Any:
        return _sparsity((self.pattern[:1], self.pattern[1:])[output])

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(self, name: str, inames: Any, onames: Any, options: Any) -> Any:
        self.kept.append(_Slopes(self, name, options))
        return self.kept[-1]


class _Slopes(ca.Callback):
    """Jacobian of :class:`_Values`."""

    def __init__(self, values: _Values, name: str, options: Any) -> None:
        super().__init__()
        self.values = values
        self.parts = [_sparsity(values.pattern[:1]), _sparsity(values.pattern[1:])]
        self.construct(name, options)

    def get_n_in(self) -> int:
        return 3

    def get_n_out(self) -> int:
        return 2

    def get_sparsity_in(self, index: int) -> Any:
        return ca.Sparsity.dense((self.values.inputs, 1, self.values.outputs)[index], 1)

    def get_sparsity_out(self, index: int) -> Any:
        return self.parts[index]

    def eval(self, arguments: Any) -> list[Any]:
        self.values.move(arguments[0])
        if self.values.slopes is None:
            self.values.slopes = self.values.driver.slopes()
        slopes = self.values.slopes
        return [ca.project(ca.DM(rows), part) for rows, part in zip((slopes[:1], slopes[1:]), self.parts, strict=True)]


def _sparsity(pattern: np.ndarray) -> Any:
    """Where ``pattern`` is true."""
    rows, columns = np.nonzero(pattern)
    return ca.Sparsity.triplet(*pattern.shape, rows.tolist(), columns.tolist())
