"""Leishman-Beddoes dynamic stall with every state eliminated by exact periodic filters.

All states are first-order linear lags once their input is known, so that around one revolution each of them is one
periodic scan over the azimuths; nothing is marched in time. In flow that does not vary around the azimuth the loads are
those of the static section.

J. G. Leishman and T. S. Beddoes, A semi-empirical model for dynamic stall, J. American Helicopter Society 34 (1989);
M. H. Hansen, M. Gaunaa and H. Aa. Madsen, A Beddoes-Leishman type dynamic stall model, Riso-R-1354 (2004);
B. G. van der Wall and J. G. Leishman, J. American Helicopter Society 39 (1994), for the varying stream.
"""

from __future__ import annotations

from math import pi
from typing import Any

import casadi as ca

from vrsopt.atmosphere import Air
from vrsopt.rotor.airfoil import HIGHEST_LIFT_MACH, LOWEST_MACH, Airfoil, logistic, polynomial, smooth_clip
from vrsopt.rotor.section_loads import SectionLoads, flow_angles, resolved

INDICIAL = ((0.3, 0.14), (0.7, 0.53))  # amplitudes and exponents of the circulatory step response
GATE_WIDTH = 0.05  # of the normal force at which the vortex leaves
CLOCK_WIDTH = 0.5  # semi-chords over which the vortex stops being fed
REWIND, LEAK = 2.0, 60.0  # semi-chords: the clock of the vortex runs back attached, and never beyond the leak
VORTEX_TRAVEL = 0.2  # of the chord: half of the way the centre of the vortex lift moves aft


def unsteady_blade_loads(
    section: Airfoil,
    *,
    chord: float,
    velocities: tuple[Any, Any, Any],
    pitch: Any,
    pitch_rate: Any,
    rotor_speed: Any,
    air: Air,
    drag_level: Any,
    chord_recovery: float | None = None,
) -> SectionLoads:
    """Loads on an (E, N) grid of elements with dynamic stall; the N columns are uniform azimuths of one revolution.

    velocities: of the air relative to the quarter chord [m/s], (E, N) each: against its motion U_T, upward U_P,
    outward U_R. pitch [rad] and pitch_rate [rad/s], the section's nose-up rotation about the span: (E, N).
    chord_recovery: chord force of attached flow by that recovery factor instead of the section's drag.
    """
    E, N = pitch.shape
    kernel = _kernel(section, chord, N, chord_recovery).map(E)
    rows = ca.reshape(ca.vertcat(*(value.T for value in (*velocities, pitch, pitch_rate))), 5 * N, E)
    common = ca.repmat(ca.vertcat(air.speed_of_sound, air.density, drag_level, rotor_speed), 1, E)
    loads = kernel(rows, common)
    return SectionLoads(*(loads[k * N : (k + 1) * N, :].T for k in range(5)))


def _kernel(section: Airfoil, chord: float, count: int, chord_recovery: float | None) -> ca.Function:
    """One station: velocities, pitch and pitch rate (5 N,), (speed of sound, density, drag level, rotor speed) -> 5 N
    loads."""
    state, common = ca.SX.sym("state", 5 * count), ca.SX.sym("common", 4)
    U_T, U_P, U_R, pitch, pitch_rate = ca.vertsplit(state, count)
    speed_of_sound, density, drag_level, rotor_speed = ca.vertsplit(common)
    U, sine, cosine = flow_angles(U_T, U_P, pitch)
    coefficients = unsteady_coefficients(
        section,
        speed=U,
        angle=(sine, cosine),
        pitch_rate=pitch_rate,
        chord=chord,
        mach=U / speed_of_sound,
        drag_level=drag_level,
        period=2 * pi / rotor_speed,
        chord_recovery=chord_recovery,
    )
    loads = resolved((U_T, U_P, U_R), U, coefficients, density=density, chord=chord)
    return ca.Function("station", [state, common], [ca.vertcat(*loads)])


