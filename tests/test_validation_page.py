"""The numbers of the validation page: computed by the functions that the page is made with, held to their bounds, and
looked up on the page. The table of the rescue mission: tests/schedule/test_rescue_mission.py."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.page_lines import assert_on_page
from vrsopt.helicopter import MODEL_VERSION, helicopter
from vrsopt.rotor.fidelity import Fidelity

PROBLEMS = Path(__file__).parents[1] / "problems"
sys.path.insert(0, str(PROBLEMS))
try:
    import validation
    import validation_engine as engine
    import validation_gas as gas
    import validation_isolated as isolated
    import validation_rotor as rotor
    import validation_summary
finally:
    sys.path.remove(str(PROBLEMS))

PAGE = validation.PAGE.read_text(encoding="utf-8")
REFERENCE = Path(__file__).resolve().parents[2] / "shared" / "reference"
DECK, FRAMES = REFERENCE / "naca23012.npz", REFERENCE / "dynstall.npz"
MISSED = {"fuel at 257 kW, 131.5 kt, kg/h"}  # a model that meets it is to be told apart from one that does not


# -- rotor and trim ----------------------------------------------------------------------------------------------------


def test_key_figures():
    assert all(figure.met for figure in rotor.key_figures())
    assert_on_page(rotor.key_figures_table(), PAGE)


def test_blade_frequencies():
    assert max(abs(mode.difference_percent) for mode in rotor.frequencies()) < 0.12
    assert_on_page(rotor.frequencies_table(), PAGE)


def test_flight_test():
    """Power is no target, but stays where it is; pitch attitude within two degrees."""
    main, both, engines = np.transpose([flown.differences_percent() for flown in rotor.flight_test_power()])
    assert np.abs(main).max() < 16.0 and np.abs(both).max() < 18.0 and np.abs(engines).max() < 24.0
    assert max(abs(flown.difference) for flown in rotor.flight_test_pitch()) < 2.0
    assert_on_page(rotor.flight_test_tables(), PAGE)


def test_ground_effect():
    for near in rotor.near_ground():
        assert near.model == pytest.approx(near.published, rel=1e-3)
    assert_on_page(rotor.near_ground_table(), PAGE)


def test_power_balances_to_one_per_cent():
    """What is left is spent, and at least what the blades' structural damping takes."""
    for balance in rotor.power_balance():
        assert 0.0 < balance.damping < balance.rest < 0.006 * balance.total
    assert_on_page(rotor.power_balance_table(), PAGE)


# -- rotors and sections alone -----------------------------------------------------------------------------------------


def test_caradonna_tung_thrust_is_too_high():
    """The target, measured thrust to 5 %, is not met. The test only keeps it from getting worse: a better model passes
    too, and the states at the blade passage must help.

    The lattice, with the same section, also gives more thrust than measured. The chord of R / 6 is what it knows and
    the blade-passage states do not: 10 to 15 points of the measured thrust. What is left is common to both, whose wakes
    neither contract nor roll up; whether that is the reason is not shown.
    """
    for thrust, limit in zip(isolated.caradonna_tung(), ((56, 47), (45, 33), (47, 32)), strict=True):
        disc, passage, lattice = thrust.excess_percent()
        assert all(0.0 < excess < most for excess, most in zip((disc, passage), limit, strict=True))
        assert lattice < passage < disc
        assert 9.0 < passage - lattice < 16.0
    lattices = [thrust.excess_percent()[2] for thrust in isolated.caradonna_tung()]
    assert lattices == pytest.approx([31.0, 16.5, 16.0], abs=2.0)  # of a computation that is not the product's
    assert abs(isolated.slender_percent()) < 5.0
    merits = isolated.harrington()  # fails where a collective is not solved
    assert all(0 < int(np.argmax(merit)) < len(merit) - 1 for merit in merits.values())
    assert 0.62 <= max(merits["blade passage"]) <= 0.75
    assert_on_page(isolated.isolated_tables(), PAGE)


@pytest.mark.skipif(not DECK.is_file(), reason="the public HART II section deck is not part of the package")
def test_section_against_its_deck():
    assert max(error.lift_attached for error in isolated.section_errors(DECK)) < 0.02
    assert max(error.drag_attached for error in isolated.section_errors(DECK)) < 0.006
    assert_on_page(isolated.section_table(DECK), PAGE)


@pytest.mark.skipif(not FRAMES.is_file(), reason="the measured frames are not part of the package")
def test_oscillating_sections():
    """Eleven frames with one set of constants: within a tenth of lift and moment on average."""
    loops = isolated.stall_loops(FRAMES)
    assert len(loops) == 11
    lift, moment = (np.abs([getattr(one, name) for one in loops]) for name in ("lift_difference", "moment_difference"))
    assert lift.mean() < 0.07 and lift.max() < 0.17
    assert moment.mean() < 0.06 and moment.max() < 0.1
    assert np.mean([one.errors["rms_cl"] for one in loops]) < 0.2
    assert_on_page(isolated.stall_table(FRAMES), PAGE)


