"""Weight and balance: sums by hand, tanks, limits, messages."""

from dataclasses import replace

import numpy as np
import pytest

from vrsopt.aircraft import load_aircraft
from vrsopt.balance import Balance, balance
from vrsopt.errors import InputError

AIRCRAFT = load_aircraft("bo105")
LOADING = AIRCRAFT.loading


def arms(result: Balance) -> dict[str, tuple[float, float]]:
    return {load.name: (load.mass, load.arm) for load in result.loads}


def test_one_pilot_and_full_tanks_by_hand():
    """1270 kg at 3.360, 80 kg at 1.80, 74 kg at 2.275 and 382 kg at 3.220 m."""
    result = balance(AIRCRAFT)
    assert result.mass == pytest.approx(1806.0)
    moment = 1270 * 3.360 + 80 * 1.80 + 74 * 2.275 + 382 * 3.220
    assert result.cg_arm == pytest.approx(moment / 1806.0, abs=1e-12)
    assert result.cg_shift == pytest.approx(LOADING.reference_cg_arm - result.cg_arm, abs=1e-12)


def test_the_shift_is_forward_for_load_before_the_centre_of_gravity():
    base = balance(AIRCRAFT, fuel=200)
    assert balance(AIRCRAFT, fuel=200, crew=160).cg_shift > base.cg_shift
    assert balance(AIRCRAFT, fuel=200, payload={"cargo": 60}).cg_shift < base.cg_shift


def test_the_supply_tank_is_filled_first():
    some = arms(balance(AIRCRAFT, fuel=50))
    assert (some["supply tank"][0], some["main tank"][0]) == (50.0, 0.0)
    more = arms(balance(AIRCRAFT, fuel=300))
    assert (more["supply tank"][0], more["main tank"][0]) == (74.0, 226.0)


def test_payload_alone_is_in_the_first_station():
    assert balance(AIRCRAFT, payload=120) == balance(AIRCRAFT, payload={"cabin": 120})


def test_load_at_the_centre_of_gravity_does_not_move_it():
    base = balance(AIRCRAFT, fuel=100)
    station = LOADING.payload["cargo"].replaced(arm=base.cg_arm)
    aircraft = AIRCRAFT.replaced(loading=LOADING.replaced(payload={"hook": station}))
    assert balance(aircraft, fuel=100, payload=300).cg_arm == pytest.approx(base.cg_arm, abs=1e-12)


@pytest.mark.parametrize(
    "mass, foremost, aftmost", [(1806, 3.0814, 3.395), (2000, 3.0957, 3.395), (2200, 3.1103, 3.345)]
)
def test_limits_are_those_of_the_flight_manual(mass, foremost, aftmost):
    """Edges of the polygon from 1800 kg, 3.081 m to 2400 kg, 3.125 m and from 2000 kg, 3.395 m to 2400 kg, 3.295 m."""
    cabin = LOADING.payload["cabin"].replaced(arm=3.2)
    aircraft = AIRCRAFT.replaced(loading=LOADING.replaced(payload={"cabin": cabin}))
    result = balance(aircraft, payload=mass - 1806)
    assert result.mass == pytest.approx(mass)
    assert (result.foremost, result.aftmost) == pytest.approx((foremost, aftmost), abs=2e-4)


@pytest.mark.parametrize(
    "loads, words",
    [
        ({"fuel": 500}, ["fuel = 500", "0 to 456 kg"]),
        ({"fuel": float("nan")}, ["fuel = nan", "0 to 456 kg"]),
        ({"crew": -80}, ["crew = -80", "zero or more"]),
        ({"payload": {"cabin": 100, "roof": 10}}, ["'roof'", "cabin, cargo"]),
        ({"payload": float("inf")}, ["payload cabin = inf"]),
        ({"payload": 800}, ["gross mass = 2606.0 kg", "1140 to 2500 kg"]),
        ({"payload": 320, "crew": 160}, ["3.098 m", "3.111 to 3.344 m", "2206.0 kg"]),
        ({"payload": {"cargo": 300}, "fuel": 0}, ["centre of gravity = 3.4", "to 3.395 m"]),
    ],
    ids=["too much fuel", "nan", "negative", "station", "infinite", "too heavy", "too far forward", "too far aft"],
)
def test_what_can_not_be_loaded_is_told_in_one_line(loads, words):
    with pytest.raises(InputError) as caught:
        balance(AIRCRAFT, **loads)
    message = str(caught.value)
    assert "\n" not in message and message.startswith("balance: ")
    for word in words:
        assert word in message, message


def test_a_mass_beyond_the_known_limits_of_the_centre_of_gravity():
    known = LOADING.cg_limits.replaced(
        mass=LOADING.cg_limits.mass[:4], foremost=LOADING.cg_limits.foremost[:4], aftmost=LOADING.cg_limits.aftmost[:4]
    )
    aircraft = AIRCRAFT.replaced(loading=LOADING.replaced(cg_limits=known))
    with pytest.raises(InputError, match="gross mass = 2456.0 kg: .* known from 1140 to 2400 kg"):
        balance(aircraft, payload={"cabin": 500, "cargo": 150})


def test_every_allowed_loading_lies_within_the_limits():
    """The messages draw the line exactly: a loading is returned if and only if it is inside."""
    random = np.random.default_rng(3)
    inside = 0
    for cabin, cargo, fuel, crew in random.uniform(0, [600, 200, 456, 200], (200, 4)):
        parts = [(1270, 3.36), (crew, 1.8), (cabin, 2.75), (cargo, 4.1)]
        parts += [(min(fuel, 74), 2.275), (max(fuel - 74, 0), 3.22)]
        mass = sum(m for m, _ in parts)
        arm = sum(m * a for m, a in parts) / mass
        limits = LOADING.cg_limits
        allowed = mass <= 2500 and np.interp(mass, limits.mass, limits.foremost) <= arm
        allowed = allowed and arm <= np.interp(mass, limits.mass, limits.aftmost)
        loads = {"payload": {"cabin": cabin, "cargo": cargo}, "fuel": fuel, "crew": crew}
        if allowed:
            inside += 1
            assert balance(AIRCRAFT, **loads).cg_arm == pytest.approx(arm, abs=1e-9)
        else:
            with pytest.raises(InputError):
                balance(AIRCRAFT, **loads)
    assert 20 < inside < 180


def test_prints_as_a_table():
    text = str(balance(AIRCRAFT, payload={"cabin": 160, "cargo": 50}, crew=160))
    assert "gross              2096.0    3.148" in text
    assert "3.103 to 3.371" in text and "+0.082 forward" in text
    assert replace(balance(AIRCRAFT), cg_shift=-0.1).__str__().endswith("-0.100 forward of the aircraft data's")
