"""Aircraft data: what the shipped file says, and what a wrong file is told in one line."""

import tomllib
from math import radians
from typing import Any

import numpy as np
import pytest

from vrsopt.aircraft import DATA, Aircraft, data_hash, data_path, load_aircraft
from vrsopt.errors import InputError

SHIPPED = (DATA / "bo105.toml").read_text()
CONTENT = tomllib.loads(SHIPPED)


def changed(tmp_path, old: str, new: str) -> Aircraft:
    """The aircraft of the shipped file with one text replaced."""
    assert SHIPPED.count(old) == 1, old
    path = tmp_path / "machine.toml"
    path.write_text(SHIPPED.replace(old, new))
    return load_aircraft(path)


def numbers(content: dict[str, Any], path: str = "") -> list[tuple[str, dict[str, Any]]]:
    """Every { value, unit, source } table with its dotted path; a number outside of one is an error."""
    found = []
    for name, entry in content.items():
        where = f"{path}.{name}" if path else name
        if isinstance(entry, dict) and "value" in entry:
            found.append((where, entry))
        elif isinstance(entry, dict):
            found += numbers(entry, where)
        else:
            assert isinstance(entry, str), f"{where}: a number without unit and source"
    return found


NUMBERS = numbers({name: table for name, table in CONTENT.items() if name != "sources"})


def test_loads_with_the_published_numbers():
    aircraft = load_aircraft("bo105")
    rotor = aircraft.main_rotor
    assert (rotor.blades, rotor.radius, rotor.chord, rotor.nominal_rotor_speed) == (4, 4.91, 0.27, 44.4)
    assert rotor.solidity == pytest.approx(0.0700, abs=1e-4)
    assert rotor.blade_area == pytest.approx(5.303, abs=1e-3)
    assert rotor.polar_inertia == pytest.approx(4 * 231.7 * 1.05)
    assert aircraft.tail_rotor.blade_area == pytest.approx(0.342)
    assert aircraft.tail_rotor.speed_ratio * 44.4 * 60 / 6.283185307 == pytest.approx(2219, rel=2e-3)  # rpm
    # Lock number with a slope of 6.0 /rad: about five
    assert 1.225 * 6.0 * rotor.chord * rotor.radius**4 / rotor.flap_inertia == pytest.approx(5.0, abs=0.1)


def test_built_in_twist_changes_sign_once():
    """Nose-down to the tip is negative in the file and positive washout in Python."""
    assert CONTENT["main_rotor"]["built_in_twist"]["value"] == -8.0
    assert load_aircraft("bo105").main_rotor.twist == pytest.approx(+0.139626, abs=1e-6)


def test_every_number_has_a_unit_and_a_known_source():
    known = {*CONTENT["sources"], "fixed"}
    for where, entry in NUMBERS:
        assert entry["unit"], where
        for source in entry["source"].split(";"):
            words = {*source.replace(",", " ").split()}
            assert words & known, f"{where}: source {entry['source']!r}"


def test_assumed_and_solved_numbers_carry_a_range():
    """Exceptions: the abscissa of the blade-loading table, and the named variant."""
    without = {
        where
        for where, entry in NUMBERS
        if entry["source"] in ("assumed", "solved") and "range" not in entry and not where.startswith("variants.")
    }
    assert without == {"blade_loading_limit.advance_ratio"}
    for where, entry in NUMBERS:
        if "range" in entry:
            low, high = entry["range"]
            values = entry["value"] if isinstance(entry["value"], list) else [entry["value"]]
            assert low < high and low <= min(values) and max(values) <= high, where


def test_provenance_is_kept():
    origin = load_aircraft("bo105").main_rotor.provenance["section_drag_level"]
    assert (origin.unit, origin.source, origin.range) == ("-", "assumed", (0.0075, 0.0102))


