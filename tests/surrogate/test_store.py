"""Surrogates on file: bit-exact round trip; damaged, foreign and hostile files refused in one line, at little cost."""

import hashlib
import re
import tracemalloc
from dataclasses import replace

import analytic_rotor as rotor
import numpy as np
import pytest
import xarray as xr

from vrsopt.errors import InputError
from vrsopt.surrogate.classic_netcdf import read
from vrsopt.surrogate.digested import NO_DIGEST
from vrsopt.surrogate.kriging import Kriging
from vrsopt.surrogate.space import LEVEL
from vrsopt.surrogate.store import Surrogate, load, save
from vrsopt.surrogate.validation import leave_one_out

SOURCE = {"model_version": "0.1.0", "data_hash": "abc", "space": "level", "method": "sobol", "samples": 80}


@pytest.fixture(scope="module")
def surrogate():
    inputs = rotor.design(80, seed=1)
    box = {"names": LEVEL.names, "lower": rotor.LOWER, "upper": rotor.UPPER, "theta": np.full(5, 0.8), "nugget": 1e-6}
    power = Kriging("exponential", **box).fit(inputs, rotor.shaft_power(inputs))
    steps = np.diag(1e-5 * (rotor.UPPER - rotor.LOWER))
    slopes = [(rotor.shaft_power(inputs + s) - rotor.shaft_power(inputs - s)) / (2 * s.max()) for s in steps]
    enhanced = Kriging("matern52", trend="constant", gradient_nugget=1e-6, **box)
    models = {
        "power": power,
        "smooth_power": power.smoothed(0.1),
        "blade_loading": Kriging(trend="linear", **box).fit(inputs[:60], rotor.blade_loading(inputs[:60])),
        "enhanced": enhanced.fit(inputs[:40], rotor.shaft_power(inputs[:40]), np.stack(slopes, axis=1)[:40]),
    }
    figures = {name: leave_one_out(model) for name, model in models.items()}
    return Surrogate(models, figures, **SOURCE, seed=2**40)


@pytest.fixture(scope="module")
def content(surrogate, tmp_path_factory):
    path = tmp_path_factory.mktemp("store") / "surrogate.nc"
    save(path, surrogate)
    return path.read_bytes()


@pytest.fixture
def path(tmp_path, content):
    (tmp_path / "surrogate.nc").write_bytes(content)
    return tmp_path / "surrogate.nc"


def signed(content):
    """With the digest of what it has become: what is left to notice is in the file itself."""
    found = re.search(rb"digest\x00\x00\x00\x00\x00\x02\x00\x00\x00@([0-9a-f]{64})", content)
    if not found:
        return content
    blank = content[: found.start(1)] + NO_DIGEST.encode() + content[found.end(1) :]
    return blank.replace(NO_DIGEST.encode(), hashlib.sha256(blank).hexdigest().encode(), 1)


def refused(path, content):
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        load(path)
    message = str(caught.value)
    assert "\n" not in message and len(message) < 400 and message.startswith(str(path))
    return message


def test_round_trip_to_the_last_bit(path, surrogate):
    loaded = load(path, model_version="0.1.0", data_hash="abc")
    points = rotor.design(50, seed=2)
    assert list(loaded.models) == list(surrogate.models)
    for name, model in surrogate.models.items():
        again = loaded.models[name]
        for one, other in zip(again.predict(points, True), model.predict(points, True), strict=True):
            np.testing.assert_array_equal(one, other)
        np.testing.assert_array_equal(again.hessian(points), model.hessian(points))
        for one, other in zip(again.leave_one_out(True), model.leave_one_out(True), strict=True):
            np.testing.assert_array_equal(one, other)
        for field, value in vars(model.state_).items():
            if field in model.state_.__dataclass_fields__:
                np.testing.assert_array_equal(getattr(again.state_, field), value)
    assert loaded.accuracy == surrogate.accuracy and loaded.names == LEVEL.names
    for field, value in SOURCE.items():
        assert getattr(loaded, field) == value
    assert loaded.seed == 2**40 and loaded.versions == surrogate.versions
    assert set(loaded.versions) == {"vrsopt", "numpy", "scipy"}


