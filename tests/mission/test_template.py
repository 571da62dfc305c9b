"""The template of a mission: what its comments say is what the program allows."""

import re
import tomllib
from importlib import resources
from typing import Any

import pytest

import vrsopt
from vrsopt.mission.file import Handling, Limits, Loading, Mission, Place, mission_from
from vrsopt.mission.profile import Profile
from vrsopt.mission.task_types import KINDS

TEXT = (resources.files("vrsopt") / "data" / "mission_template.toml").read_text(encoding="utf-8")
OPTIONAL = re.sub(r"^# (?=\[wind\]|from_deg|speed_m_s|manoeuvre_margin)", "", TEXT, flags=re.M)
RANGED = re.compile(r"^(\w+) = (.*?) *# .*?(\S+), (-?[\d.]+) to (-?[\d.]+)$", re.M)
UNITS = {
    "deg": "deg",
    "m": "m",
    "kg": "kg",
    "s": "s",
    "m_s": "m/s",
    "m_s2": "m/s2",
    "k": "K",
    "minutes": "min",
    "deg_s": "deg/s",
    "percent": "%",
    "percent_s": "s",
    "margin": "-",
}


def test_template_is_a_mission_that_can_be_flown():
    for text in (TEXT, OPTIONAL):
        mission = mission_from(tomllib.loads(text), where="template")
        profile = Profile.of(mission)
        assert 1200.0 < profile.duration < 2400.0
    assert mission.wind.speed_m_s == 5.0 and mission.limits.manoeuvre_margin == 1.3
    assert len({task.kind for task in mission.tasks}) >= 6


def test_every_table_is_there_with_every_key_that_a_beginner_needs():
    data = tomllib.loads(OPTIONAL)
    assert set(data) == set(Mission.model_fields)
    assert set(data["places"]["base"]) == set(Place.model_fields)
    assert set(data["loading"]) == set(Loading.model_fields)
    assert set(data["handling"]) == set(Handling.model_fields)
    assert set(data["limits"]) <= set(Limits.model_fields)
    assert set(re.search(r"Kinds: ([^.]*)\.", TEXT.replace("\n# ", " "))[1].split(", ")) == set(KINDS)


def test_every_key_is_explained():
    lines = [line for line in OPTIONAL.splitlines() if re.match(r"\w+ = ", line)]
    plain = [line for line in lines if "#" not in line]
    assert all(line.partition(" ")[0] in ("kind", "to") for line in plain)  # explained where they come first


@pytest.mark.parametrize("key", [found.span() for found in RANGED.finditer(OPTIONAL)], ids=lambda span: str(span[0]))
def test_comment_has_the_unit_and_the_range_of_its_key(key):
    line = OPTIONAL[slice(*key)]
    name, value, unit, low, high = RANGED.match(line).groups()
    known = [UNITS[name.split("_", k)[-1]] for k in range(name.count("_") + 1) if name.split("_", k)[-1] in UNITS]
    assert not known or unit == known[0]
    is_list = value.startswith("[")
    for wrong in (-1e9, 1e9):
        stated = f"{[wrong, wrong]}" if is_list else str(wrong)
        changed = OPTIONAL[: key[0]] + f"{name} = {stated}" + OPTIONAL[key[1] :]
        with pytest.raises(vrsopt.InputError, match=rf"{name}.* from {low} to {high}\b"):
            mission_from(tomllib.loads(changed), where="template")


def test_every_number_has_its_range():
    ranged = {found[1] for found in RANGED.finditer(OPTIONAL)}
    assert ranged == set(_numbers(tomllib.loads(OPTIONAL)))


def _numbers(data: Any, name: str = "") -> list[str]:
    """Names of what is a number, or begins with one."""
    if isinstance(data, dict):
        return [key for inner, value in data.items() for key in _numbers(value, inner)]
    if isinstance(data, list) and isinstance(data[0], dict):
        return [key for value in data for key in _numbers(value)]
    first = data[0] if isinstance(data, list) else data
    return [name] if isinstance(first, float) else []
