"""Aerodynamics of the time-marching baseline: static and unsteady section, dynamic inflow. Plain numpy."""

from __future__ import annotations

from functools import cached_property
from math import factorial, pi, sqrt
from typing import Any

import numpy as np
from numpy.polynomial import legendre

INDICIAL = ((0.3, 0.14), (0.7, 0.53))  # amplitudes and exponents of the lift's response to a step
LAGS = 6  # states of an unsteady section
SHED, CLOCK, REWIND, LEAK, TRAVEL, FALLING = 0.05, 0.5, 2.0, 60.0, 0.2, 0.01  # as in the model to be compared
Coefficients = tuple[np.ndarray, np.ndarray, np.ndarray]


class Section:
    """Coefficients of lift, drag and moment from the polynomials in Mach number of the data file."""

    def __init__(self, data: dict) -> None:
        self.reference = data["drag_reference"]
        curves = {name: value for name, value in data.items() if name != "drag_reference"}
        self.names = tuple(curves)
        self.table = np.zeros((len(curves), max(len(value) for value in curves.values())))
        for row, value in zip(self.table, curves.values(), strict=True):
            row[: len(value)] = value

    def at(self, mach: np.ndarray) -> dict[str, np.ndarray]:
        """Every polynomial at once."""
        powers = mach ** np.arange(self.table.shape[1])[:, None, None]
        return dict(zip(self.names, np.tensordot(self.table, powers, 1), strict=True))

    def static(self, sine: np.ndarray, cosine: np.ndarray, mach: np.ndarray, level: float) -> Coefficients:
        """In steady flow."""
        k = self.at(held(mach, 0.2, 0.82))
        forward = sigmoid(cosine / 0.08)
        share = attachment(k, sine) * forward
        lift = share * k["lift_slope"] * from_zero(k, sine, cosine) + (1 - share) * plate(k, sine, cosine)
        return lift, self.drag(sine, mach, level), moment(k, sine, cosine, share, forward)

    def drag(self, sine: np.ndarray, mach: np.ndarray, level: float) -> np.ndarray:
        """Drag coefficient with ``level`` at zero incidence and low Mach number."""
        k = self.at(held(mach, 0.2, 0.95))
        drag = k["drag_level"] + level - self.reference + k["drag_parabola"] * (sine - k["drag_bucket_sine"]) ** 2
        for sign, name in ((1, ""), (-1, "negative_")):
            width = 0.005 + np.exp(k[f"log_{name}ramp_width"])
            beyond = sign * (sine - k[f"{name}ramp_sine"]) / width
            drag += k[f"{name}ramp_slope"] * width * np.logaddexp(0, beyond)
        return drag

    def unsteady(
        self,
        lags: np.ndarray,
        *,
        speed: np.ndarray,
        angle: tuple[np.ndarray, np.ndarray],
        mach: np.ndarray,
        pitch_rate: np.ndarray,
        chord: float,
        level: float,
        slopes: Any,
    ) -> tuple[Coefficients, np.ndarray]:
        """Coefficients and the time derivatives of the states ``lags`` (LAGS, B, E) with Leishman-Beddoes stall.

        angle: sine and cosine of the geometric one. ``slopes(name, value)`` gives the time derivative of a quantity
        that has no equation of its own.
        """
        (sine, cosine), per_time = angle, 2 * speed / chord  # semi-chords
        upwash, pressure, separation, clock, vortex = lags[:2], *lags[2:]
        held_mach = held(mach, 0.2, 0.82)
        k = self.at(held_mach)
        slope = k["lift_slope"]
        forward, beta_squared = sigmoid(cosine / 0.08), held(1 - mach**2, 0.2, 2.0)
        above = from_zero(k, sine, cosine)

        normal = speed * above + 0.5 * chord * pitch_rate  # at three quarters of the chord
        lagged = sum(A * x for (A, _), x in zip(INDICIAL, upwash, strict=True))
        lagged_sine = lagged / np.sqrt(speed**2 * (1 - above**2) + lagged**2)
        attached = slope * lagged_sine
        acceleration = slopes("middle", speed * sine + 0.25 * chord * pitch_rate)
        indicial = sum(A * b for A, b in INDICIAL)
        mass = 3 / (1 - held_mach + pi * held_mach**2 * np.sqrt(beta_squared) * indicial)
        impulsive = mass * chord * acceleration / speed**2

        feeding = lagged_sine + impulsive / slope
        size = np.sqrt(pressure**2 + 1e-4)
        shedding = forward * sigmoid((slope * size - k["critical_normal_force"]) / SHED)
        clock_rate = (1 - shedding) / REWIND + 1 / LEAK
        travel = held(clock / k["vortex_passage"], 0.0, 1.0, 0.1)
        falling = (pressure - feeding) * pressure / size
        falling = 0.5 * (falling + np.sqrt(falling**2 + 1e-6)) - 0.5e-3
        delay = k["reattachment_shift"] * travel * pressure / size * falling / (falling + FALLING)
        share, broken = separation * forward, plate(k, sine, cosine)
        lift = share * attached + (1 - share) * broken
        feed = shedding * sigmoid((k["vortex_passage"] - clock) / CLOCK)
        loss = slopes("loss", (1 - share) * forward * (attached - broken))

        felt = sine + forward * (pressure - above)
        lost = 1 - forward * attachment(k, felt)
        table = (1 - lost) * slope * pressure + lost * plate(k, felt, cosine)
        drag = self.drag(felt, mach, level) + lost * (lift * sine - table * felt)
        drag += share * attached * (normal - lagged) / speed
        pitching = moment(k, sine, cosine, share, forward) - 0.25 * impulsive
        pitching -= forward * pi / 8 / np.sqrt(beta_squared) * pitch_rate * chord / speed
        pitching -= TRAVEL * (1 - np.cos(pi * travel)) * vortex
        rates = [
            *(b * beta_squared * per_time * (normal - x) for (_, b), x in zip(INDICIAL, upwash, strict=True)),
            per_time / k["pressure_lag"] * (feeding - pressure),
            per_time / k["separation_lag"] * (attachment(k, sine + pressure - above + delay) - separation),
            per_time * (shedding - clock_rate * clock),
            feed * loss - per_time / k["vortex_decay"] * vortex,
        ]
        push = vortex + impulsive
        return (lift + push * cosine, drag + push * sine, pitching), np.array(rates)


