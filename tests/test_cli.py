"""The command line: what each sub-command prints and writes, and that the words agree with the Python verbs."""

import contextlib
import json
import math
import os
import pty
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
import warnings
from importlib import resources
from pathlib import Path

import pytest

import vrsopt
from vrsopt.cli import main
from vrsopt.console import DEGREES, PERCENT, converted
from vrsopt.helicopter import MODEL_VERSION

TRIM_KEYS = (
    "success status message residual_norm main_rotor_power_w tail_rotor_power_w shaft_power_per_engine_w "
    "engines_operating fuel_flow_kg_s nox_kg_s co2_kg_s co_kg_s nox_range_kg_s nox_index_g_kg co_index_g_kg "
    "co2_index_g_kg collective_deg lateral_cyclic_deg longitudinal_cyclic_deg tail_collective_deg "
    "pitch_deg roll_deg gas_generator_speed_percent turbine_inlet_temperature_k blade_loading "
    "figure_of_merit feasible reason induced_power_w profile_power_w parasite_power_w climb_power_w "
    "margin_blade_loading_percent margin_engine_power_percent margin_torque_percent "
    "margin_turbine_temperature_percent margin_tail_rotor_loading_percent hub_roll_moment_n_m hub_pitch_moment_n_m "
    "advancing_tip_mach one_engine_inoperative_margin_w autorotative_energy_j found_by coexisting "
    "smallest_singular_value"
).split()
ENGINE_KEYS = (
    "success power_w fuel_flow_kg_s sfc_kg_kwh gas_generator_speed_percent power_turbine_speed_percent "
    "turbine_inlet_temperature_k power_turbine_inlet_temperature_k pressure_ratio air_flow_kg_s nox_kg_s co2_kg_s "
    "co_kg_s nox_range_kg_s nox_index_g_kg co_index_g_kg surge_margin_percent combustion_efficiency inside_map"
).split()
FIT_KEYS = ("pearson_percent slope_deg bias_percent mean_abs_error_percent rms_error_percent std_error_percent").split()
MISSION = Path(__file__).with_name("hop.toml").read_text()


def run(capsys, *words: object) -> tuple[int, str, str]:
    code = main([str(word) for word in words])
    out, err = capsys.readouterr()
    return code, out, err


def run_json(capsys, *words: object) -> dict:
    code, out, err = run(capsys, *words, "--json")
    assert (code, err) == (0, "")
    assert out.count("\n") == 1
    return json.loads(out)


@pytest.fixture
def mission(tmp_path) -> Path:
    path = tmp_path / "hop.toml"
    path.write_text(MISSION)
    return path


@pytest.fixture
def small_design(tmp_path) -> Path:
    """The first points of the shipped design."""
    path = tmp_path / "doe.db"
    shutil.copy(resources.files("vrsopt") / "data" / "design.db", path)
    with sqlite3.connect(path) as connection:
        connection.execute("DELETE FROM points WHERE point >= 190")
    connection.close()
    return path


