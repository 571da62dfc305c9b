"""What a prediction rests on: variance, distance to the data, their use by an optimiser, and points worth adding."""

import casadi as ca
import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.surrogate.callback import pointwise
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.reliance import Deviation, Distance, weak_points

LOWER, UPPER = np.array([1.0, -2.0, 0.0]), np.array([3.0, 2.0, 5.0])
THETA, NUGGET = np.array([1.5, 0.8, 0.4]), 1e-6


def truth(points):
    x, y, z = points.T
    return np.sin(2.0 * x) + 0.3 * x * y + np.exp(-((y - 0.5) ** 2)) + 0.1 * z * np.cos(y)


def slopes(points):
    x, y, z = points.T
    bell = np.exp(-((y - 0.5) ** 2))
    by_y = 0.3 * x - 2.0 * (y - 0.5) * bell - 0.1 * z * np.sin(y)
    return np.column_stack([2.0 * np.cos(2.0 * x) + 0.3 * y, by_y, 0.1 * np.cos(y)])


def random(size, seed=0, share=1.0):
    """Points in the first ``share`` of the first input's range."""
    points = np.random.default_rng(seed).random((size, 3))
    points[:, 0] *= share
    return LOWER + (UPPER - LOWER) * points


def fitted(size=40, *, correlation="squared_exponential", gradients=False, share=1.0):
    points = random(size, share=share)
    model = Kriging(correlation, lower=LOWER, upper=UPPER, theta=THETA, nugget=NUGGET, gradient_nugget=NUGGET)
    return model.fit(points, truth(points), slopes(points) if gradients else None)


PLAIN = fitted()
KINDS = {
    "plain": PLAIN,
    "matern": fitted(correlation="matern52"),
    "gradients": fitted(15, gradients=True),
}


def differences(function, points, step=1e-5):
    """Central differences of the value (k, d) and the gradient (k, d, d) of ``function``."""
    first, second = [], []
    for width in np.diag(step * (UPPER - LOWER)):
        above, below = function(points + width), function(points - width)
        first.append((above[0] - below[0]) / (2.0 * np.sum(width)))
        second.append((above[1] - below[1]) / (2.0 * np.sum(width)))
    return np.stack(first, axis=-1), np.stack(second, axis=-1)


