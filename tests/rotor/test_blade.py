"""Blade modes: published frequencies, integrals of the mass, orthogonality, and the dependence on rotor speed."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import eigh

from vrsopt.aircraft import Blade, load_aircraft
from vrsopt.rotor.blade import Beam

NOMINAL = 44.4  # rad/s
BLADE = load_aircraft("bo105").main_rotor.blade
BEAM = Beam(BLADE)
COUNT = {"flap": 3, "lag": 2, "torsion": 2}
MODES = {family: BEAM.modes(family, rotor_speed=NOMINAL, count=count) for family, count in COUNT.items()}


def uniform_blade(length: float = 5.0, mass: float = 6.0, stiffness: float = 8000.0, inertia: float = 0.03) -> Blade:
    return BLADE.replaced(
        station=(0.0, length),
        mass_per_length=(mass, mass),
        bending_stiffness_flap=(stiffness, stiffness),
        bending_stiffness_lag=(stiffness, stiffness),
        torsional_stiffness=(stiffness, stiffness),
        polar_inertia=(inertia, inertia),
    )


def finite_element_frequencies(family: str, rotor_speed: float, count: int) -> np.ndarray:
    mass, elastic, centrifugal = BEAM.matrices(family)
    root = 1 if family == "torsion" else 2
    stiffness = (elastic + rotor_speed**2 * centrifugal)[root:, root:]
    return np.sqrt(eigh(stiffness, mass[root:, root:], eigvals_only=True, subset_by_index=(0, count - 1)))


def test_second_torsion_frequency():
    """Of the independent finite-element model that has the others on the validation page, per revolution."""
    assert MODES["torsion"].frequencies(NOMINAL)[1] / NOMINAL == pytest.approx(10.43, rel=1.2e-3)


# A uniform cantilever, frequencies times sqrt(m L^4 / EI): at rest Blevins, rotating A. D. Wright, C. E. Smith,
# R. W. Thresher, J. L. C. Wang, Journal of Applied Mechanics 49 (1982).
@pytest.mark.parametrize(
    "speed, published",
    [
        (0.0, (3.5160, 22.0345, 61.6972)),
        (3.0, (4.7973, 23.3203, 62.9850)),
        (6.0, (7.3604, 26.8091, 66.6840)),
        (12.0, (13.1702, 37.6031, 79.6145)),
    ],
)
def test_uniform_rotating_beam(speed, published):
    unit = np.sqrt(8000.0 / (6.0 * 5.0**4))
    beam = Beam(uniform_blade())
    flap = beam.modes("flap", rotor_speed=speed * unit, count=3).frequencies(speed * unit) / unit
    assert flap == pytest.approx(published, rel=1e-4)
    # of one bending stiffness both ways, the square of a lag frequency lies Omega^2 under that of flap
    lag = beam.modes("lag", rotor_speed=speed * unit, count=3).frequencies(speed * unit) / unit
    assert lag**2 == pytest.approx(flap**2 - speed**2, rel=1e-6)


@pytest.mark.parametrize("speed", [0.0, 40.0])
def test_uniform_shaft_in_torsion(speed):
    """(2 n - 1) pi / 2L sqrt(GJ / I), and the propeller moment adds Omega^2 to the square."""
    rod = np.pi / 2 / 5.0 * np.sqrt(8000.0 / 0.03) * np.array([1, 3])
    modes = Beam(uniform_blade()).modes("torsion", rotor_speed=speed, count=2)
    assert modes.frequencies(speed) ** 2 == pytest.approx(rod**2 + speed**2, rel=1e-6)


@pytest.mark.parametrize("family", COUNT)
@pytest.mark.parametrize("ratio", [0.75, 0.85, 1.15])
def test_fixed_basis_follows_the_full_model_away_from_nominal(family, ratio):
    exact = finite_element_frequencies(family, ratio * NOMINAL, COUNT[family])
    found = MODES[family].frequencies(ratio * NOMINAL)
    assert found == pytest.approx(exact, rel=1e-2)
    assert found[:2] == pytest.approx(exact[:2], rel=2e-3)
    assert np.all(found >= exact * (1 - 1e-9))  # Rayleigh-Ritz gives upper bounds


def test_southwell_bounds_the_first_frequency():
    """Southwell: the square exceeds the sum of the two separate least values, and Rayleigh's quotient exceeds it."""
    modes = MODES["flap"]
    at_rest = modes.frequencies(0.0)[0] ** 2
    centrifugal = eigh(modes.centrifugal, modes.mass, eigvals_only=True)[0]
    for ratio in (0.5, 0.75, 1.0, 1.15):
        square = modes.frequencies(ratio * NOMINAL)[0] ** 2
        rayleigh = (modes.elastic[0, 0] + (ratio * NOMINAL) ** 2 * modes.centrifugal[0, 0]) / modes.mass[0, 0]
        assert at_rest + (ratio * NOMINAL) ** 2 * centrifugal <= square * (1 + 1e-12)
        assert square <= rayleigh * (1 + 1e-12)


