"""Static section aerodynamics as one smooth function of angle of attack (whole circle) and Mach number.

Lift: attached line a(M) sin(alpha - alpha0), handed over to a separated lift c s / sqrt(s^2 + b) by logistic weights at
the positive and the negative break. Drag: a level, a parabola in sin(alpha) and one ramp (softplus) beyond each break,
which describes drag divergence and stall alike. Every coefficient is a polynomial in Mach number, of the widths the
logarithm. s = sin(alpha) and c = cos(alpha) are the arguments, so that no arc tangent is needed and reversed flow is
regular.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from itertools import zip_longest
from math import log
from pathlib import Path
from typing import Annotated, Any

import casadi as ca

from vrsopt.errors import InputError
from vrsopt.quantity import Record, Unit, read_toml, validated

logger = logging.getLogger(__name__)

DATA = Path(__file__).parents[1] / "data"

Polynomial = Annotated[tuple[float, ...], Unit("-")]
HIGHEST_LIFT_MACH = 0.82  # the lift coefficients are held beyond: the fit ends at 0.8
HIGHEST_DRAG_MACH = 0.95
LOWEST_MACH = 0.2  # the deck is constant below
# Leishman and Beddoes (1989), Mach 0.3 to 0.8; the passage of the vortex as one value.
NACA_0012_STALL: dict[str, tuple[float, ...]] = {
    "pressure_lag": (-0.9787, 17.68, -38.78, 30.92),
    "separation_lag": (5.149, -9.222, 6.664),
    "reattachment_shift": (0.06159, -0.07348),
    "vortex_decay": (6.0,),
    "vortex_passage": (2.204, 22.56, -17.95),
    "critical_normal_force": (4.313, -17.2, 31.89, -21.03),
}
NACA_0012_SOURCE = "Leishman and Beddoes (1989), NACA 0012"
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
    moment_level: Polynomial
    moment_slope: Polynomial
    separated_moment: Polynomial
    separated_moment_cosine: Polynomial
    reversed_moment: Polynomial
    pressure_lag: Polynomial  # time constants of dynamic stall, semi-chords
    separation_lag: Polynomial
    reattachment_shift: Polynomial  # as a sine: how much earlier the flow must come back than it left
    vortex_decay: Polynomial
    vortex_passage: Polynomial
    critical_normal_force: Polynomial

    @classmethod
    def from_c81(cls, path: str | Path) -> Airfoil:
        """The section fitted to a C81 deck.

        Logs a warning for each coefficient whose largest error between -4 and 10 deg, at any Mach number up to 0.8, is
        above 0.05 (lift), 0.02 (drag) or 0.03 (moment). All errors are in the :class:`SectionFit` of
        ``section, fit = fit_section(read_c81(path))`` (:mod:`vrsopt.rotor.section_fit`, :mod:`vrsopt.rotor.c81`); it
        prints as a table. Raises :class:`InputError` with one line when the deck can not be read or can not carry a
        fit, :class:`NoSolutionError` when the fit does not converge.
        """
        from vrsopt.rotor.c81 import read_c81
        from vrsopt.rotor.section_fit import LARGEST_ERROR, fit_section  # the fit needs the section's own class

        section, fit = fit_section(read_c81(path))
        for quantity, bound in LARGEST_ERROR.items():
            worst = fit.worst(quantity)
            if worst.largest > bound:
                logger.warning(
                    "%s: %s of the fit misses the deck by %.3f at Mach %.2f, more than %g",
                    path,
                    quantity,
                    worst.largest,
                    worst.mach,
                    bound,
                )
        return section

    def coefficients(self, sine: Any, cosine: Any, mach: Any, drag_level: Any) -> tuple[Any, Any, Any]:
        """Coefficients of lift, drag and moment from the sine and cosine of the angle of attack and the Mach number.

        The moment is about the quarter chord, nose up. ``drag_level`` is the zero-incidence drag of the blade as built
        and at full scale: the whole fitted drag is shifted by its difference from ``drag_reference``. Works on CasADi
        expressions and on floats.
        """
        m = smooth_clip(mach, LOWEST_MACH, HIGHEST_LIFT_MACH)
        slope, s0 = self.attached_lift(m)
        forward = self.forward(cosine)
        weight = attachment(sine, self.attached_limits(m)) * forward
        attached = slope * (sine * ca.sqrt(1 - s0**2) - cosine * s0)
        lift = weight * attached + (1 - weight) * self.separated(sine, cosine, m)
        return lift, self.drag(sine, mach, drag_level), self.moment(sine, cosine, m, weight, forward)

    def attached_lift(self, m: Any) -> tuple[Any, Any]:
        """Slope of the attached lift by the sine of the angle from zero lift, and the sine of the zero-lift angle.

        ``m`` here and in the other pieces: the Mach number held between the ends of the fit.
        """
        return polynomial(self.lift_slope, m), polynomial(self.zero_lift_sine, m)

    def forward(self, cosine: Any) -> Any:
        """Weight of forward flow: reversed flow is separated; the width only smooths the change-over."""
        return logistic(cosine / 0.08)

    def attached_limits(self, m: Any) -> tuple[Any, Any, Any, Any]:
        """Sine and width of the positive, sine and width of the negative break."""
        return (
            polynomial(self.break_sine, m),
            ca.exp(polynomial(self.log_break_width, m)),
            polynomial(self.negative_break_sine, m),
            ca.exp(polynomial(self.log_negative_break_width, m)),
        )

    def separated(self, sine: Any, cosine: Any, m: Any) -> Any:
        """Lift coefficient of separated flow."""
        width = polynomial(self.separated_width, m)
        return polynomial(self.separated_lift, m) * sine * cosine / ca.sqrt(sine**2 + width**2)

    def drag(self, sine: Any, mach: Any, drag_level: Any) -> Any:
        """Drag coefficient; ``mach`` is not yet held between bounds."""
        m = smooth_clip(mach, LOWEST_MACH, HIGHEST_DRAG_MACH)
        return (
            polynomial(self.drag_level, m)
            + drag_level
            - self.drag_reference
            + polynomial(self.drag_parabola, m) * (sine - polynomial(self.drag_bucket_sine, m)) ** 2
            + polynomial(self.ramp_slope, m)
            * softplus(sine - polynomial(self.ramp_sine, m), ramp_width(self.log_ramp_width, m))
            + polynomial(self.negative_ramp_slope, m)
            * softplus(polynomial(self.negative_ramp_sine, m) - sine, ramp_width(self.log_negative_ramp_width, m))
        )

    def moment(self, sine: Any, cosine: Any, m: Any, weight: Any, forward: Any) -> Any:
        """Moment coefficient about the quarter chord; ``weight`` of attached flow, ``forward`` of forward flow."""
        attached = polynomial(self.moment_level, m) + polynomial(self.moment_slope, m) * sine
        separated = -sine * (
            polynomial(self.separated_moment, m) + cosine * polynomial(self.separated_moment_cosine, m)
        )
        # Trailing edge first the lift acts at three quarters of the chord.
        aft = -polynomial(self.reversed_moment, m) * cosine**2 * sine / ca.sqrt(sine**2 + 0.07**2)
        return weight * attached + (1 - weight) * separated + (1 - forward) * aft


def attachment(sine: Any, limits: tuple[Any, Any, Any, Any]) -> Any:
    """Weight of the attached lift in forward flow between the limits of :meth:`Airfoil.attached_limits`.

    ``sine``: of the angle of attack; ``limits``: upper and its width, lower and its width.
    """
    upper, upper_width, lower, lower_width = limits
    return logistic((upper - sine) / upper_width) * logistic((sine - lower) / lower_width)


def load_section(name: str | Path) -> Airfoil:
    """The section called ``name`` (shipped: naca_0012) or described in the table [section] of a TOML file.

    Raises :class:`InputError` with one line that names file and field.
    """
    shipped = DATA / f"{name}.toml"
    path = shipped if shipped.is_file() else Path(name)
    data = read_toml(path)
    if not isinstance(data.get("section"), dict):
        raise InputError(f"{path.name}: section: missing")
    return validated(Airfoil, data["section"], where=f"{path.name}: section")


def with_largest_lift(section: Airfoil, factor: float) -> Airfoil:
    """The section with its largest lift multiplied by ``factor``: stall of the upper side comes at that part of the
    angle from zero lift, with its drag and its vortex; slope, level of drag and negative stall stay."""
    if not 0.3 <= factor <= 2:
        raise InputError(f"section: factor = {factor}: 0.3 to 2 times the largest lift")

    def moved(sines: Sequence[float]) -> tuple[float, ...]:
        pairs = zip_longest(sines, section.zero_lift_sine, fillvalue=0.0)
        return tuple(factor * sine + (1 - factor) * zero for sine, zero in pairs)

    def scaled(values: Sequence[float]) -> tuple[float, ...]:
        return tuple(factor * value for value in values)

    width = section.log_break_width
    return section.replaced(
        break_sine=moved(section.break_sine),
        log_break_width=(width[0] + log(factor), *width[1:]),
        separated_lift=scaled(section.separated_lift),
        separated_width=scaled(section.separated_width),
        ramp_sine=moved(section.ramp_sine),
        critical_normal_force=scaled(section.critical_normal_force),
    )


def polynomial(coefficients: Sequence[float], x: Any) -> Any:
    """Horner's rule, constant term first.

    ``coefficients`` of the powers of ``x``.
    """
    value: Any = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        value = value * x + coefficient
    return value


def ramp_width(log_excess: Sequence[float], mach: Any) -> Any:
    """Width of a ramp: its smallest value and the exponential of a polynomial.

    ``log_excess``: coefficients of that polynomial of ``mach``.
    """
    return SMALLEST_WIDTH + ca.exp(polynomial(log_excess, mach))


def logistic(x: Any) -> Any:
    """1 / (1 + exp(-x)) without overflow."""
    return 0.5 * (1 + ca.tanh(0.5 * x))


def softplus(x: Any, width: Any) -> Any:
    """Smooth max(x, 0): exact beyond a few widths. Written so that no exponential overflows."""
    return 0.5 * (x + ca.fabs(x)) + width * ca.log1p(ca.exp(-ca.fabs(x) / width))


def smooth_clip(x: Any, lower: float, upper: float, width: float = 0.01) -> Any:
    """x held between two bounds, rounded over about ``width`` at each.

    ``lower`` and ``upper``: the bounds, in the unit of x.
    """
    high = 0.5 * (x + upper - ca.sqrt((x - upper) ** 2 + width**2))
    return 0.5 * (high + lower + ca.sqrt((high - lower) ** 2 + width**2))
