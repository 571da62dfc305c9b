"""The species fitted to one temperature range against the polynomials they come from."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

import vrsopt

cantera = pytest.importorskip("cantera")

FILE = Path(vrsopt.__file__).parent / "data" / "combustion_species.toml"
GAS_CONSTANT = 8.314462618  # J/(mol K)


@pytest.fixture(scope="module")
def species() -> dict[str, dict]:
    return tomllib.loads(FILE.read_text(encoding="utf-8"))["species"]


@pytest.fixture(scope="module")
def source():
    gas = cantera.Solution("gri30.yaml")
    return {"Ar" if name == "AR" else name: gas.species(name) for name in gas.species_names}


def heat_capacity(entry: dict, temperature: np.ndarray) -> np.ndarray:
    """cp/R at temperatures [K]."""
    return sum(a * (temperature / 1e3) ** k for k, a in enumerate(entry["coefficients"], start=-2))


def integrated(values: np.ndarray, temperature: np.ndarray) -> np.ndarray:
    """Running integral over temperature, corrected to fourth order (its error is far below the tolerance)."""
    step = np.diff(temperature)
    slope = np.gradient(values, temperature, edge_order=2)
    pieces = step * (values[1:] + values[:-1]) / 2 + step**2 * (slope[:-1] - slope[1:]) / 12
    return np.concatenate([[0.0], np.cumsum(pieces)])


def test_every_species_within_ten_joule_per_mole(species, source):
    temperature = np.linspace(298.15, 3000.0, 5000)
    for name, entry in species.items():
        thermo = source[name].thermo
        ratio = heat_capacity(entry, temperature)
        h = entry["h298"] + GAS_CONSTANT * integrated(ratio, temperature)
        s = entry["s298"] + GAS_CONSTANT * integrated(ratio / temperature, temperature)
        h_source = np.array([thermo.h(T) for T in temperature]) / 1e3
        s_source = np.array([thermo.s(T) for T in temperature]) / 1e3
        h_error = np.abs(h - h_source).max()
        g_error = np.abs((h - h_source) / temperature - (s - s_source)).max() / GAS_CONSTANT
        assert h_error < 10.0, name
        assert g_error < 3e-4, name
        assert h_error <= 1.05 * entry["enthalpy_error"] + 0.1, f"{name}: the file claims less"
        assert g_error <= 1.05 * entry["gibbs_error"] + 1e-6, f"{name}: the file claims less"


def test_composition_and_reference_state_are_the_sources(species, source):
    for name, entry in species.items():
        thermo = source[name].thermo
        composition = {"Ar" if element == "AR" else element: n for element, n in source[name].composition.items()}
        assert entry["composition"] == composition
        assert entry["h298"] == pytest.approx(thermo.h(298.15) / 1e3, abs=0.5e-3)
        assert entry["s298"] == pytest.approx(thermo.s(298.15) / 1e3, rel=1e-8)


def test_heat_capacity_is_positive_and_rises_towards_its_limit(species):
    """A fit of seven terms must not swing where a Newton solver may go, 298 to 3000 K."""
    temperature = np.linspace(298.15, 3000.0, 500)
    for name, entry in species.items():
        ratio = heat_capacity(entry, temperature)
        assert ratio.min() >= 2.49, name
        assert np.abs(np.diff(ratio)).max() < 0.06, name
