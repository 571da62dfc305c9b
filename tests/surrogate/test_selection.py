"""The correlation of least leave-one-out error is taken."""

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.surrogate.correlation import CORRELATIONS
from vrsopt.surrogate.selection import select


def smooth(inputs):
    return np.sin(4.0 * inputs[:, 0]) * np.cos(3.0 * inputs[:, 1])


def rough(inputs):
    """Kinks of all sizes."""
    return sum(0.6**k * np.abs(np.mod(2.0**k * inputs, 1.0) - 0.5).sum(axis=1) for k in range(8))


@pytest.mark.parametrize(("function", "expected"), [(smooth, "squared_exponential"), (rough, "exponential")])
def test_picks_the_one_that_predicts_best(function, expected):
    inputs = np.random.default_rng(1).random((60, 2))
    found = select(inputs, function(inputs), trend="constant", lower=[0.0, 0.0], upper=[1.0, 1.0])
    assert tuple(found.candidates) == CORRELATIONS
    assert found.correlation == found.model.correlation == expected
    other = np.random.default_rng(2).random((200, 2))
    errors = {name: np.std(one.model.predict(other) - function(other)) for name, one in found.candidates.items()}
    assert min(errors, key=errors.__getitem__) == expected
    computed, predicted = found.model.leave_one_out()
    assert found.candidates[expected].rms_error == np.sqrt(np.mean((predicted - computed) ** 2))
    assert str(found).splitlines()[0].split() == ["correlation", "RMS", "error"]
    assert len(str(found).splitlines()) == 4


def test_with_gradients_only_the_differentiable_ones():
    inputs = np.random.default_rng(3).random((15, 2))
    a, b = 4.0 * inputs[:, 0], 3.0 * inputs[:, 1]
    slopes = np.stack([4.0 * np.cos(a) * np.cos(b), -3.0 * np.sin(a) * np.sin(b)], axis=1)
    found = select(inputs, smooth(inputs), slopes)
    assert tuple(found.candidates) == ("squared_exponential", "matern52")
    assert found.model.state_.enhanced


def test_needs_a_candidate():
    with pytest.raises(InputError, match="one or more correlations"):
        select(np.zeros((3, 1)), np.zeros(3), candidates=())
