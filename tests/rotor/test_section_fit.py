"""Decks in C81 form: round trip, malformed files; the fit of a section to a deck."""

import runpy
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from vrsopt.aircraft import load_aircraft
from vrsopt.errors import InputError
from vrsopt.rotor.airfoil import Airfoil, load_section
from vrsopt.rotor.c81 import Deck, Table, read_c81, write_c81
from vrsopt.rotor.section_fit import SectionFit, fit_section

REFERENCE = Path(__file__).resolve().parents[3] / "shared" / "reference" / "naca23012.npz"
SECTION = load_aircraft("bo105").main_rotor.section
SCRIPT = Path(__file__).parents[2] / "problems" / "fit_section.py"
ANGLES = np.unique(np.concatenate([np.arange(-180, 181, 15), np.arange(-24, 26, 2), np.arange(-6, 19)])).astype(float)
MACH = np.array([0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8])


def deck_of(section: Airfoil, mach: np.ndarray = MACH, angles: np.ndarray = ANGLES) -> Deck:
    """Tables of a section's own coefficients."""
    state = ca.SX.sym("state", 3)
    outputs = section.coefficients(state[0], state[1], state[2], section.drag_reference)
    function = ca.Function("section", [state], [ca.vertcat(*outputs)])
    alpha, m = (grid.ravel() for grid in np.meshgrid(np.radians(angles), mach, indexing="ij"))
    values = function(np.vstack([np.sin(alpha), np.cos(alpha), m])).full().reshape(3, len(angles), len(mach))
    return Deck("made for a test", *(Table(angles, mach, value) for value in values))


DECK = deck_of(SECTION)


@pytest.mark.parametrize("count", [1, 9, 10, 23])
def test_a_deck_comes_back_from_its_text(tmp_path, count):
    """Ten Mach numbers and more stand on several lines."""
    deck = deck_of(SECTION, np.round(np.linspace(0.2, 0.85, count), 4))
    write_c81(deck, tmp_path / "section.c81")
    again = read_c81(tmp_path / "section.c81")
    assert again.name == "made for a test"
    for before, after in zip((deck.lift, deck.drag, deck.moment), (again.lift, again.drag, again.moment), strict=True):
        assert np.array_equal(before.angle_deg, after.angle_deg) and np.array_equal(before.mach, after.mach)
        assert after.value == pytest.approx(before.value, abs=5.01e-5)


def test_wide_and_free_fields_are_read_too(tmp_path):
    wide = [f"{'wide':30s} 2 2 2 2 2 2"]
    free = [f"{'free':30s} 2 2 2 2 2 2"]
    for _ in range(3):
        wide += [
            f"{'':10s}{0.2:10.4f}{0.4:10.4f}",
            f"{-5:10.2f}{-0.51:10.4f}{-0.55:10.4f}",
            f"{5:10.2f}{0.5:10.4f}{0.6:10.4f}",
        ]
        free += [".2 .4", "-5 -.51 -.55", "5 5e-1 0.6"]
    for name, lines in (("wide", wide), ("free", free)):
        (tmp_path / name).write_text("\n".join(lines))
        table = read_c81(tmp_path / name).lift
        assert table.mach.tolist() == [0.2, 0.4] and table.angle_deg.tolist() == [-5, 5]
        assert table.value.tolist() == [[-0.51, -0.55], [0.5, 0.6]]


def _changed(path: Path, line: int, text: str | None) -> Path:
    lines = path.read_text().splitlines()
    lines = lines[: line - 1] if text is None else [*lines[: line - 1], text, *lines[line:]]
    path.write_text("\n".join(lines))
    return path


@pytest.mark.parametrize(
    "line, text, message",
    [
        (1, "no counts here", r"section.c81: line 1 = 'no counts here': expected a title"),
        (1, f"{'zero':30s} 0 2 2 2 2 2", r"section.c81: line 1: 0 Mach numbers: too few"),
        (4, " -165.0 0.5000 0.5zz0 0.1 0.1 0.1 0.1 0.1", r"section.c81: lift: line 4, field 3 = '0.5zz0': a number"),
        (4, "-165.00 0.5000 0.5000", r"section.c81: lift: line 4: 3 numbers: expected 8"),
        (5, "-170.00" + 7 * " 0.5000", r"section.c81: lift: line 5, angle = -170: must be above the one before, -165"),
        (
            2,
            "       " + "".join(f"{m:7.2f}" for m in (0.2, 0.3, 0.3, 0.5, 0.6, 0.7, 0.8)),
            r"lift: Mach numbers = .*: must",
        ),
        (100, None, r"drag: angle \d+ of \d+: the file ends before it is complete"),
    ],
)
def test_malformed_decks(tmp_path, line, text, message):
    write_c81(DECK, tmp_path / "section.c81")
    with pytest.raises(InputError, match=message) as caught:
        read_c81(_changed(tmp_path / "section.c81", line, text))
    assert "\n" not in str(caught.value)


