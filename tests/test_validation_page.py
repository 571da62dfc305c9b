"""The validation page is that of the shipped data."""

import re
from importlib import resources
from pathlib import Path

import pytest

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


def test_every_part_is_there():
    for title in ("Rotor and trim", "Section against the deck", "Engine", "Surrogate", "Rescue mission"):
        assert title in PAGE
