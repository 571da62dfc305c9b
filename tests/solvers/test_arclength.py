"""Pseudo-arclength continuation on curves whose folds and roots are known."""

import numpy as np
import pytest

from vrsopt.solvers.arclength import follow_curve
from vrsopt.solvers.status import Status


def cubic(z: np.ndarray, s: float) -> np.ndarray:
    """An S: z^3 - 3 z = s, folds at z = -1, s = 2 and z = 1, s = -2."""
    return z**3 - 3 * z - s


def cubic_slope(z: np.ndarray, s: float) -> np.ndarray:
    return np.array([[3 * z[0] ** 2 - 3, -1.0]])


def follow_cubic(target: float, start: float = -2.2, **options):
    first = start**3 - 3 * start
    return follow_curve(cubic, cubic_slope, start=np.array([start]), first=first, target=target, **options)


def test_both_folds_of_an_s_are_passed():
    result = follow_cubic(3.0)
    assert result.status is Status.CONVERGED and result.parameter == 3.0
    assert result.root == pytest.approx([2.1038034], abs=1e-7)
    assert result.folds == pytest.approx((2.0, -2.0), abs=0.15)
    assert result.jacobians <= 20
    assert result.parameters[0] == pytest.approx(-4.048) and result.parameters[-1] == 3.0
    # beyond both folds on the way: up to the first, back to the second, and forward again
    turns = np.flatnonzero(np.diff(np.sign(np.diff(result.parameters))))
    assert len(turns) == 2 and np.all(np.abs(result.parameters[turns + 1]) < 2.0 + 1e-9)


@pytest.mark.parametrize("target", [-1.0, 0.0, 1.0, 1.9, 1.999])
def test_the_first_of_several_roots_is_the_one_before_the_fold(target):
    result = follow_cubic(target)
    roots = np.roots([1.0, 0.0, -3.0, -target])
    assert result.status is Status.CONVERGED and result.folds == ()
    assert result.root[0] == pytest.approx(min(roots.real), abs=1e-6)


def test_the_other_way_ends_on_the_other_side():
    back = follow_curve(cubic, cubic_slope, start=np.array([2.2]), first=2.2**3 - 6.6, target=-3.0)
    assert back.status is Status.CONVERGED and back.root == pytest.approx([-2.1038034], abs=1e-7)
    assert back.folds == pytest.approx((-2.0, 2.0), abs=0.15)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_the_unit_of_the_parameter_does_not_matter(scale):
    """The curve is the same in thousands and in thousandths of the parameter."""
    plain = follow_cubic(3.0)
    scaled = follow_curve(
        lambda z, s: cubic(z, s / scale),
        lambda z, s: cubic_slope(z, s) / [1.0, scale],
        start=np.array([-2.2]),
        first=scale * (-(2.2**3) + 6.6),
        target=3.0 * scale,
    )
    assert scaled.root == pytest.approx(plain.root, abs=1e-9)
    assert scaled.jacobians == plain.jacobians


def bratu(count: int):
    """u'' + s exp(u) = 0, u(0) = u(1) = 0, by second differences at ``count`` inner points."""
    step = 1 / (count + 1)
    second = (np.diag(np.ones(count - 1), -1) - 2 * np.eye(count) + np.diag(np.ones(count - 1), 1)) / step**2
    unit = 0.1  # brings the equations to order one
    return (
        lambda u, s: unit * (second @ u + s * np.exp(u)),
        lambda u, s: unit * np.column_stack([second + np.diag(s * np.exp(u)), np.exp(u)]),
    )


def test_fold_of_the_bratu_problem():
    """Its only fold is at 3.513830719; the differences bring it within 1e-3. No root exists beyond."""
    residual, jacobian = bratu(80)
    result = follow_curve(residual, jacobian, start=np.zeros(80), first=0.0, target=4.0, max_jacobians=60)
    assert result.status is not Status.CONVERGED and result.parameter < 3.0
    assert len(result.folds) == 1
    assert result.folds[0] == pytest.approx(3.513830719, abs=1e-3)


