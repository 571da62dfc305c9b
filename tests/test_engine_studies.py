"""The studies of the engine away from its design point: what they compute, and that the page is theirs."""

import math
import re
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from vrsopt.turboshaft.data import load_engine
from vrsopt.turboshaft.velocity_triangles import ASSUMPTIONS

PROBLEMS = Path(__file__).parents[1] / "problems"
sys.path.insert(0, str(PROBLEMS))
try:
    import engine_page
    import free_turbine
    import part_power
    import part_power_cycle
    import part_power_page
    import power_turbine
finally:
    sys.path.remove(str(PROBLEMS))

ENGINE = load_engine()
PAGE = (PROBLEMS / "engine.md").read_text()


@pytest.fixture(scope="module")
def derived():
    return power_turbine.derive(ENGINE)


@pytest.fixture(scope="module")
def states():
    return part_power.steps(ENGINE)


def test_the_shipped_curvature_is_that_of_the_triangles(derived):
    origin = ENGINE.power_turbine.provenance["speed_curvature"]
    assert origin.source == "TRIANGLES"
    assert ENGINE.power_turbine.speed_curvature == pytest.approx(derived.value, abs=0.005)
    assert origin.range == pytest.approx((derived.low, derived.high), abs=0.05)


def test_best_velocity_ratio_is_above_that_of_the_design_point(derived):
    """The map has it at the design point; fitted as well, it takes up most of the map's error."""
    (default,) = power_turbine.turbines(ENGINE, [{}])
    assert default.free.best == pytest.approx(1.06, abs=0.005)
    assert default.free.rms < 0.25 * default.fit.rms
    above = [turbine.free.best > 1.0 for found in derived.samples.values() for turbine in found]
    assert np.mean(above) > 0.9


def test_loading_and_incidence_set_the_curvature_and_the_level_of_losses_does_not():
    spans = {}
    for assumption in ASSUMPTIONS:
        low, high = power_turbine.turbines(ENGINE, *power_turbine.varied(assumption))
        spans[assumption.name] = abs(high.fit.curvature - low.fit.curvature)
    assert spans["loading"] > 0.4 and spans["negative_incidence_exponent"] > 0.4
    assert max(spans["loss_factor"], spans["aspect_ratio"], spans["flow_coefficient"]) < 0.05


def test_flow_hardly_depends_on_speed(derived):
    flow = np.array([turbine.flow for found in derived.samples.values() for turbine in found])
    assert np.percentile(np.abs(flow - 1.0).max(axis=1), 90) < 0.05


@pytest.mark.parametrize("generator", [0.80, 0.90, 1.00])
def test_optimum_at_constant_generator_speed(generator):
    best = free_turbine.optimum(ENGINE, "gas_generator_speed", generator)
    assert best.speed == pytest.approx(best.drop_root, rel=1e-3)
    grid = np.linspace(best.speed - 0.02, best.speed + 0.02, 5)
    ratio = free_turbine.relative_consumption(ENGINE, "gas_generator_speed", np.array([generator]), grid)[0]
    assert np.argmin(ratio) == 2
    assert ratio[2] == pytest.approx(1.0 - best.saving, abs=1e-7)
    if generator == 1.0:
        assert best.speed == pytest.approx(1.0, abs=1e-4) and best.saving == pytest.approx(0.0, abs=1e-8)


def test_optimum_at_constant_power():
    """The place of the optimum does not depend on the curvature, the size of the saving does."""
    low, high = free_turbine.with_curvature(ENGINE)
    for power, speed in ((80e3, 0.636), (160e3, 0.798), (240e3, 0.914)):
        bests = [free_turbine.optimum(engine, "power", power) for engine in (low, ENGINE, high)]
        assert [best.speed for best in bests] == pytest.approx([speed] * 3, abs=0.005)
        assert all(one.saving < other.saving for one, other in pairwise(bests))
    with_own = [free_turbine.optimum(ENGINE, "power", 200e3, maps) for maps in power_turbine.peaked(ENGINE).values()]
    shipped = free_turbine.optimum(ENGINE, "power", 200e3)
    assert all(own.speed > shipped.speed + 0.03 and own.saving < 0.6 * shipped.saving for own in with_own)


def test_the_closed_cycle_is_that_of_the_gas_path(states):
    """Consumption closes one efficiency, which is the data file's at the design point; the temperature is a check."""
    turbine = ENGINE.gas_generator_turbine
    assert states["take_off"]["gas_generator_turbine_efficiency"] == pytest.approx(turbine.efficiency, rel=1e-9)
    for name, place in part_power.places(ENGINE).items():
        out = part_power.at_sea_level(ENGINE, **place).outputs
        found = part_power_cycle.cycle(ENGINE, states[name])
        assert found["consumption"] == pytest.approx(out["fuel_flow"] / out["power"] * 3.6e6, rel=1e-10)
        assert found["t45"] == pytest.approx(out["power_turbine_inlet_temperature"], rel=1e-8)


