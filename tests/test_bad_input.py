"""Whatever a user gets wrong ends in one line on standard error, the right exit code, and nothing written."""

import json
import re
import shutil
from importlib import resources
from pathlib import Path

import pytest

from vrsopt.cli import main
from vrsopt.surrogate.database import Database, DesignMeta
from vrsopt.surrogate.space import LEVEL

MISSION = Path(__file__).with_name("hop.toml").read_text()


@pytest.fixture(autouse=True)
def inside(tmp_path, monkeypatch):
    """An empty folder with a mission and what else the cases name."""
    monkeypatch.chdir(tmp_path)
    Path("hop.toml").write_text(MISSION)
    for name in ("garbage", "garbage.toml"):
        Path(name).write_bytes(bytes(range(256)) * 20)
    Path("empty").touch()
    Path("folder").mkdir()
    data = resources.files("vrsopt") / "data"
    Path("cut.db").write_bytes((data / "design.db").read_bytes()[:20_000])
    Path("cut.nc").write_bytes((data / "surrogate.nc").read_bytes()[:3_000])


def refused(capsys, *words: object, code: int = 2) -> str:
    """The one line on standard error of ``words``, which must fail with ``code`` and write nothing."""
    before = sorted(Path().rglob("*"))
    assert main([str(word) for word in words]) == code
    out, err = capsys.readouterr()
    assert sorted(Path().rglob("*")) == before
    assert out == ""
    assert err.startswith("vrsopt: ") and err.endswith("\n") and err.count("\n") == 1
    return err.removeprefix("vrsopt: ").rstrip("\n")


