"""One stirred reactor: thermodynamics, equilibrium, the limits of slow and fast flow, no fold, balances of NO."""

import casadi as ca
import numpy as np
import pytest

from vrsopt.combustor import reactor
from vrsopt.combustor.reactor import UNKNOWNS, equations, gas
from vrsopt.combustor.species import GAS_CONSTANT, Thermo, all_species
from vrsopt.combustor.start import solve_reactors
from vrsopt.combustor.zones import Stream, air_stream, fuel_stream

METHANE, ETHYLENE = fuel_stream(4.0, 50.026e6), fuel_stream(2.0, 47.162e6)  # net heating values of the gases at 298 K
KEROSENE = fuel_stream(1.917, 43.1e6)
FOREVER = 1e5  # m3 s/kg


def conditions(fuel, *, phi, pressure, temperature, volume, humidity=0.0, methylene=0.0):
    """Columns (12, N) of reactors fed with fresh gas; the arguments broadcast."""
    phi, pressure, temperature, volume = np.broadcast_arrays(phi, pressure, temperature, volume)
    columns = []
    for ratio, p, t, v in zip(phi.ravel(), pressure.ravel(), temperature.ravel(), volume.ravel(), strict=True):
        air = air_stream(ca.DM(t), humidity)
        need = ratio * float(air.oxygen - 0.5 * air.hydrogen) / (2.0 * fuel.carbon + 0.5 * fuel.hydrogen)
        stream = air.mixed(fuel, need / (1.0 + need))
        columns.append([p, v, methylene * float(stream.carbon), *(float(part) for part in stream.parts())])
    return np.array(columns).T


def start(c):
    """A start near complete combustion, made here."""
    carbon, hydrogen, oxygen = c[3:6]
    left = np.maximum(0.5 * oxygen - carbon - 0.25 * hydrogen, 0.02 * carbon)
    logs = [np.log(0.9 * carbon), np.log(0.1 * carbon), np.log(0.5 * hydrogen), np.log(left), np.full(c.shape[1], -2.0)]
    return np.array([*logs, np.full(c.shape[1], 2000.0), np.full(c.shape[1], 0.05)])


def solved(c, mode="kinetic", x0=None, tolerance=1e-10):
    balanced, done = solve_reactors(start(c), c, "equilibrium", tolerance) if x0 is None else (x0, np.ones(1))
    assert np.all(done)
    if mode == "kinetic":
        balanced, done = solve_reactors(balanced, c, "kinetic", tolerance)
    assert np.all(done)
    return balanced


def of(name, c, x):
    """Amount [mol/kg] of a species."""
    symbol, conditions_ = ca.SX.sym("x", len(UNKNOWNS)), ca.SX.sym("c", 12)
    one = gas(symbol, conditions_[0], Stream(*ca.vertsplit(conditions_)[3:]))
    return ca.Function("amount", [symbol, conditions_], [one.amount[name]])(x, c).full().ravel()


def test_equilibrium_constants_obey_van_t_hoff():
    t = ca.SX.sym("t")
    thermo = Thermo.at(t)
    constant = thermo.log_equilibrium({"CO": 1, "OH": 1}, {"CO2": 1, "H": 1})
    heat = sum(sign * thermo.enthalpy(name) for name, sign in (("CO2", 1), ("H", 1), ("CO", -1), ("OH", -1)))
    slope = ca.Function("slope", [t], [ca.jacobian(constant, t), heat / (GAS_CONSTANT * 1000.0 * t**2)])
    for value in (0.4, 1.0, 2.3):
        found, expected = slope(value)
        assert float(found) == pytest.approx(float(expected), rel=1e-10)


def test_molar_masses_and_air():
    known = all_species()
    assert known["CO2"].molar_mass == pytest.approx(44.009e-3)
    air = air_stream(ca.DM(298.15), 0.0)
    assert float(air.moles) == pytest.approx(1.0 / 28.965e-3, rel=1e-4)
    moist = air_stream(ca.DM(400.0), 0.02)
    assert float(moist.hydrogen) == pytest.approx(2.0 * 0.02 / 1.02 / 18.015e-3, rel=1e-4)


@pytest.mark.parametrize(("fuel", "published"), [(METHANE, 2226.0), (ETHYLENE, 2369.0)])
def test_adiabatic_flame_temperature(fuel, published):
    # stoichiometric with air at 298 K and 1 atm: S. R. Turns, An Introduction to Combustion, table B.1
    c = conditions(fuel, phi=1.0, pressure=101325.0, temperature=298.15, volume=1e-3)
    excess = solved(c, "equilibrium")[5, 0] - published
    assert 0.0 < excess < 10.0  # the heat that NO of equilibrium would take is not counted