def test_the_closed_cycle_knows_the_best_velocity_ratio():
    """Else its error would hide in the gas-generator turbine's efficiency, which is nearly that of the file."""
    states = part_power.steps(ENGINE.variant("triangles_optimum"))
    for state in states.values():
        efficiency = ENGINE.gas_generator_turbine.efficiency
        assert state["gas_generator_turbine_efficiency"] == pytest.approx(efficiency, abs=2e-4)


def test_slopes_equal_differences(states):
    exact = part_power_cycle.slopes(ENGINE, states["flight"])
    for name, slope in exact.items():
        values = [
            part_power_cycle.cycle(ENGINE, states["flight"] | {name: states["flight"][name] * math.exp(step)})
            for step in (-1e-4, 1e-4)
        ]
        below, above = (math.log(value["consumption"]) for value in values)
        assert slope == pytest.approx((above - below) / 2e-4, rel=1e-5, abs=1e-8), name


def test_shares_add_up_in_either_direction(states):
    first, second = states["take_off"], states["flight"]
    there = part_power_cycle.shares(ENGINE, first, second)
    back = part_power_cycle.shares(ENGINE, second, first)
    ends = [part_power_cycle.cycle(ENGINE, state)["consumption"] for state in (first, second)]
    assert sum(there.values()) == pytest.approx(math.log(ends[1] / ends[0]), rel=1e-9)
    assert list(there.values()) == pytest.approx([-value for value in back.values()], rel=1e-9, abs=1e-15)
    assert there["turbine inlet temperature"] + there["pressure ratio"] > 0.07  # the cycle itself
    assert there["air at the inlet (ram)"] < -0.02


@pytest.mark.slow
def test_no_number_inside_its_range_explains_the_flight_manual():
    pairs = part_power.ends(ENGINE)
    names = {end.name for pair in pairs for end in pair if end is not None}
    assert len(names) == len(part_power.numbers(ENGINE)) > 25
    base, aim = part_power.point(ENGINE), part_power.target(ENGINE)
    ratios = [end.point.ratio for pair in pairs for end in pair if end is not None]
    assert all(abs(ratio - base.ratio) < 0.015 for ratio in ratios)
    assert min(ratios) - aim / base.take_off > 0.02
    assert [pair[0].name for pair in pairs[:2]] == ["compressor.efficiency_slope", "power_turbine.best_velocity_ratio"]
    shape, _ = part_power.favourable(ENGINE, without=("design_point",))
    assert aim < part_power.point(shape).flight < base.flight


def test_sister_engine_and_the_best_velocity_ratio():
    """Take-off consumption of the 250-B17F times 1.098 at 69.8 % power."""
    power = ENGINE.design_point.power
    ratios = [
        part_power.consumption(ENGINE, part_power.SISTER_POWER * power, 0.0, maps)
        / part_power.consumption(ENGINE, power, 0.0, maps)
        for maps in power_turbine.peaked(ENGINE).values()
    ]
    assert ratios == pytest.approx([1.098, 1.098], abs=0.008)


def numbers(line):
    return re.findall(r"-?\d+\.?\d*", line)


@pytest.mark.parametrize(
    "part",
    [
        power_turbine.fits,
        power_turbine.assumptions,
        power_turbine.savings,
        free_turbine.at_generator_speed,
        pytest.param(free_turbine.at_power, marks=pytest.mark.slow),
        part_power_page.chain,
        part_power_page.needed,
    ],
)
def test_tables_of_the_page_are_those_of_the_functions(part):
    lines = list(part(ENGINE))
    rows = PAGE.split("\n")
    first = rows.index(lines[0])
    for expected, written in zip(lines, rows[first:], strict=False):
        assert re.sub(r"[\d.+-]", "", expected) == re.sub(r"[\d.+-]", "", written)
        for here, there in zip(numbers(expected), numbers(written), strict=True):
            last = 10.0 ** -len(here.partition(".")[2])  # rounding may differ by one in the last digit
            assert float(here) == pytest.approx(float(there), abs=1.01 * last), written


def test_figures_of_the_page_are_there():
    assert engine_page.MARKER in PAGE
    for name in engine_page.FIGURES:
        assert f"(figures/{name})" in PAGE and (PROBLEMS / "figures" / name).is_file()
