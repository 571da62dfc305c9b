"""Peters-He inflow against momentum theory, Pitt and Peters, and the orthonormality of its shapes."""

import casadi as ca
import numpy as np
import pytest

from vrsopt.rotor.inflow import Inflow, coupling, double_factorial, norm, radial_shape, states

# Quadrature in nu = sqrt(1 - r^2), in which the shapes are polynomials: r dr = nu dnu.
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(60)
NU = (POINTS + 1) / 2
RADIUS = np.sqrt(1 - NU**2)
AREA = WEIGHTS / 2 * NU  # weight of r dr


def axisymmetric_response(pressure: np.ndarray, skew: float, *, highest: int) -> tuple[dict[int, np.ndarray], float]:
    """Induced velocity of harmonics 0 and 1 for V = 1 under an axisymmetric load, and its thrust coefficient."""
    inflow = Inflow.at(RADIUS, highest_harmonic=highest - 1, highest_shape=highest)
    influence = np.array(ca.DM(inflow.influence(ca.DM(skew))[0]))
    tau = [
        float((pressure * AREA) @ inflow.cosine_shapes[:, k]) if m == 0 else 0.0
        for k, (m, _) in enumerate(inflow.cosine)
    ]
    state = influence @ np.array(tau) / 2
    velocity = {
        harmonic: sum(inflow.cosine_shapes[:, k] * state[k] for k, (m, _) in enumerate(inflow.cosine) if m == harmonic)
        for harmonic in (0, 1)
    }
    return velocity, 2 * float(pressure @ AREA)


def test_state_sets():
    cosine, sine = states()
    assert cosine == ((0, 1), (0, 3), (1, 2), (1, 4), (2, 3), (3, 4))
    assert sine == ((1, 2), (1, 4), (2, 3), (3, 4))
    assert [len(group) for group in states(4, 5)] == [9, 6]


def test_double_factorial():
    assert [double_factorial(n) for n in (-1, 0, 1, 2, 5, 6)] == [1, 1, 1, 2, 15, 48]
    assert double_factorial(-3) == -1  # (-1)!! = -1 * (-3)!!


def test_known_norms_and_shapes():
    assert [norm(0, 1), norm(0, 3), norm(1, 2)] == pytest.approx([1.0, 4 / 9, 3 / 8 * 4 / 3 * 4 / 3])
    r = np.array([0.0, 0.5, 1.0])
    assert radial_shape(0, 1, r) == pytest.approx(np.sqrt(3) * np.ones(3))
    # P_3^0(nu) / nu = (5 nu^2 - 3) / 2 with the norm sqrt(7), turned so that it is positive at the centre
    assert radial_shape(0, 3, r) == pytest.approx(np.sqrt(7) * (2 - 5 * r**2) / 2)


def test_shapes_are_orthonormal():
    """Within one harmonic, the integral of phi_j phi_n nu r dr is one or zero."""
    for m in range(4):
        shapes = np.column_stack([radial_shape(m, n, RADIUS) for n in range(m + 1, 9, 2)])
        assert shapes.T @ ((AREA * NU)[:, None] * shapes) == pytest.approx(np.eye(shapes.shape[1]), abs=1e-10)


def test_influence_without_skew_couples_only_equal_harmonics_and_is_symmetric():
    inflow = Inflow.at(RADIUS)
    for matrix, group in zip(inflow.influence(ca.DM(0.0)), (inflow.cosine, inflow.sine), strict=True):
        L = np.array(ca.DM(matrix))
        assert L == pytest.approx(L.T)
        assert np.all(np.linalg.eigvalsh(L) > 0)
        apart = [[a[0] != b[0] for b in group] for a in group]
        assert np.all(L[np.array(apart)] == 0)


def test_coupling_is_symmetric_in_even_and_antisymmetric_in_odd_harmonics():
    assert coupling(0, 3, 0, 1) == pytest.approx(coupling(0, 1, 0, 3))
    assert coupling(2, 3, 0, 1) == pytest.approx(coupling(0, 1, 2, 3))
    assert coupling(1, 2, 0, 1) == pytest.approx(-coupling(0, 1, 1, 2))
    assert coupling(1, 4, 0, 1) == 0


def test_pitt_peters_gradient():
    """Pressure r^2 sqrt(1 - r^2): the longitudinal gradient is (15 pi / 32) X of momentum inflow at any truncation,
    more inflow at the back (cos psi, psi = 0 at the back).

    D. M. Pitt, D. A. Peters, Vertica 5 (1981).
    """
    for highest in (4, 6, 8):
        for skew in (0.3, 1.0):
            velocity, C_T = axisymmetric_response(NU * RADIUS**2, skew, highest=highest)
            gradient = 4 * float((velocity[1] * RADIUS) @ AREA)
            assert gradient / (C_T / 2) == pytest.approx(15 * np.pi / 32 * skew, rel=1e-9)


def test_uniform_load_tends_to_momentum_theory():
    """V lambda = C_T / 2: the error of the disc mean falls at least as fast as the number of shapes rises."""
    error = []
    for highest in (2, 4, 8, 16):
        velocity, C_T = axisymmetric_response(np.ones_like(NU), 0.0, highest=highest)
        error.append(2 * float(velocity[0] @ AREA) / (C_T / 2) - 1)
    assert error[0] == pytest.approx(1 / 8)  # one state: L = 3/4, lambda_m = 9/8 of momentum theory
    assert np.all(np.diff(error) < 0) and error[1] < 0.055 and error[3] < 0.01


def hover_mass_flow(mean: float) -> tuple[np.ndarray, float]:
    cosine, _, skew = Inflow.at(RADIUS).mass_flow(ca.DM(0.0), ca.DM(mean), ca.DM(mean))
    return np.array(cosine).ravel(), float(skew)


def test_mass_flow_limits():
    """Hover: lambda for the uniform state, 2 lambda for the others. Fast flight: mu for all, and a flat wake."""
    flow, skew = hover_mass_flow(0.05)
    assert flow == pytest.approx([0.05, *[0.1] * 5], rel=1e-5) and skew == pytest.approx(0.0, abs=1e-12)
    cosine, sine, skew = Inflow.at(RADIUS).mass_flow(ca.DM(0.3), ca.DM(0.004), ca.DM(0.002))
    assert np.array(cosine).ravel() == pytest.approx(0.3 * np.ones(6), rel=1e-3)
    assert np.array(sine).ravel() == pytest.approx(0.3 * np.ones(4), rel=1e-3)
    chi = np.arctan2(0.3, 0.004)
    assert float(skew) == pytest.approx(np.tan(chi / 2), rel=1e-3)


def test_mass_flow_is_smooth_through_hover():
    mu = ca.SX.sym("mu")
    skew = Inflow.at(RADIUS).mass_flow(mu, 0.05, 0.05)[2]
    slope = ca.Function("slope", [mu], [ca.gradient(skew, mu), ca.hessian(skew, mu)[0]])
    assert [float(v) for v in slope(0.0)] == pytest.approx([1 / 0.1, 0.0], rel=1e-4, abs=1e-6)
