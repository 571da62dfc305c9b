"""The combustor's network: what is conserved, recirculation, derivatives, trends, humidity, quadrature, failures."""

import re

import casadi as ca
import numpy as np
import pytest

from vrsopt.combustor.network import combustor
from vrsopt.combustor.nitrogen import ETHYLENE
from vrsopt.combustor.reactor import UNKNOWNS, gas
from vrsopt.combustor.species import Thermo, all_species
from vrsopt.combustor.zones import Zones, air_stream, fuel_stream
from vrsopt.errors import InputError
from vrsopt.turboshaft.data import load_engine

ENGINE = load_engine()
FUEL = (ENGINE.combustor.hydrogen_to_carbon, ENGINE.combustor.heating_value)
# States of the gas path at sea level, standard dry day, at rest: 7, 30, 60, 100 % of the take-off rating
IDLE, LOW, CRUISE, FULL = (
    dict(zip(("pressure", "temperature", "air_flow", "fuel_flow", "humidity"), state, strict=True))
    for state in (
        (3.298e5, 440.9, 0.8289, 0.01219, 0.0),
        (4.508e5, 482.9, 1.0874, 0.01708, 0.0),
        (5.734e5, 521.2, 1.3105, 0.02422, 0.0),
        (7.124e5, 562.9, 1.5291, 0.03436, 0.0),
    )
)


def solved(state, reactors=ENGINE.reactors, **options):
    system = combustor(reactors, *FUEL, **options)
    solution = system.solve(state, method="newton")
    assert solution.success and solution.residual_norm < 1e-8, solution.message
    return solution


def pockets(solution, state):
    """The gas of every reactor as numbers: amounts by species, temperature; and the zones."""
    air = air_stream(ca.DM(state["temperature"]), state["humidity"])
    zones = Zones.of(ENGINE.reactors, air, fuel_stream(*FUEL), state["air_flow"], state["fuel_flow"])
    x = np.array(list(solution.values.values()))
    mean = zones.primary_mean()
    primary = [one.mixed(mean, ENGINE.reactors.recirculation) for one in zones.fresh()]
    burnt = mean  # atoms, N2 and Ar mix in the same way whether burnt or not
    inflows = [
        *primary,
        *zones.intermediate(burnt),
        zones.dilution(air.mixed(burnt, zones.fuel_fractions[1] / zones.fuel_fractions[0])),
    ]
    count = len(UNKNOWNS)
    gases = [gas(ca.DM(x[i * count : (i + 1) * count]), state["pressure"], one) for i, one in enumerate(inflows)]
    return gases, zones


def test_atoms_and_energy_of_air_and_fuel_leave():
    state = {**CRUISE, "humidity": 0.01}
    gases, zones = pockets(solved(state), state)
    last, inlet = gases[-1], zones.air.mixed(zones.fuel, zones.fuel_fractions[2])
    known = all_species()
    for element, total in (("C", inlet.carbon), ("H", inlet.hydrogen), ("O", inlet.oxygen)):
        found = sum(known[name].composition.get(element, 0) * float(amount) for name, amount in last.amount.items())
        assert found == pytest.approx(float(total), rel=1e-10), element
    thermo = Thermo.at(last.temperature / 1000.0)
    enthalpy = sum(float(amount) * float(thermo.enthalpy(name)) for name, amount in last.amount.items())
    assert enthalpy == pytest.approx(float(inlet.enthalpy), abs=1e-10 * ENGINE.combustor.heating_value)


def test_carbon_leaves_as_co2_and_co():
    outputs = solved(IDLE).outputs
    carbon = outputs["co2_index"] / 44.009e-3 + outputs["co_index"] / 28.010e-3
    assert carbon == pytest.approx(fuel_stream(*FUEL).carbon, rel=1e-10)
    assert outputs["co2_index"] < ENGINE.combustor.co2_per_fuel < outputs["co2_index"] + 1.6 * outputs["co_index"]


