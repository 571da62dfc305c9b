"""The design of experiments on file: round trip, read-only reading, and every refusal with its message."""

import hashlib
import shutil
import sqlite3
from dataclasses import replace

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.surrogate.database import Database, DesignMeta, PointRecord, Row

META = DesignMeta("0.1.0", "abc", 1, 10, ("mass", "speed"), (1400.0, 0.0), (2500.0, 70.0), ("power", "fuel_flow"))


def row(index, status="ok", **outputs):
    values = outputs or {"power": 1e5 + index, "fuel_flow": 0.1 / 3.0}
    record = PointRecord(values, status, "" if status == "ok" else "blade loading 0.130 above 0.120", 5, 1e-10)
    return Row(index, {"mass": 2000.0 + index / 3.0, "speed": 30.0}, record)


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "a design #1.db"
    with Database.create(file, META) as database:
        database.append([row(0), row(1, status="stalled"), row(2, status="not converged", power=np.nan)])
    return file


def test_round_trip_to_the_last_bit(path):
    with Database.open(path, META) as database:
        assert database.meta == META
        inputs, outputs = database.arrays()
        everything, results = database.arrays(flyable=False)
        data = database.dataset()
    np.testing.assert_array_equal(inputs, [[2000.0, 30.0]])
    np.testing.assert_array_equal(outputs, [[1e5, 0.1 / 3.0]])
    assert everything[1, 0] == 2000.0 + 1.0 / 3.0
    assert np.all(np.isnan(results[2]))
    assert data.status.values.tolist() == ["ok", "stalled", "not converged"]
    assert "0.130" in str(data.reason.values[1])
    assert data.attrs["seed"] == 1 and data.attrs["outputs"] == ["power", "fuel_flow"]


def test_empty_design_reads_as_no_points(tmp_path):
    with Database.create(tmp_path / "empty.db", META) as database:
        assert database.status() == []
        assert database.arrays()[0].shape == (0, 2)
        assert database.dataset().sizes["point"] == 0


def test_reading_changes_nothing(path):
    before = hashlib.sha256(path.read_bytes()).hexdigest(), path.stat().st_mtime_ns
    with Database.open(path) as database:
        database.dataset()
        with pytest.raises(InputError, match="can not be written"):
            database.append([row(3)])
    assert (hashlib.sha256(path.read_bytes()).hexdigest(), path.stat().st_mtime_ns) == before
    assert [item.name for item in path.parent.iterdir()] == [path.name]


def test_batch_with_a_duplicate_is_rejected_as_a_whole(path):
    with Database.open(path, write=True) as database:
        with pytest.raises(InputError, match="points 2 to 3: not stored"):
            database.append([row(3), row(2)])
        assert len(database.status()) == 3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"model_version": "0.2.0"}, "model version = 0.1.0: this run has 0.2.0"),
        ({"data_hash": "xyz"}, "data hash = abc: this run has xyz"),
        ({"seed": 2}, "seed = 1: this run has 2"),
        ({"block_size": 20}, "samples = 10: this run has 20"),
        ({"upper": (2500.0, 80.0)}, "upper"),
    ],
)
def test_another_design_is_refused(path, change, message):
    with pytest.raises(InputError, match=message):
        Database.open(path, replace(META, **change))


def test_files_that_are_no_design_are_refused(path, tmp_path):
    text = tmp_path / "text.db"
    text.write_text("mass,speed\n" * 200)
    with pytest.raises(InputError, match="not a readable design"):
        Database.open(text)
    foreign = tmp_path / "foreign.db"
    with sqlite3.connect(foreign) as connection:
        connection.execute("CREATE TABLE points (point INTEGER)")
    connection.close()
    with pytest.raises(InputError, match="not a design of experiments"):
        Database.open(foreign)
    empty = tmp_path / "empty.db"
    empty.touch()
    with pytest.raises(InputError, match="not a design of experiments"):
        Database.open(empty)
    with pytest.raises(InputError, match="no such file"):
        Database.open(tmp_path / "none.db")
    with pytest.raises(InputError, match="exists already"):
        Database.create(path, META)


def test_cut_file_is_refused(path):
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(InputError, match="not a readable design|can not be read"), Database.open(path) as database:
        database.dataset()


def test_file_of_a_run_killed_while_writing_says_so_and_is_repaired(path, tmp_path):
    before = path.read_bytes()
    killed = tmp_path / "killed.db"
    connection = sqlite3.connect(path)
    connection.execute("PRAGMA cache_size = 1")
    connection.execute("UPDATE points SET mass = mass + 1")
    connection.execute("CREATE TABLE filler AS SELECT hex(randomblob(200000)) AS x")  # more than the cache holds
    shutil.copy(path, killed)
    shutil.copy(f"{path}-journal", f"{killed}-journal")
    connection.rollback()
    connection.close()
    assert killed.read_bytes() != before
    with pytest.raises(InputError, match="killed while it wrote: resume"):
        Database.open(killed)
    with Database.open(killed, META, write=True) as repaired, Database.open(path) as original:
        assert repaired.dataset().identical(original.dataset())


def test_other_schema_version_is_refused(path):
    connection = sqlite3.connect(path)
    connection.execute("PRAGMA user_version = 7")
    connection.close()
    with pytest.raises(InputError, match="schema version 7: this program reads 1"):
        Database.open(path)


def test_missing_points_are_noticed(path):
    with Database.open(path, write=True) as database:
        database.append([row(5)])
        with pytest.raises(InputError, match="points 0 to 5: 4 of them"):
            database.status()


def test_rows_that_do_not_fit_are_refused(path):
    with Database.open(path, write=True) as database:
        with pytest.raises(InputError, match="fuel_flow = nan although the point is flyable"):
            database.append([row(3, power=1.0, fuel_flow=float("nan"))])
        with pytest.raises(InputError, match="output 'thrust': one of power, fuel_flow"):
            database.append([row(3, thrust=1.0)])
        with pytest.raises(InputError, match="point 3: inputs mass"):
            database.append([replace(row(3), inputs={"mass": 1.0})])


@pytest.mark.parametrize("name", ["status", "fuel flow", 'x"; DROP TABLE points; --', "mass"])
def test_names_that_can_not_be_columns_are_refused(name):
    with pytest.raises(InputError, match="name"):
        replace(META, outputs=("power", name))
