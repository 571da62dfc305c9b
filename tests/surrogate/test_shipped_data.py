"""The shipped design of experiments and surrogate: of this model, reproducible, accurate, small."""

from importlib import resources

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.helicopter import MODEL_VERSION
from vrsopt.residual import TOLERANCE
from vrsopt.surrogate import store
from vrsopt.surrogate.database import Database
from vrsopt.surrogate.design import AIRCRAFT, OUTPUTS, evaluate, model_data_hash
from vrsopt.surrogate.space import LEVEL
from vrsopt.surrogate.training import fit

DATA = resources.files("vrsopt") / "data"


@pytest.fixture(scope="module")
def design():
    with resources.as_file(DATA / "design.db") as path, Database.open(path) as database:
        yield database


@pytest.fixture(scope="module")
def surrogate():
    with resources.as_file(DATA / "surrogate.nc") as path:
        return store.load(path, model_version=MODEL_VERSION, data_hash=model_data_hash())


def test_belongs_to_this_model_and_this_aircraft(design, surrogate):
    assert design.meta.model_version == surrogate.model_version == MODEL_VERSION
    assert design.meta.data_hash == surrogate.data_hash == model_data_hash()
    assert design.meta.names == LEVEL.names and design.meta.outputs == OUTPUTS
    assert AIRCRAFT == "bo105"


@pytest.mark.slow
def test_random_rows_are_recomputed(design):
    rows = design.dataset()
    chosen = np.random.default_rng(20).choice(len(rows.point), 10, replace=False)
    for k in chosen:
        row = rows.isel(point=int(k))
        record = evaluate({name: float(row[name]) for name in LEVEL.names})
        assert record.status == str(row.status.values)
        for name in OUTPUTS:
            stored = float(row[name])
            if np.isfinite(stored):
                assert record.outputs[name] == pytest.approx(stored, rel=1e-6)
            else:
                assert name not in record.outputs


def test_counts_and_residuals(design):
    rows = design.dataset()
    status = rows.status.values
    assert np.sum(status == "ok") == 1500
    below_limit = status != "stalled"
    assert np.sum(status == "not converged") <= 0.005 * np.sum(below_limit)
    assert rows.residual_norm.values[status == "ok"].max() < TOLERANCE
    unexplained = [reason for reason, s in zip(rows.reason.values, status, strict=True) if s != "ok" and not reason]
    assert not unexplained


def test_leave_one_out_of_the_fuel_flow(surrogate):
    fuel = surrogate.accuracy["fuel_flow"]
    assert fuel.pearson_percent >= 99.9
    assert fuel.mean_abs_error_percent <= 0.1
    assert surrogate.accuracy["main_rotor_power"].mean_abs_error_percent <= 0.1


@pytest.mark.parametrize("name", ["hover_rotor_power", "ground_rotor_power", "vertical_rotor_power"])
def test_powers_at_rest_depend_on_four_variables_and_are_all_but_exact(surrogate, name):
    accuracy = surrogate.accuracy[name]
    assert accuracy.pearson_percent >= 99.999 and accuracy.mean_abs_error_percent <= 0.01
    points = np.array([[2000.0, 300.0, speed, 40.0, 0.18] for speed in (0.0, 35.0, 70.0)])
    assert np.ptp(surrogate.models[name].predict(points)) < 50.0  # W


def test_hover_is_that_of_level_flight_at_no_speed(surrogate):
    rng = np.random.default_rng(3)
    low, high = np.array([[1500.0, 0.0, 0.0, 38.0, 0.12], [2200.0, 1200.0, 0.0, 48.0, 0.27]])
    points = rng.uniform(low, high, (40, 5))
    level = sum(surrogate.models[name].predict(points) for name in ("main_rotor_power", "tail_rotor_power"))
    hover = surrogate.models["hover_rotor_power"].predict(points)
    assert level == pytest.approx(hover, rel=5e-3)
    near, climb = (surrogate.models[f"{name}_rotor_power"].predict(points) for name in ("ground", "vertical"))
    assert np.all(near < 0.97 * hover) and np.all(climb > 1.05 * hover)


@pytest.mark.parametrize("name", ["nox_flow", "nox_flow_wide_mixing", "co_flow", "co2_flow"])
def test_leave_one_out_of_the_emissions(surrogate, name):
    """Flows span less than a decade over the flyable points: no logarithm is needed."""
    assert surrogate.accuracy[name].pearson_percent >= 99.9
    assert surrogate.accuracy[name].mean_abs_error_percent <= 0.5


def test_size_of_the_package_data():
    total = sum((DATA / name).read_bytes().__len__() for name in ("design.db", "surrogate.nc"))
    assert total <= 3_000_000


@pytest.mark.slow
def test_shipped_surrogate_is_the_fit_of_the_shipped_design(surrogate):
    with resources.as_file(DATA / "design.db") as path:
        again = fit(path)
    point = np.array([[2000.0, 300.0, 40.0, 40.0, 0.18]])
    for name in ("main_rotor_power", "fuel_flow", "climb_rotor_power"):
        assert again.surrogate.models[name].predict(point) == pytest.approx(
            surrogate.models[name].predict(point), rel=1e-4
        )
    assert again.flyable == 1500 and again.converged > again.flyable
    for accuracy in again.converged_accuracy.values():
        assert accuracy.pearson_percent > 90.0


@pytest.mark.slow
def test_the_study_s_correlation_reaches_its_accuracy():
    """Targets of the reference study for the fuel flow: correlation 99.6 %, error 1.2 %."""
    with resources.as_file(DATA / "design.db") as path:
        fuel = fit(path, correlation="exponential").flyable_accuracy["fuel_flow"]
    assert fuel.pearson_percent >= 99.6
    assert fuel.mean_abs_error_percent <= 1.2


def test_another_model_version_is_refused(tmp_path):
    with resources.as_file(DATA / "surrogate.nc") as path, pytest.raises(InputError, match="model version"):
        store.load(path, model_version="0")