def test_primary_temperature_is_the_mean_of_burnt_pockets():
    """Every pocket is between the air and the stoichiometric flame, and the zone's mean between them."""
    gases, _ = pockets(solved(FULL), FULL)
    temperatures = np.array([float(one.temperature) for one in gases[:9]])
    mean = solved(FULL).outputs["primary_temperature"]
    assert FULL["temperature"] < temperatures.min() < mean < temperatures.max() < 2500.0


def test_recirculation_does_nothing_to_a_zone_without_spread():
    indices = []
    for recirculation in (0.0, 0.2, 0.5):
        reactors = ENGINE.reactors.replaced(primary_unmixedness=0.0, recirculation=recirculation)
        outputs = solved(CRUISE, reactors).outputs
        indices.append((outputs["nox_index"], outputs["co_index"]))
    assert indices[1] == pytest.approx(indices[0], rel=1e-8)
    assert indices[2] == pytest.approx(indices[0], rel=1e-8)


@pytest.mark.parametrize("state", [IDLE, LOW, CRUISE, FULL])
def test_recirculation_keeps_the_leanest_pocket_burning(state):
    alone = solved(state, ENGINE.reactors.replaced(recirculation=0.0)).outputs["leanest_pocket_unburnt_co"]
    with_burnt_gas = solved(state).outputs["leanest_pocket_unburnt_co"]
    assert with_burnt_gas < 0.5 < alone


@pytest.mark.parametrize("fit", ["shipped", "wide_mixing"])
def test_going_out_is_no_fold(fit):
    """The leanest state of the engine, and one leaner still at 1.5 bar: volumes to a 400th and back, one branch."""
    reactors = ENGINE.reactors if fit == "shipped" else ENGINE.variant(fit).reactors
    volumes = ("primary_volume", "intermediate_volume", "dilution_volume")
    system = combustor(reactors, *FUEL, free=volumes)
    factors = np.exp(-0.2 * np.arange(31))

    def follow(state, order, near):
        found = np.empty((len(factors), 2))
        for k in order:
            point = {**state, **{name: factors[k] * getattr(reactors, name) for name in volumes}}
            near = system.solve(point, guess=near, method="newton")
            assert near.success, near.message
            found[k] = near.outputs["primary_temperature"], near.outputs["co_index"]
        return found, near

    for pressure, temperature, air_flow, ratio in ((3.78e5, 402.0, 0.95, 0.0138), (1.5e5, 330.0, 0.4, 0.0125)):
        state = dict(pressure=pressure, temperature=temperature, air_flow=air_flow, humidity=0.03)
        state["fuel_flow"] = ratio * air_flow
        down, cold = follow(state, range(len(factors)), None)
        up, _ = follow(state, range(len(factors))[::-1], cold)
        assert up == pytest.approx(down, rel=1e-7)
        assert np.all(np.diff(down[:, 0]) < 0) and np.abs(np.diff(down[:, 0])).max() < 40.0
        assert down[-1, 1] > 1.5 > 0.3 > down[0, 1]  # kg/kg: from burning to CO alone


@pytest.mark.parametrize("state", [IDLE, FULL])
def test_derivatives_are_those_of_solving_again(state):
    free = ("primary_air_fraction", "recirculation", "primary_volume")
    point = {**state, "humidity": 0.005, **{name: getattr(ENGINE.reactors, name) for name in free}}
    system = combustor(ENGINE.reactors, *FUEL, free=free)
    centre = system.solve(point, method="newton")
    exact = system.sensitivities(centre)
    for name, value in point.items():
        step = 1e-4 * value
        up, down = (
            system.solve({**point, name: value + sign * step}, guess=centre, method="newton").outputs
            for sign in (1, -1)
        )
        for output in ("nox_index", "co_index", "exit_temperature"):
            difference = (up[output] - down[output]) / (2 * step)
            scale = abs(centre.outputs[output] / value)
            assert exact[output][name] == pytest.approx(difference, rel=1e-5, abs=1e-5 * scale), (output, name)


