"""The solution cascade of a trim, on a small rotor whose trims are known in closed form."""

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from vrsopt.residual import Named, ResidualSystem, Unknown
from vrsopt.solvers.status import Status
from vrsopt.trimming import Trim, find_trim

EASY = {"mass": 1000.0, "wind": 0.0}


def stalling_rotor(heavy: float = -3.0, *, upper: float = 50.0, depth: float = 1.0) -> ResidualSystem:
    """A rotor whose incidence a at a mass solves 250 depth (a^3 - 3 a) = mass - wind - 2000; power grows with a.

    Folds at a = -1 (the stall: 2000 + 500 depth kg) and a = 1 (2000 - 500 depth kg). ``heavy``: start of Newton above
    1100 kg; below it starts on the branch of least power.
    """
    x, p = ca.SX.sym("x"), ca.SX.sym("p", 2)
    mass, wind = ca.vertsplit(p)
    return ResidualSystem(
        name="rotor",
        unknowns=(Unknown("incidence", "-", 1.0, -50.0, upper),),
        parameters=(Named("mass", "kg"), Named("wind", "kg")),
        residuals=(Named("lift", "kg", 1000.0),),
        outputs=(Named("main_rotor_power", "W"), Named("tail_rotor_power", "W")),
        x=x,
        p=p,
        r=250 * depth * (x**3 - 3 * x) - (mass - wind - 2000),
        y=ca.vertcat(1e5 * (5 + x), 1e4),
        guess=lambda parameters: {"incidence": heavy if parameters["mass"] > 1100 else -3.0},
    )


def incidences(mass: float) -> np.ndarray:
    roots = np.roots([1.0, 0.0, -3.0, -(mass - 2000) / 250])
    return np.sort(roots[np.abs(roots.imag) < 1e-9].real)


def at(mass: float, wind: float = 0.0) -> dict[str, float]:
    return {"mass": mass, "wind": wind}


def incidence(trim: Trim) -> float:
    assert trim.success and trim.reason == ""
    return trim.solution.values["incidence"]


def test_an_ordinary_point_is_a_newton_solve_and_no_more():
    trim = find_trim(stalling_rotor(), at(1400.0), easy=EASY)
    assert trim.stage == "momentum" and trim.jacobians == 0 and not trim.coexisting and trim.folds == ()
    assert incidence(trim) == pytest.approx(incidences(1400.0)[0])
    assert trim.power == pytest.approx(1e5 * (5 + incidence(trim)) + 1e4)


def test_a_neighbour_comes_first():
    system = stalling_rotor()
    near = find_trim(system, at(1400.0), easy=EASY)
    trim = find_trim(system, at(1410.0), easy=EASY, guess=near.solution)
    assert trim.stage == "guess" and incidence(trim) == pytest.approx(incidences(1410.0)[0])
    far = replace(near.solution, scaled=np.array([math.nan]), factorisation=None)
    assert find_trim(system, at(1410.0), easy=EASY, guess=far).stage == "momentum"


def test_behind_the_folds_by_arclength():
    """At 3000 kg only the trim of deep stall exists; Newton from a start at the stall does not reach it."""
    trim = find_trim(stalling_rotor(heavy=-1.0), at(3000.0), easy=EASY)
    assert trim.stage == "arclength" and len(trim.folds) == 2
    assert incidence(trim) == pytest.approx(incidences(3000.0)[0], abs=1e-7)
    masses = [1000 + fold * 2000 for fold in trim.folds]
    assert masses == pytest.approx([2500.0, 1500.0], abs=40.0)
    assert trim.smallest_singular_value == pytest.approx(0.75 * (incidence(trim) ** 2 - 1), rel=0.05)


def test_a_way_without_folds_is_a_homotopy():
    """A start at which the Jacobian is singular stops Newton; the light aircraft is found from its own guess."""
    trim = find_trim(stalling_rotor(heavy=-1.0), at(2200.0), easy=EASY)
    assert trim.stage == "homotopy" and trim.folds == ()
    assert incidence(trim) == pytest.approx(incidences(2200.0)[0], abs=1e-7)


