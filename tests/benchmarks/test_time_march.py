"""The time-marching baseline against the product's periodic rotor: a coarser case than the benchmark's own."""

import ast
import importlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vrsopt.rotor.fidelity import Fidelity

HERE = Path(__file__).parent


@pytest.fixture
def benchmark_module(monkeypatch):
    monkeypatch.syspath_prepend(str(HERE))
    return importlib.import_module("time_march")


def test_the_baseline_shares_no_code_with_the_product():
    allowed = {"__future__", "collections", "dataclasses", "functools", "math", "typing", "numpy", "scipy"}
    files = sorted(HERE.glob("marched_*.py"))
    assert len(files) == 4
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) else []
            roots = {name.split(".")[0] for name in names} - {other.stem for other in files}
            assert roots <= allowed, (file.name, roots)


@pytest.mark.slow
def test_the_march_agrees_with_the_periodic_rotor(benchmark_module):
    fidelity = Fidelity(stations=8, blade_passage=True)  # dynamic stall
    _, solution = benchmark_module.trimmed(fidelity, {})
    given = benchmark_module.condition(fidelity, solution)
    numerics = replace(benchmark_module.numerics(fidelity), steps=64, periodic=1e-3)
    rotor = benchmark_module.MarchedTrim(benchmark_module.rotor_data(), given, numerics)
    controls = np.array([solution.values[name] for name in benchmark_module.CONTROLS])
    state, loads = rotor.march(rotor.start(), controls)
    assert rotor.work.revolutions < numerics.most_revolutions  # the motion repeats
    thrust, *moments = rotor.miss(loads)
    assert abs(thrust) < 2e-3
    # a tenth of a degree of cyclic pitch makes about 0.27 of this measure
    np.testing.assert_allclose(moments, 0.0, atol=0.1)
    power = -loads[5] * given.rotor_speed
    assert power == pytest.approx(solution.outputs["main_rotor_power"], rel=2e-3)
    # the first step of a trim from there is the difference of the controls
    collective = rotor.march(state, controls + np.radians([0.25, 0.0, 0.0]))[1]
    slope = (rotor.miss(collective)[0] - thrust) / 0.25  # per degree
    assert abs(thrust / slope) < 0.1