def attachment(k: dict[str, np.ndarray], sine: np.ndarray) -> np.ndarray:
    """Share of attached flow while the flow is forward."""
    upper = (k["break_sine"] - sine) / np.exp(k["log_break_width"])
    lower = (sine - k["negative_break_sine"]) / np.exp(k["log_negative_break_width"])
    return sigmoid(upper) * sigmoid(lower)


def from_zero(k: dict[str, np.ndarray], sine: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    """Sine of the angle from zero lift."""
    return sine * np.sqrt(1 - k["zero_lift_sine"] ** 2) - cosine * k["zero_lift_sine"]


def plate(k: dict[str, np.ndarray], sine: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    """Lift coefficient of separated flow."""
    return k["separated_lift"] * sine * cosine / np.hypot(sine, k["separated_width"])


def moment(
    k: dict[str, np.ndarray], sine: np.ndarray, cosine: np.ndarray, share: np.ndarray, forward: np.ndarray
) -> np.ndarray:
    """Moment coefficient about the quarter chord; ``share`` of attached flow includes that of forward flow."""
    attached = k["moment_level"] + k["moment_slope"] * sine
    broken = -sine * (k["separated_moment"] + cosine * k["separated_moment_cosine"])
    backward = -k["reversed_moment"] * cosine**2 * sine / np.hypot(sine, 0.07)
    return share * attached + (1 - share) * broken + (1 - forward) * backward


class PetersHe:
    """Generalised dynamic wake in wind axes: alpha' = M^-1 (tau / 2 - L^-1 V alpha), ' = d / d(Omega t).

    States (m, n) up to harmonic m and shape n, m + n odd, cosines then sines. D. A. Peters, D. D. Boyd, C. J. He,
    Journal of the American Helicopter Society 34 (1989).
    """

    def __init__(self, radius: np.ndarray, weight: np.ndarray, harmonic: int, shape: int) -> None:
        pairs = [(m, n) for m in range(harmonic + 1) for n in range(m + 1, shape + 1) if (m + n) % 2]
        self.kinds = [(m, n, np.cos) for m, n in pairs] + [(m, n, np.sin) for m, n in pairs if m]
        self.cosines, self.size = len(pairs), len(self.kinds)
        self.harmonics = np.array([m for m, _, _ in self.kinds])
        self.shapes = np.array([shape_function(m, n, radius) for m, n, _ in self.kinds])  # (S, E)
        self.loaded = self.shapes * weight * np.where(self.harmonics == 0, 0.5, 1.0)[:, None] / pi
        self.mass = np.array([2 / pi * ratio(m, n) for m, n, _ in self.kinds])
        points, weights = legendre.leggauss(20)
        inside = (1 + points) / 2
        means = [np.sum(weights * inside * shape_function(m, n, inside)) for m, n, _ in self.kinds]
        self.disc_mean = np.where(self.harmonics == 0, means, 0.0)

    def waves(self, azimuth: np.ndarray) -> np.ndarray:
        """(B, S): cosine or sine of each state's harmonic at azimuths from downwind (B,)."""
        angle = azimuth[:, None] * self.harmonics
        return np.where(np.arange(self.size) < self.cosines, np.cos(angle), np.sin(angle))

    def induced(self, states: np.ndarray, waves: np.ndarray) -> np.ndarray:
        """Inflow ratio at the stations of each blade (B, E)."""
        return (waves * states) @ self.shapes

    def loads(self, lift: np.ndarray, waves: np.ndarray) -> np.ndarray:
        """tau (S,) of the lifts (B, E) of all blades, over rho Omega^2 R^3."""
        return np.sum((lift @ self.loaded.T) * waves, axis=0)

    def rate(self, states: np.ndarray, tau: np.ndarray, advance: float, upward: float) -> np.ndarray:
        """d(states)/d(Omega t); advance ratio in the disc and air velocity through it, upward, over tip speed."""
        mean = self.disc_mean @ states
        through = mean - upward
        total = np.hypot(advance, through)
        flow = np.full(self.size, (advance**2 + (through + mean) * through) / total)
        flow[0] = total
        straight, mirrored, low, high = self.gains
        skew = advance / (total + abs(through))
        L = straight * skew**low + mirrored * skew**high
        return (tau / 2 - np.linalg.solve(L, flow * states)) / self.mass

    @cached_property
    def gains(self) -> tuple[np.ndarray, ...]:
        """L = straight skew^low + mirrored skew^high, skew the tangent of half of the wake's angle: (S, S) each."""
        straight, mirrored, low, high = np.zeros((4, self.size, self.size))
        for i, (r, j, wave) in enumerate(self.kinds):
            for k, (m, n, other) in enumerate(self.kinds):
                low[i, k], high[i, k] = abs(m - r), m + r
                if wave is not other:
                    continue
                odd = sqrt((2 * n + 1) * (2 * j + 1) / (ratio(m, n) * ratio(r, j)))
                if (r + m) % 2 == 0:
                    gain = (-1) ** ((n + j - 2 * r) // 2) * 2 * odd / ((j + n) * (j + n + 2) * ((j - n) ** 2 - 1))
                else:
                    gain = pi / 2 * odd * np.sign(r - m) * (abs(j - n) == 1) / ((2 * n + 1) * (2 * j + 1))
                straight[i, k] = gain
                if r > 0:
                    mirrored[i, k] = gain * (-1) ** min(r, m) * (1 if wave is np.cos else -1)
        return straight, mirrored, low, high


def shape_function(m: int, n: int, radius: np.ndarray) -> np.ndarray:
    """P_n^m(nu) / nu, nu = sqrt(1 - r^2), with the normalised Legendre function."""
    nu = np.sqrt(1 - radius**2)
    derivative = legendre.legval(nu, legendre.legder(np.eye(n + 1)[n], m))
    return sqrt((2 * n + 1) * factorial(n - m) / factorial(n + m)) * radius**m * derivative / nu


def ratio(m: int, n: int) -> float:
    """H = (n+m-1)!! (n-m-1)!! / ((n+m)!! (n-m)!!)."""
    up, down = (_semifactorial(n + m - 1), _semifactorial(n - m - 1)), (_semifactorial(n + m), _semifactorial(n - m))
    return up[0] * up[1] / (down[0] * down[1])


def _semifactorial(n: int) -> float:
    return float(np.prod(np.arange(max(n, 1), 0, -2.0)))


def sigmoid(x: np.ndarray) -> np.ndarray:
    return 0.5 * (1 + np.tanh(0.5 * x))


def held(x: np.ndarray, lower: float, upper: float, width: float = 0.01) -> np.ndarray:
    """x between two bounds, with corners rounded over ``width`` as the section data was fitted."""
    high = 0.5 * (x + upper - np.hypot(x - upper, width))
    return 0.5 * (high + lower + np.hypot(high - lower, width))