@pytest.mark.parametrize(("mass", "start", "found"), [(2499.8, -0.95, 1), (1500.2, 1.05, 2), (2499.8, -1.05, 0)])
def test_close_to_a_fold_the_trim_of_least_power_is_taken(mass, start, found):
    """Newton finds the branch it starts close to: of the three trims near a fold the lowest is taken."""
    system = stalling_rotor(heavy=start)
    alone = system.solve(at(mass), method="newton")
    assert alone.values["incidence"] == pytest.approx(incidences(mass)[found], abs=1e-6)
    trim = find_trim(system, at(mass), easy=EASY)
    assert incidence(trim) == pytest.approx(incidences(mass)[0], abs=1e-6)
    assert trim.coexisting and trim.replaced == (found > 0)
    exact = abs(0.75 * (incidence(trim) ** 2 - 1))
    assert trim.smallest_singular_value == pytest.approx(exact, rel=1e-3)


def test_without_a_trim_the_reason_tells_how_far_trims_go():
    """Where the incidence is bounded below the deep-stall branch nothing is found beyond the stall."""
    trim = find_trim(stalling_rotor(heavy=-1.0, upper=0.5), at(3000.0), easy=EASY)
    assert not trim.success and math.isnan(trim.smallest_singular_value)
    assert trim.solution.status is not Status.CONVERGED and trim.solution.parameters == at(3000.0)
    kilograms = [float(word) for word in trim.reason.replace(",", "").split() if word.replace(".", "").isdigit()]
    assert "kg" in trim.reason and kilograms[1] == pytest.approx(2500, abs=40)
    assert "after 1 folds (at or beyond its bound: incidence)" in trim.reason
    assert trim.jacobians > 0


def test_from_easy_flight_first_then_with_the_mass_alone():
    gusty = {"mass": 1000.0, "wind": 500.0}
    trim = find_trim(stalling_rotor(heavy=-1.0), at(3000.0), easy=gusty)
    assert trim.stage == "arclength" and incidence(trim) == pytest.approx(incidences(3000.0)[0], abs=1e-7)
    unflyable = {"mass": 1000.0, "wind": 1e9}
    trim = find_trim(stalling_rotor(heavy=-1.0), at(3000.0), easy=unflyable)
    assert trim.stage == "arclength" and incidence(trim) == pytest.approx(incidences(3000.0)[0], abs=1e-7)
    neither = find_trim(stalling_rotor(heavy=-1.0, upper=0.5), at(3000.0), easy=unflyable)
    assert "no start: easy flight has no trim" in neither.reason and "from 1000 kg" in neither.reason


def test_no_light_trim_is_said():
    bounded = replace(stalling_rotor(), unknowns=(Unknown("incidence", "-", 1.0, 5.0, 6.0, 5.5),))
    trim = find_trim(bounded, at(2200.0), easy=EASY)
    assert not trim.success and trim.reason == "no start: 1000 kg has no trim"


def test_an_easier_system_gives_the_start():
    built = []

    def easier() -> ResidualSystem:
        built.append(1)
        return stalling_rotor(depth=0.1)

    hard = stalling_rotor(heavy=1.0)
    assert find_trim(stalling_rotor(), at(1400.0), easy=EASY, easier=easier).stage == "momentum" and not built
    trim = find_trim(hard, at(3000.0), easy=EASY, easier=easier)
    assert trim.stage == "tail rotor" and built == [1]
    assert incidence(trim) == pytest.approx(incidences(3000.0)[0], abs=1e-7)


def test_the_result_depends_on_the_point_alone():
    system = stalling_rotor(heavy=-1.0)
    first = find_trim(system, at(3000.0), easy=EASY)
    find_trim(system, at(2498.0), easy=EASY)
    again = find_trim(system, at(3000.0), easy=EASY)
    assert np.array_equal(first.solution.scaled, again.solution.scaled) and first.folds == again.folds
