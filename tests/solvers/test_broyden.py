"""Broyden's method along a family of systems, with the inverse Jacobian handed on."""

import numpy as np
import pytest

from vrsopt.solvers.broyden import broyden


def system(parameter):
    """Root near (1, 2) that moves with ``parameter``; its Jacobian there is far from diagonal."""

    def residual(x):
        return np.array([x[0] ** 2 + x[1] - 3.0 - parameter, np.exp(x[0] - 1.0) - 0.5 * x[1] + 0.3 * parameter])

    return residual


JACOBIAN = np.array([[2.0, 1.0], [1.0, -0.5]])


def test_a_chain_of_systems_needs_one_jacobian():
    """Each from the last root, to the tolerance; the updates keep the inverse as good as a fresh Jacobian."""
    x, inverse, evaluations = np.array([1.0, 2.0]), np.linalg.inv(JACOBIAN), []
    for parameter in np.linspace(0.0, 2.0, 41):
        found = broyden(system(parameter), start=x, inverse=inverse, tolerance=1e-10)
        assert found.success and np.max(np.abs(system(parameter)(found.root))) < 1e-10
        x, inverse = found.root, found.inverse
        evaluations.append(found.evaluations)
    exact = np.linalg.inv([[2 * x[0], 1.0], [np.exp(x[0] - 1.0), -0.5]])
    assert inverse == pytest.approx(exact, rel=0.05)
    assert np.mean(evaluations) < 5.5
    fixed = broyden(system(0.0), start=np.array([1.0, 2.0]), inverse=inverse, tolerance=1e-10)
    assert fixed.success and fixed.evaluations == 1 and fixed.inverse is inverse


def test_it_gives_up_at_once_and_leaves_the_inverse_as_it_was():
    """A step that does not contract, one that is too long, and one that ends in no number."""
    wrong = -np.linalg.inv(JACOBIAN)
    found = broyden(system(0.5), start=np.array([1.0, 2.0]), inverse=wrong, tolerance=1e-10)
    assert not found.success and found.inverse is wrong and found.evaluations == 2
    good = np.linalg.inv(JACOBIAN)
    far = broyden(system(3.0), start=np.array([1.0, 2.0]), inverse=good, tolerance=1e-10, reach=0.1)
    assert not far.success and far.evaluations == 1
    none = broyden(lambda x: np.where(x > 1.5, np.nan, x - 2.0), start=np.ones(2), inverse=np.eye(2), tolerance=1e-10)
    assert not none.success and np.all(np.isfinite(none.root))
