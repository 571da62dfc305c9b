"""Flap modes: published frequencies, integrals of the mass, orthogonality, and the dependence on rotor speed."""

import numpy as np
import pytest
from scipy.linalg import eigh

from vrsopt.aircraft import Blade, load_aircraft
from vrsopt.rotor.blade import finite_elements, flap_modes

NOMINAL = 44.4  # rad/s
BLADE = load_aircraft("bo105").main_rotor.blade


def uniform_blade(length: float = 5.0, mass: float = 6.0, stiffness: float = 8000.0) -> Blade:
    def number(value: object, unit: str) -> dict[str, object]:
        return {"value": value, "unit": unit, "source": "assumed"}

    return Blade.model_validate(
        {
            "station": number([0.0, length], "m"),
            "mass_per_length": number([mass, mass], "kg/m"),
            "bending_stiffness_flap": number([stiffness, stiffness], "N m2"),
            "structural_damping": number(0.01, "-"),
        }
    )


def finite_element_frequencies(blade: Blade, rotor_speed: float, count: int) -> np.ndarray:
    _, mass, bending, centrifugal = finite_elements(blade, blade.bending_stiffness_flap)
    stiffness = (bending + rotor_speed**2 * centrifugal)[2:, 2:]
    return np.sqrt(eigh(stiffness, mass[2:, 2:], eigvals_only=True, subset_by_index=(0, count - 1)))


# The rotating beam's frequencies from an independent finite-element model, per revolution at nominal speed.
@pytest.mark.parametrize(
    "ratio, published", [(1.0, (1.1155, 2.8121, 4.9908)), (0.85, (0.957, 2.444, 4.453))], ids=["nominal", "85 percent"]
)
def test_blade_frequencies(ratio, published):
    modes = flap_modes(BLADE, rotor_speed=NOMINAL)
    assert modes.frequencies(ratio * NOMINAL) / NOMINAL == pytest.approx(published, rel=1e-2)


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
    modes = flap_modes(uniform_blade(), rotor_speed=speed * unit)
    assert modes.frequencies(speed * unit) / unit == pytest.approx(published, rel=1e-4)


@pytest.mark.parametrize("ratio", [0.75, 0.85, 1.15])
def test_fixed_basis_follows_the_full_model_away_from_nominal(ratio):
    modes = flap_modes(BLADE, rotor_speed=NOMINAL)
    exact = finite_element_frequencies(BLADE, ratio * NOMINAL, 3)
    assert modes.frequencies(ratio * NOMINAL) == pytest.approx(exact, rel=1e-2)
    assert modes.frequencies(ratio * NOMINAL)[:2] == pytest.approx(exact[:2], rel=2e-3)
    assert np.all(modes.frequencies(ratio * NOMINAL) >= exact - 1e-9)  # Rayleigh-Ritz gives upper bounds


def test_southwell_bounds_the_first_frequency():
    """Southwell: the square exceeds the sum of the two separate least values, and Rayleigh's quotient exceeds it."""
    modes = flap_modes(BLADE, rotor_speed=NOMINAL)
    at_rest = modes.frequencies(0.0)[0] ** 2
    centrifugal = eigh(modes.centrifugal, modes.mass, eigvals_only=True)[0]
    for ratio in (0.5, 0.75, 1.0, 1.15):
        square = modes.frequencies(ratio * NOMINAL)[0] ** 2
        rayleigh = (modes.bending[0, 0] + (ratio * NOMINAL) ** 2 * modes.centrifugal[0, 0]) / modes.mass[0, 0]
        assert at_rest + (ratio * NOMINAL) ** 2 * centrifugal <= square * (1 + 1e-12)
        assert square <= rayleigh * (1 + 1e-12)


def test_mass_integrals():
    """Mass, first and second moment outboard of the root, from rigid shapes in the element matrices."""
    nodes, mass, bending, centrifugal = finite_elements(BLADE, BLADE.bending_stiffness_flap)
    heave, rigid = np.zeros(2 * len(nodes)), np.zeros(2 * len(nodes))
    heave[::2] = 1.0
    rigid[::2], rigid[1::2] = nodes, 1.0
    assert [rigid @ mass @ rigid, rigid @ mass @ heave, heave @ mass @ heave] == pytest.approx(
        [226.2, 69.13, 26.73], rel=5e-4
    )
    assert rigid @ bending @ rigid == pytest.approx(0.0, abs=1e-12 * np.trace(bending))
    # tension times slope squared of a rigid blade: integral of m r (r - root)
    assert rigid @ centrifugal @ rigid == pytest.approx(226.2 - 0.37 * 69.13, rel=5e-4)


def test_modes_are_orthogonal_and_normalised():
    modes = flap_modes(BLADE, rotor_speed=NOMINAL)
    stiffness = modes.bending + NOMINAL**2 * modes.centrifugal
    for matrix in (modes.mass, stiffness):
        size = np.sqrt(np.outer(np.diag(matrix), np.diag(matrix)))
        assert np.abs(matrix / size - np.eye(3)).max() < 1e-8
    deflection, slope = modes.at(np.array([0.2, 0.37, 4.91]))
    assert deflection[2] == pytest.approx(np.ones(3))
    assert np.all(deflection[:2] == 0) and np.all(slope[:2] == 0)


def test_slope_is_the_derivative_of_the_deflection():
    modes = flap_modes(BLADE, rotor_speed=NOMINAL)
    radius = np.array([0.5, 1.3, 2.71, 4.5])
    difference = (modes.at(radius + 1e-5)[0] - modes.at(radius - 1e-5)[0]) / 2e-5
    assert modes.at(radius)[1] == pytest.approx(difference, rel=1e-6, abs=1e-8)


def test_load_vectors_of_precone_and_weight():
    """Integrals of m r phi and m phi by an independent fine quadrature."""
    modes = flap_modes(BLADE, rotor_speed=NOMINAL)
    edges = np.array([0.37, 0.9, 1.1, 4.91])
    points, weights = np.polynomial.legendre.leggauss(60)
    first, zeroth = np.zeros(3), np.zeros(3)
    for a, b in zip(edges[:-1], edges[1:], strict=True):
        r, dr = a + (points + 1) / 2 * (b - a), weights / 2 * (b - a)
        m = np.interp(r, BLADE.station, BLADE.mass_per_length)
        first += (m * r * dr) @ modes.at(r)[0]
        zeroth += (m * dr) @ modes.at(r)[0]
    # elements that straddle a kink of the mass distribution cost the third mode 2e-5
    assert modes.precone == pytest.approx(first, rel=5e-5)
    assert modes.weight == pytest.approx(zeroth, rel=5e-5)
