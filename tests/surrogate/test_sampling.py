"""Sampling: the same design whatever the workers and interruptions, filled up to the flyable count."""

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

from vrsopt.errors import InputError, NoSolutionError
from vrsopt.surrogate.database import Database, PointRecord
from vrsopt.surrogate.sampling import BOUNDS, block, sample

MODEL = {"outputs": ("power", "blade_loading"), "model_version": "0.1.0", "data_hash": "abc"}


def contents(path):
    with Database.open(path) as database:
        return database.dataset()


def run(path, **settings):
    return sample(path, **{"evaluate": rotor.evaluate, "samples": 60, "workers": 1, **MODEL, **settings})


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


def test_block_is_a_latin_hypercube_in_the_box():
    points = block(1, 0, 50)
    cells = np.floor((points - BOUNDS[0]) / (BOUNDS[1] - BOUNDS[0]) * 50).astype(int)
    np.testing.assert_array_equal(np.sort(cells, axis=0), np.tile(np.arange(50)[:, None], 5))
    assert not np.array_equal(points, block(1, 1, 50))


def test_samples_until_enough_points_are_flyable(tmp_path):
    summary = run(tmp_path / "a.db")
    data = contents(tmp_path / "a.db")
    status = data.status.values
    assert np.sum(status == "ok") == summary.flyable == 60
    assert status[-1] == "ok" and summary.points == len(status) > 60  # it went into the second block
    expected = np.concatenate([block(1, 0, 60), block(1, 1, 60)])[: len(status)]
    np.testing.assert_array_equal(data.mass.values, expected[:, 0])
    np.testing.assert_allclose(data.power.values, rotor.shaft_power(expected), rtol=1e-12)


def test_result_does_not_depend_on_the_workers(tmp_path, reference):
    run(tmp_path / "two.db", workers=2)
    assert contents(tmp_path / "two.db").identical(reference)


def test_backend_of_the_caller_is_used(tmp_path, reference):
    seen = []

    def evaluate(inputs):  # a closure: threads only
        seen.append(os.getpid())
        return rotor.evaluate(inputs)

    with joblib.parallel_config(backend="threading"):
        run(tmp_path / "threads.db", workers=2, evaluate=evaluate)
    assert set(seen) == {os.getpid()}
    assert contents(tmp_path / "threads.db").identical(reference)


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


SCRIPT = """
import sys
sys.path.insert(0, sys.argv[2])
import time
import analytic_rotor
from vrsopt.surrogate.sampling import sample
sample(sys.argv[1], evaluate=analytic_rotor.evaluate_slowly, outputs=("power", "blade_loading"),
       model_version="0.1.0", data_hash="abc", samples=60, workers=2)
"""


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_killed_process_resumes_to_the_same_design(tmp_path, reference, how):
    path = tmp_path / "killed.db"
    command = [sys.executable, "-c", SCRIPT, str(path), str(Path(__file__).parent)]
    process = subprocess.Popen(command, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        deadline = time.monotonic() + 30.0
        while time.monotonic() < deadline and not (path.exists() and path.stat().st_size and count(path) >= 6):
            time.sleep(0.05)
        os.killpg(process.pid, how)  # the workers too, as Ctrl-C or a batch system does
        assert process.wait(10.0) != 0
    finally:
        if process.poll() is None:
            process.kill()
    assert 6 <= count(path) < 60
    run(path, resume=True)
    assert contents(path).identical(reference)


def count(path):
    try:
        with Database.open(path) as database:
            return len(database.status())
    except InputError:  # being written
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
    with pytest.raises(InputError, match="samples = 60: this run has 70"):
        run(path, samples=70, resume=True)
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


@pytest.mark.parametrize("setting", ["samples", "workers"])
def test_counts_are_checked(tmp_path, setting):
    with pytest.raises(InputError, match=f"{setting} = 0: at least 1"):
        run(tmp_path / "a.db", **{setting: 0})
    assert not list(tmp_path.iterdir())


def test_progress_goes_to_standard_error(tmp_path, capsys):
    run(tmp_path / "a.db", progress=True)
    captured = capsys.readouterr()
    assert captured.out == "" and "flyable points" in captured.err
