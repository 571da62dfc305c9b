"""Peters-He finite-state inflow: mean states, and states at the blade-passage frequency.

D. A. Peters, D. D. Boyd, C. J. He, "Finite-state induced-flow model for rotors in hover and forward flight", Journal of
the American Helicopter Society 34 (1989); D. A. Peters, C. J. He, same journal 40 (1995). The induced velocity is

    v(r, psi, t) / (Omega R) = sum_m,n phi_n^m(r) (alpha_n^m(t) cos m psi + beta_n^m(t) sin m psi),

with M alpha* + L^-1 V alpha = tau / 2 and the loads tau projected on the same functions. Other papers order the
mass flow as V L^-1; this order, with the disc's mean for the induced flow in V, is the one that agrees with momentum
theory annulus by annulus. A steady rotor of N_b equal blades has states of frequencies 0, N_b, 2 N_b, ... per
revolution. The mean and, by choice, the first are kept: N_b stands for what the finite number of blades costs, as
Prandtl's tip loss does; the full series diverges for blades that are lines.

Azimuths are those of the hub (psi = 0 aft), not of the wind: the wake skew enters as the vector X (cos Delta, sin
Delta) = wind in the disc / (V_T + |lambda|), X = tan(chi / 2), whose powers are polynomials of the wind, so that
nothing is singular in hover.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import pi, sqrt
from typing import Any

import casadi as ca
import numpy as np

State = tuple[int, int]  # (harmonic m, shape n)

WAKE_CURVATURE = 1.5  # K_R, inflow gradient per angular velocity of the disc in hover


def states(highest_harmonic: int, highest_shape: int) -> tuple[tuple[State, ...], tuple[State, ...]]:
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


def shape_polynomial(m: int, n: int) -> np.ndarray:
    """Coefficients (n,) of phi_n^m in rising powers of the radius over R."""
    powers = np.zeros(n)
    for q in range(m, n, 2):
        powers[q] = (-1) ** ((q - m) // 2) * double_factorial(n + q)
        powers[q] /= double_factorial(q - m) * double_factorial(q + m) * double_factorial(n - q - 1)
    return np.asarray(sqrt((2 * n + 1) * norm(m, n)) * powers)


def radial_shape(m: int, n: int, radius: np.ndarray) -> np.ndarray:
    """phi_n^m at radii over R (E,).

    ``m``: harmonic; ``n``: number of the shape; ``radius`` over R [-].
    """
    return np.asarray(np.polynomial.polynomial.polyval(radius, shape_polynomial(m, n)))


def coupling(r: int, j: int, m: int, n: int) -> float:
    """Gamma_jn^rm, the skew-independent part of the influence of load (m, n) on state (r, j)."""
    root = sqrt(norm(m, n) * norm(r, j))
    if (r + m) % 2 == 0:
        sign = (-1) ** ((n + j - 2 * r) // 2)
        return sign * 2 * sqrt((2 * n + 1) * (2 * j + 1)) / (root * (j + n) * (j + n + 2) * ((j - n) ** 2 - 1))
    if abs(j - n) == 1:
        return pi * np.sign(r - m) / (2 * root * sqrt((2 * n + 1) * (2 * j + 1)))
    return 0.0


@dataclass(frozen=True, eq=False)
class Inflow:
    """The chosen states, cosine before sine, and their shapes on the grid of the blade.

    With ``blade_passage`` the mean states are followed by their cosine and then their sine amplitudes at blades times
    the azimuth of the blade, which is the same for every blade.
    """

    cosine: tuple[State, ...]
    sine: tuple[State, ...]
    radius: np.ndarray  # (E,) over R
    weight: np.ndarray  # (E,) over R
    azimuth: np.ndarray  # (N,) rad
    blades: int
    blade_passage: bool

    @classmethod
    def at(
        cls,
        radius: np.ndarray,
        weight: np.ndarray,
        azimuth: np.ndarray,
        *,
        blades: int,
        highest_harmonic: int,
        highest_shape: int,
        blade_passage: bool = False,
    ) -> Inflow:
        """States up to the given harmonic and shape on a grid of radii and quadrature weights over R and azimuths.

        With ``blade_passage`` at least up to the harmonic after that of the number of blades: in hover only the latter
        is felt, in flight its neighbours are, too.
        """
        if blade_passage:
            highest_harmonic, highest_shape = max(highest_harmonic, blades + 1), max(highest_shape, blades + 2)
        cosine, sine = states(highest_harmonic, highest_shape)
        return cls(cosine, sine, radius, weight, azimuth, blades, blade_passage)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the states, such as ``inflow_cos_1_2``."""
        mean = [f"inflow_cos_{m}_{n}" for m, n in self.cosine] + [f"inflow_sin_{m}_{n}" for m, n in self.sine]
        parts = ("", "_passage_cos", "_passage_sin") if self.blade_passage else ("",)
        return tuple(name + part for part in parts for name in mean)

    @property
    def mean_size(self) -> int:
        """Number of mean states."""
        return len(self.cosine) + len(self.sine)

    @property
    def size(self) -> int:
        """Number of all states."""
        return self.mean_size * (3 if self.blade_passage else 1)

    @cached_property
    def _shapes(self) -> np.ndarray:
        """Every state's induced velocity on the grid, azimuth after azimuth (E N, size)."""
        columns = [
            np.outer(wave(m * self.azimuth), radial_shape(m, n, self.radius)).ravel()
            for group, wave in ((self.cosine, np.cos), (self.sine, np.sin))
            for m, n in group
        ]
        mean = np.column_stack(columns)
        if not self.blade_passage:
            return mean
        passage = np.repeat(self.blades * self.azimuth, len(self.radius))[:, None]
        return np.hstack([mean, mean * np.cos(passage), mean * np.sin(passage)])

    @cached_property
    def _projection(self) -> np.ndarray:
        """Matrix (size, E N) from the load of one blade to the pressure integrals tau of all blades."""
        harmonic = np.array([m for m, _ in self.cosine + self.sine])
        share = np.where(harmonic == 0, 0.5, 1.0) / pi * self.blades / len(self.azimuth)
        if self.blade_passage:
            share = np.concatenate([share, 2 * share, 2 * share])
        return np.asarray((self._shapes * np.tile(self.weight, len(self.azimuth))[:, None]).T * share[:, None])

    @cached_property
    def _disc_mean(self) -> np.ndarray:
        """Mean over the disc of every mean state's shape (n,): 2 int phi r dr for the axisymmetric ones."""
        means = np.zeros(self.mean_size)
        for k, (m, n) in enumerate(self.cosine):
            if m == 0:
                means[k] = np.sum(2 * shape_polynomial(m, n) / (np.arange(n) + 2))
        return means

    @cached_property
    def _influence(self) -> np.ndarray:
        """L = sum over k of Re z^k P_k + Im z^k Q_k, z the skew vector: P and Q (2, highest power + 1, n, n).

        In complex amplitudes a = alpha - i beta the load tau of harmonic m gives state r the velocity Gamma (z^(m-r)
        tau + (-1)^min(r,m) conj(z)^(m+r) conj(tau)), with conj(z)^(r-m) for negative m - r and the first term alone for
        r = 0.
        """
        kinds = [(m, n, False) for m, n in self.cosine] + [(m, n, True) for m, n in self.sine]
        highest = max(m for m, _, _ in kinds)
        matrices = np.zeros((2, 2 * highest + 1, len(kinds), len(kinds)))
        for i, (r, j, is_sine) in enumerate(kinds):
            for k, (m, n, from_sine) in enumerate(kinds):
                gamma, turn = coupling(r, j, m, n), 1 if m >= r else -1
                terms = [(abs(m - r), turn, 1)]
                if r > 0:
                    terms.append((m + r, -1, (-1) ** min(r, m)))
                for index, (power, direction, sign) in enumerate(terms):
                    mirrored = -1 if index == 1 and from_sine else 1  # conj(tau)
                    factor = gamma * sign * mirrored
                    # (Re + i direction Im)(cosine - i sine): its real part is alpha, minus its imaginary part beta
                    if is_sine == from_sine:
                        matrices[0, power, i, k] += factor
                    else:
                        matrices[1, power, i, k] += factor * direction * (-1 if is_sine else 1)
        return matrices

    def induced(self, state: Any) -> Any:
        """Induced velocity over tip speed, positive down (E, N)."""
        return ca.reshape(ca.mtimes(ca.DM(self._shapes), state), len(self.radius), len(self.azimuth))

    def mean(self, state: Any) -> Any:
        """Induced inflow ratio, mean over the disc and the revolution: sqrt(C_T / 2) in hover."""
        return ca.dot(ca.DM(self._disc_mean), state[: self.mean_size])

    def skew(self, state: Any, wind: Any) -> Any:
        """X = tan(chi / 2) of the wake, from the wind (aft, right, up) over tip speed."""
        *_, along, across = self._flow(state, wind)
        return ca.sqrt(along**2 + across**2 + 1e-12)

    def residual(self, state: Any, load: Any, *, wind: Any, hub_rate: Any = (0.0, 0.0), curvature: bool = False) -> Any:
        """V alpha + L M alpha* - L tau / 2 of every state (size,).

        load: F_z / (rho Omega^2 R^3) of one blade (E, N). wind: air velocity relative to the hub (aft, right, up) over
        tip speed. hub_rate: angular velocity of the hub over Omega (about aft, right), bends the wake if ``curvature``.
        """
        n = self.mean_size
        total, other, along, across = self._flow(state, wind)
        V = ca.vertcat(total, ca.repmat(other, n - 1, 1))
        L = self._influence_at(along, across)
        tau = ca.mtimes(ca.DM(self._projection), ca.reshape(load, -1, 1))
        mean = V * state[:n] - ca.mtimes(L, tau[:n]) / 2
        if curvature:
            mean -= other * self._curvature(self.mean(state) / total, along, across, hub_rate)
        if not self.blade_passage:
            return mean
        mass = self.blades * ca.DM([2 * norm(*s) / pi for s in self.cosine + self.sine])
        cosine, sine = state[n : 2 * n], state[2 * n :]
        return ca.vertcat(
            mean,
            V * cosine + ca.mtimes(L, mass * sine - tau[n : 2 * n] / 2),
            V * sine - ca.mtimes(L, mass * cosine + tau[2 * n :] / 2),
        )

    def _curvature(self, ratio: Any, along: Any, across: Any, hub_rate: Any) -> Any:
        """Change of the states (n,) by the curvature of the wake of a rotating hub; ``ratio`` is lambda_m / V_T.

        J. Zhao, J. V. R. Prasad, D. A. Peters, "Rotor dynamic wake distortion model for helicopter maneuvering flight",
        Journal of the American Helicopter Society 49 (2004), of whose influence matrix the column of thrust is kept,
        gradient = K_R (kappa / 2) C_T (1 -+ 3/2 X^2) / V_T along and across the wind; K_R = 1.5 by the vortex tube of
        J. D. Keller, same journal 41 (1996). A nose-up rate lowers the back of the disc onto its wake: the vortices
        lie closer there and further apart in front, so the inflow grows at the back by K_R q / Omega in hover. The
        curvature is kappa = rate / V_T, so that it fades with speed; the axial flow, by which the source divides, would
        make it grow without limit in fast level flight.
        """
        # Downward velocity of the disc's edge is c cos psi + s sin psi.
        c, s = hub_rate[1], -hub_rate[0]
        double_cos, double_sin = along**2 - across**2, 2 * along * across
        gradient = (
            c - 1.5 * (double_cos * c + double_sin * s),
            s - 1.5 * (double_sin * c - double_cos * s),
        )
        change = ca.vertcat(*gradient) * WAKE_CURVATURE * ratio / shape_polynomial(1, 2)[1]
        rows = ca.DM(self.mean_size, 2)
        if (1, 2) in self.sine:
            rows[self.cosine.index((1, 2)), 0] = 1
            rows[len(self.cosine) + self.sine.index((1, 2)), 1] = 1
        return ca.mtimes(rows, change)

    def _flow(self, state: Any, wind: Any) -> tuple[Any, Any, Any, Any]:
        """Mass-flow parameters V_T of the uniform and V of the other states, and the skew vector (aft, right)."""
        mean = self.mean(state)
        through = mean - wind[2]
        in_plane = wind[0] ** 2 + wind[1] ** 2
        total = ca.sqrt(in_plane + through**2 + 1e-8)
        other = (in_plane + (through + mean) * through) / total
        speed = total + ca.sqrt(through**2 + 1e-8)
        return total, other, wind[0] / speed, wind[1] / speed

    def _influence_at(self, along: Any, across: Any) -> Any:
        """L (n, n) at a skew vector."""
        highest = self._influence.shape[1] - 1
        real, imaginary = [1.0], [0.0]
        for _ in range(highest):
            real, imaginary = (
                [*real, real[-1] * along - imaginary[-1] * across],
                [*imaginary, real[-1] * across + imaginary[-1] * along],
            )
        n = self.mean_size
        flat = self._influence.transpose(3, 2, 0, 1).reshape(n * n, -1)
        return ca.reshape(ca.mtimes(ca.sparsify(ca.DM(flat)), ca.vertcat(*real, *imaginary)), n, n)
