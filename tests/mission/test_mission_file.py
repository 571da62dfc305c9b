"""Mission files: what is read, and that anything else is refused in one line with file, field and reason."""

import copy
import json
import re
import tomllib
from math import inf, nan
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.mission.small_missions import SHEAR, TOUR
from tests.mission.small_missions import data as small
from vrsopt.errors import InputError
from vrsopt.mission.file import Mission, mission_from, read_mission
from vrsopt.mission.profile import Profile

PROBLEMS = Path(__file__).parents[2] / "problems"
SARM = PROBLEMS / "sarm.toml"
FILES = {name: tomllib.loads((PROBLEMS / f"{name}.toml").read_text()) for name in ("sarm", "patm", "lem")}
DELETE = object()
PICK_UP = {"duration_s": 180, "mass_change_kg": 240}
KINDS = "idle, ground_idle, hover, vertical_climb, climb, cruise, descent, speed_change, mass_change, loiter, search"
AT_ENDS = "allowed for the first and the last task: idle, ground_idle, hover"

# every table and every key there is
COMPLETE = small(
    *TOUR,
    wind={**SHEAR, "speed_m_s": [0.0, 0.0, 0.0]},  # still air is flown faster
    isa_offset_k=10.0,
    limits={
        "rotor_speed_percent": [80.0, 110.0],
        "twist_deg": [6.0, 12.0],
        "rotor_speed_rate_percent_s": 0.5,
        "twist_rate_deg_s": 0.5,
        "rotor_speed_acceleration_percent_s2": 0.5,
        "twist_acceleration_deg_s2": 1.0,
        "spin_down_credit": False,
        "forbidden_rotor_speed": [{"percent": [87.0, 95.0], "crossing_s": 20.0}],
        "ends": "free",
        "limits": "study",
        "manoeuvre_margin": 1.2,
    },
    handling={
        "acceleration_m_s2": 1.0,
        "cruise_acceleration_m_s2": 0.5,
        "vertical_acceleration_m_s2": 0.5,
        "bank_deg": 20.0,
        "roll_in_s": 3.0,
    },
)
FILES["complete"] = json.loads(json.dumps(COMPLETE))  # no table twice


def toml(value) -> str:
    """A value as TOML; strings and numbers are written as in JSON but for NaN and infinity."""
    if isinstance(value, dict):
        return (
            "{"
            + ", ".join(f"{json.dumps(key, ensure_ascii=False)} = {toml(item)}" for key, item in value.items())
            + "}"
        )
    if isinstance(value, list):
        return "[" + ", ".join(toml(item) for item in value) + "]"
    return json.dumps(value, ensure_ascii=False).replace("NaN", "nan").replace("Infinity", "inf")


def document(data: dict) -> str:
    return "\n".join(f"{json.dumps(key, ensure_ascii=False)} = {toml(value)}" for key, value in data.items())


def changed(path, value, file: str = "sarm") -> dict:
    """The data of a mission with one entry changed, added or deleted."""
    data = copy.deepcopy(FILES[file])
    at = data
    for part in path[:-1]:
        at = at[part]
    if value is DELETE:
        del at[path[-1]]
    else:
        at[path[-1]] = value
    return data


def field(path) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).removeprefix(".")


def refusal(tmp_path, data) -> str:
    file = tmp_path / "mission.toml"
    file.write_text(document(data), encoding="utf-8")
    with pytest.raises(InputError) as error:
        read_mission(file)
    message = str(error.value)
    assert message.startswith(f"{file}: ") and "\n" not in message
    assert error.value.__suppress_context__
    return message.removeprefix(f"{file}: ")


# what is read


def test_shipped_mission_reads():
    mission = read_mission(SARM)
    assert (mission.name, mission.aircraft, mission.start) == ("SARM", "bo105", "KSFO")
    assert mission.loading.zero_fuel_mass == 1615.0
    assert mission.limits.rotor_speed_percent == (75.0, 115.0)


@pytest.mark.parametrize("name", FILES)
def test_round_trip(tmp_path, name):
    file = tmp_path / "first.toml"
    file.write_text(document(FILES[name]))
    mission = read_mission(file)
    file.write_text(document(mission.model_dump(mode="json", exclude_none=True)))
    again = read_mission(file)
    assert again == mission
    assert Mission.model_validate_json(mission.model_dump_json()) == mission


def test_limits_offset_handling_and_wind_have_the_defaults_shared_by_the_missions():
    left_out = ("limits", "isa_offset_k", "handling")
    mission = mission_from({key: value for key, value in FILES["sarm"].items() if key not in left_out}, where="x")
    limits = {key: value for key, value in FILES["sarm"]["limits"].items() if key != "manoeuvre_margin"}
    calm = {"from_deg": 90.0, "speed_m_s": 0.0}
    stated = mission_from({**FILES["sarm"], "isa_offset_k": 0.0, "limits": limits, "wind": calm}, where="x")
    assert mission.limits == stated.limits and mission.handling == stated.handling
    assert mission.limits.manoeuvre_margin is None  # the aircraft's own
    assert mission.wind.field.calm and stated.wind.field.calm


def test_integers_are_numbers():
    data = changed(("tasks", 0, "duration_s"), 120)
    assert mission_from(data, where="x").tasks[0].duration_s == 120.0


def test_names_may_have_any_letters(tmp_path):
    data = json.loads(json.dumps(FILES["patm"]).replace("milton_keynes", "Mühldorf – 機場 3"))
    file = tmp_path / "names.toml"
    file.write_text(document(data), encoding="utf-8")
    tasks = {segment.task for segment in Profile.of(read_mission(file)).segments}
    assert "cruise to Mühldorf – 機場 3" in tasks


# what is not, by hand


def band(low: float, high: float, crossing: float = 20.0) -> dict:
    return {"percent": [low, high], "crossing_s": crossing}


