"""The pure parts of the comparison with pyCycle: its tables in the product's gas path, and the verdict. No pyCycle."""

import ast
import importlib
import sys
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from vrsopt.turboshaft.cycle import gas_path, sized
from vrsopt.turboshaft.data import load_engine
from vrsopt.turboshaft.maps import compressor_map, swallowing

HERE = Path(__file__).parent
GRID = ([0.4, 0.7, 1.0, 1.1], [1.0, 1.4, 2.0, 2.2, 2.6])
VALUES = np.random.default_rng(3).uniform(0.5, 1.5, (4, 5))
# A made-up map of each kind: speeds 0.8 to 1.2, design point inside a cell.
COMPRESSOR = {
    "speed": [0.8, 1.0, 1.2],
    "line": [1.0, 2.0, 3.0],
    "design": (1.0, 2.0),
    "flow": [[18.0, 20.0, 21.0], [28.0, 30.0, 31.0], [33.0, 35.0, 35.5]],
    "pressure_ratio": [[3.0, 2.8, 2.4], [5.6, 5.0, 4.4], [6.6, 6.0, 5.0]],
    "efficiency": [[0.80, 0.82, 0.78], [0.83, 0.85, 0.80], [0.81, 0.82, 0.77]],
}
TURBINE = {
    "speed": [80.0, 100.0, 120.0],
    "pressure_ratio": [2.0, 4.0, 6.0],
    "design": (100.0, 4.0),
    "flow": [[140.0, 150.0, 152.0], [138.0, 148.0, 150.0], [135.0, 145.0, 147.0]],
    "efficiency": [[0.84, 0.88, 0.86], [0.88, 0.92, 0.91], [0.87, 0.92, 0.93]],
}


@pytest.fixture
def tables(monkeypatch):
    monkeypatch.syspath_prepend(str(HERE))
    return importlib.import_module("pycycle_maps")


@pytest.fixture
def comparison(monkeypatch):
    monkeypatch.syspath_prepend(str(HERE))
    return importlib.import_module("pycycle_comparison")


def test_a_table_interpolates_and_goes_on_linearly_as_an_expression(tables):
    table, x, y = tables.Table(*GRID, VALUES), ca.SX.sym("x"), ca.SX.sym("y")
    function = ca.Function("table", [x, y], [table(x, y)])
    reference = RegularGridInterpolator(GRID, VALUES, bounds_error=False, fill_value=None)
    points = np.random.default_rng(5).uniform([0.2, 0.5], [1.4, 3.0], (200, 2))
    ours = np.array([float(function(*point)) for point in points])
    assert ours == pytest.approx(reference(points), abs=1e-12)


def test_the_design_point_of_a_compressor_map_becomes_the_engines(tables):
    scaled = tables.CompressorTables(**COMPRESSOR)
    found = [float(value) for value in scaled.at(1.0, 0.0, pressure_ratio=7.1, efficiency=0.775)]
    assert found == pytest.approx([1.0, 7.1, 0.775])
    flow, ratio, efficiency = (float(v) for v in scaled.at(1.2, 1.0, pressure_ratio=7.1, efficiency=0.775))
    assert flow == pytest.approx(35.5 / 30.0)
    assert ratio == pytest.approx(1.0 + 6.1 / 4.0 * (5.0 - 1.0))
    assert efficiency == pytest.approx(0.775 * 0.77 / 0.85)


def test_the_design_point_of_a_turbine_map_becomes_the_engines(tables):
    scaled = tables.TurbineTables(**TURBINE)
    assert [float(value) for value in scaled.at(1.0, 2.5, design_ratio=2.5)] == pytest.approx([1.0, 1.0])
    # an expansion ratio of 1.5 is a third of the way from 1 to 2.5, as 2 is from 1 to 4
    found = [float(value) for value in scaled.at(0.8, 1.5, design_ratio=2.5)]
    assert found == pytest.approx([140.0 / 148.0, 0.84 / 0.92])


