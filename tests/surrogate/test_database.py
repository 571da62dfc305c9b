"""The design of experiments on file: round trip, read-only reading, exports, and every refusal with its message."""

import hashlib
import shutil
import sqlite3
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from vrsopt.errors import InputError
from vrsopt.surrogate.database import Database, DesignMeta, PointRecord, Row
from vrsopt.surrogate.design import PHYSICS
from vrsopt.surrogate.design_table import read_points, unit
from vrsopt.surrogate.space import SPACES

META = DesignMeta(
    "0.1.0",
    "abc",
    "small",
    "latin_hypercube",
    1,
    10,
    ("mass", "speed"),
    (1400.0, 0.0),
    (2500.0, 70.0),
    ("power", "fuel_flow"),
    ("fuel_flow",),
)


def row(point, status="ok", slopes=True, **outputs):
    values = outputs or {"power": 1e5 + point, "fuel_flow": 0.1 / 3.0}
    reason = "" if status == "ok" else "blade loading 0.130 above 0.120, \u00abstall\u00bb"
    derivatives = {"fuel_flow": {"mass": 1e-5 / 3.0 * (1 + point), "speed": np.nan}} if slopes else {}
    record = PointRecord(values, status, reason, 5, 1e-10, derivatives)
    return Row(point, {"mass": 2000.0 + point / 3.0, "speed": 30.0}, record, 0.25)


ROWS = [row(2, "not converged", slopes=False, power=np.nan), row(-2), row(0), row(-1), row(1, "stalled")]


@pytest.fixture
def path(tmp_path):
    """Rows as they may arrive; a third point is to be added."""
    file = tmp_path / "a design #1.db"
    with Database.create(file, META) as database:
        database.register([[2000.0 - 1 / 3.0, 30.0], [2000.0 - 2 / 3.0, 30.0], [1500.0, 3.0]])
        for each in ROWS:
            database.append([each])
    return file


def test_round_trip_to_the_last_bit_in_the_order_of_the_design(path):
    with Database.open(path, META) as database:
        assert (database.meta, database.samples) == (META, 10)
        inputs, outputs = database.arrays()
        everything, results = database.arrays(flyable=False)
        assert database.found() == {0: "ok", 1: "stalled", 2: "not converged", -1: "ok", -2: "ok"}
        assert database.status() == ["ok", "stalled", "not converged", "ok", "ok"]
        assert database.pending() == {-3: (1500.0, 3.0)}
    np.testing.assert_array_equal(inputs, [[2000.0, 30.0], [2000.0 - 1 / 3.0, 30.0], [2000.0 - 2 / 3.0, 30.0]])
    np.testing.assert_array_equal(outputs, [[1e5 + k, 0.1 / 3.0] for k in (0, -1, -2)])
    assert everything[1, 0] == 2000.0 + 1.0 / 3.0
    assert np.all(np.isnan(results[2]))


def test_derivatives_are_rows_of_the_same_points(path):
    with Database.open(path) as database:
        flyable, everything = database.derivatives(), database.derivatives(flyable=False)
    assert everything.shape == (5, 2, 2) and flyable.shape == (3, 2, 2)
    assert np.all(np.isnan(everything[:, 0])) and np.all(np.isnan(everything[:, 1, 1]))
    np.testing.assert_array_equal(everything[:, 1, 0], [1e-5 / 3.0, 2e-5 / 3.0, np.nan, 0.0, -1e-5 / 3.0])
    np.testing.assert_array_equal(flyable, everything[[0, 3, 4]])


def test_data_set_has_units_and_all_there_is_to_know(path):
    with Database.open(path) as database:
        data = database.dataset()
    assert data.sequence.values.tolist() == [0, 1, 2, -1, -1]
    assert data.status.values.tolist()[:3] == ["ok", "stalled", "not converged"]
    assert "0.130" in str(data.reason.values[1])
    assert data.d_fuel_flow.dims == ("point", "input") and "d_power" not in data
    assert float(data.d_fuel_flow.sel(input="mass")[1]) == 2e-5 / 3.0
    assert (data.mass.units, data.power.units, data.fuel_flow.units) == ("kg", "W", "kg/s")
    assert data.unit.values.tolist() == ["kg", "m/s"] and data.upper.values.tolist() == [2500.0, 70.0]
    assert (data.attrs["seed"], data.attrs["outputs"], data.attrs["space"]) == (1, "power fuel_flow", "small")