def test_trim_prints_the_point_of_the_verb(capsys):
    words = ("trim", "--mass", 2200, "--altitude", 300, "--speed", 30, "--rotor-speed-percent", 90, "--twist-deg", 10)
    figures = run_json(capsys, *words, "--climb-angle-deg", 2, "--load-factor", 1.1, "--isa-offset", 5)
    point = vrsopt.trim(
        2200.0,
        30.0,
        altitude=300.0,
        rotor_speed=0.9 * 44.4,
        twist=math.radians(10.0),
        climb_angle=math.radians(2.0),
        load_factor=1.1,
        isa_offset=5.0,
    )
    assert list(figures) == TRIM_KEYS
    assert figures["fuel_flow_kg_s"] == pytest.approx(point.fuel_flow, rel=1e-9)
    assert figures["main_rotor_power_w"] == pytest.approx(point.main_rotor_power, rel=1e-9)
    assert figures["collective_deg"] == pytest.approx(math.degrees(point.collective), rel=1e-9)
    assert figures["gas_generator_speed_percent"] == pytest.approx(100 * point.gas_generator_speed, rel=1e-9)
    assert (figures["success"], figures["status"], figures["feasible"]) == (True, "converged", True)
    for name in ("nox", "co", "co2"):
        assert figures[f"{name}_kg_s"] == pytest.approx(getattr(point, name), rel=1e-9)
        assert figures[f"{name}_index_g_kg"] == pytest.approx(1e3 * getattr(point, f"{name}_index"), rel=1e-9)
    assert figures["nox_range_kg_s"] == pytest.approx(point.nox_range, rel=1e-9)
    for name in ("induced", "profile", "parasite", "climb"):
        assert figures[f"{name}_power_w"] == pytest.approx(point.powers[name], rel=1e-9)
    for name, margin in point.margins.items():
        assert figures[f"margin_{name.replace(' ', '_')}_percent"] == pytest.approx(100 * margin, rel=1e-9)
    assert figures["hub_roll_moment_n_m"] == pytest.approx(point.hub_roll_moment, rel=1e-6)
    assert figures["hub_pitch_moment_n_m"] == pytest.approx(point.hub_pitch_moment, rel=1e-6)
    assert figures["advancing_tip_mach"] == pytest.approx(point.advancing_tip_mach)
    assert figures["one_engine_inoperative_margin_w"] == pytest.approx(point.one_engine_inoperative_margin)
    assert figures["autorotative_energy_j"] == pytest.approx(point.autorotative_energy)
    assert (figures["found_by"], figures["coexisting"]) == (point.trim.stage, False)
    assert figures["smallest_singular_value"] == pytest.approx(point.trim.smallest_singular_value, rel=1e-6)


def test_trim_figure_of_merit_is_that_of_a_hover(capsys):
    assert 0.5 < run_json(capsys, "trim", "--mass", 2000, "--speed", 0)["figure_of_merit"] < 0.85
    assert run_json(capsys, "trim", "--mass", 2000, "--speed", 20)["figure_of_merit"] is None


def test_trim_table(capsys):
    code, out, err = run(capsys, "trim", "--mass", 2200, "--speed", 30)
    assert (code, err) == (0, "")
    assert "kg/h" in out and "flyable          yes" in out


def test_trim_draws_the_rotor(capsys, tmp_path):
    folder = tmp_path / "point"
    code, out, _ = run(capsys, "trim", "--mass", 2200, "--speed", 30, "--load-factor", 1.2, "--out", folder)
    assert code == 0
    assert "rotor_maps.png" in out
    assert (folder / "rotor_map.nc").exists()
    taken = tmp_path / "file"
    taken.write_text("mine")
    code, _, error = run(capsys, "trim", "--mass", 2200, "--speed", 30, "--out", taken)
    assert code == 2 and "folder" in error
    assert taken.read_text() == "mine"


def test_trim_near_the_ground_needs_less_power(capsys):
    near, far = (
        json.loads(run(capsys, "trim", "--mass", 2200, "--speed", 0, "--json", *more)[1])
        for more in (("--hub-height", 4), ())
    )
    assert near["main_rotor_power_w"] < 0.95 * far["main_rotor_power_w"]
    code, _, error = run(capsys, "trim", "--mass", 2200, "--speed", 0, "--hub-height", 1)
    assert code == 2 and "hub_height = 1: at least 2.455" in error


def test_point_that_may_not_be_flown_is_no_failure(capsys):
    figures = run_json(capsys, "trim", "--mass", 2500, "--speed", 40, "--climb-angle-deg", 18)
    assert (figures["success"], figures["feasible"]) == (True, False)
    assert "kW per engine above" in figures["reason"]


@pytest.mark.slow
def test_point_without_trim(capsys):
    words = ("trim", "--mass", 2200, "--speed", 30, "--altitude", 2000, "--rotor-speed-percent", 60, "--json")
    code, out, err = run(capsys, *words)
    figures = json.loads(out)
    assert code == 3
    assert list(figures) == TRIM_KEYS
    assert (figures["success"], figures["feasible"], figures["fuel_flow_kg_s"]) == (False, False, None)
    assert (figures["nox_kg_s"], figures["nox_range_kg_s"]) == (None, [None, None])
    assert figures["found_by"] is figures["induced_power_w"] is figures["margin_torque_percent"] is None
    assert err.count("\n") == 1
    assert "no solution at 2200 kg, 30 m/s, 2000 m, rotor speed 60 %: blade loading 0.2" in err


