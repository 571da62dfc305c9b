"""Decks in C81 form: round trip, malformed files; the fit of a section to a deck."""

import runpy
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from vrsopt.aircraft import load_aircraft
from vrsopt.errors import InputError, NoSolutionError
from vrsopt.rotor import section_fit
from vrsopt.rotor.airfoil import Airfoil, load_section
from vrsopt.rotor.c81 import VALUES_PER_LINE, Deck, Table, read_c81
from vrsopt.rotor.section_fit import SectionFit, fit_section

REFERENCE = Path(__file__).resolve().parents[3] / "shared" / "reference" / "naca23012.npz"
NO_DECK = "naca23012.npz, the public HART II section deck, is missing: it is not redistributed with the package"
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


def write_c81(deck: Deck, path: Path) -> None:
    """A deck in fields of seven columns: values to four decimals, angles to two."""
    tables = [deck.lift, deck.drag, deck.moment]
    lines = [f"{deck.name:30s}" + "".join(f"{len(t.mach):2d}{len(t.angle_deg):2d}" for t in tables)]
    for table in tables:
        rows = [(" " * 7, table.mach), *zip([f"{a:7.2f}" for a in table.angle_deg], table.value, strict=True)]
        for first, values in rows:
            for k in range(0, len(values), VALUES_PER_LINE):
                part = values[k : k + VALUES_PER_LINE]
                lines.append((" " * 7 if k else first) + "".join(f"{value:7.4f}" for value in part))
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


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
        (tmp_path / name).write_text("\n".join(lines), encoding="utf-8")
        table = read_c81(tmp_path / name).lift
        assert table.mach.tolist() == [0.2, 0.4] and table.angle_deg.tolist() == [-5, 5]
        assert table.value.tolist() == [[-0.51, -0.55], [0.5, 0.6]]


def _changed(path: Path, line: int, text: str | None) -> Path:
    lines = path.read_text(encoding="utf-8").splitlines()
    lines = lines[: line - 1] if text is None else [*lines[: line - 1], text, *lines[line:]]
    path.write_text("\n".join(lines), encoding="utf-8")
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
    (tmp_path / "empty").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match="line 1 = ''"):
        read_c81(tmp_path / "empty")


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
    with pytest.raises(InputError, match="test: lift: 3 angles between -10 and 15 deg: at least 8"):
        fit_section(deck_of(SECTION, MACH, np.arange(-180.0, 181, 10)))


def _with(quantity: str, table: Table) -> Deck:
    return replace(DECK, **{quantity: table})


def _without(table: Table, low: float, high: float) -> Table:
    kept = (table.angle_deg < low) | (table.angle_deg > high)
    return Table(table.angle_deg[kept], table.mach, table.value[kept])


def _spoilt(table: Table, mach: int, value: float) -> Table:
    values = table.value.copy()
    values[:, mach] = value
    return replace(table, value=values)


@pytest.mark.parametrize(
    "deck, message",
    [
        (_with("lift", _without(DECK.lift, -2, 3)), "lift: 1 angles between -2 and 4 deg: at least 3"),
        (_with("drag", _without(DECK.drag, -3, 3)), "drag: 0 angles between -3 and 3 deg: at least 3"),
        (_with("moment", _without(DECK.moment, -4, 9)), "moment: 1 angles between -4 and 10 deg: at least 3"),
        (_with("lift", _spoilt(DECK.lift, 1, 0.0)), "lift: Mach 0.3: slope = .* per rad: at least 0.1"),
        (_with("lift", replace(DECK.lift, value=-DECK.lift.value)), "lift: Mach 0.2: slope = -.* per rad: at least"),
        (_with("drag", _spoilt(DECK.drag, 4, -0.01)), "drag: Mach 0.6: value = -0.01: must be positive"),
        (_with("moment", _spoilt(DECK.moment, 2, np.nan)), "moment: a value is not finite"),
    ],
)
def test_tables_that_can_not_carry_a_fit(deck, message):
    with pytest.raises(InputError, match="^made for a test: " + message) as caught:
        fit_section(deck)
    assert "\n" not in str(caught.value)


def test_a_fit_that_does_not_settle(monkeypatch):
    monkeypatch.setattr(section_fit, "EVALUATIONS", 3)
    monkeypatch.setattr(section_fit, "SETTLING", 3)
    with pytest.raises(NoSolutionError, match="^made for a test: lift: the fit does not settle in 3 eval"):
        fit_section(DECK)


def test_a_poor_fit_of_a_file_is_told(tmp_path, caplog):
    """A step in the attached lift is more than the section can follow."""
    good = deck_of(SECTION, np.array([0.3, 0.5]))
    step = 0.15 * ((ANGLES > 5) & (ANGLES < 9))[:, None]
    poor = replace(good, lift=replace(good.lift, value=good.lift.value + step))
    for name, deck in (("good", good), ("poor", poor)):
        write_c81(deck, tmp_path / name)
        Airfoil.from_c81(tmp_path / name)
        lines = [record.getMessage() for record in caplog.records]
        assert bool(lines) == (name == "poor"), lines
    assert "poor: lift of the fit misses the deck by 0." in lines[0] and "more than 0.05" in lines[0]


def test_what_the_script_prints_is_a_section_file(tmp_path, naca_0012):
    section, fit = naca_0012
    script = runpy.run_path(str(SCRIPT), run_name="fit_section")
    path = tmp_path / "section.toml"
    path.write_text(script["section_file"](section, replace(fit, name='a "quoted" \\ name\n')), encoding="utf-8")
    again = load_section(path)
    assert again.model_dump(exclude={"provenance"}) == section.model_dump(exclude={"provenance"})
    sources = {name: origin.source for name, origin in again.provenance.items()}
    assert sources["lift_slope"] == sources["moment_level"] == sources["critical_normal_force"] == "fit"
    assert sources["pressure_lag"] == sources["vortex_passage"] == "LB"


def test_the_script_tells_in_one_line_what_is_wrong(capsys):
    with pytest.raises(SystemExit) as caught:
        runpy.run_path(str(SCRIPT), run_name="fit_section")["main"]("missing.c81")
    assert caught.value.code == 2
    assert capsys.readouterr().err == "error: missing.c81: no such file\n"


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
@pytest.mark.skipif(not REFERENCE.is_file(), reason=NO_DECK)
def test_the_script_derives_the_shipped_section_from_the_deck():
    script = runpy.run_path(str(SCRIPT), run_name="fit_section")
    section = fit_section(script["load"](str(REFERENCE)))[0]
    for mach in MACH:
        shipped, again = (deck_of(s, np.array([mach]), np.linspace(-4, 10, 57)) for s in (SECTION, section))
        assert again.lift.value == pytest.approx(shipped.lift.value, abs=2e-3)
        assert again.drag.value == pytest.approx(shipped.drag.value, abs=3e-4)
        assert again.moment.value == pytest.approx(shipped.moment.value, abs=1e-3)
