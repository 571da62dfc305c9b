"""Resolution of the rotor: what resolves nothing is refused in one line."""

import pytest

from vrsopt.errors import InputError
from vrsopt.rotor.fidelity import Fidelity


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"harmonics": 0}, "harmonics = 0: at least 1"),
        ({"stations": 0}, "stations = 0: at least 1"),
        ({"flap_modes": -1}, "flap_modes = -1: at least 0"),
        ({"lag_modes": -1}, "lag_modes = -1: at least 0"),
        ({"torsion_modes": -1}, "torsion_modes = -1: at least 0"),
        ({"highest_harmonic": -1}, "highest_harmonic = -1: at least 0"),
        ({"highest_shape": 0}, "highest_shape = 0: at least 1"),
        ({"azimuths": 8}, "azimuths = 8: above 8, twice the harmonics"),
        ({"harmonics": 18}, "azimuths = 36: above 36, twice the harmonics"),
        ({"chord_recovery": 0.0}, "chord_recovery = 0: above 0 and at most 1, or None"),
        ({"chord_recovery": 1.01}, "chord_recovery = 1.01: above 0 and at most 1, or None"),
        ({"chord_recovery": float("nan")}, "chord_recovery = nan: above 0 and at most 1, or None"),
    ],
)
def test_what_resolves_nothing_is_refused(change, words):
    with pytest.raises(InputError) as caught:
        Fidelity(**change)
    assert str(caught.value) == f"fidelity: {words}"


def test_the_bounds_themselves_are_allowed():
    least = Fidelity(harmonics=1, azimuths=3, stations=1, highest_harmonic=0, highest_shape=1, chord_recovery=1.0)
    assert (least.harmonics, least.azimuths) == (1, 3)
    assert Fidelity(lag_modes=0, torsion_modes=0).flap_modes == 3
