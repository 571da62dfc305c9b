"""The lattice of vortices: on a wing, on slender blades, and on the rotor of Caradonna and Tung."""

import sys
from math import pi, radians
from pathlib import Path

import numpy as np
import pytest

PROBLEMS = Path(__file__).parents[2] / "problems"
sys.path.insert(0, str(PROBLEMS))
try:
    from validation_isolated import slender_thrust
    from vortex_lattice import CHORD, Lattice, points, upwash
finally:
    sys.path.remove(str(PROBLEMS))


def test_wing_of_aspect_ratio_six():
    """The same row of horseshoes on a rectangular wing: between the lifting line and Helmbold's formula."""
    y = -3 * np.cos(np.linspace(0, pi, 41))
    edge, control = points(y, 0, 0), points((y[1:] + y[:-1]) / 2, -0.5, 0)
    trail = upwash(control, edge, edge - [0, 1e4, 0])
    influence = trail[:, 1:] - trail[:, :-1] + upwash(control, edge[:-1], edge[1:]) + np.eye(40) / pi
    strength = np.linalg.solve(np.eye(40) - pi * influence, np.full(40, pi))
    slope = 2 * strength @ np.diff(y) / 6
    assert slope == pytest.approx(2 * pi * 6 / (2 + np.sqrt(4 + 36)), rel=0.08) and slope < 2 * pi * 6 / 8


@pytest.mark.slow
@pytest.mark.parametrize(("share", "tolerance"), [(0.25, 0.05), (0.1, 0.015)])
def test_slender_blades_have_the_thrust_of_the_lattice(share, tolerance):
    """With a chord of R / 24 and R / 60 instead of R / 6."""
    assert slender_thrust(8, share) == pytest.approx(Lattice(radians(8), share * CHORD).thrust(), rel=tolerance)
