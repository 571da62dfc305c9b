"""Bands of the saving: whose they are, and what a report says."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from vrsopt.helicopter import MODEL_VERSION, helicopter
from vrsopt.mission.file import mission_from, read_mission
from vrsopt.report.saving_band import band_sentence, known_bands, mission_hash, saving_band
from vrsopt.report.tables import summary_text

PROBLEMS = Path(__file__).parents[2] / "problems"
NAMES = ("patm", "lem", "sarm")
SAME = {"variables": "both", "objective": "fuel", "model_version": MODEL_VERSION, "data_hash": helicopter().data_hash}


def flown(comparison, mission, percent=None, **changes):
    """The comparison as if it were of a mission, its trajectory saving ``percent``, by default what was studied."""
    studied = known_bands()["missions"].get(mission_hash(mission), {"shipped_percent": 10.0})["shipped_percent"]
    result = comparison.results["trajectory"]
    other = replace(result, fuel_physics_delta_percent=-(studied if percent is None else percent))
    results = {**comparison.results, "trajectory": other}
    return replace(
        comparison, mission=mission, results=results, provenance={**comparison.provenance, **SAME, **changes}
    )


@pytest.mark.parametrize("name", NAMES)
def test_shipped_missions_have_the_bands_of_the_study(comparison, name):
    """With the model and the data as they are now: whoever changes one of them has to repeat the study."""
    study = json.loads((PROBLEMS / "uncertainty.json").read_text(encoding="utf-8"))
    known, mission = known_bands(), read_mission(PROBLEMS / f"{name}.toml")
    assert (known["model_version"], known["data_hash"]) == (MODEL_VERSION, helicopter().data_hash)
    band = saving_band(flown(comparison, mission), "trajectory")
    cost = study["reference"][name]["saving"] - study["schedules"][name]["trajectory"]
    assert band == pytest.approx([value - cost for value in study["samples"]["bands"]["saving"][name]])
    assert band[0] < study["schedules"][name]["trajectory"] < band[2]
    text = band_sentence(flown(comparison, mission), "trajectory")
    assert f"save {band[0]:.1f} to {band[2]:.1f} %" in text and known["command"] in text


def test_whatever_is_not_what_was_studied_has_no_band(comparison):
    sarm = read_mission(PROBLEMS / "sarm.toml")
    hot = mission_from(sarm.model_dump(mode="json", exclude_none=True) | {"isa_offset_k": 20.0}, where="sarm")
    assert saving_band(flown(comparison, sarm), "pointwise") is None
    assert saving_band(flown(comparison, hot), "trajectory") is None
    assert saving_band(flown(comparison, sarm), "trajectory") is not None
    assert saving_band(flown(comparison, sarm, 11.0), "trajectory") is None  # by a poor surrogate, say
    assert saving_band(flown(comparison, sarm, float("nan")), "trajectory") is None
    for name, value in (
        ("variables", "speed"),
        ("objective", '{"nox": 1.0}'),
        ("data_hash", "0"),
        ("model_version", "0"),
    ):
        assert saving_band(flown(comparison, sarm, **{name: value}), "trajectory") is None, name
    text = band_sentence(flown(comparison, hot), "trajectory")
    assert "was not studied" in text and all(name.upper() in text for name in NAMES)


def test_terminal_says_how_sure_it_is(comparison):
    text = " ".join(summary_text(comparison).split())
    assert "Where the saving comes from" in text and "How sure that is was not studied for this schedule." in text


def test_layout_of_a_mission_file_does_not_matter(tmp_path):
    text = (PROBLEMS / "patm.toml").read_text(encoding="utf-8")
    other = tmp_path / "patm.toml"
    other.write_text(f"# a remark\n\n{text}\n", encoding="utf-8")
    mission = read_mission(PROBLEMS / "patm.toml")
    assert mission_hash(read_mission(other)) == mission_hash(mission)
    turned = mission.model_copy(update={"places": dict(reversed(mission.places.items()))})
    assert list(turned.places) != list(mission.places) and mission_hash(turned) == mission_hash(mission)