def test_engine_prints_the_result_of_the_verb(capsys):
    words = ("engine", "--power-kw", 200, "--power-turbine-speed-percent", 95, "--altitude", 500, "--humidity-g-kg", 8)
    more = ("--isa-offset", 10, "--mach", 0.1, "--bleed-percent", 2, "--power-offtake-kw", 3)
    figures = run_json(capsys, *words, *more)
    result = vrsopt.engine(
        200e3,
        power_turbine_speed=0.95,
        altitude=500.0,
        isa_offset=10.0,
        mach=0.1,
        humidity=0.008,
        bleed_fraction=0.02,
        power_offtake=3e3,
    )
    assert set(ENGINE_KEYS) <= set(figures)
    assert not {"message", "status"} & set(figures)
    assert all(figures[key] == pytest.approx(getattr(result, key)) for key in ENGINE_KEYS)


@pytest.mark.parametrize(
    ("words", "demand", "key", "value"),
    [
        (("--gas-generator-speed-percent", 92), {"gas_generator_speed": 0.92}, "gas_generator_speed_percent", 92.0),
        (
            ("--turbine-temperature-k", 1050),
            {"inter_turbine_temperature": 1050.0},
            "power_turbine_inlet_temperature_k",
            1050.0,
        ),
        (("--rating", "take_off"), {"rating": "take_off"}, "power_w", 313e3),
    ],
)
def test_engine_at_other_demands(capsys, words, demand, key, value):
    figures, result = run_json(capsys, "engine", *words), vrsopt.engine(**demand)
    assert figures[key] == pytest.approx(value, rel=1e-4)
    assert figures["power_w"] == pytest.approx(result.power_w, rel=1e-6)
    assert figures["nox_kg_s"] == pytest.approx(result.nox_kg_s, rel=1e-6)


def test_every_shipped_engine_runs_by_name_and_as_a_file(capsys, tmp_path):
    data = {
        path.name: path.read_text() for path in (resources.files("vrsopt") / "data").iterdir() if "toml" in path.name
    }
    engines = {name.removesuffix(".toml"): text for name, text in data.items() if "[design_point]" in text}
    assert "allison_250_c20b" in engines
    for name, text in engines.items():
        mine = tmp_path / f"{name}.toml"
        mine.write_text(text)
        figures = run_json(capsys, "engine", "--engine", name, "--rating", "take_off")
        assert figures["power_w"] > 300e3 and figures["nox_kg_s"] > 0
        assert run_json(capsys, "engine", "--engine", mine, "--rating", "take_off") == figures


def test_rating_brings_its_own_power_turbine_speed(capsys):
    idle, fast = (
        run_json(capsys, "engine", "--rating", "ground_idle", *words)
        for words in ((), ("--power-turbine-speed-percent", 90))
    )
    assert idle["power_turbine_speed_percent"] < fast["power_turbine_speed_percent"] == pytest.approx(90.0)


def test_engine_without_power_has_no_consumption_per_power(capsys):
    assert run_json(capsys, "engine", "--power-kw", 0)["sfc_kg_kwh"] is None


def test_power_that_can_not_be_had(capsys):
    code, out, err = run(capsys, "engine", "--power-kw", 400, "--json")
    assert (code, json.loads(out)["success"]) == (3, False)
    assert err.startswith("vrsopt: engine: power 400.0 kW can not be had: maximum power 3")
    assert err.count("\n") == 1


@pytest.mark.parametrize("words", [("--turbine-temperature-k", 1300), ("--gas-generator-speed-percent", 112)])
def test_other_demands_that_can_not_be_had(capsys, words):
    code, out, err = run(capsys, "engine", *words, "--json")
    assert (code, json.loads(out)["success"]) == (3, False)
    assert err.startswith("vrsopt: engine: ") and "can not be had: " in err and err.count("\n") == 1