TRIM = ("trim", "--mass", "2200", "--speed", "30")


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ((), "Missing command; see vrsopt --help"),
        (("fly",), "No such command 'fly'; see vrsopt --help"),
        (("trim", "--speed", "30"), "trim: Missing option '--mass'; see vrsopt trim --help"),
        ((*TRIM, "--paint", "red"), "trim: No such option: --paint; see vrsopt trim --help"),
        ((*TRIM, "more"), "trim: Got unexpected extra argument"),
        (("trim", "--mass", "heavy", "--speed", "30"), "'--mass': 'heavy' is not a number"),
        (("trim", "--mass", "-2200", "--speed", "30"), "trim: mass = -2200: a number from 500 to 5000"),
        (("trim", "--mass", "nan", "--speed", "30"), "trim: mass = nan: a number from 500 to 5000"),
        (("trim", "--mass", "2200", "--speed", "300"), "trim: speed = 300: a number from 0 to 90"),
        (("trim", "--mass", "2200", "--speed", "inf"), "trim: speed = inf: a number from 0 to 90"),
        ((*TRIM, "--altitude", "99999"), "trim: altitude = 99999: a number from -500 to 6000"),
        ((*TRIM, "--rotor-speed-percent", "10"), "trim: rotor_speed_percent = 10: a number from 50 to 130"),
        ((*TRIM, "--rotor-speed-percent", "nan"), "trim: rotor_speed_percent = nan: a number from 50 to 130"),
        ((*TRIM, "--twist-deg", "90"), "trim: twist_deg = 90: a number from -5.7 to 22.9"),
        ((*TRIM, "--climb-angle-deg", "-45"), "trim: climb_angle_deg = -45: a number from -20 to 20"),
        ((*TRIM, "--load-factor", "9"), "trim: load_factor = 9: a number from 1 to 3"),
        ((*TRIM, "--aircraft", "nosuch.toml"), "nosuch.toml: no such file"),
        ((*TRIM, "--aircraft", "folder"), "folder: can not be read"),
        ((*TRIM, "--aircraft", "garbage"), "garbage: not a TOML file: its byte 129 is no text in UTF-8"),
        ((*TRIM, "--aircraft", "hop.toml"), "hop.toml: "),
        (("engine", "--power-kw", "-1"), "engine: power_kw = -1: a number of at least 0"),
        (("engine", "--power-kw", "much"), "'--power-kw': 'much' is not a number"),
        (("engine", "--power-kw", "nan"), "engine: power_kw = nan: a number of at least 0"),
        (("engine", "--power-kw", "9", "--mach", "2"), "engine: mach = 2.0: a number from 0 to 0.4"),
        (
            ("engine",),
            "engine: none given: exactly one of --power-kw, --gas-generator-speed-percent, --turbine-temperature-k, "
            "--rating; see vrsopt engine --help",
        ),
        (
            ("engine", "--power-kw", "200", "--rating", "take_off"),
            "engine: --power-kw and --rating given: exactly one of",
        ),
        (("engine", "--rating", "best"), "best"),
        (("engine", "--power-kw", "9", "--humidity-g-kg", "-1"), "engine: humidity_g_kg = -1: a number from 0 to "),
        (("engine", "--power-kw", "9", "--bleed-percent", "90"), "engine: bleed_percent = 90: a number from 0 to "),
        (
            ("engine", "--power-kw", "9", "--power-offtake-kw", "inf"),
            "engine: power_offtake_kw = inf: a number of at l",
        ),
        (("engine", "--gas-generator-speed-percent", "5"), "engine: gas_generator_speed_percent = 5: a number from "),
        (("engine", "--turbine-temperature-k", "20"), "engine: turbine_temperature_k = 20: a number from "),
        (("engine", "--power-kw", "9", "--engine", "nosuch"), "engine = 'nosuch': neither a shipped engine nor a path"),
        (("engine", "--power-kw", "9", "--engine", "nosuch.toml"), "nosuch.toml: no such file"),
        (("engine", "--power-kw", "9", "--engine", "bo105"), "engine = 'bo105': not an engine file"),
        (("engine", "--power-kw", "9", "--engine", "garbage.toml"), "garbage.toml: "),
        ((*TRIM, "--engines-operating", "3"), "trim: engines_operating = 3: a whole number from 1 to 2"),
        ((*TRIM, "--engines-operating", "one"), "'--engines-operating': 'one' is not a whole number"),
        (
            ("engine", "--power-kw", "9", "--power-turbine-speed-percent", "0"),
            "engine: power_turbine_speed_percent = 0: a number from 40 to 140",
        ),
    ],
)
def test_trim_and_engine(capsys, words, line):
    assert line in refused(capsys, *words)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("--samples", "0", "--out", "a.db"), "sample: samples = 0: at least 1"),
        (("--samples", "-3", "--out", "a.db"), "sample: samples = -3: at least 1"),
        (("--samples", "1e3", "--out", "a.db"), "'--samples': '1e3' is not a whole number"),
        (("--samples", "2000000000", "--out", "a.db"), "sample: samples = 2000000000: at most 1000000"),
        (("--workers", "0", "--out", "a.db"), "sample: workers = 0: at least 1"),
        (("--workers", "99999999999", "--out", "a.db"), "sample: workers = 99999999999: at most 1024"),
        (("--seed", "-1", "--out", "a.db"), "sample: seed = -1: at least 0"),
        (("--seed", str(2**64), "--out", "a.db"), f"sample: seed = {2**64}: at most {2**63 - 1}"),
        (("--space", "orbit", "--out", "a.db"), "space = 'orbit': one of level, flight"),
        (("--method", "halton", "--out", "a.db"), "sample: method = 'halton': one of latin_hypercube, sobol"),
        (("--dask", "here", "--out", "a.db"), "dask = here: "),
        (("--out", "nowhere/a.db"), "nowhere/a.db: can not be written: no folder nowhere"),
        (("--out", "folder"), "folder: can not be written: it is a folder"),
        (("--out", "garbage"), "garbage: exists already: resume it or name another file"),
        (("--out", "garbage", "--resume"), "garbage: not a readable design of experiments"),
        ((), "sample: Missing option '--out'"),
    ],
)
def test_sample(capsys, words, line):
    assert line in refused(capsys, "sample", *words)


