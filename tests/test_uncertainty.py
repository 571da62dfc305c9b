"""The study of uncertainty: what it varies, the flights that stand for a mission, tornado and bands."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from vrsopt.aircraft import data_hash, load_aircraft
from vrsopt.helicopter import helicopter
from vrsopt.limits import Limits
from vrsopt.mission.file import read_mission
from vrsopt.quantity import Record
from vrsopt.turboshaft.data import load_engine

HERE = Path(__file__).parent
PROBLEMS = HERE.parent / "problems"
sys.path.insert(0, str(PROBLEMS))
try:
    import uncertainty
    import uncertainty_effects
    import uncertainty_flown
    import uncertainty_numbers
    import uncertainty_optimum
    import uncertainty_page
    import uncertainty_points
finally:
    sys.path.remove(str(PROBLEMS))

VARIED = uncertainty_numbers.numbers()
SHIPPED = uncertainty_numbers.Case.shipped()


def ranged(record, start=""):
    """Paths of all numbers of a record that have a range."""
    for name in type(record).model_fields:
        value = getattr(record, name)
        if name in record.provenance and record.provenance[name].range:
            yield start + name
        if isinstance(value, Record):
            yield from ranged(value, f"{start}{name}.")


def numbers_of(case):
    return data_hash(case.aircraft, case.engine), case.mass_factor


def test_every_number_with_a_range_is_varied_or_left_out_with_a_reason():
    aircraft = load_aircraft()
    known = {*ranged(aircraft), *ranged(load_engine(aircraft.engine), "engine.")}
    paths = {number.path for number in VARIED}
    assert len(paths) == len(VARIED) > 50
    for path in known - paths:
        assert any(path.startswith(start) for start in uncertainty_numbers.LEFT_OUT), path
    assert paths - known == set(uncertainty_numbers.OWN_RANGES)


@pytest.mark.parametrize("number", VARIED, ids=lambda number: number.path)
def test_both_ends_of_every_range_make_another_aircraft(number):
    assert number.low <= number.value <= number.high
    for end in number.ends:
        case = SHIPPED._with(number.path, end)
        assert (numbers_of(case) == numbers_of(SHIPPED)) == (end == number.value)


def test_ranges_are_those_of_the_files():
    numbers = {number.path: number for number in VARIED}
    drag = load_aircraft().main_rotor.provenance["section_drag_level"]
    assert numbers["main_rotor.section_drag_level"].ends == drag.range
    table = load_aircraft().blade_loading_limit
    low, high = table.provenance["thrust_over_solidity"].range
    number = numbers[uncertainty_numbers.LEVEL]
    assert number.low * min(table.thrust_over_solidity) == pytest.approx(low)
    assert number.high * max(table.thrust_over_solidity) == pytest.approx(high)


def test_a_changed_section_keeps_its_level_of_drag():
    section, level = SHIPPED.aircraft.main_rotor.section, 0.0088
    for name, change in uncertainty_numbers.SECTIONS.items():
        for factor in uncertainty_numbers.OWN_RANGES[f"section.{name}"]:
            changed = change(section, factor)
            assert float(changed.drag(0.0, 0.3, level)) == pytest.approx(level, abs=1e-5)
    grown = uncertainty_numbers.SECTIONS["drag_growth"](section, 1.5)
    assert grown.drag(0.12, 0.4, level) > section.drag(0.12, 0.4, level)
    later = uncertainty_numbers.SECTIONS["drag_rise_mach"](section, 1.03)
    assert later.drag(0.0, 0.75, level) < section.drag(0.0, 0.75, level)


def test_draws_are_a_latin_hypercube_inside_the_ranges_and_repeat():
    count = 20
    values = uncertainty.draws(VARIED, count, 3)
    assert values == uncertainty.draws(VARIED, count, 3)
    for number in VARIED:
        unit = np.array([row[number.path] - number.low for row in values]) / (number.high - number.low)
        assert sorted(np.floor(count * unit).astype(int)) == list(range(count))


def test_tornado_has_both_ends_of_every_number():
    jobs = uncertainty.tornado_jobs(VARIED)
    ends = sum(end != number.value for number in VARIED for end in number.ends)
    assert len(jobs) == ends == len({job.key for job in jobs})
    assert all(len(job.values) == 1 for job in jobs)


def test_few_flights_integrate_a_family_with_weights_that_are_not_negative():
    x = np.linspace(0.0, 1.0, 60)
    values = np.array([1.0 + x ** (k % 5) if k else np.ones(60) for k in range(len(uncertainty_points.FAMILY))])
    targets = [values @ (10.0 + np.arange(60.0)), values @ np.full(60, 5.0)]
    chosen = uncertainty_points.greedy(values, targets, 8)
    assert len(set(chosen)) == 8
    for target in targets:
        weights, error = uncertainty_points.fitted(values[:, chosen], target)
        assert np.all(weights >= 0.0)
        assert np.max(np.abs(error)) < 1e-4
        assert weights.sum() == pytest.approx(target[0], rel=1e-4)  # the first function is one: time


@pytest.fixture(scope="module")
def hop():
    return uncertainty_points.sampled(read_mission(HERE / "hop.toml"), "hop")


def test_few_flights_have_the_saving_of_a_mission(hop):
    few = uncertainty_points.represented([hop], 6)
    integrals = dict(zip(uncertainty_points.FAMILY, hop.target, strict=True))
    assert few.weights["hop"].sum() == pytest.approx(hop.weights.sum(), rel=0.01)
    assert few.error["hop"] < 2e-3
    nominal, least = (integrals[f"{what} fuel, mass x 1, margin 1.3"] for what in ("nominal", "least"))
    rows = [uncertainty_points.FAMILY.index(f"{what} fuel, mass x 1, margin 1.3") for what in ("nominal", "least")]
    chosen = [hop.flights.index(flight) for flight in few.flights]
    usual, best = hop.values[rows][:, chosen] @ few.weights["hop"]
    assert best / usual == pytest.approx(least / nominal, abs=1e-3)
    assert 1.0 < hop.carried < 1.01
    again = uncertainty_points.Representation.from_dict(json.loads(json.dumps(few.as_dict())))
    assert again.flights == few.flights


def test_a_mission_spread_over_its_time_keeps_it(hop):
    many = uncertainty_points.spread(hop, 10)
    assert many.weights["hop"].sum() == pytest.approx(hop.weights.sum())
    assert len(many.flights) == 10


@pytest.mark.parametrize(("mass", "speed", "active"), [(1850.0, 50.0, "blade loading"), (1990.0, 0.0, "tail rotor")])
def test_few_trims_find_the_optimum_of_the_whole_problem(optimiser, mass, speed, active):
    rotor = optimiser.machine.aircraft.main_rotor
    flight = {"mass": mass, "altitude": 30.0, "isa_offset": 0.0, "speed": speed, "climb_angle": 0.0, "load_factor": 1.0}
    flight |= {"rotor_speed": rotor.nominal_rotor_speed, "twist": rotor.twist}
    few, whole = optimiser.solve(flight, rotor.twist), optimiser.searched(flight)
    assert few.trims is not None
    assert few.active[0].startswith(active)
    assert few.least == pytest.approx(whole.least, rel=1e-5)
    assert few.rotor_speed == pytest.approx(whole.rotor_speed, abs=1e-5)
    assert few.nominal == pytest.approx(whole.nominal, rel=1e-7)


@pytest.fixture(scope="module")
def optimiser():
    machine = helicopter()
    return uncertainty_optimum.Optimiser(machine, Limits(machine.aircraft, machine.engine, manoeuvre_margin=1.3))


def test_outcome_of_a_row():
    few = uncertainty_points.Representation(
        [{}, {}], {"a": np.array([100.0, 300.0])}, {"a": (200.0, 0.0)}, {"a": 1.01}, {}
    )
    row = {"flights": [[0.05, 0.04, 0.8, 10.0, ["torque"]], [0.04, 0.03, 0.9, 12.0, []]], "idle": {"a": 0.02}}
    found = uncertainty_flown.outcome(row, few, "a")
    nominal = 5.0 + 12.0 + 4.0
    assert found.nominal == pytest.approx(nominal)
    assert found.saving == pytest.approx(100 * (1 - (1.01 * 13.0 + 4.0) / nominal))
    assert found.rotor_speed == pytest.approx(87.5)
    assert found.active == {"torque": 25.0}
    held = row | {"flights_held": [[0.05, 0.05, 1.0, 8.0, []], [0.04, 0.04, 1.0, 8.0, []]]}
    assert uncertainty_flown.outcome(held, few, "a", "flights_held").rotor_speed == 100.0


def test_a_row_belongs_to_what_its_job_changes():
    few = uncertainty_points.Representation([{}], {"a": np.array([1.0])}, {"a": (0.0, 0.0)}, {"a": 1.0}, {})
    job = uncertainty_flown.Job("sample 1", {"main_rotor.hub_above_skids": 3.0}, held=1.3)
    others = [
        uncertainty_flown.Job("sample 1", {"main_rotor.hub_above_skids": 3.1}, held=1.3),
        uncertainty_flown.Job("sample 1", job.values),
        uncertainty_flown.Job("sample 1", job.values, "installed", 1.3),
    ]
    marks = [uncertainty_flown.fingerprint(few, one) for one in (job, *others)]
    assert len(set(marks)) == 4 and marks[0] == uncertainty_flown.fingerprint(few, job)


def synthetic():
    """The result of a model whose saving is 10 + 2 a - b², a from -1 to 1, b from 0 to 2, shipped at 0."""

    def outcome(a, b):
        return {"m": {"saving": 10.0 + 2.0 * a - b**2, "rotor_speed": 80.0 - a}, "message": ""}

    numbers = [
        {"path": "b", "at": {"low": outcome(0.0, 0.0), "high": outcome(0.0, 2.0)}},
        {"path": "a", "at": {"low": outcome(-1.0, 0.0), "high": outcome(1.0, 0.0)}},
    ]
    return {"reference": {"m": outcome(0.0, 0.0)["m"]}, "numbers": numbers}


def test_tornado_of_a_known_model():
    b, a = uncertainty_effects.effects(synthetic(), "saving")
    assert (a.path, a.low["m"], a.high["m"], a.size) == ("a", -2.0, 2.0, 2.0)
    assert (b.path, b.low["m"], b.high["m"], b.size) == ("b", 0.0, -4.0, 4.0)
    assert uncertainty_effects.added([a, b], "m") == pytest.approx(np.sqrt(16 / 12 + 16 / 12))
    assert uncertainty_effects.effects(synthetic(), "rotor_speed")[0].path == "a"


def test_shares_of_the_variance_add_up():
    found = uncertainty_effects.effects(synthetic(), "saving")
    shares = uncertainty_effects.shares(found, "m")
    assert sum(shares.values()) == pytest.approx(1.0)
    assert shares["other parts of rotors and airframe"] == pytest.approx(1.0)


def test_band():
    assert uncertainty.band(np.arange(101.0)) == [5.0, 50.0, 95.0]


def test_samples_without_a_solution_are_named_and_not_counted():
    few = uncertainty_points.Representation([{}], {"a": np.array([100.0])}, {"a": (0.0, 0.0)}, {"a": 1.0}, {})
    rows = [
        {"key": f"sample {k}", "message": "", "constants": [k], "idle": {"a": 0.0}}
        | {"flights": [[0.05, 0.05 - 0.001 * k, 0.8, 10.0, []]], "flights_held": [[0.05, 0.04, 0.9, 10.0, []]]}
        for k in range(3)
    ]
    rows.append({"key": "sample 3", "message": "no trim"})
    found = uncertainty.spread_of(rows, few)
    assert found["samples"]["values"]["saving"]["a"] == pytest.approx([0.0, 2.0, 4.0])
    assert found["samples"]["bands"]["saving"]["a"][1] == pytest.approx(2.0)
    assert found["margin_held"]["values"]["rotor_speed"]["a"] == pytest.approx([90.0] * 3)
    assert found["unsolved"] == [{"key": "sample 3", "message": "no trim"}]
    assert found["constants"] == [[0], [1], [2]]


def test_the_page_says_what_the_result_file_says():
    content = json.loads((PROBLEMS / "uncertainty.json").read_text(encoding="utf-8"))
    page = (PROBLEMS / "uncertainty.md").read_text(encoding="utf-8")
    found = {quantity: uncertainty_effects.effects(content, quantity) for quantity in ("saving", "rotor_speed")}
    for part in (uncertainty_page.answer(content), uncertainty_page.tornado(content, found)):
        assert "\n".join(part) in page
    assert {one["path"] for one in content["numbers"]} == {number.path for number in VARIED}
    for name, band in content["samples"]["bands"]["saving"].items():
        assert band == uncertainty.band(np.array(content["samples"]["values"]["saving"][name]))


def test_headline_of_the_readme_is_that_of_the_study():
    content = json.loads((PROBLEMS / "uncertainty.json").read_text(encoding="utf-8"))
    text = " ".join((HERE.parent / "README.md").read_text(encoding="utf-8").split())
    first, second, third = (content["schedules"][name]["trajectory"] for name in ("sarm", "lem", "patm"))
    assert f"**{first:.1f} %** less fuel" in text and f"{second:.1f} % less on a police flight" in text
    assert f"and {third:.1f} % less on an air taxi" in text
    bands = [uncertainty_page.shifted(content, "samples", name) for name in ("sarm", "lem", "patm")]
    told = [f"{low:.1f} to {high:.1f} %" for low, _, high in bands]
    count = len(content["samples"]["values"]["saving"]["sarm"])
    assert f"90 % of {count} samples lie within {told[0]}, {told[1]} and {told[2]}" in text