BANDS = ("limits", "forbidden_rotor_speed")
VARIANTS = [
    (("name",), DELETE, "name: missing"),
    (("name",), "", "name = '': allowed: a text that is not empty"),
    (("name",), 7, "name = 7: allowed: a text"),
    (("name",), "two\nlines", "name = 'two\\nlines': allowed: a text in one line"),
    (("name",), "bell\a", "name = 'bell\\x07': allowed: a text in one line, of characters that can be shown"),
    (("aircraft",), 105, "aircraft = 105: allowed: a text"),
    (("aircraft",), "", "aircraft = '': allowed: a text that is not empty"),
    (("aircraft",), DELETE, "aircraft: missing"),
    (("start",), DELETE, "start: missing"),
    (("start",), ["KSFO"], "start = ['KSFO']: allowed: a text"),
    (
        ("start",),
        "Oakland",
        "start = 'Oakland': allowed: a place of this file (KSFO, incident, search_area, brookside)",
    ),
    (("isa_offset_k",), 90, "isa_offset_k = 90: allowed: a number from -40 to 40"),
    (("isa_offset_c",), 10, "isa_offset_c = 10: unknown key, allowed: isa_offset_k, wind, name, "),
    (("colour",), "red", "colour = 'red': unknown key, allowed: isa_offset_k, wind, name, aircraft, start, places, l"),
    (("Name",), "SARM", "Name = 'SARM': unknown key, allowed: isa_offset_k, "),
    (("handling", "bank"), 20, "handling.bank = 20: unknown key, allowed: acceleration_m_s2, "),
    (("handling", "turn_rate_deg_s"), 3, "handling.turn_rate_deg_s = 3: unknown key, allowed: acceleration_m_s2, "),
    (("handling",), 3, "handling = 3: allowed: a table"),
    (("handling",), [{}], "handling = [{}]: allowed: a table"),
    (("places",), DELETE, "places: missing"),
    (("places",), {}, "places = {}: allowed: at least one entry"),
    (("places",), 3, "places = 3: allowed: a table"),
    (("places",), [{"name": "KSFO"}], "places = [{'name': 'KSFO'}]: allowed: a table"),
    (("places", "KSFO"), [1, 2, 3], "places.KSFO = [1, 2, 3]: allowed: a table"),
    (("places", "KSFO", "latitude_deg"), 97.0, "places.KSFO.latitude_deg = 97.0: allowed: a number from -90 to 90"),
    (("places", "KSFO", "latitude_deg"), "37.6N", "places.KSFO.latitude_deg = '37.6N': allowed: a number from -90 to"),
    (("places", "KSFO", "longitude_deg"), -181, "places.KSFO.longitude_deg = -181: allowed: a number from -180 to 180"),
    (("places", "KSFO", "elevation_m"), -3.0, "places.KSFO.elevation_m = -3.0: allowed: a number from 0 to 2000"),
    (("places", "KSFO", "elevation_m"), DELETE, "places.KSFO.elevation_m: missing"),
    (("places", "KSFO", "latitude_deg"), DELETE, "places.KSFO.latitude_deg: missing"),
    (("places", "KSFO", "elevation_ft"), 13, "places.KSFO.elevation_ft = 13: unknown key, allowed: latitude_deg, "),
    (
        ("places", "KSFO", "icao"),
        "X",
        "places.KSFO.icao = 'X': unknown key, allowed: latitude_deg, longitude_deg, elev",
    ),
    (("places", "a\nb"), FILES["sarm"]["places"]["KSFO"], "places.\"a\\nb\" = 'a\\nb': allowed: a text in one line"),
    (("places", "a b"), {}, 'places."a b".latitude_deg: missing'),
    (("places", ""), FILES["sarm"]["places"]["KSFO"], "places.\"\" = '': allowed: a text that is not empty"),
    (("loading",), DELETE, "loading: missing"),
    (("loading",), "heavy", "loading = 'heavy': allowed: a table"),
    (("loading", "empty_kg"), -1300.0, "loading.empty_kg = -1300.0: allowed: a number from 0 to 2500"),
    (("loading", "empty_kg"), DELETE, "loading.empty_kg: missing"),
    (("loading", "empty_kg"), inf, "loading.empty_kg = inf: allowed: a number from 0 to 2500"),
    (("loading", "empty_lb"), 2866, "loading.empty_lb = 2866: unknown key, allowed: empty_kg, crew_kg, equipment_kg, "),
    (("loading", "crew_kg"), "two", "loading.crew_kg = 'two': allowed: a number from 0 to 2500"),
    (("loading", "crew_kg"), "170", "loading.crew_kg = '170': allowed: a number from 0 to 2500"),
    (("loading", "crew_kg"), DELETE, "loading.crew_kg: missing"),
    (("loading", "fuel_kg"), 300, "loading.fuel_kg = 300: unknown key, allowed: empty_kg, crew_kg, equipment_kg, res"),
    (("loading", "equipment_kg"), 145, "loading.equipment_kg = 145: allowed: a table"),
    (("loading", "equipment_kg"), [85, 60], "loading.equipment_kg = [85, 60]: allowed: a table"),
    (("loading", "equipment_kg", "winch"), -1, "loading.equipment_kg.winch = -1: allowed: a number from 0 to 2500"),
    (("loading", "equipment_kg", "winch"), {"kg": 1}, "loading.equipment_kg.winch = {'kg': 1}: allowed: a number from"),
    (("loading", "equipment_kg", ""), 5, "loading.equipment_kg.\"\" = '': allowed: a text that is not empty"),
    (("loading", "reserve_minutes"), True, "loading.reserve_minutes = True: allowed: a number from 0 to 120"),
    (("loading", "reserve_min"), 30, "loading.reserve_min = 30: unknown key, allowed: empty_kg, crew_kg, equipment_kg"),
    (("limits",), [], "limits = []: allowed: a table"),
    (("limits", "rotor_speed_percent"), [60, 115], "limits.rotor_speed_percent[0] = 60: allowed: a number from 75 to"),
    (("limits", "rotor_speed_percent"), [115, 75], "limits.rotor_speed_percent = [115.0, 75.0]: allowed: [lower, upp"),
    (
        ("limits", "rotor_speed_percent"),
        [75, 95],
        "limits.rotor_speed_percent = [75.0, 95.0]: allowed: around 100, the",
    ),
    (("limits", "rotor_speed_percent"), 100, "limits.rotor_speed_percent = 100: allowed: a list"),
    (("limits", "rotor_speed_percent"), [], "limits.rotor_speed_percent[0]: missing"),
    (("limits", "twist_deg"), [6], "limits.twist_deg[1]: missing"),
    (("limits", "twist_deg"), [6, 8, 16], "limits.twist_deg = [6, 8, 16]: allowed: two numbers, [lower, upper]"),
    (("limits", "twist_deg"), [6, nan], "limits.twist_deg[1] = nan: allowed: a number from 6 to 16"),
    (("limits", "twist_deg"), {"low": 6}, "limits.twist_deg = {'low': 6}: allowed: a list"),
    (("limits", "twist_rate_deg_s"), 0, "limits.twist_rate_deg_s = 0: allowed: a number from 0.01 to 20"),
    (("limits", "spin_down_credit"), 1, "limits.spin_down_credit = 1: allowed: true or false"),
    (("limits", "ends"), "loose", "limits.ends = 'loose': allowed: 'pinned', 'free' or 'periodic'"),
    (("limits", "forbidden_rotor_speed"), {}, "limits.forbidden_rotor_speed = {}: allowed: a list"),
    (("limits", "forbidden_rotor_speed"), [{}], "limits.forbidden_rotor_speed[0].percent: missing"),
    (BANDS, [band(95, 87)], "limits.forbidden_rotor_speed[0].percent = [95.0, 87.0]: allowed: [lower, upper]"),
    (BANDS, [band(87, 105)], "limits.forbidden_rotor_speed[0].percent = [87.0, 105.0]: allowed: a band without 100 %"),
    (BANDS, [band(87, 95, 2)], "limits.forbidden_rotor_speed[0].crossing_s = 2.0: allowed: 0 (never cross), or at lea"),
    (BANDS, [band(80, 87), band(85, 95)], "limits.forbidden_rotor_speed = [[80.0, 87.0], [85.0, 95.0]]: allowed: ba"),
    (BANDS, [band(80, 87) | {"time_s": 1}], "limits.forbidden_rotor_speed[0].time_s = 1: unknown key, allowed: perce"),
    (("limits", "limits"), "none", "limits.limits = 'none': allowed: 'manual' or 'study'"),
    (("limits", "limits"), 257, "limits.limits = 257: allowed: 'manual' or 'study'"),
    (("limits", "manoeuvre_margin"), 0.5, "limits.manoeuvre_margin = 0.5: allowed: a number from 1 to 2"),
    (("limits", "margin"), 1.3, "limits.margin = 1.3: unknown key, allowed: rotor_speed_percent, twist_deg, "),
    (("wind",), 8, "wind = 8: allowed: a table"),
    (("wind",), {}, "wind.from_deg: missing"),
    (("wind",), {"from_deg": 250}, "wind.speed_m_s: missing"),
    (("wind",), {"speed_m_s": 5}, "wind.from_deg: missing"),
    (("wind",), {"from_deg": 250, "speed_m_s": 5, "gusts": 9}, "wind.gusts = 9: unknown key, allowed: from_deg, speed"),
    (("wind",), {"from_deg": 250, "speed_kt": 10}, "wind.speed_m_s: missing"),
    (
        ("wind",),
        {"from_deg": "west", "speed_m_s": 5},
        "wind.from_deg = 'west': allowed: a number from 0 to 360, or a l",
    ),
    (("wind",), {"from_deg": -10, "speed_m_s": 5}, "wind.from_deg = -10: allowed: a number from 0 to 360, or a list"),
    (("wind",), {"from_deg": 10, "speed_m_s": 26}, "wind.speed_m_s = 26: allowed: a number from 0 to 25, or a list of"),
    (("wind",), {"from_deg": 10, "speed_m_s": -1}, "wind.speed_m_s = -1: allowed: a number from 0 to 25, or a list of"),
    (("wind",), {"from_deg": nan, "speed_m_s": 5}, "wind.from_deg = nan: allowed: a number from 0 to 360, or a list"),
    (("wind",), {"from_deg": True, "speed_m_s": 5}, "wind.from_deg = True: allowed: a number from 0 to 360, or a list"),
    (("wind",), {"from_deg": [10], "speed_m_s": [5]}, "wind.from_deg = [10.0]: allowed: one number, unless altitude_m"),
    (
        ("wind",),
        {"from_deg": 10, "speed_m_s": [5]},
        "wind.speed_m_s = [5.0]: allowed: one number, unless altitude_m is",
    ),
    (
        ("wind",),
        {"from_deg": 10, "speed_m_s": 5, "altitude_m": [0]},
        "wind.from_deg = 10.0: allowed: a list with one number for each of altitude_m, 1",
    ),
    (
        ("wind",),
        {"from_deg": [10, 20], "speed_m_s": [5], "altitude_m": [0, 500]},
        "wind.speed_m_s = [5.0]: allowed: a list with one number for each of altitude_m, 2",
    ),
    (
        ("wind",),
        {"from_deg": [10, 20], "speed_m_s": [5, 6], "altitude_m": [500, 0]},
        "wind.altitude_m = [500.0, 0.0]: allowed: one or more altitudes, each above the one before",
    ),
    (
        ("wind",),
        {"from_deg": [10, 20], "speed_m_s": [5, 6], "altitude_m": [500, 500]},
        "wind.altitude_m = [500.0, 500.0]: allowed: one or more altitudes, each above the one before",
    ),
    (("wind",), {"from_deg": [], "speed_m_s": [], "altitude_m": []}, "wind.altitude_m = []: allowed: one or more alt"),
    (("wind",), {"from_deg": [1], "speed_m_s": [5], "altitude_m": 0}, "wind.altitude_m = 0: allowed: a list"),
    (
        ("wind",),
        {"from_deg": [1], "speed_m_s": [5], "altitude_m": [-1]},
        "wind.altitude_m[0] = -1: allowed: a number f",
    ),
    (("wind",), {"from_deg": [1], "speed_m_s": [[5]], "altitude_m": [0]}, "wind.speed_m_s = [[5]]: allowed: a number"),
    (("wind",), {"from_deg": 300, "speed_m_s": 25, "altitude_ft": 5}, "wind.altitude_ft = 5: unknown key, allowed: fr"),
    (("tasks",), [], "tasks = []: allowed: at least one entry"),
    (("tasks",), DELETE, "tasks: missing"),
    (("tasks",), {"kind": "idle"}, "tasks = {'kind': 'idle'}: allowed: a list"),
    (("tasks",), "fly", "tasks = 'fly': allowed: a list"),
    (("tasks", 0), 3, "tasks[0] = 3: allowed: a table"),
    (("tasks", 0), [], "tasks[0] = []: allowed: a table"),
    (("tasks", 0), {}, f"tasks[0].kind: missing, allowed: {KINDS}"),
    (("tasks", 0, "kind"), DELETE, f"tasks[0].kind: missing, allowed: {KINDS}"),
    (("tasks", 0, "kind"), "park", f"tasks[0].kind = 'park': allowed: {KINDS}"),
    (("tasks", 0, "kind"), "", f"tasks[0].kind = '': allowed: {KINDS}"),
    (("tasks", 0, "kind"), "Idle", f"tasks[0].kind = 'Idle': allowed: {KINDS}"),
    (("tasks", 0, "kind"), 1, f"tasks[0].kind = 1: allowed: {KINDS}"),
    (("tasks", 0, "kind"), ["idle"], f"tasks[0].kind = ['idle']: allowed: {KINDS}"),
    (("tasks", 0, "kind"), {"idle": 1}, f"tasks[0].kind = {{'idle': 1}}: allowed: {KINDS}"),
    (("tasks", 0, "duration_s"), -5, "tasks[0].duration_s = -5: allowed: a number from 1 to 20000"),
    (("tasks", 0, "duration_min"), 2, "tasks[0].duration_min = 2: unknown key, allowed: kind, duration_s, mass_change"),
    (("tasks", 0, "height_m"), 2, "tasks[0].height_m = 2: unknown key, allowed: kind, duration_s, mass_change_kg"),
    (("tasks", 0, "mass_change_kg"), 80, "tasks[0].mass_change_kg = 80.0: allowed for the first task: 0 (state in [l"),
    (("tasks", 1, "height_m"), "low", "tasks[1].height_m = 'low': allowed: a number from 0 to 500"),
    (("tasks", 1, "height_m"), 50, "tasks[1].height_m = 50.0: allowed after an idle task: at most 5"),
    (("tasks", 1, "duration_s"), 3, "tasks[1].duration_s = 3.0: allowed: at least 5.9, the time to lift off and to"),
    (("tasks", 2, "altitude_m"), 2500, "tasks[2].altitude_m = 2500: allowed: a number from 0 to 2000"),
    (("tasks", 2, "altitude_m"), 3, "tasks[2].altitude_m = 3.0: allowed for a climb: above 6, where it begins"),
    (("tasks", 2, "altitude_m"), DELETE, "tasks[2].altitude_m: missing"),
    (("tasks", 2, "altitude_ft"), 1000, "tasks[2].altitude_ft = 1000: unknown key, allowed: kind, speed_m_s, altitud"),
    (("tasks", 2, "climb_angle_deg"), -7.12, "tasks[2].climb_angle_deg = -7.12: allowed: a number from 0.5 to 30"),
    (("tasks", 2, "climb_rate_m_s"), 5, "tasks[2].climb_rate_m_s = 5: unknown key, allowed: kind, speed_m_s, altitude"),
    (("tasks", 3, "speed_m_s"), 300, "tasks[3].speed_m_s = 300: allowed: a number from 1 to 70"),
    (("tasks", 3, "speed_m_s"), nan, "tasks[3].speed_m_s = nan: allowed: a number from 1 to 70"),
    (("tasks", 3, "speed_m_s"), DELETE, "tasks[3].speed_m_s: missing"),
    (("tasks", 3, "speed_kt"), 90, "tasks[3].speed_kt = 90: unknown key, allowed: kind, speed_m_s, speed_range_m_s,"),
    (("tasks", 3, "to"), "Alcatraz", "tasks[3].to = 'Alcatraz': allowed: a place of this file (KSFO, incident, "),
    (("tasks", 3, "to"), "", "tasks[3].to = '': allowed: a text that is not empty"),
    (("tasks", 3, "to"), 3, "tasks[3].to = 3: allowed: a text"),
    (("tasks", 3, "to"), DELETE, "tasks[3].to: missing, allowed: one of to, duration_s and distance_m, not none"),
    (("tasks", 3, "to"), "KSFO", "tasks[3].to = 'KSFO': allowed: a place where the aircraft is not already"),
    (
        ("tasks", 3, "duration_s"),
        300,
        "tasks[3].to = 'incident': allowed: one of to, duration_s and distance_m, not to and duration_s",
    ),
    (("tasks", 3, "course_deg"), 30, "tasks[3].course_deg = 30.0: allowed: with duration_s or distance_m, not with to"),
    (
        ("tasks", 3),
        {"kind": "cruise", "duration_s": 90, "speed_m_s": 48},
        "tasks[3].course_deg: missing, needed where ",
    ),
    (("tasks", 3, "distance_km"), 3, "tasks[3].distance_km = 3: unknown key, allowed: kind, speed_m_s, speed_range_m"),
    (("tasks", 4, "altitude_m"), 400, "tasks[4].altitude_m = 400.0: allowed for a descent: below 300, where it beg"),
    (("tasks", 4, "altitude_m"), DELETE, "tasks[4].altitude_m: missing, needed unless a hover at the place of the cru"),
    (("tasks", 4, "climb_angle_deg"), 7.12, "tasks[4].climb_angle_deg = 7.12: allowed: a number from -30 to -0.5"),
    (("tasks", 5, "around"), "bay", "tasks[5].around = 'bay': allowed: a place of this file (KSFO, incident, "),
    (("tasks", 5, "around"), DELETE, "tasks[5].around: missing"),
    (("tasks", 5, "leg_m"), DELETE, "tasks[5].leg_m: missing"),
    (
        ("tasks", 5, "pattern"),
        "spiral",
        "tasks[5].pattern = 'spiral': allowed: creeping_line, expanding_square, sector",
    ),
    (
        ("tasks", 5, "pattern"),
        "circle",
        "tasks[5].pattern = 'circle': allowed: creeping_line, expanding_square, sector",
    ),
    (("tasks", 5, "pattern"), ["sector"], "tasks[5].pattern = ['sector']: allowed: creeping_line, expanding_square, s"),
    (("tasks", 5, "pattern"), 3, "tasks[5].pattern = 3: allowed: creeping_line, expanding_square, sector"),
    (("tasks", 5, "pattern"), "sector", "tasks[5].sector_m: missing"),
    (("tasks", 5, "turns"), "left", "tasks[5].turns = 'left': unknown key, allowed: kind, around, turn_radius_m, spe"),
    (("tasks", 5, "spacing_m"), 300, "tasks[5].spacing_m = 300.0: allowed: at least twice turn_radius_m, 400"),
    (("tasks", 5, "spacing_nm"), 1, "tasks[5].spacing_nm = 1: unknown key, allowed: kind, around, turn_radius_m, spee"),
    (("tasks", 5, "turn_radius_m"), 50, "tasks[5].turn_radius_m = 50.0: allowed: at least 72.2, a bank of 60 deg"),
    (("tasks", 5, "duration_s"), 5, "tasks[5].duration_s = 5.0: allowed: more than "),
    (("tasks", 5, "altitude_m"), 50, "tasks[5].altitude_m = 50: unknown key, allowed: kind, around, turn_radius_m, sp"),
    (("tasks", 8, "height_m"), 20, "tasks[8].height_m = 20.0: allowed here: 30, the height the aircraft has"),
    (("tasks", 8, "mass_change_kg"), -500, "tasks[8].mass_change_kg = -500.0: allowed: no more than is aboard, 145 kg"),
    (("tasks", 8, "mass_change_kg"), "3 people", "tasks[8].mass_change_kg = '3 people': allowed: a number from -1000 "),
    (("tasks", 13, "mass_change_kg"), -400, "tasks[13].mass_change_kg = -400.0: allowed: no more than is aboard, 385"),
    (("places", "brookside", "elevation_m"), 400, "tasks[10].to = 'brookside': allowed: a place no higher than 300 m"),
    (
        ("places", "search_area", "elevation_m"),
        60,
        "tasks[5].around = 'search_area': allowed: a place no higher than 50 m, the altitude flown there",
    ),
    (("places", "incident", "elevation_m"), 70, "tasks[3].to = 'incident': allowed: a place no higher than 50 m, the"),
    (("tasks", 6), DELETE, "tasks[6].kind = 'descent': allowed: only with a cruise that says where to"),
    (("tasks", 12), DELETE, "tasks[11].altitude_m: missing, needed unless a hover at the place of the cruise follows"),
    (("tasks", 6), {"kind": "hover", "duration_s": 9}, "tasks[6].kind = 'hover': allowed: at a place; a cruise to one"),
    (("tasks", 1), {"kind": "idle", "duration_s": 9}, "tasks[2].kind = 'climb': allowed: after a hover, not from the"),
    (("tasks", 8, "kind"), "idle", "tasks[8].height_m = 30.0: unknown key, allowed: kind, duration_s, mass_change_kg"),
    (("tasks", 8), {**PICK_UP, "kind": "idle"}, "tasks[8].kind = 'idle': allowed: as the first task or after a"),
    (
        ("tasks", 9),
        {"kind": "idle", "duration_s": 9},
        "tasks[8].height_m = 30.0: allowed before an idle task: at most 5",
    ),
    (
        ("tasks", 9),
        {"kind": "ground_idle", "duration_s": 9},
        "tasks[8].height_m = 30.0: allowed before an idle task: a",
    ),
    (
        ("tasks", 9),
        {"kind": "vertical_climb", "height_m": 20},
        "tasks[9].height_m = 20.0: allowed: above 30, where it begins, and at most 2000",
    ),
    (
        ("tasks", 6),
        {"kind": "vertical_climb", "height_m": 200},
        "tasks[6].kind = 'vertical_climb': allowed: at a place; a cruise to one has to come first",
    ),
    (
        ("tasks", 2),
        {"kind": "speed_change", "speed_m_s": 30, "acceleration_m_s2": 0.5},
        "tasks[4].altitude_m = 50.0: allowed for a descent: below 6, where it begins",
    ),
    (("tasks", 0), FILES["sarm"]["tasks"][2], f"tasks[0].kind = 'climb': {AT_ENDS}"),
    (("tasks", 0), {"kind": "mass_change", "mass_change_kg": 5}, f"tasks[0].kind = 'mass_change': {AT_ENDS}"),
    (("tasks", 0), {"kind": "vertical_climb", "height_m": 50}, f"tasks[0].kind = 'vertical_climb': {AT_ENDS}"),
    (("tasks", 19), FILES["sarm"]["tasks"][17], f"tasks[19].kind = 'descent': {AT_ENDS}"),
    (("tasks", 19), {"kind": "mass_change", "mass_change_kg": 5}, f"tasks[19].kind = 'mass_change': {AT_ENDS}"),
    (("wind",), {"from_deg": 300, "speed_m_s": 25}, "tasks[5].turn_radius_m = 200.0: allowed: at least 212."),
]
OTHER_FILES = [
    ("patm", ("start",), "EGKK", "start = 'EGKK': allowed: a place of this file (EGTC, milton_keynes, EGGW)"),
    ("patm", ("tasks", 3, "to"), "EGTC", "tasks[3].to = 'EGTC': allowed: a place where the aircraft is not already"),
    ("patm", ("tasks", 3, "speed_m_s"), "50", "tasks[3].speed_m_s = '50': allowed: a number from 1 to 70"),
    ("patm", ("tasks", 2, "altitude_m"), 1500, "tasks[3].to = 'milton_keynes': allowed: a place at least "),
    ("patm", ("tasks", 2, "altitude_m"), 105, "tasks[2].altitude_m = 105.0: allowed for a climb: above 111.1, where "),
    ("patm", ("tasks", 6, "mass_change_kg"), -151, "tasks[6].mass_change_kg = -151.0: allowed: no more than is aboard"),
    ("patm", ("tasks", 12, "mass_change_kg"), -511, "tasks[12].mass_change_kg = -511.0: allowed: no more than is aboa"),
    ("patm", ("tasks", 6, "passengers"), 4, "tasks[6].passengers = 4: unknown key, allowed: kind, duration_s, mass_"),
    ("patm", ("tasks", 5), DELETE, "tasks[4].altitude_m: missing, needed unless a hover at the place of the cruise fo"),
    ("patm", ("handling", "bank_deg"), 50, "handling.bank_deg = 50: allowed: a number from 5 to 45"),
    (
        "patm",
        ("handling", "acceleration_g"),
        0.1,
        "handling.acceleration_g = 0.1: unknown key, allowed: acceleration_m",
    ),
    ("patm", ("places", "EGGW", "elevation_m"), 600.0, "tasks[9].to = 'EGGW': allowed: a place no higher than 560 m"),
    ("patm", ("wind",), {"from_deg": 0.0, "speed_m_s": "calm"}, "wind.speed_m_s = 'calm': allowed: a number from 0"),
    ("lem", ("tasks", 4, "pattern"), "figure_eight", "tasks[4].pattern = 'figure_eight': allowed: race_track, circle"),
    ("lem", ("tasks", 4, "pattern"), "circle", "tasks[4].leg_m = 1500.0: unknown key, allowed: kind, around, turn_rad"),
    ("lem", ("tasks", 4, "leg_m"), DELETE, "tasks[4].leg_m: missing"),
    ("lem", ("tasks", 4, "leg_m"), 50, "tasks[4].leg_m = 50: allowed: a number from 100 to 50000"),
    ("lem", ("tasks", 4, "turns"), "up", "tasks[4].turns = 'up': allowed: 'right' or 'left'"),
    ("lem", ("tasks", 4, "turns"), True, "tasks[4].turns = True: allowed: 'right' or 'left'"),
    ("lem", ("tasks", 4, "turn_radius_m"), 94, "tasks[4].turn_radius_m = 94.0: allowed: at least 94.2, a bank of 60 d"),
    ("lem", ("tasks", 4, "bank_deg"), 25, "tasks[4].bank_deg = 25: unknown key, allowed: kind, around, turn_radius_m"),
    ("lem", ("tasks", 4, "around"), "area_C", "tasks[4].around = 'area_C': allowed: a place of this file (LIMA, area_"),
    ("lem", ("tasks", 4, "duration_s"), 20, "tasks[4].duration_s = 20.0: allowed: more than "),
    ("lem", ("tasks", 4, "bearing_deg"), "NE", "tasks[4].bearing_deg = 'NE': allowed: a number from 0 to 360"),
    ("lem", ("tasks", 4, "spacing_m"), 700, "tasks[4].spacing_m = 700: unknown key, allowed: kind, around, turn_radiu"),
    ("lem", ("tasks", 2, "altitude_m"), 239, "tasks[2].altitude_m = 239.0: allowed for a climb: above 289.4, where it"),
    ("lem", ("places", "area_A", "elevation_m"), 601.0, "tasks[3].to = 'area_A': allowed: a place no higher than 600 "),
    ("lem", ("tasks", 10, "kind"), "land", f"tasks[10].kind = 'land': allowed: {KINDS}"),
    ("lem", ("wind",), {"from_deg": 0.0, "speed_m_s": 25.0, "altitude_m": 0}, "wind.altitude_m = 0: allowed: a list"),
    ("complete", ("tasks", 2, "height_m"), 2.0, "tasks[2].height_m = 2.0: allowed: above 2, where it begins, and at m"),
    ("complete", ("tasks", 2, "speed_m_s"), 3, "tasks[2].speed_m_s = 3: unknown key, allowed: kind, height_m, climb_r"),
    ("complete", ("tasks", 9, "acceleration_m_s2"), DELETE, "tasks[9].acceleration_m_s2: missing"),
    ("complete", ("tasks", 9, "to"), "east", "tasks[9].to = 'east': unknown key, allowed: kind, speed_m_s, accelerat"),
    ("complete", ("tasks", 7, "mass_change_kg"), DELETE, "tasks[7].mass_change_kg: missing"),
    ("complete", ("tasks", 7, "mass_change_kg"), -201, "tasks[7].mass_change_kg = -201.0: allowed: no more than is ab"),
    ("complete", ("tasks", 7, "duration_s"), 5, "tasks[7].duration_s = 5: unknown key, allowed: kind, mass_change_kg"),
    ("complete", ("tasks", 8, "leg_m"), 900, "tasks[8].leg_m = 900: unknown key, allowed: kind, around, turn_radius_"),
    ("complete", ("tasks", 12, "pattern"), "race_track", "tasks[12].pattern = 'race_track': allowed: creeping_line, "),
    ("complete", ("tasks", 13, "leg_m"), 900, "tasks[13].leg_m = 900: unknown key, allowed: kind, around, turn_radi"),
    ("complete", ("tasks", 13, "spacing_m"), 400, "tasks[13]: spacing_m = 400: allowed: at least "),
    ("complete", ("tasks", 13, "spacing_m"), DELETE, "tasks[13].spacing_m: missing"),
    ("complete", ("tasks", 14, "sector_m"), 300, "tasks[14]: sector_m = 300: allowed: at least "),
    ("complete", ("tasks", 14, "turns"), "left", "tasks[14].turns = 'left': unknown key, allowed: kind, around, turn"),
    ("complete", ("tasks", 15, "duration_s"), 2, "tasks[15].duration_s = 2.0: allowed: at least "),
    ("complete", ("tasks", 15, "duration_s"), DELETE, "tasks[15].to: missing, allowed: one of to, duration_s and dis"),
    ("complete", ("tasks", 15, "distance_m"), 900, "tasks[15].to: missing, allowed: one of to, duration_s and distan"),
    ("complete", ("tasks", 16, "distance_m"), 120, "tasks[16].distance_m = 120.0: allowed: at least "),
    ("complete", ("tasks", 22, "kind"), "landed", f"tasks[22].kind = 'landed': allowed: {KINDS}"),
]
HAND = [("sarm", *entry) for entry in VARIANTS] + OTHER_FILES


