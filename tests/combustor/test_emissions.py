"""Emissions of one engine: balances, range over the fits, the bulk path, exact derivatives, failures."""

from dataclasses import replace

import numpy as np
import pytest

from vrsopt import foca
from vrsopt.combustor.emissions import (
    INDICES,
    SHIPPED,
    SPECIES,
    emission_sensitivities,
    emissions,
    emissions_many,
    reactor_fits,
)
from vrsopt.errors import InputError
from vrsopt.residual import TOLERANCE
from vrsopt.solution import Solution
from vrsopt.solvers.status import Status
from vrsopt.turboshaft.bulk import solve_many
from vrsopt.turboshaft.cycle import gas_path
from vrsopt.turboshaft.data import load_engine

ENGINE = load_engine()
PLACE = {
    "power_turbine_speed": 1.0,
    "altitude": 0.0,
    "isa_offset": 0.0,
    "mach": 0.0,
    "bleed_fraction": 0.0,
    "power_offtake": 0.0,
    "humidity": 0.0,
}


def engine_at(demand: float, mode: str = "power", **changes: float) -> Solution:
    solution = gas_path(ENGINE, mode).solve({"demand": demand, **PLACE, **changes}, method="newton")
    assert solution.success
    return solution


@pytest.mark.parametrize("power", [22e3, 94e3, 188e3, 313e3])
def test_indices_flows_and_carbon(power):
    gas = engine_at(power, humidity=0.006)
    found, fuel = emissions(ENGINE, gas), gas.outputs["fuel_flow"]
    assert found.success and found.residual_norm < TOLERANCE
    for name in SPECIES:
        assert getattr(found, name) == pytest.approx(getattr(found, f"{name}_index") * fuel, rel=1e-12)
    burnt = 1.0 - gas.outputs["hydrocarbon_index"]
    carbon = burnt * 12.011 / (12.011 + 1.008 * ENGINE.combustor.hydrogen_to_carbon) * fuel  # CHx
    assert found.co2 * 12.011 / 44.009 + found.co * 12.011 / 28.010 == pytest.approx(carbon, rel=1e-5)
    # FOCA's hydrocarbons, 38 % too many at full power, where the engine's efficiency is 0.99 and FOCA's 0.993
    assert gas.outputs["hydrocarbon_index"] == pytest.approx(foca.hc_index(power), rel=0.4 if power > 300e3 else 0.2)
    assert 0 < found.co_index < 0.25 and 0 < found.nox_index < 0.02


def test_nox_rises_with_power_and_co_falls():
    idle, cruise, full = (emissions(ENGINE, engine_at(power)) for power in (22e3, 200e3, 313e3))
    assert idle.nox_index < cruise.nox_index < full.nox_index
    assert idle.co_index > cruise.co_index > full.co_index


def test_vapour_lowers_nox():
    dry, humid = (emissions(ENGINE, engine_at(250e3, humidity=h)) for h in (0.0, 0.0063))
    assert -0.16 < np.log(humid.nox_index / dry.nox_index) < -0.09  # ICAO corrects by exp(-19 h): -0.12


def test_range_is_over_the_shipped_fit_and_the_variants_with_reactors():
    fits = reactor_fits(ENGINE)
    assert list(fits) == [SHIPPED, "wide_mixing"]
    assert fits[SHIPPED] == ENGINE.reactors != fits["wide_mixing"]
    gas = engine_at(200e3)
    found, other = emissions(ENGINE, gas), emissions(ENGINE.variant("wide_mixing"), gas)
    assert found.nox_of_fits == pytest.approx({SHIPPED: found.nox, "wide_mixing": other.nox})
    assert found.nox_range == (min(found.nox, other.nox), max(found.nox, other.nox))
    assert found.nox_range[0] < found.nox_range[1]