@pytest.mark.slow
def test_sample_resume_and_refusal_to_overwrite(capsys, tmp_path):
    design = tmp_path / "doe.db"
    words = ("sample", "--samples", 2, "--seed", 3, "--workers", 1, "--out", design)
    code, out, err = run(capsys, *words)
    assert (code, err) == (0, "")
    assert "2 flyable" in out
    content = design.read_bytes()
    code, out, err = run(capsys, *words)
    assert (code, out, err) == (2, "", f"vrsopt: {design}: exists already: resume it or name another file\n")
    assert run(capsys, *words, "--resume")[0] == 0
    assert design.read_bytes() == content
    tables = (tmp_path / "doe.csv", tmp_path / "doe.nc")
    for table in tables:
        code, out, err = run(capsys, "export", design, "--out", table)
        assert (code, err) == (0, "") and out.startswith(f"{table}: ") and table.stat().st_size > 500
    lines = tables[0].read_text().splitlines()
    tables[0].write_text("\n".join([*lines, ",,2000.0,300.0,30.0,44.4,0.14" + "," * (lines[0].count(",") - 6)]))
    for _ in range(2):  # again: the point is there
        code, out, err = run(capsys, "add-points", design, tables[0], "--workers", 1)
        assert (code, err) == (0, "") and "3 flyable, 1 added by hand" in out


@pytest.mark.slow
def test_fit_writes_a_surrogate_and_its_figures(capsys, tmp_path, small_design):
    out = tmp_path / "surrogate.nc"
    figures = run_json(capsys, "fit", small_design, "--out", out)
    assert figures["samples"] == 190
    assert 100 <= figures["flyable"] <= figures["converged"] <= 190
    for case in ("flyable", "converged"):
        assert list(figures["outputs"]["main_rotor_power"][case])[: len(FIT_KEYS)] == FIT_KEYS
        assert figures["outputs"]["main_rotor_power"][case]["pearson_percent"] > 95
    assert set(vrsopt.load_surrogate(out).models) == set(figures["outputs"])


@pytest.mark.slow
def test_solve_writes_its_results_and_prints_the_summary(capsys, tmp_path, mission):
    folder = tmp_path / "deep" / "results"
    words = ("solve", mission, "--out", folder, "--schedules", "nominal,trajectory")
    figures = run_json(capsys, *words)
    assert {"mission", "takeoff_mass_kg", "duration_s", "schedules", "solver"} <= set(figures)
    assert list(figures["schedules"]) == ["nominal", "trajectory"]
    assert figures["schedules"]["trajectory"]["fuel_delta_percent"] < -1.0
    assert json.loads((folder / "summary.json").read_text()) == figures
    assert {"result.nc", "report.html", "summary.json"} <= {file.name for file in folder.iterdir()}


@pytest.mark.slow
def test_solve_table_and_variants(capsys, tmp_path, mission):
    folder = tmp_path / "results"
    code, out, err = run(capsys, "solve", mission, "--out", folder, "--schedules", "nominal", "--variables", "all")
    assert (code, err) == (0, "")
    assert "hop" in out and "flyable" in out and "summary.json" in out
    assert {"speed_only", "twist_only"} <= set(json.loads((folder / "summary.json").read_text()))


COMMANDS = ("trim", "engine", "sample", "export", "add-points", "fit", "envelope", "new", "solve")


def test_help_lists_every_command_with_a_whole_sentence(capsys):
    code, out, err = run(capsys, "--help")
    listed = [line.split(None, 1) for line in out.partition("Commands:")[2].partition("Examples:")[0].splitlines()]
    described = {words[0]: words[1] for words in listed if words}
    assert (code, err, tuple(described)) == (0, "", COMMANDS)
    assert all(text.endswith(".") and not text.endswith("...") for text in described.values())


@pytest.mark.parametrize("verb", ("", *COMMANDS))
def test_help_ends_with_examples_that_can_be_typed(capsys, verb):
    code, out, err = run(capsys, *verb.split(), "--help")
    assert (code, err) == (0, "")
    body, _, shown = out.partition("\n  Examples:\n")
    pairs = shown.rstrip("\n").split("\n")
    assert "Options:" in body and len(pairs) >= 2
    for what, typed in zip(pairs[::2], pairs[1::2], strict=True):
        assert what.startswith("    ") and what.endswith(":")
        words = typed.removeprefix("      ").split()
        assert words[0] == "vrsopt" and words[1] in ((verb,) if verb and verb != "new" else COMMANDS)
        options = {word for word in words if word.startswith("--")}
        assert options <= set(run(capsys, words[1], "--help")[1].split()), typed


