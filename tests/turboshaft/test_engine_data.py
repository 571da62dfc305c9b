"""The engine's data file: what is in it, and what a broken one says."""

from importlib import resources

import pytest

from vrsopt.errors import InputError
from vrsopt.quantity import Record
from vrsopt.turboshaft.data import load_engine

TEXT = (resources.files("vrsopt") / "data" / "allison_250_c20b.toml").read_text(encoding="utf-8")
EFFICIENCY = 'efficiency = { value = 0.775, unit = "-", source = "TYPICAL", range = [0.75, 0.80] }'


def test_design_point_and_ratings_are_the_sourced_ones():
    engine = load_engine()
    point = engine.design_point
    assert (point.power, point.sfc, point.air_flow, point.pressure_ratio) == (313000.0, 0.395, 1.56, 7.1)
    assert engine.ratings.take_off_power == 313000.0
    assert engine.ratings.idle_power_ratio == 0.07


@pytest.mark.parametrize("name", ["allison_250_c20b", "generic_500kw"])
def test_every_number_names_a_source_of_the_file_and_assumed_ones_a_range(name):
    engine = load_engine(name)
    known = [engine, *(engine.variant(variant) for variant in engine.variants)]
    origins = [origin for data in known for origin in origins_of(data)]
    assert len(origins) > 50
    assumed = {key for key, text in engine.sources.items() if "assumed" in text or "recalled" in text}
    assert {"MAP", "TYPICAL"} <= assumed
    for origin in origins:
        assert origin.source in engine.sources
        assert origin.range is not None or origin.source not in assumed
    assert {origin.source for origin in origins} == set(engine.sources)


def origins_of(record):
    """Provenance of every number of a record and of the records in it."""
    yield from record.provenance.values()
    for value in vars(record).values():
        for part in value.values() if isinstance(value, dict) else (value,):
            if isinstance(part, Record):
                yield from origins_of(part)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (EFFICIENCY, "", r"engine\.toml: compressor\.efficiency: missing"),
        ("value = 0.775", "value = 1.2", r"engine\.toml: compressor.*efficiency"),
        ("value = 0.775", "value = 0.70", r"engine\.toml: compressor: efficiency: 0.7: outside its own range"),
        ('value = 313000.0, unit = "W"', 'value = 420.0, unit = "hp"', r"power: unit 'hp': expected 'W'"),
        ("[exhaust]", "[chimney]", r"engine\.toml: (exhaust: missing|chimney: unknown key)"),
        (EFFICIENCY, EFFICIENCY + "\nstages = 7", r"engine\.toml: compressor\.stages: unknown key"),
        ("slope.compressor]", "slope.propeller]", r"engine\.toml: .*unknown component 'propeller'"),
        ("[intake]", "intake]", r"engine\.toml: not a TOML file"),
    ],
)
def test_a_broken_file_is_one_line_that_names_the_field(tmp_path, old, new, message):
    path = tmp_path / "engine.toml"
    assert old in TEXT
    path.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=message) as caught:
        load_engine(path)
    assert "\n" not in str(caught.value)


def test_a_file_elsewhere_is_the_same_engine(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(TEXT, encoding="utf-8")
    assert load_engine(path) == load_engine()


@pytest.mark.parametrize("name", ["pt6", "missing.toml", "bo105"])
def test_an_unknown_engine_is_an_input_error(name):
    with pytest.raises(InputError, match=name):
        load_engine(name)


def test_variants_and_changes():
    engine = load_engine()
    slope = engine.variant("flight_manual_slope")
    assert slope.compressor.efficiency_slope > 2 and engine.compressor.efficiency_slope == 0.30
    assert slope.compressor.provenance["efficiency_slope"].source == "SOLVED"
    assert slope.compressor.efficiency == engine.compressor.efficiency
    with pytest.raises(InputError, match="variant = 'hot': expected one of: .*flight_manual_slope"):
        engine.variant("hot")
    with pytest.raises(InputError, match="unknown component 'propeller'"):
        engine.changed("propeller", efficiency=0.8)
    with pytest.raises(InputError, match="unknown field 'stages'"):
        engine.changed("compressor", stages=7.0)
