"""A numpy function of many points, with its gradients and Hessians, as a CasADi function.

Value, gradient and Hessian of column k depend on column k alone. They are computed together, once for each x, and the
three callbacks (one for each order) share them. Their outputs are dense and hold only what is not zero: block-diagonal
Jacobians are put together around them from explicit sparsity patterns.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Evaluate = Callable[[Array], tuple[Array, Array, Array]]

KEPT = 8  # results: a graph may call one function with several x, and ask for each order after all of them
VALUE, GRADIENT, HESSIAN = range(3)

# CasADi knows no Python references: a callback must outlive every graph, and every derivative of one, that calls it,
# and nothing tells when the last is gone. So it lives as long as the process.
_alive: list[ca.Callback] = []


def pointwise(name: str, evaluate: Evaluate, dimensions: int, size: int) -> ca.Function:
    """CasADi Function ``name(x) -> y``, x (dimensions, size) and y (1, size), twice differentiable.

    ``evaluate``: of points (size, dimensions), the columns of x, to value (size,), gradient (size, dimensions) and
    Hessian (size, dimensions, dimensions). It is kept until the process ends, with all it refers to.
    """
    return _Order(name, VALUE, _Results(evaluate, dimensions, size))


class _Results:
    """The latest results of ``evaluate``, by the bytes of x."""

    def __init__(self, evaluate: Evaluate, dimensions: int, size: int) -> None:
        self.evaluate, self.dimensions, self.size = evaluate, dimensions, size
        self._latest: OrderedDict[bytes, tuple[Array, Array, Array]] = OrderedDict()

    def at(self, x: memoryview) -> tuple[Array, Array, Array]:
        key = bytes(x)
        if key not in self._latest:
            # CasADi stores by columns: one column of x is one row here.
            points = np.frombuffer(key).reshape(self.size, self.dimensions)
            self._latest[key] = self.evaluate(points)
            if len(self._latest) > KEPT:
                self._latest.popitem(last=False)
        return self._latest[key]


class _Order(ca.Callback):
    """Values (1, N), gradients (f, N) or Hessians (f, f N) side by side."""

    def __init__(self, name: str, order: int, results: _Results) -> None:
        ca.Callback.__init__(self)
        self.order, self.results = order, results
        self.construct(name, {})
        _alive.append(self)

    def get_n_in(self) -> int:
        return 1

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, _: int) -> str:
        return "x"

    def get_name_out(self, _: int) -> str:
        return "y"

    def get_sparsity_in(self, _: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.results.dimensions, self.results.size)

    def get_sparsity_out(self, _: int) -> ca.Sparsity:
        f, size = self.results.dimensions, self.results.size
        return ca.Sparsity.dense(*((1, size), (f, size), (f, f * size))[self.order])

    def has_eval_buffer(self) -> bool:
        return True

    def eval_buffer(self, arg: Any, res: Any) -> int:
        if res[0] is not None:
            np.frombuffer(res[0])[:] = self.results.at(arg[0])[self.order].ravel()
        return 0

    def has_jac_sparsity(self, _out: int, _in: int) -> bool:
        return self.order < HESSIAN

    def get_jac_sparsity(self, _out: int, _in: int, _symmetric: bool) -> ca.Sparsity:
        f, size = self.results.dimensions, self.results.size
        block = ca.Sparsity.dense(f if self.order == GRADIENT else 1, f)
        return ca.diagcat(*[block] * size)

    def has_jacobian(self) -> bool:
        return self.order < HESSIAN

    def get_jacobian(self, name: str, names_in: Any, names_out: Any, options: Any) -> Any:
        """The callback of the next order, its entries placed where the Jacobian of this one is not zero."""
        x, y = ca.MX.sym("x", self.sparsity_in(0)), ca.MX.sym("y", ca.Sparsity(*self.size_out(0)))
        following = _Order(f"{self.name()}_{self.order + 1}", self.order + 1, self.results)
        # By columns, the entries of the blocks are those of the gradients, or of the symmetric Hessians, in turn.
        jacobian = ca.MX(self.get_jac_sparsity(0, 0, False), ca.vec(following(x)))
        return ca.Function(name, [x, y], [jacobian], names_in, names_out, options)
