"""The reproduction of the reference study: its parts on small sizes, what is kept of them, and the page."""

import base64
import json
import re

import numpy as np
import pytest
import xarray as xr

from problems.study import bars, benefit, climb, flights, maps, missions, schedules, turbine
from problems.study.__main__ import PARTS, main
from problems.study.finding import FIGURES, RESULTS, Finding, Picture, Table, save
from problems.study.page import page
from vrsopt.errors import InputError
from vrsopt.report.style import new_figure

pytestmark = pytest.mark.slow
HOP = "tests/hop.toml"


@pytest.fixture(autouse=True)
def from_root(monkeypatch, pytestconfig):
    monkeypatch.chdir(pytestconfig.rootpath)


@pytest.mark.parametrize("part", [schedules, bars])
def test_parts_of_a_short_mission(part):
    found = part.run((HOP,))
    assert found.sentences and all(len(row) == len(found.table.header) for row in found.table.rows)


def test_missions_against_time():
    assert len(missions.against_time((HOP,)).axes) == 3


def test_strategies_nest():
    """Both variables burn no more than either alone, and either no more than the nominal rotor."""
    fuel = {strategy: flights.flown(HOP, strategy).flight.fuel for strategy in ("nominal", *flights.STRATEGIES)}
    assert fuel["both"] <= min(fuel["speed"], fuel["twist"]) * (1 + 1e-5)
    assert max(fuel["speed"], fuel["twist"]) <= fuel["nominal"] * (1 + 1e-5)


def test_time_of_the_benefit():
    saved, weight = flights.benefit_percent(HOP)
    assert weight.sum() == pytest.approx(flights.ready(HOP).profile.duration)
    three, five, ten, fifteen, mean = benefit.shares(HOP)
    assert 0.0 <= fifteen <= ten <= five <= three <= 100.0 and np.nanmin(saved) <= mean <= np.nanmax(saved)


def test_mission_on_the_map(monkeypatch):
    """The mean is over the places that the map has, the rest is told, and a place above the map is an error."""
    axes = {"altitude": [0.0, 500.0, 1000.0], "speed": [0.0, 30.0, 60.0]}
    saved = xr.DataArray([[5.0, 10.0, np.nan]] * 3, coords=axes, dims=tuple(axes))
    at = [np.array(values) for values in ([0.0, 15.0, 60.0], [0.0, 500.0, 1000.0], [60.0, 20.0, 20.0], [0.0] * 3)]
    monkeypatch.setattr(benefit, "places", lambda mission: at)
    assert benefit.on_map("patm", saved) == pytest.approx((5.625, 20.0))
    at[1] = np.array([0.0, 500.0, 1025.0])
    with pytest.raises(InputError, match=r"patm: altitudes from 0 to 1025 m; .* allows 0 to 1000 m"):
        benefit.on_map("patm", saved)


def test_sentences_of_the_climb():
    assert climb.resting(["torque"] * 3) == "torque, in all 3"
    assert climb.resting(["torque", "none", "torque"]) == "torque in 2, none in 1"
    assert climb.at_most(0.0, "deg") == "less than 0.01 deg" and climb.at_most(0.25, "deg") == "at most 0.25 deg"


def test_maps():
    found = maps.run(points=36, masses=(1800.0, 2000.0))
    assert len(found.table.rows) == 6 and len(found.figures) == 7


def test_climb_against_the_physics():
    """The path model's optimum in climb and descent is that of the physics to a per cent of speed, half a degree."""
    for angle in (-7.12, 7.12):
        own, true = climb.best(2000.0, np.array([angle])), climb.physics(2000.0, angle)
        assert own["rotor_speed"][0] == pytest.approx(true[0], abs=1.0)
        assert own["twist"][0] == pytest.approx(true[1], abs=0.5)
        assert own["more"][0] > 0.0


def test_free_turbine():
    rows = turbine.run((0.9, 1.0)).table.rows
    assert rows[0][2] < rows[1][2]


def test_what_is_kept_and_the_page(tmp_path):
    picture = Picture(new_figure(1.0, 1.0), "a > dot")
    found = Finding("A < B", "theirs & ours", ["one & two"], Table(("x",), ((None,), (1.5,))), {"dot": picture})
    kept = save("part", found, results=tmp_path, figures=tmp_path)
    assert kept == json.loads((tmp_path / "part.json").read_text(encoding="utf-8"))
    html = page({"part": kept}, figures=tmp_path)
    assert base64.b64encode((tmp_path / "study_dot.png").read_bytes()).decode() in html
    assert all(words in html for words in ("A &lt; B", "theirs &amp; ours", "one &amp; two", "a &gt; dot"))


def test_committed_results():
    """Every part that is kept is valid and shows its figures on the page."""
    kept = {name: json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8")) for name in PARTS}
    html = page(kept)
    assert len(re.findall("<img ", html)) == sum(len(one["figures"]) for one in kept.values())
    for name, one in kept.items():
        assert one["command"] == f"python -m problems.study {name}"
        assert one["sentences"] and all(len(row) == len(one["header"]) for row in one["rows"])
        assert all((FIGURES / picture["file"]).is_file() for picture in one["figures"])


def test_unknown_part(capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["nothing"])
    assert stopped.value.code == 2 and "nothing" in capsys.readouterr().err