def test_long_residence_is_equilibrium():
    c = conditions(KEROSENE, phi=np.array([0.4, 0.7, 1.0, 1.3]), pressure=5e5, temperature=500.0, volume=FOREVER)
    slow, balanced = solved(c, tolerance=1e-6), solved(c, "equilibrium", tolerance=1e-6)
    assert slow[5] == pytest.approx(balanced[5], rel=1e-5)
    assert np.exp(slow[:5]) == pytest.approx(np.exp(balanced[:5]), rel=1e-2)


def test_long_residence_brings_no_to_equilibrium():
    """All paths of NO obey detailed balance: N2 + O2 = 2 NO, whatever the rates."""
    c = conditions(KEROSENE, phi=np.array([0.5, 0.8, 1.0]), pressure=6e5, temperature=600.0, volume=FOREVER)
    x = solved(c, tolerance=1e-6)
    t = ca.SX.sym("t")
    constant = ca.Function("K", [t], [Thermo.at(t).log_equilibrium({"N2": 1, "O2": 1}, {"NO": 2})])
    balanced = np.exp(0.5 * constant(x[5] / 1000.0).full().ravel()) * np.sqrt(of("N2", c, x) * of("O2", c, x))
    assert x[6] == pytest.approx(balanced, rel=1e-3)


def test_atoms_and_energy_stay():
    c = conditions(KEROSENE, phi=np.array([0.3, 0.6, 1.0, 1.5]), pressure=3e5, temperature=430.0, volume=2e-3)
    x = solved(c)
    amounts = {name: of(name, c, x) for name in ("CO2", "CO", "H2O", "O2", "OH", "O", "H", "H2", "N2", "Ar")}
    known = all_species()
    for row, element in ((3, "C"), (4, "H"), (5, "O")):
        total = sum(known[name].composition.get(element, 0) * amount for name, amount in amounts.items())
        assert total == pytest.approx(c[row], rel=1e-10)
    t = ca.SX.sym("t")
    heats = {name: ca.Function("h", [t], [Thermo.at(t).enthalpy(name)]) for name in amounts}
    enthalpy = sum(amount * heats[name](x[5] / 1000.0).full().ravel() for name, amount in amounts.items())
    assert enthalpy == pytest.approx(c[8], abs=1e-3)  # J/kg, of some 1e6


def test_time_burns_co_and_makes_no():
    c = conditions(KEROSENE, phi=0.8, pressure=5e5, temperature=520.0, volume=np.geomspace(2e-4, 2e-2, 12))
    x = solved(c)
    assert np.all(np.diff(x[1]) < 0) and np.all(np.diff(x[6]) > 0) and np.all(np.diff(x[5]) > 0)


@pytest.mark.parametrize(("pressure", "temperature"), [(1.6e5, 360.0), (2.5e5, 410.0), (7e5, 580.0)])
@pytest.mark.parametrize("volume", [5e-4, 3e-3])
def test_going_out_is_no_fold(pressure, temperature, volume):
    """From burning to cold and back in steps of 0.01 in the equivalence ratio: one branch, and no jump on it."""
    ratios = np.arange(0.6, 0.1, -0.01)
    c = conditions(KEROSENE, phi=ratios, pressure=pressure, temperature=temperature, volume=volume)

    def follow(columns):
        x, temperatures = solved(c[:, columns[:1]]) if columns[0] == 0 else cold, []
        for column in columns:
            x = solved(c[:, [column]], x0=x)
            temperatures.append(x[5, 0])
        return x, np.array(temperatures)

    order = np.arange(len(ratios))
    cold, down = follow(order)
    _, up = follow(order[::-1])
    assert down == pytest.approx(up[::-1], abs=1e-4)
    assert np.all(np.diff(down) < 0) and np.max(np.abs(np.diff(down))) < 60.0


def test_prompt_no_is_what_carbon_by_way_of_ch2_makes():
    """It is little in lean gas and much in rich gas, and in proportion to that carbon."""
    made = {}
    for share in (0.0, 0.1, 0.2):
        c = conditions(
            KEROSENE, phi=np.array([0.6, 1.2]), pressure=5e5, temperature=500.0, volume=5e-4, methylene=share
        )
        made[share] = solved(c)[6]
    gain = made[0.1] - made[0.0]
    assert gain[0] < 0.15 * made[0.0][0] and gain[1] > 0.3 * made[0.0][1]
    assert made[0.2] - made[0.1] == pytest.approx(gain, rel=0.1)


def test_the_equations_do_not_see_no():
    """NO is too little to change the gas: the other residuals do not depend on it."""
    x, c = ca.SX.sym("x", 7), ca.SX.sym("c", 12)
    parts = ca.vertsplit(c)
    r = equations(x, parts[0], Stream(*parts[3:]), parts[1], methylene=parts[2])
    assert ca.jacobian(r[:6], x[6]).nnz() == 0 and len(reactor.RESIDUALS) == r.numel()
