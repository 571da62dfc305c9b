"""Sampling: the same design whatever the workers and interruptions, filled up to the flyable count, extended."""

import itertools
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import analytic_rotor as rotor
import joblib
import numpy as np
import pytest
import xarray as xr

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.surrogate.database import Database, PointRecord, is_empty
from vrsopt.surrogate.design_table import read_points
from vrsopt.surrogate.sampling import add_points, sample
from vrsopt.surrogate.sequence import Sequence
from vrsopt.surrogate.space import FLIGHT, LEVEL

MODEL = {"model_version": "0.1.0", "data_hash": "abc"}
DESIGN = {"space": LEVEL, "outputs": ("power", "blade_loading"), "derivatives": ("power",), **MODEL}


def contents(path):
    with Database.open(path) as database:
        return database.dataset().drop_vars("seconds")


def run(path, **settings):
    return sample(path, **{"evaluate": rotor.evaluate, "samples": 60, "workers": 1, **DESIGN, **settings})


def add(path, inputs, **settings):
    return add_points(path, inputs, **{"evaluate": rotor.evaluate, "workers": 1, **MODEL, **settings})


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    path = tmp_path_factory.mktemp("sampling") / "reference.db"
    run(path)
    return contents(path)


class Stop:
    """Evaluates ``count`` points, then is interrupted."""

    def __init__(self, count):
        self.left = count

    def __call__(self, inputs):
        self.left -= 1
        if self.left < 0:
            raise KeyboardInterrupt
        return rotor.evaluate(inputs)


def never(inputs):
    return PointRecord({}, "stalled", "always", 1, 0.0)


def later(inputs):
    """Points that arrive in another order than they are sent out."""
    time.sleep(0.02 * (inputs["mass"] % 1.0))
    return rotor.evaluate(inputs)


@pytest.mark.parametrize("method", ["latin_hypercube", "sobol"])
def test_samples_until_enough_points_are_flyable(tmp_path, method):
    summary = run(tmp_path / "a.db", method=method)
    data = contents(tmp_path / "a.db")
    status = data.status.values
    assert np.sum(status == "ok") == summary.flyable == 60
    assert status[-1] == "ok" and summary.points == len(status) > 60  # it went into the second block
    expected = Sequence(method, 1, 60, LEVEL.lower, LEVEL.upper).points(len(status))
    for k, name in enumerate(LEVEL.names):
        np.testing.assert_array_equal(data[name].values, expected[:, k])
    np.testing.assert_allclose(data.power.values, rotor.shaft_power(expected), rtol=1e-12)
    assert data.sequence.values.tolist() == list(range(len(status)))
    np.testing.assert_array_equal(
        data.d_power.sel(input="twist").values[7], rotor.power_slopes(expected[7])["twist"], strict=False
    )


def test_time_of_each_point_is_kept(tmp_path):
    run(tmp_path / "a.db", samples=3)
    with Database.open(tmp_path / "a.db") as database:
        seconds = database.dataset().seconds.values
    assert np.all((seconds > 0) & (seconds < 1))


def test_result_does_not_depend_on_the_workers(tmp_path, reference):
    run(tmp_path / "two.db", workers=2, evaluate=later)
    assert contents(tmp_path / "two.db").identical(reference)


def test_backend_of_the_caller_is_used(tmp_path, reference):
    seen = []

    def evaluate(inputs):  # a closure: threads only
        seen.append(os.getpid())
        return later(inputs)

    with joblib.parallel_config(backend="threading"):
        run(tmp_path / "threads.db", workers=3, evaluate=evaluate)
    assert set(seen) == {os.getpid()}
    assert contents(tmp_path / "threads.db").identical(reference)


def test_results_are_stored_as_they_arrive(tmp_path):
    """The first point takes until others, behind it, are on file: they are not lost if it never arrives."""
    path, calls = tmp_path / "a.db", itertools.count()

    def evaluate(inputs):
        if next(calls) == 0:
            deadline = time.monotonic() + 20.0
            while count(path) < 3:
                assert time.monotonic() < deadline
                time.sleep(0.01)
            raise KeyboardInterrupt
        return rotor.evaluate(inputs)

    with joblib.parallel_config(backend="threading"), pytest.raises(KeyboardInterrupt):
        run(path, workers=2, evaluate=evaluate)
    assert count(path) >= 3 and int(contents(path).sequence[0]) > 0


