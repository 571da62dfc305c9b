"""What a schedule may do, as a mission file states it and as the schedules read it."""

import math
import tomllib
from pathlib import Path

import pytest

from vrsopt.errors import InputError
from vrsopt.helicopter import helicopter
from vrsopt.mission.file import mission_from
from vrsopt.schedule.bands import ForbiddenBand
from vrsopt.schedule.schedule import ScheduleSettings
from vrsopt.schedule.study_input import read, schedule_settings

HOP = tomllib.loads((Path(__file__).parents[1] / "hop.toml").read_text())


def settings_of(**limits: object) -> ScheduleSettings:
    return schedule_settings(mission_from(HOP | {"limits": limits}, where="hop"), helicopter("bo105"))


def test_limits_of_a_mission_in_si_units():
    settings = settings_of(
        rotor_speed_acceleration_percent_s2=0.5,
        twist_acceleration_deg_s2=2.0,
        spin_down_credit=False,
        forbidden_rotor_speed=[{"percent": [87.0, 95.0]}],
        ends="free",
    )
    assert settings.rotor_speed_acceleration == pytest.approx(0.005 * 44.4)
    assert settings.twist_acceleration == pytest.approx(math.radians(2.0))
    band = settings.forbidden_bands[0]
    assert (band.lower, band.upper, band.crossing_time) == pytest.approx((0.87 * 44.4, 0.95 * 44.4, 10.0))
    assert (settings.spin_down_credit, settings.ends) == (False, "free")


def test_what_a_mission_does_not_state_changes_nothing():
    assert settings_of() == ScheduleSettings(nominal_twist=helicopter("bo105").aircraft.main_rotor.twist)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "[[tasks]]",
            "[limits]\ntwist_deg = [9, 16]\n[[tasks]]",
            "limits.twist_deg = [9.0, 16.0]: allowed: around 8, ",
        ),
        ('"bo105"', '"none"', "aircraft = 'none': a shipped aircraft (bo105"),
    ],
)
def test_what_does_not_go_with_the_aircraft_is_refused_by_file_and_field(tmp_path, old, new, message):
    file = tmp_path / "hop.toml"
    file.write_text((Path(__file__).parents[1] / "hop.toml").read_text().replace(old, new, 1))
    for weather in ({}, {"isa_offset": 5.0}):
        with pytest.raises(InputError) as error:
            read(file, **weather)
        assert str(error.value).startswith(f"{file}: {message}")


@pytest.mark.parametrize(
    ("stated", "message"),
    [
        ({"rotor_speed_rate": -0.1}, "rotor_speed_rate = -0.1: must not be negative"),
        ({"twist_rate": math.nan}, "twist_rate = nan: must be a number, or None if unlimited"),
        ({"rotor_speed_rate": "a"}, "rotor_speed_rate = 'a': must be a number, or None"),
        ({"rotor_speed_rate": True}, "rotor_speed_rate = True: must be a number, or None"),
        ({"rotor_speed_acceleration": math.inf}, "rotor_speed_acceleration = inf: must be a number, or None"),
        ({"nominal_rotor_speed": None}, "nominal_rotor_speed = None: must be a number"),
        ({"rotor_speed_bounds": 5}, "rotor_speed_bounds = 5: must be (lower, upper), two numbers"),
        ({"twist_bounds": (0.1,)}, "twist_bounds = (0.1,): must be (lower, upper), two numbers"),
        ({"spin_down_credit": "no"}, "spin_down_credit = 'no': must be True or False"),
        ({"forbidden_bands": ((30.0, 35.0, 5.0),)}, "must be a tuple of ForbiddenBand"),
        ({"rotor_speed_acceleration": 0.0}, "rotor_speed_acceleration = 0: must be above 0"),
        ({"twist_acceleration": -1.0}, "twist_acceleration = -1: must be above 0"),
        ({"ends": "loose"}, "ends = 'loose': one of pinned, free, periodic"),
        ({"forbidden_bands": (ForbiddenBand(44.0, 45.0, 9.0),)}, "forbidden band 44 to 45 rad/s: contains"),
    ],
)
def test_settings_that_can_not_be(stated, message):
    with pytest.raises(InputError) as error:
        ScheduleSettings(**stated)
    assert message in str(error.value)


def test_a_band_is_of_numbers():
    with pytest.raises(InputError, match="forbidden band: crossing_time = None: must be a number"):
        ForbiddenBand(30.0, 35.0, None)
