"""Sampling on a Dask cluster: the same design, also when a worker process is killed; every failure in one line."""

import os
import signal
import sys
import threading

import analytic_rotor as rotor
import dask
import pytest
import xarray as xr
from distributed import LocalCluster

from vrsopt.errors import InputError
from vrsopt.surrogate import cluster
from vrsopt.surrogate.database import Database, PointRecord
from vrsopt.surrogate.sampling import add_points, sample
from vrsopt.surrogate.space import LEVEL

MODEL = {"model_version": "0.1.0", "data_hash": "abc"}
DESIGN = {"space": LEVEL, "outputs": ("power", "blade_loading"), "derivatives": ("power",), "samples": 30, **MODEL}


def evaluate_where(inputs):
    """As ``evaluate_slowly``, the process in the reason."""
    record = rotor.evaluate_slowly(inputs)
    return PointRecord(record.outputs, record.status, str(os.getpid()), 7, 1e-9, record.derivatives)


def fatal(inputs):
    os._exit(9)


def contents(path, *dropped):
    with Database.open(path) as database:
        return database.dataset().drop_vars(["seconds", *dropped])


@pytest.fixture(scope="module")
def two_processes():
    """A scheduler and two worker processes, one thread each; restarted when they die."""
    with (
        dask.config.set({"distributed.comm.timeouts.connect": "3s"}),  # to a worker that is no longer there
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=50) as local,
    ):
        yield local


@pytest.mark.slow
def test_design_is_the_same_though_a_worker_is_killed(tmp_path, two_processes):
    sample(tmp_path / "here.db", evaluate=rotor.evaluate, workers=1, **DESIGN)
    path, killed = tmp_path / "cluster.db", []

    def kill():
        """One worker, once both have delivered."""
        while len(seen := processes(path)) < 2:
            stop.wait(0.02)
        killed.append(seen[0])
        os.kill(seen[0], signal.SIGKILL)

    stop, killer = threading.Event(), threading.Thread(target=kill, daemon=True)
    killer.start()
    sample(path, evaluate=evaluate_where, dask=two_processes.scheduler_address, **DESIGN)
    killer.join(10.0)
    assert killed and len(processes(path)) >= 2
    xr.testing.assert_identical(contents(path, "reason"), contents(tmp_path / "here.db", "reason"))
    summary = add_points(path, rotor.design(3), evaluate=rotor.evaluate, dask=two_processes.scheduler_address, **MODEL)
    assert summary.added == 3


def processes(path):
    """Those that have computed what is on file."""
    if not path.exists():
        return []
    try:
        with Database.open(path) as database:
            return [int(pid) for pid in dict.fromkeys(database.rows()["reason"])]
    except InputError:  # being written
        return []


@pytest.mark.slow
def test_points_that_end_every_worker_are_reported(tmp_path, two_processes):
    two_processes.scheduler.allowed_failures = 0  # and not three: quicker
    with pytest.raises(InputError, match="dask = tcp://.*: a task ended every worker that tried it: see their logs"):
        sample(tmp_path / "a.db", evaluate=fatal, dask=two_processes.scheduler_address, **DESIGN)


def test_clusters_that_are_not_there_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "CONNECTING", 0.3)
    for address in ("tcp://127.0.0.1:9", "nonsense://x", "127.0.0.1:port"):
        with pytest.raises(InputError, match=f"dask = {address}: no scheduler answers: an address as tcp://host:8786"):
            sample(tmp_path / "a.db", evaluate=rotor.evaluate, dask=address, **DESIGN)
    assert not list(tmp_path.iterdir())


def test_cluster_without_workers_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "WORKERS", 0.3)
    with (
        LocalCluster(n_workers=0, processes=False, dashboard_address=":0", protocol="tcp://") as local,
        pytest.raises(InputError, match="the scheduler has no workers"),
    ):
        sample(tmp_path / "a.db", evaluate=rotor.evaluate, dask=local.scheduler_address, **DESIGN)


def test_without_dask_it_is_said_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"Dask is not installed: pip install vrsopt\[dask\]"):
        sample(tmp_path / "a.db", evaluate=rotor.evaluate, dask="tcp://127.0.0.1:8786", **DESIGN)