@pytest.fixture
def design():
    """A design of experiments without points."""
    box = [(bound, bound + 1.0) for bound in range(5)]
    meta = DesignMeta("0", "abc", "level", "sobol", 1, 2, LEVEL.names, *zip(*box, strict=True), ("power",))
    Database.create("doe.db", meta).close()
    Path("points.csv").write_text("colour\nred\n")
    Path("other.csv").write_text(",".join(LEVEL.names) + "\n0,1,2,3,much\n")
    Path("good.csv").write_text(",".join(LEVEL.names) + "\n0,1,2,3,4\n")


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("export", "doe.db", "--out", "doe.txt"), "doe.txt: a name that ends in .nc or .csv"),
        (("export", "doe.db", "--out", "nowhere/doe.nc"), "nowhere/doe.nc: can not be written: no folder nowhere"),
        (("export", "garbage", "--out", "doe.nc"), "garbage: not a readable design of experiments"),
        (("export", "nosuch.db", "--out", "doe.nc"), "nosuch.db: no such file"),
        (("add-points", "nosuch.db", "points.csv"), "nosuch.db: no such file"),
        (("add-points", "doe.db", "nosuch.csv"), "nosuch.csv: can not be read: No such file"),
        (("add-points", "doe.db", "garbage"), "garbage: not a CSV file"),
        (("add-points", "doe.db", "points.csv"), "points.csv: no column mass: needed are mass, altitude, speed"),
        (("add-points", "doe.db", "other.csv"), "other.csv: line 2: twist = 'much': a number"),
        (("add-points", "doe.db", "good.csv"), "doe.db: model version = 0: this run has "),
        (("add-points", "doe.db", "good.csv", "--workers", "0"), "add_points: workers = 0: at least 1"),
    ],
)
def test_export_and_added_points(capsys, design, words, line):
    assert line in refused(capsys, *words)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("nosuch.db", "--out", "s.nc"), "nosuch.db: no such file"),
        (("folder", "--out", "s.nc"), "folder: "),
        (("empty", "--out", "s.nc"), "empty: not a design of experiments"),
        (("garbage", "--out", "s.nc"), "garbage: not a readable design of experiments: file is not a database"),
        (("cut.db", "--out", "s.nc"), "cut.db: not a readable design of experiments"),
        (("cut.db", "--out", "nowhere/s.nc"), "nowhere/s.nc: can not be written: no folder nowhere"),
        (("cut.db", "--out", "cut.db"), "cut.db: can not be written: it is the design of experiments itself"),
        (("cut.db", "--out", "s.nc", "--correlation", "linear"), "fit: correlation = 'linear': one of squared_exp"),
        (("cut.db",), "fit: Missing option '--out'"),
    ],
)
def test_fit(capsys, words, line):
    assert line in refused(capsys, "fit", *words)