@pytest.mark.parametrize("space", SPACES)
def test_every_column_of_the_physics_has_its_unit(space):
    words = {"power": "W", "flow": "kg/s", "temperature": "K", "loading": "1", "consumption": "kg/J"}
    for name in (*SPACES[space].names, *PHYSICS[space].outputs):
        assert unit(name), name
        assert unit(name) == words.get(name.split("_")[-1], unit(name))
    assert (unit("shaft_power_per_engine"), unit("nox_flow_wide_mixing"), unit("colour")) == ("W", "kg/s", "")


def test_netcdf_is_the_data_set(path, tmp_path):
    with Database.open(path) as database:
        database.to_netcdf(tmp_path / "design.nc")
        data = database.dataset()
    with xr.open_dataset(tmp_path / "design.nc", engine="scipy") as file:
        loaded = file.load()
    assert loaded.attrs.pop("seed") == str(data.attrs.pop("seed"))
    for name in ("status", "reason", "unit", "input"):
        loaded[name] = loaded[name].astype(str)
    assert loaded.identical(data)


def test_seed_of_any_length_can_be_exported(tmp_path):
    with Database.create(tmp_path / "a.db", replace(META, seed=2**62)) as database:
        database.to_netcdf(tmp_path / "a.nc")
    with xr.open_dataset(tmp_path / "a.nc", engine="scipy") as data:
        assert data.attrs["seed"] == str(2**62) and data.sizes["point"] == 0


def test_csv_can_be_fed_back(path, tmp_path):
    table = tmp_path / "design.csv"
    with Database.open(path) as database:
        database.to_csv(table)
        inputs, _ = database.arrays(flyable=False)
    head, *lines = table.read_text(encoding="utf-8").splitlines()
    assert head == (
        "point,sequence,mass,speed,power,fuel_flow,status,reason,iterations,residual_norm,seconds,"
        "d_fuel_flow_d_mass,d_fuel_flow_d_speed"
    )
    assert lines[0] == f"0,0,2000.0,30.0,100000.0,{0.1 / 3!r},ok,,5,1e-10,0.25,{1e-5 / 3!r},"
    assert lines[3].startswith("3,,1999.66")
    assert lines[2].startswith("2,2,2000.66") and ",,,not converged," in lines[2] and lines[2].endswith(",,")
    np.testing.assert_array_equal(read_points(table, META), inputs)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no column mass: needed are mass, speed"),
        ("mass\n2000\n", "no column speed: needed are mass, speed"),
        ("mass,speed,colour\n2000,3,red\n", "column 'colour': one of mass, speed, or of an export"),
        ("mass,speed,mass\n2000,3,2\n", "column mass: 2 times: allowed once"),
        ("mass,speed\n", "no points"),
        ("mass,speed\n2000,3\n\n2000,fast\n", "line 4: speed = 'fast': a number"),
        ("mass,speed\n2000\n", "line 2: 1 values: 2, one for each column"),
        ("mass,speed\n\0\udcff\n", "not a CSV file"),
    ],
)
def test_tables_of_points_that_are_refused(tmp_path, text, message):
    table = tmp_path / "points.csv"
    table.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(InputError, match=f"points.csv: {message}"):
        read_points(table, META)


def test_table_as_a_spreadsheet_writes_it(tmp_path):
    (tmp_path / "points.csv").write_bytes("\ufeffspeed, mass\r\n3,2e3\r\n4, 2100 \r\n".encode())
    np.testing.assert_array_equal(read_points(tmp_path / "points.csv", META), [[2000.0, 3.0], [2100.0, 4.0]])
    with pytest.raises(InputError, match="none.csv: can not be read"):
        read_points(tmp_path / "none.csv", META)


def test_exports_to_nowhere_are_refused(path, tmp_path):
    with Database.open(path) as database:
        for write in (database.to_csv, database.to_netcdf):
            with pytest.raises(InputError, match="can not be written"):
                write(tmp_path / "nowhere" / "a")


def test_empty_design_reads_as_no_points(tmp_path):
    with Database.create(tmp_path / "empty.db", META) as database:
        assert database.status() == []
        assert database.arrays()[0].shape == (0, 2)
        assert database.derivatives().shape == (0, 2, 2)
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
        before = database.dataset()
        with pytest.raises(InputError, match="points 2 to 3: not stored"):
            database.append([row(3), row(2)])
        with pytest.raises(InputError, match="point 4: derivatives of 'power' by mass: the file's"):
            database.append(
                [row(3), replace(row(4), record=replace(row(4).record, derivatives={"power": {"mass": 1}}))]
            )
        assert database.dataset().identical(before)


def test_cut_removes_the_end_of_the_sequence_with_its_derivatives(path):
    with Database.open(path, write=True) as database:
        database.cut(3)
        assert len(database.status()) == 5
        database.cut(1)
        assert list(database.found()) == [0, -1, -2]
        assert database._connection.execute("SELECT point FROM derivatives").fetchall() == [(-2,), (-1,), (0,)]