@pytest.mark.parametrize(("file", "path", "value", "message"), HAND, ids=[f"{e[0]}-{e[3][:60]}" for e in HAND])
def test_what_is_wrong_is_said_in_one_line(tmp_path, file, path, value, message):
    assert refusal(tmp_path, changed(path, value, file)).startswith(message)


@pytest.mark.parametrize(
    ("percent", "ends", "limits", "message"),
    [
        ([75.0, 115.0], "free", [70.0, 120.0], "allowed: a band that leaves some of rotor_speed_percent, 75 to 115"),
        ([100.0, 100.0], "periodic", [90.0, 101.0], "allowed: a band that leaves some of rotor_speed_percent, 100 to"),
        (
            [75.0, 115.0],
            "free",
            [97.0, 103.0],
            "allowed: a band without 100 %, at which the rotor turns in tasks[0] (i",
        ),
        ([100.0, 100.0], "free", [90.0, 100.0], None),
        ([75.0, 115.0], "free", [70.0, 100.0], None),
    ],
)
def test_a_band_leaves_rotor_speeds_and_idle(percent, ends, limits, message):
    data = changed(("limits",), {"rotor_speed_percent": percent, "ends": ends, BANDS[1]: [band(*limits)]}, "sarm")
    if message is None:
        mission_from(data, where="x")
        return
    with pytest.raises(InputError) as error:
        mission_from(data, where="x")
    assert str(error.value).startswith(f"x: limits.forbidden_rotor_speed[0].percent = {limits}: {message}")


