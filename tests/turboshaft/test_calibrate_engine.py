"""The engine's calibration: which numbers are solved, that they solve again, and what was done with them."""

import importlib.util
import sys
from pathlib import Path

import pytest

from vrsopt.turboshaft.cycle import sized
from vrsopt.turboshaft.data import load_engine

PATH = Path(__file__).parents[2] / "problems" / "calibrate_engine.py"
SPEC = importlib.util.spec_from_file_location("calibrate_engine", PATH)
assert SPEC is not None and SPEC.loader is not None
calibrate_engine = importlib.util.module_from_spec(SPEC)
sys.modules[SPEC.name] = calibrate_engine  # dataclasses look their module up
SPEC.loader.exec_module(calibrate_engine)


def solved_keys(data):
    return {
        f"{component}.{key}"
        for parts in data.variants.values()
        for component, entries in parts.items()
        for key, entry in entries.items()
        if entry["source"] == "SOLVED"
    }


def test_calibrated_keys_and_their_values():
    data = load_engine()
    results = calibrate_engine.calibrate_all(data)
    assert {f"{item.component}.{item.parameter}" for item in results} == solved_keys(data)
    assert solved_keys(data) == {"compressor.efficiency_slope", "design_point.sfc"}
    slope, level = results
    shipped = data.variant("flight_manual_slope").compressor.efficiency_slope
    assert slope.solved == pytest.approx(shipped, rel=1e-5)
    assert level.solved == pytest.approx(data.variant("flight_manual_level").design_point.sfc, rel=1e-5)
    # outside their ranges: the sourced values are shipped
    assert not slope.accepted and not level.accepted
    assert data.compressor.efficiency_slope == 0.30 and data.design_point.sfc == 0.395


def test_variants_reproduce_the_flight_manual_and_the_shipped_engine_does_not():
    data = load_engine()
    assert calibrate_engine.fuel_flow_error(data) == pytest.approx(3.88, abs=0.02)
    for name in calibrate_engine.VARIANTS:
        assert calibrate_engine.fuel_flow_error(data.variant(name)) == pytest.approx(0.0, abs=1e-3)


def test_the_level_variant_brings_the_quoted_temperature_limit():
    assert sized(load_engine().variant("flight_manual_level")).t45 - 273.15 == pytest.approx(810.0, abs=5.0)


@pytest.mark.parametrize("name", ["allison_250_c20b", "generic_500kw"])
def test_combustion_loss_is_the_fit_of_the_fleet(name):
    combustor = load_engine(name).combustor
    solved = calibrate_engine.fit_combustion_loss(load_engine(name))
    assert (combustor.loss_slope, combustor.loss_curvature) == pytest.approx(solved, abs=2e-3)


@pytest.mark.slow
def test_report_is_a_table():
    lines = calibrate_engine.report(load_engine())
    assert sum("variant only" in line for line in lines) == 2
    assert any(line.startswith("shipped") for line in lines)
