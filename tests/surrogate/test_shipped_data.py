"""The shipped designs of experiments and surrogates: of this model, reproducible, accurate, small."""

from importlib import resources

import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.helicopter import MODEL_VERSION
from vrsopt.residual import TOLERANCE
from vrsopt.surrogate import store
from vrsopt.surrogate.database import Database
from vrsopt.surrogate.design import OUTPUTS, PHYSICS, WITH_DERIVATIVES, model_data_hash
from vrsopt.surrogate.space import SPACES
from vrsopt.surrogate.validation import accuracy, leave_one_out

DATA = resources.files("vrsopt") / "data"
FILES = {"level": ("design.db", "surrogate.nc"), "flight": ("flight_design.db", "flight_surrogate.nc")}
LARGEST_ERRORS = {"level": 0.4, "flight": 0.8}  # %, mean absolute error of the fuel flow, left out
STATUS = {"ok", "stalled", "tail rotor", "over power", "over temperature", "turn rate", "not converged"}


@pytest.fixture(scope="module", params=FILES)
def space(request):
    return request.param


@pytest.fixture(scope="module")
def design(space):
    with resources.as_file(DATA / FILES[space][0]) as path, Database.open(path) as database:
        yield database


@pytest.fixture(scope="module")
def surrogate(space):
    return load(space)


@pytest.fixture(scope="module")
def level():
    return load("level")


def load(space):
    with resources.as_file(DATA / FILES[space][1]) as path:
        return store.load(path, model_version=MODEL_VERSION, data_hash=model_data_hash())


def test_belongs_to_this_model_and_this_aircraft(space, design, surrogate):
    assert design.meta.model_version == surrogate.model_version == MODEL_VERSION
    assert design.meta.data_hash == surrogate.data_hash == model_data_hash()
    assert design.meta.space == surrogate.space == space and surrogate.samples == design.samples == 1500
    assert design.meta.names == SPACES[space].names
    assert (design.meta.lower, design.meta.upper) == (SPACES[space].lower, SPACES[space].upper)
    assert design.meta.outputs == tuple(surrogate.models) == PHYSICS[space].outputs
    assert design.meta.derivatives == WITH_DERIVATIVES


@pytest.mark.slow
def test_random_rows_are_recomputed(space, design):
    rows, slopes = design.rows(), design.derivatives(flyable=False)
    status = np.array(rows["status"])
    rng = np.random.default_rng(20)
    chosen = [rng.choice(np.flatnonzero(status == wanted)) for wanted in ("ok", "stalled", "tail rotor")]
    for k in chosen:
        record = PHYSICS[space].evaluate({name: rows[name][k] for name in design.meta.names})
        assert (record.status, record.reason) == (status[k], rows["reason"][k])
        stored = {name: rows[name][k] for name in design.meta.outputs if rows[name][k] is not None}
        assert record.outputs == pytest.approx(stored, rel=1e-6)
        for name in WITH_DERIVATIVES:
            known = slopes[k, design.meta.outputs.index(name)]
            row = record.derivatives.get(name, {})
            found = [row.get(variable, np.nan) for variable in design.meta.names]
            assert np.allclose(found, known, rtol=1e-4, atol=0.0, equal_nan=True), name


def test_counts_and_residuals(space, design):
    rows, inputs = design.rows(), design.arrays(flyable=False)[0]
    status, residual = np.array(rows["status"]), np.array(rows["residual_norm"], dtype=float)
    assert set(status) <= STATUS and ("turn rate" in status) == (space == "flight")
    assert np.sum(status == "ok") == 1500
    assert np.sum(status == "not converged") <= 0.005 * np.sum(status != "stalled")
    assert residual[status == "ok"].max() < TOLERANCE
    assert all(bool(reason) == (s != "ok") for reason, s in zip(rows["reason"], status, strict=True))
    assert np.all(inputs >= design.meta.lower) and np.all(inputs <= design.meta.upper)


def test_flyable_points_have_every_output_and_its_derivatives(design):
    """The powers beside a point are missing where they can not be flown."""
    _, outputs = design.arrays()
    columns = [design.meta.outputs.index(name) for name in OUTPUTS]
    assert np.isfinite(outputs[:, columns]).all()
    slopes = design.derivatives()[:, [design.meta.outputs.index(name) for name in WITH_DERIVATIVES]]
    assert np.isfinite(slopes).all()


