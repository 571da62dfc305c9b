"""Sizing: exact derivatives with respect to the data file, engines of other sizes, impossible design points."""

import numpy as np
import pytest
from scipy.stats import qmc

from vrsopt.errors import InputError
from vrsopt.turboshaft.cycle import gas_path, sized
from vrsopt.turboshaft.data import load_engine
from vrsopt.turboshaft.design_point import SIZED_BY, design_point, design_sensitivities, sizing

ENGINE = load_engine()


def test_balances_close():
    solution = sizing().solve(
        {f"{part}.{name}": getattr(getattr(ENGINE, part), name) for part, names in SIZED_BY.items() for name in names}
    )
    assert solution.success and solution.residual_norm < 1e-9  # residuals there are a thousand times finer
    design = design_point(ENGINE)
    assert design.fuel_flow == pytest.approx(0.395 * 313e3 / 3.6e6)
    assert design.t3_ideal < design.t3 < design.t45 < design.t45_uncooled < design.t4


@pytest.mark.parametrize("component", SIZED_BY)
def test_derivatives_with_respect_to_the_data_file_equal_differences(component):
    exact = design_sensitivities(ENGINE)
    assert set(vars(sized(ENGINE))) < set(exact)
    for name in SIZED_BY[component]:
        value = getattr(getattr(ENGINE, component), name)
        step = 1e-4 * value
        steps = np.array([-2, -1, 1, 2])
        moved = [design_point(ENGINE.changed(component, **{name: value + k * step})) for k in steps]
        for output in ("t4", "t45", "t5", "power_turbine_efficiency", "gas_generator_constant", "exhaust_constant"):
            values = np.array([getattr(point, output) for point in moved])
            difference = (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * step)
            negligible = 1e-7 * abs(values[0] / value)
            assert exact[output][f"{component}.{name}"] == pytest.approx(difference, rel=1e-5, abs=negligible)


def test_what_the_temperatures_hang_on():
    """Power, consumption and air flow fix the temperature between the turbines; component efficiencies do not."""
    slopes = design_sensitivities(ENGINE)["t45"]
    given = {
        name: slope * getattr(getattr(ENGINE, name.split(".")[0]), name.split(".")[1]) for name, slope in slopes.items()
    }
    for name in ("design_point.power", "design_point.sfc", "design_point.air_flow"):
        assert abs(given[name]) > 500.0  # K per 100 %
    for name in ("gas_generator_turbine.efficiency", "power_turbine.mechanical_efficiency", "exhaust.pressure_loss"):
        assert abs(given[name]) < 1e-6
    assert abs(given["compressor.efficiency"]) < 5.0


def test_engines_from_200_to_2000_kw_are_sized_from_the_same_start():
    low, high = [200e3, 0.29, 4.5, 900.0, 0.72, 0.80], [2000e3, 0.42, 16.0, 1500.0, 0.84, 0.89]
    solved = 0
    for power, sfc, ratio, rise, compressor, turbine in qmc.scale(qmc.LatinHypercube(6, rng=4).random(300), low, high):
        fuel = sfc * power / 3.6e6
        engine = (
            ENGINE.changed(
                "design_point",
                power=power,
                sfc=sfc,
                pressure_ratio=ratio,
                air_flow=fuel * 43.1e6 / (1170.0 * (rise - 300.0)),
            )
            .changed("compressor", efficiency=compressor)
            .changed("gas_generator_turbine", efficiency=turbine)
        )
        try:
            design = design_point(engine)
        except InputError as error:  # power and consumption that no power turbine gives
            assert "power-turbine" in str(error)
            continue
        solved += 1
        assert 500.0 < design.t5 < design.t45 < design.t4 < 2200.0
    assert solved > 60


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"sfc": 0.8}, "needs a power-turbine efficiency of 0.350: 0.5 to 0.95 allowed"),
        ({"sfc": 0.05}, "power-turbine expansion 0.561: more than 1.05 needed"),
        ({"air_flow": 0.5}, "no T4 between 150 and 2200 K closes the balance"),
        ({"power": 1e9}, "no T4 between 150 and 2200 K closes the balance"),
        ({"power": 400e3, "sfc": 0.1}, "power-turbine|no T"),
    ],
)
def test_a_design_point_that_can_not_be_is_one_line(change, message):
    with pytest.raises(InputError, match=message) as caught:
        gas_path(ENGINE.changed("design_point", **change))
    assert str(caught.value).startswith("Allison 250-C20B: design_point: ") and "\n" not in str(caught.value)
