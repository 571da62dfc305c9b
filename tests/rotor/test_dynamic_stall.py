"""Dynamic stall: exact solutions of the attached part, static limit, derivatives, one measured loop."""

from math import pi

import casadi as ca
import numpy as np
import pytest

from vrsopt.aircraft import load_aircraft
from vrsopt.atmosphere import standard_air
from vrsopt.errors import InputError
from vrsopt.rotor.airfoil import load_section, polynomial, smooth_clip
from vrsopt.rotor.dynamic_stall import IMPULSIVE, INDICIAL, unsteady_blade_loads
from vrsopt.rotor.oscillating_section import harmonic_pitch, section_loop
from vrsopt.rotor.section_loads import SLOWEST, SectionLoads, blade_loads

ROTOR = load_aircraft("bo105").main_rotor
NACA_0012 = load_section("naca_0012")
AIR, CHORD, LEVEL, OMEGA = standard_air(0.0), 0.27, 0.009, 44.4
E, N = 4, 24
MACH = 0.3


def stacked(loads: SectionLoads) -> ca.MX:
    return ca.vertcat(loads.up, loads.along, loads.outward, loads.dissipation, loads.moment)


def unsteady(section=ROTOR.section, *, count: int = N, **options) -> ca.Function:
    """Loads (5 E, N) of velocities, pitch and pitch rate (5 E, N)."""
    state = ca.MX.sym("state", 5 * E, count)
    U_T, U_P, U_R, pitch, rate = ca.vertsplit(state, E)
    loads = unsteady_blade_loads(
        section,
        chord=CHORD,
        velocities=(U_T, U_P, U_R),
        pitch=pitch,
        pitch_rate=rate,
        rotor_speed=OMEGA,
        air=AIR,
        drag_level=LEVEL,
        **options,
    )
    return ca.Function("unsteady", [state], [stacked(loads)])


def static(state: np.ndarray) -> np.ndarray:
    U_T, U_P, U_R, pitch, _ = (ca.MX(ca.DM(part)) for part in np.vsplit(state, 5))
    loads = blade_loads(ROTOR.section, chord=CHORD, velocities=(U_T, U_P, U_R), pitch=pitch, air=AIR, drag_level=LEVEL)
    return ca.evalf(stacked(loads)).full()


def flight(speed: float, count: int = N) -> np.ndarray:
    """A rotor in edgewise flow, with reversed flow at the root and stall on the retreating side."""
    psi = 2 * pi * np.arange(count) / count
    radius = ROTOR.radius * np.linspace(0.25, 1, E)[:, None]
    pitch = np.radians(14 - 8 * (radius / ROTOR.radius - 0.75) - 7 * np.sin(psi))
    U_T = OMEGA * radius + speed * np.sin(psi)
    return np.vstack(
        [
            U_T,
            -7 - 0.03 * speed * np.cos(psi) + 0 * radius,
            speed * np.cos(psi) + 0 * radius,
            pitch,
            OMEGA * np.radians(-7 * np.cos(psi)) + 0 * radius,
        ]
    )


def test_static_section_where_nothing_varies():
    """Attached, stalled, at rest and reversed: whatever the state, as long as it is the same at all azimuths."""
    for U_T in (-40.0, 0.0, 30.0, 120.0, 230.0):
        for pitch in (-0.3, -0.05, 0.02, 0.15, 0.3, 0.6):
            state = np.repeat([[U_T], [-4.0], [10.0], [pitch], [0.0]], E, axis=0) * np.ones((1, N))
            expected = static(state)
            assert unsteady()(state).full() == pytest.approx(expected, rel=1e-9, abs=1e-7), (U_T, pitch)


def exact_response(k: float) -> complex:
    """Lift per radian of pitch about the quarter chord over the static slope, from the indicial functions.

    Circulatory: the angle at three quarters of the chord, 1 + i k, through the lags b beta^2 / (b beta^2 + i k).
    Impulsive: apparent mass on the acceleration of the middle of the chord.
    """
    m, slope = fitted_mach_and_slope()
    beta_squared = 1 - MACH**2
    circulatory = sum(A * b * beta_squared / (b * beta_squared + 1j * k) for A, b in INDICIAL) * (1 + 1j * k)
    K = IMPULSIVE / (1 - m + pi * m**2 * np.sqrt(beta_squared) * sum(A * b for A, b in INDICIAL))
    return circulatory + 4 * K * (2j * k - k**2) / slope