def test_derivatives_of_the_rows_predict_their_neighbours(design):
    """The nearest points, by the first-order step from the one to the other: a sign or a unit would show."""
    inputs, outputs = design.arrays()
    column = design.meta.outputs.index("shaft_power_per_engine")
    power, slope = outputs[:, column], design.derivatives()[:, column]
    scaled = (inputs - design.meta.lower) / np.subtract(design.meta.upper, design.meta.lower)
    distance = np.sum((scaled[:, None] - scaled) ** 2, axis=2) + 9.0 * np.eye(len(scaled))
    one = np.argsort(distance.min(axis=1))[:100]
    other = distance[one].argmin(axis=1)
    step = 0.5 * np.sum((slope[one] + slope[other]) * (inputs[other] - inputs[one]), axis=1)
    change = power[other] - power[one]
    assert np.corrcoef(step, change)[0, 1] > 0.99
    assert np.polyfit(change, step, 1)[0] == pytest.approx(1.0, abs=0.05)


def test_leave_one_out_of_the_fuel_flow(space, surrogate):
    fuel = surrogate.accuracy["fuel_flow"]
    assert fuel.pearson_percent >= 99.9
    assert fuel.mean_abs_error_percent <= LARGEST_ERRORS[space] / 2
    assert surrogate.accuracy["main_rotor_power"].mean_abs_error_percent <= LARGEST_ERRORS[space] / 2
    for name, figures in surrogate.accuracy.items():
        assert figures.pearson_percent >= 99.0 and abs(figures.slope_deg - 45.0) < 0.5, name


def test_the_surrogate_is_a_fit_of_the_design(design, surrogate):
    inputs, outputs = design.arrays()
    for name in ("main_rotor_power", "fuel_flow"):
        state = surrogate.models[name].state_
        assert np.array_equal(state.inputs, inputs)
        values = outputs[:, design.meta.outputs.index(name)]
        assert state.outputs() == pytest.approx(values, rel=1e-7)
    again = leave_one_out(surrogate.models["fuel_flow"])
    assert again.as_dict() == pytest.approx(surrogate.accuracy["fuel_flow"].as_dict(), rel=1e-4, abs=1e-5)


@pytest.mark.parametrize("name", ["hover_rotor_power", "ground_rotor_power", "vertical_rotor_power"])
def test_powers_at_rest_depend_on_four_variables_and_are_all_but_exact(level, name):
    figures = level.accuracy[name]
    assert figures.pearson_percent >= 99.999 and figures.mean_abs_error_percent <= 0.01
    points = np.array([[2000.0, 300.0, speed, 40.0, 0.18] for speed in (0.0, 35.0, 70.0)])
    assert np.ptp(level.models[name].predict(points)) < 50.0  # W


def test_hover_is_that_of_level_flight_at_no_speed(level):
    rng = np.random.default_rng(3)
    low, high = np.array([[1500.0, 0.0, 0.0, 38.0, 0.12], [2200.0, 1200.0, 0.0, 48.0, 0.27]])
    points = rng.uniform(low, high, (40, 5))
    power = sum(level.models[name].predict(points) for name in ("main_rotor_power", "tail_rotor_power"))
    hover = level.models["hover_rotor_power"].predict(points)
    assert power == pytest.approx(hover, rel=5e-3)
    near, climb = (level.models[f"{name}_rotor_power"].predict(points) for name in ("ground", "vertical"))
    assert np.all(near < 0.97 * hover) and np.all(climb > 1.05 * hover)


def test_both_surrogates_agree_on_level_flight(level):
    rng = np.random.default_rng(4)
    points = rng.uniform([1500.0, 0.0, 5.0, 38.0, 0.12], [2200.0, 1200.0, 60.0, 48.0, 0.27], (60, 5))
    straight = np.column_stack([points, np.zeros(60), np.ones(60)])
    flight = load("flight")
    for name in ("main_rotor_power", "fuel_flow", "turbine_inlet_temperature"):
        figures = accuracy(level.models[name].predict(points), flight.models[name].predict(straight))
        assert figures.mean_abs_error_percent < 1.0, name


@pytest.mark.parametrize("name", ["nox_flow", "nox_flow_wide_mixing", "co_flow", "co2_flow"])
def test_leave_one_out_of_the_emissions(level, name):
    """Flows span less than a decade over the flyable points: no logarithm is needed."""
    assert level.accuracy[name].pearson_percent >= 99.9
    assert level.accuracy[name].mean_abs_error_percent <= 0.5


def test_size_of_the_package_data():
    total = sum(len((DATA / name).read_bytes()) for pair in FILES.values() for name in pair)
    assert total <= 6_000_000


def test_another_model_version_is_refused():
    with resources.as_file(DATA / "surrogate.nc") as path, pytest.raises(InputError, match="model version"):
        store.load(path, model_version="0")