def test_rows_that_outputs_share_are_stored_once(content):
    _, variables = read(content)
    assert sorted(name for name in variables if name.startswith("inputs_")) == ["inputs_0", "inputs_1", "inputs_2"]
    assert variables["inputs_0"].values.shape == (80, 5)
    assert variables["weights_smooth_power"].attributes["rows"] == 0.0


def test_saving_the_same_gives_the_same_bytes(path, content):
    save(path, load(path))
    assert path.read_bytes() == content


def test_loaded_model_still_refuses_to_extrapolate(path):
    with pytest.raises(InputError, match="outside the sampled box"):
        load(path).models["power"].predict(rotor.UPPER[None] + 1.0)


def test_file_is_classic_netcdf_that_others_can_read(path):
    assert path.read_bytes()[:4] == b"CDF\x02"
    with xr.open_dataset(path, engine="scipy") as data:
        assert data.attrs["model_version"] == "0.1.0" and data.attrs["inputs"].split() == list(LEVEL.names)
        assert data["weights_power"].attrs["pearson_percent"] > 90.0


def test_saving_replaces_and_leaves_nothing_beside(path, surrogate):
    save(path, replace(surrogate, model_version="0.2.0"))
    assert load(path).model_version == "0.2.0"
    assert [item.name for item in path.parent.iterdir()] == [path.name]
    with pytest.raises(InputError, match="can not be written"):
        save(path.parent / "none" / "surrogate.nc", surrogate)


def test_another_model_or_data_is_refused(path):
    with pytest.raises(InputError, match="model version = 0.1.0: this run has 9"):
        load(path, model_version="9")
    with pytest.raises(InputError, match="data hash = abc: this run has xyz"):
        load(path, data_hash="xyz")


def test_foreign_files_are_refused(path):
    assert "classic format" in refused(path, b"this is no NetCDF")
    assert "classic format" in refused(path, b"")
    assert "classic format" in refused(path, b"\x89HDF\r\n\x1a\n" + bytes(500))
    xr.Dataset({"a": ("x", [1.0])}).to_netcdf(path, engine="scipy")
    assert "no attribute format" in refused(path, path.read_bytes())
    xr.Dataset({"a": ("x", ["text"])}, attrs={"history": "two\nlines"}).to_netcdf(path, engine="scipy")
    assert "not a surrogate" in refused(path, path.read_bytes())
    with pytest.raises(InputError, match="can not be read"):
        load(path.parent / "none.nc")
    with pytest.raises(InputError, match="not a file"):
        load(path.parent)


def test_another_format_version_is_refused(path, content):
    name = b"format_version\0\0\0\0\0\4\0\0\0\1\0\0\0"
    assert content.count(name + b"\2") == 1
    message = refused(path, content.replace(name + b"\2", name + b"\1"))
    assert "format version 1: this program reads 2; fit it again" in message


def test_every_changed_bit_is_noticed(path, content):
    random = np.random.default_rng(3)
    for position in [*range(0, 1500, 15), *random.integers(0, len(content), 200)]:
        damaged = bytearray(content)
        damaged[position] ^= 1 << int(random.integers(8))
        refused(path, bytes(damaged))


def test_every_cut_and_every_addition_is_noticed(path, content):
    for length in [*range(0, 3000, 41), *np.linspace(3000, len(content) - 1, 60).astype(int)]:
        refused(path, content[:length])
    assert "digest" in refused(path, content + bytes(4))
    assert "digest" in refused(path, content[:-4] + content[:4])