def test_tables_taken_from_the_analytic_maps_give_the_analytic_gas_path(tables):
    engine = load_engine()
    for turbine in (
        "gas_generator_turbine",
        "power_turbine",
    ):  # efficiency as a table can hold it
        engine = engine.changed(turbine, speed_curvature=0.0)
    speeds, lines = np.linspace(0.6, 1.1, 41).tolist(), np.linspace(-1.0, 1.0, 41).tolist()
    ratio = engine.design_point.pressure_ratio
    values = [[compressor_map(engine.compressor, n, b, pressure_ratio=ratio) for b in lines] for n in speeds]
    compressor = tables.CompressorTables(speeds, lines, (1.0, 0.0), *np.moveaxis(np.array(values, dtype=float), 2, 0))

    def turbine_tables(design_ratio: float, exponent: float):
        ratios = np.linspace(1.0, 4.0, 61)
        flow = np.tile(np.sqrt(swallowing(ratios, exponent)), (2, 1))
        return tables.TurbineTables([0.5, 1.5], ratios.tolist(), (1.0, design_ratio), flow, np.ones_like(flow))

    design = sized(engine)
    maps = tables.component_maps(
        compressor,
        turbine_tables(design.gas_generator_expansion, engine.gas_generator_turbine.flow_exponent),
        turbine_tables(design.power_turbine_expansion, engine.power_turbine.flow_exponent),
    )
    for power, speed in ((300e3, 1.0), (150e3, 0.9)):
        point = {"demand": power, "power_turbine_speed": speed, "altitude": 500.0, "isa_offset": 10.0, "mach": 0.1}
        point |= {"bleed_fraction": 0.0, "power_offtake": 0.0, "humidity": 0.0}
        tabulated, analytic = gas_path(engine, maps=maps).solve(point), gas_path(engine).solve(point)
        assert tabulated.success and analytic.success
        for name in ("fuel_flow", "air_flow", "pressure_ratio", "exhaust_temperature"):
            assert tabulated.outputs[name] == pytest.approx(analytic.outputs[name], rel=1e-3), name


def test_the_matched_engine_keeps_its_turbine_temperature_at_another_fuel_flow(comparison):
    engine = comparison.like_pycycle(load_engine())
    other = comparison.matched(engine, 0.95 * comparison.sized(engine).fuel_flow)
    assert comparison.sized(other).fuel_flow == pytest.approx(0.95 * comparison.sized(engine).fuel_flow)
    assert comparison.sized(other).t4 == pytest.approx(comparison.sized(engine).t4, abs=1e-6)
    assert other.combustor.heating_value > 1.04 * engine.combustor.heating_value


def test_every_missed_target_is_named(comparison):
    def row(power: float, fuel: float, solved: bool = True) -> dict:
        return {"point": {"power": power}, "solved": solved, "difference_percent": {"fuel_flow": fuel}}

    good = [row(200e3, 0.5), row(200e3, -0.4), row(100e3, 0.9)]
    assert comparison.missed(good, {"bulk": 1000.0}) == []
    bad = [row(200e3, -0.6), row(100e3, 1.1), row(50e3, float("nan")), row(40e3, 0.0, solved=False)]
    lines = comparison.missed(good + bad, {"single": 999.0, "bulk": 2000.0})
    assert len(lines) == 5
    assert "not solved" in lines[3] and "single" in lines[4]


def test_differences_are_the_products_over_pycycles(comparison):
    theirs = dict.fromkeys(comparison.COMPARED, 2.0)
    found = comparison.differences({**theirs, "fuel_flow": 2.01}, theirs)
    assert found["fuel_flow"] == pytest.approx(0.5)
    assert found["air_flow"] == 0.0


def test_the_scripts_of_the_other_environment_need_nothing_of_this_one():
    allowed = {"openmdao", "pycycle", "numpy", "pycycle_cycle", *sys.stdlib_module_names}
    for name in ("pycycle_engine.py", "pycycle_cycle.py"):
        tree = ast.parse((HERE / name).read_text(encoding="utf-8"))
        names = {a.name for node in ast.walk(tree) if isinstance(node, ast.Import) for a in node.names}
        names |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        assert {module.split(".")[0] for module in names} <= allowed, name