def on_terminal(*words: str, **environment: str) -> tuple[int, str, str]:
    """Exit code, standard output and, of a terminal, standard error of a command line."""
    terminal, end = pty.openpty()
    command = [sys.executable, "-m", "vrsopt", *words]
    environment = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "100", **environment}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=end, env=environment)
    os.close(end)
    shown = b""
    with contextlib.suppress(OSError):  # what Linux says when nobody writes any more
        while part := os.read(terminal, 4096):
            shown += part
    os.close(terminal)
    out = process.communicate()[0]
    return process.returncode, out.decode(), shown.decode()


@pytest.mark.skipif(os.name == "nt", reason="terminals")
def test_progress_is_for_terminals_and_goes_when_quiet():
    words = ("engine", "--power-kw", "200", "--json")
    (code, out, shown), quiet = on_terminal(*words, NO_COLOR="1"), on_terminal(*words, "--quiet")
    assert code == 0 and json.loads(out)["success"]
    assert "engine" in shown and "0:00:0" in shown
    assert not re.search(r"\x1b\[(3[0-7]|9[0-7]|38;)", shown)  # colours
    assert quiet == (0, out, "")


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="terminals")
def test_a_bar_stays_out_of_what_is_redirected(tmp_path):
    words = ("envelope", "--points", "30", "--masses", "2000", "--out", str(tmp_path / "envelope"), "--json")
    code, out, shown = on_terminal(*words)
    assert code == 0 and json.loads(out)["success"]
    assert "envelope" in shown and "100%" in shown


def test_quiet_leaves_results_and_errors(capsys, tmp_path):
    words = ("trim", "--mass", 2200, "--speed", 30, "--out", tmp_path / "point")
    loud, quiet = run(capsys, *words), run(capsys, *words, "-q")
    assert (loud[0], quiet[0], quiet[2]) == (0, 0, "")
    assert loud[1].splitlines()[:-1] == quiet[1].splitlines() and "rotor_maps.png" in loud[1].splitlines()[-1]
    assert run(capsys, "engine", "--power-kw", 400, "--quiet")[2].startswith("vrsopt: engine: power 400.0 kW can not")
    assert run(capsys, "new", tmp_path / "mine.toml", "--quiet") == (0, "", "")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_for_shells(capsys, monkeypatch, shell):
    monkeypatch.setattr("shellingham.detect_shell", lambda: (shell, f"/bin/{shell}"))
    code, script, err = run(capsys, "--show-completion")
    assert (code, err) == (0, "") and "_VRSOPT_COMPLETE" in script and f"complete_{shell}" in script


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("vrsopt so", ["solve"]),
        ("vrsopt e", ["engine", "export", "envelope"]),
        ("vrsopt solve --wind", ["--wind-from-deg", "--wind-speed"]),
    ],
)
def test_completion_offers_commands_and_options(capsys, monkeypatch, typed, offered):
    for name, value in (("_VRSOPT_COMPLETE", "complete_bash"), ("COMP_WORDS", typed)):
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("COMP_CWORD", str(len(typed.split()) - 1))
    code, out, err = run(capsys)
    assert (code, out.split(), err) == (0, offered, "")


def test_new_mission_is_read_and_never_overwritten(capsys, tmp_path):
    path = tmp_path / "mine.toml"
    code, out, err = run(capsys, "new", path)
    assert (code, err) == (0, "") and f"vrsopt solve {path} --out results/mine" in out
    assert len(vrsopt.read_mission(path).tasks) > 10
    path.write_text("mine")
    assert run(capsys, "new", path) == (2, "", f"vrsopt: {path}: exists already: name another file\n")
    assert path.read_text() == "mine"
    assert run(capsys, "new", tmp_path / "mine.txt")[2].endswith("mine.txt: a name that ends in .toml\n")
    nowhere = tmp_path / "nowhere" / "mine.toml"
    assert run(capsys, "new", nowhere)[2] == f"vrsopt: {nowhere}: can not be written: no folder {nowhere.parent}\n"


