"""The combustor's fitted numbers are what the fit gives, and no other number is fitted."""

import numpy as np
import pytest

from problems.calibrate_combustor import FITTED, FREE, bounds, burnt, calibrate, operating_line, report
from vrsopt import foca
from vrsopt.turboshaft.data import load_engine


@pytest.mark.slow
@pytest.mark.parametrize("fit", ["shipped", "wide_mixing"])
def test_fitted_numbers(fit):
    engine = load_engine()
    reactors = engine.reactors if fit == "shipped" else engine.variant(fit).reactors
    assert {name for name, origin in reactors.provenance.items() if origin.source == "FITTED"} == set(FREE)
    solved = calibrate(engine if fit == "shipped" else engine.variant(fit))
    for name, low, high in zip(FREE, *bounds(reactors), strict=True):
        assert getattr(reactors, name) == pytest.approx(solved.values[name], rel=1e-3), name
        assert low * 0.999999 <= solved.values[name] <= high * 1.000001
    assert set(solved.at_bound) == {"primary_unmixedness", "primary_volume"}


def test_nothing_else_is_fitted():
    engine = load_engine()
    parts = [part for part in vars(engine).values() if hasattr(part, "provenance")]
    fitted = [name for part in parts for name, origin in part.provenance.items() if origin.source == "FITTED"]
    assert sorted(fitted) == sorted(FREE)


def test_how_close_the_fit_is_to_foca():
    engine = load_engine()
    power, *states = operating_line(engine, FITTED)
    outputs = burnt(engine, *states)
    nox = outputs["nox_index"] / [foca.nox_index(float(value)) for value in power]
    assert np.all(np.abs(np.log(nox)) < 0.10)
    assert outputs["co_index"][-1] == pytest.approx(foca.co_index(float(power[-1])), rel=0.01)


@pytest.mark.slow
def test_the_report_has_both_fits():
    lines = report(load_engine())
    assert sum(line.startswith(("shipped", "wide_mixing")) for line in lines) == 2
    assert sum(line.lstrip().startswith("100 ") for line in lines) == 2
