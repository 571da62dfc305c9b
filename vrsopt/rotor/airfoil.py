"""Static section aerodynamics as one smooth function of angle of attack (whole circle) and Mach number.

Lift: attached line a(M) sin(alpha - alpha0), handed over to a separated lift c s / sqrt(s^2 + b) by logistic weights at
the positive and the negative break. Drag: a level, a parabola in sin(alpha) and one ramp (softplus) beyond each break,
which describes drag divergence and stall alike. Every coefficient is a polynomial in Mach number, of the widths the
logarithm. s = sin(alpha) and c = cos(alpha) are the arguments, so that no arc tangent is needed and reversed flow is
regular.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import casadi as ca

from vrsopt.quantity import Record, Unit

Polynomial = Annotated[tuple[float, ...], Unit("-")]
HIGHEST_LIFT_MACH = 0.82  # the lift coefficients are held beyond: the fit ends at 0.8
HIGHEST_DRAG_MACH = 0.95
LOWEST_MACH = 0.2  # the deck is constant below
SMALLEST_WIDTH = 0.005  # of a drag ramp, as a sine: no kink however the coefficients come out


class Airfoil(Record):
    """Section coefficients as polynomials in Mach number, constant term first; angles as sines."""

    lift_slope: Polynomial
    zero_lift_sine: Polynomial
    break_sine: Polynomial
    log_break_width: Polynomial
    negative_break_sine: Polynomial
    log_negative_break_width: Polynomial
    separated_lift: Polynomial
    separated_width: Polynomial
    drag_level: Polynomial
    drag_parabola: Polynomial
    drag_bucket_sine: Polynomial
    ramp_sine: Polynomial
    ramp_slope: Polynomial
    log_ramp_width: Polynomial
    negative_ramp_sine: Polynomial
    negative_ramp_slope: Polynomial
    log_negative_ramp_width: Polynomial
    drag_reference: Annotated[float, Unit("-")]  # the fit's own level at Mach 0.3 and zero angle of attack

    def coefficients(self, sine: Any, cosine: Any, mach: Any, drag_level: Any) -> tuple[Any, Any]:
        """Lift and drag coefficient from the sine and cosine of the angle of attack and the Mach number.

        ``drag_level`` is the zero-incidence drag of the blade as built and at full scale: the whole fitted
        drag is shifted by its difference from ``drag_reference``. Works on CasADi expressions and on floats.
        """
        m = smooth_clip(mach, LOWEST_MACH, HIGHEST_LIFT_MACH)
        s0 = polynomial(self.zero_lift_sine, m)
        attached = polynomial(self.lift_slope, m) * (sine * ca.sqrt(1 - s0**2) - cosine * s0)
        separated = (
            polynomial(self.separated_lift, m)
            * sine
            * cosine
            / ca.sqrt(sine**2 + polynomial(self.separated_width, m) ** 2)
        )
        upper = logistic((polynomial(self.break_sine, m) - sine) / ca.exp(polynomial(self.log_break_width, m)))
        lower = logistic(
            (sine - polynomial(self.negative_break_sine, m)) / ca.exp(polynomial(self.log_negative_break_width, m))
        )
        forward = logistic(cosine / 0.08)  # reversed flow is separated; the width only smooths the change-over
        weight = upper * lower * forward
        lift = weight * attached + (1 - weight) * separated

        m = smooth_clip(mach, LOWEST_MACH, HIGHEST_DRAG_MACH)
        drag = (
            polynomial(self.drag_level, m)
            + drag_level
            - self.drag_reference
            + polynomial(self.drag_parabola, m) * (sine - polynomial(self.drag_bucket_sine, m)) ** 2
            + polynomial(self.ramp_slope, m)
            * softplus(sine - polynomial(self.ramp_sine, m), ramp_width(self.log_ramp_width, m))
            + polynomial(self.negative_ramp_slope, m)
            * softplus(polynomial(self.negative_ramp_sine, m) - sine, ramp_width(self.log_negative_ramp_width, m))
        )
        return lift, drag


def polynomial(coefficients: Sequence[float], x: Any) -> Any:
    """Horner's rule, constant term first."""
    value: Any = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        value = value * x + coefficient
    return value


def ramp_width(log_excess: Sequence[float], mach: Any) -> Any:
    """Width of a ramp: its smallest value and the exponential of a polynomial."""
    return SMALLEST_WIDTH + ca.exp(polynomial(log_excess, mach))


def logistic(x: Any) -> Any:
    """1 / (1 + exp(-x)) without overflow."""
    return 0.5 * (1 + ca.tanh(0.5 * x))


def softplus(x: Any, width: Any) -> Any:
    """Smooth max(x, 0): exact beyond a few widths. Written so that no exponential overflows."""
    return 0.5 * (x + ca.fabs(x)) + width * ca.log1p(ca.exp(-ca.fabs(x) / width))


def smooth_clip(x: Any, lower: float, upper: float, width: float = 0.01) -> Any:
    """x held between two bounds, rounded over about ``width`` at each."""
    high = 0.5 * (x + upper - ca.sqrt((x - upper) ** 2 + width**2))
    return 0.5 * (high + lower + ca.sqrt((high - lower) ** 2 + width**2))