def test_variance_is_that_of_universal_kriging():
    """Sacks et al. (1989), eq. 8, with nothing shared: matrices written down and inverted."""
    state, points = PLAIN.state_, random(9, seed=1)
    data, asked = ((rows - LOWER) / (UPPER - LOWER) for rows in (state.inputs, points))

    def correlation(one, other):
        return np.exp(-(((one[:, None] - other) ** 2) @ THETA))

    def trend(u):
        one = np.ones(len(u))
        return np.column_stack([one, *u.T, *(u[:, i] * u[:, j] for i in range(3) for j in range(i, 3))])

    inverse = np.linalg.inv(correlation(data, data) + NUGGET * np.eye(len(data)))
    r, F = correlation(asked, data), trend(data)
    spread = np.linalg.inv(F.T @ inverse @ F)
    u = r @ inverse @ F - trend(asked)
    unexplained = 1.0 - np.sum((r @ inverse) * r, axis=1) + np.sum((u @ spread) * u, axis=1)
    expected = state.scale**2 * state.variance * unexplained
    assert PLAIN.standard_deviation(points) == pytest.approx(np.sqrt(expected), rel=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_deviation_has_exact_derivatives(kind):
    points = random(5, seed=2)
    value, gradient, hessian = Deviation(KINDS[kind])(points)
    assert value == pytest.approx(np.sqrt(KINDS[kind].posterior.variance(points)), rel=1e-9)
    first, second = differences(Deviation(KINDS[kind]), points)
    assert gradient == pytest.approx(first, abs=1e-6 * np.abs(first).max())
    assert hessian == pytest.approx(second, abs=1e-6 * np.abs(second).max())


def test_gradients_make_known_more_than_values_alone():
    points = random(50, seed=3)
    alone = fitted(15).posterior
    both = KINDS["gradients"].posterior
    assert np.all(both.variance(points) / both.scale < alone.variance(points) / alone.scale)
    assert np.all(both.variance(both.state.inputs) < 2.0 * NUGGET * both.scale)


def test_smooth_distance_is_never_below_the_nearest_and_close_to_it():
    points, distance = random(300, seed=4), Distance(PLAIN)
    nearest, smooth = distance.nearest(points), distance(points)[0]
    scaled = (points[:, None] - PLAIN.state_.inputs) / (UPPER - LOWER)
    assert nearest == pytest.approx(np.linalg.norm(scaled, axis=-1).min(axis=1), rel=1e-12)
    assert np.all(smooth >= nearest)
    excess = smooth / np.hypot(nearest, 0.01)
    assert np.mean(excess) < 1.02 and np.max(excess) < 1.1
    assert distance(PLAIN.state_.inputs)[0] == pytest.approx(0.01, rel=1e-3)
    assert distance.spacing().shape == (40,)


def test_distance_has_exact_derivatives():
    points, distance = random(6, seed=5), Distance(PLAIN)
    _, gradient, hessian = distance(points)
    first, second = differences(distance, points)
    assert gradient == pytest.approx(first, abs=1e-7 * np.abs(first).max())
    assert hessian == pytest.approx(second, abs=1e-6 * np.abs(second).max())


@pytest.mark.parametrize("measure, largest", [(Deviation, 0.2), (Distance, 0.2)])
def test_an_optimiser_keeps_to_what_is_known(measure, largest):
    """The least mean, at two nodes at once: only half of the box is sampled, and the mean falls on beyond it."""
    model = fitted(60, share=0.5)
    x = ca.MX.sym("x", 3, 2)
    mean = pointwise("mean", lambda points: model.state_.derivatives(points, 2), 3, 2)(x)
    problem = {"x": ca.vec(x), "f": ca.sum2(mean), "g": ca.vec(measure(model).function(2)(x))}
    solver = ca.nlpsol("solver", "ipopt", problem, {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes"})
    box = {"lbx": np.tile(LOWER, 2), "ubx": np.tile(UPPER, 2), "lbg": -np.inf}
    errors = []
    for bound in (largest, np.inf):
        solution = solver(x0=model.state_.inputs[:2].ravel(), ubg=bound, **box)
        assert solver.stats()["success"] and solver.stats()["iter_count"] < 60
        found = np.array(solution["x"]).reshape(2, 3)
        errors.append(np.max(np.abs(model.state_.predict(found) - truth(found))))
        if bound == largest:
            assert np.max(measure(model)(found)[0]) == pytest.approx(largest, rel=1e-4)
    assert errors[0] < 0.3 * errors[1]


def test_weak_points_are_those_of_refits():
    """Each is where a Kriging that knows the ones before it, with the same correlation, is least certain."""
    candidates = random(60, seed=7)
    chosen = weak_points(PLAIN, candidates, 4)
    assert chosen.shape == (4, 3)
    inputs = PLAIN.state_.inputs
    for point in chosen:
        model = Kriging(lower=LOWER, upper=UPPER, theta=THETA, nugget=NUGGET).fit(inputs, truth(inputs))
        assert candidates[np.argmax(model.standard_deviation(candidates))] == pytest.approx(point)
        inputs = np.vstack([inputs, point])


def test_weak_points_do_not_repeat_what_is_known():
    candidate = random(1, seed=8)
    assert len(weak_points(PLAIN, np.repeat(candidate, 5, axis=0), 5)) == 1
    assert len(weak_points(PLAIN, candidate, 5)) == 1


def test_weak_points_of_nothing():
    assert weak_points(PLAIN, np.empty((0, 3)), 5).shape == (0, 3)
    with pytest.raises(InputError, match="weak points: count = 0: at least 1"):
        weak_points(PLAIN, random(3), 0)


def test_weak_points_make_an_optimum_trustworthy():
    """A sparse design, its optimum, points where that was least certain: deviation and true error fall."""
    model = fitted(22)
    grid = LOWER + (UPPER - LOWER) * np.stack(np.meshgrid(*[np.linspace(0, 1, 15)] * 3), axis=-1).reshape(-1, 3)

    def optimum(model):
        best = grid[np.argmin(model.predict(grid))][None]
        return best, model.standard_deviation(best)[0], abs(model.predict(best)[0] - truth(best)[0])

    best, deviation, error = optimum(model)
    near = np.clip(best + 0.15 * (UPPER - LOWER) * random(200, seed=9) / UPPER, LOWER, UPPER)
    inputs = np.vstack([model.state_.inputs, weak_points(model, near, 6)])
    again = Kriging(lower=LOWER, upper=UPPER, theta=THETA, nugget=NUGGET).fit(inputs, truth(inputs))
    _, deviation_after, error_after = optimum(again)
    assert deviation_after < 0.5 * deviation
    assert error_after < 0.5 * error
