"""Many points at once: the whole operating box from one start, and what happens to a point without a solution."""

import casadi as ca
import numpy as np
import pytest
from scipy.stats import qmc

from vrsopt.errors import InputError
from vrsopt.residual import TOLERANCE
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.cycle import gas_path
from vrsopt.turboshaft.data import load_engine

LOW = [20e3, 0.7, 0.0, -15.0, 0.0, 0.0, 0.0, 0.0]
HIGH = [330e3, 1.2, 2000.0, 30.0, 0.22, 0.05, 10e3, 0.03]


def box(count, seed):
    return qmc.scale(qmc.LatinHypercube(8, rng=seed).random(count), LOW, HIGH)


def iterations(engine, points):
    """Full Newton steps (N,) from the design point to the tolerance; 99 where 12 are not enough."""
    z, p, r, _ = gas_path(engine).nlp_terms()
    step = ca.Function("step", [z, p], [z - ca.solve(ca.jacobian(r, z), r), ca.norm_inf(r)])
    x, taken = np.tile([1.0, 0.0, *[1.0] * 7], (len(points), 1)).T, np.full(len(points), 99)
    for count in range(13):
        ahead, norm = (part.full() for part in step.map(len(points))(x, points.T))
        taken = np.where((taken == 99) & (norm[0] < TOLERANCE), count, taken)
        x = ahead
    return taken


@pytest.mark.parametrize("name", ["allison_250_c20b", "generic_500kw"])
@pytest.mark.parametrize("count", [400, pytest.param(2000, marks=pytest.mark.slow)])
def test_the_whole_box_solves_from_the_design_point_in_eight_iterations(count, name):
    engine, points = load_engine(name), box(count, seed=1)
    points[:, [0, 6]] *= engine.design_point.power / 313e3
    taken = iterations(engine, points)
    assert taken.max() <= 8 and taken.mean() < 5.5

    result = solve_many(points, engine_data=engine)
    assert result.success.all() and not result.failures
    assert np.max(result.residual_norm) < TOLERANCE
    assert result.outputs["power"] == pytest.approx(points[:, 0], rel=1e-8)
    assert np.all(np.abs(result.outputs["map_coordinate"]) < 1.0)
    assert np.all(result.outputs["surge_margin"] > 0.15)


@pytest.mark.parametrize("count", [400, pytest.param(1000, marks=pytest.mark.slow)])
def test_the_box_in_gas_generator_speed(count):
    points = box(count, seed=2)
    points[:, 0] = 0.6 + 0.47 * (points[:, 0] - LOW[0]) / (HIGH[0] - LOW[0])
    result = solve_many(points, mode="gas_generator_speed")
    assert result.success.all()
    assert result.outputs["gas_generator_speed"] == pytest.approx(points[:, 0], rel=1e-8)


def test_bulk_equals_single_solves_across_chunks():
    points = np.tile(box(30, seed=4), (40, 1))[:1017]
    result = solve_many(points)
    system = gas_path(load_engine())
    for row in (0, 29, 499, 500, 1016):
        values = dict(zip((item.name for item in system.parameters), points[row].tolist(), strict=True))
        single = system.solve(values, method="newton")
        for name, value in single.outputs.items():
            assert result.outputs[name][row] == pytest.approx(value, rel=1e-7, abs=1e-7)
    assert solve_many(points[:0]).success.shape == (0,)


def test_a_point_without_a_solution_is_named_and_not_a_number():
    points = box(3, seed=5)
    points[1, 0] = 3e6
    result = solve_many(points)
    assert result.success.tolist() == [True, False, True]
    assert list(result.failures) == [1] and "largest scaled residual" in result.failures[1]
    assert np.isnan(result.outputs["fuel_flow"][1]) and np.isfinite(result.outputs["fuel_flow"][[0, 2]]).all()


def test_wrong_shapes_and_numbers_are_input_errors():
    with pytest.raises(InputError, match=r"shape \(3, 5\): expected \(N, 8\)"):
        solve_many(np.zeros((3, 5)))
    bad = box(3, seed=6)
    bad[2, 3] = np.nan
    with pytest.raises(InputError, match="row 2: not finite"):
        solve_many(bad)