def test_changes_under_a_valid_digest_end_in_one_line_or_in_a_model(path, content):
    """Whoever writes the file can write its digest: the structure alone keeps harm away. Half hits the header."""
    random = np.random.default_rng(4)
    header = content.index(b"weights_power") + 600
    outcomes = {"refused": 0, "loaded": 0}
    tracemalloc.start()
    for trial in range(200):
        damaged = bytearray(content)
        for _ in range(1 + trial % 3):
            where = int(random.integers(4, header if trial % 2 else len(content)))
            damaged[where] = int(random.integers(256))
        path.write_bytes(signed(bytes(damaged)))
        try:
            loaded = load(path)
        except InputError as error:
            assert "\n" not in str(error)
            outcomes["refused"] += 1
        else:
            assert loaded.models and len(loaded.names) == 5
            outcomes["loaded"] += 1
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20 * len(content)
    assert outcomes["refused"] > 60 and outcomes["loaded"] > 20


def word(value):
    return value.to_bytes(4, "big", signed=value < 0)


@pytest.mark.parametrize("size", [2**31 - 1, 2**28, 10_000, 0, -1, -(2**31)])
def test_absurd_sizes_cost_nothing(path, content, size):
    """Lengths of dimensions, names, lists and texts: refused before anything is allocated."""
    places = [
        content.index(b"point_0") + 8,  # length of a dimension
        content.index(b"point_0") - 4,  # of its name
        content.index(b"format\0\0") - 8,  # number of attributes
        content.index(b"format\0\0") + 12,  # length of a text
        content.index(b"inputs_0") + 8,  # dimensions of a variable
        content.index(b"inputs_0") + 12,  # which one
        8 + 4,  # number of dimensions
        4,  # records
    ]
    tracemalloc.start()
    for place in places:
        if content[place : place + 4] != word(size):
            refused(path, content[:place] + word(size) + content[place + 4 :])
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20 * len(content)


def test_variables_that_share_bytes_do_not_multiply(path, content):
    """Many variables that all point at one block would make gigabytes of a small file."""
    values = 8 * 5000
    begin = 40_000 + values
    variable = word(1) + word(0) + word(0) * 2 + word(6) + word(values) + begin.to_bytes(8, "big")
    head = b"CDF\x02" + word(0) + word(10) + word(1) + word(1) + b"d\0\0\0" + word(5000) + word(0) * 2
    names = [f"v{k:06d}".encode() + b"\0" for k in range(1000)]
    variables = b"".join(word(7) + name + variable for name in names)
    bomb = head + word(11) + word(len(names)) + variables
    assert "longer than the file" in refused(path, bomb + bytes(begin + values - len(bomb)))


def test_large_files_are_not_read(path):
    with path.open("wb") as stream:
        stream.truncate(2**26 + 1)
    with pytest.raises(InputError, match="longer than 64 MiB"):
        load(path)


def changed(path, change):
    """The file after ``change`` of its dataset, with a valid digest."""
    with xr.open_dataset(path, engine="scipy") as lazy:
        dataset = lazy.load()
    dataset = change(dataset) or dataset
    return signed(bytes(dataset.to_netcdf(None, engine="scipy", format="NETCDF3_64BIT")))


def attribute(name, value, variable=None):
    def change(dataset):
        (dataset if variable is None else dataset[variable]).attrs[name] = value

    return change