def test_gaps_are_filled_and_the_end_is_cut(tmp_path, reference):
    path = tmp_path / "a.db"
    run(path, samples=60)
    with Database.open(path, write=True) as database, database._connection as connection:
        connection.execute("DELETE FROM points WHERE point IN (0, 3, 4, 50)")
        connection.execute("DELETE FROM derivatives WHERE point IN (0, 3, 4, 50)")
        end = len(reference.point)
        stored = connection.execute(f"SELECT * FROM points WHERE point = {end - 1}").fetchone()
        beyond = Sequence("latin_hypercube", 1, 60, LEVEL.lower, LEVEL.upper).points(end + 3)[end + 2].tolist()
        marks = ", ".join("?" * len(stored))
        connection.execute(f"INSERT INTO points VALUES ({marks})", (end + 2, *beyond, *stored[6:]))
    calls = Stop(4)
    run(path, evaluate=calls, resume=True)
    assert calls.left == 0
    assert contents(path).identical(reference)


def test_interrupted_run_resumes_to_the_same_design(tmp_path, reference):
    path = tmp_path / "stopped.db"
    with pytest.raises(KeyboardInterrupt):
        run(path, evaluate=Stop(20))
    assert contents(path).sizes["point"] == 20
    with pytest.raises(KeyboardInterrupt):
        run(path, evaluate=Stop(17), resume=True)
    assert contents(path).sizes["point"] == 37
    run(path, resume=True)
    assert contents(path).identical(reference)


@pytest.mark.parametrize("method", ["latin_hypercube", "sobol"])
def test_design_is_extended_by_the_points_that_follow(tmp_path, method):
    path = tmp_path / "a.db"
    run(path, samples=15, method=method)
    first = contents(path)
    calls = Stop(1000)
    run(path, samples=60, method=method, evaluate=calls, resume=True)
    data = contents(path)
    assert 1000 - calls.left == data.sizes["point"] - first.sizes["point"]
    assert data.isel(point=slice(first.sizes["point"])).equals(first)  # but for the samples wanted, an attribute
    assert (data.attrs["samples"], data.attrs["block_size"]) == (60, 15)
    expected = Sequence(method, 1, 15, LEVEL.lower, LEVEL.upper).points(data.sizes["point"])
    np.testing.assert_array_equal(data.mass.values, expected[:, 0])
    with pytest.raises(InputError, match="samples = 60: this run has 15: at least as many"):
        run(path, samples=15, method=method, resume=True)


def test_interrupted_extension_resumes_to_the_same_design(tmp_path):
    for name, stops in (("at once.db", ()), ("stopped.db", (5, 20))):
        path = tmp_path / name
        run(path, samples=15)
        for stop in stops:
            with pytest.raises(KeyboardInterrupt):
                run(path, samples=40, evaluate=Stop(stop), resume=True)
        run(path, samples=40, resume=True)
    assert contents(tmp_path / "stopped.db").identical(contents(tmp_path / "at once.db"))


SCRIPT = """
import sys
sys.path.insert(0, sys.argv[2])
import analytic_rotor
from vrsopt.surrogate.sampling import sample
from vrsopt.surrogate.space import LEVEL
def run(evaluate, workers, path=sys.argv[1], samples=60):
    sample(path, evaluate=evaluate, space=LEVEL, outputs=("power", "blade_loading"), derivatives=("power",),
           model_version="0.1.0", data_hash="abc", samples=samples, workers=workers, resume=True)
"""


@pytest.mark.slow
def test_interrupted_processes_end_and_their_design_is_resumed(tmp_path, reference):
    path = tmp_path / "stopped.db"
    script = SCRIPT + "run(analytic_rotor.evaluate_slowly, 2)"
    command = [sys.executable, "-c", script, str(path), str(Path(__file__).parent)]
    process = subprocess.Popen(command, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        deadline = time.monotonic() + 30.0
        while time.monotonic() < deadline and count(path) < 6:
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGINT)  # the workers too, as Ctrl-C does
        assert process.wait(10.0) != 0
    finally:
        if process.poll() is None:
            process.kill()
    assert 6 <= count(path) < 60
    run(path, resume=True)
    assert contents(path).identical(reference)