def test_what_is_misspelled_is_named_with_what_may_be_meant(capsys, tmp_path):
    assert run(capsys, "slove")[2] == "vrsopt: No such command 'slove'. Did you mean 'solve'? See vrsopt --help\n"
    assert (
        "No such option: --rotor-speed (Possible options: --rotor-speed-percent, --speed); see"
        in (run(capsys, "trim", "--mass", 2200, "--speed", 30, "--rotor-speed", 90)[2])
    )
    path = tmp_path / "mine.toml"
    run(capsys, "new", path)
    path.write_text(path.read_text().replace("speed_m_s = 55.0", "speed_kt = 107.0"))
    error = run(capsys, "solve", path, "--out", tmp_path / "results")[2]
    assert f"{path}: tasks[3].speed_m_s: missing; unknown key beside it: 'speed_kt'" in error


@pytest.mark.slow
def test_new_mission_is_solved_as_it_is(capsys, tmp_path):
    path, folder = tmp_path / "mine.toml", tmp_path / "results"
    assert run(capsys, "new", path)[0] == 0
    figures = run_json(capsys, "solve", path, "--out", folder, "--schedules", "nominal,trajectory")
    assert figures["schedules"]["trajectory"]["success"]
    assert figures["schedules"]["trajectory"]["fuel_physics_delta_percent"] < -5.0


def test_help_says_where_the_shift_of_the_centre_of_gravity_comes_from(capsys):
    assert "vrsopt.balance" in run(capsys, "trim", "--help")[1]


def test_help_loads_no_models():
    code = "import sys; from vrsopt.cli import main; main(['--help']); print('|', *sys.modules)"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert "Commands:" in shown
    assert not {"casadi", "numpy", "matplotlib"} & set(shown.partition("|")[2].split())


def test_version_names_program_model_and_data(capsys):
    code, out, err = run(capsys, "--version")
    assert (code, err) == (0, "")
    assert out.startswith(f"vrsopt {vrsopt.__version__}, model {MODEL_VERSION}, data ")


def test_percent_and_degrees_are_shown_as_typed():
    assert converted("x", 100.0, per=PERCENT, allowed=(0.5, 1.3)) == 1.0
    assert converted("x", 180.0, per=DEGREES, allowed=(-4.0, 4.0)) == pytest.approx(math.pi, rel=1e-15)
    with pytest.raises(vrsopt.InputError, match="x = 22.95: a number from -5.7 to 22.9"):
        converted("x", 22.95, per=DEGREES, allowed=(-0.1, 0.4))


def test_a_process_that_joblib_replaces_is_no_news(capsys):
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        run(capsys, "--version")
        warnings.warn("A worker stopped while some jobs were given to the executor.", UserWarning, stacklevel=1)
    assert told == []


@pytest.mark.parametrize("words", [["trim", "--mass", "2200", "--speed", "30"], ["--help"]])
def test_a_reader_that_goes_away_is_no_traceback(words):
    process = subprocess.Popen(
        [sys.executable, "-m", "vrsopt", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    process.stdout.close()
    error = process.stderr.read()
    process.stderr.close()
    assert (process.wait(), error) == (1, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_output_that_can_not_be_written():
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "vrsopt", "--help"], stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert (done.returncode, done.stderr) == (2, "vrsopt: standard output: No space left on device\n")


def test_incomplete_installation_is_one_line(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "vrsopt.turboshaft.performance", None)
    code, out, err = run(capsys, "engine", "--power-kw", 200)
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert "vrsopt.turboshaft.performance can not be loaded" in err


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_interrupt_is_one_line_and_keeps_the_points(tmp_path):
    design = tmp_path / "doe.db"
    words = [sys.executable, "-m", "vrsopt", "sample", "--samples", "500", "--workers", "1", "--out", str(design)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60
    while _points(design) < 2:
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    out, error = process.communicate(timeout=60)
    assert (process.returncode, out, error) == (130, "", "vrsopt: interrupted\n")
    assert _points(design) >= 2


def test_interrupt_of_compiled_code_is_one_line(capsys, monkeypatch):
    def interrupted(*words, **settings):
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    monkeypatch.setattr("vrsopt.turboshaft.performance.engine", interrupted)
    assert run(capsys, "engine", "--power-kw", 200) == (130, "", "vrsopt: interrupted\n")


def _points(design: Path) -> int:
    if not design.exists():
        return 0
    connection = sqlite3.connect(f"{design.as_uri()}?mode=ro", uri=True)
    try:
        return connection.execute("SELECT count(*) FROM points").fetchone()[0]
    except sqlite3.OperationalError:  # not there yet
        return 0
    finally:
        connection.close()