def test_the_variants_are_different():
    documents = {document(changed(path, value, file)) for file, path, value, _ in HAND}
    assert len(documents) == len(HAND) >= 200


# what is not, by the range of every number there is

SPEED, DURATION, BEARING, MASS = (1, 70), (1, 20_000), (0, 360), (-1000, 1000)
LEG, RADIUS, SPACING = (100, 50_000), (20, 10_000), (50, 20_000)
RANGES = {
    ("isa_offset_k",): (-40, 40),
    ("places", "home", "latitude_deg"): (-90, 90),
    ("places", "home", "longitude_deg"): (-180, 180),
    ("places", "north", "elevation_m"): (0, 2000),
    ("loading", "empty_kg"): (0, 2500),
    ("loading", "crew_kg"): (0, 2500),
    ("loading", "equipment_kg", "load"): (0, 2500),
    ("loading", "reserve_minutes"): (0, 120),
    ("limits", "rotor_speed_percent", 0): (75, 115),
    ("limits", "rotor_speed_percent", 1): (75, 115),
    ("limits", "twist_deg", 0): (6, 16),
    ("limits", "twist_deg", 1): (6, 16),
    ("limits", "rotor_speed_rate_percent_s"): (0.01, 20),
    ("limits", "twist_rate_deg_s"): (0.01, 20),
    ("limits", "rotor_speed_acceleration_percent_s2"): (0.001, 100),
    ("limits", "twist_acceleration_deg_s2"): (0.001, 100),
    ("limits", "forbidden_rotor_speed", 0, "percent", 0): (0, 200),
    ("limits", "forbidden_rotor_speed", 0, "percent", 1): (0, 200),
    ("limits", "forbidden_rotor_speed", 0, "crossing_s"): (0, 3600),
    ("limits", "manoeuvre_margin"): (1, 2),
    ("handling", "acceleration_m_s2"): (0.05, 3),
    ("handling", "cruise_acceleration_m_s2"): (0.05, 3),
    ("handling", "vertical_acceleration_m_s2"): (0.05, 2),
    ("handling", "bank_deg"): (5, 45),
    ("handling", "roll_in_s"): (0.5, 10),
    ("wind", "altitude_m", 0): (0, 2000),
    ("tasks", 0, "duration_s"): DURATION,
    ("tasks", 0, "mass_change_kg"): MASS,
    ("tasks", 1, "duration_s"): DURATION,
    ("tasks", 1, "height_m"): (0, 500),
    ("tasks", 1, "mass_change_kg"): MASS,
    ("tasks", 2, "height_m"): (0, 500),
    ("tasks", 2, "climb_rate_m_s"): (0.1, 6),
    ("tasks", 3, "altitude_m"): (0, 2000),
    ("tasks", 3, "speed_m_s"): SPEED,
    ("tasks", 3, "climb_angle_deg"): (0.5, 30),
    ("tasks", 5, "speed_m_s"): SPEED,
    ("tasks", 6, "leg_m"): LEG,
    ("tasks", 6, "bearing_deg"): BEARING,
    ("tasks", 6, "turn_radius_m"): RADIUS,
    ("tasks", 6, "speed_m_s"): SPEED,
    ("tasks", 6, "duration_s"): DURATION,
    ("tasks", 7, "mass_change_kg"): MASS,
    ("tasks", 8, "turn_radius_m"): RADIUS,
    ("tasks", 8, "duration_s"): DURATION,
    ("tasks", 9, "speed_m_s"): SPEED,
    ("tasks", 9, "acceleration_m_s2"): (0.05, 3),
    ("tasks", 11, "altitude_m"): (0, 2000),
    ("tasks", 11, "climb_angle_deg"): (-30, -0.5),
    ("tasks", 12, "leg_m"): LEG,
    ("tasks", 12, "leg_bearing_deg"): BEARING,
    ("tasks", 12, "spacing_m"): SPACING,
    ("tasks", 13, "spacing_m"): SPACING,
    ("tasks", 13, "bearing_deg"): BEARING,
    ("tasks", 14, "sector_m"): LEG,
    ("tasks", 14, "bearing_deg"): BEARING,
    ("tasks", 15, "duration_s"): DURATION,
    ("tasks", 15, "course_deg"): BEARING,
    ("tasks", 16, "distance_m"): (100, 500_000),
    ("tasks", 22, "duration_s"): DURATION,
    ("tasks", 22, "mass_change_kg"): MASS,
}