def test_lower_branch_of_the_bratu_problem():
    """At s = 1: u = 2 ln(cosh c / cosh(c (1 - 2 x))) with c = sqrt(2 s) / 4 cosh c, the smaller c."""
    residual, jacobian = bratu(80)
    result = follow_curve(residual, jacobian, start=np.zeros(80), first=0.0, target=1.0)
    c = 0.0
    for _ in range(200):
        c = np.sqrt(2.0) / 4 * np.cosh(c)
    x = np.arange(1, 81) / 81
    assert result.status is Status.CONVERGED and result.jacobians <= 8
    assert result.root == pytest.approx(2 * np.log(np.cosh(c) / np.cosh(c * (1 - 2 * x))), abs=1e-4)


def test_a_curve_without_unknowns_that_move():
    result = follow_curve(
        lambda z, s: z - 2.0, lambda z, s: np.array([[1.0, 0.0]]), start=np.array([2.0]), first=0.0, target=1.0
    )
    assert result.status is Status.CONVERGED and result.root == pytest.approx([2.0]) and result.jacobians <= 5


def circle(z: np.ndarray, s: float) -> np.ndarray:
    return z**2 + s**2 - 1


def test_a_curve_that_comes_back_has_no_root_ahead():
    """A circle, from its left end: s never passes 1."""
    result = follow_curve(
        circle, lambda z, s: np.array([[2 * z[0], 2 * s]]), start=np.array([0.8]), first=-0.6, target=1.5
    )
    assert result.status is Status.INFEASIBLE
    assert result.folds == pytest.approx((1.0,), abs=0.01)
    assert result.root[0] < 0  # on the other side


def test_the_curve_ends_where_it_may_not_go():
    met: list[float] = []

    def admissible(z):
        met.append(z[0])
        return bool(z[0] < 0.5)

    result = follow_cubic(3.0, admissible=admissible)
    assert result.status is Status.OUT_OF_BOUNDS and len(result.folds) == 1
    assert met[-2] < 0.5 <= met[-1] == result.root[0]
    assert cubic(np.array(met), result.parameters[1:]) == pytest.approx(0.0, abs=1e-7)


def test_the_effort_is_limited():
    result = follow_cubic(3.0, max_jacobians=6)
    assert result.status is Status.ITERATION_LIMIT and result.jacobians <= 8


def test_undefined_ground_ends_the_curve():
    """sqrt(1 - s) is a root until s = 1, where its slope is infinite and the equations end."""

    def residual(z, s):
        return z - np.sqrt(1 - s) if s <= 1 else np.array([np.nan])

    def jacobian(z, s):
        return np.array([[1.0, 0.5 / np.sqrt(1 - s)]]) if s < 1 else np.full((1, 2), np.nan)

    result = follow_curve(residual, jacobian, start=np.array([1.0]), first=0.0, target=2.0)
    assert result.status in (Status.NO_PROGRESS, Status.ITERATION_LIMIT)
    assert result.parameter < 1.0
    bad = follow_curve(residual, jacobian, start=np.array([0.0]), first=1.0, target=2.0)
    assert bad.status is Status.NOT_FINITE


def test_a_pair_of_unknowns_in_a_rotated_frame():
    """The S of the cubic along a direction of the plane, with a second equation that couples both."""
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])

    def residual(z, s):
        a, b = turn.T @ z
        return turn @ np.array([a**3 - 3 * a - s, b - 0.3 * a**2])

    def jacobian(z, s):
        a, _ = turn.T @ z
        local = np.array([[3 * a**2 - 3, 0.0], [-0.6 * a, 1.0]])
        return np.column_stack([turn @ local @ turn.T, turn @ np.array([-1.0, 0.0])])

    a0 = -2.2
    result = follow_curve(
        residual, jacobian, start=turn @ np.array([a0, 0.3 * a0**2]), first=a0**3 - 3 * a0, target=3.0
    )
    assert result.status is Status.CONVERGED and len(result.folds) == 2
    assert turn.T @ result.root == pytest.approx([2.1038034, 0.3 * 2.1038034**2], abs=1e-6)