def fitted_mach_and_slope() -> tuple[float, float]:
    m = float(smooth_clip(MACH, 0.2, 0.82))
    return m, polynomial(NACA_0012.lift_slope, m)


@pytest.mark.parametrize("k", [0.02, 0.1, 0.3])
def test_harmonic_response_of_attached_flow(k):
    amplitude = np.radians(0.05)
    loop = section_loop(NACA_0012, harmonic_pitch(0.0, amplitude, 720), mach=MACH, reduced_frequency=k)
    wave = 2j * np.mean(loop.c_l * np.exp(-1j * loop.phase)) / amplitude
    steady = [section_loop(NACA_0012, np.full(8, a), mach=MACH, reduced_frequency=k).c_l[0] for a in (1e-3, -1e-3)]
    response = wave / ((steady[0] - steady[1]) / 2e-3)
    assert abs(response - exact_response(k)) < 2e-3 * abs(exact_response(k))


def test_quasi_steady_lift_lags_and_leads_with_frequency():
    """The shed wake lags the lift at low frequency, the apparent mass leads it at high frequency."""
    assert np.angle(exact_response(0.1)) < 0 < np.angle(exact_response(1.0))
    assert abs(exact_response(0.1)) < 1


def test_steady_pitch_rate_of_a_thin_section():
    """Quarter-chord moment -pi/8 q c / (beta U), angle of attack at three quarters of the chord, no drag by tilt."""
    U, rate = 100.0, 2.0
    state = np.repeat([[U], [0.0], [0.0], [0.02], [0.0]], E, axis=0) * np.ones((1, N))
    turning, turned = state.copy(), state.copy()
    turning[4 * E :] = rate
    turned[3 * E : 4 * E] = 0.02 + rate * CHORD / (2 * U)
    still, pitching, inclined = (unsteady()(s).full()[::E, 0] for s in (state, turning, turned))
    beta = np.sqrt(1 - (U / AIR.speed_of_sound) ** 2)
    moment = -pi / 8 * rate * CHORD / U / beta * 0.5 * AIR.density * U**2 * CHORD**2
    assert pitching[0] - still[0] == pytest.approx(inclined[0] - still[0], rel=1e-3)
    assert pitching[4] - still[4] == pytest.approx(moment, rel=2e-3)
    assert pitching[3] == pytest.approx(inclined[3], rel=5e-3)


@pytest.mark.parametrize("chord_recovery", [None, 0.95])
def test_derivatives_are_exact_and_finite_with_reversed_flow(chord_recovery):
    loads, state = unsteady(chord_recovery=chord_recovery), flight(70.0)
    state[0, 0], state[E, 0] = 0.0, 0.0  # one element at rest
    assert state[0].min() < -10
    x = ca.MX.sym("x", 5 * E, N)
    J = ca.Function("J", [x], [ca.jacobian(ca.vec(loads(x)), ca.vec(x))])(state).full()
    assert np.all(np.isfinite(J))
    scale = np.repeat([[1.0], [1.0], [1.0], [0.01], [0.5]], E, axis=0)
    direction = np.random.default_rng(4).normal(size=state.shape) * scale
    step = 1e-5
    difference = (loads(state + step * direction) - loads(state - step * direction)).full() / (2 * step)
    exact = (J @ direction.ravel("F")).reshape(difference.shape, order="F")
    assert exact == pytest.approx(difference, rel=1e-5, abs=1e-5 * np.abs(difference).max())


def test_no_dynamic_stall_in_reversed_flow():
    """Slow pitching with the trailing edge ahead: the static section at every instant."""
    psi = 2 * pi * np.arange(N) / N
    pitch = np.radians(10 + 5 * np.sin(psi))
    state = np.vstack([np.full((E, N), -230.0), np.zeros((2 * E, N)), np.tile(pitch, (E, 1)), np.zeros((E, N))])
    gentle, expected = unsteady()(state).full(), static(state)
    for k in range(5):
        block = slice(k * E, (k + 1) * E)
        assert np.abs(gentle[block] - expected[block]).max() <= 0.05 * np.abs(expected[block]).max()