def entry(variable, value, index=(0,)):
    def change(dataset):
        dataset[variable].values[index] = value

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (attribute("correlation", "cubic", "weights_power"), "power: correlation 'cubic'"),
        (attribute("correlation", 3.0, "weights_power"), "correlation: a text"),
        (attribute("trend", "cubic", "weights_power"), "trend 'cubic'"),
        (attribute("trend", "linear", "weights_power"), r"coefficients has shape \(21,\): expected \(6,\)"),
        (
            attribute("correlation", "exponential", "weights_enhanced"),
            "enhanced: gradients with correlation 'exponential'",
        ),
        (attribute("smoothing", 0.1, "weights_blade_loading"), "smoothing = 0.1: 0, or up to 1"),
        (attribute("nugget", -1e-6, "weights_power"), "nuggets and variance >= 0"),
        (attribute("nugget", "small", "weights_power"), "nugget: a finite number"),
        (attribute("variance", np.nan, "weights_power"), "variance: a finite number"),
        (attribute("mean", [1.0, 2.0], "weights_power"), "mean: a finite number"),
        (attribute("scale", 0.0, "weights_power"), "scale > 0"),
        (attribute("rows", 1, "weights_power"), r"inputs has shape \(60, 5\): expected \(80, 5\)"),
        (attribute("rows", 1e300, "weights_power"), r"inputs_1e\+300 is missing"),
        (attribute("pearson_percent", "good", "weights_power"), "pearson_percent: a finite number"),
        (attribute("inputs", "mass altitude speed rotor_speed"), r"coefficients has shape \(21,\): expected \(15,\)"),
        (attribute("inputs", "mass altitude speed rotor_speed mass"), "inputs: different names"),
        (attribute("inputs", " ".join(f"x{k}" for k in range(21))), "21 inputs, 4 outputs: at most 20 and 200"),
        (attribute("outputs", "power os.system"), "outputs: different names"),
        (attribute("outputs", "power torque"), "weights_torque is missing"),
        (attribute("outputs", " "), "outputs: different names"),
        (attribute("seed", "1e5"), "seed = '1e5': a whole number"),
        (attribute("samples", 0), "samples = 0: at least 1"),
        (attribute("space", 5), "space: a text"),
        (attribute("space", "x" * 20_000), "space: a text of at most 10000"),
        (attribute("format", [1.0, 2.0]), "no attribute format"),
        (attribute("format_version", [2.0, 2.0]), "format version unknown"),
        (attribute("model_version", "1\n2"), "control characters"),
        (entry("weights_power", np.inf), "power: weights: finite numbers only"),
        (entry("inputs_0", np.nan, (3, 2)), "inputs: finite numbers only"),
        (entry("inputs_0", 3000.0, (3, 0)), "power: inputs: between lower and upper"),
        (entry("theta_power", 0.0), "theta > 0"),
        (entry("lower_power", 1e9), "lower < upper"),
        (lambda data: data.drop_vars("theta_power"), "theta_power is missing"),
        (lambda data: data.assign(theta_power=("input", np.ones(5, dtype="f4"))), "not in double precision"),
        (lambda data: data.assign(theta_power=("term_21", np.ones(21))), r"theta has shape \(21,\)"),
        (lambda data: data.assign(weights_power=((), 1.0, data.weights_power.attrs)), "shape"),
        (lambda data: data.assign(gradient_weights_enhanced=("input", np.ones(5))), "gradient_weights has shape"),
    ],
)
def test_what_no_fit_has_is_refused_whatever_the_digest(path, change, message):
    with pytest.raises(InputError, match=message):
        load_changed(path, change)


def load_changed(path, change):
    path.write_bytes(changed(path, change))
    return load(path)


def test_the_changes_above_are_noticed_for_their_own_sake(path, surrogate):
    """The way they are made, without a change, loads."""
    assert load_changed(path, lambda data: None).accuracy == surrogate.accuracy


def test_incomplete_sets_are_refused(surrogate):
    one = {"power": surrogate.models["power"]}
    figures = {"power": surrogate.accuracy["power"]}
    with pytest.raises(InputError, match="each with its accuracy"):
        Surrogate(one, {}, **SOURCE, seed=1)
    with pytest.raises(InputError, match="letters, digits and _"):
        Surrogate({"a b": one["power"]}, {"a b": figures["power"]}, **SOURCE, seed=1)
    with pytest.raises(InputError, match="printable ASCII"):
        Surrogate(one, figures, **{**SOURCE, "method": "two\nlines"}, seed=1)
    with pytest.raises(InputError, match="samples = 0: at least 1"):
        Surrogate(one, figures, **{**SOURCE, "samples": 0}, seed=1)
    inputs = rotor.design(40, seed=1)
    other = Kriging(theta=np.ones(5), nugget=1e-6).fit(inputs, rotor.shaft_power(inputs))
    with pytest.raises(InputError, match="other of x0, x1, x2, x3, x4: of mass"):
        Surrogate({**one, "other": other}, {**figures, "other": figures["power"]}, **SOURCE, seed=1)
