"""Loads of blade elements with the static section: directions, power, reversed flow, derivatives."""

import casadi as ca
import numpy as np
import pytest

from vrsopt.aircraft import load_aircraft
from vrsopt.atmosphere import standard_air
from vrsopt.rotor.section_loads import SLOWEST, blade_loads

SECTION = load_aircraft("bo105").main_rotor.section
AIR, CHORD, LEVEL = standard_air(1000.0), 0.27, 0.009
E, N = 3, 8


def function() -> ca.Function:
    """Five loads, one below the other (5 E, N), of the velocities and the pitch (4 E, N)."""
    state = ca.MX.sym("state", 4 * E, N)
    U_T, U_P, U_R, pitch = ca.vertsplit(state, E)
    loads = blade_loads(SECTION, chord=CHORD, velocities=(U_T, U_P, U_R), pitch=pitch, air=AIR, drag_level=LEVEL)
    outputs = (loads.up, loads.along, loads.outward, loads.dissipation, loads.moment)
    assert all(output.shape == (E, N) for output in outputs)
    return ca.Function("loads", [state], [ca.vertcat(*outputs)])


@pytest.fixture(scope="module")
def state() -> np.ndarray:
    """Fast and slow, forward and reversed flow, one element at rest."""
    rng = np.random.default_rng(3)
    U_T = rng.uniform(-40, 220, (E, N))
    U_T[0, 0] = 0.0
    U_P, U_R, pitch = rng.uniform(-15, 5, (E, N)), rng.uniform(-60, 60, (E, N)), rng.uniform(-0.1, 0.3, (E, N))
    U_P[0, 0] = 0.0
    return np.vstack([U_T, U_P, U_R, pitch])


def test_one_element_by_hand():
    U_T, U_P, U_R, pitch = 150.0, -6.0, 20.0, np.radians(7.0)
    loads = function()(np.repeat([[U_T], [U_P], [U_R], [pitch]], E, axis=0) * np.ones((1, N))).full()[::E, 0]
    U = np.sqrt(U_T**2 + U_P**2 + SLOWEST**2)
    alpha = pitch + np.arctan2(U_P, U_T)
    c_l, c_d, c_m = (
        float(c) for c in SECTION.coefficients(np.sin(alpha), np.cos(alpha), U / AIR.speed_of_sound, LEVEL)
    )
    pressure = 0.5 * AIR.density * U**2 * CHORD
    lift, drag = pressure * c_l, pressure * c_d
    # lift is normal to the air's path, drag along it; the air comes from ahead and above
    assert loads[0] == pytest.approx((lift * U_T + drag * U_P) / U, rel=1e-4)
    assert loads[1] == pytest.approx((lift * U_P - drag * U_T) / U, rel=1e-3)
    assert loads[2] == pytest.approx(drag * U_R / U, rel=1e-4)
    assert loads[4] == pytest.approx(pressure * CHORD * c_m, rel=1e-3)


def test_power_of_the_loads_is_what_the_drag_dissipates(state):
    up, along, outward, dissipation, _ = np.vsplit(function()(state).full(), 5)
    U_T, U_P, U_R, _ = np.vsplit(state, 4)
    assert up * U_P - along * U_T + outward * U_R == pytest.approx(dissipation, rel=1e-9, abs=1e-9)
    assert np.all(dissipation >= 0)


def test_reversed_flow_lifts_towards_the_trailing_edge_s_side():
    """With the trailing edge ahead, nose up means that the blade is pushed down."""
    state = np.repeat([[-40.0], [0.0], [0.0], [np.radians(8)]], E, axis=0) * np.ones((1, N))
    up, along = function()(state).full()[[0, E], 0]
    assert up < 0 and along > 0  # the drag takes the blade with the air, along its own motion


def test_derivatives_are_exact_and_finite_at_rest_and_in_reversed_flow(state):
    loads = function()
    x = ca.MX.sym("x", 4 * E, N)
    J = ca.Function("J", [x], [ca.jacobian(ca.vec(loads(x)), ca.vec(x))])(state).full()
    assert np.all(np.isfinite(J))
    direction = np.random.default_rng(4).normal(size=state.shape) * np.repeat([[1.0], [1.0], [1.0], [0.01]], E, axis=0)
    step = 1e-5
    difference = (loads(state + step * direction) - loads(state - step * direction)).full() / (2 * step)
    exact = (J @ direction.ravel("F")).reshape(difference.shape, order="F")
    assert exact == pytest.approx(difference, rel=1e-6, abs=1e-5)