def test_second_order_in_the_number_of_azimuths():
    def loads(count: int) -> np.ndarray:
        pitch = harmonic_pitch(np.radians(10), np.radians(8), count)
        return section_loop(NACA_0012, pitch, mach=MACH, reduced_frequency=0.05).c_l[:: count // 24]

    exact = loads(1536)
    errors = [np.sqrt(np.mean((loads(count) - exact) ** 2)) for count in (48, 96, 192, 384)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders[1:] > 1.6) and errors[0] < 0.05, errors


def test_moment_of_deep_stall_at_the_azimuths_of_the_trim():
    """The vortex runs its course at 36 instants of a revolution as it does at many."""

    def least(count: int) -> float:
        pitch = harmonic_pitch(np.radians(9.8), np.radians(9.9), count)
        return float(section_loop(NACA_0012, pitch, mach=MACH, reduced_frequency=0.096).c_m.min())

    assert least(36) == pytest.approx(least(720), rel=0.08)


def test_scaling_of_time():
    """Only reduced frequency and Mach number count: the chord of the driver does not appear."""
    pitch = harmonic_pitch(np.radians(10), np.radians(10), 60)
    fast = section_loop(NACA_0012, pitch, mach=0.4, reduced_frequency=0.1)
    omega = 2 * 0.1 * 0.4 * AIR.speed_of_sound / CHORD
    U_T = np.sqrt((0.4 * AIR.speed_of_sound) ** 2 - SLOWEST**2)
    loads = unsteady_blade_loads(
        NACA_0012,
        chord=CHORD,
        velocities=(ca.MX.ones(1, 60) * U_T, ca.MX.zeros(1, 60), ca.MX.zeros(1, 60)),
        pitch=ca.MX(ca.DM(pitch).T),
        pitch_rate=ca.MX(ca.DM(omega * np.radians(10) * np.cos(fast.phase)).T),
        rotor_speed=omega,
        air=AIR,
        drag_level=NACA_0012.drag_reference,
    )
    lift = ca.evalf(loads.up).full().ravel() / (0.5 * AIR.density * 0.4 * AIR.speed_of_sound * U_T * CHORD)
    assert lift == pytest.approx(fast.c_l, abs=1e-9)


def test_recovery_factor_of_the_chord_force():
    """Attached and steady: drag is the level and the part of the suction that is not recovered."""
    alpha = np.radians(6)
    for eta in (1.0, 0.95):
        loop = section_loop(
            NACA_0012, np.full(16, alpha), mach=MACH, reduced_frequency=0.1, drag_level=0.008, chord_recovery=eta
        )
        level = float(NACA_0012.drag(0.0, MACH, 0.008))
        lost = loop.c_n[0] * alpha * (1 - eta)
        assert loop.c_d[0] == pytest.approx(level + lost, abs=6e-4)


def test_stall_is_delayed_overshoots_and_pitches_down():
    """NASA TM 84245, frame 9302: 9.8 + 9.9 sin, k = 0.096, Mach 0.302; cl 1.844 at 18.1 deg, cm -0.239."""
    pitch = harmonic_pitch(np.radians(9.8), np.radians(9.9))
    loop = section_loop(NACA_0012, pitch, mach=0.302, reduced_frequency=0.096)
    assert loop.c_l.max() == pytest.approx(1.844, abs=0.15)
    assert loop.c_m.min() == pytest.approx(-0.239, abs=0.08)
    assert np.degrees(pitch[loop.c_l.argmax()]) == pytest.approx(18.1, abs=1.5)
    assert loop.c_d.max() == pytest.approx(0.534, abs=0.1)
    slow = section_loop(NACA_0012, pitch, mach=0.302, reduced_frequency=1e-4)
    assert slow.c_l.max() < loop.c_l.max() - 0.3
    assert loop.c_n == pytest.approx(loop.c_l * np.cos(pitch) + loop.c_d * np.sin(pitch))
    assert loop.c_c == pytest.approx(loop.c_l * np.sin(pitch) - loop.c_d * np.cos(pitch))


@pytest.mark.parametrize(
    "pitch, options, message",
    [
        (np.zeros(4), {}, r"pitch of shape \(4,\)"),
        (np.full(16, np.nan), {}, "at least 8 finite angles"),
        (np.zeros(16), {"mach": 1.2}, "mach = 1.2"),
        (np.zeros(16), {"reduced_frequency": 0.0}, "reduced_frequency = 0.0"),
    ],
)
def test_schedules_that_make_no_sense(pitch, options, message):
    with pytest.raises(InputError, match=message):
        section_loop(NACA_0012, pitch, **{"mach": 0.3, "reduced_frequency": 0.1, **options})