@pytest.mark.parametrize(("path", "limits"), RANGES.items(), ids=map(field, RANGES))
def test_every_number_has_its_range(path, limits):
    low, high = limits
    past = 1e-9 * max(abs(low), abs(high))
    wrong = [low - past, high + past, -1e30, 10**40, inf, -inf, nan, str(high), True, [high], {"value": high}, ""]
    for value in wrong:
        with pytest.raises(InputError) as error:
            mission_from(changed(path, value, "complete"), where="x")
        assert str(error.value).startswith(f"x: {field(path)} = "), value
        assert str(error.value).endswith(f": allowed: a number from {low:g} to {high:g}"), value


@pytest.mark.parametrize(("path", "limits"), RANGES.items(), ids=map(field, RANGES))
def test_the_ends_of_a_range_are_in_it(path, limits):
    """Whatever else they may be wrong for."""
    for value in limits:
        try:
            mission_from(changed(path, value, "complete"), where="x")
        except InputError as error:
            assert "allowed: a number from" not in str(error)


# what is not, at random


def numbers(at, path=()):
    """Paths of all numbers of a mission."""
    items = at.items() if isinstance(at, dict) else enumerate(at) if isinstance(at, list) else ()
    for key, value in items:
        if isinstance(value, float | int) and not isinstance(value, bool):
            yield (*path, key)
        yield from numbers(value, (*path, key))


