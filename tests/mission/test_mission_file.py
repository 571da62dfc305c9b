import copy
import json
import re
import tomllib
from math import inf, nan
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vrsopt.errors import InputError
from vrsopt.mission.file import Mission, mission_from, read_mission
from vrsopt.mission.profile import Profile

SARM = Path(__file__).parents[2] / "problems" / "sarm.toml"
DATA = tomllib.loads(SARM.read_text())
DELETE = object()
PICK_UP = {"duration_s": 180, "mass_change_kg": 240}


def toml(value) -> str:
    """A value as TOML; strings and numbers are written as in JSON but for NaN and infinity."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(toml(item) for item in value) + "]"
    return json.dumps(value).replace("NaN", "nan").replace("Infinity", "inf")


def document(data: dict) -> str:
    return "\n".join(f"{json.dumps(key)} = {toml(value)}" for key, value in data.items())


def changed(path, value) -> dict:
    """The data of the shipped mission with one entry changed, added or deleted."""
    data = copy.deepcopy(DATA)
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
    file.write_text(document(data))
    with pytest.raises(InputError) as error:
        read_mission(file)
    message = str(error.value)
    assert message.startswith(f"{file}: ") and "\n" not in message
    assert error.value.__suppress_context__
    return message.removeprefix(f"{file}: ")


def test_shipped_mission_reads():
    mission = read_mission(SARM)
    assert (mission.name, mission.aircraft, mission.start) == ("SARM", "bo105", "KSFO")
    assert mission.loading.zero_fuel_mass == 1615.0
    assert mission.limits.rotor_speed_percent == (75.0, 115.0)


def test_assumptions_are_marked():
    text = SARM.read_text()
    assert text.count("(assumed)") > 30
    for line in text.splitlines():
        if line.startswith(("empty_kg", "crew_kg", "reserve_minutes", "duration_s", "leg_m", "mass_change_kg")):
            assert "(assumed)" in line


def test_round_trip(tmp_path):
    mission = read_mission(SARM)
    file = tmp_path / "again.toml"
    file.write_text(document(mission.model_dump(mode="json", exclude_none=True)))
    again = read_mission(file)
    assert again == mission
    assert Profile.of(again) == Profile.of(mission)
    assert Mission.model_validate_json(mission.model_dump_json()) == mission


def test_limits_and_offset_have_the_defaults_shared_by_the_missions():
    data = {key: value for key, value in DATA.items() if key not in ("limits", "isa_offset_k")}
    mission = mission_from(data, where="x")
    limits = {key: value for key, value in DATA["limits"].items() if key != "manoeuvre_margin"}
    assert mission == mission_from({**data, "isa_offset_k": 0.0, "limits": limits}, where="x")
    assert mission.limits.manoeuvre_margin is None  # the aircraft's own


VARIANTS = [
    (("name",), DELETE, "name: missing"),
    (("name",), "", "name = '': allowed: a text that is not empty"),
    (("name",), 7, "name = 7: allowed: a text"),
    (("aircraft",), 105, "aircraft = 105: allowed: a text"),
    (("aircraft",), DELETE, "aircraft: missing"),
    (("start",), DELETE, "start: missing"),
    (
        ("start",),
        "Oakland",
        "start = 'Oakland': allowed: a place of this file (KSFO, incident, search_area, brookside)",
    ),
    (("isa_offset_k",), 90, "isa_offset_k = 90: allowed: a number from -40 to 40"),
    (("isa_offset_k",), nan, "isa_offset_k = nan: allowed: a number from -40 to 40"),
    (("colour",), "red", "colour = 'red': unknown key, allowed: name, aircraft, start, isa_offset_k, places, loading"),
    (("places",), DELETE, "places: missing"),
    (("places",), {}, "places = {}: allowed: at least one entry"),
    (("places",), 3, "places = 3: allowed: a table"),
    (("places", "KSFO"), [1, 2, 3], "places.KSFO = [1, 2, 3]: allowed: a table"),
    (("places", "KSFO", "latitude_deg"), 97.0, "places.KSFO.latitude_deg = 97.0: allowed: a number from -90 to 90"),
    (("places", "KSFO", "longitude_deg"), -181, "places.KSFO.longitude_deg = -181: allowed: a number from -180 to 180"),
    (("places", "KSFO", "elevation_m"), -3.0, "places.KSFO.elevation_m = -3.0: allowed: a number from 0 to 2000"),
    (("places", "KSFO", "elevation_m"), DELETE, "places.KSFO.elevation_m: missing"),
    (
        ("places", "KSFO", "icao"),
        "X",
        "places.KSFO.icao = 'X': unknown key, allowed: latitude_deg, longitude_deg, elev",
    ),
    (("places", "a\nb"), {}, 'places."a\\nb".latitude_deg: missing'),
    (("places", ""), DATA["places"]["KSFO"], "places.\"\" = '': allowed: a text that is not empty"),
    (("loading",), DELETE, "loading: missing"),
    (("loading",), "heavy", "loading = 'heavy': allowed: a table"),
    (("loading", "empty_kg"), -1300.0, "loading.empty_kg = -1300.0: allowed: a number from 0 to 2500"),
    (("loading", "empty_kg"), DELETE, "loading.empty_kg: missing"),
    (("loading", "empty_kg"), inf, "loading.empty_kg = inf: allowed: a number from 0 to 2500"),
    (("loading", "crew_kg"), "two", "loading.crew_kg = 'two': allowed: a number from 0 to 2500"),
    (("loading", "crew_kg"), "170", "loading.crew_kg = '170': allowed: a number from 0 to 2500"),
    (("loading", "fuel_kg"), 300, "loading.fuel_kg = 300: unknown key, allowed: empty_kg, crew_kg, equipment_kg, res"),
    (("loading", "equipment_kg"), 145, "loading.equipment_kg = 145: allowed: a table"),
    (("loading", "equipment_kg", "winch"), -1, "loading.equipment_kg.winch = -1: allowed: a number from 0 to 2500"),
    (("loading", "reserve_minutes"), True, "loading.reserve_minutes = True: allowed: a number from 0 to 120"),
    (("limits",), [], "limits = []: allowed: a table"),
    (("limits", "rotor_speed_percent"), [60, 115], "limits.rotor_speed_percent[0] = 60: allowed: a number from 75 to"),
    (("limits", "rotor_speed_percent"), [115, 75], "limits.rotor_speed_percent = [115.0, 75.0]: allowed: [lower, upp"),
    (("limits", "rotor_speed_percent"), 100, "limits.rotor_speed_percent = 100: allowed: a list"),
    (("limits", "twist_deg"), [6], "limits.twist_deg[1]: missing"),
    (("limits", "twist_deg"), [6, 8, 16], "limits.twist_deg = [6, 8, 16]: allowed: two numbers, [lower, upper]"),
    (("limits", "twist_deg"), [6, nan], "limits.twist_deg[1] = nan: allowed: a number from 6 to 16"),
    (("limits", "twist_rate_deg_s"), 0, "limits.twist_rate_deg_s = 0: allowed: a number from 0.01 to 20"),
    (("limits", "limits"), "none", "limits.limits = 'none': allowed: 'manual' or 'study'"),
    (("limits", "manoeuvre_margin"), 0.5, "limits.manoeuvre_margin = 0.5: allowed: a number from 1 to 2"),
    (("limits", "margin"), 1.3, "limits.margin = 1.3: unknown key, allowed: rotor_speed_percent, twist_deg, "),
    (("tasks",), [], "tasks = []: allowed: at least one entry"),
    (("tasks",), DELETE, "tasks: missing"),
    (("tasks",), {"kind": "idle"}, "tasks = {'kind': 'idle'}: allowed: a list"),
    (("tasks", 0), 3, "tasks[0] = 3: allowed: a table"),
    (("tasks", 0, "kind"), DELETE, "tasks[0].kind: missing, allowed: idle, hover, climb, cruise, descent, search"),
    (("tasks", 0, "kind"), "park", "tasks[0].kind = 'park': allowed: idle, hover, climb, cruise, descent, search"),
    (("tasks", 0, "kind"), ["idle"], "tasks[0].kind = ['idle']: allowed: idle, hover, climb, cruise, descent, search"),
    (("tasks", 0, "duration_s"), -5, "tasks[0].duration_s = -5: allowed: a number from 1 to 20000"),
    (("tasks", 0, "mass_change_kg"), 80, "tasks[0].mass_change_kg = 80.0: allowed for the first task: 0 (state in [l"),
    (("tasks", 1, "height_m"), "low", "tasks[1].height_m = 'low': allowed: a number from 0 to 500"),
    (("tasks", 1, "height_m"), 50, "tasks[1].height_m = 50.0: allowed after an idle task: at most 5"),
    (("tasks", 2, "altitude_m"), 2500, "tasks[2].altitude_m = 2500: allowed: a number from 0 to 2000"),
    (("tasks", 2, "altitude_m"), 3, "tasks[2].altitude_m = 3.0: allowed for a climb: above 6, where it begins"),
    (("tasks", 2, "altitude_m"), DELETE, "tasks[2].altitude_m: missing"),
    (("tasks", 2, "climb_angle_deg"), -7.12, "tasks[2].climb_angle_deg = -7.12: allowed: a number from 0.5 to 30"),
    (("tasks", 3, "speed_m_s"), 300, "tasks[3].speed_m_s = 300: allowed: a number from 1 to 70"),
    (("tasks", 3, "speed_m_s"), nan, "tasks[3].speed_m_s = nan: allowed: a number from 1 to 70"),
    (("tasks", 3, "speed_kt"), 90, "tasks[3].speed_kt = 90: unknown key, allowed: kind, to, speed_m_s"),
    (("tasks", 3, "to"), "Alcatraz", "tasks[3].to = 'Alcatraz': allowed: a place of this file (KSFO, incident, "),
    (("tasks", 3, "to"), "KSFO", "tasks[3].to = 'KSFO': allowed: a place at least 4355 m away, as far as the climbs"),
    (("tasks", 4, "altitude_m"), 400, "tasks[4].altitude_m = 400.0: allowed for a descent: below 300, where it beg"),
    (("tasks", 4, "altitude_m"), DELETE, "tasks[4].altitude_m: missing: needed unless a hover follows"),
    (("tasks", 5, "around"), "bay", "tasks[5].around = 'bay': allowed: a place of this file (KSFO, incident, "),
    (("tasks", 5, "spacing_m"), 300, "tasks[5].spacing_m = 300.0: allowed: at least twice turn_radius_m, 400"),
    (("tasks", 5, "turn_radius_m"), 50, "tasks[5].turn_radius_m = 50.0: allowed: at least 72.1, a bank of 60 deg"),
    (("tasks", 5, "duration_s"), 5, "tasks[5].duration_s = 5.0: allowed: more than "),
    (("tasks", 8, "height_m"), 20, "tasks[8].height_m = 20.0: allowed here: 30, the height the aircraft has"),
    (("tasks", 8, "mass_change_kg"), -500, "tasks[8].mass_change_kg = -500.0: allowed: no more than is aboard, 145 kg"),
    (("tasks", 13, "mass_change_kg"), -400, "tasks[13].mass_change_kg = -400.0: allowed: no more than is aboard, 385"),
    (("places", "brookside", "elevation_m"), 400, "tasks[10].to = 'brookside': allowed: a place no higher than 300 m"),
    (
        ("places", "search_area", "elevation_m"),
        60,
        "tasks[5].around = 'search_area': allowed: a place no higher than 5",
    ),
    (("places", "incident", "elevation_m"), 70, "tasks[3].to = 'incident': allowed: a place no higher than 50 m, the"),
    (("tasks", 6), DELETE, "tasks[6].kind = 'descent': allowed: only with a cruise that says where to"),
    (("tasks", 12), DELETE, "tasks[11].altitude_m: missing: needed unless a hover follows"),
    (("tasks", 6), {"kind": "hover", "duration_s": 9}, "tasks[6].kind = 'hover': allowed: at a place; a cruise to one"),
    (("tasks", 1), {"kind": "idle", "duration_s": 9}, "tasks[2].kind = 'climb': allowed: after a hover, not from the"),
    (("tasks", 8, "kind"), "idle", "tasks[8].height_m = 30.0: unknown key, allowed: kind, duration_s, mass_change_kg"),
    (("tasks", 8), {**PICK_UP, "kind": "idle"}, "tasks[8].kind = 'idle': allowed: as the first task or after a"),
    (("tasks", 9), {"kind": "idle", "duration_s": 9}, "tasks[9].kind = 'idle': allowed: after a hover at most 5 m"),
    (("tasks", 0), DATA["tasks"][2], "tasks[0].kind = 'climb': allowed for the first and the last task: idle, hover"),
    (("tasks", 19), DATA["tasks"][17], "tasks[19].kind = 'descent': allowed for the first and the last task: idle, h"),
]


@pytest.mark.parametrize(("path", "value", "message"), VARIANTS, ids=[entry[2][:60] for entry in VARIANTS])
def test_what_is_wrong_is_said_in_one_line(tmp_path, path, value, message):
    assert refusal(tmp_path, changed(path, value)).startswith(message)


def numbers(at=DATA, path=()):
    """Paths of all numbers of the shipped mission."""
    items = at.items() if isinstance(at, dict) else enumerate(at) if isinstance(at, list) else ()
    for key, value in items:
        if isinstance(value, float | int):
            yield (*path, key)
        yield from numbers(value, (*path, key))


def tables(at=DATA, path=()):
    """Paths of all tables with fixed keys."""
    if isinstance(at, dict) and path not in ((), ("places",), ("loading", "equipment_kg")):
        yield path
    items = at.items() if isinstance(at, dict) else enumerate(at) if isinstance(at, list) else ()
    for key, value in items:
        if isinstance(value, dict | list):
            yield from tables(value, (*path, key))


NOT_NUMBERS = st.one_of(
    st.sampled_from([nan, inf, -inf, True, [], {}, "", 10**30, 1e300, -1e9]),
    st.text(alphabet=st.characters(codec="ascii", exclude_categories=["Cc"]), max_size=100),
    st.floats(min_value=20_001.0),
    st.floats(max_value=-1001.0),
    st.lists(st.integers(), max_size=60),
)


@settings(deadline=None, max_examples=300, database=None)
@given(path=st.sampled_from(list(numbers())), value=NOT_NUMBERS)
def test_no_number_of_the_file_takes_anything_else(tmp_path_factory, path, value):
    message = refusal(tmp_path_factory.getbasetemp(), changed(path, value))
    assert message.startswith(f"{field(path)} = ")
    assert ": allowed: a number from " in message


@settings(deadline=None, max_examples=100, database=None)
@given(path=st.sampled_from(list(tables())), key=st.text(alphabet="abcxyz\n\"' .é", min_size=1, max_size=12))
def test_no_table_takes_an_unknown_key(tmp_path_factory, path, key):
    message = refusal(tmp_path_factory.getbasetemp(), changed((*path, key), 1.0))
    assert message.startswith(f"{field(path)}.")
    assert " = 1.0: unknown key, allowed: " in message


PLACES = st.sampled_from(list(DATA["places"]))
EN_ROUTE = st.one_of(
    st.builds(lambda to: {"kind": "cruise", "to": to, "speed_m_s": 48}, PLACES),
    st.builds(lambda h: {"kind": "climb", "altitude_m": h}, st.integers(100, 600)),
    st.builds(lambda h: {"kind": "descent", "altitude_m": h}, st.integers(30, 500)),
    st.builds(lambda place: {**DATA["tasks"][5], "around": place}, PLACES),
)


@settings(deadline=None, max_examples=200, database=None)
@given(tasks=st.lists(EN_ROUTE, max_size=6))
def test_tasks_in_any_order_are_flown_without_a_gap_or_refused_in_one_line(tasks):
    """Whatever tasks follow each other: a profile with continuous positions, or one line that says why not."""
    home = {"kind": "cruise", "to": "KSFO", "speed_m_s": 48}
    out = [*DATA["tasks"][:3], {**home, "to": "brookside"}]
    data = {**DATA, "tasks": [*out, *tasks, home, *DATA["tasks"][-3:]]}
    try:
        profile = Profile.of(mission_from(data, where="x"))
    except InputError as error:
        assert re.match(r"SARM: tasks\[\d+\]\.\w+( = .+)?: (allowed|missing)", str(error))
        assert "\n" not in str(error)
    else:
        inner = profile.edges[1:-1]
        before = np.array(profile.positions(np.arange(inner.size), inner))
        after = np.array(profile.positions(np.arange(1, inner.size + 1), inner))
        assert np.abs(before - after).max() < 1e-8  # deg, about 1 mm
        assert profile.duration > 1000.0


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no such file"),
        (b"tasks = [", "not a TOML file: "),
        (b"\xff\xfe\x00", "not a TOML file: "),
        (b"", "name: missing"),
    ],
)
def test_a_file_that_can_not_be_read(tmp_path, content, message):
    file = tmp_path / "broken.toml"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(InputError) as error:
        read_mission(file)
    assert str(error.value).startswith(f"{file}: {message}")


def test_a_number_of_thousands_of_digits_is_refused(tmp_path):
    file = tmp_path / "long.toml"
    file.write_text(SARM.read_text().replace("empty_kg = 1300.0", "empty_kg = 0x" + "F" * 9000))
    with pytest.raises(InputError, match="thousands of digits.*allowed: a number from 0 to 2500"):
        read_mission(file)