def test_files_that_are_no_decks(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        Airfoil.from_c81(tmp_path / "missing.c81")
    with pytest.raises(InputError, match="can not be read"):
        read_c81(tmp_path)
    (tmp_path / "empty").write_text("")
    with pytest.raises(InputError, match="line 1 = ''"):
        read_c81(tmp_path / "empty")
    with pytest.raises(InputError, match="at most seven columns"):
        write_c81(replace(DECK, drag=Table(ANGLES, MACH, 1e4 * DECK.drag.value)), tmp_path / "wide.c81")


def test_a_section_comes_back_from_its_own_deck(tmp_path):
    write_c81(DECK, tmp_path / "section.c81")
    section, fit = fit_section(read_c81(tmp_path / "section.c81"))
    worst = {q: max(e.attached for e in fit.errors if e.quantity == q) for q in ("lift", "drag", "moment")}
    assert worst["lift"] < 0.01 and worst["drag"] < 0.002 and worst["moment"] < 0.005, worst
    assert max(e.stall for e in fit.errors if e.quantity == "lift") < 0.03
    assert section.drag_reference == pytest.approx(SECTION.drag_reference, abs=3e-4)
    assert Airfoil.from_c81(tmp_path / "section.c81") == section
    assert "made for a test: fit less deck" in str(fit) and len(str(fit).splitlines()) == 2 + 3 * len(MACH)


@pytest.mark.parametrize("mach", [(0.0,), (0.3,), (0.3, 0.5)])
def test_decks_with_few_mach_numbers(mach):
    section, fit = fit_section(deck_of(SECTION, np.array(mach)))
    assert max(e.attached for e in fit.errors if e.quantity == "lift") < 0.01
    assert max(e.attached for e in fit.errors if e.quantity == "drag") < 0.001
    if len(mach) == 1:
        values = [float(section.coefficients(0.1, 0.99, m, 0.01)[0]) for m in (0.2, 0.7)]
        assert values[0] == pytest.approx(values[1], abs=1e-12)


def test_decks_that_can_not_be_fitted():
    with pytest.raises(InputError, match="at least one up to 0.8"):
        fit_section(deck_of(SECTION, np.array([0.9])))
    with pytest.raises(InputError, match="3 angles between -10 and 15 deg: at least 8"):
        fit_section(deck_of(SECTION, MACH, np.arange(-180.0, 181, 10)))


@pytest.fixture(scope="module")
def naca_0012() -> tuple[Airfoil, SectionFit]:
    return fit_section(runpy.run_path(str(SCRIPT), run_name="fit_section")["naca_0012"]())


def test_shipped_naca_0012_follows_from_the_published_constants(naca_0012):
    fitted, fit = naca_0012
    shipped = load_section("naca_0012")
    for name in ("lift_slope", "break_sine", "ramp_sine", "moment_slope"):
        for m in (0.3, 0.5, 0.7):
            values = [np.polynomial.polynomial.polyval(m, getattr(s, name)) for s in (fitted, shipped)]
            assert values[0] == pytest.approx(values[1], abs=0.01), name
    assert max(e.stall for e in fit.errors if e.quantity == "lift") < 0.035


def test_critical_normal_force_is_about_that_of_naca_0012(naca_0012):
    """The published value belongs to 30 % of separated chord: Mach 0.3 to 0.7 as printed by the source."""
    force = [np.polynomial.polynomial.polyval(m, naca_0012[0].critical_normal_force) for m in (0.3, 0.4, 0.5, 0.6, 0.7)]
    assert force == pytest.approx([1.45, 1.2, 1.05, 0.92, 0.68], abs=0.15)


@pytest.mark.slow
@pytest.mark.skipif(not REFERENCE.is_file(), reason="the section deck is not part of the package")
def test_the_script_derives_the_shipped_section_from_the_deck():
    script = runpy.run_path(str(SCRIPT), run_name="fit_section")
    section = fit_section(script["load"](str(REFERENCE)))[0]
    for mach in MACH:
        shipped, again = (deck_of(s, np.array([mach]), np.linspace(-4, 10, 57)) for s in (SECTION, section))
        assert again.lift.value == pytest.approx(shipped.lift.value, abs=2e-3)
        assert again.drag.value == pytest.approx(shipped.drag.value, abs=3e-4)
        assert again.moment.value == pytest.approx(shipped.moment.value, abs=1e-3)