def unsteady_coefficients(
    section: Airfoil,
    *,
    speed: Any,
    angle: tuple[Any, Any],
    pitch_rate: Any,
    chord: float,
    mach: Any,
    drag_level: Any,
    period: Any,
    chord_recovery: float | None = None,
) -> tuple[Any, Any, Any]:
    """Coefficients of lift, drag and moment (N,) at N uniform times of one period."""
    sine, cosine = angle
    step = period / sine.shape[0]
    m = smooth_clip(mach, LOWEST_MACH, HIGHEST_LIFT_MACH)
    slope, s0 = section.attached_lift(m)
    forward = section.forward(cosine)
    beta_squared = smooth_clip(1 - mach**2, 0.2, 2.0)
    semichords = 2 * speed / chord * step  # travelled in one step

    # attached flow: lag of the velocity normal to the zero-lift line, three quarters of the chord aft
    from_zero = sine * ca.sqrt(1 - s0**2) - cosine * s0
    normal = speed * from_zero + 0.5 * chord * pitch_rate
    effective: Any = 0
    for amplitude, exponent in INDICIAL:
        effective += amplitude * lag(exponent * beta_squared * semichords, normal)
    effective_sine = effective / ca.sqrt(speed**2 * (1 - from_zero**2) + effective**2)
    attached = slope * effective_sine

    # impulsive normal force: apparent mass on the acceleration of the middle of the chord
    middle = speed * sine + 0.25 * chord * pitch_rate
    acceleration = (ahead(middle) - behind(middle)) / (2 * step)
    stiffness = 1 / (1 - m + pi * m**2 * ca.sqrt(beta_squared) * sum(A * b for A, b in INDICIAL))
    impulsive = 3 * stiffness * chord * acceleration / speed**2

    # separation: lagged pressure, then lagged boundary layer
    lagged = lag(semichords / polynomial(section.pressure_lag, m), effective_sine + impulsive / slope)
    shifted = sine + lagged - from_zero
    rate = semichords / polynomial(section.separation_lag, m)
    weight = lag(rate, section.attachment(shifted, m)) * forward
    separated = section.separated(sine, cosine, m)
    lift = weight * attached + (1 - weight) * separated

    # vortex: fed by the lift that separation takes, from the critical normal force until it has passed the chord
    size = ca.sqrt((slope * lagged) ** 2 + 1e-4)
    shedding = forward * logistic((size - polynomial(section.critical_normal_force, m)) / GATE_WIDTH)
    clock_rate = (1 - shedding) / REWIND + 1 / LEAK
    clock = lag(semichords * clock_rate, shedding / clock_rate)
    passage = polynomial(section.vortex_passage, m)
    feed = shedding * logistic((passage - clock) / CLOCK_WIDTH)
    vortex = fed(
        semichords / polynomial(section.vortex_decay, m), (1 - weight) * forward * (attached - separated), feed
    )
    travel = smooth_clip(clock / passage, 0.0, 1.0, 0.1)

    drag_sine = lag(rate, shifted)
    drag = section.drag(drag_sine, mach, drag_level)
    drag += (1 - weight) * lift * (sine - drag_sine) + weight * attached * (normal - effective) / speed
    moment = section.moment(sine, cosine, m, weight, forward)
    moment -= forward * (pi / 8) / ca.sqrt(beta_squared) * pitch_rate * chord / speed + 0.25 * impulsive
    moment -= VORTEX_TRAVEL * (1 - ca.cos(pi * travel)) * vortex

    normal_force = vortex + impulsive
    return lift + normal_force * cosine, drag + normal_force * sine, moment


def lag(rates: Any, values: Any) -> Any:
    """Periodic solution (N,) of x' = rate (u - x) for u linear between the N times; ``rates`` per time step.

    Exact for a rate that is constant over each step: x+ = e x + u (w - e) + u+ (1 - w), e = exp(-z), w = (1 - e)/z.
    """
    z = 0.5 * (rates + ahead(rates))
    e = ca.exp(-z)
    w = (1 - e) / z
    return _periodic(e, values * (w - e) + ahead(values) * (1 - w))


def fed(rates: Any, values: Any, feed: Any) -> Any:
    """Periodic solution (N,) of x' = feed u' - rate x, ``rates`` per time step."""
    z = 0.5 * (rates + ahead(rates))
    e = ca.exp(-z)
    return _periodic(e, 0.5 * (feed + ahead(feed)) * (ahead(values) - values) * (1 - e) / z)


def _periodic(factors: Any, sources: Any) -> Any:
    """The x (N,) with x[k+1] = factors[k] x[k] + sources[k] around the circle."""
    count = factors.shape[0]
    end: Any = 0
    product: Any = 1
    for k in range(count):
        end = factors[k] * end + sources[k]
        product = product * factors[k]
    x = [end / (1 - product)]
    for k in range(count - 1):
        x.append(factors[k] * x[k] + sources[k])
    return ca.vertcat(*x)


def ahead(values: Any) -> Any:
    """The values one step later, around the circle."""
    return ca.vertcat(values[1:], values[0])


def behind(values: Any) -> Any:
    """The values one step earlier, around the circle."""
    return ca.vertcat(values[-1], values[:-1])
