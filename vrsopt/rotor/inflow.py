"""Peters-He finite-state inflow, mean (non-rotating, steady) states.

D. A. Peters, D. D. Boyd, C. J. He, "Finite-state induced-flow model for rotors in hover and forward flight", Journal of
the American Helicopter Society 34 (1989); D. A. Peters, C. J. He, same journal 40 (1995). The induced velocity is

    v(r, psi) / (Omega R) = sum_m,n phi_n^m(r) (alpha_n^m cos m psi + beta_n^m sin m psi),

psi from the downwind direction, and in the steady state V alpha = L tau / 2 with the loads tau projected on the same
functions. The wake skew enters as X = tan(chi / 2) = mu / (V_T + |lambda|), without an arc tangent.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt
from typing import Any

import casadi as ca
import numpy as np

State = tuple[int, int]  # (harmonic m, shape n)


def states(highest_harmonic: int = 3, highest_shape: int = 4) -> tuple[tuple[State, ...], tuple[State, ...]]:
    """Cosine and sine states (m, n) with m <= highest_harmonic, n <= highest_shape and m + n odd."""
    cosine = tuple(
        (m, n) for m in range(highest_harmonic + 1) for n in range(m + 1, highest_shape + 1) if (m + n) % 2 == 1
    )
    return cosine, tuple((m, n) for m, n in cosine if m > 0)


def double_factorial(n: int) -> float:
    """n!! with (-1)!! = 0!! = 1; a negative odd argument below -1 by the recurrence n!! = (n+2)!!/(n+2)."""
    if n >= 0:
        return float(np.prod(np.arange(n, 0, -2))) if n > 0 else 1.0
    value, k = 1.0, -1
    while k > n:
        value, k = value / k, k - 2
    return value


def norm(m: int, n: int) -> float:
    """H_n^m = (n+m-1)!! (n-m-1)!! / ((n+m)!! (n-m)!!)."""
    return (
        double_factorial(n + m - 1) * double_factorial(n - m - 1) / (double_factorial(n + m) * double_factorial(n - m))
    )


def radial_shape(m: int, n: int, radius: np.ndarray) -> np.ndarray:
    """phi_n^m at radii over R (E,)."""
    total = np.zeros_like(radius)
    for q in range(m, n, 2):
        total = total + radius**q * (-1) ** ((q - m) // 2) * double_factorial(n + q) / (
            double_factorial(q - m) * double_factorial(q + m) * double_factorial(n - q - 1)
        )
    return sqrt((2 * n + 1) * norm(m, n)) * total


def coupling(r: int, j: int, m: int, n: int) -> float:
    """Gamma_jn^rm, the skew-independent part of the influence of load (m, n) on state (r, j)."""
    root = sqrt(norm(m, n) * norm(r, j))
    if (r + m) % 2 == 0:
        sign = (-1) ** ((n + j - 2 * r) // 2)
        return sign * 2 * sqrt((2 * n + 1) * (2 * j + 1)) / (root * (j + n) * (j + n + 2) * ((j - n) ** 2 - 1))
    if abs(j - n) == 1:
        return pi * np.sign(r - m) / (2 * root * sqrt((2 * n + 1) * (2 * j + 1)))
    return 0.0


@dataclass(frozen=True)
class Inflow:
    """The chosen states and their shapes at the radial stations."""

    cosine: tuple[State, ...]
    sine: tuple[State, ...]
    cosine_shapes: np.ndarray  # (E, n_cosine)
    sine_shapes: np.ndarray  # (E, n_sine)

    @classmethod
    def at(cls, radius: np.ndarray, *, highest_harmonic: int = 3, highest_shape: int = 4) -> Inflow:
        """States up to the given harmonic and shape, evaluated at radii over R (E,)."""
        cosine, sine = states(highest_harmonic, highest_shape)
        shapes = [np.column_stack([radial_shape(m, n, radius) for m, n in group]) for group in (cosine, sine)]
        return cls(cosine, sine, *shapes)

    def influence(self, skew: Any) -> tuple[Any, Any]:
        """Matrices L of the cosine and the sine states as expressions of X = tan(chi / 2)."""
        matrices = []
        for group, sign in ((self.cosine, 1), (self.sine, -1)):
            rows = []
            for r, j in group:
                row = []
                for m, n in group:
                    skew_power = skew**m if r == 0 else skew ** abs(m - r) + sign * (-1) ** min(r, m) * skew ** (m + r)
                    row.append(skew_power * coupling(r, j, m, n))
                rows.append(ca.horzcat(*row))
            matrices.append(ca.vertcat(*rows))
        return matrices[0], matrices[1]

    def mass_flow(self, advance_ratio: Any, inflow: Any, mean_induced: Any) -> tuple[Any, Any, Any]:
        """Mass-flow parameters of the cosine and the sine states, and X = tan(chi / 2).

        ``inflow`` is the whole mean flow through the disc over the tip speed, ``mean_induced`` its induced part.
        The uniform state is carried by V_T, all others by V = (mu^2 + (lambda + lambda_m) lambda) / V_T.
        """
        total = ca.sqrt(advance_ratio**2 + inflow**2 + 1e-8)
        other = (advance_ratio**2 + (inflow + mean_induced) * inflow) / total
        skew = advance_ratio / (total + ca.sqrt(inflow**2 + 1e-8))
        cosine = ca.vertcat(*[total if state == (0, 1) else other for state in self.cosine])
        return cosine, ca.repmat(other, len(self.sine), 1), skew

    @property
    def mean_weight(self) -> float:
        """Mean induced velocity over the disc per unit of the uniform state alpha_1^0."""
        return sqrt(3.0)