KILLS = """
import os, random, signal, time
def evaluate(inputs):
    time.sleep(0.01)
    return analytic_rotor.evaluate(inputs)
begin = time.perf_counter()
run(evaluate, 1, sys.argv[1] + ".small", 6)
longest, chance = time.perf_counter() - begin, random.Random(8)
for _ in range(20):
    wait = chance.uniform(0.0, longest)
    child = os.fork()
    if child == 0:
        signal.alarm(60)
        run(evaluate, 1)
        os._exit(0)
    time.sleep(wait)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    print(wait, flush=True)
    sys.stdin.readline()
"""


@pytest.mark.slow
def test_twenty_kills_at_any_moment_lose_nothing_but_points_in_flight(tmp_path, reference):
    """Each time the run is resumed and killed after a random while; every row that was on file stays."""
    path, kept, kills = tmp_path / "killed.db", {}, 0
    command = [sys.executable, "-c", SCRIPT + KILLS, str(path), str(Path(__file__).parent)]
    alone = os.environ | dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")  # it forks
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "env": alone, "text": True, "bufsize": 1}
    with subprocess.Popen(command, **pipes) as process:
        for _ in process.stdout:
            kills, kept = kills + 1, still_there(path, kept)
            process.stdin.write("\n")
    assert (kills, process.returncode) == (20, 0)
    assert 0 < len(kept) < len(reference.point)
    run(path, resume=True)
    assert contents(path).identical(reference)


def still_there(path, before):
    """Rows by point, each with the time it took; all rows of ``before`` are among them."""
    if is_empty(path) or not path.exists():
        assert not before
        return {}
    with Database.open(path, write=True) as database:
        rows = database.rows()
        slopes = database.derivatives(flyable=False)[:, 0]
    assert np.all(np.isfinite(slopes))  # rows and derivatives come together
    after = dict(zip(rows["point"], zip(rows["power"], rows["seconds"], strict=True), strict=True))
    assert before.items() <= after.items()
    return after


def count(path):
    try:
        with Database.open(path) as database:
            return len(database.status())
    except InputError:  # not there, or being written
        return 0


def test_complete_design_is_left_alone(tmp_path):
    run(tmp_path / "a.db")
    before = (tmp_path / "a.db").read_bytes()
    summary = run(tmp_path / "a.db", evaluate=Stop(0), resume=True)
    assert summary.flyable == 60
    assert (tmp_path / "a.db").read_bytes() == before


def test_existing_file_needs_resume_and_the_same_design(tmp_path):
    path = tmp_path / "a.db"
    run(path, resume=True)  # nothing there yet: begun
    with pytest.raises(InputError, match="exists already"):
        run(path)
    with pytest.raises(InputError, match="seed = 1: this run has 2"):
        run(path, seed=2, resume=True)
    with pytest.raises(InputError, match="method = latin_hypercube: this run has sobol"):
        run(path, method="sobol", resume=True)
    with pytest.raises(InputError, match="space = level: this run has flight"):
        run(path, space=FLIGHT, resume=True)
    with pytest.raises(InputError, match="model version = 0.1.0: this run has 0.2.0"):
        run(path, model_version="0.2.0", resume=True)
    with pytest.raises(InputError, match="data hash = abc: this run has xyz"):
        run(path, data_hash="xyz", resume=True)


def test_points_of_another_generator_are_refused(tmp_path):
    path = tmp_path / "a.db"
    with pytest.raises(KeyboardInterrupt):
        run(path, evaluate=Stop(3))
    with Database.open(path, write=True) as database:
        database._connection.execute("UPDATE points SET mass = 2000.0 WHERE point = 1")
        database._connection.commit()
    with pytest.raises(InputError, match="point 1: not the point that seed 1 gives here"):
        run(path, resume=True)


