"""The sequence of design points: Latin hypercubes inside one another, Sobol points, a prefix that never changes."""

import numpy as np
import pytest
from scipy.stats import qmc

from vrsopt.errors import InputError
from vrsopt.surrogate.sequence import METHODS, Sequence
from vrsopt.surrogate.space import FLIGHT, LEVEL


def sequence(method="latin_hypercube", *, space=LEVEL, seed=1, block_size=13):
    return Sequence(method, seed, block_size, space.lower, space.upper)


def unit(points, space=LEVEL):
    return (points - np.array(space.lower)) / (np.array(space.upper) - np.array(space.lower))


@pytest.mark.parametrize("space", [LEVEL, FLIGHT])
@pytest.mark.parametrize("block_size", [1, 13, 100])
def test_every_doubled_design_is_a_latin_hypercube_in_the_box(space, block_size):
    design = sequence(space=space, block_size=block_size)
    for doublings in range(6):
        count = block_size * 2**doublings
        cells = np.floor(unit(design.points(count), space) * count).astype(int)
        np.testing.assert_array_equal(np.sort(cells, axis=0), np.tile(np.arange(count)[:, None], len(space.names)))


@pytest.mark.parametrize("method", METHODS)
def test_longer_design_keeps_the_shorter(method):
    longest = sequence(method).points(300)
    for count in (0, 1, 12, 13, 14, 26, 27, 51, 53, 299):
        np.testing.assert_array_equal(sequence(method).points(count), longest[:count])
    assert len(np.unique(longest, axis=0)) == 300


@pytest.mark.parametrize("method", METHODS)
def test_points_depend_on_the_seed(method):
    first, other = sequence(method).points(40), sequence(method, seed=2).points(40)
    assert not np.any(first == other)


def test_first_points_are_those_of_the_designs_on_file():
    """A change of NumPy's or SciPy's generators would make every file there is another design."""
    hypercube, sobol = (Sequence(method, 1, 4, (0.0, 0.0), (1.0, 1.0)).points(6)[[0, 5]] for method in METHODS)
    np.testing.assert_allclose(
        hypercube, [[0.07795786300262136, 0.855831612243144], [0.12735798662383052, 0.6345878536167544]], rtol=1e-14
    )
    np.testing.assert_allclose(
        sobol, [[0.28616916202008724, 0.16263530403375626], [0.9234123202040792, 0.739032962359488]], rtol=1e-14
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("block_size", [32, 128])
def test_fills_the_box_better_than_random_points(method, block_size):
    measures = [
        qmc.discrepancy(unit(sequence(method, seed=seed, block_size=block_size).points(128))) for seed in range(10)
    ]
    random = [qmc.discrepancy(np.random.default_rng(seed).random((128, 5))) for seed in range(10)]
    assert max(measures) < min(random)


def test_sobol_points_are_those_of_scipy():
    theirs = qmc.Sobol(5, rng=np.random.default_rng(3)).random(64)
    ours = sequence("sobol", seed=3).points(50)  # no warning about the number
    np.testing.assert_allclose(ours, qmc.scale(theirs, LEVEL.lower, LEVEL.upper)[:50], rtol=1e-15)


def test_sobol_does_not_depend_on_the_block():
    np.testing.assert_array_equal(sequence("sobol").points(30), sequence("sobol", block_size=7).points(30))


def test_unknown_method_is_refused():
    with pytest.raises(InputError, match="method = 'halton': one of latin_hypercube, sobol"):
        sequence("halton")
