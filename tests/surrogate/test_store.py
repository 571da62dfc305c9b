"""Surrogates on file: bit-exact round trip, and damaged or foreign files refused in one line."""

import analytic_rotor as rotor
import numpy as np
import pytest
import xarray as xr

from vrsopt.errors import InputError
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.space import LEVEL
from vrsopt.surrogate.store import Surrogate, load, save
from vrsopt.surrogate.validation import leave_one_out


@pytest.fixture(scope="module")
def surrogate():
    inputs = rotor.design(80, seed=1)
    box = {"names": LEVEL.names, "lower": rotor.LOWER, "upper": rotor.UPPER, "theta": np.full(5, 0.8), "nugget": 1e-6}
    power = Kriging("exponential", **box).fit(inputs, rotor.shaft_power(inputs))
    models = {
        "power": power,
        "smooth_power": power.smoothed(0.1),
        "blade_loading": Kriging(**box).fit(inputs[:60], rotor.blade_loading(inputs[:60])),
    }
    figures = {name: leave_one_out(model) for name, model in models.items()}
    return Surrogate(models, "0.1.0", "abc", 2**40, figures)


@pytest.fixture
def path(tmp_path, surrogate):
    save(tmp_path / "surrogate.nc", surrogate)
    return tmp_path / "surrogate.nc"


def test_round_trip_to_the_last_bit(path, surrogate):
    loaded = load(path, model_version="0.1.0", data_hash="abc")
    points = rotor.design(50, seed=2)
    assert list(loaded.models) == list(surrogate.models)
    for name, model in surrogate.models.items():
        np.testing.assert_array_equal(loaded.models[name].predict(points), model.predict(points))
        assert loaded.models[name].state_.names == LEVEL.names
    assert loaded.models["smooth_power"].state_.smoothing == 0.1
    assert loaded.accuracy == surrogate.accuracy
    assert (loaded.model_version, loaded.data_hash, loaded.seed) == ("0.1.0", "abc", 2**40)


def test_loaded_model_still_refuses_to_extrapolate(path):
    with pytest.raises(InputError, match="outside the sampled box"):
        load(path).models["power"].predict(rotor.UPPER[None] + 1.0)


def test_file_is_classic_netcdf_that_others_can_read(path):
    assert path.read_bytes()[:4] == b"CDF\x02"
    with xr.open_dataset(path, engine="scipy") as data:
        assert data.attrs["model_version"] == "0.1.0"
        assert data["power_weights"].attrs["pearson_percent"] > 90.0


def test_saving_replaces_and_leaves_nothing_beside(path, surrogate):
    save(path, Surrogate(surrogate.models, "0.2.0", "abc", 1, surrogate.accuracy))
    assert load(path).model_version == "0.2.0"
    assert [item.name for item in path.parent.iterdir()] == [path.name]
    with pytest.raises(InputError, match="can not be written"):
        save(path.parent / "none" / "surrogate.nc", surrogate)


def test_another_model_or_data_is_refused(path):
    with pytest.raises(InputError, match="model version = 0.1.0: this run has 9"):
        load(path, model_version="9")
    with pytest.raises(InputError, match="data hash = abc: this run has xyz"):
        load(path, data_hash="xyz")


def test_foreign_files_are_refused(tmp_path):
    (tmp_path / "text.nc").write_text("this is no NetCDF")
    (tmp_path / "empty.nc").touch()
    xr.Dataset({"a": ("x", [1.0])}).to_netcdf(tmp_path / "other.nc", engine="scipy")
    for name, message in (("text", "no readable NetCDF"), ("empty", "not a surrogate"), ("other", "no attribute")):
        with pytest.raises(InputError, match=message):
            load(tmp_path / f"{name}.nc")
    with pytest.raises(InputError, match="can not be read"):
        load(tmp_path / "none.nc")


def test_every_damaged_byte_and_every_cut_is_noticed(path):
    content = path.read_bytes()
    random = np.random.default_rng(3)
    reference = load(path)
    points = rotor.design(5, seed=4)
    for position in [*range(0, 200, 3), *random.integers(200, len(content), 200)]:
        damaged = bytearray(content)
        damaged[position] ^= 0x41
        path.write_bytes(damaged)
        try:
            loaded = load(path)
        except InputError as error:
            assert "\n" not in str(error)
            continue
        # a byte between the variables: nothing that is read has changed
        for name, model in reference.models.items():
            np.testing.assert_array_equal(loaded.models[name].predict(points), model.predict(points))
    for length in (0, 3, 40, 500, len(content) // 2, len(content) - 9):
        path.write_bytes(content[:length])
        with pytest.raises(InputError):
            load(path)


def test_incomplete_sets_are_refused(surrogate):
    with pytest.raises(InputError, match="each with its accuracy"):
        Surrogate(surrogate.models, "1", "a", 1, {})
    with pytest.raises(InputError, match="letters, digits and _"):
        Surrogate({"a b": surrogate.models["power"]}, "1", "a", 1, {"a b": surrogate.accuracy["power"]})