@pytest.mark.parametrize("state", [IDLE, CRUISE])
def test_both_solvers_agree(state):
    system = combustor(ENGINE.reactors, *FUEL)
    newton, ipopt = (system.solve(state, method=method) for method in ("newton", "ipopt"))
    assert newton.success and ipopt.success and newton.iterations <= 6
    for name, value in newton.outputs.items():
        assert ipopt.outputs[name] == pytest.approx(value, rel=1e-7), name


def test_trends():
    base = solved(CRUISE).outputs

    def change(output, **factors):
        state = {name: value * factors.get(name, 1.0) for name, value in CRUISE.items()}
        return solved(state).outputs[output] / base[output] - 1.0

    assert change("nox_index", pressure=1.1) > 0.03 and change("nox_index", temperature=1.05) > 0.05
    assert change("co_index", pressure=1.1) < -0.03 and change("co_index", temperature=1.05) < -0.03
    assert change("exit_temperature", fuel_flow=1.05) > 0.01
    assert change("nox_index", air_flow=1.05) < 0.0 < change("co_index", air_flow=1.1)


def test_humidity_lowers_nox_as_measured_in_engines():
    """ICAO Annex 16 corrects EINOx with exp(19 (h - 0.00634)): 19 per kg/kg is the measured effect."""

    def effect(state, reactors=ENGINE.reactors):
        dry, wet = (solved({**state, "humidity": h}, reactors).outputs["nox_index"] for h in (0.0, 0.01))
        return np.log(wet / dry) / 0.01

    for state in (LOW, CRUISE, FULL):
        assert -22.0 < effect(state) < -16.0
    thermal, ethylene = (ENGINE.reactors.replaced(methylene_fraction=share) for share in (0.0, ETHYLENE))
    assert effect(CRUISE, thermal) < effect(CRUISE) < effect(CRUISE, ethylene)


@pytest.mark.parametrize("fit", ["shipped", "wide_mixing"])
@pytest.mark.parametrize("state", [IDLE, CRUISE, FULL])
def test_nine_pockets_are_enough(fit, state):
    reactors = ENGINE.reactors if fit == "shipped" else ENGINE.variant(fit).reactors
    few, many = (solved(state, reactors, pockets=count).outputs for count in (9, 21))
    assert few["nox_index"] == pytest.approx(many["nox_index"], rel=0.02)
    assert few["co_index"] == pytest.approx(many["co_index"], rel=0.02)


def test_built_once():
    assert combustor(ENGINE.reactors, *FUEL) is combustor(load_engine().reactors, *FUEL)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"pressure": -1.0}, r"combustor: a value became infinite or not a number .* 'primary pocket 1: \w+'"),
        ({"fuel_flow": 0.0}, r"combustor: .*not a number"),
        ({"fuel_flow": 0.004}, r"combustor: no progress: .* in '(dilution zone|intermediate pocket \d): "),
    ],
)
def test_a_state_that_can_not_burn_fails_with_the_equation(change, message):
    solution = combustor(ENGINE.reactors, *FUEL).solve({**CRUISE, **change}, method="newton")
    assert not solution.success

    assert re.match(message, solution.message), solution.message


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"primary_unmixedness": 0.7}, r"primary_unmixedness: times mixture_cutoff = 1\.05: less than 1"),
        ({"primary_air_fraction": 0.85}, r"intermediate_air_fraction: with primary_air_fraction 1\.05: less than 1"),
        ({"recirculation": 1.0}, r"recirculation = 1\.0"),
        ({"methylene_fraction": 0.9}, r"methylene_fraction = 0\.9"),
    ],
)
def test_zones_that_can_not_be(change, message):
    with pytest.raises(InputError, match=message):
        ENGINE.reactors.replaced(**change)