def test_model_without_flyable_points_ends(tmp_path):
    with pytest.raises(NoSolutionError, match="0 of 40 points flyable: 2 wanted"):
        run(tmp_path / "never.db", evaluate=never, samples=2)
    with pytest.raises(NoSolutionError, match="0 of 40 points flyable: 2 wanted"):
        run(tmp_path / "never.db", evaluate=Stop(0), samples=2, resume=True)


@pytest.mark.parametrize("setting", ["samples", "workers"])
def test_counts_are_checked(tmp_path, setting):
    with pytest.raises(InputError, match=f"{setting} = 0: at least 1"):
        run(tmp_path / "a.db", **{setting: 0})
    with pytest.raises(InputError, match="method = 'halton': one of"):
        run(tmp_path / "a.db", method="halton")
    assert not list(tmp_path.iterdir())


def test_progress_goes_to_standard_error(tmp_path, capsys):
    run(tmp_path / "a.db", progress=True)
    captured = capsys.readouterr()
    assert captured.out == ""
    for text in ("flyable points", "60/60", "points/s", "left"):
        assert text in captured.err


POINTS = rotor.design(5, seed=3)


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.db"
    run(path, samples=4)
    return path


def test_added_points_follow_those_of_the_sequence(small, capsys):
    before = contents(small)
    summary = add(small, POINTS[:3], workers=2, progress=True)
    data = contents(small)
    assert "added points" in capsys.readouterr().err
    assert (summary.added, summary.points) == (3, before.sizes["point"] + 3)
    assert "3 added by hand" in str(summary)
    assert data.isel(point=slice(-3)).identical(before)
    added = data.isel(point=slice(-3, None))
    assert added.sequence.values.tolist() == [-1, -1, -1]
    np.testing.assert_array_equal(np.stack([added[name] for name in LEVEL.names], axis=1), POINTS[:3])
    np.testing.assert_allclose(added.power.values, rotor.shaft_power(POINTS[:3]), rtol=1e-12)


def test_order_of_extending_and_adding_does_not_matter(tmp_path):
    first, other = tmp_path / "first.db", tmp_path / "other.db"
    for path in (first, other):
        run(path, samples=4)
    add(first, POINTS[:2])
    run(first, samples=9, resume=True)
    add(first, POINTS)
    run(other, samples=9, resume=True)
    add(other, POINTS)
    xr.testing.assert_identical(contents(first), contents(other))


def test_interrupted_adding_is_continued_by_the_same_call(tmp_path, small):
    at_once = tmp_path / "at once.db"
    run(at_once, samples=4)
    add(at_once, POINTS)
    with pytest.raises(KeyboardInterrupt):
        add(small, POINTS, evaluate=Stop(2))
    calls = Stop(3)
    add(small, POINTS, evaluate=calls)
    assert calls.left == 0
    assert contents(small).identical(contents(at_once))


def test_export_with_more_points_is_fed_back(tmp_path, small):
    table = tmp_path / "design.csv"
    with Database.open(small) as database:
        database.to_csv(table)
        meta, before = database.meta, len(database.status())
    fields = [*map(repr, POINTS[0].tolist())]
    columns = len(table.read_text().splitlines()[0].split(","))
    with table.open("a") as stream:
        stream.write(",".join(["", "", *fields, *[""] * (columns - 7)]) + "\n")
    summary = add(small, read_points(table, meta))
    assert (summary.added, summary.points) == (1, before + 1)


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ([[2000.0, 300.0, 30.0]], r"inputs of shape \(1, 3\): \(points, 5\)"),
        ([[2000.0, 300.0, 30.0, 44.0, 0.14], [2000.0, 300.0, 99.0, 44.0, 0.14]], "point 2: speed = 99: from 0 to 70"),
        ([[2000.0, float("nan"), 30.0, 44.0, 0.14]], "point 1: altitude = nan: from 0 to 2000"),
    ],
)
def test_points_that_can_not_be_added(small, inputs, message):
    before = small.read_bytes()
    with pytest.raises(InputError, match=message):
        add(small, inputs)
    with pytest.raises(InputError, match="model version = 0.1.0: this run has 0.2.0"):
        add(small, POINTS, model_version="0.2.0")
    assert small.read_bytes() == before
