"""The studies of the surrogates: what they compute, what they draw, and that the page is that of the shipped data."""

import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vrsopt.helicopter import helicopter
from vrsopt.report.plots import png
from vrsopt.surrogate import store
from vrsopt.surrogate.engine_table import engine_table

PROBLEMS = Path(__file__).parents[1] / "problems"
sys.path.insert(0, str(PROBLEMS))
try:
    import design_space
    import leave_one_out
    import surrogate_data
    import surrogate_errors
    import surrogate_fuel
finally:
    sys.path.remove(str(PROBLEMS))

PAGE = (PROBLEMS / "surrogates.md").read_text(encoding="utf-8")
SPACES = tuple(surrogate_data.DESIGNS)


@pytest.fixture(scope="module")
def few():
    """150 flyable points of the shipped design."""
    points = surrogate_data.read(surrogate_data.DESIGNS["level"])
    return replace(
        points, inputs=points.inputs[:150], outputs=points.outputs[:150], derivatives=points.derivatives[:150]
    )


def test_r2_of_known_polynomials():
    x = np.linspace(-1.0, 1.0, 101)[:, None]
    cubic = (2.0 + x - 3.0 * x**3)[:, 0]
    assert design_space.regression(x, cubic, 3)[1] == pytest.approx(1.0, abs=1e-12)
    assert design_space.regression(x, cubic, 2)[1] < 0.99
    assert design_space.regression(x, x[:, 0] ** 2, 1)[1] == pytest.approx(0.0, abs=1e-12)
    model, _ = design_space.regression(x, cubic, 3)
    assert model.predict([[0.5]]) == pytest.approx([2.0 + 0.5 - 3.0 * 0.125])


def test_shares_of_an_additive_function_are_those_of_its_terms():
    grid = np.linspace(0.0, 1.0, 7)
    inputs = np.stack(np.meshgrid(grid, grid, grid, indexing="ij"), axis=-1).reshape(-1, 3)
    shares = design_space.shares(inputs, 3.0 * inputs[:, 0] + inputs[:, 1], 2)
    assert shares == pytest.approx([0.9, 0.1, 0.0], abs=1e-9)
    product = design_space.shares(inputs, (inputs[:, 0] - 0.5) * (inputs[:, 1] - 0.5), 2)
    assert product == pytest.approx([0.5, 0.5, 0.0], abs=1e-9)  # what only both explain is shared


def test_error_normalised_by_the_spread():
    computed = np.array([-1.0, 1.0])  # crosses zero: no error relative to it
    assert surrogate_errors.normalised(computed, computed + 0.1) == pytest.approx(10.0)


def test_spread_points_are_one_of_every_cluster():
    corners = np.repeat([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]], 5, axis=0)
    near = corners + np.random.default_rng(2).uniform(-0.05, 0.05, corners.shape)
    assert sorted(surrogate_errors.spread(near, 4) // 5) == [0, 1, 2, 3]


def test_a_point_left_out_is_not_known(few):
    """Leave-one-out on few points is worse than a prediction of the points themselves, and unbiased."""
    found = leave_one_out.left_out(few, surrogate_data.STUDY)
    inputs, fuel = few.known("fuel_flow")
    assert found.computed == pytest.approx(fuel)
    fitted = few.kriging(surrogate_data.STUDY).fit(inputs, fuel).predict(inputs)
    assert np.std(found.predicted - fuel) > 10.0 * np.std(fitted - fuel)
    texts = dict(zip(leave_one_out.FIGURES, leave_one_out.cells(found.figures), strict=True))
    assert float(texts["RMS error %"]) == pytest.approx(
        100.0 * np.sqrt(np.mean((found.predicted / fuel - 1.0) ** 2)), abs=1e-4
    )
    assert float(texts["slope deg"]) == pytest.approx(
        np.degrees(np.arctan(np.polyfit(found.computed, found.predicted, 1)[0])), abs=1e-3
    )


@pytest.mark.parametrize("space", SPACES)
def test_the_engine_s_equations_give_the_fuel_of_the_computed_power(space):
    points = surrogate_data.read(surrogate_data.DESIGNS[space])
    machine = helicopter("bo105")
    power = points.column(surrogate_fuel.SHAFT)
    fuel = surrogate_fuel.engine_fuel(points, points.inputs, power, engine_table(engine_data=machine.engine), machine)
    assert fuel == pytest.approx(points.column("fuel_flow"), rel=2e-6)


def test_figures_render(few):
    model = few.kriging().fit(*few.known(design_space.POWER))
    at = design_space.lines(few, model, np.linspace(0.0, 70.0, 30))
    assert np.any(np.isfinite(at)) and np.any(np.isnan(at))  # not where there are no points
    one = leave_one_out.left_out(few, surrogate_data.STUDY)
    learned = [
        surrogate_errors.Learned(count, enhanced, spread, 1.0 / count, 2.0 / count, 0.1)
        for enhanced, spread in ((False, False), (True, False), (True, True))
        for count in (50, 100)
    ]
    figures = (
        design_space.draw(few, model),
        leave_one_out.draw({("level", surrogate_data.STUDY): one, ("flight", surrogate_data.OURS): one}),
        surrogate_errors.draw_learning({"level": learned, "flight": learned}),
    )
    assert all(png(figure, dpi=40).startswith(b"\x89PNG") for figure in figures)


def section(title, words):
    """Cells of the table of one space under a heading of the page."""
    text = PAGE.split(f"## {title}\n")[1].split("\n## ")[0]
    text = text.split(f"{words.capitalize()} variables:\n")[1].split(" variables:\n")[0]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line[:1] == "|"]


@pytest.mark.parametrize("space", SPACES)
def test_the_page_is_that_of_the_shipped_surrogate(space):
    surrogate = store.load(surrogate_data.SURROGATES[space])
    header, _, *rows = section("Leave-one-out of every output", surrogate_data.WORDS[space])
    assert header[0] == "output"
    found = {row[0].replace(" ", "_"): row[3:9] for row in rows}
    assert found == {name: leave_one_out.cells(figures) for name, figures in surrogate.accuracy.items()}


def test_every_figure_of_the_page_is_there():
    figures = re.findall(r"\]\((figures/[a-z_]+\.png)\)", PAGE)
    assert len(figures) == 3
    assert all((PROBLEMS / name).is_file() for name in figures)