def tables(at, path=()):
    """Paths of all tables with fixed keys."""
    if isinstance(at, dict) and path not in ((), ("places",), ("loading", "equipment_kg")):
        yield path
    items = at.items() if isinstance(at, dict) else enumerate(at) if isinstance(at, list) else ()
    for key, value in items:
        if isinstance(value, dict | list):
            yield from tables(value, (*path, key))


NUMBERS = [(name, path) for name, data in FILES.items() for path in numbers(data)]
TABLES = [(name, path) for name, data in FILES.items() for path in tables(data)]
NOT_NUMBERS = st.one_of(
    st.sampled_from([nan, inf, -inf, True, [], {}, "", 10**30, 1e300, -1e9]),
    st.text(alphabet=st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"]), max_size=100),
    st.floats(min_value=500_001.0),
    st.floats(max_value=-1001.0),
    st.lists(st.integers(), max_size=60),
)


@pytest.mark.slow
@settings(deadline=None, max_examples=400, database=None)
@given(which=st.sampled_from(NUMBERS), value=NOT_NUMBERS)
def test_no_number_of_a_file_takes_anything_else(tmp_path_factory, which, value):
    file, path = which
    message = refusal(tmp_path_factory.getbasetemp(), changed(path, value, file))
    whole = path[:2] if path[0] == "wind" and path[1] != "altitude_m" else path  # one number or a list
    assert message.startswith(f"{field(whole)} = ")
    assert ": allowed: a number from " in message


@settings(deadline=None, max_examples=150, database=None)
@given(which=st.sampled_from(TABLES), key=st.text(alphabet="abcxyz\n\"' .é", min_size=1, max_size=12))
def test_no_table_takes_an_unknown_key(tmp_path_factory, which, key):
    file, path = which
    message = refusal(tmp_path_factory.getbasetemp(), changed((*path, key), 1.0, file))
    assert message.startswith(f"{field(path)}.")
    assert " = 1.0: unknown key, allowed: " in message


def entries(at, path=()):
    """Paths of everything there is in a mission."""
    items = at.items() if isinstance(at, dict) else enumerate(at) if isinstance(at, list) else ()
    for key, value in items:
        yield (*path, key)
        yield from entries(value, (*path, key))


ENTRIES = [(name, path) for name, data in FILES.items() for path in entries(data)]
ANYTHING = st.recursive(
    st.one_of(st.booleans(), st.integers(-(10**6), 10**6), st.floats(), st.text(max_size=10)),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(st.text(max_size=5), inner, max_size=3)),
    max_leaves=4,
)


