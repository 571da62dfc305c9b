"""FOCA's guidance against the values tabulated with it for engines of every class."""

import numpy as np
import pytest

from vrsopt import foca
from vrsopt.errors import InputError

# Per cent of the rating: fuel flow kg/s, NOx, HC, CO, particulates g/kg, as tabulated for the DDA250-C20B (420 shp)
C20B = {
    5: ("0.0091", "1.19", "142.502", "192.82", "0.110548272"),
    7: ("0.0107", "1.44", "99.08", "132.724", "0.112515727"),
    15: ("0.0158", "2.22", "43.499", "56.957", "0.120317808"),
    38: ("0.0234", "3.763", "15.939", "20.298", "0.14214508"),
    46: ("0.025", "4.194", "12.967", "16.419", "0.149527188"),
    78: ("0.0308", "5.661", "7.33", "9.137", "0.17797182"),
    87: ("0.0327", "6.023", "6.515", "8.094", "0.185659432"),
}
# Rating shp, per cent, fuel flow kg/s of the two larger classes: ARRIEL 2C1, PT6C-67C, MAKILA 1A1
OTHERS = [
    (839, {7: "0.0151", 5: "0.013", 78: "0.0493", 38: "0.032"}),
    (1100, {6: "0.0196", 66: "0.0591", 32: "0.0414"}),
    (1820, {6: "0.0238", 66: "0.0789", 32: "0.053"}),
]


def is_printed(value, text):
    """Whether ``value`` rounds to the printed ``text``; tables leave trailing zeros out."""
    digits = max(len(text.partition(".")[2]), 4 if abs(value) < 0.1 else 3)
    return f"{value:.{digits}f}" == f"{float(text):.{digits}f}"


@pytest.mark.parametrize("percent", C20B)
def test_all_printed_digits_of_the_small_engine(percent):
    power = percent / 100 * 420 * foca.HORSEPOWER
    indices = (foca.nox_index, foca.hc_index, foca.co_index, foca.soot_index)
    values = (foca.fuel_flow(power), *(1e3 * index(power) for index in indices))
    for value, text in zip(values, C20B[percent], strict=True):
        assert is_printed(value, text), (value, text)


@pytest.mark.parametrize(("rating", "rows"), OTHERS)
def test_fuel_flow_of_the_larger_classes(rating, rows):
    for percent, text in rows.items():
        value = foca.fuel_flow(percent / 100 * rating * foca.HORSEPOWER, rating=rating * foca.HORSEPOWER)
        assert is_printed(value, text), (percent, value, text)


def test_a_cycle_of_the_light_twin_by_hand():
    """5 min at 7 %, 3 min at 78 %, 5.5 min at 38 %, two engines, from the printed values."""
    cycle = foca.landing_take_off(420 * foca.HORSEPOWER, takeoff_mass=2400.0)
    fuel = [2 * 300 * 0.0107, 2 * 180 * 0.0308, 2 * 330 * 0.0234]
    assert [mode.fuel for mode in cycle.modes] == pytest.approx(fuel, rel=5e-3)
    nox = [a * b / 1e3 for a, b in zip(fuel, (1.44, 5.661, 3.763), strict=True)]
    assert [mode.nox for mode in cycle.modes] == pytest.approx(nox, rel=5e-3)
    total = cycle.total
    assert total.duration == 13.5 * 60 and total.co2 == pytest.approx(3.16 * total.fuel)
    for name in foca.MASSES:
        assert getattr(total, name) == pytest.approx(sum(getattr(mode, name) for mode in cycle.modes), rel=1e-12)
    assert "factor of 2" in str(cycle) and "approach" in str(cycle)


def test_a_mission_is_its_cycles_and_the_mean_power_for_the_rest():
    rating = 420 * foca.HORSEPOWER
    cycle = foca.landing_take_off(rating).total
    hour = foca.mission(3600.0 + 2 * cycle.duration, rating, landings=2)
    mean = hour.modes[-1]
    assert mean.duration == pytest.approx(3600.0) and mean.power == pytest.approx(0.65 * rating)
    assert mean.fuel == pytest.approx(2 * 3600 * foca.fuel_flow(0.65 * rating))
    assert hour.total.nox == pytest.approx(2 * cycle.nox + mean.nox)
    short = foca.mission(60.0, rating)
    assert short.modes[-1].fuel == 0.0 and short.total.fuel == pytest.approx(cycle.fuel)


def test_category_by_engines_and_mass():
    rating = 500e3
    powers = [
        foca.landing_take_off(rating, engines, takeoff_mass=mass).modes[1].power / rating
        for engines, mass in ((1, 2500.0), (2, 3400.0), (2, 3500.0))
    ]
    assert powers == pytest.approx([0.87, 0.78, 0.66])


def test_arrays_are_the_numbers_one_by_one():
    power = np.array([20e3, 100e3, 300e3])
    for function in (foca.fuel_flow, foca.nox_index, foca.co_index, foca.hc_index, foca.soot_index):
        assert function(power) == pytest.approx([function(one) for one in power])


@pytest.mark.parametrize(("duration", "landings"), [(-1.0, 1), (float("nan"), 1), (3600.0, -1)])
def test_no_mission_is_refused(duration, landings):
    with pytest.raises(InputError, match="foca: duration"):
        foca.mission(duration, 300e3, landings=landings)


@pytest.mark.parametrize(("rating", "engines"), [(0.0, 2), (300e3, 0), (float("inf"), 2)])
def test_no_engine_is_refused(rating, engines):
    with pytest.raises(InputError, match="foca: rating"):
        foca.landing_take_off(rating, engines)