@pytest.mark.parametrize(
    "old, new, words",
    [
        ('radius = { value = 4.91, unit = "m", source = "PAD" }\n', "", ["main_rotor.radius", "missing"]),
        (
            "[loading]\n",
            '[loading]\npaint = { value = 1, unit = "kg", source = "RFM" }\n',
            ["loading.paint", "unknown"],
        ),
        (
            'radius = { value = 4.91, unit = "m"',
            'radius = { value = 49.1, unit = "m"',
            ["main_rotor.radius", "49.1", "less than 20"],
        ),
        (
            'radius = { value = 4.91, unit = "m"',
            'radius = { value = 4.91, unit = "ft"',
            ["main_rotor", "radius", "'ft'", "'m'"],
        ),
        ('radius = { value = 4.91, unit = "m", source = "PAD" }', "radius = 4.91", ["main_rotor", "radius", "source"]),
        (
            'radius = { value = 4.91, unit = "m", source = "PAD" }',
            'radius = { value = 4.91, unit = "m" }',
            ["main_rotor", "radius", "source", "missing"],
        ),
        (
            'radius = { value = 4.91, unit = "m"',
            'radius = { value = nan, unit = "m"',
            ["main_rotor.radius"],
        ),
        (
            'radius = { value = 4.91, unit = "m"',
            'radius = { value = "long", unit = "m"',
            ["main_rotor.radius", "long"],
        ),
        (
            "efficiency = { value = 0.975",
            "efficiency = { value = 0.95",
            ["transmission", "efficiency", "0.95", "[0.965, 0.985]"],
        ),
        (
            "station = { value = [0.37, 0.9, 1.1, 4.91]",
            "station = { value = [0.37, 1.1, 0.9, 4.91]",
            ["main_rotor.blade", "station", "must increase"],
        ),
        (
            "station = { value = [0.37, 0.9, 1.1, 4.91]",
            "station = { value = [0.37, 0.9, 1.1, 4.8]",
            ["main_rotor", "blade.station = [0.37, 0.9, 1.1, 4.8]", "must end at the radius, 4.91 m"],
        ),
        (
            "station = { value = [0.37, 0.9, 1.1, 4.91]",
            "station = { value = [1.09, 1.2, 1.3, 4.91]",
            ["main_rotor", "blade.station = [1.09, 1.2, 1.3, 4.91]", "inboard of root_cutout, 1.0802 m"],
        ),
        (
            "flap_inertia = { value = 231.7",
            "flap_inertia = { value = 250.0",
            ["main_rotor.flap_inertia = 250", "within 10 % of 226.2 kg m2"],
        ),
        (
            "mass_per_length = { value = [6.901, 6.901, 5.726, 5.726]",
            "mass_per_length = { value = [6.901, 6.901, 5.726]",
            ["main_rotor.blade", "mass_per_length", "3 values"],
        ),
        (
            "fuel_capacity = { value = 456.0",
            "fuel_capacity = { value = 450.0",
            ["loading", "fuel_capacity", "450", "456 kg"],
        ),
        (
            "foremost = { value = [3.081, 3.081",
            "foremost = { value = [3.481, 3.081",
            ["loading.cg_limits", "foremost", "3.481 at 1140 kg", "less than aftmost"],
        ),
        (
            "angle = { value = [-180, -160, -90, -30, 0, 20, 90, 160, 180]",
            "angle = { value = [-170, -160, -90, -30, 0, 20, 90, 160, 180]",
            ["fuselage.far_x", "angle", "-170 to 180", "must cover"],
        ),
        ("[loading]", "[loading", ["not a TOML file"]),
    ],
    ids=[
        "missing",
        "unknown",
        "out of range",
        "unit",
        "bare number",
        "no source",
        "nan",
        "text",
        "own range",
        "stations",
        "blade that does not end at the tip",
        "blade that begins outboard of the cut-out",
        "two inertias",
        "lengths",
        "tanks",
        "limits of the centre of gravity",
        "part of the circle",
        "syntax",
    ],
)
def test_a_wrong_file_is_told_in_one_line(tmp_path, old, new, words):
    with pytest.raises(InputError) as caught:
        changed(tmp_path, old, new)
    message = str(caught.value)
    assert "\n" not in message
    assert "machine.toml" in message
    for word in words:
        assert word in message, message


def test_no_such_aircraft(tmp_path):
    for path in ("no_such_machine", tmp_path):
        with pytest.raises(InputError) as caught:
            load_aircraft(path)
        assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_shipped_name_and_own_path(tmp_path):
    assert data_path("bo105") == DATA / "bo105.toml"
    assert data_path(tmp_path / "a.toml") == tmp_path / "a.toml"


def test_hash_follows_numbers_and_not_notes(tmp_path):
    base = data_hash(load_aircraft("bo105"))
    note = changed(tmp_path, 'note = "usable"', 'note = "all tanks"')
    (tmp_path / "other").mkdir()
    number = changed(tmp_path / "other", "pilot_mass = { value = 80.0", "pilot_mass = { value = 81.0")
    assert data_hash(note) == base
    assert data_hash(number) != base
    assert data_hash(load_aircraft("bo105").variant("section_drag_level")) != base


def test_replaced_is_validated_and_loses_the_range():
    rotor = load_aircraft("bo105").main_rotor
    other = rotor.replaced(section_drag_level=0.0132)
    assert other.section_drag_level == 0.0132 and rotor.section_drag_level == 0.0088
    assert other.provenance["section_drag_level"].range is None
    with pytest.raises(InputError, match="section_drag_level"):
        rotor.replaced(section_drag_level=0.5)
    with pytest.raises(InputError, match="colour"):
        rotor.replaced(colour=1.0)


def test_variant_is_the_other_split():
    aircraft = load_aircraft("bo105")
    other = aircraft.variant("section_drag_level")
    assert other.main_rotor.induced_power_factor == 1.0
    assert other.main_rotor.section_drag_level == aircraft.variants["section_drag_level"].section_drag_level
    with pytest.raises(InputError, match="section_drag_level"):
        aircraft.variant("none such")


def test_equal_aircraft_share_their_hash(tmp_path):
    again = changed(tmp_path, 'name = "Bo 105"', 'name = "Bo 105" # the same')
    aircraft = load_aircraft("bo105")
    assert hash(again) == hash(aircraft) and again == aircraft


def test_inertia_is_that_of_a_body():
    """Padfield's values; a positive product, nose low and tail high, is a negative element of the tensor."""
    inertia = load_aircraft("bo105").loading.inertia
    assert (inertia.roll, inertia.pitch, inertia.yaw, inertia.product) == (1433.0, 4973.0, 4099.0, 660.0)
    tensor = np.array(inertia.matrix)
    assert tensor[0, 2] == tensor[2, 0] == -660.0
    principal = np.linalg.eigvalsh(tensor)
    assert principal[0] > 0 and principal[2] < principal[0] + principal[1]


def test_drive_train_power():
    drive = load_aircraft("bo105").transmission
    assert drive.power_per_engine(0.975 * 506e3) == pytest.approx(257e3)


def test_degrees_in_the_file_are_those_of_the_sources():
    rotor = load_aircraft("bo105").main_rotor
    assert radians(rotor.shaft_tilt_forward) == pytest.approx(0.05236, abs=1e-5)
    assert rotor.precone == 2.5
