"""Values of many points with their first and second derivatives by two variables, carried through arithmetic.

Forward differentiation of second order: an expression written with +, -, *, / and constant powers, for numbers or for
arrays, is differentiated by putting a :class:`Jet` into it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

# Of the parts value, d/dx, d/dy, d2/dx2, d2/dxdy, d2/dy2: a second derivative and the first ones that it is made of
SECOND = ((3, 1, 1), (4, 1, 2), (5, 2, 2))


class Jet:
    """``parts`` (6, ...): value, derivatives by x and y, second derivatives by xx, xy and yy."""

    __array_ufunc__ = None  # an array on the left leaves the operation to the jet

    def __init__(self, parts: np.ndarray) -> None:
        self.parts = parts

    @classmethod
    def variable(cls, values: np.ndarray, index: int) -> Jet:
        """The variable x (``index`` 0) or y (1) itself."""
        parts = np.zeros((6, *values.shape))
        parts[0], parts[1 + index] = values, 1.0
        return cls(parts)

    @property
    def value(self) -> np.ndarray:
        """(...)."""
        return self.parts[0]

    @property
    def gradient(self) -> np.ndarray:
        """(..., 2)."""
        return np.moveaxis(self.parts[1:3], 0, -1)

    @property
    def hessian(self) -> np.ndarray:
        """(..., 2, 2)."""
        rows = np.moveaxis(self.parts[[3, 4, 4, 5]], 0, -1)
        return rows.reshape(*rows.shape[:-1], 2, 2)

    def __add__(self, other: Any) -> Jet:
        if isinstance(other, Jet):
            return Jet(self.parts + other.parts)
        parts = self.parts.copy()
        parts[0] += other
        return Jet(parts)

    def __mul__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.parts * other)
        a, b = self.parts, other.parts
        parts = a * b[0] + a[0] * b
        parts[0] = a[0] * b[0]
        for both, i, j in SECOND:
            parts[both] += a[i] * b[j] + a[j] * b[i]
        return Jet(parts)

    def __pow__(self, exponent: float) -> Jet:
        a = self.value
        if exponent == 2:
            return self * self
        power = a**exponent
        return chain((power, exponent * power / a, exponent * (exponent - 1) * power / a**2), self)

    def __neg__(self) -> Jet:
        return Jet(-self.parts)

    def __sub__(self, other: Any) -> Jet:
        return self + (-other)

    def __rsub__(self, other: Any) -> Jet:
        return -self + other

    def __truediv__(self, other: Any) -> Jet:
        return self * (other**-1 if isinstance(other, Jet) else 1.0 / other)

    def __rtruediv__(self, other: Any) -> Jet:
        return self**-1 * other

    __radd__ = __add__
    __rmul__ = __mul__


def chain(outer: tuple[np.ndarray, ...], u: Jet) -> Jet:
    """F(u) from the value and the two derivatives of F at the value of ``u``.

    ``outer``: these three.
    """
    value, slope, bend = outer
    parts = slope * u.parts
    parts[0] = value
    for both, i, j in SECOND:
        parts[both] += bend * u.parts[i] * u.parts[j]
    return Jet(parts)


def chain2(outer: Jet, u: Jet, v: Jet) -> Jet:
    """F(u, v) from F as a jet in u and v at their values; its arrays may have more axes in front."""
    value, by_u, by_v, uu, uv, vv = outer.parts
    a, b = u.parts, v.parts
    parts = np.stack([value, *(by_u * a[k] + by_v * b[k] for k in range(1, 6))])
    for both, i, j in SECOND:
        parts[both] += uu * a[i] * a[j] + uv * (a[i] * b[j] + a[j] * b[i]) + vv * b[i] * b[j]
    return Jet(parts)