def changed(old: str, new: str) -> None:
    assert MISSION.count(old) >= 1
    Path("hop.toml").write_text(MISSION.replace(old, new, 1))


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("crew_kg = 170.0", "crew_kg = 170.0\npilot_kg = 3", "loading.pilot_kg = 3: unknown key, allowed: empty_kg"),
        ("crew_kg = 170.0", "crew_kg = -170.0", "loading.crew_kg = -170.0: allowed: a number from 0 to 2500"),
        ("crew_kg = 170.0", "crew_kg = 'two'", "loading.crew_kg = 'two': allowed: a number from 0 to 2500"),
        ("crew_kg = 170.0", "crew_kg = nan", "loading.crew_kg = nan: allowed: a number from 0 to 2500"),
        ("speed_m_s = 45.0", "speed_m_s = 300.0", "tasks[2].speed_m_s = 300.0: allowed: a number from 1 to 70"),
        ("isa_offset_k = 0.0", "isa_offset_k = inf", "isa_offset_k = inf: allowed: a number from -40 to 40"),
        ('kind = "hover"', 'kind = "hoover"', "tasks[0].kind = 'hoover': allowed: idle, ground_idle, h"),
        ('to = "site"', 'to = "moon"', "tasks[2].to = 'moon': allowed: a place of this file (base, site)"),
        ('to = "site"', 'to = "base"', "tasks[2].to = 'base': allowed: a place where the aircraft is not already"),
        ("latitude_deg = 47.04", "latitude_deg = 47.02", "tasks[2].to = 'site': allowed: a place at least "),
        ("altitude_m = 430.0", "altitude_m = 390.0", "tasks[1].altitude_m = 390.0: allowed for a climb: above 402"),
        (
            "reserve_minutes = 20.0",
            "reserve_minutes = 20.0\n[wind]\nfrom_deg = 'W'",
            "wind.from_deg = 'W': allowed: a number from 0 ",
        ),
        (
            "reserve_minutes = 20.0",
            "reserve_minutes = 20.0\n[handling]\nbank_deg = 80",
            "handling.bank_deg = 80: allowed: a number fr",
        ),
        (
            "reserve_minutes = 20.0",
            "reserve_minutes = 20.0\n[handling]\nacceleration_m_s2 = 0.1",
            "tasks[2].to = 'site': allowed: a place at least ",
        ),
        (
            "speed_m_s = 45.0",
            "speed_m_s = 15.0\n[wind]\nfrom_deg = 0\nspeed_m_s = 15",
            "wind = 15.0 m/s against and 0.0 m",
        ),
        ('name = "hop"', "name = ", "not a TOML file: Invalid value (at line 1, column 8)"),
    ],
)
def test_mission_file(capsys, old, new, line):
    changed(old, new)
    message = refused(capsys, "solve", "hop.toml", "--out", "results")
    assert message.startswith("hop.toml: ") and line in message


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("nosuch.toml", "--out", "r"), "nosuch.toml: no such file"),
        (("folder", "--out", "r"), "folder: can not be read"),
        (("garbage", "--out", "r"), "garbage: not a TOML file"),
        (("empty", "--out", "r"), "empty: name: missing"),
        (("track.csv", "--out", "r"), "track.csv: mass: missing: needed with a flown track, the take-off mass in kg"),
        (("track.GPX", "--mass", "2000", "--out", "r"), "track.GPX: no such file"),
        (("hop.toml", "--mass", "2000", "--out", "r"), "hop.toml: mass = 2000: allowed with a flown track"),
        (("hop.toml", "--isa-offset", "nan", "--out", "r"), "hop.toml: isa_offset_k = nan: allowed: a number from -40"),
        (("hop.toml", "--wind-from-deg", "20", "--out", "r"), "hop.toml: wind.speed_m_s: missing"),
        (
            ("hop.toml", "--wind-from-deg", "3", "--wind-speed", "50", "--out", "r"),
            "hop.toml: wind.speed_m_s = 50.0: allowed: a number from 0 to 25",
        ),
        (
            ("hop.toml", "--wind-from-deg", "370", "--wind-speed", "5", "--out", "r"),
            "hop.toml: wind.from_deg = 370.0: allowed: a number from 0 to 360",
        ),
        (("hop.toml", "--out", "garbage"), "garbage: can not be written: garbage is not a folder"),
        (("hop.toml", "--out", "garbage/deep/er"), "garbage is not a folder"),
        (
            ("hop.toml", "--out", "r", "--schedules", "best"),
            "solve: schedules: 'best': some of nominal, constant, pointwise, prescribed",
        ),
        (("hop.toml", "--out", "r", "--schedules", ""), "solve: schedules: '': some of nominal, constant, pointwise"),
        (
            ("hop.toml", "--out", "r", "--variables", "none"),
            "solve: variables = 'none': one of both, speed, twist, all",
        ),
        (("hop.toml", "--out", "r", "--surrogate", "nosuch.nc"), "nosuch.nc: can not be read"),
        (("hop.toml", "--out", "r", "--surrogate", "folder"), "folder: not a surrogate: not a file"),
        (("hop.toml", "--out", "r", "--surrogate", "garbage"), "garbage: not a surrogate"),
        (("hop.toml", "--out", "r", "--surrogate", "cut.nc"), "cut.nc: not a surrogate"),
        (("hop.toml", "--out", "r", "--objective", "noise=1"), "objective: 'noise': weights of fuel, nox, co, co2"),
        (("hop.toml",), "solve: Missing option '--out'"),
        (("--out", "r"), "solve: mission: missing: a mission file, a flown track, or --from with a result.nc"),
        (("hop.toml", "--out", "r", "--search", "random"), "solve: search = 'random': one of nsga2, batched"),
    ],
)
def test_solve(capsys, words, line):
    assert line in refused(capsys, "solve", *words)