def test_many_are_the_same_one_by_one():
    powers, humidity = np.array([30e3, 150e3, 313e3]), np.array([0.0, 0.01, 0.003])
    rows = np.column_stack([powers, np.tile(list(PLACE.values()), (3, 1))])
    rows[:, -1] = humidity
    states = dict(solve_many(rows).outputs)
    states["burnt_fuel_flow"] = np.append(states["burnt_fuel_flow"], np.nan)  # a gas path that failed
    for name in set(states) - {"burnt_fuel_flow"}:
        states[name] = np.append(states[name], states[name][-1])
    many = emissions_many(ENGINE, states, np.append(humidity, 0.0))
    for k, (power, vapour) in enumerate(zip(powers.tolist(), humidity.tolist(), strict=True)):
        one = emissions(ENGINE, engine_at(power, humidity=vapour))
        for name in SPECIES:
            assert many[name][k] == pytest.approx(getattr(one, name), rel=1e-6)
        assert (many["nox_low"][k], many["nox_high"][k]) == pytest.approx(one.nox_range, rel=1e-6)
        assert many["nox_shipped"][k] == many["nox"][k]
    assert all(np.isnan(values[-1]) for values in many.values())


@pytest.mark.parametrize(
    ("mode", "demand", "changes"),
    [
        ("power", 180e3, {"altitude": 1200.0, "isa_offset": 12.0, "mach": 0.15, "humidity": 0.008}),
        ("temperature", 1050.0, {"power_turbine_speed": 0.9, "bleed_fraction": 0.02, "power_offtake": 3e3}),
    ],
)
def test_derivatives_are_those_of_solutions_solved_again(mode, demand, changes):
    system = gas_path(ENGINE, mode)
    parameters = {"demand": demand, **PLACE, "mach": 0.1, "humidity": 0.004, "bleed_fraction": 0.01, **changes}
    slopes = emission_sensitivities(ENGINE, system.solve(parameters, method="newton"), system)
    assert set(slopes) == {*SPECIES, *INDICES}
    steps = {"demand": 2e-3 * demand, "altitude": 20.0, "isa_offset": 0.5, "power_offtake": 100.0}

    def flows(**new: float) -> np.ndarray:
        found = emissions(ENGINE, system.solve({**parameters, **new}, method="newton"))
        return np.array([getattr(found, name) for name in slopes])

    size = np.abs(flows())
    for name, value in parameters.items():
        h = steps.get(name, 1e-3)
        near, far = ((flows(**{name: value + s}) - flows(**{name: value - s})) / (2 * s) for s in (h, 2 * h))
        exact = np.array([slopes[output][name] for output in slopes])
        differences = (4 * near - far) / 3  # good to the solutions' own 1e-9 over the step
        assert np.all(np.abs(differences - exact) <= 1e-5 * np.abs(exact) + 1e-9 * size / h)


def test_far_beyond_the_engine_s_limits_there_are_numbers_or_nan_and_no_warning():
    for power in (500e3, 700e3, 800e3):
        found = emissions(ENGINE, engine_at(power, altitude=1000.0, isa_offset=20.0))
        numbers = [found.nox, found.co, found.co2, found.nox_index]
        assert np.isfinite(numbers).all() if found.success else np.isnan(numbers).all()


def test_a_gas_path_that_failed_has_no_emissions():
    gas = engine_at(200e3)
    failed = replace(gas, success=False, status=Status.NO_PROGRESS, message="gas path: stuck")
    found = emissions(ENGINE, failed)
    assert (found.success, found.status, found.message) == (False, Status.NO_PROGRESS, "gas path: stuck")
    assert np.isnan([found.nox, found.co2_index, *found.nox_range]).all()
    with pytest.raises(InputError, match="gas path: no derivatives at a failed solution"):
        emission_sensitivities(ENGINE, failed, gas_path(ENGINE, "power"))


def test_a_gas_path_without_derivatives_is_named_before_the_combustor():
    """Beyond all limits the combustor behind it fails as well: the message is about what failed first."""
    system = gas_path(ENGINE, "power")
    stuck = system.solve({"demand": 3e6, **PLACE}, method="newton")
    assert not stuck.success
    with pytest.raises(InputError, match=rf"^{system.name}: no derivatives at a failed solution"):
        emission_sensitivities(ENGINE, stuck, system)
