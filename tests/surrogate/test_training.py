"""From a design of experiments to a surrogate with its figures, on a stand-in for the physics."""

import json
from dataclasses import replace

import analytic_rotor as rotor
import numpy as np
import pytest

from vrsopt.errors import InputError
from vrsopt.surrogate import store, training
from vrsopt.surrogate.sampling import sample
from vrsopt.surrogate.space import LEVEL
from vrsopt.surrogate.training import fit

FLYABLE = 130
KEYS = ("pearson_percent", "slope_deg", "bias_percent", "mean_abs_error_percent", "rms_error_percent")


def _sample(path, flyable, *, evaluate=rotor.evaluate, derivatives=("power",)):
    """A design of experiments in level flight with ``flyable`` flyable points."""
    sample(
        path,
        evaluate=evaluate,
        space=LEVEL,
        outputs=("power", "blade_loading"),
        derivatives=derivatives,
        model_version="test",
        data_hash="0" * 8,
        samples=flyable,
        workers=1,
    )


@pytest.fixture(scope="module")
def design(tmp_path_factory):
    path = tmp_path_factory.mktemp("training") / "doe.db"
    _sample(path, FLYABLE)
    return path


@pytest.fixture(scope="module")
def plain(design):
    return fit(design, workers=1)


def test_every_output_on_both_sets(plain):
    assert plain.flyable == FLYABLE < plain.converged == plain.samples and not plain.gradient_enhanced
    figures = plain.as_dict()
    assert json.loads(json.dumps(figures)) == figures
    assert set(figures["outputs"]) == {"power", "blade_loading"}
    for name, sets in figures["outputs"].items():
        assert list(sets) == ["flyable", "converged"]
        assert [sets[label]["points"] for label in sets] == [plain.flyable, plain.converged]
        for label in sets:
            assert tuple(sets[label])[:5] == KEYS
            assert sets[label]["correlation"] == "squared_exponential"
            assert sets[label]["pearson_percent"] > 99.0 and sets[label]["condition_number"] > 1.0
            assert 80.0 < sets[label]["coverage_percent"] <= 100.0, name
    table = str(plain).splitlines()
    assert table[0] == f"{plain.samples} points, {FLYABLE} flyable, {plain.converged} converged"
    assert len(table) == 6 and table[2].split()[:3] == ["power", "flyable", str(FLYABLE)]


def test_the_surrogate_is_that_of_the_flyable_points(plain):
    points = rotor.design(300, seed=5)
    flyable = points[rotor.blade_loading(points) < 0.12]
    error = plain.surrogate.models["power"].predict(flyable) / rotor.shaft_power(flyable) - 1.0
    assert np.mean(np.abs(error)) < 0.02
    assert len(plain.surrogate.models["power"].state_.inputs) == FLYABLE
    assert plain.surrogate.accuracy["power"] == plain.figures["flyable"]["power"].accuracy


def test_gradients_make_it_better_and_leave_other_outputs_alone(design, monkeypatch):
    monkeypatch.setattr(training, "LEAST_FLYABLE", 50)  # small, as they cost time
    plain, enhanced = (fit(design, gradient_enhanced=wanted, samples=50, workers=1) for wanted in (False, True))
    assert enhanced.gradient_enhanced and enhanced.surrogate.models["power"].state_.enhanced
    assert not enhanced.surrogate.models["blade_loading"].state_.enhanced
    assert enhanced.figures["flyable"]["blade_loading"] == plain.figures["flyable"]["blade_loading"]
    errors = [found.surrogate.accuracy["power"].mean_abs_error_percent for found in (enhanced, plain)]
    assert errors[0] < 0.5 * errors[1]


def test_the_first_rows_of_a_design(design, tmp_path):
    part = fit(design, tmp_path / "part.nc", samples=100, workers=1)
    assert part.flyable == 100 and part.samples < 130
    loaded = store.load(tmp_path / "part.nc")
    assert (loaded.space, loaded.samples, loaded.seed) == ("level", 100, 1)
    points = rotor.design(5)
    assert np.array_equal(loaded.models["power"].predict(points), part.surrogate.models["power"].predict(points))


def test_best_correlation_of_each_output(design):
    best, rough = (fit(design, correlation=name, samples=100, workers=1) for name in ("best", "exponential"))
    for name in ("power", "blade_loading"):
        chosen, alone = (found.figures["flyable"][name] for found in (best, rough))
        assert chosen.correlation in ("squared_exponential", "matern52")
        assert chosen.accuracy.rms_error_percent < alone.accuracy.rms_error_percent
        assert f"  {chosen.correlation}" in str(best)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"correlation": "linear"}, "fit: correlation = 'linear': one of squared_exponential, .*, best"),
        ({"workers": 0}, "fit: workers = 0: at least 1"),
        ({"samples": 99}, "fit: samples = 99: from 100 to 130, the flyable points of"),
        ({"samples": 131}, "fit: samples = 131: from 100 to 130, the flyable points of"),
        ({"gradient_enhanced": True}, "912 equations with gradients: at most 600, which is about 85 samples"),
    ],
)
def test_refusals(design, monkeypatch, options, message):
    monkeypatch.setattr(training, "LARGEST_SYSTEM", 600)
    with pytest.raises(InputError, match=message):
        fit(design, **{"workers": 1, **options})


def test_a_design_is_not_overwritten_and_needs_points(design, tmp_path):
    with pytest.raises(InputError, match="it is the design of experiments itself"):
        fit(design, design)
    few = tmp_path / "few.db"
    _sample(few, 99)
    with pytest.raises(InputError, match="99 flyable points: at least 100"):
        fit(few)


def still(inputs):
    record = rotor.evaluate(inputs)
    return replace(record, outputs={**record.outputs, "blade_loading": 0.1}, derivatives={})


def test_a_design_without_derivatives_and_an_output_that_does_not_vary_are_named(tmp_path):
    path = tmp_path / "still.db"
    _sample(path, 100, evaluate=still, derivatives=())
    with pytest.raises(InputError, match="still.db: no derivatives are stored in it"):
        fit(path, gradient_enhanced=True)
    with pytest.raises(InputError, match="fit: blade_loading: kriging: y = 0.1 in all 100 rows"):
        fit(path, workers=1)