@pytest.mark.slow
@settings(deadline=None, max_examples=100, database=None)
@given(which=st.sampled_from(ENTRIES), value=st.one_of(ANYTHING, st.just(DELETE)))
def test_anything_anywhere_is_read_or_refused_in_one_line(which, value):
    file, path = which
    try:
        Profile.of(mission_from(changed(path, value, file), where="x"), where="x")
    except InputError as error:
        pattern = r'^x: (([\w\[\]. -]|"([^"\\]|\\.)*")+(: missing| = )|tasks\[\d+\]: \w+ = |wind = ).*'
        assert re.match(pattern, str(error)) and "\n" not in str(error), str(error)


@pytest.mark.parametrize("file", FILES)
def test_nothing_that_has_to_be_there_may_be_left_out(file):
    """Each entry of the file left out: it is missing, or has a default, or other tasks no longer follow each other."""
    missing = 0
    for path in entries(FILES[file]):
        if isinstance(path[-1], int):
            continue
        try:
            mission_from(changed(path, DELETE, file), where="x")
        except InputError as error:
            missing += "missing" in str(error)
            assert re.match(r"x: [\w.\[\]]+(: missing| = )", str(error))
    assert missing >= 30


# the file as a text


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no such file"),
        (b"tasks = [", "not a TOML file: "),
        (b"\xff\xfe\x00", "not a TOML file: "),
        (b"\xef\xbb\xbfname = 'x'", "not a TOML file: "),
        (b'name = "a"\nname = "b"', "not a TOML file: Cannot overwrite a value"),
        (b"[loading]\nempty_kg = 1\n[loading]\ncrew_kg = 2", "not a TOML file: Cannot declare ('loading',) twice"),
        (b"[handling]\nbank_deg = 20\nbank_deg = 25", "not a TOML file: Cannot overwrite a value"),
        (b"name = SARM", "not a TOML file: Invalid value"),
        (b"isa_offset_k = 1,5", "not a TOML file: "),
        (b"isa_offset_k = 010", "not a TOML file: "),
        (b"name: SARM", "not a TOML file: "),
        (b'{"name": "SARM"}', "not a TOML file: "),
        (b'name = "x\ny"', "not a TOML file: "),
        (b"name = 'x'\ntasks = 5\n[[tasks]]\nkind = 'idle'", "not a TOML file: "),
        (b"", "name: missing"),
        (b"# nothing", "name: missing"),
        (b"name = 2026-01-01", "name = datetime.date(2026, 1, 1): allowed: a text"),
        (b"name = 'x'\naircraft = 'bo105'\nstart = 1979-05-27T07:32:00Z", "start = datetime.datetime(1979, 5, 27"),
    ],
)
def test_a_file_that_can_not_be_read(tmp_path, content, message):
    file = tmp_path / "broken.toml"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(InputError) as error:
        read_mission(file)
    assert str(error.value).startswith(f"{file}: {message}") and "\n" not in str(error.value)


def test_a_number_of_thousands_of_digits_is_refused(tmp_path):
    file = tmp_path / "long.toml"
    file.write_text(SARM.read_text().replace("empty_kg = 1300.0", "empty_kg = 0x" + "F" * 9000))
    with pytest.raises(InputError, match="thousands of digits.*allowed: a number from 0 to 2500"):
        read_mission(file)


def test_a_list_in_lists_without_end_is_refused(tmp_path):
    file = tmp_path / "deep.toml"
    file.write_text("name = " + "[" * 5000 + "]" * 5000)
    with pytest.raises(InputError, match="not a TOML file: "):
        read_mission(file)
