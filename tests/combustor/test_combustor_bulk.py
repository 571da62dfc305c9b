"""Many states of the combustor: everywhere in the engine's box, the same as one by one, and refusals."""

import numpy as np
import pytest

from vrsopt.combustor import bulk
from vrsopt.combustor.bulk import solve_combustor_many
from vrsopt.combustor.network import combustor
from vrsopt.errors import InputError
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.data import load_engine

INLET = ("compressor_exit_pressure", "compressor_exit_temperature", "combustor_air_flow", "burnt_fuel_flow")


def engine_states(engine, count, seed=0):
    """States (count, 5) behind the compressor: no power to more than take-off, to 2500 m, -35 to 35 K, humid air."""
    sample = np.random.default_rng(seed).random((count, 8))
    low = np.array([0.0, 0.75, 0.0, -35.0, 0.0, 0.0, 0.0, 0.0])
    high = np.array([1.05 * engine.ratings.take_off_power, 1.15, 2500.0, 35.0, 0.25, 0.0, 0.0, 0.03])
    points = low + sample * (high - low)
    solved = solve_many(points, engine_data=engine)
    assert solved.success.all()
    return np.column_stack([*(solved.outputs[name] for name in INLET), points[:, -1]])


def burnt(engine, states, reactors=None):
    fuel = engine.combustor.hydrogen_to_carbon, engine.combustor.heating_value
    return solve_combustor_many(states, reactors or engine.reactors, *fuel)


@pytest.mark.slow
@pytest.mark.parametrize("fit", ["shipped", "wide_mixing"])
def test_the_whole_box_of_the_engine(fit):
    engine = load_engine()
    reactors = engine.reactors if fit == "shipped" else engine.variant(fit).reactors
    solved = burnt(engine, engine_states(engine, 2000), reactors)
    assert solved.success.all() and not solved.failures and solved.residual_norm.max() < 1e-8
    outputs = solved.outputs
    assert np.all(outputs["nox_index"] > 0) and np.all(outputs["co_index"] > 0)
    assert np.all(outputs["leanest_pocket_unburnt_co"] < 0.5)  # no pocket is out


def test_a_second_engine_uses_the_same_function():
    engine = load_engine("generic_500kw")
    solved = burnt(engine, engine_states(engine, 250))
    assert solved.success.all() and solved.residual_norm.max() < 1e-8


def test_a_state_does_not_depend_on_its_neighbours():
    """From a fit through others, from scratch, and alone: the same solution."""
    engine = load_engine()
    states = engine_states(engine, 300, seed=1)
    many, few = burnt(engine, states), burnt(engine, states[:7])
    system = combustor(engine.reactors, engine.combustor.hydrogen_to_carbon, engine.combustor.heating_value)
    for row in range(7):
        names = (parameter.name for parameter in system.parameters)
        alone = system.solve(dict(zip(names, states[row].tolist(), strict=True)), method="newton")
        for name in ("nox_index", "co_index", "exit_temperature"):
            assert many.outputs[name][row] == pytest.approx(alone.outputs[name], rel=1e-7)
            assert few.outputs[name][row] == pytest.approx(alone.outputs[name], rel=1e-7)


def test_what_can_not_burn_is_nan_with_a_reason():
    engine = load_engine()
    states = engine_states(engine, 4)
    states[2, 3] *= 0.1
    solved = burnt(engine, states)
    assert solved.success.tolist() == [True, True, False, True]
    assert np.isnan(solved.outputs["nox_index"][2]) and solved.failures[2].startswith("combustor: ")


@pytest.mark.parametrize("without_fuel", [[3], range(12)], ids=["one", "all"])
def test_what_can_not_burn_does_not_disturb_the_others(without_fuel, monkeypatch):
    """Not even where the others start from a fit of some of them; warnings are errors here."""
    monkeypatch.setattr(bulk, "ANCHORS", 6)
    engine = load_engine()
    states = engine_states(engine, 12)
    expected = burnt(engine, states).outputs["nox_index"]
    states[list(without_fuel), 3] = 0.0
    solved = burnt(engine, states)
    expected[list(without_fuel)] = np.nan
    np.testing.assert_allclose(solved.outputs["nox_index"], expected, rtol=1e-7)
    assert set(solved.failures) == set(without_fuel)


@pytest.mark.parametrize(
    ("states", "message"),
    [
        (np.ones((3, 4)), r"combustor: parameters: shape \(3, 4\): expected \(N, 5\)"),
        (np.full((2, 5), np.nan), r"combustor: parameters: row 0: not finite"),
    ],
)
def test_refusals(states, message):
    with pytest.raises(InputError, match=message):
        burnt(load_engine(), states)
