"""The validation page is that of the shipped data."""

import re
from importlib import resources
from pathlib import Path

import pytest

from vrsopt.rotor.fidelity import Fidelity
from vrsopt.surrogate import store
from vrsopt.surrogate.database import Database

PAGE = (Path(__file__).parents[1] / "problems" / "validation.md").read_text()
DATA = resources.files("vrsopt") / "data"


def test_counts_are_those_of_the_shipped_design():
    found = re.search(r"(\d+) points, (\d+) flyable, (\d+) converged", PAGE)
    assert found
    with resources.as_file(DATA / "design.db") as path, Database.open(path) as database:
        status, outputs = database.status(), database.arrays(flyable=False)[1]
    counts = [len(status), status.count("ok"), int((outputs[:, 0] == outputs[:, 0]).sum())]
    assert [int(number) for number in found.groups()] == counts


def test_leave_one_out_is_that_of_the_shipped_surrogate():
    row = re.search(r"\| squared_exponential \| flyable \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|", PAGE)
    assert row
    with resources.as_file(DATA / "surrogate.nc") as path:
        accuracy = store.load(path).accuracy["fuel_flow"]
    assert float(row[1]) == pytest.approx(accuracy.pearson_percent, abs=2e-3)
    assert float(row[3]) == pytest.approx(accuracy.mean_abs_error_percent, abs=2e-3)


PARTS = (
    "## Rotor and trim",
    "Blade frequencies",
    "power against flight test",
    "Pitch attitude against flight test",
    "Section against the deck",
    "Dynamic stall of an oscillating NACA 0012",
    "Caradonna and Tung",
    "Harrington",
    "Ground effect",
    "where it goes",
    "## Convergence and derivatives",
    "Exact derivatives",
    "## Engine",
    "Free-turbine speed of least consumption",
    "Similarity",
    "Random points of the whole box",
    "## Emissions",
    "## Surrogate",
    "## Rescue mission",
)


def test_every_part_is_there_in_its_order():
    places = [PAGE.find(part) for part in PARTS]
    assert -1 not in places
    assert places == sorted(places)


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


def test_pitch_attitude_is_within_two_degrees_of_flight_test():
    errors = [abs(float(row[-1])) for row in rows("Pitch attitude against flight test")]
    assert len(errors) == 12 and max(errors) < 2.0


def test_power_balances_to_one_per_cent():
    rests = [float(row[-1].split()[0]) for row in rows("where it goes")]
    assert len(rests) >= 8 and max(map(abs, rests)) < 1.0


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