# -- convergence and derivatives: minutes of computing, checked on the page --------------------------------------------


def rows(words: str) -> list[list[str]]:
    """Cells of the table that follows ``words``."""
    lines = PAGE[PAGE.index(words) :].split("\n")
    first = next(k for k, line in enumerate(lines) if line.startswith("|---"))
    table = []
    for line in lines[first + 1 :]:
        if not line.startswith("|"):
            break
        table.append([cell.strip() for cell in line.strip("|").split("|")])
    return table


def test_default_resolution_is_good_to_a_part_in_a_thousand():
    """Harmonics, azimuths and stations of the default; inflow states to half a per cent."""
    row = next(cells for cells in rows("harmonics, 96 azimuths") if cells[0].startswith("default"))
    assert max(abs(float(cell)) for cell in row[1:-2]) <= 0.1
    fidelity = Fidelity()
    name = f"m <= {fidelity.highest_harmonic}, n <= {fidelity.highest_shape}"
    row = next(cells for cells in rows("Mean inflow states against") if cells[0] == name)
    assert max(abs(float(cell)) for cell in row[1:-2]) <= 0.5


def test_exact_derivatives_agree_with_differences():
    found = re.search(r"of (\d+) with a smallest singular value above [\d.]+, (\d+) agree within 1e-05", PAGE)
    assert found and int(found[1]) >= 30
    assert int(found[2]) >= 0.95 * int(found[1])


# -- engine and emissions ----------------------------------------------------------------------------------------------


def test_engine_against_published_numbers():
    for figure in engine.consumption():
        assert figure.met == (figure.quantity not in MISSED), figure
    assert_on_page(engine.consumption_table(), PAGE)


def test_free_turbine_speed_of_least_consumption():
    found = engine.free_turbine()
    for best in found:
        assert best.best == pytest.approx(best.reference, abs=engine.BEST_SPEED_TOLERANCE)
        assert best.best == pytest.approx(best.root, rel=0.01)
    assert np.all(np.diff([best.best for best in found]) < 0)
    assert_on_page(engine.free_turbine_table(), PAGE)


def test_similarity():
    """Fuel from 200 kW up: combustion efficiency depends on the absolute pressure, which costs up to 4.4 % of the fuel
    at 100 kW and 2000 m."""
    for departure in engine.similarity():
        assert departure.generator_speed < 0.4 and departure.pressure_ratio < 0.4 and departure.temperature < 1.0
        assert max(map(abs, departure.fuel[1:])) < 2.0 and abs(departure.fuel[0]) < 5.0
    assert_on_page(engine.similarity_table(), PAGE)


def test_the_whole_box_is_solved():
    for solved in engine.robustness():
        assert solved.solved == engine.POINTS and solved.residual < 1e-8 and solved.difference < 1e-7
        assert f"| {solved.engine} | {solved.solved} of {engine.POINTS} |" in PAGE


def test_emissions_against_foca():
    found = engine.emissions()
    for index in found:
        assert abs(index.nox_percent) < (10.0 if index.fit == "shipped" else 15.0) and abs(index.co_percent) < 25.0
        assert -22.0 < index.humidity_slope < -16.0
    assert_on_page(engine.emissions_table(), PAGE)
    assert_on_page(gas.gas_table(), PAGE)  # bounds in tests/turboshaft/test_gas_cantera.py


# -- surrogate ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("correlation", "pearson", "error"), [(validation.OURS, 99.99, 0.05), (validation.STUDY, 99.64, 1.17)]
)
def test_leave_one_out(correlation, pearson, error):
    """The study gives 99.64 % and 1.17 % for five variables."""
    found = validation.left_out(correlation, flyable=True)
    assert found.accuracy.pearson_percent >= pearson
    assert found.accuracy.mean_abs_error_percent <= found.accuracy.rms_error_percent <= error
    (row,) = validation.left_out_rows([found])
    assert_on_page(["| " + " | ".join(row) + " |"], PAGE, last=2.0)  # a refit of other versions ends elsewhere


def test_counts_are_those_of_the_shipped_design():
    assert validation.counts() in PAGE


# -- the page ----------------------------------------------------------------------------------------------------------


def test_in_short():
    """What the README shows too, with the figures that the benchmarks printed."""
    assert_on_page(validation_summary.summary(FRAMES if FRAMES.is_file() else None), PAGE)


@pytest.mark.parametrize("benchmark", ["time_march", "cantera_comparison", "pycycle_comparison"])
def test_benchmarks_ran_with_this_model_and_its_data(benchmark):
    """What they printed is not computed again: after a change of the model it is to be printed anew."""
    versions = validation_summary.printed(benchmark)["versions"]
    assert (versions["model"], versions["data"]) == (MODEL_VERSION, helicopter().data_hash)


def test_every_part_is_there_in_its_order():
    parts = ("In short", "Rotor and trim", "Convergence and derivatives", "Engine", "Emissions", "Surrogate")
    places = [PAGE.find(f"\n## {part}\n") for part in (*parts, "Rescue mission")]
    assert -1 not in places and places == sorted(places)
