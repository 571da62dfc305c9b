"""A result made again from what it stores; what is solved is a stand-in, but for the last test."""

from __future__ import annotations

import json
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

from vrsopt.cli import main
from vrsopt.errors import InputError
from vrsopt.helicopter import MODEL_VERSION
from vrsopt.report import request as requests
from vrsopt.report.dataset import netcdf, read_result, result_dataset
from vrsopt.report.request import Request, repeat, run
from vrsopt.schedule.study_input import loaded

HOP = Path(__file__).parents[1] / "hop.toml"
ASKED = Request(
    file=HOP.name,
    schedules=("nominal", "trajectory"),
    variables="speed",
    objective={"fuel": 1.0, "nox": 30.0},
    seed=3,
    isa_offset=12.5,
    wind=(270.0, 6.0),
)


@pytest.fixture
def asked_of(monkeypatch, comparison) -> list[Any]:
    """Calls of ``solve``, which answers with a hand-made comparison."""
    calls: list[Any] = []

    def solve(task: Any, surrogate: Any, **options: Any) -> Any:
        calls.append((task, surrogate, options))
        own = comparison.provenance | {"model_version": MODEL_VERSION, "variables": options["variables"]}
        return replace(comparison, provenance=own)

    monkeypatch.setattr(requests, "solve", solve)
    return calls


@pytest.fixture(scope="module")
def content(comparison) -> bytes:
    """The result.nc of a run, but for what was asked."""
    return netcdf(result_dataset(comparison, mission_text=HOP.read_text()))


@pytest.fixture
def result(asked_of, content, tmp_path) -> Path:
    """The result.nc of a run."""
    done = run(HOP, ASKED)
    path = tmp_path / "result.nc"
    path.write_bytes(content)
    assert done.mission_text == HOP.read_text()
    provenance = done.comparison.provenance
    return rewritten(path, request=provenance["request"], model_version=provenance["model_version"])


def rewritten(result: Path, **attributes: Any) -> Path:
    """The result with other attributes; ``None`` takes one away."""
    dataset = read_result(result)
    dataset.attrs |= attributes
    dataset.attrs = {name: value for name, value in dataset.attrs.items() if value is not None}
    dataset.to_netcdf(result, engine="scipy", format="NETCDF3_64BIT")
    return result


def test_a_result_knows_what_was_asked_for(asked_of, result):
    again = repeat(result)
    (first, surrogate, options), (second, same, repeated) = asked_of
    assert first == second and surrogate is same and options == repeated
    assert second.isa_offset_k == 12.5 and second.wind.speed_m_s == 6.0
    assert options["schedules"] == ("nominal", "trajectory") and options["seed"] == 3
    assert again.mission_text == HOP.read_text()
    stored = json.loads(again.comparison.provenance["request"])
    assert stored["surrogate_hash"] == loaded(None, surrogate.data_hash).fingerprint
    assert stored == json.loads(read_result(result).attrs["request"])


def test_another_model_or_surrogate_is_refused(result):
    other = ASKED.model_copy(update={"surrogate_hash": "0" * 64}).model_dump_json()
    with pytest.raises(InputError, match=f"its content has the hash .*: the result has {'0' * 64}"):
        repeat(rewritten(result, request=other))
    with pytest.raises(InputError, match=f"result.nc: model_version = 7.0: this program has {MODEL_VERSION}"):
        repeat(rewritten(result, model_version="7.0"))
    with pytest.raises(InputError, match="result.nc: mission_text: missing: it was not written by vrsopt solve"):
        repeat(rewritten(result, model_version=MODEL_VERSION, mission_text=None))


@pytest.mark.parametrize(
    ("request_", "complaint"),
    [
        (None, "request: missing: it was not written by vrsopt solve"),
        ("[]", "request: not what this program writes"),
        (ASKED.model_dump_json().replace('"speed"', "[1]"), "request: not what this program writes"),
        (
            ASKED.model_copy(update={"file": "hop\0.toml"}).model_dump_json(),
            r"file = 'hop\\x00.toml': a name of a file",
        ),
        (ASKED.model_copy(update={"file": ""}).model_dump_json(), "file = '': a name of a file"),
        (ASKED.model_dump_json().replace("hop.toml", "../hop.toml"), r"file = '../hop.toml': a name of a file"),
    ],
)
def test_what_can_not_be_repeated_is_refused_in_one_line(result, request_, complaint):
    with pytest.raises(InputError, match=complaint):
        repeat(rewritten(result, request=request_))


def test_a_complaint_about_the_mission_names_the_result(result):
    text = HOP.read_text().replace("duration_s = 15.0", "duration_s = -1", 1)
    with pytest.raises(InputError, match=r"^[^ ]*result.nc: hop.toml: tasks\[0\].duration_s = -1"):
        repeat(rewritten(result, mission_text=text, mission_sha256=sha256(text.encode()).hexdigest()))
    with pytest.raises(InputError, match=r"^[^ ]*result.nc: mission_text: not the one that was flown"):
        repeat(rewritten(result, mission_text=HOP.read_text() + "\n"))


def test_command_line_makes_a_result_again_and_takes_no_other_options(asked_of, result, tmp_path, capsys, monkeypatch):
    written: list[Any] = []

    def write(comparison: Any, folder: Path, *, mission_text: str) -> list[Path]:
        written.append((folder, mission_text, comparison.provenance["request"]))
        return []

    monkeypatch.setattr("vrsopt.report.files.write_results", write)
    assert main(["solve", "--from", str(result), "--out", str(tmp_path / "again"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["success"]
    assert written == [(tmp_path / "again", HOP.read_text(), read_result(result).attrs["request"])]
    for words in (["--isa-offset", "20"], [str(HOP)], ["--schedules", "nominal"], ["--variables", "both"]):
        assert main(["solve", "--from", str(result), "--out", str(tmp_path / "again"), *words]) == 2
        assert "not allowed with --from, the result has its own" in capsys.readouterr().err
    words = ["solve", str(HOP), "--out", str(tmp_path / "again"), "--objective"]
    assert main([*words, "fuel=1, co2=0.1"]) == 0
    assert asked_of[-1][2]["objective"] == {"fuel": 1.0, "co2": 0.1}
    for wrong in ("nox", "nox=nan", ""):
        assert main([*words, wrong]) == 2
        assert f"solve: objective = {wrong!r}: weights like fuel=1,nox=30" in capsys.readouterr().err
    assert main(["solve", "--out", str(tmp_path / "again")]) == 2
    assert "solve: mission: missing: a mission file, a flown track, or --from" in capsys.readouterr().err


@pytest.mark.slow
def test_the_figures_of_a_result_made_again_are_the_same(tmp_path):
    first = ["solve", str(HOP), "--schedules", "nominal", "--isa-offset", "10"]
    assert main([*first, "--out", str(tmp_path / "first")]) == 0
    again = ["solve", "--from", str(tmp_path / "first" / "result.nc"), "--out", str(tmp_path / "again")]
    assert main(again) == 0
    ours, theirs = (json.loads((tmp_path / name / "summary.json").read_text()) for name in ("first", "again"))
    for summary in (ours, theirs):
        del summary["steps"]  # how long they took
    assert ours == theirs