def test_added_points_are_noted_once(path):
    with Database.open(path, write=True) as database:
        database.register([[2000.0, 30.0], [1500.0, 3.0], [1600.0, 3.0], [1600.0, 3.0], [2000.0 - 1 / 3.0, 30.0]])
        assert database.pending() == {-3: (1500.0, 3.0), -4: (1600.0, 3.0)}


def test_design_is_extended_but_not_shortened(path):
    with Database.open(path, write=True) as database:
        database.extend(30)
    with Database.open(path, write=True) as database:
        assert (database.samples, database.meta) == (30, META)
        with pytest.raises(InputError, match="samples = 30: this run has 29: at least as many"):
            database.extend(29)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"model_version": "0.2.0"}, "model version = 0.1.0: this run has 0.2.0"),
        ({"data_hash": "xyz"}, "data hash = abc: this run has xyz"),
        ({"space": "flight", "names": ("mass", "altitude")}, "space = small: this run has flight"),
        ({"method": "sobol"}, "method = latin_hypercube: this run has sobol"),
        ({"seed": 2}, "seed = 1: this run has 2"),
        ({"upper": (2500.0, 80.0)}, "upper"),
        ({"derivatives": ()}, "derivatives"),
    ],
)
def test_another_design_is_refused(path, change, message):
    with pytest.raises(InputError, match=message):
        Database.open(path, replace(META, **change))


def test_part_of_what_is_expected(path):
    Database.open(path, {"data_hash": "abc"}).close()
    Database.open(path, replace(META, block_size=20)).close()
    with pytest.raises(InputError, match="data hash = abc: this run has xyz"):
        Database.open(path, {"data_hash": "xyz"})


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
    with pytest.raises(InputError, match="no such file"):
        Database.open(tmp_path / "none.db")
    for taken in (path, text, foreign):
        with pytest.raises(InputError, match="exists already"):
            Database.create(taken, META)


def test_empty_file_is_no_design_but_can_become_one(tmp_path):
    empty = tmp_path / "empty.db"
    empty.touch()
    with pytest.raises(InputError, match="not a design of experiments"):
        Database.open(empty)
    Database.create(empty, META).close()
    Database.open(empty, META).close()


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
    connection.execute("PRAGMA user_version = 1")
    connection.close()
    with pytest.raises(InputError, match="schema version 1: this program reads 2: sample it again"):
        Database.open(path)


@pytest.mark.parametrize(
    ("damage", "table"),
    [
        ("DELETE FROM meta WHERE name = 'samples'", "meta"),
        ("UPDATE meta SET value = 'null' WHERE name = 'samples'", "meta"),
        ("UPDATE meta SET value = '[' WHERE name = 'seed'", "meta"),
        ("ALTER TABLE points DROP COLUMN power", "points"),
        ("DROP TABLE derivatives", "derivatives"),
    ],
)
def test_damaged_tables_are_refused(path, damage, table):
    connection = sqlite3.connect(path)
    with connection:
        connection.execute(damage)
    connection.close()
    with pytest.raises(InputError, match=f"its {table} table is damaged"):
        Database.open(path)


def test_rows_that_do_not_fit_are_refused(path):
    with Database.open(path, write=True) as database:
        with pytest.raises(InputError, match="fuel_flow = nan although the point is flyable"):
            database.append([row(3, power=1.0, fuel_flow=float("nan"))])
        with pytest.raises(InputError, match="output 'thrust': one of power, fuel_flow"):
            database.append([row(3, thrust=1.0)])
        with pytest.raises(InputError, match="point 3: inputs mass"):
            database.append([replace(row(3), inputs={"mass": 1.0})])


@pytest.mark.parametrize("name", ["status", "fuel flow", 'x"; DROP TABLE points; --', "mass", "d_fuel_flow", "Input"])
def test_names_that_can_not_be_columns_are_refused(name):
    with pytest.raises(InputError, match="name"):
        replace(META, outputs=("power", "fuel_flow", name))


def test_derivatives_are_those_of_outputs():
    with pytest.raises(InputError, match="derivatives of 'thrust': of one of power, fuel_flow"):
        replace(META, derivatives=("thrust",))


@pytest.mark.parametrize("form", ["netcdf", "csv"])
def test_a_table_does_not_replace_the_design(tmp_path, form):
    path = tmp_path / f"design.{form}"
    with Database.create(path, META) as database:
        before = path.read_bytes()
        with pytest.raises(InputError, match="can not be written: it is the design of experiments itself"):
            getattr(database, f"to_{form}")(path)
    assert path.read_bytes() == before