def test_mass_integrals():
    """Mass, first and second moment outboard of the root, from rigid shapes in the element matrices."""
    mass, elastic, centrifugal = BEAM.matrices("flap")
    heave, rigid = np.zeros(len(mass)), np.zeros(len(mass))
    heave[::2] = 1.0
    rigid[::2], rigid[1::2] = BEAM.nodes, 1.0
    assert [rigid @ mass @ rigid, rigid @ mass @ heave, heave @ mass @ heave] == pytest.approx(
        [226.2, 69.13, 26.73], rel=5e-4
    )
    assert rigid @ mass @ rigid == pytest.approx(BLADE.flap_inertia, rel=1e-12)
    assert rigid @ elastic @ rigid == pytest.approx(0.0, abs=1e-12 * np.trace(elastic))
    # tension times slope squared of a rigid blade: integral of m r (r - root)
    assert rigid @ centrifugal @ rigid == pytest.approx(226.2 - 0.37 * 69.13, rel=5e-4)


def test_integrals_to_the_tip():
    """Tension against adaptive quadrature, at points of several elements and of every segment of the data."""
    assert np.all(np.isin(np.round(BLADE.station, 12), np.round(BEAM.nodes, 12)))
    for k in (0, 7, 26, 33, 90, -2):
        r = BEAM.radius[k]
        exact = quad(
            lambda x: x * np.interp(x, BLADE.station, BLADE.mass_per_length), r, 4.91, points=[max(r, 0.9), max(r, 1.1)]
        )[0]
        assert BEAM.tension[k] == pytest.approx(exact, rel=1e-10)


@pytest.mark.parametrize("family", COUNT)
def test_modes_are_orthogonal_and_normalised(family):
    modes = MODES[family]
    stiffness = modes.elastic + NOMINAL**2 * modes.centrifugal
    for matrix in (modes.mass, stiffness):
        size = np.sqrt(np.outer(np.diag(matrix), np.diag(matrix)))
        assert np.abs(matrix / size - np.eye(modes.count)).max() < 1e-7
    value = modes.at(np.array([0.2, 0.37, 4.91]))
    assert value[2] == pytest.approx(np.ones(modes.count))
    assert np.all(value[:2] == 0) and np.all(modes.at(np.array([0.2]), 1) == 0)


@pytest.mark.parametrize("family", COUNT)
def test_slope_and_curvature_are_derivatives(family):
    modes = MODES[family]
    radius = np.array([0.5, 1.3, 2.71, 4.5])
    for order in (0, 1):
        difference = (modes.at(radius + 1e-5, order) - modes.at(radius - 1e-5, order)) / 2e-5
        assert modes.at(radius, order + 1) == pytest.approx(difference, rel=1e-6, abs=1e-8)