def test_json_is_one_object_on_bad_input_too(capsys):
    assert main(["solve", "nosuch.toml", "--out", "results", "--json"]) == 2
    out, err = capsys.readouterr()
    assert json.loads(out) == {"success": False, "message": "nosuch.toml: no such file"}
    assert err == "vrsopt: nosuch.toml: no such file\n"


def test_overloaded_mission_has_no_solution(capsys):
    changed("empty_kg = 1300.0", "empty_kg = 2400.0")
    line = refused(capsys, "solve", "hop.toml", "--out", "results", code=3)
    assert line == "hop: take-off mass: at least 2570.0 kg is needed, 70.0 kg over the maximum 2500 kg"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "where"),
    [
        (
            {
                "climb_angle_deg = 7.12": "climb_angle_deg = 25.0",
                "altitude_m = 430.0": "altitude_m = 1400.0",
                "latitude_deg = 47.04": "latitude_deg = 47.2",
            },
            " s (climb to site)",  # too steep
        ),
        (
            {
                "empty_kg = 1300.0": "empty_kg = 2200.0",
                "elevation_m = 400.0": "elevation_m = 1500.0",
                "altitude_m = 430.0": "altitude_m = 1530.0",
                "isa_offset_k = 0.0": "isa_offset_k = 25.0",
            },
            "at 0 s (hover at base)",  # heavy, hot and high
        ),
    ],
)
def test_mission_beyond_the_engines(capsys, changes, where):
    text = MISSION
    for old, new in changes.items():
        text = text.replace(old, new)
    Path("hop.toml").write_text(text)
    assert main(["solve", "hop.toml", "--out", "results", "--schedules", "nominal", "--json"]) == 3
    out, err = capsys.readouterr()
    summary = json.loads(out)
    assert err.count("\n") == 1
    assert re.match(r"vrsopt: hop: nominal: .*(engine power|turbine temperature) [\d.]+ % over its limit", err)
    assert where in err
    assert (summary["success"], summary["schedules"]["nominal"]["success"]) == (False, False)
    assert json.loads(Path("results/summary.json").read_text()) == summary


def test_results_of_a_former_run_stay_when_a_run_is_refused(capsys):
    Path("results").mkdir()
    Path("results/summary.json").write_text("{}")
    refused(capsys, "solve", "hop.toml", "--out", "results", "--schedules", "best")
    assert Path("results/summary.json").read_text() == "{}"


def test_surrogate_of_other_data_is_refused(capsys):
    shutil.copy(resources.files("vrsopt") / "data" / "bo105.toml", "mine.toml")
    text = Path("mine.toml").read_text()
    assert "chord" in text
    line = text[text.index("chord") :].splitlines()[0]
    value = line.partition("value = ")[2].split(",")[0].strip()
    Path("mine.toml").write_text(text.replace(line, line.replace(value, str(float(value) * 1.001), 1), 1))
    changed('aircraft = "bo105"', 'aircraft = "mine.toml"')
    assert "data hash = " in refused(capsys, "solve", "hop.toml", "--out", "results")
