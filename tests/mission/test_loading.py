import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vrsopt.errors import NoSolutionError
from vrsopt.mission.file import Loading
from vrsopt.mission.loading import close_takeoff_mass

LIMITS = {"max_takeoff_mass": 2500.0, "tank_capacity": 456.0}  # kg


def test_linear_burn_has_the_closed_form_take_off_mass():
    """burn = a + b m, reserve = c + d (m - burn + p), so m follows from one linear equation."""
    a, b, c, d, dry, payload = 40.0, 0.09, 20.0, 0.03, 1615.0, 100.0
    mass = (dry + a + c + d * (payload - a)) / (1.0 - b - d + d * b)
    loading = close_takeoff_mass(
        lambda m: a + b * m, lambda m: c + d * m, zero_fuel_mass=dry, payload_change=payload, **LIMITS
    )
    assert loading.takeoff_mass == pytest.approx(mass, abs=2e-6)
    assert loading.fuel_loaded == pytest.approx(mass - dry, abs=2e-6)
    assert loading.landing_mass == pytest.approx(mass + payload - loading.fuel_burned, abs=1e-9)


@settings(deadline=None, database=None)
@given(
    dry=st.floats(1400.0, 1900.0),
    rate=st.floats(1e-6, 3e-5),
    minutes=st.floats(5.0, 90.0),
    payload=st.floats(-200.0, 200.0),
)
def test_fuel_left_is_the_reserve(dry, rate, minutes, payload):
    evaluations = []

    def flow(mass: float) -> float:
        return 0.02 + rate * mass * (mass / 2000.0) ** 0.5

    def burn(mass: float) -> float:
        evaluations.append(mass)
        return 60.0 * minutes * flow(mass)

    def reserve(mass: float) -> float:
        return 1800.0 * flow(mass)

    try:
        loading = close_takeoff_mass(burn, reserve, zero_fuel_mass=dry, payload_change=payload, **LIMITS)
    except NoSolutionError:
        # then even the heaviest loading allowed has less than the reserve left
        heaviest = min(2500.0, dry + 456.0)
        burned = 60.0 * minutes * flow(heaviest)
        assert heaviest - dry - burned < reserve(heaviest + payload - burned)
    else:
        left = loading.takeoff_mass - dry - 60.0 * minutes * flow(loading.takeoff_mass)
        assert left == pytest.approx(reserve(loading.landing_mass), abs=2e-6)
        assert loading.takeoff_mass <= 2500.0 and loading.fuel_loaded <= 456.0
    assert len(evaluations) <= 12
    assert all(mass <= min(2500.0, dry + 456.0) for mass in evaluations)


@pytest.mark.parametrize(
    ("dry", "fuel", "message"),
    [
        (2400.0, 180.0, "take-off mass: at least 2580.0 kg is needed, 80.0 kg over the maximum 2500 kg"),
        (1600.0, 470.0, "take-off fuel: at least 470.0 kg is needed, 14.0 kg over the tank's 456 kg"),
        (2600.0, 1.0, "take-off mass: at least 2600.0 kg is needed, 100.0 kg over the maximum 2500 kg"),
        (1600.0, math.nan, "take-off mass: fuel burned nan kg and reserve 0.0 kg at 1600.0 kg"),
    ],
)
def test_no_loading_says_which_limit_and_by_how_much(dry, fuel, message):
    with pytest.raises(NoSolutionError) as error:
        close_takeoff_mass(lambda mass: fuel, lambda mass: 0.0, zero_fuel_mass=dry, **LIMITS)
    assert str(error.value) == message


def test_burn_that_grows_faster_than_the_fuel_is_refused():
    with pytest.raises(NoSolutionError, match="over the tank's 456 kg"):
        close_takeoff_mass(lambda mass: 10.0 + 1.1 * (mass - 1600.0), lambda mass: 0.0, zero_fuel_mass=1600.0, **LIMITS)


def test_zero_fuel_mass_is_everything_aboard_but_fuel():
    loading = Loading(empty_kg=1300, crew_kg=170, equipment_kg={"winch_operator": 85, "rescue_equipment": 60})
    assert loading.zero_fuel_mass == 1615.0
    assert loading.reserve_minutes == 30.0
